"""Text of docs/faults.md from a run of the table of faults.

It holds no time of the wall clock, so every run gives the same bytes.
"""

from rtctl.faults.cases import STANDS
from rtctl.faults.notes import NOTES
from rtctl.faults.play import Outcome
from rtctl.faults.processes import Survived
from rtctl.faults.table import Table
from rtctl.machines.profiles import profile_of
from rtctl.tick.faults import KINDS

HEAD = """# Faults

This page has every fault that `rtctl` can inject, played on every shipped machine. The command
`rtctl fault table --markdown docs/faults.md` wrote it.

```bash
rtctl fault list                                  # all faults
rtctl fault add encoder.freeze --at 3s --for 200ms
rtctl fault clear
```

A config may hold faults too:

```yaml
faults:
  - {fault: encoder.freeze, at: 3 s, lasts: 200 ms}
```

Each fault begins while the machine moves at constant speed. The processes of the daemon run in lockstep, with the
limits of the shipped config.

- *Detected*: ticks from the fault to the trip.
- *Zero written*: ticks from the fault until only zeros are written. A trip writes zeros in its own tick.
- *Reaches the machine*: whether the zeros were at the outputs of the machine while the fault lasted.
- *Largest error*: largest following error from the fault to the trip, beside the limit of the config.
- The last column is `ok` if all rows before the fault equal those of the undisturbed run to the bit, no row is lost,
  and the machine runs again after the fault, with `reset`, `arm` and `play`. Otherwise it says what failed.
"""
UNITS = {"rad": ("rad", 1.0), "m": ("mm", 1e3)}  # unit of a position: unit of its error, and the factor to it


def text(table: Table) -> str:
    """Text of the page for a run of the table, in Markdown."""
    parts = [HEAD]
    for name, stand in STANDS.items():
        outcomes = [o for o in table.outcomes if o.machine == name]
        survived = [s for s in table.survived if s.machine == name]
        if not outcomes:
            continue
        rate = stand.config().loop.rate
        parts.append(f"\n## {name}, {rate:g} Hz: faults between loop and machine\n\n")
        parts.append("| fault | size | detected | zero written | reaches the machine | largest error | |\n")
        parts.append("|---|---|---|---:|---|---:|---|\n")
        parts += [_outcome(o, rate) for o in outcomes]
        parts.append(f"\n## {name}: faults of processes\n\n")
        parts.append("| fault | mode | seen | outputs | what is lost | |\n|---|---|---|---|---|---|\n")
        parts += [_survived(s) for s in survived]
    parts.append("\n## What each fault is, and what to do\n")
    parts += [_note(name) for name in KINDS]
    return "".join(parts)


def _outcome(o: Outcome, rate: float) -> str:
    kind, (unit, factor) = KINDS[o.fault], UNITS[profile_of(o.machine).unit]
    size = f"{o.size:g} {kind.unit}".strip() if kind.size else ""
    size = f"{kind.size} {size}".strip()
    name = f"{o.fault}, channel {o.channel}" if kind.channels > 1 else o.fault
    seen = "not detected" if o.detected is None else f"`{o.trip}` after {o.detected} ({o.detected / rate * 1e3:g} ms)"
    reaches = {True: "yes", False: "not while it lasts", None: ""}[o.wire]
    zero = "" if o.safe is None else f"{o.safe}"
    wrong = [word for bad, word in ((o.lost, f"{o.lost} rows lost"), (not o.same, "differs before the fault"),
                                    (not o.again, "does not run again")) if bad]  # fmt: skip
    error = f"{o.error * factor:.3g} of {o.allowed * factor:.3g} {unit}"
    return f"| {name} | {size} | {seen} | {zero} | {reaches} | {error} | {', '.join(wrong) or 'ok'} |\n"


def _survived(s: Survived) -> str:
    return f"| {s.fault} | {s.mode} | {s.seen} | {s.outputs} | {s.lost} | {'ok' if s.ok else 'FAILED'} |\n"


def _note(name: str) -> str:
    kind, note = KINDS[name], NOTES[name]
    size = (
        f" Size: {kind.size}{f', {kind.unit}' if kind.unit else ''}; {kind.usual:g} if not given." if kind.size else ""
    )
    return (
        f"\n### {name}\n\n{kind.words[0].upper()}{kind.words[1:]}.{size}\n\n"
        f"- imitates: {note.imitates}\n- detected by: {note.detected}\n- what to do: {note.do}\n"
    )
