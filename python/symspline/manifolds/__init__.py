"""Manifolds that are not symmetric spaces, or that users bring: curves on them are made in Python."""

from .adapters import from_geomstats, from_pymanopt
from .manifold import Manifold
from .stiefel import Stiefel
from .surface import from_surface

__all__ = ["Manifold", "Stiefel", "from_geomstats", "from_pymanopt", "from_surface"]
