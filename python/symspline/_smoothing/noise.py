"""Noisy data: their validation, the spaces in which they are smoothed, and their noise there.

Rigid motions have no bi-invariant metric. In frames along a path, noise of the attitude becomes noise of the position
that grows with the distance travelled. Poses are therefore smoothed as a rotation and a position, each with its own λ
and noise level. This choice is invariant under a change of the fixed frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import reduce
from itertools import islice
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import as_array, cast, one_of, refuse, short_repr
from .._base.faults import INVALID, Fault
from .._base.time import TimeAxis, knots_of
from .._base.typing import Numbers, PointsLike, SmoothingBCType, TimesLike
from .._core import ValidationError
from .._curves.ends import NATURAL, End, end_kinds, map_ends, split_ends
from .._curves.fit import Points, moved_ends, read, read_ends, validated
from .._curves.missing import refuse_nan_times
from .._curves.options import with_atol
from .._spaces import (
    AnySpace,
    Array,
    Doubles,
    Euclidean,
    Product,
    Quotient,
    Space,
    SpecialEuclidean,
    SpecialOrthogonal,
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
    return (space.cover if isinstance(space, Quotient) else space,)


def smoothed_spaces(space: AnySpace) -> tuple[Space, ...]:
    """Return the spaces in which points are smoothed, each with its own λ.

    They are the factors of the space, with rotations and positions in place of poses.
    """
    if not isinstance(space, Product):
        return parts_of_factor(space)
    return tuple([part for factor in space.factors for part in parts_of_factor(factor)])


def is_several(space: AnySpace) -> bool:
    """Whether properties of the noise are tuples."""
    return isinstance(space, (Product, SpecialEuclidean))


def in_part(space: AnySpace, number: int, mark: str = "") -> str:
    """Return " in factor ..." and a mark for one of several smoothed spaces, or an empty text."""
    return f" in factor {number}, {smoothed_spaces(space)[number]!r}{mark}" if is_several(space) else ""


def grouped(space: AnySpace, values: Iterable[_T]) -> list[list[_T]]:
    """Group values of the smoothed spaces by factor."""
    rest, groups = iter(values), []
    for factor in factors_of(space):
        groups.append(list(islice(rest, 2 if isinstance(factor, SpecialEuclidean) else 1)))
    return groups


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


def split_end_vectors(space: Space, ends: list[End] | None) -> list[list[End] | None]:
    """Split the end conditions of a factor into the spaces in which it is smoothed."""
    if not isinstance(space, SpecialEuclidean):
        return [ends]
    parts = parts_of_factor(space)
    if ends is None:
        return [None] * len(parts)
    vectors = [None if v is None else split(space, space._numbers(v)) for _, v in ends]
    return [
        [
            (kind, None if of_parts is None else np.ascontiguousarray(part._as_doubles(of_parts[i])))
            for (kind, _), of_parts in zip(ends, vectors, strict=True)
        ]
        for i, part in enumerate(parts)
    ]


def distances_of(space: Space, p: Array, q: Array) -> Doubles:
    """Return the distances of rows of points, without checks."""
    starts, ends = np.ascontiguousarray(p), np.ascontiguousarray(q)
    return space._handle.apply("distance", [space._as_doubles(starts), space._as_doubles(ends)])


def coordinates_in_parts(space: Space, points: Array) -> Array:
    """Return matrices that convert coordinates in ``space.frame(points)`` to those in the frames of the parts."""
    vectors = split(space, space.frame(points))
    rows: list[Array] = []
    for part, basis, at in zip(parts_of_factor(space), vectors, split(space, points), strict=True):
        frame = part.frame(at)
        flat = [x.reshape(*x.shape[: basis.ndim - len(part.point_shape)], -1) for x in (basis, frame)]
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

    def map(self, function: Callable[[Array], Array]) -> Noise:
        """Apply a function to the arrays that have batch axes, such as the selection of some curves."""
        information = self.information
        if information is not None and information.ndim > 3:
            information = function(information)
        weights = function(self.weights) if self.weights.ndim > 1 else self.weights
        return self._replace(weights=weights, information=information)

    def divided(self, variances: Doubles) -> Noise:
        """Return the noise for variances of the data, shape (..., N), that multiply those of the weights."""
        information = self.information
        if information is not None:
            information = information / variances[..., None, None]
        return self._replace(weights=np.ascontiguousarray(self.weights / variances), information=information)

    def rows(self, index: NDArray[np.intp]) -> Noise:
        """Return the weights of some of the data of each curve."""
        information = None if self.information is None else np.take(self.information, index, axis=-3)
        return self._replace(weights=np.take(self.weights, index, axis=-1), information=information)


def at_times(knots: Doubles, values: Doubles, times: Doubles) -> Doubles:
    """Return functions that are linear between knots at times of each curve; all arrays are (n,) or (..., n)."""
    batch = np.broadcast_shapes(knots.shape[:-1], values.shape[:-1], times.shape[:-1])
    knots, values, times = (np.broadcast_to(x, (*batch, x.shape[-1])) for x in (knots, values, times))
    out = np.empty(times.shape)
    for index in np.ndindex(batch):
        out[index] = np.interp(times[index], knots[index], values[index])
    return out


def read_precision(weights: Numbers | None, frames: Numbers | None, space: Space, data: list[Points]) -> list[Noise]:
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
    weights_of_factors = _per_part(weights, "weights", len(factors), several and isinstance(weights, tuple))
    frames_of_factors = _per_part(frames, "frames", len(factors), several and frames is not None)
    noise: list[Noise] = []
    for factor, given, frame, part in zip(factors, weights_of_factors, frames_of_factors, data, strict=True):
        spaces = parts_of_factor(factor)
        if len(spaces) > 1 and isinstance(given, tuple):
            weights_of_parts = _per_part(given, "weights", len(spaces), True)
            frames_of = _per_part(frame, "frames", len(spaces), frame is not None)
            points = split(factor, factor._numbers(part.numbers))
            for space_of, one, at, rows in zip(spaces, weights_of_parts, frames_of, points, strict=True):
                doubles = np.ascontiguousarray(space_of._as_doubles(rows))
                noise.append(_in_factor(space_of, one, at, part._replace(numbers=doubles)))
                if part.moves is not None and noise[-1].information is not None:
                    raise ValidationError(
                        f"information matrices of {space_of!r} refer to frames at the given representatives, but "
                        "other representatives were chosen. Pass points that `space.unwrap` returned."
                    )
            continue
        precision = _in_factor(factor, given, frame, part)
        noise += [precision] if len(spaces) == 1 else _in_parts(precision, factor, part)
    return noise


def _in_factor(space: Space, given: ArrayLike | None, frames: ArrayLike | None, data: Points) -> Noise:
    array = None if given is None else as_array(given, "weights")
    shape, lead = (space.dim, space.dim), (*data.batch, data.nodes)
    if array is None or array.shape in ((data.nodes,), lead) or array.shape[-2:] != shape:
        if frames is not None:
            raise ValidationError(
                "`frames` is given, but `weights` are numbers, which do not refer to frames. Omit `frames`, or pass "
                "information matrices."
            )
        return Noise(np.ones(data.nodes) if array is None else _checked_weights(array, data, shape), None)
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
    noise, first = [], 0
    for part in parts:
        columns = np.arange(space.dim)[first : first + part.dim]
        rest = np.setdiff1d(np.arange(space.dim), columns)
        block = whole[..., columns[:, None], columns]
        cross = whole[..., columns[:, None], rest]
        others = np.linalg.pinv(whole[..., rest[:, None], rest], rcond=SINGULAR, hermitian=True)
        noise.append(_of_matrices(block - cross @ others @ np.swapaxes(cross, -1, -2)))
        first += part.dim
    return noise


def _per_part(value: Numbers | None, name: str, count: int, is_split: bool) -> list[Any]:
    """Return one value per part: the entries of a tuple, or the same value for all parts."""
    if not is_split:
        return [value] * count
    if not isinstance(value, tuple) or len(value) != count:
        raise ValidationError(f"{name} of a product must be a tuple with {count} entries, one per factor")
    return list(value)


def _checked_weights(weights: Array, data: Points, matrix: tuple[int, ...]) -> Doubles:
    """Return weights, one per point. Matrices of the other shape are accepted as well, but elsewhere."""
    batch, count = data.batch, data.nodes
    numbers = _numbers(weights)
    if numbers.shape not in ((count,), (*batch, count)):
        of_batch = f" or {(*batch, count)}" if batch else ""
        raise ValidationError(
            f"weights has shape {numbers.shape}, but {count} points need {(count,)}{of_batch}, or as matrices "
            f"{(count, *matrix)}"
        )
    negative = "but weights must be >= 0. A weight of 0 excludes a point."
    refuse(~(np.isfinite(numbers) & (numbers >= 0)), "weights", lambda i: f"is {numbers[i]}, {negative}")
    return numbers


def _numbers(array: Array) -> Doubles:
    if array.dtype.kind not in "iufb":
        raise ValidationError(f"weights must be numbers, not {array.dtype}")
    return cast(array)


def _with_matrices(given: Array, frames: ArrayLike | None, space: Space, data: Points) -> Noise:
    matrices, m = _numbers(given), space.dim
    batch, count = data.batch, data.nodes
    if matrices.shape not in ((count, m, m), (*batch, count, m, m)):
        of_batch = f" or {(*batch, count, m, m)}" if batch else ""
        raise ValidationError(
            f"weights has shape {matrices.shape}, but matrices for {count} points of {space!r} have the shape "
            f"{(count, m, m)}{of_batch}"
        )
    if space.point_shape[0] >= LARGE:
        raise ValidationError(
            f"the dimension of {space!r} is too large for information matrices. Pass numbers as weights."
        )
    _check(_of_each(matrices, lambda rows: np.asarray(np.isfinite(rows).all(axis=(-2, -1)))), "is not finite")
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
    blocks = [function(rows[start : start + block]) for start in range(0, max(1, len(rows)), block)]
    values = np.concatenate(blocks)
    return values.reshape(matrices.shape[:-2] + values.shape[1:])


def _moved_frames(frames: ArrayLike | None, space: Quotient[Any], data: Points, moves: NDArray[np.intp]) -> Array:
    """Return the frames at the points of the user, moved with these points to the chosen representatives."""
    numbers, lead = space._numbers(data.numbers), (*data.batch, data.nodes)
    if frames is None:
        given = space._moved_by(numbers, space._group.inverse[moves])
        # Points without weight may be NaN.
        good = space._where_finite(given)
        vectors = np.zeros((*lead, space.dim, *space.point_shape), space.dtype)
        vectors[good] = space.frame(given[good])
    else:
        vectors = space._numbers(space._doubles(frames, "frames"))
        if vectors.shape not in ((lead[-1], space.dim, *space.point_shape), (*lead, space.dim, *space.point_shape)):
            # Other shapes are rejected with the frames themselves.
            return vectors
    shape = (*lead, space.dim)
    vectors = np.broadcast_to(vectors, shape + space.point_shape)
    return space._moved_by(vectors, np.broadcast_to(moves[..., None], shape))


def _of_matrices(matrices: Doubles) -> Noise:
    """Return matrices without the rounding errors of their symmetry, and their mean eigenvalues as weights."""
    matrices = np.ascontiguousarray(0.5 * (matrices + np.swapaxes(matrices, -1, -2)))
    return Noise(np.trace(matrices, axis1=-2, axis2=-1) / matrices.shape[-1], matrices)


def _check(good: Array | np.bool_, complaint: str, name: str = "weights", indices: Array | None = None) -> None:
    if not np.all(good):
        bad = np.argwhere(~good)[0]
        raise ValidationError(f"{name}{(bad if indices is None else indices[bad[0]]).tolist()} {complaint}")


def _inverse_frames(frames: ArrayLike, space: Space, data: Points, used: Array) -> Doubles:
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
    basis = space.frame(space.project(points[used]))

    def flat(x: Array) -> Doubles:
        rows = space._as_doubles(np.ascontiguousarray(x))
        return np.swapaxes(rows.reshape(*x.shape[: x.ndim - axes], -1), -1, -2)

    columns = flat(vectors)
    coordinates = np.linalg.pinv(flat(basis)) @ columns
    off = np.abs(flat(basis) @ coordinates - columns).max(axis=(-2, -1))
    size = np.abs(columns).max(axis=(-2, -1))
    tangent = "are not tangent at their point. Project them with space.project_tangent."
    _check(off <= 1e-6 * size, tangent, "frames", indices)
    _check(~(np.linalg.cond(coordinates) > 1e8), "do not span the tangent space", "frames", indices)
    inverses = np.broadcast_to(np.eye(m), (*lead, m, m)).copy()
    inverses[used] = np.linalg.inv(coordinates)
    return inverses


# ---- numbers per curve ----


def per_part(
    space: Space, spaces: tuple[Space, ...], value: Any, name: str, batch: tuple[int, ...], infinite: bool = False
) -> list[Doubles]:
    """Return one array with a number per curve for each of the smoothed spaces; NaN for None.

    Raises
    ------
    ValidationError
        If the value is not a number >= 0, which may be infinite if `infinite` is True, an array with one per curve, or
        for products and poses a tuple of these.
    """
    if value is None:
        return [np.full(math.prod(batch), np.nan)] * len(spaces)
    if not (isinstance(value, tuple) and is_several(space)):
        return [_one_per_curve(value, name, batch, infinite)] * len(spaces)
    return [_one_per_curve(entry, name, batch, infinite) for entry in _entries(space, spaces, value, name)]


def _entries(space: Space, spaces: tuple[Space, ...], value: Any, name: str) -> list[Any]:
    """Return the entries of an argument: those of a tuple, or the same for every smoothed space."""
    if not (isinstance(value, tuple) and is_several(space)):
        return [value] * len(spaces)
    if len(value) != len(spaces):
        raise ValidationError(
            f"`{name}` has {len(value)} entries, but there are {len(spaces)} parts to smooth: "
            f"{', '.join(map(repr, spaces))}. Pass one entry per part."
        )
    return list(value)


class Smoothness(NamedTuple):
    """How much the data in one of the smoothed spaces are smoothed.

    Attributes
    ----------
    lam : ndarray, shape (curves,)
        λ, infinite for geodesics and NaN where it is chosen.
    profile : ndarray or None, shape (K - 1,) or (curves, K - 1)
        Given λ of the segments, divided by `lam`; None for one λ.
    adapts : bool
        Whether λ varies along the curve if the data require it.
    """

    lam: Doubles
    profile: Doubles | None = None
    adapts: bool = False

    def of_curves(self, chosen: NDArray[np.intp]) -> Smoothness:
        """Return the same for some curves of a batch."""
        profile = None if self.profile is None else np.ascontiguousarray(self.profile[chosen])
        return self._replace(lam=self.lam[chosen], profile=profile)


def read_smoothness(space: Space, spaces: tuple[Space, ...], lam: Any, batch: tuple[int, ...]) -> list[Smoothness]:
    """Return the argument `lam` for each of the smoothed spaces.

    Raises
    ------
    ValidationError
        If it is not None, a number >= 0, "adaptive", an array with one number per curve or per segment of each curve,
        or for products and poses a tuple of these.
    """
    given = []
    for entry in _entries(space, spaces, lam, "lam"):
        if isinstance(entry, str):
            if entry != "adaptive":
                raise ValidationError(f"lam must be a number, an array or 'adaptive', not {short_repr(entry)}")
            given.append(Smoothness(np.full(math.prod(batch), np.nan), adapts=True))
            continue
        array = np.asarray(entry)
        # A tuple has one entry per part, which a single space does not have.
        if entry is None or isinstance(entry, tuple) or array.dtype.kind not in "iuf" or array.ndim != len(batch) + 1:
            if entry is not None and array.dtype.kind in "iuf" and array.shape not in ((), batch):
                per_curve = f", an array of shape {batch} with one per curve" if batch else ""
                raise ValidationError(
                    f"lam has shape {array.shape}, but must be a number{per_curve}, or an array with one number per "
                    f"segment of shape {(*batch, 'K - 1')}".replace("'", "")
                )
            given.append(Smoothness(_one_per_curve(entry, "lam", batch, True)))
            continue
        if array.shape[:-1] != batch or not array.shape[-1]:
            raise ValidationError(
                f"lam has shape {array.shape}, but {(*batch, 'K - 1')} is needed for one number per segment"
            )
        refuse(~((array > 0) & np.isfinite(array)), "lam", lambda i: "must be finite and > 0 in every segment")
        logarithms = np.log(array.reshape(-1, array.shape[-1]).astype(np.float64))
        # The mean of equal numbers has a rounding error.
        mean = np.where(np.ptp(logarithms, axis=-1) == 0, logarithms[:, 0], logarithms.mean(axis=-1))
        given.append(Smoothness(np.exp(mean), np.ascontiguousarray(np.exp(logarithms - mean[:, None]))))
    return given


def check_profiles(smoothness: list[Smoothness], segments: int, which: str) -> bool:
    """Return whether λ of segments is given. `which` describes the knots.

    Raises
    ------
    ValidationError
        If the number of segments differs from that of the knots.
    """
    profiles = [given.profile for given in smoothness if given.profile is not None]
    for profile in profiles:
        if profile.shape[-1] != segments:
            raise ValidationError(
                f"lam has {profile.shape[-1]} numbers per curve, one per segment, but {which} have {segments} "
                "segments. To repeat a fit, pass knots=curve.t and lam=curve.lam_at(x) with the middles x of its "
                "segments."
            )
    return bool(profiles)


def read_adaptive_noise(space: Space, spaces: tuple[Space, ...], noise: Any) -> list[bool]:
    """Return for each of the smoothed spaces whether the noise varies along the curve if the data require it."""
    entries = _entries(space, spaces, noise, "noise")
    return [one_of(entry, "noise", "constant", "adaptive") == "adaptive" for entry in entries]


def _one_per_curve(value: Any, name: str, batch: tuple[int, ...], infinite: bool) -> Doubles:
    if value is None:
        return np.full(math.prod(batch), np.nan)
    array = np.asarray(value)
    if array.dtype.kind not in "iuf" or array.shape not in ((), batch):
        others = f" or an array of shape {batch}" if batch else ""
        raise ValidationError(f"{name} must be a number{others}, not {short_repr(value)}")
    allowed = ">= 0" if infinite else "finite and >= 0"
    refuse(~((array >= 0) & (infinite | np.isfinite(array))), name, lambda i: f"must be {allowed}, not {array[i]}")
    return np.ascontiguousarray(np.broadcast_to(array, batch), np.float64).ravel()


# ---- data ----

# The cube of the time between the first and the last datum must not overflow.
_LONGEST = 1e100


class SmoothingData(NamedTuple):
    """Noisy data of curves after validation.

    Attributes
    ----------
    time_axis : TimeAxis
        Conversion of times.
    t : ndarray, shape (N,) or (..., N)
        Times as the user sees them.
    times : ndarray
        The same times as the core counts them.
    points : list of ndarray
        Points on the space in every factor. Data of weight zero are replaced by others; masked curves are NaN.
    noise : list of Noise
        Noise in every space in which data are smoothed.
    batch : tuple of int
        Batch axes.
    """

    time_axis: TimeAxis
    t: Array
    times: Doubles
    points: list[Array]
    noise: list[Noise]
    batch: tuple[int, ...]

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which data have a nonzero weight in some factor, shape (N,) or (..., N)."""
        used = self.noise[0].weights > 0
        for noise in self.noise[1:]:
            used = used | (noise.weights > 0)
        return used

    def map(self, function: Callable[[Array], Array], batch: tuple[int, ...]) -> SmoothingData:
        """Apply a function to the arrays that have batch axes, such as the selection of some curves."""
        t, times = (x if x.ndim == 1 else function(x) for x in (self.t, self.times))
        points, noise = [function(rows) for rows in self.points], [noise.map(function) for noise in self.noise]
        return self._replace(t=t, times=times, points=points, noise=noise, batch=batch)

    def rows(self, index: NDArray[np.intp]) -> SmoothingData:
        """Return some of the data of each curve."""
        points = [np.take(rows, index, axis=len(self.batch)) for rows in self.points]
        noise = [noise.rows(index) for noise in self.noise]
        return self._replace(t=self.t[..., index], times=self.times[..., index], points=points, noise=noise)


