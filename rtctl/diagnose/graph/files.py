"""Files of a diagnosis of a described machine: diagnosis.json, model.yaml, report.html."""

import json
from pathlib import Path
from typing import Any

from rtctl.config.errors import UserError
from rtctl.config.failures import told
from rtctl.config.files import write_text
from rtctl.diagnose.graph.answer import GraphDiagnosis
from rtctl.diagnose.graph.config import write_model
from rtctl.diagnose.results import MODEL, REPORT, RESULT, finite, fresh, put
from rtctl.trace.bundle import load_case


def write(d: GraphDiagnosis, folder: Path, report: bool = True, base: Path | None = None) -> list[str]:
    """Write the files into `folder`; each is there whole or not at all.

    Where `base` is given, no link may lead out of it. Returns a sentence on each file but diagnosis.json that could not
    be made: the verdict stands without them. Raises UserError where the disk does not take them.
    """
    faults: list[str] = []
    fresh(folder, base)
    try:
        put(folder / MODEL, lambda path: write_model(d.decided.best.model, d.record, path, own_config(d)))
    except UserError as error:
        faults.append(f"{folder / MODEL} is not written: {error}")
    if report:
        try:
            from rtctl.diagnose.graph import report as page

            text = page.html(d)
            put(folder / REPORT, lambda path: write_text(path, text))
        except UserError:
            raise
        except Exception as error:  # a figure that fails must not take the verdict with it
            faults.append(f"the report is not written: {told(error)[1]}")
    put(folder / RESULT, lambda path: write_text(path, json.dumps(finite(d.as_json()), indent=1) + "\n"))
    return faults


def own_config(d: GraphDiagnosis) -> dict[str, Any] | None:
    """The config in case.json of a recording that our own daemon made; None of any other."""
    config = load_case(d.record.case.file.parent).get("config")
    return config if isinstance(config, dict) and isinstance(config.get("machine"), dict) else None
