"""Reduced bases over a parameter: proper orthogonal decomposition, and reduced operators that vary smoothly.

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

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import as_array, checked_number, refuse, whole_number
from ._base_curve import check_curve
from ._core import ValidationError
from ._cubic import CubicSpline
from ._input import times_of
from ._spaces import ComplexGrassmannian, Grassmannian
from ._typing import TimesLike
from ._validation import Array, adjoint, numbers

# Singular values closer than this, in units of the largest, are equal but for rounding.
_EQUAL = 1e-12

__all__ = ["from_snapshots", "reduced_operator"]


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


def reduced_operator(
    spline: CubicSpline[Any, Any], operator: Any | Callable[[float], Any], x: TimesLike, start: ArrayLike | None = None
) -> Array:
    """Compute the reduced operator X*AX in bases X that vary smoothly along a curve.

    The bases are those of `CubicSpline.lift`, so the matrices are as smooth as the curve and A. The representatives
    that ``spline(x)`` returns may jump at the knots.

    Parameters
    ----------
    spline : CubicSpline
        One curve on a `Grassmannian` or a `ComplexGrassmannian`.
    operator : array_like, sparse matrix or callable, shape (n, n)
        A: an array, a sparse matrix, any object that supports ``@`` with arrays, or a function of the parameter that
        returns one of these.
    x : array_like
        Parameters, any shape.
    start : array_like, shape (n, k), optional
        Basis at the first knot. None means the first point of the curve.

    Returns
    -------
    ndarray, shape ``(*x.shape, k, k)``
        Reduced operators.

    Raises
    ------
    ValidationError
        If the curve is on another space or a batch, or the operator has another shape.

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
    check_curve(spline)
    space = spline.space
    if not isinstance(space, (Grassmannian, ComplexGrassmannian)) or spline._batch:
        raise ValidationError(f"spline must be one curve on a Grassmannian, not {spline!r}")
    n, k = space.point_shape
    if not callable(operator) or hasattr(operator, "shape"):
        _check_operator(operator, n)
    parameters = as_array(times_of(x, "x")[0], "x")
    bases: Array = spline.lift(x, start=start)
    flat = bases.reshape(-1, n, k)
    if callable(operator) and not hasattr(operator, "shape"):
        made = map(operator, parameters.ravel())
        moved = np.stack([_check_operator(a, n) @ basis for a, basis in zip(made, flat, strict=True)] or [flat[:0]])
    else:
        # All columns at once.
        columns = operator @ np.moveaxis(flat, 0, 1).reshape(n, -1)
        moved = np.moveaxis(np.asarray(columns).reshape(n, -1, k), 0, 1)
    reduced: Array = adjoint(flat) @ moved.reshape(flat.shape)
    return reduced.reshape(*parameters.shape, k, k)


def _rank(sizes: Array, energy: Any) -> int:
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
