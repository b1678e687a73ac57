"""Words of a diagnosis: the phrase of each effect with names, units and sizes of the described machine."""

import math
import re
from typing import Any

from rtctl.case.start import BEGINS, FIRST_POSITION, FIRST_SPEED, START, is_start
from rtctl.diagnose.answer.phrases import Slots, harmonics, noun, phrase_of
from rtctl.diagnose.answer.si_format import both, nice
from rtctl.diagnose.evidence.diagnosis import Effect
from rtctl.diagnose.model.model import PHYSICS, RECORDING, GraphModel
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.mechanics import code_of
from rtctl.plants.graph.term_units import ends_turn, turns_at, unit_at
from rtctl.plants.graph.units import measured_unit
from rtctl.plants.physics.dimensions import DIMENSIONS


def here(machine: Description, node: str) -> str:
    """Node as part of a sentence: "the carriage", "motor 2"."""
    words = node.replace("_", " ").replace("-", " ")
    numbered = re.fullmatch(r"(.*[^\W\d]) ?(\d+)", words)
    return f"{numbered[1]} {numbered[2]}" if numbered else f"the {words}"


def unit_in(record: GraphRecord, path: str) -> str:
    """Unit of any unknown: of the description, of a nominal term, or of a first position or speed."""
    machine, plain = record.case.machine, path.partition(RECORDING)[0]
    if plain.startswith(PHYSICS):
        _, number, key = plain.split(".")
        entry = record.case.physics[int(number)]
        return unit_at(machine, str(entry["term"]), str(entry["node"]), key)
    if plain in (FIRST_POSITION, FIRST_SPEED):
        turns = turns_at(machine, machine.sensors[record.main])
        return DIMENSIONS["position" if plain == FIRST_POSITION else "speed"][not turns]
    return value_unit(machine, plain)


def channel_unit(machine: Description, channel: str) -> str:
    """Unit of the reading of a sensor, or of the measured force of the drives."""
    sensor = machine.sensors.get(channel)
    if sensor is not None:
        return measured_unit(sensor.measures, turns_at(machine, sensor))
    return DIMENSIONS["force"][not turns_at(machine, machine.drives[channel])]


def value_unit(machine: Description, path: str) -> str:
    """Unit of a number of the description by its dotted path."""
    from rtctl.plants.graph.units import BODY, GRAVITY, drive_units, joint_units

    path = path.partition(RECORDING)[0]
    if path == START:
        return "rad"
    group, name, *rest = path.split(".")
    if group == BEGINS and name in machine.bodies and not rest:
        return "rad" if machine.turns(name) else "m"
    if is_start(path) or path.startswith(PHYSICS):
        return ""
    if group == "mechanics":
        code = code_of(machine)
        return code.unit(rest[-1]) if code is not None else ""
    key = rest[-1]
    if group == "bodies" and "gravity" in rest:
        return GRAVITY.get(key, "")
    if group == "bodies":
        return BODY[key][not machine.bodies[name].turns] if key in BODY else ""
    if group == "joints":
        return joint_units(*ends_turn(machine, name)).get(key, "")
    if group == "drives":
        drive = machine.drives[name]
        return drive_units(drive.kind, drive.unit, turns_at(machine, drive)).get(key, "")
    return ""


class Sizes:
    """Sizes of an effect, by the names in its phrase."""

    def __init__(self, machine: Description, effect: Effect, model: GraphModel):
        self.here = here(machine, effect.node)
        self.machine, self.effect, self.model = machine, effect, model
        terms: list[Any] = list(model.terms)
        self.term: Any = next((t for t in terms if (t.term, t.node) == (effect.name, effect.node)), None)

    def value(self, name: str) -> float:
        """Value of a parameter, SI; nan where it is unknown."""
        if name == "F_added":
            name = "F_C"
        if name in self.effect.parameters:
            return float(self.effect.parameters[name].value)
        found = getattr(self.term, name, math.nan)
        return float(found) if isinstance(found, int | float) else math.nan

    def unit(self, name: str) -> str:
        """Unit of a parameter."""
        return unit_at(self.machine, self.effect.name, self.effect.node, "F_C" if name == "F_added" else name)

    def said(self, name: str) -> str:
        """Words of a phrase for a name that is not a number."""
        phrase = phrase_of(self.effect.name)
        if name == "sticking":
            dry = self.model.base.get(f"bodies.{self.effect.node}.dry", 0.0)
            start, keep = both(self.value("F_s"), dry, self.unit("F_s"))
            return f"it needs {start} to start but {keep} to keep moving"
        if name == "form" and phrase:
            forms = phrase.forms
            return forms.get(str(getattr(self.term, "form", "")), forms.get("", "")).format(command="command")
        if name == "harmonics":
            return harmonics(self.effect.name, self)
        if name == "jumps":
            return f"it jumps by {nice(abs(self.value('size')), self.unit('size'))}"
        return ""


def clause(machine: Description, effect: Effect, model: GraphModel) -> str:
    """Effect and its size in words: "the carriage rubs: 3 N more dry friction than in the model, at any speed"."""
    phrase = phrase_of(effect.name)
    if phrase is None:
        return f"{here(machine, effect.node)} shows {effect.name}"
    slots = Slots(Sizes(machine, effect, model))
    return f"{phrase.head.format_map(slots)}: {phrase.detail.format_map(slots)}"


def wrong_number(record: GraphRecord, path: str, believed: float, value: float) -> str:
    """Sentence on a nominal number out of its tolerance: "the machine acts as if drives.motor.gain were 0.32 ..."."""
    unit = unit_in(record, path)
    return (
        f"The machine acts as if {path} were {nice(value, unit)} instead of {nice(believed, unit)}, which is beyond "
        "its tolerance. Check this number; if it is right, look for another cause of the same behaviour."
    )


def called(machine: Description, entry: str) -> str:
    """Hypothesis "name:node" in a few words: "dry friction at the carriage"."""
    name, _, node = entry.partition(":")
    return f"{noun(name)} at {here(machine, node)}" if node else noun(name)
