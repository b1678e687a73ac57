"""PD by bandwidth and damping: the process is taken as K_p / s^2 and the closed loop gets w_n and zeta.

    K_p = |P| w^2        G = w_n^2 / K_p        tau_d = 2 zeta / w_n

Source: thesis 5.4 and 8.2 (K_p at 1 Hz, w_n = 4 pi, zeta = 1: G = 6.2 A/rad, tau_d = 0.16 s).
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.design import response
from rtctl.laws import pd


class PdDesign(NamedTuple):
    K_p: float  # position per s^2 per V
    gain: float  # V per unit of error
    tau_d: float  # s


def design(config: Any, w_n: float, zeta: float = 1.0, at: float = 1.0, motor: int = 1) -> PdDesign:
    """PD for the plant of a config: bandwidth `w_n` in rad/s, damping `zeta`, process gain taken `at` Hz.

    Raises ValueError where one of them is not positive.
    """
    f = np.array([at])
    return of_points(f, response.plant(config, f, motor), w_n, zeta, at)


def of_points(f: np.ndarray, P: np.ndarray, w_n: float, zeta: float = 1.0, at: float = 1.0) -> PdDesign:
    """PD for a plant response `P` (n,) known at `f` (n,) Hz, such as an identified one; K_p is taken `at` Hz.

    Raises NoAnswer where `at` lies outside the band, ValueError where something is not positive.
    """
    if not f[0] * (1 - 1e-9) <= at <= f[-1] * (1 + 1e-9):
        raise NoAnswer(f"the response runs from {f[0]:g} to {f[-1]:g} Hz; the process gain at {at:g} Hz is not in it")
    K_p = float(np.exp(np.interp(np.log(at), np.log(f), np.log(np.abs(P))))) * (2 * np.pi * at) ** 2
    return PdDesign(K_p, *pd.design(K_p, w_n, zeta))


def applied(config: Any, found: PdDesign) -> Any:
    """The config with a PD as its position law; a derivative filter of the former law stays."""
    from rtctl.config.load import set_path

    values: dict[str, Any] = {"gain": found.gain, "tau_d": found.tau_d}
    if getattr(config.law.position, "kind", "pd") == "pd":
        for name, value in values.items():
            config = set_path(config, f"law.position.{name}", value)
        return config
    return set_path(config, "law.position", {"kind": "pd", **values})
