"""Errors and warnings about curves that failed, or that are close to a cut locus."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._base.faults import CUT_LOCUS, Fault
from .._base.report import ConvergenceWarning, long_gaps
from .._base.warnings import warn
from .._core import ConvergenceError, CutLocusError, ValidationError
from .._spaces import Array, SpecialEuclidean, SpecialOrthogonal

# The times are considered the reason if an interval is shorter than its neighbours by this factor, and if its speed
# exceeds the median by the same factor.
_CLOSE = 10
_ERRORS: dict[str, type[Exception]] = {CUT_LOCUS: CutLocusError}


def raise_or_warn(faults: list[Fault], on_failure: str, spline: Any) -> None:
    """Raise an error or warn about failed curves, with the fitted curves attached.

    Parameters
    ----------
    faults : list of Fault
        Faults in the order of curves.
    on_failure : {"raise", "warn", "ignore"}
        Policy of the user.
    spline : curve, batch of curves, or list of curves
        The fitted curves, which become the attribute ``spline`` of the error.
    """
    batch = (len(spline),) if isinstance(spline, (list, tuple)) else spline._batch
    failed = [fault for fault in faults if fault.failed]
    if failed and on_failure != "ignore":
        first = _explained_by_times(failed[0], batch, spline)
        message = first.message(batch) + _more(failed, "curves failed")
        if on_failure == "raise":
            error: Any = _ERRORS.get(first.kind, ConvergenceError)(message)
            error.spline = spline
            error.curve = first.batch_index(batch)
            error.node, error.value, error.limit = first.node, first.value, first.limit
            raise error
        warn(message, ConvergenceWarning, first.batch_index(batch), first.node)
    almost = [fault for fault in faults if not fault.failed]
    if almost:
        message = almost[0].message(batch) + _more(almost, "curves")
        warn(message, UserWarning, almost[0].batch_index(batch), almost[0].node)


def _explained_by_times(fault: Fault, batch: tuple[int, ...], spline: Any) -> Fault:
    """Return the fault with a remedy that names two times between which no curve suits the points, if there are any.

    They are either too close together for their points, or the ends of a long gap. The first of them becomes the node
    of a fault that has none.

    Notes
    -----
    An interval of length h between points at a distance d requires the speed d/h at both of its ends. Where h is far
    shorter than its neighbours, this speed moves the curve in them much farther than their points are apart. Where h
    is far longer, the speed of the neighbours moves the curve in it much farther.
    """
    if not fault.about_times:
        return fault
    single = isinstance(spline, (list, tuple))
    curve = spline[fault.curve] if single else spline
    index = np.unravel_index(fault.curve, batch) if batch and not single else ()
    times = curve._times[index] if curve._times.ndim > 1 else curve._times
    h = np.diff(times)
    if len(h) < 2:
        return fault
    found = _steps(curve._curve.parts, index)
    if found is None:
        return fault
    step, turns = found
    around = np.minimum(np.append(np.inf, h[:-1]), np.append(h[1:], np.inf))
    i, longest = int(np.argmax(around / h)), int(np.argmax(h))
    t = curve._t[index] if curve._t.ndim > 1 else curve._t
    close, speed = around[i] / h[i], np.median(step / h)
    is_close = close > _CLOSE and step[i] / h[i] > _CLOSE * speed
    is_gap = long_gaps(times)[longest] and h[longest] * np.median(turns / h) > 0.5
    if is_close and not (is_gap and h[longest] * speed > close * step[i]):
        remedy = (
            f"t[{i}] = {t[i]} and t[{i + 1}] = {t[i + 1]} are too close for the distance {step[i]:.3g} between "
            "their points: merge the two samples, smooth the data with make_smoothing_spline, or correct the times"
        )
    elif is_gap:
        i = longest
        remedy = (
            f"there are no data between t[{i}] = {t[i]} and t[{i + 1}] = {t[i + 1]}, a gap of "
            f"{h[i] / np.median(h):.0f} median steps, in which the curve would go far away: cut it there "
            "(fit_segments), or smooth noisy data (make_smoothing_spline)"
        )
    else:
        return fault
    return fault._replace(remedy=remedy, node=i if fault.node is None else fault.node)


def _steps(parts: Any, index: Any) -> tuple[Array, Array] | None:
    """Return the distances between neighbouring points of a curve, and the largest of them in injectivity radii.

    The result is None if neighbours are close to a cut locus, which is then the reason of the fault.
    """
    steps, ratios = [], []
    for part in parts:
        space, points = part.space, part.points[index]
        if isinstance(space, SpecialEuclidean):
            # The cut locus limits rotations only.
            limited, own = SpecialOrthogonal(space.point_shape[0] - 1), np.ascontiguousarray(points[..., :-1, :-1])
        else:
            limited, own = space, points
        with np.errstate(all="ignore"):
            try:
                steps.append(np.asarray(space.distance(points[:-1], points[1:])))
                ratios.append(limited.distance(own[:-1], own[1:]) / limited.injectivity_radius)
            except (CutLocusError, ValidationError):
                return None
    turns = np.max(ratios, axis=0)
    return (np.linalg.norm(steps, axis=0), turns) if turns.max() <= 0.5 else None


def _more(faults: list[Fault], what: str) -> str:
    return f" (and {len(faults) - 1} more {what})" if len(faults) > 1 else ""
