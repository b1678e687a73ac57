"""Row: comparison of a number of the thesis with the number measured on the emulated machines.

    Part            rows and figures from common runs
    part.play(short) -> {name: measured}          computed, in the unit of the row

The thesis side of a row (number, source, quote, tolerance) is typed in. The measured number is always computed. Law,
parameter set and filter name the conditions of the computation.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, Literal, NamedTuple

from rtctl.config.errors import NoAnswer

Bound = Literal["within", "at least", "at most"]
Verdict = Literal["pass", "chosen", "erratum", "differs", "fail"]
NONE = "none"  # law, parameter set or filter of an algebraic row


class Row(NamedTuple):
    """Number of the thesis and, once measured, the number of the emulated machine."""

    name: str
    quantity: str  # name of the quantity
    source: str  # section of the quote in the thesis, then equation or figure
    thesis: float | None  # printed number; None for a claim without a number
    unit: str
    tolerance: float = 0.0  # relative where `relative`, else in the unit of the number
    relative: bool = True
    bound: Bound = "within"
    quote: str = ""  # verbatim words of the thesis with the number or the claim
    law: str = ""  # controller that was run or computed
    set: str = ""  # parameters of the plant, with each substitution
    filter: str = ""  # on the derivative or the velocity
    erratum: str = ""  # error in the thesis; "" without one
    differs: str = ""  # reason why the emulated machine misses the tolerance; "" within it
    chosen: str = ""  # inputs missing in the thesis, chosen to pass
    expected: float | None = None  # number for the comparison where it is not the printed number: the result of the
    #                                equations behind an erratum, or the number of a claim
    remark: str = ""  # reason for a wide tolerance, or other choices
    measured: float = math.nan
    refused: str = ""  # reason for a missing measurement

    @property
    def chapter(self) -> int:
        """Chapter of the thesis, from the name."""
        return int(self.name.partition(".")[0])

    @property
    def against(self) -> float:
        """Number for the comparison with the measured number."""
        value = self.thesis if self.expected is None else self.expected
        assert value is not None, self.name
        return value

    @property
    def margin(self) -> float:
        """Tolerance in the unit of the row."""
        return self.tolerance * abs(self.against) if self.relative else self.tolerance

    @property
    def passes(self) -> bool:
        """Whether the measured number is within the tolerance of `against`; nan never is."""
        off = self.measured - self.against
        if self.bound == "at least":
            return bool(off >= -self.margin)
        if self.bound == "at most":
            return bool(off <= self.margin)
        return bool(abs(off) <= self.margin)

    @property
    def verdict(self) -> Verdict:
        """Verdict: pass; chosen, erratum or differs where the row declares it; fail where that does not hold."""
        if not math.isfinite(self.measured) or self.passes == bool(self.differs):
            return "fail"
        return "differs" if self.differs else "erratum" if self.erratum else "chosen" if self.chosen else "pass"

    def as_json(self) -> dict[str, Any]:
        """Row as a JSON object. `pass` is |measured - against| <= tolerance, one-sided where `bound` is set."""
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
    """Rows with the law, parameter set and filter of their group where a row has none."""
    return tuple(r._replace(law=r.law or law, set=r.set or set, filter=r.filter or filter) for r in rows)


class Picture(NamedTuple):
    """Figure of the thesis, drawn from data of the emulated machines."""

    number: str  # 8.3
    sentence: str
    figure: Any  # matplotlib Figure


class Part(NamedTuple):
    """Rows and figures from common runs; `short` makes the runs shorter."""

    title: str
    rows: tuple[Row, ...]
    play: Callable[[bool], Mapping[str, float]]
    figures: Mapping[str, Callable[[bool], Picture]] = {}

    @property
    def chapter(self) -> int:
        """Chapter of the rows."""
        return self.rows[0].chapter


def measured(part: Part, short: bool) -> list[Row]:
    """Rows of a part with measured numbers. Rows of a failed experiment hold the reason and fail."""
    try:
        values = part.play(short)
    except NoAnswer as error:
        return [row._replace(refused=str(error)) for row in part.rows]
    return [row._replace(measured=float(values[row.name])) for row in part.rows]
