"""A daemon in real mode, and every command that talks to a daemon."""

import json

import pytest

from rtctl.cli import capture, status
from rtctl.cli.main import main
from rtctl.trace.bundle import load_bundle


@pytest.fixture(autouse=True)
def _idle(machine, capsys):
    """Outputs are off at the start of a test."""
    assert main(["disarm"]) == 0
    assert main(["reset"]) == 0


@pytest.fixture
def armed(rtctl, machine):
    code, out, err = rtctl("arm")
    assert (code, err) == (0, "")
    assert out in (f"{machine} is armed\n", f"{machine} is running\n")


def interrupt_after(monkeypatch, module, count):
    """The module's `count`-th pause ends with Ctrl-C."""
    left = iter(range(count))
    pause = module.time.sleep

    def sleep(seconds):
        if next(left, None) is None:
            raise KeyboardInterrupt
        pause(seconds)

    monkeypatch.setattr(module.time, "sleep", sleep)


def test_status_prints_the_running_machine(rtctl, machine):
    code, out, err = rtctl("status")
    assert (code, err) == (0, "")
    for text in (
        machine,
        "idle",
        "500 Hz",
        "lateness",
        "missed",
        "shm",
        "recorded",
        "capstan_error",
        "rad",
        "tension1",
    ):
        assert text in out


def test_status_as_json(rtctl, machine):
    first = json.loads(rtctl("status", "--json", "--name", machine).out)
    then = json.loads(rtctl("status", "--json").out)
    assert (first["name"], first["state"], first["trip"], first["link"]) == (machine, "idle", None, "shm")
    assert then["ticks"] > first["ticks"]
    assert set(then["signals"]) > {"capstan", "u1", "tension1_estimate"}


def test_status_repeats_until_interrupted(rtctl, machine, monkeypatch):
    interrupt_after(monkeypatch, status, 2)
    code, out, _ = rtctl("status", "--watch", "--json")
    assert code == 0
    ticks = [json.loads(line)["ticks"] for line in out.splitlines()]
    assert len(ticks) == 3
    assert ticks == sorted(ticks)
    interrupt_after(monkeypatch, status, 1)
    code, out, _ = rtctl("status", "--watch")
    assert code == 0
    assert machine in out


def test_arm_play_and_disarm(rtctl, machine, armed):
    while json.loads(rtctl("status", "--json").out)["state"] != "running":
        pass  # the tape is tightened first
    assert rtctl("play") == (0, f"{machine} is running\n", "")
    said = json.loads(rtctl("disarm", "--json").out)
    assert (said["name"], said["state"], said["trip"]) == (machine, "idle", None)


def test_setpoint_without_outputs_is_refused(rtctl):
    assert rtctl("setpoint", "1") == (2, "", "rtctl: outputs are off; `rtctl arm` first\n")


@pytest.mark.parametrize(
    ("words", "target", "rate"),
    [
        (["0.2"], 0.2, 0.0),
        (["-0.1"], -0.1, 0.0),
        (["--", "-0.1"], -0.1, 0.0),
        (["-2.5mm", "--ramp", "20mm/s"], -0.2, 1.6),
        (["-0.1", "rad"], -0.1, 0.0),
        (["position", "0.1 rad", "--ramp", "12.5 mm/s"], 0.1, 1.0),
        (["2.5", "--unit", "mm", "--ramp", "25"], 0.2, 2.0),
    ],
)
def test_setpoint_prints_its_target(rtctl, armed, words, target, rate):
    code, out, err = rtctl("setpoint", "--json", *words)
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert (result["target"], result["rate"]) == (pytest.approx(target), pytest.approx(rate))
    assert result["unit"] == "rad"


def test_setpoint_moves_the_machine(rtctl, armed, tmp_path):
    code, out, _ = rtctl("setpoint", "1", "--ramp", "1rad/s")  # further than in any other test
    assert code == 0
    assert out.startswith("to 1 rad at 1 rad/s, from tick")
    assert rtctl("capture", "--for", "20ms", "--trigger", "capstan > 0.9", "-o", tmp_path / "c").code == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["left", "3"], "no setpoint 'left'; it has 'position'"),
        (["3 furlong"], "'furlong' is neither a length nor an angle"),
        (["3V"], "'V' is neither"),
        (["much"], "setpoint much: not a number with a unit"),
        (["3mm", "--unit", "rad"], "has a unit of its own"),
        (["3mm", "--ramp", "20mm"], "--ramp 20mm: not a speed"),
        (["3mm", "--ramp", "0"], "--ramp 0: not a speed"),
        (["3mm", "--ramp", "5kg/s"], "'kg' is neither"),
        (["1e999"], "finite"),
    ],
)
def test_invalid_setpoint_is_refused(rtctl, armed, words, message):
    code, out, err = rtctl("setpoint", *words)
    assert (code, out) == (2, "")
    assert message in err


