"""The base class of all curves: evaluation, lengths, batches, parts, searches, plots and files."""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from base64 import b64encode
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from functools import cached_property
from html import escape
from importlib.util import find_spec
from io import BytesIO
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, Self, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from .._base.arrays import as_array, cast, checked_flag, checked_number, in_single, is_single, refuse, short_repr
from .._base.time import TimeAxis, refuse_outside
from .._base.typing import (
    AnyArrays,
    AnyFunction,
    Array,
    AxesLook,
    BCType,
    Extrapolate,
    File,
    FloatArray,
    Number,
    Out,
    P,
    PageLook,
    Progress,
    State,
    Time,
    TimesLike,
)
from .._core import ValidationError
from .._curves.composed import (
    Affine,
    AnyCurve,
    Law,
    Retimed,
    TimeMap,
    check_increasing,
    checked_shift,
    domain_of_law,
    evaluated,
    part_of_times,
    smooth_parts,
)
from .._curves.curve import ControlledCurve, SidePanel, UncertaintyBand
from .._curves.options import (
    EvaluationOptions,
    check_progress,
    checked_extrapolate,
    extrapolation_mode,
    order_of,
    quantity_of,
    require_matplotlib,
)
from .._curves.search import (
    ArcLength,
    ClosestPoints,
    bending_energy,
    checked_values,
    crossings,
    extrema,
    length,
    rounding_noise,
)
from .._spaces import AnySpace, Doubles, Space, factors_of, parts_of
from ..manifolds import Manifold
from . import archive

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    Color = str | tuple[float, ...]

# Relative rounding error of an arc length that a user computed.
_ROUNDING = 1e-12
# Largest distance between the points at which two curves meet, relative to large coordinates.
_MEETING = 1e-8
# Times at which the values of a law are compared with the domain of the curve.
_SAMPLES = 1001
# Resolution of pictures in notebooks, in dots per inch.
_DOTS = 60
# Names of quantities in the core.
_QUANTITIES = {"speed": "speed", "acceleration": "bend"}


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


