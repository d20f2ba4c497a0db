"""Curves as arrays, in one space and in products.

`ReducedCurve` and `OnManifold` are further classes of curves, for spaces in which the compiled core cannot evaluate
curves directly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from .. import _core
from .._base.faults import Fault
from .._base.typing import Progress
from .._core import ValidationError
from .._spaces import Affine, Array, Doubles, Similarity, Space, SpecialEuclidean, Torus, parts_of, product_norm
from . import derivatives
from .derivatives import Gradient, SampleTimes, pair_of
from .ends import ends_in_factors
from .integrals import EXACT
from .lift import check_reach, check_start, fiber_factors, is_quotient
from .solve import Options, Solved, Task, solve_single, validate
from .turns import with_more_knots

Tuple = tuple[Any, ...]
NORMS = ("speed", "bend")
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


def _check_out(out: Any, shape: tuple[int, ...], dtype: Any) -> None:
    """Raise ValidationError if an array cannot hold a result of this shape and type."""
    if not isinstance(out, np.ndarray):
        raise ValidationError(f"out must be a NumPy array, not {type(out).__name__}")
    if out.shape != shape:
        raise ValidationError(f"out has shape {out.shape}, but the result has {shape}")
    if not np.can_cast(dtype, out.dtype, "same_kind"):
        raise ValidationError(f"out has dtype {out.dtype}, which cannot hold {np.dtype(dtype)}")
    if not out.flags.writeable:
        raise ValidationError("out is read-only")


def _can_write_into(out: Array, dtype: Any, read: Array) -> bool:
    """Whether the core can write directly into an array while it reads another one."""
    apart = not np.may_share_memory(out, read)
    return apart and out.dtype == dtype and out.flags.c_contiguous and out.flags.aligned


def write_into(out: Any, values: Any, space: Space[Any]) -> Any:
    """Write results in each factor into existing arrays, and return these."""
    for own, array in zip(parts_of(out, space, "out"), parts_of(values, space, "values"), strict=True):
        _check_out(own, array.shape, array.dtype)
        np.copyto(own, array, casting="same_kind")
    return out


class CoreCurve:
    """Curves of a batch in a space that is not a product. Times are numbers of the compiled core.

    Attributes
    ----------
    space : Space
        The space of the points.
    times : ndarray, shape (N+1,) or (..., N+1)
        Knots.
    points, velocities : ndarray, shape (..., N+1, *point_shape)
        Values at the knots.
    quad_rtol : float
        Relative tolerance of integrals along the curve, not below the accuracy of its speed and acceleration.
    """

    quad_rtol = EXACT
    # Both kinds of curves have attributes of the same types.
    space: Space[Any]
    times: Doubles
    points: Any
    velocities: Any
    # Whether the core computes points in the space itself, and not in a smaller one.
    _compiled: ClassVar[bool] = True
    # Highest order of derivatives.
    max_nu: ClassVar[int] = 3

    def __init__(self, space: Space, times: Doubles, points: Array, velocities: Array, fitted: bool = True) -> None:
        self.space, self.times, self.points, self.velocities = space, times, points, velocities
        # Whether velocities are those of a C² curve, which lie in the span of the points and the end velocities.
        self._fitted = fitted
        # Read-only, in less than half the time of an assignment to `flags.writeable`.
        points.setflags(write=False)
        velocities.setflags(write=False)

    @staticmethod
    def suits(space: Space) -> bool:
        """Whether this class can represent curves in a space."""
        return True

    @staticmethod
    def solve(task: Task, options: Options, progress: Progress | None = None) -> Solved:
        """Compute the velocities of the C² curve. The core validates the points in the same call."""
        return solve_single(task, options, progress)

    @staticmethod
    def validate(task: Task, options: Options) -> tuple[Task, list[Fault]]:
        """Validate a task and project its points onto the space. Return the task and the faults of skipped curves.

        Raises
        ------
        ValidationError
            If the task is invalid.
        """
        return validate(task)

    @property
    def batch(self) -> tuple[int, ...]:
        """Shape of the batch axes."""
        points: Array = self.points
        return points.shape[: points.ndim - len(self.space._point_shape) - 1]

    @property
    def parts(self) -> tuple[Self]:
        """The curve itself; a `ProductCurve` has one curve per factor."""
        return (self,)

    def evaluate(
        self,
        x: Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        progress: Progress | None = None,
        out: Array | None = None,
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
        out : ndarray, optional
            Array for points or vectors, which is returned.
        """
        self._check_times(x, per_curve)
        if out is None:
            return self._evaluate(x, quantity, outside, per_curve, progress)
        space = self.space
        _check_out(out, (x.shape if per_curve else self.batch + x.shape) + space.point_shape, space.dtype)
        if self._compiled and _can_write_into(out, space.dtype, x):
            _core.evaluate(*self._core_curve, x, quantity, outside, per_curve, progress, space._as_doubles(out))
            _all_nan(space, out)
        else:
            np.copyto(out, self._evaluate(x, quantity, outside, per_curve, progress), casting="same_kind")
        return out

    def _evaluate(self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None) -> Any:
        """Evaluate a quantity into a new array."""
        values = _core.evaluate(*self._core_curve, x, quantity, outside, per_curve, progress)
        return values if quantity in REAL else _all_nan(self.space, self.space._numbers(values))

    def lift(
        self,
        x: Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        start: Any = None,
        progress: Progress | None = None,
    ) -> Array:
        """Evaluate the horizontal lift that starts at `start`; see `symspline.CubicSpline.lift`."""
        first = np.take(self.points, 0, axis=len(self.batch))
        if not is_quotient(self.space):
            if start is not None:
                check_start(self.space, first, start)
            return np.asarray(self.evaluate(x, quantity, outside, per_curve, progress))
        self._check_times(x, per_curve)
        if outside == "continue":
            check_reach(self.times, x)
        return self._lifted(x, quantity, outside, per_curve, fiber_factors(self.space, first, start), progress)

    def _lifted(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, start: Doubles, progress: Progress | None
    ) -> Array:
        curve, knots = self._core_curve, self._lift_knots
        values = _core.lift(*curve, x, quantity, outside, per_curve, knots, start, progress)
        return self.space._numbers(values)

    @cached_property
    def _lift_knots(self) -> Doubles:
        """Unitary factors of the horizontal lift at the knots, computed once."""
        return _core.lift_knots(*self._core_curve)

    @property
    def _core_curve(self) -> tuple[_core.Handle, Doubles, Doubles, Doubles]:
        space = self.space
        if isinstance(space, Torus) and not self._fitted:
            return space._handle, *self._with_turns
        points, velocities = space._as_doubles(self.points), space._as_doubles(self.velocities)
        return space._handle, self.times, points, velocities

    @cached_property
    def _with_turns(self) -> tuple[Doubles, Doubles, Doubles]:
        """Knots, points and velocities on a torus with so many knots that the core keeps whole turns."""
        times, points, velocities = with_more_knots(self.times, self.points, self.velocities)
        return times, np.ascontiguousarray(points), np.ascontiguousarray(velocities)

    def _check_times(self, x: Doubles, per_curve: bool) -> None:
        if per_curve and x.shape[: len(self.batch)] != self.batch:
            raise ValidationError(
                f"with per_curve=True the shape of x must begin with the batch axes {self.batch}; got {x.shape}"
            )

    def transport(self, times: tuple[float, float], outside: str, v: Any) -> Any:
        """Transport one tangent vector per curve in parallel from one time to another.

        See `symspline.CubicSpline.transport`.
        """
        space = self.space
        vectors = np.ascontiguousarray(space._as_doubles(np.asarray(v, space.dtype)))
        return space._numbers(_core.transport(*self._core_curve, times, outside, vectors))

    def control_points(self) -> Any:
        """Compute the control points of the Bézier segments, shape (..., N, 4, *point_shape)."""
        h = np.diff(self.times)
        third = h.reshape(h.shape + (1,) * len(self.space.point_shape)) / 3
        (p, q), (u, w) = (self.space._neighbours(x) for x in (self.points, self.velocities))
        with np.errstate(all="ignore"):
            handles = third * u, -third * w
        # Control points of curves without a solution are NaN.
        inner = [self.space._apply("exp", p=at, v=handle) for at, handle in zip((p, q), handles, strict=True)]
        return np.stack([p, *inner, q], axis=len(self.batch) + 1)

    def jvp(self, at: SampleTimes, bc_type: Any, points: Any, t: Any, ends: Any) -> Any:
        """Compute the change of the curve for a change of its data; see `symspline.CubicSpline.jvp`."""
        return derivatives.jvp(self, at, bc_type, points, t, ends)

    def vjp(self, at: SampleTimes, bc_type: Any, cotangent: Any) -> Gradient[Any]:
        """Compute the gradient with respect to the data; see `symspline.CubicSpline.vjp`."""
        return derivatives.vjp(self, at, bc_type, cotangent)

    def take_batch(self, index: Any) -> Self:
        """Return one curve or a slice of curves along the first batch axis."""
        times = np.ascontiguousarray(self.times[index]) if self.times.ndim > 1 else self.times
        points, velocities = (np.ascontiguousarray(x[index]) for x in (self.points, self.velocities))
        return type(self)(self.space, times, points, velocities, self._fitted)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.space, self.times, self.points, self.velocities, self._fitted)


