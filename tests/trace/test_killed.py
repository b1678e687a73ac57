"""SIGKILL at any moment of a recording costs no more than the batch that was being written."""

import json
import multiprocessing
import random
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from feeder import FINISHING, feed
from trace_rows import ROW, is_truth

from rtctl.config.errors import NoAnswer
from rtctl.daemon.shared_memory import segment_path
from rtctl.loop import fused
from rtctl.trace.bundle import load_bundle
from rtctl.trace.repair import repair
from rtctl.trace.rotation import Rotation

KILLS, TOTAL, SIZE = 20, 4000, 50  # a batch of 50 rows is what 10 kHz gives in 5 ms
SMALL = Rotation(megabytes=TOTAL * ROW.itemsize / 1e6 / 6)  # some six parts


@pytest.fixture(scope="module")
def processes():
    """Processes that start at once, from one that has imported the recorder."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["rtctl.trace.recorder"])
    return context


def killed_at(processes, folder: Path, moment: int, rotation: Rotation | None) -> tuple[int, bool]:
    """Record into `folder` and kill at the first announcement of `moment` rows or more, or while it finishes.

    Returns the last announcement before death, and whether it was finishing.
    """
    ours, theirs = processes.Pipe(duplex=False)
    child = processes.Process(target=feed, args=(theirs, folder, TOTAL, SIZE, rotation))
    child.start()
    theirs.close()
    given, finishing, killed = 0, False, False
    try:
        while True:
            told = ours.recv()
            finishing = told == FINISHING
            given = given if finishing else told
            if not killed and (finishing or given >= moment):
                child.kill()
                killed = True
    except EOFError:  # all that it ever said has been read
        pass
    child.join()
    assert child.exitcode == -signal.SIGKILL or finishing
    return given, finishing


def test_kills_lose_no_more_than_the_batch_in_hand(tmp_path, processes):
    draw = random.Random(5)
    finished = 0
    for number in range(KILLS):
        folder, rotation = tmp_path / str(number), SMALL if number % 2 else None
        moment = draw.randrange(1, TOTAL + TOTAL // 5)  # a sixth of them while it finishes
        given, finishing = killed_at(processes, folder, moment, rotation)
        finished += finishing
        try:
            rows = repair(folder).rows
        except NoAnswer:
            rows = 0
        assert given - SIZE * (not finishing) <= rows <= given, f"kill {number} at {moment}"
        if rows:
            assert is_truth(load_bundle(folder).columns, range(rows))
            assert repair(folder).changed is False
    assert 0 < finished < KILLS / 2


RUN = """
import json, os, sys
from pathlib import Path
from rtctl import machines
from rtctl.daemon.session import Session
order = json.loads(sys.argv[1])
config = machines.CONFIGS["ivu"].model_validate(order["config"])
def tell(supervisor):
    written = supervisor.recorder.stats().rows_written
    os.write(1, written.to_bytes(8, "little"))
    if written >= order["enough"]:
        os.read(0, 1)  # until it is killed: the recorder goes on, but the run never comes to its end
Session(config, Path(order["out"]), order["seconds"]).run(tell)
"""
SECONDS = 4000.0  # more than is recorded by whoever comes late to kill


@pytest.mark.parametrize("share", [0.01, 0.06])
def test_a_killed_supervisor_leaves_a_prefix_of_the_run(
    runtime: Path, config: Callable[..., Any], tmp_path: Path, share: float
) -> None:
    settings = config(set={"record.seconds": 2.0, "record.batch": 0.001})  # a ring of 1000 rows: many batches
    enough = share * SECONDS * 500
    order = {
        "config": settings.model_dump(mode="json", exclude_unset=True),
        "out": str(tmp_path / "run"), "seconds": SECONDS, "enough": enough,
    }  # fmt: skip
    child = subprocess.Popen(
        [sys.executable, "-c", RUN, json.dumps(order)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0
    )
    assert child.stdout is not None
    written = 0
    try:
        while word := child.stdout.read(8):  # to the end of what it said, also after its death
            written = int.from_bytes(word, "little")
            if written >= enough and child.poll() is None:
                child.kill()
        child.wait()
    finally:
        child.kill()
        segment_path(settings.name).unlink(missing_ok=True)
    assert child.returncode == -signal.SIGKILL
    rows = repair(tmp_path / "run").rows
    assert enough <= written <= rows < SECONDS * 500
    truth = fused.run(settings, rows / 500).rows
    columns = load_bundle(tmp_path / "run").columns
    columns.pop("order", None)  # of the request to arm: the run within this process has it without a mailbox
    for name, found in columns.items():
        np.testing.assert_array_equal(found, truth[name][:rows], err_msg=name)
