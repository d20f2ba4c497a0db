"""Smoothing of the rows of a grid along one axis, with one λ for all rows."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.warnings import silenced
from .._curves.ends import end_kinds, is_closed
from .._spaces import Array, Doubles, Euclidean, Space
from .make import make_smoothing_spline
from .spline import SmoothingSpline

# Variances do not depend on the space.
_LINE = Euclidean(1)


class Rows(NamedTuple):
    """Rows of a grid along one axis, in a space that is not a product.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Coordinates of the nodes.
    points : ndarray, shape (R, n, *point_shape)
        Noisy points. Those of weight zero are NaN.
    weights : ndarray, shape (R, n)
        Weights of the points.
    space : Space
        The space.
    bc_type : object
        End conditions of all rows.
    """

    t: Doubles
    points: Array
    weights: Doubles
    space: Space[Any]
    bc_type: Any

    def take(self, chosen: Any) -> Rows:
        """Return some of the rows."""
        return self._replace(points=self.points[chosen], weights=self.weights[chosen])

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of data in each row."""
        return np.asarray(np.count_nonzero(self.weights, axis=-1))

    @property
    def null(self) -> int:
        """Degrees of freedom of a row without bending energy."""
        kinds = end_kinds(self.bc_type)
        return 2 if kinds and all(kind == "natural" for kind in kinds) else 1

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Which nodes lie between data of their row, shape (R, n). On a closed row every node does."""
        used = self.weights > 0
        if is_closed(self.bc_type):
            return np.broadcast_to(used.any(axis=-1, keepdims=True), used.shape)
        return np.logical_or.accumulate(used, axis=-1) & np.logical_or.accumulate(used[:, ::-1], axis=-1)[:, ::-1]


class SmoothedRows(NamedTuple):
    """Smoothed rows.

    Attributes
    ----------
    points : ndarray, shape (R, n, *point_shape)
        Points of the smooth rows at the nodes between data; the others are NaN.
    df, rss : ndarray, shape (R,)
        Effective degrees of freedom, and the weighted sum of squared distances.
    iterations : ndarray of int, shape (R,)
        Number of iterations.
    converged : ndarray of bool, shape (R,)
        Whether the iteration converged.
    """

    points: Array
    df: Doubles
    rss: Doubles
    iterations: NDArray[np.int64]
    converged: NDArray[np.bool_]


def smooth(rows: Rows, lam: float) -> SmoothedRows:
    """Smooth all rows with one λ.

    A row with one datum keeps it, and a row without data stays empty.
    """
    space, count = rows.space, rows.counts
    zeros = np.zeros(len(count))
    blank, none = np.full_like(rows.points, np.nan), np.zeros(len(count), int)
    found = SmoothedRows(blank, np.minimum(count, 1.0), zeros, none, count < 2)
    single = (count == 1)[:, None] & (rows.weights > 0)
    found.points[single] = rows.points[single]
    many = np.flatnonzero(count > 1)
    if len(many):
        own = rows.take(many)
        spline = _fit(own.t, own, lam)
        _store(found, many, spline, np.where(_lifted(own.inside, own.points), spline(own.t), np.nan))
    # Nodes without data at small distances make the matrix of a row singular to rounding. Its data alone do not.
    for number in np.flatnonzero(~found.converged & (count < rows.weights.shape[-1])):
        own = rows.take([number])
        used, inside = own.weights[0] > 0, own.inside[0]
        spline = _fit(own.t[used], own._replace(points=own.points[:, used], weights=own.weights[:, used]), lam)
        filled = np.full_like(own.points, np.nan)
        filled[:, inside] = spline(own.t[inside])
        _store(found, [number], spline, filled)
    used = (rows.weights > 0) & space._where_finite(found.points)
    squares = np.zeros(used.shape)
    squares[used] = space._apply("distance", p=found.points[used], q=rows.points[used]) ** 2
    return found._replace(rss=np.sum(rows.weights * squares, axis=-1))


def _fit(t: Doubles, rows: Rows, lam: Any) -> SmoothingSpline[Any, Any]:
    options: Any = {"weights": rows.weights, "bc_type": rows.bc_type, "sigma": 1.0}
    with silenced(Warning):
        return make_smoothing_spline(t, rows.points, rows.space, lam, on_failure="ignore", **options)


def _store(found: SmoothedRows, at: Any, spline: SmoothingSpline[Any, Any], points: Array) -> None:
    report = spline.report
    found.points[at], found.df[at] = points, report.df
    found.iterations[at], found.converged[at] = report.iterations, report.converged


def _lifted(mask: NDArray[np.bool_], points: Array) -> NDArray[np.bool_]:
    """Return a mask of points as a mask of their entries."""
    return mask.reshape(*mask.shape, *[1] * (points.ndim - mask.ndim))


def posterior_variance(t: Doubles, weights: Doubles, lam: float, bc_type: Any) -> Doubles:
    """Return the posterior variance at the nodes of rows with these weights, for noise of variance one.

    Parameters
    ----------
    weights : ndarray, shape (R, n)
        Weights. Nodes that do not lie between data have an infinite variance.

    Notes
    -----
    It is the diagonal of (W + λK)⁻¹, with K the matrix of the bending energy of the natural spline through the nodes.
    It does not depend on the points, so that rows with equal weights share it.
    """
    kinds, which = np.unique(weights, axis=0, return_inverse=True)
    rows = Rows(t, np.zeros((*kinds.shape, 1)), kinds, _LINE, bc_type)
    inside, count = rows.inside, rows.counts
    variance = np.where(kinds > 0, 1 / np.where(kinds > 0, kinds, 1), np.inf)
    many = np.flatnonzero(count > 1)
    if len(many):
        own = rows.take(many)
        with np.errstate(invalid="ignore"):
            found = np.where(own.inside, _fit(t, own, lam).std(t, calibrated=False) ** 2, np.inf)
        variance[many] = found
        # As in `smooth`, the data alone where the whole row is singular to rounding.
        for number in many[np.isnan(found).any(axis=-1) | ~(found > 0).all(axis=-1)]:
            own = rows.take([number])
            used = own.weights[0] > 0
            spline = _fit(t[used], own._replace(points=own.points[:, used], weights=own.weights[:, used]), lam)
            variance[number, inside[number]] = spline.std(t[inside[number]], calibrated=False) ** 2
    return variance[which.reshape(-1)]


def complete_variance(t: Doubles, weight: float, lam: float, bc_type: Any, repeats: bool) -> Doubles:
    """Return the posterior variance of `posterior_variance` at the nodes of a row in which all weights are equal.

    Parameters
    ----------
    repeats : bool
        Whether the last node of a closed row is the first one, and not a datum of its own.
    """
    weights = np.full((1, len(t)), weight)
    if repeats:
        weights[:, -1] = 0.0
    return np.asarray(posterior_variance(t, weights, lam, bc_type)[0])
