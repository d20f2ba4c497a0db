"""Products of spaces, whose points are tuples with one point per factor, and all spaces by name."""

from __future__ import annotations

import re
from difflib import get_close_matches
from functools import cached_property, lru_cache, reduce
from itertools import pairwise
from typing import Any, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import short_repr
from .._base.typing import AnyArrays, Array, FloatArray, P, PointsLike, PProduct
from .._core import Handle, ValidationError
from .base import CLASSES, DERIVED, AnySpace, Space, example_of
from .groups import names_points, rotations_and_positions
from .statistics import Groups

Tuple = tuple[Any, ...]
# Points of factors, which are not products themselves.
_A = TypeVar("_A", bound=Array)
_B = TypeVar("_B", bound=Array)
_C = TypeVar("_C", bound=Array)
_D = TypeVar("_D", bound=Array)
# Longer parameters are rejected before they are converted to integers.
_DIGITS = 40


class Product(Space[PProduct]):
    """The product of several spaces.

    A point is a tuple with one point per factor. Geodesics and splines are computed in every factor separately, and
    distances add as in Pythagoras' theorem. In all methods, points and tangent vectors are tuples with one array per
    factor.

    Parameters
    ----------
    *factors : Space or str
        At least two spaces or their names. The factors of a product among them become factors of this product.

    Attributes
    ----------
    factors : tuple of Space
        The factors, none of them a product.

    Raises
    ------
    ValidationError
        If there are fewer than two factors.

    See Also
    --------
    space : Return a space by its name, such as ``"so:3 x r:3"``.
    SpecialEuclidean : Rigid motions, whose geodesics are screw motions.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.Product(ss.Sphere(3), ss.Euclidean(3))
    Product(Sphere(3), Euclidean(3))
    >>> str(ss.space("sphere:3 x r:3"))
    'sphere:3 x euclidean:3'
    """

    @overload
    def __init__(self: Product[tuple[_A, _B]], a: Space[_A], b: Space[_B], /) -> None: ...
    @overload
    def __init__(self: Product[tuple[_A, _B, _C]], a: Space[_A], b: Space[_B], c: Space[_C], /) -> None: ...
    @overload
    def __init__(
        self: Product[tuple[_A, _B, _C, _D]], a: Space[_A], b: Space[_B], c: Space[_C], d: Space[_D], /
    ) -> None: ...
    @overload
    def __init__(self: Product[AnyArrays], *factors: AnySpace | str) -> None: ...

    def __init__(self, *factors: AnySpace | str) -> None:
        if len(factors) < 2:
            raise ValidationError("a Product needs at least two factors")
        given = [factors_of(f) if isinstance(f, Space) else spaces_named(f) for f in factors]
        self.factors: tuple[Space[Array], ...] = tuple(part for parts in given for part in parts)
        self._has_quotients = any(factor._has_quotients for factor in self.factors)

    @property
    def point_shape(self) -> tuple[tuple[int, ...], ...]:  # type: ignore[override]
        """Shapes of the arrays of one point, a tuple of tuples."""
        return tuple(f.point_shape for f in self.factors)

    @property
    def dim(self) -> int:
        """Sum of the dimensions of the factors."""
        return sum(f.dim for f in self.factors)

    @property
    def injectivity_radius(self) -> float:
        """Smallest injectivity radius of the factors."""
        return min(f.injectivity_radius for f in self.factors)

    @property
    def curvature(self) -> float:
        """Largest K of the factors; NaN if it is NaN for one of them."""
        return float(np.max([f.curvature for f in self.factors]))

    @property
    def dtype(  # type: ignore[override]
        self,
    ) -> tuple[np.dtype[np.float64] | np.dtype[np.complex128], ...]:
        """Types of the numbers of one point, a tuple with one entry per factor.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.space("sphere:2 x cp:1").dtype
        (dtype('float64'), dtype('complex128'))
        """
        return tuple(f.dtype for f in self.factors)

    @cached_property
    def _text(self) -> str:
        return " x ".join(map(str, self.factors))

    def __repr__(self) -> str:
        return f"Product({', '.join(map(repr, self.factors))})"

    def __reduce__(self) -> Tuple:
        return Product, self.factors

    def norm(self, p: ArrayLike, v: ArrayLike) -> FloatArray:
        return product_norm(self._by_factor("norm", p, v))

    def project(self, x: ArrayLike) -> PProduct:
        return self._by_factor("project", x)

    def symmetry(self, p: ArrayLike, x: ArrayLike) -> PProduct:
        return self._by_factor("symmetry", p, x)

    def act(self, g: ArrayLike | tuple[Any, ...], x: ArrayLike) -> PProduct:
        if not isinstance(g, (tuple, list)) or len(g) != len(self.factors):
            raise ValidationError(
                f"g must be a tuple of {len(self.factors)} group elements, one per factor of {self!r}. "
                "Pass one element for each factor, in the same order."
            )
        return self._by_factor("act", g, x)

    def _rounding(self, p: ArrayLike) -> FloatArray:
        largest: FloatArray = np.max(np.stack(np.broadcast_arrays(*self._by_factor("_rounding", p))), axis=0)[()]
        return largest

    def check_point(self, p: ArrayLike) -> None:
        self._by_factor("check_point", p)

    def check_tangent(self, p: ArrayLike, v: ArrayLike) -> None:
        self._by_factor("check_tangent", p, v)

    def frame(self, p: ArrayLike) -> PProduct:
        return self._by_factor("frame", p)

    def random_point(self, rng: np.random.Generator, shape: int | tuple[int, ...] = ()) -> PProduct:
        count = len(self.factors)
        return self._by_factor("random_point", (rng,) * count, (shape,) * count)

    def random_tangent(self, rng: np.random.Generator, p: ArrayLike) -> PProduct:
        return self._by_factor("random_tangent", (rng,) * len(self.factors), p)

    def mean(self, points: ArrayLike, weights: ArrayLike | None = None) -> PProduct:
        # Squared distances add, so that the mean of every factor minimises its own sum.
        return self._by_factor("mean", points, (weights,) * len(self.factors))

    def _samples(self, points: PointsLike, weights: ArrayLike | None, what: str) -> tuple[tuple[int, ...], Groups]:
        groups_of = [
            factor._samples(part, weights, what)
            for factor, (part,) in zip(self.factors, self._split(points), strict=True)
        ]
        leads = [lead for lead, _ in groups_of]
        if any(lead != leads[0] for lead in leads):
            raise ValidationError(
                f"the factors of `points` have the leading axes {leads}. Pass as many points for each factor."
            )
        _, first = groups_of[0]
        return leads[0], first._replace(points=tuple(groups.points for _, groups in groups_of))

    def _batched(self, rows: Tuple, batch: tuple[int, ...]) -> Tuple:
        return tuple(factor._batched(part, batch) for factor, part in zip(self.factors, rows, strict=True))

    def _finite(self, operation: str, t: NDArray[np.float64] | None = None, **inputs: Any) -> Any:
        results = tuple(
            factor._finite(operation, t, **dict(zip(inputs, part, strict=True)))
            for factor, part in zip(self.factors, self._split(*inputs.values()), strict=True)
        )
        if operation == "distance":
            return product_norm(results)
        return sum(results) if operation == "inner" else results

    def _by_factor(self, method: str, *arguments: Any) -> PProduct:
        """Call a method of every factor with the entries of the arguments that belong to it."""
        parts = zip(self.factors, self._split(*arguments), strict=True)
        results: Any = tuple(getattr(factor, method)(*part) for factor, part in parts)
        result: PProduct = results
        return result

    def _split(self, *arguments: object) -> list[Tuple]:
        """Return the entries of the arguments that belong to each factor."""
        arguments = tuple(_parts_of_poses(value, self, "points") for value in arguments)
        for value in arguments:
            if not isinstance(value, (tuple, list)) or len(value) != len(self.factors):
                raise ValidationError(f"{self!r} needs tuples of {len(self.factors)} arrays, one per factor")
        return list(zip(*arguments, strict=True))


