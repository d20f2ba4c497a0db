"""The picture of every space, and figures as files and windows.

To give a new space its picture, add a drawing function and a line of `_DRAWN`, or of `_FAMILIES` for spaces of all
sizes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rcParams
from matplotlib.figure import Figure, SubFigure

from .._base.arrays import short_repr
from .._base.disk import path_of, replacing
from .._core import ValidationError
from .._spaces import Space, cover_of, factors_of
from . import chart, columns, graphs, matrices, sphere
from .curves import Curve
from .rates import IN_ROW
from .shrink import shrink, small_text
from .style import DPI, INK, font_factor, points
from .theme import invert_page, is_dark, light_colors
from .titles import points_of_factor

FACTORS = 6
"""The largest number of factors of a product that are drawn."""
_SMALLEST = 0.6
"""Text is not reduced by less than this factor, unless there is no space for a page otherwise."""
_MOVING = (".gif", ".mp4", ".apng", ".webm", ".mov", ".avi")


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

    draw: Callable[[Any, Sequence[Curve]], None]
    width: float = 5.2
    height: float = 5.2


_GRAPH, _ROWS = (10.5, 3.2), (10.5, 3.6)
_DRAWN: list[tuple[str, Callable[[Any, Sequence[Curve]], None], tuple[float, ...]]] = [
    ("euclidean:1", graphs.draw_graph, _GRAPH),
    ("euclidean:2", chart.draw_plane, ()),
    ("euclidean:3", chart.draw_3d, ()),
    ("sphere:1", graphs.draw_circle, _GRAPH),
    ("sphere:2", sphere.draw_sphere, (11.4, 4.6)),
    ("hyperbolic:2", chart.draw_disk, ()),
    ("rp:1 gr:1,2", graphs.draw_slope, _GRAPH),
    ("rp:2 gr:1,3", sphere.draw_lines, ()),
    ("gr:2,3", sphere.draw_normals, ()),
    ("cp:1 cgr:1,2", sphere.draw_bloch, ()),
    ("so:2 o:2", graphs.draw_turn, _GRAPH),
    ("sphere:3 so:3 o:3 su:2", matrices.draw_rotations, _ROWS),
    ("u:1", graphs.draw_phase, _GRAPH),
    ("spd:1", graphs.draw_components, (10.5, 3.8)),
    ("spd:2", matrices.draw_ellipses, _ROWS),
    ("spd:3", matrices.draw_ellipsoids, _ROWS),
    ("se:2", matrices.draw_flat_poses, ()),
    ("se:3", matrices.draw_poses, (6.2, 5.8)),
]
_PICTURES = {name: Picture(draw, *size) for names, draw, size in _DRAWN for name in names.split()}
_FAMILIES = dict.fromkeys(("rp", "cp", "hp", "gr", "cgr"), Picture(graphs.draw_principal_angles, 10.5, 3.8))
_FAMILIES["spd"] = Picture(matrices.draw_covariances, 10.5, 5.8)
_FAMILIES["stiefel"] = Picture(columns.draw_columns, 10.5, 4.6)
_FAMILIES["torus"] = Picture(graphs.draw_torus, 10.5, 3.8)
_FAMILIES["ch"] = Picture(graphs.draw_ratios, 10.5, 3.8)
_LONG = 2.0
"""Curves in the plane are in a panel that is wide or narrow if one side is longer than the other by this factor."""
# Spaces whose picture shows the band.
_BANDED = {"euclidean:1", "euclidean:2", "euclidean:3", "hyperbolic:2", "sphere:1", "sphere:2"}
_BANDED |= {"rp:1", "gr:1,2", "so:2", "o:2", "u:1"}
_OTHERS = Picture(graphs.draw_components, 10.5, 3.8)
# Spaces whose picture shows many curves of a batch.
PATHS = {"euclidean:2", "euclidean:3", "sphere:2", "hyperbolic:2", "rp:2", "gr:1,3", "gr:2,3", "cp:1", "cgr:1,2"}
PATHS |= {"se:2", "se:3"}
# Spaces whose picture has symbols in rows, one row per curve.
IN_ROWS = {"sphere:3", "so:3", "o:3", "su:2", "spd:2", "spd:3"}
FRAMES = {"sphere:3", "so:3", "o:3", "su:2", "se:3"}
"""Spaces whose picture has frames, with a colour for every axis."""
# Spaces whose picture has a view that depends on the curves.
VIEWS = {"sphere:2", "hyperbolic:2", "rp:2", "gr:1,3", "gr:2,3", "cp:1", "cgr:1,2"}


def picture_of(space: Space) -> Picture:
    """Return the picture of a space or its family, or graphs of the components if there is none."""
    name = str(cover_of(space))
    return _PICTURES.get(name) or _FAMILIES.get(name.partition(":")[0], _OTHERS)


def fitted(picture: Picture, curves: Sequence[Curve]) -> Picture:
    """Return the picture in a panel with the proportions of curves in R² or R³, or with space for three graphs."""
    if picture.draw is matrices.draw_rotations and matrices.are_graphs(curves):
        return picture._replace(height=4.8)
    if picture.draw not in (chart.draw_plane, matrices.draw_flat_poses, chart.draw_3d, matrices.draw_poses):
        return picture
    points = np.concatenate([curve.extent for curve in curves])
    extents = np.ptp(points if points.ndim == 2 else points[:, :-1, -1], axis=0)
    if len(extents) == 3:
        longest, *others = np.sort(extents)[::-1]
        lies = longest > max(extents[2], _LONG * others[0])
        return picture._replace(width=10.5, height=4.8) if lies else picture
    across, high = extents
    if across > _LONG * high:
        return picture._replace(width=10.5, height=float(np.clip(10.5 * high / max(across, 1e-300), 1.2, 4.0)) + 1.2)
    if high > _LONG * across:
        return picture._replace(width=float(np.clip(5.2 * across / high, 2.0, 4.0)) + 1.2)
    return picture


def draw_picture(panel: Any, space: Space, curves: Sequence[Curve]) -> None:
    """Draw the picture of a space that is not a product."""
    name = str(cover_of(space))
    if name not in PATHS:
        curves = [curve for curve in curves if not curve.faint]
    if name not in IN_ROWS:
        curves = [part for curve in curves for part in curve.unbroken]
    picture_of(space).draw(panel, curves)


def shows_band(curve: Curve) -> bool:
    """Whether the picture of a curve shows its band."""
    return str(cover_of(curve.space)) in _BANDED or matrices.are_graphs([curve])


class CurveFigure(Figure):
    """A figure that notebooks show although it does not belong to pyplot."""

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        self.savefig(buffer, format="png")
        return buffer.getvalue()


def new_figure(size: tuple[float, float], show: bool) -> Figure:
    """Return a figure, which belongs to pyplot only if a window opens."""
    if not show:
        return CurveFigure(figsize=size, dpi=DPI)
    from matplotlib import pyplot

    figure: Figure = pyplot.figure(FigureClass=CurveFigure, figsize=size)
    return figure


def layout(natural: tuple[float, float], figsize: Any) -> tuple[tuple[float, float], float]:
    """Return the size in inches at which a page is laid out, and the factor by which that page is then reduced.

    Margins and text have fixed sizes, so that a page that is smaller than its natural size is a larger one, reduced.
    """
    if figsize is None:
        return natural, 1.0
    figsize = np.divide(figsize, font_factor())
    share = np.divide(figsize, natural)
    factor = float(np.clip(share.min(), _SMALLEST, 1.0))
    size = np.maximum(np.divide(figsize, factor), np.multiply(_SMALLEST, natural))
    return (float(size[0]), float(size[1])), float(min(1.0, *np.divide(figsize, size)))


@contextmanager
def drawing(size: tuple[float, float], show: bool = False, factor: float = 1.0) -> Iterator[Figure]:
    """Create a figure to draw into, in the colours of a light style, and adapt it to the style of the user afterwards.

    Lines, symbols and text are reduced by a factor. Figures are larger by the factor of a large font.
    """
    dark = is_dark(rcParams["figure.facecolor"])
    with light_colors(dark), small_text(factor):
        figure = new_figure(size, show)
        yield figure
    larger = font_factor()
    if factor * larger != 1:
        # The search for all artists takes as long as drawing them.
        shrink(figure.findobj(), factor * larger)
    figure.set_size_inches(larger * size[0], larger * size[1])
    if dark:
        invert_page(figure)


def finish(figure: Figure, file: Any, show: bool) -> Figure:
    """Save the figure if there is a file, and open windows."""
    if file is not None:
        save(figure, file)
    if show:
        from matplotlib import pyplot

        pyplot.show()
    return figure


def save(figure: Figure, file: Any) -> None:
    """Write a figure to an open file, or to a path whose suffix selects the format."""
    path = path_of(file, method="write")
    if path is None:
        figure.savefig(file)
        return
    known = sorted(set(figure.canvas.get_supported_filetypes()) - {own[1:] for own in _MOVING})
    ending = path.suffix[1:].lower()
    if not ending:
        ending = figure.canvas.get_default_filetype()
        path = path.with_name(f"{path.name}.{ending}")
    if f".{ending}" in _MOVING:
        raise ValidationError(
            f"file = {short_repr(str(path))} is an animation, but plot writes still images. Use the method animate of "
            "a curve, or a name such as 'curve.png'."
        )
    if ending not in known:
        raise ValidationError(f"file = {short_repr(str(path))}: the name of a picture must end in .{', .'.join(known)}")
    with replacing(path) as temporary:
        figure.savefig(temporary, format=ending)


def captions(space: Space[Any]) -> list[str]:
    """Return names of the factors of a product, with what their points are, and numbers if several are equal."""
    names = [", ".join(filter(None, (repr(own), points_of_factor(own)))) for own in factors_of(space)]
    several = max(Counter(names).values()) > 1
    return [f"factor {i}: {name}" if several else name for i, name in enumerate(names)]


def picture_of_factors(curves: Sequence[Curve]) -> Picture:
    """Return the picture of a product space, which has the pictures of its factors."""
    factors, names = factors_of(curves[0].space)[:FACTORS], captions(curves[0].space)
    rows = 1 if len(factors) <= IN_ROW else 2
    width = -(-len(factors) // rows)

    def draw(panel: SubFigure, curves: Sequence[Curve]) -> None:
        graphs_only = any(matrices.are_graphs([own.part(i) for own in curves]) for i in range(len(factors)))
        cells = np.asarray(panel.subfigures(2 * rows, width, height_ratios=[0.3, 4.3] * rows))
        for i, factor in enumerate(factors):
            row, column = divmod(i, width)
            caption, cell = cells[2 * row : 2 * row + 2, column]
            caption.text(0.5, 0.3, names[i], ha="center", color=INK, fontsize=points(12))
            parts = [curve.part(i) for curve in curves]
            if str(factor) == "euclidean:3" and (graphs_only or any(len(curve.gaps) for curve in parts)):
                # A time axis shows gaps, and how positions and rotations belong together.
                graphs.draw_coordinates(cell, [own for part in parts for own in part.unbroken], ["x₁", "x₂", "x₃"])
            else:
                draw_picture(cell, factor, parts)

    return Picture(draw, 4.8 * width, 4.6 * rows)
