"""Curve constant Hamiltonians."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import as_array, refuse, short_repr
from .._core import ValidationError
from .._cubic import CubicSpline
from .._input import times_of
from .._typing import TimesLike
from ..convert._reading import Array, adjoint, largest, square_matrices
from ._generators import generator, hamiltonian, quantum_space


def pulses(
    spline: CubicSpline[Any, Any],
    edges: TimesLike,
    *,
    kind: Literal["exact", "midpoint"] = "exact",
    operators: ArrayLike | None = None,
) -> Array:
    """Compute piecewise constant Hamiltonians that steer along a curve.

    Parameters
    ----------
    spline : CubicSpline
        Curve, as for `hamiltonian`.
    edges : array_like, shape (m + 1,)
        Increasing times between the first and the last knot. There is one pulse between neighbouring edges.
    kind : {"exact", "midpoint"}, default "exact"
        ``"exact"`` for the generators of the geodesics between edges: the states agree with the curve at every edge, up
        to rounding errors. ``"midpoint"`` for H at the middle of each interval; its error is proportional to the square
        of the spacing.
    operators : array_like, shape (q, n, n), optional
        Hermitian matrices, such as Pauli matrices, in which to express the pulses. None means the matrices themselves.

    Returns
    -------
    ndarray, shape ``(*batch axes, m, n, n)`` or ``(*batch axes, m, q)``
        Hermitian matrices, or their real coefficients cⱼ with H = Σ cⱼ operators[j].

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above, or the operators do not span a pulse. The message names the
        missing components.
    CutLocusError
        If ``kind="exact"``, and an edge is so far from the next that two shortest geodesics join them.

    Examples
    --------
    >>> import symspline as ss
    >>> from_up_to_down = ss.CubicSpline([0, 1, 2], [[1, 0], [2**-0.5, 2**-0.5], [0, 1]], "cp:1")
    >>> paulis = [[[0, 1], [1, 0]], [[0, -1j], [1j, 0]], [[1, 0], [0, -1]]]
    >>> pulses(from_up_to_down, [0, 1, 2], operators=paulis).round(8) + 0.0
    array([[0.        , 0.78539816, 0.        ],
           [0.        , 0.78539816, 0.        ]])
    """
    space = quantum_space(spline)
    if not isinstance(kind, str) or kind not in ("exact", "midpoint"):
        raise ValidationError(f"kind must be 'exact' or 'midpoint', not {short_repr(kind)}")
    n = space.point_shape[0]
    basis = None if operators is None else _basis(operators, n)
    times, spacing = _edges(spline, edges)
    if kind == "midpoint":
        h = hamiltonian(spline, times[:-1] + (times[1:] - times[:-1]) / 2)
    else:
        first, last = space._neighbours(spline(times))
        h = generator(space, first, space.log(first, last)) / spacing[..., None, None]
    return h if basis is None else _coefficients(h, basis)


def _edges(spline: CubicSpline[Any, Any], edges: TimesLike) -> tuple[Array, Array]:
    """Return the edges in their original type, and the intervals between them."""
    times = as_array(times_of(edges, "edges")[0], "edges")
    if times.ndim != 1 or len(times) < 2:
        raise ValidationError(
            f"edges must be a one-dimensional array of at least two times, not of shape {times.shape}"
        )
    spacing = np.diff(spline._time_axis.at(edges, spline._batch, False, spline._times)[0])
    advice = "edges must be strictly increasing"
    refuse(~(spacing > 0), "edges", lambda i: f"is {times[i[-1]]}, and the next is {times[i[-1] + 1]}, but {advice}")
    return times, spacing


def _basis(operators: Any, n: int) -> Array:
    """Return linearly independent Hermitian matrices."""
    basis, tol = square_matrices(operators, "operators")
    if basis.ndim != 3 or basis.shape[1] != n:
        raise ValidationError(f"operators must be of shape (q, {n}, {n}), not {basis.shape}")
    skew = largest(basis - adjoint(basis))
    bad = ~(skew <= tol * largest(basis))
    refuse(bad, "operators", lambda i: f"is not Hermitian: |A - A*| is {skew[i]:.3e}; pass Hermitian operators")
    columns = _as_columns(basis)
    # The diagonal of R is the norm of the component of every operator outside the span of its predecessors.
    new = np.zeros(len(basis))
    triangle = np.abs(np.diagonal(np.linalg.qr(columns).R))
    new[: len(triangle)] = triangle
    why = "is zero or a linear combination of the previous operators; remove it, so that coefficients are unique"
    refuse(~(new > 1e-10 * np.linalg.norm(columns, axis=0)), "operators", lambda _: why)
    return basis


def _as_columns(matrices: Array) -> Array:
    """Return Hermitian matrices as columns of real numbers, with ⟨A, B⟩ = tr AB."""
    numbers = np.ascontiguousarray(matrices, complex).reshape(len(matrices), -1).view(float)
    return numbers.T


def _coefficients(h: Array, basis: Array) -> Array:
    flat = h.reshape(-1, *h.shape[-2:])
    columns = _as_columns(basis)
    wanted = _as_columns(flat)
    found = np.linalg.lstsq(columns, wanted, rcond=None)[0]
    left = (wanted - columns @ found).T.copy().view(complex).reshape(h.shape)
    size, most = np.sqrt(np.sum(np.abs(left) ** 2, axis=(-2, -1))), np.abs(left)
    # Spectral norms of pulses are speeds, so the remainder is compared with the largest norm of all pulses.
    allowed = 1e-9 * max(float(np.linalg.norm(flat, axis=(-2, -1)).max(initial=0)), np.finfo(float).tiny)

    def say(i: Any) -> str:
        j, k = np.unravel_index(most[i].argmax(), most[i].shape)
        return (
            f"cannot be expressed in the operators: {size[i]:.3e} of its norm {np.linalg.norm(h[i]):.3e} remains, "
            f"mostly in the entries [{j}, {k}] and [{k}, {j}] ({left[i][j, k]:.3g}); add operators with these entries"
        )

    refuse(~(size <= allowed), "pulse", say)
    return found.T.reshape(*h.shape[:-2], len(basis))
