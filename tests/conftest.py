"""Shared fixtures: small configs, a folder for sockets, and a machine inside the test process."""

import itertools
import os
import pwd
import shutil
import site
import sys
import tempfile
from collections.abc import Callable, Iterator, MutableMapping
from pathlib import Path
from types import ModuleType
from typing import Any

from rtctl.config.arithmetic import equal_digits

equal_digits()  # before numpy is loaded

import numpy as np
import pytest
import yaml
from hypothesis import settings

from rtctl import machines
from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import set_path
from rtctl.loop import generate
from rtctl.loop.loop import Loop
from rtctl.loop.mailbox import Mailbox
from rtctl.loop.records import layout
from rtctl.loop.ring import Reader
from rtctl.tick.memory import Segment
from rtctl.trace.replay import replay

TESTS = Path(__file__).parent
sys.path.insert(0, str(TESTS))  # for served.py and compiled.py, under importlib mode
CONFIGS = Path(__file__).parents[1] / "configs"
SHARED = TESTS.parents[1] / "shared"  # recordings from outside the project
KEPT = Path(__file__).parents[1] / "build" / "tests"  # home and caches of every process that the tests start
number = itertools.count(1)
settings.register_profile("any machine", deadline=None)  # no deadline: slow examples are not failures
settings.load_profile("any machine")


def at_home(environment: MutableMapping[str, str]) -> None:
    """Home and caches within the project, so that the tests neither write outside of it nor depend on the account that
    runs them. A cache that the caller names stays."""
    environment.setdefault("PYTHONUSERBASE", site.getuserbase())  # libraries of `pip install --user`
    for name in ("XDG_CONFIG_HOME", "XDG_CACHE_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME", "HOME"):
        environment.pop(name, None)
    environment["HOME"] = str(KEPT)
    environment.setdefault("RTCTL_CACHE_DIR", str(KEPT / "rtctl"))
    KEPT.mkdir(parents=True, exist_ok=True)


at_home(os.environ)


