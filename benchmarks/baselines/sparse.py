"""PySINDy on smoothed states: acceleration as a sparse sum of candidate functions of position, speed and command.

PySINDy is no dependency of rtctl; without it this baseline is left out. Functions of the nominal model (mass, described
friction) count as known. The largest other functions give the names.

Source: Brunton, Proctor & Kutz, PNAS 113 (2016); Kaptanoglu et al., PySINDy, JOSS 7 (2022).
"""

import importlib.util
import warnings
from typing import Any

import numpy as np

from baselines.form import diagnosis
from baselines.states import States, states
from rtctl.diagnose.record.format1 import Record

THRESHOLD = 0.02  # least coefficient, with columns and acceleration scaled to unit rms
NAMES = {
    "1": "drive.offset", "v": "friction.viscous", "sign(v)": "friction.coulomb", "|v|": "friction.asymmetry",
    "x": "load.spring", "|u|": "drive.gain_asymmetry", "u^2": "drive.gain_asymmetry", "cos(x)": "load.imbalance",
    "sin(x)": "load.imbalance", "x u": "geometry.radius_change",
    "exp(-v^2)": "friction.stribeck", "u^3": "drive.saturation", "|u| sign(v)": "friction.load",
}  # fmt: skip


def available() -> bool:
    return importlib.util.find_spec("pysindy") is not None


def library(s: States) -> dict[str, np.ndarray]:
    """Candidate functions by name, (n,) each."""
    v, x, u = s.v / _rms(s.v), s.x / _rms(s.x), s.effort / _rms(s.effort)
    sign = np.sign(v)
    out = {
        "u": u, "1": np.ones_like(v), "v": v, "x": x, "sign(v)": sign, "|v|": np.abs(v), "v^2": v**2,
        "v|v|": v * np.abs(v), "v^3": v**3, "x^2": x**2, "x v": x * v, "x u": x * u, "u v": u * v, "u^2": u**2,
        "|u|": np.abs(u), "u^3": u**3,
        "|u| sign(v)": np.abs(u) * sign, "exp(-v^2)": sign * np.exp(-((v / 0.1) ** 2)),
    }  # fmt: skip
    if s.capstan is not None:
        out |= {"cos(x)": np.cos(s.capstan), "sin(x)": np.sin(s.capstan)}
    return out


def known(s: States) -> set[str]:
    """Names of the functions in the nominal model."""
    out = {"u"}
    out |= {"v"} if s.has_viscous else set()
    out |= {"sign(v)"} if s.has_coulomb else set()
    return out | ({"x"} if s.has_spring else set())


def diagnose(record: Record) -> dict[str, Any]:
    """Diagnosis with the names of the largest functions kept by sparse regression and missing in the nominal model."""
    import pysindy

    s = states(record)
    functions = library(s)
    columns = np.column_stack([f / _rms(f) for f in functions.values()])
    target = (s.a / _rms(s.a))[:, None]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = pysindy.SINDy(
            optimizer=pysindy.STLSQ(threshold=THRESHOLD, alpha=1e-3), feature_library=pysindy.IdentityLibrary()
        )
        # columns are inputs; the derivative of the only state is the acceleration
        model.fit(s.v[:, None] / _rms(s.v), t=1.0, x_dot=target, u=columns)
    weights = np.abs(np.asarray(model.coefficients())[0])[1:]  # without the state itself
    found = [name for name, w in sorted(zip(functions, weights, strict=True), key=lambda p: -p[1]) if w > 0.0]
    left = [name for name in found if name not in known(s)]
    names = list(dict.fromkeys(NAMES[name] for name in left if name in NAMES))
    return diagnosis(record.plant, names[:3], unnamed=bool(left))


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2))) or 1.0
