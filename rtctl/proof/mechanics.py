"""Effects of the table, second half: ripples, transmission, structure, tape, geometry."""

import math

import numpy as np

from rtctl.proof import machine
from rtctl.proof.effects import MOTORS, Sizes, about, effect, index, level, to_force
from rtctl.proof.setup import Setup

REELS = {"ivu": ("reel1", "reel2")}
TAPES = {"ivu": ("tape1", "tape2")}


def _spring_of(node: str) -> int:
    return {"tape1": 1, "reel1": 1, "tape2": 2, "reel2": 2, "motor1": 0, "motor2": 3, "wheel": 0, "capstan": 1}[node]


def _harmonics(rng: np.random.Generator, rich: float = 0.6) -> np.ndarray:
    """Relative amplitudes (3,) of the first harmonic and, in most cases, of two more."""
    more = rng.random() < rich
    return np.array([1.0, rng.uniform(0.1, 0.35) * more, rng.uniform(0.05, 0.2) * more])


def _misread(s: Setup, y: int, bank: int, a: np.ndarray, n: float, phase: np.ndarray) -> None:
    """Add a periodic error with harmonics (3,) to the reading of sensor y; `bank` separates wheel and guide."""
    at = slice(bank, bank + machine.NH)
    s.m["rip_a"][y, at], s.m["rip_n"][y, at], s.m["rip_ph"][y, at] = a, n * np.arange(1, 4), phase


@effect("ripple.cogging", {"ivu": MOTORS, "ldu": ("motor",), "axis": ("drive",)}, ("angle", "position"),
        {"ldu": ("motor", "drive"), "axis": ("drive", "carriage")}, rich=True)  # fmt: skip
