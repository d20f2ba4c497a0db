"""The spaces: points, tangent vectors and their geometry."""

from .base import POINT_TOL, POINT_TOL_FLOAT32, Array, Doubles, Space, point_tol
from .groups import Orthogonal, SpecialEuclidean, SpecialOrthogonal, SpecialUnitary, Unitary
from .indefinite import AntiDeSitter, DeSitter, IndefiniteGrassmannian
from .linear import Affine, ComplexGeneralLinear, GeneralLinear, Lorentz, Similarity, SpecialLinear, Symplectic
from .positive import HermitianPositiveDefinite, Siegel, SpecialPositiveDefinite, SymmetricPositiveDefinite
from .product import Product, factors_of, parts_of, product_norm, space, space_named
from .subspaces import (
    ComplexGrassmannian,
    ComplexHyperbolic,
    ComplexProjective,
    Grassmannian,
    QuaternionicProjective,
    RealProjective,
)
from .vectors import Euclidean, Hyperbolic, Sphere

__all__ = [
    "POINT_TOL",
    "POINT_TOL_FLOAT32",
    "Affine",
    "AntiDeSitter",
    "Array",
    "ComplexGeneralLinear",
    "ComplexGrassmannian",
    "ComplexHyperbolic",
    "ComplexProjective",
    "DeSitter",
    "Doubles",
    "Euclidean",
    "GeneralLinear",
    "Grassmannian",
    "HermitianPositiveDefinite",
    "Hyperbolic",
    "IndefiniteGrassmannian",
    "Lorentz",
    "Orthogonal",
    "Product",
    "QuaternionicProjective",
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
    "Unitary",
    "factors_of",
    "parts_of",
    "point_tol",
    "product_norm",
    "space",
    "space_named",
]
