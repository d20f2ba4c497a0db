"""Manifolds that are defined by functions, in Python: Stiefel manifolds, and those of other libraries."""

from ._adapters import from_geomstats, from_pymanopt
from ._manifold import Manifold
from ._stiefel import Stiefel

__all__ = ["Manifold", "Stiefel", "from_geomstats", "from_pymanopt"]
