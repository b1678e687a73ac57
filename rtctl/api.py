"""What scripts call where the command line would need more than one line. See docs/api.md."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from rtctl.cli import common
from rtctl.config.errors import UserError
from rtctl.config.load import set_paths
from rtctl.daemon.client import Client
from rtctl.loop import fused
from rtctl.tick.safety import RUNNING
from rtctl.trace import compare
from rtctl.trace.bundle import Bundle, load_bundle
from rtctl.trace.metrics import machine_steps


def load_config(name: str | Path, changes: Mapping[str, Any] | None = None, reference: str | None = None) -> Any:
    """Settings of a config file, or of one that comes with rtctl: "ivu", "ldu", "axis".

    changes: dotted path of a key -> value, in SI or a text with its unit.
    reference: a file of steps, or one that comes with rtctl, in place of the config's own.
    Raises UserError with a line for each mistake.
    """
    return change(common.with_reference(common.load_config(str(name), None), reference), changes or {})


def change(config: Any, changes: Mapping[str, Any]) -> Any:
    """A config with other values, checked as a file would be. Raises UserError."""
    return set_paths(config, {path: _plain(value) for path, value in changes.items()}) if changes else config


def run(config: Any, seconds: float) -> fused.Run:
    """Arm a config and play its reference for `seconds` of virtual time, in memory; `loop.mode` does not matter.

    `run["capstan"]` is a column, (ticks,), named as in a recording; `run.tripped` names the trip that ended it.
    Raises UserError where the settings contradict each other.
    """
    config = _fused(config)
    common.machine_of(config)
    return fused.run(config, seconds)


def record(config: Any, seconds: float, folder: str | Path) -> Bundle:
    """Run a config in its own mode for `seconds` and record it, as `rtctl run` does. Returns the bundle in `folder`.

    Raises UserError where it cannot run and where `folder` holds a recording, RunFailed where its loop was killed or
    its recording stopped or was moved.
    """
    from rtctl.daemon.session import Session, whole

    result = whole(Session(config, Path(folder), seconds).run())
    if result["bundle"] is None:
        raise UserError(f"{folder}: the run ended before its first tick")
    return load_bundle(folder)


def steps(what: fused.Run | Bundle | str | Path) -> list[dict[str, float | None]]:
    """Final error, overshoot and settling time of every step of a run or a bundle, in order.

    The keys are t (s), size (rad or m, signed), final_error_rad, final_error_mm, overshoot_pct, settling_s (None where
    it does not settle to 2 % before the next step). Raises UserError for a folder that holds no bundle.
    """
    if not isinstance(what, fused.Run):
        return compare.steps(what if isinstance(what, Bundle) else load_bundle(what))
    machine = what.loop.machine
    ran = what["state"] == RUNNING
    if not ran.any():
        return []
    return machine_steps(machine, what["t"][ran], what["target"][ran], what[machine.signals.position][ran])


def run_campaign(file: str | Path, folder: str | Path, jobs: int = 1, seconds: float | None = None) -> pa.Table:
    """Run what is not done yet of a campaign into `folder`. Returns its table, a row a run. Raises UserError."""
    from rtctl.campaign import campaign
    from rtctl.campaign.plan import load_plan
    from rtctl.campaign.store import load_results

    plan = load_plan(str(file), common.load_config, seconds)
    campaign.run(plan, Path(folder), jobs=jobs)
    return load_results(folder)[1]


def connect(name: str | None = None) -> Client:
    """A client of the machine that runs here, or of the one called `name`, or at an endpoint. Raises UserError."""
    client: Client = common.client(name)
    return client


def _fused(config: Any) -> Any:
    return common.with_loop(config, "fused", None)


def _plain(value: Any) -> Any:
    """A number of numpy as Python's own."""
    return value.item() if isinstance(value, np.generic) else value