def cogging(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    i = 0 if node == "drive" else index(s, node)
    n = float(rng.choice([7.0, 11.0, 12.0, 14.0, 24.0] if s.plant == "ivu" else [5.0, 7.0, 12.0]))
    torque = {"ivu": 1.8e-3, "ldu": 0.3 * s.span["torque"] / 20.0, "axis": 0.4 * s.span["torque"]}[s.plant]
    pitch = 1.0
    if s.plant == "axis":
        pitch = float(rng.choice([0.005, 0.01, 0.02]))
        n = 2.0 * math.pi / pitch * float(rng.choice([1.0, 2.0, 4.0]))
    a = about(rng, torque) * size
    for k, r in enumerate(_harmonics(rng)):
        s.m["wave_a"][i, k], s.m["wave_n"][i, k] = a * r, n * (k + 1)
        s.m["wave_ph"][i, k] = rng.uniform(0, 2 * math.pi)
    if s.plant == "axis":
        return {"amplitude_N": a, "wavelength_m": 2.0 * math.pi / n}
    return {"amplitude_Nm": a, "per_turn": n}


@effect("ripple.reel", REELS, ("angle", "position"),
        {"ivu:reel1": ("reel1", "tape1"), "ivu:reel2": ("reel2", "tape2")}, rich=True)  # fmt: skip
def reel(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    j = _spring_of(node)
    e = about(rng, 4e-4) * size
    s.m["ecc_i"][j] = e * _harmonics(rng)
    s.m["ecc_pi"][j] = rng.uniform(0, 2 * math.pi, 3)
    return {"eccentricity_m": e}


@effect("ripple.encoder", {"ivu": ("encoder",), "ldu": ("encoder",), "axis": ("sensor",)}, ("angle", "position"),
        {"ivu": ("encoder", "capstan")}, rich=True)  # fmt: skip
def encoder(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    a = about(rng, {"ivu": 0.012, "ldu": 0.0055, "axis": 4e-5}[s.plant]) * size
    n = 1.0 if s.plant != "axis" else 2.0 * math.pi / float(rng.choice([0.01, 0.02, 0.04]))
    _misread(s, 0, 0, a * _harmonics(rng, 0.4), n, rng.uniform(0, 2 * math.pi, 3))
    return {"amplitude_rad": a} if s.plant != "axis" else {"amplitude_m": a, "wavelength_m": 2.0 * math.pi / n}


@effect("ripple.capstan", {"ivu": ("capstan",), "ldu": ("capstan",)}, ("angle", "position"),
        {"ldu": ("capstan", "encoder", "scale"), "ivu": ("capstan", "encoder")}, rich=True)  # fmt: skip
def capstan(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    shape, phase = _harmonics(rng, 0.5), rng.uniform(0, 2 * math.pi, 3)
    if s.plant == "ivu":
        e = about(rng, 1.5e-4) * size
        for j, side in ((1, -1.0), (2, 1.0)):
            s.m["ecc_j"][j], s.m["ecc_pj"][j] = side * e * shape, phase
        return {"eccentricity_m": e}
    e = about(rng, 1.2e-5) * size
    _misread(s, 1, 0, e / s.truth["R_c"] * shape, 1.0, phase)
    return {"eccentricity_m": e}


@effect("guide.thickness", {"ldu": ("carriage",), "axis": ("sensor",)}, ("position",),
        {"ldu": ("carriage", "scale"), "axis": ("sensor", "carriage")}, rich=True)  # fmt: skip
def thickness(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Uneven thickness of a strip or extrusion: difference between scale and capstan travel (11.6)."""
    y, f = (1, s.truth["R_c"]) if s.plant == "ldu" else (0, 1.0)
    a = about(rng, 2e-5 if s.plant == "ldu" else 3e-4) * size
    span = float(np.ptp(s.ref))
    wanted = span / rng.uniform(1.5, 5.0)  # at least one period, and not the 19 mm of a capstan turn
    wave = min((0.003125, 0.00625, 0.0125, 0.025, 0.0375, 0.075, 0.15), key=lambda v: abs(math.log(v / wanted)))
    _misread(s, y, machine.NH, a / f * _harmonics(rng, 0.4), 2 * math.pi / wave * f, rng.uniform(0, 2 * math.pi, 3))
    return {"amplitude_m": a, "wavelength_m": wave}


@effect("transmission.backlash", {"ivu": MOTORS, "ldu": ("wheel",)}, ("velocity", "command", "tension", "position"),
        {"ldu": ("wheel", "capstan", "motor"), "ivu:motor1": ("motor1", "reel1"),
         "ivu:motor2": ("motor2", "reel2")}, rich=True)  # fmt: skip
def backlash(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    j = 1 if s.plant == "ldu" else _spring_of(node)
    gap = about(rng, 0.03 if s.plant == "ivu" else 0.004) * size
    s.m["s_gap"][j] = gap
    s.m["s_gap_smooth"][j] = float(rng.choice([0.0, 0.05])) * gap
    s.m["s_gap_damped"][j] = float(rng.choice([0.0, 1.0]))
    return {"gap_rad": gap}


@effect("transmission.slip", {"ivu": ("capstan",), "ldu": ("wheel",)}, ("tension", "velocity", "command", "time"),
        {"ivu": ("capstan", "tape1", "tape2"), "ldu": ("wheel", "motor")})  # fmt: skip
def slip(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Slip above the limit of the contact force, which the hardest moves reach."""
    share = 1.0 - (0.04 if s.plant == "ivu" else 0.35) * size * about(rng, 1.0)  # share of time without slip
    a = float(np.quantile(s.acceleration, share))
    if s.plant == "ivu":
        limit = (s.truth["tau_Fc"] + s.truth["J_c"] * a) / s.truth["R_c"]
        s.m["cap_limit"] = limit
        return {"limit_N": limit}
    t = s.truth
    load = t["J_t"] + t["J_c"] + t["J_e"] + t["M"] * t["R_c"] ** 2
    limit = (s.span["torque"] + load * a) / t["N"]
    s.m["s_limit"][0] = limit
    return {"limit_Nm": limit}


@effect("transmission.creep", {"ivu": ("capstan",), "ldu": ("capstan",)}, ("tension", "position", "time"),
        {"ivu": ("capstan", "tape1", "tape2"), "ldu": ("capstan", "scale", "carriage", "wheel")})  # fmt: skip
def creep(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    if s.plant == "ivu":
        k = about(rng, 1.2e-3) * size  # m per N and rad of capstan
        s.m["cap_creep"] = k
        return {"per_N": k / s.truth["R_c"]}
    relative = about(rng, 6e-4) * size
    k = relative / s.span["torque"]
    s.m["y_creep"][1] = k  # the scale reads less where the capstan drives
    return {"per_N": k * s.truth["R_c"]}


@effect("structure.resonance", {"ivu": ("reel1", "reel2", "capstan"), "ldu": ("carriage",), "axis": ("carriage",)},
        ("frequency",), {"ldu": ("carriage", "capstan", "motor"), "ivu:reel1": ("reel1", "motor1", "tape1"),
                         "ivu:reel2": ("reel2", "motor2", "tape2")})  # fmt: skip
def resonance(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    i, f = index(s, node), to_force(s)
    if s.plant == "ivu":
        J, hz = about(rng, 2e-4 if node != "capstan" else 2e-5) * size, about(rng, 11.0)
    else:
        own = float(s.m["q_J"][i])
        J, hz = about(rng, 0.4) * size * own, about(rng, 55.0 if s.plant == "ldu" else 22.0)
        s.m["q_J"][i] = own - 0.3 * J if s.plant == "ldu" else own
    w = 2 * math.pi * hz
    extra = machine.add_node(s.m, J)
    machine.spring(s.m, i, extra, 1.0, -1.0, J * w * w, 2 * about(rng, 0.03) * w * J)
    return {"f_Hz": hz, ("J" if s.plant == "ivu" else "mass_kg"): J / f**2}


@effect("structure.stiffening", TAPES | {"axis": ("carriage",)}, ("position", "tension"),
        {"ivu:tape1": ("tape1", "reel1"), "ivu:tape2": ("tape2", "reel2")})  # fmt: skip
def stiffening(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    if s.plant == "ivu":
        j = _spring_of(node)
        c3 = about(rng, 1.5 * float(s.m["s_c"][j]) / 6e-4**2) * size
        s.m["s_c3"][j] = c3
        return {"c3_N_per_m3": c3}
    top = float(np.abs(s.ref).max())
    k3 = about(rng, 0.8 * max(s.truth.get("k", 0.0), level(s, node) / top) / top**2) * size
    s.m["q_k_pos3"][0] = k3
    return {"k3_N_per_m3": k3}


@effect("tape.viscoelastic", TAPES, ("frequency", "tension", "time"),
        {"ivu:tape1": ("tape1", "reel1"), "ivu:tape2": ("tape2", "reel2")}, rich=True)  # fmt: skip
def viscoelastic(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """One Maxwell branch parallel to the spring and damper, or two with time constants a decade apart."""
    j = _spring_of(node)
    c, tau = about(rng, 700.0) * size, about(rng, 0.2, 0.7)
    s.m["br_c"][j, 0], s.m["br_tau"][j, 0] = c, tau
    if rng.random() < 0.5:
        s.m["br_c"][j, 1], s.m["br_tau"][j, 1] = 0.5 * c, tau * rng.choice([0.12, 6.0])
    return {"c_branch": c, "tau_s": tau}


@effect("tape.slack", TAPES, ("tension",), {"ivu": ("tape1", "tape2")})
def slack(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Slack: the tape carries no compression, on both sides."""
    s.m["s_pull_only"][[1, 2]] = 1.0
    return {}


@effect("geometry.radius_change", REELS, ("position", "time", "angle"), {"ivu": ("reel1", "reel2")})
def radius_change(s: Setup, node: str, size: float, rng: np.random.Generator) -> Sizes:
    """Radii that change with the tape wound from one reel to the other (4.1-4.4)."""
    d = about(rng, 3e-4) * size
    s.m["s_grow_i"][[1, 2]] = d / (2 * math.pi)
    s.m["s_rho_h"][[1, 2]] = s.truth["rho_tape"] * s.truth["h_tape"]
    return {"d_tape_m": d}
