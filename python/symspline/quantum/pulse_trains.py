"""Piecewise constant Hamiltonians."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._core import ValidationError
from ..arrays import as_array, shown
from ..convert.reading import Array, adjoint, largest, refuse, square_matrices
from ..handed import times_of
from ..spline import CubicSpline
from .generators import generator, hamiltonian, quantum_space


def pulses(
    spline: CubicSpline, edges: ArrayLike, kind: str = "exact", operators: ArrayLike | None = None
) -> Array:
    """Piecewise constant Hamiltonians, one between any two edges, that steer along a curve.

    Args:
        spline: as for `hamiltonian`.
        edges: m + 1 increasing times between the first and the last knot.
        kind: ``"exact"`` for the generators of the geodesics from edge to edge: the states meet the curve at every
            edge, to rounding. ``"midpoint"`` for H in the middle, which is off by the square of the spacing.
        operators: Hermitian matrices, shape (q, n, n), such as Pauli's, in which to express the pulses; None for
            the matrices themselves.

    Returns:
        Hermitian matrices, shape batch axes + (m, n, n), or their real coefficients cⱼ, H = Σ cⱼ operators[j], shape
        batch axes + (m, q).

    Raises:
        ValidationError: the input is not what is described above, or the operators do not span a pulse; the message
            says what is missing.
        CutLocusError: ``kind="exact"``, and an edge is so far from the next that two geodesics join them.

    >>> import symspline as ss
    >>> from_up_to_down = ss.CubicSpline([0, 1, 2], [[1, 0], [2**-0.5, 2**-0.5], [0, 1]], "cp:1")
    >>> paulis = [[[0, 1], [1, 0]], [[0, -1j], [1j, 0]], [[1, 0], [0, -1]]]
    >>> pulses(from_up_to_down, [0, 1, 2], operators=paulis).round(8) + 0.0
    array([[0.        , 0.78539816, 0.        ],
           [0.        , 0.78539816, 0.        ]])
    """
    space = quantum_space(spline)
    if not isinstance(kind, str) or kind not in ("exact", "midpoint"):
        raise ValidationError(f"kind must be 'exact' or 'midpoint', not {shown(kind)}")
    n = space.point_shape[0]
    basis = None if operators is None else _basis(operators, n)
    times, spacing = _edges(spline, edges)
    if kind == "midpoint":
        h = hamiltonian(spline, times[:-1] + (times[1:] - times[:-1]) / 2)
    else:
        points = spline(times)
        axis = len(spline._batch)
        first, last = (
            np.take(points, range(len(times) - 1), axis),
            np.take(points, range(1, len(times)), axis),
        )
        h = generator(space, first, space.log(first, last)) / spacing[..., None, None]
    return h if basis is None else _coefficients(h, basis)


def _edges(spline: CubicSpline, edges: ArrayLike) -> tuple[Array, Array]:
    """The edges as they are given, and the times between them."""
    times = as_array(times_of(edges, "edges")[0], "edges")
    if times.ndim != 1 or len(times) < 2:
        raise ValidationError(
            f"edges must be two or more times in a row, not an array of shape {times.shape}"
        )
    spacing = np.diff(spline._clock.at(edges, spline._batch, False, spline._times)[0])
    refuse(
        ~(spacing > 0),
        "edges",
        lambda i: (
            f"is {times[i[-1]]}, and {times[i[-1] + 1]} comes next; put them in increasing order, none twice"
        ),
    )
    return times, spacing


def _basis(operators: Any, n: int) -> Array:
    """Linearly independent Hermitian matrices."""
    basis, tol = square_matrices(operators, "operators")
    if basis.ndim != 3 or basis.shape[1] != n:
        raise ValidationError(f"operators must be of shape (q, {n}, {n}), not {basis.shape}")
    skew = largest(basis - adjoint(basis))
    refuse(
        ~(skew <= tol * largest(basis)),
        "operators",
        lambda i: (
            f"is not Hermitian: |A - A*| is {skew[i]:.3e}; pulses are real multiples of Hermitian operators"
        ),
    )
    columns = _as_columns(basis)
    # The diagonal of R is how much of every operator its predecessors do not express.
    new = np.zeros(len(basis))
    triangle = np.abs(np.diagonal(np.linalg.qr(columns).R))
    new[: len(triangle)] = triangle
    refuse(
        ~(new > 1e-10 * np.linalg.norm(columns, axis=0)),
        "operators",
        lambda i: (
            "is a combination of those before it, or zero; leave it out, so that coefficients are unique"
        ),
    )
    return basis


def _as_columns(matrices: Array) -> Array:
    """Hermitian matrices as columns of real numbers, with ⟨A, B⟩ = tr AB."""
    numbers = np.ascontiguousarray(matrices, complex).reshape(len(matrices), -1).view(float)
    return numbers.T


def _coefficients(h: Array, basis: Array) -> Array:
    flat = h.reshape(-1, *h.shape[-2:])
    columns = _as_columns(basis)
    wanted = _as_columns(flat)
    found = np.linalg.lstsq(columns, wanted, rcond=None)[0]
    left = (wanted - columns @ found).T.copy().view(complex).reshape(h.shape)
    size, most = np.sqrt(np.sum(np.abs(left) ** 2, axis=(-2, -1))), np.abs(left)
    # Spectral norms of pulses are speeds: what is missing is compared with the strongest of all.
    allowed = 1e-9 * max(float(np.linalg.norm(flat, axis=(-2, -1)).max(initial=0)), np.finfo(float).tiny)

    def say(i: Any) -> str:
        j, k = np.unravel_index(most[i].argmax(), most[i].shape)
        return (
            f"cannot be expressed in the operators: {size[i]:.3e} of its norm {np.linalg.norm(h[i]):.3e} is left, "
            f"most of it in the entries [{j}, {k}] and [{k}, {j}] ({left[i][j, k]:.3g}); add operators that have them"
        )

    refuse(~(size <= allowed), "pulse", say)
    return found.T.reshape(*h.shape[:-2], len(basis))
