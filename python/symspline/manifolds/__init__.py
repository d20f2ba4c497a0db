"""Manifolds that are not symmetric spaces, or that users bring: curves on them are made in Python."""

from ._adapters import from_geomstats, from_pymanopt
from ._manifold import Manifold
from ._stiefel import Stiefel
from ._surface import from_surface

__all__ = ["Manifold", "Stiefel", "from_geomstats", "from_pymanopt", "from_surface"]
