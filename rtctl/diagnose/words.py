"""A diagnosis in words that a mechanic understands: what the machine does, where, and how large it is."""

import math
from typing import Any, Protocol

import numpy as np

from rtctl.diagnose.diagnosis import AMBIGUOUS, NAMED, UNNAMED, Diagnosis, Effect, Interval, Located
from rtctl.diagnose.model import Model, dry_friction, dry_with_terms
from rtctl.diagnose.numbers import PREFIXES as PREFIXES  # for those who draw with words
from rtctl.diagnose.numbers import both, nice, percent
from rtctl.diagnose.numbers import figures as figures
from rtctl.diagnose.numbers import prefix as prefix
from rtctl.diagnose.quantities import DIMENSIONS, Quantities, node_words, of_case
from rtctl.plants.physics import TERMS, Phrase, having
from rtctl.plants.physics.search import Turn

LIKELY = 0.5  # confidence below which an effect without a rival is no more than possible
MOST_HIDDEN = 4  # smallest sizes named in a verdict of nothing

SLIDING = {
    "ivu": ("tape1", "tape2"),
    "ldu": ("carriage", "scale"),
}  # nodes that move in m and not in rad; of an axis all or none
BY_NODE = {  # dimension of a parameter by its name, where its term does not say
    "F_C": "force", "F_added": "force", "F_s": "force", "F": "force", "F_h": "force", "B": "drag", "B_a": "drag",
    "v_s": "speed",
    "z_s": "position", "z_h": "position", "gap": "position", "size": "position", "each": "position", "mark": "position",
    "at": "position", "width": "position", "x0": "position", "turn": "position", "mass": "inertia", "k": "stiffness",
    "c2": "square", "c3": "cubic", "Q": "square_drag",
}  # fmt: skip


def channel_words(channel: str, units: Quantities) -> str:
    """A recorded channel: "the capstan's counter"."""
    if channel.endswith("_counts"):
        return f"the counter of {node_words(channel.removesuffix('_counts'), units)}"
    return {"x": "the position", "speed": "the speed"}.get(channel, channel.replace("_", " "))


def unit_at(kind: str, name: str, node: str, parameter: str, units: Quantities) -> str:
    """Unit of a term's parameter at a node; "" for a bare number."""
    term = TERMS.get(name)
    field = term.settings.model_fields.get(parameter) if term else None
    extra = field.json_schema_extra if field is not None else None
    unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
    unit = (term.units.get(parameter) if term else "") or unit or BY_NODE.get(parameter, "")
    if unit not in DIMENSIONS:
        return units.said(unit)
    return DIMENSIONS[unit][slides(kind, name, node, units)]


def slides(kind: str, name: str, node: str, units: Quantities) -> bool:
    """Whether a term at a node acts on what moves in m. A contact that drives a tape or a carriage does."""
    if kind == "axis":
        return not units.rotary
    contact = name in TERMS and TERMS[name].contact
    return node in SLIDING.get(kind, ()) or (contact and node not in having(kind, "body", "wheel"))


class Sizes:
    """The numbers of an effect, found in its intervals or else in the model, as words."""

    def __init__(self, name: str, node: str, parameters: dict[str, Interval], model: Model):
        self.name, self.node, self.parameters, self.model = name, node, parameters, model
        self.here = node_words(node, model.units)
        terms: list[Any] = list(model.terms)
        self.term: Any = next((t for t in terms if (t.term, t.node) == (name, node)), None)

    def value(self, name: str) -> float:
        """SI value; nan where nobody knows it."""
        if name in self.parameters:
            return float(self.parameters[name].value)
        found = getattr(self.term, "F_C" if name == "F_added" else name, None)
        if found is None and self.name in TERMS:
            field = TERMS[self.name].settings.model_fields.get(name)
            found = None if field is None or field.is_required() else field.get_default(call_default_factory=True)
        return float(found) if isinstance(found, int | float) else math.nan

    def text(self, name: str) -> str:
        """Which of several forms it has."""
        return str(getattr(self.term, name, ""))

    def unit(self, name: str) -> str:
        """Of a parameter."""
        given = self.parameters[name].unit if name in self.parameters else ""
        return given or unit_at(self.model.kind, self.name, self.node, name, self.model.units)

    def said(self, name: str) -> str:
        """What a phrase leaves to words."""
        return SPECIAL_WORDS[name](self)


class Sized(Protocol):
    """What a phrase asks of an effect: the node in words, and value, unit or words of a parameter by its name."""

    here: str

    def value(self, name: str) -> float: ...

    def unit(self, name: str) -> str: ...

    def said(self, name: str) -> str: ...


