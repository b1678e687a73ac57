import pytest


@pytest.fixture(autouse=True)
def _runtime(runtime):
    """Runtime folder, since socket names are printed."""


@pytest.mark.parametrize(
    ("words", "seen"),
    [
        (["ivu"], ["500 Hz, real", "pd,", "holds still", "ivu.command"]),
        (["ldu", "--mode", "fused"], ["10000 Hz, fused", "pi_velocity,", "loop's own process"]),
        (["axis", "--link", "shm"], ["1000 Hz", "emulated, over shm"]),
        (["ivu", "--reference", "steps"], ["knots over 10 s, in rad"]),
        (["ldu", "--reference", "print_steps"], ["in m"]),
        (
            ["ivu", "--set", "link.plant=external", "--set", "link.endpoint=tcp://127.0.0.1:5570"],
            ["external, at tcp://127"],
        ),
        (["ivu", "--set", "name=other", "--set", "loop.rate=1 kHz"], ["other (ivu)", "1000 Hz", "other.telemetry"]),
    ],
)
def test_check_prints_ok_and_a_summary_of_the_run(rtctl, words, seen):
    code, out, err = rtctl("check", *words)
    assert (code, err) == (0, "")
    assert out.splitlines()[0] == "ok"
    for text in seen:
        assert text in out


@pytest.mark.parametrize(
    ("words", "seen"),
    [
        (["nix.yaml"], ["nix.yaml", "no such file"]),
        (["ivu", "--reference", "stesp"], ["stesp", "did you mean 'references/steps'"]),
        (["ivu", "--set", "law.position.gian=3", "--set", "loop.rate=fast"], ["'gain'", "loop.rate=fast"]),
        (["ivu", "--set", "loop.rate=500 kg"], ["loop.rate", "Hz"]),
        (["ivu", "--set", "machine=idu"], ["idu"]),
        (["ivu", "--mode", "fats"], ["--mode fats", "lockstep"]),
        (["ivu", "--set", "name"], ["key=value"]),
    ],
)
def test_check_reports_every_mistake(rtctl, words, seen):
    code, out, err = rtctl("check", *words)
    assert (code, out) == (2, "")
    for text in seen:
        assert text in err


def test_check_names_file_and_line(rtctl, tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("name: mine\nmachine: ivy\n")
    code, _, err = rtctl("check", file)
    assert code == 2
    assert "mine.yaml:2: machine: 'ivy' is not one of ivu, ldu, axis; did you mean 'ivu'?" in err
    file.write_text("name: mine\n")
    assert "machine: missing" in rtctl("check", file).err


def test_contradictory_settings_are_refused(rtctl, tmp_path):
    file = tmp_path / "backwards.yaml"
    file.write_text("steps:\n  - {at: 2 s, to: 1 rad}\n  - {at: 1 s, to: 0 rad}\n")
    code, out, err = rtctl("check", "ivu", "--reference", file)
    assert (code, out) == (2, "")
    assert "step 2 at 1 s comes before" in err


ARM = """\
bodies:
  arm: {inertia: 0.03 kg*m^2, gravity: {mass: 1 kg, arm: 150 mm}}
sensors:
  encoder: {body: arm, column: x, resolution: 1 mrad, per_unit: -1}
physics:
  - {term: friction.coulomb, node: arm, F_C: 20 mNm}
problem: free
"""


def test_machine_description_without_a_config_is_checked(rtctl, tmp_path):
    file = tmp_path / "arm.yaml"
    file.write_text(ARM)
    code, out, err = rtctl("check", file, "--svg", tmp_path / "arm.svg")
    assert (code, err) == (0, "")
    for text in ("ok", "free", "1 kg at 150 mm", "one step is 1 mrad", "1.1", "friction.coulomb at arm"):
        assert text in out
    assert (tmp_path / "arm.svg").is_file()
    code, _, err = rtctl("check", file, "--mode", "fused")
    assert code == 2 and "--mode" in err and "goes with a config" in err


def test_mistake_in_a_machine_description_has_its_line(rtctl, tmp_path):
    file = tmp_path / "arm.yaml"
    file.write_text(ARM.replace("0.03 kg*m^2", "0.03 kg"))
    code, out, err = rtctl("check", file)
    assert (code, out) == (2, "") and "arm.yaml:2: " in err
