"""Manual page on user logs, run with logs of the fit simulation."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from manual_blocks import ROOT
from typer.testing import CliRunner

from rtctl.cli.main import app

sys.path.insert(0, str(Path(__file__).parents[1] / "diagnose" / "graph"))
from graph_cases import RUB, case_of, columns_of, command

from rtctl.config.yaml_file import Document
from rtctl.plants.graph.file import checked

TEXT = (ROOT / "docs" / "bring_your_own_machine.md").read_text().partition("## From a log to a report")[2]
DESCRIPTIONS = re.findall(r"```yaml\n(.*?)```", TEXT, re.S)
COMMANDS = [line for block in re.findall(r"```console\n(.*?)```", TEXT, re.S) for line in block.strip().splitlines()]
LOGS = {  # log -> description, its columns in the log, amplitude of the command, effects of the machine
    "swing": (0, ["time", "volts", "pos"], 4.0, []),
    "axis": (1, ["time", "volts", "motor", "carriage"], 0.6, [RUB]),
}


@pytest.mark.parametrize(
    ("log", "verdict"),
    [("swing", "Nothing is missing"), pytest.param("axis", "The carriage rubs", marks=pytest.mark.long)],
)
def test_documented_steps_lead_from_a_log_to_a_report(log, verdict, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    number, names, amplitude, terms = LOGS[log]
    name = ("pendulum", "belt")[number]
    Path(f"{name}.yaml").write_text(DESCRIPTIONS[number])
    machine = checked(yaml.safe_load(DESCRIPTIONS[number]), Document(None)).machine
    case = case_of(machine.model_dump(mode="json", exclude_unset=True), delay_samples=0.0)
    columns = columns_of(case, command(amplitude), terms)
    np.savetxt(f"{log}.csv", np.column_stack(list(columns.values())), "%.9g", ",", header=",".join(names), comments="")
    for line in [line for line in COMMANDS if line.endswith((f" -o {log}", f"diagnose {log}"))]:
        done = CliRunner().invoke(app, line.split()[1:])
        assert done.exit_code == 0, done.output
    assert verdict in done.output
    assert (Path(log) / "diagnosis" / "report.html").is_file()
