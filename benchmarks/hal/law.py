"""The law of law.hal with steps of rtctl, two `pd` and a `low_pass`, in a thread of the same rate.

Timing as in HAL: the CPU's time stamp counter is read before the first step and after each step.
"""

import platform
import threading
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types

from rtctl.idiom import fill_record, record_dtype, state
from rtctl.laws import low_pass, pd
from rtctl.loop.realtime import RealTime
from rtctl.tick import clock
from rtctl.tick.memory import intrinsic

STATE = state(first=pd.PD_STATE, smooth=low_pass.BIQUAD_STATE, second=pd.PD_STATE, a=float, b=float, c=float)
X86 = platform.machine() in ("x86_64", "AMD64")


@intrinsic
def cycles(typing_context):
    """Time stamp counter of the CPU, as read by rtapi_get_clocks(). Acts as a barrier for memory accesses."""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.IntType(64), [])
        return builder.call(builder.module.declare_intrinsic("llvm.readcyclecounter", fnty=kind), [])

    return types.int64(), codegen


counter: Any = cycles if X86 else clock.now


@njit(nogil=True, error_model="numpy")
def _run(p, s, took, period):
    """Wake every `period` ns; `took[k]` is the time of tick k in counts. Returns counts per ns."""
    wake = clock.now() + period
    begun_ns, begun = clock.now(), counter()
    for k in range(len(took)):
        clock.sleep_until(wake)
        before = counter()
        s[0].a = pd.step(p[0].first, s[0].first, 1.0 - s[0].b)
        at_a = counter()
        s[0].b = low_pass.step(p[0].smooth, s[0].smooth, s[0].a)
        at_b = counter()
        s[0].c = pd.step(p[0].second, s[0].second, s[0].b - s[0].c)
        at_c = counter()
        took[k] = (at_a - before) + (at_b - at_a) + (at_c - at_b)
        wake += period
        now = clock.now()
        if now > wake:
            wake += (now - wake) // period * period
    return (counter() - begun) / (clock.now() - begun_ns)


def run(rate: float, seconds: float, priority: int) -> tuple[np.ndarray, float]:
    """Times of all ticks in counts, and counts per ns, from a separate thread, real-time where permitted."""
    dt = 1.0 / rate
    gains = pd.PdSettings(gain=0.3, tau_d=3e-5)
    params = {
        "first": pd.build(gains, dt),
        "smooth": low_pass.build(low_pass.LowPassSettings(frequency=80.0), dt),
        "second": pd.build(gains, dt),
    }
    p = np.zeros(1, np.dtype([(name, record_dtype(value)) for name, value in params.items()], align=True))
    for name, value in params.items():
        fill_record(p[0][name], value)
    s = np.zeros(1, STATE)
    _run(p, s, np.zeros(10, np.int64), 1000)  # compiles before real-time scheduling
    took = np.zeros(round(rate * seconds), np.int64)
    out: list[float] = []

    def measured() -> None:
        realtime = RealTime(priority, None)
        out.append(_run(p, s, took, round(1e9 / rate)))
        realtime.close()

    thread = threading.Thread(target=measured)
    thread.start()
    thread.join()
    return took, out[0]
