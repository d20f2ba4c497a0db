"""The spaces in which noisy data are smoothed, and the noise of the data there.

Rigid motions have no bi-invariant metric. In frames along a path, noise of the attitude becomes noise of the position
that grows with the distance travelled. Poses are therefore smoothed as a rotation and a position, each with its own λ
and noise level. This choice is invariant under a change of the fixed frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from itertools import islice
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import as_array, cast, refuse, short_repr
from .._core import ValidationError
from .._curves.ends import End
from .._curves.fit import Points
from .._spaces import (
    Array,
    Doubles,
    Euclidean,
    Product,
    Quotient,
    Space,
    SpecialEuclidean,
    SpecialOrthogonal,
    cover_of,
    factors_of,
)
from .._spaces.base import LARGE

_T = TypeVar("_T")
# Relative size of the entries of a matrix or vector that count as rounding errors.
_ROUNDING = 1e-8
# Operations on matrices in one call of NumPy, which cannot be interrupted: some tenths of a second.
_BLOCK = 1 << 26
# Relative size of the eigenvalues of a matrix that the core treats as zero.
SINGULAR = 1e-10


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
    return isinstance(space, (Product, SpecialEuclidean))


def in_part(space: Space[Any], number: int, mark: str = "") -> str:
    """Return " in factor ..." and a mark for one of several smoothed spaces, or an empty text."""
    return f" in factor {number}, {smoothed_spaces(space)[number]!r}{mark}" if is_several(space) else ""


def grouped(space: Space[Any], values: Iterable[_T]) -> list[list[_T]]:
    """Group values of the smoothed spaces by factor."""
    if not is_several(space):
        return [list(values)]
    rest = iter(values)
    return [list(islice(rest, 2 if isinstance(factor, SpecialEuclidean) else 1)) for factor in factors_of(space)]


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
    if not isinstance(space, SpecialEuclidean):
        return [ends]
    parts = parts_of_factor(space)
    if ends is None:
        return [None] * len(parts)
    vectors = [None if v is None else split(space, space._numbers(v)) for _, v in ends]
    return [
        [
            (kind, None if own is None else np.ascontiguousarray(part._as_doubles(own[i])))
            for (kind, _), own in zip(ends, vectors, strict=True)
        ]
        for i, part in enumerate(parts)
    ]


def distances_of(space: Space, p: Array, q: Array) -> Doubles:
    """Return the distances of rows of points, without checks."""
    doubles = [np.ascontiguousarray(space._as_doubles(np.ascontiguousarray(own))) for own in (p, q)]
    return space._handle.apply("distance", doubles)


def coordinates_in_parts(space: Space, points: Array) -> Array:
    """Return matrices that convert coordinates in ``space.frame(points)`` to those in the frames of the parts."""
    vectors = split(space, space.frame(points))
    rows: list[Any] = []
    for part, own, at in zip(parts_of_factor(space), vectors, split(space, points), strict=True):
        frame = part.frame(at)
        flat = [x.reshape(*x.shape[: own.ndim - len(part.point_shape)], -1) for x in (own, frame)]
        rows.append(np.linalg.pinv(np.swapaxes(flat[1], -1, -2)) @ np.swapaxes(flat[0], -1, -2))
    return np.concatenate(rows, axis=-2)


# ---- weights and information matrices ----


class Noise(NamedTuple):
    """Noise of data in one of the spaces in which they are smoothed.

    Attributes
    ----------
    weights : ndarray, shape (N,) or (..., N)
        Weights; for matrices, the mean of their diagonal.
    information : ndarray or None, shape (N, m, m) or (..., N, m, m)
        Information matrices in the coordinates of ``space.frame(point)``.
    sigma : ndarray, shape (curves,)
        Standard deviation of a coordinate for weight one, NaN where it is estimated. Curves that a user has do not have
        it.
    loss : str
        Loss of the data.
    """

    weights: Doubles
    information: Doubles | None
    sigma: Doubles = np.empty(0)
    loss: str = "linear"

    @property
    def is_singular(self) -> bool:
        """Whether some matrices have no information in some directions."""
        if self.information is None:
            return False
        values = np.linalg.eigvalsh(self.information)
        return bool(np.any((values[..., 0] <= SINGULAR * values[..., -1]) & (values[..., -1] > 0)))

    def map(self, function: Any) -> Noise:
        """Apply a function to the arrays that have batch axes, such as the selection of some curves."""
        information = self.information
        if information is not None and information.ndim > 3:
            information = function(information)
        weights = function(self.weights) if self.weights.ndim > 1 else self.weights
        return self._replace(weights=weights, information=information)

    def rows(self, index: NDArray[np.intp]) -> Noise:
        """Return the weights of some of the data of each curve."""
        information = None if self.information is None else np.take(self.information, index, axis=-3)
        return self._replace(weights=np.take(self.weights, index, axis=-1), information=information)


def read_precision(weights: Any, frames: Any, space: Space, data: list[Points]) -> list[Noise]:
    """Return weights or matrices in every space in which data are smoothed, after all checks.

    Parameters
    ----------
    weights : array_like, tuple or None
        Numbers of shape (N,) or (..., N), or matrices of shape (N, m, m) or (..., N, m, m). For a product, a tuple
        with one of these per factor, or numbers for all factors. For poses also a pair, for rotations and positions.
    frames : array_like, tuple or None
        Tangent vectors to which matrices refer, m at every point, shape (..., N, m, *point_shape). For a product, a
        tuple. None means ``space.frame``.
    """
    factors, several = factors_of(space), isinstance(space, Product)
    own = _per_part(weights, "weights", len(factors), several and isinstance(weights, tuple))
    own_frames = _per_part(frames, "frames", len(factors), several and frames is not None)
    found: list[Noise] = []
    for factor, given, frame, part in zip(factors, own, own_frames, data, strict=True):
        spaces = parts_of_factor(factor)
        if len(spaces) > 1 and isinstance(given, tuple):
            each = _per_part(given, "weights", len(spaces), True)
            frames_of = _per_part(frame, "frames", len(spaces), frame is not None)
            points = split(factor, factor._numbers(part.numbers))
            for space_of, one, at, rows in zip(spaces, each, frames_of, points, strict=True):
                doubles = np.ascontiguousarray(space_of._as_doubles(rows))
                found.append(_in_factor(space_of, one, at, part._replace(numbers=doubles)))
                if part.moves is not None and found[-1].information is not None:
                    raise ValidationError(
                        f"information matrices of {space_of!r} refer to frames at the given representatives, but "
                        "other representatives were chosen. Pass points that `space.unwrap` returned."
                    )
            continue
        precision = _in_factor(factor, given, frame, part)
        found += [precision] if len(spaces) == 1 else _in_parts(precision, factor, part)
    return found


def _in_factor(space: Space, given: Any, frames: Any, data: Points) -> Noise:
    array = None if given is None else as_array(given, "weights")
    shape, lead = (space.dim, space.dim), (*data.batch, data.nodes)
    if array is None or array.shape in ((data.nodes,), lead) or array.shape[-2:] != shape:
        if frames is not None:
            raise ValidationError(
                "`frames` is given, but `weights` are numbers, which do not refer to frames. Omit `frames`, or pass "
                "information matrices."
            )
        return Noise(_checked_weights(given, data, shape), None)
    return _with_matrices(array, frames, space, data)


def _in_parts(precision: Noise, space: Space, data: Points) -> list[Noise]:
    """Return the inverse of the marginal covariance of each part of poses, a Schur complement."""
    parts = parts_of_factor(space)
    if precision.information is None:
        return [precision] * len(parts)
    lead = (*data.batch, data.nodes)
    points = space._numbers(data.numbers).reshape(lead + space.point_shape)
    good = space._where_finite(points)
    into = np.zeros((*lead, space.dim, space.dim))
    into[good] = np.linalg.inv(coordinates_in_parts(space, space.project(points[good])))
    whole = np.swapaxes(into, -1, -2) @ precision.information @ into
    found, first = [], 0
    for part in parts:
        own = np.arange(space.dim)[first : first + part.dim]
        rest = np.setdiff1d(np.arange(space.dim), own)
        block = whole[..., own[:, None], own]
        cross = whole[..., own[:, None], rest]
        others = np.linalg.pinv(whole[..., rest[:, None], rest], rcond=SINGULAR, hermitian=True)
        found.append(_of_matrices(block - cross @ others @ np.swapaxes(cross, -1, -2)))
        first += part.dim
    return found


def _per_part(value: Any, name: str, count: int, is_split: bool) -> list[Any]:
    """Return one value per part: the entries of a tuple, or the same value for all parts."""
    if not is_split:
        return [value] * count
    if not isinstance(value, tuple) or len(value) != count:
        raise ValidationError(f"{name} of a product must be a tuple with {count} entries, one per factor")
    return list(value)


def _checked_weights(weights: ArrayLike | None, data: Points, matrix: tuple[int, ...]) -> Doubles:
    """Return weights, one per point. Matrices of the other shape are accepted as well, but elsewhere."""
    batch, count = data.batch, data.nodes
    if weights is None:
        return np.ones(count)
    found = _numbers(weights)
    if found.shape not in ((count,), (*batch, count)):
        own = f" or {(*batch, count)}" if batch else ""
        raise ValidationError(
            f"weights has shape {found.shape}, but {count} points need {(count,)}{own}, or as matrices "
            f"{(count, *matrix)}"
        )
    negative = "but weights must be >= 0. A weight of 0 excludes a point."
    refuse(~(np.isfinite(found) & (found >= 0)), "weights", lambda i: f"is {found[i]}, {negative}")
    return found


def _numbers(weights: ArrayLike) -> Doubles:
    array = as_array(weights, "weights")
    if array.dtype.kind not in "iufb":
        raise ValidationError(f"weights must be numbers, not {array.dtype}")
    return cast(array)


def _with_matrices(given: ArrayLike, frames: Any, space: Space, data: Points) -> Noise:
    matrices, m = _numbers(given), space.dim
    batch, count = data.batch, data.nodes
    if matrices.shape not in ((count, m, m), (*batch, count, m, m)):
        own = f" or {(*batch, count, m, m)}" if batch else ""
        raise ValidationError(
            f"weights has shape {matrices.shape}, but matrices for {count} points of {space!r} have the shape "
            f"{(count, m, m)}{own}"
        )
    if space.point_shape[0] >= LARGE:
        raise ValidationError(
            f"the dimension of {space!r} is too large for information matrices. Pass numbers as weights."
        )
    _check(_of_each(matrices, lambda own: np.asarray(np.isfinite(own).all(axis=(-2, -1)))), "is not finite")
    _check(_of_each(matrices, _is_symmetric), "is not symmetric")
    least, most = (_of_each(matrices, np.linalg.eigvalsh)[..., i] for i in (0, -1))
    negative = "has a negative eigenvalue, but it must be the inverse of a covariance"
    _check(least >= -_ROUNDING * np.maximum(most, 0.0), negative)
    if data.moves is not None and isinstance(space, Quotient):
        frames = _moved_frames(frames, space, data, data.moves)
    if frames is not None:
        into = _inverse_frames(frames, space, data, np.any(matrices != 0, axis=(-2, -1)))
        matrices = np.swapaxes(into, -1, -2) @ matrices @ into
    return _of_matrices(matrices)


def _is_symmetric(matrices: Doubles) -> NDArray[np.bool_]:
    skew = np.abs(matrices - np.swapaxes(matrices, -1, -2)).max(axis=(-2, -1), initial=0.0)
    return np.asarray(skew <= _ROUNDING * np.abs(matrices).max(axis=(-2, -1), initial=0.0))


def _of_each(matrices: Doubles, function: Callable[[Doubles], Array]) -> Array:
    """Return a function of matrices. Python handles signals between blocks of them."""
    rows = matrices.reshape(math.prod(matrices.shape[:-2]), *matrices.shape[-2:])
    block = max(1, _BLOCK // max(1, matrices.shape[-1] ** 3))
    found = [function(rows[start : start + block]) for start in range(0, max(1, len(rows)), block)]
    values = np.concatenate(found)
    return values.reshape(matrices.shape[:-2] + values.shape[1:])


def _moved_frames(frames: Any, space: Quotient[Any], data: Points, moves: Any) -> Array:
    """Return the frames at the points of the user, moved with these points to the chosen representatives."""
    numbers, lead = space._numbers(data.numbers), (*data.batch, data.nodes)
    if frames is None:
        given = space._moved_by(numbers, space._group.inverse[moves])
        # Points without weight may be NaN.
        good = space._where_finite(given)
        found = np.zeros((*lead, space.dim, *space.point_shape), space.dtype)
        found[good] = space.frame(given[good])
    else:
        found = space._numbers(space._doubles(frames, "frames"))
        if found.shape not in ((lead[-1], space.dim, *space.point_shape), (*lead, space.dim, *space.point_shape)):
            # Other shapes are rejected with the frames themselves.
            return found
    shape = (*lead, space.dim)
    return space._moved_by(np.broadcast_to(found, shape + space.point_shape), np.broadcast_to(moves[..., None], shape))


def _of_matrices(matrices: Doubles) -> Noise:
    """Return matrices without the rounding errors of their symmetry, and their mean eigenvalues as weights."""
    matrices = np.ascontiguousarray(0.5 * (matrices + np.swapaxes(matrices, -1, -2)))
    return Noise(np.trace(matrices, axis1=-2, axis2=-1) / matrices.shape[-1], matrices)


def _check(good: Any, complaint: str, name: str = "weights", indices: Any = None) -> None:
    if not np.all(good):
        bad = np.argwhere(~good)[0]
        raise ValidationError(f"{name}{(bad if indices is None else indices[bad[0]]).tolist()} {complaint}")


def _inverse_frames(frames: Any, space: Space, data: Points, used: Any) -> Doubles:
    """Return matrices that convert coordinates in ``space.frame`` to coordinates in the given frames.

    Data that are missing have unit matrices.
    """
    m, axes = space.dim, len(space.point_shape)
    given = space._numbers(space._doubles(frames, "frames"))
    lead = (*data.batch, data.nodes)
    if given.shape not in ((data.nodes, m, *space.point_shape), (*lead, m, *space.point_shape)):
        raise ValidationError(
            f"frames has shape {given.shape}, but {m} tangent vectors at every point of {space!r} have the shape "
            f"{(*lead, m, *space.point_shape)}"
        )
    points = space._numbers(data.numbers).reshape(lead + space.point_shape)
    # Invalid points are reported later.
    used = np.broadcast_to(used, lead) & space._where_finite(points)
    vectors = np.broadcast_to(given, (*lead, m, *space.point_shape))[used]
    indices = np.argwhere(used)
    _check(space._where_finite(vectors).all(axis=1), "are not finite", "frames", indices)
    own = space.frame(space.project(points[used]))

    def flat(x: Array) -> Doubles:
        rows = space._as_doubles(np.ascontiguousarray(x))
        return np.swapaxes(rows.reshape(*x.shape[: x.ndim - axes], -1), -1, -2)

    columns = flat(vectors)
    coordinates = np.linalg.pinv(flat(own)) @ columns
    off = np.abs(flat(own) @ coordinates - columns).max(axis=(-2, -1))
    size = np.abs(columns).max(axis=(-2, -1))
    tangent = "are not tangent at their point. Project them with space.project_tangent."
    _check(off <= 1e-6 * size, tangent, "frames", indices)
    _check(~(np.linalg.cond(coordinates) > 1e8), "do not span the tangent space", "frames", indices)
    found = np.broadcast_to(np.eye(m), (*lead, m, m)).copy()
    found[used] = np.linalg.inv(coordinates)
    return found


# ---- numbers per curve ----


def per_part(space: Space, value: Any, name: str, batch: tuple[int, ...], infinite: bool = False) -> list[Doubles]:
    """Return one array with a number per curve for each space in which data are smoothed; NaN for None.

    Raises
    ------
    ValidationError
        If the value is not a number >= 0, which may be infinite if `infinite` is True, an array with one per curve, or
        for products and poses a tuple of these.
    """
    if not (isinstance(value, tuple) and is_several(space)):
        count = sum(map(len, map(parts_of_factor, factors_of(space)))) if is_several(space) else 1
        return [_one_per_curve(value, name, batch, infinite)] * count
    spaces = smoothed_spaces(space)
    if len(value) != len(spaces):
        raise ValidationError(
            f"`{name}` has {len(value)} entries, but there are {len(spaces)} parts to smooth: "
            f"{', '.join(map(repr, spaces))}. Pass one entry per part."
        )
    return [_one_per_curve(one, name, batch, infinite) for one in value]


def _one_per_curve(value: Any, name: str, batch: tuple[int, ...], infinite: bool = False) -> Doubles:
    if value is None:
        return np.full(int(np.prod(batch)), np.nan)
    array = np.asarray(value)
    if array.dtype.kind not in "iuf" or array.shape not in ((), batch):
        own = f" or an array of shape {batch}" if batch else ""
        raise ValidationError(f"{name} must be a number{own}, not {short_repr(value)}")
    allowed = ">= 0" if infinite else "finite and >= 0"
    good = (array >= 0) & (infinite | np.isfinite(array))
    refuse(~good, name, lambda i: f"must be {allowed}, not {array[i]}")
    return np.ascontiguousarray(np.broadcast_to(array, batch), np.float64).ravel()
