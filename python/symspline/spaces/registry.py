"""Spaces by the names that the compiled core gives them."""

from __future__ import annotations

from typing import Any

from .._core import Handle, ValidationError
from ..arrays import shown
from .base import CLASSES, Space

# No number of a space is as long.
_DIGITS = 40


def spaces_named(name: Any) -> list[Space]:
    """The spaces, none of them a product, of which a text is the name: "sphere:3 x r:3" names two.

    >>> spaces_named("sphere:3 x r:3")
    [Sphere(3), Euclidean(3)]
    """
    if not isinstance(name, str):
        raise ValidationError(f"a space or its name is needed, not {shown(name)}")
    return [_named(factor) for factor in name.split(" x ")]


def _named(name: str) -> Space:
    word, _, parameters = name.partition(":")
    word = word.strip().lower()
    names = {alias: row[0] for row in Handle.names() for alias in row}
    if word not in names:
        known = ", ".join(" or ".join(row) for row in Handle.names())
        raise ValidationError(f"unknown space {shown(name)}; known are {known}, e.g. 'sphere:2'")
    values = [part.strip() for part in parameters.split(",")]
    if not all(value.isdecimal() and value.isascii() and len(value) <= _DIGITS for value in values):
        raise ValidationError(f"{shown(name)}: behind the colon come whole numbers, e.g. 'sphere:2'")
    cls: Any = CLASSES[names[word]]
    try:
        made: Space = cls(*map(int, values))
    except TypeError:
        raise ValidationError(f"{shown(name)}: {cls.__name__} does not take {len(values)} numbers") from None
    return made
