"""Random events of a soak depend only on the seed and the event number."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rtctl.soak.events import KINDS, SIZES, WEIGHTS, Day
from rtctl.soak.rig import Fused
from rtctl.tick import faults, safety

Make = Callable[..., Fused]


def kinds(rig: Fused, seed: int, events: int) -> list[str]:
    """Kinds of the events in order."""
    day, out = Day(rig, seed), []
    for _ in range(events):
        before = dict(day.events)
        day.step()
        out += [kind for kind in day.events if day.events[kind] != before.get(kind, 0)]
    return out


def test_events_depend_only_on_the_seed_for_any_machine(rig: Make) -> None:
    assert kinds(rig("ivu"), 3, 6) == kinds(rig("axis"), 3, 6) != kinds(rig("axis"), 4, 6)


def test_random_fault_is_supported_by_the_tick(rig: Make) -> None:
    day = Day(rig("ivu"), 1)
    seen = set()
    for number in range(400):
        day.rng = np.random.default_rng([1, number])
        kind, settings = day._draw()
        fault = faults.build(settings, day.rig.machine.dt, 100)
        assert fault.kind != faults.NONE and 100 <= fault.begin < fault.end < 100 + 2000
        assert fault.channel < faults.KINDS[kind].channels
        seen.add(kind)
    assert seen == set(KINDS) >= set(SIZES)


def test_random_commands_stay_within_the_travel(rig: Make) -> None:
    machine = rig("axis")
    asked: list[float] = []
    setpoint = machine.setpoint

    def note(target: float, rate: float) -> None:
        asked.append(target)
        setpoint(target, rate)

    machine.setpoint = note  # type: ignore[method-assign]
    day = Day(machine, 2, with_faults=False)
    for _ in range(30):
        day.step()
    most = day.range.travel + 2 * day.range.jump
    assert len(asked) > 15 and np.all(np.abs(asked) < most)


def test_tripped_machine_is_reset_before_the_next_event(rig: Make, only: Callable[..., None]) -> None:
    only("move")
    machine = rig("ivu", seed=1)
    day = Day(machine, 1)
    day.step()
    machine.checker.windows["quiet_from"] = 2**62
    machine.fault(faults.FaultSettings(fault="link.silent", lasts=0.5))
    machine.run(400)
    assert machine.checker.last["state"] == safety.TRIPPED
    day.step()
    assert machine.checker.last["state"] == safety.RUNNING and machine.checker.count == 0


def test_each_kind_of_event_occurs(rig: Make) -> None:
    day: Any = Day(rig("axis"), 1)
    assert all(callable(getattr(day, f"_{kind}")) for kind in WEIGHTS)
    assert abs(sum(WEIGHTS.values()) - 1.0) < 1e-9
