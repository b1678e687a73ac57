"""Fits made by hand, of errors and sizes as a test wants them."""

import numpy as np

from rtctl.diagnose.fit import Fit
from rtctl.diagnose.model import Model
from rtctl.diagnose.space import SIZE, Coordinate, Hypothesis, Space


def made(r, terms=0, x=None):
    one = Hypothesis("structure.stiffening", "carriage", (Coordinate("c3", SIZE, 1.0),))
    space = Space(Model("axis", {"M": 1.0}), (), lambda name: 0.1, (one,) * terms)
    r = np.asarray(r, float)
    x = np.zeros(terms) if x is None else x
    return Fit(space, x, r, np.zeros((len(r), len(x))), 0.5 * float(r @ r))


def with_terms(*terms, kind="ivu", sizes=(1.0, 1.0, 1.0)):
    names = {"ripple.encoder": "A", "drive.offset": "offset", "friction.viscous": "B"}
    found = tuple(Hypothesis(t, node, (Coordinate(names.get(t, "a"), SIZE, 1.0),)) for t, node in terms)
    space = Space(Model(kind, {}), (), lambda name: 0.1, found)
    x = np.array(sizes[: len(terms)])
    return Fit(space, x, np.ones(9), np.zeros((9, len(x))), 4.5)
