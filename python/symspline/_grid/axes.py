"""The axes of a grid, coordinates to evaluate at, and the points at its nodes."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Self

import numpy as np

from .._base.arrays import as_array, filled, refuse, short_repr
from .._base.faults import renamed, warn
from .._base.report import FarPointsWarning
from .._base.time import TimeAxis, time_axis_of
from .._base.typing import Array, PointsLike, TimesLike
from .._core import CutLocusError, ValidationError
from .._curves.ends import NATURAL
from .._curves.failures import FAR, cut_fractions
from .._curves.fit import Points, validated
from .._curves.options import extrapolation_mode
from .._spaces import AnySpace, Doubles, Quotient, cover_of, factors_of, parts_of

Ends = tuple[str, str] | None
_WORDS = ("natural", "not-a-knot", "clamped")
# Remedy for coordinates outside their axis.
CONTINUE = "pass extrapolate=True or 'geodesic' to continue the spline there, or False for NaN"
_HELP = (
    "bc_type must be 'natural', 'not-a-knot', 'clamped' or 'periodic', or a sequence with one entry per axis, each of "
    "these or a pair of 'natural', 'not-a-knot' or 'clamped' for the start and the end of the axis"
)


class GridAxis(NamedTuple):
    """One axis of a grid.

    Attributes
    ----------
    time_axis : TimeAxis
        Conversion of coordinates of the user to numbers of the core.
    t : ndarray, shape (n,)
        Knots as given.
    knots : ndarray, shape (n,)
        Knots as numbers of the core.
    ends : tuple of str or None
        Conditions at both ends; None for a periodic axis.
    """

    time_axis: TimeAxis
    t: Array
    knots: Doubles
    ends: Ends

    @property
    def bc_type(self) -> str | tuple[str, str]:
        """End conditions as the user would pass them."""
        if self.ends is None:
            return "periodic"
        return self.ends[0] if self.ends[0] == self.ends[1] else self.ends

    @property
    def is_periodic(self) -> bool:
        """Whether the axis repeats."""
        return self.ends is None

    def wrapped(self, x: Doubles) -> Doubles:
        """Return the coordinates inside the axis of which those outside are repetitions."""
        first, last = self.knots[0], self.knots[-1]
        inside = np.minimum(first + (x - first) % (last - first), last)
        return np.where((x < first) | (x > last), inside, x)


class Sites(NamedTuple):
    """Coordinates at which a grid is evaluated.

    Attributes
    ----------
    x : list of ndarray
        Coordinates along each axis as numbers of the core: of equal lengths, or of any lengths for an outer product.
    outer : bool
        Whether these are the factors of an outer product.
    modes : list of str
        Extrapolation policy along each axis, by its name in the core.
    """

    x: list[Doubles]
    outer: bool
    modes: list[str]

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the results without the axes of a point."""
        return tuple(len(x) for x in self.x) if self.outer else self.x[0].shape

    def reversed(self) -> Self:
        """Return the same coordinates with the order of axes reversed."""
        return self._replace(x=self.x[::-1], modes=self.modes[::-1])

    def block(self, chosen: slice) -> Self:
        """Return some of the coordinates: along the first axis in an outer product, and otherwise along all axes."""
        return self._replace(x=[x if k and self.outer else x[chosen] for k, x in enumerate(self.x)])

    def along(self, axis: int, x: Doubles) -> Self:
        """Return these coordinates with others along one axis."""
        return self._replace(x=[*self.x[:axis], x, *self.x[axis + 1 :]])


def read_axes(axes: object, shape: tuple[int, ...] | None, bc_type: Any) -> list[GridAxis]:
    """Read the axes of a grid.

    Parameters
    ----------
    axes : sequence
        Knots of each axis; None counts the nodes from 0.
    shape : tuple of int
        Numbers of nodes.
    bc_type : str or sequence
        End conditions as in `GridSpline`.
    """
    if not isinstance(axes, (tuple, list)) or len(axes) == 0:
        raise ValidationError(
            f"axes must be a tuple with the knots of each axis, such as (u, v), not {short_repr(axes)}"
        )
    dims = len(axes)
    conditions = _conditions(bc_type, dims)
    if shape is None or len(shape) < dims:
        raise ValidationError(f"points has {len(shape or ())} grid axes, but there are {dims} axes of knots")
    if len(shape) > dims:
        raise ValidationError(
            f"points has the grid axes {shape}, but there are {dims} axes of knots. Pass one array of knots per axis, "
            "or None for 0, 1, ..., n - 1."
        )
    return [_axis(k, *arguments) for k, arguments in enumerate(zip(axes, shape, conditions, strict=True))]


