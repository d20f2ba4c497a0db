"""Other coordinates of points: models of hyperbolic space, projectors, reflections, density matrices, quaternions,
spaces that lie in others.

Every function works on arrays of points: leading axes stay as they are. Input of double precision may be
off by 1e-8, of single precision by 1e-4; what comes out is exact to rounding.

>>> import numpy as np, symspline as ss
>>> ss.convert.hyperboloid_to_ball([np.cosh(2), np.sinh(2)]).round(8)
array([0.76159416])
"""

from .embeddings import (
    positive_definite_to_siegel,
    quaternions_to_subspace,
    siegel_to_positive_definite,
    subspace_to_quaternions,
)
from .models import (
    ball_to_half_space,
    ball_to_hyperboloid,
    half_space_to_ball,
    half_space_to_hyperboloid,
    hyperboloid_to_ball,
    hyperboloid_to_half_space,
)
from .projectors import basis_to_projector, density_to_state, projector_to_basis, state_to_density
from .quaternions import matrix_to_quaternion, quaternion_to_matrix
from .reflections import basis_to_reflection, reflection_to_basis

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
    "matrix_to_quaternion",
    "positive_definite_to_siegel",
    "projector_to_basis",
    "quaternion_to_matrix",
    "quaternions_to_subspace",
    "reflection_to_basis",
    "siegel_to_positive_definite",
    "state_to_density",
    "subspace_to_quaternions",
]
