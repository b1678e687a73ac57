"""Faults on demand in a running machine: `rtctl fault add`, `list` and `clear`."""

from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from rtctl.config import complaints
from rtctl.config.errors import UserError
from rtctl.loop import faults

if TYPE_CHECKING:
    from rtctl.daemon.supervisor import Supervisor


class Faults:
    """What is wrong with a machine on purpose."""

    def __init__(self, supervisor: "Supervisor"):
        self._of = supervisor

    def handle(self, action: str, fault: dict[str, Any] | None) -> dict[str, Any]:
        """Add a fault, its time counted from now, take all away, or list what there is. Raises UserError."""
        tick = int(self._of.status["tick"])
        kept = [] if action == "clear" else self._in_force()
        if action == "add":
            kept = [*(f for f in kept if f.end > tick), self._built(fault or {}, tick)]
            if len(kept) > faults.SLOTS:
                raise UserError(f"{faults.SLOTS} faults are in force, and that is the most; `rtctl fault clear` first")
        if action != "list":
            self._of.order(lambda _, command: faults.fill(command, kept))
        return {"tick": tick, "faults": [self._described(f, tick) for f in kept]}

    def _in_force(self) -> list[faults.Fault]:
        command = self._of.segment["mailbox"][0]["command"]
        return [faults.Fault(*(value.item() for value in row)) for row in command["faults"][: int(command["faulty"])]]

    def _built(self, wanted: dict[str, Any], tick: int) -> faults.Fault:
        try:
            settings = faults.FaultSettings.model_validate(wanted)
            return faults.build(settings, self._of.machine.dt, tick)
        except ValidationError as error:
            raise UserError("fault: " + complaints.sentences(error, faults.FaultSettings, wanted)) from error
        except ValueError as error:
            raise UserError(str(error)) from error

    def _described(self, fault: faults.Fault, tick: int) -> dict[str, Any]:
        name = next(name for name, kind in faults.KINDS.items() if kind.number == fault.kind)
        return {
            "fault": name,
            "channel": fault.channel,
            "size": fault.size,
            "begin": fault.begin,
            "end": None if fault.end == faults.FOR_EVER else fault.end,
            "active": fault.begin <= tick < fault.end,
        }
