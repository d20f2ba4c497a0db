"""Pictures of curves: what `symspline.CubicSpline.plot` draws. Needs matplotlib.

Every figure has a picture that depends on the space, and speed and acceleration against time. The page
`pictures` says which space has which; the pages from which it imports draw them.
"""

from .figure import plot

__all__ = ["plot"]
