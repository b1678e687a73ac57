"""Events of a random day, one after the other, each drawn only from the seed and its number.

Each event tells the checker what to expect: the tick from which no trip may occur, the tick by which a fault must trip,
and the target of a move. The sequence of events does not depend on the mode of time, nor on the machine if its law has
gains to change.
"""

from collections import Counter

import numpy as np

from rtctl.config.load import get_path
from rtctl.soak import ranges
from rtctl.soak.invariants import NEVER
from rtctl.soak.rig import Rig
from rtctl.tick import faults, safety

WEIGHTS = {  # probability of each event
    "move": 0.28, "ramp": 0.2, "burst": 0.1, "gains": 0.1, "switch": 0.04, "play": 0.06, "capture": 0.02, "wait": 0.05,
    "fault": 0.15,
}  # fmt: skip
GAIN_STEPS = 5  # number of values that a gain may take
PATIENCE = 60.0  # s of machine time to wait for standstill or state running
MOST_CAPTURES = 8
CAPTURE = 1.5  # s of a capture
STILL = 0.1  # s over which standstill is checked
TRIES = 3  # attempts to arm after a fault
KINDS = [name for name, kind in faults.KINDS.items() if kind.number != faults.NONE]  # those in the tick


class Day:
    """Player of a day's events on a rig. Its state between events is `number`, `moves` and the four counters."""

    def __init__(self, rig: Rig, seed: int, with_faults: bool = True):
        self.rig, self.seed, self.with_faults = rig, seed, with_faults
        self.config = rig.machine.config
        self.range = ranges.range_of(rig.machine)
        self.gains = ranges.gains_of(self.config)
        self.number = 0
        self.moves = 0
        self.events: Counter[str] = Counter()
        self.injected: Counter[str] = Counter()
        self.tripped: Counter[str] = Counter()
        self.recovered: Counter[str] = Counter()
        kinds = [k for k in WEIGHTS if (with_faults or k != "fault") and (self.gains or k != "gains")]
        weights = np.array([WEIGHTS[k] for k in kinds])
        self._kinds, self._weights = kinds, weights / weights.sum()

    def step(self) -> None:
        """Play the next event."""
        self.rng = np.random.default_rng([self.seed, self.number])
        self.rig.checker.event = self.number
        kind = str(self.rng.choice(self._kinds, p=self._weights))
        if self._state != safety.RUNNING:
            self._get_running()
        getattr(self, f"_{kind}")()
        self.events[kind] += 1
        self.number += 1

    # what the machine is and does

    @property
    def _state(self) -> int:
        last = self.rig.checker.last
        return safety.IDLE if last is None else int(last["state"])

    @property
    def _position(self) -> float:
        return float(self.rig.checker.last[self.range.position])

    @property
    def _off(self) -> float:
        """Encoder position less true position, from missed counts; 0 without a truth. Moves use the true position."""
        last = self.rig.checker.last
        true = float(last[self.range.truth]) if self.range.truth in last.dtype.names else np.nan
        return self._position - true if np.isfinite(true) else 0.0

    def _run(self, seconds: float) -> None:
        self.rig.run(max(round(seconds * self.rig.machine.rate), 1))

    def _restless(self) -> None:
        """Switch off the check of the target while a command is carried out."""
        self.rig.checker.windows["settled_from"] = NEVER

    # events

    def _move(self, watch: bool = True) -> None:
        """A setpoint without a ramp."""
        step = float(self.rng.uniform(-1.0, 1.0)) * self.range.jump
        self._go(self._position + step if abs(self._position - self._off + step) < self.range.travel
                 else self._position - step, 0.0, watch)  # fmt: skip

    def _ramp(self) -> None:
        """A setpoint with a ramp, anywhere within the travel."""
        target = self._off + float(self.rng.uniform(-1.0, 1.0)) * self.range.travel
        self._go(target, float(np.exp(self.rng.uniform(*np.log(self.range.rate)))))

    def _go(self, target: float, rate: float, watch: bool = True) -> None:
        self._restless()
        way = abs(target - self._position)
        self.rig.setpoint(target, rate)
        if not watch:
            return
        self._run((way / rate if rate else 0.0) + self.range.settle)
        if self._state == safety.RUNNING:
            w = self.rig.checker.windows
            w["target"], w["settled_from"] = target, self.rig.tick
            self.moves += 1
        self._run(float(self.rng.uniform(0.1, 2.0)))

    def _burst(self) -> None:
        """Many small setpoints, faster than the machine can follow."""
        self._restless()
        centre, target = self._position, self._position
        for _ in range(int(self.rng.integers(5, 60))):
            target = centre + float(self.rng.uniform(-0.1, 0.1)) * self.range.jump
            self.rig.setpoint(target, float(self.rng.choice([0.0, self.range.rate[1]])))
            self._run(float(self.rng.exponential(0.02)))
        self._go(target, 0.0)

    def _gains(self) -> None:
        """Another value for one setting of the law, while the machine moves or stands still."""
        path = str(self.rng.choice(list(self.gains)))
        low, high = self.gains[path]
        value = low + (high - low) * int(self.rng.integers(GAIN_STEPS)) / (GAIN_STEPS - 1)
        if self.rng.random() < 0.5:
            self._move(watch=False)
            self._run(float(self.rng.uniform(0.0, 0.2)))
        self._restless()
        self.rig.set(path, float(value))
        self._run(self.range.settle)
        self._move()

    def _switch(self) -> None:
        """Outputs off for a while, and on again."""
        self._restless()
        self.rig.ask("disarm")
        self._run(float(self.rng.uniform(0.05, 2.0)))
        self._get_running()

    def _play(self) -> None:
        """Play of the config's reference from its start."""
        self._restless()
        table = self.rig.machine.reference
        self.rig.ask("play")
        self._run(min(float(table.t[table.n - 1]), 30.0) * float(self.rng.uniform(0.2, 1.2)) + 0.1)
        self._go(self._position, 0.0)

    def _capture(self) -> None:
        """A capture of the current motion."""
        checker, rate = self.rig.checker, self.rig.machine.rate
        if len(checker.captures) < MOST_CAPTURES:
            first = self.rig.tick
            checker.capture(first, first + round(CAPTURE * rate), f"capture-{len(checker.captures) + 1}")
        self._move()
        self._run(CAPTURE)

    def _wait(self) -> None:
        """A pause without commands."""
        self._run(float(np.exp(self.rng.uniform(np.log(0.1), np.log(20.0)))))

    def _fault(self) -> None:
        """A fault of a random kind, in 70 % of cases during a move; then recovery to running."""
        kind, settings = self._draw()
        checker, moving = self.rig.checker, bool(self.rng.random() < 0.7)
        self._restless()
        if moving:
            self._start_ramp()
        before = int(checker.carry["trips"])
        w = checker.windows
        w["quiet_from"] = w["counts_from"] = NEVER
        lost = self.rig.lost_counts
        fault = self.rig.fault(settings)
        self.injected[kind] += 1
        must = self._must(kind, fault, moving)
        if must is not None:
            w["must_by"], w["must_above"] = max(fault.begin, self.rig.tick) + must, before
        self.rig.run(max(fault.end - self.rig.tick, 1))
        self._run(0.2)
        tripped = int(checker.carry["trips"]) > before
        self.tripped[kind] += int(tripped)
        ready = self._bring_back()
        checker.checked("recovery")
        self.recovered[kind] += int(tripped and ready)
        w["must_by"] = NEVER
        if kind in ("encoder.missed", "encoder.freeze") or self.rig.lost_counts != lost:  # counts are lost
            ready = ready and self._find_anew()
            checker.carry["has_base"] = 0  # new zero for the comparison of counts
        w["counts_from"] = NEVER if self.config.faults else self.rig.tick
        if ready and not self.config.faults:  # faults of the config have their own times
            w["quiet_from"] = self.rig.tick

    def _draw(self) -> tuple[str, faults.FaultSettings]:
        rng, dt, r = self.rng, self.rig.machine.dt, self.range
        kind = str(rng.choice(KINDS))
        known = faults.KINDS[kind]
        wired = {"encoder": r.counters, "adc": max(r.inputs, 1)}.get(kind.split(".")[0], len(r.outputs))
        channel = int(rng.integers(min(wired, known.channels))) if known.channels > 1 else 0
        lasts = float(np.exp(rng.uniform(np.log(5e-3), np.log(1.0))))
        low, high = SIZES.get(kind, (max(known.usual / 4, 1e-9), max(min(2 * known.usual, known.high), 2e-9)))
        size = float(np.exp(rng.uniform(np.log(low), np.log(high)))) if known.size else None
        if kind == "link.silent":
            lasts *= 2.0  # longer than the link time-out more often
        if kind == "loop.stall":
            size = float(size or 0.0) * dt
        if kind == "dac.stuck":
            at = faults.FaultSettings(fault=kind, channel=channel)
            bits = faults.bits_of(faults.build(at, dt, 0, self.rig.machine.diagram.blocks))
            size, lasts = float(rng.integers(bits)), min(lasts, 0.2)  # short: the stuck bit drives the machine
        return kind, faults.FaultSettings(
            fault=kind, at=float(rng.uniform(0.0, 0.05)), lasts=max(lasts, dt), channel=channel, size=size
        )

    def _start_ramp(self) -> None:
        """Start a move that takes longer than any fault."""
        r = self.range
        here = self._position - self._off
        self.rig.setpoint(self._off - np.sign(here or 1.0) * r.travel, r.travel / 3.0)
        self._run(0.5)

    def _must(self, kind: str, fault: faults.Fault, moving: bool) -> int | None:
        """Number of ticks from the beginning of a fault by which it must trip; None where it need not trip."""
        limits, rate = self.config.safety, self.rig.machine.rate
        w = self.rig.checker.windows
        lasts = fault.end - fault.begin
        if self._state != safety.RUNNING:
            return None
        if kind == "link.silent":
            most = int(w["link_ticks"]) + 2
        elif kind == "loop.stall" and limits.missed_ticks and fault.size > w["late"]:
            most = int(w["missed"]) + 1
        elif kind == "encoder.freeze" and moving and fault.channel == 0 and limits.following_error:
            most = round((limits.following_error / (self.range.travel / 3.0) + 0.2) * rate)
        else:
            return None
        most += self.rig.slack
        return most if lasts > most else None

    # getting back

    def _bring_back(self) -> bool:
        """Bring the machine back to running, at rest and within the travel. Returns whether it is running."""
        for _ in range(TRIES):
            self._stand_still()
            if not self._get_running():
                return False
            here = self._position - self._off
            target = self._off + float(np.clip(here, -self.range.travel, self.range.travel))
            rate = self.range.travel / 3.0
            self.rig.setpoint(target, rate)
            self._run(abs(self._position - target) / rate + self.range.settle)
            if self._state == safety.RUNNING:
                return True
        self.rig.checker.note("recovery", self.rig.tick, float(self._state), float(safety.RUNNING))
        return False

    def _find_anew(self) -> bool:
        """Let the machine measure again a quantity that depends on lost counts. Returns whether it is running."""
        if self.range.measure is None:
            return True
        path, measured = self.range.measure
        self._restless()
        self.rig.set(path, measured)
        self.rig.ask("disarm")
        self._run(STILL)
        ready = self._get_running()
        self.rig.set(path, get_path(self.config, path))
        return ready

    def _stand_still(self) -> None:
        """Wait until a coasting machine is at rest, if it is not running."""
        if self._state == safety.RUNNING:
            return
        for _ in range(round(PATIENCE / STILL)):
            before = self._position
            self._run(STILL)
            if abs(self._position - before) < 0.01 * self.range.rate[0] * STILL:
                return

    def _get_running(self) -> bool:
        """Reset if tripped, arm, and wait for running. Returns whether it runs; if not, that is a violation."""
        if self._state == safety.RUNNING:
            return True
        if self._state == safety.TRIPPED:
            self.rig.ask("reset")
            self._wait_for(safety.IDLE)
        if self._state == safety.IDLE:
            self.rig.ask("arm")
        if self._wait_for(safety.RUNNING):
            return True
        self.rig.checker.note("recovery", self.rig.tick, float(self._state), float(safety.RUNNING))
        return False

    def _wait_for(self, state: int) -> bool:
        for _ in range(round(PATIENCE / STILL)):
            self._run(STILL if state != safety.IDLE else self.rig.machine.dt)
            if self._state == state:
                return True
            if self._state == safety.TRIPPED and state == safety.RUNNING:
                return False
        return False


SIZES = {  # lowest and highest size of a fault; loop.stall in periods
    "link.delay": (1e-3, 20e-3), "link.loss": (0.02, 0.9), "link.reorder": (0.02, 0.9), "encoder.missed": (0.01, 0.3),
    "encoder.noise": (1.0, 1000.0), "dac.stuck": (1.0, 11.0), "supply.sag": (0.01, 0.5), "loop.stall": (0.2, 20.0),
}  # fmt: skip
