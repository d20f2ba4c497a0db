"""Which picture a space has.

A new space adds a function that draws, and one line of `_PICTURES`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from matplotlib.figure import SubFigure

from ..spaces import Space
from .components import draw_components
from .curves import Curve
from .disk import draw_disk
from .flat import draw_graph, draw_plane, draw_room
from .frames import draw_quaternions
from .sphere import draw_angle, draw_sphere


class Picture(NamedTuple):
    """How curves in a space are drawn.

    Attributes:
        draw: draws curves into a panel, whatever its size.
        width, height: of the panel in inches when the picture is the only one. Beside a panel that is much
            wider than high there is no room for speed and acceleration: they go below.
    """

    draw: Callable[[SubFigure, Sequence[Curve]], None]
    width: float = 5.2
    height: float = 5.2


_PICTURES = {
    "euclidean:1": Picture(draw_graph, 10.5, 3.2),
    "euclidean:2": Picture(draw_plane),
    "euclidean:3": Picture(draw_room),
    "sphere:1": Picture(draw_angle, 10.5, 3.2),
    "sphere:2": Picture(draw_sphere, 11.4, 4.6),
    "sphere:3": Picture(draw_quaternions, 10.5, 2.7),
    "hyperbolic:2": Picture(draw_disk),
}
_OTHERS = Picture(draw_components, 10.5, 3.8)


def picture_of(space: Space) -> Picture:
    """The picture of a space; the components against time if it has none of its own."""
    return _PICTURES.get(str(space), _OTHERS)
