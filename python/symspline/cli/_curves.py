"""Files of curves with the names of their columns, and samples of curves as columns."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import reduce
from operator import getitem, itemgetter
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from .._base.angles import compass, to_lonlat
from .._base.arrays import brief
from .._grid import GridSpline
from .._smoothing import SmoothingSpline
from .._spaces import Doubles, Space, factors_of, parts_of
from .._spaces.degrees import with_angles
from .._splines.archive import json_in, read
from .._splines.composed import SegmentedCurve
from .._splines.cubic import CubicSpline
from .._splines.files import load, save
from ..rotations import angular_acceleration, angular_velocity, quaternion
from ._columns import (
    GLOBE,
    LONLAT,
    POSES,
    ROTATIONS,
    WITH_HEIGHT,
    Columns,
    complex_numbers,
    count_with_quaternion,
    in_degrees,
    labels,
    require_globe,
    width,
)
from ._messages import Problem, Source, did_you_mean, refuse, writing
from ._tables import CURVES, IM, RE

_COLUMNS = "columns"
"""The entry of the file with the columns, which the library ignores."""


@dataclass(frozen=True)
class Curves:
    """Curves of one space.

    Attributes
    ----------
    splines : dict
        Curves by name.
    named : bool
        Whether the names have a meaning.
    columns : Columns
        Names of their columns in a table.
    file : Source or None
        The file that was read.
    segmented : bool
        Whether the curves are the segments of one recording, in the order of time.
    """

    splines: Mapping[str, CubicSpline]
    named: bool
    columns: Columns
    segmented: bool = False
    file: Source | None = None

    @property
    def recordings(self) -> dict[str, list[str]]:
        """The names of the segments of every recording that was cut at gaps, and of every other curve itself."""
        if self.segmented:
            return {"": list(self.splines)}
        recordings: dict[str, list[str]] = {}
        for name in self.splines:
            base, _, number = name.rpartition("/")
            recordings.setdefault(base if self.columns.cut and number.isdecimal() else name, []).append(name)
        return recordings

    def called(self, name: str) -> str:
        """Refer to a curve in a message."""
        return f"{'segment' if self.segmented else 'curve'} {name!r}" if self.named else "the curve"

    def chosen(self, names: Sequence[str] | None) -> Curves:
        """Return the curves of these names, with all segments of each; a single one needs no name."""
        if names is None:
            return self
        splines: dict[str, CubicSpline] = {}
        refuse(self.file, (not self.named, " has one curve without a name; omit --curve"))
        for name in names:
            # A curve that was cut at gaps has the segments NAME/1, NAME/2, ...
            matching = {key: curve for key, curve in self.splines.items() if name in (key, key.rpartition("/")[0])}
            refuse(self.file, (not matching, f" has no curve {name!r}; {did_you_mean(name, list(self.splines))}"))
            splines |= matching
        return replace(self, splines=splines, named=len(splines) > 1)


def write_curves(path: Path, curves: Curves) -> None:
    """Write curves to a file that `symspline.load` also reads."""
    splines: Any = curves.splines if curves.named else next(iter(curves.splines.values()))
    if curves.segmented:
        splines = SegmentedCurve(list(curves.splines.values()))
    with writing(path) as temporary:
        with open(temporary, "wb") as file:
            save(splines, file)
        with zipfile.ZipFile(temporary, "a") as archive, archive.open(f"{_COLUMNS}.npy", "w") as entry:
            np.lib.format.write_array(entry, np.array(json.dumps(asdict(curves.columns))))


def read_curves(path: Path, lonlat: bool = False) -> Curves:
    """Read the curves in a file of ``symspline fit`` or of the library; ``lonlat`` as for ``symspline sample``."""
    source = Source(path, CURVES[0])
    with source.open() as file:
        if not zipfile.is_zipfile(file):
            raise Problem(f"{source} is not a file of curves, such as `symspline fit` makes")
        file.seek(0)
        content = load(file)
        named = isinstance(content, dict)
        segmented = isinstance(content, SegmentedCurve)
        if segmented:
            content, named = {str(i): curve for i, curve in enumerate(content, 1)}, True
        for curve in content.values() if named else [content]:
            refuse(source, (isinstance(curve, GridSpline), " is a grid; symspline.load reads it"))
            if not isinstance(curve, CubicSpline):
                kind = type(curve).__name__
                raise Problem(f"{source} is a {kind}, whose acceleration jumps at knots; use symspline.load")
        if named:
            splines = content
        else:
            # The curves of a batch are named by their indices.
            indices = np.ndindex(content._batch)
            splines = {",".join(map(str, index)): reduce(getitem, index, content) for index in indices}
            named = len(splines) > 1
        space = next(iter(splines.values())).space
        if lonlat:
            require_globe(space)
        columns = _columns(source, file, space)
    if lonlat and not columns.lonlat:
        columns = replace(columns, points=LONLAT if space == GLOBE else [*LONLAT, "ele"], lonlat=True)
    return Curves(splines, named, columns, segmented, source)


def _columns(path: object, file: BinaryIO, space: Space) -> Columns:
    """Return the columns that `write_curves` wrote, or the usual ones if another program wrote the curves."""
    try:
        entries = read(file, lambda name: name == _COLUMNS)
        columns = Columns(**json_in(entries, _COLUMNS)) if entries else Columns(labels(space))
    except OSError:
        raise
    except Exception as error:
        # Damaged files raise errors of zipfile, of its decompressors and of NumPy.
        raise Problem(f"{path} is damaged: {brief(error)}") from None
    refuse(path, (not _suit(columns, space), f" is damaged: its names of columns do not suit {space}"))
    return columns


def _suit(columns: Columns, space: Space) -> bool:
    names, order = columns.points, columns.quaternion
    flags = (columns.lonlat, columns.cut, columns.degrees)
    if not isinstance(names, list) or not all(isinstance(text, str) for text in (*names, columns.time, columns.curve)):
        return False
    decimals = columns.decimals
    if decimals is not None and not (isinstance(decimals, dict) and all(type(n) is int for n in decimals.values())):
        return False
    if not all(isinstance(flag, bool) for flag in flags) or columns.utc not in (True, False, None):
        return False
    if order is None:
        on_earth = {GLOBE: 2, WITH_HEIGHT: 3}.get(space)
        return len(names) == (on_earth if columns.lonlat else len(labels(space)))
    whole = isinstance(order, list) and all(type(i) is int for i in order)
    return whole and sorted(order) == list(range(len(names))) and len(names) == count_with_quaternion(space)


# ---- samples ----

_RATES = ("wx", "wy", "wz")
"""Columns of angular velocities."""

Samples = list[tuple[str, Doubles]]
"""Names and numbers of columns."""


def samples_of(spline: CubicSpline, x: Any, nu: int, columns: Columns) -> Samples:
    """Return the columns of points, velocities or accelerations at times x.

    The derivatives of a unit quaternion are the angular velocity and the angular acceleration in the frame of the body.
    """
    values, end = spline(x, nu), f"_d{nu}" if nu else ""
    if columns.lonlat:
        positions, *heights = parts_of(values, spline.space, "values")
        above = [(columns.points[2] + end, part[:, 0]) for part in heights]
        if not nu:
            return [*zip(columns.points, to_lonlat(positions), strict=False), *above]
        axes = zip(("east", "north"), compass(parts_of(spline(x), spline.space, "values")[0]), strict=True)
        return [*((name + end, np.degrees((positions * axis).sum(axis=-1))) for name, axis in axes), *above]
    values = with_angles(spline.space, values, np.degrees) if columns.degrees else values
    parts = parts_of(values, spline.space, "values")
    if columns.quaternion is not None:
        return _with_quaternion(spline, x, nu, parts, columns)
    blocks = [np.ascontiguousarray(part.reshape(len(part), -1)).view(np.float64) for part in parts]
    pairs = zip(columns.points, complex_numbers(spline.space), strict=True)
    names = [name + end + part for name, two in pairs for part in ((RE, IM) if two else ("",))]
    # A column may be named twice, as for both sides of a symmetric matrix.
    return list(dict(zip(names, np.concatenate(blocks, axis=1).T, strict=True)).items())


def _with_quaternion(spline: CubicSpline, x: Any, nu: int, parts: Sequence[Any], columns: Columns) -> Samples:
    """Return the columns of a point whose rotation is a quaternion, in the order of the table."""
    order = columns.quaternion or []
    turning = (quaternion, angular_velocity, angular_acceleration)[nu]
    options: Any = {} if nu else {"scalar_first": True}
    placed: list[tuple[int, str, Doubles]] = []
    start = 0
    for factor, part in zip(factors_of(spline.space), parts, strict=True):
        count = width(factor, True)
        at = order[start : start + count]
        start += count
        numbers = part[:, :3, 3] if factor == POSES else part.reshape(len(part), -1)
        if factor in (ROTATIONS, POSES):
            turn, at = at[-4:], at[:-4]
            names = [columns.points[i] for i in turn] if nu == 0 else [name + ("", "_d1")[nu - 1] for name in _RATES]
            # All rates stand where the first number of the quaternion does.
            where = turn if nu == 0 else [min(turn)] * len(names)
            placed += zip(where, names, turning(spline, x, **options).T, strict=True)
        end = f"_d{nu}" if nu else ""
        placed += [(i, columns.points[i] + end, column) for i, column in zip(at, numbers.T, strict=False)]
    return [(name, column) for _, name, column in sorted(placed, key=itemgetter(0))]


def deviations_of(spline: SmoothingSpline, x: Any, nu: int, columns: Columns) -> Samples:
    """Return the columns of standard deviations of points or velocities: one per factor, and two per pose.

    They have the units of the columns next to them. A component of a unit quaternion changes half as much as the angle
    of its rotation. Each component of an angular velocity has its own standard deviation.
    """
    samples: Samples = []
    if nu > 1:
        return samples
    factors, end = factors_of(spline.space), f"_d{nu}" if nu else ""
    stds: Sequence[Any] = parts_of(spline.std(x, nu=nu), spline.space, "std")
    for number, (factor, std) in enumerate(zip(factors, stds, strict=True), 1):
        name = f"std{number if len(factors) > 1 else ''}"
        if factor._name == "se":
            samples.append((f"{name}_position{end}", std[1]))
            name, std = f"{name}_rotation", std[0]
        if columns.quaternion is None or factor not in (ROTATIONS, POSES):
            degrees = in_degrees(factor, columns.lonlat, columns.degrees)
            samples.append((name + end, np.degrees(std) if degrees else std))
        elif nu:
            deviations = angular_velocity(spline, x, return_std=True)[1].T
            samples += [(f"std_{rate}", column) for rate, column in zip(_RATES, deviations, strict=True)]
        else:
            samples.append((name, std / 2))
    return samples
