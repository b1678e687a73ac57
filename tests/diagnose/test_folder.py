"""Diagnoses of a folder in parallel processes, and their results on disk."""

import json
import os
import select
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from rtctl.diagnose.folder import BAD, OURS, RESULT, Outcome, Task, diagnose_all, done, one, tasks
from rtctl.trace.bundle import CASE, PARQUET

WORK = '''
import os
import time
from rtctl.diagnose.folder import Outcome

def work(task, report):
    """Does as the bundle's name says."""
    if task.name == "stuck":
        time.sleep(600)
    if task.name == "tells":
        print(os.getpid(), flush=True)
        time.sleep(600)
    if task.name == "dies":
        os._exit(7)
    from rtctl.diagnose.likelihood.solver import THREADS
    alone = os.environ.get("OPENBLAS_NUM_THREADS")
    found = {"threads": THREADS.get(), "blas": alone, "report": report, "pid": os.getpid()}
    return Outcome(task.name, 0, 0.1, found)
'''


SCRIPT = """
from pathlib import Path
import quick_work
from rtctl.diagnose.folder import Task, diagnose_all

if __name__ == "__main__":
    list(diagnose_all([Task("tells", Path(), Path())], work=quick_work.work))
"""


@pytest.fixture
def work(tmp_path, monkeypatch):
    """A quick task that other processes import by name."""
    (tmp_path / "quick_work.py").write_text(WORK)
    monkeypatch.syspath_prepend(tmp_path)
    import quick_work

    return quick_work.work


def named(*names):
    return [Task(name, Path(name), Path(name)) for name in names]


def bundle(path, rows=10):
    path.mkdir(parents=True)
    pq.write_table(pa.table({"t": np.arange(rows) * 1e-3}), path / PARQUET)
    (path / CASE).write_text(json.dumps({"plant": "axis"}))
    return path


def test_dead_process_does_not_stop_the_others(work):
    names = ("a", "dies", "b", "c")
    outcomes = {o.name: o for o in diagnose_all(named(*names), jobs=2, work=work)}
    assert outcomes.keys() == set(names)
    assert [outcomes[name].code for name in names] == [0, OURS, 0, 0]
    assert "exit code 7" in outcomes["dies"].message
    assert outcomes["a"].diagnosis["threads"] == 1
    assert outcomes["a"].diagnosis["blas"] == "1"


def test_stuck_process_is_ended_and_the_next_task_begins(work):
    outcomes = list(diagnose_all(named("stuck", "stuck"), limit=0.2, work=work))
    assert [o.code for o in outcomes] == [OURS, OURS]
    assert "not done within --limit 0.2 s" in outcomes[1].message


def test_single_job_keeps_all_threads_and_one_process(work, monkeypatch):
    from rtctl.diagnose.likelihood.solver import THREADS

    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    outcomes = list(diagnose_all(named("a", "b"), jobs=1, report=False, work=work))
    assert {o.diagnosis["threads"] for o in outcomes} == {THREADS.get()}
    assert not outcomes[0].diagnosis["report"]
    assert len({o.diagnosis["pid"] for o in outcomes}) == 1
    assert "OPENBLAS_NUM_THREADS" not in os.environ


def test_closing_the_iterator_ends_the_processes(work):
    running = diagnose_all(named("a", "stuck"), jobs=2, work=work)
    pid = next(running).diagnosis["pid"]
    running.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_killing_the_parent_ends_the_processes(work, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as main:
        worker = os.pidfd_open(int(main.stdout.readline()))
        main.kill()
        assert select.select([worker], [], [], 60)[0]  # readable once it has ended
        os.close(worker)
        assert main.stderr.read() == b""


def test_empty_task_list_gives_no_outcomes():
    assert list(diagnose_all([])) == []


def test_tasks_are_sorted_and_paired_with_held_out_bundles(tmp_path):
    for name in ("b", "a", "a-heldout", "lonely-heldout"):
        bundle(tmp_path / name)
    (tmp_path / "notes").mkdir()
    found = tasks(tmp_path)
    assert [t.name for t in found] == ["a", "b", "lonely-heldout"]
    assert found[0].out == tmp_path / "a" / "diagnosis"
    assert [t.other for t in found] == [tmp_path / "a-heldout", None, None]


def test_tasks_with_separate_result_and_held_out_folders(tmp_path):
    bundle(tmp_path / "x" / "a")
    found = tasks(tmp_path / "x", tmp_path / "out", tmp_path / "later")
    assert found == [Task("a", tmp_path / "x" / "a", tmp_path / "out" / "a", tmp_path / "later" / "a")]


def test_bundle_is_not_a_folder_of_bundles(tmp_path):
    bundle(tmp_path / "a")
    bundle(tmp_path / "a" / "inner")
    assert tasks(tmp_path / "a") == []
    assert tasks(tmp_path / "nowhere") == []


def test_result_is_valid_while_no_input_is_newer(tmp_path):
    task = Task("a", bundle(tmp_path / "a"), tmp_path / "out")
    assert done(task) is None
    task.out.mkdir()
    result = task.out / RESULT
    result.write_text(json.dumps({"verdict": "nothing", "seconds": 3.5}))
    os.utime(result, ns=(2**61, 2**61))
    assert done(task) == Outcome("a", 0, 3.5, {"verdict": "nothing", "seconds": 3.5}, skipped=True)
    os.utime(task.bundle / PARQUET, ns=(2**61 + 10**9, 2**61 + 10**9))
    assert done(task) is None


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"seconds": null}'])
def test_incomplete_result_file_is_ignored(tmp_path, text):
    task = Task("a", bundle(tmp_path / "a"), tmp_path)
    (tmp_path / RESULT).write_text(text)
    os.utime(tmp_path / RESULT, ns=(2**61, 2**61))
    assert done(task) is None


def test_invalid_bundle_is_reported_in_one_line(tmp_path):
    outcome = one(Task("a", bundle(tmp_path / "a"), tmp_path / "out"), report=False)
    assert outcome.code == BAD
    assert "no column 'u'" in outcome.message and "\n" not in outcome.message
    assert outcome.as_json()["exit_code"] == BAD
    assert not (tmp_path / "out").exists()


def test_internal_error_is_reported_as_internal(tmp_path, monkeypatch):
    from rtctl.diagnose.answer import answer

    def broken(*_, **__):
        raise ZeroDivisionError("oh")

    monkeypatch.setattr(answer, "diagnose", broken)
    (tmp_path / "case.json").write_text('{"plant": "axis"}')
    outcome = one(Task("a", tmp_path, tmp_path), report=False)
    assert outcome.code == OURS and "internal error: ZeroDivisionError('oh')" in outcome.message
