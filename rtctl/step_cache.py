"""Keeps compiled steps on disk, so that another machine compiles only what it does not share with those before it.

A tick is a hundred steps, and nearly all of them stand in the tick of the next config too. numba's own cache will not
do for them: it looks at the file of a function and not at those that it calls, and two processes that save at the same
moment may each number their file as the other does. Here a file is named by all that goes into it: every source that
compiled code can come from, the versions, the step and its types.
"""

import hashlib
import inspect
import pickle
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import FunctionCache
from numba.core.runtime import rtsys

from rtctl.config.cache import cache_folder
from rtctl.config.files import replaced
from rtctl.config.private import check, made
from rtctl.sources import files, sources_hash


class EntryCache(FunctionCache):
    """numba's cache of an entry point, which loads without the registries of the compiler.

    numba fills them before each load, a quarter of a second (it imports scipy.linalg to look for BLAS). Only a
    compilation needs them, and it fills them itself. Loaded code needs the counting of references.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The entry point compiled for these types, or None where it is not there."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


class StepCache:
    """What numba asks before it compiles a step, and tells after it (numba.core.caching._Cache, which is not public: a
    version that does it otherwise compiles every step anew)."""

    def __init__(self, function: Callable[..., Any], use: str):
        self.function, self.use = function, use

    @property
    def cache_path(self) -> str:
        """The folder of the steps of these sources."""
        return str(cache_folder() / f"steps_{sources_hash()[:16]}")

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The step compiled for these types, or None where it is not there."""
        if not is_kept(self.function):
            return None
        try:
            from numba.core.compiler import CompileResult

            rtsys.initialize(target_context)
            path = self._path(sig, target_context)
            _safe(path.parent)
            kept, compiled = pickle.loads(path.read_bytes())
            same = kept == sig  # types may differ and be written alike
            return CompileResult._rebuild(target_context, *compiled) if same else None
        except Exception:  # not there, cut short, or of classes that are gone: then it is compiled
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled step, unless it has an address in it that another process does not."""
        if not is_kept(self.function):
            return
        with suppress(Exception):  # a full disk, a folder of somebody else, types of a function: it runs all the same
            from numba.core.serialize import dumps

            if data.library.has_dynamic_globals:
                return
            path = self._path(sig, data.target_context)
            made(path.parent)
            with replaced(path, "wb") as file:
                file.write(dumps((sig, data._reduce())))

    def _path(self, sig: Any, target_context: Any) -> Path:
        key = repr((self.function.__module__, self.use, str(sig), target_context.codegen().magic_tuple()))
        name = f"{self.function.__name__}_{hashlib.sha256(key.encode()).hexdigest()[:24]}"
        return Path(self.cache_path) / name

    def enable(self) -> None:
        """Always."""

    def disable(self) -> None:
        """Never."""

    def flush(self) -> None:
        """Nothing is ever out of date."""


@cache
def _safe(folder: Path) -> None:
    """Raise UserError where others could put a pickle into the folder of steps."""
    check(folder)


@cache
def is_kept(function: Callable[..., Any]) -> bool:
    """Whether a step is rtctl's own and stands at the top of its file: what is defined within a function depends on
    that function's arguments, and a person's own file on others of theirs. A function with the attribute `kept` says
    by its module's name, a hash, what it depends on."""
    if getattr(function, "kept", False):
        return True
    return function.__qualname__ == function.__name__ and inspect.getfile(function) in _names()


@cache
def _names() -> frozenset[str]:
    return frozenset(map(str, files()))
