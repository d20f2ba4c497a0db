"""Manifolds that are defined by functions, in Python: Stiefel manifolds, surfaces, and those of other libraries."""

from ._adapters import from_geomstats, from_pymanopt
from ._manifold import Manifold
from ._stiefel import Stiefel
from ._surface import from_surface

__all__ = ["Manifold", "Stiefel", "from_geomstats", "from_pymanopt", "from_surface"]
