"""Cases of exchange format 1 as JSON data."""

import copy
from typing import Any

IVU = {
    "format": 1,
    "plant": "ivu",
    "sample_rate": 500.0,
    "parameters": {"R1": 0.038, "R2": 0.022, "J_m1": 0.0015, "K_m1": 0.06, "K_m2": 0.05, "tau_F1": 0.0024},
    "sensors": {"capstan_counts_per_rev": 10000, "reel_counts_per_rev": 209},
    "drive": {"amp_per_volt": [0.2, 0.2], "limit_volt": 10.0, "dac_bits": 12},
    "delay_samples": 1.0,
    "controller": {"kind": "pd", "P": 6.2, "D": 1.0, "derivative_filter_hz": 80.0, "tension_N": 0.1},
    "controller_known": True,
    "reaches": {"parameter_tolerance": 0.15, "radius_tolerance": 0.02},
    "notes": "free text",
}
LDU = {
    "format": 1,
    "plant": "ldu",
    "sample_rate": 1000.0,
    "parameters": {"R_c": 0.003, "M": 1.25, "N": 20.0},
    "sensors": {"encoder_counts_per_rev": 20000, "scale_m_per_count": 5e-7},
    "drive": {"amp_per_volt": [0.1], "limit_volt": 3.0, "dac_bits": 12},
    "delay_samples": 1.0,
    "controller": {"kind": "lead_lag", "sections": [[2000.0, -1900.0, 0.0, -0.5, 0.0], [0.5, 0.25, 0.0, -0.2, 0.1]]},
    "controller_known": True,
}
AXIS = {
    "format": 1,
    "plant": "axis",
    "sample_rate": 1000.0,
    "parameters": {"M": 95.0},
    "drive": {"newton_per_volt": 35.0, "limit_volt": 10.0},
    "sensors": {"x_resolution_m": 5e-8},
    "delay_samples": 0.0,
    "controller": {"kind": "cascade_p_v", "kp": 160.0, "kv": 243.0},
    "controller_known": True,
    "reaches": {"parameter_tolerance": 0.15},
}
WRITTEN = {"ivu": IVU, "ldu": LDU, "axis": AXIS}  # cases as JSON data


def case_of(kind: str, **changes: Any) -> dict[str, Any]:
    """A case; `parameters__R1=1` goes one level down."""
    case = copy.deepcopy(WRITTEN[kind])
    for key, value in changes.items():
        *path, last = key.split("__")
        place = case
        for part in path:
            place = place.setdefault(part, {})
        place[last] = value
    return case
