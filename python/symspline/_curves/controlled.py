"""Curves of control points: B-splines by de Boor's algorithm, and cumulative B-splines on groups."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from .. import _core
from .._base.time import refuse_outside
from .._base.typing import Progress
from .._spaces import AnySpace, Array, Doubles, Product, factors_of, product_norm
from .curve import EXACT, NORMS, REAL
from .reduced import reduced


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

    @cached_property
    def parts(self) -> tuple[ControlledCurve, ...]:
        """The curve in each factor."""
        if not isinstance(self.space, Product):
            return (self,)
        factors = zip(self.space.factors, self.control, strict=True)
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

    def _motion(self, x: Doubles) -> Any:
        """Return the twist of a motion, its derivative and the pose, as `CurveArrays.evaluate` does."""
        g, velocity, acceleration = (self._at(x, name) for name in ("point", "velocity", "acceleration"))
        turned = np.swapaxes(g[..., :3, :3], -1, -2)
        rates = []
        # The acceleration is gξ' for the twist ξ.
        for vector in (velocity, acceleration):
            body = turned @ vector[..., :3, :]
            rates += [body[..., [2, 0, 1], [1, 2, 0]], body[..., 3]]
        return np.concatenate([*rates, g.reshape(*g.shape[:-2], 16)], axis=-1)
