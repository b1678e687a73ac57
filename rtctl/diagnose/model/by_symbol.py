"""Model of a machine of exchange format 1: parameters of the plant equations by symbol, and terms of physics."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rtctl.case.format1 import Case, believed
from rtctl.case.quantities import Quantities, of_case, quantities
from rtctl.config.errors import UserError
from rtctl.diagnose.record.speed_sensor import signed
from rtctl.idiom import Settings
from rtctl.machines.profile import FREE_UNITS
from rtctl.machines.profiles import profile_of

if TYPE_CHECKING:
    from rtctl.diagnose.record.format1 import Record


class Model(NamedTuple):
    """Parameters by name (SI) and the terms of the `physics:` list."""

    kind: str
    base: dict[str, float]
    terms: tuple[Settings, ...] = ()
    units: Quantities = quantities(None)  # of an axis

    def change(self, **base: float) -> "Model":
        """Model with other parameters."""
        return self._replace(base={**self.base, **base})

    def tied(self, name: str) -> tuple[str, ...]:
        """Parameters that change together with `name`: `name` alone."""
        return (name,)

    def add(self, *terms: Settings) -> "Model":
        """Model with more terms."""
        return self._replace(terms=(*self.terms, *terms))


def owner_model(case: Case, record: "Record | None" = None) -> Model:
    """Nominal model without terms; the parameters in `case.estimated` are estimated from the record.

    Raises UserError where both M and K of an axis are unknown: a record shows only their ratio.
    """
    base = {k: v for k, v in believed(case).items() if v is not None}
    if profile_of(case.plant).has(FREE_UNITS) and record is not None and not {"M", "K"} & set(base):
        words = of_case(case).needed()
        raise UserError(
            f"{case.file}: neither parameters.M nor parameters.K is there: {words['M']} and {words['K']}; a recording "
            "shows only their ratio, so give one of them (with K: 1 the command is the force)"
        )
    if case.estimated and record is not None:
        found = guess(record, base)
        if "M" in base:  # known in kg or kg m^2, so the record gives the force of one unit of the command
            found = {"K": base["M"] / found["M"]}
        base |= {name: found[name] for name in case.estimated}
    return Model(case.plant, base, units=of_case(case))


def guess(record: "Record", base: dict[str, float]) -> dict[str, float]:
    """Estimates of M, F_v and k of an axis without nominal values: least squares on U = (k + j w F_v - w^2 M) X.

    The held input is half a tick late; frequencies are weighted by their power. Source: Pintelon & Schoukens, System
    Identification (2012), ch. 8.
    """
    window = np.hanning(len(record.t))
    name, y = next(iter(record.y.items()))
    if name == "speed":
        y = signed(y, record.u[:, 0])
    x = np.fft.rfft((y - np.mean(y)) * window)
    u = np.fft.rfft((record.u[:, 0] - np.mean(record.u[:, 0])) * window) * base.get("K", 1.0)
    w = 2 * np.pi * np.fft.rfftfreq(len(record.t), record.dt)
    loud = (np.abs(u) > 0.05 * np.abs(u).max()) & (w > 0)
    u = u[loud] * np.exp(-0.5j * w[loud] * record.dt)
    if name == "speed":
        x[loud] /= 1j * w[loud]
    A = np.stack([x[loud], 1j * w[loud] * x[loud], -(w[loud] ** 2) * x[loud]], axis=1)
    size = np.abs(A).max(axis=0)
    A, b = np.concatenate([A.real, A.imag]) / size, np.concatenate([u.real, u.imag])
    k, F_v, M = np.linalg.lstsq(A, b, rcond=None)[0] / size
    return {"M": abs(M), "F_v": max(F_v, 1e-3 * abs(M) * np.sqrt(abs(k / M))), "k": max(k, 0.0)}
