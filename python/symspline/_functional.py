"""Splines as functions of plain arrays, and many of different lengths at once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import checked_flag, read_only, short_repr
from ._base_curve import evaluated
from ._core import ValidationError
from ._cubic import CubicSpline
from ._curves import fit as fitting
from ._curves.curve import CurveArrays
from ._curves.ends import freeze_bc_type, picked
from ._curves.solve import Progress
from ._errors import raise_or_warn
from ._far import warn_of_far_points
from ._input import in_library, library_of
from ._options import (
    check_on_failure,
    check_progress,
    checked_extrapolate,
    options_of,
    outside,
    quantity_of,
    with_atol,
)
from ._report import Report
from ._signs import warn_of_signs
from ._spaces import Array, Space, factors_of, parts_of
from ._spaces import space as space_named
from ._time import TimeAxis, knots_of
from ._typing import (
    AnyArray,
    AnyArrays,
    BCType,
    Extrapolate,
    FitOptions,
    Method,
    OnFailure,
    Out,
    P,
    PointsLike,
)


def fit(
    t: ArrayLike | None, points: PointsLike, space: Space[P] | str, **options: Unpack[FitOptions]
) -> tuple[P, Report]:
    """The velocities of the C² spline through points, as plain arrays.

    Takes the arguments of `CubicSpline`.

    Returns:
        The velocities, of the shape of the points, and the report. Where the points are arrays of another library that
        follows the array API standard, and on the CPU, velocities are of it, too.

    >>> import symspline as ss
    >>> u, report = ss.fit(None, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "sphere:2")
    >>> u.shape, report.converged
    ((3, 3), True)
    """
    spline = CubicSpline(t, points, space, **options)
    velocities: P = in_library(library_of(points), spline.velocities)
    return velocities, spline.report


@overload
def evaluate(
    t: ArrayLike | None,
    points: PointsLike,
    velocities: ArrayLike,
    space: Space[P] | str,
    x: ArrayLike,
    *,
    nu: int = 0,
    extrapolate: Extrapolate = None,
    per_curve: bool = False,
    progress: Progress | None = None,
    out: None = None,
) -> P: ...


@overload
def evaluate(
    t: ArrayLike | None,
    points: PointsLike,
    velocities: ArrayLike,
    space: Space[Any] | str,
    x: ArrayLike,
    *,
    nu: int = 0,
    extrapolate: Extrapolate = None,
    per_curve: bool = False,
    progress: Progress | None = None,
    out: Out,
) -> Out: ...


def evaluate(
    t: ArrayLike | None,
    points: PointsLike,
    velocities: ArrayLike,
    space: Space[Any] | str,
    x: ArrayLike,
    *,
    nu: int = 0,
    extrapolate: Extrapolate = None,
    per_curve: bool = False,
    progress: Progress | None = None,
    out: AnyArray | AnyArrays | None = None,
) -> Any:
    """The curve with given knots, points and velocities at times x, as plain arrays.

    Args:
        t: knots, as for `CubicSpline`.
        points, velocities: arrays of shape (..., N+1, *point_shape).
        space: the space or its name.
        x: times, any shape and order.
        nu, extrapolate, per_curve, progress, out: as for calling a `CubicSpline`.

    Returns:
        Values as of calling a `CubicSpline`, as arrays of the library that points, velocities or x come from.

    >>> import symspline as ss
    >>> p = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> u, _ = ss.fit(None, p, "sphere:2")
    >>> ss.evaluate(None, p, u, "sphere:2", 0.5).round(8)
    array([ 0.61308303,  0.76368565, -0.20227067])
    """
    space = space_named(space)
    check_progress(progress)
    clock, curve = given(t, points, velocities, space)
    where = outside(checked_extrapolate(extrapolate), "natural")
    values = evaluated(curve, clock, x, quantity_of(nu), where, per_curve, progress, out)
    return values if out is not None else in_library(library_of(points, velocities, x), values)


def given(
    t: ArrayLike | None, points: Any, velocities: Any, space: Space[Any]
) -> tuple[TimeAxis, CurveArrays]:
    """The curve with given knots, points and velocities, and how it counts times."""
    data = fitting.read(points, space)
    own = parts_of(velocities, space, "velocities")
    read = [
        velocities_of(*each)
        for each in zip(factors_of(space), (part.doubles for part in data), own, strict=True)
    ]
    batch, nodes = data[0].batch, data[0].nodes
    clock, _, times = knots_of(t, batch, nodes)
    try:
        on_space, _ = fitting.validated(space, times, data, fitting.read_ends("natural", space, batch))
    except ValidationError as error:
        raise clock.explain(error) from None
    arrays = list(zip(on_space, read, strict=True))
    return clock, fitting.curve_of(space, times, arrays, fitted=False)


def velocities_of(space: Space, points: Array, velocities: Any) -> Array:
    """Velocities for points in doubles, not in a product, as an array that has flags of its own."""
    doubles = space._doubles(velocities, "velocities")
    array = read_only(space._numbers(doubles))
    if doubles.shape != points.shape:
        raise ValidationError(
            f"velocities has shape {array.shape}, but points {space._numbers(points).shape}"
        )
    if not np.isfinite(array).all():
        index = np.argwhere(~np.isfinite(array))[0].tolist()
        raise ValidationError(f"velocities{index} is not finite")
    return array


def fit_many(
    curves: Iterable[tuple[ArrayLike | None, PointsLike]],
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
) -> list[CubicSpline[P]]:
    """Fit curves of different lengths in one parallel call.

    Args:
        curves: pairs (t, points), one a curve; see `CubicSpline`.
        space: the space of all curves, or its name.
        bc_type, method, tol, max_iter, extrapolate, on_failure, check, atol, progress: as for `CubicSpline`, for all
            curves alike.
        where: True for the curves that are wanted, one a curve: the others are NaN, whatever their points are.

    Returns:
        One `CubicSpline` a curve. If curves fail and ``on_failure="raise"``, the exception's ``.spline``
        is this list.

    >>> import symspline as ss
    >>> square = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    >>> [len(s.t) for s in ss.fit_many([(None, square), ([0, 2], square[:2])], "sphere:2")]
    [4, 2]
    """
    space, check = space_named(space), checked_flag(check, "check")
    if not isinstance(curves, Iterable):
        raise ValidationError(f"curves must be pairs (t, points), not {short_repr(curves)}")
    pairs: list[tuple[ArrayLike | None, Any]] = list(curves)
    policy = checked_extrapolate(extrapolate)
    check_on_failure(on_failure)
    check_progress(progress)
    options = options_of(method, tol, max_iter)
    for number, curve in enumerate(pairs):
        if not isinstance(curve, (tuple, list)) or len(curve) != 2:
            raise ValidationError(f"curve {number} must be a pair (t, points)")
    if not pairs:
        return []
    mask = fitting.mask_of(where, (len(pairs),))
    points, knots = [], []
    for number, (t, p) in enumerate(pairs):
        try:
            data = with_atol(fitting.read(p, space), atol)
            if data[0].batch:
                raise ValidationError(f"points has shape {np.shape(p)}; each curve here is a single one")
            points.append(data)
            knots.append(knots_of(t, (), data[0].nodes))
        except (ValidationError, TypeError, ValueError) as error:
            raise ValidationError(f"curve {number}: {error}") from None
    ends = fitting.read_ends(bc_type, space, (len(pairs),))
    times = [times for *_, times in knots]
    problem = fitting.ManyProblem(
        space, times, points, ends, options, check, mask, skip_invalid=on_failure != "raise"
    )
    fits, faults = fitting.fit_many(problem, progress)
    ends_kept = freeze_bc_type(bc_type)
    fitted: list[CubicSpline[P]] = [
        CubicSpline._of(clock, t, found.curve, picked(ends_kept, i, 1, space), policy, found.reports)
        for i, ((clock, t, _), found) in enumerate(zip(knots, fits, strict=True))
    ]
    if faults:
        raise_or_warn(faults, on_failure, fitted)
    warn_of_signs(space, [own if mask is None or mask[i] else None for i, own in enumerate(points)])
    warn_of_far_points([found.curve for found in fits], [found.reports for found in fits])
    return fitted
