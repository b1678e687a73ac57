"""Check of a user's file before it goes into the tick: it compiles, allocates nothing, gives numbers, is fast enough.

Only the functions of the file are compiled here, in about a second; the whole tick takes half a minute.
"""

import ast
import re
import time
from typing import Any, NamedTuple

import numba
import numpy as np
from numba import njit, types
from numba.core import ir as numba_ir

from rtctl.config.errors import UserError, nearest
from rtctl.idiom import fill_record, record_dtype
from rtctl.own.files import OwnError, Source
from rtctl.own.parts import Parts, arguments
from rtctl.tick import clock

TICKS = 20_000  # ticks measured
FIRST = 20  # ticks of a first run, which rejects a very slow step
WARM = 100  # ticks at the start that are not counted
REPEATS = 3
TOO_SLOW = 0.5  # largest share of the period for a step at its 99th percentile; the tick needs the other part
SLOW = 0.1  # share of the period beyond which a warning is given
HEAP = re.compile(r"call [^\n]*@NRT_(?:MemInfo_(?:alloc|new|varsize)|Allocate|Reallocate)")
PYTHON = re.compile(r"call [^\n]*@(?:numba_gil_ensure|PyGILState_Ensure)")
DEFINED = re.compile(
    r"^define (?![^\n]*@(?:_ZN7cpython|cfunc\.)).*?^}", re.MULTILINE | re.DOTALL
)  # without the wrappers that Python calls
MAKES = ("call", "arrayexpr", "binop", "inplace_binop", "unary", "build_list", "build_set", "build_map", "build_string")
HEAP_NAMES = ("Buffer", "List", "Set", "ListType", "DictType", "UnicodeType", "SetType")
HEAP_TYPES = tuple(getattr(types, name) for name in HEAP_NAMES if hasattr(types, name))  # numba 0.60 lacks some
DRIVER = """
def drive(p, s, inputs, out, ns):
    for k in range(inputs.shape[0]):
        begun = clock.now()
        {result}step(p[0], s[0]{given})
        ns[k] = clock.now() - begun
"""


class Verdict(NamedTuple):
    """Result of a check; times of a step in s, measured on this computer."""

    spec: str
    compiled: float  # s
    median: float
    p99: float
    worst: float
    period: float  # s, of the tick or substep

    @property
    def warning(self) -> str:
        """Warning before a run; "" for none."""
        if self.p99 > SLOW * self.period:
            return f"its step takes {self.p99 / self.period:.0%} of the period in one tick of a hundred"
        if self.worst > TOO_SLOW * self.period:
            return f"its slowest step took {self.worst / self.period:.0%} of the period"
        return ""


def check(parts: Parts, params: Any, inputs: dict[str, np.ndarray], period: float) -> Verdict:
    """Verdict on the compiled functions of a user's file with `params`; `inputs` (n,) are healthy signals by name.

    Raises UserError: does not compile, allocates, calls Python, returns no number, NaN for a healthy input, too slow.
    """
    assert parts.source is not None
    try:
        return _check(parts, params, inputs, period)
    except OwnError as error:
        raise UserError(str(error)) from error


def _check(parts: Parts, params: Any, inputs: dict[str, np.ndarray], period: float) -> Verdict:
    spec = parts.source.spec if parts.source else parts.name
    p, s = np.zeros(1, record_dtype(params)), np.zeros(1, parts.state)
    fill_record(p[0], params)
    begun = time.perf_counter()
    for name in ("start", "reset", "step", "track"):
        if parts.has(name):
            _compile(parts, name, p[0], s[0])
    compiled = time.perf_counter() - begun
    _allocates_nothing(parts)
    names = arguments(parts.module.step)[2:]
    table = np.column_stack([inputs[name] for name in names]) if names else np.zeros((TICKS, 1))
    drive = _driver(parts, len(names))
    for count in (FIRST, TICKS):  # a step of one second would take hours
        ns = _run(parts, drive, names, table[:count], p, s)
        median, p99, worst = (float(np.percentile(ns, share)) * 1e-9 for share in (50, 99, 100))
        found = Verdict(spec, compiled, median, p99, worst, period)
        _fast_enough(parts, found)
    return found


def _fast_enough(parts: Parts, found: Verdict) -> None:
    """Raise OwnError for a step that leaves the tick too little time."""
    if found.p99 > TOO_SLOW * found.period or found.worst > found.period:
        raise parts.fault(
            "step",
            f"step takes {found.p99 * 1e6:.3g} us in one tick of a hundred and {found.worst * 1e6:.3g} us at worst, "
            f"{found.worst / found.period:.0%} of the period of {found.period * 1e6:g} us; make it shorter, or the "
            "rate lower",
        )


