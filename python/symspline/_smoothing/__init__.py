"""C² curves through noisy data: smoothing splines, with their smoothness chosen from the data."""

from .grid import SmoothingGrid, SmoothingGridReport, make_smoothing_grid
from .make import make_lsq_spline, make_smoothing_spline
from .report import SmoothingReport, SmoothingWarning
from .spline import SmoothingSpline

__all__ = [
    "SmoothingGrid",
    "SmoothingGridReport",
    "SmoothingReport",
    "SmoothingSpline",
    "SmoothingWarning",
    "make_lsq_spline",
    "make_smoothing_grid",
    "make_smoothing_spline",
]
