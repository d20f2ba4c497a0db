"""Products of spaces: curves that run in several spaces at once, on the same knots."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import spline as _spline
from ._arrays import shown
from ._core import ConvergenceError, CutLocusError, ValidationError
from ._derivatives import Gradient
from ._ends import kept
from .report import SOLVERS, Report
from .spaces import Space
from .spaces import space as space_named
from .spline import CubicSpline

Tuple = tuple[Any, ...]


class Product(Space):
    """The product of spaces: a point is a tuple with one point of each.

    Distances add as in Pythagoras' theorem; geodesics and splines run in every factor on its own.

    >>> import symspline as ss
    >>> ss.Product(ss.Sphere(3), ss.Euclidean(3))
    Product(Sphere(3), Euclidean(3))
    >>> str(ss.space("sphere:3 x r:3"))
    'sphere:3 x euclidean:3'
    """

    def __init__(self, *factors: Space | str) -> None:
        spaces = [space_named(factor) for factor in factors]
        if len(spaces) < 2:
            raise ValidationError("a Product needs at least two factors")
        flat = [part for s in spaces for part in (s.factors if isinstance(s, Product) else (s,))]
        self.factors: tuple[Space, ...] = tuple(flat)

    @property
    def point_shape(self) -> Tuple:
        """Shapes of the arrays of one point, a tuple of tuples."""
        return tuple(f.point_shape for f in self.factors)

    @property
    def dim(self) -> int:
        """Sum of the factors' dimensions."""
        return sum(f.dim for f in self.factors)

    @property
    def injectivity_radius(self) -> float:
        """The smallest of the factors'."""
        return min(f.injectivity_radius for f in self.factors)

    @property
    def curvature(self) -> float:
        """The largest K of the factors; NaN if one of them has none."""
        return float(np.max([f.curvature for f in self.factors]))

    def __str__(self) -> str:
        return " x ".join(map(str, self.factors))

    def __repr__(self) -> str:
        return f"Product({', '.join(map(repr, self.factors))})"

    def __reduce__(self) -> Tuple:
        return Product, self.factors

    def _each(self, method: str, *arguments: Any, **shared: Any) -> Tuple:
        """Calls a method of every factor with its parts of the arguments."""
        for value in arguments:
            if not isinstance(value, (tuple, list)) or len(value) != len(self.factors):
                raise ValidationError(f"{self!r} needs tuples of {len(self.factors)} arrays, one a factor")
        parts = zip(*arguments, strict=True) if arguments else [()] * len(self.factors)
        return tuple(
            getattr(factor, method)(*part, **shared) for factor, part in zip(self.factors, parts, strict=True)
        )

    def exp(self, p: Any, v: Any) -> Any:
        return self._each("exp", p, v)

    def log(self, p: Any, q: Any) -> Any:
        return self._each("log", p, q)

    def geodesic(self, p: Any, q: Any, t: ArrayLike) -> Any:
        return self._each("geodesic", p, q, t=t)

    def distance(self, p: Any, q: Any) -> Any:
        return _together(self._each("distance", p, q))

    def transvection(self, p: Any, v: Any, x: Any) -> Any:
        return self._each("transvection", p, v, x)

    def transport(self, p: Any, q: Any, v: Any) -> Any:
        return self._each("transport", p, q, v)

    def inner(self, p: Any, u: Any, v: Any) -> Any:
        return sum(self._each("inner", p, u, v))

    def norm(self, p: Any, v: Any) -> Any:
        return _together(self._each("norm", p, v))

    def project(self, x: Any) -> Any:
        return self._each("project", x)

    def project_tangent(self, p: Any, v: Any) -> Any:
        return self._each("project_tangent", p, v)

    def check_point(self, p: Any) -> None:
        self._each("check_point", p)

    def check_tangent(self, p: Any, v: Any) -> None:
        self._each("check_tangent", p, v)

    def random_point(self, rng: np.random.Generator, shape: int | tuple[int, ...] = ()) -> Any:
        return tuple(factor.random_point(rng, shape) for factor in self.factors)

    def random_tangent(self, rng: np.random.Generator, p: Any) -> Any:
        check_tuple(p, self, "p")
        return tuple(factor.random_tangent(rng, q) for factor, q in zip(self.factors, p, strict=True))


