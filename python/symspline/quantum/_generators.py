"""The Hamiltonian of a curve."""

from __future__ import annotations

from typing import Any

from .._base_curve import check_curve
from .._core import ValidationError
from .._cubic import CubicSpline
from .._options import order_of
from .._spaces import ComplexGrassmannian, ComplexProjective, Space, SpecialUnitary, Unitary
from .._typing import Extrapolate, TimesLike
from ..convert._reading import Array, adjoint


def hamiltonian(spline: CubicSpline[Any, Any], x: TimesLike, *, nu: int = 0, extrapolate: Extrapolate = None) -> Array:
    """Compute the Hamiltonian that drives states along a curve, or its derivative.

    Parameters
    ----------
    spline : CubicSpline
        Curve on `ComplexProjective`, `ComplexGrassmannian`, `Unitary` or `SpecialUnitary`.
    x : array_like
        Times, any shape.
    nu : {0, 1}, default 0
        0 for H, 1 for its derivative H'.
    extrapolate : bool or str, optional
        Extrapolation policy, as for `CubicSpline`. ODE solvers may evaluate H beyond the last knot, which raises an
        error by default. Pass ``"geodesic"`` to continue with the final Hamiltonian.

    Returns
    -------
    ndarray, shape ``(*batch axes, *x.shape, n, n)``
        Hermitian matrices H with iψ' = Hψ.

    Raises
    ------
    ValidationError
        If the curve is on another space, `nu` is not 0 or 1, or a time is outside the knots.

    Notes
    -----
    For states and subspaces, H has the least norm at every time: H = i[P', P] for the projector P [1]_. Its Frobenius
    norm is √2 times the speed of the curve; for single states its spectral norm is the speed. H does not depend on
    phases or bases of the points. It is as smooth as the velocity, C¹, and ∫ ‖H'‖² dt is twice
    `CubicSpline.bending_energy`. For gates, H = iU'U* is unique. See also §4.2 of the paper.

    References
    ----------
    .. [1] Kato, "On the adiabatic theorem of quantum mechanics", 1950.

    Examples
    --------
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
    """Return the space of a curve that has a Hamiltonian, or raise ValidationError."""
    check_curve(spline)
    space: Space = spline.space
    if isinstance(space, (ComplexProjective, ComplexGrassmannian, Unitary, SpecialUnitary)):
        return space
    raise ValidationError(
        f"a curve on {space!r} does not define a Hamiltonian; use ComplexProjective(n) for states, "
        "ComplexGrassmannian(k, n) for subspaces, and Unitary(n) or SpecialUnitary(n) for gates"
    )


def generator(space: Space, point: Array, vector: Array) -> Array:
    """Return the Hermitian matrix H of least norm with −iH·point = vector, for a horizontal tangent vector."""
    if isinstance(space, ComplexProjective):
        point, vector = point[..., None], vector[..., None]
    half = 1j * vector @ adjoint(point)
    # Hermitian to the last bit; of gates both halves are the same but for rounding.
    h: Array = half + adjoint(half)
    return h / 2 if isinstance(space, (Unitary, SpecialUnitary)) else h
