"""Curves whose points are angles: on the circle, and rotations, phases and lines of a plane."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import SubFigure
from numpy.typing import NDArray

from .bands import draw_strip
from .curves import Curve
from .timeline import timelines

Array = NDArray[np.float64]


def draw_circle(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """S¹: the angle of unit vectors."""
    _draw(panel, curves, lambda points: np.arctan2(points[:, 1], points[:, 0]))


def draw_turn(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """SO(2) and O(2): the angle by which the first axis is turned."""
    _draw(panel, curves, lambda points: np.arctan2(points[:, 1, 0], points[:, 0, 0]))


def draw_phase(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """U(1): the phase."""
    _draw(panel, curves, lambda points: np.angle(points[:, 0, 0]))


def draw_slope(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """RP¹ and Gr(1, 2): the angle of a line, which is back after half a turn."""
    _draw(panel, curves, lambda points: np.arctan2(points[:, 1], points[:, 0]).ravel(), np.pi)


def _draw(
    panel: SubFigure, curves: Sequence[Curve], angles: Callable[[Any], Array], period: float = 2 * np.pi
) -> None:
    """The angle against time, without jumps."""
    (axes,) = timelines(panel, curves, ["angle, degrees"])
    for curve in curves:
        line, given = curve.marked(angles)
        line = np.unwrap(line, period=period)
        given = given + period * np.rint((curve.beside(line) - given) / period)
        if curve.radii is not None:
            draw_strip(axes, curve, np.degrees(line), np.degrees(curve.radii))
        curve.draw_line(axes, np.column_stack([curve.times, np.degrees(line)]))
        curve.draw_dots(axes, np.column_stack([curve.on_axis(curve.given_x), np.degrees(given)]))
