"""Values and derivatives of grids in one factor of a space, by the core or by functions in Python."""

from __future__ import annotations

import math
from functools import cached_property, reduce
from typing import Any, NamedTuple, cast

import numpy as np

from .. import _core
from .._base.arrays import short_repr
from .._base.faults import CUT_LOCUS, UNCONVERGED, Fault, from_core, imprecise, silenced
from .._base.report import Columns, ConvergenceWarning, FarPointsWarning
from .._base.typing import Array, Extrapolate, Progress
from .._core import ValidationError
from .._curves.derivatives import require_derivatives
from .._curves.on_manifold import Intervals
from .._curves.reduced import Span, span_of
from .._spaces import AnySpace, Doubles
from .._splines.cubic import CubicSpline
from ..manifolds import Manifold
from .axes import GridAxis, Sites
from .rows import RowSplines, beside_gaps, rows_alike, runs_of

# Chebyshev nodes of a segment, on which a derivative is interpolated to be differentiated once more.
_NODES = 12


class FactorGrid:
    """A grid in a space that is not a product.

    Parameters
    ----------
    points : ndarray, shape (n_1, ..., n_D, *point_shape)
        Points on the space; NaN for missing nodes.
    symmetric : bool
        Whether values are the midpoints of both orders of axes.
    velocities : ndarray, optional
        Velocities along the first axis in the coordinates of the core. By default they are computed.
    """

    def __init__(
        self,
        space: AnySpace,
        axes: list[GridAxis],
        points: Array,
        symmetric: bool,
        velocities: Array | None = None,
        progress: Progress | None = None,
    ) -> None:
        self.space, self.axes, self.points, self.symmetric = space, axes, points, symmetric
        self.forward: CompiledGrid | ManifoldGrid
        if isinstance(space, Manifold):
            self.forward = ManifoldGrid(space, axes, points)
            return
        if not space._is_large:
            self.forward = CompiledGrid(space, axes, points, None, velocities, progress)
            return
        flat = points.reshape(-1, *space.point_shape)
        valid = space._where_finite(flat)
        span = span_of(space, flat[valid])
        small = np.full((len(flat), *span.space.point_shape), np.nan, span.space.dtype)
        small[valid] = span.coordinates(flat[valid])
        small = small.reshape(*points.shape[: len(axes)], *span.space.point_shape)
        self.forward = CompiledGrid(span.space, axes, small, span, velocities, progress)

    @cached_property
    def backward(self) -> CompiledGrid | ManifoldGrid:
        """The grid with the order of axes reversed."""
        return self.forward.backwards()

    @property
    def is_missing(self) -> bool:
        """Whether the grid has missing nodes."""
        return not self.space._where_finite(self.points).all()

    def evaluate(self, sites: Sites, nu: tuple[int, ...], progress: Progress | None = None) -> tuple[Array, Outcome]:
        """Evaluate points, or a derivative of first or second order."""
        if sum(nu) < 2 or (nu[-1] and not self.symmetric):
            points, vectors, outcome = self._direct(sites, nu, progress)
            return (points if vectors is None else vectors), outcome
        return self._second(sites, nu)

    def gradient(self, sites: Sites, cotangent: Array) -> tuple[Array, Outcome]:
        """Compute the gradient of ``sum(cotangent * values)`` with respect to the points at the nodes.

        Raises
        ------
        ValidationError
            If the sensitivity of splines to their points is not available.
        """
        if isinstance(self.forward, ManifoldGrid):
            raise ValidationError(
                "the gradient with respect to the nodes needs the sensitivity of splines to their points, which is not "
                f"available on {self.space!r}. Use differences of grids with nodes that moved."
            )
        require_derivatives(self.space)
        if not self.symmetric:
            return self.forward.pull(sites, cotangent)
        dims, backward = len(self.axes), cast(CompiledGrid, self.backward)
        (p, *_), (q, *_) = self._orders(sites, (0,) * dims, None)
        of_p, of_q = _pull_midpoint(self.space, p, q, cotangent)
        gradient, outcome = self.forward.pull(sites, of_p)
        other, others = backward.pull(sites.reversed(), _axes_reversed(of_q, dims) if sites.outer else of_q)
        return gradient + _axes_reversed(other, dims), outcome.merged(others)

    def gap(self, sites: Sites) -> Doubles:
        """Return the distances between the values in both orders of axes."""
        p, q = (evaluated[0] for evaluated in self._orders(sites, (0,) * len(self.axes), None))
        valid = self.space._where_finite(p) & self.space._where_finite(q)
        out = np.full(valid.shape, np.nan)
        out[valid] = self.space.distance(p[valid], q[valid])
        return out

    def _direct(
        self, sites: Sites, nu: tuple[int, ...], progress: Progress | None
    ) -> tuple[Array, Array | None, Outcome]:
        """Evaluate what the core computes directly: points, and derivatives there."""
        if not self.symmetric:
            return self.forward.run(sites, *_derivative(nu), progress)
        (p, v, outcome), (q, w, others) = self._orders(sites, nu, progress)
        points, vectors = _midpoint(self.space, (p, q), None if v is None or w is None else (v, w))
        return points, vectors, outcome.merged(others)

    def _orders(
        self, sites: Sites, nu: tuple[int, ...], progress: Progress | None
    ) -> list[tuple[Array, Array | None, Outcome]]:
        """Evaluate in both orders of axes."""
        first = self.forward.run(sites, *_derivative(nu), progress)
        points, vectors, outcome = self.backward.run(sites.reversed(), *_derivative(nu[::-1]), progress)
        if sites.outer:
            points = _axes_reversed(points, len(self.axes))
            vectors = None if vectors is None else _axes_reversed(vectors, len(self.axes))
        return [first, (points, vectors, outcome)]

    def _second(self, sites: Sites, nu: tuple[int, ...]) -> tuple[Array, Outcome]:
        """Compute a second derivative from first ones.

        The first derivative is smooth on each segment of the other axis. It is evaluated at Chebyshev nodes of the
        segment, transported to the point along geodesics, interpolated and differentiated there. Transport along
        geodesics and along the curve differ by terms of third order, so that this is the covariant derivative.
        """
        axis = max(k for k, order in enumerate(nu) if order)
        first = min(k for k, order in enumerate(nu) if order)
        order = tuple(int(k == first) for k in range(len(nu)))
        result, here, outcome = self._differentiated(sites, axis, order, False)
        knots = self.axes[axis].knots
        # At the last node of a run, only the segment before it has values.
        at_knot = np.isin(sites.x[axis], knots[1:])
        if self.is_missing and at_knot.any():
            missing = self.space._where_finite(here) & ~self.space._where_finite(result)
            other, _, more = self._differentiated(sites, axis, order, True)
            result[missing] = other[missing]
            outcome = outcome.merged(more)
        return result, outcome

    def _differentiated(
        self, sites: Sites, axis: int, order: tuple[int, ...], left: bool
    ) -> tuple[Array, Array, Outcome]:
        """Differentiate the first derivative `order` along an axis. Return it, the points and a report."""
        here, _, outcome_here = self._direct(sites, (0,) * len(order), None)
        x, outcomes = sites.x[axis], [outcome_here]
        shape = (1,) * axis + (-1,) if sites.outer else (-1,)
        ones = len(sites.shape) + len(self.space.point_shape) - len(shape)

        def values(at: Doubles) -> tuple[Array, Any]:
            points, vectors, outcome_there = self._direct(sites.along(axis, at), order, None)
            outcomes.append(outcome_there)
            return points, vectors

        segments = Intervals.of(self.axes[axis].knots, x, sites.modes[axis], "left" if left else "right")
        result = segments.derivative(self.space, here, values, _NODES, shape + (1,) * ones)
        return result, here, reduce(Outcome.merged, outcomes)


