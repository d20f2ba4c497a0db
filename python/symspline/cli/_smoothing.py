"""The options of ``symspline fit --smooth``, and its summary."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from .._smoothing import SmoothingSpline
from .._spaces import factors_of
from ._errors import Problem, refuse
from ._times import is_number

_CRITERIA = ("gcv", "reml")
_BEST = "best"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``symspline fit`` for noisy data."""
    add = parser.add_argument_group("noisy data").add_argument
    add(
        "--smooth",
        nargs="?",
        const=_BEST,
        metavar="HOW",
        help="smooth the points; write it after IN. HOW is gcv (default; with --sigma Mallows' C_p), reml, or a number "
        "λ >= 0, in a product perhaps one per factor with commas",
    )
    add(
        "--sigma",
        metavar="S",
        help="known standard deviation of the noise in a coordinate: in the unit of distances, radians for rotations, "
        "degrees with --lonlat; in a product perhaps one per factor with commas",
    )
    add("--robust", action="store_true", help="reduce the influence of outliers (loss 'cauchy')")


def smoothing_options(options: argparse.Namespace) -> dict[str, Any] | None:
    """Return the options of `symspline.make_smoothing_spline`; None to fit curves through the points.

    Raises
    ------
    Problem
        Options contradict each other.
    """
    how = options.smooth
    if how is None:
        option = "--sigma" if options.sigma is not None else "--robust" if options.robust else None
        refuse(option, (option, " is for noisy data; give --smooth, too"))
        return None
    through = "is for curves through the points; omit it with --smooth"
    bad = [cell for cell in how.split(",") if not is_number(cell)] if how not in (_BEST, *_CRITERIA) else []
    choices = f"give {', '.join(_CRITERIA)} or a number; write the name of the table before --smooth"
    refuse(
        "",
        (options.bc_type != "natural", f"--bc-type {options.bc_type} {through}: smoothing has natural ends"),
        (options.tol is not None, f"--tol {through}"),
        (options.method != "auto", f"--method {through}"),
        (options.dedup == "mean", "with --smooth all points of one time count; omit --dedup mean"),
        (bad, f"--smooth {how}: {choices}"),
    )
    lam = None if how in (_BEST, *_CRITERIA) else _numbers(how, "--smooth")
    sigma = None if options.sigma is None else _numbers(options.sigma, "--sigma")
    if sigma is not None and not np.all(np.greater(sigma, 0)):
        raise Problem(f"--sigma {options.sigma}: the standard deviation must be greater than 0")
    if options.lonlat and isinstance(sigma, float):
        sigma = math.radians(sigma)
    criterion = how if how in _CRITERIA else "cp" if how == _BEST and sigma is not None else "gcv"
    loss = "cauchy" if options.robust else "linear"
    return {"criterion": criterion, "lam": lam, "sigma": sigma, "loss": loss}


def _numbers(text: str, option: str) -> Any:
    """A number, or a tuple of several."""
    cells = text.split(",")
    refuse(f"{option} {text}: ", (not all(map(is_number, cells)), "give a number such as 0.1"))
    values = tuple(map(float, cells))
    bad = [value for value in values if not 0 <= value < np.inf]
    refuse(f"{option} {text}: ", (bad, f"{next(iter(bad), 0):g} is not a finite number >= 0"))
    return values if len(values) > 1 else values[0]


def summary(splines: Sequence[SmoothingSpline], lonlat: bool) -> str:
    """Summarise smoothing splines in one line."""
    data = sum(len(spline.data[0]) for spline in splines)
    curves = f"{len(splines)} curve{'s' if len(splines) > 1 else ''}"
    reports = [spline.report if isinstance(spline.report, tuple) else (spline.report,) for spline in splines]
    spaces = factors_of(splines[0].space)
    parts = []
    # A pose has a report for its rotation and one for its position, of which the first is shown.
    for space, own in zip(spaces, zip(*reports, strict=True), strict=False):
        bound = sum(bool(report.at_bound) for report in own)
        rough = sum(bool(report.at_bound) and report.df > 2.5 for report in own)
        at_bound = " (at its bound)" if len(own) == 1 else f" ({bound} at a bound)"
        through = "the curve passes" if len(own) == 1 else f"{rough} curves pass"
        no_noise = f" (no noise was found: {through} through the points; give --sigma or a λ)"
        parts.append(
            f"{f'{space}: ' if len(spaces) > 1 else ''}λ {_range([report.lam for report in own])}"
            f"{at_bound if bound else ''}, {_range([report.df for report in own])} degrees of freedom, noise "
            f"{_range([np.degrees(report.sigma) if lonlat else report.sigma for report in own])}"
            f"{'°' if lonlat else ''}{no_noise if rough else ''}"
        )
    return f"{curves} near {data} points of {splines[0].space}, converged: {'; '.join(parts)}"


def _range(values: Sequence[float]) -> str:
    least, most = f"{min(values):.3g}", f"{max(values):.3g}"
    return least if least == most else f"{least} to {most}"
