"""Curves that are made of other curves: one after the other, or the same path at other times.

They satisfy the protocol `search.Evaluable`, with times as numbers of the core, and have the same factors as the
curves of which they are made.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import as_array, checked_flag, checked_number, short_repr
from .._base.time import TimeAxis, ends_beside, onto_ends, refuse_outside, seconds_of
from .._base.typing import AnyFunction, Progress, TimesLike
from .._core import ValidationError
from .._spaces import AnySpace, Doubles, Product, product_norm
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
_LARGEST = float(np.finfo(np.float64).max)
# Rounding errors of a knot by which its times differ, if they are computed in two ways.
_KNOT_ROUNDING = 16
# Steps of bisection from any interval to neighbouring floating-point numbers near its middle.
_BISECTIONS = 60
# Relative rounding error of a law at the ends of the curve.
_ROUNDING = 1e-9


class AnyCurve(Protocol):
    """Curves of a batch: arrays, control points, or a composition of other curves."""

    @property
    def space(self) -> AnySpace: ...
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
        self.space: AnySpace = sections[0].space
        self.batch = sections[0].batch
        self.quad_rtol = max(section.quad_rtol for section in sections)
        knots = [section.times + offset for section, offset in zip(sections, offsets, strict=True)]
        self.starts, self.stops = (np.array([section[i] for section in knots]) for i in (0, -1))
        self.times = np.unique(np.concatenate(knots))
        self.max_nu = min(section.max_nu for section in sections)

    @property
    def parts(self) -> tuple[Any, ...]:
        """The same curves in each factor of a product."""
        if not isinstance(self.space, Product):
            return (self,)
        return tuple(
            Joined(section, self.offsets) for section in zip(*(section.parts for section in self.sections), strict=True)
        )

    def map(self, function: AnyFunction) -> Joined:
        """Return the curve whose sections are the values of a function of the sections."""
        return Joined([function(section) for section in self.sections], self.offsets)

    def evaluate(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None = None
    ) -> Any:
        """Evaluate a quantity at times x; see `CurveArrays.evaluate`. Only ``"continue"`` gives zero norms in gaps."""
        if outside != "continue":
            refuse_outside(self.times, self.batch, x, per_curve)
        shape = x.shape[len(self.batch) :] if per_curve else x.shape
        flat = x.reshape((*self.batch, math.prod(shape)) if per_curve else math.prod(shape))
        number = np.clip(np.searchsorted(self.starts, flat, side="right") - 1, 0, len(self.starts) - 1)
        gap = (flat < self.starts[number]) | (flat > self.stops[number])
        evaluated_sections = []
        groups = list(_groups(number)) or [(0, np.zeros(0, np.intp))]
        for done, (i, columns) in enumerate(groups):
            values = self._in_section(i, flat[..., columns], quantity, per_curve)
            evaluated_sections.append((number[..., columns] == i, columns, values))
            if progress is not None:
                progress(done + 1, len(groups))
        missing = 0.0 if outside == "continue" and quantity in NORMS else np.nan

        def assembled(*values: Any) -> Any:
            return self._assembled(evaluated_sections, values, gap, missing).reshape(
                (*self.batch, *shape, *values[0].shape[len(self.batch) + 1 :])
            )

        return _by_factor(assembled, [values for *_, values in evaluated_sections])

    def _in_section(self, i: int, x: Doubles, quantity: str, per_curve: bool) -> Any:
        section = self.sections[i]
        times = np.clip(x, self.starts[i], self.stops[i]) - self.offsets[i]
        # The difference can exceed the ends by rounding.
        times = np.ascontiguousarray(np.clip(times, section.times[0], section.times[-1]))
        return section.evaluate(times, quantity, "raise", per_curve)

    def _assembled(
        self, evaluated_sections: list[Any], values: Sequence[Any], gap: NDArray[np.bool_], missing: float
    ) -> Any:
        """Return the values of all sections in one array of shape (*batch, m, ...)."""
        axes, rest = (slice(None),) * len(self.batch), values[0].shape[len(self.batch) + 1 :]
        result = np.full((*self.batch, gap.shape[-1], *rest), np.nan, values[0].dtype)
        for (here, columns, _), of_section in zip(evaluated_sections, values, strict=True):
            kept = here.reshape(here.shape + (1,) * len(rest))
            result[(*axes, columns)] = np.where(kept, of_section, result[(*axes, columns)])
        result[np.broadcast_to(gap, (*self.batch, gap.shape[-1]))] = missing
        return result


def _groups(number: NDArray[np.intp]) -> Iterator[tuple[int, NDArray[np.intp]]]:
    """Yield each section that occurs in an array of shape (..., m), and the columns in which it does.

    The effort is that of sorting: a recording may have as many sections as times.
    """
    flat = number.ravel()
    order = np.argsort(flat, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(flat[order])) + 1):
        if len(group):
            yield int(flat[group[0]]), np.unique(group % number.shape[-1])


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
        self.space: AnySpace = source.space
        self.batch = source.batch
        self.quad_rtol = source.quad_rtol
        self.max_nu = source.max_nu if isinstance(law, Affine) else min(2, source.max_nu)

    @property
    def parts(self) -> tuple[Any, ...]:
        """The same curve in each factor of a product."""
        if not isinstance(self.space, Product):
            return (self,)
        return tuple(Retimed(part, self.law, self.times) for part in self.source.parts)

    def map(self, function: AnyFunction) -> Retimed:
        """Return a function of the source at the same times."""
        return Retimed(function(self.source), self.law, self.times)

    def evaluate(
        self, x: Doubles, quantity: str, outside: str, per_curve: bool, progress: Progress | None = None
    ) -> Any:
        """Evaluate a quantity at times x; see `CurveArrays.evaluate`."""
        if outside != "continue":
            refuse_outside(self.times, self.batch, x, per_curve)
        at = self._source_times(x, per_curve)

        def value(name: str) -> Any:
            return self.source.evaluate(at, name, "raise", per_curve)

        if quantity == "point" or (isinstance(self.law, Affine) and quantity in NORMS):
            result = value(quantity)
        elif isinstance(self.law, Affine) and quantity in _NU:
            # Derivatives of odd order change their sign with the direction.
            sign = self.law.sign ** _NU[quantity]
            result = _by_factor(lambda factor_values: sign * factor_values, [value(quantity)])
        elif quantity == "speed":
            result = np.abs(self.law(x, 1)) * value("speed")
        elif quantity == "bend":
            result = product_norm(tuple(_acceleration_norm(part, x, outside, per_curve) for part in self.parts))
        elif quantity == "motion":
            # The twist, its derivative, and the point; see `CurveArrays.evaluate`.
            dim, motion = self.space.dim, value("motion")
            first, second = (np.asarray(self.law(x, order))[..., None] for order in (1, 2))
            twist, change = motion[..., :dim], motion[..., dim : 2 * dim]
            rates = [first * twist, second * twist + first**2 * change]
            result = np.concatenate([*rates, motion[..., 2 * dim :]], axis=-1)
        else:
            lower = _ORDERS[quantity]
            factors = _chain_rule([self.law(x, order) for order in range(1, len(lower) + 1)])
            before = x.ndim if per_curve else len(self.batch) + x.ndim
            result = _by_factor(
                lambda *factor_values: _weighted(factors, factor_values, before), [value(name) for name in lower]
            )
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


def part_of_times(times: Doubles, start: Any, stop: Any, batch: tuple[int, ...]) -> Doubles:
    """Return the ends of a part of a domain, and the times between them."""
    if np.ndim(start) or np.ndim(stop) or times.ndim > 1:
        start, stop = (np.broadcast_to(end, batch)[..., None] for end in (start, stop))
        return np.concatenate([start, np.clip(times, start, stop), stop], axis=-1)
    return np.concatenate([[start], times[(times > start) & (times < stop)], [stop]])


def _by_factor(function: AnyFunction, values: Sequence[Any]) -> Any:
    """Apply a function of arrays to values that are tuples with one array per factor, or arrays."""
    if isinstance(values[0], tuple):
        return tuple(function(*factor_values) for factor_values in zip(*values, strict=True))
    return function(*values)


def _chain_rule(s: Sequence[Any]) -> tuple[Any, ...]:
    """Return the factors of γ' and ∇γ' in the last derivative of γ∘σ, from the derivatives s of σ."""
    return (s[0],) if len(s) == 1 else (s[1], s[0] ** 2)


def _weighted(factors: Sequence[Any], values: Sequence[Any], before: int) -> Any:
    """Return a sum of vectors with factors, one per time; the vectors have `before` axes before those of a point."""
    total: Any = 0.0
    for factor, vectors in zip(factors, values, strict=True):
        total = total + np.reshape(factor, np.shape(factor) + (1,) * (vectors.ndim - before)) * vectors
    return total


def _acceleration_norm(part: Any, x: Doubles, outside: str, per_curve: bool) -> Any:
    """Return the norm of the acceleration in one factor, NaN where the curve is."""
    points, vectors = (part.evaluate(x, name, outside, per_curve) for name in ("point", "acceleration"))
    space: AnySpace = part.space
    valid = space._where_finite(points) & space._where_finite(vectors)
    norms = np.full(valid.shape, np.nan)
    norms[valid] = space.norm(points[valid], vectors[valid])
    return norms


# ---- time laws, and shifts of knots ----


@dataclass(frozen=True)
class Law:
    """A time law, with values that are counted from an origin."""

    function: AnyFunction
    origin: float

    def __call__(self, x: Any, nu: int = 0, /) -> Any:
        try:
            values = np.asarray(self.function(x, nu), np.float64)
        except TypeError as error:
            raise ValidationError(
                f"law must take times and the order of a derivative, as law(x, nu); it raises: {error}"
            ) from None
        if values.shape != np.shape(x):
            raise ValidationError(f"law returns shape {values.shape} for times of shape {np.shape(x)}")
        return values if nu else values - self.origin


def checked_shift(time_axis: TimeAxis, dt: Any) -> Any:
    """Return the time by which knots move, in a type that can be added to them."""
    if time_axis.dates:
        if isinstance(dt, str):
            dt = np.timedelta64(round(1e9 * seconds_of(dt.removeprefix("-"), "dt")), "ns") * (-1) ** dt.startswith("-")
        if not isinstance(dt, (timedelta, np.timedelta64)) or np.isnat(np.timedelta64(dt)):
            raise ValidationError(
                f"the knots are dates, so dt must be a timedelta64 or a text such as '3h', not {short_repr(dt)}"
            )
        return getattr(dt, "asm8", np.timedelta64(dt))
    if isinstance(dt, np.timedelta64):
        raise ValidationError(f"the times are numbers, so dt must be a finite number, not {short_repr(dt)}")
    # Comparison is exact for integers of any size.
    step = checked_number(dt, "the knots are numbers, so dt must be a finite number", lambda x: abs(x) <= _LARGEST)
    exact = isinstance(dt, (int, np.integer)) and abs(int(dt)) < 2**62
    return int(dt) if exact else step


def check_increasing(times: Doubles) -> None:
    """Raise ValidationError if times coincide after a shift."""
    if not (np.diff(times) > 0).all():
        raise ValidationError("knots coincide after rounding. Use a smaller dt, or dates.")


def domain_of_law(law: object, domain: Any) -> tuple[float, float]:
    """Return the first and last time of a law, from the user or from the attributes that laws of SciPy have."""
    if not callable(law):
        raise ValidationError(f"law must be a function law(x, nu), not {short_repr(law)}")
    if domain is None:
        domain = getattr(law, "domain", None)
    knots = getattr(law, "x", None)
    if domain is None and isinstance(knots, np.ndarray) and knots.ndim == 1:
        domain = knots[[0, -1]]
    if domain is None:
        raise ValidationError("the law has no domain. Pass the first and the last time of the new curve as domain.")
    ends = as_array(domain, "domain")
    if ends.shape != (2,) or ends.dtype.kind not in "iuf" or not np.isfinite(ends).all() or not ends[0] < ends[1]:
        raise ValidationError(f"domain must be two increasing finite numbers, not {short_repr(domain)}")
    return float(ends[0]), float(ends[1])


def smooth_parts(law: Law, start: float, stop: float, knots: Doubles) -> Doubles:
    """Return times between which the retimed curve is smooth: the knots of the law, and where it meets a knot.

    If the law does not increase, knots of the curve are not sought. Integrals then take more evaluations.
    """
    law_knots = np.asarray(getattr(law.function, "x", getattr(law.function, "knots", ())), np.float64).ravel()
    times = np.unique(np.concatenate([[start], law_knots[(law_knots > start) & (law_knots < stop)], [stop]]))
    sampled = np.unique(np.concatenate([times, np.linspace(start, stop, 4 * len(knots) + 1)]))
    values = law(sampled)
    if not (np.diff(values) >= 0).all():
        return times
    inner = knots[(knots > values[0]) & (knots < values[-1])]
    after = np.searchsorted(values, inner)
    low, high = sampled[after - 1], sampled[after]
    for _ in range(_BISECTIONS):
        middle = low / 2 + high / 2
        before = law(middle) < inner
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    # If a knot of the law coincides with a knot of the curve, both are in the list, with different rounding errors.
    after = np.clip(np.searchsorted(times, high), 1, len(times) - 1)
    near = np.where(high - times[after - 1] < times[after] - high, times[after - 1], times[after])
    same_value = np.abs(law(near) - inner) <= _KNOT_ROUNDING * np.spacing(np.abs(knots).max())
    same_time = np.abs(near - high) <= _KNOT_ROUNDING * np.spacing(np.abs(times).max())
    return np.unique(np.concatenate([times, high[~(same_value | same_time)]]))


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
        first, last = ends_beside(curve.times, times, curve.batch, per_curve)
        # Infinite times and NaN remain, and raise.
        beyond = np.asarray(np.isfinite(times) & ((times < first) | (times > last)))
        if beyond.any():
            times, per_curve = np.where(beyond, first, times), per_curve or beyond.ndim > times.ndim
        outside = "raise"
    try:
        values = call(times, outside, per_curve)
    except ValidationError as error:
        raise time_axis.explain(error) from None
    if beyond is not None and beyond.any():
        index = beyond if per_curve else (slice(None),) * len(curve.batch) + (beyond,)
        for array in values if isinstance(values, tuple) else (values,):
            array[index] = np.nan
    return values