def factors_of(space: AnySpace) -> tuple[Space[Array], ...]:
    """Return the factors of a product, or the space itself in a tuple."""
    return space.factors if isinstance(space, Product) else (space,)


def parts_of(value: object, space: AnySpace, name: str) -> Tuple:
    """Return the entries of a value that belong to each factor; in a space that is not a product, the value itself."""
    if not isinstance(space, Product):
        return (value,)
    count = len(space.factors)
    value = _parts_of_poses(value, space, name)
    if not isinstance(value, (tuple, list)) or len(value) != count:
        raise ValidationError(
            f"{name} must be a tuple of {count} arrays, one per factor of {space!r}{_conversion(value, space)}"
        )
    return tuple(value)


def _parts_of_poses(value: Any, space: Product[Any], name: str) -> Any:
    """Return the rotations and positions of poses on a product of ``so:3`` and ``r:3``; other values do not change.

    Poses are objects of SciPy, lists of these, or matrices as on ``se:3``.
    """
    if isinstance(value, tuple) or sorted(factor.point_shape for factor in space.factors) != [(3,), (3, 3)]:
        return value
    several = isinstance(value, list) and len(value) > 0 and all(hasattr(entry, "translation") for entry in value)
    matrices = isinstance(value, np.ndarray) and value.shape[-2:] == (4, 4) and names_points(name)
    if {str(factor) for factor in space.factors} != {"so:3", "euclidean:3"} or not (
        several or matrices or hasattr(value, "translation")
    ):
        return value
    parts = dict(zip(("so:3", "euclidean:3"), rotations_and_positions(value, name), strict=True))
    return tuple(parts[str(factor)] for factor in space.factors)


