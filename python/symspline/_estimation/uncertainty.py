"""Standard errors of quantities along a curve, by linear propagation of its covariance."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .._base.typing import TimesLike
from .._core import ValidationError
from .._curves.composed import call_at_times
from .._smoothing import SmoothingSpline
from .._smoothing.noise import smoothed_spaces, split
from .._smoothing.spline import AnySmoothingSpline
from .._spaces import Array, Doubles, factors_of
from .._splines.composed import SegmentedCurve

# The number of times whose covariances are in memory together.
_TIMES = 4096
# Derivatives of k numbers with respect to the move of a curve and its time derivatives, like those of a measurement:
# for each order a dict from parts to arrays of shape (n, k, dim).
Jacobians = list[dict[int, Doubles]]


class Motion(NamedTuple):
    """The motion of a curve in one space that is not a product, at n times.

    Attributes
    ----------
    p, v : ndarray, shape (n, *point_shape)
        Points and velocities.
    frames : ndarray, shape (n, dim, *point_shape)
        Frames along the curve.
    """

    p: Array
    v: Array
    frames: Array


def check_uncertain(spline: object) -> AnySmoothingSpline:
    """Return the curve, or raise ValidationError if it has no covariance."""
    if isinstance(spline, SegmentedCurve) and all(isinstance(segment, SmoothingSpline) for segment in spline):
        raise ValidationError(
            "return_std=True needs one smoothing spline, but spline is a SegmentedCurve. Pass its segments one by one, "
            "with times in their domains."
        )
    if not isinstance(spline, SmoothingSpline):
        raise ValidationError(
            f"return_std=True needs a curve with a covariance, but spline is a {type(spline).__name__}. Fit the curve "
            "by symspline.make_smoothing_spline or symspline.estimate."
        )
    return spline


def standard_errors(
    spline: AnySmoothingSpline,
    x: TimesLike,
    parts: list[int],
    jacobians: Callable[[list[Motion]], Jacobians],
    outside: str,
    per_curve: bool = False,
) -> Doubles:
    """Compute standard errors of numbers that depend on a curve and its time derivatives.

    If the curve moves by Σ ξ_j E_j with parallel frames E, the numbers change by the sum of J_k ξ⁽ᵏ⁾ over the orders k.
    Their covariance is J C Jᵀ for the covariance C of ξ and its derivatives.

    Parameters
    ----------
    spline : SmoothingSpline
        Curve.
    x : array_like
        Times of the user.
    parts : list of int
        Parts of the space, in the order of `smoothed_spaces`.
    jacobians : callable
        Function that returns the derivatives from the motion of these parts. All batch axes and axes of x are one.
    outside : str
        Extrapolation policy by its name in `call_at_times`.
    per_curve : bool
        Whether every curve of a batch has its own times.

    Returns
    -------
    ndarray, shape (*batch axes, *x.shape, k)
        Standard errors.
    """
    batch = spline._batch

    def call(times: Doubles, outside: str, per_curve: bool) -> Doubles:
        if not np.isfinite(times).all():
            raise ValidationError("x must be finite")
        times, per_curve = _between_knots(spline, times, outside, per_curve)
        motions = _motions(spline, times, parts, per_curve)
        by_order = jacobians(motions)
        orders = [order for order, blocks in enumerate(by_order) if blocks]
        pairs = list(zip(parts, motions, strict=True))
        rows = [by_order[order].get(part, _nothing(by_order, motion)) for order in orders for part, motion in pairs]
        shape = times.shape[len(batch) :] if per_curve else times.shape
        whole = np.concatenate(rows, axis=-1)
        whole = whole.reshape(*batch, math.prod(shape), *whole.shape[1:])
        variance = np.empty(whole.shape[:-1])
        for index in np.ndindex(batch):
            at = np.ascontiguousarray(np.ravel(times[index] if per_curve else times))
            for start in range(0, len(at), _TIMES):
                some = slice(start, start + _TIMES)
                covariance = spline._coupled(parts, index, at[some], orders)
                jacobian = whole[index][some]
                variance[index][some] = ((jacobian @ covariance) * jacobian).sum(axis=-1)
        # Rounding may make a vanishing variance negative.
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)).reshape(*batch, *shape, whole.shape[-2]))

    return np.asarray(call_at_times(spline._curve, spline._time_axis, x, per_curve, outside, call))


def _nothing(by_order: Jacobians, motion: Motion) -> Doubles:
    """Return derivatives of zero for a part on which nothing depends."""
    known = next(block for blocks in by_order for block in blocks.values())
    return np.zeros((*known.shape[:-1], motion.frames.shape[1]))


def _between_knots(spline: AnySmoothingSpline, times: Doubles, outside: str, per_curve: bool) -> tuple[Doubles, bool]:
    """Move times of closed curves between the knots by whole periods, and raise for others outside the knots."""
    if outside not in ("periodic", "continue"):
        return times, per_curve
    knots, batch = spline._times, spline._batch
    first, last = knots[..., 0], knots[..., -1]
    if knots.ndim > 1:
        shape = times.shape[len(batch) :] if per_curve else times.shape
        first, last = (end.reshape(batch + (1,) * len(shape)) for end in (first, last))
        per_curve = True
    if outside == "periodic":
        within = (times >= first) & (times <= last)
        return np.where(within, times, first + np.mod(times - first, last - first)), per_curve
    if np.any((times < first) | (times > last)):
        raise ValidationError(
            "Standard errors are available between the knots only. Pass times between them, or extrapolate=False for "
            "NaN outside."
        )
    return np.broadcast_to(times, np.broadcast_shapes(times.shape, np.shape(first))), per_curve


def _motions(spline: AnySmoothingSpline, times: Doubles, parts: list[int], per_curve: bool) -> list[Motion]:
    """Return points, velocities and frames of parts, with all batch axes and axes of times in one."""
    velocities: list[Array] = []
    for factor, curve in zip(factors_of(spline.space), spline._curve.parts, strict=True):
        velocities += split(factor, curve.evaluate(times, "velocity", "raise", per_curve))
    frames_of_parts = spline._frames(times, per_curve)
    spaces, motions = smoothed_spaces(spline.space), []
    for part in parts:
        space, (p, frames) = spaces[part], frames_of_parts[part]
        shape = space.point_shape
        rows = frames.reshape(-1, space.dim, *shape)
        motions.append(Motion(p.reshape(-1, *shape), velocities[part].reshape(-1, *shape), rows))
    return motions
