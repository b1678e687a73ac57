"""Unit files checked by systemd, if installed."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "systemd"
UNITS = ("rtctl@.service", "rtctl-plant@.service")
MOST_EXPOSED = 3.0
NEWER = "Failed to parse service type, ignoring: notify-reload"  # what systemd before 253 says


def tool(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"there is no {name} here")
    return found


def version() -> int:
    said = subprocess.run([tool("systemd-analyze"), "--version"], capture_output=True, text=True, check=True).stdout
    return int(said.split()[1])


def unit(name: str) -> dict[str, list[str]]:
    """Settings of the [Service] section, each with all values."""
    lines = (FOLDER / name).read_text().partition("[Service]")[2].partition("\n[")[0].splitlines()
    found: dict[str, list[str]] = {}
    for line in lines:
        if "=" in line and not line.startswith("#"):
            key, _, value = line.partition("=")
            found.setdefault(key, []).append(value)
    return found


@pytest.mark.parametrize("name", UNITS)
def test_systemd_verify_finds_no_error(name: str, tmp_path: Path) -> None:
    """The program path is that of this environment, since /usr/bin may lack the program."""
    program = Path(sys.executable).with_name("rtctl")
    if not program.exists():
        pytest.skip(f"there is no {program}")
    text = (FOLDER / name).read_text().replace("ExecStart=rtctl ", f"ExecStart={program} ")
    copy = tmp_path / name
    copy.write_text(text)
    run = subprocess.run([tool("systemd-analyze"), "verify", str(copy)], capture_output=True, text=True, check=False)
    said = [line for line in run.stderr.splitlines() if version() >= 253 or not line.endswith(NEWER)]
    assert said == [] and run.returncode == 0


def test_systemd_verify_finds_an_invalid_line(tmp_path: Path) -> None:
    copy = tmp_path / UNITS[0]
    copy.write_text((FOLDER / UNITS[0]).read_text().replace("WatchdogSec=", "WatchdogSecs="))
    run = subprocess.run([tool("systemd-analyze"), "verify", str(copy)], capture_output=True, text=True, check=False)
    assert "WatchdogSecs" in run.stderr


@pytest.mark.parametrize("name", UNITS)
def test_exposure_level_is_within_its_limit(name: str) -> None:
    command = [
        tool("systemd-analyze"),
        "security",
        "--offline=yes",
        f"--threshold={MOST_EXPOSED * 10:.0f}",
        "--no-pager",
    ]
    run = subprocess.run([*command, str(FOLDER / name)], capture_output=True, text=True, check=False)
    level = re.search(r"Overall exposure level for .*: ([0-9.]+)", run.stdout)
    assert level and float(level[1]) <= MOST_EXPOSED and run.returncode == 0, run.stdout + run.stderr


@pytest.mark.parametrize("name", UNITS)
def test_restrictions_that_break_a_compiled_tick_are_absent(name: str) -> None:
    settings = unit(name)
    assert "MemoryDenyWriteExecute" not in settings
    assert settings["Environment"] == ["RTCTL_CACHE_DIR=/var/cache/rtctl"] and settings["CacheDirectory"] == ["rtctl"]
    calls = " ".join(settings["SystemCallFilter"])
    assert "~@resources" not in calls and "~@memlock" not in calls


def test_loop_may_use_fifo_and_lock_its_memory() -> None:
    settings = unit("rtctl@.service")
    assert settings["LimitRTPRIO"] == ["99"] and settings["LimitMEMLOCK"] == ["infinity"]
    assert settings["LimitNOFILE"] == ["65536"]
    assert "RestrictRealtime" not in settings and "PrivateDevices" not in settings
    assert "/dev/cpu_dma_latency rw" in settings["DeviceAllow"]


def test_every_process_gets_the_signal_that_zeroes_the_outputs() -> None:
    settings = unit("rtctl@.service")
    assert settings["KillMode"] == ["control-group"] and settings["WatchdogSignal"] == ["SIGTERM"]
    assert "KillSignal" not in settings


def test_only_the_main_process_notifies_and_reload_is_configured() -> None:
    settings = unit("rtctl@.service")
    assert settings["Type"] == ["notify", "notify-reload"] and settings["NotifyAccess"] == ["main"]
    assert "ExecReload" not in settings  # with notify-reload the manager sends SIGHUP


def test_recordings_are_never_moved_or_removed() -> None:
    settings = unit("rtctl@.service")
    assert not {"ExecStartPre", "ExecStopPost"} & settings.keys() and "--out" not in settings["ExecStart"][0]
    lines = [line.split() for line in _lines("rtctl.tmpfiles")]
    assert all(words[-1] == "-" for words in lines if words[0] == "d")  # no age limit
    assert not [words for words in lines if words[0][0] in "rRD"]


@pytest.mark.parametrize("name", UNITS)
def test_folder_modes_agree_with_tmpfiles(name: str) -> None:
    """Different modes would change a folder back and forth."""
    settings = unit(name)
    modes = {words[1]: words[2] for words in map(str.split, _lines("rtctl.tmpfiles"))}
    for key, base in (("RuntimeDirectory", "/run"), ("StateDirectory", "/var/lib"), ("CacheDirectory", "/var/cache")):
        assert settings[f"{key}Mode"] == [modes[f"{base}/{settings[key][0]}"]]
    assert settings["RuntimeDirectoryPreserve"] == ["yes"]  # shared with the sockets of other machines


def test_sysusers_creates_the_account(tmp_path: Path) -> None:
    command = [tool("systemd-sysusers"), f"--root={tmp_path}", str(FOLDER / "rtctl.sysusers")]
    (tmp_path / "etc").mkdir()
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    account = (tmp_path / "etc/passwd").read_text().split(":")
    assert account[0] == "rtctl" and account[5] == "/var/lib/rtctl" and account[6].strip().endswith("nologin")
    groups = dict(line.split(":", 1) for line in (tmp_path / "etc/group").read_text().splitlines())
    assert groups["iocard"].endswith(":rtctl")
    assert {unit(name)[key][0] for name in UNITS for key in ("User", "Group")} == {"rtctl"}


def test_tmpfiles_creates_the_folders(tmp_path: Path) -> None:
    """In a temporary tree with the account."""
    test_sysusers_creates_the_account(tmp_path)
    command = [tool("systemd-tmpfiles"), f"--root={tmp_path}", "--create", str(FOLDER / "rtctl.tmpfiles")]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    if "Operation not permitted" in run.stderr:
        pytest.skip("changing the owner of a folder is not allowed here")
    assert run.returncode == 0, run.stderr
    made = {p: (tmp_path / p).stat() for p in ("run/rtctl", "var/lib/rtctl", "var/lib/rtctl/runs", "var/cache/rtctl")}
    assert {s.st_mode & 0o777 for s in made.values()} == {0o750}
    assert len({s.st_uid for s in made.values()}) == 1


def _lines(name: str) -> list[str]:
    return [line for line in (FOLDER / name).read_text().splitlines() if line and not line.startswith("#")]
