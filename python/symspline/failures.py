"""What is done about curves that failed, or that may go the wrong way round."""

from __future__ import annotations

import os
import sys
import warnings
from typing import Any

import numpy as np

from ._core import ConvergenceError, CutLocusError, ValidationError
from .curves.solve import ALMOST_CUT, Fault, failures
from .report import ConvergenceWarning

_PACKAGE = os.path.dirname(__file__)
# How messages of the solver go on that blame long steps, or unsuitable times, as it does not look for the reason.
_ADVICE_ON_STEPS, _ADVICE_ON_TIMES = "; put more points ", "; give times "
# So many times shorter than its neighbours an interval is for the times to be the reason, and so many times faster.
_CLOSE = 10
_FAULTS: dict[str, type[Exception]] = {"cut-locus": CutLocusError, "unconverged": ConvergenceError}


def fail(faults: list[Fault], on_failure: str, spline: Any) -> None:
    """Raise or warn, with the good curves attached."""
    failed = failures(faults)
    if failed and on_failure != "ignore":
        number, kind, message = failed[0]
        failed[0] = number, kind, _with_close_times(message, number, spline)
    if failed and on_failure == "raise":
        _, kind, message = failed[0]
        error: Any = _FAULTS[kind](message + _more(failed, "curves failed"))
        error.spline = spline
        raise error
    if failed and on_failure == "warn":
        message = failed[0][2] + _more(failed, "curves failed")
        warnings.warn(message, ConvergenceWarning, stacklevel=callers_level())
    if len(failed) < len(faults):
        almost = [fault for fault in faults if fault[1] == ALMOST_CUT]
        warnings.warn(almost[0][2] + _more(almost, "curves"), UserWarning, stacklevel=callers_level())


def _with_close_times(message: str, number: int, spline: Any) -> str:
    """The message of a failure whose reason is that two times lie too close together for their points; it names them.

    Parameters
    ----------
    message : str
        What the solver says.
    number : int
        Of the curve that failed.
    spline : curve, batch of curves, or list of curves
        What was fitted.

    Notes
    -----
    An interval of length h between points at a distance d asks for the speed d/h at both of its ends. Where h is far
    shorter than its neighbours, this speed carries the curve in them much farther than their points are apart.
    """
    what, found, _ = message.partition(_ADVICE_ON_STEPS)
    if not found:
        what, found, _ = message.partition(_ADVICE_ON_TIMES)
    if not found:
        return message
    curve = spline[number] if isinstance(spline, (list, tuple)) else spline
    index = np.unravel_index(number, curve._batch) if curve._batch else ()
    h = np.diff(curve._times[index] if curve._times.ndim > 1 else curve._times)
    around = np.minimum(np.append(np.inf, h[:-1]), np.append(h[1:], np.inf))
    if len(h) < 2:
        return message
    i = int(np.argmax(around / h))
    steps = []
    for part in curve._curve.parts:
        points = part.points[index]
        with np.errstate(all="ignore"):
            try:
                own = np.asarray(part.space.distance(points[:-1], points[1:]))
            except (CutLocusError, ValidationError):
                return message
        if not own.max() <= 0.5 * part.space.injectivity_radius:
            return message
        steps.append(own)
    step = np.linalg.norm(steps, axis=0)
    if not (around[i] > _CLOSE * h[i] and step[i] / h[i] > _CLOSE * np.median(step / h)):
        return message
    t = curve._t[index] if curve._t.ndim > 1 else curve._t
    return (
        f"{what}; t[{i}] = {t[i]} and t[{i + 1}] = {t[i + 1]} are too close for the distance {step[i]:.3g} between "
        "their points: merge the two samples, smooth the data with make_smoothing_spline, or correct the clock"
    )


def _more(faults: list[Fault], what: str) -> str:
    return f" (and {len(faults) - 1} more {what})" if len(faults) > 1 else ""


def callers_level() -> int:
    """How many frames up the code is that called this package."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame, level = frame.f_back, level + 1
    return level
