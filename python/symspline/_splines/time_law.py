"""Time laws of paths: the fastest traversal under limits of speed and acceleration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._base.arrays import as_array, cast, checked_number, read_only, refuse, same_fields, short_repr, whole_number
from .._base.typing import Array, FloatArray, Number
from .._core import ValidationError
from .._curves.options import order_of
from .._spaces import Doubles, factors_of, parts_of, product_norm
from .base import Curve, UserCurve

# Velocities before and after a knot that differ by more than this part jump.
_JUMP = 1e-6
# Part of the largest norm along the path below which a norm is a rounding error.
_ZERO = 1e-12
# Times outside the domain by this part of the duration are rounding errors.
_ROUNDING = 1e-12
# Intervals next to a rest, each half as long as the next.
_HALVINGS = 14
# Limits between this and its inverse are valid.
_LEAST_LIMIT = 1e-100


@dataclass(frozen=True, eq=False, repr=False)
class TimeLaw:
    """Times of a curve as a function of the time of a traversal.

    `time_law` returns objects of this class. The function is increasing and continuously differentiable, and its second
    derivative is constant between the knots.

    Attributes
    ----------
    knots : ndarray, shape (n,)
        Times of the traversal at the points of the grid, in seconds if the curve has dates; the first is zero.
    values : ndarray, shape (n,)
        Times of the curve at the knots, in seconds since its first knot if they are dates.
    rates : ndarray, shape (n,)
        First derivatives at the knots.
    max_speed, max_acceleration : tuple of float
        Limits in each factor of the space; infinite without a limit.

    See Also
    --------
    time_law : Compute the fastest traversal of a path.

    Examples
    --------
    >>> import symspline as ss
    >>> path = ss.CubicSpline(None, [[0.0], [1.0]], "r:1")
    >>> law = ss.time_law(path, max_acceleration=4.0)
    >>> law
    <TimeLaw: duration 1.0>
    >>> law([0.0, 0.5, 1.0]).round(6)
    array([0. , 0.5, 1. ])
    """

    knots: FloatArray
    values: FloatArray
    rates: FloatArray
    max_speed: tuple[float, ...]
    max_acceleration: tuple[float, ...]

    def __eq__(self, other: object) -> bool:
        """Whether both have equal arrays."""
        return same_fields(self, other) if isinstance(other, TimeLaw) else NotImplemented

    @property
    def duration(self) -> float:
        """Time of the whole traversal."""
        return float(self.knots[-1])

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time of the traversal, zero and the duration."""
        return 0.0, self.duration

    def __call__(self, x: ArrayLike, nu: int = 0) -> Number:
        """Evaluate the time of the curve, or its derivatives.

        Parameters
        ----------
        x : array_like
            Times of the traversal, from zero to the duration, of any shape.
        nu : {0, 1, 2}, default 0
            Order of the derivative.

        Returns
        -------
        ndarray or float, shape x.shape
            Times of the curve, in seconds since its first knot if they are dates, or their derivatives. The second
            derivative at a knot is that after it.

        Raises
        ------
        ValidationError
            If a time is outside the domain.
        """
        order = order_of(nu)
        array = as_array(x, "x")
        if array.dtype.kind not in "biuf":
            raise ValidationError(f"x must be real numbers, not {array.dtype}")
        times, last = cast(array), self.duration
        slack = _ROUNDING * last
        refuse(
            ~((times >= -slack) & (times <= last + slack)),
            "x",
            lambda i: f"= {times[i]} is outside the domain [0, {last}] of the time law",
        )
        times = np.clip(times, 0.0, last)
        k = np.clip(np.searchsorted(self.knots, times, "right") - 1, 0, len(self.knots) - 2)
        ahead, rate = times - self.knots[k], self.rates[k]
        second = (np.diff(self.rates) / np.diff(self.knots))[k]
        steps = ahead * (rate + ahead * second / 2)
        values = np.clip(self.values[k] + steps, self.values[k], self.values[k + 1])
        result: Number = (values, rate + second * ahead, second)[order][()]
        return result

    def __repr__(self) -> str:
        return f"<TimeLaw: duration {self.duration:.6}>"