def _axes_reversed(array: Array, dims: int) -> Array:
    """Reverse the order of the first `dims` axes of an array."""
    return array.transpose(*range(dims)[::-1], *range(dims, array.ndim))


def orders_of(nu: Any, dims: int) -> tuple[int, ...]:
    """Validate the orders of a derivative along all axes."""
    if nu is None:
        return (0,) * dims
    given = (nu,) if dims == 1 and isinstance(nu, (int, np.integer)) else nu
    valid = isinstance(given, (tuple, list)) and len(given) == dims
    if not valid or any(isinstance(n, bool) or not isinstance(n, (int, np.integer)) or n < 0 for n in given):
        raise ValidationError(f"nu must be a tuple with one order per axis ({dims}), not {short_repr(nu)}")
    if sum(given) > 2:
        raise ValidationError(f"nu is {tuple(given)}, but derivatives exist up to the second order in total")
    return tuple(int(n) for n in given)


def _derivative(nu: tuple[int, ...]) -> tuple[int | None, int]:
    """Return the axis before the last one with a derivative, and the order along the last axis."""
    along = next((k for k, order in enumerate(nu[:-1]) if order), None)
    return along, nu[-1]


def _midpoint(
    space: AnySpace, points: tuple[Array, Array], vectors: tuple[Array, Array] | None
) -> tuple[Array, Array | None]:
    """Return midpoints of geodesics, and their derivatives; NaN where a point is missing."""
    valid = space._where_finite(points[0]) & space._where_finite(points[1])
    shape = points[0].shape
    out = np.full(shape, np.nan, space.dtype)
    p, q = (np.ascontiguousarray(array[valid]) for array in points)
    if isinstance(space, Manifold):
        if vectors is not None:
            raise ValidationError(f"derivatives of symmetric grids are not available on {space!r}")
        out[valid] = space.geodesic(p, q, np.full(len(p), 0.5))
        return out, None
    pair = None if vectors is None else tuple(space._as_doubles(np.ascontiguousarray(v[valid])) for v in vectors)
    middle, moved = _core.grid_midpoint(space._handle, (space._as_doubles(p), space._as_doubles(q)), pair)
    out[valid] = space._numbers(middle)
    if moved is None:
        return out, None
    derivative = np.full(shape, np.nan, space.dtype)
    derivative[valid] = space._numbers(moved)
    return out, derivative


