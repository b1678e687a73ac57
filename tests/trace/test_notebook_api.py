"""API functions for notebooks: diagnosis, import, export, simulation, experiments, effect library."""

import json
import sys
import types

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import rtctl
from rtctl import api_diagnosis, api_progress
from rtctl.diagnose.evidence.diagnosis import Effect as Found
from rtctl.diagnose.evidence.diagnosis import Interval, LookAlike


class Answer:
    """Stub of a diagnosis of rtctl.diagnose.answer."""

    verdict, headline, seconds = "named", "The drive pushes <b>when</b> nothing is asked for.", 1.5
    located, experiment, heldout, cannot_test, parameters = None, None, None, ("tape.slack",), {}
    effects = (Found("drive.offset", "drive", 0.97, {"offset": Interval(0.8, 0.7, 0.9, "V")},
                     (LookAlike("friction.coulomb", "carriage", 0.02),)),)  # fmt: skip

    def as_json(self):
        return {"verdict": self.verdict, "nan": float("nan")}


@pytest.fixture
def answered(monkeypatch):
    """`rtctl.diagnose` with a stubbed search; returns the list of calls."""
    from rtctl.diagnose.answer import answer

    given = []

    def diagnose(*folders, progress):
        given.append(folders)
        progress("screening every hypothesis")
        return Answer()

    monkeypatch.setattr(answer, "diagnose", diagnose)
    return given


def test_callable_package_calls_its_function_and_stays_a_package():
    import rtctl.diagnose.answer.answer
    import rtctl.identify.friction

    assert isinstance(rtctl.diagnose, types.ModuleType) and callable(rtctl.diagnose)
    assert rtctl.diagnose.answer.answer.GraphDiagnosis and callable(rtctl.identify)


def test_diagnosis_as_text_table_and_plain_data(answered, tmp_path):
    heard = []
    found = rtctl.diagnose(tmp_path, progress=heard.append)
    assert answered == [(tmp_path,)] and heard == ["screening every hypothesis"]
    assert repr(found) == "<Diagnosis: named, drive.offset at drive (97 %)>"
    page = found._repr_html_()
    assert "drive.offset" in page and "offset = 0.8 (0.7 to 0.9) V" in page and "&lt;b&gt;when" in page
    assert found.as_json() == {"verdict": "named", "nan": None}
    frame = pytest.importorskip("pandas") and found.to_pandas()
    assert frame.iloc[0].to_dict() == {
        "effect": "drive.offset", "node": "drive", "confidence": 0.97, "parameter": "offset", "value": 0.8,
        "low": 0.7, "high": 0.9, "unit": "V",
    }  # fmt: skip