class ProductCurve:
    """Curves in a product space, one per factor, with the same knots.

    Points, velocities and results of methods are tuples with one entry per factor.
    """

    max_nu: ClassVar[int] = 3

    def __init__(self, space: Space[Any], parts: tuple[CoreCurve, ...]) -> None:
        self.space: Space[Any] = space
        self.times: Doubles = parts[0].times
        self._parts = parts
        self.points: Any = tuple([part.points for part in parts])
        self.velocities: Any = tuple([part.velocities for part in parts])

    @property
    def quad_rtol(self) -> float:
        return max(part.quad_rtol for part in self._parts)

    @property
    def batch(self) -> tuple[int, ...]:
        return self._parts[0].batch

    @property
    def parts(self) -> tuple[CoreCurve, ...]:
        return self._parts

    def evaluate(
        self,
        x: Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        progress: Progress | None = None,
        out: Any = None,
    ) -> Any:
        count = len(self._parts)
        arrays = (None,) * count if out is None else parts_of(out, self.space, "out")
        values = tuple(
            part.evaluate(x, quantity, outside, per_curve, share(progress, i, count), one)
            for i, (part, one) in enumerate(zip(self._parts, arrays, strict=True))
        )
        return np.asarray(product_norm(values)) if quantity in NORMS else values

    def lift(
        self,
        x: Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        start: Any = None,
        progress: Progress | None = None,
    ) -> Any:
        count = len(self._parts)
        starts = (None,) * count if start is None else parts_of(start, self.space, "start")
        return tuple(
            part.lift(x, quantity, outside, per_curve, one, share(progress, i, count))
            for i, (part, one) in enumerate(zip(self._parts, starts, strict=True))
        )

    def transport(self, times: tuple[float, float], outside: str, v: Any) -> Any:
        each = zip(self._parts, parts_of(v, self.space, "v"), strict=True)
        return tuple(part.transport(times, outside, one) for part, one in each)

    def control_points(self) -> Any:
        return tuple(part.control_points() for part in self._parts)

    def jvp(self, at: SampleTimes, bc_type: Any, points: Any, t: Any, ends: Any) -> Any:
        count = len(self._parts)
        moved = (None,) * count if points is None else parts_of(points, self.space, "points")
        vectors = [
            (None,) * count if end is None else parts_of(end, self.space, "an end vector") for end in pair_of(ends)
        ]
        conditions = ends_in_factors(bc_type, self.space)
        each = zip(self._parts, conditions, moved, zip(*vectors, strict=True), strict=True)
        return tuple(part.jvp(at, bc, p, t, pair) for part, bc, p, pair in each)

    def vjp(self, at: SampleTimes, bc_type: Any, cotangent: Any) -> Gradient[Any]:
        cotangents = parts_of(cotangent, self.space, "cotangent")
        each = zip(self._parts, ends_in_factors(bc_type, self.space), cotangents, strict=True)
        parts = [part.vjp(at, bc, c) for part, bc, c in each]
        first, last = (None if parts[0].ends[e] is None else tuple(g.ends[e] for g in parts) for e in (0, 1))
        t = np.sum([g.t for g in parts], axis=0)
        points: Any = tuple(g.points for g in parts)
        return Gradient(points, t, (first, last))

    def take_batch(self, index: Any) -> ProductCurve:
        return ProductCurve(self.space, tuple(part.take_batch(index) for part in self._parts))

    def __reduce__(self) -> Any:
        return ProductCurve, (self.space, self._parts)