def _conversion(value: object, space: Product[Any]) -> str:
    """Return a sentence that names the conversion of one array to points of the factors."""
    shapes = [factor.point_shape for factor in space.factors]
    if isinstance(value, np.ndarray) and value.ndim and all(len(shape) == 1 for shape in shapes):
        ends = np.cumsum([0, *(shape[0] for shape in shapes)]).tolist()
        if value.shape[-1] == ends[-1]:
            parts = ", ".join(f"x[..., {a}:{b}]" for a, b in pairwise(ends))
            return f". If x is your array, pass ({parts})."
    if isinstance(value, np.ndarray) and value.ndim == 2 and value.shape[1] == 7 and shapes == [(3, 3), (3,)]:
        return (
            ". If the columns of your array a are x, y, z, qx, qy, qz, qw, pass "
            "(symspline.rotations.from_quaternions(a[:, 3:], scalar_first=False), a[:, :3])."
        )
    poses = hasattr(value, "translation") or (isinstance(value, np.ndarray) and value.shape[-2:] == (4, 4))
    if not poses or not any(factor.point_shape == (3, 3) for factor in space.factors):
        return ""
    return ". symspline.poses.split(poses) returns the rotations and positions of poses."


def product_norm(lengths: Tuple) -> FloatArray:
    """Combine the lengths in the factors by Pythagoras' theorem."""
    with np.errstate(all="ignore"):
        length: FloatArray = reduce(np.hypot, lengths)
        return length


# ---- names ----


@overload
def space(name: str) -> Space: ...


@overload
def space(name: str | Space[P]) -> Space[P]: ...


