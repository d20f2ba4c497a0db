"""Splines as functions of plain arrays, and many of different lengths at once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._core import ValidationError
from .arrays import checked_flag, read_only, shown
from .curves import fit as fitting
from .curves.chosen import ManyAsked, fit_many_sound, fit_many_wanted, mask_of
from .curves.curve import Curve, quantity_of
from .curves.ends import kept, picked
from .curves.solve import Progress
from .failures import fail
from .far import warn_of_far_points
from .handed import in_library, library_of
from .options import check_on_failure, check_progress, checked_policy, options_of, outside, within
from .piecewise import evaluated
from .report import Report
from .signs import warn_of_signs
from .spaces import Array, Space, factors_of, parts_of
from .spaces import space as space_named
from .spline import CubicSpline
from .times import Clock, knots_of


def fit(t: ArrayLike | None, points: Any, space: Space | str, **options: Any) -> tuple[Any, Report]:
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
    return in_library(library_of(points), spline.velocities), spline.report


def evaluate(
    x: ArrayLike,
    t: ArrayLike | None,
    points: Any,
    u: Any,
    space: Space | str,
    nu: int = 0,
    *,
    extrapolate: bool | str | None = None,
    per_curve: bool = False,
    progress: Progress | None = None,
    out: Any = None,
) -> Any:
    """The curve with given knots, points and velocities at times x, as plain arrays.

    Args:
        x: times, any shape and order.
        t: knots, as for `CubicSpline`.
        points, u: points and velocities, shape (..., N+1, *point_shape).
        space: the space or its name.
        nu, extrapolate, per_curve, progress, out: as for calling a `CubicSpline`.

    Returns:
        Values as of calling a `CubicSpline`, as arrays of the library that points, u or x come from.

    >>> import symspline as ss
    >>> p = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> u, _ = ss.fit(None, p, "sphere:2")
    >>> ss.evaluate(0.5, None, p, u, "sphere:2").round(8)
    array([ 0.61308303,  0.76368565, -0.20227067])
    """
    space = space_named(space)
    check_progress(progress)
    clock, curve = given(t, points, u, space)
    where = outside(checked_policy(extrapolate), "natural")
    values = evaluated(curve, clock, x, quantity_of(nu), where, per_curve, progress, out)
    return values if out is not None else in_library(library_of(points, u, x), values)


def given(t: ArrayLike | None, points: Any, u: Any, space: Space) -> tuple[Clock, Curve]:
    """The curve with given knots, points and velocities, and how it counts times."""
    data = fitting.read(points, space)
    velocities = [
        velocities_of(factor, part.doubles, own)
        for factor, part, own in zip(factors_of(space), data, parts_of(u, space, "u"), strict=True)
    ]
    batch, nodes = data[0].batch, data[0].nodes
    clock, _, times = knots_of(t, batch, nodes)
    try:
        on_space = fitting.validated(space, times, data, fitting.read_ends("natural", space, batch))
    except ValidationError as error:
        raise clock.explain(error) from None
    arrays = list(zip(on_space, velocities, strict=True))
    return clock, fitting.curve_of(space, times, arrays, fitted=False)


def velocities_of(space: Space, points: Array, u: Any, name: str = "u") -> Array:
    """Velocities for points in doubles, not in a product, as an array that has flags of its own."""
    doubles = space._doubles(u, name)
    velocities = read_only(space._numbers(doubles))
    if doubles.shape != points.shape:
        raise ValidationError(
            f"{name} has shape {velocities.shape}, but points {space._numbers(points).shape}"
        )
    if not np.isfinite(velocities).all():
        index = np.argwhere(~np.isfinite(velocities))[0].tolist()
        raise ValidationError(f"{name}{index} is not finite")
    return velocities


def fit_many(
    curves: Iterable[tuple[ArrayLike | None, Any]],
    space: Space | str,
    *,
    bc_type: Any = "natural",
    method: str = "auto",
    tol: float = 1e-12,
    max_iter: int | None = None,
    extrapolate: bool | str | None = None,
    on_failure: str = "raise",
    check: bool = True,
    atol: float | None = None,
    where: ArrayLike | None = None,
    progress: Progress | None = None,
) -> list[CubicSpline]:
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
        raise ValidationError(f"curves must be pairs (t, points), not {shown(curves)}")
    pairs = list(curves)
    policy = checked_policy(extrapolate)
    check_on_failure(on_failure)
    check_progress(progress)
    options = options_of(method, tol, max_iter)
    for number, curve in enumerate(pairs):
        if not isinstance(curve, (tuple, list)) or len(curve) != 2:
            raise ValidationError(f"curve {number} must be a pair (t, points)")
    if not pairs:
        return []
    mask = None if where is None else mask_of(where, (len(pairs),))
    points, knots = [], []
    for number, (t, p) in enumerate(pairs):
        try:
            data = within(fitting.read(p, space), atol)
            if data[0].batch:
                raise ValidationError(f"points has shape {np.shape(p)}; each curve here is a single one")
            points.append(data)
            knots.append(knots_of(t, (), data[0].nodes))
        except (ValidationError, TypeError, ValueError) as error:
            raise ValidationError(f"curve {number}: {error}") from None
    ends = fitting.read_ends(bc_type, space, (len(pairs),))
    times = [times for *_, times in knots]
    asked = ManyAsked(space, times, points, ends, options, check)
    if check and on_failure != "raise":
        fits, faults = fit_many_sound(asked, progress, mask)
    else:
        fits, faults = fit_many_wanted(asked, progress, mask)
    ends_kept = kept(bc_type)
    fitted = [
        CubicSpline._of(clock, t, found.curve, picked(ends_kept, i, 1, space), policy, found.reports)
        for i, ((clock, t, _), found) in enumerate(zip(knots, fits, strict=True))
    ]
    if faults:
        fail(faults, on_failure, fitted)
    warn_of_signs(space, [own if mask is None or mask[i] else None for i, own in enumerate(points)])
    warn_of_far_points([found.curve for found in fits], [found.reports for found in fits])
    return fitted
