"""Errors and warnings about curves that failed, or that are close to a cut locus."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._core import ConvergenceError, CutLocusError, ValidationError
from ._faults import CUT_LOCUS, Fault
from ._report import ConvergenceWarning
from ._warnings import warn

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
        first = _explained_by_close_times(failed[0], batch, spline)
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


def _explained_by_close_times(fault: Fault, batch: tuple[int, ...], spline: Any) -> Fault:
    """Return the fault with a remedy that names two times too close together for their points, if there are any.

    The first of the two times becomes the node of a fault that has none.

    Notes
    -----
    An interval of length h between points at a distance d requires the speed d/h at both of its ends. Where h is far
    shorter than its neighbours, this speed moves the curve in them much farther than their points are apart.
    """
    if not fault.about_times:
        return fault
    single = isinstance(spline, (list, tuple))
    curve = spline[fault.curve] if single else spline
    index = np.unravel_index(fault.curve, batch) if batch and not single else ()
    h = np.diff(curve._times[index] if curve._times.ndim > 1 else curve._times)
    if len(h) < 2:
        return fault
    around = np.minimum(np.append(np.inf, h[:-1]), np.append(h[1:], np.inf))
    i = int(np.argmax(around / h))
    steps = []
    for part in curve._curve.parts:
        points = part.points[index]
        with np.errstate(all="ignore"):
            try:
                own = np.asarray(part.space.distance(points[:-1], points[1:]))
            except (CutLocusError, ValidationError):
                return fault
        if not own.max() <= 0.5 * part.space.injectivity_radius:
            return fault
        steps.append(own)
    step = np.linalg.norm(steps, axis=0)
    if not (around[i] > _CLOSE * h[i] and step[i] / h[i] > _CLOSE * np.median(step / h)):
        return fault
    t = curve._t[index] if curve._t.ndim > 1 else curve._t
    remedy = (
        f"t[{i}] = {t[i]} and t[{i + 1}] = {t[i + 1]} are too close for the distance {step[i]:.3g} between "
        "their points: merge the two samples, smooth the data with make_smoothing_spline, or correct the times"
    )
    return fault._replace(remedy=remedy, node=i if fault.node is None else fault.node)


def _more(faults: list[Fault], what: str) -> str:
    return f" (and {len(faults) - 1} more {what})" if len(faults) > 1 else ""
