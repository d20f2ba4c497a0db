"""Spaces by the names that the compiled core gives them."""

from __future__ import annotations

import re
from difflib import get_close_matches
from typing import Any

from .._arrays import short_repr
from .._core import Handle, ValidationError
from .base import CLASSES, Space, example_of

# No number of a space is as long.
_DIGITS = 40


def spaces_named(name: Any) -> list[Space]:
    """The spaces, none of them a product, of which a text is the name: "sphere:3 x r:3" names two.

    >>> spaces_named("sphere:3 x r:3")
    [Sphere(3), Euclidean(3)]
    """
    if isinstance(name, type) and issubclass(name, Space):
        raise ValidationError(f"{name.__name__} is a family of spaces; {_whole(name)}")
    if not isinstance(name, str):
        raise ValidationError(f"a space or its name is needed, not {short_repr(name)}")
    return [_named(factor) for factor in name.split(" x ")]


def _rows() -> list[list[str]]:
    """All names, one row a family: those of the compiled core, and of spaces that are made in Python."""
    compiled = Handle.names()
    known = {row[0] for row in compiled}
    return compiled + [[name, *cls._aliases] for name, cls in CLASSES.items() if name not in known]


def _guess(word: str, parameters: str, names: dict[str, str]) -> str:
    """What a name that is none may have been, "SO3" and "SpecialOrthogonal(3)" too; or nothing."""
    glued = re.fullmatch(r"([a-z_ -]+)\(?(\d[\d, ]*)\)?", word)
    if glued is not None and not parameters:
        word, parameters = glued[1], glued[2]
    meant = {cls.__name__.lower(): own for own, cls in CLASSES.items()} | {name: name for name in names}
    close = get_close_matches(re.sub("[-_ ]", "", word), meant, 1, 0.7)
    colon = ":" if parameters else ""
    return f"did you mean {short_repr(meant[close[0]] + colon + parameters.strip())}? " if close else ""


def _whole(cls: Any) -> str:
    """How to name one of a family."""
    if not hasattr(cls, "_name"):
        return "a space or its name is needed, such as Sphere(2) or 'sphere:2'"
    return f"give its dimension, such as {example_of(cls)}"


def _named(name: str) -> Space:
    word, _, parameters = name.partition(":")
    word = word.strip().lower()
    # SO(1, n), as it is written, is no rotation group.
    if word == "so" and parameters.count(",") == 1 and parameters.partition(",")[0].strip() == "1":
        word, parameters = "lorentz", parameters.partition(",")[2]
    rows = _rows()
    names = {alias: row[0] for row in rows for alias in row}
    if word not in names:
        known = ", ".join(" or ".join(row) for row in rows)
        guess = _guess(word, parameters, names)
        raise ValidationError(f"unknown space {short_repr(name)}; {guess}known are {known}, e.g. 'sphere:2'")
    if not parameters.strip():
        raise ValidationError(f"{short_repr(name)} is a family of spaces; {_whole(CLASSES[names[word]])}")
    values = [part.strip() for part in parameters.split(",")]
    if not all(value.isdecimal() and value.isascii() and len(value) <= _DIGITS for value in values):
        raise ValidationError(f"{short_repr(name)}: behind the colon come whole numbers, e.g. 'sphere:2'")
    cls: Any = CLASSES[names[word]]
    try:
        made: Space = cls(*map(int, values))
    except TypeError:
        raise ValidationError(
            f"{short_repr(name)}: {cls.__name__} does not take {len(values)} numbers"
        ) from None
    return made