class ProductSpline(CubicSpline):
    """A spline in a product of spaces: one spline in every factor. Made by `CubicSpline`."""

    _space: Product
    _parts: tuple[CubicSpline, ...]

    def __init__(
        self,
        t: Any,
        points: Any,
        space: Any,
        *,
        bc_type: Any = "natural",
        on_failure: str = "raise",
        **options: Any,
    ) -> None:
        space = space_named(space)
        _spline._check_options(on_failure, options.get("progress"))
        check_tuple(points, space, "points")
        ends = _split_ends(bc_type, space)
        _validate(t, points, space, ends, options)
        parts, errors = [], []
        progress = options.pop("progress", None)
        for i, (factor, p, bc) in enumerate(zip(space.factors, points, ends, strict=True)):
            options["progress"] = _share(progress, i, len(space.factors))
            part, error = _try(t, p, factor, bc, options)
            parts.append(part)
            errors += [error] if error else []
        self._join(space, tuple(parts), kept(bc_type))
        if errors:
            _spline._fail([(0, _kind(errors[0]), str(errors[0]))], on_failure, self)

    def _join(self, space: Product, parts: tuple[CubicSpline, ...], bc_type: Any) -> None:
        self._space, self._parts, self._bc_type = space, parts, bc_type
        first = parts[0]
        self._t, self._times, self._clock = first._t, first._times, first._clock
        self._extrapolate = first._extrapolate
        self._report = _worst(parts, space)

    @classmethod
    def _of_parts(cls, space: Product, parts: tuple[CubicSpline, ...], bc_type: Any) -> ProductSpline:
        self = object.__new__(cls)
        self._join(space, parts, bc_type)
        return self

    def _evaluate(self, *arguments: Any) -> Any:
        values = tuple(part._evaluate(*arguments) for part in self._parts)
        if arguments[1] in ("speed", "bend"):
            return _together(values)
        return values

    def jvp(
        self,
        x: ArrayLike,
        points: Any = None,
        t: ArrayLike | None = None,
        ends: tuple[Any, Any] | None = None,
        nu: int = 0,
    ) -> Tuple:
        """How the curve moves when its data move, see `CubicSpline.jvp`; points and vectors are tuples."""
        factors = len(self._parts)
        if points is None:
            points = (None,) * factors
        check_tuple(points, self._space, "points")
        for end in ends or ():
            if end is not None:
                check_tuple(end, self._space, "an end vector")
        pairs = [tuple(end and end[i] for end in ends) if ends else None for i in range(factors)]
        pieces = zip(self._parts, points, pairs, strict=True)
        return tuple(part.jvp(x, p, t, pair, nu) for part, p, pair in pieces)

    def vjp(self, x: ArrayLike, cotangent: Any, nu: int = 0) -> Gradient:
        """The gradient with respect to the data, see `CubicSpline.vjp`; points and vectors are tuples."""
        check_tuple(cotangent, self._space, "cotangent")
        parts = [part.vjp(x, c, nu) for part, c in zip(self._parts, cotangent, strict=True)]
        first, last = (None if parts[0].ends[e] is None else tuple(g.ends[e] for g in parts) for e in (0, 1))
        t = np.sum([g.t for g in parts], axis=0)
        return Gradient(tuple(g.points for g in parts), t, (first, last))

    @property
    def points(self) -> Tuple:
        """The points, a tuple with one array a factor."""
        return tuple(part.points for part in self._parts)

    @property
    def velocities(self) -> Tuple:
        """Velocities at the knots, a tuple with one array a factor."""
        return tuple(part.velocities for part in self._parts)

    @property
    def control_points(self) -> Tuple:
        """Control points, a tuple with one array a factor."""
        return tuple(part.control_points for part in self._parts)

    @property
    def _batch(self) -> tuple[int, ...]:
        return self._parts[0]._batch

    def __getitem__(self, index: Any) -> ProductSpline:
        parts = tuple(part[index] for part in self._parts)
        ends = [part.bc_type for part in parts]
        return ProductSpline._of_parts(self._space, parts, _join_ends(ends))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, CubicSpline):
            return NotImplemented
        return isinstance(other, ProductSpline) and self._parts == other._parts

    __hash__ = None

    def __reduce__(self) -> Tuple:
        return ProductSpline._of_parts, (self._space, self._parts, self._bc_type)


def fit_many(
    curves: list[Tuple], space: Any, bc_type: Any, policy: Any, on_failure: str, options: dict[str, Any]
) -> list[CubicSpline]:
    """`symspline.fit_many` in a product: one parallel call a factor."""
    for number, curve in enumerate(curves):
        check_tuple(curve[1], space, f"curve {number}: points")
    columns, errors = [], []
    for i, (factor, bc) in enumerate(zip(space.factors, _split_ends(bc_type, space), strict=True)):
        part = [(t, points[i]) for t, points in curves]
        try:
            fitted = _spline.fit_many(part, factor, bc_type=bc, extrapolate=policy, **options)
        except (CutLocusError, ConvergenceError) as error:
            errors.append(error)
            fitted = error.spline
        columns.append(fitted)
    made: list[CubicSpline] = [
        ProductSpline._of_parts(space, parts, _join_ends([part.bc_type for part in parts]))
        for parts in zip(*columns, strict=True)
    ]
    if errors:
        _spline._fail([(0, _kind(errors[0]), str(errors[0]))], on_failure, made)
    return made


