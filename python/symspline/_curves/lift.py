"""Representatives of points on quotient spaces: where the horizontal lift of a curve starts."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._core import ValidationError
from .._spaces import Array, Space
from .curve import Doubles

# Lengths of the first and the last segment up to which these are followed beyond the knots.
FURTHEST = 100.0
# How far a representative may be off the point: what points themselves may be.
OFF = 1e-8


def is_quotient(space: Space) -> bool:
    """Whether the array of a point is one of many, up to a unitary factor on the right."""
    return space._handle.fibre() > 0


def fiber_factors(space: Space, first: Array, start: Any) -> Doubles:
    """The unitary k × k matrices from the first points of curves, shape batch + (*point_shape), to the representatives
    to start at; shape (curves, k, k, 2)."""
    k, n = space._handle.fibre(), space.point_shape[0]
    p = first.reshape(-1, n, k)
    g = np.broadcast_to(np.eye(k), (len(p), k, k))
    if start is not None:
        given = _given(space, first, start)
        products = np.swapaxes(p.conj(), 1, 2) @ given.reshape(-1, n, k)
        # Of what is not finite there is nothing to decompose.
        u, _, v = np.linalg.svd(np.where(np.isfinite(products), products, 0.0))
        g = u @ v
        _check_near(space, (p @ g).reshape(first.shape), given)
    return np.stack([g.real, g.imag], axis=-1)


def check_start(space: Space, first: Array, start: Any) -> None:
    """ValidationError unless a lift in a space of unique arrays starts at the first points."""
    _check_near(space, first, _given(space, first, start))


def _given(space: Space, first: Array, start: Any) -> Array:
    given = space._array(start, "start")
    # Numbers, and none that would lose an imaginary part.
    space._doubles(given, "start")
    if given.shape[-len(space.point_shape) :] != space.point_shape or not _fits(given.shape, first.shape):
        raise ValidationError(
            f"start must have the shape of a point {space.point_shape}, behind the batch axes if any, "
            f"not {given.shape}"
        )
    return np.broadcast_to(given, first.shape)


def _check_near(space: Space, nearest: Array, given: Array) -> None:
    axes = tuple(range(-len(space.point_shape), 0))
    off = np.sqrt(np.sum(np.abs(given - nearest) ** 2, axis=axes) / np.sum(np.abs(nearest) ** 2, axis=axes))
    # Curves that were not found have no point to start at.
    bad = np.argwhere(~(off <= OFF) & np.isfinite(nearest).all(axis=axes))
    if len(bad):
        index = tuple(bad[0])
        of = f" of curve {', '.join(map(str, index))}" if index else ""
        raise ValidationError(
            f"start{of} is {off[index]:.3e} away from the nearest representative of the first point of the curve"
        )


def check_reach(times: Doubles, x: Doubles) -> None:
    """Segments that go on are followed step by step, which must come to an end."""
    first, last = times[..., 1] - times[..., 0], times[..., -1] - times[..., -2]
    low, high = np.max(times[..., 0] - FURTHEST * first), np.min(times[..., -1] + FURTHEST * last)
    bad = np.argwhere((x < low) | (x > high))
    if len(bad):
        index = tuple(bad[0])
        where = f"x[{', '.join(map(str, index))}]" if index else "x"
        raise ValidationError(
            f"{where} = {x[index]} is more than {FURTHEST:.0f} lengths of the last segment beyond the knots, further "
            "than a lift is followed; use extrapolate='geodesic'"
        )


def _fits(shape: tuple[int, ...], whole: tuple[int, ...]) -> bool:
    try:
        return np.broadcast_shapes(shape, whole) == whole
    except ValueError:
        return False