def test_report_is_shown_in_a_cell_and_saved(answered, tmp_path, monkeypatch):
    from rtctl.diagnose.answer import report

    monkeypatch.setattr(report, "html", lambda found: f"<p title='a'>{found.verdict}</p>")
    made = rtctl.diagnose(tmp_path, progress=False).report(tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text() == "<p title='a'>named</p>" == made.html
    assert "srcdoc='&lt;p title=&#x27;a&#x27;&gt;named&lt;/p&gt;'" in made._repr_html_()


def test_several_recordings_need_the_argument_together(answered, tmp_path):
    folders = [bundle(tmp_path / name) for name in "ab"]
    with pytest.raises(rtctl.UserError, match="the recordings do not name the same group"):
        rtctl.diagnose(*folders)
    rtctl.diagnose(*folders, together=True, progress=False)
    assert answered == [tuple(folders)]
    with pytest.raises(rtctl.UserError, match="needs a bundle"):
        rtctl.diagnose()


def test_deprecated_name_warns(answered, tmp_path):
    with pytest.warns(DeprecationWarning, match=r"rtctl.diagnose\(\) now and goes in version 0.2"):
        assert rtctl.diagnosis(tmp_path).verdict == "named"


def test_notebook_progress_bar_moves_and_is_cleared(monkeypatch):
    shown = []
    handle = types.SimpleNamespace(update=shown.append)
    display = types.SimpleNamespace(HTML=lambda text: text, display=lambda html, display_id: handle)
    monkeypatch.setattr(api_progress, "_notebook", lambda: display)
    with api_progress.stages(True) as stage:
        stage("screening every <hypothesis>")
        stage("predicting the held-out rows")
    assert "every &lt;hypothesis&gt;" in shown[0] and "<progress value='0." in shown[0]
    assert shown[-1] == ""


def test_script_without_a_terminal_shows_no_progress_bar(capsys, monkeypatch):
    monkeypatch.setattr(
        sys, "stderr", types.SimpleNamespace(isatty=lambda: False, write=lambda _: pytest.fail("a bar"))
    )
    with api_progress.stages(True) as stage:
        stage("anything")


def bundle(folder, rows=200):
    """A recording of an axis."""
    from rtctl.trace.bundle import save_case

    folder.mkdir()
    t = np.arange(rows) / 100
    pq.write_table(
        pa.table({"t": t, "u": np.sin(t), "x": np.cos(t), "ref": 0 * t, "w": 0 * t}), folder / "recording.parquet"
    )
    save_case(folder, {"format": 1, "plant": "axis", "sample_rate": 100.0})
    return folder


def test_recording_survives_export_and_import(tmp_path):
    made = rtctl.export(
        rtctl.load_bundle(bundle(tmp_path / "a")), "mcap", tmp_path / "a.mcap", columns=("u", "x"), end=1.0
    )
    assert (made.rows, made.columns) == (101, ("t", "u", "x"))
    with pytest.warns(UserWarning):  # the file has no unit of x
        back = rtctl.import_recording(
            made.path, tmp_path / "b", plant="axis", columns={"u": "u", "x": "x"}, units={"x": "mm"},
            case={"drive": {"newton_per_volt": 35.15}},
        )  # fmt: skip
    assert np.allclose(back["x"], np.cos(np.arange(101) / 100) / 1e3) and back.case["drive"]["newton_per_volt"] == 35.15


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: rtctl.import_recording("nowhere.csv", "b"), "nowhere.csv"),
        (lambda: rtctl.import_recording("a.csv", "b", rate="fast"), "rate"),
        (lambda: rtctl.export("nowhere", "mcap"), "not a folder"),
        (lambda: rtctl.simulate("case", "nowhere"), "not a folder"),
        (lambda: rtctl.physics("drive.ofset"), "did you mean 'drive.offset'"),
        (lambda: rtctl.identify("friktion", "ldu"), "did you mean 'friction'"),
        (lambda: rtctl.identify("friction"), "needs bundles, or one config"),
    ],
)
def test_invalid_arguments_give_one_message(tmp_path, monkeypatch, call, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(rtctl.UserError, match=words):
        call()


def test_physics_lists_the_library_of_effects():
    library = rtctl.physics()
    assert "drive.offset" in library and "friction.stribeck" in library._repr_html_()
    one = rtctl.physics("friction.stribeck")
    assert "F_s" in one.parameters and "friction.presliding" in one.look_alikes and one.check and one.equation


def test_nominal_model_is_simulated(tmp_path):
    folder = bundle(tmp_path / "a", 600)
    case = json.loads((folder / "case.json").read_text())
    case |= {
        "parameters": {"M": 95.1, "F_v": 203.5, "F_c": 20.4},
        "drive": {"newton_per_volt": 35.15, "limit_volt": 10.0},
        "controller": {"kind": "unknown"}, "controller_known": False, "sensors": {"x_resolution_m": 1e-6},
    }  # fmt: skip
    (folder / "case.json").write_text(json.dumps(case))
    made = rtctl.simulate("case", folder)
    assert not made.closed and made.rmse["x"] > 0 and made.units["x"] == "m"
    assert made.recorded["x"].shape == made.simulated["x"].shape == made.t.shape
    assert repr(made).startswith("<Simulation, open loop: x rmse")
    assert len(made.plot().axes) == 2
    assert list(pytest.importorskip("pandas") and made.to_pandas().columns) == ["x", "x_simulated"]


def test_diagnosis_has_a_public_class():
    assert api_diagnosis.Diagnosis is rtctl.Diagnosis
