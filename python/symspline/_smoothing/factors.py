"""The spaces in which noisy data are smoothed.

Rigid motions have no bi-invariant metric. In frames along a path, noise of the attitude becomes noise of the position
that grows with the distance travelled. Poses are therefore smoothed as a rotation and a position, each with its own λ
and noise level. This choice is invariant under a change of the fixed frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import islice
from typing import Any, TypeVar

import numpy as np

from .._curves.ends import End
from .._spaces import Array, Euclidean, Product, Space, SpecialEuclidean, SpecialOrthogonal, cover_of, factors_of

_T = TypeVar("_T")


def parts_of_factor(space: Space) -> tuple[Space, ...]:
    """Return the spaces in which points of one factor are smoothed."""
    if isinstance(space, SpecialEuclidean):
        n = space.point_shape[0] - 1
        return SpecialOrthogonal(n), Euclidean(n)
    # Data of quotients are smoothed as representatives that are continuous along the curve.
    return (cover_of(space),)


def smoothed_spaces(space: Space[Any]) -> tuple[Space, ...]:
    """Return the spaces in which points are smoothed, each with its own λ.

    They are the factors of the space, with rotations and positions in place of poses.
    """
    return tuple(part for factor in factors_of(space) for part in parts_of_factor(factor))


def is_several(space: Space[Any]) -> bool:
    """Whether properties of the noise are tuples."""
    return isinstance(space, Product) or len(smoothed_spaces(space)) > 1


def in_part(space: Space[Any], number: int, mark: str = "") -> str:
    """Return " in factor ..." and a mark for one of several smoothed spaces, or an empty text."""
    return f" in factor {number}, {smoothed_spaces(space)[number]!r}{mark}" if is_several(space) else ""


def grouped(space: Space[Any], values: Iterable[_T]) -> list[list[_T]]:
    """Group values of the smoothed spaces by factor."""
    rest = iter(values)
    return [list(islice(rest, len(parts_of_factor(factor)))) for factor in factors_of(space)]


def split(space: Space, points: Array) -> list[Array]:
    """Split points of a factor, or tangent vectors at them, into the spaces in which they are smoothed."""
    if isinstance(space, SpecialEuclidean):
        return [np.ascontiguousarray(points[..., :-1, :-1]), np.ascontiguousarray(points[..., :-1, -1])]
    return [points]


def join(space: Space, parts: Sequence[Array], corner: float = 1.0) -> Array:
    """Combine points of the smoothed spaces into points of the factor. For tangent vectors, pass the corner 0."""
    if not isinstance(space, SpecialEuclidean):
        return parts[0]
    rotations, positions = parts
    n = positions.shape[-1]
    out = np.zeros((*positions.shape[:-1], n + 1, n + 1))
    out[..., :n, :n], out[..., :n, n], out[..., n, n] = rotations, positions, corner
    return out


def split_ends(space: Space, ends: list[End] | None) -> list[list[End] | None]:
    """Split the end conditions of a factor into the spaces in which it is smoothed."""
    parts = parts_of_factor(space)
    if ends is None or len(parts) == 1:
        return [ends] * len(parts)
    vectors = [None if v is None else split(space, space._numbers(v)) for _, v in ends]
    return [
        [
            (kind, None if own is None else np.ascontiguousarray(part._as_doubles(own[i])))
            for (kind, _), own in zip(ends, vectors, strict=True)
        ]
        for i, part in enumerate(parts)
    ]


def coordinates_in_parts(space: Space, points: Array) -> Array:
    """Return matrices that convert coordinates in ``space.frame(points)`` to those in the frames of the parts."""
    vectors = split(space, space.frame(points))
    rows: list[Any] = []
    for part, own, at in zip(parts_of_factor(space), vectors, split(space, points), strict=True):
        frame = part.frame(at)
        flat = [x.reshape(*x.shape[: own.ndim - len(part.point_shape)], -1) for x in (own, frame)]
        rows.append(np.linalg.pinv(np.swapaxes(flat[1], -1, -2)) @ np.swapaxes(flat[0], -1, -2))
    return np.concatenate(rows, axis=-2)