def check_lines(parts: Parts, lines: list[str], records: dict[str, np.dtype]) -> None:
    """Compile lines of a plant that call a user's file, with these `records`. Raises OwnError where this fails."""
    from rtctl.plants import linear

    space: dict[str, Any] = {parts.module.__name__: parts.module, "linear": linear, "np": np}
    body = "\n".join(f"    {line}" for line in lines)
    exec(f"def act({', '.join(records)}):\n{body}", space)
    function = njit(nogil=True, error_model="numpy")(space["act"])
    rows = {name: np.zeros(1, dtype)[0] for name, dtype in records.items()}
    try:
        function.compile(tuple(numba.typeof(row) for row in rows.values()))
    except KeyError as error:
        raise _no_field(parts, str(error.args[0]), rows["p"], rows["s"]) from error
    except Exception as error:
        raise _complaint(parts, parts.state_name.removesuffix("_STATE"), error) from error
    _no_heap(parts, "act", function)


def _run(parts: Parts, drive: Any, names: list[str], table: np.ndarray, p: Any, s: Any) -> np.ndarray:
    """Time of each step over the inputs (n, arguments), ns: the least of REPEATS runs, free of other programs' load.

    Raises OwnError where a step raises an exception or gives NaN or infinity.
    """
    out, ns, best = np.zeros(len(table)), np.zeros(len(table), np.int64), np.full(len(table), 1 << 60)
    for _ in range(REPEATS):
        s[:] = np.zeros(1, s.dtype)
        try:
            for name in ("start", "reset"):
                if parts.has(name):
                    function = getattr(parts.module, name)
                    function(p[0], s[0], *(0.0 for _ in arguments(function)[2:]))
            drive(p, s, table, out, ns)
        except Exception as error:
            raise parts.fault("step", f"step raises {type(error).__name__} for a healthy input: {error}") from None
        _healthy(parts, names, table, out, s[0])
        best = np.minimum(best, ns)
    return best[min(WARM, len(best) // 2) :]


def _compile(parts: Parts, name: str, p: Any, s: Any) -> None:
    """Compile a function of the file for its records. Raises OwnError with numba's complaint cut to the user's line."""
    function = getattr(parts.module, name)
    numbers = [types.float64] * (len(arguments(function)) - 2)
    try:
        function.compile((numba.typeof(p), numba.typeof(s), *numbers))
    except KeyError as error:  # numba's way to say that a record has no such field
        raise _no_field(parts, str(error.args[0]), p, s) from error
    except Exception as error:  # numba's errors, and any error of its passes
        raise _complaint(parts, name, error) from error
    found = next(iter(function.overloads.values())).signature.return_type
    if name == "step" and parts.result and not isinstance(found, (types.Float, types.Integer, types.Boolean)):
        raise parts.fault(name, f"step gives {_type(found)}; it should give one number, {parts.result}")


def _no_field(parts: Parts, field: str, p: Any, s: Any) -> OwnError:
    """Error for a missing field of p or s, at its first use."""
    assert parts.source is not None
    lacking = [name for name, record in (("p", p), ("s", s)) if field not in record.dtype.names]
    nodes = [n for n in ast.walk(ast.parse(parts.source.text)) if isinstance(n, ast.Attribute) and n.attr == field]
    uses = [n for n in nodes if getattr(n.value, "id", None) in lacking] or nodes
    use = min(uses, key=lambda n: n.lineno) if uses else None
    record = getattr(getattr(use, "value", None), "id", "s")
    names = (p if record == "p" else s).dtype.names
    near = nearest(field, names)
    where = f"{parts.name}Params" if record == "p" else parts.state_name
    hint = f"did you mean {record}.{near}?" if near else f"it has {', '.join(names)}"
    return parts.source.error(use.lineno if use else None, f"{record}.{field}: {where} has no '{field}'; {hint}")


def _type(found: Any) -> str:
    if isinstance(found, types.NoneType):
        return "nothing"
    words = {types.Array: "an array", types.BaseTuple: "several values", types.UnicodeType: "text"}
    return next((word for kind, word in words.items() if isinstance(found, kind)), str(found).partition("(")[0])


def _complaint(parts: Parts, name: str, error: Exception) -> OwnError:
    """Error with numba's message in one line, at the line of the file that it concerns."""
    assert parts.source is not None
    return complaint(parts.source, name, error)


def complaint(source: Source, name: str, error: Exception) -> OwnError:
    """Error with numba's message in one line, about the function `name` of a file."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))
    file = re.escape(source.file.rpartition("/")[2])
    found = [int(a or b) for a, b in re.findall(rf'(?:File "[^"]*{file}", line (\d+)|{file} \((\d+)\))', text)]
    lines = [line.strip() for line in text.splitlines()]
    lines = [line for line in lines if line and not line.startswith(("Failed in nopython", "Overload of function"))]
    what = lines[0] if lines else type(error).__name__
    absent = re.search(r"has no attribute '(\w+)'", text)
    if absent and not found:
        nodes = [n for n in ast.walk(ast.parse(source.text)) if isinstance(n, ast.Attribute)]
        found = [n.lineno for n in nodes if n.attr == absent[1]][:1]
    if "Untyped global name" in text or "Cannot determine Numba type of" in text:
        match = re.search(r"global name '(\w+)'", text)
        what = f"'{match[1] if match else 'a value'}' is not compiled; write @tick above its definition"
    elif what.startswith("No implementation of function"):
        call = next((line.removeprefix(">>>").strip() for line in lines if line.startswith(">>>")), "")
        what = f"there is no compiled form of {call or what}"
    return source.error(found[-1] if found else source.line_of(name), f"does not compile: {what:.300}")


def _allocates_nothing(parts: Parts) -> None:
    """Raise OwnError where the machine code calls the heap or Python, with the line where it is known."""
    for name in ("start", "reset", "step", "track"):
        if not parts.has(name):
            continue
        _no_heap(parts, name, getattr(parts.module, name))


def _no_heap(parts: Parts, name: str, function: Any) -> None:
    code = "".join(part for ir in function.inspect_llvm().values() for part in DEFINED.findall(ir))
    if PYTHON.search(code):
        raise parts.fault(name, f"{name} calls Python (print, objmode); nothing in a tick may")
    if name != "start" and HEAP.search(code):
        line, what = _where_allocated(parts)
        sentence = f"{what} takes memory in every tick; keep it in the state, {parts.state_name} = state(x=(float, 3))"
        raise parts.source.error(line, sentence) if line and parts.source else parts.fault(name, sentence)


def _where_allocated(parts: Parts) -> tuple[int | None, str]:
    """First line that makes an array, a list or a text, and its type; None for an unknown line."""
    found = []
    for value in vars(parts.module).values():
        code = getattr(getattr(value, "py_func", None), "__code__", None)
        if code is None or parts.source is None or code.co_filename != parts.source.file:
            continue
        for overload in value.overloads.values():
            notes = overload.type_annotation
            for block in notes.blocks.values():
                for assign in block.find_insts(numba_ir.Assign):
                    made = notes.typemap.get(assign.target.name)
                    if getattr(assign.value, "op", None) in MAKES and isinstance(made, HEAP_TYPES):
                        found.append((assign.loc.line, _type(made) if isinstance(made, types.Array) else str(made)))
    return min(found) if found else (None, "something in it")


def _driver(parts: Parts, count: int) -> Any:
    space = {"clock": clock, "step": parts.module.step}
    given = "".join(f", inputs[k, {i}]" for i in range(count))
    exec(DRIVER.format(given=given, result="out[k] = " if parts.result else ""), space)
    return njit(nogil=True, error_model="numpy")(space["drive"])


def _healthy(parts: Parts, names: list[str], table: np.ndarray, out: np.ndarray, s: Any) -> None:
    """Raise OwnError where a healthy input has given NaN or infinity."""
    state = [n for n in parts.state.names or () if s[n].dtype.kind == "f" and not np.isfinite(s[n]).all()]
    bad = np.flatnonzero(~np.isfinite(out))
    if len(bad):
        given = ", ".join(f"{name} = {value:.3g}" for name, value in zip(names, table[bad[0]], strict=False))
        rest = f"; s.{state[0]} is no number either" if state else ""
        raise parts.fault(
            "step", f"step gives {out[bad[0]]:g} in tick {bad[0]} for a healthy input ({given or 'none'}){rest}"
        )
    if state:
        raise parts.fault("step", f"s.{state[0]} is no number any more after {len(table)} ticks of a healthy input")


def healthy(names: Any, dt: float, size: float) -> dict[str, np.ndarray]:
    """Signals (n,) of a healthy machine by name: a reference of amplitude `size`, and others that follow closely."""
    t = np.arange(TICKS) * dt
    w = 2 * np.pi / (TICKS * dt) * 4
    ref, v_ref, a_ref = size * np.sin(w * t), size * w * np.cos(w * t), -size * w**2 * np.sin(w * t)
    x = size * np.sin(w * t - 0.02)
    x[0], ref[0] = 0.0, 0.0
    known = {
        "ref": ref, "v_ref": v_ref, "a_ref": a_ref, "x": x, "e": ref - x, "v": size * w * np.cos(w * t - 0.02),
        "u": np.sin(w * t), "R1": np.full(TICKS, 0.038), "R2": np.full(TICKS, 0.022),
        "passed": np.ones(TICKS),
    }  # fmt: skip
    return {name: known.get(name, 0.5 * np.sin(w * t)) for name in {*known, *names}}
