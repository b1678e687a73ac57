"""Laws under the key `controller` of a case, and the reader for exchange format 1."""

import math
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from rtctl.case.checks import Part, part
from rtctl.case.config_law import ConfigLaw
from rtctl.config.errors import UserError
from rtctl.machines.profile import FREE_UNITS, REELS, Profile

MAX_SECTIONS = 8
INPUT = "the recorded command is taken as the input"


class PdLaw(Part):
    """u = P e + D d + w, where d is the filtered derivative of e."""

    kind: Literal["pd"] = "pd"
    P: float
    D: float
    derivative_filter_hz: float | None = Field(None, gt=0)


class TapeLaw(PdLaw):
    """u_c = P e + D d + friction sign(ref step) + w, shared between two motors that pull at a tape."""

    tension_N: float = 0.0
    friction_Nm: float = 0.0
    allocation: Literal["pull", "differential", "motor1", "motor2"] = "pull"


class SectionsLaw(Part):
    """u = sections(e) + w; each section is (b0, b1, b2, a1, a2). `kind` is the name in the case."""

    kind: str
    sections: tuple[tuple[float, float, float, float, float], ...] = Field(min_length=1, max_length=MAX_SECTIONS)


class CascadeLaw(Part):
    """u = kp kv (ref - x) - kv v + w."""

    kind: Literal["cascade_p_v"] = "cascade_p_v"
    kp: float
    kv: float


class NoLaw(Part):
    """Driven open loop: the recorded command is the input."""

    kind: Literal["none"] = "none"


class UnknownLaw(Part):
    kind: str = "unknown"


Law = PdLaw | TapeLaw | SectionsLaw | CascadeLaw | ConfigLaw | NoLaw | UnknownLaw
KNOWN_LAWS = (PdLaw, SectionsLaw, CascadeLaw, ConfigLaw)  # laws that can be recomputed


def controller(where: Path, profile: Profile, given: Any, rate: float | None, warnings: list[str]) -> Law:
    """Law under the key `controller`, of a machine with this profile. Raises UserError."""
    if given is None:
        warnings.append(f"{where}: controller is missing; {INPUT}")
        return UnknownLaw()
    tape, kind = profile.has(REELS), kind_of(where, given)
    if kind == "none":
        return NoLaw()
    if tape and kind == "pd":
        return part(where, "controller", TapeLaw, given, warnings)
    if profile.has(FREE_UNITS) and kind == "cascade_p_v":
        return part(where, "controller", CascadeLaw, {k: v for k, v in given.items() if k != "law"}, warnings)
    if not tape and given.get("sections") is not None:
        return part(where, "controller", SectionsLaw, {"kind": kind, "sections": given["sections"]}, warnings)
    if not tape and kind == "pd" and rate is not None and "P" in given and "D" in given:
        law: PdLaw = part(where, "controller", PdLaw, given, warnings)
        section = pd_section(law.P, law.D, law.derivative_filter_hz, 1 / rate)
        return part(where, "controller", SectionsLaw, {"kind": "pd", "sections": [section]}, warnings)
    return UnknownLaw(kind=kind)


def kind_of(where: Path, given: Any) -> str:
    """Kind of the law under the key `controller`. Raises UserError for no object, or a kind that is no text."""
    if not isinstance(given, dict):
        raise UserError(f"{where}: controller is a {type(given).__name__}; it should be an object with a 'kind'")
    kind = given.get("kind", "unknown")
    if not isinstance(kind, str):
        raise UserError(f"{where}: controller.kind is {kind!r}; it should be a word, such as pd")
    return kind


def pd_section(P: float, D: float, filter_hz: float | None, dt: float) -> tuple[float, float, float, float, float]:
    """P e + D d with d += a ((e - e_prev) / dt - d) as one section (b0, b1, b2, a1, a2)."""
    a = 1.0 if filter_hz is None else 1.0 - math.exp(-2 * math.pi * filter_hz * dt)
    d = D * a / dt
    return (P + d, -P * (1.0 - a) - d, 0.0, -(1.0 - a), 0.0)
