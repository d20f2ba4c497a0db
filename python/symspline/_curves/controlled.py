"""Curves of control points: B-splines by de Boor's algorithm, and cumulative B-splines on groups."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Self

import numpy as np

from .. import _core
from .._base.arrays import refuse
from .._base.typing import Progress
from .._spaces import Array, Doubles, Product, Space, factors_of, product_norm
from .curve import EXACT, NORMS, REAL
from .reduced import reduced


class ControlledCurve:
    """Knots, control points and degree of B-spline curves, and evaluation in the core.

    Attributes
    ----------
    times : ndarray
        The distinct knots of the domain, between which the curve is smooth.
    """

    quad_rtol = EXACT
    max_nu = 2

    def __init__(self, space: Space[Any], knots: Doubles, control_points: Any, degree: int) -> None:
        self.space, self.knots, self.control_points, self.degree = space, knots, control_points, degree
        self.times = np.unique(knots[degree : knots.size - degree])
        control_points.flags.writeable = knots.flags.writeable = False

    @property
    def batch(self) -> tuple[int, ...]:
        shape: tuple[int, ...] = self.control_points.shape
        return shape[: len(shape) - len(self.space.point_shape) - 1]

    @property
    def parts(self) -> tuple[Self]:
        """The curve itself; a `CumulativeProduct` has one curve per factor."""
        return (self,)

    def evaluate(
        self,
        x: Doubles,
        quantity: str,
        outside: str = "raise",
        per_curve: bool = False,
        progress: Progress | None = None,
    ) -> Any:
        """A quantity at times in the domain; with ``per_curve`` the leading axes of x are the batch axes."""
        if per_curve:
            batch = self.batch
            rows = x.reshape(-1, *x.shape[len(batch) :])
            if not (rows == rows[0]).all():
                # The core evaluates all curves of a batch at the same times.
                control = self.control_points.reshape(-1, *self.control_points.shape[len(batch) :])
                each = [
                    type(self)(self.space, self.knots, own, self.degree).evaluate(row, quantity)
                    for own, row in zip(control, np.ascontiguousarray(rows), strict=True)
                ]
                return np.reshape(each, (*batch, *each[0].shape))
            x = np.ascontiguousarray(rows[0])
        return self._at(x, quantity)

    def _at(self, x: Doubles, quantity: str) -> Any:
        """Evaluate all curves at the same times."""
        space, control, span = reduced(self.space, self.control_points)
        values = _core.evaluate_bspline(space._handle, self.knots, space._as_doubles(control), self.degree, x, quantity)
        if quantity in NORMS:
            return values
        return space._numbers(values) if span is None else span.embed_samples(space._numbers(values), self.batch)


class CumulativeCurve(ControlledCurve):
    """Knots, control points and degree of cumulative B-splines on a group that is not a product."""

    @cached_property
    def _steps(self) -> Doubles:
        """The logarithms of the steps between control points."""
        return _core.cumulative_steps(self.space._handle, self.space._as_doubles(self.control_points))

    @cached_property
    def points(self) -> Array:
        """The points of the curve at its distinct knots."""
        points: Array = self._at(self.times, "point")
        return points

    def _at(self, x: Doubles, quantity: str) -> Any:
        if quantity == "motion":
            return self._motion(x)
        space, control = self.space, self.space._as_doubles(self.control_points)
        values = _core.evaluate_bspline(space._handle, self.knots, control, self.degree, x, quantity, self._steps)
        return values if quantity in REAL else space._numbers(values)

    def _motion(self, x: Doubles) -> Any:
        """Return the twist g⁻¹g' on se:3, its derivative and the pose g, as the core does for other curves."""
        g, velocity, acceleration = (self._at(x, name) for name in ("point", "velocity", "acceleration"))
        turned = np.swapaxes(g[..., :3, :3], -1, -2)
        rates = []
        # The acceleration is gξ' for the twist ξ.
        for vector in (velocity, acceleration):
            body = turned @ vector[..., :3, :]
            rates += [body[..., [2, 0, 1], [1, 2, 0]], body[..., 3]]
        return np.concatenate([*rates, g.reshape(*g.shape[:-2], 16)], axis=-1)

    def evaluate(
        self,
        x: Doubles,
        quantity: str,
        outside: str = "raise",
        per_curve: bool = False,
        progress: Progress | None = None,
    ) -> Any:
        """A quantity at times in the domain; with ``per_curve`` the leading axes of x are the batch axes."""
        if outside == "raise":
            start, end = self.times[0], self.times[-1]
            inside = (x >= start) & (x <= end)
            refuse(~inside, "x", lambda i: f"= {x[i]} is outside the domain [{start}, {end}] of the curve")
        return super().evaluate(x, quantity, outside, per_curve)

    def take_batch(self, index: Any) -> Self:
        """Return one curve or a slice of curves along the first batch axis."""
        return self.with_control_points(self.space, self.control_points[index])

    def with_control_points(self, space: Space[Any], control_points: Array) -> Self:
        """Return curves with the same knots."""
        return type(self)(space, self.knots, np.ascontiguousarray(control_points), self.degree)


class CumulativeProduct:
    """Cumulative B-splines in a product of groups, one per factor, with the same knots.

    Points and vectors are tuples with one entry per factor.
    """

    max_nu = 2

    def __init__(self, space: Space[Any], parts: tuple[CumulativeCurve, ...]) -> None:
        self.space, self.parts = space, parts
        first = parts[0]
        self.times, self.knots, self.degree, self.batch = first.times, first.knots, first.degree, first.batch
        self.quad_rtol = first.quad_rtol

    @property
    def control_points(self) -> tuple[Array, ...]:
        return tuple(part.control_points for part in self.parts)

    @property
    def points(self) -> tuple[Array, ...]:
        """The points of the curve at its distinct knots."""
        return tuple(part.points for part in self.parts)

    def evaluate(
        self,
        x: Doubles,
        quantity: str,
        outside: str = "raise",
        per_curve: bool = False,
        progress: Progress | None = None,
    ) -> Any:
        values = tuple(part.evaluate(x, quantity, outside, per_curve) for part in self.parts)
        return np.asarray(product_norm(values)) if quantity in NORMS else values

    def take_batch(self, index: Any) -> CumulativeProduct:
        return CumulativeProduct(self.space, tuple(part.take_batch(index) for part in self.parts))


def cumulative_of(
    space: Space[Any], knots: Doubles, control: list[Array], degree: int
) -> CumulativeCurve | CumulativeProduct:
    """Return curves with control points in each factor."""
    parts = tuple(CumulativeCurve(own, knots, x, degree) for own, x in zip(factors_of(space), control, strict=True))
    return CumulativeProduct(space, parts) if isinstance(space, Product) else parts[0]
