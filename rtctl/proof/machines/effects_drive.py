"""Effects of drives and loop timing: offset, dead band, gain, limit, lag, heat, supply, back-EMF, slew, delay."""

import math

import numpy as np

from rtctl.proof.machines.arrays import FORCE
from rtctl.proof.machines.effect import (
    Setup,
    Sizes,
    UnfitError,
    about,
    command,
    drives,
    effect,
    form,
    inertia_at,
    level,
    loop,
    sign,
    span,
    speed,
)  # fmt: skip
from rtctl.proof.machines.kinematics import rotary

RESPONSE = ("frequency", "time")


def _body(s: Setup, node: str) -> str:
    return str(s.machine["drives"][node]["body"])


@effect("drive.offset", drives, ("command", "time"))
def offset(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Constant error of the command."""
    b = sign(rng) * about(rng, 0.3 * command(s, node)) * size
    s.m["d_offset"][s.drive(node)] = b
    return {"offset": b}


@effect("drive.deadband", drives, ("command",))
def deadband(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Dead band around zero with hard or rounded edges; its size is the command at which the output begins."""
    d, band = s.drive(node), about(rng, 0.35 * command(s, node)) * size
    s.m["d_band"][d], s.m["d_bandsoft"][d] = band, (0.0, 0.3 * band)[form(rng, 2)]
    return {"band": band}


@effect("drive.gain_asymmetry", drives, ("command",))
def asymmetry(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    a = sign(rng) * min(about(rng, 0.15) * size, 0.6)
    s.m["d_asym"][s.drive(node)] = a
    return {"asymmetry": a}


@effect("drive.saturation", drives, ("command",))
def saturation(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Saturation of the output below the command's limit: hard or smooth."""
    d = s.drive(node)
    top = float(np.quantile(np.abs(s.seen["command"][:, d]), 1.0 - about(rng, 0.03) * size))
    s.m["d_sat"][d], s.m["d_satsoft"][d] = top, (0.0, 0.15)[form(rng, 2)]
    return {"limit": top}


@effect("drive.lag", drives, RESPONSE)
def lag(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Lag of the drive: first order, or two in series."""
    d, tau = s.drive(node), about(rng, 4e-3) * size
    if form(rng, 2):
        s.m["d_lag"][d] = tau
    else:
        s.m["d_lag"][d], s.m["d_lag2"][d] = 0.65 * tau, 0.35 * tau
    return {"tau_s": tau}


@effect("drive.thermal", drives, ("time",))
def thermal(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Gain that falls with the heat of the squared current, or dry friction that falls with running time."""
    d = s.drive(node)
    tau = about(rng, 0.4 * s.n * s.Ts)
    i = s.body(_body(s, node))
    if form(rng, 3) == 2 and s.m["b_F"][i] > 0.3 * level(s, _body(s, node)):
        s.m["b_warm"][i], s.m["b_warm_tau"][i] = min(about(rng, 0.6) * size, 0.9), tau
        return {"share": float(s.m["b_warm"][i]), "tau": tau}
    ref = math.sqrt(float(np.mean(s.seen["forces"][:, d] ** 2)))
    s.m["d_heat"][d], s.m["d_heatref"][d], s.m["d_heattau"][d] = min(about(rng, 0.35) * size, 0.5), ref, tau
    return {"share": float(s.m["d_heat"][d]), "tau": tau}


@effect("drive.supply_sag", drives, ("command", "time"))
def sag(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Gain that falls with the total current of all drives: at once, or with the supply's time constant."""
    for d in range(int(s.m["nd"])):
        s.m["d_sagref"][d] = max(float(np.quantile(np.abs(s.seen["forces"][:, d]), 0.98)), 1e-12) * float(s.m["nd"])
    s.m["d_sag"][:] = about(rng, 0.3) * size
    s.m["d_sagtau"][:] = (0.0, about(rng, 0.01))[form(rng, 2)]
    return {"share": float(s.m["d_sag"][0])}


def _no_voltage(s: Setup) -> list[str]:
    return [n for n in drives(s) if s.m["d_kind"][s.drive(n)] == FORCE]


@effect("drive.back_emf", _no_voltage, ("velocity", "command"))
def back_emf(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Force that falls with speed: at once, or through the winding's time constant."""
    d, body = s.drive(node), _body(s, node)
    B = about(rng, 1.2 * level(s, body) / speed(s, body)) * size
    B = min(B, 40.0 * inertia_at(s, body))
    s.m["d_emf"][d], s.m["d_emftau"][d] = B, (0.0, about(rng, 8e-4))[form(rng, 2)]
    return {"constant": B}


@effect("drive.slew", drives, ("command", "time"))
def slew(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Rate limit of the command: hard or smooth."""
    d = s.drive(node)
    rate = np.abs(np.diff(s.seen["command"][:, d])) / s.Ts
    s.m["d_slew"][d] = max(float(np.quantile(rate, 1.0 - min(about(rng, 0.35) * size, 0.8))), 1e-9)
    s.m["d_slewsoft"][d] = (0.0, 2e-3)[form(rng, 2)]
    return {"rate": float(s.m["d_slew"][d])}


def _commutated(s: Setup) -> list[str]:
    return [n for n in drives(s) if rotary(s.machine, _body(s, n))]


@effect("ripple.torque", _commutated, ("angle", "position"))
def commutation(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Gain periodic in the angle of the driven body: one harmonic, or three."""
    d, wide = s.drive(node), span(s, _body(s, node))
    least = math.ceil(6.0 / max(wide, 1e-9))
    if least > 42:
        raise UnfitError("the motor hardly turns")
    n = float(rng.choice([k for k in (4, 6, 8, 12, 14, 18, 24, 42) if k >= least]))
    a = min(about(rng, 0.25) * size, 0.45)
    for h in range(1 + 2 * form(rng, 2)):
        s.m["d_rip"][d, h], s.m["d_ripn"][d, h] = a * 0.4**h, n * (h + 1)
        s.m["d_ripa"][d, h] = rng.uniform(0.0, 2.0 * math.pi)
    return {"share": a, "per_turn": n}


@effect("timing.delay", loop, RESPONSE)
def delay(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Delay beyond the delay of the case, in quarters of a tick."""
    extra = max(round(4.0 * about(rng, 4e-3) * size / s.Ts) / 4.0, 0.25)
    s.m["delay"] += extra
    return {"extra_samples": extra}
