"""Smoothing splines of different lengths, fitted one after the other."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import Any

from .._base.faults import UNCONVERGED, Fault
from .._base.typing import OnFailure, Progress
from .._base.warnings import warn
from .._core import ConvergenceError, ValidationError
from .._curves.failures import raise_or_warn
from .._curves.options import check_on_failure, check_progress
from .._spaces import Space
from .make import make_smoothing_spline
from .spline import SmoothingSpline


def smooth_many(
    curves: Iterable[tuple[Any, Any, dict[str, Any]]],
    space: Space[Any],
    *,
    on_failure: OnFailure = "raise",
    progress: Progress | None = None,
    **options: Any,
) -> list[SmoothingSpline[Any, Any]]:
    """Fit one spline per curve, each with its own λ.

    Parameters
    ----------
    curves : iterable of tuple
        Times, points and keyword arguments of each curve.
    **options
        Keyword arguments of `make_smoothing_spline` for all curves.

    Raises
    ------
    ValidationError
        If a curve is invalid. The message names the curve.
    ConvergenceError
        If a curve fails. The attribute ``spline`` is the list of all curves.
    """
    check_on_failure(on_failure)
    check_progress(progress)
    given = list(curves)
    found: list[SmoothingSpline[Any, Any]] = []
    faults: list[Fault] = []
    noted: list[tuple[int, Any]] = []
    for number, (t, points, own) in enumerate(given):
        with warnings.catch_warnings(record=True) as seen:
            warnings.simplefilter("always")
            try:
                found.append(make_smoothing_spline(t, points, space, **own, **options))
            except ConvergenceError as error:
                found.append(error.spline)
                faults.append(Fault(number, UNCONVERGED, f"curve {number}: {error}", node=error.node))
            except ValidationError as error:
                raise error._of_curve(number) from None
        noted += [(number, note) for note in seen]
        if progress is not None:
            progress(number + 1, len(given))
    # All curves share one warning of each kind, which begins with the same words. Numbers differ between curves.
    for kind, words in dict.fromkeys(map(_kind, (note for _, note in noted))):
        first, *more = [(number, note) for number, note in noted if _kind(note) == (kind, words)]
        others = f" (and {len(more)} more curves)" if more else ""
        number, note = first
        warn(f"curve {number}: {note.message}{others}", kind, (number,), getattr(note.message, "node", None))
    if faults:
        raise_or_warn(faults, on_failure, found)
    return found


def _kind(note: Any) -> tuple[type[Warning], str]:
    words = [word for word in str(note.message).split() if not any(own.isdigit() for own in word)]
    return note.category, " ".join(words[:4])
