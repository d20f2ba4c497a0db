"""Warnings about the amount of smoothing that the data ask for."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from .._errors import callers_level
from .._spaces import Space
from .factors import is_several, smoothed_spaces

# Degrees of freedom, over the number of data, from which a curve goes through nearly all of them.
_ALL = 0.9


class SmoothingWarning(UserWarning):
    """The λ that was chosen makes a curve through nearly all data, or one without any bending."""


def warn_of_bounds(space: Space, reports: list[Any], chosen: list[Any], counts: list[Any]) -> None:
    """Warn once if a λ that was chosen lies at a bound, or nearly.

    Args:
        reports: of every space in which data were smoothed.
        chosen: whether λ was chosen there, for each curve.
        counts: the number of data there, for each curve.
    """
    spaces = smoothed_spaces(space)
    for number, (report, asked, count) in enumerate(zip(reports, chosen, counts, strict=True)):
        rough = (np.asarray(report.df) > _ALL * count) & (np.asarray(count) > 4)
        good = (np.asarray(report.at_bound) | rough) & np.asarray(report.converged)
        found = np.argwhere(good & np.reshape(asked, good.shape))
        if not len(found):
            continue
        index = tuple(found[0])
        of = f" of curve {','.join(map(str, index))}" if index else ""
        of += f" in factor {number}, {spaces[number]!r}" if is_several(space) else ""
        more = f" (and of {len(found) - 1} more curves)" if len(found) > 1 else ""
        warnings.warn(
            _message(
                of, more, float(np.asarray(report.df)[index]), bool(rough[index]), report.is_stiff(index)
            ),
            SmoothingWarning,
            stacklevel=callers_level(),
        )
        return


def _message(of: str, more: str, df: float, rough: bool, stiff: bool) -> str:
    if stiff:
        return _stiff(of, more, df)
    return _rough(of, more, df) if rough else _least(of, more, df)


def _least(of: str, more: str, df: float) -> str:
    return (
        f"The smoothing{of}{more} chose the smallest lam for which a curve was found ({df:.3g} degrees of freedom). "
        "With less smoothing the curve turns too far between two knots. Pass more knots in the gaps of the data, or "
        "cut the recording at its gaps (symspline.fit_segments)."
    )


def _rough(of: str, more: str, df: float) -> str:
    return (
        f"The smoothing{of}{more} chose so small a lam that the curve goes through nearly all data ({df:.3g} degrees "
        "of freedom). Its standard deviations mean nothing unless the data are that good. Data at nearly equal times "
        "and correlated noise cause this. Pass a larger gamma, criterion='reml', sigma= with criterion='cp', or lam=."
    )


def _stiff(of: str, more: str, df: float) -> str:
    return (
        f"The smoothing{of}{more} chose the largest lam: the curve bends nowhere ({df:.3g} degrees of freedom). This "
        "is right for data beside a geodesic. Otherwise the truth bends faster than the data are sampled, or less than "
        "their noise: plot the data, and pass lam= to set the smoothness."
    )
