"""Commands of the command socket to a running machine. They are checked and prepared here, outside the tick."""

import time
from typing import TYPE_CHECKING, Any

from rtctl import machines
from rtctl.config.errors import UserError
from rtctl.config.load import get_path, set_path
from rtctl.config.units import convert
from rtctl.daemon.log import log
from rtctl.daemon.protocol import Args
from rtctl.idiom import fill_record
from rtctl.loop import generate
from rtctl.machines import Machine
from rtctl.tick import safety

if TYPE_CHECKING:
    from rtctl.daemon.supervisor import Supervisor

SWITCHED = (
    "loop", "link", "driver", "record", "commands", "board", "plant", "name", "machine", "reference", "excitation",
    "faults", "metrics", "own", "live", "sensors", "encoder", "output", "amplifier", "R_c",
)  # fmt: skip
ORDERS = (  # commands that are logged
    "arm", "disarm", "reset", "play", "stop", "setpoint", "set", "fault", "capture", "capture_stop",
)  # fmt: skip
LOOKS = ("status", "signals", "get", "capture_status", "watch")  # read-only: no sign of life of the commander


class Commands:
    """Handles one op at a time. `handle` answers at once with the ticks done; the op acts at most one tick later."""

    def __init__(self, supervisor: "Supervisor"):
        self._of = supervisor
        self._virtual = supervisor.config.loop.mode != "real"
        self._commander_lost = 0
        self.heard()

    def handle(self, op: str, args: Args) -> dict[str, Any]:
        """Carry out `op` and return its result. Raises UserError for a request that is not possible now."""
        if op not in LOOKS:
            self.heard()
        given = args.model_dump(exclude_unset=True)
        result = getattr(self, f"_{op}")(**given)
        if op in ORDERS:
            told = {name: value for name, value in given.items() if name != "event"}
            log.info(op, **told, tick=int(self._of.status["tick"]))
        return result

    def heard(self) -> None:
        """Note the time of a sign of life of the commander, a command or `ping`, for the loop."""
        self._last_heard = time.monotonic()
        self._of.status["commander_ns"] = time.monotonic_ns()

    def watch_commander(self) -> None:
        """On virtual time, report to the loop when a required commander has been silent for too long.

        On the wall clock the loop checks this itself, because this process may hang.
        """
        if not self._virtual:
            return
        limits = self._of.config.safety
        lost = int(limits.require_commander and time.monotonic() - self._last_heard > limits.commander_timeout)
        if lost != self._commander_lost:
            self._commander_lost = lost
            self._post(commander_lost=lost)

    def _post(self, **fields: Any) -> dict[str, Any]:
        def write(_: Any, command: Any) -> None:
            for name, value in fields.items():
                command[name] = value

        self._of.order(write)
        return {"tick": int(self._of.status["tick"])}

    def _count(self, name: str) -> dict[str, Any]:
        command = self._of.segment["mailbox"][0]["command"]
        return self._post(**{name: int(command[name]) + 1})

    def _status(self) -> dict[str, Any]:
        return self._of.report()

    def _signals(self) -> dict[str, Any]:
        return self._of.signals()

    def _arm(self) -> dict[str, Any]:
        taken_in = self._of.mailbox.seen == int(self._of.segment["mailbox"][0]["count"])  # else a reset may be pending
        if taken_in and int(self._of.status["state"]) == safety.TRIPPED:
            raise UserError("the machine has tripped; look at `rtctl status`, then `rtctl reset` and arm again")
        return self._count("arm")

    def _disarm(self) -> dict[str, Any]:
        return self._count("disarm")

    def _reset(self) -> dict[str, Any]:
        return self._count("reset")

    def _stop(self) -> dict[str, Any]:
        self._of.status["stop"] = 1
        return {"tick": int(self._of.status["tick"])}

    def _play(self) -> dict[str, Any]:
        """Play the reference table from its start, as soon as the machine runs."""
        self._refuse_when_off()
        return self._count("play")

    def _setpoint(self, value: float, name: str | None = None, unit: str | None = None, ramp: float | None = None,
                  ramp_unit: str | None = None) -> dict[str, Any]:  # fmt: skip
        if name not in (None, "position"):
            raise UserError(f"this machine has no setpoint '{name}'; it has 'position'")
        self._refuse_when_off()
        target = self._in_own_unit(value, unit)
        rate = (
            0.0 if ramp is None else abs(self._in_own_unit(ramp, ramp_unit.removesuffix("/s") if ramp_unit else unit))
        )
        seq = int(self._of.segment["mailbox"][0]["command"]["setpoint"]["seq"]) + 1

        def write(_: Any, command: Any) -> None:
            command["setpoint"]["target"] = target
            command["setpoint"]["rate"] = rate
            command["setpoint"]["seq"] = seq

        self._of.order(write)
        return {"tick": int(self._of.status["tick"]), "target": target, "unit": self._of.machine.unit, "rate": rate}

    def _refuse_when_off(self) -> None:
        if int(self._of.status["state"]) not in (safety.ARMED, safety.RUNNING):
            raise UserError("outputs are off; `rtctl arm` first")

    def _in_own_unit(self, value: float, unit: str | None) -> float:
        """Length or angle `value` converted to the unit of this machine's reference. Raises UserError."""
        machine = self._of.machine
        if unit is None or unit == machine.unit:
            return value
        for kind in dict.fromkeys((machine.unit, "m", "rad")):
            try:
                si = convert(value, unit, kind)
            except ValueError:
                continue
            if kind == machine.unit:
                return si
            if machine.radius is None:
                break
            return si / machine.radius if machine.unit == "rad" else si * machine.radius
        if machine.radius is None:
            raise UserError(f"'{unit}' is no unit of this machine's reference, which is in {machine.unit}")
        raise UserError(f"'{unit}' is neither a length nor an angle; use e.g. mm or rad")

    def _get(self, path: str) -> dict[str, Any]:
        value = get_path(self._of.config, path)
        return {"path": path, "value": value.model_dump(mode="json") if hasattr(value, "model_dump") else value}

    def _set(self, path: str, value: Any) -> dict[str, Any]:
        if path.split(".")[0] in SWITCHED:
            raise UserError(f"{path} cannot change while the machine runs; stop it and start it with --set {path}=...")
        config = set_path(self._of.config, path, value)
        for sentence in self._of.bounds.crossed(config).values():
            raise UserError(sentence)
        try:
            machine = machines.build(config)
        except ValueError as error:
            raise UserError(f"{path}: {error}") from error
        if generate.source(machine, self._of.link) != generate.source(self._of.machine, self._of.link):
            raise UserError(
                f"{path} changes the structure of the tick; stop the machine and start it with --set {path}=..."
            )
        self.take_over(config, machine, {path: value})
        return {"path": path, "value": value, "tick": int(self._of.status["tick"])}

    def take_over(self, config: Any, machine: Machine, changed: dict[str, Any]) -> None:
        """Put parameters of a machine of the same structure in force at one tick; `changed` are settings by path."""
        gains = int(self._of.segment["mailbox"][0]["command"]["gains"]) + 1

        def write(params: Any, command: Any) -> None:
            for block in machine.diagram.blocks:
                if block.params is not None:
                    fill_record(params[block.name], block.params)
            command["gains"] = gains

        self._of.order(write, changed)
        self._of.config, self._of.machine = config, machine
        for path, value in changed.items():
            self._of.note_change(path, value)

    def _fault(self, action: str, fault: dict[str, Any] | None = None) -> dict[str, Any]:
        return self._of.faults.handle(action, fault)

    def _capture(
        self, seconds: float, pre: float = 0.0, trigger: str | None = None, out: str | None = None
    ) -> dict[str, Any]:
        return self._of.captures.start(seconds, pre, trigger, out, self._of.config.name)

    def _capture_status(self, id: str) -> dict[str, Any]:
        return self._of.captures.status(id)

    def _capture_stop(self, id: str) -> dict[str, Any]:
        return self._of.captures.end(id)

    def _watch(self, **told: Any) -> dict[str, Any]:
        """Keep a report of `rtctl watch` for `status`, the log and the metrics. The report does not affect the loop."""
        self._of.watched.take(told)
        return {"tick": int(self._of.status["tick"])}
