"""Warnings about the chosen amount of smoothing."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._errors import warn
from .._spaces import Space
from .factors import is_several, smoothed_spaces

# Ratio of the degrees of freedom to the number of data from which a curve follows nearly all data.
_ALL = 0.9


class SmoothingWarning(UserWarning):
    """Warning that the chosen λ is at a bound: the curve follows nearly all data or has no bending energy."""


def warn_of_bounds(space: Space, reports: list[Any], chosen: list[Any], counts: list[Any]) -> None:
    """Warn once if a chosen λ is at a bound, or close to it.

    Parameters
    ----------
    reports : list of SmoothingReport
        Reports of every space in which data were smoothed.
    chosen : list of ndarray of bool
        Whether λ was chosen from the data, for each curve.
    counts : list of ndarray of int
        Number of data of each curve.
    """
    spaces = smoothed_spaces(space)
    for number, (report, asked, count) in enumerate(zip(reports, chosen, counts, strict=True)):
        rough = (np.asarray(report.df) > _ALL * count) & (np.asarray(count) > 4)
        good = (np.asarray(report.at_bound) | rough) & np.asarray(report.converged)
        found = np.argwhere(good & np.reshape(asked, good.shape))
        if not len(found):
            continue
        index = tuple(map(int, found[0]))
        of = f" of curve {','.join(map(str, index))}" if index else ""
        of += f" in factor {number}, {spaces[number]!r}" if is_several(space) else ""
        more = f" (and of {len(found) - 1} more curves)" if len(found) > 1 else ""
        warn(
            _message(
                of, more, float(np.asarray(report.df)[index]), bool(rough[index]), report.is_stiff(index)
            ),
            SmoothingWarning,
            index,
        )
        return


def _message(of: str, more: str, df: float, rough: bool, stiff: bool) -> str:
    if stiff:
        return _stiff(of, more, df)
    return _rough(of, more, df) if rough else _least(of, more, df)


def _least(of: str, more: str, df: float) -> str:
    return (
        f"The smoothing{of}{more} chose the smallest lam for which a curve was found ({df:.3g} degrees of freedom). "
        "With less smoothing, the curve would turn too far between two knots. Pass more knots in the gaps of the data, "
        "or cut the recording at its gaps (symspline.fit_segments)."
    )


def _rough(of: str, more: str, df: float) -> str:
    return (
        f"The smoothing{of}{more} chose a lam so small that the curve follows nearly all data ({df:.3g} degrees of "
        "freedom). Its standard deviations are only valid if the data are that accurate. Data at nearly equal times "
        "and correlated noise cause this. Pass a larger gamma, criterion='reml', sigma= with criterion='cp', or lam=."
    )


def _stiff(of: str, more: str, df: float) -> str:
    return (
        f"The smoothing{of}{more} chose the largest lam: the curve is a geodesic ({df:.3g} degrees of freedom). This "
        "is correct for data along a geodesic. Otherwise the true curve bends faster than the data are sampled, or "
        "less than their noise: plot the data, and pass lam= to set the smoothness."
    )
