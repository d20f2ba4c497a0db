"""Fits with conditions besides one at either end: velocities at inner nodes, and two conditions at an end."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.faults import Fault
from .._base.time import TimeAxis
from .._base.typing import Progress
from .._spaces import Array, factors_of
from .added_knots import Knots, fit_with_knots, with_knots
from .fit import Fit, FitProblem, fit, moved_ends, read_ends, validated
from .sections import InnerVelocities, fit_in_sections, read_inner
from .solve import without


def fit_with_conditions(
    problem: FitProblem,
    time_axis: TimeAxis,
    shown: NDArray[Any],
    velocities: Any,
    accelerations: Any,
    progress: Progress | None,
) -> tuple[Fit, NDArray[Any], tuple[int, ...]]:
    """Fit curves with additional conditions.

    Parameters
    ----------
    problem : FitProblem
        Curves with one condition at either end.
    time_axis, shown
        The time axis, and the knots as in `CubicSpline.t`.
    velocities : mapping or None
        The argument `velocities` of `CubicSpline`.
    accelerations : pair or None
        Additional accelerations at the ends; see `split_accelerations`.
    progress : callable or None
        Function to call with the numbers of finished and of all points.

    Returns
    -------
    fit : Fit
    shown : ndarray
        The knots, with additional ones.
    nodes : tuple of int
        Nodes with a prescribed velocity, where the curve is C¹ only.
    """
    inner = {} if velocities is None else read_inner(velocities, problem.space, problem.points)
    if accelerations is None:
        return _solve(problem, inner, progress), shown, tuple(inner)
    knots = with_knots(time_axis, shown, problem.times, problem.points[0].batch, accelerations)
    found, inner = _with_accelerations(problem, inner, accelerations, knots, progress)
    return found, knots.shown, tuple(inner)


def _solve(problem: FitProblem, inner: InnerVelocities, progress: Progress | None = None) -> Fit:
    return fit_in_sections(problem, inner, progress) if inner else fit(problem, progress)


def _with_accelerations(
    problem: FitProblem, inner: InnerVelocities, accelerations: Any, knots: Knots, progress: Progress | None
) -> tuple[Fit, InnerVelocities]:
    """Fit curves with accelerations at the ends. Return the fit, and the inner velocities by node of the new curve."""
    space, times, data, check = problem.space, problem.times, problem.points, problem.check
    batch = data[0].batch
    ends = read_ends(moved_ends(accelerations, space, data), space, batch)
    invalid: list[Fault] = []
    if check:
        skip = problem.check and problem.skip_invalid
        points, invalid = validated(space, times, data, problem.ends, skip, problem.mask)
        _, more = validated(space, times, data, ends, skip, problem.mask)
        invalid += [fault for fault in more if fault.curve not in {own.curve for own in invalid}]
        numbers = [
            own._replace(numbers=factor._as_doubles(np.ascontiguousarray(found)))
            for factor, own, found in zip(factors_of(space), data, points, strict=True)
        ]
        problem = problem._replace(points=numbers, check=False, mask=without(problem.mask, invalid, batch))
    shift = int(0 in knots.which)
    shifted = {node + shift: vectors for node, vectors in inner.items()}

    def solve(own: FitProblem) -> Fit:
        if own.space is space:
            return _solve(own, shifted if own.times is knots.times else inner, progress)
        zero: Array = np.zeros((*own.points[0].batch, 1))
        return _solve(own, {node: [zero] for node in shifted})

    found = fit_with_knots(problem, [own or [] for own in ends], knots, solve)
    faults = {fault.curve: fault for fault in (*found.faults, *invalid)}
    return found._replace(faults=[faults[number] for number in sorted(faults)]), shifted
