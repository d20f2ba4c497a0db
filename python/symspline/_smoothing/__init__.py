"""C² curves through noisy data: smoothing splines, with their smoothness chosen from the data."""

from .grid_report import SmoothingGridReport
from .make import make_lsq_spline, make_smoothing_spline
from .make_grid import make_smoothing_grid
from .report import SmoothingReport
from .smoothing_grid import SmoothingGrid
from .spline import SmoothingSpline
from .warned import SmoothingWarning

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
