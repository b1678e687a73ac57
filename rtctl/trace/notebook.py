"""Bundle in a notebook: text, table, conversion to pandas, xarray and Arrow, and a figure of its columns."""

import io
from collections.abc import Sequence
from functools import partial
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from rtctl.config.errors import UserError, nearest

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rtctl.trace.bundle import Bundle

ROWS = 40  # most columns in the table of a bundle


def column(bundle: "Bundle", name: str) -> np.ndarray:
    """Column (n,). Raises UserError where no column has this name."""
    if name not in bundle.columns:
        hint = nearest(name, bundle.columns)
        raise UserError(f"{bundle.folder} has no column '{name}'" + (f"; did you mean '{hint}'?" if hint else ""))
    return bundle.columns[name]


def words(bundle: "Bundle") -> str:
    """Summary of a bundle in one line."""
    t = bundle.columns["t"]
    machine = machine_of(bundle)
    return f"<Bundle {bundle.folder}: {machine}{len(t)} rows, {seconds(t)}, {len(bundle.columns)} columns>"


def machine_of(bundle: "Bundle") -> str:
    """Name of the machine and a comma; "" where the case has no name."""
    config = bundle.case.get("config")
    name = (config.get("name") if isinstance(config, dict) else None) or bundle.case.get("plant")
    return f"{name}, " if name else ""


def seconds(t: np.ndarray) -> str:
    """Duration in s and rate in Hz, as text."""
    if len(t) < 2 or t[-1] <= t[0]:
        return "one row" if len(t) < 2 else "no time passes"
    return f"{t[-1] - t[0]:.4g} s at {(len(t) - 1) / (t[-1] - t[0]):.4g} Hz"


def html(bundle: "Bundle") -> str:
    """HTML table of the columns: unit, least, mean and greatest value."""
    rows = []
    for name, values in list(bundle.columns.items())[:ROWS]:
        finite = values[np.isfinite(values)] if values.dtype.kind == "f" else values
        found = (finite.min(), finite.mean(), finite.max()) if len(finite) else ()
        cells = "".join(f"<td style='text-align:right'>{v:.5g}</td>" for v in found) or "<td colspan=3>no number</td>"
        rows.append(f"<tr><th>{escape(name)}</th><td>{escape(bundle.units.get(name, ''))}</td>{cells}</tr>")
    more = len(bundle.columns) - ROWS
    rest = f"<p>and {more} more columns</p>" if more > 0 else ""
    head = "".join(f"<th>{word}</th>" for word in ("column", "unit", "least", "mean", "greatest"))
    line = escape(words(bundle).strip("<>"))
    return f"<p>{line}</p><table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>{rest}"


def arrow(bundle: "Bundle") -> pa.Table:
    """Arrow table of the columns, with units in the metadata of the fields."""
    fields = [
        pa.field(name, pa.from_numpy_dtype(values.dtype), metadata={"unit": bundle.units.get(name, "")})
        for name, values in bundle.columns.items()
    ]
    return pa.table(list(bundle.columns.values()), schema=pa.schema(fields))


def to_pandas(bundle: "Bundle") -> Any:
    """DataFrame indexed by time in s, with the units in `attrs`. Raises UserError without pandas."""
    frame = extra("pandas").DataFrame(bundle.columns).set_index("t")
    frame.attrs = {"units": dict(bundle.units), "folder": str(bundle.folder)}
    return frame


def to_xarray(bundle: "Bundle") -> Any:
    """Dataset along time in s, each variable with its unit. Raises UserError without xarray."""
    xarray = extra("xarray")
    units = bundle.units
    values = {name: ("t", v, {"units": units.get(name, "")}) for name, v in bundle.columns.items() if name != "t"}
    time = ("t", bundle.columns["t"], {"units": units.get("t", "s")})
    return xarray.Dataset(values, {"t": time}, {"folder": str(bundle.folder)})


def extra(name: str) -> Any:
    """Module of an optional dependency. Raises UserError where it is not installed."""
    try:
        return import_module(name)
    except ImportError as error:
        raise UserError(f"this needs the package {name}: pip install 'rtctl[notebook]'") from error


def plot(bundle: "Bundle", columns: Sequence[str]) -> "Figure":
    """Figure of `columns` over time, one panel for each unit; of all known columns where none is named.

    Raises UserError for a missing column, ValueError where no column is known.
    """
    from rtctl.trace.plot import figure_of, figure_of_columns

    if not columns:
        return in_cell(figure_of(bundle, ()))
    for name in columns:
        column(bundle, name)
    return in_cell(figure_of_columns(bundle, columns))


def in_cell(figure: "Figure") -> "Figure":
    """Figure that a notebook cell also displays without pyplot."""
    figure._repr_png_ = partial(png, figure)  # type: ignore[attr-defined]  # IPython's hook for PNG
    return figure


def png(figure: "Figure") -> bytes:
    """PNG bytes of a figure."""
    file = io.BytesIO()
    figure.savefig(file, format="png", bbox_inches="tight")
    return file.getvalue()
