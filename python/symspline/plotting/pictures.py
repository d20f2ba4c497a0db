"""Which picture a space has.

A new space adds a function that draws, and one line of `_PICTURES` or, for all sizes alike, of `_FAMILIES`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from matplotlib.figure import SubFigure

from ..spaces import Space
from .angle import draw_circle, draw_phase, draw_slope, draw_turn
from .bloch import draw_bloch
from .components import draw_components
from .curves import Curve
from .disk import draw_disk
from .dome import draw_lines, draw_normals
from .ellipses import draw_ellipses, draw_ellipsoids
from .flat import draw_graph, draw_plane, draw_room
from .frames import draw_quaternions, draw_rotations, draw_spins
from .poses import draw_flat_poses, draw_poses
from .sphere import draw_sphere
from .subspaces import draw_principal_angles, draw_ratios


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
    "sphere:1": Picture(draw_circle, 10.5, 3.2),
    "sphere:2": Picture(draw_sphere, 11.4, 4.6),
    "sphere:3": Picture(draw_quaternions, 10.5, 2.7),
    "hyperbolic:2": Picture(draw_disk),
    "rp:1": Picture(draw_slope, 10.5, 3.2),
    "rp:2": Picture(draw_lines),
    "cp:1": Picture(draw_bloch),
    "gr:1,2": Picture(draw_slope, 10.5, 3.2),
    "gr:1,3": Picture(draw_lines),
    "gr:2,3": Picture(draw_normals),
    "cgr:1,2": Picture(draw_bloch),
    "so:2": Picture(draw_turn, 10.5, 3.2),
    "so:3": Picture(draw_rotations, 10.5, 2.7),
    "o:2": Picture(draw_turn, 10.5, 3.2),
    "o:3": Picture(draw_rotations, 10.5, 2.7),
    "u:1": Picture(draw_phase, 10.5, 3.2),
    "su:2": Picture(draw_spins, 10.5, 2.7),
    "spd:2": Picture(draw_ellipses, 10.5, 2.7),
    "spd:3": Picture(draw_ellipsoids, 10.5, 2.7),
    "se:2": Picture(draw_flat_poses),
    "se:3": Picture(draw_poses, 6.2, 5.8),
}
_FAMILIES = dict.fromkeys(("rp", "cp", "hp", "gr", "cgr"), Picture(draw_principal_angles, 10.5, 3.8))
_FAMILIES["ch"] = Picture(draw_ratios, 10.5, 3.8)
_OTHERS = Picture(draw_components, 10.5, 3.8)


def picture_of(space: Space) -> Picture:
    """The picture of a space or of its family; the components against time if it has none of its own."""
    name = str(space)
    return _PICTURES.get(name) or _FAMILIES.get(name.partition(":")[0], _OTHERS)
