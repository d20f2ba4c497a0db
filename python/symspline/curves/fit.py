"""From points to curves: the same for one curve, a batch, and many of different lengths, in any space.

A space has its kind of curve: plain, in the span of its points, on a manifold that is made of functions, or, for a
product, one in every factor. A further kind is a class with the methods of `Plain`, and its name in `kind_of`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from .._core import ValidationError
from ..report import Report, shaped
from ..spaces import Array, Product, Space, factors_of, parts_of, point_tol
from .curve import Curve
from .ends import End, ends_in_factors, ends_of
from .in_span import InSpan
from .on_manifold import OnManifold
from .plain import Plain
from .solve import Fault, Options, Progress, Solved, Task, failures
from .together import Together, share

_T = TypeVar("_T")
# Options for a fit that is not carried out.
_ANY = Options("auto", 0.0, None)


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


class Asked(NamedTuple):
    """Curves of equal length that are asked for.

    Attributes:
        times: knots, shape (N+1,), or (..., N+1) with one row per curve.
        points, ends: in every factor.
        check: whether points and ends are to be checked.
    """

    space: Space
    times: NDArray[np.float64]
    points: list[Points]
    ends: list[list[End] | None]
    options: Options
    check: bool


class Fit(NamedTuple):
    """What came of a fit: the curves, a report a factor, and what failed."""

    curve: Curve
    reports: list[Report]
    faults: list[Fault]


def kind_of(space: Space) -> type[Plain]:
    """How curves are made in a space that is no product."""
    for kind in (OnManifold, InSpan):
        if kind.suits(space):
            return kind
    return Plain


def read(points: Any, space: Space) -> list[Points]:
    """Points as a user gives them, in every factor."""
    if not isinstance(space, Product):
        return [_read(space, points)]
    found = _in_factors(space, _read, parts_of(points, space, "points"))
    if len({(part.batch, part.nodes) for part in found}) > 1:
        described = ", ".join(f"{part.nodes} points, batch axes {part.batch}" for part in found)
        raise ValidationError(f"points: the factors differ in length, or batch axes differ: {described}")
    return found


def _read(space: Space, points: Any) -> Points:
    array = space._array(points, "points")
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


def read_ends(bc_type: Any, space: Space, batch: tuple[int, ...]) -> list[list[End] | None]:
    """End conditions in every factor."""
    if not isinstance(space, Product):
        return [ends_of(bc_type, space, batch)]
    conditions = ends_in_factors(bc_type, space)
    return _in_factors(space, lambda factor, ends: ends_of(ends, factor, batch), conditions)


def curve_of(
    space: Space, times: NDArray[np.float64], arrays: Sequence[tuple[Array, Array]], fitted: bool = True
) -> Curve:
    """The curve with points and velocities, which are there for every factor.

    Args:
        fitted: whether velocities are those of a C² curve, not any.
    """
    if isinstance(space, Product):
        each = zip(space.factors, arrays, strict=True)
        return Together(space, tuple(_part(factor, times, *pair, fitted) for factor, pair in each))
    return _part(space, times, *arrays[0], fitted)


def _part(space: Space, times: NDArray[np.float64], points: Array, velocities: Array, fitted: bool) -> Plain:
    kind = kind_of(space)
    if kind is InSpan:
        return InSpan(space, times, points, velocities, fitted)
    return kind(space, times, points, velocities)


def fit(asked: Asked, progress: Progress | None) -> Fit:
    """Curves of equal length."""
    return finished(asked, solve_factors(asked, progress))


def solve_factors(asked: Asked, progress: Progress | None) -> list[Solved]:
    """What comes of curves of equal length in every factor."""
    space, times, points, ends, options, check = asked
    tasks = [
        Task(factor, times, part.doubles, end, part.tol if check else None)
        for factor, part, end in zip(factors_of(space), points, ends, strict=True)
    ]
    return _solve(space, tasks, options, progress)


def finished(asked: Asked, solved: list[Solved]) -> Fit:
    """Curves and reports of what was solved."""
    space, times, batch = asked.space, asked.times, asked.points[0].batch
    reports = [
        shaped(found.columns, times, batch, factor.curvature, asked.options.method)
        for factor, found in zip(factors_of(space), solved, strict=True)
    ]
    return Fit(curve_of(space, times, [found[:2] for found in solved]), reports, first_faults(solved))


def fit_many(
    space: Space,
    times: list[NDArray[np.float64]],
    points: list[list[Points]],
    ends: list[list[End] | None],
    options: Options,
    check: bool,
    progress: Progress | None,
) -> tuple[list[Fit], list[Fault]]:
    """Single curves of different lengths, in one call of the core a factor; and what failed."""
    offsets = np.cumsum([0, *map(len, times)]).tolist()
    row = np.concatenate(times)
    if check:
        _check_doubles(space, points)
    tasks = []
    for i, (factor, end) in enumerate(zip(factors_of(space), ends, strict=True)):
        parts = [own[i] for own in points]
        tol = max(part.tol for part in parts) if check else None
        tasks.append(Task(factor, row, np.concatenate([part.doubles for part in parts]), end, tol, offsets))
    solved = _solve(space, tasks, options, progress)

    def one(i: int, start: int, stop: int) -> Fit:
        own = slice(start, stop)
        reports = [
            shaped(
                found.columns.part(slice(i, i + 1)),
                times[i],
                (),
                task.space.curvature,
                options.method,
            )
            for task, found in zip(tasks, solved, strict=True)
        ]
        arrays = [(found.points[own], found.velocities[own]) for found in solved]
        return Fit(curve_of(space, times[i], arrays), reports, [])

    return [one(i, *pair) for i, pair in enumerate(pairwise(offsets))], first_faults(solved)


def validated(
    space: Space, times: NDArray[np.float64], points: list[Points], ends: list[list[End] | None]
) -> list[Array]:
    """The points in every factor, moved onto it, after the checks of a fit."""
    tasks = [
        Task(factor, times, part.doubles, end, part.tol)
        for factor, part, end in zip(factors_of(space), points, ends, strict=True)
    ]
    tasks = _checked(space, tasks, _ANY)
    return [task.space._numbers(task.points) for task in tasks]


def _solve(space: Space, tasks: list[Task], options: Options, progress: Progress | None) -> list[Solved]:
    """What every factor's kind of curve makes of its task; everything is checked before any work."""
    if len(tasks) == 1 and kind_of(space) is Plain:
        # The core checks before it solves.
        return [Plain.solve(tasks[0], options, progress)]
    return [
        kind_of(task.space).solve(task, options, share(progress, i, len(tasks)))
        for i, task in enumerate(_checked(space, tasks, options))
    ]


