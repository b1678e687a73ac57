"""Record of the true machine: a field for each parameter, a row for each body, joint, drive or sensor; SI units.

Fields of effects are neutral by default: a machine without missing physics sets only its described values.
"""

from typing import Any

import numpy as np

NB, NJ, ND, NS = 6, 7, 2, 5  # capacity: bodies, joints, drives, sensors
NH, NG, NE, NW = 3, 2, 4, 3  # harmonics, gravity entries, friction elements, wells
ENDLESS = 1e30
GRAVITY = 9.81  # m/s^2

PRANDTL, DAHL, IWAN = 0.0, 1.0, 2.0  # laws of dry friction before sliding
FORCE, VOLTAGE = 0.0, 1.0  # kinds of drive
POSITION, SPEED, ACCELERATION, STRETCH, LOAD, CURRENT = (float(k) for k in range(6))  # what a sensor measures

BODY: dict[str, tuple[int, float]] = {  # field -> (columns, default)
    "b_J": (0, 1.0), "b_B": (0, 0.0), "b_F": (0, 0.0), "b_coord": (0, 0.0), "b_ratio": (0, 1.0),
    "b_sigma": (0, 1.0), "b_damp": (0, 0.0), "b_law": (0, PRANDTL),  # bristle: N/m, N s/m
    "b_Fs": (0, 0.0), "b_vs": (0, 1.0), "b_fall": (0, 0.0),  # Stribeck: height, speed, form of the fall
    "b_as": (0, 0.0), "b_Bas": (0, 0.0),  # asymmetry of dry (share) and viscous friction
    "b_mu": (0, 0.0), "b_mu_g": (0, 0.0),  # friction by joint force and by gravity load
    "b_quad": (0, 0.0), "b_power": (0, 2.0),  # drag
    "b_pF": (0, 0.0), "b_pform": (0, 0.0), "b_pat": (0, 0.0), "b_pw": (0, 1.0),  # dry friction by position
    "b_warm": (0, 0.0), "b_warm_tau": (0, 1.0),  # dry friction that decreases with running time
    "b_g": (NG, 0.0), "b_ga": (NG, 0.0), "b_gc": (0, 0.0),  # gravity of the description: m g r, angle; constant
    "b_gx": (0, 0.0), "b_gxa": (0, 0.0), "b_gxc": (0, 0.0),  # gravity missing in the description
    "b_im": (0, 0.0), "b_ima": (0, 0.0),  # imbalance
    "b_cog": (NH, 0.0), "b_cogn": (NH, 1.0), "b_coga": (NH, 0.0),
    "b_k": (0, 0.0), "b_k3": (0, 0.0), "b_ksat": (0, ENDLESS), "b_x0": (0, 0.0),
    "b_hump": (0, 0.0), "b_humpform": (0, 0.0), "b_humpat": (0, 0.0), "b_humpw": (0, 1.0),
    "b_Ja": (0, 0.0), "b_Jn": (0, 1.0), "b_Jp": (0, 0.0),  # inertia by angle
    "b_eddy": (0, 0.0), "b_eddyv": (0, 1.0), "b_well": (0, 0.0), "b_wellat": (NW, 0.0), "b_wellw": (0, 1.0),
    "b_cross": (0, 0.0), "b_crossj": (0, 0.0), "b_wander": (0, 0.0), "b_wanderf": (0, 1.0),
    "b_neg": (0, 0.0), "b_negv": (0, 1.0), "b_negw": (0, 1.0), "b_relax": (0, 0.0), "b_relaxtau": (0, 1.0),
}  # fmt: skip
JOINT: dict[str, tuple[int, float]] = {
    "j_a": (0, 0.0), "j_b": (0, 0.0), "j_n": (0, 1.0), "j_k": (0, 0.0), "j_d": (0, 0.0), "j_rigid": (0, 0.0),
    "j_gap": (0, 0.0), "j_soft": (0, 0.0), "j_beta": (0, 0.0), "j_e0": (0, 1.0), "j_p": (0, 2.0),
    "j_H": (0, 0.0), "j_z0": (0, 1.0), "j_Hlaw": (0, DAHL), "j_limit": (0, ENDLESS), "j_eta": (0, 0.0),
    "j_creep": (0, 0.0), "j_creepv": (0, 0.0), "j_rip": (NH, 0.0), "j_ripn": (NH, 1.0), "j_ripa": (NH, 0.0),
    "j_ripend": (0, 0.0), "j_par": (0, 0.0), "j_parf": (0, 1.0), "j_loose": (0, 0.0), "j_loosetau": (0, 1.0),
}  # fmt: skip
DRIVE: dict[str, tuple[int, float]] = {
    "d_kind": (0, FORCE), "d_at": (0, 0.0), "d_gain": (0, 1.0), "d_Kt": (0, 1.0), "d_R": (0, 1.0), "d_L": (0, 0.0),
    "d_w": (0, 0.0), "d_z": (0, 0.7), "d_offset": (0, 0.0), "d_band": (0, 0.0), "d_bandsoft": (0, 0.0),
    "d_asym": (0, 0.0), "d_sat": (0, ENDLESS), "d_satsoft": (0, 0.0), "d_lag": (0, 0.0), "d_lag2": (0, 0.0),
    "d_heat": (0, 0.0), "d_heattau": (0, 1.0), "d_heatref": (0, 1.0), "d_sag": (0, 0.0), "d_sagtau": (0, 0.0),
    "d_sagref": (0, 1.0), "d_emf": (0, 0.0), "d_emftau": (0, 0.0), "d_slew": (0, ENDLESS), "d_slewsoft": (0, 0.0),
    "d_rip": (NH, 0.0), "d_ripn": (NH, 1.0), "d_ripa": (NH, 0.0), "d_pulse": (0, 0.0), "d_pulsef": (0, 1.0),
}  # fmt: skip
SENSOR: dict[str, tuple[int, float]] = {
    "s_what": (0, POSITION), "s_at": (0, 0.0), "s_gain": (0, 1.0), "s_phase": (0, 0.0), "s_rel": (0, 1.0),
    "s_rip": (NH, 0.0), "s_ripn": (NH, 1.0), "s_ripa": (NH, 0.0), "s_lag": (0, 0.0), "s_lag2": (0, 0.0),
    "s_rect": (0, 0.0), "s_cross": (0, 0.0), "s_counter": (0, 1.0),
}  # fmt: skip
SCALAR: dict[str, float] = {"nb": 0.0, "nj": 0.0, "nd": 0.0, "ns": 0.0, "Ts": 1e-3, "sub": 20.0, "delay": 1.0}


