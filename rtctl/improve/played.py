"""Runs of a law on an emulated machine: the law of one config with the plant of another, and figures of the run.

The error is that of the judged body against the reference before the remedies: a remedy that slows the reference down
is judged by the original reference.
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl import machines
from rtctl.config.errors import UserError
from rtctl.loop import fused, generate
from rtctl.machines.base import DESCRIBED
from rtctl.machines.described_motion import mechanics
from rtctl.machines.profiles import profile_of
from rtctl.machines.reference_motion import motion
from rtctl.tick import safety
from rtctl.trace.metrics import step_metrics

REST = 1.0  # s played after the last change of the reference


class Judge(NamedTuple):
    """Column of the truth that is compared with the reference."""

    column: str
    ratio: float  # units of the column for one unit of the reference
    words: str


class Figures(NamedTuple):
    """Figures of one run, in the unit of the reference and of the command."""

    rms: float  # tracking error
    most: float
    final: float  # largest mean error at rest
    overshoot: float  # % of the step, the largest
    settling: float  # s, the longest; inf where it does not settle
    effort: float  # rms of the command
    tripped: str


class Played(NamedTuple):
    """A run: figures, and signals over the time that the reference plays, (n,)."""

    figures: Figures
    t: np.ndarray  # s
    ref: np.ndarray
    y: np.ndarray  # of the judged body, in units of the reference
    u: np.ndarray  # first output


def judge_of(config: Any, body: str | None = None) -> Judge:
    """Judged body: the named one, else of a described machine the last body that no drive acts on.

    Raises UserError for a body that the machine does not have.
    """
    machine = machines.build(config)
    truth = machine.signals.truth
    if config.kind != DESCRIBED:
        if body is not None:
            raise UserError(
                f"--body {body}: the body that follows is that of {truth}; --body is for a described machine"
            )
        return Judge(truth, 1.0, truth.removeprefix("truth_"))
    described = config.machine
    moving = [name for name in described.bodies if not described.is_frame(name)]
    if body is not None and body not in moving:
        raise UserError(f"--body {body}: the machine has {', '.join(moving)}")
    try:
        made = mechanics(config, machine.dt)
    except ValueError:  # a speed, or mechanics of a file: the column of the feedback
        return Judge(truth, 1.0, truth.removeprefix("truth_"))
    driven = {drive.body for drive in described.drives.values()}
    name = body or next((name for name in reversed(moving) if name not in driven), moving[0])
    ratio = float(made.rows[name] @ motion(made).phi)
    if abs(ratio) < 1e-12:
        raise UserError(f"--body {name}: the reference does not move it")
    return Judge(f"truth_{name.replace('-', '_')}", ratio, name)


def with_reference(config: Any) -> Any:
    """The config, fused, with the reference of its profile where it has none. Raises UserError where there is none."""
    from rtctl.config.load import set_paths

    changes: dict[str, Any] = {"loop.mode": "fused"}
    if not config.reference.steps and not config.reference.knots:
        usual = profile_of(config.kind).range
        if usual is None:
            raise UserError("reference is missing: there is no motion to improve; give --reference FILE, or write one")
        changes["reference"] = {"knots": [list(knot) for knot in usual.knots]}
    return set_paths(config, changes)


def seconds_of(config: Any) -> float:
    """Length of one playback, s."""
    table = machines.build(config).reference
    played = table.period * table.dt if table.period else float(table.t[table.n - 1])
    return played + REST


def move_of(config: Any) -> float:
    """Length of the move in s: one period of a repeated reference, else the whole playback."""
    table = machines.build(config).reference
    return table.period * table.dt if table.period else seconds_of(config)


def play(law: Any, plant: Any, seconds: float, judge: Judge, asked: np.ndarray | None = None) -> Played:
    """Play the law of one config on the emulated machine of another for `seconds` of its reference.

    `asked` (n,) is the reference by which the error is judged; the reference of the law's config if absent.
    """
    machine = machines.build(law)
    other = machines.build(plant)
    machine = machine._replace(
        plant_diagram=other.plant_diagram, truth=other.truth, substeps=other.substeps, plant_period=other.plant_period
    )
    made = generate.generate(machine, "shm")
    arming = 30.0 if getattr(getattr(law, "radius", None), "source", "") == "measured" else 2.0
    run = fused.play(machine, made, round((seconds + arming) * machine.rate))
    rows = run.rows
    first = int(np.argmax(rows["state"] == safety.RUNNING)) if (rows["state"] == safety.RUNNING).any() else 0
    rows = rows[first : first + round(seconds * machine.rate)]
    ref = rows["ref"].copy()
    n = len(ref) if asked is None else min(len(ref), len(asked))
    wanted = ref[:n] if asked is None else asked[:n]
    y = rows[judge.column][:n] / judge.ratio
    outputs = np.array([rows[name][:n] for name in machine.signals.outputs])
    tripped = run.tripped
    t = rows["t"][:n] - rows["t"][0]
    return Played(figures_of(t, rows["target"][:n], wanted, y, outputs, tripped), t, ref[:n], y, outputs[0])


def figures_of(
    t: np.ndarray, target: np.ndarray, ref: np.ndarray, y: np.ndarray, u: np.ndarray, tripped: str
) -> Figures:
    """Figures of a run (n,) by its target, reference, position and commands (drives, n); infinite where it tripped."""
    error = ref - y
    if not np.isfinite(error).all() or tripped:
        return Figures(np.inf, np.inf, np.inf, np.inf, np.inf, np.inf, tripped or "not a number")
    steps = step_metrics(t, target, y, None, None)
    settling = [step["settling_s"] for step in steps]
    return Figures(
        rms=float(np.sqrt(np.mean(error**2))),
        most=float(np.abs(error).max()),
        final=max((abs(float(step["final_error"] or 0.0)) for step in steps), default=float(abs(error[-1]))),
        overshoot=max((float(step["overshoot_pct"] or 0.0) for step in steps), default=0.0),
        settling=max((np.inf if s is None else float(s) for s in settling), default=0.0),
        effort=float(np.sqrt(np.mean(u**2))),
        tripped="",
    )
