"""Pictures of curves and grids, as `symspline.Curve.plot` and `GridSpline.plot` draw them with matplotlib.

Every figure of a curve has a picture that depends on the space, and graphs of velocity and acceleration. The module
`figure` has a table of the picture of every space, and the module `fields` one for grids; the modules that they import
draw the pictures. The module `collect` samples curves, `comparison` draws several curves and data, and `animation`
moves a marker along a curve.
"""

from .animation import animate
from .comparison import compare
from .grids import plot_grid
from .looks import checked_look
from .page import plot

__all__ = ["animate", "checked_look", "compare", "plot", "plot_grid"]
