"""Curves of geodesics between neighbouring points, as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._spaces import Array, Doubles, Space, factors_of
from .curve import CurveArrays, FactorArrays
from .fit import curve_of_factors
from .slopes import geodesic_velocities, wide


def jumps(curve: CurveArrays) -> list[Doubles]:
    """Return the norms of the jumps of the velocity at the inner knots in each factor, as parts of the speed before.

    They are NaN at the ends of segments without a geodesic.
    """
    return [_jumps(factor) for factor in curve.factors]


def _jumps(factor: FactorArrays) -> Doubles:
    space = factor.space
    inner: Any = (..., slice(1, -1), *[slice(None)] * len(space.point_shape))
    assert factor.before is not None
    p, before, after = (array[inner] for array in (factor.points, factor.before, factor.velocities))
    if not p.size:
        return np.zeros(p.shape[: p.ndim - len(space.point_shape)])
    gaps = ~(space._where_finite(before) & space._where_finite(after))
    before, after = (np.where(wide(gaps, space), 0, own) for own in (before, after))
    with np.errstate(all="ignore"):
        jumps: Doubles = np.nan_to_num(space.norm(p, after - before) / space.norm(p, before), nan=0.0)
    jumps[gaps] = np.nan
    return jumps


def joined(space: Space[Any], times: Doubles, points: list[Array]) -> CurveArrays:
    """Return the curve of geodesics between neighbouring points, given in each factor.

    It is a curve of cubic segments with corners at the knots. Between two points that no unique geodesic joins,
    velocities and the curve are NaN.

    Raises
    ------
    CutLocusError
        If all neighbouring points lie at or past each other's cut locus.
    """
    factors = []
    for factor, own in zip(factors_of(space), points, strict=True):
        starts, ends = geodesic_velocities(factor, times, own)
        axis = own.ndim - len(factor.point_shape) - 1
        first, last = np.take(starts, [0], axis=axis), np.take(ends, [-1], axis=axis)
        after, before = np.concatenate([starts, last], axis=axis), np.concatenate([first, ends], axis=axis)
        factors.append(FactorArrays(factor, own, after, before))
    return curve_of_factors(space, times, tuple(factors), fitted=False)
