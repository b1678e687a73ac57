"""Config reload: which changes are applied, which are refused, and all of them at one tick."""

from collections.abc import Callable
from typing import Any

import pytest

from rtctl import machines
from rtctl.config.bounds import Bounds
from rtctl.config.errors import UserError
from rtctl.config.load import set_paths
from rtctl.daemon.reload import differences, mixed, reload


class Supervisor:
    """Stub of a supervisor for `reload`."""

    def __init__(self, config: Any):
        self.config, self.machine, self.link = config, machines.build(config), "shm"
        self.bounds = Bounds(config)
        self.commands = self
        self.changes: list[tuple[str, Any]] = []
        self.taken = 0

    def take_over(self, config: Any, machine: Any, changed: dict[str, Any]) -> None:
        self.config, self.machine = config, machine
        self.changes += changed.items()
        self.taken += 1


@pytest.fixture
def supervised(config: Callable[..., Any]) -> Callable[..., tuple[Supervisor, Any]]:
    """`supervised("ivu", {...}, start)`: a supervisor started with the settings `start`, and the changed config."""

    def make(kind: str, values: dict[str, Any], start: dict[str, Any] | None = None) -> tuple[Supervisor, Any]:
        settings = config(kind, set=start)
        return Supervisor(settings), set_paths(settings, values)

    return make


def test_reload_of_an_unchanged_config_does_nothing(supervised: Callable[..., Any]) -> None:
    supervisor, fresh = supervised("ivu", {})
    assert reload(supervisor, fresh) == ([], [])
    assert supervisor.taken == 0


def test_reload_applies_gains_and_limits_at_one_tick_and_refuses_the_rest(supervised: Callable[..., Any]) -> None:
    values = {"law.position.gain": 20.0, "safety.current": 0.5, "loop.rate": 250.0, "record.seconds": 5.0}
    supervisor, fresh = supervised("ivu", values)
    taken, refused = reload(supervisor, fresh)
    assert taken == ["safety.current", "law.position.gain"]  # in the order of the settings
    assert refused == [
        f"{path} cannot change while the machine runs; restart it" for path in ("loop.rate", "record.seconds")
    ]
    assert supervisor.taken == 1  # all changes at one tick
    config = supervisor.config
    assert (config.law.position.gain, config.safety.current) == (20.0, 0.5)
    assert (config.loop.rate, config.record.seconds) == (500.0, 20.0)
    assert supervisor.changes == [("safety.current", 0.5), ("law.position.gain", 20.0)]


def test_reload_refuses_a_changed_law_structure_and_applies_the_other_changes(supervised: Callable[..., Any]) -> None:
    values = {"law.position": {"kind": "pd", "gain": 2000.0, "tau_d": 0.01}, "safety.current": 0.2}
    supervisor, fresh = supervised("ldu", values)
    taken, refused = reload(supervisor, fresh)
    assert taken == ["safety.current"]
    assert refused == ["law.position changes the structure of the tick; restart the machine"]
    assert supervisor.config.law.position.kind == "pi_velocity"


def test_reload_refuses_the_config_of_another_machine(
    supervised: Callable[..., Any], config: Callable[..., Any]
) -> None:
    supervisor, _ = supervised("ivu", {})
    with pytest.raises(UserError, match="machine: 'axis' instead of 'ivu' needs a restart"):
        reload(supervisor, config("axis"))
    assert supervisor.taken == 0


def test_second_reload_reports_only_the_refused_changes(supervised: Callable[..., Any]) -> None:
    supervisor, fresh = supervised("ivu", {"law.position.gain": 20.0, "loop.rate": 250.0})
    reload(supervisor, fresh)
    assert reload(supervisor, fresh) == ([], ["loop.rate cannot change while the machine runs; restart it"])


def test_reload_applies_interdependent_limits_together(supervised: Callable[..., Any]) -> None:
    """Either value alone would put the lower limit above the upper limit."""
    live = {"live": {"safety.tension_max": 20.0}}
    supervisor, fresh = supervised("ivu", {**live, "safety.tension_max": 20.0, "safety.tension_min": 10.0}, live)
    taken, refused = reload(supervisor, fresh)
    assert sorted(taken) == ["safety.tension_max", "safety.tension_min"] and refused == []


def test_differences_of_two_configs_are_setting_paths(config: Callable[..., Any]) -> None:
    old = config("ivu")
    assert differences(old, old) == []
    new = set_paths(
        old,
        {
            "law.friction.motor1.tau_C": 3e-3,
            "plant.physics": [{"term": "friction.viscous", "node": "motor1", "B": 1e-4}],
        },
    )
    assert differences(old, new) == ["law.friction.motor1.tau_C", "plant.physics"]
    assert differences(old, mixed(old, new, ["plant.physics"])) == ["plant.physics"]
