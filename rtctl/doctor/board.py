"""Wiring checks of a real board, by hand and with the outputs off: instruction, reading and right result of each.

This module writes only zeros to the card.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

from rtctl.config.errors import UserError
from rtctl.doctor.finding import Finding
from rtctl.drivers import at_mio_16de as mio
from rtctl.drivers import daq_stc, optical_sensor
from rtctl.drivers.board import Board, input_params
from rtctl.machines.base import DESCRIBED
from rtctl.machines.profile import REELS, SCALE
from rtctl.machines.profiles import profile_of
from rtctl.machines.wiring import wiring
from rtctl.tick import frames

REST_READS = 200  # readings at rest
REST_CODES = 4  # ADC codes, peak to peak, at rest; the thesis's board has 0.5 LSB of dither
TURN = 0.05  # relative tolerance of a turn by hand
STROKE = 0.1  # m, travel by hand
BACK = 0.02  # relative tolerance of the return, beside that of the way there
SILENT = "nobody was asked: no terminal, or --json"


class Sample(NamedTuple):
    """One reading: counts since the start of a step, signed, and volts of the inputs."""

    counts: tuple[int, ...]
    volts: tuple[float, ...]


class Person(Protocol):
    """Person who carries out the steps at the machine."""

    def act(self, step: "Step", read: Callable[[], Sample]) -> bool:
        """Whether the step was done; `read` is called repeatedly meanwhile."""

    def confirm(self, step: "Step") -> bool | None:
        """Whether the right result was found; None where the step was left out."""


class Step(NamedTuple):
    """One check."""

    name: str
    do: str  # instruction for a person; "" for none
    right: str  # right result
    judge: (
        Callable[[list[Sample]], tuple[str, bool]] | None
    )  # text of the result, and whether it is right; None: a person judges


class Wires:
    """Open card, read as the loop reads it."""

    def __init__(self, card: Board) -> None:
        self.card = card
        self._frame = np.zeros(1, frames.INPUTS)[0]
        self._from: list[int] = []
        self.start()

    def start(self) -> None:
        """Set the outputs to zero and the counts to 0."""
        self.card.zero()
        self._from = self._codes()
        self._counts = [0] * len(self._from)

    def _codes(self) -> list[int]:
        self.card.read(self._frame)
        return [int(c) for c in self._frame["counter_codes"][: self.card.wiring.counters]]

    def read(self) -> Sample:
        """Present reading of the card."""
        codes = self._codes()
        for n, (code, before) in enumerate(zip(codes, self._from, strict=True)):
            self._counts[n] += int(daq_stc.difference.py_func(code, before))
        self._from = codes
        used = zip(self.card.inputs, self._frame["ai_codes"], strict=False)
        return Sample(tuple(self._counts), tuple(float(mio.codes_to_input_volts.py_func(p, c)) for p, c in used))


def run(config: Any, card: Board, person: Person | None, tell: Callable[[Finding], None]) -> list[Finding]:
    """Findings of all steps with an open card, each passed to `tell`; without a person the steps by hand are left out.

    Raises BoardError where the card fails.
    """
    found = [Finding("card", card.name, "good")]
    tell(found[0])
    wires = Wires(card)
    for step in steps(config):
        found.append(_one(step, wires, person))
        tell(found[-1])
    card.zero()
    return found


def _one(step: Step, wires: Wires, person: Person | None) -> Finding:
    wires.start()
    if step.judge is None:
        said = None if person is None else person.confirm(step)
        if said is None:
            return Finding(step.name, SILENT if person is None else "left out", "unknown", change=step.do)
        return Finding(
            step.name,
            "as it should be" if said else "not so",
            "good" if said else "bad",
            "",
            "" if said else f"right is: {step.right}",
        )
    samples = [wires.read()]

    def read() -> Sample:
        samples.append(wires.read())
        return samples[-1]

    if step.do:
        if person is None:
            return Finding(step.name, SILENT, "unknown", change=step.do)
        if not person.act(step, read):
            return Finding(step.name, "left out", "unknown", change=step.do)
    else:
        for _ in range(REST_READS):
            read()
    words, good = step.judge(samples)
    return Finding(step.name, words, "good" if good else "bad", "", "" if good else f"right is: {step.right}")


OUTPUTS = Step(
    "outputs", "Measure every analog output at the connector block with a voltmeter.", "0 V, within 5 mV, and no drift",
    None,
)  # fmt: skip


def steps(config: Any) -> list[Step]:
    """Checks of a machine, in a safe order."""
    described = config.kind == DESCRIBED
    common = [
        Step("emergency stop", "Push the emergency stop. The motors must turn freely by hand.",
             "no drive has power while you touch the machine", None),
        Step("rest", "", f"counters stand still, inputs within {REST_CODES} codes", _rest(config)),
    ]  # fmt: skip
    if described:  # on a bus: there is no terminal for a voltmeter
        return [*common, *_named(config)]
    common.insert(1, OUTPUTS)
    profile = profile_of(config.kind)
    of = _reels if profile.has(REELS) else _carriage if profile.has(SCALE) else _axis
    return [*common, *of(config)]


def _reels(config: Any) -> list[Step]:
    counts = config.sensors.capstan.lines * config.sensors.capstan.multiply
    out = [
        *_way("capstan", 0, "Turn the capstan one full turn, tape towards reel 1.", counts, "one turn", TURN),
    ]
    for n, name in enumerate(("reel1", "reel2")):
        sensor = getattr(config.sensors, name)
        do = f"Turn {name.replace('l', 'l ')} slowly by hand, one full turn in about ten seconds."
        right = f"{sensor.pulses} pulses, from below {sensor.low:g} V to above {sensor.high:g} V"
        out.append(Step(name, do, right, _pulses(n, sensor)))
    return out


def _carriage(config: Any) -> list[Step]:
    counts = config.sensors.encoder.lines * config.sensors.encoder.multiply
    travel = round(STROKE / config.sensors.scale.pitch)
    turns = STROKE / (2 * math.pi * config.sensors.R_c)
    push, way = f"Push the carriage {STROKE * 1e3:g} mm away from home", f"{STROKE * 1e3:g} mm"
    return [
        *_way("scale", 1, f"{push}.", travel, way, 0.1),
        Step("encoder", f"{push} once more.",
             f"about {counts * turns:.0f} counts, upwards, and the scale beside it",
             _together(counts / (2 * math.pi * config.sensors.R_c), 1 / config.sensors.scale.pitch)),
    ]  # fmt: skip


def _axis(config: Any) -> list[Step]:
    travel = round(STROKE / config.encoder.pitch)
    return _way("encoder", 0, f"Push the axis {STROKE * 1e3:g} mm forwards.", travel, f"{STROKE * 1e3:g} mm", 0.1)


def _named(config: Any) -> list[Step]:
    """Checks of a described machine's position sensors, moved by hand: each changes, in the right direction."""
    wires = wiring(config)
    found = []
    for n, name in enumerate(wires.sensors):
        what = config.machine.sensors[name]
        if what.measures != "position" or what.body is None:
            continue
        do = f"Move {what.body} forwards by hand, half a turn or 50 mm, and leave it there."
        counter, number = (n, None) if n < wires.counters else (None, n - wires.counters)
        found.append(Step(name, do, "it goes up", _upwards(counter, number)))
    return found


