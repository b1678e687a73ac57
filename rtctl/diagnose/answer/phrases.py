"""Phrases of a diagnosis for a mechanic: behaviour of the machine, place and size."""

from typing import Protocol

from rtctl.diagnose.answer.si_format import PREFIXES as PREFIXES  # for the figures
from rtctl.diagnose.answer.si_format import figures as figures
from rtctl.diagnose.answer.si_format import nice, percent
from rtctl.diagnose.answer.si_format import prefix as prefix
from rtctl.plants.physics import TERMS, Phrase
from rtctl.plants.physics.search import Turn


class Sized(Protocol):
    """Effect in a phrase: the node in words, and value, unit or words of a parameter by its name."""

    here: str

    def value(self, name: str) -> float: ...

    def unit(self, name: str) -> str: ...

    def said(self, name: str) -> str: ...


class _Slot:
    """Parameter name in a phrase."""

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
    """Names of a phrase with their values from an effect."""

    def __init__(self, sizes: Sized):
        super().__init__(here=sizes.here)
        self.sizes = sizes

    def __missing__(self, name: str) -> _Slot:
        return _Slot(self.sizes, name)


def harmonics(term: str, s: Sized) -> str:
    """Fitted harmonics of a ripple in words: ", 2 mNm twice as often"."""
    phrase = phrase_of(term)
    stem = next((part.amplitude for part in TERMS[term].search if isinstance(part, Turn)), "")
    again = [(f"{stem}{n}", w) for n, w in ((2, "twice"), (3, "three times")) if s.value(f"{stem}{n}") > 0]
    base = phrase.again if phrase else ""
    return "".join(f", {nice(s.value(k), s.unit(k))} {w}{base}" for k, w in again)


def phrase_of(name: str) -> Phrase | None:
    """Phrase of an effect; None for a term without a phrase."""
    return TERMS[name].phrase if name in TERMS else None


def noun(name: str) -> str:
    """Effect in a few words: "sticking"."""
    phrase = phrase_of(name)
    return phrase.noun if phrase else name


def need(entry: str) -> str:
    """Motion that a record needs for a test of "name:node", in words."""
    phrase = phrase_of(entry.partition(":")[0])
    return phrase.need if phrase else "a richer motion"
