"""Pictures of curves and grids, as `symspline.Curve.plot` and `GridSpline.plot` draw them with matplotlib.

A page of a curve has the view of its space, and graphs of velocity and acceleration. The module `views` has a table
with the view of every space, and the module `grid` one for grids. `curves` samples what is drawn, `panels` has the axes
and what is drawn along a curve, and `globe`, `chart`, `matrices` and `graphs` have the views. `plot` draws one or
several curves on a page, which explains its symbols, or in axes of the user, and `animation` moves a marker along a
curve. Colours and fonts are those of the active style of matplotlib.
"""

from .animation import animate
from .grid import checked_axis_names, checked_direction, plot_grid
from .plot import checked_look, compare, plot

__all__ = ["animate", "checked_axis_names", "checked_direction", "checked_look", "compare", "plot", "plot_grid"]
