"""The position law of a machine: its block, and the lines that call it in the tick.

The names of a function's arguments select its signals:

    step(p, s, e)             position error; gives the command in V
    step(p, s, e, v, v_ref)   position error, measured speed, and speed of the reference

The command of a user's law passes gains, limits and the safety checks, as that of any law does. A law that raises an
exception, or returns NaN, trips the machine with its outputs at zero.
"""

from typing import Any, NamedTuple

from rtctl.own.parts import Parts, builtin, camel

SIGNALS = {  # name -> meaning; lengths in the unit of the machine's position, rad or m
    "e": "position error, ref - x",
    "x": "measured position",
    "v": "measured speed, filtered as law.velocity says",
    "ref": "position reference, shaped",
    "v_ref": "speed of the shaped reference, 0 without a shaper",
    "a_ref": "acceleration of the shaped reference, 0 without a shaper",
    "u": "voltage written in the tick before (ivu: command, before it is shared out), V",
    "R1": "radius of reel 1, m (ivu)",
    "R2": "radius of reel 2, m (ivu)",
    "passed": "periods since the previous tick: 1, or more after missed ticks",
}
FUNCTIONS = {"step": "step(p, s, e)", "reset": "reset(p, s)"}
RESULT = "the command in V"
TRIP = "safety.trip(s.safety, safety.NOT_A_NUMBER, k)"
own_laws: dict[type, Parts] = {}  # settings class -> parts, of the laws in user files


class LawLines(NamedTuple):
    """A law in the tick of a machine, as the block `position`."""

    parts: Parts
    uses: str  # module
    step: tuple[str, ...]  # u_... = step
    reset: tuple[str, ...]
    track: tuple[str, ...]  # after the limit; none for most


def law_of(settings: Any) -> Parts:
    """Parts of a law by its settings, from a user's file or from rtctl.laws."""
    found = own_laws.get(type(settings))
    kind = getattr(settings, "kind", "pd")
    return found or builtin(f"rtctl.laws.{kind}", camel(kind))


def lines(settings: Any, result: str, signals: dict[str, str], tracked: dict[str, str] | None = None) -> LawLines:
    """Lines of a law; `result` is the name of its result, `signals` and `tracked` map argument names to expressions.

    Raises OwnError where the law has an argument that this machine does not offer.
    """
    parts = law_of(settings)
    signals = {**signals, "passed": "passed"}  # an argument of every machine's tick
    step = parts.call("step", "position", signals)
    start = {**dict.fromkeys(signals, "0.0"), "x": signals["x"], "ref": signals["x"]}
    reset = parts.call("reset", "position", start)
    track = ""
    if parts.has("track"):
        track = parts.call("track", "position", tracked or {})
    name = parts.module.__name__
    if parts.source is None:
        return LawLines(parts, name, (f"{result} = {step}",), (reset,), (track,) if track else ())
    return LawLines(
        parts,
        name,
        guarded(f"{result} = {step}", f"{result} = np.nan"),
        guarded(reset, TRIP),
        guarded(track, TRIP) if track else (),
    )


def guarded(line: str, otherwise: str) -> tuple[str, ...]:
    """Lines that run a line of a user's law; an exception leads to a trip and does not end the loop's process."""
    return ("try:", f"    {line}", "except Exception:", f"    {otherwise}")
