"""The observer equals the simulation of the diagnosis, continued from chunk to chunk."""

from pathlib import Path

import numpy as np
import pytest

from rtctl.diagnose.answer.load import of_bundle
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.simulate import Simulator
from rtctl.trace.bundle import Bundle
from rtctl.watch.observer import Observer


@pytest.fixture(scope="module")
def record(rehearsed):
    rows = rehearsed.rows[rehearsed.rows["state"] == 2][:15_000]
    columns = {name: rows[name] for name in rows.dtype.names}
    return of_bundle(Bundle(columns, rehearsed.case, Path("x"), {}))


def fed(record, sizes):
    observer = Observer(record, nominal(record.case))
    y = np.stack([record.y[name] for name in observer.sensors], axis=1)
    parts, at = [], 0
    for size in sizes:
        parts.append(observer.step(record.u[at : at + size], y[at : at + size]))
        at += size
    return [np.concatenate(part) for part in zip(*parts, strict=True)]


def test_observer_of_one_chunk_equals_the_simulation_of_the_diagnosis(record):
    e, push = fed(record, [15_000])
    simulator = Simulator(record)
    out, told = simulator.everything(nominal(record.case))
    name = simulator.main
    late = slice(2, None)  # the diagnosis has no command before the first row
    np.testing.assert_allclose(e[late, 0], record.y[name][late] - out[late, simulator.column(name)], atol=1e-9)
    np.testing.assert_allclose(push[late], told[late], atol=1e-9)


def test_observer_does_not_depend_on_the_chunk_size(record):
    whole, pieces = fed(record, [15_000]), fed(record, [1, 2, 997, 4000, 10_000])
    np.testing.assert_allclose(pieces[0], whole[0], atol=1e-4 * record.grain[record.main])
    off = np.sqrt(np.mean((pieces[1] - whole[1]) ** 2))  # the first row of a chunk has no error rate
    assert off < 0.1 * np.sqrt(np.mean(whole[1] ** 2))
