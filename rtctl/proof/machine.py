"""The true machine as one record: nodes that turn or slide, springs between them, drives, sensors and their faults.

    J_i q_i'' = drive + torque(t) - B_i q_i' - friction_i - waves_i(q_i) - sum_s a_si F_s
    F_s = c_s e_s + k_s e_s' + ...
    e_s = l_i(q_i) + l_j(q_j),  l(q) = a q + grow q^2 / 2 + sum_n (ecc_n / n) (sin(n q + ph_n) - sin ph_n)

All three plants have this form. Every effect, listed in the table or not, is a number in this record. The number is 0
(or unlimited) in a sound machine: one compiled solver serves all cases.
"""

from typing import Any

import numpy as np

NQ, NS, NU, NY, NH = 6, 6, 2, 3, 3  # nodes, springs, drives, sensors, harmonics
STOP, DAHL, SMOOTH = 0.0, 1.0, 2.0  # law of dry friction: elastic stop, exponential bristle, steep in speed
UP_DOWN, EDGES = 0.0, 1.0  # counters
ENDLESS = 1e30

NODE = (
    "J", "B", "friction_law", "F_C", "F_s", "v_s", "delta", "asym", "mu_load", "sigma0", "sigma1", "v_eps", "F_q",
    "F_neg", "v_neg", "w_neg", "k_pos", "k_pos3", "bump_F", "bump_at", "bump_w", "bump_drag", "det_a", "det_n",
    "det_play", "spot_F", "gyro", "ring_a", "ring_w", "ring_z", "ring_v", "warm_F",
)  # fmt: skip
SPRING = (
    "i", "j", "a_i", "a_j", "c", "k", "c3", "gap", "gap_smooth", "gap_damped", "pull_only", "limit", "creep",
    "par_a", "par_n", "grow_i", "rho_h",
)  # fmt: skip
DRIVE = (
    "node", "K", "amp", "w", "zeta", "current_limit", "offset", "band", "band_soft", "asym", "sat_A", "sat_soft",
    "lag", "sag", "sag_tau", "heat_gain", "heat_tau", "pulse_a", "pulse_f", "rms_A",
)  # fmt: skip
SENSOR = ("node", "kind", "gain", "relative", "cross", "creep", "phase")
LOOP = ("nq", "ns", "nu", "ny", "Ts", "delay", "cap_limit", "cap_creep", "sub")

MACHINE = np.dtype(
    [(f"q_{n}", "f8", (NQ,)) for n in NODE]
    + [("wave_a", "f8", (NQ, 4)), ("wave_n", "f8", (NQ, 4)), ("wave_ph", "f8", (NQ, 4)), ("load_on", "f8", (NQ, NS))]
    + [(f"s_{n}", "f8", (NS,)) for n in SPRING]
    + [("br_c", "f8", (NS, 2)), ("br_tau", "f8", (NS, 2)), ("ecc_i", "f8", (NS, NH)), ("ecc_pi", "f8", (NS, NH))]
    + [("ecc_j", "f8", (NS, NH)), ("ecc_pj", "f8", (NS, NH))]
    + [(f"d_{n}", "f8", (NU,)) for n in DRIVE]
    + [(f"y_{n}", "f8", (NY,)) for n in SENSOR]
    + [("rip_a", "f8", (NY, 2 * NH)), ("rip_n", "f8", (NY, 2 * NH)), ("rip_ph", "f8", (NY, 2 * NH))]
    + [(n, "f8") for n in LOOP]
)

LAW_NUMBERS = (
    "kind", "P", "D", "a", "Ts", "T1", "T2", "F", "allocation", "limit", "top", "step", "counts_to_q", "hidden",
    "n_sections", "kp", "kv",
)  # fmt: skip
LAW = np.dtype([(n, "f8") for n in LAW_NUMBERS] + [("sections", "f8", (6, 5))])


def blank() -> np.ndarray:
    """Machine record () without effects: all fields 0, limits out of reach."""
    m = np.zeros((), MACHINE)
    for name, value in (
        ("q_delta", 1.0), ("q_v_s", 1.0), ("q_v_eps", 1.0), ("q_sigma0", 1.0), ("q_bump_w", 1.0), ("q_w_neg", 1.0),
        ("q_det_n", 1.0), ("q_det_play", 1.0), ("q_ring_w", 1.0), ("s_limit", ENDLESS),
        ("cap_limit", ENDLESS), ("br_tau", 1.0), ("d_current_limit", ENDLESS), ("d_sat_A", ENDLESS),
        ("d_heat_tau", 1.0), ("y_phase", 0.5), ("y_gain", 1.0), ("y_relative", 1.0), ("q_J", 1.0), ("sub", 1.0),
        ("d_w", 1.0),        ("s_gap_damped", 1.0), ("d_zeta", 0.7), ("s_i", -1.0), ("s_j", -1.0),
    ):  # fmt: skip
        m[name] = value
    return m


def node(m: np.ndarray, i: int, **values: float) -> None:
    """Set fields of node `i`, in SI."""
    for name, value in values.items():
        m[f"q_{name}"][i] = value


def dry(m: np.ndarray, i: int, level: float, soft: float, law: float, v_eps: float) -> None:
    """Set dry friction of `level` (Nm or N): elastic within `soft` (rad or m), or steep within speed `v_eps`."""
    sigma0 = level / soft
    node(m, i, F_C=level, friction_law=law, sigma0=sigma0, v_eps=v_eps, sigma1=np.sqrt(sigma0 * float(m["q_J"][i])))


def spring(m: np.ndarray, i: int, j: int, a_i: float, a_j: float, c: float, k: float) -> int:
    """Add a spring and damper of elongation a_i q_i + a_j q_j; returns its number."""
    s = int(m["ns"])
    for name, value in (("i", i), ("j", j), ("a_i", a_i), ("a_j", a_j), ("c", c), ("k", k)):
        m[f"s_{name}"][s] = value
    m["ns"] = s + 1
    return s


def add_node(m: np.ndarray, J: float) -> int:
    """Add a free node of inertia J; returns its number."""
    i = int(m["nq"])
    m["nq"] = i + 1
    m["q_J"][i] = J
    return i


def drive(m: np.ndarray, d: int, **values: float) -> None:
    """Set fields of drive `d`."""
    for name, value in values.items():
        m[f"d_{name}"][d] = value


def sensor(m: np.ndarray, y: int, **values: float) -> None:
    """Set fields of sensor `y`."""
    for name, value in values.items():
        m[f"y_{name}"][y] = value


def law_record(**values: Any) -> np.ndarray:
    """A law record (); `sections` is a list of [b0, b1, b2, a1, a2]."""
    law = np.zeros((), LAW)
    for name, value in values.items():
        if name == "sections":
            law["n_sections"] = len(value)
            law["sections"][: len(value)] = value
        else:
            law[name] = value
    return law
