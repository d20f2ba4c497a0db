"""The covariant derivative of the acceleration on a manifold that is made of functions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from ..._base.typing import Progress
from ..._spaces import Array, Doubles, Space
from ..curve import CurveArrays

# Chebyshev nodes of half a segment, on which the acceleration is interpolated.
_NODES = 16


def differentiation(nodes: Doubles, x: Doubles) -> Doubles:
    """Return the weights of values at `nodes` in the derivative of their interpolating polynomial at x."""
    degree = len(nodes) - 1
    derivatives = np.stack(
        [chebyshev.chebval(x, chebyshev.chebder(np.eye(degree + 1)[n])) for n in range(degree + 1)], axis=-1
    )
    return np.asarray(derivatives @ np.linalg.inv(chebyshev.chebvander(nodes, degree)))


def jerk(part: CurveArrays, x: Doubles, outside: str, per_curve: bool, progress: Progress | None) -> Array:
    """Compute the covariant jerk ∇∇γ' at times x.

    The acceleration is smooth on each segment. It is evaluated at Chebyshev nodes of the half of the segment that
    contains x, transported to γ(x) along geodesics, interpolated and differentiated there. Transport along geodesics
    and along the curve differ by terms of third order, so that this is the covariant derivative.

    Parameters
    ----------
    part, x, outside, per_curve, progress
        As for `CurveArrays.evaluate`.
    """
    space, axes = part.space, len(part.batch)
    if (per_curve and x.ndim == axes) or not x.ndim:
        # One time per curve.
        found = jerk(part, x[..., None], outside, per_curve, progress)
        return np.asarray(np.take(found, 0, axis=axes))
    # This call validates the times.
    here = part.evaluate(x, "point", outside, per_curve)
    if part.times.ndim > 1 and not per_curve:
        x, per_curve = np.broadcast_to(x, part.batch + x.shape), True
    starts, widths = _halves(part, x, outside)
    nodes = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
    weights = differentiation(nodes, 2 * (x - starts) / widths - 1) * (2 / widths)[..., None]
    result: Array = np.zeros_like(here)
    for k in range(_NODES):
        at = np.ascontiguousarray(starts + widths * (nodes[k] + 1) / 2)
        points, vectors = (part.evaluate(at, name, outside, per_curve) for name in ("point", "acceleration"))
        factor = weights[..., k].reshape(weights.shape[:-1] + (1,) * len(space.point_shape))
        result += factor * transported(space, points, here, vectors)
        if progress is not None:
            progress(k + 1, _NODES)
    return result


def _halves(part: CurveArrays, x: Doubles, outside: str) -> tuple[Doubles, Doubles]:
    """Return an interval that contains each time, on which the curve is smooth: its start and its width."""
    if part.times.ndim == 1:
        return _halves_of(part.times, x, outside)
    nodes = part.times.shape[-1]
    rows = np.broadcast_to(part.times, (*part.batch, nodes)).reshape(-1, nodes)
    each = [_halves_of(*own, outside) for own in zip(rows, x.reshape(len(rows), -1), strict=True)]
    starts, widths = (np.reshape(own, x.shape) for own in zip(*each, strict=True)) if each else (x, x)
    return starts, widths


def _halves_of(knots: Doubles, x: Doubles, outside: str) -> tuple[Doubles, Doubles]:
    first, last = knots[0], knots[-1]
    turns = np.floor((x - first) / (last - first)) * (last - first) if outside == "periodic" else np.zeros_like(x)
    i = np.clip(np.searchsorted(knots, x - turns, side="right") - 1, 0, len(knots) - 2)
    starts, widths = knots[i] + turns, (knots[i + 1] - knots[i]) / 2
    starts = np.where(x >= starts + widths, starts + widths, starts)
    if outside in ("continue", "geodesic"):
        # The first and the last segment, or the geodesics that follow them.
        starts = np.where(x > last, x, np.where(x < first, x - widths, starts))
    return starts, widths


def transported(space: Space[Any], p: Array, q: Array, vectors: Any) -> Array:
    """Transport vectors from p to q along geodesics; NaN where anything is missing."""
    valid = space._where_finite(p) & space._where_finite(q) & space._where_finite(vectors)
    out = np.full(vectors.shape, np.nan, vectors.dtype)
    if valid.any():
        out[valid] = space.transport(p[valid], q[valid], vectors[valid])
    return out
