"""Continuous representatives of points of a quotient space, along paths and over grids."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.faults import warn
from .base import Array
from .finite_groups import FiniteGroup, Indices

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
    found = compare(points[previous], points[node])
    total = np.full(finite.shape, group.identity)
    total[node] = found.moves
    _warn_ambiguous(found, [node[-1], previous[-1]], node[:-1], 1)
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
        u, v = (np.moveaxis(numbers, axis, 0)[own].ravel() for own in (slice(-1), slice(1, None)))
        both = finite.flat[u] & finite.flat[v]
        u, v = u[both], v[both]
        pairs.append((u, v))
        steps.append(compare(rows[u], rows[v]))
    u, v = (np.concatenate([own[i] for own in pairs]) for i in (0, 1))
    found = Nearest(*(np.concatenate(each) for each in zip(*steps, strict=True)))
    total, tree = _spanning_tree(group, finite.size, u, v, found)
    in_tree = Nearest(found.moves[tree], found.distance[tree], found.ambiguous[tree])
    nodes = [np.stack(np.unravel_index(own[tree], shape), axis=-1) for own in (v, u)]
    _warn_ambiguous(in_tree, nodes, (), finite.ndim)
    open_edges = np.flatnonzero(group.table[total[u], found.moves] != total[v])
    if open_edges.size:
        own_u, own_v = u[open_edges], v[open_edges]
        axes = rows.ndim - 1
        moved = group.move(rows[own_v], group.table[total[own_u], found.moves[open_edges]], axes)
        off = np.abs(moved - group.move(rows[own_v], total[own_v], axes)).reshape(open_edges.size, -1).max(axis=-1)
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
            own = np.full(count, -1)
            own[ends] = position
            np.maximum(rank, own, out=rank)
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


def _warn_ambiguous(found: Nearest, nodes: list[Indices], batch: tuple[Indices, ...], axes: int) -> None:
    """Warn if two representatives of a node are nearly equally near to the node before it."""
    some = np.flatnonzero(found.ambiguous)
    if not some.size:
        return
    i = some[0]
    node, before = (tuple(np.atleast_1d(own[i]).tolist()) for own in nodes)
    curve = tuple(int(own[i]) for own in batch)
    more = f" (and {some.size - 1} more nodes)" if some.size > 1 else ""
    name, other = (f"points[{', '.join(map(str, (*curve, *own)))}]" for own in (node, before))
    warn(
        f"two representatives are nearly equally near: {name}{more} has two representatives whose distances from "
        f"{other} differ by less than {_CLOSE:.0%}. The nearest one, at a distance of {found.distance[i]:.3g}, was "
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
        both = (np.stack(np.unravel_index(own, shape), axis=-1).tolist() for own in edges)
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
    for (u, _), own in zip(pairs, steps, strict=True):
        full = np.full(total, -1)
        full[u] = own.moves
        index.append(full.reshape(shape))
    numbers = np.arange(total).reshape(shape)
    loops = []
    for a, b in combinations(range(len(shape)), 2):

        def corner(array: Any, i: int, j: int, a: int = a, b: int = b) -> Any:
            own: list[slice] = [slice(None)] * len(shape)
            own[a], own[b] = (slice(-1), slice(1, None))[i], (slice(-1), slice(1, None))[j]
            return array[tuple(own)]

        along_a, then_b = corner(index[a], 0, 0), corner(index[b], 1, 0)
        along_b, then_a = corner(index[b], 0, 0), corner(index[a], 0, 1)
        known = (along_a >= 0) & (then_b >= 0) & (along_b >= 0) & (then_a >= 0)
        is_open = known & (group.table[along_a, then_b] != group.table[along_b, then_a])
        around = [corner(numbers, *own)[is_open] for own in ((0, 0), (1, 0), (1, 1), (0, 1))]
        each = [np.stack(np.unravel_index(own, shape), axis=-1).tolist() for own in around]
        loops += [tuple(map(tuple, loop)) for loop in zip(*each, strict=True)]
    return loops
