"""Mechanics in a user's file: M(q) and h(q, v) of a machine with coupled bodies.

    FurutaSettings(Settings)   parameters of the mechanics, each with its unit
    FurutaParams(NamedTuple)   params for M and h
    COORDINATES = (...)        names of the bodies with the positions q
    build(settings, h)         params from settings
    @tick M(p, J, q, out)      full mass matrix, into `out`, which is zero at the call
    @tick h(p, J, q, v, out)   terms beside M q'' on the left of the equation, into `out`, which is zero at the call

J are the inertias (kg m^2) or masses (kg) of the bodies in the description, in the order of COORDINATES.
The file is named in the user's config or on the command line. No text of a bundle is run.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np

from rtctl.config.errors import UserError
from rtctl.idiom import Settings, record_dtype
from rtctl.own.check import complaint
from rtctl.own.files import OWN, OwnError, Source, load, read
from rtctl.own.parts import arguments, camel
from rtctl.plants.graph import coupled
from rtctl.plants.graph import mechanics as graph
from rtctl.plants.graph.mechanics import Mechanics

EXAMPLES = {"M": "M(p, J, q, out)", "h": "h(p, J, q, v, out)"}
TRIED = 0.3  # rad or m, and per s: size of q and v in the test call of the functions


def long_kind(kind: str) -> str:
    """./furuta.py as ./furuta.py:Furuta."""
    return kind if ":" in Path(kind).name or not kind.endswith(".py") else f"{kind}:{camel(Path(kind).stem)}"


def register(source: Source, path: Path | None = None) -> Mechanics:
    """Load a file and let descriptions use it; `path` is where the user has it. Raises OwnError."""
    found = graph.known(_digest(source))
    if found is None:
        module = load(source)
        settings = getattr(module, f"{source.name}Settings", None)
        if not (isinstance(settings, type) and issubclass(settings, Settings)):
            raise source.error(
                None, f"there is no class {source.name}Settings; write class {source.name}Settings(Settings):"
            )
        names = getattr(module, "COORDINATES", None)
        if not (isinstance(names, tuple) and names and all(isinstance(name, str) for name in names)):
            raise source.error(
                source.line_of("COORDINATES"),
                'COORDINATES should be a tuple of names of bodies: COORDINATES = ("arm",)',
            )
        if not callable(getattr(module, "build", None)):
            raise source.error(None, "there is no function build; write def build(settings, h):")
        for name, example in EXAMPLES.items():
            _check_function(source, module, name, example)
        name = f"coupled_{source.module}"
        params = coupled.params_class(source.name)
        steps = coupled.steps(module, name)
        sys.modules[name] = steps  # compiled code that refers to it finds it here
        found = Mechanics(source.name, _digest(source), module, settings, steps, params, str(path or source.file))
        params.code = found  # type: ignore[attr-defined, unused-ignore]
    graph.register(found)
    return found


def register_file(kind: str, folder: Path) -> Mechanics:
    """Load a file that the user names by path, and let descriptions use it. Raises OwnError."""
    kind = long_kind(kind)
    match = OWN.fullmatch(kind)
    if match is None:
        raise OwnError(f"'{kind:.80}' should be a Python file and a name in it, such as ./furuta.py:Furuta")
    file, name = match["file"], match["name"]
    return register(Source(file, name, read(file, folder)), (folder / file).resolve())


def give(kind: str) -> None:
    """Register a file that the command line names. Raises UserError."""
    try:
        register_file(kind, Path())
    except OwnError as error:
        raise UserError(f"--mechanics {error}") from error


def give_machine(path: Path) -> None:
    """Register the mechanics that a user's config names, if any. Raises UserError."""
    from rtctl.config.yaml_file import find, load_yaml

    file = find(path)
    document = load_yaml(file)
    data = document.data if isinstance(document.data, dict) else {}
    machine = data.get("machine", data)
    given = machine.get("mechanics") if isinstance(machine, dict) else None
    kind = given.get("kind") if isinstance(given, dict) else given
    if isinstance(kind, str):
        try:
            register_file(kind, file.parent)
        except OwnError as error:
            line = document.line(("machine", "mechanics")) or document.line(("mechanics",))
            raise UserError(f"{document.path}{f':{line}' if line else ''}: mechanics: {error}") from error


def checked(machine: Any, source: Source) -> None:
    """Compile M and h of a description's mechanics and check their results.

    Raises OwnError with file and line: does not compile, NaN or infinity, M not symmetric.
    """
    code = graph.code_of(machine)
    assert code is not None
    params = code.module.build(code.settings.model_validate(machine.mechanics.parameters), 1e-3)
    p, n = np.zeros(1, record_dtype(params))[0], len(code.coordinates)
    vector, matrix = numba.typeof(np.zeros(n)), numba.typeof(np.zeros((n, n)))
    for name, types in (("M", (vector, vector, matrix)), ("h", (vector,) * 4)):
        try:
            getattr(code.module, name).compile((numba.typeof(p), *types))
        except Exception as error:  # numba's errors, and any error of its passes
            raise complaint(source, name, error) from error
    bodies = [machine.bodies[name] for name in graph.bodies_of(machine)]
    J = np.array([body.inertia if body.turns else body.mass for body in bodies])
    q, own, out = TRIED * np.arange(1, n + 1), np.zeros((n, n)), np.zeros(n)
    code.module.M.interpret(params, J, q, own)
    code.module.h.interpret(params, J, q, q, out)
    if not np.isfinite(own).all() or not np.isfinite(out).all():
        raise source.error(source.line_of("M"), f"M or h gives no number at q = v = {q.tolist()}")
    if not np.allclose(own, own.T, rtol=1e-9, atol=1e-12 * np.abs(own).max()):
        j, k = np.unravel_index(np.argmax(np.abs(own - own.T)), own.shape)
        raise source.error(
            source.line_of("M"),
            f"M is not symmetric: out[{j}, {k}] is {own[j, k]:.6g} and out[{k}, {j}] {own[k, j]:.6g}",
        )


def _digest(source: Source) -> str:
    return source.module.rpartition("_")[2] + "_" + source.name


def _check_function(source: Source, module: Any, name: str, example: str) -> None:
    found: Callable[..., Any] | None = getattr(module, name, None)
    if found is None:
        raise source.error(None, f"there is no function {name}; write @tick def {example}:")
    line = source.line_of(name)
    if not hasattr(found, "py_func"):
        raise source.error(line, f"{name} is not compiled; write @tick above it: @tick def {example}:")
    given = arguments(found)
    if len(given) != example.count(",") + 1:
        raise source.error(line, f"{name}({', '.join(given)}) should be @tick def {example}:")
