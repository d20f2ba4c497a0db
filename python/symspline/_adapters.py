"""What the adapters for libraries of automatic differentiation share."""

from __future__ import annotations

from typing import Any

from ._core import ValidationError
from .spaces import Space
from .spline import CubicSpline

# End conditions without their vectors: a word, or a pair of words and orders.
Kinds = str | tuple[str | int, str | int]


def split(bc_type: Any) -> tuple[Kinds, tuple[Any, Any]]:
    """End conditions as something to hash, and the vectors in them (None where there is none)."""
    if isinstance(bc_type, str):
        return bc_type, (None, None)
    try:
        pair = [(end, None) if isinstance(end, str) else (int(end[0]), end[1]) for end in bc_type]
        (first, a), (last, b) = pair
    except (TypeError, ValueError, IndexError):
        raise ValidationError(
            "bc_type must be a word or a pair of words and (order, vector), as for CubicSpline"
        ) from None
    return (first, last), (a, b)


def joined(kinds: Kinds, vectors: tuple[Any, Any]) -> Any:
    """The inverse of `split`."""
    if isinstance(kinds, str):
        return kinds
    return tuple(
        kind if isinstance(kind, str) else (kind, vector) for kind, vector in zip(kinds, vectors, strict=True)
    )


def fitted(
    t: Any, points: Any, vectors: tuple[Any, Any], space: Space, kinds: Kinds, options: dict[str, Any]
) -> CubicSpline:
    """The spline through the points of the space beside the given ones: numbers that an optimiser or a
    finite difference makes are a little off it."""
    projected = space.project(points)
    ends = list(vectors)
    for i, vector in enumerate(vectors):
        if vector is not None:
            axis = projected.ndim - len(space.point_shape) - 1
            ends[i] = space.project_tangent(projected.take(-i, axis=axis), vector)
    return CubicSpline(t, projected, space, bc_type=joined(kinds, (ends[0], ends[1])), **options)
