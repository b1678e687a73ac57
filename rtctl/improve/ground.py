"""Basis of the proposed remedies: the machine with its effects, and its present loop."""

from typing import NamedTuple

from rtctl.design.margins import Margins
from rtctl.improve.found import Found
from rtctl.improve.played import Judge


class Ground(NamedTuple):
    """Machine, loop and reference that proposals are made from."""

    found: Found
    judge: Judge
    margins: Margins | None
    gain: tuple[float, float] | None  # acceleration for one unit of positive and negative command; None: no feedforward
    travel: tuple[float, float]  # of the feedback
