"""Evaluation of curves at times as a user passes them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import checked_flag
from .._base.time import TimeAxis, onto_ends
from .._base.typing import Progress, TimesLike
from .._core import ValidationError
from .._spaces import Doubles
from .composed import AnyCurve
from .curve import CurveArrays, write_into


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