def _upwards(counter: int | None, number: int | None) -> Callable[[list[Sample]], tuple[str, bool]]:
    def judge(samples: list[Sample]) -> tuple[str, bool]:
        if counter is not None:
            moved: float = samples[-1].counts[counter]
            words = f"{moved:+.0f} counts"
        else:
            assert number is not None
            moved = samples[-1].volts[number] - samples[0].volts[number]
            words = f"{moved:+.4g} rad or m"
        if moved == 0:
            words += "; it does not change: is it the right node, sensor and wire?"
        elif moved < 0:
            words += "; the wrong way: give per_turn the other sign, or swap A and B"
        return words, moved > 0

    return judge


def _way(name: str, counter: int, do: str, counts: int, way: str, within: float) -> list[Step]:
    """Checks of a motion there and back: sign, size, and lost counts."""
    back = "Go back to where you began."

    def there(samples: list[Sample]) -> tuple[str, bool]:
        n = samples[-1].counts[counter]
        words = f"{n:+d} counts"
        if n == 0:
            words += "; none at all: is the encoder fed, are its wires on the counter's source and direction?"
        elif n < 0:
            words += "; the wrong way: swap A and B of this encoder"
        elif not abs(n / counts - 1) <= within:
            words += f"; {n / counts:.3g} of what it should be: lines, x1 or x4, or counts lost"
        return words, abs(n / counts - 1) <= within

    def returned(samples: list[Sample]) -> tuple[str, bool]:
        n = samples[-1].counts[counter]
        return f"{n:+d} counts", abs(n / counts + 1) <= within + BACK

    return [
        Step(name, do, f"{counts:+d} counts for {way}, within {within:.0%}", there),
        Step(f"{name}, back", back, f"{-counts:+d} counts, within {within + BACK:.0%}", returned),
    ]


