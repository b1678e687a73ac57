"""The one idiom that everything in the tick shares: settings, params, state, build, step.

    class PdSettings(Settings)       what a person writes in YAML, in the unit of their choice
    class PdParams(NamedTuple)       what the tick needs: coefficients for this dt
    PD_STATE = state(e=float)        what it remembers from tick to tick
    def build(settings, dt)          the only road from the first to the second
    @tick def step(p, s, ...)        one expression of the law or the physics, compiled

In the running tick `p` and `s` are records inside shared memory; in a test they may as well be the
named tuple itself and `np.zeros(1, PD_STATE)[0]`: compiled code reads `p.gain` from either.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import update_wrapper
from typing import Any

import numpy as np
from numba import njit, typeof
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic.fields import FieldInfo

from rtctl.config.cache import check_numba
from rtctl.config.units import to_si
from rtctl.step_cache import StepCache

check_numba()  # once, before the first function is compiled or loaded

OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": False}
INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def tick(function: Callable[..., Any]) -> Any:
    """Compile a step. It is kept, as the generated module that calls it is, under a name made of all sources.

    IEEE arithmetic in program order (no fastmath, no contraction), so that the same step gives the same bits in
    whatever module it is compiled; division by zero gives inf instead of raising, since nobody could catch it.
    """
    return Step(function)


def glue(function: Callable[..., Any]) -> Any:
    """As `tick`, for generated code: numba counts no references in it, so that whatever would take memory from the heap
    does not compile."""
    return Step(function, _nrt=False)


class _Interpreter(threading.local):
    runs = False  # whether steps that are called in this thread are to be interpreted


INTERPRETER = _Interpreter()


@contextmanager
def interpreted() -> Iterator[None]:
    """Steps that are called within are interpreted, in this thread: see `Step.interpret`."""
    before, INTERPRETER.runs = INTERPRETER.runs, True
    try:
        with np.errstate(all="ignore"):  # as in compiled code: counters of random numbers wrap around
            yield
    finally:
        INTERPRETER.runs = before


class Step:
    """A function compiled twice, each when it is first asked for: as compiled code calls it, and as Python does.

    What only compiled code calls needs no wrappers that unpack Python objects. A tick is made of a hundred steps, and
    their wrappers, which nobody calls, would be more than a third of the time that it takes to compile. What Python
    calls a few times only is not worth compiling at all: see `interpret`.
    """

    def __init__(self, function: Callable[..., Any], **options: Any):
        update_wrapper(self, function)
        self.py_func = function
        self._inner = njit(**OPTIONS, **INNER, **options)(function)
        self._outer = njit(**OPTIONS, **options)(function)
        self._inner._cache, self._outer._cache = StepCache(function, "inner"), StepCache(function, "outer")
        self._numba_type_ = typeof(self._inner)  # what a name stands for in compiled code

    def __call__(self, *arguments: Any) -> Any:
        return (self.py_func if INTERPRETER.runs else self._outer)(*arguments)

    def interpret(self, *arguments: Any) -> Any:
        """The same bits from Python's interpreter, in this step and in those it calls, with nothing compiled.

        Params are named tuples and states records of a recarray, whose fields Python can read.
        """
        with interpreted():
            return self.py_func(*arguments)

    def compile(self, types: tuple[Any, ...]) -> None:
        """Compile for arguments of these types, for compiled code."""
        self._inner.compile(types)

    def inspect_llvm(self) -> dict[Any, str]:
        """Optimised code for compiled code, by types."""
        return dict(self._inner.inspect_llvm())

    @property
    def overloads(self) -> dict[Any, Any]:
        """What was compiled for compiled code, by types."""
        return dict(self._inner.overloads)


class Settings(BaseModel):
    """What a person writes in YAML. SI units or a string with a unit; an unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=False, allow_inf_nan=False)


def quantity(
    default: Any = ..., *, unit: str, help: str, safer: str = "", off: float | None = None, absent: str = "",
    **bounds: Any,
) -> Any:  # fmt: skip
    """A setting with its unit and one line of help, both shown by `rtctl schema`.

    A number is taken as SI; a string may carry any unit of the same dimension ("160 ms", "2.4 mNm"). `safer`, "smaller"
    or "larger", keeps a running machine from the other direction (rtctl/config/bounds.py); `off` is the value that
    switches the limit off, `absent` the setting whose negative is meant where this one is None.
    """
    words: dict[str, Any] = {"unit": unit, **guard(safer, off)} if safer else {"unit": unit}
    words |= {"absent": absent} if absent else {}
    field = Field(default, description=help, json_schema_extra=words, **bounds)
    assert isinstance(field, FieldInfo)
    field.metadata.append(BeforeValidator(lambda value: to_si(value, unit)))  # last: it runs first
    return field


def guard(safer: str, off: float | None = None) -> dict[str, Any]:
    """What a field says in `json_schema_extra` of its safer direction; see `quantity`."""
    return {"safer": safer} if off is None else {"safer": safer, "off": off}


def state(**fields: Any) -> np.dtype:
    """A state record: `state(e=float, n=int, x=(float, 4), pd=PD_STATE)`. float is f8, int is i8."""
    return np.dtype([_field(name, kind) for name, kind in fields.items()], align=True)


def _field(name: str, kind: Any) -> tuple:
    if isinstance(kind, tuple):
        return (name, _scalar(kind[0]), kind[1] if isinstance(kind[1], tuple) else (kind[1],))
    return (name, _scalar(kind))


def _scalar(kind: Any) -> Any:
    return {float: np.float64, int: np.int64}.get(kind, kind)


def record_dtype(params: Any) -> np.dtype:
    """The record that holds a params tuple in shared memory, nested tuples and arrays included."""
    fields: list[tuple] = []
    for name in params._fields:
        value = getattr(params, name)
        if hasattr(value, "_fields"):
            fields.append((name, record_dtype(value)))
        elif isinstance(value, np.ndarray):
            fields.append((name, value.dtype, value.shape))
        elif isinstance(value, (bool, int, np.integer)):
            fields.append((name, np.int64))
        else:
            fields.append((name, np.float64))
    return np.dtype(fields, align=True)


def fill_record(record: Any, params: Any) -> None:
    """Copy a params tuple into its record, field by field."""
    for name in params._fields:
        value = getattr(params, name)
        if hasattr(value, "_fields"):
            fill_record(record[name], value)
        else:
            record[name] = value
