"""numpy's archive: an array for each column, or a matrix whose columns are `name.1`, `name.2`."""

import zipfile
from pathlib import Path

import numpy as np

from rtctl.config.errors import UserError
from rtctl.trace.imports.table import Table, flat


def read(path: Path) -> Table:
    """The columns of an archive. Nothing in it is ever run. Raises UserError, OSError."""
    if path.is_file() and not zipfile.is_zipfile(path):  # numpy would speak of pickles instead
        raise UserError(f"{path} cannot be read as npz: it is no archive of arrays; np.savez makes one")
    try:
        with np.load(path, allow_pickle=False) as found:
            return Table(path, dict(flat({name: found[name] for name in found.files})), {})
    except OSError:
        raise
    except Exception as error:  # whatever a damaged file makes of the reader
        raise UserError(f"{path} cannot be read as npz: {error}") from None
