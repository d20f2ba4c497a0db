"""Arrow heads on curves in plane pictures, which show the direction of time."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.transforms import Affine2D

from .curves import Curve
from .style import Array

_HEAD = np.array([[0.09, 0.0], [-0.06, 0.065], [-0.025, 0.0], [-0.06, -0.065]])
"""Corners in inches."""
_HEADS, _FEW_HEADS, _SHORT = 3, 2, 0.04
"""Numbers of arrow heads of a single curve and of one of several, and the share of parts that have none."""
_NEAR = np.linspace(-0.3, 0.3, 21)
"""How far they are moved away from given points, as parts of the length that belongs to each."""


def draw_arrows(axes: Axes, curve: Curve, positions: Array, dots: Array) -> None:
    """Draw arrow heads on a line through positions of shape (m, 2), which may be broken by NaN, and mark its end.

    The scales of both axes are equal. Arrow heads are far from ``dots``, the positions of given points.
    """
    if curve.faint or not curve.has_line:
        return
    curve.draw_end(axes, positions[-1:])
    steps = np.diff(positions, axis=0)
    lengths = np.linalg.norm(np.nan_to_num(steps), axis=1)
    total = np.cumsum(lengths)
    # The speed of a point at rest is a rounding error.
    moved = curve.at("speed").max() * (curve.x[-1] - curve.x[0])
    if moved <= 1e-12 * np.abs(curve.points).max() or not total[-1] > 0:
        return
    # Every part of a line that is broken has an arrow head, unless it is very short.
    starts = np.flatnonzero(np.diff(np.isfinite(positions[:, 0]).astype(int), prepend=0) == 1)
    parts = np.diff(total[np.minimum(starts, len(total) - 1)], append=total[-1])
    number = _HEADS if curve.alone else _FEW_HEADS
    counts = [max(int(share > _SHORT), round(number * share)) for share in (parts / total[-1]).tolist()]
    shares = [(np.arange(count) + 0.5) / max(count, 1) for count in counts]
    first = total[np.minimum(starts, len(total) - 1)]
    wanted = np.concatenate([own + part * share for own, part, share in zip(first, parts, shares, strict=True)])
    reach = np.concatenate([np.full(count, part / max(count, 1)) for count, part in zip(counts, parts, strict=True)])
    near = np.searchsorted(total, wanted[:, None] + np.multiply.outer(reach, _NEAR))
    if curve.noise is None and np.isfinite(dots).any():
        dots = dots[np.isfinite(dots[:, 0])]
        free = np.linalg.norm(positions[near][..., None, :] - dots, axis=-1).min(axis=-1)
        at = near[np.arange(len(near)), np.nan_to_num(free).argmax(axis=1)]
    else:
        at = near[:, len(_NEAR) // 2]
    (x, y), middles = (steps[at] / lengths[at, None]).T, (positions[at] + positions[at + 1]) / 2
    turns = np.stack([np.stack([x, y], axis=-1), np.stack([-y, x], axis=-1)], axis=1)
    look = {"offsets": middles, "offset_transform": axes.transData, "clip_on": False, "zorder": 4.5}
    scale = Affine2D().scale(1.0 if curve.alone else 0.8) + axes.figure.dpi_scale_trans
    heads = PolyCollection(list(_HEAD @ turns), facecolor=curve.color, linewidth=0, transform=scale, **look)
    heads.set_label("_time")
    axes.add_collection(heads)
