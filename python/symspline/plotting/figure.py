"""The figure: a heading, the picture of the space, and speed and acceleration against time."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from textwrap import shorten
from typing import Any

import numpy as np
from matplotlib.figure import Figure, SubFigure

from .._core import ValidationError
from ..arrays import shown
from ..disk import path_of, replacing
from ..spaces import Product, SpecialEuclidean, factors_of
from .bands import ALPHA
from .curves import Curve, Spline, curves_of
from .pictures import Picture, picture_of
from .style import DPI, INK, heading
from .timeline import timelines

_HEAD, _RATES_WIDTH, _RATES_HEIGHT = 0.95, 5.8, 4.0
_FACTORS = 6
_NORMAL = 1.96
"""A normal variable is nearer to its mean than so many deviations with probability 95 %."""


class CurveFigure(Figure):
    """A figure that notebooks show although pyplot does not know it."""

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        self.savefig(buffer, format="png")
        return buffer.getvalue()


def plot(spline: Spline, file: Any = None) -> Figure:
    """The figure of a spline, saved if ``file`` is given. See `symspline.CubicSpline.plot`."""
    curves, words = curves_of(spline)
    picture = _of_factors(curves) if isinstance(spline.space, Product) else picture_of(spline.space)
    wide = picture.width > 1.5 * picture.height
    if wide:
        widths, heights = [picture.width], [_HEAD, picture.height, _RATES_HEIGHT]
    else:
        widths, heights = [picture.width, _RATES_WIDTH], [_HEAD, picture.height]
    figure = CurveFigure(figsize=(sum(widths), sum(heights)), dpi=DPI, facecolor="white")
    grid = figure.add_gridspec(len(heights), len(widths), width_ratios=widths, height_ratios=heights)
    title = shorten(f"{spline._kind} on {spline.space!r}", int(6 * sum(widths)), placeholder=" …")
    heading(
        figure, title, words + _description(spline) + _noise(curves) + _gaps(curves), 1 - 0.5 / sum(heights)
    )
    picture.draw(figure.add_subfigure(grid[1, 0]), curves)
    _draw_rates(figure.add_subfigure(grid[2, 0] if wide else grid[1, 1]), curves)
    if file is not None:
        save(figure, file)
    return figure


def save(figure: Figure, file: Any) -> None:
    """Write a figure to an open file, or replace a file by its name, whose ending says the format."""
    path = path_of(file, method="write")
    if path is None:
        figure.savefig(file)
        return
    known = figure.canvas.get_supported_filetypes()
    ending = path.suffix[1:].lower()
    if not ending:
        ending = figure.canvas.get_default_filetype()
        path = path.with_name(f"{path.name}.{ending}")
    if ending not in known:
        raise ValidationError(
            f"file = {shown(str(path))}: the name of a picture must end in .{', .'.join(sorted(known))}"
        )
    with replacing(path) as temporary:
        figure.savefig(temporary, format=ending)


def _description(spline: Spline) -> str:
    """What it is made of, and whether the solver got there."""
    words = spline._made_of
    factors = len(factors_of(spline.space))
    if factors > _FACTORS:
        words += f", {_FACTORS} of {factors} factors"
    if not spline._unconverged:
        return words
    number = f"{spline._unconverged} " if spline._curve.batch else ""
    return f"{words}, {number}not converged"


def _noise(curves: Sequence[Curve]) -> str:
    """What the light bands are, and how many curves have them."""
    if curves[0].noise is None:
        return ""
    shown = sum(curve.shown for curve in curves)
    return ", band 95 %" if shown == len(curves) else f", data and 95 % bands of {shown}"


def _gaps(curves: Sequence[Curve]) -> str:
    """How many bands mark missing points."""
    number = sum(len(curve.gaps) for curve in curves)
    return f", {number} long gap{'s' if number > 1 else ''}" if number else ""


def _draw_rates(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """|γ'| and |∇γ'| of every curve, and the band of the speed where noise is known."""
    per = ("", "") if curves[0].time_name == "t" else (", 1/s", ", 1/s²")
    # Rigid motions have no invariant lengths, see `SpecialEuclidean`.
    rigid = isinstance(curves[0].space, SpecialEuclidean)
    first, second = ("|(ω, v)|", "|(ω′, v′)|") if rigid else ("|γ′|", "|∇γ′|")
    speed, bend = timelines(panel, curves, [f"speed\n{first}{per[0]}", f"acceleration\n{second}{per[1]}"])
    tops: list[float] = []
    for curve in curves:
        line = {"color": curve.color, "linewidth": 1.8 if curve.alone else 1.1}
        speed.plot(curve.times, curve.speed, **line)
        bend.plot(curve.times, curve.bend, **line)
        if curve.noise is not None and curve.noise.speed is not None and curve.shown:
            spread = _NORMAL * curve.noise.speed
            low, high = np.maximum(curve.speed - spread, 0), curve.speed + spread
            band: Any = {"color": curve.color, "alpha": ALPHA, "linewidth": 0, "label": "band"}
            speed.fill_between(curve.times, low, high, **band)
            tops.append(high.max())
    top = max([curve.speed.max() for curve in curves] + tops) or 1.0
    unit = top / max(curve.x[-1] - curve.x[0] for curve in curves)
    highest = max(curve.bend.max() for curve in curves)
    speed.set_ylim(0, 1.08 * top)
    # The rounding of a geodesic is not blown up.
    bend.set_ylim(0, 1.08 * (highest if highest > 1e-9 * unit else unit))


def _of_factors(curves: Sequence[Curve]) -> Picture:
    """The pictures of a product's factors, side by side."""
    factors = factors_of(curves[0].space)
    shown = factors[:_FACTORS]
    rows = 1 if len(shown) <= 3 else 2
    columns = -(-len(shown) // rows)

    def draw(panel: SubFigure, curves: Sequence[Curve]) -> None:
        cells = np.asarray(panel.subfigures(2 * rows, columns, height_ratios=[0.3, 4.3] * rows))
        for i, factor in enumerate(shown):
            row, column = divmod(i, columns)
            caption, cell = cells[2 * row : 2 * row + 2, column]
            caption.text(0.5, 0.3, repr(factor), ha="center", color=INK, fontsize=12)
            picture_of(factor).draw(cell, [curve.part(i) for curve in curves])

    return Picture(draw, 4.8 * columns, 4.6 * rows)
