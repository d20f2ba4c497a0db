"""Finite groups of transformations of a space: multiplication by matrices from one side or both, or by numbers."""

from __future__ import annotations

import json
from itertools import product as combinations
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .._base.angles import matrices_of_quaternions
from .._base.arrays import as_array, read_only, short_repr
from .._core import ValidationError
from .base import Array, Space
from .point_groups import elements, proper_symbol, recognised

Indices = NDArray[np.intp]
Side = Literal["left", "right"]

# Tolerance for products of elements, which are often given with few decimals.
_TOL = 1e-6
# The group of all diagonal matrices with entries ±1, and the largest size for which it is made.
SIGNS = "signs"
_MOST_SIGNS = 8
# Largest number of elements of a group from one side.
_MOST = 2000


class Factor:
    """A finite group that multiplies points from one side.

    Parameters
    ----------
    space : Space
        The space of the points.
    group : array_like or str
        Matrices of shape (k, m, m), numbers of shape (k,), the symbol of a point group, or ``"signs"``.
    side : {"left", "right"}

    Attributes
    ----------
    elements : ndarray, shape (k, m, m) or (k,)
        The elements, read-only.
    table : ndarray of int, shape (k, k)
        Indices of the products: ``elements[table[i, j]]`` is the product of elements i and j.
    name : str
        The group as a text: a symbol, ``"signs"`` or the elements as JSON.
    """

    def __init__(self, space: Space[Any], group: Any, side: Side) -> None:
        shape = space.point_shape
        # A vector is a row on the right, and a column on the left, of a matrix.
        size = shape[0] if side == "left" else shape[-1]
        array, self.name = _read(space, group, size)
        self.side: Side = side
        self.elements: Array = read_only(array)
        self.table: Indices = _table(array)

    def move(self, x: Array, index: Any, axes: int) -> Array:
        """Multiply points with `axes` axes each by the elements with some indices, of the shape of leading axes."""
        chosen = self.elements[index]
        if self.elements.ndim == 1:
            return np.asarray(chosen.reshape(*chosen.shape, *[1] * axes) * x)
        if axes > 1:
            return np.asarray(x @ chosen if self.side == "right" else chosen @ x)
        if self.side == "right":
            return np.asarray((x[..., None, :] @ chosen)[..., 0, :])
        return np.asarray((chosen @ x[..., None])[..., 0])


class FiniteGroup:
    """A finite group of transformations, the direct product of the groups that multiply from either side.

    Attributes
    ----------
    left, right : Factor or None
    size : int
        Number of transformations.
    table : ndarray of int, shape (size, size)
        ``table[i, j]`` is the index of the transformation j followed by i.
    identity : int
        Index of the identity.
    inverse : ndarray of int
        Indices of the inverse transformations.
    """

    def __init__(self, left: Factor | None, right: Factor | None) -> None:
        self.left, self.right = left, right
        # Indices of the factors of each transformation.
        sizes = [1 if factor is None else len(factor.elements) for factor in (left, right)]
        self._of_left, self._of_right = np.divmod(np.arange(sizes[0] * sizes[1]), sizes[1])
        self.size: int = sizes[0] * sizes[1]
        i, j = self._of_left, self._of_right
        first = i[:, None] * 0 if left is None else left.table[i[:, None], i]
        # The factor that acts last is next to the point on the left, and farthest from it on the right.
        second = j[:, None] * 0 if right is None else right.table[j, j[:, None]]
        self.table: Indices = first * sizes[1] + second
        self.identity = int(np.flatnonzero((self.table == np.arange(self.size)).all(axis=1))[0])
        self.inverse: Indices = np.argmax(self.table == self.identity, axis=1)

    def described(self, index: int) -> tuple[Array, ...]:
        """Return the elements from the left and the right of which a transformation consists."""
        both = ((self.left, self._of_left), (self.right, self._of_right))
        return tuple(factor.elements[own[index]] for factor, own in both if factor is not None)

    def move(self, x: Array, index: Any, axes: int) -> Array:
        """Apply the transformations with some indices to points or tangent vectors with `axes` axes each."""
        if self.left is not None:
            x = self.left.move(x, self._of_left[index], axes)
        return x if self.right is None else self.right.move(x, self._of_right[index], axes)


