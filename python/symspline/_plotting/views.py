"""The view of every space, and what its points are called.

To give a new space its view, make a `View`, or a function of the curves that returns one, and add a line to `_VIEWS`,
or to `_FAMILIES` for spaces of all sizes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from textwrap import shorten

from .._spaces import AnySpace, Euclidean, Product, cover_of, factors_of, short_name
from . import chart, globe, graphs, matrices
from .curves import Curve
from .panels import View

FACTORS = 6
"""The largest number of factors of a product that are drawn."""
FRAMES = {"sphere:3", "so:3", "o:3", "su:2", "se:3"}
"""Spaces whose view has frames, with a colour for every axis."""
_Views = View | Callable[[Sequence[Curve]], View]
_LINES, _STATES = "lines through the origin", "states of a qubit"
_angles = {names: graphs.angle(*data) for names, data in graphs.ANGLES.items()}
# Spaces, their view, and what their points are.
_VIEWS: list[tuple[str, _Views, str]] = [
    ("euclidean:1", graphs.coordinates(["x"]), ""),
    ("euclidean:2", partial(chart.plane, has_band=True), ""),
    ("euclidean:3", partial(chart.solid, has_band=True), ""),
    ("sphere:1", _angles["sphere:1"], ""),
    ("sphere:2", globe.sphere, ""),
    ("sphere:3", matrices.rotations, "unit quaternions"),
    ("hyperbolic:2", chart.DISK, ""),
    ("rp:1 gr:1,2", _angles["rp:1 gr:1,2"], _LINES),
    ("rp:2 gr:1,3", globe.LINES, _LINES),
    ("gr:2,3", globe.PLANES, "planes through the origin"),
    ("cp:1 cgr:1,2", globe.BLOCH, _STATES),
    ("so:2", _angles["so:2 o:2"], "rotations"),
    ("o:2", _angles["so:2 o:2"], ""),
    ("so:3", matrices.rotations, "rotations"),
    ("o:3 su:2", matrices.rotations, ""),
    ("u:1", _angles["u:1"], ""),
    ("spd:1", graphs.components, "matrices"),
    ("spd:2", matrices.ELLIPSES, "matrices"),
    ("spd:3", matrices.ELLIPSOIDS, "matrices"),
    ("se:2", partial(chart.plane, positions=chart.positions_of, draw=chart.draw_bodies), "poses"),
    ("se:3", partial(chart.solid, positions=chart.positions_of, draw=chart.draw_on_path), "poses"),
]
_FAMILIES: dict[str, tuple[_Views, str]] = {
    **dict.fromkeys(("rp", "cp", "hp", "cgr"), (graphs.angles_to_first, "")),
    "gr": (graphs.angles_to_first, "subspaces"),
    "spd": (matrices.covariances, "matrices"),
    "stiefel": (graphs.matrix_columns, "orthonormal frames"),
    "torus": (graphs.torus_angles, ""),
    "ch": (graphs.ratios, ""),
}
_BY_NAME = {name: (view, points) for names, view, points in _VIEWS for name in names.split()}


def _entry(space: AnySpace) -> tuple[_Views, str]:
    name = str(cover_of(space))
    return _BY_NAME.get(name) or _FAMILIES.get(name.partition(":")[0], (graphs.components, ""))


def view_of(curves: Sequence[Curve]) -> View:
    """Return the view of curves on a space that is not a product; graphs of the components if there is no other."""
    view = _entry(curves[0].space)[0]
    return view if isinstance(view, View) else view(curves)


def views_of_factors(curves: Sequence[Curve]) -> list[tuple[View, list[Curve]]]:
    """Return the views of the factors of a product, and the curves in them."""
    factors = factors_of(curves[0].space)[:FACTORS]
    parts = [[curve.part(i) for curve in curves] for i in range(len(factors))]
    views = list(map(view_of, parts))
    vectors = any(
        str(cover_of(part)) in matrices.MATRICES and not view.in_rows for part, view in zip(factors, views, strict=True)
    )
    for i, part in enumerate(parts):
        if str(factors[i]) == "euclidean:3" and (vectors or any(len(curve.gaps) for curve in part)):
            # A time axis shows gaps, and how positions and rotations belong together.
            views[i] = graphs.coordinates(["x₁", "x₂", "x₃"])
        if not views[i].is_time:
            # There is no space for a map beside a globe.
            views[i] = views[i]._replace(rows=1)
    return list(zip(views, parts, strict=True))


# ---- titles ----


def captions(space: AnySpace) -> list[str]:
    """Return names of the factors of a product, with what their points are, and numbers if several are equal."""
    names = [", ".join(filter(None, (short_name(factor), _points_of_factor(factor)))) for factor in factors_of(space)]
    several = max(Counter(names).values()) > 1
    return [f"factor {i}: {name}" if several else name for i, name in enumerate(names)]


def _points_of_factor(space: AnySpace) -> str:
    return "vectors" if isinstance(space, Euclidean) else _entry(space)[1]


def title_on(what: str, space: AnySpace, most: int = 63) -> str:
    """Return the title of a figure, in at most ``most`` letters, with the name of the space that the user can type.

    Long titles of products have none, because captions name the factors.
    """
    words = [_points_of_factor(text) for text in factors_of(space)]
    points = _entry(space)[1]
    if isinstance(space, Product):
        points = " and ".join(dict.fromkeys(words)) if all(words) else ""
    kinds = [f"{what} of {points}"] * bool(points) + [what]
    titles = [f"{kind} on {short_name(space)}" for kind in kinds]
    if isinstance(space, Product) and len(kinds) > 1:
        titles.insert(1, kinds[0])
    return next((text for text in titles if len(text) <= most), shorten(titles[-1], most, placeholder=" …"))