def _dtype() -> list[Any]:
    out: list[Any] = [(name, float) for name in SCALAR]
    for rows, fields in ((NB, BODY), (NJ, JOINT), (ND, DRIVE), (NS, SENSOR)):
        out += [(name, float, (rows, n) if n else (rows,)) for name, (n, _) in fields.items()]
    return out


def neutral() -> np.ndarray:
    """Record () of a machine without bodies and effects."""
    m = np.zeros((), _dtype())
    for name, value in SCALAR.items():
        m[name] = value
    for fields in (BODY, JOINT, DRIVE, SENSOR):
        for name, (_, value) in fields.items():
            m[name] = value
    return m


def coordinates(m: np.ndarray) -> None:
    """Fill b_coord and b_ratio: bodies behind rigid joints share the coordinate of the joined body."""
    nb, nj = int(m["nb"]), int(m["nj"])
    m["b_coord"], m["b_ratio"] = np.arange(NB), 1.0
    for _ in range(nb):
        for j in range(nj):
            a, b, n = int(m["j_a"][j]), int(m["j_b"][j]), float(m["j_n"][j])
            if m["j_rigid"][j] and m["b_coord"][a] != m["b_coord"][b]:
                old, into = m["b_coord"][b], m["b_coord"][a]
                by = n * float(m["b_ratio"][a]) / float(m["b_ratio"][b])
                for i in range(nb):
                    if m["b_coord"][i] == old:
                        m["b_coord"][i] = into
                        m["b_ratio"][i] *= by


def add_body(m: np.ndarray, J: float) -> int:
    """Index of a new body of inertia `J`, free, without friction."""
    i = int(m["nb"])
    assert i < NB, "no room for another body"
    m["nb"] += 1
    m["b_J"][i], m["b_coord"][i] = J, i
    return i


def add_joint(m: np.ndarray, a: int, b: int, n: float, k: float, d: float) -> int:
    """Index of a new spring-damper joint from body `a` to `b` with ratio `n`."""
    j = int(m["nj"])
    assert j < NJ, "no room for another joint"
    m["nj"] += 1
    for name, value in (("j_a", a), ("j_b", b), ("j_n", n), ("j_k", k), ("j_d", d)):
        m[name][j] = value
    return j


def bristles(m: np.ndarray, natural: float = 4000.0) -> None:
    """Set the presliding stiffness for a natural frequency of `natural` rad/s: deflections far below a count."""
    for i in range(int(m["nb"])):
        c = m["b_coord"][i]
        J = sum(m["b_ratio"][k] ** 2 * m["b_J"][k] for k in range(int(m["nb"])) if m["b_coord"][k] == c)
        J /= m["b_ratio"][i] ** 2
        m["b_sigma"][i] = J * natural**2
        m["b_damp"][i] = 0.6 * J * natural
