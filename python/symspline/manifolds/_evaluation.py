"""Bézier curves by de Casteljau's algorithm with exp and log, and their derivatives by differences."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._spaces import Array
from ._condition import ControlPolygon
from ._differences import STEPS, eighth_difference, first_derivative, second_derivative
from ._operations import Operations

Doubles = NDArray[np.float64]

# Of the length of a segment. Errors of order eight of a segment that turns by a radian, and rounding, are some 1e-12
# of its squared speed in its acceleration.
STEP = 1 / 64
# Eighth differences beyond this part of the way, and this part of the size of arrays, show that a segment is not
# smooth on that scale: de Casteljau's inner geodesics jump where their ends pass each other's cut locus. Then steps
# are halved, this often at most.
ROUGH, NOISE, HALVINGS = 1e-8, 1e-9, 7


class Rows(NamedTuple):
    """Positions on segments, one per row.

    Attributes
    ----------
    tau : ndarray, shape (rows,)
        0 at the start of the segment and 1 at its end.
    h : ndarray, shape (rows,)
        Duration of the segment.
    polygon : ControlPolygon
        Control polygon of the segment, with rows in place of curves and segments.
    straight : ndarray of bool, shape (rows,)
        Whether the curve continues as a geodesic, before the start of the segment or after its end.
    """

    tau: Doubles
    h: Doubles
    polygon: ControlPolygon
    straight: NDArray[np.bool_]

    def at(self, chosen: NDArray[np.int64]) -> Rows:
        """Some of the rows."""
        return Rows(self.tau[chosen], self.h[chosen], self.polygon.at(chosen), self.straight[chosen])


def points(operations: Operations, rows: Rows) -> Array:
    """The curve (8), by its control polygon."""
    polygon = rows.polygon
    if not rows.straight.any():
        return _bezier(operations, rows.tau, polygon)
    result: Array = np.empty_like(polygon.p[0])
    for chosen, work in ((~rows.straight, _bezier), (rows.straight, _geodesic)):
        result[chosen] = work(operations, rows.tau[chosen], polygon.at(chosen))
    return result


def _bezier(operations: Operations, tau: Doubles, polygon: ControlPolygon) -> Array:
    t = tau.reshape(-1, *[1] * (polygon.p.ndim - 2))
    # The outer handles are given by their velocities, which is exact for long ones, too.
    starts = np.stack([polygon.p[0], polygon.q[0], polygon.p[1]])
    a, b, c = operations.exp(starts, np.stack([t * polygon.v[0], t * polygon.w[0], (1 - t) * polygon.v[1]]))
    d, e = _between(operations, np.stack([a, b]), np.stack([b, c]), t)
    return _between(operations, d, e, t)


def _between(operations: Operations, p: Array, q: Array, t: Array) -> Array:
    return operations.exp(p, t * operations.log(p, q))


def _geodesic(operations: Operations, tau: Doubles, polygon: ControlPolygon) -> Array:
    before = (tau < 0.5).reshape(-1, *[1] * (polygon.p.ndim - 2))
    t = tau.reshape(before.shape)
    return operations.exp(
        np.where(before, polygon.p[0], polygon.p[1]),
        3 * np.where(before, t * polygon.v[0], (1 - t) * polygon.v[1]),
    )


def derivative(operations: Operations, rows: Rows, nu: int) -> tuple[Array, Array]:
    """Points, and there the velocity or the covariant acceleration, by differences of order eight in normal
    coordinates. Beyond its ends a segment goes on, so that they are those of one segment everywhere; where it goes
    over a cut locus soon, steps are shorter."""
    here = points(operations, rows)
    vectors, least = np.empty_like(here), np.full(len(here), np.inf)
    axes = tuple(range(1, here.ndim))
    left, step = np.arange(len(here)), STEP
    for halvings in range(HALVINGS + 1):
        moved = _around(operations, rows.at(left), here[left], step)
        difference = first_derivative if nu == 1 else second_derivative
        found = difference(moved, (step * rows.h[left]).reshape(-1, *[1] * (here.ndim - 1)))
        jump, size = (np.abs(x).max(axis=axes) for x in (eighth_difference(moved), here[left]))
        # What the jump may have done to the derivative: where it is noise of the logarithm, longer steps are better.
        harm = jump / step**nu
        better = (harm < least[left]) | (halvings == 0)
        vectors[left[better]], least[left[better]] = found[better], harm[better]
        least[np.isnan(least)] = np.inf
        smooth = jump <= ROUGH * np.abs(moved).max(axis=(0, *(a + 1 for a in axes))) + NOISE * size
        left, step = left[~smooth], step / 2
        if not left.size:
            break
    return here, vectors


def _around(operations: Operations, rows: Rows, here: Array, step: float) -> Array:
    """Return the logarithms of the curve at `STEPS` from the points `here`."""
    shape = (len(STEPS), *here.shape)
    tau = rows.tau + np.multiply.outer(STEPS * step, np.ones_like(rows.tau))

    def repeated(x: Array) -> Array:
        return np.broadcast_to(x[:, None], (2, *shape)).reshape(2, -1, *here.shape[1:])

    # A geodesic goes on through the knot at which it begins.
    around = Rows(
        tau.ravel(),
        np.tile(rows.h, len(STEPS)),
        ControlPolygon(*map(repeated, rows.polygon)),
        np.tile(rows.straight, len(STEPS)),
    )
    return operations.log(np.broadcast_to(here, shape), points(operations, around).reshape(shape))