def _checked(space: Space, tasks: list[Task], options: Options) -> list[Task]:
    return _in_factors(space, lambda factor, task: kind_of(factor).checked(task, options), tasks)


def first_faults(solved: list[Solved]) -> list[Fault]:
    """The faults in the first factor in which curves failed, or else in which there is something to say."""
    faults = sorted((found.faults for found in solved if found.faults), key=lambda own: not failures(own))
    return faults[0] if faults else []


def _in_factors(space: Space, work: Callable[[Space, Any], _T], values: Sequence[Any]) -> list[_T]:
    """What work gives in every factor for its value; errors say in which."""
    if not isinstance(space, Product):
        return [work(space, values[0])]
    results = []
    for i, (factor, value) in enumerate(zip(space.factors, values, strict=True)):
        try:
            results.append(work(factor, value))
        except ValidationError as error:
            raise ValidationError(f"factor {i}, {factor!r}: {error}") from None
    return results


def _check_doubles(space: Space, points: list[list[Points]]) -> None:
    """Points in double precision may not be as far off as those in single precision beside them."""
    for i, factor in enumerate(factors_of(space)):
        most = max(own[i].tol for own in points)
        for number, own in enumerate(points):
            if own[i].tol < most:
                doubles = own[i].doubles
                try:
                    factor._handle.check_points(doubles.reshape(len(doubles), -1), [len(doubles)], own[i].tol)
                except ValidationError as error:
                    raise ValidationError(f"curve {number}: {error}") from None
