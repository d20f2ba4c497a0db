"""Representatives of points on quotient spaces: where the horizontal lift of a curve starts."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._base.arrays import refuse
from .._core import ValidationError
from .._spaces import Array, Doubles, Space

# Largest extrapolation of a lift, in lengths of the first or last segment.
FURTHEST = 100.0
# Largest relative distance of a representative from the point, equal to the tolerance for points.
OFF = 1e-8


def is_quotient(space: Space) -> bool:
    """Whether a point has several representatives, which differ by a unitary factor on the right."""
    return space._handle.fibre() > 0


def fiber_factors(space: Space, first: Array, start: Any) -> Doubles:
    """Return unitary k × k matrices that map first points to their representatives at the start of the lift.

    Parameters
    ----------
    first : ndarray, shape batch + (*point_shape)
        First points of the curves.
    start : array_like or None
        Representatives of these points; None means the first points.

    Returns
    -------
    ndarray, shape (curves, k, k, 2)
        Real and imaginary parts of the matrices.
    """
    k, n = space._handle.fibre(), space.point_shape[0]
    p = first.reshape(-1, n, k)
    g = np.broadcast_to(np.eye(k), (len(p), k, k))
    if start is not None:
        given = _given(space, first, start)
        products = np.swapaxes(p.conj(), 1, 2) @ given.reshape(-1, n, k)
        # The decomposition fails for infinite and NaN entries, so zeros replace them.
        u, _, v = np.linalg.svd(np.where(np.isfinite(products), products, 0.0))
        g = u @ v
        _check_near(space, (p @ g).reshape(first.shape), given)
    return np.stack([g.real, g.imag], axis=-1)


def check_start(space: Space, first: Array, start: Any) -> None:
    """Raise ValidationError unless a lift starts at the first points, in a space with unique representatives."""
    _check_near(space, first, _given(space, first, start))


def _given(space: Space, first: Array, start: Any) -> Array:
    given = space._array(start, "start")
    # This raises if an entry is not a number, or if an imaginary part would be discarded.
    space._doubles(given, "start")
    try:
        if given.shape[-len(space.point_shape) :] == space.point_shape:
            return np.broadcast_to(given, first.shape)
    except ValueError:
        pass
    raise ValidationError(
        f"start must have the shape of a point {space.point_shape}, after the batch axes if any, not {given.shape}"
    )


def _check_near(space: Space, nearest: Array, given: Array) -> None:
    axes = tuple(range(-len(space.point_shape), 0))
    off = np.sqrt(np.sum(np.abs(given - nearest) ** 2, axis=axes) / np.sum(np.abs(nearest) ** 2, axis=axes))
    # Curves without a solution have no start to check.
    bad = np.argwhere(~(off <= OFF) & np.isfinite(nearest).all(axis=axes))
    if len(bad):
        index = tuple(bad[0])
        of = f" of curve {', '.join(map(str, index))}" if index else ""
        raise ValidationError(
            f"start{of} is {off[index]:.3e} away from the nearest representative of the first point of the curve"
        )


def check_reach(times: Doubles, x: Doubles) -> None:
    """Raise ValidationError for times too far beyond the knots, because the lift is computed in small steps."""
    first, last = times[..., 1] - times[..., 0], times[..., -1] - times[..., -2]
    low, high = np.max(times[..., 0] - FURTHEST * first), np.min(times[..., -1] + FURTHEST * last)
    limit = (
        f"is more than {FURTHEST:.0f} lengths of the last segment beyond the knots, which is the limit for lifts; use "
        "extrapolate='geodesic'"
    )
    refuse((x < low) | (x > high), "x", lambda i: f"= {x[i]} {limit}")
