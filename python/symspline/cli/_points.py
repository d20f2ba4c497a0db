"""Points in columns: their components, quaternions, or longitude and latitude in degrees."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import ValidationError
from .._cubic import CubicSpline
from .._lonlat import compass, from_lonlat, to_lonlat
from .._pose_files import join, rotations_in_rows
from .._smoothing import SmoothingSpline
from .._spaces import POINT_TOL_FLOAT32, Doubles, Product, Space, factors_of, parts_of, space_named
from ..rotations import angular_acceleration, angular_velocity, quaternion
from ._messages import Problem, for_command_line
from ._tables import IM, RE, Place

GLOBE, ROTATIONS, POSES = map(space_named, ("sphere:2", "so:3", "se:3"))
LONLAT = ["lon", "lat"]
RATES = ("wx", "wy", "wz")
"""Columns of angular velocities."""
IN_BRACKETS = re.compile(r"[(\[].*?[)\]]")
# Longitudes may start at -180 or at 0, or continue across the date line. 400 is an error, and 999 a missing value.
_LARGEST = (360, 90)


@dataclass(frozen=True)
class Columns:
    """Names of columns, and what they hold.

    Attributes
    ----------
    points : list of str
        For every number of a point; for complex numbers without their endings.
    time, curve : str
        For times and for names of curves.
    lonlat : bool
        Whether points are longitude and latitude in degrees.
    utc : bool or None
        Whether dates had a time zone, and are written with a Z. None if that is not known.
    quaternion : list of int or None
        For rotations as quaternions the column of every number of a point, position first and scalar first.
    """

    points: list[str]
    time: str = "time"
    curve: str = "curve"
    lonlat: bool = False
    utc: bool | None = None
    quaternion: list[int] | None = None


def require_globe(space: Space) -> None:
    """Raise `Problem` unless the points of a space have longitude and latitude."""
    if space != GLOBE:
        raise Problem(f"--lonlat is for sphere:2, not for {space}")


# ---- names ----


def complex_numbers(space: Space) -> list[bool]:
    """For every number of a point whether it is complex."""
    return [factor._complex for factor in factors_of(space) for _ in range(math.prod(factor.point_shape))]


def labels(space: Space) -> list[str]:
    """Name the numbers of a point x0, x1, … in vectors, m11, m12, … in a matrix, m1_11, … in several matrices."""
    factors = factors_of(space)
    several = sum(map(_is_matrix, factors)) > 1
    names: list[str] = []
    vectors, matrices = count(), count(1)
    for factor in factors:
        if _is_matrix(factor):
            start = f"m{next(matrices)}_" if several else "m"
            between = "_" if max(factor.point_shape) > 9 else ""
            names += [f"{start}{i + 1}{between}{j + 1}" for i, j in np.ndindex(*factor.point_shape)]
        else:
            names += [f"x{next(vectors)}" for _ in range(*factor.point_shape)]
    return names


def described(space: Space) -> str:
    """Describe the numbers of a point and their order."""
    parts = [_described(factor) for factor in factors_of(space)]
    if len(parts) == 1:
        return parts[0]
    each = "; ".join(f"{factor}: {part}" for factor, part in zip(factors_of(space), parts, strict=True))
    return f"{len(labels(space))} numbers ({each})"


def _described(space: Space) -> str:
    size = math.prod(space.point_shape)
    text = f"{size} {'complex number' if space._complex else 'number'}{'s' if size > 1 else ''}"
    text += f", A{RE} and A{IM} each" if space._complex else ""
    return f"{text}, a {matrix(space)}" if _is_matrix(space) else text


def matrix(space: Space) -> str:
    """Describe a matrix in columns; empty for vectors."""
    return f"{' x '.join(map(str, space.point_shape))} matrix row by row" if _is_matrix(space) else ""


def _is_matrix(space: Space) -> bool:
    return len(space.point_shape) > 1


# ---- quaternions ----


def count_with_quaternion(space: Space) -> int | None:
    """Count the numbers of a point whose rotation is a quaternion; None without exactly one rotation in space."""
    factors = factors_of(space)
    if sum(factor in (ROTATIONS, POSES) for factor in factors) != 1 or any(factor._complex for factor in factors):
        return None
    return sum(width(factor, True) for factor in factors)


def width(space: Space, quaternion: bool) -> int:
    """Count the columns of a point of a space, not a product."""
    if quaternion and space in (ROTATIONS, POSES):
        return 4 if space == ROTATIONS else 7
    return math.prod(space.point_shape) * (2 if space._complex else 1)


def in_order(space: Space, scalar_last: int) -> list[int]:
    """Return `Columns.quaternion` for columns in the order of the factors, the scalar first (0) or last (1)."""
    columns: list[int] = []
    for factor in factors_of(space):
        own = list(range(len(columns), len(columns) + width(factor, True)))
        if factor in (ROTATIONS, POSES):
            own[-4:] = np.roll(own[-4:], scalar_last).tolist()
        columns += own
    return columns


def quaternion_by_names(names: Sequence[str], space: Space) -> list[int] | None:
    """Return `Columns.quaternion` for names that end in w, x, y and z after a common beginning; None for other names.

    Positions whose names end in x, y and z may also be in any order.
    """
    plain = [IN_BRACKETS.sub("", name).strip().lower() for name in names]
    scalars = [name for name in plain if name.endswith("w")]
    quaternion = [scalars[0][:-1] + letter for letter in "wxyz"] if len(scalars) == 1 else []
    if not quaternion or any(plain.count(name) != 1 for name in quaternion):
        return None
    scalar_first = [plain.index(name) for name in quaternion]
    rest = [i for i in range(len(names)) if i not in scalar_first]
    columns: list[int] = []
    for factor in factors_of(space):
        turns = factor in (ROTATIONS, POSES)
        count = width(factor, True) - (4 if turns else 0)
        own, rest = rest[:count], rest[count:]
        by_letter = sorted(own, key=lambda i: plain[i][-1:])
        if [plain[i][-1:] for i in by_letter] == [*"xyz"]:
            own = by_letter
        elif factor == POSES:
            return None
        columns += own + (scalar_first if turns else [])
    return columns


# ---- numbers ----


def points_of(space: Space, numbers: Doubles, lonlat: bool, order: list[int] | None, file: object, place: Place) -> Any:
    """Return the points of all rows, projected onto the space if they are off it by rounding in a file only.

    Raises
    ------
    Problem
        A point is farther off.
    """
    if lonlat:
        for name, values, largest in zip(("longitude", "latitude"), numbers.T, _LARGEST, strict=True):
            wild = np.flatnonzero(np.abs(values) > largest)
            if wild.size:
                raise Problem(
                    f"{file}, {place(int(wild[0]))}: {name} {values[wild[0]]:g} is not between -{largest} and "
                    f"{largest} degrees; omit missing values, or say with --columns LON,LAT which is which"
                )
        return from_lonlat(*numbers.T)
    if order:
        numbers = numbers[:, order]
    parts, start = [], 0
    for factor in factors_of(space):
        own = np.ascontiguousarray(numbers[:, start : start + width(factor, order is not None)])
        start += own.shape[1]
        if order and factor in (ROTATIONS, POSES):
            rotations = rotations_in_rows(own[:, -4:], file, place, POINT_TOL_FLOAT32)
            part = join(rotations, own[:, :3]) if factor == POSES else rotations
        else:
            part = own.view(factor.dtype).reshape(len(own), *factor.point_shape)
        of = f"the part in {factor} of " if isinstance(space, Product) else ""
        parts.append(_projected(factor, part, file, place, of))
    return tuple(parts) if isinstance(space, Product) else parts[0]


def _projected(space: Space, points: NDArray[Any], file: object, place: Place, of: str) -> NDArray[Any]:
    doubles = space._doubles(points, "points")
    lead = space._lead(doubles)
    try:
        space._handle.check_points(space._rows(doubles, lead), lead, POINT_TOL_FLOAT32)
    except ValidationError as error:
        row, _, found = for_command_line(error).removeprefix("point ").partition(" ")
        order = f"; the columns of the table are a {matrix(space)}" if matrix(space) else ""
        raise Problem(f"{file}: {of}the point in {place(int(row))} {found}{order}") from None
    return space.project(points)


# ---- samples ----

Samples = list[tuple[str, Doubles]]
"""Names and numbers of columns."""


def samples_of(spline: CubicSpline, x: Any, nu: int, columns: Columns) -> Samples:
    """Return the columns of points, velocities or accelerations at times x.

    The derivatives of a unit quaternion are the angular velocity and the angular acceleration in the frame of the body.
    """
    values, end = spline(x, nu), f"_d{nu}" if nu else ""
    if columns.lonlat:
        if not nu:
            return list(zip(columns.points, to_lonlat(values), strict=True))
        axes = zip(("east", "north"), compass(spline(x)), strict=True)
        return [(name + end, np.degrees((values * axis).sum(axis=-1))) for name, axis in axes]
    parts = parts_of(values, spline.space, "values")
    if columns.quaternion is not None:
        return _with_quaternion(spline, x, nu, parts, columns)
    blocks = [np.ascontiguousarray(own.reshape(len(own), -1)).view(np.float64) for own in parts]
    pairs = zip(columns.points, complex_numbers(spline.space), strict=True)
    names = [name + end + part for name, two in pairs for part in ((RE, IM) if two else ("",))]
    return list(zip(names, np.concatenate(blocks, axis=1).T, strict=True))


def _with_quaternion(spline: CubicSpline, x: Any, nu: int, parts: Sequence[Any], columns: Columns) -> Samples:
    """Return the columns of a point whose rotation is a quaternion, in the order of the table."""
    order = columns.quaternion or []
    turning = (quaternion, angular_velocity, angular_acceleration)[nu]
    options: Any = {} if nu else {"scalar_first": True}
    found: list[tuple[int, str, Doubles]] = []
    start = 0
    for factor, own in zip(factors_of(spline.space), parts, strict=True):
        count = width(factor, True)
        at = order[start : start + count]
        start += count
        numbers = own[:, :3, 3] if factor == POSES else own.reshape(len(own), -1)
        if factor in (ROTATIONS, POSES):
            turn, at = at[-4:], at[:-4]
            names = [columns.points[i] for i in turn] if nu == 0 else [name + ("", "_d1")[nu - 1] for name in RATES]
            # All rates stand where the first number of the quaternion does.
            where = turn if nu == 0 else [min(turn)] * len(names)
            found += zip(where, names, turning(spline, x, **options).T, strict=True)
        end = f"_d{nu}" if nu else ""
        found += [(i, columns.points[i] + end, column) for i, column in zip(at, numbers.T, strict=False)]
    return [(name, column) for _, name, column in sorted(found, key=itemgetter(0))]


def deviations_of(spline: SmoothingSpline, x: Any, nu: int, columns: Columns) -> Samples:
    """Return the columns of standard deviations of points or velocities: one per factor, and two per pose.

    They have the units of the columns next to them. A component of a unit quaternion changes half as much as the angle
    of its rotation. Each component of an angular velocity has its own standard deviation.
    """
    found: Samples = []
    if nu > 1:
        return found
    factors, end = factors_of(spline.space), f"_d{nu}" if nu else ""
    half = 2 if columns.quaternion is not None else 1
    stds: Sequence[Any] = parts_of(spline.std(x, nu=nu), spline.space, "std")
    for number, (factor, std) in enumerate(zip(factors, stds, strict=True), 1):
        name = f"std{number if len(factors) > 1 else ''}"
        if factor == POSES:
            found.append((f"{name}_position{end}", std[1]))
        if factor in (ROTATIONS, POSES):
            turn = name if factor == ROTATIONS else f"{name}_rotation"
            if nu and columns.quaternion is not None:
                each = angular_velocity(spline, x, return_std=True)[1].T
                found += [(f"std_{rate}", own) for rate, own in zip(RATES, each, strict=True)]
            else:
                found.append((turn + end, (std if factor == ROTATIONS else std[0]) / half))
        elif factor._name == "se":
            found += [(f"{name}_position{end}", std[1]), (f"{name}_rotation{end}", std[0])]
        else:
            found.append((name + end, np.degrees(std) if columns.lonlat else std))
    return found
