"""A diagnosis in words that a mechanic understands: what the machine does, where, and how large it is."""

from typing import Protocol

from rtctl.diagnose.answer.si_format import PREFIXES as PREFIXES  # for those who draw with words
from rtctl.diagnose.answer.si_format import figures as figures
from rtctl.diagnose.answer.si_format import nice, percent
from rtctl.diagnose.answer.si_format import prefix as prefix
from rtctl.plants.physics import TERMS, Phrase
from rtctl.plants.physics.search import Turn


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


def harmonics(term: str, s: Sized) -> str:
    """The harmonics of a ripple that were found: ", 2 mNm twice as often"."""
    phrase = phrase_of(term)
    stem = next((part.amplitude for part in TERMS[term].search if isinstance(part, Turn)), "")
    again = [(f"{stem}{n}", w) for n, w in ((2, "twice"), (3, "three times")) if s.value(f"{stem}{n}") > 0]
    base = phrase.again if phrase else ""
    return "".join(f", {nice(s.value(k), s.unit(k))} {w}{base}" for k, w in again)


def phrase_of(name: str) -> Phrase | None:
    """How an effect is spoken of; None of one whose term does not say."""
    return TERMS[name].phrase if name in TERMS else None


def noun(name: str) -> str:
    """An effect in a few words: "sticking"."""
    phrase = phrase_of(name)
    return phrase.noun if phrase else name


def need(entry: str) -> str:
    """What a record would have to hold to test "name:node"."""
    phrase = phrase_of(entry.partition(":")[0])
    return phrase.need if phrase else "a richer motion"
