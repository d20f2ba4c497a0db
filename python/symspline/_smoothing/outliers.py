"""Warnings about the data that a robust loss rejects."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.warnings import warn
from .._spaces import Space
from .report import SmoothingReport
from .warned import SmoothingWarning, first_affected

# Kinds of selections that cannot be trusted, as numbered in `Selection` of the core.
_INTERPOLATED, _UNSETTLED, _FEW, _PULLED = 1, 2, 3, 4


class Outliers(NamedTuple):
    """Outcome of the rejection of data, for each curve.

    Attributes
    ----------
    selection : int or ndarray of int
        Kind of the selection: 0 if it can be trusted or the loss is not robust.
    rejected : int or ndarray of int
        Number of data that were not selected.
    """

    selection: Any
    rejected: Any

    def map(self, function: Callable[[Any], Any]) -> Outliers:
        """Apply a function to both arrays, such as one that selects some curves."""
        return Outliers(function(self.selection), function(self.rejected))


def warn_of_outliers(
    space: Space, loss: str, each: list[Outliers], reports: list[SmoothingReport], counts: list[Any]
) -> list[NDArray[np.bool_]]:
    """Warn once if the data that were rejected from a curve may be the wrong ones.

    Parameters
    ----------
    each : list of Outliers
        Outcomes in every space in which data were smoothed.
    reports : list of SmoothingReport
        Reports of the same.
    counts : list of ndarray of int
        Number of data of each curve.

    Returns
    -------
    list of ndarray of bool
        Whether the selection of each curve in every space can be trusted, so that other warnings apply.
    """
    sound = [np.asarray(own.selection) == 0 for own in each]
    bad = [~good & np.asarray(report.converged) for good, report in zip(sound, reports, strict=True)]
    # Data without noise, such as those of a body at rest, contain no outliers.
    exact = [(np.asarray(own.rejected) == 0) & ~(np.asarray(r.sigma) > 0) for own, r in zip(each, reports, strict=True)]
    bad = [own & ~still for own, still in zip(bad, exact, strict=True)]
    if first := first_affected(space, bad):
        number, index, of = first
        kind, rejected = (int(np.asarray(one)[index]) for one in each[number])
        df = float(np.asarray(reports[number].df)[index])
        data = int(np.broadcast_to(counts[number], bad[number].shape)[index])
        warn(_message(kind, f"The smoothing{of} with loss={loss!r}", rejected, df, data), SmoothingWarning, index)
    return sound


def _message(kind: int, what: str, rejected: int, df: float, count: int) -> str:
    if kind == _INTERPOLATED:
        return (
            f"{what} follows nearly all data ({df:.3g} degrees of freedom for {count} data): their noise is smaller "
            f"than their sampling can show. It rejected {rejected} data that deviate far more than others, and cannot "
            "find smaller outliers. Its standard deviations are only valid if the data are that accurate. Pass sigma= "
            "to find smaller outliers, or sample more often."
        )
    if kind == _UNSETTLED:
        return (
            f"{what} could not determine which data are outliers: the selection alternates between two sets of data. "
            f"The last one rejects {rejected} of {count} data. Plot the residuals, and pass sigma=, or weights of 0 "
            "for the wrong data."
        )
    if kind == _PULLED:
        return (
            f"{what} has an outlier that moves the curve by more than five standard deviations, because there are no "
            "other data near it. Pass loss='cauchy', or weights of 0 for outliers in gaps."
        )
    return (
        f"{what} rejects many data: {rejected} of {count} data are far from the curve. If these are not outliers, the "
        "noise varies along the recording, or the data belong to several curves. Plot the residuals, and pass sigma= "
        "or weights=."
    )
