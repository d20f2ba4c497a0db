"""Pictures of curves, as `symspline.CubicSpline.plot` draws them with matplotlib.

Every figure has a picture that depends on the space, and graphs of speed and acceleration. The module `figure` has a
table of the picture of every space; the modules that it imports draw the pictures.
"""

from .figure import plot

__all__ = ["plot"]
