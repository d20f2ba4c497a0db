"""Limit given velocities: their control handles must stay inside the cut locus."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._base.faults import of_index
from .._core import CutLocusError, ValidationError
from .._spaces import Array, Doubles, Space, Torus
from .turns import LONGEST

# Handles shorter than this fraction of the injectivity radius are valid without further tests.
_SHORT = 0.99
# Relative difference beyond which the logarithm of the end of a handle is another vector than the handle.
_SAME = 1e-6


def require_short_handles(space: Space[Any], times: Doubles, points: Array, velocities: Array) -> None:
    """Raise ValidationError if a velocity is too fast for a segment next to it.

    The curve is evaluated from its control points. If a handle h u/3 passes the cut locus, its control point is also
    the end of a shorter handle. The curve would then not have the given velocity, or would lose whole turns. Curves on
    a `Torus` keep up to 3000 turns per segment.
    """
    radius = space.injectivity_radius
    if not 0 < radius < np.inf:
        return
    limit = LONGEST if isinstance(space, Torus) else _SHORT * radius
    axes = len(space.point_shape)
    lead = points.shape[: points.ndim - axes]
    steps = np.broadcast_to(np.diff(times), (*lead[:-1], lead[-1] - 1))
    ends = np.zeros((*lead[:-1], 1))
    longest = np.maximum(np.concatenate([steps, ends], -1), np.concatenate([ends, steps], -1))
    with np.errstate(all="ignore"):
        square = np.asarray(space._apply("inner", p=points, u=velocities, v=velocities))
        length = longest / 3 * np.sqrt(np.maximum(square, 0))
    for index in zip(*np.nonzero(length > limit), strict=True):
        handle = longest[index] / 3 * velocities[index]
        try:
            again = space.log(points[index], space.exp(points[index], handle))
            lost = np.abs(again - handle).max() > _SAME * np.abs(handle).max()
        except CutLocusError:
            lost = True
        if lost:
            after = longest[index] == np.append(steps[index[:-1]], 0.0)[index[-1]]
            _refuse(space, index, index[-1] - (not after), float(length[index]), float(longest[index]))


def _refuse(space: Space[Any], index: tuple[Any, ...], segment: int, length: float, step: float) -> None:
    *batch, node = (int(i) for i in index)
    of = of_index(batch)
    other = " Or use `Euclidean` and angles that count turns." if space._has_angles else ""
    raise ValidationError(
        f"`velocities[{node}]`{of} has speed {3 * length / step:.6g}, which is too fast for a segment of length "
        f"{step:.6g}, between t[{segment}] and t[{segment + 1}]: its control handle, a third of the product, has "
        f"length {length:.4g} and passes the cut locus. The curve would have a different velocity or lose whole turns. "
        f"Add knots between them, or pass slower velocities.{other}"
    )
