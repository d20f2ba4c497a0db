"""Titles of figures."""

from __future__ import annotations

from textwrap import shorten
from typing import Any

from .._spaces import Euclidean, Product, Space, cover_of, factors_of, short_name

_POINTS = {
    "so:2 so:3": "rotations",
    "sphere:3": "unit quaternions",
    "se:2 se:3": "poses",
    "rp:1 rp:2 gr:1,2 gr:1,3": "lines through the origin",
    "gr:2,3": "planes through the origin",
    "cp:1 cgr:1,2": "states of a qubit",
}
_POINTS = {name: words for names, words in _POINTS.items() for name in names.split()}
_FAMILIES = {"spd": "matrices", "stiefel": "orthonormal frames", "gr": "subspaces"}
"""What the points of a space are, for titles."""


def points_of_factor(space: Space[Any]) -> str:
    """Return what the points of a factor of a product are, or nothing."""
    return "vectors" if isinstance(space, Euclidean) else points_of(space)


def points_of(space: Space[Any]) -> str:
    """Return what the points of a space are, or nothing."""
    if isinstance(space, Product):
        each = list(map(points_of_factor, factors_of(space)))
        return " and ".join(dict.fromkeys(each)) if all(each) else ""
    name = str(cover_of(space))
    return _POINTS.get(name) or _FAMILIES.get(name.partition(":")[0], "")


def title_on(what: str, space: Space[Any], most: int = 63) -> str:
    """Return the title of a figure, in at most ``most`` letters.

    Long titles have the short name of the space, and those of products have none, because captions name the factors.
    """
    names = [" × ".join(map(repr, factors_of(space))), short_name(space)]
    kinds = [f"{what} of {words}" for words in [points_of(space)] if words] + [what]
    titles = [f"{kind} on {name}" for kind in kinds for name in names]
    if isinstance(space, Product) and len(kinds) > 1:
        titles.insert(1, kinds[0])
    return next((own for own in titles if len(own) <= most), shorten(titles[-1], most, placeholder=" …"))
