"""Splines as functions of plain arrays, and fits of many curves of different lengths."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import checked_flag, short_repr
from .._base.input import in_library, library_of
from .._base.report import Report
from .._base.time import TimeAxis, knots_of
from .._base.typing import (
    AnyArrays,
    Array,
    BCType,
    Extrapolate,
    FitOptions,
    Method,
    OnFailure,
    Out,
    P,
    PointsLike,
    Progress,
    TimesLike,
)
from .._core import ValidationError
from .._curves import fit as fitting
from .._curves.composed import evaluated
from .._curves.curve import CurveArrays
from .._curves.ends import freeze_bc_type, take_batch
from .._curves.failures import raise_or_warn, warn_of_held_points, warn_of_representatives
from .._curves.missing import counts_all_samples, curves_without_missing, with_remedy
from .._curves.options import (
    EvaluationOptions,
    check_progress,
    checked_extrapolate,
    extrapolation_mode,
    fit_options,
    quantity_of,
    with_atol,
)
from .._spaces import AnySpace, Doubles, Product, Quotient, Space, factors_of, parts_of, space_named
from ..manifolds import Manifold
from .cubic import CubicSpline

# With fewer knots, all of them are read.
_MANY = 64


def fit(
    t: TimesLike | None, points: PointsLike, space: Space[P] | str, **options: Unpack[FitOptions]
) -> tuple[P, Report]:
    """Compute the velocities of a C² cubic spline as plain arrays.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (n,) or (..., n), or None
        Strictly increasing knots. None means 0, 1, ..., n - 1.
    points : array_like, shape (..., n, *space.point_shape)
        Points to interpolate. For a `Product`, a tuple with one array per factor.
    space : Space or str
        A space or its name, such as ``Sphere(2)`` or ``"sphere:2"``.
    **options
        Keyword arguments of `CubicSpline`.

    Returns
    -------
    velocities : ndarray or tuple of ndarray
        Velocities at the knots, with the shape of the points. If the points are arrays of another library that
        follows the array API standard, on the CPU, so are the velocities.
    report : Report
        Report of the fit.

    Raises
    ------
    ValidationError, CutLocusError, ConvergenceError
        As for `CubicSpline`.

    See Also
    --------
    CubicSpline : Interpolate points by a C² curve.
    evaluate : Evaluate a curve given by plain arrays.

    Examples
    --------
    >>> import symspline as ss
    >>> u, report = ss.fit(None, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "sphere:2")
    >>> u.shape, report.converged
    ((3, 3), True)
    """
    spline = CubicSpline(t, points, space, **options)
    velocities: P = in_library(library_of(points), _at_given(points, spline))
    return velocities, spline.report


def _at_given(points: object, spline: CubicSpline[Any]) -> Any:
    """Return the velocities of a curve at the points of the user, which may be other representatives."""
    space, velocities = spline.space, spline.velocities
    if not any(isinstance(factor, Quotient) for factor in factors_of(space)):
        return velocities
    given = fitting.read_given(points, space)
    factors = zip(factors_of(space), given, spline._curve.parts, strict=True)
    moved = [
        quotient._moved_like(quotient._numbers(part.numbers), curve.points, curve.velocities)
        if isinstance(quotient, Quotient)
        else curve.velocities
        for quotient, part, curve in factors
    ]
    return tuple(moved) if isinstance(space, Product) else moved[0]


@overload
def evaluate(
    t: TimesLike | None,
    points: PointsLike,
    velocities: ArrayLike,
    space: Space[P] | str,
    x: TimesLike,
    *,
    nu: int = 0,
    out: None = None,
    **options: Unpack[EvaluationOptions],
) -> P: ...


@overload
def evaluate(
    t: TimesLike | None,
    points: PointsLike,
    velocities: ArrayLike,
    space: AnySpace | str,
    x: TimesLike,
    *,
    nu: int = 0,
    out: Out,
    **options: Unpack[EvaluationOptions],
) -> Out: ...


def evaluate(
    t: TimesLike | None,
    points: PointsLike,
    velocities: ArrayLike,
    space: AnySpace | str,
    x: TimesLike,
    *,
    nu: int = 0,
    extrapolate: Extrapolate = None,
    per_curve: bool = False,
    progress: Progress | None = None,
    out: Array | AnyArrays | None = None,
) -> Any:
    """Evaluate a curve that is given by knots, points and velocities.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (n,) or (..., n), or None
        Strictly increasing knots. None means 0, 1, ..., n - 1.
    points, velocities : array_like, shape (..., n, *space.point_shape)
        Points and velocities at the knots. For a `Product`, tuples with one array per factor.
    space : Space or str
        A space or its name, such as ``Sphere(2)`` or ``"sphere:2"``.
    x : array_like of float or datetime64
        Times, of any shape and in any order. Only the nodes of the segments between the first and the last of these
        times are read and checked, so that few times cost little.
    nu : {0, 1, 2}, default 0
        Order of the derivative: 0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.
    extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
        Extrapolation policy for times beyond the knots. None and ``"raise"`` raise `ValidationError`. True continues
        the first and last segments. False gives NaN. ``"geodesic"`` continues with constant velocity. ``"periodic"``
        repeats the curve.
    per_curve : bool, default False
        True if every curve of a batch has its own times. The leading axes of x are then the batch axes.
    progress : callable, optional
        Function that is called from time to time with the finished and the total number of points.
    out : ndarray or tuple of ndarray, optional
        Array into which the result is written, and which is returned.

    Returns
    -------
    ndarray or tuple of ndarray
        Points or tangent vectors, shape ``(*batch axes, *x.shape, *point_shape)``. If `points`, `velocities` or `x`
        are arrays of another library that follows the array API standard, on the CPU, so is the result.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.

    See Also
    --------
    fit : Compute the velocities of a C² cubic spline as plain arrays.
    HermiteSpline : Interpolate points and given velocities.

    Examples
    --------
    >>> import symspline as ss
    >>> p = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> u, _ = ss.fit(None, p, "sphere:2")
    >>> ss.evaluate(None, p, u, "sphere:2", 0.5).round(8)
    array([ 0.61308303,  0.76368565, -0.20227067])
    """
    space = space_named(space)
    check_progress(progress)
    libraries = points, velocities, x
    if not per_curve:
        t, points, velocities = _nodes_around(t, points, velocities, space, x)
    time_axis, curve = given(t, points, velocities, space)
    where = extrapolation_mode(checked_extrapolate(extrapolate), "natural")
    values = evaluated(curve, time_axis, x, quantity_of(nu), where, per_curve, progress, out)
    return values if out is not None else in_library(library_of(*libraries), values)


def _nodes_around(
    t: TimesLike | None, points: PointsLike, velocities: PointsLike | None, space: Space, x: TimesLike
) -> tuple[Any, Any, Any]:
    """Return the knots, points and velocities of the segments in which times lie.

    All nodes are returned if they are not plain arrays or too few for a gain. Each segment is determined by its two
    ends, so the values are bit-identical.
    """
    everything = t, points, velocities
    if any(isinstance(factor, Quotient) for factor in factors_of(space)):
        # Representatives are chosen from the first point on.
        return everything
    if type(t) is not np.ndarray or t.dtype != np.float64 or t.ndim != 1 or len(t) < _MANY:
        return everything
    times = np.asarray(x) if isinstance(x, (int, float, np.ndarray)) else None
    if times is None or times.dtype.kind not in "iuf" or not 0 < times.size <= len(t):
        return everything
    first, last = times.min(), times.max()
    # Invalid input raises further on. Comparisons are false for NaN.
    if not (t[0] <= first and last <= t[-1] < np.inf and (t[1:] > t[:-1]).all()):
        return everything
    start, stop = int(t.searchsorted(first, "right")) - 1, int(t.searchsorted(last, "right")) + 1
    start = min(start, len(t) - 2)
    arrays: list[Any] = []
    for name, value in (("points", points), ("velocities", velocities)):
        parts = list(parts_of(value, space, name))
        for i, factor in enumerate(factors_of(space)):
            inner, array = len(factor.point_shape), parts[i]
            if type(array) is not np.ndarray or array.ndim <= inner or array.shape[-1 - inner] != len(t):
                return everything
            nodes: Any = (..., slice(start, stop), *[slice(None)] * inner)
            parts[i] = array[nodes]
        arrays.append(tuple(parts) if isinstance(space, Product) else parts[0])
    return t[start:stop], arrays[0], arrays[1]


def given(t: TimesLike | None, points: object, velocities: PointsLike, space: AnySpace) -> tuple[TimeAxis, CurveArrays]:
    """Return the time axis and the curve with the given knots, points and velocities, after validation."""
    data = fitting.read(points, space)
    vectors = fitting.read_velocities(velocities, space, data)
    batch, nodes = data[0].batch, data[0].nodes
    time_axis, _, times = knots_of(t, batch, nodes)
    try:
        on_space, _ = fitting.validated(space, times, data, fitting.read_ends("natural", space, batch))
    except ValidationError as error:
        raise time_axis.explain(error) from None
    arrays = [(points, numbers) for points, (numbers, _) in zip(on_space, vectors, strict=True)]
    return time_axis, fitting.curve_of(space, times, arrays, fitted=False)


@counts_all_samples
def fit_many(
    curves: Iterable[tuple[TimesLike | None, PointsLike]],
    space: Space[P] | str,
    *,
    bc_type: BCType = "natural",
    method: Method = "auto",
    tol: float = 1e-12,
    max_iter: int | None = None,
    extrapolate: Extrapolate = None,
    on_failure: OnFailure = "raise",
    check: bool = True,
    atol: float | None = None,
    where: ArrayLike | None = None,
    progress: Progress | None = None,
    skipna: bool = False,
) -> list[CubicSpline[P]]:
    """Fit curves of different lengths in one parallel call.

    Parameters
    ----------
    curves : iterable of pair
        Pairs ``(t, points)``, one per curve, as for `CubicSpline`. Each pair is a single curve, not a batch.
    space : Space or str
        Space of all curves, or its name.
    bc_type, method, tol, max_iter, extrapolate, on_failure, check, atol : optional
        As for `CubicSpline`. They apply to all curves.
    where : array_like of bool, optional
        Mask over the curves. Curves where it is False are not fitted and evaluate to NaN.
    progress : callable, optional
        Function that is called from time to time with the finished and the total number of points.
    skipna : bool, default False
        True to omit missing samples from each curve, where the point or its time is NaN, NaT or masked.

    Returns
    -------
    list of CubicSpline
        One spline per curve.

    Raises
    ------
    ValidationError, CutLocusError, ConvergenceError
        As for `CubicSpline`. The message names the curve. The attribute ``spline`` of a `CutLocusError` or
        `ConvergenceError` is the list of all splines.

    See Also
    --------
    CubicSpline : Interpolate points, or a batch of curves of equal length.
    fit_segments : Fit a recording with gaps.
    save : Write several curves to one file.

    Examples
    --------
    >>> import symspline as ss
    >>> square = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    >>> [len(s.t) for s in ss.fit_many([(None, square), ([0, 2], square[:2])], "sphere:2")]
    [4, 2]
    """
    space = space_named(space)
    options = fit_options(method, tol, max_iter, extrapolate, on_failure, check, progress)
    skip = checked_flag(skipna, "skipna")
    if not isinstance(curves, Iterable):
        raise ValidationError(f"curves must be pairs (t, points), not {short_repr(curves)}")
    pairs: list[tuple[TimesLike | None, Any]] = list(curves)
    for number, curve in enumerate(pairs):
        if not isinstance(curve, (tuple, list)) or len(curve) != 2:
            raise ValidationError(f"curves[{number}] must be a pair (t, points), not {short_repr(curve)}")
    if not pairs:
        return []
    mask = fitting.mask_of(where, (len(pairs),))
    points, knots = [], []
    for number, (t, p) in enumerate(pairs):
        try:
            if skip:
                t, p = curves_without_missing(t, p, space)
            data = with_atol(fitting.read(p, space), atol)
            if data[0].batch:
                raise ValidationError(f"points has shape {np.shape(p)}, but each pair must be a single curve")
            points.append(data)
            knots.append(knots_of(t, (), data[0].nodes))
        except (ValidationError, TypeError, ValueError) as error:
            raise ValidationError(str(error))._of_curve(number) from None
    bc_type = fitting.moved_ends_of_many(bc_type, space, points)
    ends = fitting.read_ends(bc_type, space, (len(pairs),))
    times = [times for *_, times in knots]
    problem = fitting.Problem(
        space, times, points, ends, options, bool(check), mask, skip_invalid=on_failure != "raise"
    )
    try:
        fits, faults = fitting.fit_many(problem, progress)
    except ValidationError as error:
        number = error.curve[0] if error.curve else 0
        raise with_remedy(error, points[number], times[number], of_many=True) from None
    ends_kept = freeze_bc_type(bc_type)
    fitted: list[CubicSpline[P]] = [
        CubicSpline._fitted(time_axis, t, one_fit.curve, take_batch(ends_kept, i, 1, space), extrapolate, one_fit)
        for i, ((time_axis, t, _), one_fit) in enumerate(zip(knots, fits, strict=True))
    ]
    if faults:
        raise_or_warn(faults, on_failure, fitted)
    wanted = [data_of_curve if mask is None or mask[i] else None for i, data_of_curve in enumerate(points)]
    warn_of_representatives(space, wanted, [one_fit.curve for one_fit in fits], [one_fit.columns for one_fit in fits])
    any(
        warn_of_held_points(times[i], [part.numbers for part in data_of_curve], (), curve=(i,) * (len(pairs) > 1))
        for i, data_of_curve in enumerate(wanted)
        if data_of_curve is not None
    )
    return fitted


# ---- segments of a curve as separate curves, and their jumps at the knots ----


@dataclass(frozen=True)
class Jumps:
    """Jumps of γ, γ' or ∇γ' at the knots where two segments meet.

    Attributes
    ----------
    size : ndarray, shape (knots,)
        Size of each jump.
    largest : float
        Largest value at an end of a segment.
    """

    size: Doubles
    largest: float

    @property
    def relative(self) -> float:
        """Largest jump, relative to the largest value."""
        most = float(self.size.max(initial=0.0))
        return most / self.largest if most else 0.0


@dataclass(frozen=True)
class Segments:
    """Segments as separate curves with two knots each, evaluated without their neighbours.

    Attributes
    ----------
    space : Space
        Their space, not a product.
    t : ndarray, shape (S, 2)
        Knots.
    points, velocities : ndarray, shape (S, 2, *point_shape)
        Points and velocities at the knots.
    """

    space: Space
    t: Array
    points: Array
    velocities: Array

    def at(self, x: Array, nu: int = 0) -> Array:
        """Evaluate every segment at its own times, the rows of x; shape (S, m, *point_shape)."""
        return np.asarray(evaluate(self.t, self.points, self.velocities, self.space, x, nu=nu, per_curve=True))

    def jumps(self, nu: int, closed: bool = False) -> Jumps:
        """Return the differences between the ends of segments and the starts of the next ones.

        Parameters
        ----------
        nu : {0, 1, 2}
            Order of the derivative.
        closed : bool
            Whether the last segment is compared with the first one as well.

        Notes
        -----
        Each value is computed from its segment alone. One point may have several representatives, so vectors are
        transported in parallel from end to start before they are compared. Their lengths are those of the space.
        Rounding errors far out in hyperbolic space are then comparable to those near its origin, up to the condition
        number |p|².
        """
        last = None if closed else -1
        points = self.at(self.t)
        end, start = points[:last, 1], _next(points)[:last]
        if nu == 0:
            flat = points.reshape(*points.shape[:2], -1)
            return Jumps(self.space.distance(end, start), float(np.linalg.norm(flat, axis=-1).max()))
        vectors = self.at(self.t, nu)
        transported = vectors[:last, 1]
        # A manifold made of functions without `transport` has one representative per point.
        if not isinstance(self.space, Manifold) or self.space.functions.transport is not None:
            transported = self.space.transport(end, start, transported)
        size = self.space.norm(start, transported - _next(vectors)[:last])
        return Jumps(size, float(self.space.norm(points, vectors).max()))


def segments_of(spline: CubicSpline) -> Segments:
    """Return the segments of a single curve, not in a product."""
    return Segments(spline.space, pairs(spline.t), pairs(spline.points), pairs(spline.velocities))


def pairs(values: Array) -> Array:
    """Return pairs of neighbours, shape (N, 2, ...)."""
    return np.stack([values[:-1], values[1:]], axis=1)


def _next(values: Array) -> Array:
    """Return the values at the start of the segment after each; after the last one comes the first."""
    return np.roll(values[:, 0], -1, axis=0)
