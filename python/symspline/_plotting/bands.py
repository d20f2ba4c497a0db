"""Bands around curves in two-dimensional pictures, and curves with their bands. A band is a union of discs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from numpy.typing import NDArray

from .curves import ALPHA, BAND, QUANTILES, Batch, Curve
from .style import DATA, Array, Indices, evenly


def draw_in_plane(
    axes: Axes, curve: Curve, flat: Callable[[Any], Array], rims: Callable[[Array, Array], Array]
) -> None:
    """Draw a curve in a map of a surface, with its band and its points.

    ``flat`` returns positions of points in the map. ``rims`` returns discs of given radii around such positions, shape
    (m, k, 2).
    """
    if curve.radii is not None:
        discs = disc_indices(curve)
        draw_tube(axes, curve, rims(flat(curve.points[discs]), curve.radii[discs]))
    curve.draw_polygon(axes, flat)
    curve.draw_line(axes, curve.near_data(flat(curve.points)))
    curve.draw_dots(axes, flat(curve.given))


def draw_graph_of(axes: Axes, curve: Curve, line: Array, given: Array, unit: float | Array = 1.0, **dots: Any) -> None:
    """Draw numbers against time with their band, and those of the given points. Radii are multiplied by ``unit``.

    Further arguments are the look of the given points.
    """
    if curve.radii is not None:
        fill_band(axes, curve, line - unit * curve.radii, line + unit * curve.radii, zorder=3)
    curve.draw_line(axes, np.column_stack([curve.times, line]))
    curve.draw_dots(axes, np.column_stack([curve.on_axis(curve.given_x), given]), **dots)


def shade_quantiles(axes: Axes, batch: Batch, values: Array) -> tuple[float, float]:
    """Fill the area between the 5 % and the 95 % quantile of numbers, one row per curve, and return its limits."""
    low, high = np.quantile(values, [0.05, 0.95], axis=0)
    axes.fill_between(batch.times, low, high, color=DATA, alpha=0.35, linewidth=0, label=QUANTILES, zorder=1.5)
    return float(low.min()), float(high.max())


def fill_band(axes: Axes, curve: Curve, low: Array, high: Array, **look: Any) -> None:
    """Draw a band against time."""
    look |= {"color": curve.color, "alpha": ALPHA, "linewidth": 0, "label": BAND}
    axes.fill_between(curve.times, low, high, **look)


def disc_indices(curve: Curve) -> Indices:
    """Return the samples of a curve at which a band has discs."""
    return evenly(len(curve.x), 500)


def draw_tube(axes: Axes, curve: Curve, rings: Array) -> None:
    """Fill discs along a curve, and the areas between neighbouring discs.

    ``rings`` are the rims of the discs, shape (m, k, 2). They are NaN where a disc is missing.
    """
    good: NDArray[np.bool_] = np.all(np.isfinite(rings), axis=(1, 2))
    if not good.any():
        return
    pairs = good[1:] & good[:-1]
    polygons = [_turned_left(rings[good])]
    if pairs.any():
        polygons.append(_between(rings[:-1][pairs], rings[1:][pairs]))
    # All polygons have the same orientation, so that overlapping areas are filled once.
    path = Path.make_compound_path(*map(Path.make_compound_path_from_polys, polygons))
    # ``add_patch`` would compute the extent of every side in a slow loop.
    axes.update_datalim(rings[good].reshape(-1, 2))
    axes.add_artist(PathPatch(path, facecolor=curve.color, alpha=ALPHA, linewidth=0, zorder=3, label=BAND))


def _turned_left(rings: Array) -> Array:
    x, y = np.moveaxis(rings - rings.mean(axis=1, keepdims=True), -1, 0)
    area = np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)
    return np.where((area < 0)[:, None, None], rings[:, ::-1], rings)


def _between(first: Array, second: Array) -> Array:
    """Return the quadrangles that touch two neighbouring discs on both sides."""
    along = second.mean(axis=1) - first.mean(axis=1)
    corners = []
    for rings in (first, second):
        aside = along[:, :1] * rings[..., 1] - along[:, 1:] * rings[..., 0]
        corners += [rings[np.arange(len(rings)), i] for i in (aside.argmin(axis=1), aside.argmax(axis=1))]
    right, left, next_right, next_left = corners
    return np.stack([right, next_right, next_left, left], axis=1)