def _read(space: Space[Any], group: Any, size: int) -> tuple[Array, str]:
    """Return the elements of a group and its name."""
    if isinstance(group, str):
        return _named(space, group, size)
    array = as_array(matrices_of(group), "group")
    if array.dtype.kind not in ("biufc" if space._complex else "biuf"):
        raise ValidationError(
            f"`group` must be an array of {'' if space._complex else 'real '}numbers, not of {array.dtype}, to act on "
            f"{space!r}."
        )
    if array.ndim not in (1, 3) or (array.ndim == 3 and array.shape[1:] != (size, size)) or not len(array):
        raise ValidationError(
            f"`group` has shape {array.shape}, but a group that acts on {space!r} consists of matrices, shape "
            f"(k, {size}, {size}), or of numbers, shape (k,)."
        )
    if not np.isfinite(array).all():
        raise ValidationError(f"`group[{np.argwhere(~np.isfinite(array))[0][0]}]` is not finite. Pass finite numbers.")
    array = array.astype(space.dtype)
    if array.shape == (2**size, size, size) and (np.abs(array) == np.eye(size)).all():
        return _named(space, SIGNS, size)
    symbol = recognised(array)
    # Elements with rounding errors are replaced, so that the group agrees exactly with its name.
    return (elements(symbol), symbol) if symbol else (array, _as_text(array))


def _named(space: Space[Any], name: str, size: int) -> tuple[Array, str]:
    if name.startswith("["):
        try:
            numbers: Array = np.array(json.loads(name), np.float64)
        except (ValueError, TypeError, RecursionError):
            raise ValidationError(f"{short_repr(name)} is not an array of numbers") from None
        if space._complex:
            if numbers.shape[-1:] != (2,):
                raise ValidationError(f"{short_repr(name)} is not an array of pairs of real and imaginary parts")
            numbers = numbers.view(np.complex128)[..., 0]
        return _read(space, numbers, size)
    if name == SIGNS:
        if size > _MOST_SIGNS:
            raise ValidationError(
                f"the group of all signs of {size} columns has 2**{size} elements. Pass the elements that you need as "
                "an array, or fit a Grassmannian, where signs of columns do not matter."
            )
        return np.array([np.diag(own) for own in combinations([1.0, -1.0], repeat=size)]).astype(space.dtype), SIGNS
    symbol = proper_symbol(name)
    if size != 3:
        raise ValidationError(
            f"point groups consist of 3 × 3 matrices, but a group that acts on {space!r} needs {size} × {size} "
            "matrices. Pass an array of these."
        )
    return elements(symbol).astype(space.dtype), symbol


def _as_text(array: Array) -> str:
    """Return the elements as JSON; complex numbers as pairs."""
    numbers = array[..., None].view(np.float64) if array.dtype.kind == "c" else array
    return json.dumps((numbers + 0.0).tolist(), separators=(",", ":"))


def matrices_of(group: Any) -> Any:
    """Return the matrices of rotations of SciPy or of a symmetry of orix; any other value is returned unchanged.

    An improper element of an orix symmetry is a rotation followed by the inversion, which does not change
    orientations: the rotations are those of the Laue group.
    """
    if hasattr(group, "as_matrix"):
        return group.as_matrix()
    if not hasattr(group, "improper"):
        return group
    found = matrices_of_quaternions(group.data).reshape(-1, 3, 3)
    same = np.abs(found[:, None] - found).max(axis=(-2, -1)) < _TOL
    return found[~np.tril(same, -1).any(axis=1)]


def _table(array: Array) -> Indices:
    """Return the indices of all products of two elements.

    Raises
    ------
    ValidationError
        If two elements are equal, a product is not an element, or the identity is missing.
    """
    count = len(array)
    if count > _MOST:
        raise ValidationError(f"`group` has {count} elements, but at most {_MOST} are supported.")
    flat = array.reshape(count, -1)
    # Real and imaginary parts have the same distances.
    flat = np.ascontiguousarray(flat).view(np.float64)
    tol = _TOL * max(1.0, float(np.abs(flat).max()))
    squares = np.sum(flat**2, axis=-1)
    table = np.empty((count, count), np.intp)
    for i in range(count):
        same = np.flatnonzero(np.abs(flat[i] - flat[:i]).max(axis=-1) <= tol)
        if same.size:
            raise ValidationError(f"`group[{same[0]}]` and `group[{i}]` are equal. Remove one of them.")
        products = array[i] * array if array.ndim == 1 else array[i] @ array
        rows = np.ascontiguousarray(products.reshape(count, -1)).view(np.float64)
        # The nearest element has the smallest |x|² − 2x·y.
        table[i] = np.argmin(squares - 2 * rows @ flat.T, axis=1)
        missing = np.flatnonzero(~(np.abs(rows - flat[table[i]]).max(axis=-1) <= tol))
        if missing.size:
            product_of = f"group[{i}] {'*' if array.ndim == 1 else '@'} group[{missing[0]}]"
            raise ValidationError(
                f"`{product_of}` is not an element of `group`, but a group contains the product of any two of its "
                "elements. Pass all elements, including the identity."
            )
    one = np.ones(1) if array.ndim == 1 else np.eye(array.shape[-1])
    if not (np.abs(array - one).reshape(count, -1).max(axis=-1) <= tol).any():
        raise ValidationError("`group` does not contain the identity. Pass all elements of the group.")
    return table
