"""A package that is called as a function of its name: `rtctl.diagnose(...)` beside `rtctl.diagnose.answer`."""

import importlib
import sys
from types import ModuleType
from typing import Any


class CallableModule(ModuleType):
    """A module that passes a call on to the function that it names in `CALLED`, as module:name."""

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        module, _, name = self.CALLED.partition(":")
        return getattr(importlib.import_module(module), name)(*arguments, **named)


def called(module: str, function: str) -> None:
    """Have a module be called as `function`, module:name, which is loaded at the first call."""
    made = sys.modules[module]
    made.__class__ = CallableModule
    made.CALLED = function  # type: ignore[attr-defined]
