"""Warn about maps with boundaries, such as those between the grains of a crystal."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._base.warnings import warn
from .._spaces import Array, Doubles, Space
from .warned import SmoothingWarning

# A jump is a step between neighbouring nodes that is longer than the first number of median steps along the axis, and
# than the second number of times the steps before and after it. Noise and outliers cause no jumps, because the steps
# next to a long step are long as well.
_MEDIANS, _BESIDE = 8.0, 4.0
# Least number of jumps, as a fraction of the number of nodes along a side of the map.
_SHARE = 0.3


def warn_of_boundaries(parts: list[tuple[Space[Any], Array]], weights: Doubles) -> None:
    """Warn once if many neighbouring nodes of a map are far apart compared with the nodes beside them.

    Parameters
    ----------
    parts : list
        Each space with its points, of shape (n_1, ..., n_D, *point_shape).
    weights : ndarray, shape (n_1, ..., n_D)
        Weights; nodes of weight zero do not count.
    """
    for space, points in parts:
        count, first = 0, None
        for k in range(weights.ndim):
            steps = _steps(space, points, weights, k)
            jumps = np.argwhere(_are_jumps(steps))
            count += len(jumps)
            if first is None and len(jumps):
                # Steps have their axis last.
                *others, i = jumps[0].tolist()
                nodes = [[*others[:k], j, *others[k:]] for j in (i, i + 1)]
                first = nodes, float(steps[tuple(jumps[0])]), float(np.nanmedian(steps))
        if first is None or count < _SHARE * weights.size ** (1 - 1 / weights.ndim):
            continue
        nodes, distance, usual = first
        warn(
            f"the map has a boundary that the smooth surface cannot follow: {count} pairs of neighbouring nodes are "
            f"far apart, for example points{nodes[0]} and points{nodes[1]}, whose distance is {distance:.2g}. The "
            f"median distance of neighbours is {usual:.2g}. If the map has regions such as grains, label them, and "
            "smooth each region with weights of zero at all other nodes.",
            SmoothingWarning,
        )
        return


def _steps(space: Space[Any], points: Array, weights: Doubles, k: int) -> Doubles:
    """Return the distances of neighbours along axis k, which becomes the last one; NaN where a node is missing."""
    axis = weights.ndim - 1
    there, rows = np.moveaxis(weights > 0, k, axis), np.moveaxis(points, k, axis)
    left, right = (np.take(rows, range(i, rows.shape[axis] - 1 + i), axis) for i in (0, 1))
    good = there[..., :-1] & there[..., 1:] & space._where_finite(left) & space._where_finite(right)
    steps = np.full(good.shape, np.nan)
    if good.any():
        steps[good] = space._apply("distance", p=left[good], q=right[good])
    return steps


def _are_jumps(steps: Doubles) -> Any:
    """Return a mask of the steps that are much longer than the median step and than the steps next to them."""
    if steps.shape[-1] < 4 or not np.isfinite(steps).any():
        return np.zeros(steps.shape, bool)
    known = np.nan_to_num(steps, nan=0.0)
    # The first and the last step may be long because of an outlier at the end.
    beside = np.full(steps.shape, np.inf)
    beside[..., 1:-1] = np.maximum(known[..., :-2], known[..., 2:])
    return (known > _MEDIANS * np.nanmedian(steps)) & (known > _BESIDE * beside)
