"""Spaces by name, including products."""

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
    """Return the space with a name.

    Parameters
    ----------
    name : str or Space
        The name of a space, followed by a colon and its parameters, such as ``"sphere:2"`` or ``"h:3"``. The names of
        the factors of a product are joined by ``" x "``, as in ``"so:3 x r:3"``. A space is returned unchanged.

    Returns
    -------
    Space
        The space. ``str(space)`` is its full name.

    Raises
    ------
    ValidationError
        If the name is unknown, or its parameters are invalid.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.space("sphere:2")
    Sphere(2)
    >>> ss.space("so:3 x r:3")
    Product(SpecialOrthogonal(3), Euclidean(3))
    """
    if isinstance(name, Space):
        return name
    factors = spaces_named(name)
    return factors[0] if len(factors) == 1 else Product(*factors)
