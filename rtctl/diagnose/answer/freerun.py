"""Free run of a model compared with a recording, sensor by sensor.

In open loop the recorded commands are the input. A machine of one body begins at the position and speed, its whole
state, that fit the first rows best. Any other machine begins at rest where the first rows are at rest, else in the
state of the observer after its transient.

In closed loop the reference is the input: the tick of the config closes the loop of a recording by rtctl, else the
known law. A machine with a held motion (kinematic, static) is predicted from the first row.
"""

import numpy as np

from rtctl.case.laws import INPUT
from rtctl.config.errors import NoAnswer, UserError
from rtctl.diagnose.answer.comparison import NAMES, Channel, Comparison
from rtctl.diagnose.answer.emulate import can_emulate, emulate
from rtctl.diagnose.likelihood.held import other_commands
from rtctl.diagnose.likelihood.likelihood import settled
from rtctl.diagnose.model import loop
from rtctl.diagnose.model.kernel import OPEN, TRACK
from rtctl.diagnose.model.loop_of import loop_of
from rtctl.diagnose.model.model import GraphModel, nominal
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.record.replayed import replayed_law
from rtctl.plants.graph.term_units import turns_at
from rtctl.plants.graph.units import measured_unit
from rtctl.trace.bundle import Bundle

FIRST = 20  # rows of the estimate of the first position and speed
ROUNDS = 3  # Gauss-Newton steps of the estimate: the error of few rows is nearly linear
STILL = 5.0  # resolutions of the main sensor: largest noise and vibration at rest
COUNTS = "counts"  # unit of a counter's column


def compare(record: GraphRecord, closed: bool | None = None, skip: int = 0, bundle: Bundle | None = None) -> Comparison:
    """Comparison of a free run of the machine of a case with the record, without held or followed rows.

    The loop is closed from the reference, or open from the recorded commands. For None it is closed where the law is
    known and the recording has a reference, or where the tick of the `bundle`'s config gave the command to the bit.
    Raises UserError where a loop cannot be closed or `skip` leaves less than two rows, NoAnswer for divergence.
    """
    n, sim = len(record.t), Simulator(record)
    around = loop_of(record)
    known = around.known and bool(np.isfinite(record.ref).all()) and sim.mode == TRACK
    ticks = closed is not False and sim.mode == TRACK and ticks_again(record, bundle, around.known)
    closed = known or ticks if closed is None else closed
    if closed and not known and not ticks:
        raise UserError(f"the loop cannot be closed: {_why(record, around.known)}; simulate it with --open-loop")
    if not 0 <= skip <= n - 2:
        raise UserError(f"--skip {skip}: the recording has {n} rows; leave at least two")
    if closed and ticks:
        assert bundle is not None  # ticks_again
        return _compared(sim, *emulate(bundle, record), True, skip)
    model, volts = nominal(record.case), None
    if closed:
        out, volts = loop.run(_started(sim, model, skip), around, model, record.ref, record.w, shaped=True)
    else:
        out, skip = _open(sim, model, skip)
    lost = np.flatnonzero(~np.isfinite(out).all(axis=1))
    if len(lost):
        k = int(lost[0])
        raise NoAnswer(f"the model diverged at tick {k} ({record.t[k] - record.t[0]:.6g} s) in {NAMES[closed]}")
    readings = {name: out[:, sim.column(name)] for name in (*sim.channels, *record.edges)}
    for name in record.edges:  # they count the motion in either direction
        readings[name] = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(readings[name])))])
    return _compared(sim, readings, volts, closed, skip)


def ticks_again(record: GraphRecord, bundle: Bundle | None, known: bool) -> bool:
    """Whether the tick of the bundle's config can close the loop.

    Its law is known, or gives the recorded command to the bit.
    """
    if bundle is None or not can_emulate(bundle):
        return False
    if known:
        return True
    found = record.source.replay if record.source is not None else replayed_law(bundle)
    return found is not None and found.identical


def _why(record: GraphRecord, known: bool) -> str:
    """Reason why no law closes the loop."""
    said = next((warning for warning in record.case.warnings if INPUT in warning), "its law is not known")
    return "the recording has no reference" if known else said


def _open(sim: Simulator, model: GraphModel, skip: int) -> tuple[np.ndarray, int]:
    """Readings (n, sensors) under the recorded commands, and the first row that counts.

    Commands that no controller wrote were held between their samples or smooth: the better fit is taken.
    """
    if sim.mode != TRACK:
        return sim.run(model), skip
    other = other_commands(sim)
    runs = [_freely(one, model, skip) for one in (sim, *([other] if other is not None else []))]
    column = sim.column(sim.main)
    errors = [float(np.mean((out[begin:, column] - sim.seen[begin:]) ** 2)) for out, begin in runs]
    return runs[1] if len(runs) > 1 and errors[1] < errors[0] else runs[0]  # a diverged run counts as held


