"""Plant model of a machine as a function of named parameters, at the reel radii and motor of a response.

    H = P(j w) sinc(f T) e^(-j w tau)         hold T = 1/rate, delay tau = T_s/2 + T_c  (8.2)

P is `state_space` of the plant with the given parameters. On a reel unit with equal sides one name stands for both
sides: J_m for J_m1 and J_m2, likewise c_m, k_m, c, k and K_m.

Source: thesis 4.9-4.17, 8.2 and appendix F, through rtctl.plants.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rtctl.design import response
from rtctl.identify.frf import Frf, drive
from rtctl.machines.profiles import profile_of

F_GAIN = 1.0  # Hz, frequency of the process gain (8.2)


def keys(kind: str, name: str) -> tuple[str, ...]:
    """Keys of the plant's parameters for a name."""
    return profile_of(kind).pairs.get(name, (name,))


class Model:
    """Plant of a machine as a function of named parameters."""

    def __init__(self, config: Any, names: Sequence[str]):
        self.config, self.kind = config, config.kind
        self.parts = response.take(config)
        self.base = profile_of(self.kind).plant.parameters(config.plant)
        self.start = {name: float(getattr(self.base, keys(self.kind, name)[0])) for name in names}

    def settings(self, values: Mapping[str, float]) -> Any:
        """Settings of the plant with these parameter values."""
        given = self.config.plant.parameters.model_dump(exclude_unset=True)
        for name, value in values.items():
            given.update(dict.fromkeys(keys(self.kind, name), value))
        plant = self.config.plant
        return plant.model_copy(update={"parameters": type(plant.parameters)(**given)})

    def linear(self, values: Mapping[str, float], frf: Frf) -> response.Model:
        """Plant linearised at the radii of a response and driven by its motor."""
        profile, blocks = profile_of(self.kind), self.parts.blocks
        assert profile.response is not None and profile.model is not None
        p = profile.response.params(self.settings(values), frf.R1, frf.R2)
        if "allocation" in blocks:  # only the motor of the response
            blocks = {**blocks, "allocation": blocks["allocation"]._replace(kind=1 + frf.motor)}
        return profile.model(self.config, p, blocks, frf.motor)

    def response(self, values: Mapping[str, float], frf: Frf, tau: float) -> np.ndarray:
        """Model response (n,) at the lines of `frf`, with hold and delay `tau` in s; per ampere where `frf` is."""
        P = response.plant_response(self.linear(values, frf), frf.f)
        if frf.per_ampere:
            P = P / drive(self.config, frf.f)
        return P * np.sinc(frf.f * frf.dt) * np.exp(-2j * np.pi * frf.f * tau)

    def process_gain(self, values: Mapping[str, float], frf: Frf) -> float:
        """|H| (2 pi f)^2 per ampere at 1 Hz, rad/s^2/A or m/s^2/A (8.2), without hold and delay."""
        f = np.array([F_GAIN])
        H = response.plant_response(self.linear(values, frf), f) / drive(self.config, f)
        return float(np.abs(H[0]) * (2 * np.pi * F_GAIN) ** 2)


def process_gain(config: Any, frf: Frf) -> float:
    """Process gain at 1 Hz of the model in a config, at the radii of a response; rad/s^2/A or m/s^2/A."""
    return Model(config, ()).process_gain({}, frf)
