"""Precomputed result of loop shaping for the shipped linear drive: 50.2 Hz, 11.5 dB, 60.5 deg."""

from typing import Any

FIFTY_HERTZ: dict[str, Any] = {
    "sections": [
        {"kind": "lead_lag", "k": 83213.0, "alpha": 0.05, "tau_I": 7.8959, "beta": 82.862, "tau_D": 0.0014457},
        {"kind": "notch", "frequency": 110.76, "zeta_z": 0.15498, "zeta_p": 0.54745},
        {"kind": "notch", "frequency": 311.26, "zeta_z": 0.051327, "zeta_p": 0.052768},
        {"kind": "low_pass", "frequency": 1485.5},
    ]
}
