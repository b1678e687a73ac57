"""The three plants with nominal values, and true values that differ by a few percent.

Source: thesis 4.9-4.17 and appendix A (two reels), F.1-F.9 (linear drive); Janot, Gautier & Brunot 2019 (axis).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rtctl.proof import control, machine, motion
from rtctl.proof.setup import Hidden, Setup

IVU_NODES = {"motor1": 0, "reel1": 1, "reel2": 2, "motor2": 3, "capstan": 4}
LDU_NODES = {"motor": 0, "wheel": 1, "capstan": 2, "carriage": 2, "encoder": 3}
EXACT = ("R_c", "R_min", "rho_tape", "h_tape", "J_10", "J_20", "N", "R_s", "R_t")
RADII = ("R1", "R2")
SUBSTEPS = {"ivu": 50, "ldu": 12, "axis": 20}  # solver steps per tick: 40 us, 8.3 us, 50 us
GIVES = 0.02  # share of the finest count: elastic travel of dry friction in a sound machine; more is presliding


def reel_inertia(p: dict[str, float], R: float, core: float) -> float:
    """Inertia of a reel in kg m^2, core and paper (4.1)."""
    return core + 0.5 * math.pi * p["rho_tape"] * p["h_tape"] * (R**4 - p["R_min"] ** 4)


def true_values(rng: np.random.Generator, believed: dict[str, float], tolerance: float, edge: bool) -> dict[str, float]:
    """True values within `tolerance` of the nominal values; at 0.6 to 1 of the tolerance where `edge`."""
    out = {}
    for name, value in believed.items():
        r = rng.uniform(-0.85, 0.85) * tolerance
        if edge:
            r = rng.choice([-1.0, 1.0]) * rng.uniform(0.6, 0.97) * tolerance
        if name in EXACT:
            r = 0.0
        elif name in RADII:
            r = rng.uniform(-0.02, 0.02)
        out[name] = value * (1.0 + r)
    return out


def friction_law(rng: np.random.Generator) -> float:
    """Friction law of a sound machine: the elastic stop. The steep law creeps during sticking: missing physics."""
    rng.random()  # keeps the random stream of earlier versions, which drew a law
    return machine.STOP


class Play(NamedTuple):
    """Motion of a recording: called with a generator, it returns reference and excitation (n,)."""

    how: str  # rich or production
    n: int
    Ts: float
    step: float
    slow: float
    fast: float
    reach: float
    rms: float  # V, rms of the excitation
    top_hz: float
    slope: float

    def __call__(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        n, Ts = self.n, self.Ts
        if self.how == "production":
            return motion.production(rng, n, Ts, self.step, self.fast, self.reach), np.zeros(n)
        ref = motion.rich(rng, n, Ts, self.step, self.slow, self.fast, self.reach)
        return ref, motion.multisine(rng, n, Ts, self.rms, self.top_hz, self.slope)


def ivu(rng: np.random.Generator, how: str, edge: bool, other_law: bool) -> Setup:
    """Two reels and a capstan at 500 Hz."""
    R1, R2 = [(0.038, 0.022), (0.035, 0.028), (0.033, 0.026), (0.022, 0.037), (0.030, 0.031)][rng.integers(5)]
    p = {"R1": R1, "R2": R2, "R_c": 0.0125, "R_min": 0.02, "J_m1": 1.5e-3, "J_m2": 1.5e-3, "J_c": 5e-6}
    for name, value in {"c_m": 12.0, "k_m": 0.013, "c": 450.0, "k": 12.5, "K_m": 0.061}.items():
        p |= {f"{name}1": value, f"{name}2": value}
    p |= {"rho_tape": 1700.0, "h_tape": 0.037, "J_10": 1e-6, "J_20": 1e-6, "tau_F1": 0.0024, "tau_F2": 0.0026}
    p |= {"tau_Fc": 2e-4}
    p |= {"J_1": reel_inertia(p, R1, 1e-6), "J_2": reel_inertia(p, R2, 1e-6)}
    t = true_values(rng, p, 0.15, edge)
    Ts, n = 0.002, int(rng.choice([20, 25, 30])) * 500
    m = machine.blank()
    m["nq"], m["nu"], m["ny"], m["Ts"], m["delay"], m["sub"] = 5, 2, 3, Ts, 1.0, SUBSTEPS["ivu"]
    m["q_J"][:5] = [t["J_m1"], t["J_1"], t["J_2"], t["J_m2"], t["J_c"]]
    machine.spring(m, 0, 1, 1.0, -1.0, t["c_m1"], t["k_m1"])
    machine.spring(m, 1, 4, t["R1"], -t["R_c"], t["c1"], t["k1"])
    machine.spring(m, 2, 4, t["R2"], t["R_c"], t["c2"], t["k2"])
    machine.spring(m, 3, 2, 1.0, -1.0, t["c_m2"], t["k_m2"])
    law = friction_law(rng)
    for i, name, v_eps in ((0, "tau_F1", 2e-4), (3, "tau_F2", 2e-4), (4, "tau_Fc", 1.5e-3)):
        machine.dry(m, i, t[name], 2e-5, law, v_eps)
    bandwidth, damping = 3000.0, 0.7071
    for d, i in enumerate((0, 3)):
        w = 2.0 * math.pi * bandwidth * (1.0 + rng.uniform(-0.1, 0.1))
        machine.drive(m, d, node=i, K=t[f"K_m{d + 1}"], amp=0.2, w=w, zeta=damping)
    machine.sensor(m, 0, node=4, gain=10000 / (2 * math.pi))
    machine.sensor(m, 1, node=1, gain=209 / (2 * math.pi), kind=machine.EDGES)
    machine.sensor(m, 2, node=2, gain=209 / (2 * math.pi), kind=machine.EDGES)
    case = _case("ivu", 500.0, p, 1.0, {"parameter_tolerance": 0.15, "radius_tolerance": 0.02})
    case["sensors"] = {"capstan_counts_per_rev": 10000, "reel_counts_per_rev": 209}
    case["drive"] = {
        "amp_per_volt": [0.2, 0.2], "limit_volt": 10.0, "dac_bits": 12, "bandwidth_hz": bandwidth, "damping": damping,
    }  # fmt: skip
    case["controller"], case["notes"] = control.ivu(rng)
    fast, step = rng.uniform(4.0, 14.0), rng.choice([1.5, 2.5, 4.0, 12.0], p=[0.3, 0.35, 0.25, 0.1])
    play = Play(how, n, Ts, step, 0.15, fast, 60.0, rng.uniform(0.3, 0.75), 80.0, 0.5)
    ref, w_in = play(rng)
    h = Hidden()
    h.torque_sd[[0, 3]] = 1e-4 * rng.uniform(0.5, 1.5)
    h.torque_sd[4] = 2e-6
    h.count_sd[0] = rng.uniform(0.15, 0.4)
    h.jitter_s = rng.uniform(2e-6, 2e-5)
    s = Setup("ivu", m, t, case, ref, w_in, IVU_NODES, ["capstan_counts", "reel1_counts", "reel2_counts"], h)
    s.span = {"u": 1.0, "v": fast, "q": step, "torque": 2.5e-3}
    s.play = play
    return _with_law(rng, s, other_law)


def ldu(rng: np.random.Generator, how: str, edge: bool, other_law: bool) -> Setup:
    """Capstan drive of a carriage at 10 kHz."""
    heavy = rng.random() < 0.5
    p = {"R_s": 0.0015, "R_t": 0.03, "R_c": 0.0015 if heavy else 0.003, "N": 20.0, "k_s": 4.2, "k_c": 7.6}
    p |= {"b_s": 1.90986e-05, "b_c": 8.13161e-4, "J_m": 1e-6, "J_t": 1e-5, "J_c": 1e-7, "J_e": 3e-6}
    p |= {"M": 5.0 if heavy else 1.25, "K_m1": 0.021, "K_m2": 5e-8, "B_c": 1e-6, "B_m": 0.5}
    p |= {"F_c": 6.0 if heavy else 5.0}
    t = true_values(rng, p, 0.15, edge)
    Ts, n = 1e-4, int(rng.choice([6, 8, 10])) * 10000
    m = machine.blank()
    m["nq"], m["nu"], m["ny"], m["Ts"], m["delay"], m["sub"] = 4, 1, 2, Ts, 1.0, SUBSTEPS["ldu"]
    load = t["J_c"] + t["M"] * t["R_c"] ** 2
    m["q_J"][:4] = [t["J_m"], t["J_t"], load, t["J_e"]]
    machine.spring(m, 0, 1, 1.0, -t["N"], t["k_s"], t["b_s"])
    machine.spring(m, 1, 2, 1.0, -1.0, t["k_c"], t["b_c"])
    machine.spring(m, 2, 3, 1.0, -1.0, t["k_c"], t["b_c"])
    machine.node(m, 0, B=t["K_m2"])
    machine.node(m, 2, B=t["B_c"] + t["R_c"] ** 2 * t["B_m"])
    gains = 20000 / (2 * math.pi), p["R_c"] / 5e-7  # counts a rad of encoder and scale, whichever the case has
    finest = 1.0 / max(gains)  # rad
    machine.dry(m, 2, t["R_c"] * t["F_c"], GIVES * finest, friction_law(rng), 6e-3)
    w = 2 * math.pi * 3000.0 * (1.0 + rng.uniform(-0.1, 0.1))
    machine.drive(m, 0, node=0, K=t["K_m1"], amp=0.1, current_limit=0.3, w=w, zeta=0.7071)
    machine.sensor(m, 0, node=3, gain=gains[0])
    machine.sensor(m, 1, node=2, gain=gains[1])
    scale = rng.random() < 0.75
    case = _case("ldu", 10000.0, p, 1.0, {"parameter_tolerance": 0.15, "radius_tolerance": 1e-5})
    case["sensors"] = {"encoder_counts_per_rev": 20000} | ({"scale_m_per_count": 5e-7} if scale else {})
    case["drive"] = {
        "amp_per_volt": [0.1], "limit_volt": 3.0, "dac_bits": 12, "dac_range_volt": 10.0, "current_limit": 0.3,
        "bandwidth_hz": 3000.0, "damping": 0.7071,
    }  # fmt: skip
    case["controller"], case["notes"] = control.ldu(rng, heavy)
    step = rng.choice([0.004, 0.02, 0.08])
    fast = float(np.clip(step * 3.0, 0.01, 0.12)) * rng.uniform(0.7, 1.3)
    play = Play(how, n, Ts, step, fast / 12.0, fast, 0.3, rng.uniform(0.07, 0.14), 400.0, 0.0)
    ref, w_in = play(rng)
    h = Hidden()
    h.torque_sd[0] = 3e-5
    h.count_sd[:2] = rng.uniform(0.15, 0.3)
    h.jitter_s = rng.uniform(1e-7, 1.5e-6)
    s = Setup("ldu", m, t, case, ref, w_in, LDU_NODES, ["encoder_counts"] + ["scale_counts"] * scale, h)
    s.span = {"u": 0.45, "v": fast / p["R_c"], "q": step / p["R_c"], "torque": p["R_c"] * p["F_c"]}
    s.play = play
    return _with_law(rng, s, other_law)


def axis(rng: np.random.Generator, how: str, edge: bool, other_law: bool) -> Setup:
    """One mass on a guide at 1 kHz: a heavy ball screw, a linear motor stage, or a mass on a spring."""
    sort = rng.choice(["screw", "stage", "spring"], p=[0.45, 0.4, 0.15])
    p, K, bits = {"M": 95.0, "F_v": 200.0, "F_c": 20.0}, 35.0, 16
    if sort == "stage":
        p, K, bits = {"M": 3.0, "F_v": 12.0, "F_c": 2.0}, 8.0, 12
    if sort == "spring":
        p, K, bits = {"M": 1.0, "F_v": 6.0, "F_c": 0.02, "k": 900.0}, 8.0, 16
    t = true_values(rng, {**p, "K": K}, 0.15, edge)
    Ts, n = 1e-3, int(rng.choice([15, 20, 25])) * 1000
    m = machine.blank()
    delay = float(rng.integers(0, 2))
    m["nq"], m["nu"], m["ny"], m["Ts"], m["delay"], m["sub"] = 1, 1, 1, Ts, delay, SUBSTEPS["axis"]
    machine.node(m, 0, J=t["M"], B=t["F_v"], k_pos=t.get("k", 0.0))
    law = friction_law(rng)
    band = 2 * math.pi * 1000.0 * (1.0 + rng.uniform(-0.1, 0.1))
    machine.drive(m, 0, node=0, K=t["K"], amp=1.0, w=band, zeta=0.7071)
    pitch = 1e-6 if sort == "spring" else float(rng.choice([5e-7, 2e-6]))
    machine.sensor(m, 0, node=0, gain=1.0 / pitch)
    machine.dry(m, 0, t["F_c"], GIVES * pitch, law, 1e-5)
    case = _case("axis", 1000.0, p, delay, {"parameter_tolerance": 0.15})
    case["sensors"] = {"x_resolution_m": pitch}
    case["drive"] = {
        "newton_per_volt": K,
        "limit_volt": 10.0,
        "dac_bits": bits,
        "bandwidth_hz": 1000.0,
        "damping": 0.7071,
    }
    case["controller"], case["notes"] = control.axis(rng, p["M"], K, delay)
    fast = {"screw": 0.15, "stage": 0.3, "spring": 0.05}[sort] * rng.uniform(0.5, 1.2)
    step = fast * 0.8 if sort != "spring" else 0.01
    reach = 0.03 if sort == "spring" else 0.5
    rms = {"screw": 0.4, "stage": 0.25, "spring": 0.3}[sort] * rng.uniform(0.5, 1.3)
    play = Play(how, n, Ts, step, fast / 30.0, fast, reach, rms, 150.0, 0.4)
    ref, w_in = play(rng)
    h = Hidden()
    h.torque_sd[0] = {"screw": 0.6, "stage": 0.06, "spring": 0.01}[str(sort)] * rng.uniform(0.5, 1.5)
    h.count_sd[0] = rng.uniform(0.15, 0.4)
    h.jitter_s = rng.uniform(1e-7, 4e-6)
    s = Setup("axis", m, t, case, ref, w_in, {"carriage": 0}, ["x"], h)
    force = max(t["F_c"], 0.1 * K * rms)
    s.span = {"u": max(rms, 1.5 * t["F_c"] / K), "v": fast, "q": step, "torque": force}
    s.play = play
    return _with_law(rng, s, other_law)


def _case(plant: str, rate: float, p: dict[str, float], delay: float, reaches: dict[str, float]) -> dict[str, Any]:
    believed = {k: float(f"{v:.6g}") for k, v in p.items()}
    return {
        "format": 1, "plant": plant, "sample_rate": rate, "parameters": believed, "sensors": {}, "drive": {},
        "delay_samples": delay, "controller": {}, "notes": "", "controller_known": True, "reaches": reaches,
    }  # fmt: skip


def _with_law(rng: np.random.Generator, s: Setup, other: bool) -> Setup:
    """Setup with the law of the case; where the law is undocumented, with an additional integrator."""
    from rtctl.proof.law import from_case

    s.m["y_phase"] = rng.uniform(0.05, 0.95, 3)
    s.law = from_case(s.case)
    if s.plant == "axis":
        s.law["counts_to_q"] = s.case["sensors"]["x_resolution_m"]
    if other:
        gain = {"ivu": s.case["controller"].get("P", 0.0), "ldu": 2000.0, "axis": 100.0}[s.plant]
        s.law["hidden"] = gain * rng.uniform(0.5, 2.0)
        s.case["controller"] = {"kind": "unknown"}
        s.case["controller_known"] = False
        s.case["notes"] = s.case["notes"].split("Law:")[0] + "The law is not known; the recorded command is the input."
    return s


BUILD = {"ivu": ivu, "ldu": ldu, "axis": axis}
