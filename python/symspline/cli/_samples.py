"""Points, derivatives and standard deviations of curves as columns of a table."""

from __future__ import annotations

from collections.abc import Sequence
from operator import itemgetter
from typing import Any

import numpy as np

from .._base.lonlat import compass, to_lonlat
from .._smoothing import SmoothingSpline
from .._spaces import Doubles, Torus, factors_of, parts_of
from .._spaces.degrees import with_angles
from .._splines.cubic import CubicSpline
from ..rotations import angular_acceleration, angular_velocity, quaternion
from ._points import POSES, ROTATIONS, Columns, complex_numbers, width
from ._tables import IM, RE

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
        if not nu:
            return list(zip(columns.points, to_lonlat(values), strict=True))
        axes = zip(("east", "north"), compass(spline(x)), strict=True)
        return [(name + end, np.degrees((values * axis).sum(axis=-1))) for name, axis in axes]
    values = with_angles(spline.space, values, np.degrees) if columns.degrees else values
    parts = parts_of(values, spline.space, "values")
    if columns.quaternion is not None:
        return _with_quaternion(spline, x, nu, parts, columns)
    blocks = [np.ascontiguousarray(own.reshape(len(own), -1)).view(np.float64) for own in parts]
    pairs = zip(columns.points, complex_numbers(spline.space), strict=True)
    names = [name + end + part for name, two in pairs for part in ((RE, IM) if two else ("",))]
    # A column may be named twice, as for both sides of a symmetric matrix.
    return list(dict(zip(names, np.concatenate(blocks, axis=1).T, strict=True)).items())


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
            names = [columns.points[i] for i in turn] if nu == 0 else [name + ("", "_d1")[nu - 1] for name in _RATES]
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
    stds: Sequence[Any] = parts_of(spline.std(x, nu=nu), spline.space, "std")
    for number, (factor, std) in enumerate(zip(factors, stds, strict=True), 1):
        name = f"std{number if len(factors) > 1 else ''}"
        if factor._name == "se":
            found.append((f"{name}_position{end}", std[1]))
            name, std = f"{name}_rotation", std[0]
        if columns.quaternion is None or factor not in (ROTATIONS, POSES):
            found.append(
                (
                    name + end,
                    np.degrees(std) if columns.lonlat or (columns.degrees and isinstance(factor, Torus)) else std,
                )
            )
        elif nu:
            each = angular_velocity(spline, x, return_std=True)[1].T
            found += [(f"std_{rate}", own) for rate, own in zip(_RATES, each, strict=True)]
        else:
            found.append((name, std / 2))
    return found