class _Slot:
    """One name in a phrase."""

    def __init__(self, sizes: Sized, name: str):
        self.sizes, self.name = sizes, name

    def __format__(self, form: str) -> str:
        s, name = self.sizes, self.name
        if form == "words":
            return s.said(name)
        value = s.value(name)
        if "|" in form:
            return form.split("|")[int(value < 0)]
        if form == "%":
            return percent(abs(value))
        if form == "g":
            return f"{value:.3g}"
        if form == "+":
            return nice(value, s.unit(name))
        return nice(abs(value) if form == "" else value, s.unit(name), int(form or 2))


class Slots(dict):
    """The names of a phrase, filled in from an effect."""

    def __init__(self, sizes: Sized):
        super().__init__(here=sizes.here)
        self.sizes = sizes

    def __missing__(self, name: str) -> _Slot:
        return _Slot(self.sizes, name)


def _sticking(s: Sizes) -> str:
    dry = dry_with_terms(s.model, s.node)
    told = "F_s" in s.parameters  # else it is the term's, which falls to the plant's own friction and counts no other
    added = 0.0 if told else dry - dry_friction(s.model.kind, s.model.base, s.node)
    start, keep = both(s.value("F_s") + added, dry, s.unit("F_s"))
    return f"it needs {start} to start but {keep} to keep moving"


def _form(s: Sizes) -> str:
    phrase = phrase_of(s.name)
    said = phrase.forms if phrase else {}
    return said.get(s.text("form"), said.get("", "")).format(command=s.model.units.command_name)


def _jumps(s: Sizes) -> str:
    if s.value("each"):
        return f"each passage of one mark shifts the reading by {nice(abs(s.value('each')), s.unit('each'))}"
    count = 1 + len(getattr(s.term, "more", None) or ())
    size = nice(abs(s.value("size")), s.unit("size"))
    jumps = "it jumps once" if count == 1 else f"it jumps {count} times, first"
    return f"{jumps} by {size}, at {nice(s.value('at'), 's', 3)}"


def _harmonics(s: Sizes) -> str:
    return harmonics(s.name, s)


def harmonics(term: str, s: Sized) -> str:
    """The harmonics of a ripple that were found: ", 2 mNm twice as often"."""
    phrase = phrase_of(term)
    stem = next((part.amplitude for part in TERMS[term].search if isinstance(part, Turn)), "")
    again = [(f"{stem}{n}", w) for n, w in ((2, "twice"), (3, "three times")) if s.value(f"{stem}{n}") > 0]
    base = phrase.again if phrase else ""
    return "".join(f", {nice(s.value(k), s.unit(k))} {w}{base}" for k, w in again)


SPECIAL_WORDS = {"sticking": _sticking, "form": _form, "jumps": _jumps, "harmonics": _harmonics}


def effect_clause(effect: Effect, model: Model) -> tuple[str, str]:
    """What the effect does and how much: ("motor 1 sticks", "it needs 3.1 mNm to start ...")."""
    s = Sizes(effect.name, effect.node, effect.parameters, model)
    phrase = phrase_of(effect.name)
    if phrase is None:
        sizes = [f"{name} {nice(v.value, v.unit)}" for name, v in effect.parameters.items()]
        return f"{s.here} shows {effect.name}", ", ".join(sizes)
    slots = Slots(s)
    return phrase.head.format_map(slots), phrase.detail.format_map(slots)


def phrase_of(name: str) -> Phrase | None:
    """How an effect is spoken of; None of one whose term does not say."""
    return TERMS[name].phrase if name in TERMS else None


def noun(name: str) -> str:
    """An effect in a few words: "sticking"."""
    phrase = phrase_of(name)
    return phrase.noun if phrase else name


def noun_at(name: str, node: str, units: Quantities) -> str:
    """An effect with its node in a few words: "sticking, motor 1"."""
    return f"{noun(name)}, {node_words(node, units).removeprefix('the ')}" if node else noun(name)


def entry_noun(entry: str, units: Quantities) -> str:
    """A hypothesis "name:node" in a few words: "sticking, motor 1"."""
    name, _, node = entry.partition(":")
    return noun_at(name, node, units)


def at(entry: str, units: Quantities) -> str:
    """A hypothesis "name:node" as part of a sentence: "sticking at motor 1"."""
    name, _, node = entry.partition(":")
    return f"{noun(name)} at {node_words(node, units)}" if phrase_of(name) and node else entry


