"""`rtctl soak`: exit codes, JSON, JUnit XML, and no progress output without a terminal."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

Rtctl = Callable[..., Any]


def test_short_soak_passes(rtctl: Rtctl, tmp_path: Path) -> None:
    out, xml = tmp_path / "out", tmp_path / "soak.xml"
    said = rtctl("soak", "ivu", "--hours", 0.01, "--seed", 2, "--out", out, "--junit", xml, "--json")
    assert said.code == 0 and said.err == ""
    found = json.loads(said.out)
    assert found["violations"] == 0 and found["seed"] == 2 and found["simulated_hours"] >= 0.01
    assert {"wall_s", "faults", "ticks", "invariants", "trips", "moves"} <= set(found)
    assert "<testsuite" in xml.read_text()
    more = rtctl("soak", "ivu", "--hours", 0.015, "--seed", 2, "--out", out, "--resume")
    assert more.code == 0 and "no violations" in more.out


def test_soak_with_user_law_and_user_plant(rtctl: Rtctl, tmp_path: Path) -> None:
    """Law and plant of `rtctl new`. The plant does not publish its speed, so this column is empty."""
    assert rtctl("new", "law", "pusher", "--for", "axis", "--into", tmp_path).code == 0
    assert rtctl("new", "plant", "slide", "--for", "axis", "--into", tmp_path).code == 0
    plant, config = tmp_path / "slide.py", tmp_path / "slide.yaml"
    plant.write_text(plant.read_text().replace("x=float, v=float", "x=float, w=float").replace("s.v", "s.w"))
    law = yaml.safe_load((tmp_path / "pusher.yaml").read_text())["law"]["position"]
    given = yaml.safe_load(config.read_text())
    given["law"]["position"] = law
    config.write_text(yaml.safe_dump(given, sort_keys=False))
    said = rtctl("soak", config, "--hours", 0.03, "--seed", 3, "--out", tmp_path / "out", "--json")
    assert said.code == 0, said.err
    found = json.loads(said.out)
    assert found["violations"] == 0 and found["moves"] > 10 and found["faults"]
    assert found["invariants"]["finite"] == found["ticks"]
    assert found["invariants"]["counters"] > 0.5 * found["ticks"]


def test_violations_are_exit_code_1(rtctl: Rtctl, tmp_path: Path) -> None:
    broken = "sensors.capstan.pulse_width=1 ms"
    said = rtctl("soak", "ivu", "--hours", 0.01, "--no-faults", "--set", broken, "--out", tmp_path / "out")
    assert said.code == 1 and "FAIL counters" in said.out and "see violation-01-counters" in said.out
    assert (tmp_path / "out" / "violation-01-counters" / "recording.parquet").is_file()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--hours", "0"), "--hours 0"),
        (("--hours", "nan"), "--hours nan"),
        (("--hours", "1", "--resume"), "--resume needs --out"),
        (("--hours", "1", "--mode", "fast"), "real, lockstep or fused"),
        (("--hours", "1", "--seed", "-1"), "seed"),
        ((), "--hours"),
    ],
)
def test_invalid_arguments_are_exit_code_2(rtctl: Rtctl, options: tuple[str, ...], words: str) -> None:
    said = rtctl("soak", "ivu", *options)
    assert said.code == 2 and words in said.err and said.err.count("\n") == 1


def test_folder_of_another_soak_is_refused(rtctl: Rtctl, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    said = rtctl("soak", "ivu", "--hours", 0.01, "--out", tmp_path / "file")
    assert said.code == 2 and "cannot be made" in said.err
    said = rtctl("soak", "ivu", "--hours", 0.01, "--out", tmp_path / "empty", "--resume")
    assert said.code == 2 and "nothing to resume" in said.err


def test_damaged_progress_file_is_exit_code_3(rtctl: Rtctl, tmp_path: Path) -> None:
    (tmp_path / "progress.npz").write_bytes(b"nothing")
    said = rtctl("soak", "ivu", "--hours", 0.01, "--out", tmp_path, "--resume")
    assert said.code == 3 and "cannot be read" in said.err
