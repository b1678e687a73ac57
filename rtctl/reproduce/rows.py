"""A row: one number of the thesis beside the number that our own machines give, and whether they agree.

    Part            rows and figures that come out of the same runs
    part.play(short) -> {name: measured}          computed, in the unit of the row

What a row says of the thesis (number, source, quote, tolerance) is typed in; what is measured is always computed. Law,
parameter set and filter say what it was computed with.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, Literal, NamedTuple

from rtctl.config.errors import NoAnswer

Bound = Literal["within", "at least", "at most"]
Verdict = Literal["pass", "chosen", "erratum", "differs", "fail"]
NONE = "none"  # law, parameter set or filter of a row that is algebra


class Row(NamedTuple):
    """A number of the thesis, and once it is measured the number beside it."""

    name: str
    quantity: str  # what it is, in words
    source: str  # section of the thesis where the quote stands, then equation or figure
    thesis: float | None  # as it is printed; None where the text makes a claim without a number
    unit: str
    tolerance: float = 0.0  # share of the number where `relative`, else in its unit
    relative: bool = True
    bound: Bound = "within"
    quote: str = ""  # words of the thesis with the number or the claim, to the letter
    law: str = ""  # controller that was played or computed
    set: str = ""  # parameters of the plant, with each substitution
    filter: str = ""  # on the derivative or the velocity
    erratum: str = ""  # what is wrong in the thesis; "" where nothing is
    differs: str = ""  # why the emulated machine misses the tolerance; "" where it keeps it
    chosen: str = ""  # inputs that are not of the thesis and were chosen so that the row passes
    expected: float | None = None  # what the measured one is held against where that is not what is printed: the number
    #                                of the equations behind an erratum, or of a claim
    remark: str = ""  # why the tolerance is wide, or what else was chosen here
    measured: float = math.nan
    refused: str = ""  # why nothing was measured

    @property
    def chapter(self) -> int:
        """Chapter of the thesis, from the name."""
        return int(self.name.partition(".")[0])

    @property
    def against(self) -> float:
        """Number that the measured one is held against."""
        value = self.thesis if self.expected is None else self.expected
        assert value is not None, self.name
        return value

    @property
    def margin(self) -> float:
        """Tolerance in the unit of the row."""
        return self.tolerance * abs(self.against) if self.relative else self.tolerance

    @property
    def passes(self) -> bool:
        """Whether the measured number is within the tolerance of the number it is held against; nan never is."""
        off = self.measured - self.against
        if self.bound == "at least":
            return bool(off >= -self.margin)
        if self.bound == "at most":
            return bool(off <= self.margin)
        return bool(abs(off) <= self.margin)

    @property
    def verdict(self) -> Verdict:
        """pass; chosen, erratum or differs where the row says so; fail where it does not do what it says."""
        if not math.isfinite(self.measured) or self.passes == bool(self.differs):
            return "fail"
        return "differs" if self.differs else "erratum" if self.erratum else "chosen" if self.chosen else "pass"

    def as_json(self) -> dict[str, Any]:
        """The row for a program. `pass` is |measured - against| <= tolerance, one-sided where `bound` says so."""
        return {
            "name": self.name,
            "quantity": self.quantity,
            "source": self.source,
            "unit": self.unit,
            "thesis": self.thesis,
            "measured": self.measured if math.isfinite(self.measured) else None,
            "tolerance": self.margin,
            "bound": self.bound,
            "pass": self.passes,
            "verdict": self.verdict,
            "law": self.law,
            "set": self.set,
            "filter": self.filter,
            "quote": self.quote,
            "erratum": self.erratum or None,
            "differs": self.differs or None,
            "chosen": self.chosen or None,
            "against": self.against,
            "remark": self.refused or self.remark,
        }


def under(*rows: Row, law: str = NONE, set: str = NONE, filter: str = NONE) -> tuple[Row, ...]:
    """Rows with the law, parameter set and filter of their group, where a row does not name its own."""
    return tuple(r._replace(law=r.law or law, set=r.set or set, filter=r.filter or filter) for r in rows)


class Picture(NamedTuple):
    """A figure of the thesis drawn from our own data."""

    number: str  # 8.3
    sentence: str
    figure: Any  # matplotlib Figure


class Part(NamedTuple):
    """Rows and figures that come out of the same runs; `short` makes the runs shorter."""

    title: str
    rows: tuple[Row, ...]
    play: Callable[[bool], Mapping[str, float]]
    figures: Mapping[str, Callable[[bool], Picture]] = {}

    @property
    def chapter(self) -> int:
        """Chapter of its rows."""
        return self.rows[0].chapter


def measured(part: Part, short: bool) -> list[Row]:
    """The rows of a part with their measured numbers. Where an experiment gives no answer they say why and fail."""
    try:
        values = part.play(short)
    except NoAnswer as error:
        return [row._replace(refused=str(error)) for row in part.rows]
    return [row._replace(measured=float(values[row.name])) for row in part.rows]