def sentence(entry: str, *more: str, units: Quantities) -> str:
    """Why a hypothesis "name:node" cannot be tested, and at `more` nodes: what a record would have to hold."""
    name, _, node = entry.partition(":")
    at = f" at {_join([node_words(n, units) for n in (node, *more)], 'and')}" if node else ""
    phrase = phrase_of(name)
    if phrase is None:
        return f"This record cannot show {name}{at}."
    return f"This record cannot show {phrase.noun}{at}: that takes {phrase.need}."


def need(entry: str) -> str:
    """What a record would have to hold to test "name:node"."""
    phrase = phrase_of(entry.partition(":")[0])
    return phrase.need if phrase else "a richer motion"


def main_unit(d: Diagnosis) -> str:
    """Unit of the main channel: counts, or that of x."""
    channel = next(iter(d.record.y))
    if channel.endswith("counts"):
        return "counts"
    if channel == "speed":
        return of_case(d.record.case).speed
    return d.record.case.sensors.unit or "m"


def heldout_error(d: Diagnosis, nrmse: float) -> float:
    """A held-out nrmse as rms error of the main channel in its own unit."""
    return nrmse * float(np.std(next(iter(d.record.y.values()))))


def falls(d: Diagnosis) -> str:
    """How the held-out error changed: "falls from 12 to 0.4 counts"."""
    unit = main_unit(d)
    before, after = heldout_error(d, d.heldout_before), heldout_error(d, d.heldout_after)
    one, two = both(before, after, unit)
    if one.split()[1:] == two.split()[1:]:
        one = one.split()[0]
    return f"{'falls' if after < before else 'goes'} from {one} to {two}"


def verdict_sentences(d: Diagnosis) -> str:
    """The verdict in two sentences with sizes and units."""
    if d.verdict == NAMED and d.effects:
        clauses = [effect_clause(e, d.after) for e in d.effects]
        if len(clauses) == 1:
            first = f"{clauses[0][0]}: {clauses[0][1]}."
        else:
            count = {2: "two", 3: "three"}.get(len(clauses), str(len(clauses)))
            first = f"{count} things are missing: " + _join([f"{h} ({t})" for h, t in clauses], "and") + "."
        rest = "that" if len(clauses) == 1 else "them"
        second = f"With {rest} in the model the error on the part that was not fitted {falls(d)}."
        if d.faint:
            second = (
                f"Random forces do more than that: {second[0].lower()}{second[1:-1]}, but beneath them it is plain."
            )
    elif d.verdict == AMBIGUOUS and d.effects:
        first, second = _ambiguous(d), f"Run this next: {plan(d)}."
    elif d.verdict == UNNAMED or d.effects:
        first, second = _unnamed(d)
    else:
        first, second = _nothing(d)
    return f"{first[0].upper()}{first[1:]} {second}"


def _ambiguous(d: Diagnosis) -> str:
    """What is sure, and what may stand for what: each rival beside the effect whose place it would take."""
    own = [e for e in d.effects if e.instead_of is None]
    groups = [[e, *(r for r in d.effects if r.instead_of == f"{e.name}:{e.node}")] for e in own]
    least = min(own, key=lambda e: e.confidence) if all(len(group) == 1 for group in groups) else None
    sure, doubtful = [], []
    for group in groups:
        clauses = [f"{h} ({t})" for h, t in (effect_clause(e, d.after) for e in group)]
        if len(group) > 1:
            doubtful.append(f"either {_join(clauses, 'or')}")
        elif group[0] is least or group[0].confidence < LIKELY:
            doubtful.append(f"perhaps {clauses[0]}")
        else:
            sure.append(clauses[0])
    first = f"{_join(sure, 'and')}, which is sure. Beside that " if sure else ""
    return f"{first}{_join(doubtful, 'and')}: this record cannot tell."


def plan(d: Diagnosis) -> str:
    """The experiment to run next, in words: the one that was designed, or else what tells such rivals apart."""
    told = str((d.experiment or {}).get("words") or "").rstrip(".")
    return told[:1].lower() + told[1:] if told else separating(d)