class Curve(ABC, Generic[P]):
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

    # Name of the format in files and pickles.
    _format: ClassVar[str]
    # Title of plots.
    _kind: ClassVar[str] = "Curve"
    _curve: AnyCurve
    _time_axis: TimeAxis = TimeAxis()
    _extrapolate: Extrapolate = None
    # Extrapolation policy, by its name in the core.
    _extrapolation_mode: str = "raise"
    # End conditions, which determine whether curves are closed.
    _bc_type: BCType = "natural"

    def __init_subclass__(cls) -> None:
        if "_format" in vars(cls):
            archive.FORMATS[cls._format] = cls

    @property
    def space(self) -> Space[P]:
        """Space of the curve."""
        return self._curve.space

    @property
    def domain(self) -> tuple[Time, Time]:
        """First and last time. They are arrays with the batch axes if every curve has its own times."""
        first, last = (self._shown_times(time)[()] for time, _ in self._part_times(None, None))
        return first, last

    @property
    def extrapolate(self) -> Extrapolate:
        """Extrapolation policy, as passed to the constructor."""
        return self._extrapolate

    # ---- evaluation ----

    @overload
    def __call__(
        self, x: TimesLike, nu: int = 0, *, dtype: None = None, out: None = None, **options: Unpack[EvaluationOptions]
    ) -> P: ...
    @overload
    def __call__(self, x: TimesLike, nu: int = 0, *, out: Out, **options: Unpack[EvaluationOptions]) -> Out: ...
    @overload
    def __call__(
        self: Curve[AnyArrays], x: TimesLike, nu: int = 0, *, dtype: DTypeLike, **options: Unpack[EvaluationOptions]
    ) -> AnyArrays: ...
    @overload
    def __call__(
        self: Curve[Array], x: TimesLike, nu: int = 0, *, dtype: DTypeLike, **options: Unpack[EvaluationOptions]
    ) -> Array: ...
    def __call__(
        self,
        x: TimesLike,
        nu: int = 0,
        *,
        extrapolate: Extrapolate = None,
        per_curve: bool = False,
        dtype: DTypeLike | None = None,
        progress: Progress | None = None,
        out: Array | AnyArrays | None = None,
    ) -> Any:
        """Evaluate the curve or its derivatives.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape and in any order. If the knots are dates, times must be dates as well. If the knots had
            a time zone, pass times with any time zone, or ``datetime64`` in UTC; otherwise pass times without one.
        nu : {0, 1, 2, 3}, default 0
            Order of the derivative: 0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ', 3 for
            the covariant jerk ∇∇γ'. The jerk jumps at knots, where it is that of the segment after the knot. B-splines
            have no jerk.
        extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
            Extrapolation policy for this call. None means the policy of the curve. B-splines and curves that are made
            of others have None, ``"raise"`` and False only.
        per_curve : bool, default False
            True if every curve of a batch has its own times. The leading axes of x are then the batch axes.
        dtype : {"float32", "float64"}, optional
            Precision of the result; ``"float32"`` gives complex64 on complex spaces. The computation is always in
            double precision.
        progress : callable, optional
            Function that is called from time to time with the finished and the total number of points.
        out : ndarray or tuple of ndarray, optional
            Array into which the result is written, and which is returned. For a `Product`, a tuple with one array per
            factor. An array that is not contiguous, or not of the type of the space, requires an additional copy.

        Returns
        -------
        ndarray or tuple of ndarray
            Points or tangent vectors, shape ``(*batch axes, *x.shape, *point_shape)``. With `per_curve`, the batch
            axes appear only once. For a `Product`, a tuple with one array per factor.

        Raises
        ------
        ValidationError
            If a time is not finite, if a time lies outside the knots and the policy does not allow it, if `out` cannot
            hold the result, or if both `out` and `dtype` are given.

        Notes
        -----
        The jerk is computed by differentiation of a polynomial that interpolates the acceleration on half a segment.
        Let a be the largest size of the acceleration on a segment and h the length of its interval. Errors are about
        1e-12 of a/h, and up to 1e-8 of it if the step between two points exceeds half of the distance to the cut locus.
        A `Manifold` must have a function `transport`, and errors are larger there, because accelerations are
        differences. If segments have many times, the jerk takes about three times as long as the acceleration.
        """
        if progress is not None:
            check_progress(progress)
        single = dtype is not None and is_single(dtype)
        if out is not None and dtype is not None:
            raise ValidationError("dtype and out are both given. Pass one of them; the result has the type of out.")
        quantity = quantity_of(nu, self._curve.max_nu)
        where = self._extrapolation_mode if extrapolate is None else self._where(extrapolate)
        values = evaluated(self._curve, self._time_axis, x, quantity, where, per_curve, progress, out)
        return in_single(values) if single else values

    def speed(
        self, x: TimesLike, *, extrapolate: Extrapolate = None, per_curve: bool = False, dtype: DTypeLike | None = None
    ) -> FloatArray:
        """Compute the speed of the curve.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape and in any order, as in a call of the curve.
        extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
            Extrapolation policy for this call. None means the policy of the curve.
        per_curve : bool, default False
            True if every curve of a batch has its own times.
        dtype : {"float32", "float64"}, optional
            Precision of the result.

        Returns
        -------
        ndarray or float, shape ``(*batch axes, *x.shape)``
            The norm of the velocity γ'.

        Raises
        ------
        ValidationError
            If `x` is invalid, as in a call of the curve.

        Examples
        --------
        >>> import symspline as ss
        >>> line = ss.CubicSpline([0, 2], [[0.0], [3.0]], "r:1")
        >>> line.speed([0.5, 1.0])
        array([1.5, 1.5])
        """
        single = dtype is not None and is_single(dtype)
        values = evaluated(self._curve, self._time_axis, x, "speed", self._where(extrapolate), per_curve)
        speeds: FloatArray = (in_single(values) if single else values)[()]
        return speeds

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

    def _where(self, extrapolate: Any) -> str:
        """Return the core's name of an extrapolation policy; curves without cubic segments at their ends have two."""
        if extrapolate is None:
            return self._extrapolation_mode
        mode = extrapolation_mode(checked_extrapolate(extrapolate), "natural")
        if mode not in ("raise", "nan"):
            raise ValidationError(
                f"extrapolate must be None, 'raise' or False, not {extrapolate!r}, for a {type(self).__name__}"
            )
        return mode

    def _core_times(self, x: Any, name: str, per_curve: bool = False) -> tuple[Doubles, bool]:
        """Return times as numbers of the core, and whether each curve then has its own times.

        Raises
        ------
        ValidationError
            If a time is not in the domain of the curve.
        """
        batch, knots = self._batch, self._curve.times
        if per_curve:
            _check_batch_axes(np.shape(x), batch, name)
        times, per_curve = self._time_axis.at(x, batch, per_curve, knots, name)
        if knots.ndim > 1 and not per_curve:
            times, per_curve = np.broadcast_to(times, batch + times.shape), True
        with self._time_axis.explained():
            refuse_outside(knots, batch, times, per_curve, name)
        return times, per_curve

    def _shown_times(self, x: Doubles) -> Array:
        """Return times of the core as the user sees them."""
        return self._time_axis.shown(x, self._batch)

    # ---- lengths ----

    def length(self, a: TimesLike | None = None, b: TimesLike | None = None) -> Number:
        r"""Compute the length of the curve, or of the part between two times.

        Parameters
        ----------
        a, b : array_like of float or datetime64, optional
            Start and end of the part; b must not be before a. Both must be in the domain of the curve. Arrays are
            broadcast. By default, the first and the last time of the domain.

        Returns
        -------
        ndarray or float, shape ``(*batch axes, *shape of the times)``
            The integral of the speed, :math:`\int_a^b \lVert\gamma'\rVert \, dt`.

        Raises
        ------
        ValidationError
            If a time is not in the domain of the curve, or b is before a.

        See Also
        --------
        Curve.arc_length : Compute the length from the start of the domain to many times.

        Examples
        --------
        >>> import symspline as ss
        >>> quarter = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], ss.Sphere(2))
        >>> round(float(quarter.length()), 8)
        1.57079633
        >>> quarter.length([0, 0.25], [0.5, 1]).round(8)
        array([0.78539816, 1.17809725])
        """
        if a is None and b is None:
            return length(self._curve)
        ends = self._part_times(a, b)
        shapes = [x.shape[len(self._batch) * per_curve :] for x, per_curve in ends]
        start, stop = (self._with_batch(x, per_curve, max(map(len, shapes))) for x, per_curve in ends)
        try:
            start, stop = np.broadcast_arrays(start, stop)
        except ValueError:
            raise ValidationError(f"a and b have shapes {shapes[0]} and {shapes[1]}, which do not broadcast") from None
        refuse(stop < start, "b", lambda _: "is before a. Exchange a and b.")
        return self._by_columns(ArcLength.between, start, stop)

    def arc_length(self, x: TimesLike, *, per_curve: bool = False) -> Number:
        """Compute the length of the curve from the start of its domain to given times.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times in the domain of the curve, of any shape and in any order.
        per_curve : bool, default False
            True if every curve of a batch has its own times. The leading axes of x are then the batch axes.

        Returns
        -------
        ndarray or float, shape ``(*batch axes, *x.shape)``
            Arc lengths. With `per_curve`, the batch axes appear only once.

        Raises
        ------
        ValidationError
            If a time is not in the domain of the curve.

        See Also
        --------
        Curve.at_length : Compute the times at which the curve has given arc lengths.

        Examples
        --------
        >>> import symspline as ss
        >>> curve = ss.HermiteSpline([0, 1], [[0.0], [1.0]], [[0.0], [2.0]], "r:1")  # x = t²
        >>> curve.arc_length([0.0, 0.5, 1.0]).round(12)
        array([0.  , 0.25, 1.  ])
        """
        times, per_curve = self._core_times(x, "x", checked_flag(per_curve, "per_curve"))
        return self._by_columns(
            ArcLength.at, self._with_batch(times, per_curve, times.ndim - len(self._batch) * per_curve)
        )

    def at_length(self, s: ArrayLike, *, per_curve: bool = False) -> Time:
        """Compute the times at which the curve has given arc lengths.

        Use it to sample a curve at constant speed, that is at equal distances along the curve.

        Parameters
        ----------
        s : array_like
            Arc lengths from the start of the domain, between 0 and the length of the curve, of any shape.
        per_curve : bool, default False
            True if every curve of a batch has its own arc lengths. The leading axes of s are then the batch axes.

        Returns
        -------
        ndarray or float, shape ``(*batch axes, *s.shape)``
            Times, the inverse of `arc_length`. If the curve rests, this is the first time with this arc length. Dates
            are in nanoseconds. Curves that failed have NaN or NaT.

        Raises
        ------
        ValidationError
            If an arc length is negative or exceeds the length of the curve.

        See Also
        --------
        Curve.arc_length : Compute the length of the curve from its start to given times.

        Examples
        --------
        Five points at equal distances along a curve:

        >>> import numpy as np
        >>> import symspline as ss
        >>> curve = ss.HermiteSpline([0, 1], [[0.0], [1.0]], [[0.0], [2.0]], "r:1")  # x = t²
        >>> t = curve.at_length(np.linspace(0, curve.length(), 5))
        >>> curve(t)[:, 0].round(12)
        array([0.  , 0.25, 0.5 , 0.75, 1.  ])
        """
        array = as_array(s, "s")
        if array.dtype.kind not in "biuf":
            raise ValidationError(f"s must be real numbers, not {array.dtype}")
        batch, per_curve = self._batch, checked_flag(per_curve, "per_curve")
        if per_curve:
            _check_batch_axes(array.shape, batch, "s")
        wanted = self._with_batch(cast(array), per_curve, array.ndim - len(batch) * per_curve)
        if 0 in batch:
            return self._shown_times(wanted)
        shape = batch + (1,) * (wanted.ndim - len(batch))
        total = self._arc.lengths[:, -1].reshape(shape)
        # An arc length that exceeds the length by rounding is the length, such as the last of np.linspace. `length`
        # sums other intervals, and the sums differ by more where rounding errors are large beside steps of time.
        reach = _ROUNDING * total
        if (wanted > total + reach).any():
            reach += np.abs(np.reshape(length(self._curve), shape) - total)
        wrong = ~((wanted >= -reach) & (wanted <= total + reach)) & ~np.isnan(total)
        refuse(
            wrong | np.isnan(wanted),
            "s",
            lambda i: (
                f"= {wanted[i]} is not an arc length of the curve: it must be between 0 and "
                f"{np.broadcast_to(total, wanted.shape)[i]}"
            ),
        )
        times = np.asarray(self._by_columns(ArcLength.times_at, np.clip(wanted, 0.0, total)))
        shown: Time = self._shown_times(times)[()]
        return shown

    def _part_times(self, a: TimesLike | None, b: TimesLike | None) -> list[tuple[Doubles, bool]]:
        """Return two times, by default the first and the last, as `_core_times` does."""
        times = self._curve.times
        return [
            (np.asarray(times[..., i]), times.ndim > 1) if x is None else self._core_times(x, name)
            for i, x, name in ((0, a, "a"), (-1, b, "b"))
        ]

    def _with_batch(self, x: Doubles, per_curve: bool, inner: int) -> Doubles:
        """Return an array of one value per curve and sample, shape (*batch, ...) with `inner` axes of samples."""
        batch = self._batch
        lead, shape = (batch, x.shape[len(batch) :]) if per_curve else ((1,) * len(batch), x.shape)
        ones = (1,) * (inner - len(shape))
        return np.broadcast_to(x.reshape(lead + ones + shape), batch + ones + shape)

    def _by_columns(self, call: Callable[..., Doubles], *arrays: Doubles) -> Number:
        """Call a method of the arc length, which takes shape (*batch, m), for any number of axes of samples."""
        shape = arrays[0].shape
        if 0 in shape:
            return np.zeros(shape)
        values: Number = call(self._arc, *arrays)[()]
        return values

    def bending_energy(self) -> Number:
        r"""Compute the bending energy of the curve.

        Returns
        -------
        ndarray or float, shape ``batch axes``
            The integral of the squared covariant acceleration.

        Notes
        -----
        The bending energy is :math:`\int \lVert\nabla_{\gamma'}\gamma'\rVert^2 \, dt`, equation (1) of the paper.
        Riemannian cubics minimise it.

        References
        ----------
        G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
        Anal. 56 (2018), equation (1).

        Examples
        --------
        >>> import symspline as ss
        >>> wave = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1")
        >>> round(float(wave.bending_energy()), 8)
        6.0
        """
        return bending_energy(self._curve)

    # ---- batches ----

    @property
    def _batch(self) -> tuple[int, ...]:
        return self._curve.batch

    def __repr__(self) -> str:
        return f"<{type(self).__name__} on {self.space!r}: {self._batch_text}{self._counts}{self._span_text}>"

    @property
    def _counts(self) -> str:
        """The numbers of points, followed by a comma, in the representation of the curve."""
        return ""

    @property
    def _batch_text(self) -> str:
        """The batch in the representation of the curve."""
        return f"{' x '.join(map(str, self._batch))} curves, " if self._batch else ""

    @property
    def _span_text(self) -> str:
        """The domain in the representation of the curve."""
        first, last = self.domain
        if np.ndim(first):
            return "each with its own times"
        return f"from {_time_text(first)} to {_time_text(last)}"

    @abstractmethod
    def _picked(self, index: Any) -> Self:
        """Return one curve of a batch, or a slice of the batch."""

    def __len__(self) -> int:
        if not self._batch:
            raise TypeError("this is one curve; only a batch of curves has a length (see also .length())")
        return self._batch[0]

    def __getitem__(self, index: int | np.integer | slice) -> Self:
        """Return one curve of a batch, or a slice of the batch."""
        if not self._batch:
            raise TypeError("this is one curve; only a batch of curves can be indexed")
        if not isinstance(index, (int, np.integer, slice)):
            raise TypeError(f"the index of a curve must be an integer or a slice, not {short_repr(index)}")
        if not isinstance(index, slice) and not -len(self) <= index < len(self):
            raise IndexError(f"index {short_repr(index)} is out of range: there are {len(self)} curves")
        return self._picked(index)

    def __bool__(self) -> bool:
        return True

    def __iter__(self) -> Iterator[Self]:
        return (self[i] for i in range(len(self)))

    # ---- parts, copies in other times, and curves one after the other ----

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
        segmented: Curve[P] = archive.FORMATS["symspline-segments"]([*self._in_segments(), *other._in_segments()])
        return segmented

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
        return self._shifted(checked_shift(self._time_axis, dt))

    def retime(self, law: AnyFunction, *, domain: ArrayLike | None = None) -> Curve[P]:
        r"""Return the same path with another time law.

        Parameters
        ----------
        law : callable
            AnyFunction σ that takes a time x of the new curve, and as second argument the order of a derivative. It
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
        ends, time_axis = domain_of_law(law, domain), self._time_axis
        shifted = Law(law, 0.0 if time_axis.plain or time_axis.dates else float(time_axis.origin))
        times = smooth_parts(shifted, *ends, self._curve.times)
        curve = self._retimed(TimeAxis(), shifted, times)
        # The values of the law must be in the domain, also between its knots.
        curve(np.concatenate([times, np.linspace(*ends, _SAMPLES)]))
        return curve

    # Classes of curves override these methods.

    def _restricted(self, start: Doubles, stop: Doubles) -> Curve[P]:
        """Return the part between two times of the core, one per curve if each curve has its own times."""
        return self._retimed(self._time_axis, Affine(), part_of_times(self._curve.times, start, stop, self._batch))

    def _reversed(self) -> Curve[P]:
        times = self._curve.times
        law = Affine(-1, times[..., 0] + times[..., -1])
        mirrored = np.clip(np.asarray(law(times))[..., ::-1], times[..., :1], times[..., -1:])
        return self._retimed(self._time_axis, law, np.ascontiguousarray(mirrored))

    def _shifted(self, step: Any) -> Curve[P]:
        if not self._time_axis.plain:
            moved = replace(self._time_axis, origin=self._time_axis.origin + step)
            return self._retimed(moved, Affine(), self._curve.times)
        times = self._curve.times + step
        check_increasing(times)
        return self._retimed(self._time_axis, Affine(1, -float(step)), times)

    def _retimed(self, time_axis: TimeAxis, law: TimeMap, times: Doubles) -> Curve[P]:
        """Return this curve at other times, which a law maps to those of this curve."""
        curve: Curve[P] = archive.FORMATS["symspline-retimed"]._of(self, time_axis, law, times)
        return curve

    def _part_ends(self, a: TimesLike | None, b: TimesLike | None) -> tuple[Doubles, Doubles]:
        """Return the ends of a part as numbers of the core, one per curve if each curve has its own times."""
        ends = []
        for name, (time, per_curve) in zip("ab", self._part_times(a, b), strict=True):
            if time.ndim > len(self._batch) * per_curve:
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

    # ---- search ----

    @cached_property
    def _arc(self) -> ArcLength:
        return ArcLength(self._curve)

    def closest(
        self, points: ArrayLike | tuple[ArrayLike, ...], *, per_curve: bool = False
    ) -> tuple[Time, FloatArray | float]:
        r"""Find the nearest points of the curve to given points.

        Parameters
        ----------
        points : array_like, shape (..., *space.point_shape)
            Points of the space, near the curve or far from it. For a `Product`, a tuple with one array per factor.
        per_curve : bool, default False
            True if every curve of a batch has its own points. The leading axes of the points are then the batch axes.

        Returns
        -------
        times : ndarray or float, shape ``(*batch axes, ...)``
            Times in the domain at which the curve is nearest to each point. If several are equally near, one of them.
            Dates are in nanoseconds. Curves that failed have NaN or NaT.
        distances : ndarray or float, shape ``(*batch axes, ...)``
            Distances between the points and the curve.

        Raises
        ------
        ValidationError
            If an array does not consist of points of the space, or if the space has no distance that belongs to an
            invariant metric, such as `SpecialEuclidean`.

        See Also
        --------
        Space.distance : Compute the distance between points.
        Curve.arc_length : Compute the length of the curve up to a time.

        Notes
        -----
        The search is global. Let :math:`d_i` and :math:`d_{i+1}` be the distances of a point from two samples of the
        curve, and :math:`L` the arc length between these. By the triangle inequality, the distance from the curve
        between them is at least :math:`(d_i + d_{i+1} - L)/2`. Intervals in which this bound exceeds the distance from
        another sample are excluded, and the others are bisected down to a fraction of a segment. In the remaining
        intervals, the minimum is a root of the derivative of the squared distance,
        :math:`-2\langle\log_{\gamma}(q), \gamma'\rangle`.

        The first call computes a table of arc lengths and samples, which further calls reuse. On a `Manifold`, the
        distance is the length of the geodesic that its function ``log`` returns.

        Examples
        --------
        The nearest time of a circle of latitude, and the distance from it:

        >>> import numpy as np
        >>> import symspline as ss
        >>> equator = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0], [-1, 0, 0]], "sphere:2")
        >>> time, distance = equator.closest([0.0, np.cos(0.3), np.sin(0.3)])
        >>> time.round(8), distance.round(8)
        (np.float64(1.0), np.float64(0.3))
        """
        space, per_curve = self.space, checked_flag(per_curve, "per_curve")
        _check_metric(space)
        targets = [
            _checked(factor, value)
            for factor, value in zip(factors_of(space), parts_of(points, space, "points"), strict=True)
        ]
        batch, lead = self._curve.batch, _lead(space, targets)
        if per_curve and lead[: len(batch)] != batch:
            raise ValidationError(
                f"with per_curve=True the shape of points must begin with the batch axes {batch}; "
                f"got leading axes {lead}"
            )
        shape = lead if per_curve else batch + lead
        if 0 in shape:
            return self._shown_times(np.zeros(shape)), np.zeros(shape)
        inner = shape[len(batch) :]
        rows = [
            np.broadcast_to(x, shape + factor.point_shape).reshape(-1, *factor.point_shape)
            for x, factor in zip(targets, factors_of(space), strict=True)
        ]
        curve = np.repeat(np.arange(math.prod(batch), dtype=np.int64), math.prod(inner))
        with np.errstate(all="ignore"):
            times, distances = self._closest.search(rows, curve)
        return self._shown_times(times.reshape(shape))[()], distances.reshape(shape)[()]

    def extrema(
        self,
        function: Literal["speed", "acceleration"] | Callable[[Any], Any] = "speed",
        *,
        kind: Literal["max", "min"] = "max",
    ) -> tuple[Array, FloatArray]:
        r"""Find the local maxima or minima of the speed, or of another function of time.

        Parameters
        ----------
        function : {"speed", "acceleration"} or callable, default "speed"
            The norm of the velocity, the norm of the covariant acceleration, or a function that takes an array of times
            and returns an array of real numbers of the same shape.
        kind : {"max", "min"}, default "max"
            Whether maxima or minima are returned.

        Returns
        -------
        times : ndarray, shape (m,)
            Increasing times of the extrema. An end of the domain counts if the function is larger (or smaller) there
            than next to it. The largest of all values is therefore among them.
        values : ndarray, shape (m,)
            Values of the function at these times.

        Raises
        ------
        ValidationError
            If the curve is a batch, or an argument is invalid.

        See Also
        --------
        Curve.solve : Find the times at which a function has a given value.

        Notes
        -----
        The function is interpolated at 24 Chebyshev nodes on every segment, and the extrema are the roots of the
        derivative of the polynomial. Segments are halved up to seven times until the polynomial represents the
        function to ten significant digits. Extrema at which the function varies less than that, or features much
        shorter than a segment, can be missed. A function that jumps at knots has the value after the knot there.

        Rounding errors of points cause errors of the speed of about :math:`\varepsilon/h` times the size of the points,
        and of the acceleration of about :math:`\varepsilon/h^2`, where h is the spacing of the knots: 1e-8 for
        rotations at 1 kHz. Extrema of the two quantities that are less prominent than that are omitted.

        Examples
        --------
        >>> import symspline as ss
        >>> curve = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1")
        >>> times, speeds = curve.extrema("speed")
        >>> times.round(8), speeds.round(8)
        (array([0., 2.]), array([1.5, 1.5]))
        >>> curve.extrema(lambda x: curve(x)[..., 0])[0].round(8)
        array([1.])
        """
        if not isinstance(kind, str) or kind not in ("max", "min"):
            raise ValidationError(f"kind must be 'max' or 'min', not {short_repr(kind)}")
        f = self._function(function)
        times = extrema(f, self._curve.times, 1.0 if kind == "max" else -1.0, self._noise(function))
        return self._shown_times(times), f(times)

    def solve(self, function: Literal["speed", "acceleration"] | Callable[[Any], Any], value: float = 0.0) -> Array:
        """Find the times at which the speed, or another function of time, has a given value.

        Parameters
        ----------
        function : {"speed", "acceleration"} or callable
            The norm of the velocity, the norm of the covariant acceleration, or a function that takes an array of times
            and returns an array of real numbers of the same shape.
        value : float, default 0.0
            The value to find.

        Returns
        -------
        ndarray, shape (m,)
            Increasing times at which the function crosses the value, also by a jump.

        Raises
        ------
        ValidationError
            If the curve is a batch, or an argument is invalid.

        See Also
        --------
        Curve.extrema : Find the local maxima or minima of a function.

        Notes
        -----
        Sign changes between the Chebyshev nodes that `extrema` uses are refined by Chandrupatla's method. Two crossings
        between neighbouring nodes, and times at which the function touches the value without crossing it, can be
        missed. Rounding errors of the speed and of the acceleration do not count as crossings, see `extrema`.

        Examples
        --------
        The times at which a motion has reached half of its height:

        >>> import symspline as ss
        >>> curve = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1")
        >>> curve.solve(lambda x: curve(x)[..., 0], 0.5).round(6)
        array([0.347296, 1.652704])
        """
        number = checked_number(value, "value must be a finite number", math.isfinite)
        f = self._function(function)
        return self._shown_times(crossings(f, self._curve.times, number, self._noise(function)))

    def _function(self, function: object) -> Callable[[Doubles], Doubles]:
        """Return a function of times of the core, of one curve."""
        if self._curve.batch:
            raise ValidationError(
                "the curve is a batch, but extrema belong to one curve. Use one of them, as curve[0]."
            )
        if callable(function):
            return lambda x: _called(function, self._shown_times(x))
        if not isinstance(function, str) or function not in _QUANTITIES:
            raise ValidationError(
                f"function must be 'speed', 'acceleration' or a function of times, not {short_repr(function)}"
            )
        quantity = _QUANTITIES[function]
        return lambda x: checked_values(
            self._curve.evaluate(np.ascontiguousarray(x), quantity, "continue", False), self._shown_times(x)
        )

    def _noise(self, function: object) -> Doubles:
        """Return the rounding errors of a quantity between the times of the curve; zero for functions of the user."""
        if callable(function):
            return np.zeros(len(self._curve.times) - 1)
        return _noise_of(self._curve, 1 if function == "speed" else 2)

    @cached_property
    def _closest(self) -> ClosestPoints:
        return ClosestPoints(self._curve, self.space, self._arc)

    # ---- what a plot shows, which classes of curves override ----

    def _made_of(self, radius: float | None = None) -> str:
        """Return a description of the data, for the title of a plot; noise in metres on a globe of a given radius."""
        return ""

    @property
    def _unconverged(self) -> int:
        """Number of curves that failed."""
        return 0

    @property
    def _node_times(self) -> Doubles:
        """Times of the core at which one curve passes through given points; empty if there are none."""
        return np.empty(0)

    @property
    def _rate_limits(self) -> list[tuple[float, float]]:
        """Limits of speed and acceleration in each factor of the space; empty if there are none."""
        return []

    @property
    def _breaks(self) -> Doubles:
        """Starts and ends of gaps in the curve as times of the core, shape (m, 2)."""
        return np.empty((0, 2))

    def _noise_beside(self, index: tuple[int, ...], x: Doubles) -> UncertaintyBand | None:
        """Return the noisy data of one curve of a batch, with uncertainty bands at times x of the core.

        Curves that pass through their points have none and return None.
        """
        return None

    def _panels_below(self, x: Doubles) -> list[SidePanel]:
        """Return the bands at times x of the core, and the residuals of measurements that are not points, for plots."""
        return []

    # ---- plots ----

    def _repr_html_(self) -> str:
        """Return the representation for notebooks, with a small plot if Matplotlib is installed."""
        text = f"<pre>{escape(repr(self))}</pre>"
        if find_spec("matplotlib") is None:
            return text
        picture = BytesIO()
        try:
            self.plot().savefig(picture, format="png", dpi=_DOTS)
        except ValidationError:
            # Curves that failed cannot be plotted.
            return text
        data = b64encode(picture.getvalue()).decode()
        return f'{text}<img src="data:image/png;base64,{data}" alt="{escape(repr(self))}">'

    @overload
    def plot(
        self,
        file: File | None = None,
        *,
        ax: None = None,
        **look: Unpack[PageLook],
    ) -> Figure: ...
    @overload
    def plot(
        self,
        file: None = None,
        *,
        ax: Axes,
        **look: Unpack[AxesLook],
    ) -> Axes: ...
    def plot(
        self,
        file: File | None = None,
        *,
        ax: Axes | None = None,
        color: str | tuple[float, ...] | None = None,
        label: str | None = None,
        title: str | None = None,
        figsize: tuple[float, float] | float | None = None,
        show: bool = False,
    ) -> Figure | Axes:
        """Plot the curve, its velocity and its covariant acceleration.

        Without `ax`, a figure with several panels is created. The first panel depends on the space:

        - S²: a globe and a map, or an enlarged part; H²: the Poincaré disk; R¹, R² and R³: the graph or the curve.
        - SO(3), O(3), SU(2) and S³ (unit quaternions, scalar first): rotated frames along the time axis. Graphs of the
          rotation vectors, if rotations are small, noisy, have long gaps, or are beside other curves or factors.
        - S¹, SO(2), O(2), U(1), RP¹ and Gr(1, 2): the continuous angle against time.
        - SE(3): frames along the path of the positions; SE(2): arrow heads on it.
        - CP¹ and the complex Gr(1, 2): the Bloch sphere.
        - RP², Gr(1, 3) and Gr(2, 3): a hemisphere, with the normals of planes. A curve that leaves it through the rim
          re-enters on the opposite side.
        - Other projective spaces and Grassmannians: the principal angles to the first point.
        - SPD(2) and SPD(3): ellipses and ellipsoids along the time axis; larger SPD(n), as covariance matrices: their
          standard deviations and correlations.
        - Tori: the angles in degrees; lines break where an angle passes 180 degrees.
        - Stiefel manifolds: the components of each column against time.
        - All other spaces: the components against time, with dashed imaginary parts. If there are more than twelve,
          the twelve with the largest ranges have names.

        A product has one such panel per factor. The other panels show the speed |γ'| and the size |∇γ'| of the
        covariant acceleration, with one panel per factor of a product. In one dimension both have a sign. For poses,
        rates of rotation and of translation have separate panels, because their units differ. Dashed lines show the
        limits of a curve that was retimed by a law of `time_law`. Rates that are small per second are per hour, day or
        year.

        Parameters
        ----------
        file : str, path or file object, optional
            File to which the figure is saved, such as ``"curve.pdf"``.
        ax : matplotlib.axes.Axes, optional
            Axes into which the first panel is drawn, without the others. R³ and SE(3) need axes with
            ``projection="3d"``, all other spaces ordinary ones. The axes keep their style, and numbers stay as they
            are on the time axis.
        color : color, optional
            Colour of the curve, in any form that Matplotlib accepts. By default, the next colour of the property cycle
            of `ax`, or a dark blue. On a page, components of a point have colours of their own.
        label : str, optional
            Name of the curve in legends.
        title : str, optional
            Title of the figure, or of `ax`.
        figsize : float or pair of float, optional
            Width of the figure in inches, with the height that all panels need, or width and height. Letters have at
            least 6 points on any page, unless your font is smaller.
        show : bool, default False
            Whether to open a window by pyplot, in which you can rotate three-dimensional pictures.

        Returns
        -------
        matplotlib.figure.Figure or matplotlib.axes.Axes
            The figure, which you can modify or save, or `ax`.

        Raises
        ------
        ValidationError
            If an argument is invalid, if `ax` does not suit the space, or if no curve of a batch is finite.
        ImportError
            If Matplotlib is not installed.

        See Also
        --------
        plot : Compare several curves and data.
        Curve.animate : Show the motion along the curve.

        Notes
        -----
        A smoothing spline is drawn with its data and, where possible, with 95 % bands of the curve and the speed. A
        curve of `estimate` is drawn with all points among its measurements. It has a panel with the residuals of every
        other measurement in standard deviations, and one with the radius of the 95 % band if the first panel does not
        show the band.

        Of a batch of more than five curves, three are drawn with their points, or their mean if they are close to it.
        Areas between the 5 % and the 95 % quantile represent the others where numbers are drawn against time, and thin
        lines do so elsewhere.

        Times that are far from zero, such as seconds since 1970, are shown as differences from a round number, which
        the label of the axis names.

        Fonts, font sizes and dark backgrounds follow your settings of Matplotlib. The method does not change them, and
        it uses pyplot only if `show` is True.

        Examples
        --------
        >>> import symspline as ss
        >>> quarter = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], ss.Sphere(2))
        >>> figure = quarter.plot()

        Draw into existing axes:

        >>> from matplotlib.figure import Figure
        >>> ax = Figure().add_subplot()
        >>> ax = quarter.plot(ax=ax, label="quarter")
        >>> legend = ax.legend()
        """
        require_matplotlib()
        from .._plotting import checked_look, plot

        look = checked_look(file, ax, color, label, title, figsize, show)
        drawn: Figure | Axes = plot(self, file, ax=ax, show=show, **look)
        return drawn

    def animate(
        self,
        file: File | None = None,
        *,
        frames: int = 60,
        fps: float = 15,
        color: str | tuple[float, ...] | None = None,
        title: str | None = None,
        figsize: tuple[float, float] | float | None = None,
    ) -> FuncAnimation:
        """Animate the motion along the curve.

        The pages of `plot` are shown with a marker, or a frame for rotations and poses, that moves along the curve. A
        vertical line marks the time in all panels with a time axis, and the time is printed in the upper right corner.

        Parameters
        ----------
        file : str or path, optional
            File to which the animation is saved, such as ``"curve.gif"`` or ``"curve.mp4"``. The latter needs ffmpeg.
        frames : int, default 60
            Number of frames, at equal distances in time.
        fps : float, default 15
            Frames per second.
        color : color, optional
            Colour of the curve.
        title : str, optional
            Title of the figure.
        figsize : float or pair of float, optional
            Width of the figure in inches, or width and height.

        Returns
        -------
        matplotlib.animation.FuncAnimation
            The animation. In a notebook, show it by ``IPython.display.HTML(animation.to_jshtml())``.

        Raises
        ------
        ValidationError
            If an argument is invalid, if this is a batch, or if ffmpeg is needed and not installed.
        ImportError
            If Matplotlib is not installed.

        See Also
        --------
        Curve.plot : Plot the curve.

        Examples
        --------
        >>> import io, symspline as ss
        >>> turn = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "sphere:2")
        >>> animation = turn.animate("turn.gif", frames=2)  # doctest: +SKIP
        """
        require_matplotlib()
        from .._plotting import animate, checked_look

        look = checked_look(file, None, color, None, title, figsize, False)
        moving: FuncAnimation = animate(self, file, frames, fps, **look)
        return moving

    # ---- files and pickles ----

    __hash__: ClassVar[None] = None  # type: ignore[assignment]

    def save(self, file: File) -> None:
        """Write the curve to an NPZ file.

        `load` reads it back without a new fit.

        Parameters
        ----------
        file : str, path or file object
            Name of the file, or a binary file that is open for writing. An existing file of this name is replaced only
            when the new one is complete.

        Raises
        ------
        ValidationError
            If the space is a `Manifold` made of functions, which cannot be stored.
        OSError
            If the file cannot be written.

        See Also
        --------
        load : Read a curve.
        save : Write several curves to one file.

        Examples
        --------
        >>> import io, symspline as ss
        >>> file = io.BytesIO()
        >>> ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], "sphere:2").save(file)
        >>> _ = file.seek(0)
        >>> ss.load(file)
        <CubicSpline on Sphere(2): 2 points, from 0 to 1, natural>
        """
        archive.write(file, self._state())

    def __reduce__(self) -> tuple[object, ...]:
        return archive.restore, (self._state(),)

    @abstractmethod
    def _state(self) -> State:
        """Return the entries of files and pickles."""

    @classmethod
    @abstractmethod
    def _from_state(cls, state: archive.Entries) -> Self:
        """Return the curve of a state."""


# A curve on any space, also on a product.
UserCurve = Curve[Any]


def _check_batch_axes(shape: tuple[int, ...], batch: tuple[int, ...], name: str) -> None:
    if shape[: len(batch)] != batch:
        raise ValidationError(
            f"with per_curve=True the shape of {name} must begin with the batch axes {batch}; got {shape}"
        )


def _time_text(x: Any) -> str:
    """Return a time in a few characters; dates without the zeros at their end."""
    if isinstance(x, np.datetime64):
        return re.sub(r"(:00)?\.?0*$", "", str(x)) if "." in str(x) else str(x)
    return f"{float(x):.6g}" if abs(float(x)) < 1e6 else f"{float(x):.13g}"


def _check_meeting(first: UserCurve, second: UserCurve) -> None:
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
        p, q = (np.reshape(point, (-1, *space.point_shape)) for point in (p, q))
        valid = space._where_finite(p) & space._where_finite(q)
        close = np.abs(p - q)[valid] <= _MEETING * np.maximum(1.0, np.abs(p)[valid])
        # Different arrays can represent one point of a quotient space.
        if not close.all() and not (space.distance(p[valid], q[valid]) <= _MEETING).all():
            raise ValidationError(
                f"other begins at {short_repr(q[0])}, but the curve ends at {short_repr(p[0])}. Both must be one point."
            )


def check_timed(spline: Any, name: str = "spline") -> None:
    """Raise TypeError unless an argument is a curve with a time axis."""
    if not isinstance(spline, Curve) or isinstance(spline._curve, ControlledCurve):
        what = "a curve with knots and velocities, such as a symspline.CubicSpline, or made of such curves"
        raise TypeError(f"{name} must be {what}, not {short_repr(spline)}")


# ---- extrema and closest points ----


def _noise_of(curve: Any, order: int) -> Doubles:
    """Return the size of rounding errors of a derivative of a curve between its times."""
    if isinstance(curve, Retimed):
        # The errors are those of the source, at other times.
        middle = curve.times[:-1] / 2 + curve.times[1:] / 2
        source = _noise_of(curve.source, order)
        at = np.searchsorted(curve.source.times, curve.law(middle), side="right") - 1
        return np.asarray(source[np.clip(at, 0, len(source) - 1)] * np.abs(curve.law(middle, 1)) ** order)
    points = parts_of(curve.evaluate(curve.times, "point", "continue", False), curve.space, "points")
    sizes = [space._rounding(values) for space, values in zip(factors_of(curve.space), points, strict=True)]
    return rounding_noise(np.max(sizes, axis=0), np.diff(curve.times), order)


def _called(function: Callable[[Any], Any], times: Array) -> Doubles:
    return checked_values(function(times), times)


def _check_metric(space: AnySpace) -> None:
    """Raise ValidationError if distances do not belong to a metric."""
    for factor in factors_of(space):
        if not isinstance(factor, Manifold) and np.isnan(factor.curvature):
            raise ValidationError(
                f"{factor!r} has no invariant metric, so that no point of the curve is nearest. Use a space with a "
                "metric, such as 'so:3 x r:3' for poses."
            )


def _checked(space: AnySpace, value: Any) -> Array:
    """Return points of one factor as an array of numbers, projected onto the space."""
    array = space._array(value, "points")
    doubles = space._doubles(array, "points")
    if isinstance(space, Manifold):
        try:
            space.check_point(array)
        except ValidationError as error:
            raise ValidationError(f"points are invalid: {error}") from None
        return space._numbers(doubles)
    lead = space._lead(doubles)
    space._handle.check_points(space._rows(doubles, lead), lead, space._tol(array), "points")
    return space._apply("project", x=space._numbers(doubles))


def _lead(space: AnySpace, arrays: list[Array]) -> tuple[int, ...]:
    shapes = [x.shape[: x.ndim - len(f.point_shape)] for x, f in zip(arrays, factors_of(space), strict=True)]
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        raise ValidationError(f"the leading axes of points do not broadcast: {shapes}") from None


# ---- one picture of several curves and data ----

if TYPE_CHECKING:
    Item = UserCurve | tuple[Any, Any]


@overload
def plot(
    curves: UserCurve | Iterable[Item],
    file: File | None = None,
    *,
    labels: Sequence[str | None] | None = None,
    colors: Sequence[Color] | None = None,
    ax: None = None,
    title: str | None = None,
    figsize: tuple[float, float] | float | None = None,
    show: bool = False,
) -> Figure: ...
@overload
def plot(
    curves: UserCurve | Iterable[Item],
    file: None = None,
    *,
    labels: Sequence[str | None] | None = None,
    colors: Sequence[Color] | None = None,
    ax: Axes,
    title: str | None = None,
    figsize: None = None,
    show: bool = False,
) -> Axes: ...
def plot(
    curves: UserCurve | Iterable[Item],
    file: File | None = None,
    *,
    labels: Sequence[str | None] | None = None,
    colors: Sequence[Color] | None = None,
    ax: Axes | None = None,
    title: str | None = None,
    figsize: tuple[float, float] | float | None = None,
    show: bool = False,
) -> Figure | Axes:
    """Compare curves and data in one picture.

    Parameters
    ----------
    curves : sequence
        Curves of any class on one space, such as the list that `fit_many` returns. A pair ``(t, points)`` of arrays is
        drawn as dots; missing points are omitted. At least one entry must be a curve.
    file : str, path or file object, optional
        File to which the figure is saved, such as ``"comparison.pdf"``.
    labels : sequence of str, optional
        Names for the legend, one per entry.
    colors : sequence of color, optional
        Colours, one per entry.
    ax : matplotlib.axes.Axes, optional
        Axes into which the picture is drawn, without further panels; see `Curve.plot`.
    title : str, optional
        Title of the figure, or of `ax`.
    figsize : float or pair of float, optional
        Width of the figure in inches, or width and height.
    show : bool, default False
        Whether to open a window by pyplot.

    Returns
    -------
    matplotlib.figure.Figure or matplotlib.axes.Axes
        The figure, which you can modify or save, or `ax`.

    Raises
    ------
    ValidationError
        If there is no curve, if an entry is a batch or on another space, or if an option is invalid.
    ImportError
        If Matplotlib is not installed.

    See Also
    --------
    Curve.plot : Plot one curve or a batch.

    Examples
    --------
    >>> import symspline as ss
    >>> points = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> spline, polygon = ss.CubicSpline(None, points, "sphere:2"), ss.PiecewiseGeodesic(None, points, "sphere:2")
    >>> figure = ss.plot([spline, polygon], labels=["C² spline", "geodesics"])
    """
    require_matplotlib()
    from .._plotting import checked_look, compare

    look = checked_look(file, ax, None, None, title, figsize, show)
    items = checked_items(curves)
    drawn: Figure | Axes = compare(items, labels, file, colors=colors, ax=ax, show=show, **look)
    return drawn


def checked_items(curves: Any, name: str = "curves") -> list[Any]:
    if isinstance(curves, Curve):
        curves = [curves]
    if not isinstance(curves, Iterable) or isinstance(curves, (str, bytes, dict)):
        raise TypeError(f"{name} must be a sequence of curves, not {short_repr(curves)}")
    items = list(curves)
    for i, item in enumerate(items):
        is_data = isinstance(item, tuple) and len(item) == 2
        if not (isinstance(item, Curve) or is_data):
            raise TypeError(f"{name}[{i}] must be a curve or a pair (t, points), not {short_repr(item)}")
        if isinstance(item, Curve) and item._batch:
            raise ValidationError(f"{name}[{i}] is a batch of {len(item)} curves. Pass its curves: [*batch].")
    first = next((item for item in items if isinstance(item, Curve)), None)
    if first is None:
        raise ValidationError(f"{name} must contain at least one curve, which determines the space")
    for i, item in enumerate(items):
        if isinstance(item, Curve) and item.space != first.space:
            raise ValidationError(f"{name}[{i}] is on {item.space!r}, but the first curve is on {first.space!r}")
    return items
