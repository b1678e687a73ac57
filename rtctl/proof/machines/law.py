"""Controller: PID on a position, or PI on a speed, for several drives with a preload; or a recorded command."""

from typing import Any

import numpy as np

from rtctl.proof.machines.arrays import ND
from rtctl.proof.machines.compiled import compiled

FIELDS = ("kp", "kd", "ki", "ki_settle", "tau", "unit", "sensor", "file", "limit", "step", "top", "Ts", "n")


def law_record(pre: tuple[float, ...] = (0.0,), share: tuple[float, ...] = (1.0,), **values: float) -> np.ndarray:
    """Record () of a law: gains in command units per unit of the sensor; `unit` is sensor units per quantum."""
    kinds: list[Any] = [(name, float) for name in FIELDS] + [("pre", float, (ND,)), ("share", float, (ND,))]
    law = np.zeros((), kinds)
    for name, value in values.items():
        law[name] = value
    law["pre"][: len(pre)], law["share"][: len(share)] = pre, share
    return law


@compiled
def law_tick(law, s, settle, ref, w, y, u):
    """One tick: readings `y` in quanta and reference in, commands out in `u` (ND,). `s` (4,) is its state."""
    Ts = law.Ts
    if law.file != 0.0:
        uc = 0.0
    else:
        e = ref - law.unit * y[int(law.sensor)]
        if s[3] == 0.0:
            s[0], s[3] = e, 1.0
        a = 1.0 - np.exp(-Ts / law.tau)
        s[1] += a * ((e - s[0]) / Ts - s[1])
        s[0] = e
        ki = law.ki_settle if settle else law.ki
        s[2] += ki * e * Ts
        s[2] = min(max(s[2], -law.limit), law.limit)
        uc = law.kp * e + law.kd * s[1] + s[2]
    for d in range(int(law.n)):
        v = law.share[d] * (uc + w) + law.pre[d]
        v = min(max(v, -law.limit), law.limit)
        if law.step > 0.0:
            v = min(np.rint(v / law.step) * law.step, law.top)
        u[d] = v
