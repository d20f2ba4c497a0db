"""Fits of one curve, a batch of curves, and curves of different lengths, in any space."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from types import MappingProxyType
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._base.arrays import as_array, refuse
from .._base.faults import INVALID, Fault, of_index
from .._base.report import Columns, Report, shaped
from .._base.typing import Array, CubicBCType, PointsLike, Progress
from .._core import ValidationError
from .._spaces import AnySpace, Doubles, Product, Quotient, Space, Torus, cover_of, factors_of, parts_of
from ..manifolds import Manifold
from .curve import CurveArrays, FactorArrays, require_short_handles, share, turns_of
from .ends import NATURAL, End, ends_in_factors, ends_of, is_closed, split_ends
from .manifold_fit import fit_of_one_length, hermite_on_manifold, validate_on_manifold
from .on_manifold import Mixed, OnManifold
from .reduced import solve_in_span
from .solve import Mask, Options, Solved, Task, faults_of, solve, solve_in_python, solve_single, validate, without

_T = TypeVar("_T")
_Times = TypeVar("_Times")
_Data = TypeVar("_Data")
InnerVelocities = Mapping[int, list[Doubles]]
# Options for a validation, which has no solver.
_ANY = Options("auto", 0.0, None)


class Points(NamedTuple):
    """Points of curves in a space that is not a product.

    Attributes
    ----------
    numbers : ndarray, shape (*batch, nodes, *numbers of a point)
        Floating-point numbers of the core.
    tol : float
        Tolerance of points off the space.
    batch : tuple of int
        Shape of the batch axes.
    nodes : int
        Number of points per curve.
    moves : ndarray of int or None
        In a quotient, the transformations that were applied to the points of the user, shape (*batch, nodes). None
        if the points were not changed.
    """

    numbers: Doubles
    tol: float
    batch: tuple[int, ...]
    nodes: int
    moves: NDArray[np.intp] | None = None


class Problem(NamedTuple, Generic[_Times, _Data]):
    """Curves to fit: with equal numbers of points, or single curves of different lengths.

    Attributes
    ----------
    times : ndarray, shape (N+1,) or (..., N+1), or list of ndarray
        Knots, shared or with one row per curve; for curves of different lengths, one array per curve.
    points : list of Points, or list of lists of them
        Points in each factor; for curves of different lengths, one such list per curve.
    ends : list
        End conditions in each factor.
    check : bool
        Whether to validate points and ends.
    mask : ndarray of bool or None
        Curves to fit; masked curves are NaN. None fits all curves.
    skip_invalid : bool
        Whether curves with points off the space are masked instead of raising an error.
    names : sequence of int or None
        Indices of the nodes in messages; None for 0, 1, ...
    inner : dict
        Prescribed velocities in each factor, by inner node.
    """

    space: AnySpace
    times: _Times
    points: _Data
    ends: list[list[End] | None]
    options: Options
    check: bool = True
    mask: Mask | None = None
    skip_invalid: bool = False
    names: Sequence[int] | None = None
    inner: InnerVelocities = MappingProxyType({})


FitProblem = Problem[Doubles, list[Points]]
ManyProblem = Problem[list[Doubles], list[list[Points]]]


class Fit(NamedTuple):
    """The result of a fit.

    Attributes
    ----------
    curve : CurveArrays
    columns : list of Columns
        The reports in each factor.
    method : str
        The method that was requested.
    faults : list of Fault
    """

    curve: CurveArrays
    columns: list[Columns]
    method: str
    faults: list[Fault]

    def reports(self) -> list[Report]:
        """Return the reports in each factor."""
        times, batch = self.curve.times, self.curve.batch
        return [
            shaped(columns, times, batch, part.space, self.method)
            for part, columns in zip(self.curve.parts, self.columns, strict=True)
        ]


def read(points: Any, space: AnySpace) -> list[Points]:
    """Read points from the user in each factor, in quotients as representatives that are continuous along the curve."""
    if not space._has_quotients:
        return read_given(points, space) if isinstance(space, Product) else [_read(space, points)]
    return [unwrapped(*pair) for pair in zip(factors_of(space), read_given(points, space), strict=True)]


def unwrapped(space: AnySpace, part: Points) -> Points:
    """Choose representatives that are continuous along each curve."""
    if not isinstance(space, Quotient):
        return part
    numbers = space._numbers(part.numbers)
    moves = space._transformations(numbers, space._where_finite(numbers))
    if (moves == space._group.identity).all():
        return part
    moved = np.ascontiguousarray(space._moved_by(numbers, moves))
    return part._replace(numbers=space._as_doubles(moved), moves=moves)


def read_given(points: object, space: AnySpace) -> list[Points]:
    """Read points from the user in each factor, as they are."""
    if not isinstance(space, Product):
        return [_read(space, points)]
    data = _in_factors(space, _read, parts_of(points, space, "points"))
    equal = True
    for part in data:
        equal &= part.nodes == data[0].nodes and part.batch == data[0].batch
    if not equal:
        described = ", ".join(f"{part.nodes} points, batch axes {part.batch}" for part in data)
        raise ValidationError(f"the factors of points have different lengths, or their batch axes differ: {described}")
    return data


def _read(space: Space, points: Any) -> Points:
    if type(points) is np.ndarray and points.dtype == np.float64 and not space._complex:
        # The usual case is checked without further function calls.
        flags, shape, axis = points.flags, points.shape, points.ndim - len(space._point_shape) - 1
        suits = axis >= 0 and points.size and shape[axis] >= 2 and shape[axis + 1 :] == space._point_shape
        if suits and flags.c_contiguous and flags.aligned:
            return Points(points, space._tol(points), shape[:axis], shape[axis])
    known = type(points) is np.ndarray and not isinstance(space, Quotient)
    array = points if known else space._array(points, "points")
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
    return Points(doubles, space._tol(array), lead[:-1], lead[-1])


def read_velocities(velocities: PointsLike | None, space: AnySpace, data: list[Points]) -> list[tuple[Array, float]]:
    """Return velocities in each factor, and how far they may be from tangent, after checks of shape and numbers."""
    results = []
    for factor, part, value in zip(factors_of(space), data, parts_of(velocities, space, "velocities"), strict=True):
        array = factor._array(value, "velocities")
        doubles = factor._doubles(array, "velocities")
        # A view has flags of its own, so that making it read-only leaves the user's array as it is.
        numbers = factor._numbers(doubles).view()
        if doubles.shape != part.numbers.shape:
            shape = factor._numbers(part.numbers).shape
            raise ValidationError(f"velocities has shape {numbers.shape}, but points {shape}")
        refuse(~np.isfinite(numbers), "velocities", lambda _: "is not finite")
        if part.moves is not None and isinstance(factor, Quotient):
            numbers = np.ascontiguousarray(factor._moved_by(numbers, part.moves))
        results.append((numbers, factor._tol(array)))
    return results


def read_ends(bc_type: Any, space: AnySpace, batch: tuple[int, ...]) -> list[list[End] | None]:
    """Read end conditions in each factor."""
    if isinstance(bc_type, str) and bc_type == "natural":
        return [NATURAL] * (len(space.factors) if isinstance(space, Product) else 1)
    if not isinstance(space, Product):
        return [ends_of(bc_type, space, batch)]
    conditions = ends_in_factors(bc_type, space)
    return _in_factors(space, lambda factor, ends: ends_of(ends, factor, batch), conditions)


def moved_ends(bc_type: Any, space: AnySpace, data: list[Points]) -> Any:
    """Return end conditions for the chosen representatives.

    Vectors at the last point are tangent at the representative that the user gave.

    Raises
    ------
    ValidationError
        If a closed curve does not return to the representative of its first point.
    """
    if is_closed(bc_type):
        for factor, part in zip(factors_of(space), data, strict=True):
            _check_closed(factor, part)
    return _moved_ends(bc_type, space, [part.moves if part.moves is None else part.moves[..., -1] for part in data])


def moved_ends_of_many(bc_type: CubicBCType, space: AnySpace, points: list[list[Points]]) -> Any:
    """Return end conditions for the chosen representatives of single curves of different lengths."""
    for number, parts in enumerate(points):
        try:
            moved_ends(bc_type if is_closed(bc_type) else "natural", space, parts)
        except ValidationError as error:
            raise error._of_curve(number) from None
    last: list[NDArray[np.intp] | None] = []
    for i, factor in enumerate(factors_of(space)):
        moves_of_curves = [parts_of_curve[i].moves for parts_of_curve in points]
        known = isinstance(factor, Quotient) and any(moves is not None for moves in moves_of_curves)
        still = factor._group.identity if isinstance(factor, Quotient) else 0
        last.append(np.array([still if moves is None else moves[-1] for moves in moves_of_curves]) if known else None)
    return _moved_ends(bc_type, space, last)


def _check_closed(space: AnySpace, part: Points) -> None:
    if not isinstance(space, Quotient):
        return
    numbers = space._numbers(part.numbers)
    first, last = (np.take(numbers, i, axis=len(part.batch)).reshape(-1, *space.point_shape) for i in (0, -1))
    good = space._where_finite(first) & space._where_finite(last)
    opens = np.flatnonzero(good)[space._nearest(first[good], last[good]).moves != space._group.identity]
    if opens.size:
        curve = [int(i) for i in np.unravel_index(opens[0], part.batch)]
        raise ValidationError(
            f"the curve{of_index(curve)} is not closed: continuous representatives from points[0] on end at "
            f"points[{part.nodes - 1}], which is equivalent to points[0], but another representative. Repeat the "
            "points until they return to the same representative, or use another bc_type."
        )


def _moved_ends(bc_type: Any, space: AnySpace, last: list[NDArray[np.intp] | None]) -> Any:
    if isinstance(bc_type, str) or all(moves is None for moves in last):
        return bc_type
    _, (_, word, vector) = split_ends(bc_type)
    if vector is None:
        return bc_type
    moved = []
    for factor, moves, part in zip(factors_of(space), last, parts_of(vector, space, "an end vector"), strict=True):
        if moves is None or not isinstance(factor, Quotient):
            moved.append(part)
            continue
        numbers = factor._numbers(factor._doubles(part, "an end vector"))
        lead = factor._leads({"an end vector": numbers.shape}, moves.shape)
        numbers = np.broadcast_to(numbers, lead + factor.point_shape)
        moved.append(factor._moved_by(numbers, np.broadcast_to(moves, lead)))
    return bc_type[0], (word, tuple(moved) if isinstance(space, Product) else moved[0])


def curve_of(
    space: AnySpace, times: Doubles, arrays: Sequence[tuple[Array, Array]], fitted: bool = True
) -> CurveArrays:
    """Return the curve with given points and velocities in each factor.

    Parameters
    ----------
    fitted : bool
        Whether velocities are those of a C² curve.
    """
    factors = tuple([FactorArrays(f, *pair) for f, pair in zip(factors_of(space), arrays, strict=True)])
    return curve_of_factors(space, times, factors, fitted)


def curve_of_factors(
    space: AnySpace, times: Doubles, factors: tuple[FactorArrays, ...], fitted: bool = True
) -> CurveArrays:
    """Return the curve with given arrays in each factor."""
    kind: type[CurveArrays] = CurveArrays
    for factor in factors:
        if factor.space._in_python:
            kind = Mixed if isinstance(space, Product) else OnManifold
    return kind(space, times, factors, fitted)


def mask_of(where: ArrayLike | None, batch: tuple[int, ...]) -> Mask | None:
    """Read the argument `where`; None means all curves."""
    if where is None:
        return None
    mask = as_array(where, "where")
    if mask.dtype != bool or mask.shape != batch:
        raise ValidationError(f"where must be a Boolean array of shape {batch}, not {mask.dtype} of shape {mask.shape}")
    return None if mask.all() else mask


def fit(problem: FitProblem, progress: Progress | None = None) -> Fit:
    """Fit curves with equal numbers of points."""
    space, times, options = problem.space, problem.times, problem.options
    factors = factors_of(space)
    solved, faults = solve_tasks(space, tasks_of(problem, factors), options, progress)
    arrays, columns = [], []
    for factor, solution in zip(factors, solved, strict=True):
        arrays.append(FactorArrays(factor, solution.points, solution.velocities))
        columns.append(solution.columns)
    curve = curve_of_factors(space, times, tuple(arrays), not problem.inner)
    return Fit(curve, columns, options.method, faults)


def tasks_of(problem: FitProblem, factors: Sequence[Space]) -> list[Task]:
    """Return the tasks of all factors."""
    _, times, points, ends, _, check, mask, skip, names, inner = problem
    # Loops take fewer calls of functions than comprehensions, and most fits are short.
    tasks = []
    for i, (factor, part, end) in enumerate(zip(factors, points, ends, strict=True)):
        cover, radius = factor, None
        if isinstance(factor, Quotient):
            cover, radius = factor.cover, factor.injectivity_radius
        tol = part.tol if check else None
        vectors = {node: of_factors[i] for node, of_factors in inner.items()} if inner else None
        tasks.append(Task(cover, times, part.numbers, end, tol, None, mask, check and skip, names, vectors, radius))
    return tasks


def fit_many(problem: ManyProblem, progress: Progress | None) -> tuple[list[Fit], list[Fault]]:
    """Fit single curves of different lengths in one call of the core per factor. Return the fits and the faults."""
    space, times, points, ends, options, check, mask, skip, _, _ = problem
    offsets = np.cumsum([0, *map(len, times)]).tolist()
    row = np.concatenate(times)
    invalid: list[Fault] = []
    if check:
        invalid = _check_precision(problem)
        mask = without(mask, invalid, (len(times),))
    tasks = []
    for i, (factor, end) in enumerate(zip(factors_of(space), ends, strict=True)):
        parts = [nodes[i] for nodes in points]
        tol = max(part.tol for part in parts) if check else None
        numbers = np.concatenate([part.numbers for part in parts])
        radius = factor.injectivity_radius if isinstance(factor, Quotient) else None
        cover = cover_of(factor)
        tasks.append(Task(cover, row, numbers, end, tol, offsets, mask, check and skip, radius=radius))
    solved, faults = solve_tasks(space, tasks, options, progress)

    def one(i: int, start: int, stop: int) -> Fit:
        nodes = slice(start, stop)
        columns = [solution.columns.part(slice(i, i + 1)) for solution in solved]
        arrays = [(solution.points[nodes], solution.velocities[nodes]) for solution in solved]
        return Fit(curve_of(space, times[i], arrays), columns, options.method, [])

    fits = [one(i, *pair) for i, pair in enumerate(pairwise(offsets))]
    return fits, sorted(invalid + faults, key=lambda fault: fault.curve)


def validated(
    space: AnySpace,
    times: Doubles,
    points: list[Points],
    ends: list[list[End] | None],
    skip_invalid: bool = False,
    mask: Mask | None = None,
) -> tuple[list[Array], list[Fault]]:
    """Validate points and project them onto the space. Return them in each factor, and the faults of skipped curves."""
    problem = Problem(space, times, points, ends, _ANY, mask=mask, skip_invalid=skip_invalid)
    tasks, faults = validated_tasks(space, tasks_of(problem, factors_of(space)), _ANY)
    on_space = []
    for task in tasks:
        on_space.append(task.space._numbers(task.points))
    return on_space, faults


def hermite_data(
    space: AnySpace, times: Doubles, points: list[Points], velocities: list[tuple[Array, float]]
) -> list[tuple[Array, Array, Array]]:
    """Validate the data of a Hermite spline.

    Parameters
    ----------
    velocities : list of tuple
        Contiguous velocities in each factor, with the tolerance of their normal component.

    Returns
    -------
    list of tuple
        In each factor, points on the space, tangent velocities, and the longest distance between neighbours of each
        curve.

    Raises
    ------
    ValidationError
        If points or times are invalid, or a velocity is not tangent or too fast for its segments.
    CutLocusError
        If inner control points of a segment lie at or past each other's cut locus.
    """

    def checked(factor: Space, data_of_factor: tuple[Points, tuple[Array, float]]) -> tuple[Array, Array, Array]:
        part, (vectors, tangent_tol) = data_of_factor
        if isinstance(factor, Manifold):
            task = Task(cover_of(factor), times, part.numbers, NATURAL, part.tol)
            return *hermite_on_manifold(task, vectors), np.full(math.prod(part.batch), np.inf)
        doubles = factor._as_doubles(vectors)
        turns = turns_of(times, part.numbers, doubles) if isinstance(factor, Torus) else None
        slow = doubles
        if turns is not None:
            # The curve between these nodes has more knots, so that its control points are not those of the segment.
            slow = doubles.copy()
            slow[..., :-1, :][turns.sides > 0] = slow[..., 1:, :][turns.sides > 0] = np.nan
        on_space, tangent, longest = _core.hermite(factor._handle, times, part.numbers, slow, part.tol, tangent_tol)
        if turns is not None:
            tangent = doubles
        on_space, tangent = factor._numbers(on_space), factor._numbers(tangent)
        require_short_handles(factor, times, on_space, tangent)
        return on_space, tangent, longest

    return _in_factors(space, checked, list(zip(points, velocities, strict=True)))


def _validate(_: Space, task: Task, options: Options) -> tuple[Task, list[Fault]]:
    return validate_on_manifold(task, options) if isinstance(task.space, Manifold) else validate(task)


def _solve(task: Task, options: Options, progress: Progress | None) -> Solved:
    if not (task.space._in_python or task.space._is_large):
        return solve_single(task, options, progress)
    solver = fit_of_one_length if isinstance(task.space, Manifold) else solve_in_span
    return solve_in_python(task, options, progress, solver)


def solve_tasks(
    space: Space, tasks: list[Task], options: Options, progress: Progress | None
) -> tuple[list[Solved], list[Fault]]:
    """Validate the tasks of all factors, then solve them. Return the solutions and the faults."""
    compiled = True
    for task in tasks:
        compiled &= not (task.space._in_python or task.space._is_large)
    if compiled:
        try:
            return solve(tasks, options, progress)
        except ValidationError as error:
            number = vars(error).pop("_factor", None)
            raise (error if number is None else _in_factor(error, number, tasks[number].space)) from None
    tasks, invalid = validated_tasks(space, tasks, options)
    solutions = [_solve(task, options, share(progress, i, len(tasks))) for i, task in enumerate(tasks)]
    return solutions, faults_of(solutions, invalid)


def validated_tasks(space: Space, tasks: list[Task], options: Options) -> tuple[list[Task], list[Fault]]:
    """Validate tasks and project their points. A curve that is skipped in one factor is masked in all of them."""
    validations = _in_factors(space, partial(_validate, options=options), tasks)
    valid, faults_of_factors = zip(*validations, strict=True)
    if not any(faults_of_factors):
        return list(valid), []
    first_faults = {fault.curve: fault for faults in reversed(faults_of_factors) for fault in faults}
    faults = [first_faults[curve] for curve in sorted(first_faults)]
    mask = without(tasks[0].mask, faults, tasks[0].batch)
    return [task._replace(mask=mask) for task in valid], faults


def _in_factors(space: AnySpace, work: Callable[[Space, Any], _T], values: Sequence[Any]) -> list[_T]:
    """Apply a function to each factor and its value. Errors name the factor."""
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
    """Return an error that names its factor."""
    return error._with_message(f"factor {number}, {factor!r}: {error}")


def _check_precision(problem: ManyProblem) -> list[Fault]:
    """Validate curves whose tolerance is stricter than the largest one, which the common call applies to all curves."""
    space, times, points, _, _, _, mask, skip, _, _ = problem
    faults: dict[int, Fault] = {}
    for i, factor in enumerate(factors_of(space)):
        most = max(parts_of_curve[i].tol for parts_of_curve in points)
        for number, parts_of_curve in enumerate(points):
            if parts_of_curve[i].tol >= most or (mask is not None and not mask[number]):
                continue
            # Invalid times are an error in any case, which is raised later.
            knots = np.arange(len(times[number]), dtype=float)
            task = Task(factor, knots, parts_of_curve[i].numbers, NATURAL, parts_of_curve[i].tol)
            try:
                _validate(factor, task, _ANY)
            except ValidationError as error:
                if not skip:
                    raise error._of_curve(number) from None
                faults.setdefault(number, Fault(number, INVALID, f"curve {number}: {error}"))
    return list(faults.values())
