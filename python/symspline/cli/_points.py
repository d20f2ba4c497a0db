"""Points in columns: their components, quaternions, or longitude and latitude in degrees."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.lonlat import from_lonlat
from .._core import ValidationError
from .._spaces import Doubles, Product, Space, Torus, factors_of, space_named
from ..convert._pose_files import join, rotations_in_rows
from ._messages import Problem, for_command_line
from ._tables import IM, RE, Place

GLOBE, ROTATIONS, POSES = map(space_named, ("sphere:2", "so:3", "se:3"))
LONLAT = ["lon", "lat"]
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
    cut : bool
        Whether NAME/1, NAME/2, ... are the segments of one recording, which was cut at gaps.
    degrees : bool
        Whether angles of tori are in degrees.
    """

    points: list[str]
    time: str = "time"
    curve: str = "curve"
    lonlat: bool = False
    utc: bool | None = None
    quaternion: list[int] | None = None
    cut: bool = False
    degrees: bool = False


def require_globe(space: Space) -> None:
    """Raise `Problem` unless the points of a space have longitude and latitude."""
    if space != GLOBE:
        heights = GLOBE in factors_of(space)
        advice = (
            "; fit the other columns by themselves, such as heights by --space r:1 --columns ele" if heights else ""
        )
        raise Problem(f"--lonlat is for sphere:2, not for {space}{advice}")


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


def points_of(
    space: Space,
    numbers: Doubles,
    lonlat: bool,
    order: list[int] | None,
    file: object,
    place: Place,
    degrees: bool = False,
) -> Any:
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
            rotations = rotations_in_rows(own[:, -4:], file, place)
            part = join(rotations, own[:, :3]) if factor == POSES else rotations
        else:
            part = own.view(factor.dtype).reshape(len(own), *factor.point_shape)
            part = np.radians(part) if degrees and isinstance(factor, Torus) else part
        of = f"the part in {factor} of " if isinstance(space, Product) else ""
        parts.append(_projected(factor, part, file, place, of))
    return tuple(parts) if isinstance(space, Product) else parts[0]


def _projected(space: Space, points: NDArray[Any], file: object, place: Place, of: str) -> NDArray[Any]:
    doubles = space._doubles(points, "points")
    lead = space._lead(doubles)
    try:
        space._handle.check_points(space._rows(doubles, lead), lead, space._tol(points))
    except ValidationError as error:
        row, _, found = for_command_line(error).removeprefix("point ").partition(" ")
        order = f"; the columns of the table are a {matrix(space)}" if matrix(space) else ""
        raise Problem(f"{file}: {of}the point in {place(int(row))} {found}{order}") from None
    return space.project(points)
