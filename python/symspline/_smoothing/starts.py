"""Further starts of the smoothing, for data for which the objective has several minima.

The core starts from means of neighbouring data. If the noise is a large fraction of the distance to the cut locus, or
consecutive data are far apart, the iteration may end in a minimum that is not the global one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._base.warnings import warn
from .._curves.representatives import cut_fractions
from .._spaces import (
    Array,
    ComplexGrassmannian,
    ComplexProjective,
    Doubles,
    Euclidean,
    Grassmannian,
    RealProjective,
    Space,
    SpecialOrthogonal,
    Sphere,
    Torus,
    nearest_rotations,
)
from .factors import smoothed_spaces
from .report import SmoothingReport
from .warned import SmoothingWarning, first_affected

# Standard deviation of the noise, divided by the injectivity radius, from which a second start is tried: 34° on a
# circle. In all experiments with less noise, the first start led to the best minimum.
_NOISY = 0.19
# The same ratio from which the best minimum found may be a wrong one: 52° on a circle.
_TOO_NOISY = 0.29
# Median step between the data, as a fraction of the distance to the cut locus, from which the data are a start, unless
# the noise of the curve found is less than the second number times the injectivity radius.
_FAST, _SMALL = 0.6, 0.05
# Noise, divided by the injectivity radius, from which the curve of data with far steps may be wrong.
_FAST_NOISY = 0.03
# Objectives that differ by less than this multiple of the variance are nearly equal. Curves are different if they are
# farther apart than this fraction of the injectivity radius.
_EQUAL, _OTHER = 12.0, 0.5
# Largest number of coordinates of an embedding.
_WIDE = 64
# Lengths of the windows in which the most frequent step is determined, and the number of data up to which all of these
# lengths are tried.
_WINDOWS, _LONG = (11, 21, 41), 20_000

# Kinds of results that may be wrong.
UNIQUE, TWO, NOISY, FAST = range(4)


class Raw(NamedTuple):
    """Results of the core for a batch of curves: points at the knots, the band of A⁻¹, columns of the report, A."""

    points: Doubles
    band: Doubles
    columns: tuple[NDArray[Any], ...]
    system: tuple[Doubles, Doubles, int]

    @property
    def converged(self) -> NDArray[np.bool_]:
        """Whether the curves converged."""
        return np.asarray(self.columns[0] == 0)

    def where(self, chosen: NDArray[np.bool_], other: Raw) -> Raw:
        """Return the chosen curves from the other results, and all others from these."""
        if chosen.all() or (chosen.any() and self.system[2] != other.system[2]):
            return other
        if not chosen.any():
            return self

        def pick(own: Any, its: Any) -> Any:
            flat = own.reshape(len(chosen), -1), its.reshape(len(chosen), -1)
            return np.where(chosen[:, None], flat[1], flat[0]).reshape(own.shape)

        columns = tuple(map(pick, self.columns, other.columns))
        matrix, turn = map(pick, self.system[:2], other.system[:2])
        return Raw(
            pick(self.points, other.points), pick(self.band, other.band), columns, (matrix, turn, self.system[2])
        )


class Column:
    """Positions of columns of the report."""

    LAM, SIGMA, OBJECTIVE = 2, 6, -1


class Samples(NamedTuple):
    """Data of a batch of curves: times (N,) or (..., N), points with `axes` axes of a point, weights, and knots."""

    times: Doubles
    points: Array
    weights: Doubles
    knots: Doubles
    axes: int
    closed: bool


Solve = Callable[[Doubles, Doubles | None], Raw]
"""Function that smooths with given λ (NaN to choose λ) and initial points at the knots."""


def best_of_starts(space: Space, data: Samples, lam: Doubles, solve: Solve) -> tuple[Raw, NDArray[np.int_]]:
    """Smooth from the start of the core, and from further starts where its result may not be the best.

    Returns
    -------
    tuple
        The best results, and their kinds: one of `UNIQUE`, `TWO`, `NOISY`, `FAST` for each curve.
    """
    first = solve(lam, None)
    kinds = np.zeros(lam.size, int)
    radius = space.injectivity_radius
    if not (np.isfinite(radius) and radius > 0) or not lam.size:
        return first, kinds
    radii = radius * np.sqrt(_usual_weights(data, lam.size))
    fast = _median_steps(space, data) > _FAST
    noisy = _noise(first) > _NOISY * radii
    if not (noisy | fast).any():
        return first, kinds
    best = first
    if fast.any():
        for start in _fast_starts(space, data):
            if not (fast & (_noise(best) > _SMALL * radii)).any():
                break
            other = solve(lam, start)
            chooses = np.isnan(lam)
            less = np.where(chooses, _noise(other) < 0.7 * _noise(best), _is_less(other, best))
            best = best.where(fast & other.converged & (less | ~best.converged), other)
    noisy = _noise(best) > _NOISY * radii
    if noisy.any():
        given = np.where(best.converged, best.columns[Column.LAM], lam)
        inside = _embedded_start(space, data, given)
        if inside is not None:
            other = solve(given, inside)
            both = best.converged & other.converged
            apart = _apart(space, best.points, other.points) > _OTHER * radius
            variance = _noise(best) ** 2
            differ = np.abs(other.columns[Column.OBJECTIVE] - best.columns[Column.OBJECTIVE])
            kinds[noisy & both & apart & (differ < _EQUAL * variance)] = TWO
            best = best.where(noisy & other.converged & (_is_less(other, best) | ~best.converged), other)
    kinds[(kinds == UNIQUE) & ~fast & (_noise(best) > _TOO_NOISY * radii)] = NOISY
    kinds[fast & (_noise(best) > _FAST_NOISY * radii)] = FAST
    return best, kinds


def _usual_weights(data: Samples, curves: int) -> Doubles:
    """Return the median weight of every curve, because noise levels refer to weight one."""
    rows = data.weights.reshape(-1, data.weights.shape[-1])
    return np.array([np.median(own[own > 0]) if (own > 0).any() else 1.0 for own in rows]) * np.ones(curves)


def _noise(raw: Raw) -> Doubles:
    """Return the noise levels, infinite for curves that did not converge."""
    return np.where(raw.converged, raw.columns[Column.SIGMA], np.inf)


def _is_less(other: Raw, best: Raw) -> NDArray[np.bool_]:
    return np.asarray(other.columns[Column.OBJECTIVE] < best.columns[Column.OBJECTIVE] * (1 - 1e-6))


def _apart(space: Space, p: Doubles, q: Doubles) -> Doubles:
    """Return the largest distance between two curves at their knots."""
    a, b = space._numbers(p), space._numbers(q)
    good = space._where_finite(a) & space._where_finite(b)
    found = np.zeros(good.shape)
    found[good] = space._apply("distance", p=a[good], q=b[good])
    found[~np.isfinite(found)] = space.injectivity_radius
    rows = found.reshape(-1, p.shape[found.ndim - 1])
    return np.asarray(rows.max(axis=-1))


def _median_steps(space: Space, data: Samples) -> Doubles:
    """Return the median step of every curve, as a fraction of the distance to the cut locus."""
    fractions = cut_fractions(space, data.points)
    rows = fractions.reshape(-1, fractions.shape[-1])
    if data.weights.all() and np.isfinite(rows).all():
        return np.asarray(np.median(rows, axis=-1))
    weights = np.broadcast_to(data.weights, (*data.points.shape[: fractions.ndim - 1], data.weights.shape[-1]))
    used = weights.reshape(len(rows), -1) > 0
    rows = np.where(used[:, 1:] & used[:, :-1], rows, np.nan)
    known = np.isfinite(rows).any(axis=-1)
    found = np.zeros(len(rows))
    if known.any():
        found[known] = np.nanmedian(rows[known], axis=-1)
    return found


def warn_of_minima(space: Space, kinds: list[Any], reports: list[SmoothingReport]) -> list[NDArray[np.bool_]]:
    """Warn once if a curve may not be the one with the least objective.

    Parameters
    ----------
    kinds : list of ndarray of int
        Kinds of the results in every space in which data were smoothed, with the batch axes.
    reports : list of SmoothingReport
        Reports of the same.

    Returns
    -------
    list of ndarray of bool
        Whether the curves of every space are known to be the best ones, so that other warnings apply.
    """
    sound = [np.asarray(own) == UNIQUE for own in kinds]
    bad = [~good & np.asarray(report.converged) for good, report in zip(sound, reports, strict=True)]
    if first := first_affected(space, bad, ","):
        number, index, of = first
        noise = f"{float(np.asarray(reports[number].sigma)[index]):.2g}"
        message = _MESSAGES[int(np.asarray(kinds[number])[index])]
        warn(message.format(of=of, noise=noise, space=smoothed_spaces(space)[number]), SmoothingWarning, index)
    return sound


_MESSAGES = {
    TWO: (
        "Two curves fit the data{of} nearly equally well (noise {noise}): they go around {space!r} in different ways. "
        "The better one was returned. Plot it, and sample more often, or pass weights of 0 for wrong data."
    ),
    NOISY: (
        "The noise of the data{of}, {noise} per coordinate, is so large a part of the distance to the cut locus of "
        "{space!r} that the curve may go around it in the wrong way. Check the units of angles. Plot the curve, and "
        "sample more often, or pass a larger lam, or weights of 0 for wrong data."
    ),
    FAST: (
        "The data{of} turn by more than half of the distance to the cut locus of {space!r} from one to the next, and "
        "their noise is {noise}, so that the curve may turn by wrong angles. Sample more often. If the angular "
        "velocity is known, remove this rotation from the data first."
    ),
}


# ---- consecutive data that are far apart ----


def _fast_starts(space: Space, data: Samples) -> Iterator[Doubles]:
    """Yield the data themselves, and on rotations a slow path times a path that turns by the most frequent step."""
    near = _nearest(data)
    lead = data.points.ndim - data.axes - 1

    def at_knots(points: Array) -> Doubles:
        flat = points.reshape(-1, *points.shape[lead:])
        rows = np.stack([own[index] for own, index in zip(flat, near, strict=True)])
        shaped = rows.reshape(*points.shape[:lead], *rows.shape[1:])
        return np.ascontiguousarray(space._as_doubles(np.ascontiguousarray(shaped)))

    yield at_knots(data.points)
    if isinstance(space, SpecialOrthogonal):
        flat = data.points.reshape(-1, *data.points.shape[lead:])
        # The data are slow · turn, or turn · slow.
        turns, fixed = (np.stack(own) for own in zip(*(_modal_turn(space, own) for own in flat), strict=True))
        turns, fixed = turns.reshape(data.points.shape), fixed.reshape(*data.points.shape[:lead], 1, 1, 1)
        back = np.swapaxes(turns, -1, -2)
        slow = np.ascontiguousarray(np.where(fixed, back @ data.points, data.points @ back))
        smooth = _linear(space, data, space._as_doubles(slow), np.full(len(flat), np.nan))
        if smooth is not None:
            found, turn = space._numbers(smooth), space._numbers(at_knots(turns))
            whole = np.ascontiguousarray(np.where(fixed, turn @ found, found @ turn))
            yield np.ascontiguousarray(space._as_doubles(whole))


def _nearest(data: Samples) -> NDArray[np.intp]:
    """Return the index of the datum nearest to each knot, one row per curve."""
    lead = data.points.shape[: data.points.ndim - data.axes - 1]
    times = np.broadcast_to(data.times, (*lead, data.times.shape[-1])).reshape(-1, data.times.shape[-1])
    knots = np.broadcast_to(data.knots, (*lead, data.knots.shape[-1])).reshape(-1, data.knots.shape[-1])
    rows = []
    for t, at in zip(times, knots, strict=True):
        after = np.clip(np.searchsorted(t, at), 1, len(t) - 1)
        rows.append(np.where(at - t[after - 1] < t[after] - at, after - 1, after))
    return np.array(rows)


def _modal_turn(space: Space, points: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return the path from the identity that turns by the most frequent step nearby, and whether in the fixed frame.

    The frame (moving or fixed) and the length of the windows are those for which the remaining steps are shortest.
    """
    count, identity = len(points), np.eye(points.shape[-1])
    best, turn, in_fixed = np.inf, points, False
    for fixed in (False, True):
        # Steps in the fixed frame are those of the inverse in the moving frame.
        own = np.swapaxes(points, -1, -2) if fixed else points
        steps = np.ascontiguousarray(np.swapaxes(own[:-1], -1, -2) @ own[1:])
        vectors = space._apply("log", p=np.broadcast_to(identity, steps.shape), q=steps).reshape(count - 1, -1)
        for window in _WINDOWS if count <= _LONG else _WINDOWS[1:2]:
            usual = _modes(vectors, min(window, count - 1)).reshape(steps.shape)
            each = space._apply("exp", p=np.broadcast_to(identity, steps.shape), v=usual)
            path = np.empty_like(points)
            path[0] = identity
            for i, step in enumerate(each):
                path[i + 1] = path[i] @ step
            rest = np.ascontiguousarray(own @ np.swapaxes(path, -1, -2))
            length = float(np.nanquantile(space._apply("distance", p=rest[:-1], q=rest[1:]), 0.25))
            if length < best:
                best, turn, in_fixed = length, np.swapaxes(path, -1, -2) if fixed else path, fixed
    return turn, np.array(in_fixed)