Ends = list[list[End] | None]


def read_noisy(
    t: TimesLike | None,
    points: PointsLike,
    space: Space,
    spaces: tuple[Space, ...],
    weights: Numbers | None,
    frames: Numbers | None,
    sigma: Numbers | None,
    loss: str,
    bc_type: SmoothingBCType,
    atol: float | None,
) -> tuple[SmoothingData, list[Points], Ends]:
    """Return the data of a user without points, the points in every factor, and the end conditions.

    The points are not checked. They are smoothed in `spaces`.

    Raises
    ------
    ValidationError
        If another argument is invalid.
    """
    data = read(points, space)
    if atol is not None:
        data = with_atol(data, atol)
    batch, count = data[0].batch, data[0].nodes
    time_axis, shown_times, times = knots_of(t, batch, count)
    refuse_nan_times(times)
    back = np.argwhere(np.diff(times) < 0)
    if len(back):
        *curve, i = back[0].tolist()
        later, earlier = shown_times[(*curve, i + 1)], shown_times[(*curve, i)]
        raise ValidationError(
            f"t{[*curve, i + 1]} = {later} is before t{[*curve, i]} = {earlier}. Sort times and points together, for "
            "instance with order = np.argsort(t)."
        )
    if np.any(times[..., -1] / 2 - times[..., 0] / 2 > _LONGEST):
        raise ValidationError(f"t spans more than {_LONGEST:.0e}, too much for smoothing. Choose another unit of time.")
    given = [Noise(np.ones(count), None)] * len(spaces)
    if weights is not None or frames is not None:
        given = read_precision(weights, frames, space, data)
    if weights is not None:
        pairs = zip(data, grouped(space, given), strict=True)
        data = [_without_missing(part, [one.weights for one in noise_of_factor]) for part, noise_of_factor in pairs]
    if space._has_quotients:
        bc_type = moved_ends(bc_type, space, data)
    ends = read_ends(bc_type, space, batch)
    sigmas = per_part(space, spaces, sigma, "sigma", batch)
    # Two points have no outliers and do not determine the noise level.
    loss = "linear" if count == 2 else loss
    noise = []
    for part, of_part in zip(given, sigmas, strict=True):
        noise.append(part._replace(sigma=of_part, loss=loss))
    return SmoothingData(time_axis, shown_times, times, [], noise, batch), data, ends


