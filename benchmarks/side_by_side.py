"""symspline beside the others, on the same rotations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from . import data
from .data import Array, Sizes
from .libraries import Library, all_libraries, angular, symspline
from .tables import count, table, versus
from .timing import Contestant, Effort, Result, Work, failure, measure

ALL_CORES = "symspline, all cores"
QUANTITIES = ("value", "rate", "acceleration")

Use = Callable[[Library], Work]


@dataclass(frozen=True)
class Row:
    """A line of the table: results by library, and the goal beside RotationSpline, on one core and on all."""

    work: str
    results: dict[str, Result]
    goal: float | None = None
    goal_all: float | None = None


def construction(walk: Array, sizes: Sizes, threads: int, effort: Effort) -> dict[int, dict[str, Result]]:
    """Times of the construction by number of knots: of symspline also on all cores, of the others up
    to some number."""
    found = {}
    for n in sizes.knots:
        libraries = all_libraries() if n <= sizes.most_knots_of_others else [symspline()]
        found[n] = _measure(_construct(data.knots(n), walk[:n]), libraries, threads, effort)
    return found


def rows(
    walk: Array, built: dict[int, dict[str, Result]], sizes: Sizes, threads: int, effort: Effort
) -> list[Row]:
    """The whole comparison."""
    goals = {10: 50.0, 1000: 30.0, 100_000: 50.0} if sizes.goals else {}
    made = [
        Row(f"construct, {count(n)} knots", _worth_showing(n, results), goals.get(n), goals.get(n))
        for n, results in built.items()
        if n <= sizes.most_knots_of_others
    ]
    made.append(_uneven(sizes, threads, effort))
    made += _evaluation(walk[: sizes.knots_to_evaluate], sizes, effort)
    made.append(_many(walk, sizes, threads, effort))
    return made


def text(rows: list[Row]) -> str:
    """The table; a line for each number of cores."""
    head = ("work", "symspline", "RotationSpline", "ratio", "goal", "splines", "ratio")
    return table(head, [line for row in rows for line in _lines(row)])


def agreement(walk: Array, sizes: Sizes) -> str:
    """How far the curves of the others are from that of symspline, ten knots away from the ends."""
    points = walk[: sizes.knots_to_evaluate]
    x = np.linspace(10, len(points) - 11, min(2000, sizes.samples))
    own, *others = all_libraries()
    curve = own.curve(*own.arguments(data.knots(len(points)), points))
    values = [own.numbers(curve, x, nu) for nu in range(3)]
    lines = [
        [library.name, *(_gap(values[nu], library, points, x, nu) for nu in range(3))] for library in others
    ]
    head = ("largest distance from symspline", "angle, rad", "angular velocity", "angular acceleration")
    return table(head, lines)


def _worth_showing(n: int, results: dict[str, Result]) -> dict[str, Result]:
    """Short curves are fitted on one core anyway."""
    return {name: result for name, result in results.items() if n > 1000 or name != ALL_CORES}


def _uneven(sizes: Sizes, threads: int, effort: Effort) -> Row:
    n = sizes.most_knots_of_others
    use = _construct(*data.uneven(n))
    return Row(f"construct, {count(n)} knots, uneven gaps", _measure(use, all_libraries(), threads, effort))


def _evaluation(points: Array, sizes: Sizes, effort: Effort) -> list[Row]:
    t = data.knots(len(points))
    x = data.times(len(points), sizes.samples)
    orders = {"sorted": x, "in random order": data.shuffled(x)}
    goals = (20.0, 8.0, 8.0) if sizes.goals else (None,) * 3
    made, samples = [], f"{count(sizes.samples)} samples"
    for order, at in orders.items():
        for nu, (quantity, goal) in enumerate(zip(QUANTITIES, goals, strict=True)):
            results = _measure(_evaluate(t, points, at, nu), all_libraries(), None, effort)
            made.append(Row(f"{samples} {order}: {quantity}", results, goal if order == "sorted" else None))
    for nu in (1, 2):
        results = _measure(_angular(t, points, x, nu), all_libraries(), None, effort)
        goal = (6.0, 7.0)[nu - 1] if sizes.goals else None
        made.append(Row(f"{samples} sorted: angular {('velocity', 'acceleration')[nu - 1]}", results, goal))
    middle = 0.3712 * float(t[-1])
    single = _measure(_evaluate(t, points, middle, 0), all_libraries(), None, effort)
    return [*made, Row("one sample: value", single, 15.0 if sizes.goals else None)]


def _many(walk: Array, sizes: Sizes, threads: int, effort: Effort) -> Row:
    curves, keys, samples = sizes.many
    points = walk[: curves * keys].reshape(curves, keys, 4)
    t, x = data.knots(keys), data.times(keys, samples)

    def use(library: Library) -> Work:
        if library.name == "symspline":
            arguments = library.arguments(t, points)
            return lambda: library.at(library.curve(*arguments))(x, 0)
        each = [library.arguments(t, own) for own in points]
        return lambda: [library.at(library.curve(*arguments))(x, 0) for arguments in each]

    label = f"{count(curves)} curves × {keys} knots × {samples} values, with construction"
    goals = (200.0, 350.0) if sizes.goals else ()
    return Row(label, _measure(use, all_libraries(), threads, effort), *goals)


def _construct(t: Array, points: Array) -> Use:
    return lambda library: partial(library.curve, *library.arguments(t, points))


def _evaluate(t: Array, points: Array, x: Any, nu: int) -> Use:
    return lambda library: partial(library.at(library.curve(*library.arguments(t, points))), x, nu)


def _angular(t: Array, points: Array, x: Array, nu: int) -> Use:
    """What the others give as derivatives; symspline from a curve of matrices."""

    def use(library: Library) -> Work:
        return (
            angular(t, points, x, nu) if library.name == "symspline" else _evaluate(t, points, x, nu)(library)
        )

    return use


def _measure(use: Use, libraries: list[Library], threads: int | None, effort: Effort) -> dict[str, Result]:
    """Times of all libraries, symspline on one core and, if threads are given, on all."""
    contestants = {library.name: Contestant(partial(use, library)) for library in libraries}
    if threads is not None:
        contestants[ALL_CORES] = Contestant(partial(use, libraries[0]), threads)
    return measure(contestants, effort)


def _lines(row: Row) -> list[list[object]]:
    result = row.results
    others = [result["RotationSpline"], result["splines"]]
    lines: list[list[object]] = []
    for name, goal in (("symspline", row.goal), (ALL_CORES, row.goal_all)):
        if name not in result:
            continue
        label = row.work if name == "symspline" else f"{row.work}; symspline on all cores"
        first, second = versus(result, "RotationSpline", name, goal), versus(result, "splines", name)
        lines.append([label, result[name], others[0], *first, others[1], second[0]])
    return lines


def _gap(own: Array, library: Library, points: Array, x: Array, nu: int) -> str:
    try:
        curve = library.curve(*library.arguments(data.knots(len(points)), points))
        theirs = library.numbers(curve, x, nu)
    except Exception as error:
        return str(failure(error))
    gap = np.linalg.norm(own - theirs, axis=-1).max()
    # The angle of a rotation is twice the distance of the quaternions.
    return f"{gap if nu else 2 * gap:.1e}"
