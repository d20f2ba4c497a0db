"""Finite groups of transformations, the point groups of crystals among them, and continuous representatives.

Transformations are multiplications by matrices from one side or both, or by numbers.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import lru_cache
from itertools import combinations, product
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.angles import matrices_of_quaternions
from .._base.arrays import as_array, read_only, short_repr
from .._base.faults import warn
from .._base.typing import Array, FloatArray
from .._core import ValidationError
from .base import AnySpace

# ---- the point groups of crystals, by their symbols ----

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
    known = ", ".join(f"{name} or {aliases[0]}" for name, aliases in _ALIASES.items())
    laue = ", ".join(aliases[1] for aliases in _ALIASES.values())
    raise ValidationError(
        f"{short_repr(symbol)} is not the symbol of a point group. Pass one of the proper point groups {known}, or "
        f"one of the Laue groups {laue}."
    )


@lru_cache
def elements(symbol: str) -> FloatArray:
    """Return the rotations of a proper point group, the identity first. The array is read-only."""
    rotations = [np.eye(3)]
    for one in rotations:
        for generator in _GENERATORS[symbol]:
            made = one @ np.asarray(generator)
            made = _ENTRIES[np.abs(made[..., None] - _ENTRIES).argmin(axis=-1)]
            if not any(np.array_equal(made, known) for known in rotations):
                rotations.append(made)
    return read_only(np.array(rotations))


def recognised(group: Array) -> str | None:
    """Return the symbol of the proper point group with the same elements, in any order, or None."""
    if group.shape[1:] != (3, 3) or group.dtype.kind != "f":
        return None
    for symbol in _GENERATORS:
        rotations = elements(symbol)
        if len(rotations) == len(group):
            off = np.abs(group[:, None] - rotations).max(axis=(-2, -1))
            if off.min(axis=0).max() < 1e-8 and off.min(axis=1).max() < 1e-8:
                return symbol
    return None


# ---- finite groups of transformations of a space: multiplication by matrices from one side or both ----

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

    def __init__(self, space: AnySpace, group: Any, side: Side) -> None:
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
        return tuple(factor.elements[of_factor[index]] for factor, of_factor in both if factor is not None)

    def move(self, x: Array, index: Any, axes: int) -> Array:
        """Apply the transformations with some indices to points or tangent vectors with `axes` axes each."""
        if self.left is not None:
            x = self.left.move(x, self._of_left[index], axes)
        return x if self.right is None else self.right.move(x, self._of_right[index], axes)


def _read(space: AnySpace, group: object, size: int) -> tuple[Array, str]:
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


def _named(space: AnySpace, name: str, size: int) -> tuple[Array, str]:
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
        return np.array([np.diag(signs) for signs in product([1.0, -1.0], repeat=size)]).astype(space.dtype), SIGNS
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
    matrices = matrices_of_quaternions(group.data).reshape(-1, 3, 3)
    same = np.abs(matrices[:, None] - matrices).max(axis=(-2, -1)) < _TOL
    return matrices[~np.tril(same, -1).any(axis=1)]


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


# ---- continuous representatives of points of a quotient space, along paths and over grids ----

# Two representatives are nearly equally near if their distances differ by less than this fraction.
_CLOSE = 0.1
# Distances below this are rounding errors.
_ZERO = 1e-9
# The number of loops and nodes that a warning names.
_SHOWN = 3


class Nearest(NamedTuple):
    """The transformations that bring points q nearest to points p.

    Attributes
    ----------
    moves : ndarray of int
        Indices of the transformations.
    distance : ndarray
        The distance to the nearest representative; infinite if it is unknown.
    ambiguous : ndarray of bool
        Whether another representative is nearly equally near.
    """

    moves: Indices
    distance: NDArray[np.float64]
    ambiguous: NDArray[np.bool_]


Compare = Callable[[Array, Array], Nearest]


def nearest_of(distances: NDArray[np.float64], same: Callable[[Any, Indices, Indices], Any]) -> Nearest:
    """Return the nearest representatives from the distances of all of them, shape (m, k).

    Parameters
    ----------
    same : callable
        ``same(rows, i, j)``, whether the representatives i and j of some rows are equal.
    """
    index = np.argmin(distances, axis=1)
    rows = np.arange(len(index))
    least = distances[rows, index]
    near = distances <= (1 + _CLOSE) * least[:, None] + _ZERO
    near[rows, index] = False
    ambiguous = near.any(axis=1) & np.isfinite(least)
    # Points with a symmetry have equal representatives.
    some = np.flatnonzero(ambiguous)
    if some.size:
        row, other = np.nonzero(near[some])
        differ = ~same(some[row], index[some[row]], other)
        ambiguous[some] = np.bincount(row[differ], minlength=some.size) > 0
    return Nearest(index, least, ambiguous)


def along_path(group: FiniteGroup, points: Array, finite: NDArray[np.bool_], compare: Compare) -> Indices:
    """Return the transformations that make points continuous along a path.

    Parameters
    ----------
    points : ndarray, shape (..., n, *point_shape)
    finite : ndarray of bool, shape (..., n)
        Valid mask of the points. The path continues beyond masked points.
    compare : callable
        ``compare(p, q)`` for rows of points.

    Returns
    -------
    ndarray of int, shape (..., n)
        The first existing point of each path is unchanged.
    """
    count = finite.shape[-1]
    where = np.where(finite, np.arange(count), -1)
    before = np.maximum.accumulate(where, axis=-1)[..., :-1]
    joined = np.zeros(finite.shape, bool)
    joined[..., 1:] = finite[..., 1:] & (before >= 0)
    node = np.nonzero(joined)
    previous = (*node[:-1], before[(*node[:-1], node[-1] - 1)])
    nearest = compare(points[previous], points[node])
    total = np.full(finite.shape, group.identity)
    total[node] = nearest.moves
    _warn_ambiguous(nearest, [node[-1], previous[-1]], node[:-1], 1)
    # Prefix products of all steps, in logarithmically many passes.
    shift = 1
    while shift < count:
        total[..., shift:] = group.table[total[..., :-shift], total[..., shift:]]
        shift *= 2
    return total


def over_grid(group: FiniteGroup, points: Array, finite: NDArray[np.bool_], compare: Compare) -> Indices:
    """Return the transformations that make points continuous over one grid, without batch axes.

    Points are joined along a minimum spanning tree of the distances between neighbours. Loops whose steps do not
    return to the same representative cause a warning.
    """
    shape, numbers = finite.shape, np.arange(finite.size).reshape(finite.shape)
    rows = points.reshape(finite.size, *points.shape[finite.ndim :])
    pairs, steps = [], []
    for axis in range(finite.ndim):
        u, v = (np.moveaxis(numbers, axis, 0)[part].ravel() for part in (slice(-1), slice(1, None)))
        both = finite.flat[u] & finite.flat[v]
        u, v = u[both], v[both]
        pairs.append((u, v))
        steps.append(compare(rows[u], rows[v]))
    u, v = (np.concatenate([part[i] for part in pairs]) for i in (0, 1))
    nearest = Nearest(*(np.concatenate(arrays) for arrays in zip(*steps, strict=True)))
    total, tree = _spanning_tree(group, finite.size, u, v, nearest)
    in_tree = Nearest(nearest.moves[tree], nearest.distance[tree], nearest.ambiguous[tree])
    nodes = [np.stack(np.unravel_index(part[tree], shape), axis=-1) for part in (v, u)]
    _warn_ambiguous(in_tree, nodes, (), finite.ndim)
    open_edges = np.flatnonzero(group.table[total[u], nearest.moves] != total[v])
    if open_edges.size:
        open_u, open_v = u[open_edges], v[open_edges]
        axes = rows.ndim - 1
        moved = group.move(rows[open_v], group.table[total[open_u], nearest.moves[open_edges]], axes)
        off = np.abs(moved - group.move(rows[open_v], total[open_v], axes)).reshape(open_edges.size, -1).max(axis=-1)
        open_edges = open_edges[off > _ZERO]
    if open_edges.size:
        _warn_open(group, shape, pairs, steps, (u[open_edges], v[open_edges]))
    return total.reshape(shape)


def _spanning_tree(group: FiniteGroup, count: int, u: Indices, v: Indices, steps: Nearest) -> tuple[Indices, Indices]:
    """Join nodes along a minimum spanning forest by Borůvka's algorithm.

    Returns
    -------
    total : ndarray of int, shape (count,)
        Transformations of the nodes. The first node of each tree is unchanged.
    tree : ndarray of int
        Edges of the forest.
    """
    table, inverse, identity = group.table, group.inverse, group.identity
    root, total = np.arange(count), np.full(count, identity)
    # From the longest to the shortest edge, so that the last of several assignments is the shortest. The order is
    # strict, and so the edges that are selected form no loops.
    edges = np.argsort(-steps.distance, kind="stable")
    tree: list[Indices] = []
    while True:
        of_u, of_v = root[u[edges]], root[v[edges]]
        edges = edges[of_u != of_v]
        if not edges.size:
            break
        of_u, of_v = root[u[edges]], root[v[edges]]
        best = np.full(count, -1)
        rank = np.full(count, -1)
        position = np.arange(edges.size)
        for ends in (of_u, of_v):
            positions = np.full(count, -1)
            positions[ends] = position
            np.maximum(rank, positions, out=rank)
        active = np.flatnonzero(rank >= 0)
        best = edges[rank[active]]
        a, b = root[u[best]], root[v[best]]
        other = np.where(a == active, b, a)
        # Bring the tree of `active` to the representatives of the other one.
        to_a = table[table[total[u[best]], steps.moves[best]], inverse[total[v[best]]]]
        change = np.where(a == active, inverse[to_a], to_a)
        parent, relative = np.arange(count), np.full(count, identity)
        parent[active], relative[active] = other, change
        # Two trees that selected the same edge would be parents of each other.
        mutual = active[(parent[other] == active) & (active < other)]
        parent[mutual], relative[mutual] = mutual, identity
        tree.append(np.unique(best))
        while not np.array_equal(parent[parent], parent):
            relative = table[relative[parent], relative]
            parent = parent[parent]
        total = table[relative[root], total]
        root = parent[root]
    first = np.full(count, count)
    np.minimum.at(first, root, np.arange(count))
    total = table[inverse[total[first[root]]], total]
    return total, np.concatenate(tree) if tree else np.zeros(0, np.intp)


def _warn_ambiguous(nearest: Nearest, nodes: list[Indices], batch: tuple[Indices, ...], axes: int) -> None:
    """Warn if two representatives of a node are nearly equally near to the node before it."""
    some = np.flatnonzero(nearest.ambiguous)
    if not some.size:
        return
    i = some[0]
    node, before = (tuple(np.atleast_1d(index[i]).tolist()) for index in nodes)
    curve = tuple(int(index[i]) for index in batch)
    more = f" (and {some.size - 1} more nodes)" if some.size > 1 else ""
    name, other = (f"points[{', '.join(map(str, (*curve, *index)))}]" for index in (node, before))
    warn(
        f"two representatives are nearly equally near: {name}{more} has two representatives whose distances from "
        f"{other} differ by less than {_CLOSE:.0%}. The nearest one, at a distance of {nearest.distance[i]:.3g}, was "
        "chosen, but the other one may be meant. Use samples that are closer together, or smooth the data first.",
        UserWarning,
        curve,
        node[0] if axes == 1 else None,
    )


def _warn_open(
    group: FiniteGroup,
    shape: tuple[int, ...],
    pairs: list[tuple[Indices, Indices]],
    steps: list[Nearest],
    edges: tuple[Indices, Indices],
) -> None:
    """Warn of loops around which the nearest representatives do not return to the first one."""
    loops = _open_squares(group, shape, pairs, steps)
    if loops:
        what = [" – ".join(map(str, loop)) for loop in loops[:_SHOWN]]
        count, kind = len(loops), "squares of four neighbours"
    else:
        # The loop surrounds missing nodes.
        both = (np.stack(np.unravel_index(ends, shape), axis=-1).tolist() for ends in edges)
        what = [f"{tuple(a)} – {tuple(b)}" for a, b in list(zip(*both, strict=True))[:_SHOWN]]
        count, kind = len(edges[0]), "loops around missing nodes, through the neighbours"
    named = "; ".join(what) + ("; …" if count > _SHOWN else "")
    warn(
        f"representatives are not continuous over the whole grid: around {count} {kind} the nearest representatives do "
        f"not return to the first one: {named}. {len(edges[0])} pairs of neighbours are not joined by the nearest "
        "representatives. Where the data jump, as at grain boundaries, treat the two sides separately; set nodes there "
        "to NaN, or use a finer grid.",
        UserWarning,
    )


def _open_squares(
    group: FiniteGroup, shape: tuple[int, ...], pairs: list[tuple[Indices, Indices]], steps: list[Nearest]
) -> list[tuple[tuple[int, ...], ...]]:
    """Return the squares of four neighbours, in order around the square, whose steps do not return to the start."""
    total = int(np.prod(shape))
    index = []
    for (u, _), entry in zip(pairs, steps, strict=True):
        full = np.full(total, -1)
        full[u] = entry.moves
        index.append(full.reshape(shape))
    numbers = np.arange(total).reshape(shape)
    loops = []
    for a, b in combinations(range(len(shape)), 2):

        def corner(array: Any, i: int, j: int, a: int = a, b: int = b) -> Any:
            index: list[slice] = [slice(None)] * len(shape)
            index[a], index[b] = (slice(-1), slice(1, None))[i], (slice(-1), slice(1, None))[j]
            return array[tuple(index)]

        along_a, then_b = corner(index[a], 0, 0), corner(index[b], 1, 0)
        along_b, then_a = corner(index[b], 0, 0), corner(index[a], 0, 1)
        known = (along_a >= 0) & (then_b >= 0) & (along_b >= 0) & (then_a >= 0)
        is_open = known & (group.table[along_a, then_b] != group.table[along_b, then_a])
        around = [corner(numbers, *entry)[is_open] for entry in ((0, 0), (1, 0), (1, 1), (0, 1))]
        corners = [np.stack(np.unravel_index(entry, shape), axis=-1).tolist() for entry in around]
        loops += [tuple(map(tuple, loop)) for loop in zip(*corners, strict=True)]
    return loops
