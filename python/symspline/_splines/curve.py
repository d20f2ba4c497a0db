"""The base class of all curves, with parts, copies in other times, and curves one after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from typing import Any, Generic

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import as_array, checked_number, short_repr
from .._base.durations import seconds_of
from .._base.time import TimeAxis
from .._base.typing import P, TimesLike
from .._core import ValidationError
from .._curves.composed import Affine, TimeMap, part_of_times
from .._curves.options import order_of
from .._spaces import Doubles, factors_of, parts_of
from . import archive
from .curve_plots import CurvePlots

_LARGEST = float(np.finfo(np.float64).max)
# Largest distance between the points at which two curves meet, relative to large coordinates.
_MEETING = 1e-8
# Times at which the values of a law are compared with the domain of the curve.
_SAMPLES = 1001
# Rounding errors of a knot by which its times differ, if they are computed in two ways.
_KNOT_ROUNDING = 16
# Steps of bisection from any interval to neighbouring floating-point numbers near its middle.
_BISECTIONS = 60


@dataclass(frozen=True)
class Derivative(Generic[P]):
    """A derivative of a curve, as a function of time.

    `Curve.derivative` returns objects of this class.

    Attributes
    ----------
    curve : Curve
        The curve.
    nu : int
        Order of the derivative.

    Examples
    --------
    >>> import symspline as ss
    >>> velocity = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1").derivative()
    >>> velocity([0.0, 2.0])[:, 0]
    array([ 1.5, -1.5])
    """

    curve: Curve[P]
    nu: int

    def __call__(self, x: TimesLike, nu: int = 0, **options: Any) -> P:
        """Evaluate the derivative, or a further derivative of it.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, as in a call of the curve.
        nu : int, default 0
            Order of the further derivative.
        **options
            Keyword arguments of a call of the curve.

        Returns
        -------
        ndarray or tuple of ndarray
            Tangent vectors, shape ``(*batch axes, *x.shape, *point_shape)``.
        """
        most = self.curve._curve.max_nu - self.nu
        order = order_of(nu, most) if most else order_of(nu, 0)
        at: Any = x
        values: P = self.curve(at, self.nu + order, **options)
        return values

    def derivative(self, nu: int = 1) -> Derivative[P]:
        """Return a further derivative.

        Parameters
        ----------
        nu : int, default 1
            Order of the further derivative.

        Returns
        -------
        Derivative
            The derivative of the curve of order ``self.nu + nu``.

        Examples
        --------
        >>> import symspline as ss
        >>> curve = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1")
        >>> curve.derivative().derivative()(1.0)
        array([-3.])
        """
        return self.curve.derivative(self.nu + order_of(nu, 3))


class Curve(CurvePlots[P]):
    """A curve on a space, or a batch of curves.

    This is the base class of `CubicSpline`, `HermiteSpline`, `PiecewiseGeodesic`, `SmoothingSpline`, `BSpline`,
    `BezierCurve` and `CumulativeBSpline`. Call a curve to evaluate it or its derivatives. A batch is a sequence of
    curves.

    Examples
    --------
    >>> import symspline as ss
    >>> points = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> curves = ss.CubicSpline(None, points, "sphere:2"), ss.BezierCurve(points, "sphere:2")
    >>> [isinstance(curve, ss.Curve) for curve in curves]
    [True, True]
    >>> [curve.length().round(4).item() for curve in curves]
    [3.2601, 2.4139]
    """

    def restrict(self, a: TimesLike | None = None, b: TimesLike | None = None) -> Curve[P]:
        """Return the part of the curve between two times.

        Parameters
        ----------
        a, b : float or datetime64, optional
            Start and end of the part. By default, the start and the end of the curve.

        Returns
        -------
        Curve
            A curve with the domain from a to b. A curve of cubic segments that is cut at its knots gives a
            `HermiteSpline`, a `PiecewiseGeodesic` one of the same class, and a `SegmentedCurve` one with fewer
            segments. All other curves give a `RetimedCurve`.

        Raises
        ------
        ValidationError
            If a time is not in the domain of the curve, or b is not after a.

        See Also
        --------
        Curve.concatenate : Join two curves.

        Notes
        -----
        The part is exact. On a curved space part of a segment is in general not a cubic Bézier curve. Between knots,
        the result therefore refers to the whole curve.

        Examples
        --------
        >>> import symspline as ss
        >>> spline = ss.CubicSpline(None, [[0.0], [1.0], [0.0], [2.0]], "r:1")
        >>> spline.restrict(1, 3)
        <HermiteSpline on Euclidean(1): 3 points, from 1 to 3>
        >>> part = spline.restrict(0.5, 2.5)
        >>> part.domain, bool(part(1.5) == spline(1.5))
        ((np.float64(0.5), np.float64(2.5)), True)
        """
        return self._restricted(*self._part_ends(a, b))

    def concatenate(self, other: Curve[P]) -> Curve[P]:
        """Return this curve followed by another one.

        Parameters
        ----------
        other : Curve
            A curve on the same space that begins at the time and the point at which this curve ends.

        Returns
        -------
        Curve
            A `HermiteSpline` if both curves consist of cubic segments and their velocities agree where they meet, and
            a `SegmentedCurve` otherwise. At the common time, derivatives are those of the second curve.

        Raises
        ------
        ValidationError
            If the curves are on different spaces, or do not meet.

        See Also
        --------
        Curve.shift : Move a curve in time.
        SegmentedCurve : Join curves with gaps between them.

        Notes
        -----
        Both curves remain as they are. The velocity of the result jumps if their velocities differ where they meet.

        Examples
        --------
        >>> import symspline as ss
        >>> spline = ss.CubicSpline(None, [[0.0], [1.0], [0.0], [2.0]], "r:1")
        >>> spline.restrict(0, 1).concatenate(spline.restrict(1, 3))
        <HermiteSpline on Euclidean(1): 4 points, from 0 to 3>
        """
        if not isinstance(other, Curve):
            raise TypeError(f"other must be a curve, not {short_repr(other)}")
        _check_meeting(self, other)
        merged = self._merged(other)
        if merged is not None:
            return merged
        # Without nesting, the depth of curves that are joined in a loop does not grow.
        found: Curve[P] = archive.FORMATS["symspline-segments"]([*self._in_segments(), *other._in_segments()])
        return found

    def reverse(self) -> Curve[P]:
        """Return the curve in the opposite direction, over the same domain.

        Returns
        -------
        Curve
            A curve whose point at time x is that of this curve at time ``a + b - x``, where a and b are the ends of the
            domain. A curve of cubic segments gives a `HermiteSpline`, a `PiecewiseGeodesic` one of the same class, and
            all other curves a `RetimedCurve`.

        Notes
        -----
        The result is exact, and its covariant acceleration is continuous where that of the curve is.

        Examples
        --------
        >>> import symspline as ss
        >>> spline = ss.CubicSpline([0, 1, 4], [[0.0], [1.0], [0.0]], "r:1")
        >>> spline.reverse()(3.0)
        array([1.])
        """
        return self._reversed()

    def shift(self, dt: float | str | timedelta | np.timedelta64) -> Curve[P]:
        """Return the curve at times that are later by a constant.

        Parameters
        ----------
        dt : float, str or timedelta64
            Time by which the curve moves. If its times are dates, a ``timedelta``, a ``timedelta64`` or a text such as
            ``"3h"``, otherwise a number. Negative values move the curve to earlier times.

        Returns
        -------
        Curve
            A curve whose point at time ``x + dt`` is that of this curve at time x. A curve of cubic segments gives a
            `HermiteSpline`, a `PiecewiseGeodesic` and a `SegmentedCurve` one of the same class, and all other curves a
            `RetimedCurve`.

        Raises
        ------
        ValidationError
            If `dt` is invalid, or so large that times coincide after rounding.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.CubicSpline([0, 1, 4], [[0.0], [1.0], [0.0]], "r:1").shift(10).domain
        (np.float64(10.0), np.float64(14.0))
        """
        return self._shifted(_checked_shift(self._time_axis, dt))

    def retime(self, law: Callable[..., Any], *, domain: ArrayLike | None = None) -> Curve[P]:
        r"""Return the same path with another time law.

        Parameters
        ----------
        law : callable
            Function σ that takes a time x of the new curve, and as second argument the order of a derivative. It
            returns a time of this curve: seconds since its start if its times are dates. Pass a result of `time_law`,
            or a SciPy spline such as ``PchipInterpolator``.
        domain : array_like, shape (2,), optional
            First and last time of the new curve. By default, the domain of the law.

        Returns
        -------
        RetimedCurve
            The curve :math:`x \mapsto \gamma(\sigma(x))`. Its times are numbers.

        Raises
        ------
        ValidationError
            If the law is invalid, or returns a time outside the domain of this curve.

        See Also
        --------
        time_law : Compute the fastest law within limits of speed and acceleration.

        Notes
        -----
        By the chain rule the velocity is :math:`\sigma' \gamma'`, and the covariant acceleration is
        :math:`\sigma'^2 \nabla_{\gamma'}\gamma' + \sigma'' \gamma'`.

        Examples
        --------
        Traverse a curve with a smooth start and a smooth end:

        >>> import symspline as ss
        >>> from scipy.interpolate import CubicHermiteSpline
        >>> curve = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], "sphere:2")
        >>> slow = curve.retime(CubicHermiteSpline([0, 4], [0, 1], [0, 0]))
        >>> slow.speed([0.0, 2.0, 4.0]).round(4)
        array([0.   , 0.589, 0.   ])
        """
        if self._curve.times.ndim > 1:
            raise ValidationError(
                "retime needs curves that share their times. Retime the curves of the batch one by one."
            )
        start, stop = _law_domain(law, domain)
        origin = 0.0 if self._time_axis.plain or self._time_axis.dates else float(self._time_axis.origin)
        shifted = _Law(law, origin)
        times = _smooth_parts(shifted, start, stop, self._curve.times)
        curve: Curve[P] = _retimed(self, TimeAxis(), shifted, times)
        # The values of the law must be in the domain, also between its knots.
        curve(np.concatenate([times, np.linspace(start, stop, _SAMPLES)]))
        return curve

    def derivative(self, nu: int = 1) -> Derivative[P]:
        """Return a derivative of the curve as a function of time.

        Parameters
        ----------
        nu : int, default 1
            Order of the derivative, at most 3 (2 for B-spline and Bézier curves, and for general time laws).

        Returns
        -------
        Derivative
            Function of x that returns ``curve(x, nu)``.

        Examples
        --------
        >>> import symspline as ss
        >>> curve = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1")
        >>> acceleration = curve.derivative(2)
        >>> acceleration([0.5, 1.0])[:, 0]
        array([-1.5, -3. ])
        """
        return Derivative(self, order_of(nu, self._curve.max_nu))

    # ---- hooks that classes of curves override ----

    def _restricted(self, start: Doubles, stop: Doubles) -> Curve[P]:
        """Return the part between two times of the core, one per curve if each curve has its own times."""
        times = part_of_times(self._curve.times, start, stop, self._batch)
        curve: Curve[P] = _retimed(self, self._time_axis, Affine(), times)
        return curve

    def _reversed(self) -> Curve[P]:
        times = self._curve.times
        law = Affine(-1, times[..., 0] + times[..., -1])
        mirrored = np.clip(np.asarray(law(times))[..., ::-1], times[..., :1], times[..., -1:])
        curve: Curve[P] = _retimed(self, self._time_axis, law, np.ascontiguousarray(mirrored))
        return curve

    def _shifted(self, step: Any) -> Curve[P]:
        time_axis, times, law = self._time_axis, self._curve.times, Affine()
        if time_axis.plain:
            times, law = times + step, Affine(1, -float(step))
            check_increasing(times)
        else:
            time_axis = replace(time_axis, origin=time_axis.origin + step)
        curve: Curve[P] = _retimed(self, time_axis, law, times)
        return curve

    def _part_ends(self, a: TimesLike | None, b: TimesLike | None) -> tuple[Doubles, Doubles]:
        """Return the ends of a part as numbers of the core, one per curve if each curve has its own times."""
        ends = []
        for number, (x, name) in enumerate([(a, "a"), (b, "b")]):
            own_axes = self._domain_ends[number]
            time, own = own_axes if x is None else self._core_times(x, name)
            if time.ndim > len(self._batch) * own:
                raise ValidationError(f"{name} must be a single time, not an array of shape {time.shape}")
            ends.append(time)
        start, stop = ends
        if not (start < stop).all():
            raise ValidationError("b must be after a. Exchange a and b, or omit one of them.")
        return start, stop

    def _in_segments(self) -> Sequence[Curve[P]]:
        """Return the segments of which the curve consists."""
        return [self]

    def _merged(self, other: Curve[P]) -> Curve[P] | None:
        """Return this curve and another one as one curve of cubic segments, or None if this is not possible."""
        return None


@dataclass(frozen=True)
class _Law:
    """A time law, with values that are counted from an origin."""

    function: Callable[..., Any]
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


def _checked_shift(time_axis: TimeAxis, dt: Any) -> Any:
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


def _retimed(source: Curve[Any], time_axis: TimeAxis, law: TimeMap, times: Doubles) -> Any:
    return archive.FORMATS["symspline-retimed"]._of(source, time_axis, law, times)


def _law_domain(law: Any, domain: Any) -> tuple[float, float]:
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


def _smooth_parts(law: _Law, start: float, stop: float, knots: Doubles) -> Doubles:
    """Return times between which the retimed curve is smooth: the knots of the law, and where it meets a knot.

    If the law does not increase, knots of the curve are not sought. Integrals then take more evaluations.
    """
    own = np.asarray(getattr(law.function, "x", getattr(law.function, "knots", ())), np.float64).ravel()
    times = np.unique(np.concatenate([[start], own[(own > start) & (own < stop)], [stop]]))
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


def _check_meeting(first: Curve[Any], second: Curve[Any]) -> None:
    """Raise ValidationError unless the second curve begins at the time and the point at which the first ends."""
    if first.space != second.space:
        raise ValidationError(f"other is on {second.space!r}, but the curve is on {first.space!r}")
    if first._batch != second._batch:
        raise ValidationError(f"other has batch axes {second._batch}, but the curve has {first._batch}")
    if first._curve.times.ndim > 1 or second._curve.times.ndim > 1:
        raise ValidationError("curves of a batch must share their times. Concatenate them one by one.")
    stop: Any = first.domain[1]
    start: Any = second.domain[0]
    try:
        apart = abs((start - stop) / (np.timedelta64(1, "s") if first._time_axis.dates else 1))
        size = 0.0 if first._time_axis.dates else max(abs(start), abs(stop))
    except TypeError:
        raise ValidationError(
            f"other begins at {start}, but the curve ends at {stop}. Use numbers for both, or dates for both."
        ) from None
    if apart > 4 * np.spacing(size):
        raise ValidationError(
            f"other begins at {start}, but the curve ends at {stop}. Move it by other.shift(dt), or pass both curves "
            "to SegmentedCurve, which allows a gap."
        )
    for space, p, q in zip(
        factors_of(first.space),
        parts_of(first(stop), first.space, "points"),
        parts_of(second(start), second.space, "points"),
        strict=True,
    ):
        p, q = (np.reshape(own, (-1, *space.point_shape)) for own in (p, q))
        valid = space._where_finite(p) & space._where_finite(q)
        close = np.abs(p - q)[valid] <= _MEETING * np.maximum(1.0, np.abs(p)[valid])
        # Different arrays can represent one point of a quotient space.
        if not close.all() and not (space.distance(p[valid], q[valid]) <= _MEETING).all():
            raise ValidationError(
                f"other begins at {short_repr(q[0])}, but the curve ends at {short_repr(p[0])}. Both must be one point."
            )