def _axis(k: int, t: TimesLike | None, nodes: int, ends: Ends) -> GridAxis:
    if nodes < 2:
        raise ValidationError(f"axis {k} of points has {nodes} nodes, but a spline needs at least two")
    if t is None:
        t = np.arange(nodes, dtype=np.float64)
    time_axis, shown = time_axis_of(t)
    if shown.shape != (nodes,):
        raise ValidationError(f"axes[{k}] has shape {shown.shape}, but points has {nodes} nodes along axis {k}")
    knots = time_axis.knots(shown)
    refuse(~np.isfinite(knots), f"axes[{k}]", lambda index: f"is {knots[index]}, but knots must be finite")
    steps = np.diff(knots)
    bad = np.flatnonzero(~(steps > 0))
    if bad.size:
        i = int(bad[0])
        raise ValidationError(
            f"axes[{k}][{i + 1}] = {shown[i + 1]} is not greater than axes[{k}][{i}] = {shown[i]}, but knots must "
            "increase. Sort the knots together with the points, and merge nodes with equal knots."
        )
    return GridAxis(time_axis, shown, knots, ends)


def _conditions(bc_type: object, dims: int) -> list[Ends]:
    if isinstance(bc_type, str):
        return [_ends(bc_type)] * dims
    if not isinstance(bc_type, (tuple, list)) or len(bc_type) != dims:
        raise ValidationError(f"{_HELP}; got {short_repr(bc_type)} for {dims} axes")
    return [_ends(value) for value in bc_type]


def _ends(value: object) -> Ends:
    if isinstance(value, str) and value == "periodic":
        return None
    pair = (value, value) if isinstance(value, str) else value
    if isinstance(pair, (tuple, list)) and len(pair) == 2 and all(isinstance(w, str) and w in _WORDS for w in pair):
        return pair[0], pair[1]
    raise ValidationError(f"{_HELP}; got {short_repr(value)}")


def coordinates(axes: list[GridAxis], x: Any, outer: bool) -> tuple[list[Doubles], tuple[int, ...], bool]:
    """Read coordinates along each axis.

    Returns
    -------
    list of ndarray
        Flat coordinates as numbers of the core.
    tuple of int
        Shape of the results.
    bool
        Whether the coordinates are the factors of an outer product.
    """
    dims = len(axes)
    if not outer and not isinstance(x, (tuple, list)):
        array = as_array(x, "x")
        if dims == 1 and (array.ndim == 0 or array.shape[-1:] != (1,)):
            x = (array,)
        elif array.ndim and array.shape[-1] == dims:
            x = tuple(np.moveaxis(array, -1, 0))
        else:
            raise ValidationError(
                f"x has shape {array.shape}, but its last axis must hold the {dims} coordinates. Pass a tuple of "
                f"{dims} arrays, or an array of shape (..., {dims})."
            )
    if len(x) != dims:
        raise ValidationError(f"x has {len(x)} coordinates, but the grid has {dims} axes")
    arrays = [axis.time_axis.at(x_k, (), False, axis.knots)[0] for axis, x_k in zip(axes, x, strict=True)]
    for k, x_k in enumerate(arrays):
        refuse(~np.isfinite(x_k), f"x[{k}]", lambda _: "is not finite; coordinates must be finite")
    if outer:
        for k, x_k in enumerate(arrays):
            if x_k.ndim > 1:
                raise ValidationError(f"the coordinates along axis {k} have shape {x_k.shape}, but must be a vector")
        lead = tuple(size for x_k in arrays for size in x_k.shape)
        return [np.ascontiguousarray(x_k.ravel()) for x_k in arrays], lead, True
    try:
        shape = np.broadcast_shapes(*(x_k.shape for x_k in arrays))
    except ValueError:
        shapes = ", ".join(str(x_k.shape) for x_k in arrays)
        raise ValidationError(f"the coordinates do not broadcast: their shapes are {shapes}") from None
    if dims > 1 and len(shape) == dims and all(x_k.size == x_k.shape[k] for k, x_k in enumerate(_padded(arrays))):
        # Each coordinate varies along an axis of its own, as those of an open mesh do.
        return [np.ascontiguousarray(x_k.ravel()) for x_k in arrays], shape, True
    return [np.ascontiguousarray(np.broadcast_to(x_k, shape).ravel()) for x_k in arrays], shape, False