@pytest.hookimpl(wrapper=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Iterator[None]:
    """Which tests go to one worker: those on the wall clock, since two FIFO loops on one CPU would judge each other;
    and those that share a fixture of their file or what a module keeps (`functools.cache`): dear, once is enough."""
    groups = {item: name for item in items if (name := group(item))}
    for item, name in groups.items():
        item.add_marker(pytest.mark.xdist_group(name))
    yield
    for item, name in groups.items() if "PYTEST_XDIST_WORKER" in os.environ else ():
        if not item.nodeid.endswith(f"@{name}"):  # from pytest 9.2 on xdist forgets it (pytest-dev/pytest-xdist#1386)
            setattr(item, "_id", type(item.id).parse(f"{item.nodeid}@{name}"))  # noqa: B010


def group(item: pytest.Item) -> str:
    """Worker group of a test, "" for none."""
    fixtures = getattr(item, "_fixtureinfo").name2fixturedefs.values()  # noqa: B009
    if item.get_closest_marker("realtime"):
        return "realtime"
    here = f"{item.path.parent.name}-{item.path.stem}"
    if any(found[-1].scope == "module" for found in fixtures):
        return here
    seen = vars(getattr(item, "module"))  # noqa: B009
    if any(keeps(value) and value.__module__ == seen["__name__"] for value in seen.values()):
        return here
    helpers = [value for value in seen.values() if isinstance(value, ModuleType) and is_helper(value)]
    return helpers[0].__name__ if helpers else ""


def is_helper(module: ModuleType) -> bool:
    """Whether a module is a test helper that caches its results."""
    path = getattr(module, "__file__", None)
    return path is not None and TESTS in Path(path).parents and any(keeps(value) for value in vars(module).values())


def keeps(value: Any) -> bool:
    """Whether an object is a function with a cache."""
    return hasattr(value, "cache_info")


MADE_BY_TOOLS = {"build", "dist", "rtctl.egg-info", ".hypothesis", ".pytest_cache", ".mypy_cache", ".ruff_cache"}


@pytest.fixture(scope="session", autouse=True)
def nothing_is_written_elsewhere() -> Iterator[None]:
    """No home and no folder of rtctl's is made for an account that the tests run as, root or nobody, and nothing beside
    the sources."""
    homes = {Path(pwd.getpwuid(os.getuid()).pw_dir), Path(pwd.getpwnam("nobody").pw_dir)}
    places = [home / name for home in homes for name in ("", ".cache/rtctl", ".config/rtctl", ".local/share/rtctl")]
    missing = [place for place in places if not place.exists()]
    root = Path(__file__).parents[1]
    there = {path.name for path in root.iterdir()} | MADE_BY_TOOLS
    yield
    made = [str(place) for place in missing if place.exists()]
    made += [str(path) for path in root.iterdir() if path.name not in there]
    assert not made, f"a test, or a process that it started, made {', '.join(made)}"


@pytest.fixture(scope="session", autouse=True)
def every_recording_replays(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Every recording of the tests replays bit-exact."""
    yield
    for journal in sorted(tmp_path_factory.getbasetemp().rglob("orders.jsonl")):
        try:
            found = replay(journal.parent)
        except (UserError, NoAnswer):
            continue  # truncated, damaged or changed on purpose
        assert found.identical, f"{journal.parent}: {found.differences[0]}"


@pytest.fixture(scope="session")
def runtime() -> Iterator[Path]:
    """A folder for sockets and locks with a short path: a socket path has at most 107 bytes."""
    if "PYTEST_XDIST_WORKER" in os.environ:  # many tests are coming; for one of them it would be too much
        from compiled import reel_unit

        reel_unit()
    folder = Path(tempfile.mkdtemp(prefix="rt-", dir="/tmp"))
    memory = Path(tempfile.mkdtemp(prefix="rt-", dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else "/tmp"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(folder))
        patch.setenv("RTCTL_SHM_DIR", str(memory))  # otherwise segments of killed daemons remain
        yield folder
    for made in (folder, memory):
        shutil.rmtree(made, ignore_errors=True)


@pytest.fixture(scope="session")
def config() -> Callable[..., Any]:
    """`config("ivu", mode="fused", link="shm", set={"safety.current": 0.5})`: settings under a name of their own."""

    def make(kind: str = "ivu", mode: str = "fused", link: str = "shm", set: dict[str, Any] | None = None) -> Any:
        data = yaml.safe_load((CONFIGS / f"{kind}.yaml").read_text())
        data["name"] = f"t{os.getpid()}-{next(number)}"
        settings = machines.CONFIGS[kind].model_validate(data)
        for path, value in {"loop.mode": mode, "link.kind": link, **(set or {})}.items():
            settings = set_path(settings, path, value)
        return settings

    return make


class Bench:
    """A machine inside the test process: ask, run some seconds of virtual time, look at the rows."""

    def __init__(self, config: Any, folder: Path, rows: int = 20_000):
        self.machine = machines.build(config)
        self.made = generate.generate(self.machine, "shm")
        self.segment = Segment.create(
            folder / f"segment-{config.name}", layout(self.made.params, self.made.tables, self.made.row, rows)
        )
        self.take_over(config)
        generate.fill_tables(self.segment["tables"][0], (self.machine.reference, self.machine.excitation))
        self.status = self.segment["status"][0]
        self.mailbox, self.reader = Mailbox(self.segment), Reader(self.segment)
        self.loop = Loop(self.machine, self.made, self.segment, self.segment["outputs"], self.segment["inputs"])
        self.ticks = 0

    def take_over(self, config: Any) -> None:
        """Put the parameters of a config into the mailbox; the tick takes them with the next request."""
        generate.fill(self.segment["mailbox"][0]["params"], machines.build(config).diagram.blocks)

    def ask(self, *requests: str, **fields: int) -> "Bench":
        """Increment the given requests (arm, play, reset, disarm, gains) and set fields of the command."""

        def write(_: Any, command: Any) -> None:
            for name in requests:
                command[name] += 1
            for name, value in fields.items():
                command[name] = value

        self.mailbox.post(write)
        return self

    def run(self, seconds: float) -> np.ndarray:
        """The rows of the next `seconds`."""
        ticks = round(seconds * self.machine.rate)
        self.loop.stretch(self.ticks, ticks)
        self.ticks += ticks
        return self.reader.take()


@pytest.fixture
def bench(tmp_path: Path) -> Callable[..., Bench]:
    """`bench(config)` is a Bench for it."""

    def make(config: Any, rows: int = 20_000) -> Bench:
        return Bench(config, tmp_path, rows)

    return make


@pytest.fixture(scope="module")
def served(runtime: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Any]]:
    """`served(config)` is a Bench whose command socket answers; its name is that of the config."""
    from served import Served

    from rtctl.daemon.server import default_endpoint

    made = []

    def make(config: Any, rows: int = 20_000) -> Any:
        machine = Bench(config, tmp_path_factory.mktemp("served"), rows)
        made.append(Served(machine, default_endpoint(config.name, "command")))
        return made[-1]

    yield make
    for machine in made:
        machine.close()


@pytest.fixture
def library() -> Iterator[None]:
    """Restores the library of terms: a user term stays registered for the life of the process."""
    from rtctl.own.term import registered
    from rtctl.plants.physics import TERMS

    before = dict(TERMS)
    yield
    TERMS.clear()
    TERMS.update(before)
    registered.clear()


@pytest.fixture
def shared() -> Callable[[str], Path]:
    """`shared("data/emps")`: a recording from outside the project; skips where it is missing."""

    def find(name: str) -> Path:
        folder = SHARED / name
        if not (folder / "case.json").is_file():
            pytest.skip(f"{folder} is missing")
        return folder

    return find
