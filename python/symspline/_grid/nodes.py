"""Points at the nodes of a grid: reading and validation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .._base.arrays import filled, refuse
from .._base.report import FarPointsWarning
from .._base.warnings import warn
from .._core import CutLocusError, ValidationError
from .._curves.ends import NATURAL
from .._curves.fit import Points, validated
from .._curves.representatives import FAR, cut_fractions
from .._spaces import Array, Quotient, Space, cover_of, factors_of, parts_of
from .axes import GridAxis


def read_nodes(points: Any, space: Space[Any], dims: int) -> tuple[list[Array], list[float], tuple[int, ...]]:
    """Read points in each factor, their tolerances, and the numbers of nodes of the grid.

    Masked numbers become NaN. In quotients, representatives are chosen that are continuous over the grid.
    """
    parts = parts_of(points, space, "points")
    arrays, tols = [], []
    for factor, part in zip(factors_of(space), parts, strict=True):
        array = factor._array(filled(part), "points")
        arrays.append(np.array(factor._numbers(factor._doubles(array, "points"))))
        tols.append(factor._tol(array))
    shapes = [a.shape[: a.ndim - len(f.point_shape)] for f, a in zip(factors_of(space), arrays, strict=True)]
    if len(set(shapes)) > 1:
        raise ValidationError(f"the factors of points have different numbers of nodes: {shapes}")
    if len(shapes[0]) == dims:
        arrays = [_unwrapped(*pair, dims) for pair in zip(factors_of(space), arrays, strict=True)]
    return arrays, tols, shapes[0]


def _unwrapped(space: Space[Any], array: Array, dims: int) -> Array:
    """Choose representatives that are continuous over the grid."""
    if not isinstance(space, Quotient):
        return array
    moves = space._transformations(array, space._where_finite(array), dims)
    return np.ascontiguousarray(space._moved_by(array, moves))


def validate_nodes(space: Space[Any], arrays: list[Array], tols: list[float], axes: list[GridAxis]) -> None:
    """Validate points and project them onto the space, in place. Nodes that are missing in one factor are NaN in all.

    Raises
    ------
    ValidationError
        If a point is not on the space, or the ends of a periodic axis differ.
    """
    factors = factors_of(space)
    lead = tuple(len(axis.knots) for axis in axes)
    missing = np.zeros(lead, bool)
    for factor, array in zip(factors, arrays, strict=True):
        own = factor._point_axes(array)
        refuse(
            np.asarray(np.isinf(array).any(axis=own)), "points", lambda _: "is infinite. Mark missing nodes with NaN."
        )
        missing |= np.isnan(array).any(axis=own)
    if missing.all():
        raise ValidationError("points has no valid node: every node contains NaN")
    for factor, array, tol in zip(factors, arrays, tols, strict=True):
        array[missing] = np.nan
        array[~missing] = _on_space(factor, array[~missing], tol, np.argwhere(~missing))
    for k, axis in enumerate(axes):
        if axis.is_periodic:
            _close(space, arrays, k)


def _on_space(space: Space[Any], points: Array, tol: float, nodes: Array) -> Array:
    """Return points projected onto the space."""
    space = cover_of(space)
    single = len(points) == 1
    rows = np.ascontiguousarray(np.repeat(points, 2, axis=0) if single else points)
    data = Points(space._as_doubles(rows), tol, (), len(rows))
    try:
        (found,), _ = validated(space, np.arange(float(len(rows))), [data], [NATURAL])
    except ValidationError as error:
        node: Any = vars(error).get("node")
        if node is None or (node >= len(nodes) and not single):
            raise
        index = nodes[0 if single else node].tolist()
        raise error._with_message(str(error).replace(f"points[{node}]", f"points{index}", 1)) from None
    return found[:1] if single else found


def _close(space: Space[Any], arrays: list[Array], axis: int) -> None:
    """Make the first and the last nodes of a periodic axis equal, in place."""
    for factor, array in zip(map(cover_of, factors_of(space)), arrays, strict=True):
        first, last = (np.take(array, i, axis=axis) for i in (0, -1))
        both = factor._where_finite(first) & factor._where_finite(last)
        apart = np.zeros(both.shape)
        if both.any():
            apart[both] = factor.distance(first[both], last[both])
        far = apart > 1e-7 * np.maximum(1.0, np.abs(first).max(initial=1.0, where=np.isfinite(first)))
        if far.any():
            index = np.argwhere(far)[0].tolist()
            index.insert(axis, ":")
            where = ", ".join(map(str, index))
            raise ValidationError(
                f"axis {axis} is periodic, but its first and last nodes in points[{where}] are {apart[far][0]:.3g} "
                "apart. Repeat the first node at the end of the axis."
            )
        # A node that is missing at one end is taken from the other.
        only_last = ~factor._where_finite(first) & factor._where_finite(last)
        first[only_last] = last[only_last]
        edge: list[Any] = [slice(None)] * array.ndim
        for i in (0, -1):
            edge[axis] = i
            array[tuple(edge)] = first


def check_steps(space: Space[Any], arrays: list[Array], dims: int, raises: bool) -> None:
    """Raise an error or warn about neighbouring nodes that are far apart.

    Raises
    ------
    CutLocusError
        If two neighbours are at or past each other's cut locus, and `raises` is true.

    Warns
    -----
    FarPointsWarning
        If more than half of the steps along an axis exceed 0.6 of the distance to the cut locus.
    """
    for factor, array in zip(map(cover_of, factors_of(space)), arrays, strict=True):
        if math.isinf(factor.injectivity_radius):
            continue
        for k in range(dims):
            rows = np.moveaxis(array, k, dims - 1)
            fractions = cut_fractions(factor, rows)
            known = fractions[np.isfinite(fractions)]
            if not known.size or known.max() <= FAR:
                continue
            if raises and known.max() >= 1:
                *others, i = np.argwhere(fractions >= 1)[0].tolist()
                node, after = ([*others[:k], j, *others[k:]] for j in (i, i + 1))
                raise CutLocusError(
                    f"points{node} and points{after} lie at or past each other's cut locus on {factor!r}: no unique "
                    "shortest geodesic joins them. Put nodes between them, or mark one of them as missing with NaN."
                )
            far = int(np.count_nonzero(known > FAR))
            if far > known.size / 2:
                warn(
                    f"more than half of the steps are long: along axis {k}, {far} of {known.size} steps between "
                    f"neighbouring nodes are beyond {FAR} of the way to the cut locus of {factor!r}. Usually the "
                    "representation of the points is inconsistent. Where points have equivalent representatives, "
                    "pass a Quotient as space; its method unwrap chooses representatives that are continuous over the "
                    "grid. Otherwise add nodes.",
                    FarPointsWarning,
                )