def _padded(arrays: list[Doubles]) -> list[Doubles]:
    most = max(array.ndim for array in arrays)
    return [array.reshape((1,) * (most - array.ndim) + array.shape) for array in arrays]


def sites_of(
    axes: list[GridAxis], x: list[Doubles], outer: bool, extrapolate: object, remedy: str = CONTINUE
) -> tuple[Sites, list[np.ndarray[Any, np.dtype[np.bool_]]]]:
    """Return sites under an extrapolation policy, and for each axis which coordinates give NaN.

    Parameters
    ----------
    remedy : str
        Remedy for coordinates outside their axis, for messages.

    Raises
    ------
    ValidationError
        If the policy is to raise and a coordinate is outside its axis.
    """
    kept, modes, missing = [], [], []
    for k, (axis, times) in enumerate(zip(axes, x, strict=True)):
        mode = extrapolation_mode(extrapolate, axis.bc_type)
        first, last = axis.knots[0], axis.knots[-1]
        outside = ~((times >= first) & (times <= last))
        if mode == "raise" and outside.any():
            i = int(np.flatnonzero(outside)[0])
            message = f"the coordinate {times[i]} is outside axis {k}, which extends from {first} to {last}; {remedy}"
            raise axis.time_axis.explain(ValidationError(message))
        missing.append(outside if mode == "nan" else np.zeros(outside.shape, bool))
        kept.append(np.where(outside, first, times) if mode == "nan" else times)
        modes.append("continue" if mode in ("raise", "nan") else mode)
    return Sites(kept, outer, modes), missing


# ---- points at the nodes of a grid: reading and validation ----


def read_nodes(points: PointsLike, space: AnySpace, dims: int) -> tuple[list[Array], list[float], tuple[int, ...]]:
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


def _unwrapped(space: AnySpace, array: Array, dims: int) -> Array:
    """Choose representatives that are continuous over the grid."""
    if not isinstance(space, Quotient):
        return array
    moves = space._transformations(array, space._where_finite(array), dims)
    return np.ascontiguousarray(space._moved_by(array, moves))


def validate_nodes(space: AnySpace, arrays: list[Array], tols: list[float], axes: list[GridAxis]) -> None:
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
        refuse(
            np.asarray(np.isinf(array).any(axis=factor._point_axes)),
            "points",
            lambda _: "is infinite. Mark missing nodes with NaN.",
        )
        missing |= np.isnan(array).any(axis=factor._point_axes)
    if missing.all():
        raise ValidationError("points has no valid node: every node contains NaN")
    for factor, array, tol in zip(factors, arrays, tols, strict=True):
        array[missing] = np.nan
        array[~missing] = _on_space(factor, array[~missing], tol, np.argwhere(~missing))
    for k, axis in enumerate(axes):
        if axis.is_periodic:
            _close(space, arrays, k)


def _on_space(space: AnySpace, points: Array, tol: float, nodes: Array) -> Array:
    """Return points projected onto the space."""
    space = cover_of(space)
    single = len(points) == 1
    rows = np.ascontiguousarray(np.repeat(points, 2, axis=0) if single else points)
    data = Points(space._as_doubles(rows), tol, (), len(rows))
    try:
        (on_space,), _ = validated(space, np.arange(float(len(rows))), [data], [NATURAL])
    except ValidationError as error:
        index = {i: ", ".join(map(str, nodes[0 if single else i])) for i in range(len(rows))}
        raise renamed(error, lambda sample: (sample.argument, index[sample.node])) from None
    return on_space[:1] if single else on_space


def _close(space: AnySpace, arrays: list[Array], axis: int) -> None:
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


def check_steps(space: AnySpace, arrays: list[Array], dims: int, raises: bool) -> None:
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
