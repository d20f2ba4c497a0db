"""The Hamiltonian of a curve."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from .._core import ValidationError
from ..convert.reading import Array, adjoint
from ..curves.curve import order_of
from ..piecewise import check_curve
from ..spaces import ComplexGrassmannian, ComplexProjective, Space, SpecialUnitary, Unitary
from ..spline import CubicSpline


def hamiltonian(
    spline: CubicSpline, x: ArrayLike, nu: int = 0, *, extrapolate: bool | str | None = None
) -> Array:
    """The Hamiltonian H(x) with iψ' = Hψ that drives states along a curve, or its derivative.

    Of states and subspaces it is the one of least norm at every time: its Frobenius norm is √2 times the speed of the
    curve, and of single states its spectral norm is the speed. It does not depend on phases or bases of the points. H
    is as smooth as the velocity: C¹, and ∫ ‖H'‖² dt is twice `CubicSpline.bending_energy`. Of gates it is iU'U*, the
    only one.

    A solver of differential equations may try times past the last knot, where the curve raises an error: give it
    ``extrapolate="geodesic"``, with which H goes on as it was at the end.

    Source: §4.2 of the paper; Kato, On the adiabatic theorem of quantum mechanics (1950): H = i[P', P] for the
    projector P.

    Args:
        spline: a curve on `ComplexProjective`, `ComplexGrassmannian`, `Unitary` or `SpecialUnitary`.
        x: times, any shape.
        nu: 0 for H, 1 for its derivative H'.
        extrapolate: as for calling a `CubicSpline`.

    Returns:
        Hermitian matrices, shape batch axes + x.shape + (n, n).

    Raises:
        ValidationError: the curve is in another space, ``nu`` is not 0 or 1, or a time is outside the knots.

    >>> import numpy as np, symspline as ss
    >>> from_up_to_down = ss.CubicSpline([0, 1, 2], [[1, 0], [2**-0.5, 2**-0.5], [0, 1]], "cp:1")
    >>> (hamiltonian(from_up_to_down, 0.5) / (np.pi / 4)).round(8) + 0.0
    array([[0.+0.j, 0.-1.j],
           [0.+1.j, 0.+0.j]])
    """
    space = quantum_space(spline)
    nu = order_of(nu, 1)
    point, vector = (spline(x, nu=order, extrapolate=extrapolate) for order in (0, nu + 1))
    return generator(space, point, vector)


def quantum_space(spline: Any) -> Space:
    """The space of a curve that has a Hamiltonian."""
    check_curve(spline)
    space: Space = spline.space
    if isinstance(space, (ComplexProjective, ComplexGrassmannian, Unitary, SpecialUnitary)):
        return space
    raise ValidationError(
        f"a curve on {space!r} has no Hamiltonian; states are points of ComplexProjective(n), subspaces of "
        "ComplexGrassmannian(k, n), gates of Unitary(n) or SpecialUnitary(n)"
    )


def generator(space: Space, point: Array, vector: Array) -> Array:
    """The Hermitian matrix H of least norm with −iH·point = vector, for a tangent vector of horizontal form."""
    if isinstance(space, ComplexProjective):
        point, vector = point[..., None], vector[..., None]
    half = 1j * vector @ adjoint(point)
    # Hermitian to the last bit; of gates both halves are the same but for rounding.
    h: Array = half + adjoint(half)
    return h / 2 if isinstance(space, (Unitary, SpecialUnitary)) else h
