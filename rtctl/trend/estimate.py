"""Estimates of one piece: parameters and known terms fitted under the tracking observer, with 90 % intervals.

Every fit starts from the nominal values, so that an estimate depends on its piece alone: it is bit-identical on every
machine and in every order of the pieces.
"""

import math
import warnings
from contextvars import copy_context
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from rtctl.case.start import is_start
from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.failures import told
from rtctl.diagnose.answer.intervals import parameters
from rtctl.diagnose.answer.load import of_bundle
from rtctl.diagnose.likelihood import solver
from rtctl.diagnose.likelihood.fits import Fitted, prior, refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.likelihood.widths import Z90, half_widths
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.trend.pieces import Piece, read

PARAMETER, RESIDUAL = "parameter", "residual"

Row = dict[str, Any]


def estimates(pieces: list[Piece]) -> list[list[Row]]:
    """Rows of the trend of each piece, computed by one thread: one task of a worker."""
    return copy_context().run(_by_one_thread, pieces)


def _by_one_thread(pieces: list[Piece]) -> list[list[Row]]:
    solver.THREADS.set(1)
    with threadpool_limits(1), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a model that diverges overflows; its residual shows it
        return [estimate(piece) for piece in pieces]


def estimate(piece: Piece) -> list[Row]:
    """Rows of one piece, one for each number and each sensor; one row with `error` where the fit fails."""
    head = {
        "machine": piece.machine, "folder": piece.folder, "first_row": piece.first, "begin_s": piece.begin,
        "seconds": piece.seconds, "at": piece.at if math.isfinite(piece.at) else None, "stamp": piece.stamp,
    }  # fmt: skip
    try:
        record = of_bundle(read(piece))
        fitted = refit(*together([record]))
        return [{**head, **row} for row in (*_parameters(fitted, record), *_residuals(fitted))]
    except (UserError, NoAnswer) as error:
        return [{**head, "error": " ".join(str(error).split())}]
    except Exception as error:  # one bad recording must not end the others
        return [{**head, "error": told(error)[1]}]


def _parameters(f: Fitted, record: GraphRecord) -> list[Row]:
    """Rows of the description's numbers and of those of the known terms."""
    case, out = record.case, []
    found, nominal = parameters(f, record), f.space.owner.base
    narrowed = half_widths(f) * np.sqrt(prior(f.space)) / Z90  # spread of the posterior over that of the prior
    for i, path in enumerate(f.space.names):
        if is_start(path):
            continue
        name = case.called.get(path, path)
        value = found[name]
        out.append(
            {
                "kind": PARAMETER, "name": name, "value": value.value, "low": value.low, "high": value.high,
                "unit": value.unit, "nominal": nominal[path], "own": path in case.per_recording,
                "told": float(np.clip(1.0 - narrowed[i] ** 2, 0.0, 1.0)),
            }
        )  # fmt: skip
    return out


def _residuals(f: Fitted) -> list[Row]:
    """Rms residual of each sensor under the fitted description, SI; a new missing effect raises it."""
    rms = np.sqrt(np.mean(f.e**2, axis=0))
    least = f.like.least
    out = []
    for name, value, floor in zip(f.like.sim.channels, rms, least, strict=True):
        size = float(math.hypot(value, floor))  # residuals below the counting noise are not distinguished from zero
        out.append({"kind": RESIDUAL, "name": name, "value": size, "low": size, "high": size, "unit": "",
                    "nominal": float(floor), "own": False, "told": 1.0})  # fmt: skip
    return out
