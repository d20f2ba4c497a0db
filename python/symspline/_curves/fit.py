"""From points to curves: the same for one curve, a batch, and many of different lengths, in any space.

A space has its kind of curve: plain, in the span of its points, on a manifold that is made of functions, or, for a
product, one in every factor. A further kind is a class with the methods of `CoreCurve`, and its name in `kind_of`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._arrays import as_array
from .._core import ValidationError
from .._faults import INVALID, Fault
from .._report import Columns, Report, shaped
from .._spaces import POINT_TOL, Array, Product, Space, factors_of, parts_of, point_tol
from ..manifolds import Manifold
from ..manifolds._checks import hermite_on_manifold
from ..manifolds._on_manifold import OnManifold
from .core_curve import CoreCurve
from .curve import CurveArrays
from .ends import End, ends_in_factors, ends_of
from .product import ProductCurve, share
from .reduced import ReducedCurve
from .solve import Mask, Options, Progress, Solved, Task, solve, without

_T = TypeVar("_T")
# Options for a fit that is not carried out.
_ANY = Options("auto", 0.0, None)
_NATURAL: list[End] = [("natural", None), ("natural", None)]


class Points(NamedTuple):
    """Points of curves in a space that is no product.

    Attributes:
        doubles: their numbers, shape (*batch, nodes, *doubles of a point).
        tol: how far off the space they may be.
    """

    doubles: NDArray[np.float64]
    tol: float
    batch: tuple[int, ...]
    nodes: int


class FitProblem(NamedTuple):
    """Curves of equal length to fit.

    Attributes:
        times: knots, shape (N+1,), or (..., N+1) with one row per curve.
        points, ends: in every factor.
        check: whether points and ends are to be checked.
        mask: which curves are fitted; the others are NaN. None for all.
        skip_invalid: whether curves with points off the space are masked instead of an error.
    """

    space: Space[Any]
    times: NDArray[np.float64]
    points: list[Points]
    ends: list[list[End] | None]
    options: Options
    check: bool = True
    mask: Mask | None = None
    skip_invalid: bool = False


class ManyProblem(NamedTuple):
    """Single curves of different lengths to fit, with one entry per curve in ``times`` and ``points``, and otherwise as
    `FitProblem`."""

    space: Space[Any]
    times: list[NDArray[np.float64]]
    points: list[list[Points]]
    ends: list[list[End] | None]
    options: Options
    check: bool = True
    mask: Mask | None = None
    skip_invalid: bool = False


class Fit(NamedTuple):
    """The result of a fit.

    Attributes
    ----------
    curve : CurveArrays
    columns : list of Columns
        The reports in every factor.
    method : str
        The method that was requested.
    faults : list of Fault
    """

    curve: CurveArrays
    columns: list[Columns]
    method: str
    faults: list[Fault]

    def reports(self) -> list[Report]:
        """The reports in every factor."""
        times, batch = self.curve.times, self.curve.batch
        return [
            shaped(own, times, batch, part.space.curvature, self.method)
            for part, own in zip(self.curve.parts, self.columns, strict=True)
        ]


def kind_of(space: Space) -> type[CoreCurve]:
    """How curves are made in a space that is no product."""
    known: type[CoreCurve] | None = space.__dict__.get("_curve_kind")
    if known is None:
        known = next((kind for kind in (OnManifold, ReducedCurve) if kind.suits(space)), CoreCurve)
        space.__dict__["_curve_kind"] = known
    return known


def read(points: Any, space: Space[Any]) -> list[Points]:
    """Points as a user gives them, in every factor."""
    if not isinstance(space, Product):
        return [_read(space, points)]
    found = _in_factors(space, _read, parts_of(points, space, "points"))
    if len({(part.batch, part.nodes) for part in found}) > 1:
        described = ", ".join(f"{part.nodes} points, batch axes {part.batch}" for part in found)
        raise ValidationError(f"points: the factors differ in length, or batch axes differ: {described}")
    return found


def _read(space: Space, points: Any) -> Points:
    if type(points) is np.ndarray and points.dtype == np.float64 and not space._complex:
        # The usual case is checked without further function calls.
        flags, shape, axis = points.flags, points.shape, points.ndim - len(space._point_shape) - 1
        suits = axis >= 0 and points.size and shape[axis] >= 2 and shape[axis + 1 :] == space._point_shape
        if suits and flags.c_contiguous and flags.aligned:
            return Points(points, POINT_TOL, shape[:axis], shape[axis])
    array = points if type(points) is np.ndarray else space._array(points, "points")
    # A batch may be empty, as blocks of a selection are.
    axis = array.ndim - len(space._point_shape) - 1
    if array.ndim == 0 or (array.size == 0 and (axis < 1 or array.shape[axis] == 0)):
        raise ValidationError("no points given; a curve needs at least two")
    doubles = space._doubles(array, "points")
    lead = doubles.shape[: doubles.ndim - len(space._point_shape)]
    if not lead:
        raise ValidationError(
            f"points has shape {array.shape}, which is one point; a curve needs shape (..., N+1, *point_shape)"
        )
    if lead[-1] < 2:
        raise ValidationError("a curve needs at least two points; got one")
    return Points(doubles, point_tol(array.dtype), lead[:-1], lead[-1])


def read_ends(bc_type: Any, space: Space[Any], batch: tuple[int, ...]) -> list[list[End] | None]:
    """End conditions in every factor."""
    if not isinstance(space, Product):
        return [ends_of(bc_type, space, batch)]
    conditions = ends_in_factors(bc_type, space)
    return _in_factors(space, lambda factor, ends: ends_of(ends, factor, batch), conditions)


def curve_of(
    space: Space[Any], times: NDArray[np.float64], arrays: Sequence[tuple[Array, Array]], fitted: bool = True
) -> CurveArrays:
    """The curve with points and velocities, which are there for every factor.

    Args:
        fitted: whether velocities are those of a C² curve, not any.
    """
    if isinstance(space, Product):
        each = zip(space.factors, arrays, strict=True)
        return ProductCurve(space, tuple([_part(factor, times, *pair, fitted) for factor, pair in each]))
    return _part(space, times, *arrays[0], fitted)


def _part(
    space: Space, times: NDArray[np.float64], points: Array, velocities: Array, fitted: bool
) -> CoreCurve:
    kind = kind_of(space)
    if kind is ReducedCurve:
        return ReducedCurve(space, times, points, velocities, fitted)
    return kind(space, times, points, velocities)


def mask_of(where: Any, batch: tuple[int, ...]) -> Mask | None:
    """The mask that a user gives; None for all curves."""
    if where is None:
        return None
    mask = as_array(where, "where")
    if mask.dtype != bool or mask.shape != batch:
        raise ValidationError(
            f"where must be True or False for every curve, of shape {batch}, not {mask.dtype} of shape {mask.shape}"
        )
    return None if mask.all() else mask


def fit(problem: FitProblem, progress: Progress | None = None) -> Fit:
    """Fit curves of equal length."""
    space, times, points, ends, options, check, mask, skip = problem
    if len(points) == 1 and kind_of(space) is CoreCurve:
        # The core checks before it solves.
        data = points[0]
        task = Task(
            space, times, data.doubles, ends[0], data.tol if check else None, None, mask, check and skip
        )
        (found,) = solve((task,), options, progress)
        single = CoreCurve(space, times, found.points, found.velocities)
        return Fit(single, [found.columns], options.method, found.faults)
    tasks = [
        Task(
            factor,
            times,
            part.doubles,
            end,
            part.tol if check else None,
            mask=mask,
            skip_invalid=check and skip,
        )
        for factor, part, end in zip(factors_of(space), points, ends, strict=True)
    ]
    solved, faults = _solve(space, tasks, options, progress)
    curve = curve_of(space, times, [found[:2] for found in solved])
    return Fit(curve, [found.columns for found in solved], options.method, faults)


def fit_many(problem: ManyProblem, progress: Progress | None) -> tuple[list[Fit], list[Fault]]:
    """Fit single curves of different lengths in one call of the core per factor. Return the fits and the faults."""
    space, times, points, ends, options, check, mask, skip = problem
    offsets = np.cumsum([0, *map(len, times)]).tolist()
    row = np.concatenate(times)
    invalid: list[Fault] = []
    if check:
        invalid = _check_precision(problem)
        mask = without(mask, invalid, (len(times),))
    tasks = []
    for i, (factor, end) in enumerate(zip(factors_of(space), ends, strict=True)):
        parts = [own[i] for own in points]
        tol = max(part.tol for part in parts) if check else None
        numbers = np.concatenate([part.doubles for part in parts])
        tasks.append(Task(factor, row, numbers, end, tol, offsets, mask, check and skip))
    solved, faults = _solve(space, tasks, options, progress)

    def one(i: int, start: int, stop: int) -> Fit:
        own = slice(start, stop)
        columns = [found.columns.part(slice(i, i + 1)) for found in solved]
        arrays = [(found.points[own], found.velocities[own]) for found in solved]
        return Fit(curve_of(space, times[i], arrays), columns, options.method, [])

    fits = [one(i, *pair) for i, pair in enumerate(pairwise(offsets))]
    return fits, sorted(invalid + faults, key=_number)


def validated(
    space: Space[Any],
    times: NDArray[np.float64],
    points: list[Points],
    ends: list[list[End] | None],
    skip_invalid: bool = False,
    mask: Mask | None = None,
) -> tuple[list[Array], list[Fault]]:
    """The points in every factor after validation, projected onto the space, and the faults of skipped curves."""
    tasks = [
        Task(factor, times, part.doubles, end, part.tol, mask=mask, skip_invalid=skip_invalid)
        for factor, part, end in zip(factors_of(space), points, ends, strict=True)
    ]
    tasks, faults = _validated(space, tasks, _ANY)
    return [task.space._numbers(task.points) for task in tasks], faults


def hermite_data(
    space: Space[Any], times: NDArray[np.float64], points: list[Points], velocities: list[tuple[Array, float]]
) -> list[tuple[Array, Array, Array]]:
    """Points on the space, tangent velocities, and the longest distance between neighbours of each curve, in every
    factor.

    Args:
        velocities: contiguous, in every factor, with how far they may be from tangent.

    Raises:
        ValidationError: points or times are invalid, or a velocity is not tangent.
        CutLocusError: inner control points of a segment lie at or past each other's cut locus.
    """

    def checked(factor: Space, own: tuple[Points, tuple[Array, float]]) -> tuple[Array, Array, Array]:
        part, (vectors, tangent_tol) = own
        if isinstance(factor, Manifold):
            task = Task(factor, times, part.doubles, _NATURAL, part.tol)
            return *hermite_on_manifold(task, vectors), np.full(math.prod(part.batch), np.inf)
        doubles = factor._as_doubles(vectors)
        found, tangent, longest = _core.hermite(
            factor._handle, times, part.doubles, doubles, part.tol, tangent_tol
        )
        return factor._numbers(found), factor._numbers(tangent), longest

    return _in_factors(space, checked, list(zip(points, velocities, strict=True)))


def _solve(
    space: Space, tasks: list[Task], options: Options, progress: Progress | None
) -> tuple[list[Solved], list[Fault]]:
    """Solve the task of every factor, and return the faults. All factors are validated before the first is solved."""
    if all(kind_of(task.space) is CoreCurve for task in tasks):
        try:
            solved = solve(tasks, options, progress)
        except ValidationError as error:
            number = vars(error).pop("_factor", None)
            raise (error if number is None else _in_factor(error, number, tasks[number].space)) from None
        return solved, _faults_of(solved, [])
    tasks, invalid = _validated(space, tasks, options)
    solved = [
        kind_of(task.space).solve(task, options, share(progress, i, len(tasks)))
        for i, task in enumerate(tasks)
    ]
    return solved, _faults_of(solved, invalid)


def _validated(space: Space, tasks: list[Task], options: Options) -> tuple[list[Task], list[Fault]]:
    """Tasks whose points are on their spaces; a curve that is skipped in one factor is masked in all."""
    each = _in_factors(space, lambda factor, task: kind_of(factor).validate(task, options), tasks)
    found = {fault.curve: fault for _, faults in reversed(each) for fault in faults}
    faults = [found[curve] for curve in sorted(found)]
    mask = without(tasks[0].mask, faults, tasks[0].batch)
    return [task._replace(mask=mask) for task, _ in each], faults


def _faults_of(solved: list[Solved], invalid: list[Fault]) -> list[Fault]:
    """The faults of invalid curves, and those in the first factor in which curves failed, or else in which there is
    something to report, in the order of curves."""
    skipped = {fault.curve: fault for fault in invalid}
    others = []
    for found in solved:
        rest = []
        for fault in found.faults:
            if fault.kind == INVALID:
                skipped.setdefault(fault.curve, fault)
            else:
                rest.append(fault)
        if rest:
            others.append(rest)
    others.sort(key=lambda own: not any(fault.failed for fault in own))
    return sorted([*skipped.values(), *(others[0] if others else [])], key=_number)


def _number(fault: Fault) -> int:
    return fault.curve


def _in_factors(space: Space[Any], work: Callable[[Space, Any], _T], values: Sequence[Any]) -> list[_T]:
    """What work gives in every factor for its value; errors say in which."""
    if not isinstance(space, Product):
        return [work(space, values[0])]
    results = []
    for i, (factor, value) in enumerate(zip(space.factors, values, strict=True)):
        try:
            results.append(work(factor, value))
        except ValidationError as error:
            raise _in_factor(error, i, factor) from None
    return results


def _in_factor(error: ValidationError, number: int, factor: Space) -> ValidationError:
    """The error with the factor in which it was found."""
    return error._with_message(f"factor {number}, {factor!r}: {error}")


def _check_precision(problem: ManyProblem) -> list[Fault]:
    """Points in double precision may not be as far off as those in single precision beside them."""
    space, times, points, _, _, _, mask, skip = problem
    faults: dict[int, Fault] = {}
    for i, factor in enumerate(factors_of(space)):
        most = max(own[i].tol for own in points)
        for number, own in enumerate(points):
            # Invalid times are an error in any case, which is raised later.
            if own[i].tol < most and (mask is None or mask[number]):
                try:
                    kind_of(factor).validate(
                        Task(
                            factor,
                            np.arange(len(times[number]), dtype=float),
                            own[i].doubles,
                            _NATURAL,
                            own[i].tol,
                        ),
                        _ANY,
                    )
                except ValidationError as error:
                    if not skip:
                        raise error._of_curve(number) from None
                    faults.setdefault(number, Fault(number, INVALID, f"curve {number}: {error}"))
    return list(faults.values())
