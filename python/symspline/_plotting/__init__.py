"""Pictures of curves and grids, as `symspline.Curve.plot` and `GridSpline.plot` draw them with matplotlib.

A page of a curve has the view of its space, and graphs of velocity and acceleration. The module `views` has a table
with the view of every space, and the module `grid` one for grids. `curves` samples what is drawn, `lines` draws it
along a curve, and `sphere`, `chart`, `poses`, `matrices` and `graphs` have the views. `page` lays out a page and
explains its symbols, `plot` draws one or several curves on a page or in axes of the user, and `animation` moves a
marker along a curve. Colours and fonts are those of the active style of matplotlib.
"""

from .animation import animate
from .grid import plot_grid
from .plot import checked_look, compare, plot

__all__ = ["animate", "checked_look", "compare", "plot", "plot_grid"]