def _modes(vectors: Doubles, window: int) -> Doubles:
    """Return the mean of the vectors near the mode of each window."""
    half = window // 2
    padded = np.pad(vectors, ((half, window - half - 1), (0, 0)), mode="edge")
    rows = np.swapaxes(np.lib.stride_tricks.sliding_window_view(padded, window, axis=0), -1, -2)
    squares = np.einsum("nik,nik->ni", rows, rows)
    apart = squares[:, :, None] + squares[:, None, :] - 2 * rows @ np.swapaxes(rows, -1, -2)
    apart = np.sqrt(np.maximum(apart, 0))
    rank = max(2, window // 4)
    radii = np.partition(apart, min(rank, window - 1), axis=-1)[..., min(rank, window - 1)]
    centre = radii.argmin(axis=-1)
    each = np.arange(len(rows))
    near = apart[each, centre] <= 2 * radii[each, centre][:, None] + 1e-12
    return np.asarray((rows * near[..., None]).sum(axis=1) / near.sum(axis=1)[:, None])


# ---- data with much noise ----


def _embedded_start(space: Space, data: Samples, lam: Doubles) -> Doubles | None:
    """Return the data smoothed in the embedding Euclidean space and projected; None without a known embedding."""
    x = data.points
    if isinstance(space, Torus):
        inside = np.concatenate([np.cos(x), np.sin(x)], axis=-1)
    elif isinstance(space, (Sphere, SpecialOrthogonal)):
        inside = x
    elif isinstance(space, (RealProjective, ComplexProjective, Grassmannian, ComplexGrassmannian)):
        columns = x[..., None] if isinstance(space, (RealProjective, ComplexProjective)) else x
        inside = columns @ np.swapaxes(columns.conj(), -1, -2)
    else:
        return None
    lead = x.shape[: x.ndim - len(space.point_shape)]
    flat = np.ascontiguousarray(inside).view(np.float64).reshape(*lead, -1)
    if flat.shape[-1] > _WIDE:
        return None
    found = _linear(Euclidean(flat.shape[-1]), data, np.ascontiguousarray(flat), lam)
    if found is None:
        return None
    near = np.ascontiguousarray(found).view(inside.dtype).reshape(*found.shape[:-1], *inside.shape[len(lead) :])
    return np.ascontiguousarray(space._as_doubles(np.ascontiguousarray(_projected(space, near))))


def _projected(space: Space, x: Array) -> Array:
    if isinstance(space, Torus):
        cos, sin = np.split(x, 2, axis=-1)
        return np.asarray(np.arctan2(sin, cos))
    if isinstance(space, Sphere):
        return np.asarray(x / np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), np.finfo(float).tiny))
    if isinstance(space, SpecialOrthogonal):
        return nearest_rotations(x)
    _, vectors = np.linalg.eigh(x)
    if isinstance(space, (RealProjective, ComplexProjective)):
        return vectors[..., -1]
    return vectors[..., -space.point_shape[-1] :]


def _linear(space: Space, data: Samples, points: Doubles, lam: Doubles) -> Doubles | None:
    """Return the points at the knots of a curve that is smoothed by least squares; None if it does not exist."""
    sigma, closed = np.full(lam.size, np.nan), None if data.closed else [("natural", None)] * 2
    options = "gcv", 1.4, "acceleration", "linear", "auto", 1e-2, 50, False
    found = _core.smooth(
        space._handle, data.times, points, data.weights, None, data.knots, lam, sigma, closed, *options, None, None
    )[0]
    return found if np.isfinite(found).all() else None
