"""Reduced bases over a parameter: proper orthogonal decomposition, and operators in bases that vary smoothly.

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

from ._core import ValidationError
from .arrays import as_array, shown, whole_number
from .convert.reading import Array, adjoint, numbers, refuse
from .handed import times_of
from .piecewise import check_curve
from .spaces import ComplexGrassmannian, Grassmannian
from .spline import CubicSpline

# Singular values closer than this, in units of the largest, are equal but for rounding.
_EQUAL = 1e-12


def from_snapshots(x: ArrayLike, rank: int | None = None, *, energy: float | None = None) -> Array:
    """The subspaces that hold most of some snapshots: bases of the proper orthogonal decomposition.

    Of all subspaces of dimension k it is the one from which the snapshots are least away, in the sum of squares.
    Source: Sirovich, Turbulence and the dynamics of coherent structures (1987); Eckart & Young (1936).

    Args:
        x: snapshots in columns, shape (..., n, m), real or complex; leading axes are values of the parameter. The mean
            is not taken away.
        rank: the dimension k of the subspaces.
        energy: instead of ``rank``, the share of the sum of squares that every subspace holds at least, above 0 and at
            most 1: k is the smallest that does for all.

    Returns:
        The first k left singular vectors, shape (..., n, k): points of ``Grassmannian(k, n)``, or of
        ``ComplexGrassmannian(k, n)``.

    Raises:
        ValidationError: not one of ``rank`` and ``energy`` is given; k is not below n; or the snapshots do not
            determine the subspace: they have a lower rank, or singular values k and k + 1 are equal.

    >>> abs(from_snapshots([[3, 3], [0, 0], [0, 1]], rank=1)).round(3).ravel().tolist()
    [0.986, 0.0, 0.169]
    """
    snapshots, _ = numbers(x, "x", 2)
    n, m = snapshots.shape[-2:]
    if (rank is None) == (energy is None):
        raise ValidationError(
            "say either rank, the dimension of the subspaces, or energy, the share they hold"
        )
    if not snapshots.size:
        raise ValidationError(f"x has shape {snapshots.shape}: there are no snapshots")
    left, sizes, _ = np.linalg.svd(snapshots, full_matrices=False)
    k = whole_number(rank, "rank", 1) if rank is not None else _rank(sizes, energy)
    if k >= n or k > m:
        raise ValidationError(
            f"{k} dimensions need more than {k} numbers a snapshot, and {k} snapshots or more; x has shape "
            f"{snapshots.shape}"
        )
    beyond = np.concatenate([sizes, np.zeros((*sizes.shape[:-1], 1))], axis=-1)
    refuse(
        ~(beyond[..., k - 1] - beyond[..., k] > _EQUAL * beyond[..., 0]),
        "x",
        lambda i: (
            f"does not determine a subspace of {k} dimensions: its singular values {k} and {k + 1} are "
            f"{beyond[i][k - 1]:.6g} and {beyond[i][k]:.6g}; take another rank"
        ),
    )
    return np.ascontiguousarray(left[..., :k])


def reduced_operator(
    spline: CubicSpline, operator: Any | Callable[[float], Any], x: ArrayLike, start: ArrayLike | None = None
) -> Array:
    """An operator in the reduced bases at parameters x: X*AX, with bases X that do not turn within the subspaces.

    The bases are those of `CubicSpline.lift`, so that the matrices are as smooth as the curve and A; those of a call
    of the spline jump at the knots. Source: Amsallem & Farhat, Interpolation method for adapting reduced-order models
    (2008), for the interpolation of subspaces.

    Args:
        spline: one curve on a `Grassmannian` or a `ComplexGrassmannian`.
        operator: A, of shape (n, n): an array, a sparse matrix, or what else multiplies arrays by ``@``; or a function
            of the parameter that returns such.
        x: parameters, any shape.
        start: the basis at the first knot, shape (n, k); None for the first point of the curve.

    Returns:
        Shape x.shape + (k, k).

    Raises:
        ValidationError: the curve is in another space or a batch, or the operator is of another shape.
    """
    check_curve(spline)
    space = spline.space
    if not isinstance(space, (Grassmannian, ComplexGrassmannian)) or spline._batch:
        raise ValidationError(f"reduced bases are one curve on a Grassmannian, not {spline!r}")
    n, k = space.point_shape
    if not callable(operator) or hasattr(operator, "shape"):
        _check_operator(operator, n)
    parameters = as_array(times_of(x, "x")[0], "x")
    bases: Array = spline.lift(x, start=start)
    flat = bases.reshape(-1, n, k)
    if callable(operator) and not hasattr(operator, "shape"):
        made = map(operator, parameters.ravel())
        moved = np.stack(
            [_check_operator(a, n) @ basis for a, basis in zip(made, flat, strict=True)] or [flat[:0]]
        )
    else:
        # All columns at once.
        columns = operator @ np.moveaxis(flat, 0, 1).reshape(n, -1)
        moved = np.moveaxis(np.asarray(columns).reshape(n, -1, k), 0, 1)
    reduced: Array = adjoint(flat) @ moved.reshape(flat.shape)
    return reduced.reshape(*parameters.shape, k, k)


def _rank(sizes: Array, energy: Any) -> int:
    """The smallest rank with which every subspace holds a share of the sum of squares."""
    if isinstance(energy, bool) or not isinstance(energy, (int, float, np.floating)) or not 0 < energy <= 1:
        raise ValidationError(f"energy must be a share above 0 and at most 1, not {shown(energy)}")
    squares = (sizes / np.maximum(sizes[..., :1], np.finfo(float).tiny)) ** 2
    # What is left beyond rank 1, 2, …, without cancellation.
    left = np.cumsum(squares[..., ::-1], axis=-1)[..., ::-1]
    missing = np.concatenate([left[..., 1:], np.zeros_like(left[..., :1])], axis=-1)
    enough = missing <= (1 - energy) * left[..., :1]
    return 1 + int(np.argmax(enough, axis=-1).max())


def _check_operator(operator: Any, n: int) -> Any:
    shape = np.shape(operator) if not hasattr(operator, "shape") else operator.shape
    if tuple(shape) != (n, n):
        raise ValidationError(
            f"the operator has shape {tuple(shape)}, but bases of {n} numbers need {(n, n)}"
        )
    return operator if hasattr(operator, "shape") else np.asarray(operator)