def _pull_midpoint(space: AnySpace, p: Array, q: Array, cotangent: Array) -> tuple[Array, Array]:
    """Return the gradients of ``sum(cotangent * midpoints)`` with respect to p and q; zero where one is missing."""
    valid = space._where_finite(p) & space._where_finite(q)
    gradients = np.zeros((2, *p.shape), space.dtype)
    # The midpoint is that of a natural spline through two points.
    pairs = np.stack([p[valid], q[valid]], axis=1)
    with silenced(FarPointsWarning):
        geodesics = CubicSpline((0.0, 1.0), pairs, space, check=False, on_failure="ignore")
    gradients[:, valid] = np.moveaxis(geodesics.vjp(0.5, cotangent[valid]).points, 1, 0)
    return gradients[0], gradients[1]


# ---- grids in spaces of the compiled core ----

# The most numbers of an array between two axes in the gradient with respect to the nodes: 16 MB.
_MOST = 1 << 21


class Outcome(NamedTuple):
    """What the fits of many rows report together.

    Attributes
    ----------
    failed : int
        Number of rows that failed.
    fault : Fault or None
        The fault of the first of them.
    residual : float
        Largest residual of the others.
    """

    failed: int = 0
    fault: Fault | None = None
    residual: float = 0.0

    def merged(self, other: Outcome) -> Outcome:
        """Return both reports as one."""
        residual = max(self.residual, other.residual)
        return Outcome(self.failed + other.failed, self.fault or other.fault, residual)


class _Arrays(NamedTuple):
    """Arrays of a grid for the core: points and velocities as rows along axis 0, which comes last."""

    axes: list[tuple[Doubles, list[str] | None, str]]
    points: Doubles
    velocities: Doubles


