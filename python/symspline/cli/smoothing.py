"""What ``symspline fit --smooth`` asks for, and what it prints."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..smoothing import SmoothingSpline
from ..spaces import Product, Space, SpecialEuclidean, SpecialOrthogonal, factors_of
from .errors import Problem
from .layout import Doubles
from .numbers import is_number

_CRITERIA = ("gcv", "reml")
_BEST = "best"
_ROTATIONS = SpecialOrthogonal(3)


@dataclass(frozen=True)
class Asked:
    """How to smooth.

    Attributes:
        criterion: how λ is chosen, if it is not given.
        lam, sigma: numbers, in a product perhaps tuples with one of every factor, or None; sigma in radians on a globe.
        loss: ``"linear"``, or ``"cauchy"``.
    """

    criterion: str
    lam: Any
    sigma: Any
    loss: str

    @property
    def keywords(self) -> dict[str, Any]:
        """Those of `symspline.make_smoothing_spline`."""
        return dict(vars(self))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``symspline fit`` for noisy data."""
    add = parser.add_argument_group("noisy data").add_argument
    add(
        "--smooth",
        nargs="?",
        const=_BEST,
        metavar="HOW",
        help="a smooth curve near the points, not through them; times may repeat. Write it behind IN. HOW smooth is "
        "chosen from the data by gcv (default; with --sigma it is Mallows' C_p) or reml; or it is a number λ >= 0, in "
        "a product perhaps one of every factor with commas",
    )
    add(
        "--sigma",
        metavar="S",
        help="standard deviation of the noise in a coordinate, if it is known, for --smooth: in the unit of distances, "
        "radians for rotations, degrees with --lonlat; in a product perhaps one of every factor with commas",
    )
    add("--robust", action="store_true", help="points far off count little, for --smooth (loss 'cauchy')")


def asked(options: argparse.Namespace) -> Asked | None:
    """How to smooth; None to fit curves through the points.

    Raises:
        Problem: options do not go together.
    """
    if options.smooth is None:
        for option, given in (("--sigma", options.sigma is not None), ("--robust", options.robust)):
            if given:
                raise Problem(f"{option} is for noisy data; give --smooth, too")
        return None
    if options.bc_type != "natural":
        raise Problem(f"--smooth makes curves with natural ends; leave --bc-type {options.bc_type} out")
    if options.method != "auto" or options.tol is not None:
        option = "--tol" if options.tol is not None else "--method"
        raise Problem(f"{option} is for curves through the points; leave it out with --smooth")
    if options.dedup == "mean":
        raise Problem("with --smooth all points of one time count; leave --dedup mean out")
    sigma = None if options.sigma is None else _numbers(options.sigma, "--sigma", "0.1")
    if sigma is not None and not np.all(np.greater(sigma, 0)):
        raise Problem(f"--sigma {options.sigma}: noise is more than 0")
    if options.lonlat and isinstance(sigma, float):
        sigma = math.radians(sigma)
    loss = "cauchy" if options.robust else "linear"
    how = options.smooth
    if how == _BEST:
        return Asked("gcv" if sigma is None else "cp", None, sigma, loss)
    if how in _CRITERIA:
        return Asked(how, None, sigma, loss)
    if not all(map(is_number, how.split(","))):
        raise Problem(
            f"--smooth {how}: give {', '.join(_CRITERIA)} or a number; where the table is meant, write it in front of "
            "--smooth"
        )
    return Asked("gcv", _numbers(how, "--smooth", "0.5"), sigma, loss)


def _numbers(text: str, option: str, example: str) -> Any:
    """A number, or a tuple of several."""
    cells = text.split(",")
    if not all(map(is_number, cells)):
        raise Problem(f"{option} {text}: give a number such as {example}")
    values = tuple(map(float, cells))
    bad = [value for value in values if not 0 <= value < np.inf]
    if bad:
        raise Problem(f"{option} {text}: {bad[0]:g} is not a number >= 0")
    return values if len(values) > 1 else values[0]


def summary(splines: Sequence[SmoothingSpline], lonlat: bool) -> str:
    """What a user wants to know of all curves."""
    data = sum(len(spline.data[0]) for spline in splines)
    curves = f"{len(splines)} curve{'s' if len(splines) > 1 else ''}"
    reports = [spline.report if isinstance(spline.report, tuple) else (spline.report,) for spline in splines]
    spaces = factors_of(splines[0].space)
    parts = []
    for number, space in enumerate(spaces):
        own = [report[number] for report in reports]
        noise = [np.degrees(report.sigma) if lonlat else report.sigma for report in own]
        bound = sum(bool(report.at_bound) for report in own)
        rough = sum(bool(report.at_bound) and report.df > 2.5 for report in own)
        of = f"{space}: " if len(spaces) > 1 else ""
        parts.append(
            f"{of}λ {_range([report.lam for report in own])}{_at_bound(bound, len(own))}, "
            f"{_range([report.df for report in own])} degrees of freedom, noise {_range(noise)}"
            f"{'°' if lonlat else ''}{_none_found(rough, len(own))}"
        )
    return f"{curves} near {data} points of {splines[0].space}, converged: {'; '.join(parts)}"


def _range(values: Sequence[float]) -> str:
    least, most = f"{min(values):.3g}", f"{max(values):.3g}"
    return least if least == most else f"{least} to {most}"


def _at_bound(count: int, of: int) -> str:
    """A λ that was not found between its bounds is to be looked at."""
    if not count:
        return ""
    return " (at its bound)" if of == 1 else f" ({count} at a bound)"


def _none_found(count: int, of: int) -> str:
    """Of a curve that goes through all of its data nothing was smoothed."""
    if not count:
        return ""
    which = "the curve goes" if of == 1 else f"{count} curves go"
    return f" (no noise was found: {which} through the points, as without --smooth; --sigma or a λ says how much)"


def spread_names(space: Space, nu: int) -> list[str]:
    """The columns of standard deviations: of points and velocities, one per factor, of poses one for place and
    rotation each."""
    if nu > 1:
        return []
    factors, end = factors_of(space), f"_d{nu}" if nu else ""
    return [
        f"std{number if len(factors) > 1 else ''}{part}{end}"
        for number, factor in enumerate(factors, 1)
        for part in (("_position", "_rotation") if isinstance(factor, SpecialEuclidean) else ("",))
    ]


def spreads(spline: SmoothingSpline, x: Any, nu: int, lonlat: bool, quaternion: bool) -> Doubles:
    """These columns at times x, shape (rows, columns), each in the unit of the columns that it stands beside.

    Numbers of a unit quaternion change half as much as the angle of its rotation.
    """
    if nu > 1:
        return np.empty((len(x), 0))
    found = spline.std(x, nu)
    columns: list[Doubles] = []
    each = found if isinstance(spline.space, Product) else (found,)
    half = 2 if quaternion else 1
    for factor, own in zip(factors_of(spline.space), each, strict=True):
        if isinstance(factor, SpecialEuclidean):
            rotation, position = own
            columns += [position, rotation / half]
        else:
            columns.append(own / half if factor == _ROTATIONS else np.degrees(own) if lonlat else own)
    return np.stack(columns, axis=-1)
