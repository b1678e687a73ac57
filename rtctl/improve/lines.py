"""Response of effects alone to a command or a reading: their lines, interpreted, on a record of a machine."""

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

import numpy as np

from rtctl.idiom import interpreted
from rtctl.plants.linear import MACHINE
from rtctl.plants.physics import TERMS, ordered


def runner(entries: Sequence[Any], site: str, kind: str, h: float) -> Callable[[float], float] | None:
    """Step of `h` s of these effects at the site `command` or `reading`: function from the signal before to after them.

    None where none of them acts there.
    """
    m = np.zeros(1, MACHINE).view(np.recarray)[0]
    m.h, m.nu, m.ny = h, 1, 1
    names: dict[str, Any] = {"m": m, "np": np}
    codes = []
    for number, entry in enumerate(ordered(list(entries))):
        term = TERMS[entry.term]
        line = term.act_at(site, kind)
        if line is None:
            continue
        module = import_module(term.build.__module__)
        state = term.state if term.state is not None else [("spare", "f8")]
        names |= {
            f"P{number}": term.build(entry, h),
            f"S{number}": np.zeros(1, state).view(np.recarray)[0],
            module.__name__.rpartition(".")[2]: module,
        }
        text = line.format(p=f"P{number}", s=f"S{number}", m="m", i=0, l=0, c=0, k=-1, r=1.0)
        codes.append(compile(text, entry.term, "exec"))
    if not codes:
        return None
    signal = m.volts if site == "command" else m.y

    def step(value: float) -> float:
        signal[0] = value
        m.x[0] = value
        with interpreted():
            for code in codes:
                exec(code, names)
        m.t += h
        return float(signal[0])

    return step


def swept(entries: Sequence[Any], site: str, kind: str, values: np.ndarray) -> np.ndarray:
    """The signal (n,) behind effects without memory for `values` (n,) before them."""
    step = runner(entries, site, kind, 1.0)
    return values.copy() if step is None else np.array([step(value) for value in values])
