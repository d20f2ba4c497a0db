"""Bands around curves in pictures of two dimensions, made of discs."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from numpy.typing import NDArray

from .curves import Curve

Array = NDArray[np.float64]

ALPHA = 0.22
_MOST = 500
_ANGLES = np.linspace(0, 2 * np.pi, 24, endpoint=False)
CIRCLE: Array = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=-1)
"""Places around a disc."""


def places_of_discs(curve: Curve) -> NDArray[np.intp]:
    """At which samples of a curve discs are close enough."""
    count = len(curve.x)
    return np.unique(np.linspace(0, count - 1, min(count, _MOST)).astype(int))


def draw_tube(axes: Axes, curve: Curve, rings: Array) -> None:
    """Fill discs along a curve, and what lies between neighbours.

    Args:
        rings: the rim of every disc, shape (m, k, 2); NaN where there is none.
    """
    good: NDArray[np.bool_] = np.all(np.isfinite(rings), axis=(1, 2))
    if not good.any():
        return
    pairs = good[1:] & good[:-1]
    polygons = [_turned_left(rings[good])]
    if pairs.any():
        polygons.append(_between(rings[:-1][pairs], rings[1:][pairs]))
    # All go round to the left, so that what several of them cover is filled once.
    path = Path.make_compound_path(*map(Path.make_compound_path_from_polys, polygons))
    # ``add_patch`` would go through all sides one by one to see how far they reach.
    axes.update_datalim(rings[good].reshape(-1, 2))
    axes.add_artist(PathPatch(path, facecolor=curve.color, alpha=ALPHA, linewidth=0, zorder=3, label="band"))


def draw_strip(axes: Axes, curve: Curve, heights: Array, radii: Array) -> None:
    """Fill what is near a graph over time."""
    look: Any = {"color": curve.color, "alpha": ALPHA, "linewidth": 0, "zorder": 3, "label": "band"}
    axes.fill_between(curve.times, heights - radii, heights + radii, **look)


def _turned_left(rings: Array) -> Array:
    x, y = np.moveaxis(rings - rings.mean(axis=1, keepdims=True), -1, 0)
    area = np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)
    return np.where((area < 0)[:, None, None], rings[:, ::-1], rings)


def _between(first: Array, second: Array) -> Array:
    """The quadrangles that touch two discs on either side."""
    along = second.mean(axis=1) - first.mean(axis=1)
    corners = []
    for rings in (first, second):
        aside = along[:, :1] * rings[..., 1] - along[:, 1:] * rings[..., 0]
        rows = np.arange(len(rings))
        corners.append((rings[rows, aside.argmin(axis=1)], rings[rows, aside.argmax(axis=1)]))
    (right, left), (next_right, next_left) = corners
    return np.stack([right, next_right, next_left, left], axis=1)