def time_law(
    curve: UserCurve,
    *,
    max_acceleration: float | tuple[float | None, ...],
    max_speed: float | tuple[float | None, ...] | None = None,
    initial_speed: float = 0.0,
    final_speed: float = 0.0,
    grid_size: int = 1000,
) -> TimeLaw:
    r"""Compute the fastest traversal of a path under limits of speed and acceleration.

    The points of the curve stay the same; the times at which they are reached change.

    Parameters
    ----------
    curve : Curve
        The path, one curve.
    max_acceleration : float or tuple
        Largest norm of the covariant acceleration. For a `Product`, a tuple with one limit per factor, in which None
        means no limit.
    max_speed : float or tuple, optional
        Largest norm of the velocity, likewise. By default there is no limit.
    initial_speed, final_speed : float, default 0.0
        Norm of the velocity at the start and at the end. In a product, the norm over all factors.
    grid_size : int, default 1000
        Number of intervals of the grid on the path. It is increased to at least four per segment of the curve.

    Returns
    -------
    TimeLaw
        The times of the curve as a function of the time of the traversal.

    Raises
    ------
    ValidationError
        If an argument is invalid, if the curve does not move during an interval or does not have a positive limit in
        each moving factor, or if a speed at an end cannot be reached within the limits.

    See Also
    --------
    Curve.retime : Return the curve of the traversal.
    Curve.at_length : Compute times of equal distances along a curve, for a traversal at constant speed.

    Notes
    -----
    Let :math:`x` be the time of the curve :math:`\gamma`. The traversal has the velocity :math:`\gamma' \dot x` and the
    acceleration :math:`\nabla\gamma' \, u + \gamma' \ddot x`, where :math:`u = \dot x^2` and
    :math:`\ddot x = \tfrac12 du/dx`; for the arc length these are the formulas
    :math:`\lVert a\rVert^2 = \ddot s^2 + \kappa^2 \dot s^4`. On a grid that contains the knots, :math:`u` is piecewise
    linear. The limits are imposed at both ends of each interval, where the acceleration may differ on the two sides. A
    backward pass computes the largest :math:`u` from which the end can be reached, and a forward pass accelerates as
    much as the limits allow, as in TOPP-RA [1]_. Between the points of the grid, limits are exceeded by terms of
    second order in the steps, usually less than 0.1 %. Increase `grid_size` if the curvature changes within few
    intervals.

    Where the velocity jumps, as at the knots of a `PiecewiseGeodesic`, the traversal comes to rest. A curve whose
    velocity vanishes at single times, such as an end with zero velocity, is accepted.

    References
    ----------
    .. [1] H. Pham, Q.-C. Pham, A New Approach to Time-Optimal Path Parameterization Based on Reachability Analysis,
           IEEE Trans. Robot. 34 (2018).

    Examples
    --------
    A turn of a camera by 180° with limits in rad/s and rad/s²:

    >>> import numpy as np
    >>> import symspline as ss
    >>> path = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0], [-1, 0, 0]], "sphere:2")
    >>> law = ss.time_law(path, max_speed=1.0, max_acceleration=0.5)
    >>> round(law.duration, 2), round(np.pi / 1.0 + 1.0 / 0.5, 2)
    (5.14, 5.14)
    >>> x = law(1.0)
    >>> round(float(path.speed(x) * law(1.0, nu=1)), 3)
    0.5
    """
    if not isinstance(curve, Curve):
        raise ValidationError(f"curve must be a curve of symspline, not {short_repr(curve)}")
    if curve._curve.batch:
        raise ValidationError("curve is a batch, but a time law belongs to one curve. Pass one of them, as curve[0].")
    count = len(factors_of(curve.space))
    speeds, accelerations = (
        _limits(value, count, name)
        for value, name in ((max_speed, "max_speed"), (max_acceleration, "max_acceleration"))
    )
    ends = [
        checked_number(value, f"{name} must be a number that is not negative", lambda x: x >= 0)
        for value, name in ((initial_speed, "initial_speed"), (final_speed, "final_speed"))
    ]
    path = _sampled(curve, whole_number(grid_size, "grid_size", 4))
    problem = _problem(path, np.array(speeds), np.array(accelerations), (ends[0], ends[1]))
    rates = np.sqrt(_fastest(problem))
    steps = 2 * np.diff(path.x) / (rates[:-1] + rates[1:])
    if not (np.isfinite(steps).all() and (steps > 0).all()):
        where = int(np.flatnonzero(~(np.isfinite(steps) & (steps > 0)))[0])
        raise ValidationError(
            f"curve has no fastest traversal between its times {path.x[where]} and {path.x[where + 1]}: increase "
            "grid_size or the limits"
        )
    knots = np.concatenate([[0.0], np.cumsum(steps)])
    values = path.x if curve._time_axis.dates else curve._shown_times(path.x)
    return TimeLaw(read_only(knots), read_only(values), read_only(rates), speeds, accelerations)


