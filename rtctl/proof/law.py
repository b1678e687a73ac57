"""Control laws, tick by tick: the solver runs them, and `recompute` repeats them from a recording.

Kinds: 0 two reels, PD with an allocation over two motors; 1 sections in series on the position error; 2 cascade of a
position and a speed gain (EMPS). Units: rad or m in, V out, clipped and rounded to the DAC step.
"""

import math
from typing import Any

import numpy as np

from rtctl.proof import machine
from rtctl.proof.compiled import compiled

IVU, SECTIONS, CASCADE = 0.0, 1.0, 2.0
PULL, DIFFERENTIAL, MOTOR1, MOTOR2 = 0.0, 1.0, 2.0, 3.0
ALLOCATIONS = {"pull": PULL, "differential": DIFFERENTIAL, "motor1": MOTOR1, "motor2": MOTOR2}
NL = 32  # states of a law


@compiled
def dac(u, limit, top, step):
    """Voltage clipped to +-limit, rounded to the step, and limited to the codes of the converter."""
    u = min(max(u, -limit), limit)
    if step <= 0.0:
        return u
    return min(np.rint(u / step) * step, top)


@compiled
def law_tick(law, s, first, ref, w, reading, u):
    """One tick: reading (counts, or m) and reference in, voltages out in `u` (2,). `s` (NL,) is the law's state."""
    kind = int(law.kind)
    if kind == 0:
        e = ref - law.counts_to_q * reading
        if first:
            s[0] = e
            s[2] = ref
        s[1] += law.a * ((e - s[0]) / law.Ts - s[1])
        s[0] = e
        s[3] += law.hidden * e * law.Ts
        uc = law.P * e + law.D * s[1] + s[3] + law.F * np.sign(ref - s[2]) + w
        s[2] = ref
        how = int(law.allocation)
        u1, u2 = law.T1, law.T2
        if how == 0:
            u1 += max(uc, 0.0)
            u2 += max(-uc, 0.0)
        elif how == 1:
            u1 += uc / 2
            u2 -= uc / 2
        elif how == 2:
            u1 += uc
        else:
            u2 -= uc
        u[0] = dac(u1, law.limit, law.top, law.step)
        u[1] = dac(u2, law.limit, law.top, law.step)
    elif kind == 1:
        x = ref - law.counts_to_q * reading
        for i in range(int(law.n_sections)):
            b = law.sections[i]
            o = 4 * i
            y = b[0] * x + b[1] * s[o] + b[2] * s[o + 1] - b[3] * s[o + 2] - b[4] * s[o + 3]
            s[o + 1] = s[o]
            s[o] = x
            s[o + 3] = s[o + 2]
            s[o + 2] = y
            x = y
        s[28] += law.hidden * (ref - law.counts_to_q * reading) * law.Ts
        u[0] = dac(x + s[28] + w, law.limit, law.top, law.step)
    else:
        x = law.counts_to_q * reading
        if first:
            s[0] = x
            s[1] = x
        v = (x - s[1]) / (2.0 * law.Ts)  # backward difference of the mean of two: (x_k - x_k-2) / 2 Ts
        s[1] = s[0]
        s[0] = x
        s[3] += law.hidden * (ref - x) * law.Ts
        u[0] = dac(law.kp * law.kv * (ref - x) - law.kv * v + s[3] + w, law.limit, law.top, law.step)


@compiled
def replay(law, ref, w, reading, u):
    """Run the law over a whole recording; fills u (n, 2) in V."""
    s = np.zeros(NL)
    for k in range(len(ref)):
        law_tick(law, s, k == 0, ref[k], w[k], reading[k], u[k])


def from_case(case: dict[str, Any]) -> np.ndarray:
    """Law record described by case.json."""
    c, d, sensors, p = case["controller"], case["drive"], case["sensors"], case["parameters"]
    Ts = 1.0 / case["sample_rate"]
    limit = d["limit_volt"]
    reach = d.get("dac_range_volt", limit)
    step = 2.0 * reach / 2 ** d["dac_bits"] if "dac_bits" in d else 0.0
    common = {"Ts": Ts, "limit": limit, "top": reach - step, "step": step}
    if case["plant"] == "ivu":
        per_volt = [p[f"K_m{i + 1}"] * d["amp_per_volt"][i] for i in range(2)]
        return machine.law_record(
            kind=IVU, P=c["P"], D=c["D"], a=1.0 - math.exp(-2.0 * math.pi * c["derivative_filter_hz"] * Ts),
            T1=c["tension_N"] * p["R1"] / per_volt[0], T2=c["tension_N"] * p["R2"] / per_volt[1],
            F=c["friction_Nm"] / per_volt[0], allocation=ALLOCATIONS[c["allocation"]],
            counts_to_q=2.0 * math.pi / sensors["capstan_counts_per_rev"], **common,
        )  # fmt: skip
    if case["plant"] == "ldu":
        to_m = p["R_c"] * 2.0 * math.pi / sensors["encoder_counts_per_rev"]
        return machine.law_record(kind=SECTIONS, sections=c["sections"], counts_to_q=to_m, **common)
    if c["kind"] == "cascade_p_v":
        return machine.law_record(kind=CASCADE, kp=c["kp"], kv=c["kv"], counts_to_q=1.0, **common)
    return machine.law_record(kind=SECTIONS, sections=c["sections"], counts_to_q=1.0, **common)


def reading_of(case: dict[str, Any], columns: dict[str, np.ndarray]) -> np.ndarray:
    """Feedback column (n,) of the law."""
    name = {"ivu": "capstan_counts", "ldu": "encoder_counts", "axis": "x"}[case["plant"]]
    return np.asarray(columns[name], float)


def recompute(case: dict[str, Any], columns: dict[str, np.ndarray]) -> np.ndarray:
    """Voltages (n, 2) of the law in case.json for recorded columns, in V; the second is 0 with one drive."""
    u = np.zeros((len(columns["t"]), 2))
    replay(from_case(case)[()], columns["ref"], columns["w"], reading_of(case, columns), u)
    return u
