"""The spaces: where points live, and their geometry."""

from .base import Array, Space
from .groups import Orthogonal, SpecialEuclidean, SpecialOrthogonal, SpecialUnitary, Unitary
from .named import space
from .positive import HermitianPositiveDefinite, SymmetricPositiveDefinite
from .product import Product, factors_of, parts_of, together
from .subspaces import ComplexGrassmannian, ComplexHyperbolic, ComplexProjective, Grassmannian, RealProjective
from .tolerance import POINT_TOL_FLOAT32, point_tol
from .vectors import Euclidean, Hyperbolic, Sphere

__all__ = [
    "POINT_TOL_FLOAT32",
    "Array",
    "ComplexGrassmannian",
    "ComplexHyperbolic",
    "ComplexProjective",
    "Euclidean",
    "Grassmannian",
    "HermitianPositiveDefinite",
    "Hyperbolic",
    "Orthogonal",
    "Product",
    "RealProjective",
    "Space",
    "SpecialEuclidean",
    "SpecialOrthogonal",
    "SpecialUnitary",
    "Sphere",
    "SymmetricPositiveDefinite",
    "Unitary",
    "factors_of",
    "parts_of",
    "point_tol",
    "space",
    "together",
]
