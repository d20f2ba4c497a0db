"""Spaces by the names that the compiled core gives them."""

from __future__ import annotations

import re
from difflib import get_close_matches
from typing import Any

from .._arrays import short_repr
from .._core import Handle, ValidationError
from .base import CLASSES, Space, example_of

# Longer parameters are rejected before they are converted to integers.
_DIGITS = 40


def spaces_named(name: Any) -> list[Space]:
    """Return the spaces that a name lists, none of them a product.

    >>> spaces_named("sphere:3 x r:3")
    [Sphere(3), Euclidean(3)]
    """
    if isinstance(name, type) and issubclass(name, Space):
        raise ValidationError(f"{name.__name__} is a family of spaces; {_whole(name)}")
    if not isinstance(name, str):
        raise ValidationError(f"a space or its name is needed, not {short_repr(name)}")
    return [_named(factor) for factor in name.split(" x ")]


def _rows() -> list[list[str]]:
    """Return all names, one row per class: those of the compiled core, and those of spaces implemented in Python."""
    compiled = Handle.names()
    known = {row[0] for row in compiled}
    return compiled + [[name, *cls._aliases] for name, cls in CLASSES.items() if name not in known]


def _guess(word: str, parameters: str, names: dict[str, str]) -> str:
    """Suggest the name that was probably meant, also for "SO3" and "SpecialOrthogonal(3)", or return an empty text."""
    glued = re.fullmatch(r"([a-z_ -]+)\(?(\d[\d, ]*)\)?", word)
    if glued is not None and not parameters:
        word, parameters = glued[1], glued[2]
    meant = {cls.__name__.lower(): own for own, cls in CLASSES.items()} | {name: name for name in names}
    close = get_close_matches(re.sub("[-_ ]", "", word), meant, 1, 0.7)
    colon = ":" if parameters else ""
    return f"did you mean {short_repr(meant[close[0]] + colon + parameters.strip())}? " if close else ""


def _whole(cls: Any) -> str:
    """Explain how to specify one space of a class."""
    if not hasattr(cls, "_name"):
        return "a space or its name is needed, such as Sphere(2) or 'sphere:2'"
    return f"give its dimension, such as {example_of(cls)}"


def _named(name: str) -> Space:
    word, _, parameters = name.partition(":")
    word = word.strip().lower()
    # SO(1, n) is the usual notation for the Lorentz group.
    if word == "so" and parameters.count(",") == 1 and parameters.partition(",")[0].strip() == "1":
        word, parameters = "lorentz", parameters.partition(",")[2]
    rows = _rows()
    names = {alias: row[0] for row in rows for alias in row}
    if word not in names:
        known = ", ".join(" or ".join(row) for row in rows)
        guess = _guess(word, parameters, names)
        raise ValidationError(f"unknown space {short_repr(name)}; {guess}known names are {known}, as in 'sphere:2'")
    if not parameters.strip():
        raise ValidationError(f"{short_repr(name)} is a family of spaces; {_whole(CLASSES[names[word]])}")
    values = [part.strip() for part in parameters.split(",")]
    if not all(value.isdecimal() and value.isascii() and len(value) <= _DIGITS for value in values):
        raise ValidationError(f"{short_repr(name)}: the parameters after the colon must be integers, as in 'sphere:2'")
    cls: Any = CLASSES[names[word]]
    try:
        made: Space = cls(*map(int, values))
    except TypeError:
        raise ValidationError(f"{short_repr(name)}: {cls.__name__} does not take {len(values)} parameters") from None
    return made