def separating(d: Diagnosis) -> str:
    """What tells the rivals apart, in words: those that would take each other's place, where that is known."""
    pairs = [(e.instead_of.partition(":")[0], e.name) for e in d.effects if e.instead_of is not None]
    pairs = pairs or [(e.name, other) for e in d.effects for other in _others(d, e)]
    for one, other in [*pairs, *((b, a) for a, b in pairs)]:
        if one in TERMS and other in TERMS[one].look_alikes:
            return TERMS[one].look_alikes[other].rstrip(".")
    names = {name for pair in pairs for name in pair} or {e.name for e in d.effects}
    if len(names) == 1:
        return "drive one motor alone, then the other, so that only one of the places is loaded"
    needs = [phrase.need for phrase in map(phrase_of, sorted(names)) if phrase]
    return "a record with " + _join(list(dict.fromkeys(needs)), "and") if needs else "a longer record with richer moves"


def _others(d: Diagnosis, effect: Effect) -> list[str]:
    return [e.name for e in d.effects if e is not effect] + [r.name for r in effect.look_alikes]


def _unnamed(d: Diagnosis) -> tuple[str, str]:
    unit = main_unit(d)
    left, noise = heldout_error(d, d.heldout_after), heldout_error(d, d.noise_floor)
    one, two = both(left, noise, unit)
    amount = f"the error on the part that was not fitted is {one} where noise leaves {two}"
    if d.untestable:
        what = _join([at(entry, d.owner.units) for entry in d.untestable], "and")
        needs = _join(list(dict.fromkeys(need(entry) for entry in d.untestable)), "and")
        return (
            f"Something is missing, and what fits best, {what}, cannot be tested by this record, so it has no name.",
            f"{_capital(amount)}. Record this next: {needs}.",
        )
    if d.unpredicted:
        return (
            "The model does not predict: run freely from the recorded state it leaves the record by more than noise "
            "and the uncertainty of its parameters make it, and no known effect explains why.",
            f"{_capital(amount)}.",
        )
    if d.resembles is not None:
        name, node = d.resembles
        return (
            f"Something is missing at {node_words(node, d.owner.units)} that has no name in the table: "
            f"it looks like {noun(name)}.",
            f"{_capital(amount)}.",
        )
    if d.located is None:
        return "Something is missing that no known effect explains.", f"It has no clear place: {amount}."
    place = node_words(d.located.node, d.owner.units)
    since = f", from {nice(d.located.since_s, 's', 3)} on" if d.located.since_s > 0 else ""
    kind = f"{goes(d.located)}{since}"
    share = f"{percent(d.located.share)} of the error lies there"
    return (
        f"Something is missing at {place} that no known effect explains: {kind}.",
        f"{_capital(channel_words(d.located.channel, d.owner.units))} shows it, {share}; {amount}.",
    )


def goes(located: Located) -> str:
    """What an error goes with: "it goes with velocity, -0.1 to 0.1"."""
    there = located.where.removeprefix(f"{located.axis} ")
    return f"it goes with {located.axis}, {there}" if there else f"it goes with {located.axis}"


def _nothing(d: Diagnosis) -> tuple[str, str]:
    unit = main_unit(d)
    left, noise = (nice(heldout_error(d, x), unit) for x in (d.heldout_after, d.noise_floor))
    if d.random_forces:
        first = (
            f"Nothing is missing that has a pattern: random forces move the part that was not fitted by {left}, and "
            f"noise makes {noise} beside that."
        )
    else:
        first = (
            f"Nothing is missing: the part that was not fitted is predicted to {left}, and noise alone makes {noise}."
        )
    if not d.hides:
        return first, "How large an effect could be and still hide was not worked out."
    words: list[str] = []
    seen: set[str] = set()
    for entry in sorted(d.hides, key=lambda e: not told_first(e)):
        name, _, node = entry.partition(":")
        if name not in seen and len(words) < MOST_HIDDEN:
            seen.add(name)
            words.append(f"{noun(name)} of {hidden_size(d, entry)} at {node_words(node, d.owner.units)}")
    return first, f"It would have shown {_join(words, 'and')}."


def told_first(entry: str) -> bool:
    """Whether a verdict of nothing names the smallest size of "term:node" before others."""
    name = entry.partition(":")[0]
    return name in TERMS and TERMS[name].told_first


def hidden_size(d: Diagnosis, entry: str) -> str:
    """The smallest size of "term:node" that the record would have shown, with its unit."""
    size = d.hides[entry]
    name, _, node = entry.partition(":")
    known = name in TERMS and size.unit in TERMS[name].settings.model_fields  # the main parameter instead of its unit
    unit = unit_at(d.record.plant, name, node, size.unit, d.owner.units) if known else size.unit
    return nice(abs(size.value), unit) if unit else percent(abs(size.value))


def _join(parts: list[str], word: str) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} {word} {parts[-1]}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
