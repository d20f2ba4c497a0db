"""Splines over grids: interpolation over several parameters."""

from .spline import GridReport as GridReport
from .spline import GridSpline as GridSpline
