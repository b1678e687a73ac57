"""SIGKILL during a recording loses at most the batch that was being written."""

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

KILLS, TOTAL, SIZE = 20, 4000, 50  # 50 rows: 5 ms at 10 kHz
SMALL = Rotation(megabytes=TOTAL * ROW.itemsize / 1e6 / 6)  # about six parts


@pytest.fixture(scope="module")
def processes():
    """Context of a fork server with the recorder imported, for fast process starts."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["rtctl.trace.recorder"])
    return context


def killed_at(processes, folder: Path, moment: int, rotation: Rotation | None) -> tuple[int, bool]:
    """Record into `folder`; kill at the first announcement of at least `moment` rows, or during the finish.

    Returns the last announced number of rows, and whether the recorder was finishing.
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
    except EOFError:  # all announcements are read
        pass
    child.join()
    assert child.exitcode == -signal.SIGKILL or finishing
    return given, finishing


def test_kill_loses_at_most_the_batch_being_written(tmp_path, processes):
    draw = random.Random(5)
    finished = 0
    for number in range(KILLS):
        folder, rotation = tmp_path / str(number), SMALL if number % 2 else None
        moment = draw.randrange(1, TOTAL + TOTAL // 5)  # a sixth of the kills during the finish
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
SECONDS = 4000.0  # s, more than is recorded before a late kill


@pytest.mark.parametrize("share", [0.01, 0.06])
def test_killed_supervisor_leaves_a_prefix_of_the_run(
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
        while word := child.stdout.read(8):  # read the whole output, also after its end
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
    columns.pop("order", None)  # the fused run arms without a mailbox order
    for name, found in columns.items():
        np.testing.assert_array_equal(found, truth[name][:rows], err_msg=name)
