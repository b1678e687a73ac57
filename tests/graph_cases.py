"""Recordings of described machines, made in memory by the fit simulation."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rtctl.case.format2 import read_case
from rtctl.diagnose.answer.answer import diagnose_record
from rtctl.diagnose.model.kernel import OPEN
from rtctl.diagnose.model.model import nominal, settings_of
from rtctl.diagnose.model.recording import GraphRecord, record_of
from rtctl.diagnose.model.simulate import Simulator

RATE, SECONDS = 500.0, 4.0
PENDULUM = {
    "bodies": {"rod": {"inertia": 9.8e-3, "dry": 5e-3, "viscous": 2e-3,
                       "gravity": {"mass": 0.28, "arm": 0.17, "angle": 0.0}}},
    "drives": {"motor": {"body": "rod", "column": "u", "kind": "force", "gain": 0.1}},
    "sensors": {"encoder": {"body": "rod", "measures": "position", "column": "rod_counts", "counts_per_unit": 5000.0}},
}  # fmt: skip
BELT = {
    "bodies": {"motor": {"inertia": 4e-5, "dry": 4e-3, "viscous": 2e-5}, "carriage": {"mass": 1.5, "dry": 2.0}},
    "joints": {"belt": {"from": "motor", "to": "carriage", "ratio": 0.0127, "stiffness": 4e4, "damping": 25.0}},
    "drives": {"amplifier": {"body": "motor", "column": "u", "kind": "force", "gain": 0.25}},
    "sensors": {
        "encoder": {"body": "motor", "measures": "position", "column": "encoder_counts", "counts_per_unit": 1300.0},
        "scale": {"body": "carriage", "measures": "position", "column": "scale_counts", "counts_per_unit": 2e5},
    },
}  # fmt: skip

CROSSTALK = 10.0  # counts for a unit of the command
RUB = {"term": "friction.coulomb", "node": "carriage", "F_C": 2.0}


def case_of(machine, **more):
    """A case.json of a machine."""
    return {"format": 2, "sample_rate": RATE, "machine": machine, "delay_samples": 1.0, "tolerance": {"default": 0.1},
            "controller": {"kind": "unknown"}, **more}  # fmt: skip


def command(amplitude, seconds=SECONDS, seed=1):
    """A command (n,) of several tones and random levels, which starts at zero."""
    t = np.arange(round(seconds * RATE)) / RATE
    rng = np.random.default_rng(seed)
    tones = sum(np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in (0.7, 1.3, 2.9))
    levels = np.repeat(rng.uniform(-1, 1, len(t) // 100 + 1), 100)[: len(t)]
    return amplitude * (0.4 * tones + 0.6 * levels) * np.minimum(t / 0.2, 1.0)


def blank(case, u):
    """A record of a case with a command (n,) and empty sensor columns."""
    n, rate = len(u), case["sample_rate"]
    read = read_case(case, "bundle")
    sensors = read.machine.sensors
    y = {name: np.zeros(n) for name in sensors}
    grain = {name: abs(s.grain / s.scale) for name, s in sensors.items()}
    return GraphRecord(
        read, np.arange(n) / rate, 1.0 / rate, np.full(n, np.nan), np.zeros(n), u[:, None], y, grain, None
    )


def columns_of(case, u, terms=(), push=None):
    """Columns of a recording: the machine with `terms` beyond its description, and a push (n,) on coordinate 0."""
    record = blank(case, u)
    sim = Simulator(record)
    if push is not None:
        forces = np.zeros((len(u), sim.layout.nq))
        forces[:, 0] = push
        sim = sim.pushed(forces)
    out = sim.run(nominal(record.case).add(*map(settings_of, terms)), mode=OPEN)
    assert np.isfinite(out).all()
    shown = {s.column: np.floor(out[:, k] * s.scale) for k, s in enumerate(record.case.machine.sensors.values())}
    return {"t": record.t, "u": u, **shown}


def record(case, u, terms=(), push=None):
    """The record of `columns_of`."""
    return record_of(columns_of(case, u, terms, push), read_case(case, "bundle"), Path("bundle/recording.parquet"))


def write_bundle(folder, case, columns):
    """A bundle on disk."""
    folder.mkdir(parents=True)
    pq.write_table(pa.table(columns), folder / "recording.parquet")
    (folder / "case.json").write_text(json.dumps(case))
    return folder


@cache
def nothing():
    """Diagnosis of a nominal pendulum."""
    return diagnose_record(record(case_of(PENDULUM), command(4.0)))


@cache
def named():
    """Diagnosis of a belt axis with friction at the carriage."""
    return diagnose_record(record(case_of(BELT), command(0.6), [RUB]))


@cache
def unnamed():
    """Diagnosis of a pendulum with intermittent external pushes."""
    u = command(4.0)
    now_and_then = np.sin(2 * np.pi * 1.1 * np.arange(len(u)) / RATE) > 0.8
    return diagnose_record(record(case_of(PENDULUM), u, push=0.2 * now_and_then))


@cache
def misread():
    """Diagnosis of a pendulum with crosstalk from the command to the encoder."""
    u = command(4.0)
    columns = columns_of(case_of(PENDULUM), u)
    acted = np.concatenate([[0.0, 0.0], u[:-2]])  # until the sensor is read: written two ticks before
    columns["rod_counts"] = columns["rod_counts"] + np.round(CROSSTALK * acted)
    return diagnose_record(record_of(columns, read_case(case_of(PENDULUM), "bundle"), Path("bundle/recording.parquet")))


def at_rest(config, seconds):
    """A record of a config's machine at rest, `seconds` long."""
    case = {
        "format": 2, "sample_rate": config.loop.rate, "delay_samples": 1.0, "tolerance": {"default": 0.15},
        "machine": config.machine.model_dump(mode="json", exclude_unset=True),
        "config": config.model_dump(mode="json", exclude_unset=True),
    }  # fmt: skip
    read, n = read_case(case, "."), round(seconds * config.loop.rate)
    t = np.arange(n) / config.loop.rate
    sensors = read.machine.sensors
    grain = {name: abs(s.grain / s.scale) for name, s in sensors.items()}
    still = {name: np.zeros(n) for name in sensors}
    return GraphRecord(read, t, t[1], t * 0.0, t * 0.0, np.zeros((n, len(read.machine.drives))), still, grain, None)
