"""Idiom of all code in the tick: settings, params, state, build, step.

    class PdSettings(Settings)       settings in YAML, in any unit of the right dimension
    class PdParams(NamedTuple)       coefficients of the tick for this dt
    PD_STATE = state(e=float)        memory from tick to tick
    def build(settings, dt)          params from settings
    @tick def step(p, s, ...)        law or physics of one tick, compiled

In the running tick `p` and `s` are records in shared memory. In a test `p` may be the named tuple, and `s` be
`np.zeros(1, PD_STATE)[0]`: compiled code reads `p.gain` from a record or a named tuple.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property, update_wrapper
from typing import Any

import numpy as np
from numba import njit, typeof
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic.fields import FieldInfo

from rtctl.config.cache import check_numba
from rtctl.config.units import to_si
from rtctl.step_cache import EntryCache, StepCache

check_numba()  # once, before the first function is compiled or loaded

OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": False}
INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def tick(function: Callable[..., Any]) -> Any:
    """Compiled step, cached under a hash of all sources, like the generated module that calls the step.

    IEEE arithmetic in program order (no fastmath, no contraction): a step gives equal bits in each module that compiles
    it. Division by zero gives inf and does not raise: a tick cannot catch an exception.
    """
    return Step(function)


def glue(function: Callable[..., Any]) -> Any:
    """Compiled step of generated code, without reference counting: code that takes memory from the heap does not
    compile."""
    return Step(function, _nrt=False)


def entry(function: Callable[..., Any], **options: Any) -> Any:
    """Compiled function of a generated module that Python calls, cached beside its module."""
    made = njit(**OPTIONS, **options)(function)
    made._cache = EntryCache(function)
    return made


def glue_entry(function: Callable[..., Any]) -> Any:
    """Entry without reference counting, as `glue`."""
    return entry(function, _nrt=False)


class _Interpreter(threading.local):
    runs = False  # whether the steps called in this thread are interpreted


INTERPRETER = _Interpreter()


@contextmanager
def interpreted() -> Iterator[None]:
    """Context in which the steps of this thread are interpreted; see `Step.interpret`."""
    before, INTERPRETER.runs = INTERPRETER.runs, True
    try:
        with np.errstate(all="ignore"):  # as in compiled code: counters of random numbers wrap around
            yield
    finally:
        INTERPRETER.runs = before


class Step:
    """Function compiled on first use, once for calls from compiled code and once for calls from Python.

    A step that only compiled code calls needs no wrapper that unpacks Python objects. The wrappers of the hundred steps
    of a tick would take more than a third of the compilation time. A step that Python calls a few times is interpreted;
    see `interpret`.
    """

    def __init__(self, function: Callable[..., Any], **options: Any):
        update_wrapper(self, function)
        self.py_func = function
        self._options = options

    @cached_property
    def _inner(self) -> Any:
        """For calls from compiled code. Made at first use: a process uses a few of the library's steps."""
        made = njit(**OPTIONS, **INNER, **self._options)(self.py_func)
        made._cache = StepCache(self.py_func, "inner")
        return made

    @cached_property
    def _outer(self) -> Any:
        """For calls from Python."""
        made = njit(**OPTIONS, **self._options)(self.py_func)
        made._cache = StepCache(self.py_func, "outer")
        return made

    @cached_property
    def _numba_type_(self) -> Any:
        """Type of the step's name in compiled code."""
        return typeof(self._inner)

    def __call__(self, *arguments: Any) -> Any:
        return (self.py_func if INTERPRETER.runs else self._outer)(*arguments)

    def interpret(self, *arguments: Any) -> Any:
        """Result of the step, to the bit, from Python's interpreter: this step and the steps that it calls.

        Params are named tuples and states records of a recarray, whose fields Python can read.
        """
        with interpreted():
            return self.py_func(*arguments)

    def compile(self, types: tuple[Any, ...]) -> None:
        """Compile for calls from compiled code with arguments of these types."""
        self._inner.compile(types)

    def inspect_llvm(self) -> dict[Any, str]:
        """Optimised code for calls from compiled code, by argument types."""
        return dict(self._inner.inspect_llvm())

    @property
    def overloads(self) -> dict[Any, Any]:
        """Compiled overloads for calls from compiled code, by argument types."""
        return dict(self._inner.overloads)


class Settings(BaseModel):
    """Settings in YAML: numbers in SI, or strings with a unit. An unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=False, allow_inf_nan=False)


def quantity(
    default: Any = ..., *, unit: str, help: str, safer: str = "", off: float | None = None, absent: str = "",
    **bounds: Any,
) -> Any:  # fmt: skip
    """Field of a setting with its unit and one line of help; `rtctl schema` shows both.

    A number is SI; a string may have any unit of the dimension ("160 ms", "2.4 mNm"). `safer` is the direction,
    "smaller" or "larger", in which a running machine accepts values beyond the start value (rtctl/config/bounds.py).
    `off` is the value that switches the limit off. `absent` is the setting whose negative replaces a value of None.
    """
    words: dict[str, Any] = {"unit": unit, **guard(safer, off)} if safer else {"unit": unit}
    words |= {"absent": absent} if absent else {}
    field = Field(default, description=help, json_schema_extra=words, **bounds)
    assert isinstance(field, FieldInfo)
    field.metadata.append(BeforeValidator(lambda value: to_si(value, unit)))  # the last validator runs first
    return field


def guard(safer: str, off: float | None = None) -> dict[str, Any]:
    """Part of `json_schema_extra` with the safer direction of a field; see `quantity`."""
    return {"safer": safer} if off is None else {"safer": safer, "off": off}


def state(**fields: Any) -> np.dtype:
    """Dtype of a state record: `state(e=float, n=int, x=(float, 4), pd=PD_STATE)`. float is f8, int is i8."""
    return np.dtype([_field(name, kind) for name, kind in fields.items()], align=True)


def _field(name: str, kind: Any) -> tuple:
    if isinstance(kind, tuple):
        return (name, _scalar(kind[0]), kind[1] if isinstance(kind[1], tuple) else (kind[1],))
    return (name, _scalar(kind))


def _scalar(kind: Any) -> Any:
    return {float: np.float64, int: np.int64}.get(kind, kind)


def record_dtype(params: Any) -> np.dtype:
    """Dtype of the record of a params tuple in shared memory, with nested tuples and arrays."""
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