def checked_ends(bc_type: SmoothingBCType | None, penalty: object, method: object) -> SmoothingBCType:
    """Return the end conditions, by default those that belong to the penalty.

    Raises
    ------
    ValidationError
        If the penalty is unknown, or the end conditions or the method are not available for it.
    """
    if one_of(penalty, "penalty", "acceleration", "jerk") == "jerk":
        if isinstance(method, str) and method == "newton":
            raise ValidationError("method='newton' is not available for penalty='jerk'. Use 'auto' or 'linearized'.")
        if bc_type is not None and not (isinstance(bc_type, str) and bc_type in ("not-a-knot", "periodic")):
            raise ValidationError(
                f"bc_type {short_repr(bc_type)} is not available for penalty='jerk', whose ends are free. Use "
                "'not-a-knot' or 'periodic'."
            )
        return bc_type or "not-a-knot"
    if bc_type is None:
        return "natural"
    if not isinstance(bc_type, str):
        split_ends(bc_type)
    for kind in end_kinds(bc_type) or []:
        if kind not in ("natural", "velocity"):
            raise ValidationError(
                f"bc_type {kind!r} is not available for smoothing splines. Use 'natural', 'clamped', 'periodic' or "
                "(1, velocity)."
            )
    return bc_type


def valid_curves(
    noisy: SmoothingData, data: list[Points], ends: Ends, space: Space, mask: NDArray[np.bool_] | None, strict: bool
) -> tuple[SmoothingData, Ends, NDArray[np.intp] | None, list[Fault]]:
    """Select the valid curves of the mask, and project their points onto the space.

    Returns
    -------
    noisy : SmoothingData
        The data of these curves. If some curves are masked, there is one batch axis.
    ends : list
        Their end conditions in every factor.
    chosen : ndarray of int or None
        Their indices in the batch of the user; None for all curves.
    faults : list of Fault
        Faults of curves that became masked.

    Raises
    ------
    ValidationError
        If a point is invalid, or a curve has data at fewer than two times. Unless `strict`, such curves of a batch are
        masked instead.
    """
    batch = noisy.batch
    skip = bool(batch) and not strict
    # Only points are checked here. Times may repeat, knots need not be times of the data, and the ends of a closed
    # curve are noisy and differ.
    plain = np.arange(data[0].nodes, dtype=np.float64)
    conditions: Ends = [NATURAL] * len(ends) if ends[0] is None else ends
    points, faults = validated(space, plain, data, conditions, skip, mask)
    noisy = noisy._replace(points=points)
    kept = np.ones(batch, bool) if mask is None else mask.copy()
    for fault in faults:
        kept.flat[fault.curve] = False
    for noise in noisy.noise:
        for number in np.flatnonzero(kept & ~_enough(noisy.times, noise.weights, batch)).tolist():
            too_few = _too_few(noise.weights, batch, number)
            if not skip:
                raise ValidationError(too_few)
            faults.append(Fault(number, INVALID, too_few))
            kept.flat[number] = False
    if kept.all():
        return noisy, ends, None, faults
    chosen = np.flatnonzero(kept)

    def rows(array: Array) -> Array:
        return np.ascontiguousarray(array.reshape(-1, *array.shape[len(batch) :])[chosen])

    noisy = noisy.map(rows, (len(chosen),))
    noisy = noisy._replace(noise=[noise._replace(sigma=noise.sigma[chosen]) for noise in noisy.noise])
    return noisy, [map_ends(end, rows) for end in ends], chosen, faults


