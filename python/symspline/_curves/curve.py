"""Curves as arrays, which the compiled core evaluates: points and velocities at knots, or control points of B-splines.

`on_manifold` has further classes of curves, for spaces that are made of functions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any, ClassVar, Literal, NamedTuple, Never, Self

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from .. import _core
from .._base.arrays import refuse
from .._base.faults import of_index
from .._base.time import refuse_outside
from .._base.typing import Array, CubicBCType, PointsLike, Progress
from .._core import CutLocusError, ValidationError
from .._spaces import (
    Affine,
    AnySpace,
    Doubles,
    Product,
    Similarity,
    Space,
    SpecialEuclidean,
    Torus,
    factors_of,
    parts_of,
    product_norm,
)
from .._spaces.statistics import TURN, wrap
from . import derivatives
from .derivatives import Gradient, SampleTimes, pair_of
from .ends import ends_in_factors
from .reduced import Span, reduced, span_of

NORMS = ("speed", "bend")
# Relative tolerance of integrals along curves whose derivatives are exact.
EXACT = 1e-14
# Quantities that are real numbers or vectors, not points or tangent vectors of the space.
REAL = (*NORMS, "body velocity", "body acceleration", "motion")
# Matrices of these spaces have a constant last row, which the core also writes for curves without a solution.
_CONSTANT_ROW = (SpecialEuclidean, Similarity, Affine)


def _all_nan(space: Space, values: Array) -> Array:
    """Set every matrix that contains a NaN to NaN as a whole, in place."""
    if isinstance(space, _CONSTANT_ROW):
        missing = np.isnan(values[..., 0, 0])
        if missing.any():
            values[missing] = np.nan
    return values


# ---- results in existing arrays of the user, as for the argument ``out`` of NumPy ----


def _check_out(out: Array | tuple[Array, ...] | None, shape: tuple[int, ...], dtype: DTypeLike) -> None:
    """Raise ValidationError if an array cannot hold a result of this shape and type."""
    if not isinstance(out, np.ndarray):
        raise ValidationError(f"out must be a NumPy array, not {type(out).__name__}")
    if out.shape != shape:
        raise ValidationError(f"out has shape {out.shape}, but the result has {shape}")
    if not np.can_cast(dtype, out.dtype, "same_kind"):
        raise ValidationError(f"out has dtype {out.dtype}, which cannot hold {np.dtype(dtype)}")
    if not out.flags.writeable:
        raise ValidationError("out is read-only")


def _can_write_into(out: Array, dtype: DTypeLike, read: Array) -> bool:
    """Whether the core can write directly into an array while it reads another one."""
    apart = not np.may_share_memory(out, read)
    return apart and out.dtype == dtype and out.flags.c_contiguous and out.flags.aligned


def write_into(out: object, values: object, space: AnySpace) -> Any:
    """Write results in each factor into existing arrays, and return these."""
    for given, array in zip(parts_of(out, space, "out"), parts_of(values, space, "values"), strict=True):
        _check_out(given, array.shape, array.dtype)
        np.copyto(given, array, casting="same_kind")
    return out


class FactorArrays(NamedTuple):
    """Points and velocities of curves in a space that is not a product.

    Attributes
    ----------
    space : Space
    points, velocities : ndarray, shape (..., N+1, *point_shape)
        Values at the knots; at corners the velocities after the knot.
    before : ndarray or None
        Velocities before the knots, for curves with corners.
    """

    space: AnySpace
    points: Array
    velocities: Array
    before: Array | None = None

    def map(self, function: Callable[[Array], Array]) -> FactorArrays:
        """Return a function of all arrays."""
        before = None if self.before is None else function(self.before)
        return FactorArrays(self.space, function(self.points), function(self.velocities), before)


class CurveArrays:
    """Curves of a batch in any space. Times are numbers of the compiled core.

    In a product, points, velocities and results of methods are tuples with one entry per factor.

    Attributes
    ----------
    space : Space
        The space of the points.
    times : ndarray, shape (N+1,) or (..., N+1)
        Knots.
    factors : tuple of FactorArrays
        Points and velocities in each factor; a space that is not a product is its only factor.
    fitted : bool
        Whether velocities are those of a C² curve, which lie in the span of the points and the end velocities.
    """

    # Highest order of derivatives.
    max_nu: ClassVar[int] = 3
    # Relative tolerance of integrals along the curve, not below the accuracy of its speed and acceleration.
    quad_rtol: ClassVar[float] = EXACT
    # Whether the core evaluates all factors.
    is_compiled: ClassVar[bool] = True

    def __init__(self, space: AnySpace, times: Doubles, factors: tuple[FactorArrays, ...], fitted: bool = True) -> None:
        self.space, self.times, self.factors, self.fitted = space, times, factors, fitted
        for factor in factors:
            # Read-only, in less than half the time of an assignment to `flags.writeable`.
            factor.points.setflags(write=False)
            factor.velocities.setflags(write=False)
        first = factors[0]
        self.batch: tuple[int, ...] = first.points.shape[: first.points.ndim - len(first.space._point_shape) - 1]

    @property
    def points(self) -> Any:
        """Points at the knots."""
        return self._joined([factor.points for factor in self.factors])

    @property
    def velocities(self) -> Any:
        """Velocities at the knots; at corners those after the knot."""
        return self._joined([factor.velocities for factor in self.factors])

    @property
    def parts(self) -> tuple[CurveArrays, ...]:
        """One curve per factor of a product; the curve itself on other spaces."""
        # A curve that kept itself would wait for the garbage collector.
        return self._of_factors if isinstance(self.space, Product) else (self,)

    @cached_property
    def _of_factors(self) -> tuple[CurveArrays, ...]:
        return tuple(self._of_factor(factor) for factor in self.factors)

    def _of_factor(self, factor: FactorArrays) -> CurveArrays:
        return CurveArrays(factor.space, self.times, (factor,), self.fitted)

    def _joined(self, values: Sequence[Any]) -> Any:
        return tuple(values) if isinstance(self.space, Product) else values[0]

    @property
    def is_smooth(self) -> bool:
        """Whether the core computes the curve in its space, with these knots, and without corners."""
        if not self.is_compiled or any(factor.before is not None for factor in self.factors):
            return False
        turning = not self.fitted and any(isinstance(factor.space, Torus) for factor in self.factors)
        return not turning and all(span is None for span in self._spans)

    # ---- evaluation by the core ----

    @cached_property
    def compiled(self) -> _core.Curve:
        """The curves as an object of the core."""
        # Loops take fewer calls of functions than comprehensions, and most curves are short.
        arrays = []
        for factor, span in zip(self.factors, self._spans, strict=True):
            arrays.append(self._core_arrays(factor, span))
        return _core.Curve(arrays)

    @cached_property
    def _spans(self) -> list[Span | None]:
        """The spans of the points of factors in large spaces, in which the core computes."""
        spans: list[Span | None] = []
        for factor in self.factors:
            spans.append(self._span_of(factor) if factor.space._is_large else None)
        return spans

    def _span_of(self, factor: FactorArrays) -> Span:
        vectors = factor.velocities
        if self.fitted:
            vectors = np.take(vectors, [0, -1], axis=len(self.batch))
        others = () if factor.before is None else (factor.before,)
        return span_of(factor.space, factor.points, vectors, *others)

    def _core_arrays(self, factor: FactorArrays, span: Span | None) -> Any:
        """Return a space of the core and the arrays of a factor in it."""
        if isinstance(factor.space, Torus) and not self.fitted and factor.before is None:
            times, *arrays = with_more_knots(self.times, factor.points, factor.velocities)
            return factor.space._handle, times, *map(np.ascontiguousarray, arrays), None
        if span is not None:
            factor = FactorArrays(span.space, *factor.map(span.coordinates)[1:])
        if factor.space._complex:
            factor = factor.map(factor.space._as_doubles)
        return factor.space._handle, self.times, *factor[1:]

    @cached_property
    def _finishing(self) -> bool:
        """Whether results of the core are not yet those of all factors."""
        for factor, span in zip(self.factors, self._spans, strict=True):
            if factor.space._complex or isinstance(factor.space, _CONSTANT_ROW) or span is not None:
                return True
        return False

    def _finished(self, values: object) -> Any:
        """Return points or vectors from results of the core."""
        results = []
        for factor, span, doubles in zip(self.factors, self._spans, self._by_factor(values), strict=True):
            numbers = _all_nan(factor.space, factor.space._numbers(doubles))
            results.append(numbers if span is None else span.embed_samples(numbers, self.batch))
        return self._joined(results)

    def _by_factor(self, values: object) -> Any:
        return values if isinstance(self.space, Product) else (values,)

    def evaluate(
        self,
        x: Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        progress: Progress | None = None,
        out: Any = None,
    ) -> Any:
        """Evaluate a quantity at times x.

        Parameters
        ----------
        x : ndarray
            Sampling times.
        quantity : str
            ``"point"``, ``"velocity"``, ``"acceleration"``, ``"speed"`` or ``"bend"``, which is |∇γ'|. Rotations and
            poses also have ``"body velocity"``, ``"body acceleration"``, and ``"motion"``: both of these and the
            point, one after the other.
        outside : {"raise", "continue", "geodesic", "periodic"}
            Extrapolation policy.
        per_curve : bool
            Whether the leading axes of x are the batch axes.
        progress : callable, optional
            Function to call with the numbers of finished and of all steps.
        out : ndarray or tuple of ndarray, optional
            Arrays for points or vectors, which are returned.
        """
        if per_curve and x.shape[: len(self.batch)] != self.batch:
            self._refuse_times(x)
        if out is not None:
            return self._evaluate_into(out, x, quantity, outside, per_curve, progress)
        values = self._evaluate(x, quantity, outside, per_curve, progress)
        if quantity == "point" and self._gaps:
            self._write_nodes(values, x, per_curve)
        return values

    def _evaluate(self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None) -> Any:
        """Evaluate a quantity into new arrays."""
        values = self.compiled.evaluate(x, quantity, outside, per_curve, progress)
        return self._finished(values) if self._finishing and quantity not in REAL else values

    @cached_property
    def _gaps(self) -> list[Any]:
        """Where segments of curves with corners are NaN in each factor, if they are; these begin with a point."""
        if self.factors[0].before is None:
            return []
        gaps = [~factor.space._where_finite(factor.velocities) for factor in self.factors]
        return gaps if any(missing.any() for missing in gaps) else []

    def _write_nodes(self, values: object, x: Doubles, per_curve: bool) -> None:
        """Write the points at which a segment that is NaN begins."""
        for factor, gaps, points in zip(self.factors, self._gaps, self._by_factor(values), strict=True):
            for curve in np.argwhere(gaps.any(axis=-1)):
                index = tuple(curve)
                t = self.times[index] if self.times.ndim > 1 else self.times
                sampled = x[index] if per_curve else x
                nodes = np.asarray(np.searchsorted(t[:-2], sampled))
                at = (t[nodes] == sampled) & gaps[index][nodes]
                points[index][at] = factor.points[index][nodes[at]]

    def _evaluate_into(
        self, out: object, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None
    ) -> Any:
        shape = x.shape if per_curve else self.batch + x.shape
        arrays = parts_of(out, self.space, "out")
        direct = self.is_compiled and not self._gaps
        for factor, span, array in zip(self.factors, self._spans, arrays, strict=True):
            _check_out(array, shape + factor.space.point_shape, factor.space.dtype)
            direct &= span is None and _can_write_into(array, factor.space.dtype, x)
        if not direct:
            return write_into(out, self.evaluate(x, quantity, outside, per_curve, progress), self.space)
        doubles = [factor.space._as_doubles(array) for factor, array in zip(self.factors, arrays, strict=True)]
        self.compiled.evaluate(x, quantity, outside, per_curve, progress, doubles)
        for factor, array in zip(self.factors, arrays, strict=True):
            _all_nan(factor.space, array)
        return out

    def _refuse_times(self, x: Doubles) -> Never:
        raise ValidationError(
            f"with per_curve=True the shape of x must begin with the batch axes {self.batch}; got {x.shape}"
        )

    def lift(
        self,
        x: Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        start: object = None,
        progress: Progress | None = None,
    ) -> Any:
        """Evaluate the horizontal lift that starts at `start`; see `symspline.CubicSpline.lift`."""
        starts = [None] * len(self.factors) if start is None else parts_of(start, self.space, "start")
        fibers: list[Doubles | None] = []
        for factor, begin in zip(self.factors, starts, strict=True):
            first = np.take(factor.points, 0, axis=len(self.batch))
            lifted = is_quotient(factor.space)
            if not lifted and begin is not None:
                check_start(factor.space, first, begin)
            fibers.append(fiber_factors(factor.space, first, begin) if lifted else None)
        if per_curve and x.shape[: len(self.batch)] != self.batch:
            self._refuse_times(x)
        if outside == "continue" and any(fiber is not None for fiber in fibers):
            check_reach(self.times, x)
        # Unitary factors of the lift are the same in the span of the points.
        values = self.compiled.lift(x, quantity, outside, per_curve, fibers, progress)
        return self._finished(values) if self._finishing else values

    def transport(self, times: tuple[float, float], outside: str, v: ArrayLike) -> Any:
        """Transport one tangent vector per curve in parallel from one time to another.

        See `symspline.CubicSpline.transport`.
        """
        given = parts_of(v, self.space, "v")
        if any(span is not None for span in self._spans):
            return self._joined(
                [
                    part._transport_in_span(times, outside, vector)
                    for part, vector in zip(self.parts, given, strict=True)
                ]
            )
        spaces = [factor.space for factor in self.factors]
        vectors = [
            np.ascontiguousarray(space._as_doubles(np.asarray(vector, space.dtype)))
            for space, vector in zip(spaces, given, strict=True)
        ]
        moved = self.compiled.transport(times, outside, vectors)
        return self._joined([space._numbers(vector) for space, vector in zip(spaces, moved, strict=True)])

    def _transport_in_span(self, times: tuple[float, float], outside: str, v: ArrayLike) -> Any:
        if not self.space._is_large:
            return self.transport(times, outside, v)
        # The span includes the vector, whose component outside the span of the curve is transported, too.
        knots = len(self.batch)
        rows = np.expand_dims(np.asarray(v, self.space.dtype), knots)
        span = span_of(self.space, self.points, self.velocities, rows)
        moved = in_span(self, span).transport(times, outside, np.squeeze(span.coordinates(rows), knots))
        return np.squeeze(span.embed(np.expand_dims(moved, knots)), knots)

    def control_points(self) -> Any:
        """Compute the control points of the Bézier segments, shape (..., N, 4, *point_shape)."""
        return self._joined([self._control_points(factor) for factor in self.factors])

    def _control_points(self, factor: FactorArrays) -> Array:
        space, h = factor.space, np.diff(self.times)
        third = h.reshape(h.shape + (1,) * len(space.point_shape)) / 3
        before = factor.velocities if factor.before is None else factor.before
        (p, q), (u, _), (_, w) = (space._neighbours(array) for array in (factor.points, factor.velocities, before))
        with np.errstate(all="ignore"):
            handles = third * u, -third * w
        # Control points of curves without a solution are NaN.
        inner = [space._apply("exp", p=at, v=handle) for at, handle in zip((p, q), handles, strict=True)]
        return np.stack([p, *inner, q], axis=len(self.batch) + 1)

    # ---- derivatives with respect to the data ----

    def jvp(self, at: SampleTimes, bc_type: Any, points: object, t: object, ends: object) -> Any:
        """Compute the change of the curve for a change of its data; see `symspline.CubicSpline.jvp`."""
        self._require_derivatives()
        count = len(self.factors)
        moved = (None,) * count if points is None else parts_of(points, self.space, "points")
        vectors = [
            (None,) * count if end is None else parts_of(end, self.space, "an end vector") for end in pair_of(ends)
        ]
        conditions = ends_in_factors(bc_type, self.space)
        factors = zip(self.parts, conditions, moved, zip(*vectors, strict=True), strict=True)
        return self._joined([derivatives.jvp(part, at, bc, p, t, pair) for part, bc, p, pair in factors])

    def vjp(self, at: SampleTimes, bc_type: CubicBCType, cotangent: PointsLike) -> Gradient[Any]:
        """Compute the gradient with respect to the data; see `symspline.CubicSpline.vjp`."""
        self._require_derivatives()
        cotangents = parts_of(cotangent, self.space, "cotangent")
        factors = zip(self.parts, ends_in_factors(bc_type, self.space), cotangents, strict=True)
        gradients = [derivatives.vjp(part, at, bc, vectors) for part, bc, vectors in factors]
        if not isinstance(self.space, Product):
            return gradients[0]
        first, last = (None if gradients[0].ends[e] is None else tuple(g.ends[e] for g in gradients) for e in (0, 1))
        t = np.sum([g.t for g in gradients], axis=0)
        points = tuple(g.points for g in gradients)
        return Gradient(points, t, (first, last))

    def _require_derivatives(self) -> None:
        for factor in self.factors:
            derivatives.require_derivatives(factor.space)

    # ---- batches ----

    def take_batch(self, index: Any) -> Self:
        """Return one curve or a slice of curves along the first batch axis."""
        times = np.ascontiguousarray(self.times[index]) if self.times.ndim > 1 else self.times
        factors = tuple(factor.map(lambda array: np.ascontiguousarray(array[index])) for factor in self.factors)
        return type(self)(self.space, times, factors, self.fitted)

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self.space, self.times, self.factors, self.fitted)


def in_span(curve: CurveArrays, span: Span) -> CurveArrays:
    """Return a curve in coordinates of a span."""
    factor = FactorArrays(span.space, *curve.factors[0].map(span.coordinates)[1:])
    return CurveArrays(span.space, curve.times, (factor,), curve.fitted)


_NO_TIMES: Doubles = np.empty(0)


class UncertaintyBand(NamedTuple):
    """Noisy data near one curve, and the credible band of the curve.

    Attributes
    ----------
    x : list of ndarray
        Times of the data in each factor, as numbers of the core.
    points : list of ndarray
        The data in each factor.
    radii : list of ndarray
        Radii of the 95 % band around the curve at the requested times, in each factor.
    speed : ndarray or None
        Standard deviation of the velocity in one direction; None in a product.
    others : ndarray
        Times of data that are not points.
    """

    x: list[Doubles]
    points: list[Array]
    radii: list[Doubles]
    speed: Doubles | None
    others: Doubles = _NO_TIMES

    @property
    def times(self) -> Doubles:
        """Sorted times of all data."""
        return np.unique(np.concatenate([*self.x, self.others]))

    @classmethod
    def joined(cls, bands: Sequence[UncertaintyBand], offsets: Sequence[float]) -> UncertaintyBand:
        """Combine the bands of curves one after the other, whose times begin at different offsets."""
        pairs = list(zip(bands, offsets, strict=True))

        def concatenated(arrays: Callable[[UncertaintyBand, float], list[Any]]) -> list[Any]:
            return [np.concatenate(band) for band in zip(*(arrays(*pair) for pair in pairs), strict=True)]

        speeds = [band.speed for band in bands if band.speed is not None]
        return cls(
            concatenated(lambda band, offset: [x + offset for x in band.x]),
            concatenated(lambda band, _: band.points),
            concatenated(lambda band, _: band.radii),
            np.concatenate(speeds) if len(speeds) == len(bands) else None,
            np.concatenate([band.others + offset for band, offset in pairs]),
        )

    def between(self, first: float, last: float, samples: slice) -> Self:
        """Return the data from one time to another, and the band at some of the times."""
        kept = [(x >= first) & (x <= last) for x in self.x]
        return self._replace(
            x=[x[chosen] for x, chosen in zip(self.x, kept, strict=True)],
            points=[points[chosen] for points, chosen in zip(self.points, kept, strict=True)],
            radii=[chosen[samples] for chosen in self.radii],
            speed=None if self.speed is None else self.speed[samples],
            others=self.others[(self.others >= first) & (self.others <= last)],
        )

    def part(self, number: int) -> Self:
        """Return the data and the band in one factor of a product."""
        kept = {"x": [self.x[number]], "points": [self.points[number]], "radii": [self.radii[number]]}
        return self._replace(**kept, speed=None, others=_NO_TIMES)


class SidePanel(NamedTuple):
    """Numbers of one curve against time, which a plot shows in a panel below the others.

    Attributes
    ----------
    label : str
        Label of the vertical axis.
    x : ndarray, shape (n,)
        Times as numbers of the core.
    values : ndarray, shape (n, k)
        Residuals in standard deviations, radii of the 95 % band, or weights λ or standard deviations of the noise,
        which have one column. λ belongs to the segments that begin at these times.
    names : tuple of str
        Names of the components; empty if they have none.
    factor : int or None
        Factor of the space in which a band has these radii; None for other numbers.
    kind : {"residuals", "radii", "lam", "sigma"}
        Kind of the numbers.
    space : Space or None
        Space in which the noise has this standard deviation; None for other numbers.
    """

    label: str
    x: Doubles
    values: Doubles
    names: tuple[str, ...] = ()
    factor: int | None = None
    kind: Literal["residuals", "radii", "lam", "sigma"] = "residuals"
    space: AnySpace | None = None


def share(progress: Progress | None, i: int, count: int) -> Progress | None:
    """Return a function that converts the progress of the i-th of `count` equal tasks to that of all of them."""
    return progress and partial(_advance, progress, i, count)


def _advance(progress: Progress, i: int, count: int, finished: int, total: int) -> object:
    return progress(i * total + finished, count * total)


def longest_step(curve: CurveArrays) -> Any:
    """Compute D in equation (21), the longest distance between neighbours in the product metric."""
    pairs = ((part.space, *part.space._neighbours(part.points)) for part in curve.parts)
    steps = [space._apply("distance", p=p, q=q) for space, p, q in pairs]
    longest = np.max(product_norm(tuple(steps)), axis=-1)
    return float(longest) if np.ndim(longest) == 0 else longest


# ---- representatives of points on quotient spaces: where the horizontal lift of a curve starts ----

# Largest extrapolation of a lift, in lengths of the first or last segment.
FURTHEST = 100.0
# Largest relative distance of a representative from the point, equal to the tolerance for points.
OFF = 1e-8


def is_quotient(space: Space) -> bool:
    """Whether a point has several representatives, which differ by a unitary factor on the right."""
    return space._handle.fibre() > 0


def fiber_factors(space: Space, first: Array, start: ArrayLike | None) -> Doubles:
    """Return unitary k × k matrices that map first points to their representatives at the start of the lift.

    Parameters
    ----------
    first : ndarray, shape batch + (*point_shape)
        First points of the curves.
    start : array_like or None
        Representatives of these points; None means the first points.

    Returns
    -------
    ndarray, shape (curves, k, k, 2)
        Real and imaginary parts of the matrices.
    """
    k, n = space._handle.fibre(), space.point_shape[0]
    p = first.reshape(-1, n, k)
    g = np.broadcast_to(np.eye(k), (len(p), k, k))
    if start is not None:
        given = _given(space, first, start)
        products = np.swapaxes(p.conj(), 1, 2) @ given.reshape(-1, n, k)
        # The decomposition fails for infinite and NaN entries, so zeros replace them.
        u, _, v = np.linalg.svd(np.where(np.isfinite(products), products, 0.0))
        g = u @ v
        _check_near(space, (p @ g).reshape(first.shape), given)
    return np.stack([g.real, g.imag], axis=-1)


def check_start(space: Space, first: Array, start: ArrayLike | None) -> None:
    """Raise ValidationError unless a lift starts at the first points, in a space with unique representatives."""
    _check_near(space, first, _given(space, first, start))


def _given(space: Space, first: Array, start: ArrayLike | None) -> Array:
    given = space._array(start, "start")
    # This raises if an entry is not a number, or if an imaginary part would be discarded.
    space._doubles(given, "start")
    try:
        if given.shape[-len(space.point_shape) :] == space.point_shape:
            return np.broadcast_to(given, first.shape)
    except ValueError:
        pass
    raise ValidationError(
        f"start must have the shape of a point {space.point_shape}, after the batch axes if any, not {given.shape}"
    )


def _check_near(space: Space, nearest: Array, given: Array) -> None:
    axes = tuple(range(-len(space.point_shape), 0))
    off = np.sqrt(np.sum(np.abs(given - nearest) ** 2, axis=axes) / np.sum(np.abs(nearest) ** 2, axis=axes))
    # Curves without a solution have no start to check.
    bad = np.argwhere(~(off <= OFF) & np.isfinite(nearest).all(axis=axes))
    if len(bad):
        index = tuple(bad[0])
        of = f" of curve {', '.join(map(str, index))}" if index else ""
        raise ValidationError(
            f"start{of} is {off[index]:.3e} away from the nearest representative of the first point of the curve"
        )


def check_reach(times: Doubles, x: Doubles) -> None:
    """Raise ValidationError for times too far beyond the knots, because the lift is computed in small steps."""
    first, last = times[..., 1] - times[..., 0], times[..., -1] - times[..., -2]
    low, high = np.max(times[..., 0] - FURTHEST * first), np.min(times[..., -1] + FURTHEST * last)
    limit = (
        f"is more than {FURTHEST:.0f} lengths of the last segment beyond the knots, which is the limit for lifts; use "
        "extrapolate='geodesic'"
    )
    refuse((x < low) | (x > high), "x", lambda i: f"= {x[i]} {limit}")


# ---- limits of given velocities: handles inside the cut locus, and whole turns on a torus ----

# Handles shorter than this fraction of the injectivity radius are valid without further tests.
_SHORT = 0.99
# Relative difference beyond which the logarithm of the end of a handle is another vector than the handle.
_SAME = 1e-6


def require_short_handles(space: AnySpace, times: Doubles, points: Array, velocities: Array) -> None:
    """Raise ValidationError if a velocity is too fast for a segment next to it.

    The curve is evaluated from its control points. If a handle h u/3 passes the cut locus, its control point is also
    the end of a shorter handle. The curve would then not have the given velocity, or would lose whole turns. Curves on
    a `Torus` keep up to 3000 turns per segment.
    """
    radius = space.injectivity_radius
    if not 0 < radius < np.inf:
        return
    limit = LONGEST if isinstance(space, Torus) else _SHORT * radius
    axes = len(space.point_shape)
    lead = points.shape[: points.ndim - axes]
    steps = np.broadcast_to(np.diff(times), (*lead[:-1], lead[-1] - 1))
    ends = np.zeros((*lead[:-1], 1))
    longest = np.maximum(np.concatenate([steps, ends], -1), np.concatenate([ends, steps], -1))
    with np.errstate(all="ignore"):
        square = np.asarray(space._apply("inner", p=points, u=velocities, v=velocities))
        length = longest / 3 * np.sqrt(np.maximum(square, 0))
    for index in zip(*np.nonzero(length > limit), strict=True):
        handle = longest[index] / 3 * velocities[index]
        try:
            again = space.log(points[index], space.exp(points[index], handle))
            lost = np.abs(again - handle).max() > _SAME * np.abs(handle).max()
        except CutLocusError:
            lost = True
        if lost:
            after = longest[index] == np.append(steps[index[:-1]], 0.0)[index[-1]]
            _refuse(space, index, index[-1] - (not after), float(length[index]), float(longest[index]))


def _refuse(space: AnySpace, index: tuple[int, ...], segment: int, length: float, step: float) -> None:
    *batch, node = (int(i) for i in index)
    of = of_index(batch)
    other = " Or use `Euclidean` and angles that count turns." if space._has_angles else ""
    raise ValidationError(
        f"`velocities[{node}]`{of} has speed {3 * length / step:.6g}, which is too fast for a segment of length "
        f"{step:.6g}, between t[{segment}] and t[{segment + 1}]: its control handle, a third of the product, has "
        f"length {length:.4g} and passes the cut locus. The curve would have a different velocity or lose whole turns. "
        f"Add knots between them, or pass slower velocities.{other}"
    )


# ---- whole turns of curves on a torus, which follow from the velocities at the knots ----

# Segments with a longer handle are fast. C² curves have shorter ones, and take the shorter way between their points.
_FAST = 0.49995 * TURN
# Longer handles would need too many knots.
LONGEST = 1e3 * TURN
# The largest distance of neighbouring control points with more knots.
_NEAR = 0.25 * TURN


class Turns(NamedTuple):
    """Fast segments on a torus, over which the core would lose turns.

    Attributes
    ----------
    sides : ndarray, shape (..., n - 1)
        The longest side of the control polygon of fast segments; 0 for others.
    change : ndarray, shape (..., n - 1, angles)
        Change of every angle over each segment, with whole turns.
    """

    sides: Doubles
    change: Doubles


def turns_of(times: Doubles, points: Array, velocities: Array) -> Turns | None:
    """Return the turns of curves on a torus, or None if no segment is fast.

    Notes
    -----
    Points determine the change of an angle over a segment of length h up to whole turns. Among these changes, that
    nearest to h (u₀ + u₁)/2 gives the cubic with the lowest bending energy. It is used for the fast angles of a
    segment. For others, the core takes the shorter way between the inner control points, the change nearest to
    h (u₀ + u₁)/3.
    """
    h = np.diff(times)[..., None]
    u0, u1 = h * velocities[..., :-1, :], h * velocities[..., 1:, :]
    longest = np.maximum(np.abs(u0), np.abs(u1)) / 3
    fast = (longest > _FAST) & (longest <= LONGEST)
    if not fast.any():
        return None
    expected = (u0 + u1) / np.where(fast, 2, 3)
    change = expected + wrap(np.diff(points, axis=-2) - expected)
    sides = np.where(fast, np.maximum(longest, np.abs(change - (u0 + u1) / 3)), 0.0).max(axis=-1)
    return Turns(sides, change)


def with_more_knots(times: Doubles, points: Array, velocities: Array) -> tuple[Doubles, Array, Array]:
    """Return knots, points and velocities of the same curves with more knots on segments with several turns."""
    turns = turns_of(times, points, velocities)
    if turns is None:
        return times, points, velocities
    parts = np.ceil(turns.sides.reshape(-1, turns.sides.shape[-1]).max(axis=0) / _NEAR)
    parts = np.maximum(parts, 1).astype(int)
    segment = np.repeat(np.arange(len(parts)), parts)
    tau = np.concatenate([np.arange(count) / count for count in parts])
    start, h = times[..., segment], np.diff(times)[..., segment]
    s, h_wide = tau[:, None], h[..., None]
    u0, u1 = (h_wide * velocities[..., segment + i, :] for i in (0, 1))
    change = turns.change[..., segment, :]
    # The cubic Hermite polynomial and its derivative.
    square, cube = 3 * change - 2 * u0 - u1, u0 + u1 - 2 * change
    inner = points[..., segment, :] + s * (u0 + s * (square + s * cube))
    rates = (u0 + s * (2 * square + 3 * s * cube)) / h_wide
    # The given nodes remain exact.
    inner = np.where(s == 0, points[..., segment, :], inner)
    rates = np.where(s == 0, velocities[..., segment, :], rates)
    return (
        np.concatenate([start + tau * h, times[..., -1:]], axis=-1),
        np.concatenate([inner, points[..., -1:, :]], axis=-2),
        np.concatenate([rates, velocities[..., -1:, :]], axis=-2),
    )


# ---- curves of control points: B-splines by de Boor's algorithm, and cumulative B-splines on groups ----


class ControlledCurve:
    """Knots, control points and degree of B-spline curves, and evaluation in the core.

    Parameters
    ----------
    control : sequence of ndarray
        Control points in each factor.
    cumulative : bool
        Whether it is a cumulative B-spline, on groups.

    Attributes
    ----------
    times : ndarray
        The distinct knots of the domain, between which the curve is smooth.
    """

    quad_rtol = EXACT
    max_nu = 2

    def __init__(
        self, space: AnySpace, knots: Doubles, control: Sequence[Array], degree: int, cumulative: bool = False
    ) -> None:
        self.space, self.knots, self.control, self.degree = space, knots, tuple(control), degree
        self.cumulative = cumulative
        self.times = np.unique(knots[degree : knots.size - degree])
        for array in (knots, *control):
            array.flags.writeable = False
        axes = control[0].ndim - len(factors_of(space)[0].point_shape)
        self.batch: tuple[int, ...] = control[0].shape[: axes - 1]

    @property
    def control_points(self) -> Any:
        """Control points, on products one array per factor."""
        return self.control if isinstance(self.space, Product) else self.control[0]

    @property
    def parts(self) -> tuple[ControlledCurve, ...]:
        """The curve in each factor."""
        return self._of_factors if isinstance(self.space, Product) else (self,)

    @cached_property
    def _of_factors(self) -> tuple[ControlledCurve, ...]:
        factors = zip(factors_of(self.space), self.control, strict=True)
        return tuple(self.with_control_points(factor, control) for factor, control in factors)

    def with_control_points(self, space: AnySpace, *control: Array) -> ControlledCurve:
        """Return the curve with the same knots and other control points."""
        return ControlledCurve(space, self.knots, [*map(np.ascontiguousarray, control)], self.degree, self.cumulative)

    def take_batch(self, index: Any) -> ControlledCurve:
        """Return the curves that an index selects from the batch."""
        return self.with_control_points(self.space, *(control[index] for control in self.control))

    def evaluate(
        self,
        x: Doubles,
        quantity: str,
        outside: str = "raise",
        per_curve: bool = False,
        progress: Progress | None = None,
    ) -> Any:
        """Evaluate a quantity at times in the domain; with `per_curve`, the leading axes of x are the batch axes."""
        if outside == "raise":
            refuse_outside(self.times, self.batch, x, per_curve)
        if isinstance(self.space, Product):
            values = tuple(part.evaluate(x, quantity, "continue", per_curve) for part in self.parts)
            return product_norm(values) if quantity in NORMS else values
        if not per_curve:
            return self._at(x, quantity)
        rows = x.reshape(-1, *x.shape[len(self.batch) :])
        if (rows == rows[0]).all():
            return self._at(np.ascontiguousarray(rows[0]), quantity)
        # The core evaluates all curves of a batch at the same times.
        control = self.control[0].reshape(-1, *self.control[0].shape[len(self.batch) :])
        pairs = zip(control, np.ascontiguousarray(rows), strict=True)
        values = tuple(self.with_control_points(self.space, points)._at(row, quantity) for points, row in pairs)
        return np.reshape(values, (*self.batch, *values[0].shape))

    @cached_property
    def _steps(self) -> Doubles:
        """The logarithms between neighbouring control points."""
        return _core.cumulative_steps(self.space._handle, self.space._as_doubles(self.control[0]))

    def _at(self, x: Doubles, quantity: str) -> Any:
        """Evaluate a quantity of a curve in one factor, at times for all curves of a batch."""
        if quantity == "motion":
            return self._motion(x)
        steps, span = self._steps if self.cumulative else None, None
        space, control = self.space, self.control[0]
        if not self.cumulative:
            space, control, span = reduced(space, control)
        doubles = space._as_doubles(control)
        values = _core.evaluate_bspline(space._handle, self.knots, doubles, self.degree, x, quantity, steps)
        if quantity in REAL:
            return values
        return space._numbers(values) if span is None else span.embed_samples(space._numbers(values), self.batch)

    def _motion(self, x: Doubles) -> Array:
        """Return the twist of a motion, its derivative and the pose, as `CurveArrays.evaluate` does."""
        g, velocity, acceleration = (self._at(x, name) for name in ("point", "velocity", "acceleration"))
        turned = np.swapaxes(g[..., :3, :3], -1, -2)
        rates = []
        # The acceleration is gξ' for the twist ξ.
        for vector in (velocity, acceleration):
            body = turned @ vector[..., :3, :]
            rates += [body[..., [2, 0, 1], [1, 2, 0]], body[..., 3]]
        return np.concatenate([*rates, g.reshape(*g.shape[:-2], 16)], axis=-1)
