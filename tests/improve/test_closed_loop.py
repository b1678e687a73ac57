"""Runs on the running machine: their order, the learning updates and the kept config."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.improve import closed_loop
from rtctl.improve.played import Figures


def figures(rms, tripped=""):
    return Figures(rms, rms, rms, 0.0, 0.0, 1.0, tripped)


@pytest.fixture
def machine(with_sizes, monkeypatch):
    """A machine whose error is the force minus the learned values; it trips in the runs named in `trips`."""
    played, trips = [], set()

    def read(config, bundle, tripped):
        learned = config.law.compensation.learning
        n = round(closed_loop.played.seconds_of(config) * config.loop.rate)
        t = np.arange(n) / config.loop.rate
        force = np.sin(0.5 * np.pi * t)
        given = (
            0.0
            if learned is None
            else np.interp(t, np.linspace(0, learned.duration, len(learned.values)), learned.values)
        )
        error = (force - given) / config.law.position.gain
        played.append(config)
        return figures(np.inf, tripped) if tripped else figures(float(np.sqrt(np.mean(error**2)))), error

    def run(config, bundle, seconds):
        return {"tripped": "following_error" if Path(bundle).name in trips else None}

    monkeypatch.setattr(closed_loop, "_read", read)
    better = with_sizes(dry=3.0)
    result = SimpleNamespace(found=SimpleNamespace(config=with_sizes()), config=better, margins_after=None)
    owner = better.model_copy(update={"name": "bench"})
    return SimpleNamespace(result=result, owner=owner, run=run, played=played, trips=trips)


def test_learning_reduces_the_error_over_successive_runs(machine, tmp_path):
    proof = closed_loop.prove(machine.result, machine.owner, tmp_path, 3, run=machine.run)
    assert proof.names == ("before", "improved", "learned-1", "learned-2", "learned-3")
    rms = [f.rms for f in proof.figures]
    assert rms[1] == rms[0] > 1.5 * rms[2]
    assert proof.after.rms == min(rms[1:])
    assert proof.config.law.compensation.learning is not None


def test_runs_keep_the_name_of_the_configured_machine(machine, tmp_path):
    closed_loop.prove(machine.result, machine.owner, tmp_path, 0, run=machine.run)
    assert [config.name for config in machine.played] == ["bench", "bench"]


def test_trip_stops_the_learning(machine, tmp_path):
    machine.trips.add("learned-1")
    proof = closed_loop.prove(machine.result, machine.owner, tmp_path, 4, run=machine.run)
    assert proof.names == ("before", "improved", "learned-1")
    assert proof.config.law.compensation.learning is None
