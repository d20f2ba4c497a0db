"""Reduced bases over parameters: proper orthogonal decomposition, and reduced operators that vary smoothly.

Examples
--------
>>> import numpy as np, symspline as ss
>>> grid, time = np.linspace(0, 1, 50), np.linspace(0, 1, 20)
>>> decay = lambda mu: np.exp(-mu * time * np.arange(1, 4)[:, None] ** 2)
>>> modes = lambda mu: np.sin(np.pi * np.outer(grid**mu, np.arange(1, 4)))
>>> snapshots = np.stack([modes(mu) @ decay(mu) for mu in (0.8, 1.0, 1.3)])
>>> bases = ss.subspaces.from_snapshots(snapshots, rank=2)
>>> ss.CubicSpline([0.8, 1.0, 1.3], bases, "gr:2,50")(1.1).shape
(50, 2)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._base.arrays import adjoint, as_array, cast, checked_number, numbers, off_one, refuse, whole_number
from ._base.faults import warn
from ._base.input import times_of
from ._base.typing import AnyFunction, Array, TimesLike
from ._core import CutLocusError, ValidationError
from ._grid import GridSpline
from ._grid.axes import coordinates
from ._spaces import (
    AnySpace,
    ComplexGrassmannian,
    Euclidean,
    Grassmannian,
    HermitianPositiveDefinite,
    SymmetricPositiveDefinite,
    point_tol,
)
from ._splines.cubic import AnyCubicSpline, CubicSpline
from ._splines.piecewise import check_curve

# Numbers closer than this, in units of the largest, are equal but for rounding.
_EQUAL = 1e-12
# Cosines of principal angles to a reference basis: orthogonal but for rounding, and far.
_ORTHOGONAL = 1e-8
_FAR = 0.1

__all__ = ["OperatorSpline", "align", "from_snapshots", "reduced_operator"]


def __dir__() -> list[str]:
    return __all__


def from_snapshots(x: ArrayLike, rank: int | None = None, *, energy: float | None = None) -> Array:
    """Compute bases of the proper orthogonal decomposition of snapshots.

    Among all subspaces of dimension k, the result has the smallest sum of squared distances to the snapshots [1]_ [2]_.

    Parameters
    ----------
    x : array_like, shape (..., n, m)
        Snapshots in columns, real or complex. Leading axes are values of the parameter. The mean is not subtracted.
    rank : int, optional
        Dimension k of the subspaces. Pass either `rank` or `energy`.
    energy : float, optional
        Fraction of the sum of squares that every subspace must contain, above 0 and at most 1. The smallest k that
        suffices for all subspaces is used.

    Returns
    -------
    ndarray, shape (..., n, k)
        First k left singular vectors: points of ``Grassmannian(k, n)``, or of ``ComplexGrassmannian(k, n)``.

    Raises
    ------
    ValidationError
        If not exactly one of `rank` and `energy` is given, k is not below n, or the snapshots do not determine the
        subspace: their rank is below k, or singular values k and k + 1 are equal.

    References
    ----------
    .. [1] Sirovich, "Turbulence and the dynamics of coherent structures", 1987.
    .. [2] Eckart & Young, "The approximation of one matrix by another of lower rank", 1936.

    Examples
    --------
    >>> abs(from_snapshots([[3, 3], [0, 0], [0, 1]], rank=1)).round(3).ravel().tolist()
    [0.986, 0.0, 0.169]
    """
    snapshots, _ = numbers(x, "x", 2)
    n, m = snapshots.shape[-2:]
    if (rank is None) == (energy is None):
        raise ValidationError("pass either rank, the dimension of the subspaces, or energy, the fraction they contain")
    if not snapshots.size:
        raise ValidationError(f"x has shape {snapshots.shape}, but must contain at least one snapshot")
    left, sizes, _ = np.linalg.svd(snapshots, full_matrices=False)
    k = whole_number(rank, "rank", 1) if rank is not None else _rank(sizes, energy)
    if k >= n or k > m:
        raise ValidationError(
            f"a basis of {k} dimensions needs more than {k} numbers per snapshot and at least {k} snapshots; "
            f"x has shape {snapshots.shape}"
        )
    beyond = np.concatenate([sizes, np.zeros((*sizes.shape[:-1], 1))], axis=-1)
    bad = ~(beyond[..., k - 1] - beyond[..., k] > _EQUAL * beyond[..., 0])
    what = f"does not determine a subspace of {k} dimensions: its singular values {k} and {k + 1} are"
    refuse(bad, "x", lambda i: f"{what} {beyond[i][k - 1]:.6g} and {beyond[i][k]:.6g}; take another rank")
    return np.ascontiguousarray(left[..., :k])


def align(bases: ArrayLike, reference: ArrayLike | None = None) -> Array:
    """Choose the bases of subspaces that are nearest to a reference basis.

    A subspace has many orthonormal bases. Of these, the result takes the one with the smallest distance to the
    reference as a matrix. It depends on the subspace only, and as smoothly as the subspace varies.

    Parameters
    ----------
    bases : array_like, shape (..., n, k)
        Orthonormal columns, real or complex. Leading axes are values of one or several parameters. A basis with NaN is
        missing and stays NaN.
    reference : array_like, shape (n, k), optional
        Reference basis. None means the basis in the middle of the leading axes, or the nearest one that is not missing.

    Returns
    -------
    ndarray, shape (..., n, k)
        Bases of the same subspaces.

    Raises
    ------
    ValidationError
        If columns are not orthonormal, or all bases are missing.
    CutLocusError
        If a subspace contains a direction that is orthogonal to the reference. The nearest basis is not unique then.

    Warns
    -----
    UserWarning
        If a principal angle to the reference exceeds 84°, because the bases vary fast there.

    See Also
    --------
    OperatorSpline : Interpolate reduced operators in aligned bases.

    Notes
    -----
    The nearest basis is :math:`VQ`, where :math:`Q` is the unitary factor of the polar decomposition
    :math:`V^*V_0 = QH` (orthogonal Procrustes problem). Amsallem & Farhat use it to make reduced operators consistent
    [1]_.

    References
    ----------
    .. [1] Amsallem & Farhat, "An online method for interpolating linear parametric reduced-order models", 2011.

    Examples
    --------
    >>> align([[[1.0], [0.0]], [[-0.6], [-0.8]]], [[1.0], [0.0]])[1].ravel().tolist()
    [0.6, 0.8]
    """
    array, present = _checked_bases(bases)
    turned = array @ _rotations(array, present, _reference(array, present, reference))
    return np.ascontiguousarray(turned)


def reduced_operator(
    spline: AnyCubicSpline | GridSpline[Any],
    operator: Any | AnyFunction,
    x: ArrayLike,
    start: ArrayLike | None = None,
) -> Array:
    """Compute the reduced operator X*AX in bases X that vary smoothly along a curve or over a grid.

    The bases along a curve are those of `CubicSpline.lift`. Those over a grid are aligned with a reference basis, see
    `align`. The matrices are therefore as smooth as the subspaces and A. The representatives that ``spline(x)`` returns
    may jump at the knots.

    Parameters
    ----------
    spline : CubicSpline or GridSpline
        One curve, or a grid, on a `Grassmannian` or a `ComplexGrassmannian`.
    operator : array_like, sparse matrix or callable, shape (n, n)
        A: an array, a sparse matrix, any object that supports ``@`` with arrays, or a function that returns one of
        these. The function has one argument per parameter.
    x : array_like, or tuple of array_like
        Parameters, any shape. For a grid one array per axis; they are broadcast, as in `GridSpline`.
    start : array_like, shape (n, k), optional
        Basis at the first knot of a curve; None means the first point of the curve. For a grid the reference basis;
        None means the basis at the middle node. If no reference suits all parameters, pass one parameter at a time with
        ``start=spline(x)``.

    Returns
    -------
    ndarray, shape ``(*x.shape, k, k)``
        Reduced operators.

    Raises
    ------
    ValidationError
        If the curve is on another space or a batch, or the operator has another shape.
    CutLocusError
        If a subspace of a grid contains a direction that is orthogonal to the reference.

    See Also
    --------
    OperatorSpline : Interpolate reduced operators that are known at the nodes only.

    References
    ----------
    Amsallem & Farhat, "Interpolation method for adapting reduced-order models", 2008.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> spline = ss.CubicSpline(None, [[[1.0], [0], [0]], [[0.6], [0.8], [0]]], "gr:1,3")
    >>> reduced_operator(spline, np.diag([2.0, 4, 6]), [0.0, 0.5, 1.0]).round(12).ravel()
    array([2.  , 2.4 , 3.28])
    """
    if isinstance(spline, GridSpline):
        n, _ = _subspaces_of(spline)
        bases, parameters = _grid_bases(spline, x, start)
    else:
        check_curve(spline)
        n, _ = _subspaces_of(spline)
        parameters = [as_array(times_of(x, "x")[0], "x")]
        bases = np.asarray(spline.lift(x, start=start))
    constant = not callable(operator) or hasattr(operator, "shape")
    if constant:
        return _reduced(bases, _check_operator(operator, n))
    flat = bases.reshape(-1, *bases.shape[-2:])
    rows = zip(flat, *(parameter.ravel() for parameter in parameters), strict=True)
    matrices = [_reduced(basis, _check_operator(operator(*mu), n)) for basis, *mu in rows]
    return np.reshape(matrices, (*bases.shape[:-2], *[bases.shape[-1]] * 2))


class OperatorSpline:
    """Interpolate reduced operators over several parameters.

    Use it where the reduced operators X*AX are known at the nodes only. They are first expressed in bases that are
    aligned with a reference, because matrices in unrelated bases cannot be interpolated. If all of them are positive
    definite, the values are positive definite, too.

    Parameters
    ----------
    axes : sequence of D array_like
        Nodes n_1, ..., n_D of each parameter, strictly increasing.
    operators : array_like, shape (n_1, ..., n_D, k, k)
        Reduced operators in `bases`, real or complex. NaN marks missing nodes.
    bases : array_like, shape (n_1, ..., n_D, n, k)
        Orthonormal columns, in any representation. A basis with NaN is missing.
    reference : array_like, shape (n, k), optional
        Reference basis. None means the basis at the middle node.
    bc_type : str or sequence of D entries, default "not-a-knot"
        End conditions of each axis, as for `GridSpline`.

    Raises
    ------
    ValidationError
        If shapes do not match or the bases are not orthonormal.
    CutLocusError
        If a subspace contains a direction that is orthogonal to the reference.

    See Also
    --------
    reduced_operator : The operator in interpolated bases, where A is known for all parameters.

    Notes
    -----
    The matrices are interpolated on `SymmetricPositiveDefinite` or `HermitianPositiveDefinite` if all of them are
    positive definite, and entry by entry otherwise. Negate negative definite operators, such as the Laplacian, before
    and afterwards to keep their sign. The values belong to the bases ``align(grid(x), reference)``, where ``grid`` is
    the `GridSpline` through the bases.

    Examples
    --------
    >>> import numpy as np
    >>> from symspline.subspaces import OperatorSpline, align
    >>> u, v = np.linspace(0, 1, 4), np.linspace(0, 1, 5)
    >>> angle = 0.5 * u[:, None] + 0.2 * v
    >>> bases = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[..., None]
    >>> stiffness = OperatorSpline((u, v), bases.swapaxes(-1, -2) @ np.diag([1.0, 2.0]) @ bases, bases)
    >>> bool(abs(stiffness((0.3, 0.6))[0, 0] - (1 + np.sin(0.27) ** 2)) < 1e-3)
    True
    """

    def __init__(
        self,
        axes: Sequence[TimesLike | None],
        operators: ArrayLike,
        bases: ArrayLike,
        *,
        reference: ArrayLike | None = None,
        bc_type: str | Sequence[str | tuple[str, str]] = "not-a-knot",
    ) -> None:
        array, present = _checked_bases(bases)
        k = array.shape[-1]
        matrices = as_array(operators, "operators")
        if matrices.dtype.kind not in "biufc":
            raise ValidationError(f"operators must be an array of numbers, not of {matrices.dtype}")
        refuse(np.isinf(matrices).any(axis=(-2, -1)), "operators", lambda _: "is infinite; operators must be finite")
        tol = point_tol(matrices)
        if matrices.shape != (*array.shape[:-2], k, k):
            raise ValidationError(
                f"operators has shape {matrices.shape}, but bases of shape {array.shape} need "
                f"{(*array.shape[:-2], k, k)}: one reduced operator per basis"
            )
        self._reference = _reference(array, present, reference)
        turns = _rotations(array, present, self._reference)
        matrices = adjoint(turns) @ matrices @ turns
        self._complex = np.iscomplexobj(matrices)
        self._size = k
        if _are_positive(matrices, tol):
            points = (matrices + adjoint(matrices)) / 2
            space: AnySpace = (HermitianPositiveDefinite if self._complex else SymmetricPositiveDefinite)(k)
        else:
            points = matrices.reshape(*matrices.shape[:-2], k * k)
            points = np.concatenate([points.real, points.imag], axis=-1) if self._complex else points
            space = Euclidean(points.shape[-1])
        self._spline: GridSpline[Any] = GridSpline(axes, points, space, bc_type=bc_type)

    @property
    def reference(self) -> Array:
        """Reference basis, shape (n, k)."""
        return self._reference

    @property
    def spline(self) -> GridSpline[Array]:
        """Spline through the aligned matrices: on positive definite matrices, or on their entries."""
        return self._spline

    def __call__(self, x: Any) -> Array:
        """Evaluate the reduced operator.

        Parameters
        ----------
        x : tuple of D array_like
            Parameters, which are broadcast against each other.

        Returns
        -------
        ndarray, shape (*broadcast shape, k, k)
            Reduced operators in bases that are aligned with `reference`; NaN where nodes are missing.

        Raises
        ------
        ValidationError
            If a parameter is outside its axis.
        """
        values: Array = self._spline(x)
        if self._spline.space.point_shape == (self._size, self._size):
            return values
        k = self._size**2
        values = values[..., :k] + 1j * values[..., k:] if self._complex else values
        return values.reshape(*values.shape[:-1], self._size, self._size)


# ---- bases ----


def _subspaces_of(spline: AnyCubicSpline | GridSpline[Any]) -> tuple[int, ...]:
    """Return n and k of a curve or grid of subspaces."""
    space: AnySpace = spline.space
    batch = isinstance(spline, CubicSpline) and spline._batch
    if not isinstance(space, (Grassmannian, ComplexGrassmannian)) or batch:
        raise ValidationError(f"spline must be one curve or a grid on a Grassmannian, not {spline!r}")
    return space.point_shape


def _grid_bases(spline: GridSpline[Any], x: object, start: ArrayLike | None) -> tuple[Array, list[Array]]:
    """Return aligned bases at parameters, and the parameters of each axis for every basis."""
    axes, shape, outer = coordinates(spline._axes, x, False)
    parameters = np.meshgrid(*axes, indexing="ij") if outer else axes
    values: Array = spline(x)
    reference = _reference(spline.points, _present(spline.points), start)
    return values @ _rotations(values, _present(values), reference), [
        parameter.reshape(shape) for parameter in parameters
    ]


def _checked_bases(value: ArrayLike) -> tuple[Array, NDArray[np.bool_]]:
    """Return bases with orthonormal columns, and which of them are not missing."""
    array = as_array(value, "bases")
    if array.dtype.kind not in "biufc" or array.ndim < 2 or not 0 < array.shape[-1] <= array.shape[-2]:
        raise ValidationError(
            f"bases must be numbers of shape (..., n, k) with k <= n, not {array.dtype} of shape {array.shape}"
        )
    tol = point_tol(array)
    array = cast(array, np.complex128 if array.dtype.kind == "c" else np.float64)
    present = _present(array)
    if not present.any():
        raise ValidationError("bases must contain at least one basis without NaN")
    off = np.zeros(present.shape)
    off[present] = off_one(array[present])
    refuse(
        ~(off <= tol),
        "bases",
        lambda i: (
            f"must have orthonormal columns, but |X*X - 1| is {off[i]:.2g}; orthonormalise it, for example by "
            "numpy.linalg.qr"
        ),
    )
    return array, present


def _present(matrices: Array) -> NDArray[np.bool_]:
    """Which matrices are not missing."""
    return np.asarray(~np.isnan(matrices).any(axis=(-2, -1)))


def _reference(bases: Array, present: NDArray[np.bool_], given: ArrayLike | None) -> Array:
    """Return the given reference basis, or the basis closest to the middle of the leading axes."""
    if given is None:
        middle = (np.array(present.shape) - 1) // 2
        nodes = np.argwhere(present)
        chosen: Array = bases[tuple(nodes[np.argmin(np.abs(nodes - middle).sum(axis=1))])]
        return chosen
    reference = _checked_bases(given)[0]
    if reference.shape != bases.shape[-2:]:
        raise ValidationError(f"the reference basis has shape {reference.shape}, but must have {bases.shape[-2:]}")
    return reference


def _rotations(bases: Array, present: NDArray[np.bool_], reference: Array) -> Array:
    """Return the unitary matrices Q for which the bases times Q are nearest to the reference; NaN for missing ones."""
    k = reference.shape[-1]
    overlaps = adjoint(bases[present]) @ reference
    left, cosines, right = np.linalg.svd(overlaps)
    turns = np.full((*present.shape, k, k), np.nan, dtype=overlaps.dtype)
    turns[present] = left @ right
    smallest = np.ones(present.shape)
    smallest[present] = cosines[..., -1]
    index = np.unravel_index(np.argmin(smallest), smallest.shape)
    cosine, where = float(smallest[index]), f"bases{[int(i) for i in index] or ''}"
    remedy = "Pass a reference in the middle of the subspaces, or use fewer parameters at once."
    if cosine < _ORTHOGONAL:
        raise CutLocusError(
            f"the subspace of {where} contains a direction orthogonal to the reference basis, so that no basis is "
            f"nearest to the reference. {remedy}"
        )
    if cosine < _FAR:
        warn(
            f"the subspace of {where} is {np.degrees(np.arccos(cosine)):.1f}° from the reference, and aligned bases "
            f"vary fast close to 90°. {remedy}",
            UserWarning,
        )
    return turns


def _are_positive(matrices: Array, tol: float) -> bool:
    """Whether all matrices, except missing ones, are Hermitian and positive definite."""
    present = matrices[_present(matrices)]
    size = np.abs(present).max(axis=(-2, -1), initial=0.0)
    if (np.abs(present - adjoint(present)).max(axis=(-2, -1), initial=0.0) > tol * size).any():
        return False
    return bool((np.linalg.eigvalsh(present)[..., 0] > _EQUAL * size).all())


# ---- rank and operators ----


def _reduced(bases: Array, operator: object) -> Array:
    """Return X*AX of one operator."""
    n, k = bases.shape[-2:]
    flat = bases.reshape(-1, n, k)
    # All columns at once.
    columns = operator @ np.moveaxis(flat, 0, 1).reshape(n, -1)
    moved = np.moveaxis(np.asarray(columns).reshape(n, -1, k), 0, 1)
    reduced: Array = adjoint(flat) @ moved
    return reduced.reshape(*bases.shape[:-2], k, k)


def _rank(sizes: Array, energy: object) -> int:
    """Return the smallest rank with which every subspace contains the given fraction of the sum of squares."""
    energy = checked_number(energy, "energy must be a fraction above 0 and at most 1", lambda x: 0 < x <= 1)
    squares = (sizes / np.maximum(sizes[..., :1], np.finfo(float).tiny)) ** 2
    # What is left beyond rank 1, 2, …, without cancellation.
    left = np.cumsum(squares[..., ::-1], axis=-1)[..., ::-1]
    missing = np.concatenate([left[..., 1:], np.zeros_like(left[..., :1])], axis=-1)
    enough = missing <= (1 - energy) * left[..., :1]
    return 1 + int(np.argmax(enough, axis=-1).max())


def _check_operator(operator: Any, n: int) -> Any:
    shape = np.shape(operator) if not hasattr(operator, "shape") else operator.shape
    if tuple(shape) != (n, n):
        raise ValidationError(f"the operator has shape {tuple(shape)}, but bases of {n} numbers need {(n, n)}")
    return operator if hasattr(operator, "shape") else np.asarray(operator)
