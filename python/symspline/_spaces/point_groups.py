"""The point groups of crystals: finite groups of rotations by their symbols."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import read_only, short_repr
from .._core import ValidationError

Array = NDArray[np.float64]

_ROOT = np.sqrt(0.75)
# Rotations that generate the groups. The main axis is z; the two-fold axis of "32" is x, as in orix.
_QUARTER_Z = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
_THIRD_Z = [[-0.5, -_ROOT, 0.0], [_ROOT, -0.5, 0.0], [0.0, 0.0, 1.0]]
_HALF_Z, _HALF_X = np.diag([-1.0, -1.0, 1.0]), np.diag([1.0, -1.0, -1.0])
# About the diagonal (1, 1, 1).
_THIRD_DIAGONAL = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
# All entries of the matrices of point groups, to which products are rounded.
_ENTRIES = np.array([-1.0, -_ROOT, -0.5, 0.0, 0.5, _ROOT, 1.0])

# Generators by Hermann–Mauguin symbol.
_GENERATORS: dict[str, list[object]] = {
    "1": [],
    "2": [_HALF_Z],
    "222": [_HALF_Z, _HALF_X],
    "4": [_QUARTER_Z],
    "422": [_QUARTER_Z, _HALF_X],
    "3": [_THIRD_Z],
    "32": [_THIRD_Z, _HALF_X],
    "6": [_THIRD_Z, _HALF_Z],
    "622": [_THIRD_Z, _HALF_Z, _HALF_X],
    "23": [_HALF_Z, _HALF_X, _THIRD_DIAGONAL],
    "432": [_QUARTER_Z, _HALF_X, _THIRD_DIAGONAL],
}
# The Schoenflies symbol of each proper group, and both symbols of its Laue group.
_ALIASES = {
    "1": ("C1", "-1", "Ci"),
    "2": ("C2", "2/m", "C2h"),
    "222": ("D2", "mmm", "D2h"),
    "4": ("C4", "4/m", "C4h"),
    "422": ("D4", "4/mmm", "D4h"),
    "3": ("C3", "-3", "S6"),
    "32": ("D3", "-3m", "D3d"),
    "6": ("C6", "6/m", "C6h"),
    "622": ("D6", "6/mmm", "D6h"),
    "23": ("T", "m-3", "Th"),
    "432": ("O", "m-3m", "Oh"),
}
_PROPER = {alias: symbol for symbol, aliases in _ALIASES.items() for alias in (symbol, *aliases)}


def proper_symbol(symbol: object) -> str:
    """Return the Hermann–Mauguin symbol of the proper point group that a symbol denotes.

    Raises
    ------
    ValidationError
        If the symbol is unknown.
    """
    if isinstance(symbol, str) and symbol in _PROPER:
        return _PROPER[symbol]
    known = ", ".join(f"{own} or {aliases[0]}" for own, aliases in _ALIASES.items())
    laue = ", ".join(aliases[1] for aliases in _ALIASES.values())
    raise ValidationError(
        f"{short_repr(symbol)} is not the symbol of a point group. Pass one of the proper point groups {known}, or "
        f"one of the Laue groups {laue}."
    )


@lru_cache
def elements(symbol: str) -> Array:
    """Return the rotations of a proper point group, the identity first. The array is read-only."""
    found = [np.eye(3)]
    for one in found:
        for generator in _GENERATORS[symbol]:
            product = one @ np.asarray(generator)
            product = _ENTRIES[np.abs(product[..., None] - _ENTRIES).argmin(axis=-1)]
            if not any(np.array_equal(product, known) for known in found):
                found.append(product)
    return read_only(np.array(found))


def recognised(group: NDArray[Any]) -> str | None:
    """Return the symbol of the proper point group with the same elements, in any order, or None."""
    if group.shape[1:] != (3, 3) or group.dtype.kind != "f":
        return None
    for symbol in _GENERATORS:
        own = elements(symbol)
        if len(own) == len(group):
            off = np.abs(group[:, None] - own).max(axis=(-2, -1))
            if off.min(axis=0).max() < 1e-8 and off.min(axis=1).max() < 1e-8:
                return symbol
    return None
