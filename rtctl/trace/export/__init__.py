"""Export of a recording to the formats of other programs; one module for each format."""

import importlib
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa

from rtctl.config.errors import UserError, nearest
from rtctl.config.files import replaced_path
from rtctl.trace.export.source import ALL, Selection, Source

__all__ = ["ALL", "FORMATS", "Exported", "Format", "Selection", "export", "format_of"]


class Format(NamedTuple):
    """Export format: module, file suffix, programs that read it, and the package and extra it needs."""

    module: str
    suffix: str
    reader: str
    package: str = ""
    extra: str = ""


FORMATS = {
    "csv": Format("csv_file", ".csv", "spreadsheets, PlotJuggler"),
    "mat": Format("mat_file", ".mat", "MATLAB, Octave, scipy"),
    "parquet": Format("parquet_file", ".parquet", "pandas, DuckDB, Polars"),
    "mcap": Format("mcap_file", ".mcap", "Foxglove, PlotJuggler, Rerun", "mcap"),
    "mcap-json": Format("mcap_json_file", ".mcap", "readers of MCAP that know JSON alone", "mcap"),
    "rrd": Format("rrd_file", ".rrd", "Rerun", "rerun", "rerun"),
    "mf4": Format("mf4_file", ".mf4", "CANape, asammdf", "asammdf", "mf4"),
    "tdms": Format("tdms_file", ".tdms", "LabVIEW, DIAdem", "nptdms", "tdms"),
}


OWN = ("case.json", "orders.jsonl")  # files of a bundle beside its recording


class Exported(NamedTuple):
    path: Path
    to: str
    rows: int
    columns: tuple[str, ...]
    bytes: int


def format_of(name: str) -> Format:
    """The format of this name. Raises UserError."""
    if name not in FORMATS:
        near = nearest(name, FORMATS)
        raise UserError(
            f"no format '{name}'; " + (f"did you mean '{near}'?" if near else f"there is {', '.join(FORMATS)}")
        )
    return FORMATS[name]


def export(folder: Path | str, to: str, out: Path | str | None = None, selection: Selection = ALL) -> Exported:
    """Export the bundle in `folder` as format `to` (a name of FORMATS) to `out`, by default `trace.*` in the bundle.

    The file is written atomically. Raises UserError for an invalid bundle, selection or path, and where the package of
    the format is not installed.
    """
    form = format_of(to)
    writer = _writer(to, form)
    source = Source(folder, selection)
    path = Path(out) if out is not None else source.folder / f"trace{form.suffix}"
    if any(path.exists() and path.samefile(file) for file in source.paths):
        raise UserError(f"{path} is the recording itself; choose another name")
    if path.name in OWN and path.parent.resolve() == source.folder.resolve():
        raise UserError(f"{path} is a part of the bundle; choose another name")
    if not path.parent.is_dir():
        raise UserError(f"{path}: cannot be written (there is no folder {path.parent})")
    try:
        with replaced_path(path, form.suffix) as part:  # some packages check the suffix
            writer.write(source, part)
    except (pa.ArrowException, OSError) as error:
        why = getattr(error, "strerror", None) or str(error).splitlines()[0]
        raise UserError(f"{path}: cannot be written ({why})") from None
    return Exported(path, to, source.rows, tuple(column.name for column in source.columns), path.stat().st_size)


def _writer(to: str, form: Format) -> Any:
    """Module that writes the format."""
    try:
        return importlib.import_module(f"rtctl.trace.export.{form.module}")
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != form.package:
            raise
        wanted = f"rtctl[{form.extra}]" if form.extra else form.package
        raise UserError(f"--to {to} needs the package {form.package}: pip install '{wanted}'") from None
