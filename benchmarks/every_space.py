"""Fit, evaluation and geodesics in every kind of space, beside NumPy, pyriemann and pymanopt."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

import symspline as ss

from . import data, geodesics, geometries, gradients, machine, space_rows
from .data import Array
from .side_by_side import QUANTITIES
from .tables import count, table, versus
from .timing import Effort, Result, in_unit, measure, ready, shared
from .walks import walks

ONE, TWO, NUMPY = "one core", "two cores", "NumPy"


@dataclass(frozen=True)
class Case:
    """How much of what in a space.

    Attributes:
        space: its name.
        curves: how many curves are fitted at once.
        few: how many of them NumPy fits.
        evaluated: how many of them are evaluated.
        knots: of every curve.
    """

    space: str
    curves: int
    few: int
    evaluated: int
    knots: int = 12


@dataclass(frozen=True)
class Plan:
    """What is measured.

    Attributes:
        cases: the spaces.
        samples: of every curve that is evaluated.
        pairs: most pairs of points between which geodesics are taken.
        effort: how much a measurement may cost.
        rows: the spaces of the table with one row per space.
        row_curves: number of its curves.
    """

    cases: tuple[Case, ...]
    samples: int
    pairs: int
    effort: Effort
    rows: tuple[str, ...]
    row_curves: int

    def with_large(self) -> Plan:
        """Also one curve of small subspaces of a large space."""
        return replace(self, cases=(*self.cases, LARGE))


FULL = Plan(
    (
        Case("spd:3", 100_000, 5000, 1000),
        Case("so:3", 10_000, 5000, 1000),
        Case("u:4", 10_000, 2000, 500),
        Case("gr:2,5", 10_000, 2000, 1000),
        Case("cp:3", 10_000, 5000, 1000),
        Case("se:3", 10_000, 5000, 1000),
        Case("spd:30", 100, 50, 4),
        Case("u:16", 100, 50, 10),
    ),
    samples=100,
    pairs=500,
    effort=Effort(5, 0.02, 3),
    rows=space_rows.NAMES,
    row_curves=200,
)
QUICK = Plan(
    tuple(Case(name, 3, 2, 1) for name in ("spd:3", "so:3", "u:4", "gr:2,5", "cp:3", "se:3", "gr:2,50")),
    samples=5,
    pairs=2,
    effort=Effort(2, 0, 0.1),
    rows=("sphere:2", "st:2,4", "cp:3"),
    row_curves=2,
)
LARGE = Case("gr:10,10000", 1, 1, 1, knots=20)


def pieces(plan: Plan, threads: int) -> Iterator[str]:
    """The tables, paragraph by paragraph."""
    where = machine.description(threads, ("symspline", "numpy", *geodesics.PEERS))
    yield "; ".join(f"{name}: {value}" for name, value in where.items()) + "."
    points = {case: walks(ss.space(case.space), case.curves, case.knots) for case in plan.cases}
    with one_core():
        yield space_rows.text(plan.rows, plan.row_curves, plan.samples, plan.effort)
        yield fits_text(points, plan.effort)
        yield samples_text(points, plan.samples, plan.effort)
        yield gradients.text(plan.effort)
        yield geodesics.text({case.space: _pairs(p, plan.pairs) for case, p in points.items()}, plan.effort)


def one_core() -> AbstractContextManager[object]:
    """Keeps BLAS to one core: more bring small matrices nothing, and on a busy machine cost much."""
    # Only what is loaded is limited; SciPy, which pymanopt uses, has a BLAS of its own.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    limits: AbstractContextManager[object] = threadpool_limits(1)
    return limits


def fits_text(points: Mapping[Case, Array], effort: Effort) -> str:
    """Time of a fit, for one curve."""
    lines = []
    for case, p in points.items():
        space = ss.space(case.space)
        check(p[: case.few], space)
        floor = ready(partial(geometries.velocities, p[: case.few], space))
        fit = partial(ss.CubicSpline, None, p, space)
        found = measure({**{name: ready(fit, n) for name, n in _cores()}, NUMPY: floor}, effort)
        each = {name: shared(result, case.few if name == NUMPY else len(p)) for name, result in found.items()}
        work = f"{space!r}: {count(len(p))} × {case.knots} knots"
        lines.append([work, *_by_cores(each, 1e-6), in_unit(each[NUMPY], 1e-6), versus(each, NUMPY, ONE)[0]])
    return table(("fit: µs a curve", ONE, TWO, "ratio", f"{NUMPY}, one core", "ratio to one core"), lines)


def samples_text(points: Mapping[Case, Array], samples: int, effort: Effort) -> str:
    """Time of an evaluation, for one sample."""
    lines = []
    for case, p in points.items():
        space = ss.space(case.space)
        curves = ss.CubicSpline(None, p[: case.evaluated], space)
        x = data.times(case.knots, samples)
        for nu, quantity in enumerate(QUANTITIES):
            found = measure({name: ready(partial(curves, x, nu), n) for name, n in _cores()}, effort)
            each = {name: shared(result, case.evaluated * samples) for name, result in found.items()}
            lines.append([f"{space!r}: {quantity}", *_by_cores(each, 1e-9)])
    return table(("evaluate: ns a sample", ONE, TWO, "ratio"), lines)


def check(points: Array, space: ss.Space) -> None:
    """Stop the benchmark if NumPy's velocities are not those of symspline."""
    expected = ss.CubicSpline(None, points, space).velocities
    gap = np.abs(geometries.velocities(points, space) - expected).max()
    geodesics.agree(float(gap), geodesics.TOLERANCE, f"{NUMPY}: fit in {space!r}")


def _cores() -> list[tuple[str, int]]:
    return [(ONE, 1), (TWO, 2)] if (os.cpu_count() or 1) > 1 else [(ONE, 1)]


def _by_cores(found: Mapping[str, Result], unit: float) -> list[object]:
    """Times on one core and on two, if there are two, and their ratio."""
    if TWO not in found:
        return [in_unit(found[ONE], unit), None, None]
    return [in_unit(found[ONE], unit), in_unit(found[TWO], unit), versus(found, ONE, TWO)[0]]


def _pairs(points: Array, most: int) -> tuple[Array, Array]:
    """Neighbours on as many curves, as arrays of their own."""
    return points[:most, 0].copy(), points[:most, 1].copy()
