"""Emulated belt axis under its PD law, as a bundle of format 2 with the law in its case."""

from functools import cache
from pathlib import Path

import numpy as np

from rtctl.case.format2 import read_case
from rtctl.cli.common import load_config
from rtctl.config.load import set_path
from rtctl.diagnose.model.recording import record_of
from rtctl.loop import fused

SECONDS = 2.0
COUNTS = ("encoder_counts", "scale_counts")


@cache
def belt():
    """Config of the belt axis, and a recording of it in closed loop."""
    config = set_path(load_config("machines/belt", []), "loop.mode", "fused")
    return config, fused.run(config, SECONDS + 0.5).between(0.0, SECONDS)


def law(**changes):
    """Law of the belt axis as in a case."""
    position = belt()[0].law.position
    return {
        "kind": "pd", "P": position.gain, "D": position.gain * position.tau_d,
        "derivative_filter_hz": position.derivative_filter, "sensor": "encoder", **changes,
    }  # fmt: skip


def bundle(controller, drives=None, **columns):
    """The record of the belt axis with a law in its case, with changed columns; `drives` beside its own."""
    config, rows = belt()
    machine = config.machine.model_dump(mode="json", exclude_unset=True)
    machine["drives"] |= drives or {}
    case = {
        "format": 2, "sample_rate": config.loop.rate, "machine": machine, "delay_samples": 1.0,
        "tolerance": {"default": 0.15}, "controller": controller,
    }  # fmt: skip
    shown = {name: np.array(rows[name], float) for name in ("t", "ref", "w", "u", *COUNTS)} | columns
    shown = {name: values for name, values in shown.items() if values is not None}
    return record_of(shown, read_case(case, "belt"), Path("belt/recording.parquet"))
