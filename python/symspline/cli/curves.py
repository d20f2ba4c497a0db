"""Files of curves, with the names that columns had in the table they were fitted to."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..archive import json_in, read
from ..arrays import brief
from ..files import load, load_many, save_many
from ..spaces import Space
from ..spline import CubicSpline
from .errors import Problem, reading, writing
from .layout import labels
from .points import GLOBE, LONLAT, require_globe
from .quaternions import count_of

ENDING = (".npz",)
_COLUMNS = "columns"
"""The entry of the file with the columns, which the library does not look at."""


@dataclass(frozen=True)
class Columns:
    """Names of columns.

    Attributes:
        points: of the numbers of a point; those of complex ones without their endings.
        time, curve: of times and of names of curves.
        lonlat: whether points are longitude and latitude in degrees.
        utc: whether the dates had a time zone, and are written with a Z; None where that is not known.
        quaternion: of rotations as quaternions, which column holds which number, see `quaternions.places_of`.
    """

    points: list[str]
    time: str = "time"
    curve: str = "curve"
    lonlat: bool = False
    utc: bool | None = None
    quaternion: list[int] | None = None


@dataclass(frozen=True)
class Curves:
    """Curves of one space.

    Attributes:
        splines: by name.
        named: whether the names mean something: not for a single curve.
        columns: how they are called in tables.
    """

    splines: dict[str, CubicSpline]
    named: bool
    columns: Columns

    def called(self, name: str) -> str:
        """How a message calls a curve."""
        return f"curve {name!r}" if self.named else "the curve"


def write_curves(path: Path, curves: Curves) -> None:
    """Write curves to a file that `symspline.load` or `symspline.load_many` reads, too."""
    with writing(path) as temporary:
        with open(temporary, "wb") as file:
            if curves.named:
                save_many(curves.splines, file)
            else:
                next(iter(curves.splines.values())).save(file)
        columns = np.array(json.dumps(asdict(curves.columns)))
        with zipfile.ZipFile(temporary, "a") as archive, archive.open(f"{_COLUMNS}.npy", "w") as entry:
            np.lib.format.write_array(entry, columns)


def read_curves(path: Path, lonlat: bool = False) -> Curves:
    """The curves in a file of ``symspline fit``, `CubicSpline.save` or `symspline.save_many`.

    Args:
        path: the file.
        lonlat: whether to write longitudes and latitudes, also if the file does not say so.
    """
    with reading(path), open(path, "rb") as file:
        entries = _entries(path, file)
        if "names.npy" in entries:
            splines, named = load_many(file), True
        else:
            spline = load(file)
            if not isinstance(spline, CubicSpline):
                raise Problem(
                    f"{path} is a HermiteSpline, whose acceleration jumps; the commands are for C² splines, "
                    "symspline.load reads it in Python"
                )
            splines = dict(_singles(spline))
            named = len(splines) > 1
        space = next(iter(splines.values())).space
        if lonlat:
            require_globe(space)
        file.seek(0)
        columns = _columns(path, file, space) if f"{_COLUMNS}.npy" in entries else None
    if columns is None:
        columns = Columns(labels(space))
    if lonlat and not columns.lonlat:
        columns = replace(columns, points=LONLAT, lonlat=True)
    return Curves(splines, named, columns)


def _entries(path: Path, file: BinaryIO) -> list[str]:
    """What is in the file."""
    try:
        with zipfile.ZipFile(file) as archive:
            return archive.namelist()
    except (zipfile.BadZipFile, NotImplementedError, ValueError):
        raise Problem(f"{path} is not a file of curves, such as `symspline fit` makes") from None
    finally:
        file.seek(0)


def _columns(path: Path, file: BinaryIO, space: Space) -> Columns:
    try:
        columns = Columns(**json_in(read(file, lambda name: name == _COLUMNS), _COLUMNS))
    except OSError:
        raise
    except Exception as error:
        # Damage shows as errors of zipfile, of its decompressors and of NumPy.
        raise Problem(f"{path} is damaged: {brief(error)}") from None
    names = columns.points
    if columns.quaternion is None:
        wanted: int | None = len(LONLAT if columns.lonlat else labels(space))
    else:
        fits = _are_places(columns.quaternion) and len(columns.quaternion) == count_of(space)
        wanted = count_of(space) if fits else None
    good = (
        isinstance(names, list)
        and len(names) == wanted
        and all(isinstance(name, str) for name in (*names, columns.time, columns.curve))
        and isinstance(columns.lonlat, bool)
        and (columns.utc is None or isinstance(columns.utc, bool))
    )
    if not good or (columns.lonlat and (space != GLOBE or columns.quaternion is not None)):
        raise Problem(f"{path} is damaged: its names of columns do not suit {space}")
    return columns


def _are_places(values: object) -> bool:
    """Whether they are 0, 1, 2, … in any order."""
    return (
        isinstance(values, list)
        and all(type(value) is int for value in values)
        and sorted(values) == list(range(len(values)))
    )


def _singles(spline: CubicSpline, name: str = "") -> Iterator[tuple[str, CubicSpline]]:
    """The curves of a batch, named by their numbers."""
    if not spline._batch:
        yield name, spline
        return
    for i, part in enumerate(spline):
        yield from _singles(part, f"{name},{i}" if name else str(i))
