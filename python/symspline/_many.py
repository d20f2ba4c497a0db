"""Curves of different lengths in one call of the core."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _core, spline
from ._arrays import whole_number
from ._core import ValidationError
from ._ends import ends_of, kept, picked
from ._span import fit_each_in_span, is_large
from .report import shaped
from .spaces import Space
from .spline import CubicSpline


def fit_many(
    curves: list[tuple[Any, Any]],
    space: Space,
    *,
    bc_type: Any = "natural",
    method: str = "auto",
    tol: float = 1e-12,
    max_iter: int | None = None,
    extrapolate: bool | str | None = None,
    on_failure: str = "raise",
    check: bool = True,
    progress: spline.Progress | None = None,
) -> list[CubicSpline]:
    """See `symspline.fit_many`."""
    policy = spline._policy(extrapolate)
    spline._check_options(on_failure, progress)
    if max_iter is not None:
        max_iter = whole_number(max_iter, "max_iter", 1)
    for number, curve in enumerate(curves):
        if not isinstance(curve, (tuple, list)) or len(curve) != 2:
            raise ValidationError(f"curve {number} must be a pair (t, points)")
    if hasattr(space, "factors"):
        from .product import fit_many as product_many

        options = {"method": method, "tol": tol, "max_iter": max_iter, "check": check, "progress": progress}
        return product_many(curves, space, bc_type, policy, on_failure, options)
    if not curves:
        return []
    prepared, tols = [], []
    for number, curve in enumerate(curves):
        try:
            t, points = curve
            doubles, tol_here = spline._points(points, space)
            if doubles.ndim != len(space.point_shape) + 1:
                raise ValidationError(f"points has shape {doubles.shape}; each curve here is a single one")
            prepared.append((*spline._knots(t, (), doubles.shape[0]), doubles))
        except (ValidationError, TypeError, ValueError) as error:
            raise ValidationError(f"curve {number}: {error}") from None
        tols.append(tol_here)
    if check:
        _check_doubles(prepared, tols, space)
    offsets = np.cumsum([0, *(len(p) for *_, p in prepared)])
    all_times = np.concatenate([times for _, _, times, _ in prepared])
    ends = ends_of(bc_type, space, (len(curves),))
    large = is_large(space)
    all_points, all_velocities, columns, faults = _core.fit(
        space._handle,
        all_times,
        np.concatenate([p for *_, p in prepared]),
        ends,
        method,
        tol,
        max_iter,
        check,
        max(tols),
        offsets.tolist(),
        progress,
        large,
    )
    all_points, all_velocities = space._numbers(all_points), space._numbers(all_velocities)
    if large:
        all_velocities, columns, faults = fit_each_in_span(
            space, all_times, all_points, offsets, ends, (method, tol, max_iter), progress
        )
    ends_kept = kept(bc_type)
    fitted = [
        CubicSpline._made(
            space,
            clock,
            t,
            times,
            all_points[offsets[i] : offsets[i + 1]],
            all_velocities[offsets[i] : offsets[i + 1]],
            picked(ends_kept, i, 1, space),
            policy,
            shaped(tuple(column[i : i + 1] for column in columns), (), space.curvature, method),
        )
        for i, (clock, t, times, _) in enumerate(prepared)
    ]
    if faults:
        spline._fail(faults, on_failure, fitted)
    return fitted


def _check_doubles(prepared: list[Any], tols: list[float], space: Space) -> None:
    """Points in double precision may not be as far off as those in single precision beside them."""
    for number, ((*_, points), tol) in enumerate(zip(prepared, tols, strict=True)):
        if tol < max(tols):
            rows = points.reshape(len(points), -1)
            try:
                space._handle.check_points(rows, [len(points)], tol)
            except ValidationError as error:
                raise ValidationError(f"curve {number}: {error}") from None
