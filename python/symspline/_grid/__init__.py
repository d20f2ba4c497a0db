"""Splines over grids: interpolation over several parameters."""

from .report import GridReport as GridReport
from .spline import GridSpline as GridSpline
