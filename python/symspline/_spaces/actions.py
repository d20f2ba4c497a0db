"""Geodesic symmetries and group actions, one class per kind of action in Table 1 of the paper."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._base.arrays import adjoint, as_array, cast, point_tol, refuse, short_repr
from .._base.typing import Array, P
from .._core import CutLocusError, ValidationError
from .base import AnySpace, Space


def matrices(space: AnySpace, g: ArrayLike, size: int, dtype: Any) -> tuple[Array, float]:
    """Return the argument `g` of `Space.act` as square matrices, and the tolerance for its type."""
    array = as_array(g, "g")
    if array.dtype.kind not in ("biufc" if np.dtype(dtype).kind == "c" else "biuf"):
        numbers = "numbers" if np.dtype(dtype).kind == "c" else "real numbers"
        raise ValidationError(
            f"g has type {array.dtype}, but the group of {space!r} needs {numbers}. Pass matrices of {numbers}."
        )
    if array.shape[-2:] != (size, size):
        raise ValidationError(
            f"g has shape {array.shape}, but the group of {space!r} consists of {size} × {size} matrices. "
            f"Pass an array of shape (..., {size}, {size})."
        )
    infinite = ~np.isfinite(array).all(axis=(-2, -1))
    refuse(infinite, "g", lambda _: "has entries that are not finite. Pass finite numbers.")
    return cast(array, np.dtype(dtype)), point_tol(array)


def require(space: AnySpace, defects: NDArray[np.float64], allowed: Any, what: str, remedy: str) -> None:
    """Raise ValidationError for the first matrix whose deviation exceeds the limit."""
    limits = np.broadcast_to(allowed, defects.shape)
    refuse(
        ~(np.isfinite(defects) & (defects <= limits)),
        "g",
        lambda i: f"is not in the group of {space!r}: {what} is {defects[i]:.3e} (allowed: {limits[i]:.0e}). {remedy}",
    )


def largest(x: Array) -> NDArray[np.float64]:
    """Return the largest absolute value of the entries of every matrix."""
    sizes: NDArray[np.float64] = np.max(np.abs(x), axis=(-2, -1))
    return sizes


def preserves(space: AnySpace, g: Array, form: Array, tol: float, remedy: str) -> None:
    """Raise ValidationError unless g*Jg = J for the form J, to a tolerance relative to the squared size of g."""
    defects = largest(adjoint(g) @ form @ g - form)
    star = "*" if np.iscomplexobj(g) else "ᵀ"
    what = f"|g{star}g − 1|" if np.array_equal(form, np.eye(len(form))) else f"|g{star}Jg − J|"
    require(space, defects, tol * np.maximum(1.0, largest(g)) ** 2, what, remedy)


class Preserving(Space[P]):
    """Vectors and bases of subspaces of a linear space with a form J: g acts as x ↦ gx, where g*Jg = J."""

    # Indices of the entries −1 of the diagonal matrix J; the other entries are 1.
    _negative: tuple[int, ...] = ()

    def __init__(self, n: int) -> None:
        super().__init__(n)

    def _signs(self) -> NDArray[np.float64]:
        signs = np.ones(self.point_shape[0])
        signs[list(self._negative)] = -1.0
        return signs

    def _reflected(self, p: Array, x: Array) -> Any:
        # 2P − 1 with the projection P = p (p*Jp)⁻¹ p*J onto p; p*Jp is 1, −1 or the unit matrix.
        if len(self.point_shape) == 1:
            dual = p.conj() * self._signs()
            square = np.sign(np.sum(dual * p, axis=-1, keepdims=True).real)
            return 2 * square * np.sum(dual * x, axis=-1, keepdims=True) * p - x
        return 2 * p @ (adjoint(p) @ x) - x

    def _element(self, g: Any) -> Any:
        size = self.point_shape[0]
        g, tol = matrices(self, g, size, self._dtype)
        if self._negative:
            remedy = f"Pass a matrix with g*Jg = J, J = diag({'−1, ' * len(self._negative)}1, …, 1)."
        else:
            remedy = "Pass a matrix with orthonormal columns, such as numpy.linalg.qr(g)[0]."
        preserves(self, g, np.diag(self._signs()), tol, remedy)
        return g

    def _moved(self, g: Array, x: Array) -> Any:
        return (g @ x[..., None])[..., 0] if len(self.point_shape) == 1 else g @ x


class Congruent(Space[P]):
    """Positive definite matrices: g acts as x ↦ g x g*."""

    def __init__(self, n: int) -> None:
        super().__init__(n)

    def _reflected(self, p: Array, x: Array) -> Any:
        # p x⁻¹ p by Cholesky factors, which remains accurate for matrices with entries of very different size.
        y = np.linalg.solve(np.linalg.cholesky(x), p)
        return adjoint(y) @ y

    def _element(self, g: Any) -> Any:
        g, tol = matrices(self, g, self.point_shape[0], self._dtype)
        sizes = np.linalg.svd(g, compute_uv=False)
        require(self, sizes[..., 0] / sizes[..., -1], 1e14, "its condition number", "Pass an invertible matrix.")
        self._require_subgroup(g, tol)
        return g

    def _require_subgroup(self, g: Array, tol: float) -> None:
        """Raise ValidationError unless g is in the group. GL(n) requires no more than an invertible matrix."""

    def _moved(self, g: Array, x: Array) -> Any:
        return g @ x @ adjoint(g)


class Group(Space[P]):
    """Groups as symmetric spaces: a pair (a, b) of elements acts as x ↦ a x b⁻¹."""

    # Whether x⁻¹ = x*.
    _unitary = False

    def __init__(self, n: int) -> None:
        super().__init__(n)

    def _inverse_times(self, x: Array, y: Array) -> Array:
        return adjoint(x) @ y if self._unitary else np.linalg.solve(x, y)

    def _reflected(self, p: Array, x: Array) -> Any:
        return p @ self._inverse_times(x, p)

    def _element(self, g: Any) -> Any:
        if not isinstance(g, (tuple, list)) or len(g) != 2:
            raise ValidationError(
                f"g must be a pair (a, b) of elements of the group, which act on {self!r} as x ↦ a x b⁻¹, but it is "
                f"{short_repr(g)}. Pass (g, numpy.eye({self.point_shape[0]})) for multiplication from the left."
            )
        for i, element in enumerate(g):
            try:
                self.check_point(element)
            except ValidationError as error:
                raise ValidationError(
                    f"g[{i}] is not an element of the group of {self!r}: {error}. Pass a pair of points of the space."
                ) from None
        a, b = (self._numbers(self._doubles(element, f"g[{i}]")) for i, element in enumerate(g))
        return a, b

    def _moved(self, g: tuple[Array, Array], x: Array) -> Any:
        a, b = g
        # x b⁻¹ = (b⁻* x*)*.
        return a @ (x @ adjoint(b) if self._unitary else adjoint(np.linalg.solve(adjoint(b), adjoint(x))))


def homogeneous(space: AnySpace, g: Any, dim: int) -> Array:
    """Return isometries of Euclidean space as homogeneous matrices (A, b; 0, 1)."""
    array, tol = matrices(space, g, dim + 1, np.float64)
    remedy = "Pass [[A, b], [0, 1]] with an orthogonal matrix A and a vector b."
    off = array[..., -1:, :] - np.eye(dim + 1)[-1]
    require(space, largest(off), tol, "the distance of its last row from (0, …, 0, 1)", remedy)
    linear = array[..., :-1, :-1]
    defects = largest(adjoint(linear) @ linear - np.eye(dim))
    require(space, defects, tol, "|AᵀA − 1| of its linear part A", remedy)
    return array


# ---- groups of real matrices with two components, of positive and of negative determinant ----


class DisconnectedGroup(Space[P]):
    """Group with two components. Operations on points in different components fail with an explanation."""

    def _finite(self, operation: str, t: NDArray[np.float64] | None = None, **inputs: ArrayLike) -> Any:
        try:
            return super()._finite(operation, t, **inputs)
        except (CutLocusError, ValidationError):
            if "q" in inputs:
                self._check_same_part(inputs["p"], inputs["q"])
            raise

    def _check_same_part(self, p: ArrayLike, q: ArrayLike) -> None:
        pairs: Array = np.zeros((0, 0), int)
        # Arrays of a wrong shape raise an error elsewhere.
        with np.errstate(all="ignore"), suppress(ValueError):
            signs = [np.sign(np.linalg.det(self._doubles(x, name))) for x, name in ((p, "p"), (q, "q"))]
            pairs = np.argwhere(signs[0] * signs[1] < 0)
        if len(pairs):
            pair = ",".join(map(str, pairs[0])) or "0"
            raise ValidationError(f"pair {pair} has opposite determinants: no curve joins them")
