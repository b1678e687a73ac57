import math
import sys
from pathlib import Path

import pytest
import yaml

from rtctl.config.errors import UserError
from rtctl.config.load import load_settings
from rtctl.machines.axis import AxisConfig
from rtctl.machines.wiring import TERMINALS

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed")
sys.path.insert(0, str(Path(__file__).parent))
import carriage  # noqa: E402

from rtctl.plants.fmu import Fmu, FmuSettings, modelica, plan  # noqa: E402

CONFIGS = Path(__file__).parents[2] / "configs"
M, K, D = 95.1, 35.15, 203.5
AXIS = TERMINALS["axis"]


@pytest.fixture(scope="session")
def library(tmp_path_factory):
    built = carriage.library(tmp_path_factory.mktemp("carriage"))
    if built is None:
        pytest.skip("no C compiler (cc) here")
    return built


def given(file, **changes):
    return FmuSettings(**{"file": str(file), "inputs": {"drive": "u"}, "outputs": {"sensor": "x"}, **changes})


def position(t, mass=M):
    """Of the carriage t s after 1 V came on, m."""
    a = D / mass
    return K / D * (t - (1 - math.exp(-a * t)) / a)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("ticks", [1, 5])
def test_it_moves_as_its_equations_say_in_our_units(library, tmp_path, version, ticks):
    fmu = Fmu(given(carriage.pack(tmp_path / "c.fmu", library, version), ticks=ticks), *AXIS, 1e-3)
    assert fmu.readings == [0.0]
    for n in range(500):
        reading = fmu.tick([1.0])[0]
        assert reading == pytest.approx(position((n // ticks + 1) * ticks * 1e-3), rel=1e-9)
    fmu.close()


def test_parameters_are_set_before_it_starts(library, tmp_path):
    fmu = Fmu(given(carriage.pack(tmp_path / "c.fmu", library), parameters={"m": 10.0}), *AXIS, 0.5)
    assert fmu.tick([1.0])[0] == pytest.approx(position(0.5, 10.0), rel=1e-9)
    fmu.close()


def test_a_unit_that_the_fmu_does_not_say_is_taken_from_the_config(library, tmp_path):
    file = carriage.pack(tmp_path / "c.fmu", library)
    assert plan(given(file, outputs={"sensor": "bare"}, units={"bare": "um"}), *AXIS, 1e-3).outputs[0][1] == 1e6
    assert plan(given(file, outputs={"sensor": "bare"}), *AXIS, 1e-3).outputs[0][1] == 1.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"inputs": {"drive": "U"}}, r"inputs.drive: .* has no variable 'U'; did you mean 'u'"),
        ({"inputs": {"drve": "u"}}, r"the machine has no 'drve'; it has drive; did you mean 'drive'"),
        ({"inputs": {}}, r"inputs: 'drive' \(V\) is missing"),
        ({"inputs": {"drive": "x"}}, r"'x' of .* is of causality output; it takes input"),
        ({"outputs": {"sensor": "speed"}}, r"'speed' of .* is in 'mm/s', and it has to be a quantity in m"),
        ({"outputs": {"sensor": "count"}}, r"of type Integer; it has to be Real"),
        ({"units": {"x": "um"}}, r"says that 'x' is in mm, not um"),
        ({"units": {"y": "um"}}, r"units.y: .* has no variable 'y'"),
        ({"outputs": {"sensor": "bare"}, "units": {"bare": "kg"}}, r"'bare' .* has to be a quantity in m"),
        ({"parameters": {"mass": 1.0}}, r"parameters.mass: .* has no variable 'mass'"),
    ],
)
def test_a_wrong_map_is_one_message(tmp_path, changes, words):
    built = tmp_path / "nothing.so"
    built.write_bytes(b"")
    with pytest.raises(UserError, match=words) as error:
        plan(given(carriage.pack(tmp_path / "c.fmu", built), **changes), *AXIS, 1e-3)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"kind": "ModelExchange"}, "for model exchange only; export it for co-simulation"),
        ({"platform": "win64"}, "no library for linux64, only win64"),
        ({"version": 3, "inner": 3e-4}, r"plant.fmu.ticks: .* steps by 0.0003 s and 0.001 s is no multiple of it"),
    ],
)
def test_an_fmu_that_cannot_run_here_says_why(tmp_path, options, words):
    built = tmp_path / "nothing.so"
    built.write_bytes(b"")
    with pytest.raises(UserError, match=words):
        plan(given(carriage.pack(tmp_path / "c.fmu", built, **options)), *AXIS, 1e-3)