def _limits(value: object, count: int, name: str) -> tuple[float, ...]:
    """Return one limit per factor."""
    if isinstance(value, np.ndarray) and value.ndim == 1:
        value = tuple(value)
    values = (value,) * count if value is None else value if isinstance(value, (tuple, list)) else (value,)
    if len(values) != count:
        raise ValidationError(
            f"{name} must be a tuple with {count} limits, one per factor of the space; got {len(values)}: "
            f"{short_repr(value)}"
            if count > 1
            else f"{name} must be one number, not {len(values)}. For a limit per joint, use a product with one factor "
            "per joint, such as 'torus:1 x torus:1'."
        )
    if name == "max_acceleration" and all(one is None for one in values):
        raise ValidationError("max_acceleration is needed: without it, the traversal would start with a jump")
    # Squares of limits must be floating-point numbers.
    requirement = f"{name} must be a positive number between {_LEAST_LIMIT} and {1 / _LEAST_LIMIT}"
    requirement += ", or None, in each factor" if count > 1 else ""
    valid = lambda x: _LEAST_LIMIT <= x <= 1 / _LEAST_LIMIT  # noqa: E731
    return tuple(math.inf if one is None else checked_number(one, requirement, valid) for one in values)


class _Path(NamedTuple):
    """A path on a grid. The last axis of arrays is that of the factors.

    Attributes
    ----------
    x : ndarray, shape (n,)
        Grid.
    p, q, r : ndarray, shape (2, n - 1, factors)
        |∇γ'|², ⟨∇γ', γ'⟩ and |γ'|² at the starts and at the ends of the intervals.
    rests : ndarray of bool, shape (n,)
        Where the velocity jumps, so that the traversal rests.
    """

    x: Doubles
    p: Doubles
    q: Doubles
    r: Doubles
    rests: Array

    @property
    def squares(self) -> Doubles:
        """Largest |γ'|² at the grid on either side, shape (n, factors)."""
        after, before = np.append(self.r[0], self.r[1, -1:], axis=0), np.append(self.r[0, :1], self.r[1], axis=0)
        return np.asarray(np.maximum(after, before))


def _sampled(curve: UserCurve, size: int) -> _Path:
    knots = curve._curve.times
    parts_per_interval = max(4, math.ceil(size / (len(knots) - 1)))
    jumping = _jumps(curve, knots)
    x = _graded(knots, parts_per_interval, np.concatenate([[True], jumping, [True]]))
    rests = np.isin(x, knots[1:-1][jumping])
    # Derivatives can jump at knots. Those of an interval are evaluated after its start and before its end.
    times = np.ascontiguousarray(np.stack([x[:-1], x[1:] - 1e-9 * np.diff(x)]))
    parts = [_values(curve, times, quantity) for quantity in ("point", "velocity", "acceleration")]
    p, q, r = [], [], []
    for space, points, v, a in zip(factors_of(curve.space), *parts, strict=True):
        p.append(space.inner(points, a, a))
        q.append(space.inner(points, a, v))
        r.append(space.inner(points, v, v))
    moving = np.sqrt(np.sum(r, axis=0))
    still = ~(moving > _ZERO * moving.max()).any(axis=0)
    if still.any():
        where = int(np.flatnonzero(still)[0])
        raise ValidationError(
            f"curve does not move between its times {x[where]} and {x[where + 1]}. Remove repeated points: a traversal "
            "of a path does not rest."
        )
    return _Path(x, np.stack(p, axis=-1), np.stack(q, axis=-1), np.stack(r, axis=-1), rests)


def _values(curve: UserCurve, x: Doubles, quantity: str) -> tuple[Array, ...]:
    """Evaluate the curve in each factor."""
    values = parts_of(curve._curve.evaluate(x, quantity, "continue", False), curve.space, quantity)
    if not all(np.isfinite(array).all() for array in values):
        raise ValidationError("curve is not finite in its whole domain. Pass one segment of a recording with gaps.")
    return values


