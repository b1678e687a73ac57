"""Open-loop simulation of a described machine: sensors under given commands, from rest, without converters."""

import numpy as np

from rtctl.idiom import fill_record, record_dtype, tick
from rtctl.plants import linear
from rtctl.plants.graph import plant
from rtctl.plants.graph.params import GraphParams
from rtctl.plants.graph.plant import GRAPH_STATE


def played(p: GraphParams, u: np.ndarray, substeps: int) -> np.ndarray:
    """Sensors (n, ny), SI, at every sample of the commands `u` (n, nu), each held for `substeps` substeps of `p.h`."""
    y = np.zeros((len(u), p.ny))
    code = getattr(type(p), "code", None)
    if code is not None:
        record = np.zeros(1, record_dtype(p))
        fill_record(record[0], p)
        code.steps.play(record[0], np.zeros(1, GRAPH_STATE)[0], np.ascontiguousarray(u, float), substeps, y)
        return y
    play(p, np.zeros(1, GRAPH_STATE)[0], np.ascontiguousarray(u, float), substeps, y)
    return y


@tick
def play(p, s, u, substeps, y):
    """Fill `y` (n, ny); see `played`."""
    m = s.m
    plant.start(p, s)
    for k in range(len(u)):
        plant.read(p, m)
        for c in range(p.ny):
            y[k, c] = m.y[c]
        for d in range(p.nu):
            m.volts[d] = u[k, d]
        for _ in range(substeps):
            plant.ask(p, m)
            plant.take(p, m)
            linear.midpoint(m)
            plant.weigh(p, m)
            linear.advance(m)
