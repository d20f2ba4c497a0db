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


def points_of(space: Space[Any]) -> str:
    """Return what the points of a space are, or nothing. Those of R^n are vectors in a product."""
    if isinstance(space, Product):
        each = ["vectors" if isinstance(own, Euclidean) else points_of(own) for own in factors_of(space)]
        return " and ".join(dict.fromkeys(each)) if all(each) else ""
    name = str(cover_of(space))
    return _POINTS.get(name) or _FAMILIES.get(name.partition(":")[0], "")


def title_on(what: str, space: Space[Any], most: int = 63) -> str:
    """Return the title of a figure. Products and long titles have the short name of the space."""
    names = [short_name(space)] if isinstance(space, Product) else [repr(space), short_name(space)]
    kinds = [f"{what} of {words}" for words in [points_of(space)] if words] + [what]
    titles = [f"{kind} on {name}" for kind in kinds for name in names]
    return next((own for own in titles if len(own) <= most), shorten(titles[-1], most, placeholder=" …"))
