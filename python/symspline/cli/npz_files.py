"""NPZ: arrays with one entry a row; the entries of an array with more axes are columns of their own."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Sequence
from pathlib import Path

from .._core import ValidationError
from ..archive import read
from ..arrays import brief
from .errors import Problem, did_you_mean, reading
from .layout import IM, RE
from .tables import Array, ArrayTable
from .times import is_date_like


class NpzTable(ArrayTable):
    """The arrays of an NPZ file. The entries of an array ``a`` are the columns ``a_0``, ``a_1``, … row by
    row; those of complex numbers ``a_0_re``, ``a_0_im``, …"""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._groups = {
            key: _split(key, array)
            for key, array in _arrays(path).items()
            if array.ndim and array.dtype.kind in "biufcMmSU"
        }
        self._columns = {name: column for group in self._groups.values() for name, column in group.items()}
        self.names = list(self._columns)
        self.numeric = [name for name, column in self._columns.items() if column.dtype.kind in "biuf"]
        self.dates = [name for name, column in self._columns.items() if _holds_dates(column)]

    def require(self, name: str) -> str:
        if name not in self.names:
            raise Problem(f"{self.path} has no array {name!r}; {did_you_mean(name, list(self._groups))}")
        return name

    def expand(self, name: str) -> list[str]:
        return list(self._groups[name]) if name in self._groups else super().expand(name)

    def points(self, others: Sequence[str | None]) -> list[str]:
        return self.expand("points") if "points" in self._groups else super().points(others)

    def _column(self, name: str) -> Array:
        return self._columns[name]


def _arrays(path: Path) -> dict[str, Array]:
    with reading(path), open(path, "rb") as file:
        if not zipfile.is_zipfile(file):
            raise Problem(f"{path} is not an NPZ file")
        file.seek(0)
        try:
            arrays = read(file, lambda name: True)
        except (OSError, MemoryError):
            raise
        except ValidationError as error:
            raise Problem(f"{path}: {error}") from None
        except Exception as error:
            # Damage shows as errors of zipfile, of its decompressors and of NumPy.
            raise Problem(f"{path} is damaged, or holds other things than numbers: {brief(error)}") from None
    if "format" in arrays:
        raise Problem(f"{path} is a curve that was fitted already, not a table")
    return arrays


def _holds_dates(column: Array) -> bool:
    return column.dtype.kind in "Mm" or (
        column.dtype.kind == "U" and len(column) > 0 and is_date_like(str(column[0]))
    )


def _split(key: str, array: Array) -> dict[str, Array]:
    """The columns of an array."""
    entries = array.reshape(len(array), math.prod(array.shape[1:])).T
    names = [key] if array.ndim == 1 else [f"{key}_{i}" for i in range(len(entries))]
    if array.dtype.kind != "c":
        return dict(zip(names, entries, strict=True))
    columns = {}
    for name, entry in zip(names, entries, strict=True):
        columns[name + RE], columns[name + IM] = entry.real, entry.imag
    return columns
