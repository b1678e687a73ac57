"""Tuning of a config: kind and settings of the law, with a reason for each.

    ivu     PD by bandwidth and damping (5.4), a gain schedule over the radii, feedforward of friction and inertia
    ldu     lead-lag, two notches and a low-pass by optimisation (12.7), feedforward of friction
    axis    PD by bandwidth and damping
    others  PD or PI, the fastest that keeps its margins (first_law.py); or state feedback by LQ (lq.py)

The law is tuned on the model in the config's `plant`, identified or given.

Source: thesis 5.2, 8.2, 9, 12.7.
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import to_yaml
from rtctl.config.yaml_file import parse
from rtctl.design import feedforward, first_law, lq, margins, pd, schedule, shaping
from rtctl.design.margins import Margins
from rtctl.design.robustness import Map
from rtctl.design.shaping import Limits
from rtctl.machines.base import DESCRIBED
from rtctl.machines.profile import AMPLIFIER, REELS
from rtctl.machines.profiles import profile_of

PLAIN = (6.0, 45.0)  # dB and deg, of machines that are not listed


class Reason(NamedTuple):
    """A key of the config that was set, with the reason."""

    path: str
    words: str


class Tuned(NamedTuple):
    """A tuned config with its reasons, margins before and after, and maps over the radii of a reel unit."""

    config: Any
    reasons: list[Reason]
    before: Margins | None  # None where there was no law to judge
    after: Margins
    maps: dict[str, Map]


METHODS = ("usual", "lq")  # lq: state feedback from an observer, of a described machine


def _described(config: Any, hertz: float | None, GM: float | None, PM: float | None, method: str) -> Tuned:
    """Law of a described machine; the former law does not matter."""
    least = (PLAIN[0] if GM is None else GM, PLAIN[1] if PM is None else PM)
    check(1e-3 * config.loop.rate if hertz is None else hertz, 1.0, least, config.loop.rate)
    before = None
    if getattr(config.law.position, "gain", 1.0):
        before = margins.of_config(config)
    if method == "lq":
        made = lq.design(config, least, hertz)
        words = f"{made.words}; |L| = 1 near {made.crossover:.3g} Hz, the fastest with these margins"
        return Tuned(made.config, [Reason("law.position.kind", words)], before, made.margins, {})
    found = first_law.design(config, least, hertz)
    law = found.law
    reasons = [
        Reason("law.position.kind", found.words),
        Reason("law.position.gain", f"crosses |L| = 1 at {found.crossover:.3g} Hz, the fastest with these margins"),
    ]
    if law.kind == "pd":
        reasons.append(Reason("law.position.tau_d", f"lead at the crossover, filtered above {law.corner:.3g} Hz"))
    else:
        reasons.append(Reason("law.position.tau_i", f"{first_law.INTEGRAL:g} / w of the crossover"))
        if law.tau_d:
            reasons.append(
                Reason("law.position.velocity_gain", f"lead at the crossover, above {law.corner:.3g} Hz off")
            )
    return Tuned(found.config, reasons, before, found.margins, {})


def tune(
    config: Any, bandwidth: float | None = None, damping: float = 1.0, GM: float | None = None, PM: float | None = None,
    method: str = "usual",
) -> Tuned:  # fmt: skip
    """The config with a law for `bandwidth` Hz, `damping`, and at least `GM` dB and `PM` deg; by machine where None.

    Raises UserError where the method is not for this machine, NoAnswer where the loop to start from is unstable, or the
    limits cannot be met.
    """
    kind = config.kind
    if method not in METHODS:
        raise UserError(f"--method {method}: it is {' or '.join(METHODS)}")
    if kind == DESCRIBED:
        return _described(config, bandwidth, GM, PM, method)
    if method == "lq":
        raise UserError(f"--method lq is for machines that a config describes; {config.name} has a law of its own")
    profile = profile_of(kind)
    least = (profile.least[0] if GM is None else GM, profile.least[1] if PM is None else PM)
    hertz = profile.bandwidth if bandwidth is None else bandwidth
    check(hertz, damping, least, config.loop.rate)
    before = starting(config)
    if profile.has(REELS):
        made, reasons, maps = _reels(config, hertz, damping, least)
    elif profile.has(AMPLIFIER):
        made, reasons, maps = _shaped(config, hertz, least)
    else:
        made, reasons, maps = *_pd(config, hertz, damping), {}
    after = margins.of_config(made)
    if not after.stable or after.GM < least[0] or after.PM < least[1]:
        raise NoAnswer(
            f"{hertz:g} Hz leaves {after.GM:.1f} dB at {after.f_GM:.3g} Hz and {after.PM:.0f} deg at {after.f_PM:.3g} "
            f"Hz where {least[0]:g} dB and {least[1]:g} deg are asked for; ask for a lower bandwidth"
        )
    return Tuned(made, reasons, before, after, maps)


def check(bandwidth: float, damping: float, least: tuple[float, float], rate: float) -> None:
    """Raise UserError where an option is out of its range."""
    if not 0 < bandwidth < rate / 10:
        raise UserError(f"--bandwidth {bandwidth:g}: it lies above 0 and below a tenth of the rate, {rate / 10:g} Hz")
    if not 0.1 <= damping <= 10:
        raise UserError(f"--damping {damping:g}: it lies between 0.1 and 10; 1 does not overshoot (5.2)")
    if not 0 < least[0] <= 40:
        raise UserError(f"--gm {least[0]:g}: a gain margin lies between 0 and 40 dB; 6 is usual")
    if not 0 < least[1] <= 90:
        raise UserError(f"--pm {least[1]:g}: a phase margin lies between 0 and 90 deg; 45 to 60 is usual")


def starting(config: Any) -> Margins:
    """Margins of the initial loop. Raises NoAnswer, which names the frequency, where the loop is unstable."""
    found = margins.of_config(config)
    if not found.stable:
        where = f"at {found.f_GM:.3g} Hz" if np.isfinite(found.f_GM) else f"near {found.f_PM:.3g} Hz"
        by = f"; its gain is {abs(found.GM):.1f} dB too high" if np.isfinite(found.GM) else ""
        raise NoAnswer(
            f"the loop of {config.name} is unstable {where}{by}; start from a law that holds the machine, or the model "
            "is not that of the machine"
        )
    return found


def written(tuned: Tuned, header: str = "") -> str:
    """YAML of the tuned config with every reason as a comment above its key; it loads to the same config."""
    text = to_yaml(tuned.config)
    lines, at = text.splitlines(), parse(text, "tuned").lines
    notes: dict[int, list[str]] = {}
    for reason in tuned.reasons:
        path = tuple(int(part) if part.isdigit() else part for part in reason.path.split("."))
        if path in at:
            notes.setdefault(at[path] - 1, []).append(reason.words)
    out = [f"# {line}" for line in header.splitlines()]
    for i, line in enumerate(lines):
        indent = line[: len(line) - len(line.lstrip(" -"))].replace("-", " ") if i in notes else ""
        out += [f"{indent}# {words}" for words in notes.get(i, [])]
        out.append(line)
    return "\n".join(out) + "\n"


def words(m: Margins | None) -> str:
    """Margins in one line."""
    if m is None:
        return "no law that moves the machine"
    if not m.stable:
        return f"unstable near {m.f_GM if np.isfinite(m.f_GM) else m.f_PM:.3g} Hz"
    return (
        f"bandwidth {m.bandwidth:.3g} Hz, gain margin {m.GM:.1f} dB at {m.f_GM:.3g} Hz, phase margin {m.PM:.0f} deg at "
        f"{m.f_PM:.3g} Hz, |S| up to {m.M_S:.1f} dB"
    )


def _pd(config: Any, hertz: float, damping: float) -> tuple[Any, list[Reason]]:
    at = 1.0 if profile_of(config.kind).has(REELS) else hertz
    found = pd.design(config, 2 * np.pi * hertz, damping, at)
    found = found._replace(gain=float(f"{found.gain:.4g}"), tau_d=float(f"{found.tau_d:.4g}"))
    made = pd.applied(config, found)
    return made, [
        Reason("law.position.gain", f"w_n^2 / K_p for {hertz:g} Hz, K_p = {found.K_p:.4g} per V at {at:g} Hz (5.4)"),
        Reason("law.position.tau_d", f"2 zeta / w_n, zeta = {damping:g} (5.4)"),
    ]


def _reels(
    config: Any, hertz: float, damping: float, least: tuple[float, float]
) -> tuple[Any, list[Reason], dict[str, Map]]:
    made, reasons = _pd(schedule.with_mode(config, "off"), hertz, damping)
    values = feedforward.design(made)
    made = feedforward.applied(made, values)
    found = schedule.design(made, GM=least[0], PM=least[1])
    made = schedule.with_table(made, found.table)
    worst, R_drive, R_other = found.fixed.worst
    reasons += [
        Reason(
            "law.gain_schedule",
            f"a fixed gain has {worst:.1f} dB of gain margin at {1e3 * R_drive:g}/{1e3 * R_other:g} mm; with the table "
            f"every radius has {found.scheduled.worst[0]:.1f} dB and {found.scheduled.PM.min():.0f} deg",
        ),
        *(Reason(value.path, value.reason) for value in values),
    ]
    return made, reasons, {"fixed gain": found.fixed, "scheduled": found.scheduled}


def _shaped(config: Any, hertz: float, least: tuple[float, float]) -> tuple[Any, list[Reason], dict[str, Map]]:
    found = shaping.design(config, Limits(GM=least[0], PM=least[1], bandwidth=hertz))
    values = feedforward.design(config)
    made = feedforward.applied(shaping.applied(config, found.law), values)
    lead, first, second, low = (section.model_dump() for section in found.law.sections)
    middle = 1 / (2 * np.pi * lead["tau_D"] * np.sqrt(lead["beta"]))
    kind = "law.position.sections"
    reasons = [
        Reason("law.position", f"largest bandwidth with {least[0]:g} dB and {least[1]:g} deg (12.7, figure 12.9)"),
        Reason(f"{kind}.0.kind", f"lead around {middle:.3g} Hz; the lag gives 26 dB more at rest (12.4)"),
        *(
            Reason(f"{kind}.{i}.kind", f"takes {_decibels(n):.1f} dB at {n['frequency']:.4g} Hz (12.5)")
            for i, n in ((1, first), (2, second))
        ),
        Reason(f"{kind}.3.kind", f"rolls off above {low['frequency']:.4g} Hz (12.7)"),
        *(Reason(value.path, value.reason) for value in values),
    ]
    return made, reasons, {}


def _decibels(notch: dict[str, Any]) -> float:
    return float(-20 * np.log10(notch["zeta_z"] / notch["zeta_p"]))