def _freely(sim: Simulator, model: GraphModel, skip: int) -> tuple[np.ndarray, int]:
    """Readings (n, sensors) and the first row that counts."""
    started = _started(sim, model, skip)
    if started.begins is not None:
        return started.run(model, OPEN), skip
    x = sim.seen[: round(1.0 / sim.follow / sim.record.dt) + 1]
    rests = not sim.shows_speed and np.ptp(x) <= STILL * sim.record.grain[sim.main]
    at = skip if rests else max(skip, min(settled(sim), len(sim.seen) // 4))
    return sim.released(0 if rests else at).run(model), at


def _started(sim: Simulator, model: GraphModel, skip: int) -> Simulator:
    """Simulator at the first position and speed of a machine of one body; unchanged for any other machine."""
    if sim.layout.nq > 1 or sim.case.problem != "driven":
        return sim
    first = begin(sim, model, max(FIRST, skip))
    return sim.beginning(*(first or (0.0, 0.0) if sim.shows_speed else first or (float(sim.seen[0]), 0.0)))


def begin(sim: Simulator, model: GraphModel, rows: int = FIRST) -> tuple[float, float] | None:
    """First position and speed of the main body, SI, by least squares of a free run over the first `rows` rows.

    Gauss-Newton starts from the first reading at rest, or from the first speed in both directions, since a sensor may
    have no direction. None where the model diverges: the run then begins at rest at the first position.
    """
    rows = min(rows, len(sim.seen))
    seen, column = sim.seen[:rows], sim.column(sim.main)
    first = float(seen[0])
    guesses = [(0.0, first), (0.0, -first)] if sim.shows_speed else [(first, 0.0)]
    per_s, size = 1.0 / (rows * sim.record.dt), max(float(np.ptp(seen)), 1e-9)
    steps = size * np.array([1.0 / per_s, 1.0] if sim.shows_speed else [1.0, per_s])

    def error(x: np.ndarray) -> np.ndarray:
        return np.asarray(seen - sim.beginning(float(x[0]), float(x[1])).run(model, OPEN, rows)[:, column])

    found: list[np.ndarray] = []
    for guess in guesses:
        x = np.array(guess)
        for _ in range(ROUNDS):
            e = error(x)
            J = np.stack([error(x + step) - e for step in np.diag(steps)], axis=1)
            if not np.isfinite(J).all():
                break
            x = x - steps * np.linalg.lstsq(J, e, rcond=None)[0]
        else:
            found.append(x)
    if not found:
        return None
    best = min(found, key=lambda x: float(np.sum(error(x) ** 2)))
    return float(best[0]), float(best[1])


def _compared(
    sim: Simulator, readings: dict[str, np.ndarray], volts: np.ndarray | None, closed: bool, skip: int
) -> Comparison:
    """Comparison of readings (n,) by sensor, SI, and commands (n, drives) of a law with the record."""
    record, channels = sim.record, {}
    for name, made in readings.items():
        label, channel = _channel(sim, name, made[skip:], skip)
        channels[label] = channel
    for column, (name, drive) in enumerate(sim.case.machine.drives.items() if volts is not None else ()):
        assert volts is not None
        label = name if record.source is None else record.source.commands[column]
        channels[label] = Channel(record.u[skip:, column], volts[skip:, column], drive.unit)
    return Comparison(record.t[skip:], channels, closed, skip)


def _channel(sim: Simulator, name: str, made: np.ndarray, skip: int) -> tuple[str, Channel]:
    """Name and channel of one sensor: its own name and SI, or its column and unit in exchange format 1.

    The offset of a position beside the main one is arbitrary: the position is compared up to a constant.
    """
    machine, record = sim.case.machine, sim.record
    sensor = machine.sensors.get(name)
    seen = record.edges[name] / sensor.scale if sensor is not None and name in record.edges else record.y[name]
    measures = "force" if sensor is None else sensor.measures  # a channel without a sensor is the force of a drive
    if measures == "position" and name != sim.main:
        made = made + np.mean(seen[skip:] - made)
    unit = measured_unit(measures, turns_at(machine, sensor or machine.drives[name]))
    if record.source is None or sensor is None:
        return name, Channel(seen[skip:], made, unit)
    if sensor.counts_per_unit is not None:
        return sensor.column, Channel(sensor.scale * seen[skip:], sensor.scale * made, COUNTS)
    own = record.source.case.sensors.unit or unit
    return sensor.column, Channel(seen[skip:], made, f"{own}/s" if own != unit and measures == "speed" else own)
