"""States of a qubit on the Bloch sphere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from numpy.typing import NDArray

from .curves import Curve
from .globe import View, draw_globe, label_directions, middle_of
from .sphere import draw_on_globe, part_of_globe
from .style import INK, inside

Array = NDArray[np.float64]

_LABELS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "|0⟩": (0.0, 0.0, 1.0), "|1⟩": (0.0, 0.0, -1.0)}


def draw_bloch(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """CP¹: the Bloch sphere or, where states are close together, a part of it."""
    pairs = [curve.marked(bloch_vectors) for curve in curves]
    everything = np.concatenate([bloch_vectors(curve.extent) for curve in curves])
    part = part_of_globe(panel, everything)
    axes, view = part or _ball(panel, everything)
    for curve, (line, given) in zip(curves, pairs, strict=True):
        # States turn half as far as their vectors.
        draw_on_globe(axes, view, curve, line, given, None if curve.radii is None else 2 * curve.radii)
    note = "part of the Bloch sphere: longitude from x, |0⟩ is 90°N" if part else "Bloch sphere"
    panel.text(0.5, 0.02, note, ha="center", color=INK, fontsize=9)


def bloch_vectors(states: Any) -> Array:
    """The unit vectors of states of shape (m, 2) or (m, 2, 1), whatever their phase."""
    a, b = states.reshape(-1, 2).T
    across = 2 * a.conj() * b
    return np.stack([across.real, across.imag, np.abs(a) ** 2 - np.abs(b) ** 2], axis=-1)


def _ball(panel: SubFigure, points: Array) -> tuple[Axes, View]:
    """The whole ball, turned towards points, with |0⟩ at the top."""
    lon, lat = middle_of(points)
    view = View.above(lon, float(np.clip(lat, 10, 20)))
    axes = panel.add_axes(inside(panel, 0.1, 0.35, 0.1, 0.1))
    draw_globe(axes, view, 30)
    axes.set(xlim=(-1.22, 1.22), ylim=(-1.22, 1.22))
    label_directions(axes, view, _LABELS)
    return axes, view
