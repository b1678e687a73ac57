"""Shared fixtures of the diagnosis: recordings of an axis, simulated and quantised."""

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from known_records import SENSORS, at_rest, of_closed
from threadpoolctl import threadpool_limits

from rtctl.case.format1 import read_case
from rtctl.diagnose.model.by_symbol import Model, owner_model
from rtctl.diagnose.record.format1 import Record, check
from rtctl.plants.physics import TERMS

SHARED = Path(__file__).parents[3] / "shared"
STEP = 2e-6  # m, encoder resolution
RATE, SECONDS = 1000.0, 8.0
CASE: dict[str, Any] = {
    "format": 1,
    "plant": "axis",
    "sample_rate": RATE,
    "parameters": {"M": 95.0, "F_v": 200.0, "F_c": 20.0},
    "sensors": {"x_resolution_m": STEP},
    "drive": {"newton_per_volt": 35.0, "limit_volt": 10.0},
    "delay_samples": 0.0,
    "controller": {"kind": "cascade_p_v", "kp": 160.0, "kv": 243.0},
    "controller_known": True,
    "reaches": {"parameter_tolerance": 0.15},
}

IVU_CASE: dict[str, Any] = {
    "format": 1,
    "plant": "ivu",
    "sample_rate": 500.0,
    "parameters": {"R1": 0.035, "R2": 0.028, "d_tape": 0.0, "tau_F1": 2.4e-3, "tau_F2": 2.6e-3},
    "sensors": {"capstan_counts_per_rev": 10000, "reel_counts_per_rev": 209},
    "drive": {"amp_per_volt": [0.2, 0.2], "limit_volt": 10.0, "dac_bits": 12, "bandwidth_hz": 3000.0, "damping": 0.7},
    "delay_samples": 1.0,
    "controller": {"kind": "pd", "P": 4.3, "D": 0.7, "derivative_filter_hz": 80.0, "tension_N": 0.08},
    "reaches": {"parameter_tolerance": 0.15, "radius_tolerance": 0.02},
}
LDU_CASE: dict[str, Any] = {
    "format": 1,
    "plant": "ldu",
    "sample_rate": 10e3,
    "parameters": {"F_c": 5.0, "B_m": 0.5},
    "sensors": {"encoder_counts_per_rev": 20000, "scale_m_per_count": 0.5e-6},
    "drive": {"amp_per_volt": [0.1], "limit_volt": 3.0, "dac_bits": 12, "current_limit": 0.3},
    "delay_samples": 1.0,
    "controller": {"kind": "unknown"},
    "reaches": {"parameter_tolerance": 0.15},
}
CASES = {"axis": CASE, "ivu": IVU_CASE, "ldu": LDU_CASE}


def command(n: int) -> np.ndarray:
    """Reference (n,) in m: two slow sines with stops at both ends.

    Every speed and position occurs in both directions; the stops separate asymmetric friction from a constant force.
    """
    t = np.arange(n) / RATE
    return np.clip(0.05 * (1 - np.cos(2 * np.pi * 0.4 * t)) + 0.01 * np.sin(2 * np.pi * 1.3 * t), 0.01, 0.09) - 0.01


class Axis(NamedTuple):
    """Recording of the axis and its true model."""

    record: Record
    model: Model


def record_axis(*physics: dict[str, Any], seconds: float = SECONDS, step: float = STEP, **true: float) -> Axis:
    """Recording of the axis with the terms `physics`; `true` parameters differ from the nominal values.

    The law used the unquantised reading, so the recorded command is the input.
    """
    case, n = read_case(CASE, "."), round(RATE * seconds)
    model = owner_model(case).change(**true).add(*(TERMS[p["term"]].settings(**p) for p in physics))
    made = of_closed(at_rest(case, n, command(n)), model)
    x = np.round(made.y["x"] / step) * step
    columns = {"t": made.t, "ref": made.ref, "w": made.w, "u": made.u[:, 0], "x": x}
    return Axis(check(columns, case._replace(controller_known=False)), model)


@pytest.fixture(scope="session")
def blank() -> Callable[..., Record]:
    """`blank("ivu", u, y)`: record of a plant with volts u (n, drives) and readings y (n,) of the main sensor."""

    def make(plant: str, u: np.ndarray, y: np.ndarray | None = None, **changes: Any) -> Record:
        case = read_case({**CASES[plant], **changes}, ".")
        n, dt = len(u), 1 / float(case.sample_rate or 1.0)
        zero = np.zeros(n)
        readings = {name: zero if y is None else np.array(y, float) for name in SENSORS[plant]}
        return Record(plant, case, np.arange(n) * dt, dt, zero, zero, u.reshape(n, -1), readings, {})

    return make


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    """One thread of linear algebra: more threads slow down small matrices."""
    with threadpool_limits(1):
        yield


@pytest.fixture(scope="session")
def make_axis() -> Callable[..., Axis]:
    """`make_axis({"term": ...}, M=100.0)`: recording with these terms and parameters, cached."""

    @lru_cache
    def made(physics: tuple, options: tuple) -> Axis:
        return record_axis(*(dict(p) for p in physics), **dict(options))

    def make(*physics: dict[str, Any], **options: float) -> Axis:
        return made(tuple(tuple(p.items()) for p in physics), tuple(sorted(options.items())))

    return make


@pytest.fixture(scope="session")
def plain(make_axis: Callable[..., Axis]) -> Axis:
    """Axis without extra terms; the nominal values of the owner are wrong."""
    return make_axis(M=100.0, F_v=180.0, F_c=22.0)


@pytest.fixture(scope="session")
def practice() -> Path:
    """Folder of the practice bundles beside the project; without the folder the test is skipped."""
    folder = SHARED / "blind" / "practice"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not here")
    return folder


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of recordings of real machines beside the project; without the folder the test is skipped."""
    folder = SHARED / "data"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not here")
    return folder