def _graded(knots: Doubles, count: int, rests: Array) -> Doubles:
    """Divide every segment into `each` intervals, with shorter ones next to knots at which the traversal rests."""
    x = np.append((knots[:-1, None] + np.diff(knots)[:, None] * np.arange(count) / count).ravel(), knots[-1])
    step, at = np.diff(knots) / count, np.flatnonzero(rests)
    parts = 0.5 ** np.arange(1, _HALVINGS + 1)
    after = (knots[at[:-1], None] + step[at[:-1], None] * parts).ravel()
    before = (knots[at[1:], None] - step[at[1:] - 1, None] * parts).ravel()
    return np.unique(np.concatenate([x, after, before]))


def _jumps(curve: UserCurve, knots: Doubles) -> Array:
    """Return the inner knots at which the velocity jumps."""
    times = np.ascontiguousarray(np.stack([knots[1:-1] - 1e-9 * np.diff(knots)[:-1], knots[1:-1]]))
    jumps, sizes = [], []
    for space, p, v in zip(
        factors_of(curve.space), _values(curve, times, "point"), _values(curve, times, "velocity"), strict=True
    ):
        # Representatives of points may differ on both sides of a knot.
        moved = np.asarray(space.transport(p[0], p[1], v[0]))
        jumps.append(space.norm(p[1], v[1] - moved))
        sizes.append(space.norm(p[0], v[0]))
    size = product_norm(tuple(sizes))
    return np.asarray(product_norm(tuple(jumps)) > _JUMP * size + 1e-9 * size.max(initial=0.0))


class _Problem(NamedTuple):
    """Limits on a grid, for the core.

    Attributes
    ----------
    h : ndarray, shape (n - 1,)
        Steps of the grid.
    most : ndarray, shape (n,)
        Largest u at the grid.
    forms : tuple of ndarray, each of shape (2, n - 1, factors)
        p, q and r of the path in the factors with a limit of the acceleration.
    limits : ndarray, shape (factors,)
        Squares of these limits.
    ends : tuple
        Values of u at both ends; None where γ' vanishes, so that all values of u are a rest.
    """

    h: Doubles
    most: Doubles
    forms: tuple[Doubles, Doubles, Doubles]
    limits: Doubles
    ends: tuple[float | None, float | None]


def _problem(path: _Path, speeds: Doubles, accelerations: Doubles, wanted: tuple[float, float]) -> _Problem:
    limited = np.isfinite(accelerations)
    p, q, r = (np.ascontiguousarray(coefficients[..., limited]) for coefficients in (path.p, path.q, path.r))
    limits, squares = accelerations[limited] ** 2, path.squares
    with np.errstate(all="ignore"):
        # The largest u with any a, from the determinant of the quadratic form.
        form = p * r - q * q
        turning = np.min(np.where(form > 0, np.sqrt(limits * r / form), np.inf), axis=-1)
        most = np.min(np.where(squares > 0, speeds**2 / squares, np.inf), axis=-1)
        most = np.minimum(most, np.minimum(np.append(turning[0], np.inf), np.append(np.inf, turning[1])))
    most[path.rests] = 0.0
    total = np.sqrt(squares.sum(axis=-1))
    ends = tuple(
        _end(most, total, end, speed, name)
        for end, speed, name in ((0, wanted[0], "initial_speed"), (-1, wanted[1], "final_speed"))
    )
    return _Problem(np.diff(path.x), most, (p, q, r), limits, (ends[0], ends[1]))


def _end(most: Doubles, total: Doubles, end: int, speed: float, name: str) -> float | None:
    """Return u at an end with the given speed, and limit the largest u there."""
    if total[end] <= 1e-9 * total.max():
        if speed > 0:
            raise ValidationError(
                f"{name} = {speed} cannot be reached where the velocity of the curve is zero. Pass 0."
            )
        # There is no bound for u from the end alone.
        most[end] = min(most[end], 4 * most[1 if end == 0 else -2])
        return None
    u = float(speed / total[end]) ** 2
    if u > most[end] * (1 + 1e-9):
        raise ValidationError(f"{name} = {speed} exceeds the limits at this end. Reduce it.")
    most[end] = u
    return u


def _fastest(problem: _Problem) -> Doubles:
    """Return u at the grid, with the largest acceleration at any time that allows the end to be reached."""
    start, end = problem.ends
    largest, u = _core.time_law(problem.h, problem.most, problem.forms, problem.limits, start)
    if start is not None and start > largest * (1 + 1e-9):
        raise ValidationError("initial_speed is too high: the curve cannot be followed within the limits. Reduce it.")
    if end is not None and u[-1] < end * (1 - 1e-9):
        raise ValidationError("final_speed cannot be reached on this path within the limits. Reduce it.")
    return u
