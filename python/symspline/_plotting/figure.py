"""The figure: a heading, the picture of the space, and speed and acceleration against time.

To give a new space its picture, add a drawing function and a line of `_DRAWN`, or of `_FAMILIES` for spaces of all
sizes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from io import BytesIO
from textwrap import shorten
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure, SubFigure

from .._arrays import short_repr
from .._core import ValidationError
from .._disk import path_of, replacing
from .._spaces import Product, Space, SpecialEuclidean, cover_of, factors_of
from . import chart, graphs, matrices, residuals, sphere
from .curves import Curve, curves_of, fill_band
from .graphs import timelines
from .style import DPI, INK, heading

_HEAD, _RATES_WIDTH, _RATES_HEIGHT = 0.95, 5.8, 4.0
FACTORS = 6
"""The largest number of factors of a product that are drawn."""
_NORMAL = 1.96
"""Half width of the 95 % interval of a normal distribution, in standard deviations."""


class Picture(NamedTuple):
    """The picture of a space.

    Attributes
    ----------
    draw : callable
        Draws curves into a panel of any size.
    width, height : float
        Size of the panel in inches if the picture is the only one. Speed and acceleration are beside the panel, or
        below a panel that is much wider than high.
    """

    draw: Callable[[SubFigure, Sequence[Curve]], None]
    width: float = 5.2
    height: float = 5.2


_GRAPH, _ROWS = (10.5, 3.2), (10.5, 3.6)
_DRAWN: list[tuple[str, Callable[[SubFigure, Sequence[Curve]], None], tuple[float, ...]]] = [
    ("euclidean:1", graphs.draw_graph, _GRAPH),
    ("euclidean:2", chart.draw_plane, ()),
    ("euclidean:3", chart.draw_3d, ()),
    ("sphere:1", graphs.draw_circle, _GRAPH),
    ("sphere:2", sphere.draw_sphere, (11.4, 4.6)),
    ("sphere:3", matrices.draw_quaternions, _ROWS),
    ("hyperbolic:2", chart.draw_disk, ()),
    ("rp:1 gr:1,2", graphs.draw_slope, _GRAPH),
    ("rp:2 gr:1,3", sphere.draw_lines, ()),
    ("gr:2,3", sphere.draw_normals, ()),
    ("cp:1 cgr:1,2", sphere.draw_bloch, ()),
    ("so:2 o:2", graphs.draw_turn, _GRAPH),
    ("so:3 o:3", matrices.draw_rotations, _ROWS),
    ("u:1", graphs.draw_phase, _GRAPH),
    ("su:2", matrices.draw_spins, _ROWS),
    ("spd:2", matrices.draw_ellipses, _ROWS),
    ("spd:3", matrices.draw_ellipsoids, _ROWS),
    ("se:2", matrices.draw_flat_poses, ()),
    ("se:3", matrices.draw_poses, (6.2, 5.8)),
]
_PICTURES = {name: Picture(draw, *size) for names, draw, size in _DRAWN for name in names.split()}
_FAMILIES = dict.fromkeys(("rp", "cp", "hp", "gr", "cgr"), Picture(graphs.draw_principal_angles, 10.5, 3.8))
_FAMILIES["ch"] = Picture(graphs.draw_ratios, 10.5, 3.8)
# Spaces whose picture shows the band.
_BANDED = {"euclidean:1", "euclidean:2", "euclidean:3", "hyperbolic:2", "sphere:1", "sphere:2"}
_BANDED |= {"rp:1", "gr:1,2", "so:2", "o:2", "u:1"}
_OTHERS = Picture(graphs.draw_components, 10.5, 3.8)


def picture_of(space: Space) -> Picture:
    """Return the picture of a space or its family, or graphs of the components if there is none."""
    name = str(cover_of(space))
    return _PICTURES.get(name) or _FAMILIES.get(name.partition(":")[0], _OTHERS)


class CurveFigure(Figure):
    """A figure that notebooks show although it does not belong to pyplot."""

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        self.savefig(buffer, format="png")
        return buffer.getvalue()


def plot(spline: Any, file: Any = None, radius: float | None = None) -> Figure:
    """Draw the figure of a spline, and save it if ``file`` is given. See `symspline.CubicSpline.plot`.

    The radius in metres is that of the Earth, if a curve on S² is one of longitude and latitude.
    """
    curves, words = curves_of(spline)
    picture = _of_factors(curves) if isinstance(spline.space, Product) else picture_of(spline.space)
    if radius is not None:
        picture = picture._replace(draw=partial(sphere.draw_earth, radius))
    wide = picture.width > 1.5 * picture.height
    widths = [picture.width] if wide else [picture.width, _RATES_WIDTH]
    heights = [_HEAD, picture.height, _RATES_HEIGHT][: 3 if wide else 2]
    panels = residuals.panels_of(spline, curves[0], [str(cover_of(own)) in _BANDED for own in factors_of(spline.space)])
    if panels:
        heights.append(residuals.height(panels))
    figure = CurveFigure(figsize=(sum(widths), sum(heights)), dpi=DPI, facecolor="white")
    grid = figure.add_gridspec(len(heights), len(widths), width_ratios=widths, height_ratios=heights)
    title = shorten(f"{spline._kind} on {spline.space!r}", int(6 * sum(widths)), placeholder=" …")
    heading(figure, title, words + _description(spline, curves), 1 - 0.5 / sum(heights))
    picture.draw(figure.add_subfigure(grid[1, 0]), curves)
    _draw_rates(figure.add_subfigure(grid[2, 0] if wide else grid[1, 1]), curves, radius)
    if panels:
        residuals.draw(figure.add_subfigure(grid[-1, :]), curves[0], panels)
    if file is not None:
        save(figure, file)
    return figure


def save(figure: Figure, file: Any) -> None:
    """Write a figure to an open file, or to a path whose suffix selects the format."""
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
            f"file = {short_repr(str(path))}: the name of a picture must end in .{', .'.join(sorted(known))}"
        )
    with replacing(path) as temporary:
        figure.savefig(temporary, format=ending)


def _description(spline: Any, curves: Sequence[Curve]) -> str:
    """Describe the data, the convergence of the solver, the number of curves with bands, and the number of gaps."""
    words = [spline._made_of]
    factors = len(factors_of(spline.space))
    if factors > FACTORS:
        words.append(f"{FACTORS} of {factors} factors")
    if spline._unconverged:
        words.append(f"{spline._unconverged} not converged" if spline._curve.batch else "not converged")
    if curves[0].noise is not None:
        banded = sum(curve.shown for curve in curves)
        words.append("band 95 %" if banded == len(curves) else f"data and 95 % bands of {banded}")
    gaps = sum(len(curve.gaps) for curve in curves)
    if gaps:
        words.append(f"{gaps} long gap{'s' if gaps > 1 else ''}")
    return ", ".join(words)


def _draw_rates(panel: SubFigure, curves: Sequence[Curve], radius: float | None) -> None:
    """Draw |γ'| and |∇γ'| of every curve, and the band of the speed if the noise is known.

    On the Earth they are in km/h and m/s², or in km per unit of time.
    """
    no_dates = curves[0].time_name == "t"
    per = ("", "") if no_dates else (", 1/s", ", 1/s²")
    scales = (1.0, 1.0)
    # Rigid motions have no invariant lengths, see `SpecialEuclidean`.
    rigid = isinstance(curves[0].space, SpecialEuclidean)
    first, second = ("|(ω, v)|", "|(ω′, v′)|") if rigid else ("|γ′|", "|∇γ′|")
    names = [f"{first}{per[0]}", f"{second}{per[1]}"]
    if radius is not None:
        names = ["km per unit of t", "km per unit of t²"] if no_dates else ["km/h", "m/s²"]
        scales = (radius / 1000,) * 2 if no_dates else (3.6 * radius, radius)
    upper, lower = timelines(panel, curves, [f"speed\n{names[0]}", f"acceleration\n{names[1]}"])
    top = highest = rounding = 0.0
    for curve in curves:
        speed, bend = scales[0] * curve.at("speed"), scales[1] * curve.at("bend")
        look: Any = {"color": curve.color, "linewidth": 1.8 if curve.alone else 1.1}
        upper.plot(curve.times, speed, **look)
        lower.plot(curve.times, bend, **look)
        top, highest = max(top, speed.max()), max(highest, bend.max())
        # Rounding errors of points between the closest knots, which a curve at rest has.
        points = curve.data.points if isinstance(curve.space, Product) else (curve.data.points,)
        size = max(np.abs(part).max() for part in points)
        rounding = max(rounding, 1e-15 * scales[0] * size / np.diff(curve.data.times).min())
        if curve.noise is not None and curve.noise.speed is not None and curve.shown:
            spread = scales[0] * _NORMAL * curve.noise.speed
            fill_band(upper, curve, np.maximum(speed - spread, 0), speed + spread)
            top = max(top, (speed + spread).max())
    top = top if top > rounding else 1.0
    unit = top / max(curve.x[-1] - curve.x[0] for curve in curves)
    upper.set_ylim(0, 1.08 * top)
    # Rounding errors of a geodesic, whose acceleration is 0, are not magnified.
    lower.set_ylim(0, 1.08 * (highest if highest > 1e-9 * unit else unit))


def _of_factors(curves: Sequence[Curve]) -> Picture:
    """Return the picture of a product space, which has the pictures of its factors."""
    factors = factors_of(curves[0].space)[:FACTORS]
    rows = 1 if len(factors) <= 3 else 2
    columns = -(-len(factors) // rows)

    def draw(panel: SubFigure, curves: Sequence[Curve]) -> None:
        cells = np.asarray(panel.subfigures(2 * rows, columns, height_ratios=[0.3, 4.3] * rows))
        for i, factor in enumerate(factors):
            row, column = divmod(i, columns)
            caption, cell = cells[2 * row : 2 * row + 2, column]
            caption.text(0.5, 0.3, repr(factor), ha="center", color=INK, fontsize=12)
            picture_of(factor).draw(cell, [curve.part(i) for curve in curves])

    return Picture(draw, 4.8 * columns, 4.6 * rows)
