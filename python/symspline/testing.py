"""Tests of the laws of a space, which you can run on your own space.

Examples
--------
>>> import symspline as ss
>>> print(ss.testing.check(ss.Sphere(2)))  # doctest: +ELLIPSIS
Sphere(2) obeys
  log inverts exp                    ...
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._base.arrays import checked_number, whole_number
from ._base.typing import Array
from ._core import ConvergenceError, CutLocusError, ValidationError
from ._spaces import AnySpace, Doubles, Product, Space, space_named
from ._splines.cubic import CubicSpline
from ._splines.functional import segments_of
from .manifolds import Manifold

__all__ = ["Conformance", "check"]


def __dir__() -> list[str]:
    return __all__


# Lengths of steps as parts of the longest.
_PARTS = (1e-8, 1e-4, 1e-2, 0.3, 1.0)
# Central differences of order four: positions, weights, step, and error relative to the compared quantity.
_PLACES = np.array([-2.0, -1.0, 1.0, 2.0])
_WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / 12
_STEP = 3e-3
_DIFFERENCES = 1e-8
# By how much errors of exp and log may be larger in second derivatives.
_BENT = 1e4
_COUNT = 6


@dataclass(frozen=True)
class Conformance:
    """Deviations of a space from the laws of symmetric spaces.

    Attributes
    ----------
    space : Space
        Space that was checked.
    deviations : dict of str to float
        Largest relative deviation from each law; for the order of convergence, the distance from four.
    allowed : dict of str to float
        Largest allowed deviation from each law.

    Examples
    --------
    >>> from symspline import testing
    >>> found = testing.check("sphere:2")
    >>> found.space, found.deviations.keys() == found.allowed.keys()
    (Sphere(2), True)
    """

    space: Space
    deviations: dict[str, float] = field(default_factory=dict)
    allowed: dict[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        lines = [f"  {law:34} {value:.1e} (allowed {self.allowed[law]:.0e})" for law, value in self.deviations.items()]
        return "\n".join([f"{self.space!r} obeys", *lines])

    def _add(self, law: str, deviation: Any, allowed: float) -> None:
        largest = float(np.max(deviation))
        self.deviations[law], self.allowed[law] = largest, allowed
        if not largest <= allowed:
            raise AssertionError(
                f"{self.space!r} breaks the law that {law}: off by {largest:.3e}, allowed {allowed:.1e}"
            )


def check(
    space: AnySpace | str,
    *,
    point: ArrayLike | None = None,
    length: float | None = None,
    tol: float = 1e-10,
    seed: int = 0,
) -> Conformance:
    """Check the laws of a space, such as a `symspline.Manifold`, and of the curves on it.

    The laws are:

    - exp and log are inverse, log is tangent, and exp stays on the space;
    - the inner product is symmetric, bilinear and positive;
    - distance is symmetric, and its derivative agrees with the first variation, which relates geodesics to the inner
      product;
    - the derivative of log agrees with differences;
    - splines interpolate, and value, velocity and covariant acceleration are continuous at every knot, on equal and
      unequal knots;
    - with not-a-knot ends, the error for a smooth curve falls with the fourth power of the spacing.

    Parameters
    ----------
    space : Space or str
        Space, except products, or its name.
    point : array_like, optional
        Point from which the tests start. None means a random one, which requires ``project`` of a `Manifold`.
    length : float, optional
        Longest step of the tests. None means half the injectivity radius, and at most 0.5.
    tol : float, default 1e-10
        Expected accuracy of exp, log and distances, relative to numbers of size 1. The limits of the other laws are
        derived from it. Distances that are arc cosines need 1e-7.
    seed : int, default 0
        Seed of the random numbers.

    Returns
    -------
    Conformance
        Largest deviation from each law.

    Raises
    ------
    AssertionError
        If a law is violated. The message states the law and the deviation.
    ValidationError
        If the space cannot be checked.

    Examples
    --------
    >>> from symspline import testing
    >>> print(testing.check("sphere:2"))  # doctest: +ELLIPSIS
    Sphere(2) obeys
      ...
    """
    space = space_named(space)
    if isinstance(space, Product):
        raise ValidationError("a product cannot be checked; check each factor")
    for name, number in (("tol", tol), ("length", length)):
        if number is not None:
            checked_number(number, f"{name} must be a number above 0", lambda x: 0 < x < np.inf)
    rng = np.random.default_rng(whole_number(seed, "seed", 0))
    if point is None:
        base = space.random_point(rng)
    else:
        space.check_point(point)
        base = np.asarray(point, space.dtype)
    longest = min(0.5, space.injectivity_radius / 2) if length is None else length
    result = Conformance(space)
    rounding = float(np.max(space._rounding(base)))
    sample = _Sample(space, base, longest, max(tol, 1e-14 * rounding), rng)
    _operations(result, sample)
    # K is NaN where no metric belongs to a group, and of manifolds made of functions.
    if isinstance(space, Manifold) or not np.isnan(space.curvature):
        _metric(result, sample)
    if isinstance(space, Manifold):
        _derivative(result, sample)
    try:
        _smoothness(result, sample)
        _order(result, sample)
    except (ConvergenceError, CutLocusError) as error:
        raise AssertionError(f"{space!r} breaks the law that near points have splines: {error}") from error
    return result


class _Sample:
    """Random points, and steps of many lengths from them."""

    def __init__(self, space: Space, base: Array, longest: float, tol: float, rng: np.random.Generator) -> None:
        self.space, self.base, self.longest, self.tol, self.rng = space, base, longest, tol, rng
        around = self.tangents(np.broadcast_to(base, (_COUNT, *base.shape)))
        points = space.exp(base, longest * around)
        self.lengths = longest * np.repeat(_PARTS, _COUNT)
        self.p = np.concatenate([points] * len(_PARTS))
        self.v = self.wide(self.lengths) * self.tangents(self.p)
        self.q = space.exp(self.p, self.v)

    def tangents(self, p: Array) -> Array:
        """Return random unit tangent vectors."""
        v = self.space.random_tangent(self.rng, p)
        return np.asarray(v / self.wide(self.space.norm(p, v)))

    def wide(self, x: ArrayLike) -> Array:
        """Reshape numbers so that they can be multiplied by points."""
        shape = *np.shape(x), *[1] * len(self.space.point_shape)
        return np.asarray(x).reshape(shape)

    def size(self, x: Array) -> Array:
        """Return the largest entry of every point or vector."""
        axes = tuple(range(-len(self.space.point_shape), 0))
        return np.asarray(np.abs(x).max(axis=axes))


def _operations(result: Conformance, s: _Sample) -> None:
    space = s.space
    logs = space.log(s.p, s.q)
    # Of short steps rounding of the points is what is left.
    result._add("log inverts exp", s.size(logs - s.v) / np.maximum(1.0, s.lengths), s.tol)
    result._add("exp inverts log", space.distance(space.exp(s.p, logs), s.q), s.tol)
    space.check_point(s.q)
    noise = s.rng.standard_normal(s.p.shape).astype(space.dtype)
    tangent = space.project_tangent(s.p, noise)
    result._add("project_tangent is a projection", s.size(space.project_tangent(s.p, tangent) - tangent), s.tol)
    result._add("log is tangent", s.size(space.project_tangent(s.p, logs) - logs), s.tol)
    half = space.exp(s.p, s.v / 2)
    result._add(
        "geodesics run at constant speed", s.size(2 * space.log(s.p, half) - logs) / np.maximum(1.0, s.lengths), s.tol
    )
    onward = -space.log(half, s.p)
    result._add("geodesics go on as geodesics", s.space.distance(space.exp(half, onward), s.q), s.tol)


def _metric(result: Conformance, s: _Sample) -> None:
    space = s.space
    a, b, c = (s.tangents(s.p) for _ in range(3))
    result._add("inner is symmetric", np.abs(space.inner(s.p, a, b) - space.inner(s.p, b, a)), s.tol)
    both = space.inner(s.p, a + 2 * b, c) - space.inner(s.p, a, c) - 2 * space.inner(s.p, b, c)
    result._add("inner is bilinear", np.abs(both), s.tol)
    result._add("inner is positive", np.maximum(0.0, -space.inner(s.p, a, a)), 0.0)
    there, back = space.distance(s.p, s.q), space.distance(s.q, s.p)
    result._add("distance is symmetric", np.abs(there - back), s.tol)
    result._add("distance is the length of log", np.abs(there - s.lengths), s.tol)

    # Of the half square of distance, whose gradient at q is minus the logarithm.
    w = s.tangents(s.q)
    slope = _slope(lambda h: space.distance(s.p, space.exp(s.q, h * w)) ** 2 / 2, _STEP)
    expected = -space.inner(s.q, space.log(s.q, s.p), w)
    result._add("distance has its first variation", np.abs(slope - expected), _allowed(s))


def _slope(function: Callable[[float], Array], step: float) -> Array:
    """Return the derivative of a function at 0 by central differences."""
    return np.asarray(np.tensordot(_WEIGHTS, np.array([function(place * step) for place in _PLACES]), 1) / step)


def _allowed(s: _Sample) -> float:
    """Return the limit for differences: their own error, and that of their terms."""
    return max(_DIFFERENCES / min(1.0, s.longest) ** 2, 10 * s.tol / _STEP)


def _derivative(result: Conformance, s: _Sample) -> None:
    space = s.space
    assert isinstance(space, Manifold)
    w = s.tangents(s.q)
    slope = _slope(lambda h: space.log(s.p, space.exp(s.q, h * w)), _STEP * min(1.0, 2 * s.longest))
    result._add("dlog is the derivative of log", s.size(space.dlog(s.p, s.q, w) - slope), _allowed(s))


def _walk(s: _Sample) -> Array:
    """Return points whose steps have the longest length and turn by half a radian."""
    space, p = s.space, [s.base]
    direction = s.tangents(s.base)
    for _ in range(5):
        q = space.exp(p[-1], s.longest * direction)
        direction = -space.log(q, p[-1]) / s.longest + 0.5 * s.tangents(q)
        direction = direction / s.wide(space.norm(q, direction))
        p.append(q)
    return np.array(p)


def _smoothness(result: Conformance, s: _Sample) -> None:
    space, p = s.space, _walk(s)
    offs: list[Any] = []
    largest = np.zeros(3)
    for t in (np.arange(len(p), dtype=float), np.cumsum(s.rng.uniform(0.7, 1.3, len(p)))):
        for ends in ("natural", "not-a-knot"):
            spline = CubicSpline(t, p, space, bc_type=ends)
            offs.append(s.space.distance(spline(t), p).max())
            jumps = [segments_of(spline).jumps(nu) for nu in range(3)]
            # A straight walk has no acceleration, so that jumps are relative to the length of a step at least.
            sizes = (1.0, *(max(jump.largest, s.longest) for jump in jumps[1:]))
            largest = np.maximum(largest, np.divide([jump.size.max() for jump in jumps], sizes))
    value, velocity, acceleration = largest
    result._add("splines interpolate", offs, s.tol)
    result._add("splines are continuous", value, s.tol)
    result._add("velocity is continuous", velocity, 100 * s.tol)
    result._add("acceleration is continuous", acceleration, _BENT * s.tol)


def _order(result: Conformance, s: _Sample) -> None:
    """Check the order of convergence of curves with not-a-knot ends through points of a smooth curve."""
    space = s.space
    axes = [s.tangents(s.base) for _ in range(3)]

    def curve(t: Doubles) -> Array:
        waves = 0.9 * t + 0.3 * np.sin(3 * t), 0.5 * np.cos(2 * t), 0.4 * np.sin(4 * t)
        v = sum(s.wide(wave) * axis for wave, axis in zip(waves, axes, strict=True))
        return space.exp(s.base, s.longest * np.asarray(v))

    errors = [_error(space, curve, n) for n in (16, 32)]
    # Where an error is rounding there is nothing to measure.
    order = np.log2(errors[0] / errors[1]) if errors[1] > 1e3 * s.tol * s.longest else 4.0
    result._add("the order of not-a-knot is four", abs(order - 4.0), 0.6)


def _error(space: Space, curve: Callable[[Doubles], Array], n: int) -> float:
    t = np.linspace(0, 1, n + 1)
    x = np.linspace(0, 1, 4 * n + 1)[1::2]
    spline = CubicSpline(t, curve(t), space, bc_type="not-a-knot")
    return float(np.max(space.distance(spline(x), curve(x))))