def _pulses(channel: int, sensor: Any) -> Callable[[list[Sample]], tuple[str, bool]]:
    def judge(samples: list[Sample]) -> tuple[str, bool]:
        volts = [s.volts[channel] for s in samples]
        s = np.zeros(1, optical_sensor.OPTICAL_SENSOR_STATE).view(np.recarray)[0]
        p = optical_sensor.build(sensor, 1.0)
        edges = [int(optical_sensor.count.py_func(p, s, v)) for v in volts][-1]
        low, high = min(volts), max(volts)
        words = f"{edges} pulses, {low:.2f} to {high:.2f} V"
        if high - low < 0.1:
            words += "; it does not change: is the sensor fed, is it on this input?"
        return words, abs(edges - sensor.pulses) <= 1 and low < sensor.low and high > sensor.high

    return judge


def _together(encoder_per_metre: float, scale_per_metre: float) -> Callable[[list[Sample]], tuple[str, bool]]:
    def judge(samples: list[Sample]) -> tuple[str, bool]:
        encoder, scale = (
            n / per for n, per in zip(samples[-1].counts, (encoder_per_metre, scale_per_metre), strict=True)
        )
        words = f"{encoder * 1e3:+.2f} mm by the encoder, {scale * 1e3:+.2f} mm by the scale"
        if encoder * scale < 0:
            words += "; against each other: swap A and B of one"
        return words, scale > STROKE / 2 and abs(encoder / scale - 1) <= TURN

    return judge


def _rest(config: Any) -> Callable[[list[Sample]], tuple[str, bool]]:
    def judge(samples: list[Sample]) -> tuple[str, bool]:
        moved = [max(s.counts[n] for s in samples) - min(s.counts[n] for s in samples)
                 for n in range(len(samples[0].counts))]  # fmt: skip
        wide = [max(s.volts[n] for s in samples) - min(s.volts[n] for s in samples)
                for n in range(len(samples[0].volts))]  # fmt: skip
        level = ", ".join(f"{v:.3f} V" for v in samples[-1].volts)
        words = f"counters moved {moved}" + (f"; inputs at {level}, {', '.join(f'{w * 1e3:.1f}' for w in wide)} mV wide"
                                             if wide else "")  # fmt: skip
        steps_ = [REST_CODES * input_params(i).volts_per_code for i in wiring(config).inputs]
        quiet = all(w <= most * (1 + 1e-9) for w, most in zip(wide, steps_, strict=True))
        return words, quiet and all(m <= 1 for m in moved)  # an encoder may stand on an edge

    return judge


def card_of(config: Any) -> Board:
    """Card of a config, not open yet. Raises UserError for an emulated board."""
    from rtctl.drivers.boards import make

    if config.driver.kind == "emulated":
        raise UserError(f"--board: {config.name} has an emulated board, which has no wires; say which card, e.g. "
                        "--set 'driver={kind: comedi, device: /dev/comedi0}'")  # fmt: skip
    return make(config.driver, wiring(config), config.driver.rate or config.loop.rate)
