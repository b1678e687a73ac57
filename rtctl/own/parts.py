"""The four parts of a module by the idiom: XSettings, X_STATE, build, and compiled functions such as step and reset.

All laws enter a tick by this module, those of rtctl and those in user files.
"""

import importlib
import inspect
import re
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import nearest
from rtctl.idiom import Settings
from rtctl.own.files import OwnError, Source, load

STATE_EXAMPLE = "state(e=float, n=int)"


class Parts(NamedTuple):
    """Settings, state and functions of a module under one name of the idiom."""

    module: ModuleType
    name: str  # Pd, for PdSettings and PD_STATE
    settings: type[Settings]
    state: np.dtype
    source: Source | None = None  # of a user's file
    result: str = ""  # noun of the result of step; "" where step writes only its state

    @property
    def state_name(self) -> str:
        """Name of its state record, PD_STATE."""
        return f"{upper(self.name)}_STATE"

    def build(self, settings: Any, dt: float) -> Any:
        """Params for a tick of `dt` s. Raises ValueError with the module's message on invalid settings."""
        try:
            params = self.module.build(settings, dt)
        except (ValueError, ArithmeticError):
            raise
        except Exception as error:
            if self.source is None:
                raise
            raise self.fault("build", f"build: {type(error).__name__}: {error}") from error
        if self.source is not None:
            self._check_params(params)
        return params

    def _check_params(self, params: Any) -> None:
        if not hasattr(params, "_fields"):
            raise self.fault(
                "build", f"build gives a {type(params).__name__}; it should give a {self.name}Params, a NamedTuple"
            )
        for name in params._fields:
            value = getattr(params, name)
            if not (hasattr(value, "_fields") or isinstance(value, (bool, int, float, np.number, np.ndarray))):
                raise self.fault(
                    f"{self.name}Params",
                    f"{self.name}Params.{name} is a {type(value).__name__}; the tick takes numbers and arrays",
                )

    def has(self, function: str) -> bool:
        """Whether the module has this function."""
        return hasattr(self.module, function)

    def call(self, function: str, block: str, signals: dict[str, str]) -> str:
        """Text of a call of a compiled function for a block; the names of its arguments select the signals.

        Raises OwnError where an argument names no signal.
        """
        names = arguments(getattr(self.module, function))[2:]
        for name in names:
            if name not in signals:
                near = nearest(name, signals)
                there = ", ".join(signals) or "none"
                hint = f"did you mean '{near}'?" if near else f"there is {there}"
                head = f"{function}({', '.join(['p', 's', *names])})"
                raise self.fault(function, f"{head}: there is no signal '{name}' here; {hint}")
        given = ", ".join([f"p.{block}", f"s.{block}", *(signals[name] for name in names)])
        return f"{self.module.__name__.rpartition('.')[2]}.{function}({given})"

    def fault(self, name: str, what: str) -> OwnError:
        """Error at the place where `name` is defined."""
        if self.source is None:
            return OwnError(f"{self.module.__name__}: {what}")
        return self.source.error(self.source.line_of(name), what)


def own(source: Source, functions: dict[str, str], result: str = "") -> Parts:
    """Parts of a user's file; `functions` maps required functions to examples. Raises OwnError for a missing part."""
    module = load(source)
    settings = getattr(module, f"{source.name}Settings", None)
    if not (isinstance(settings, type) and issubclass(settings, Settings)):
        raise _no_settings(source, module, settings)
    state_name = f"{upper(source.name)}_STATE"
    state = getattr(module, state_name, None)
    if not (isinstance(state, np.dtype) and state.names):
        what = "is missing" if state is None else "is no record with fields"
        raise source.error(source.line_of(state_name), f"{state_name} {what}; write {state_name} = {STATE_EXAMPLE}")
    if "kind" in settings.model_fields:
        raise source.error(
            source.line_of(settings.__name__), f"{settings.__name__}.kind: `kind` is the config's own key; rename it"
        )
    _check_function(source, module, "build", "build(settings, dt)", compiled=False)
    for name, example in functions.items():
        _check_function(source, module, name, example, compiled=True)
    return Parts(module, source.name, settings, state, source, result)


def builtin(module: str, name: str) -> Parts:
    """Parts of a module that comes with rtctl, rtctl.laws.pd and Pd."""
    found = importlib.import_module(module)
    return Parts(found, name, getattr(found, f"{name}Settings"), getattr(found, f"{upper(name)}_STATE"))


def upper(name: str) -> str:
    """MyLaw -> MY_LAW."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).upper()


def camel(name: str) -> str:
    """my_law -> MyLaw."""
    return "".join(word[:1].upper() + word[1:] for word in name.split("_"))


def arguments(function: Any) -> list[str]:
    """Names of the arguments of a function, compiled or not."""
    return list(inspect.signature(getattr(function, "py_func", function)).parameters)


def _no_settings(source: Source, module: ModuleType, found: Any) -> OwnError:
    wanted = f"{source.name}Settings"
    if found is not None:
        return source.error(source.line_of(wanted), f"{wanted} is not a Settings; write class {wanted}(Settings):")
    there = [
        name.removesuffix("Settings")
        for name, value in vars(module).items()
        if isinstance(value, type) and value.__module__ == module.__name__ and name.endswith("Settings")
    ]
    near = nearest(source.name.removesuffix("Settings"), there) or (there[0] if len(there) == 1 else None)
    hint = f"did you mean {source.file}:{near}?" if near else f"write class {wanted}(Settings):"
    return source.error(None, f"there is no class {wanted}; {hint}")


def _check_function(source: Source, module: ModuleType, name: str, example: str, compiled: bool) -> None:
    found = getattr(module, name, None)
    head = f"@tick\ndef {example}:" if compiled else f"def {example}:"
    head = head.replace("\n", " ")
    if found is None:
        there = [n for n, value in vars(module).items() if callable(value) and source.line_of(n)]
        near = nearest(name, there)
        raise source.error(
            source.line_of(near) if near else None,
            f"there is no function {name}; " + (f"did you mean '{near}'?" if near else f"write {head}"),
        )
    line = source.line_of(name)
    if compiled and not hasattr(found, "py_func"):
        raise source.error(line, f"{name} is not compiled; write @tick above it: {head}")
    if not callable(found):
        raise source.error(line, f"{name} is not a function; write {head}")
    given, wanted = arguments(found), example.partition("(")[2].rstrip(")").split(", ")
    right = given[:2] == ["p", "s"] if compiled else len(given) == len(wanted)
    if not right:
        raise source.error(line, f"{name}({', '.join(given)}) should be {head}")