def space(name: str | AnySpace) -> AnySpace:
    """Return the space with a name.

    Parameters
    ----------
    name : str or Space
        The name of a space, followed by a colon and its parameters, such as ``"sphere:2"`` or ``"h:3"``. The names of
        the factors of a product are joined by ``" x "``, as in ``"so:3 x r:3"``. A slash and the symbol of a group
        make a `Quotient`, as in ``"so:3/432"``. A space is returned unchanged.

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
    if isinstance(name, str):
        return _space_of(name)
    raise _not_a_name(name)


# The same function, for modules in which `space` is the name of an argument.
space_named = space


def short_name(space: AnySpace) -> str:
    """Return the shortest name that `symspline.space` accepts, such as "so:3 x r:3"."""
    return str(space).replace("euclidean:", "r:").replace("hyperbolic:", "h:")


def spaces_named(name: object) -> list[Space]:
    """Return the spaces that a name lists, none of them a product.

    >>> spaces_named("sphere:3 x r:3")
    [Sphere(3), Euclidean(3)]
    """
    if not isinstance(name, str):
        raise _not_a_name(name)
    return [_named(factor) for factor in name.split(" x ")]


@lru_cache
def _space_of(name: str) -> AnySpace:
    """Return the space with a name. Spaces do not change, and to create one takes longer than a fit of few points."""
    factors = spaces_named(name)
    return factors[0] if len(factors) == 1 else Product(*factors)


def _not_a_name(value: object) -> ValidationError:
    """Return the error for a value that is neither a space nor a text."""
    if isinstance(value, type) and issubclass(value, Space):
        return ValidationError(f"{value.__name__} is a family of spaces; {_whole(value)}")
    return ValidationError(f"a space or its name is needed, not {short_repr(value)}")


def _rows() -> list[list[str]]:
    """Return all names, one row per class: those of the compiled core, and those of spaces implemented in Python."""
    compiled = Handle.names()
    known = {row[0] for row in compiled}
    return compiled + [[name, *cls._aliases] for name, cls in CLASSES.items() if name not in known]


def _guess(word: str, parameters: str, names: dict[str, str]) -> str:
    """Suggest the name that was probably meant, also for "SO3" and "SpecialOrthogonal(3)", or return an empty text."""
    glued = re.fullmatch(r"([a-z_ -]+)\(?(\d[\d, ]*)\)?", word)
    if glued is not None and not parameters:
        word, parameters = glued[1], glued[2]
    meant = {cls.__name__.lower(): short for short, cls in CLASSES.items()} | {name: name for name in names}
    close = get_close_matches(re.sub("[-_ ]", "", word), meant, 1, 0.7)
    colon = ":" if parameters else ""
    return f"did you mean {short_repr(meant[close[0]] + colon + parameters.strip())}? " if close else ""


def _whole(cls: Any) -> str:
    """Explain how to specify one space of a class."""
    if not hasattr(cls, "_name"):
        return "a space or its name is needed, such as Sphere(2) or 'sphere:2'"
    return f"give its dimension, such as {example_of(cls)}"


def _named(name: str) -> AnySpace:
    for mark, read in DERIVED.items():
        if mark in name:
            return read(name)
    word, _, parameters = name.partition(":")
    word = word.strip().lower()
    # SO(1, n) is the usual notation for the Lorentz group.
    if word == "so" and parameters.count(",") == 1 and parameters.partition(",")[0].strip() == "1":
        word, parameters = "lorentz", parameters.partition(",")[2]
    rows = _rows()
    names = {alias: row[0] for row in rows for alias in row}
    if word not in names:
        known = ", ".join(" or ".join(row) for row in rows)
        guess = _guess(word, parameters, names)
        raise ValidationError(f"unknown space {short_repr(name)}; {guess}known names are {known}, as in 'sphere:2'")
    if not parameters.strip():
        raise ValidationError(f"{short_repr(name)} is a family of spaces; {_whole(CLASSES[names[word]])}")
    values = [part.strip() for part in parameters.split(",")]
    if not all(value.isdecimal() and value.isascii() and len(value) <= _DIGITS for value in values):
        joined = re.search(r"[x×*]", parameters)
        product = "; put ' x ' between the factors of a product, as in 'so:3 x r:3'" if joined else ""
        raise ValidationError(
            f"{short_repr(name)}: the parameters after the colon must be integers, as in 'sphere:2'{product}"
        )
    cls = CLASSES[names[word]]
    try:
        made: Space = cls(*map(int, values))
    except TypeError:
        raise ValidationError(f"{short_repr(name)}: {cls.__name__} does not take {len(values)} parameters") from None
    return made
