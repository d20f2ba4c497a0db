"""The base class of curves whose times are numbers, dates or durations."""

from __future__ import annotations

from typing import Any, Unpack, overload

import numpy as np
from numpy.typing import DTypeLike, NDArray

from .._base.arrays import in_single, is_single, refuse, short_repr
from .._base.typing import AnyArray, AnyArrays, BCType, Extrapolate, FloatArray, Out, P, Progress, TimesLike
from .._core import ValidationError
from .._curves.at_times import evaluated
from .._curves.composed import AnyCurve
from .._curves.options import EvaluationOptions, check_progress, checked_extrapolate, extrapolation_mode, quantity_of
from .._spaces import Doubles
from .curve import Curve


class TimedCurve(Curve[P]):
    """Base class of curves with a time axis and an extrapolation policy."""

    _curve: AnyCurve
    _extrapolate: Extrapolate
    # Extrapolation policy, by its name in the core.
    _extrapolation_mode: str
    # End conditions, which determine whether curves are closed.
    _bc_type: BCType = "natural"

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
        self: Curve[AnyArray], x: TimesLike, nu: int = 0, *, dtype: DTypeLike, **options: Unpack[EvaluationOptions]
    ) -> AnyArray: ...
    def __call__(
        self,
        x: TimesLike,
        nu: int = 0,
        *,
        extrapolate: Extrapolate = None,
        per_curve: bool = False,
        dtype: DTypeLike | None = None,
        progress: Progress | None = None,
        out: AnyArray | AnyArrays | None = None,
    ) -> Any:
        """Evaluate the curve or its derivatives.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape and in any order. If the knots are dates, times must be dates as well. If the knots had
            a time zone, pass times with any time zone, or ``datetime64`` in UTC; otherwise pass times without one.
        nu : {0, 1, 2, 3}, default 0
            Order of the derivative: 0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ', 3 for
            the covariant jerk ∇∇γ'. The jerk jumps at knots, where it is that of the segment after the knot.
        extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
            Extrapolation policy for this call. None means the policy of the curve.
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

    def _where(self, extrapolate: Any) -> str:
        """Return the core's name of the extrapolation policy."""
        return (
            self._extrapolation_mode
            if extrapolate is None
            else extrapolation_mode(checked_extrapolate(extrapolate), self._bc_type)
        )

    def _core_times(self, x: Any, name: str, per_curve: bool = False) -> tuple[Doubles, bool]:
        batch, knots = self._batch, self._curve.times
        if per_curve and np.shape(x)[: len(batch)] != batch:
            raise ValidationError(
                f"with per_curve=True the shape of {name} must begin with the batch axes {batch}; got {np.shape(x)}"
            )
        times, own = self._time_axis.at(x, batch, per_curve, knots, name)
        if knots.ndim > 1 and not own:
            times, own = np.broadcast_to(times, batch + times.shape), True
        samples = (1,) * (times.ndim - len(batch) if own else 0)
        first, last = (
            end.reshape(end.shape + samples) if knots.ndim > 1 else end for end in (knots[..., 0], knots[..., -1])
        )

        def say(i: Any) -> str:
            ends = [np.broadcast_to(end, times.shape)[i] for end in (first, last)]
            where = f"outside the knots [{ends[0]}, {ends[1]}]" if np.isfinite(times[i]) else "not finite"
            return f"= {times[i]} is {where}"

        try:
            refuse(~((times >= first) & (times <= last)), name, say)
        except ValidationError as error:
            raise self._time_axis.explain(error) from None
        return times, own

    def _shown_times(self, x: Doubles) -> NDArray[Any]:
        return self._time_axis.shown(x, self._batch)

    @property
    def extrapolate(self) -> Extrapolate:
        """Extrapolation policy, as passed to the constructor."""
        return self._extrapolate


def check_timed(spline: Any, name: str = "spline") -> None:
    """Raise TypeError unless an argument is a curve with a time axis."""
    if not isinstance(spline, TimedCurve):
        what = "a curve with knots and velocities, such as a symspline.CubicSpline, or made of such curves"
        raise TypeError(f"{name} must be {what}, not {short_repr(spline)}")
