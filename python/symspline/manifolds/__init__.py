"""Manifolds that are not symmetric spaces, or that users bring: curves on them are made in Python."""

from .manifold import Manifold
from .stiefel import Stiefel

__all__ = ["Manifold", "Stiefel"]
