"""Rotations in columns as unit quaternions, alone or with a place, in place of matrices."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..convert import matrix_to_quaternion, quaternion_to_matrix
from ..spaces import (
    POINT_TOL_FLOAT32,
    Euclidean,
    Product,
    Space,
    SpecialEuclidean,
    SpecialOrthogonal,
    factors_of,
)
from .errors import Problem, listed
from .layout import Doubles
from .tables import Place

# Quaternions are w, x, y, z within this module; the columns of a table are in the order of their names.
LETTERS = "wxyz"
ORDERS = ("wxyz", "xyzw")
_ROTATIONS, _POSES, _PLACES = SpecialOrthogonal(3), SpecialEuclidean(3), Euclidean(3)
_NAME = re.compile(r"(.*?)[_. ]?([wxyz])", re.IGNORECASE | re.DOTALL)
_IN_BRACKETS = re.compile(r"[(\[].*?[)\]]")


def count_of(space: Space) -> int | None:
    """How many numbers a point has with quaternions for its rotation; None in spaces without exactly one rotation of
    space."""
    parts = factors_of(space)
    if sum(part in (_ROTATIONS, _POSES) for part in parts) != 1:
        return None
    if any(part.dtype.kind == "c" for part in parts):
        return None
    return sum(map(_width, parts))


def places_of(names: Sequence[str], space: Space, order: str | None) -> list[int]:
    """For every number of a point, in the order of this module, which of the named columns holds it.

    Args:
        names: of as many columns as `count_of` says.
        space: where the points are.
        order: ``"wxyz"`` or ``"xyzw"`` if the user said it; else names tell.

    Raises:
        Problem: the names do not tell, or say something else than the user.
    """
    found = _by_names(names, space)
    if order is None:
        if found is None:
            raise Problem(
                f"{listed(names)} may be a quaternion{' and a place' if len(names) > 4 else ''}, but the names do not "
                "say which number is which: call them qw, qx, qy, qz (and x, y, z), or say --quaternion wxyz or xyzw"
            )
        return found
    given = _in_order(space, order)
    if found is not None and found != given:
        raise Problem(
            f"--quaternion {order} makes other numbers of {listed(names)} than their names; leave one of the two away"
        )
    return given


def _in_order(space: Space, order: str) -> list[int]:
    places: list[int] = []
    for part in factors_of(space):
        start = len(places)
        if part == _ROTATIONS:
            places += [start + order.index(letter) for letter in LETTERS]
        elif part == _POSES:
            places += [*range(start, start + 3), *(start + 3 + order.index(letter) for letter in LETTERS)]
        else:
            places += range(start, start + _width(part))
    return places


def _by_names(names: Sequence[str], space: Space) -> list[int] | None:
    """The same from names such as qw or q_w, where they are as clear as that."""
    matches = [_NAME.fullmatch(_IN_BRACKETS.sub("", name).strip()) for name in names]
    keys = [None if match is None else (match[1].lower(), match[2].lower()) for match in matches]
    scalars = [key for key in keys if key is not None and key[1] == "w"]
    if len(scalars) != 1:
        return None
    quaternion = [(scalars[0][0], letter) for letter in LETTERS]
    if any(keys.count(key) != 1 for key in quaternion):
        return None
    turn = [keys.index(key) for key in quaternion]
    rest = [i for i in range(len(names)) if i not in turn]
    places: list[int] = []
    for part in factors_of(space):
        if part == _ROTATIONS:
            places += turn
            continue
        own, rest = rest[: part.point_shape[0]], rest[part.point_shape[0] :]
        if part == _POSES:
            own, rest = own[:3], own[3:] + rest
        if part in (_POSES, _PLACES):
            letters = {(keys[i] or ("", ""))[1]: i for i in own}
            if set(letters) == set("xyz"):
                own = [letters[letter] for letter in "xyz"]
            elif part == _POSES:
                return None
        places += own + (turn if part == _POSES else [])
    return places


def _width(space: Space) -> int:
    if space == _ROTATIONS:
        return 4
    return 7 if space == _POSES else math.prod(space.point_shape)


# ---- numbers ----


def points_of(space: Space, columns: Doubles, places: Sequence[int], place: Place) -> list[NDArray[Any]]:
    """The points in every factor.

    Raises:
        Problem: a quaternion is not of length 1.
    """
    numbers = columns[:, places]
    parts: list[NDArray[Any]] = []
    start = 0
    for part in factors_of(space):
        own = numbers[:, start : start + _width(part)]
        start += _width(part)
        if part in (_ROTATIONS, _POSES):
            turned = quaternion_to_matrix(_unit(own[:, -4:], place), scalar_first=True)
            if part == _POSES:
                poses = np.broadcast_to(np.eye(4), (len(own), 4, 4)).copy()
                poses[:, :3, :3], poses[:, :3, 3] = turned, own[:, :3]
                turned = poses
            parts.append(turned)
        else:
            parts.append(np.ascontiguousarray(own).reshape(len(own), *part.point_shape))
    return parts


def _unit(q: Doubles, place: Place) -> Doubles:
    lengths = np.hypot.reduce(q, axis=1)
    bad = np.flatnonzero(~(np.abs(lengths - 1) <= POINT_TOL_FLOAT32))
    if bad.size:
        raise Problem(
            f"{place(int(bad[0]))}: the quaternion has length {lengths[bad[0]]:.6g}, not 1 (allowed: 1 ± "
            f"{POINT_TOL_FLOAT32:.0e}); are these its columns?"
        )
    unit: Doubles = q / lengths[:, None]
    return unit


class Signs:
    """Quaternions along a curve: of ±q, which are one rotation, the one next to that before; first with w >= 0."""

    def __init__(self) -> None:
        self._last: Doubles | None = None

    def along(self, rotations: Doubles) -> Doubles:
        """Quaternions w, x, y, z of rotations that come after those of the last call."""
        q = matrix_to_quaternion(rotations, scalar_first=True)
        before = np.concatenate([q[:1] if self._last is None else self._last, q])
        turns = (before[1:] * before[:-1]).sum(axis=1) < 0
        q = q * np.where(np.cumsum(turns) % 2, -1.0, 1.0)[:, None]
        self._last = q[-1:]
        return q


def columns_of(
    space: Space, points: Any, values: Any, nu: int, places: Sequence[int], signs: Signs
) -> Doubles:
    """Points, velocities or accelerations as columns.

    Vectors go with the quaternion as it moves on the sphere of unit quaternions: q' = q ω/2 with the rate ω in the
    body. That sphere covers the rotations without stretching angles, so that covariant derivatives go the same way.
    """
    numbers: list[Doubles] = []
    each = zip(
        *(value if isinstance(space, Product) else (value,) for value in (points, values)), strict=True
    )
    for part, (at, own) in zip(factors_of(space), each, strict=True):
        if part not in (_ROTATIONS, _POSES):
            numbers.append(own.reshape(len(own), -1))
            continue
        turn = at[:, :3, :3]
        if part == _POSES:
            numbers.append(own[:, :3, 3])
        q = signs.along(turn)
        if nu:
            rate = np.swapaxes(turn, 1, 2) @ own[:, :3, :3]
            q = _half_product(q, np.stack([rate[:, 2, 1], rate[:, 0, 2], rate[:, 1, 0]], axis=1))
        numbers.append(q)
    columns = np.empty((len(numbers[0]), len(places)))
    columns[:, places] = np.concatenate(numbers, axis=1)
    return columns


def _half_product(q: Doubles, v: Doubles) -> Doubles:
    """q (0, v) / 2."""
    w, xyz = q[:, :1], q[:, 1:]
    vector = w * v + np.cross(xyz, v)
    product: Doubles = np.concatenate([-(xyz * v).sum(axis=1, keepdims=True), vector], axis=1)
    return 0.5 * product
