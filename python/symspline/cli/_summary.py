"""Descriptions of fitted curves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from .._base.report import long_gaps
from .._smoothing import SmoothingReport, SmoothingSpline
from .._smoothing.noise import is_several, smoothed_spaces
from .._spaces import Doubles
from .._splines.cubic import CubicSpline

# Residuals may exceed the given standard deviations by this factor without a note.
_FACTOR = 2.0
_ROUGH = 2.5
"""Degrees of freedom from which on a curve is not a geodesic."""


def counted(count: int, what: str) -> str:
    """Return a count with its noun, such as "2 curves"."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def spread(values: Sequence[Any]) -> str:
    """Return the range of some numbers."""
    least, most = f"{min(values):.3g}", f"{max(values):.3g}"
    return least if least == most else f"{least} to {most}"


def gaps_in(recordings: Iterable[Doubles], unit: str) -> str:
    """Describe the steps that are far longer than most of a recording; empty if there are none."""
    found = np.concatenate([np.diff(times)[long_gaps(times)] for times in recordings])
    return f"{counted(found.size, 'long gap')}, up to {found.max():.6g}{unit}" if found.size else ""


def _reports(splines: Sequence[SmoothingSpline[Any, Any]]) -> list[tuple[str, list[SmoothingReport]]]:
    """Return the reports of all curves for every space in which they were smoothed, which is named if several are."""
    space = splines[0].space
    reports = [spline.report if is_several(space) else (spline.report,) for spline in splines]
    names = [f"{part}: " if is_several(space) else "" for part in smoothed_spaces(space)]
    return [(name, list(own)) for name, own in zip(names, zip(*reports, strict=True), strict=True)]


def fitted(splines: Sequence[CubicSpline], lonlat: bool) -> str:
    """Describe curves through points, or near them."""
    smooth = [spline for spline in splines if isinstance(spline, SmoothingSpline)]
    points = sum(len(spline.data[0]) for spline in smooth) or sum(len(spline.t) for spline in splines)
    where = "near" if smooth else "through"
    words = f"{counted(len(splines), 'curve')} {where} {points} points of {splines[0].space}, converged: "
    if smooth:
        return words + smoothed(smooth, lonlat)
    reports = [spline.report for spline in splines]
    most = "at most " if len(splines) > 1 else ""
    iterations, residual = max(r.iterations for r in reports), max(r.residual for r in reports)
    return f"{words}{reports[0].method}, {most}{iterations} iterations, residual {most}{residual:.1e}"


def smoothed(splines: Sequence[SmoothingSpline[Any, Any]], lonlat: bool) -> str:
    """Describe λ, the degrees of freedom and the noise, which is in degrees with ``lonlat``."""
    return "; ".join(_chosen(name, own) + _noise(own, lonlat) for name, own in _reports(splines))


def _chosen(name: str, own: Sequence[SmoothingReport]) -> str:
    """Describe λ and the degrees of freedom."""
    bound = sum(bool(report.at_bound) for report in own)
    at_bound = "" if not bound else " (at its bound)" if len(own) == 1 else f" ({bound} at a bound)"
    degrees = spread([report.df for report in own])
    return f"{name}λ {spread([report.lam for report in own])}{at_bound}, {degrees} degrees of freedom"


def _noise(own: Sequence[SmoothingReport], lonlat: bool) -> str:
    rough = sum(bool(report.at_bound) and report.df > _ROUGH for report in own)
    through = "the curve passes" if len(own) == 1 else f"{rough} curves pass"
    advice = f" (no noise was found: {through} through the points; give --sigma or a λ)" if rough else ""
    noise = spread([np.degrees(report.sigma) if lonlat else report.sigma for report in own])
    return f", noise {noise}{'°' if lonlat else ''}{advice}"


def bridged(splines: Sequence[CubicSpline]) -> str:
    """Describe the gaps across which curves pass although nothing was measured there."""
    gaps = gaps_in(map(_data_times, splines), " s" if splines[0].t.dtype.kind == "M" else "")
    return f"; {gaps} (--max-gap cuts there)" if gaps else ""


def _data_times(spline: CubicSpline) -> Doubles:
    if isinstance(spline, SmoothingSpline):
        return np.unique(spline._noisy.times[spline._noisy.used])
    return spline._times


def estimated(
    curves: Mapping[str, SmoothingSpline[Any, Any]], named: bool, counts: Sequence[int], omitted: int
) -> list[str]:
    """Describe curves from points, rates and velocities in one line for all, and one per bias."""
    splines = list(curves.values())
    kinds = zip(counts, ("points", "rates", "velocities"), strict=True)
    given = [f"{count} {kind}" for count, kind in kinds if count]
    near = " and ".join([*filter(None, [", ".join(given[:-1])]), given[-1]])
    reports = _reports(splines)
    # All spaces share one factor.
    sizes = [report.sigma for report in reports[0][1]]
    advice = " (check --sigma, --rate-sigma and --velocity-sigma)" if max(sizes) > _FACTOR else ""
    rows = f"; {counted(omitted, 'row')} without measurements omitted" if omitted else ""
    lines = [
        f"{counted(len(curves), 'curve')} near {near} on {splines[0].space}, converged: "
        f"{'; '.join(_chosen(name, own) for name, own in reports)}; residuals {spread(sizes)} times the given "
        f"standard deviations{advice}{rows}"
    ]
    for name, curve in curves.items():
        of = f" of curve {name!r}" if named else ""
        lines += parameters_of(curve, of)
    return lines


def parameters_of(curve: SmoothingSpline[Any, Any], of: str = "") -> list[str]:
    """Describe the unknowns that were estimated with a curve, such as a bias."""
    each = {key: zip(found.value, found.std, strict=True) for key, found in curve.parameters.items()}
    return [f"{key}{of}: {', '.join(f'{value:.3g} ± {std:.2g}' for value, std in own)}" for key, own in each.items()]
