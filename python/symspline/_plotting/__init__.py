"""Pictures of curves and grids, as `symspline.CubicSpline.plot` and `GridSpline.plot` draw them with matplotlib.

Every figure of a curve has a picture that depends on the space, and graphs of speed and acceleration. The module
`figure` has a table of the picture of every space, and the module `fields` one for grids; the modules that they import
draw the pictures.
"""

from .figure import plot
from .grids import plot_grid

__all__ = ["plot", "plot_grid"]