def test_get_and_set_a_setting(rtctl):
    assert rtctl("set", "law.position.gain", "25").code == 0
    assert rtctl("get", "law.position.gain").out == "25.0\n"
    assert rtctl("set", "law.position.tau_d", "180 ms").code == 0
    assert json.loads(rtctl("get", "law.position", "--json").out)["value"]["tau_d"] == 0.18
    assert "gain: 25.0\n" in rtctl("get", "law.position").out
    assert rtctl("set", "safety.tension_max", "7").code == 0
    assert rtctl("get", "safety.tension_max").out == "7.0\n"
    told = rtctl("set", "safety.tension_max", "1000")
    assert told.code == 2 and "safety.tension_max cannot become 1000 N while the machine runs" in told.err
    assert rtctl("set", "law.gain_schedule.mode", "off").code == 0
    assert rtctl("get", "law.gain_schedule.mode").out == "off\n"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["get", "law.position.gian"], "did you mean 'gain'"),
        (["get", "lwa"], "did you mean 'law'"),
        (["set", "law.position.gian", "3"], "did you mean 'gain'"),
        (["set", "law.position.gain", "5 kg"], "law.position.gain"),
        (["set", "law.position.gain", "{a: 1}"], "law.position.gain"),
        (["set", "law.position.gain", ".nan"], "finite"),
        (["set", "law.position.gain", "[1"], "not YAML"),
        (["set", "loop.rate", "1000"], "cannot change while the machine runs"),
        (["set", "name", "other"], "cannot change while the machine runs"),
    ],
)
def test_invalid_or_fixed_setting_is_refused(rtctl, words, message):
    code, out, err = rtctl(*words)
    assert (code, out) == (2, "")
    assert message in err


def test_capture_with_a_trigger(rtctl, machine, tmp_path):
    soon = json.loads(rtctl("status", "--json").out)["ticks"] + 200
    folder = tmp_path / "capture"
    code, out, err = rtctl("capture", "--for", "400ms", "--pre", "100ms", "--trigger", f"tick >= {soon}", "-o", folder)
    assert (code, out, err) == (0, f"{folder}\n", "")
    bundle = load_bundle(folder)
    tick = bundle.columns["tick"]
    assert tick[0] <= soon <= tick[-1]
    assert soon - 50 <= tick[0]
    assert bundle.case["plant"] == "ivu"


def test_capture_without_waiting(rtctl, tmp_path):
    code, out, _ = rtctl(
        "capture", "--for", "50ms", "--trigger", "tick < 0", "-o", tmp_path / "c", "--no-wait", "--json"
    )
    assert code == 0
    found = json.loads(out)
    assert (found["done"], found["bundle"]) == (False, str(tmp_path / "c"))


def test_ctrl_c_ends_a_capture_and_keeps_its_rows(rtctl, tmp_path, monkeypatch):
    interrupt_after(monkeypatch, capture, 1)
    folder = tmp_path / "capture"
    code, out, err = rtctl("capture", "--for", "1s", "--trigger", "tick < 0", "-o", folder)
    assert (code, out) == (3, f"{folder}\n")
    assert "the trigger never came" in err
    assert (folder / "case.json").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--for", "soon"], "--for soon: not a duration"),
        (["--for", "1s", "--pre", "-1s"], "--pre -1s"),
        (["--for", "1s", "--pre", "1h"], "the most that is kept"),
        (["--for", "1s", "--trigger", "captsan > 1"], "did you mean 'capstan'"),
        (["--for", "1s", "--trigger", "capstan"], "a condition"),
        (["--for", "1s", "-o", "/proc/nothing"], "/proc/nothing"),
    ],
)
def test_invalid_capture_is_refused(rtctl, words, message):
    code, out, err = rtctl("capture", *words)
    assert (code, out) == (2, "")
    assert message in err


def test_folder_with_a_recording_is_not_overwritten(rtctl, tmp_path):
    folder = tmp_path / "c"
    assert rtctl("capture", "--for", "20ms", "-o", folder).code == 0
    code, _, err = rtctl("capture", "--for", "20ms", "-o", folder)
    assert code == 2
    assert "already holds" in err


def test_second_daemon_of_a_name_is_refused(rtctl, machine, tmp_path):
    words = ["--mode", "real", "--link", "shm", "--for", "1s", "--out", tmp_path / "b"]
    code, _, err = rtctl("run", "ivu", "--set", f"name={machine}", *words)
    assert code == 2
    assert f"'{machine}' is run by another daemon (pid" in err


def test_endpoint_in_use_is_an_error(rtctl, machine, runtime, tmp_path):
    words = ["--mode", "real", "--link", "shm", "--for", "1s", "--out", tmp_path / "b"]
    taken = f"commands.endpoint=ipc://{runtime}/rtctl/{machine}.command"
    code, _, err = rtctl("run", "ivu", "--set", f"name={machine}b", "--set", taken, *words)
    assert code == 2
    assert "in use by another daemon" in err


def test_unknown_machine_name_error_suggests_running_machines(rtctl, machine):
    code, _, err = rtctl("status", "--name", f"{machine}x")
    assert code == 2
    assert f"did you mean '{machine}'" in err
    code, _, err = rtctl("status", "--name", "zzz")
    assert f"there is {machine}" in err


def test_stop_waits_for_the_end_and_the_run_prints_its_result(rtctl, machine, running, tmp_path):
    other = f"{machine}2"
    with running(other, tmp_path / "bundle") as process:
        code, _, err = rtctl("status")
        assert code == 2
        assert f"several machines run: {machine}, {other}; say which with --name" in err
        assert rtctl("stop", "--name", other) == (0, f"stopped (pid {process.pid})\n", "")
        out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    told = json.loads(out)
    assert (told["name"], told["tripped"], told["bundle"]) == (other, None, str(tmp_path / "bundle"))
    assert len(load_bundle(tmp_path / "bundle").columns["t"]) == told["ticks"]
    assert rtctl("status", "--name", other).code == 2
    assert rtctl("status").code == 0


def test_build_after_a_run_compiles_nothing(rtctl, machine):
    code, out, err = rtctl("build", "ivu", "--mode", "real", "--link", "shm")
    assert (code, err) == (0, "")
    assert out.endswith("cached: run_real, plant_real\n")
