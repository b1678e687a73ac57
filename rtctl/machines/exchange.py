"""Exchange format 1 of a kind of machine: symbols, columns, laws, and the config made of a case.

Each machine declares one `Exchange` (ivu_exchange.py, ldu_exchange.py, axis_exchange.py) in its profile.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from rtctl.idiom import Settings

NOTHING: Mapping[str, Any] = MappingProxyType({})
DAMPING = 0.5**0.5  # damping ratio of a drive, if none is given
DIRECT = 20e3  # Hz, bandwidth of a drive, if none is given
Numbers = dict[str, float]
Changes = tuple[dict[str, Any], list[str]]  # keys of a config, and a sentence on each value that it cannot hold


class Scale(NamedTuple):
    """Counts of a column in a case."""

    key: str  # key of `sensors`
    per_turn: bool = True  # counts a turn; False: metres a count
    optional: bool = False  # whether a recording may lack the column


class Exchange(NamedTuple):
    """Exchange format 1 of a kind of machine."""

    parameters: type[Settings]  # by symbol
    terms: tuple[str, ...]  # symbols of effects: absent means 0
    believed: Callable[[Mapping[str, float], Any], Numbers]  # given symbols, drive -> nominal value of every symbol, SI
    symbols: Callable[[Any], Numbers]  # settings of a config's plant -> symbols
    carried: Callable[[Mapping[str, float], Numbers, Any], Changes]  # fitted model, nominal values, case -> changes
    derived: tuple[str, ...] = ()  # symbols that follow from others; used where they are given
    aliases: Mapping[str, str] = NOTHING  # other name -> symbol
    silent: tuple[str, ...] = ()  # symbols whose absence from the case gives no warning
    exact: tuple[str, ...] = ()  # symbols with exact nominal values
    scales: Mapping[str, Scale] = NOTHING  # column of a counter -> its counts in the case
    gains: int = 0  # number of values in drive.amp_per_volt; 0: none is required
    delay: float | None = None  # samples, if the case gives none; None: 1, with a warning
    radius: str = ""  # symbol, m, that takes the main sensor's angle to the reference; "" where they have one unit
    settings: Callable[[Mapping[str, float]], Numbers] = dict  # symbols -> parameters of a config's plant
    stand_in: Callable[[Mapping[str, float], float], tuple[dict[str, Any], float]] | None = None
    # model and tick in s -> `law.position` of a slow loop that replaces an unknown law, and its bandwidth in Hz


def lines(counts: float | None, what: str, path: str, left: list[str]) -> dict[str, Any]:
    """Settings of an encoder with `counts` a turn, at the path of a config: x4 counting, or x1."""
    if counts is None:
        return {}
    whole = round(counts)
    if whole != counts:
        left.append(f"{what}, {counts:g} counts a turn: {whole} are taken")
    return {path: {"lines": whole // 4} if whole % 4 == 0 else {"lines": whole, "multiply": 1}}


def digits(value: float) -> float:
    """Value rounded to six significant digits."""
    return float(f"{value:.6g}")


def numbers(parameters: Settings) -> Numbers:
    """Values of all parameters by name."""
    return {name: float(value) for name, value in parameters.model_dump().items()}