def test_what_is_no_fmu_is_refused(tmp_path):
    with pytest.raises(UserError, match="there is no such file"):
        plan(given(tmp_path / "missing.fmu"), *AXIS, 1e-3)
    (tmp_path / "text.fmu").write_text("not a zip")
    with pytest.raises(UserError, match="it is no FMU"):
        plan(given(tmp_path / "text.fmu"), *AXIS, 1e-3)


def test_a_library_that_does_not_load_is_refused_and_leaves_nothing_behind(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "unpacked"))
    (tmp_path / "unpacked").mkdir()
    built = tmp_path / "nothing.so"
    built.write_bytes(b"no library")
    with pytest.raises(UserError, match="it cannot be loaded"):
        Fmu(given(carriage.pack(tmp_path / "c.fmu", built)), *AXIS, 1e-3)
    assert not list((tmp_path / "unpacked").iterdir())


def test_a_start_value_that_it_refuses_is_said(library, tmp_path):
    with pytest.raises(UserError, match=r"it does not start \(fmi2ExitInitializationMode.*see its parameters"):
        Fmu(given(carriage.pack(tmp_path / "c.fmu", library), parameters={"m": -1.0}), *AXIS, 1e-3)


@pytest.mark.parametrize("version", [2, 3])
def test_a_step_that_fails_says_when(library, tmp_path, version):
    fmu = Fmu(given(carriage.pack(tmp_path / "c.fmu", library, version), parameters={"fail_at": 0.0025}), *AXIS, 1e-3)
    fmu.tick([0.0])
    fmu.tick([0.0])
    with pytest.raises(UserError, match=r"DoStep failed .* at 0.002 s of its time"):
        fmu.tick([0.0])
    fmu.close()


def test_numbers_that_are_none_end_the_run(library, tmp_path):
    fmu = Fmu(given(carriage.pack(tmp_path / "c.fmu", library)), *AXIS, 1e-3)
    with pytest.raises(UserError, match=r"outputs are \[nan\]"):
        fmu.tick([math.nan])
    fmu.close()


def test_units_are_spelt_as_modelica_does():
    assert [modelica(u) for u in ("N.m", "m/s2", "rad/s", "V")] == ["N*m", "m/s^2", "rad/s", "V"]


def test_a_file_is_looked_for_beside_the_config_first(tmp_path, monkeypatch):
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "carriage.fmu").touch()
    config = yaml.safe_load((CONFIGS / "axis.yaml").read_text())
    config["plant"] = {"fmu": {"file": "carriage.fmu", "inputs": {"drive": "u"}, "outputs": {"sensor": "x"}}}
    (tmp_path / "there" / "axis.yaml").write_text(yaml.safe_dump(config))
    monkeypatch.chdir(tmp_path)
    found = load_settings(tmp_path / "there" / "axis.yaml", AxisConfig, ["plant.fmu.ticks=2"])
    assert found.plant.fmu.file == str(tmp_path / "there" / "carriage.fmu")
    elsewhere = load_settings(tmp_path / "there" / "axis.yaml", AxisConfig, ["plant.fmu.file=other.fmu"])
    assert elsewhere.plant.fmu.file == "other.fmu"  # and what is not there is said by `plan`
