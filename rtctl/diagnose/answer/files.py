"""Files of a diagnosis: verdict, model, separating experiment, torque over the turn, report."""

import json
from pathlib import Path
from typing import Any

from rtctl.config.errors import UserError
from rtctl.config.failures import told
from rtctl.config.files import write_text
from rtctl.diagnose.answer import config, played, repair
from rtctl.diagnose.answer import format1_config as export
from rtctl.diagnose.answer.answer import GraphDiagnosis
from rtctl.diagnose.answer.played_law import played_law
from rtctl.diagnose.answer.results import EXPERIMENT, MODEL, REPORT, RESULT, TURN, finite, fresh, put
from rtctl.diagnose.answer.torque_ripple_map import over_turn
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED
from rtctl.diagnose.model.format1 import known_model
from rtctl.diagnose.model.model import GraphModel, nominal
from rtctl.trace.bundle import load_case


def write(d: GraphDiagnosis, folder: Path, report: bool = True, base: Path | None = None) -> list[str]:
    """Sentences on the files, except diagnosis.json, that could not be made; all others are written into `folder`.

    Each file is written whole or not at all. Where `base` is given, no link may lead out of `base`. The verdict is
    valid without the missing files. Raises UserError where the disk does not take the files.
    """
    faults: list[str] = []
    fresh(folder, base)
    try:
        put(folder / MODEL, lambda path: write_model(d, path))
    except UserError as error:
        faults.append(f"{folder / MODEL} is not written: {error}")
    if d.experiment is not None:
        try:
            plan = experiment_yaml(d)
            put(folder / EXPERIMENT, lambda path: write_text(path, plan))
        except UserError as error:
            faults.append(f"{folder / EXPERIMENT} is not written: {error}")
    source = d.record.source
    if source is not None:
        turn = over_turn(source, known_model(after(d), d.record))
        if turn is not None:
            put(folder / TURN, lambda path: export.write_turn(turn, path))
    if report:
        try:
            from rtctl.diagnose.answer import report as page

            text = page.html(d)
            put(folder / REPORT, lambda path: write_text(path, text))
        except UserError:
            raise
        except Exception as error:  # the verdict is written even if a figure fails
            faults.append(f"the report is not written: {told(error)[1]}")
    put(folder / RESULT, lambda path: write_text(path, json.dumps(finite(d.as_json()), indent=1) + "\n"))
    return faults


def after(d: GraphDiagnosis) -> GraphModel:
    """Predictor of a diagnosis; the nominal model where nothing is named: a fit without the effect would be biased."""
    return d.predictor.model if d.verdict in (NAMED, AMBIGUOUS) else nominal(d.record.case)


def write_model(d: GraphDiagnosis, path: Path) -> Path:
    """Path of the fitted model, written as config: of exchange format 1 by its parameters, else by a description.

    Raises UserError where the machine could not be read again, or the file cannot be written.
    """
    record, model = d.record, d.predictor.model
    if record.source is not None:
        return export.write_model(known_model(model, record), record.source, path, own_config(d))
    return config.write_model(model, record, path, own_config(d))


def experiment_yaml(d: GraphDiagnosis) -> str:
    """Separating experiment as the text of a config for `rtctl run`. Raises UserError where it cannot be made."""
    assert d.experiment is not None
    record, own = d.record, own_config(d)
    if own is not None:
        data = own
    elif record.source is not None:
        data = export.to_config(known_model(nominal(record.case), record), record.source)
    else:
        data = {**config.to_config(nominal(record.case), record), "law": played_law(record)}
    names = [r.replace(" + ", " with ") for r in d.experiment["why"]["rivals"]]
    return played.text(data, d.experiment, names, record.dt * len(record.t), own is not None)


def own_config(d: GraphDiagnosis) -> dict[str, Any] | None:
    """Config in case.json of a recording by rtctl; None of any other recording."""
    if d.record.source is None:
        return d.record.case.config
    case = load_case(d.record.case.file.parent)
    own = case.get("config")
    return own if isinstance(own, dict) and own.get("machine") == case.get("plant") else None


def changes(d: GraphDiagnosis) -> list[tuple[str, str, str]]:
    """Rows (key, nominal value, new value) of the keys of the config that the model changes, the terms last."""
    record, model = d.record, d.predictor.model
    if record.source is not None:
        return repair.between(known_model(nominal(record.case), record), known_model(model, record))
    rows = [
        (f"machine.{path}", f"{was:.4g} {unit}".rstrip(), f"{value:.4g} {unit}".rstrip())
        for path, was, value, unit in config.changed(model, record)
    ]
    return rows + played.terms(model.resolved().terms, model.known())
