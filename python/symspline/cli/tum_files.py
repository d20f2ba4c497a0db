"""Trajectories as the TUM RGB-D benchmark writes them: lines of time, place and quaternion, its scalar last.

Source: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..pose_files import TUM, tum_rows
from ..spaces import space as space_named
from .curves import Curves
from .errors import Problem, reading
from .progress import Progress
from .quaternions import places_of
from .tables import Array, Rows, Table

ENDINGS = (".tum", ".txt")
_NAMES = list(TUM)
_POSE = _NAMES[1:]
_SPACES = [space_named(name) for name in ("se:3", "so:3 x r:3", "r:3 x so:3")]


class TumTable(Table):
    """A TUM trajectory. Lines that begin with # are comments."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.names, self.numeric, self.dates = _NAMES, _NAMES, []
        with reading(path):
            self._rows, self._place = tum_rows(path)

    def read(self, numbers: Sequence[str], time: str | None, label: str | None, progress: Progress) -> Rows:
        def column(name: str) -> Array:
            return self._rows[:, _NAMES.index(name)]

        times = np.empty(0) if time is None else column(time)
        labels = None if label is None else [str(x) for x in column(label)]
        return Rows(
            self._rows[:, [_NAMES.index(name) for name in numbers]], times, False, labels, self._place
        )


def as_tum(curves: Curves, orders: list[int]) -> Curves:
    """The curves with the columns of a TUM trajectory.

    Raises:
        Problem: they are no trajectories of poses, or more than one.
    """
    space = next(iter(curves.splines.values())).space
    if space not in _SPACES:
        raise Problem(
            f"a TUM trajectory has poses, points of {' or of '.join(map(str, _SPACES))}, not of {space}"
        )
    if curves.named:
        raise Problem("a TUM trajectory is one curve; write several to a .csv, .npz or .parquet file")
    if orders != [0]:
        raise Problem(
            "a TUM trajectory has poses and no derivatives; write those to a .csv, .npz or .parquet file"
        )
    # The names alone say where place and quaternion stand.
    columns = replace(curves.columns, points=_POSE, time="time", quaternion=places_of(_POSE, space, None))
    return replace(curves, columns=columns)


def write_tum(file: BinaryIO, columns: Mapping[str, Array]) -> None:
    """Write poses; dates become seconds since 1970."""
    time, *pose = (columns[name] for name in _NAMES)
    text = io.TextIOWrapper(file, "utf-8", newline="\n")
    text.write(f"# timestamp {' '.join(_POSE)}\n")
    rows = zip(_seconds(time), *(map(repr, column.tolist()) for column in pose), strict=True)
    text.writelines(" ".join(row) + "\n" for row in rows)
    text.flush()
    text.detach()


def _seconds(times: Array) -> list[str]:
    """Times as texts, dates to a nanosecond."""
    if times.dtype.kind != "M":
        return [repr(time) for time in times.tolist()]
    nanoseconds = times.astype("datetime64[ns]")
    if not (nanoseconds == times).all():
        raise Problem(
            "dates of a TUM trajectory are counted in nanoseconds since 1970; these are too fine or too far"
        )
    if (nanoseconds.astype(np.int64) < 0).any():
        raise Problem("times of a TUM trajectory are counted from 1970 on; these dates are earlier")
    whole, rest = np.divmod(nanoseconds.astype(np.int64), 10**9)
    return [f"{second}.{part:09}" for second, part in zip(whole.tolist(), rest.tolist(), strict=True)]
