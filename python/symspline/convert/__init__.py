"""Conversions between representations of points.

The representations are models of hyperbolic space, projectors, reflections, density matrices, and totally geodesic
submanifolds. `symspline.rotations` converts rotations.

All functions are vectorised over the leading axes. The accuracy of the input determines how far it may deviate, as for
points of `symspline.CubicSpline`: by 1e-8 in double precision, and by 1e-4 for numbers that were in single precision or
have at most nine significant digits. Results are exact up to rounding errors.

Examples
--------
>>> import numpy as np, symspline as ss
>>> ss.convert.hyperboloid_to_ball([np.cosh(2), np.sinh(2)]).round(8)
array([0.76159416])
"""

from ._models import (
    ball_to_half_space,
    ball_to_hyperboloid,
    basis_to_projector,
    basis_to_reflection,
    density_to_state,
    half_space_to_ball,
    half_space_to_hyperboloid,
    hyperboloid_to_ball,
    hyperboloid_to_half_space,
    positive_definite_to_siegel,
    projector_to_basis,
    quaternions_to_subspace,
    reflection_to_basis,
    siegel_to_positive_definite,
    state_to_density,
    subspace_to_quaternions,
)

__all__ = [
    "ball_to_half_space",
    "ball_to_hyperboloid",
    "basis_to_projector",
    "basis_to_reflection",
    "density_to_state",
    "half_space_to_ball",
    "half_space_to_hyperboloid",
    "hyperboloid_to_ball",
    "hyperboloid_to_half_space",
    "positive_definite_to_siegel",
    "projector_to_basis",
    "quaternions_to_subspace",
    "reflection_to_basis",
    "siegel_to_positive_definite",
    "state_to_density",
    "subspace_to_quaternions",
]
