"""Any space by its name."""

from __future__ import annotations

from typing import Any, overload

from .._typing import P
from .base import Space
from .product import Product
from .registry import spaces_named


@overload
def space(name: str) -> Space: ...


@overload
def space(name: str | Space[P]) -> Space[P]: ...


def space(name: str | Space[Any]) -> Space[Any]:
    """The space with a name, e.g. ``"sphere:2"``, ``"h:3"``, or ``"sphere:3 x r:3"`` for a product.

    Args:
        name: the name in long or short form, a colon, and the parameters; a space is returned as it is.

    >>> import symspline as ss
    >>> ss.space("sphere:2")
    Sphere(2)
    """
    if isinstance(name, Space):
        return name
    factors = spaces_named(name)
    return factors[0] if len(factors) == 1 else Product(*factors)
