import math
import sys
import zipfile
from pathlib import Path

import pytest
import yaml

from rtctl.config.errors import UserError
from rtctl.config.load import load_settings
from rtctl.machines.axis import AxisConfig
from rtctl.machines.wiring import TERMINALS
from rtctl.plants import fmu_file

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
    """Position of the carriage (m), t seconds after a step of 1 V."""
    a = D / mass
    return K / D * (t - (1 - math.exp(-a * t)) / a)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("ticks", [1, 5])
def test_fmu_carriage_moves_by_its_equations_in_si_units(library, tmp_path, version, ticks):
    fmu = Fmu(given(carriage.pack(tmp_path / "c.fmu", library, version), ticks=ticks), *AXIS, 1e-3)
    assert fmu.readings == [0.0]
    for n in range(500):
        reading = fmu.tick([1.0])[0]
        assert reading == pytest.approx(position((n // ticks + 1) * ticks * 1e-3), rel=1e-9)
    fmu.close()


def test_parameters_are_set_before_initialisation(library, tmp_path):
    fmu = Fmu(given(carriage.pack(tmp_path / "c.fmu", library), parameters={"m": 10.0}), *AXIS, 0.5)
    assert fmu.tick([1.0])[0] == pytest.approx(position(0.5, 10.0), rel=1e-9)
    fmu.close()


def test_missing_unit_of_an_fmu_variable_comes_from_the_config(library, tmp_path):
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
def test_wrong_variable_map_gives_a_one_line_message(tmp_path, changes, words):
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
        ({"platform": "x86_64-windows", "version": 3}, "no library for x86_64-linux, only x86_64-windows"),
        ({"platform": "darwin64"}, "no library for linux64, only darwin64"),
        ({"version": 3, "inner": 3e-4}, r"plant.fmu.ticks: .* steps by 0.0003 s and 0.001 s is no multiple of it"),
    ],
)
def test_fmu_that_cannot_run_here_is_refused_with_the_reason(tmp_path, options, words):
    built = tmp_path / "nothing.so"
    built.write_bytes(b"")
    with pytest.raises(UserError, match=words):
        plan(given(carriage.pack(tmp_path / "c.fmu", built, **options)), *AXIS, 1e-3)


def test_missing_file_and_file_without_an_fmu_are_refused(tmp_path):
    with pytest.raises(UserError, match="there is no such file"):
        plan(given(tmp_path / "missing.fmu"), *AXIS, 1e-3)
    (tmp_path / "text.fmu").write_text("not a zip")
    with pytest.raises(UserError, match="it is no FMU"):
        plan(given(tmp_path / "text.fmu"), *AXIS, 1e-3)


def packed(path, names, description=None):
    """Archive with modelDescription.xml and the files `names`, {name: content}."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("modelDescription.xml", carriage.description(2) if description is None else description)
        for name, content in names.items():
            file.writestr(name, content)
    return path


LINUX = {"binaries/linux64/carriage.so": b""}
LINK = zipfile.ZipInfo("resources/link")
LINK.external_attr = 0o120777 << 16


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ({"sources/carriage.c": b""}, "no library for linux64, only C sources; compile them into it"),
        ({"binaries/linux64/other.so": b""}, "binaries/linux64 holds other.so, not carriage.so"),
        ({"../../evil": b"", **LINUX}, "the path '../../evil', which leads out of its folder; nothing is unpacked"),
        ({"/etc/evil": b"", **LINUX}, "the path '/etc/evil', which leads out"),
        ({LINK: b"/etc/passwd", **LINUX}, "the link 'resources/link'; an FMU holds plain files"),
    ],
)
def test_archive_is_checked_before_unpacking(tmp_path, names, words):
    with pytest.raises(UserError, match=words):
        plan(given(packed(tmp_path / "c.fmu", names)), *AXIS, 1e-3)


def test_archive_above_the_unpacked_size_limit_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(fmu_file, "UNPACKED_LIMIT", 1 << 20)
    path = packed(tmp_path / "c.fmu", {"resources/zeros": bytes(2 << 20), **LINUX})
    with pytest.raises(UserError, match=r"its files are .* GiB when unpacked"):
        plan(given(path), *AXIS, 1e-3)


def test_archive_with_a_damaged_or_encrypted_file_is_refused(tmp_path):
    path = packed(tmp_path / "c.fmu", LINUX)
    whole = path.read_bytes()
    at = whole.index(b"<?xml") if b"<?xml" in whole else 60
    path.write_bytes(whole[:at] + b"\xff" * 20 + whole[at + 20 :])
    with pytest.raises(UserError, match=r"the file is damaged .*; export it again|is not valid"):
        plan(given(path), *AXIS, 1e-3)
    locked = bytearray(whole)
    directory = whole.index(b"PK\x01\x02")
    locked[directory + 8] |= 1
    path.write_bytes(locked)
    with pytest.raises(UserError, match=r"modelDescription.xml in it is encrypted; export it without a password"):
        plan(given(path), *AXIS, 1e-3)


@pytest.mark.parametrize("missing", ["fmi2DoStep", "fmi3GetFloat64"])
def test_missing_function_of_the_library_is_named(library, tmp_path, missing):
    built = carriage.library(tmp_path, without=missing)
    with pytest.raises(UserError, match=f"its library lacks {missing}; export it again for co-simulation"):
        Fmu(given(carriage.pack(tmp_path / "c.fmu", built, int(missing[3]))), *AXIS, 1e-3)


def test_library_that_does_not_load_is_refused_and_its_files_are_removed(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "unpacked"))
    (tmp_path / "unpacked").mkdir()
    built = tmp_path / "nothing.so"
    built.write_bytes(b"no library")
    with pytest.raises(UserError, match="it cannot be loaded"):
        Fmu(given(carriage.pack(tmp_path / "c.fmu", built)), *AXIS, 1e-3)
    assert not list((tmp_path / "unpacked").iterdir())


def test_start_value_refused_by_the_fmu_is_reported(library, tmp_path):
    with pytest.raises(UserError, match=r"it does not start \(fmi2ExitInitializationMode.*see its parameters"):
        Fmu(given(carriage.pack(tmp_path / "c.fmu", library), parameters={"m": -1.0}), *AXIS, 1e-3)


@pytest.mark.parametrize("version", [2, 3])
def test_failed_step_is_reported_with_its_time(library, tmp_path, version):
    fmu = Fmu(given(carriage.pack(tmp_path / "c.fmu", library, version), parameters={"fail_at": 0.0025}), *AXIS, 1e-3)
    fmu.tick([0.0])
    fmu.tick([0.0])
    with pytest.raises(UserError, match=r"DoStep failed .* at 0.002 s of its time"):
        fmu.tick([0.0])
    fmu.close()


def test_nan_output_ends_the_run(library, tmp_path):
    fmu = Fmu(given(carriage.pack(tmp_path / "c.fmu", library)), *AXIS, 1e-3)
    with pytest.raises(UserError, match=r"outputs are \[nan\]"):
        fmu.tick([math.nan])
    fmu.close()


def test_modelica_units_are_translated():
    assert [modelica(u) for u in ("N.m", "m/s2", "rad/s", "V")] == ["N*m", "m/s^2", "rad/s", "V"]


def test_fmu_path_is_resolved_beside_the_config_first(tmp_path, monkeypatch):
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "carriage.fmu").touch()
    config = yaml.safe_load((CONFIGS / "axis.yaml").read_text())
    config["plant"] = {"fmu": {"file": "carriage.fmu", "inputs": {"drive": "u"}, "outputs": {"sensor": "x"}}}
    (tmp_path / "there" / "axis.yaml").write_text(yaml.safe_dump(config))
    monkeypatch.chdir(tmp_path)
    found = load_settings(tmp_path / "there" / "axis.yaml", AxisConfig, ["plant.fmu.ticks=2"])
    assert found.plant.fmu.file == str(tmp_path / "there" / "carriage.fmu")
    elsewhere = load_settings(tmp_path / "there" / "axis.yaml", AxisConfig, ["plant.fmu.file=other.fmu"])
    assert elsewhere.plant.fmu.file == "other.fmu"  # `plan` reports a missing file
