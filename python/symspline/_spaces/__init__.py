# ruff: noqa: F401
# mypy: implicit-reexport
"""The spaces: points, tangent vectors and their geometry."""

from .._base.arrays import POINT_TOL, point_tol
from .._base.typing import Array
from .actions import Group
from .base import AnySpace, Doubles, Space
from .groups import (
    Affine,
    ComplexGeneralLinear,
    GeneralLinear,
    Lorentz,
    Orthogonal,
    Similarity,
    SpecialEuclidean,
    SpecialLinear,
    SpecialOrthogonal,
    SpecialUnitary,
    Symplectic,
    Unitary,
    nearest_rotations,
    rotations_and_positions,
)
from .indefinite import AntiDeSitter, DeSitter, IndefiniteGrassmannian
from .positive import (
    HermitianPositiveDefinite,
    LogEuclidean,
    Siegel,
    SpecialPositiveDefinite,
    SymmetricPositiveDefinite,
)
from .product import Product, factors_of, parts_of, product_norm, short_name, space, space_named
from .quotient import Quotient, cover_of, refuse_quotients
from .statistics import AmbiguousMeanWarning, Groups, karcher_mean, require_metric
from .subspaces import (
    ComplexGrassmannian,
    ComplexHyperbolic,
    ComplexProjective,
    Grassmannian,
    QuaternionicProjective,
    RealProjective,
)
from .vectors import Euclidean, Hyperbolic, Sphere, Torus

# What `symspline` exports.
__all__ = [
    "Affine",
    "AmbiguousMeanWarning",
    "AntiDeSitter",
    "ComplexGeneralLinear",
    "ComplexGrassmannian",
    "ComplexHyperbolic",
    "ComplexProjective",
    "DeSitter",
    "Euclidean",
    "GeneralLinear",
    "Grassmannian",
    "HermitianPositiveDefinite",
    "Hyperbolic",
    "IndefiniteGrassmannian",
    "LogEuclidean",
    "Lorentz",
    "Orthogonal",
    "Product",
    "QuaternionicProjective",
    "Quotient",
    "RealProjective",
    "Siegel",
    "Similarity",
    "Space",
    "SpecialEuclidean",
    "SpecialLinear",
    "SpecialOrthogonal",
    "SpecialPositiveDefinite",
    "SpecialUnitary",
    "Sphere",
    "SymmetricPositiveDefinite",
    "Symplectic",
    "Torus",
    "Unitary",
    "space",
]
