"""C² curves through noisy data: smoothing splines, with their smoothness chosen from the data."""

from .make import make_lsq_spline, make_smoothing_spline
from .report import SmoothingReport
from .spline import SmoothingSpline
from .warned import SmoothingWarning

__all__ = ["SmoothingReport", "SmoothingSpline", "SmoothingWarning", "make_lsq_spline", "make_smoothing_spline"]
