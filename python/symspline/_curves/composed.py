"""Curves that are made of other curves: one after the other, or the same path at other times.

They satisfy the protocol `length.Evaluable`, with times as numbers of the core, and have the same factors as the
curves of which they are made.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import checked_flag, refuse
from .._base.time import TimeAxis, onto_ends
from .._base.typing import Progress, TimesLike
from .._core import ValidationError
from .._spaces import Doubles, Product, Space, product_norm
from .curve import NORMS, CurveArrays, write_into

# Orders of derivatives.
_NU = {"point": 0, "velocity": 1, "acceleration": 2, "jerk": 3, "body velocity": 1, "body acceleration": 2}
# The quantities from which each one follows by the chain rule.
_ORDERS = {
    "point": ("point",),
    "velocity": ("velocity",),
    "acceleration": ("velocity", "acceleration"),
    "body velocity": ("body velocity",),
    "body acceleration": ("body velocity", "body acceleration"),
}
# Relative rounding error of a law at the ends of the curve.
_ROUNDING = 1e-9


class AnyCurve(Protocol):
    """Curves of a batch: arrays, control points, or a composition of other curves."""

    @property
    def space(self) -> Space[Any]: ...
    @property
    def times(self) -> Doubles: ...
    @property
    def batch(self) -> tuple[int, ...]: ...
    @property
    def quad_rtol(self) -> float: ...
    @property
    def max_nu(self) -> int:
        """Highest order of derivatives."""
        ...

    @property
    def parts(self) -> tuple[Any, ...]:
        """One curve per factor of a product; the curve itself on other spaces."""
        ...

    def evaluate(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None = None
    ) -> Any: ...


class TimeMap(Protocol):
    """Times of a curve as a function of other times, with derivatives."""

    def __call__(self, x: Any, nu: int = 0, /) -> Any: ...


@dataclass(frozen=True, eq=False)
class Affine:
    """The map that takes x to ``offset + sign * x``.

    Attributes
    ----------
    sign : int
        1 or -1.
    offset : ndarray or float
        One number, or one per curve.
    """

    sign: int = 1
    offset: Any = 0.0

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Affine):
            return NotImplemented
        return self.sign == other.sign and np.array_equal(self.offset, other.offset)

    def __call__(self, x: Any, nu: int = 0, /) -> Any:
        if nu:
            return np.full(np.shape(x), float(self.sign) if nu == 1 else 0.0)
        offset = np.asarray(self.offset)
        if offset.ndim:
            offset = offset.reshape(offset.shape + (1,) * (np.ndim(x) - offset.ndim))
        return offset + self.sign * x


class Joined:
    """Curves one after the other, with gaps where one ends before the next begins.

    Values in gaps are NaN. Lengths and energies are sums over the curves, so that gaps contribute nothing.

    Attributes
    ----------
    sections : tuple of curves
        The curves, on one space and with the same batch axes. Curves of a batch share their times.
    offsets : tuple of float
        Origins of the times of the sections.
    times : ndarray
        Times between which the curves are smooth.
    """

    def __init__(self, sections: Sequence[AnyCurve], offsets: Sequence[float]) -> None:
        self.sections, self.offsets = tuple(sections), tuple(offsets)
        self.space: Space[Any] = sections[0].space
        self.batch = sections[0].batch
        self.quad_rtol = max(own.quad_rtol for own in sections)
        knots = [own.times + offset for own, offset in zip(sections, offsets, strict=True)]
        self.starts, self.stops = (np.array([own[i] for own in knots]) for i in (0, -1))
        self.times = np.unique(np.concatenate(knots))
        self.max_nu = min(own.max_nu for own in sections)

    @property
    def parts(self) -> tuple[Any, ...]:
        """The same curves in each factor of a product."""
        if not isinstance(self.space, Product):
            return (self,)
        return tuple(Joined(own, self.offsets) for own in zip(*(own.parts for own in self.sections), strict=True))

    def map(self, function: Callable[[Any], Any]) -> Joined:
        """Return the curve whose sections are the values of a function of the sections."""
        return Joined([function(own) for own in self.sections], self.offsets)

    def evaluate(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None = None
    ) -> Any:
        """Evaluate a quantity at times x; see `CurveArrays.evaluate`. Only ``"continue"`` gives zero norms in gaps."""
        _check_inside(self, x, outside, per_curve)
        shape = x.shape[len(self.batch) :] if per_curve else x.shape
        flat = x.reshape((*self.batch, math.prod(shape)) if per_curve else math.prod(shape))
        number = np.clip(np.searchsorted(self.starts, flat, side="right") - 1, 0, len(self.starts) - 1)
        gap = (flat < self.starts[number]) | (flat > self.stops[number])
        found = []
        groups = list(_groups(number)) or [(0, np.zeros(0, np.intp))]
        for done, (i, columns) in enumerate(groups):
            values = self._in_section(i, flat[..., columns], quantity, per_curve)
            found.append((number[..., columns] == i, columns, values))
            if progress is not None:
                progress(done + 1, len(groups))
        missing = 0.0 if outside == "continue" and quantity in NORMS else np.nan

        def assembled(*values: Any) -> Any:
            return self._assembled(found, values, gap, missing).reshape(
                (*self.batch, *shape, *values[0].shape[len(self.batch) + 1 :])
            )

        return _by_factor(assembled, [values for *_, values in found])

    def _in_section(self, i: int, x: Doubles, quantity: str, per_curve: bool) -> Any:
        own = self.sections[i]
        times = np.clip(x, self.starts[i], self.stops[i]) - self.offsets[i]
        # The difference can exceed the ends by rounding.
        times = np.ascontiguousarray(np.clip(times, own.times[0], own.times[-1]))
        return own.evaluate(times, quantity, "raise", per_curve)

    def _assembled(self, found: list[Any], values: Sequence[Any], gap: NDArray[np.bool_], missing: float) -> Any:
        """Return the values of all sections in one array of shape (*batch, m, ...)."""
        axes, rest = (slice(None),) * len(self.batch), values[0].shape[len(self.batch) + 1 :]
        result = np.full((*self.batch, gap.shape[-1], *rest), np.nan, values[0].dtype)
        for (here, columns, _), own in zip(found, values, strict=True):
            kept = here.reshape(here.shape + (1,) * len(rest))
            result[(*axes, columns)] = np.where(kept, own, result[(*axes, columns)])
        result[np.broadcast_to(gap, (*self.batch, gap.shape[-1]))] = missing
        return result


def _groups(number: NDArray[np.intp]) -> Iterator[tuple[int, NDArray[np.intp]]]:
    """Yield each section that occurs in an array of shape (..., m), and the columns in which it does.

    The effort is that of sorting: a recording may have as many sections as times.
    """
    flat = number.ravel()
    order = np.argsort(flat, kind="stable")
    for own in np.split(order, np.flatnonzero(np.diff(flat[order])) + 1):
        if len(own):
            yield int(flat[own[0]]), np.unique(own % number.shape[-1])


class Retimed:
    """A curve at other times: γ(σ(x)).

    Attributes
    ----------
    source : curve
        The curve γ.
    law : callable
        The function σ, called with times and the order of a derivative.
    times : ndarray
        Times between which the result is smooth, within its domain.
    """

    def __init__(self, source: AnyCurve, law: TimeMap, times: Doubles) -> None:
        self.source, self.law, self.times = source, law, times
        self.space: Space[Any] = source.space
        self.batch = source.batch
        self.quad_rtol = source.quad_rtol
        self.max_nu = source.max_nu if isinstance(law, Affine) else min(2, source.max_nu)

    @property
    def parts(self) -> tuple[Any, ...]:
        """The same curve in each factor of a product."""
        if not isinstance(self.space, Product):
            return (self,)
        return tuple(Retimed(own, self.law, self.times) for own in self.source.parts)

    def map(self, function: Callable[[Any], Any]) -> Retimed:
        """Return a function of the source at the same times."""
        return Retimed(function(self.source), self.law, self.times)

    def evaluate(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None = None
    ) -> Any:
        """Evaluate a quantity at times x; see `CurveArrays.evaluate`."""
        _check_inside(self, x, outside, per_curve)
        at = self._source_times(x, per_curve)

        def value(name: str) -> Any:
            return self.source.evaluate(at, name, "raise", per_curve)

        if quantity == "point" or (isinstance(self.law, Affine) and quantity in NORMS):
            result = value(quantity)
        elif isinstance(self.law, Affine) and quantity in _NU:
            # Derivatives of odd order change their sign with the direction.
            sign = self.law.sign ** _NU[quantity]
            result = _by_factor(lambda own: sign * own, [value(quantity)])
        elif quantity == "speed":
            result = np.abs(self.law(x, 1)) * value("speed")
        elif quantity == "bend":
            result = product_norm(tuple(_acceleration_norm(part, x, outside, per_curve) for part in self.parts))
        elif quantity == "motion":
            # The twist, its derivative, and the point; see `CurveArrays.evaluate`.
            dim, found = self.space.dim, value("motion")
            first, second = (np.asarray(self.law(x, order))[..., None] for order in (1, 2))
            twist, change = found[..., :dim], found[..., dim : 2 * dim]
            rates = [first * twist, second * twist + first**2 * change]
            result = np.concatenate([*rates, found[..., 2 * dim :]], axis=-1)
        else:
            lower = _ORDERS[quantity]
            factors = _chain_rule([self.law(x, order) for order in range(1, len(lower) + 1)])
            before = x.ndim if per_curve else len(self.batch) + x.ndim
            result = _by_factor(lambda *own: _weighted(factors, own, before), [value(name) for name in lower])
        if progress is not None:
            progress(1, 1)
        return result

    def _source_times(self, x: Doubles, per_curve: bool) -> Doubles:
        """Return the times of the source, which can exceed its ends by rounding only."""
        times = np.asarray(self.law(x, 0), np.float64)
        first, last = ends_beside(self.source.times, times, self.batch, per_curve)
        reach = _ROUNDING * (last - first)
        wrong = ~((times >= first - reach) & (times <= last + reach))
        if wrong.any():
            i = tuple(np.argwhere(wrong)[0].tolist())
            raise ValidationError(
                f"law returns {np.broadcast_to(times, wrong.shape)[i]} at x = {np.broadcast_to(x, wrong.shape)[i]}, "
                f"outside the domain of the curve [{np.ravel(first)[0]}, {np.ravel(last)[0]}]. Pass a law with values "
                "in the domain."
            )
        return np.asarray(np.clip(times, first, last), order="C") if times.ndim == wrong.ndim else times


def ends_beside(times: Doubles, x: Doubles, batch: tuple[int, ...], per_curve: bool) -> tuple[Any, Any]:
    """Return the first and the last of `times` in a shape that broadcasts with times x."""
    first, last = times[..., 0], times[..., -1]
    if times.ndim == 1:
        return first, last
    ones = (1,) * (x.ndim - len(batch) if per_curve else x.ndim)
    return first.reshape(batch + ones), last.reshape(batch + ones)


def part_of_times(times: Doubles, start: Any, stop: Any, batch: tuple[int, ...]) -> Doubles:
    """Return the ends of a part of a domain, and the times between them."""
    if np.ndim(start) or np.ndim(stop) or times.ndim > 1:
        start, stop = (np.broadcast_to(end, batch)[..., None] for end in (start, stop))
        return np.concatenate([start, np.clip(times, start, stop), stop], axis=-1)
    return np.concatenate([[start], times[(times > start) & (times < stop)], [stop]])


def _check_inside(curve: Joined | Retimed, x: Doubles, outside: str, per_curve: bool) -> None:
    """Raise ValidationError if a time is not finite or lies outside the domain."""
    if outside == "continue":
        return
    first, last = ends_beside(curve.times, x, curve.batch, per_curve)
    wrong = ~((x >= first) & (x <= last))

    def say(i: Any) -> str:
        time = np.broadcast_to(x, wrong.shape)[i]
        ends = [np.broadcast_to(end, wrong.shape)[i] for end in (first, last)]
        where = f"outside the domain [{ends[0]}, {ends[1]}] of the curve" if np.isfinite(time) else "not finite"
        return f"= {time} is {where}"

    refuse(wrong, "x", say)


def _by_factor(function: Callable[..., Any], values: Sequence[Any]) -> Any:
    """Apply a function of arrays to values that are tuples with one array per factor, or arrays."""
    if isinstance(values[0], tuple):
        return tuple(function(*own) for own in zip(*values, strict=True))
    return function(*values)


def _chain_rule(s: Sequence[Any]) -> tuple[Any, ...]:
    """Return the factors of γ' and ∇γ' in the last derivative of γ∘σ, from the derivatives s of σ."""
    return (s[0],) if len(s) == 1 else (s[1], s[0] ** 2)


def _weighted(factors: Sequence[Any], values: Sequence[Any], before: int) -> Any:
    """Return a sum of vectors with factors, one per time; the vectors have `before` axes before those of a point."""
    total: Any = 0.0
    for factor, own in zip(factors, values, strict=True):
        total = total + np.reshape(factor, np.shape(factor) + (1,) * (own.ndim - before)) * own
    return total


def _acceleration_norm(part: Any, x: Doubles, outside: str, per_curve: bool) -> Any:
    """Return the norm of the acceleration in one factor, NaN where the curve is."""
    points, vectors = (part.evaluate(x, name, outside, per_curve) for name in ("point", "acceleration"))
    space: Space[Any] = part.space
    valid = space._where_finite(points) & space._where_finite(vectors)
    norms = np.full(valid.shape, np.nan)
    norms[valid] = space.norm(points[valid], vectors[valid])
    return norms


# ---- evaluation of curves at times as a user passes them ----


def evaluated(
    curve: AnyCurve,
    time_axis: TimeAxis,
    x: TimesLike,
    quantity: str,
    outside: str,
    per_curve: bool,
    progress: Progress | None = None,
    out: Any = None,
) -> Any:
    """Evaluate a quantity at times as a user passes them."""

    def call(x: Doubles, outside: str, per_curve: bool) -> Any:
        if out is not None and isinstance(curve, CurveArrays):
            return curve.evaluate(x, quantity, outside, per_curve, progress, out)
        values = curve.evaluate(x, quantity, outside, per_curve, progress)
        return values if out is None else write_into(out, values, curve.space)

    return call_at_times(curve, time_axis, x, per_curve, outside, call)


def call_at_times(
    curve: AnyCurve,
    time_axis: TimeAxis,
    x: TimesLike,
    per_curve: bool,
    outside: str,
    call: Callable[[Doubles, str, bool], Any],
) -> Any:
    """Call a function of a curve with times as a user passes them.

    Parameters
    ----------
    outside : str
        Extrapolation policy by its name in the core, or ``"nan"``, which this function implements.
    call : callable
        Function of times as the core counts them, a policy of the core, and `per_curve`.
    """
    per_curve = per_curve is not False and checked_flag(per_curve, "per_curve")
    if time_axis.plain and type(x) is float:
        # Single times are frequent, and the general conversion would cost more than the evaluation.
        times, knots = np.array(x), curve.times
        if knots.ndim > 1 or not knots[0] <= x <= knots[-1]:
            times, per_curve = onto_ends(times, knots, curve.batch, per_curve)
    else:
        times, per_curve = time_axis.at(x, curve.batch, per_curve, curve.times)
    beyond = None
    if outside == "nan":
        times, per_curve, beyond = _inside(curve, times, per_curve)
        outside = "raise"
    try:
        values = call(times, outside, per_curve)
    except ValidationError as error:
        raise time_axis.explain(error) from None
    if beyond is not None:
        index = beyond if per_curve else (slice(None),) * len(curve.batch) + (beyond,)
        for own in values if isinstance(values, tuple) else (values,):
            own[index] = np.nan
    return values


def _inside(curve: AnyCurve, times: Doubles, per_curve: bool) -> tuple[Doubles, bool, NDArray[np.bool_] | None]:
    """Replace times outside the knots by the first knot, and return which times these are, if any."""
    first, last = curve.times[..., 0], curve.times[..., -1]
    if curve.times.ndim > 1:
        own = times.shape[len(curve.batch) :] if per_curve else times.shape
        first, last = (end.reshape(curve.batch + (1,) * len(own)) for end in (first, last))
    # Infinite times and NaN remain, and raise.
    beyond = np.asarray(np.isfinite(times) & ((times < first) | (times > last)))
    if not beyond.any():
        return times, per_curve, None
    return np.where(beyond, first, times), per_curve or beyond.ndim > times.ndim, beyond