def _validate(t: Any, points: Any, space: Product, ends: list[Any], options: dict[str, Any]) -> None:
    """Raise before any work if one of the factors would."""
    check = options.get("check", True)
    method, tol = options.get("method", "auto"), options.get("tol", 1e-12)
    shapes = []
    for i, (factor, p, bc) in enumerate(zip(space.factors, points, ends, strict=True)):
        part = object.__new__(CubicSpline)
        part._space, part._extrapolate = factor, None
        try:
            part._fill(t, p, bc, method, tol, options.get("max_iter"), check, None, dry=True)
        except ValidationError as error:
            raise ValidationError(f"factor {i}, {factor!r}: {error}") from None
        shapes.append((part._batch, part._times.shape[-1]))
    if len(set(shapes)) > 1:
        described = ", ".join(f"{nodes} points, batch axes {batch}" for batch, nodes in shapes)
        raise ValidationError(f"points: the factors differ in length, or batch axes differ: {described}")


def _share(progress: Any, i: int, factors: int) -> Any:
    """Progress of the i-th factor as progress of all."""
    if progress is None:
        return None
    return lambda finished, total: progress(i * total + finished, factors * total)


def _try(t: Any, points: Any, factor: Space, bc: Any, options: dict[str, Any]) -> tuple[CubicSpline, Any]:
    """A fit whose failure is kept beside what it reached."""
    try:
        return CubicSpline(t, points, factor, bc_type=bc, **options), None
    except (CutLocusError, ConvergenceError) as error:
        return error.spline, error


def _kind(error: Exception) -> str:
    return "cut-locus" if isinstance(error, CutLocusError) else "unconverged"


def check_tuple(points: Any, space: Any, name: str) -> None:
    """Raise ValidationError unless there is one array a factor."""
    if not isinstance(points, (tuple, list)) or len(points) != len(space.factors):
        raise ValidationError(
            f"{name} must be a tuple of {len(space.factors)} arrays, one a factor of {space!r}"
        )


def _split_ends(bc_type: Any, space: Product) -> list[Any]:
    """End conditions for each factor; prescribed vectors are tuples."""
    if isinstance(bc_type, str):
        return [bc_type] * len(space.factors)
    if not isinstance(bc_type, (tuple, list)) or len(bc_type) != 2:
        raise ValidationError(f"bc_type must be a word or a pair, not {shown(bc_type)}")

    def part(end: Any, i: int) -> Any:
        if isinstance(end, str):
            return end
        if not isinstance(end, (tuple, list)) or len(end) != 2:
            raise ValidationError(
                f"an end condition is a word or a pair (order, tuple of vectors), not {shown(end)}"
            )
        check_tuple(end[1], space, "an end vector")
        return (end[0], end[1][i])

    return [tuple(part(end, i) for end in bc_type) for i in range(len(space.factors))]


def _join_ends(ends: list[Any]) -> Any:
    """The inverse of `_split_ends`."""
    if isinstance(ends[0], str):
        return ends[0]

    def both(e: int) -> Any:
        first = ends[0][e]
        return first if isinstance(first, str) else (first[0], tuple(end[e][1] for end in ends))

    return (both(0), both(1))


def _together(lengths: Tuple) -> Any:
    """What lengths in the factors are as one, by Pythagoras' theorem."""
    with np.errstate(all="ignore"):
        return reduce(np.hypot, lengths)


def _worst(parts: tuple[CubicSpline, ...], space: Product) -> Report:
    reports = [part.report for part in parts]

    def largest(values: list[Any]) -> Any:
        result: NDArray[Any] = np.max(np.stack(values), axis=0)
        return result.item() if result.ndim == 0 else result

    converged: Any = np.all(np.stack([np.asarray(r.converged) for r in reports]), axis=0)
    return replace(
        reports[0],
        method=max((r.method for r in reports), key=SOLVERS.index),
        # The theorem is about each factor by itself.
        invariant_radius=None,
        converged=bool(converged) if np.ndim(converged) == 0 else converged,
        iterations=largest([r.iterations for r in reports]),
        residual=largest([r.residual for r in reports]),
        max_step=_longest_step(parts),
        curvature=space.curvature,
        rate=largest([r.rate for r in reports]),
    )


def _longest_step(parts: tuple[CubicSpline, ...]) -> Any:
    """D of (21): distances of the factors add as in Pythagoras' theorem, step by step."""
    steps = []
    for part in parts:
        index = (slice(None),) * len(part._batch)
        p, q = part.points[(*index, slice(None, -1))], part.points[(*index, slice(1, None))]
        steps.append(part.space._apply("distance", p=p, q=q))
    longest = np.max(_together(tuple(steps)), axis=-1)
    return float(longest) if np.ndim(longest) == 0 else longest
