"""NPZ: every array is a column; the entries of an array with more axes are columns of their own."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .errors import Problem, did_you_mean, reading
from .tables import Array, ArrayTable


class NpzTable(ArrayTable):
    """Arrays of an NPZ file. Entries of an array ``points`` are ``points_0``, ``points_1``, … row by row;
    of complex numbers ``points_0_re``, ``points_0_im``, …"""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._groups: dict[str, list[str]] = {}
        self._columns: dict[str, Array] = {}
        for key, array in _arrays(path).items():
            if array.ndim and array.dtype.kind in "biufcMU":
                columns = _split(key, array)
                self._groups[key] = list(columns)
                self._columns.update(columns)
        self.names = list(self._columns)
        self.numeric = [name for name, column in self._columns.items() if column.dtype.kind in "biuf"]

    def expand(self, name: str) -> list[str]:
        return self._groups.get(name) or super().expand(name)

    def require(self, name: str) -> str:
        if name not in self.names:
            raise Problem(f"{self.path} has no array {name!r}; {did_you_mean(name, list(self._groups))}")
        return name

    def points(self, others: Sequence[str | None]) -> list[str]:
        return self._groups.get("points") or super().points(others)

    def _column(self, name: str) -> Array:
        return self._columns[name]


def _arrays(path: Path) -> dict[str, Array]:
    with reading(path):
        if not zipfile.is_zipfile(path):
            path.open("rb").close()
            raise Problem(f"{path} is not an NPZ file")
        try:
            with np.load(path, allow_pickle=False) as archive:
                arrays = {key: archive[key] for key in archive.files}
        except (zipfile.BadZipFile, ValueError, EOFError) as error:
            raise Problem(f"{path} is damaged, or holds objects instead of numbers: {error}") from None
    if "format" in arrays:
        raise Problem(f"{path} is a fitted curve, not a table")
    return arrays


def _split(key: str, array: Array) -> dict[str, Array]:
    """The columns of an array."""
    rows = array.reshape(len(array), -1)
    names = [key] if array.ndim == 1 else [f"{key}_{i}" for i in range(rows.shape[1])]
    if array.dtype.kind != "c":
        return dict(zip(names, rows.T, strict=True))
    parts = [(f"{name}{end}", part) for name, column in zip(names, rows.T, strict=True)
             for end, part in (("_re", column.real), ("_im", column.imag))]
    return dict(parts)
