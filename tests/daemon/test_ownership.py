"""Ownership of files: what a killed daemon leaves to the next one, and the access rights of other users."""

import json
import os
import pwd
import signal
import socket
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zmq
from waiting import gone, wait_for

from rtctl.daemon.server import CommandServer, runtime_dir
from rtctl.daemon.session import Session
from rtctl.daemon.shared_memory import segment_path, shared_folder
from rtctl.daemon.supervisor import Supervisor
from rtctl.daemon.telemetry import Telemetry
from rtctl.loop.records import STATUS
from rtctl.tick.memory import Segment
from rtctl.trace.bundle import load_bundle
from rtctl.trace.repair import repair

RUN = """
import json, sys
from pathlib import Path
from rtctl import machines
from rtctl.daemon.session import Session
order = json.loads(sys.argv[1])
config = machines.CONFIGS[order["config"]["machine"]].model_validate(order["config"])
Session(config, Path(order["out"]), order["length"]).run()
"""
LONG = 1e6  # s of virtual time; the run is killed long before


def left(config: Any) -> list[Path]:
    """Files of a machine in shared memory and in the folder of sockets."""
    return [*shared_folder().glob(f"{config.name}.*"), *runtime_dir().glob(f"{config.name}.*")]


def status_of(path: Path) -> Any:
    """Counters of the loop: the first block of a segment."""
    return np.memmap(path, STATUS, "r", shape=(1,))[0]


SOME_ROWS = 50_000  # bytes


@pytest.fixture
def killed(runtime: Path, tmp_path: Path) -> Iterator[Callable[[Any], list[int]]]:
    """`killed(config)` starts a run, kills its supervisor during the run and returns the pids of its children."""
    made: list[subprocess.Popen] = []

    def kill(config: Any) -> list[int]:
        data = config.model_dump(mode="json", exclude_unset=True)
        order = {"config": data, "out": str(tmp_path / "killed"), "length": LONG}
        made.append(subprocess.Popen([sys.executable, "-c", RUN, json.dumps(order)]))
        pid, path = made[-1].pid, segment_path(config.name)
        wait_for(lambda: path.exists() and path.stat().st_size >= STATUS.itemsize)  # the file is created, then sized
        wait_for(lambda: status_of(path)["tick"] > 1000, 200)
        stream = tmp_path / "killed" / "recording.arrows"
        wait_for(lambda: stream.exists() and stream.stat().st_size > SOME_ROWS)
        children = [int(p) for p in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
        assert children and not any(map(gone, children))
        made[-1].send_signal(signal.SIGKILL)
        made[-1].wait()
        return children

    yield kill
    for each in made:
        each.kill()
        each.wait()


@pytest.mark.parametrize("mode", ["lockstep", "fused"])
def test_after_sigkill_the_children_end_and_the_next_start_takes_over_the_files(
    config: Callable[..., Any], killed: Callable[[Any], list[int]], tmp_path: Path, mode: str
) -> None:
    settings = config(mode=mode, link="shm", set={"record.seconds": 2.0, "record.batch": 0.001})
    children = killed(settings)
    wait_for(lambda: all(map(gone, children)), 10)
    assert {p.suffix for p in left(settings)} >= {".lock", ".command", ".telemetry"}  # no cleanup after SIGKILL
    assert segment_path(settings.name) in left(settings)  # with the last seconds of the trace
    assert Session(settings, tmp_path / "next", 2.0).run()["ticks"] == 1000
    assert left(settings) == []
    kept, first = load_bundle(tmp_path / "next").columns, repair(tmp_path / "killed")
    before = load_bundle(tmp_path / "killed").columns
    assert first.rows > 0 and (kept["tick"] == np.arange(1000)).all()
    both = min(first.rows, 1000)
    assert (before["u1"][:both] == kept["u1"][:both]).all()  # the killed run does not affect the next one


def test_two_machines_with_different_names_share_no_files(
    config: Callable[..., Any], runtime: Path, tmp_path: Path
) -> None:
    first, second = config(), config()
    with Supervisor(first, None, 50) as supervisor:
        assert Session(second, tmp_path / "second", 0.1).run()["ticks"] == 50
        assert left(second) == []
        assert len(left(first)) == 9  # lock, segment, description, and three sockets with their inner ends
        for _ in supervisor.run():
            pass
        assert supervisor.snapshot()["ticks"] == 50
    assert left(first) == []


def test_shared_memory_is_accessible_to_its_owner_only(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        made = Segment.create(tmp_path / "segment", {"status": (STATUS, 1)})
    finally:
        os.umask(before)
    assert stat.S_IMODE(made.path.stat().st_mode) == 0o600


# other users


class Nothing:
    def handle(self, op: str, args: Any) -> dict[str, Any]:
        return {}


@pytest.fixture
def served(runtime: Path) -> Iterator[dict[str, Path]]:
    """Both sockets as under rtctl@.service: UMask=0027, in a folder of mode 0750. Paths by socket."""
    folder = runtime / f"service-{time.monotonic_ns()}"
    folder.mkdir()
    folder.chmod(0o750)
    context = zmq.Context()
    before = os.umask(0o027)
    try:
        command = CommandServer(f"ipc://{folder}/ivu.command", Nothing(), context)
        telemetry = Telemetry(f"ipc://{folder}/ivu.telemetry", "ivu", ["x"], context)
    finally:
        os.umask(before)
    yield {name: folder / f"ivu.{name}" for name in ("command", "telemetry")}
    command.close()
    telemetry.close()
    context.destroy(linger=0)


def test_command_socket_is_for_the_owner_and_telemetry_also_for_the_group(served: dict[str, Path]) -> None:
    """On Linux a connection to a unix socket needs write permission."""
    modes = {name: stat.S_IMODE(path.stat().st_mode) for name, path in served.items()}
    assert modes["command"] & 0o222 == 0o200
    assert modes["telemetry"] & 0o222 == 0o220


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
def test_group_member_connects_to_telemetry_only_and_other_users_to_nothing(
    served: dict[str, Path], runtime: Path
) -> None:
    nobody = pwd.getpwnam("nobody")
    group = nobody.pw_gid
    for path in (served["command"].parent, *served.values()):
        os.chown(path, 0, group)
    mode = runtime.stat().st_mode
    runtime.chmod(0o755)
    try:
        member = {name: connects(path, nobody.pw_uid, group) for name, path in served.items()}
        stranger = {name: connects(path, nobody.pw_uid, group + 1) for name, path in served.items()}
    finally:
        runtime.chmod(mode)
    assert member == {"command": False, "telemetry": True}
    assert stranger == {"command": False, "telemetry": False}


def connects(path: Path, uid: int, gid: int) -> bool:
    """Whether a process of that user and group can connect to a unix socket."""
    child = os.fork()
    if child == 0:
        code = 2
        try:
            os.setgroups([])
            os.setgid(gid)
            os.setuid(uid)
            with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
                probe.connect(str(path))
            code = 0
        except PermissionError:
            code = 1
        finally:
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert code in (0, 1)
    return code == 0
