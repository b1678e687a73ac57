"""`rtctl diagnose` of the rows to fit, and a free run of its model from the common initial state."""

import tempfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from identification.records import Problem, rows_of
from rtctl.diagnose.answer.answer import GraphDiagnosis, diagnose
from rtctl.diagnose.answer.load import of_bundle
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.model.kernel import OPEN
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.simulate import Simulator
from rtctl.trace.bundle import PARQUET, save_case


def nominal(p: Problem) -> tuple[np.ndarray, dict[str, float]]:
    """Free run of the nominal model, with numbers fitted to the rows before, and these numbers."""
    found = refit(*together([of_bundle(rows_of(p.bundle, 0, p.first))]))
    return free(p, found.model), {}


def fit(p: Problem) -> tuple[np.ndarray, dict[str, float], str]:
    """Free run (n - first,) over the rows to predict, sizes, and the verdict with its names."""
    with tempfile.TemporaryDirectory() as folder:
        rows = rows_of(p.bundle, 0, p.first)
        pq.write_table(pa.table(rows.columns), Path(folder) / PARQUET)
        save_case(Path(folder), rows.case)
        found: GraphDiagnosis = diagnose(folder)
    names = ", ".join(f"{e.name}@{e.node}" for e in found.effects)
    sizes = {f"{e.name}@{e.node}.{k}": v.value for e in found.effects for k, v in e.parameters.items()}
    return free(p, found.predictor.model), sizes, f"{found.verdict}: {names}" if names else found.verdict


def free(p: Problem, model: GraphModel) -> np.ndarray:
    """Free run (n - first,) of a model from the smoothed state at the first row to predict."""
    late = of_bundle(rows_of(p.bundle, p.first, len(p.seen)))
    sim = Simulator(late)
    x, v = p.states[p.first]
    offset = float(p.seen[p.first] - sim.seen[0]) if not p.shows_speed else 0.0
    out = sim.beginning(float(x - offset), float(v)).run(model, OPEN)
    return np.asarray(out[:, sim.column(sim.main)] + offset)
