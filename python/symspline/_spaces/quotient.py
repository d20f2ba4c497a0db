"""Quotients of spaces by finite groups, where equivalent points count as one."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import short_repr, whole_number
from .._base.typing import Array, P, PointsLike
from .._core import CutLocusError, ValidationError
from .base import DERIVED, AnySpace, Space
from .finite_groups import Factor, FiniteGroup, Indices, Nearest, along_path, nearest_of, over_grid
from .groups import SpecialOrthogonal, SpecialUnitary, names_points
from .product import Product, factors_of, space_named

# Operations on two points, of which the second one is replaced by its representative nearest to the first.
_OF_PAIRS = ("distance", "log", "geodesic", "transport")
# Classes of quotients by the class of their spaces.
_CLASSES: dict[type, type] = {}
# Largest number of floating-point numbers of the representatives that are compared at a time.
_BLOCK = 2**22
# Errors of transformations that are not isometries are larger than this.
_TOL = 1e-6


class Quotient(Space[P]):
    """The quotient of a space by a finite group, where equivalent points count as one.

    A point is any of its representatives, an array of the given space. Curves are fitted through representatives that
    are continuous along the curve, so that they may be given in any order and choice. Use it for orientations of
    crystals and symmetric objects, gates up to a phase, axes, and bases with arbitrary signs.

    Parameters
    ----------
    space : Space or str
        The space of representatives, or its name. It must not be a product; make quotients of its factors instead.
    group : array_like or str
        All elements of a finite group: matrices of shape (k, m, m), which multiply points from the right, or numbers
        of shape (k,). Also the symbol of a point group, see `symspline.rotations.point_group`; ``"signs"``, which
        changes the signs of columns; a SciPy ``Rotation``; or an orix ``Symmetry``, ``Orientation`` or
        ``Misorientation``, which supply their symmetry and its side.
    left : bool or array_like, default False
        Whether the matrices multiply from the left. Vectors are columns on their right and rows on their left.
        Alternatively a second group, which multiplies from the left while `group` multiplies from the right.

    Attributes
    ----------
    cover : Space
        The space of representatives.

    Raises
    ------
    ValidationError
        If the group is not closed under multiplication, or an element does not map the space to itself isometrically.

    See Also
    --------
    symspline.rotations.point_group : The point groups of crystals.
    RealProjective, ComplexProjective : Vectors up to a sign or phase.
    Grassmannian : Subspaces, whatever their bases.

    Notes
    -----
    Distances are the smallest ones between representatives, such as the disorientation of crystals, and `Space.log` and
    `Space.geodesic` lead to the nearest representative. Other methods and curves are those of the space of
    representatives.
    `Space.act` acts on representatives.

    Names of quotients are ``"so:3/432"`` for a group on the right, ``"432\\so:3"`` for one on the left, and
    ``"pu:4"`` for SU(4) up to phases.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> cubic = ss.Quotient("so:3", ss.rotations.point_group("432"))
    >>> cubic
    Quotient(SpecialOrthogonal(3), '432')
    >>> turned = ss.rotations.from_rotation_vectors([0, 0, np.radians(80)])
    >>> np.degrees(cubic.distance(np.eye(3), turned)).round(8)
    np.float64(10.0)

    Orientations 1, 2 and 3 have other representatives than orientation 0, but the curve turns by 30 degrees only:

    >>> angles = np.radians([0, 10 + 90, 20 - 180, 30 + 90])
    >>> given = ss.rotations.from_rotation_vectors(angles[:, None] * [0, 0, 1])
    >>> spline = ss.CubicSpline(None, given, cubic)
    >>> np.degrees(spline.length()).round(6)
    np.float64(30.0)
    """

    cover: Space[P]
    _group: FiniteGroup

    def __new__(cls, space: Space[P] | str, group: object, *, left: bool | PointsLike = False) -> Quotient[P]:
        cover = space_named(space)
        if isinstance(cover, (Product, Quotient)):
            remedy = (
                "Make quotients of its factors" if isinstance(cover, Product) else "Pass its space of representatives"
            )
            raise ValidationError(f"{cover!r} cannot be the space of a Quotient. {remedy}.")
        # The object is an instance of the class of its space, too, so that curves, pictures and functions of that
        # space accept it.
        made: Quotient[P] = object.__new__(_class_of(type(cover)))
        return made

    def __init__(self, space: Space[P] | str, group: object, *, left: bool | PointsLike = False) -> None:
        self.cover = space_named(space)
        vars(self).update(vars(self.cover))
        self._group = FiniteGroup(*_factors(self.cover, group, left))
        _check_isometries(self.cover, self._group)

    def __init_subclass__(cls) -> None:
        # The class for each kind of space has no name of its own.
        pass

    # Averages of representatives are not those of the points.
    _has_angles = False
    _has_quotients = True
    _first_means = Space._first_means
    _extrinsic_means = Space._extrinsic_means
    _whitening = Space._whitening
    _whitening_at = Space._whitening_at

    # ---- the group ----

    @property
    def group(self) -> Array | None:
        """Elements that multiply from the right, None if there are none."""
        return None if self._group.right is None else self._group.right.elements

    @property
    def left_group(self) -> Array | None:
        """Elements that multiply from the left, None if there are none."""
        return None if self._group.left is None else self._group.left.elements

    @property
    def injectivity_radius(self) -> float:
        """Distance below which two points are joined by a unique shortest geodesic.

        It is half of the distance to the nearest other representative, at most that of the space of representatives,
        and 0 if this distance is not the same for all points.
        """
        return self._radius_of_points

    @cached_property
    def _radius_of_points(self) -> float:
        radius = self.cover.injectivity_radius
        others = np.delete(np.arange(self._group.size), self._group.identity)
        if not others.size:
            return radius
        try:
            points: Any = self.cover.random_point(np.random.default_rng(0), 4)
        except ValidationError:
            # A manifold without `project` has no random points.
            return 0.0
        lengths = [self._lengths(points, self._moved_by(points, np.full(4, index))) for index in others]
        nearest = np.minimum(np.min(lengths, axis=0), 2 * radius)
        return min(radius, float(nearest.min()) / 2) if np.ptp(nearest) < 1e-6 else 0.0

    def _moved_by(self, x: Array, index: Any) -> Array:
        """Apply transformations with some indices to points or tangent vectors."""
        return self._group.move(x, index, len(self._point_shape))

    def _lengths(self, p: Array, q: Array) -> NDArray[np.float64]:
        """Return distances in the space of representatives; infinite where they are unknown."""
        functions = getattr(self.cover, "functions", None)
        with np.errstate(all="ignore"):
            if functions is None:
                lengths = self.cover._apply("distance", p=p, q=q)
            else:
                v = functions.log(p, q)
                lengths = np.sqrt(np.asarray(functions.inner(p, v, v)))
        return np.where(np.isfinite(lengths), lengths, np.inf)

    @cached_property
    def _products(self) -> NDArray[np.float64] | None:
        """Coefficients of tr pᵀT(q) for all transformations T of rotations, shape (9 · 9, k); None in other spaces."""
        if not isinstance(self.cover, SpecialOrthogonal) or self._point_shape != (3, 3):
            return None
        units = np.eye(9).reshape(9, 3, 3)
        maps = [self._moved_by(units, np.full(9, i)).reshape(9, 9).T for i in range(self._group.size)]
        return np.stack(maps, axis=-1).reshape(81, -1)

    def _nearest(self, p: Array, q: Array) -> Nearest:
        """Return the transformations that bring points q nearest to points p, of shape (m, *point_shape)."""
        size = self._group.size * max(1, math.prod(self._doubles_shape))
        rows = max(1, _BLOCK // size)
        blocks = [self._nearest_of_few(p[i : i + rows], q[i : i + rows]) for i in range(0, max(len(p), 1), rows)]
        return Nearest(*(np.concatenate(arrays) for arrays in zip(*blocks, strict=True)))

    def _nearest_of_few(self, p: Array, q: Array) -> Nearest:
        count = self._group.size
        if self._products is not None:
            # The angle of a rotation follows from its trace.
            outer = (p.reshape(-1, 9, 1) * q.reshape(-1, 1, 9)).reshape(-1, 81)
            distances = np.arccos(np.clip((outer @ self._products - 1) / 2, -1, 1))
        else:
            index = np.tile(np.arange(count), len(q))
            moved = self._moved_by(np.repeat(q, count, axis=0), index)
            distances = self._lengths(np.repeat(p, count, axis=0), moved).reshape(len(q), count)
        nearest = nearest_of(distances, lambda rows, i, j: self._are_equal(q[rows], i, j))
        # Traces do not give small angles accurately.
        return nearest if self._products is None else nearest._replace(distance=self._after(p, q, nearest.moves))

    def _after(self, p: Array, q: Array, index: Indices) -> NDArray[np.float64]:
        return self._lengths(p, self._moved_by(q, index))

    def _moved_like(self, given: Array, points: Array, vectors: Array) -> Array:
        """Apply to vectors at points the transformations that move the points to equivalent given ones."""
        shape = self._point_shape
        nearest = self._nearest(given.reshape(-1, *shape), points.reshape(-1, *shape))
        return self._moved_by(vectors, nearest.moves.reshape(given.shape[: given.ndim - len(shape)]))

    def _are_equal(self, x: Array, i: Indices, j: Indices) -> NDArray[np.bool_]:
        off = np.abs(self._moved_by(x, i) - self._moved_by(x, j)).reshape(len(x), -1)
        return np.asarray(off.max(axis=-1, initial=0.0) < _TOL)

    # ---- representatives ----

    def _array(self, value: Any, name: str) -> Array:
        array = self.cover._array(value, name)
        return _without_phase(array) if names_points(name) and self._full_name.startswith("pu:") else array

    def unwrap(self, points: ArrayLike, axes: int = 1) -> P:
        """Choose representatives that are continuous along a path or over a grid.

        Along a path, each point is replaced by the representative nearest to the point before it. Over a grid,
        neighbours are joined along a minimum spanning tree of their distances, so that the longest steps count least.

        Parameters
        ----------
        points : array_like, shape (..., *nodes, *point_shape)
            Points. Leading axes are batch axes. Points that are NaN remain NaN: a path continues beyond them, and each
            connected part of a grid is treated by itself.
        axes : int, default 1
            Number of axes of the nodes: 1 for paths, 2 for maps, 3 for volumes.

        Returns
        -------
        ndarray, shape (..., *nodes, *point_shape)
            Representatives. The first one of each path, or of each connected part of a grid, is unchanged.

        Raises
        ------
        ValidationError
            If a point is not in the space, or there are fewer axes than `axes`.

        Warns
        -----
        UserWarning
            If the distances of two representatives from the point before them differ by less than 10 %; or if no choice
            over the grid is continuous, because the nearest representatives do not return to the first one around a
            loop. The warnings name the first nodes.

        See Also
        --------
        Space.distance : The distance between the nearest representatives.

        Examples
        --------
        >>> import symspline as ss
        >>> axes = ss.Quotient("sphere:2", [1, -1])
        >>> axes.unwrap([[0.6, 0.8, 0], [-0.8, -0.6, 0], [1, 0, 0]]) + 0.0
        array([[0.6, 0.8, 0. ],
               [0.8, 0.6, 0. ],
               [1. , 0. , 0. ]])
        """
        count = whole_number(axes, "axes", 1)
        given = self._array(points, "points")
        numbers = self._numbers(self._doubles(given, "points"))
        lead = numbers.shape[: numbers.ndim - len(self._point_shape)]
        if len(lead) < count:
            raise ValidationError(
                f"`points` has shape {numbers.shape}, which has {len(lead)} axes of nodes, but `axes` is {count}."
            )
        finite = self._where_finite(numbers)
        self.cover.check_point(given[finite])
        total = self._transformations(numbers, finite, count)
        unwrapped: Any = np.where(
            finite.reshape(*lead, *[1] * len(self._point_shape)), self._moved_by(numbers, total), numbers
        )
        result: P = unwrapped
        return result

    def _transformations(self, points: Array, finite: NDArray[np.bool_], axes: int = 1) -> Indices:
        """Return the indices of the transformations that make points continuous."""
        if axes == 1:
            return along_path(self._group, points, finite, self._nearest)
        total = np.empty(finite.shape, np.intp)
        for batch in np.ndindex(finite.shape[:-axes]):
            total[batch] = over_grid(self._group, points[batch], finite[batch], self._nearest)
        return total

    def _nearer(self, p: ArrayLike, q: ArrayLike) -> tuple[Array, Nearest]:
        """Return the representatives of points q that are nearest to points p, after broadcasting."""
        a, b = (self._numbers(self._doubles(x, name)) for x, name in ((p, "p"), (q, "q")))
        lead = self._leads({"p": a.shape, "q": b.shape})
        first, second = (np.broadcast_to(x, lead + self._point_shape).reshape(-1, *self._point_shape) for x in (a, b))
        nearest = self._nearest(first, second)
        return self._moved_by(second, nearest.moves).reshape(lead + self._point_shape), nearest

    # ---- geometry ----

    def _finite(self, operation: str, t: NDArray[np.float64] | None = None, **inputs: Any) -> Any:
        if operation not in _OF_PAIRS:
            return self.cover._finite(operation, t, **inputs)
        nearest, moves = self._nearer(inputs["p"], inputs["q"])
        lead = nearest.shape[: nearest.ndim - len(self._point_shape)]
        if operation == "distance":
            return self._require_finite(operation, moves.distance.reshape(lead)[()])
        result: Any = self.cover._finite(operation, t, **(inputs | {"q": nearest}))
        if operation != "transport":
            return result
        # Transported vectors are tangent at the given representative of q, not at the nearest one.
        back = self._group.inverse[moves.moves].reshape(lead)
        return self._moved_by(result, np.broadcast_to(back, result.shape[: result.ndim - len(self._point_shape)]))

    def symmetry(self, p: ArrayLike, x: ArrayLike) -> P:
        return self.cover.symmetry(p, self._nearer(p, x)[0])

    # ---- names ----

    @cached_property
    def _full_name(self) -> str:
        left, right = self._group.left, self._group.right
        if left is None and right is not None and _is_phases(self.cover, right):
            return f"pu:{self._point_shape[0]}"
        before = "" if left is None else f"{left.name}\\"
        return f"{before}{self.cover}{'' if right is None else f'/{right.name}'}"

    def __str__(self) -> str:
        return self._full_name

    def __repr__(self) -> str:
        if self._full_name.startswith("pu:"):
            return f"space({self._full_name!r})"
        left, right = (None if factor is None else _shown(factor) for factor in (self._group.left, self._group.right))
        if right is None:
            return f"Quotient({self.cover!r}, {left}, left=True)"
        return f"Quotient({self.cover!r}, {right}{'' if left is None else f', left={left}'})"

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, Quotient) and self.cover == other.cover and str(self) == str(other))

    def __hash__(self) -> int:
        return hash((self.cover, self._full_name))

    def __reduce__(self) -> tuple[object, ...]:
        left, right = (None if factor is None else factor.elements for factor in (self._group.left, self._group.right))
        return _restored, (self.cover, left, right)


def _restored(cover: AnySpace, left: Array | None, right: Array | None) -> Quotient[Any]:
    """Return the quotient that a pickle describes."""
    if right is None:
        return Quotient(cover, left, left=True)
    return Quotient(cover, right, left=False if left is None else left)


def _class_of(kind: type) -> type:
    """Return the class of quotients of spaces of some class, the same one each time."""
    if kind not in _CLASSES:
        members = {"__module__": __name__, "__doc__": Quotient.__doc__}
        _CLASSES.setdefault(kind, type("Quotient", (Quotient, kind), members))
    return _CLASSES[kind]


def cover_of(space: AnySpace) -> AnySpace:
    """Return the space of representatives of a quotient; any other space is returned unchanged."""
    return space.cover if isinstance(space, Quotient) else space


def refuse_quotients(space: AnySpace, what: str) -> None:
    """Raise ValidationError if the space or a factor of it is a quotient."""
    for factor in factors_of(space):
        if isinstance(factor, Quotient):
            raise ValidationError(
                f"{what} on {factor!r}. Choose continuous representatives by its method unwrap, and use "
                f"{factor.cover!r}."
            )


def _factors(cover: AnySpace, group: object, left: Any) -> tuple[Factor | None, Factor | None]:
    """Return the groups that multiply from the left and from the right."""
    if isinstance(left, (bool, np.bool_)):
        symmetry = getattr(group, "symmetry", None)
        if symmetry is None:
            factor = Factor(cover, group, "left" if left else "right")
            return (factor, None) if left else (None, factor)
        # Orientations of orix map vectors of the sample to vectors of the crystal, so that symmetry acts on the left.
        # A misorientation maps vectors of the first crystal to vectors of the second.
        if not isinstance(symmetry, tuple):
            return Factor(cover, symmetry, "left"), None
        right, left = symmetry
        return Factor(cover, left, "left"), Factor(cover, right, "right")
    return Factor(cover, left, "left"), Factor(cover, group, "right")


def _is_phases(cover: AnySpace, group: Factor) -> bool:
    """Whether a group consists of all n-th roots of unity, on SU(n)."""
    n = cover.point_shape[0]
    if not isinstance(cover, SpecialUnitary) or group.elements.shape != (n,):
        return False
    return bool(np.abs(group.elements**n - 1).max() < _TOL)


def _shown(group: Factor) -> str:
    """Return a group as it appears in messages."""
    if not group.name.startswith("["):
        return repr(group.name)
    return group.name if len(group.name) < 40 else f"<{len(group.elements)} elements>"


def _check_isometries(cover: AnySpace, group: FiniteGroup) -> None:
    """Raise ValidationError unless all transformations map the space to itself isometrically, at a random geodesic."""
    rng = np.random.default_rng(0)
    try:
        p: Any = cover.random_point(rng)
    except ValidationError:
        # A manifold without `project` has no random points.
        return
    v: Any = cover.random_tangent(rng, p)
    v = 0.1 * min(1.0, cover.injectivity_radius) * v / max(float(np.abs(v).max()), 1e-300)
    every, axes = np.arange(group.size), len(cover.point_shape)
    count = (group.size, *[1] * axes)
    moved, vectors = (group.move(np.tile(x, count), every, axes) for x in (p, v))
    expected = group.move(np.tile(cover.exp(p, v), count), every, axes)
    for i in range(group.size):
        try:
            cover.check_point(moved[i])
            good = np.abs(cover.exp(moved[i], vectors[i]) - expected[i]).max() < _TOL
        except (ValidationError, CutLocusError):
            good = False
        if not good:
            raise ValidationError(
                f"transformation {i} of the group, {short_repr(group.described(i))}, does not map {cover!r} to itself "
                "isometrically. Pass the matrices by which equivalent points are multiplied, and left=True if they "
                "multiply from the left."
            )


def quotient_named(name: str) -> Quotient[Any]:
    """Return the quotient with a name such as ``"so:3/432"``, ``"432\\so:3"`` or ``"pu:4"``."""
    left, _, rest = name.rpartition("\\")
    space, _, right = (part.strip() for part in rest.partition("/"))
    left = left.strip()
    if not right:
        return Quotient(space, left, left=True)
    return Quotient(space, right, left=left or False)


def _without_phase(x: Array) -> Array:
    """Return unitary matrices of determinant 1 that equal the given ones up to a phase; others do not change."""
    if x.dtype.kind not in "fc" or x.ndim < 2 or x.shape[-1] != x.shape[-2]:
        return x
    with np.errstate(all="ignore"):
        phase = np.linalg.det(x.astype(np.complex128))
        phase = phase / np.abs(phase)
        turned = np.isfinite(phase) & (np.abs(phase - 1) > _TOL)
        root = np.where(turned, np.exp(-1j * np.angle(phase) / x.shape[-1]), 1.0)
    return x * root[..., None, None] if turned.any() else x


def _unitary_up_to_phase(name: str) -> Quotient[Any]:
    """Return the quotient with a name such as ``"pu:4"``."""
    cover = space_named(f"su:{name.partition(':')[2]}")
    n = cover.point_shape[0]
    return Quotient(cover, np.exp(2j * np.pi * np.arange(n) / n))


DERIVED.update({"/": quotient_named, "\\": quotient_named, "pu:": _unitary_up_to_phase})
