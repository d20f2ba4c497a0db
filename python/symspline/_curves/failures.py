"""Errors and warnings about curves that failed, far points, signs of quaternions and repeated points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.faults import CUT_LOCUS, Fault, of_index, warn
from .._base.report import MAX_STEP, Columns, ConvergenceWarning, FarPointsWarning, long_gaps
from .._base.typing import Array, BatchIndex
from .._core import ConvergenceError, CutLocusError, ValidationError
from .._spaces import (
    AnySpace,
    Doubles,
    Euclidean,
    Space,
    SpecialEuclidean,
    SpecialOrthogonal,
    Sphere,
    Torus,
    Unitary,
    cover_of,
    factors_of,
)
from ..manifolds import Manifold
from .curve import CurveArrays
from .fit import Points

# The times are considered the reason if an interval is shorter than its neighbours by this factor, and if its speed
# exceeds the median by the same factor.
_CLOSE = 10
_ERRORS: dict[str, type[Exception]] = {CUT_LOCUS: CutLocusError}


def raise_or_warn(faults: list[Fault], on_failure: str, spline: Any) -> None:
    """Raise an error or warn about failed curves, with the fitted curves attached.

    Parameters
    ----------
    faults : list of Fault
        Faults in the order of curves.
    on_failure : {"raise", "warn", "ignore"}
        Policy of the user.
    spline : curve, batch of curves, or list of curves
        The fitted curves, which become the attribute ``spline`` of the error.
    """
    batch = (len(spline),) if isinstance(spline, (list, tuple)) else spline._batch
    failed = [fault for fault in faults if fault.failed]
    if failed and on_failure != "ignore":
        first = _explained_by_times(failed[0], batch, spline)
        message = first.message(batch) + _more(failed, "curves failed")
        if on_failure == "raise":
            error: Any = _ERRORS.get(first.kind, ConvergenceError)(message)
            error.spline = spline
            error.curve = first.batch_index(batch)
            error.node, error.value, error.limit = first.node, first.value, first.limit
            raise error
        warn(message, ConvergenceWarning, first.batch_index(batch), first.node)
    almost = [fault for fault in faults if not fault.failed]
    if almost:
        message = almost[0].message(batch) + _more(almost, "curves")
        warn(message, UserWarning, almost[0].batch_index(batch), almost[0].node)


def _explained_by_times(fault: Fault, batch: tuple[int, ...], spline: Any) -> Fault:
    """Return the fault with a remedy that names two times between which no curve suits the points, if there are any.

    They are either too close together for their points, or the ends of a long gap. The first of them becomes the node
    of a fault that has none.

    Notes
    -----
    An interval of length h between points at a distance d requires the speed d/h at both of its ends. Where h is far
    shorter than its neighbours, this speed moves the curve in them much farther than their points are apart. Where h
    is far longer, the speed of the neighbours moves the curve in it much farther.
    """
    if not fault.about_times:
        return fault
    single = isinstance(spline, (list, tuple))
    curve = spline[fault.curve] if single else spline
    index = np.unravel_index(fault.curve, batch) if batch and not single else ()
    times = curve._times[index] if curve._times.ndim > 1 else curve._times
    h = np.diff(times)
    if len(h) < 2:
        return fault
    steps_and_turns = _steps(curve._curve.parts, index)
    if steps_and_turns is None:
        return fault
    step, turns = steps_and_turns
    around = np.minimum(np.append(np.inf, h[:-1]), np.append(h[1:], np.inf))
    i, longest = int(np.argmax(around / h)), int(np.argmax(h))
    t = curve._t[index] if curve._t.ndim > 1 else curve._t
    close, speed = around[i] / h[i], np.median(step / h)
    is_close = close > _CLOSE and step[i] / h[i] > _CLOSE * speed
    is_gap = long_gaps(times)[longest] and h[longest] * np.median(turns / h) > 0.5
    if is_close and not (is_gap and h[longest] * speed > close * step[i]):
        remedy = (
            f"t[{i}] = {t[i]} and t[{i + 1}] = {t[i + 1]} are too close for the distance {step[i]:.3g} between "
            "their points: merge the two samples, smooth the data with make_smoothing_spline, or correct the times"
        )
    elif is_gap:
        i = longest
        remedy = (
            f"there are no data between t[{i}] = {t[i]} and t[{i + 1}] = {t[i + 1]}, a gap of "
            f"{h[i] / np.median(h):.0f} median steps, in which the curve would go far away: cut it there "
            "(fit_segments), or smooth noisy data (make_smoothing_spline)"
        )
    else:
        return fault
    return fault._replace(remedy=remedy, node=i if fault.node is None else fault.node)


def _steps(parts: Any, index: BatchIndex) -> tuple[Array, Array] | None:
    """Return the distances between neighbouring points of a curve, and the largest of them in injectivity radii.

    The result is None if neighbours are close to a cut locus, which is then the reason of the fault.
    """
    steps, ratios = [], []
    for part in parts:
        space, points = part.space, part.points[index]
        if isinstance(space, SpecialEuclidean):
            # The cut locus limits rotations only.
            limited, rotations = (
                SpecialOrthogonal(space.point_shape[0] - 1),
                np.ascontiguousarray(points[..., :-1, :-1]),
            )
        else:
            limited, rotations = space, points
        with np.errstate(all="ignore"):
            try:
                steps.append(np.asarray(space.distance(points[:-1], points[1:])))
                ratios.append(limited.distance(rotations[:-1], rotations[1:]) / limited.injectivity_radius)
            except (CutLocusError, ValidationError):
                return None
    turns = np.max(ratios, axis=0)
    return (np.linalg.norm(steps, axis=0), turns) if turns.max() <= 0.5 else None


def _more(faults: list[Fault], what: str) -> str:
    return f" (and {len(faults) - 1} more {what})" if len(faults) > 1 else ""


# ---- warnings about neighbouring points in inconsistent representations ----

# The fraction of the cut angle from which several C² curves are common, see docs/solvers_tables.md.
FAR = 0.6
# Fewer steps are too few to show a pattern.
_LEAST = 4
# Points closer to each other than this, slightly less than π/2, have a positive inner product.
_NEAR = 1.57
# Remedies for quaternions of opposite sign, for users of the Python interface.
IN_PYTHON = (
    "For rotations, use so:3 (symspline.rotations.from_quaternions returns its points) or rp:3, where q and -q are the "
    "same point. For other data, silence this warning with "
    "warnings.filterwarnings('ignore', message='neighbours of opposite sign')"
)


def warn_of_representatives(
    space: AnySpace,
    points: Sequence[list[Points] | None],
    curves: Sequence[CurveArrays],
    longest_steps: Sequence[Sequence[Columns | Doubles]],
) -> None:
    """Warn about signs and about far points, for curves through their points.

    Parameters
    ----------
    points : sequence of list of Points
        The given points of each curve in every factor. A batch counts as one curve. None for masked curves.
    curves, longest_steps
        As for `warn_of_far_points`.
    """
    for curve, of_factors in zip(curves, longest_steps, strict=True):
        for (factor, *_), steps in zip(curve.factors, of_factors, strict=True):
            limit = factor.__dict__.get("_longest_near_step") or _longest_near_step(factor)
            longest = steps.numbers[MAX_STEP] if isinstance(steps, Columns) else steps
            # Operations on arrays would take longer than the rest of this module's work for one curve.
            if longest.item() > limit if longest.size == 1 else (longest > limit).any():
                warn_of_signs(space, [None if parts is None else [part.numbers for part in parts] for parts in points])
                warn_of_far_points(curves, longest_steps)
                return


def _longest_near_step(space: AnySpace) -> float:
    """Return the longest step that never leads to a warning, cached for each space."""
    limit = FAR * space.injectivity_radius
    if _has_quaternions(space):
        limit = min(limit, _NEAR)
    space.__dict__["_longest_near_step"] = limit
    return limit


def _has_quaternions(space: AnySpace) -> bool:
    return isinstance(space, Sphere) and space._parameters == (3,)


# ---- quaternions of opposite sign ----


def warn_of_signs(space: AnySpace, curves: Sequence[list[Array] | None]) -> None:
    """Warn if neighbouring points on S³ are more than a quarter turn apart.

    As quaternions they would be closer with the opposite sign. The curve between them turns the long way round.

    Parameters
    ----------
    curves : sequence of list of ndarray
        The given points of each curve in every factor. A batch counts as one curve. None for masked curves.
    """
    pairs = []
    for number, parts in enumerate(curves):
        for points, factor in zip(parts or (), factors_of(space), strict=parts is not None):
            if _has_quaternions(factor):
                for index in _opposite(points):
                    pairs.append((number, index, points))
    if not pairs:
        return
    number, index, points = pairs[0]
    *batch, i = index.tolist()
    curve = [number] * (len(curves) > 1) + batch
    of, more = of_index(curve), f" (and {len(pairs) - 1} more pairs)" if len(pairs) > 1 else ""
    product = float(points[(*batch, i)] @ points[(*batch, i + 1)])
    message = (
        f"neighbours of opposite sign on sphere:3: points[{i}] and points[{i + 1}]{of} have inner product "
        f"{product:.3g}{more}. The quaternions q and -q are the same rotation, but here the curve turns the long way "
        f"round. {IN_PYTHON}"
    )
    warn(message, UserWarning, tuple(curve), i)


def _opposite(points: Array) -> NDArray[np.intp]:
    """Return the indices of points whose inner product with the next point is negative."""
    return np.argwhere(np.einsum("...i,...i", points[..., :-1, :], points[..., 1:, :]) < 0)


# ---- long steps ----


def warn_of_far_points(curves: Sequence[CurveArrays], longest_steps: Sequence[Sequence[Columns | Doubles]]) -> None:
    """Warn if more than half of the steps of a curve exceed 0.6 of the distance to the cut locus.

    Parameters
    ----------
    curves : sequence of CurveArrays
        The curves of one fit.
    longest_steps : sequence of sequence of Columns or ndarray
        The longest steps of each curve in every factor, or its reports. Points need not be examined if these are short.
    """
    far_curves: list[_Far] = []
    for number, curve in enumerate(curves):
        for part, steps in zip(curve.parts, longest_steps[number], strict=True):
            longest = steps.numbers[MAX_STEP] if isinstance(steps, Columns) else steps
            # The deciding angle never exceeds the distance.
            if (longest > FAR * part.space.injectivity_radius).any():
                # Curves that did not converge are reported elsewhere, according to `on_failure`.
                valid = steps.row("converged").reshape(curve.batch) if isinstance(steps, Columns) else True
                far_curves += _far_curves(part.space, part.points, valid, [number] * (len(curves) > 1))
    if far_curves:
        _warn_of_far(far_curves)


def warn_of_far_data(space: AnySpace, data: Sequence[Array]) -> bool:
    """Warn in the same way about data in every factor that a curve need not pass through, and return whether it did."""
    far_curves: list[_Far] = []
    for factor, points in zip(factors_of(space), data, strict=True):
        far_curves += _far_curves(factor, points)
    if far_curves:
        _warn_of_far(far_curves)
    return bool(far_curves)


class _Far(NamedTuple):
    """A curve with long steps: its index, the numbers of long and of all steps, and their space."""

    place: tuple[int, ...]
    far: int
    steps: int
    space: AnySpace


def _far_curves(space: AnySpace, points: Array, valid: Any = True, number: Sequence[int] = ()) -> list[_Far]:
    """Return the valid curves of a batch, in one factor, of which more than half of the steps are long."""
    steps = points.shape[-1 - len(space._point_shape)] - 1
    if steps < _LEAST or isinstance(space, Euclidean):
        return []
    far = np.where(valid, np.count_nonzero(cut_fractions(space, points) > FAR, axis=-1), 0)
    far_curves = []
    for index in map(tuple, np.argwhere(far > steps / 2).tolist()):
        far_curves.append(_Far((*number, *index), int(far[index]), steps, space))
    return far_curves


def _warn_of_far(far_curves: list[_Far]) -> None:
    place, count, steps, space = far_curves[0]
    of = of_index(place)
    others = len({place for place, *_ in far_curves}) - 1
    more = f" (and of {others} more curves)" if others else ""
    # Steps of degrees look like steps at random on a torus.
    angles = " Angles must be in radians." if isinstance(cover_of(space), Torus) else ""
    warn(
        f"more than half of the steps are long: {count} of {steps} steps between neighbouring points{of}{more} are "
        f"beyond {FAR} of the way to the cut locus of {cover_of(space)!r}, where several C² curves may exist.{angles} "
        "Where points have equivalent representatives, as orientations of crystals do, use a Quotient, whose method "
        "unwrap takes the one nearest to the previous point. Where phases, signs or bases do not count, use a "
        "Quotient, a projective space, or a Grassmannian, whose curves give continuous bases by their method lift. "
        "Otherwise put points in between.",
        FarPointsWarning,
        place,
    )


def cut_fractions(space: AnySpace, points: Array) -> Doubles:
    """Return the deciding angle between neighbouring points, divided by the angle at which the cut locus is reached.

    Parameters
    ----------
    space : Space
        A space that is not a product.
    points : ndarray, shape (..., N+1, *point_shape)
        Points.

    Returns
    -------
    ndarray, shape (..., N)
        NaN where a point is not finite or the fraction is unknown.
    """
    space = cover_of(space)
    finite = space._where_finite(points)
    good = finite[..., :-1] & finite[..., 1:]
    if not isinstance(space, (Manifold, Unitary)):
        return np.where(good, cut_fractions_in_core(space, points), np.nan)
    result = np.full(good.shape, np.nan)
    p, q = (x[good] for x in space._neighbours(points))
    if not len(p):
        return result
    if isinstance(space, Manifold):
        # The distance may be unknown on a manifold made of functions.
        with suppress(CutLocusError):
            result[good] = space.distance(p, q) / space.injectivity_radius
        return result
    # A random global phase alone is often below the limit. The root mean square of the angles, doubled, exceeds it more
    # often.
    rms = space.distance(p, q) / math.sqrt(space._parameters[0])
    result[good] = np.maximum(cut_fractions_in_core(space, points)[good], math.sqrt(2) * rms / math.pi)
    return result


def cut_fractions_in_core(space: Space, points: Array) -> Doubles:
    """Return the same, as the core computes it on its spaces; arbitrary where a point is not finite."""
    starts, ends = space._neighbours(space._as_doubles(np.ascontiguousarray(points)))
    fractions = space._handle.apply("cut_fraction", [np.ascontiguousarray(starts), np.ascontiguousarray(ends)])
    return fractions.reshape(starts.shape[: -len(space._point_shape)])


# ---- recordings in which the last point of a sensor was repeated at new times (sample and hold) ----

# Least number of points, and of runs of equal points that are not cut off at an end.
FEWEST_HELD, _RUNS = 12, 5
# Least share of copies among the points, and of runs with a copy: a body at rest is one long run.
_COPIES, _REPEATED = 0.2, 0.2
# Least share of runs that are not much longer than the median, and of runs whose point occurs in no other run. Points
# of low resolution differ: they return to earlier values, and stay the same longest where the motion reverses.
_REGULAR, _NEW = 0.9, 0.9


def warn_of_held_points(
    times: Array,
    points: list[Array],
    batch: tuple[int, ...],
    category: type[Warning] = UserWarning,
    name: str = "points",
    curve: tuple[int, ...] = (),
) -> bool:
    """Warn once if many points of a curve are exact copies of the point before, at a later time.

    Parameters
    ----------
    times : ndarray, shape (n,) or (*batch, n)
        Times.
    points : list of ndarray, shape (*batch, n, ...)
        Points in every factor.
    category : type
        Category of the warning.
    name : str
        Name of the points in the message.
    curve : tuple of int
        Leading indices of the curve, which precede those in the batch.

    Returns
    -------
    bool
        Whether the warning was issued.
    """
    axis, nodes = len(batch), times.shape[-1]
    if nodes < FEWEST_HELD or times.dtype.kind not in "iufM":
        return False
    for array in points:
        if array.dtype.kind not in "iufc":
            return False
        # Nearly always the first numbers of the points show that few are copies.
        first = array.reshape(-1)[:: math.prod(array.shape[axis + 1 :]) or 1]
        if np.count_nonzero(first[1:] == first[:-1]) < _COPIES * (nodes - 1):
            return False
    equal = np.broadcast_to(np.diff(times) > 0, (*batch, times.shape[-1] - 1))
    for array in points:
        rows = array.reshape(*array.shape[: axis + 1], -1)
        equal = equal & np.all(rows[..., 1:, :] == rows[..., :-1, :], axis=-1)
    shares = equal.mean(axis=-1)
    for index in map(tuple, np.argwhere(shares >= _COPIES).tolist()):
        if not _are_held(equal[index], [array[index].reshape(times.shape[-1], -1) for array in points]):
            continue
        i = int(np.argmax(equal[index]))
        axes = tuple(range(1, points[0].ndim - axis))
        of = of_index((*curve, *index))
        warn(
            f"{100 * shares[index]:.0f} % of the {name}{of} are exact copies of the point before at a later time, for "
            f"example {name}[{i + 1}]. The sensor was probably slower than the log, which repeated its last point. The "
            "curve has steps, and estimates of noise and velocities are wrong. Keep the first of equal points: "
            f"new = np.append(True, np.any({name}[1:] != {name}[:-1], axis={axes})); pass t[new] and {name}[new].",
            category,
            (*curve, *index),
            i + 1,
        )
        return True
    return False


def _are_held(equal: NDArray[np.bool_], points: list[Array]) -> bool:
    """Whether the runs of equal points are like those of a log that is faster than its sensor."""
    starts = np.append(0, np.flatnonzero(~equal) + 1)
    runs = np.diff(np.append(starts, len(equal) + 1))[1:-1]
    if len(runs) < _RUNS or np.mean(runs > 1) < _REPEATED:
        return False
    regular = np.mean(runs <= 2 * np.median(runs) + 1) >= _REGULAR
    values = np.concatenate([array[starts] for array in points], axis=1)
    return bool(regular and len(np.unique(values, axis=0)) >= _NEW * len(starts))