def _without_missing(part: Points, weights: list[Doubles]) -> Points:
    """Replace points of weight zero, which may be NaN, by the last point with a weight before them.

    Points without such a predecessor become the first point that has a weight.
    """
    shape = (*part.batch, part.nodes)
    missing = reduce(np.logical_and, [np.broadcast_to(of_part == 0, shape) for of_part in weights])
    if not missing.any():
        return part
    order = np.arange(part.nodes)
    last = np.maximum.accumulate(np.where(missing, -1, order), axis=-1)
    first = np.argmin(missing, axis=-1)[..., None]
    nearest = np.where(last < 0, first, last)
    axes = part.numbers.ndim - nearest.ndim
    doubles = np.take_along_axis(part.numbers, nearest.reshape(*nearest.shape, *[1] * axes), axis=nearest.ndim - 1)
    return part._replace(numbers=np.ascontiguousarray(doubles))


def _enough(times: Doubles, weights: Doubles, batch: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return which curves have data at two or more different times."""
    shape = (*batch, times.shape[-1])
    used, times_of_curves = np.broadcast_to(weights > 0, shape), np.broadcast_to(times, shape)
    first, last = np.where(used, times_of_curves, np.inf).min(-1), np.where(used, times_of_curves, -np.inf).max(-1)
    return np.asarray(last > first)


def _too_few(weights: Doubles, batch: tuple[int, ...], number: int) -> str:
    index = np.unravel_index(number, batch)
    of = f" of curve {','.join(map(str, index))}" if batch else ""
    weights_of_curve = weights[index] if weights.ndim > 1 else weights
    if not np.any(weights_of_curve > 0):
        return f"All weights of the data{of} are 0. A curve needs points at two or more times."
    return f"The data{of} have one time only. A curve needs points at two or more times."


class Part(NamedTuple):
    """Data in one of the spaces in which they are smoothed.

    Attributes
    ----------
    space : Space
        The space.
    points : ndarray, shape (..., N, *point_shape)
        Points.
    noise : Noise
        Their noise.
    lam : ndarray, shape (curves,)
        λ, infinite for geodesics and NaN where it is chosen.
    ends : list of End or None
        End conditions; None for closed curves.
    profile : ndarray or None, shape (curves, K - 1)
        Given λ of the segments, divided by `lam`.
    adapts : tuple of bool
        Whether λ and σ vary along the curve if the data require it.
    """

    space: Space
    points: Array
    noise: Noise
    lam: Doubles
    ends: list[End] | None
    profile: Doubles | None = None
    adapts: tuple[bool, bool] = (False, False)

    @property
    def axis(self) -> int:
        """The axis of the data among those of the points."""
        return self.points.ndim - len(self.space.point_shape) - 1

    def map(self, function: Callable[[Array], Array], noise: Noise) -> Part:
        """Apply a function to the arrays, such as one that adds masked curves, and replace the noise."""
        ends = map_ends(self.ends, function)
        return self._replace(points=function(self.points), noise=noise, lam=function(self.lam), ends=ends)

    def rows(self, index: NDArray[np.intp]) -> Part:
        """Return some of the data of each curve, with natural ends."""
        points, noise = np.take(self.points, index, axis=self.axis), self.noise.rows(index)
        return self._replace(points=points, noise=noise, ends=NATURAL, adapts=(False, False))


def parts_of(
    noisy: SmoothingData,
    space: Space,
    spaces: tuple[Space, ...],
    smoothness: list[Smoothness],
    adapts: list[bool],
    ends: Ends,
) -> list[Part]:
    """Return the data in every space in which they are smoothed, with the end conditions of the factors.

    The noise may vary in the spaces where `adapts` is True.
    """
    arrays: list[Array] = []
    conditions: list[list[End] | None] = []
    for factor, points, of_factor in zip(factors_of(space), noisy.points, ends, strict=True):
        arrays += split(factor, points)
        conditions += split_end_vectors(factor, of_factor)
    return [
        Part(space_of_part, points, noise, given.lam, ends_of_part, given.profile, (given.adapts, noise_adapts))
        for space_of_part, points, noise, given, noise_adapts, ends_of_part in zip(
            spaces, arrays, noisy.noise, smoothness, adapts, conditions, strict=True
        )
    ]