class CompiledGrid:
    """Nodes of a grid in a space of the core, with the splines along its first axis.

    Parameters
    ----------
    points : ndarray, shape (n_1, ..., n_D, *point_shape)
        Points on the space; NaN for missing nodes.
    span : Span or None
        Span of a low-rank reduction, in which points and velocities are coordinates.
    velocities : ndarray, optional
        Velocities along the first axis. By default they are computed.
    order : {1, -1}
        Whether the axes are in the order of the user, for messages.
    """

    def __init__(
        self,
        space: AnySpace,
        axes: list[GridAxis],
        points: Array,
        span: Span | None,
        velocities: Array | None = None,
        progress: Progress | None = None,
        order: int = 1,
    ) -> None:
        self.space, self.axes, self.span, self._order = space, axes, span, order
        self.points = points
        self.outcome = Outcome()
        self._rows = self._in_rows(points)
        if velocities is None:
            self._velocities, self.outcome = self._fit(0, self._rows, progress)
        else:
            self._velocities = self._in_rows(velocities)

    @property
    def velocities(self) -> Array:
        """Velocities at the nodes along the first axis, in the order of the axes."""
        return np.moveaxis(self.space._numbers(self._velocities), len(self.axes) - 1, 0)

    def backwards(self) -> CompiledGrid:
        """Return the grid with the order of axes reversed."""
        points = np.ascontiguousarray(_axes_reversed(self.points, len(self.axes)))
        return CompiledGrid(self.space, self.axes[::-1], points, self.span, order=-self._order)

    def run(
        self, sites: Sites, along: int | None, last: int, progress: Progress | None
    ) -> tuple[Array, Array | None, Outcome]:
        """Evaluate points, and a derivative there.

        Parameters
        ----------
        along : int or None
            Axis before the last one along which the first derivative is taken.
        last : {0, 1, 2}
            Order of the derivative along the last axis; at most 1 together with `along`.

        Returns
        -------
        tuple
            Points, the derivative or None, and the report of the fits.
        """
        axes = [self._axis(k, mode) for k, mode in enumerate(sites.modes)]
        arrays = _Arrays(axes, self._rows, self._velocities)
        if sites.outer:
            points, vectors, summary = _core.grid_product(self.space._handle, arrays, sites.x, along, last, progress)
        else:
            x = np.ascontiguousarray(np.stack(sites.x, axis=-1))
            points, vectors, summary = _core.grid_scattered(self.space._handle, arrays, x, along, last, progress)
        return self._shown(points), None if vectors is None else self._shown(vectors), self._read(summary)

    def pull(self, sites: Sites, cotangent: Array) -> tuple[Array, Outcome]:
        """Compute the gradient of ``sum(cotangent * values)`` with respect to the points at the nodes.

        Coordinates along the first axis, or scattered coordinates, are divided into blocks to bound the memory.
        """
        gradient, outcome = np.zeros(self.points.shape, self.space.dtype), Outcome()
        if cotangent.size == 0:
            return gradient, outcome
        counts = [len(x) if sites.outer else 1 for x in sites.x]
        nodes = [len(axis.knots) for axis in self.axes]
        largest = max(math.prod(counts[1 : k + 1]) * math.prod(nodes[k + 1 :]) for k in range(len(nodes)))
        size = max(_MOST // max(largest * math.prod(self.space.point_shape), 1), 1)
        for start in range(0, len(cotangent), size):
            block = slice(start, start + size)
            part, outcome_of_block = self._pull_block(sites.block(block), cotangent[block])
            gradient += part
            outcome = outcome.merged(outcome_of_block)
        return gradient, outcome

    def _pull_block(self, sites: Sites, cotangent: Array) -> tuple[Array, Outcome]:
        """Compute the gradient axis after axis: forward for the points at the nodes of each axis, and back."""
        last, outcome, splines = len(self.axes) - 1, Outcome(), []
        points, velocities = self.points, self.space._numbers(self._velocities)
        if not sites.outer:
            # Each scattered coordinate is an outer product of its own, along the first axis.
            cotangent = cotangent.reshape(len(cotangent), *(1,) * last, *self.space.point_shape)
        for k, axis in enumerate(self.axes):
            rows, x = np.moveaxis(points, k, last), axis.wrapped(sites.x[k])
            times = x.reshape(-1, *(1,) * last) if k and not sites.outer else x
            times = np.broadcast_to(times, (*rows.shape[:last], times.shape[-1]))
            if k:
                velocities, outcome_of_axis = self._velocities_for(k, rows, times)
                outcome = outcome.merged(outcome_of_axis)
            splines.append(RowSplines(self.space, axis, rows, velocities, times))
            if k < last:
                points = np.moveaxis(splines[k].values(), last, k)
        for k, own_splines in reversed(list(enumerate(splines))):
            cotangent = np.moveaxis(own_splines.pull(np.moveaxis(cotangent, k, last)), last, k)
        return cotangent, outcome

    def _velocities_for(self, k: int, rows: Array, x: Doubles) -> tuple[Array, Outcome]:
        """Fit the rows along axis k that are evaluated between nodes; points at nodes need no spline."""
        needed = ~np.isin(x, self.axes[k].knots).all(axis=-1)
        velocities = np.full(rows.shape, np.nan, self.space.dtype)
        fitted, outcome = self._fit(k, self.space._as_doubles(np.ascontiguousarray(rows[needed])))
        velocities[needed] = self.space._numbers(fitted)
        return velocities, outcome

    def _fit(self, k: int, rows: Doubles, progress: Progress | None = None) -> tuple[Doubles, Outcome]:
        """Compute velocities at the nodes of rows along axis k."""
        velocities, summary = _core.grid_rows(self.space._handle, self._axis(k, "continue"), rows, progress)
        return velocities, self._read(summary, k)

    def _axis(self, k: int, mode: str) -> tuple[Doubles, list[str] | None, str]:
        axis = self.axes[k]
        return axis.knots, None if axis.ends is None else list(axis.ends), mode

    def _in_rows(self, array: Array) -> Doubles:
        """Move the first axis behind the others."""
        return self.space._as_doubles(np.ascontiguousarray(np.moveaxis(array, 0, len(self.axes) - 1)))

    def _shown(self, doubles: Doubles) -> Array:
        """Return results of the core as points or vectors of the user's space."""
        numbers = self.space._numbers(doubles)
        return numbers if self.span is None else self.span.embed_samples(numbers, ())

    def _read(self, summary: Any, start: int = 0) -> Outcome:
        """Read the report of rows. Axis `start` is the first one that the core was given."""
        failed, first, residual, *_ = summary
        if first is None:
            return Outcome(0, None, residual)
        axis, kind, node, value, limit, row_residual = first
        number = start + axis if self._order > 0 else len(self.axes) - 1 - start - axis
        return Outcome(failed, row_fault(number, kind, node, value, limit, row_residual), residual)


def row_fault(
    axis: int, kind: str, node: int | None, value: float, limit: float, residual: float, tol: float = 1e-12
) -> Fault:
    """Return the fault of a row along an axis."""
    where = f" of a row along axis {axis}"
    if kind == "unconverged":
        what = f"no convergence{where}: the residual is {residual:.3e}, the tolerance {tol:.0e}"
        return Fault(0, UNCONVERGED, what, "add nodes where neighbouring points are far apart", None, residual, tol)
    if kind == "imprecise":
        return Fault(0, UNCONVERGED, *imprecise(where, value, tol), None, value, tol)
    fault = from_core((0, kind, node, value, limit, None), Columns.empty(1), tol, False)
    return fault._replace(kind=CUT_LOCUS, what=fault.what.replace("{of}", where))


# ---- grids on manifolds that are made of functions, row by row in Python ----

_POLICIES: dict[str, Extrapolate] = {"continue": True, "geodesic": "geodesic", "periodic": "periodic"}


class ManifoldGrid:
    """Nodes of a grid on a `Manifold`; see `CompiledGrid`."""

    span = None

    def __init__(self, space: AnySpace, axes: list[GridAxis], points: Array) -> None:
        self.space, self.axes, self.points = space, axes, points
        self.outcome = Outcome()

    def backwards(self) -> ManifoldGrid:
        """Return the grid with the order of axes reversed."""
        return ManifoldGrid(self.space, self.axes[::-1], _axes_reversed(self.points, len(self.axes)))

    def run(
        self, sites: Sites, along: int | None, last: int, progress: Progress | None
    ) -> tuple[Array, Array | None, Outcome]:
        """Evaluate points, and a derivative there; see `CompiledGrid.run`."""
        if along is not None:
            raise ValidationError(
                f"derivatives along axis {along} need the sensitivity of splines to their points, which is not "
                f"available on {self.space!r}. Differentiate along the last axis, or reorder the axes."
            )
        if not sites.outer:
            return self._scattered(sites, last, progress)
        outcome, nodes, vectors = Outcome(), self.points, None
        for k, (axis, x, mode) in enumerate(zip(self.axes, sites.x, sites.modes, strict=True)):
            rows = np.moveaxis(nodes, k, len(self.axes) - 1)
            orders = [0, last] if k + 1 == len(self.axes) and last else [0]
            *_, values = evaluated = [self._row_values(axis, rows, x, mode, nu, k) for nu in orders]
            nodes = np.moveaxis(evaluated[0][0], len(self.axes) - 1, k)
            vectors = np.moveaxis(values[0], len(self.axes) - 1, k) if len(orders) > 1 else None
            outcome = outcome.merged(evaluated[0][1])
            if progress:
                progress(k + 1, len(self.axes))
        return nodes, vectors, outcome

    def _scattered(self, sites: Sites, last: int, progress: Progress | None) -> tuple[Array, Array | None, Outcome]:
        """Evaluate scattered coordinates one at a time."""
        count = len(sites.x[0])
        points = np.full((count, *self.space.point_shape), np.nan, self.space.dtype)
        vectors = points.copy() if last else None
        outcome = Outcome()
        for i in range(count):
            one = Sites([x[i : i + 1] for x in sites.x], True, sites.modes)
            p, v, outcome_of_site = self.run(one, None, last, None)
            points[i] = p.reshape(self.space.point_shape)
            if vectors is not None and v is not None:
                vectors[i] = v.reshape(self.space.point_shape)
            outcome = outcome.merged(outcome_of_site)
            if progress:
                progress(i + 1, count)
        return points, vectors, outcome

    def _row_values(
        self, axis: GridAxis, rows: Array, x: Doubles, mode: str, nu: int, number: int
    ) -> tuple[Array, Outcome]:
        """Evaluate all rows at the same coordinates; NaN outside the runs of a row."""
        shape, lead = self.space.point_shape, rows.shape[: len(self.axes) - 1]
        flat = rows.reshape(-1, len(axis.knots), *shape)
        out = np.full((len(flat), len(x), *shape), np.nan, self.space.dtype)
        if mode == "periodic":
            x = axis.wrapped(x)
        valid = self.space._where_finite(flat)
        outcome = Outcome()
        for same in rows_alike(valid):
            for first, stop in runs_of(valid[same[0]]):
                inside = (x >= axis.knots[first]) & (x <= axis.knots[stop - 1])
                if stop == len(axis.knots):
                    inside |= x > axis.knots[-1]
                if first == 0:
                    inside |= x < axis.knots[0]
                if stop - first == 1:
                    if nu == 0:
                        out[np.ix_(same, x == axis.knots[first])] = flat[same, first][:, None]
                    continue
                whole = stop - first == len(axis.knots)
                bc: Any = axis.bc_type if whole else beside_gaps(axis, first, stop)
                points = np.ascontiguousarray(flat[same, first:stop])
                with silenced(ConvergenceWarning), silenced(FarPointsWarning):
                    spline = CubicSpline(
                        axis.knots[first:stop], points, self.space, bc_type=bc, check=False, on_failure="ignore"
                    )
                out[np.ix_(same, inside)] = spline(x[inside], nu, extrapolate=_POLICIES[mode])
                outcome = outcome.merged(_outcome(spline, number))
        return out.reshape(*lead, len(x), *shape), outcome


def _outcome(spline: CubicSpline[Any], number: int) -> Outcome:
    report = spline.report
    failed = ~np.atleast_1d(np.asarray(report.converged))
    residuals = np.atleast_1d(np.asarray(report.residual, np.float64))
    if not failed.any():
        return Outcome(0, None, float(residuals.max(initial=0.0)))
    first = float(residuals[failed][0])
    return Outcome(int(failed.sum()), row_fault(number, "unconverged", None, first, np.nan, first), 0.0)
