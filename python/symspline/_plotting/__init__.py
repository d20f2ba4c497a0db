"""Pictures of curves: what `symspline.CubicSpline.plot` draws. Needs matplotlib.

Every figure has a picture that depends on the space, and speed and acceleration against time. The module `figure`
lists the picture of every space; the modules that it imports draw them.
"""

from .figure import plot

__all__ = ["plot"]
