"""Pictures of curves: what `symspline.CubicSpline.plot` draws. Needs matplotlib.

Every figure has a picture that depends on the space, and speed and acceleration against time. The pages
`flat`, `sphere`, `frames`, `disk` and `components` draw the pictures; `pictures` says which space has which.
"""

from .figure import plot

__all__ = ["plot"]
