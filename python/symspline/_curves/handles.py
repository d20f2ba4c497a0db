"""Limits of given velocities: handles inside the cut locus, and whole turns on a torus."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .._base.faults import of_index
from .._core import CutLocusError, ValidationError
from .._spaces import Array, Doubles, Space, Torus
from .._spaces.statistics import TURN, wrap

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


# ---- whole turns of curves on a torus, which follow from the velocities at the knots ----

# Segments with a longer handle are fast. C² curves have shorter ones, and take the shorter way between their points.
_FAST = 0.49995 * TURN
# Longer handles would need too many knots.
LONGEST = 1e3 * TURN
# The largest distance of neighbouring control points with more knots.
_NEAR = 0.25 * TURN


class Turns(NamedTuple):
    """Fast segments on a torus, over which the core would lose turns.

    Attributes
    ----------
    sides : ndarray, shape (..., n - 1)
        The longest side of the control polygon of fast segments; 0 for others.
    change : ndarray, shape (..., n - 1, angles)
        Change of every angle over each segment, with whole turns.
    """

    sides: Doubles
    change: Doubles


def turns_of(times: Doubles, points: Array, velocities: Array) -> Turns | None:
    """Return the turns of curves on a torus, or None if no segment is fast.

    Notes
    -----
    Points determine the change of an angle over a segment of length h up to whole turns. Among these changes, that
    nearest to h (u₀ + u₁)/2 gives the cubic with the lowest bending energy. It is used for the fast angles of a
    segment. For others, the core takes the shorter way between the inner control points, the change nearest to
    h (u₀ + u₁)/3.
    """
    h = np.diff(times)[..., None]
    u0, u1 = h * velocities[..., :-1, :], h * velocities[..., 1:, :]
    longest = np.maximum(np.abs(u0), np.abs(u1)) / 3
    fast = (longest > _FAST) & (longest <= LONGEST)
    if not fast.any():
        return None
    expected = (u0 + u1) / np.where(fast, 2, 3)
    change = expected + wrap(np.diff(points, axis=-2) - expected)
    sides = np.where(fast, np.maximum(longest, np.abs(change - (u0 + u1) / 3)), 0.0).max(axis=-1)
    return Turns(sides, change)


def with_more_knots(times: Doubles, points: Array, velocities: Array) -> tuple[Doubles, Array, Array]:
    """Return knots, points and velocities of the same curves with more knots on segments with several turns."""
    found = turns_of(times, points, velocities)
    if found is None:
        return times, points, velocities
    parts = np.ceil(found.sides.reshape(-1, found.sides.shape[-1]).max(axis=0) / _NEAR)
    parts = np.maximum(parts, 1).astype(int)
    segment = np.repeat(np.arange(len(parts)), parts)
    tau = np.concatenate([np.arange(count) / count for count in parts])
    start, h = times[..., segment], np.diff(times)[..., segment]
    s, h_wide = tau[:, None], h[..., None]
    u0, u1 = (h_wide * velocities[..., segment + i, :] for i in (0, 1))
    change = found.change[..., segment, :]
    # The cubic Hermite polynomial and its derivative.
    square, cube = 3 * change - 2 * u0 - u1, u0 + u1 - 2 * change
    inner = points[..., segment, :] + s * (u0 + s * (square + s * cube))
    rates = (u0 + s * (2 * square + 3 * s * cube)) / h_wide
    # The given nodes remain exact.
    inner = np.where(s == 0, points[..., segment, :], inner)
    rates = np.where(s == 0, velocities[..., segment, :], rates)
    return (
        np.concatenate([start + tau * h, times[..., -1:]], axis=-1),
        np.concatenate([inner, points[..., -1:, :]], axis=-2),
        np.concatenate([rates, velocities[..., -1:, :]], axis=-2),
    )