CurveArrays = CoreCurve | ProductCurve
"""Curves of a batch in any space: knots, points and velocities."""


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

        def each(arrays: Callable[[UncertaintyBand, float], list[Any]]) -> list[Any]:
            return [np.concatenate(own) for own in zip(*(arrays(*pair) for pair in pairs), strict=True)]

        speeds = [own.speed for own in bands if own.speed is not None]
        return cls(
            each(lambda own, offset: [x + offset for x in own.x]),
            each(lambda own, _: own.points),
            each(lambda own, _: own.radii),
            np.concatenate(speeds) if len(speeds) == len(bands) else None,
            np.concatenate([own.others + offset for own, offset in pairs]),
        )

    def between(self, first: float, last: float, samples: slice) -> Self:
        """Return the data from one time to another, and the band at some of the times."""
        kept = [(x >= first) & (x <= last) for x in self.x]
        return self._replace(
            x=[x[own] for x, own in zip(self.x, kept, strict=True)],
            points=[points[own] for points, own in zip(self.points, kept, strict=True)],
            radii=[own[samples] for own in self.radii],
            speed=None if self.speed is None else self.speed[samples],
            others=self.others[(self.others >= first) & (self.others <= last)],
        )

    def part(self, number: int) -> Self:
        """Return the data and the band in one factor of a product."""
        kept = {"x": [self.x[number]], "points": [self.points[number]], "radii": [self.radii[number]]}
        return self._replace(**kept, speed=None, others=_NO_TIMES)


class SidePanel(NamedTuple):
    """Numbers of one curve against time, which a plot shows in a panel of their own.

    Attributes
    ----------
    label : str
        Label of the vertical axis.
    x : ndarray, shape (n,)
        Times as numbers of the core.
    values : ndarray, shape (n, k)
        Residuals in standard deviations, or radii of the 95 % band.
    names : tuple of str
        Names of the components; empty if they have none.
    factor : int or None
        Factor of the space in which a band has these radii; None for residuals.
    """

    label: str
    x: Doubles
    values: Doubles
    names: tuple[str, ...] = ()
    factor: int | None = None


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
