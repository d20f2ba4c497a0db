"""Whole turns of curves on a torus, which follow from the velocities at the knots.

The core joins neighbouring control points the shorter way around each circle. Between knots that are many turns apart,
further knots make the control points near neighbours; a cubic in flat space remains the same cubic.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._spaces import Array, Doubles
from .._spaces.circle import TURN, wrap

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
