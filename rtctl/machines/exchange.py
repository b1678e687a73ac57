"""What exchange format 1 says of a kind of machine: symbols, columns, laws, and its config made of a case.

Each machine declares one `Exchange` (ivu_exchange.py, ldu_exchange.py, axis_exchange.py) in its profile.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from rtctl.idiom import Settings

NOTHING: Mapping[str, Any] = MappingProxyType({})
DAMPING = 0.5**0.5  # of a drive of which the owner says nothing
DIRECT = 20e3  # Hz, bandwidth of the same
Numbers = dict[str, float]
Changes = tuple[dict[str, Any], list[str]]  # keys of a config, and a sentence on each thing that it has no place for


class Scale(NamedTuple):
    """How a case says the counts of a column."""

    key: str  # of `sensors`
    per_turn: bool = True  # counts a turn; False: metres a count
    optional: bool = False  # whether a recording may lack the column


class Exchange(NamedTuple):
    """What exchange format 1 says of a kind of machine."""

    parameters: type[Settings]  # by symbol
    terms: tuple[str, ...]  # symbols of effects: absent means 0
    believed: Callable[[Mapping[str, float], Any], Numbers]  # symbols that are given, drive -> every symbol, SI
    symbols: Callable[[Any], Numbers]  # settings of a config's plant -> symbols
    carried: Callable[[Mapping[str, float], Numbers, Any], Changes]  # model, symbols as believed, case
    derived: tuple[str, ...] = ()  # symbols that follow from others; taken where they are given
    aliases: Mapping[str, str] = NOTHING  # other name -> symbol
    silent: tuple[str, ...] = ()  # symbols that nobody is warned about where the case does not say them
    exact: tuple[str, ...] = ()  # symbols that the owner knows without error
    scales: Mapping[str, Scale] = NOTHING  # column of a counter -> how the case says its counts
    gains: int = 0  # number of values in drive.amp_per_volt; 0: none is asked for
    delay: float | None = None  # samples, where the case says none; None: 1, with a warning
    radius: str = ""  # symbol, m, that takes the main sensor's angle to the reference; "" where they have one unit
    settings: Callable[[Mapping[str, float]], Numbers] = dict  # symbols -> parameters of a config's plant
    stand_in: Callable[[Mapping[str, float], float], tuple[dict[str, Any], float]] | None = None
    # model and tick in s -> `law.position` of a slow loop for a machine whose law nobody knows, and its bandwidth in Hz


def lines(counts: float | None, what: str, path: str, left: list[str]) -> dict[str, Any]:
    """Lines of an encoder, at the path of a config, that counts each of them four times, or once."""
    if counts is None:
        return {}
    whole = round(counts)
    if whole != counts:
        left.append(f"{what}, {counts:g} counts a turn: {whole} are taken")
    return {path: {"lines": whole // 4} if whole % 4 == 0 else {"lines": whole, "multiply": 1}}


def digits(value: float) -> float:
    """Six significant digits."""
    return float(f"{value:.6g}")


def numbers(parameters: Settings) -> Numbers:
    """Every parameter by its name."""
    return {name: float(value) for name, value in parameters.model_dump().items()}
