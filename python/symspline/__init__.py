"""Smooth C² curves through points on curved spaces.

>>> import symspline as ss
>>> spline = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], ss.Sphere(2))
>>> spline(0.5).round(8)
array([ 0.61308303,  0.76368565, -0.20227067])

The method is that of Bogfjellmo, Modin and Verdier, *A Numerical Algorithm for C²-splines on
Symmetric Spaces* (2018), extended to any knots and many end conditions.
"""

# The compiled module comes first.
# ruff: noqa: E402
import os as _os
from pathlib import Path as _Path

from . import _cpu

_cpu.load(_Path(__file__).parent)

from . import (
    _smoothing,
    _spaces,
    convert,
    geo,
    manifolds,
    measure,
    poses,
    quantum,
    rotations,
    shapes,
    subspaces,
    tensors,
    testing,
)
from ._base import VERSION
from ._base.exceptions import SymsplineError
from ._base.report import ConvergenceWarning, CumulativeReport, FarPointsWarning, Report
from ._base.system import set_num_threads, show_config
from ._core import ConvergenceError, CutLocusError, ValidationError, num_threads
from ._curves.derivatives import Gradient
from ._estimation import estimate
from ._grid import GridReport, GridSpline
from ._smoothing import *  # noqa: F403
from ._smoothing.segments import fit_segments
from ._spaces import *  # noqa: F403
from ._splines.base import Curve, Derivative, plot
from ._splines.bsplines import BezierCurve, BSpline, CumulativeBSpline
from ._splines.composed import RetimedCurve, SegmentedCurve
from ._splines.cubic import CubicSpline
from ._splines.files import load, save
from ._splines.functional import evaluate, fit, fit_many
from ._splines.piecewise import HermiteSpline, PiecewiseGeodesic
from ._splines.riemannian import RiemannianCubic, riemannian_cubic
from ._splines.time_law import TimeLaw, time_law
from ._statistics import TangentPCA, tangent_pca
from .manifolds import Manifold, Stiefel

__version__ = VERSION
__all__ = [
    "BSpline",
    "BezierCurve",
    "ConvergenceError",
    "ConvergenceWarning",
    "CubicSpline",
    "CumulativeBSpline",
    "CumulativeReport",
    "Curve",
    "CutLocusError",
    "Derivative",
    "FarPointsWarning",
    "Gradient",
    "GridReport",
    "GridSpline",
    "HermiteSpline",
    "Manifold",
    "PiecewiseGeodesic",
    "Report",
    "RetimedCurve",
    "RiemannianCubic",
    "SegmentedCurve",
    "Stiefel",
    "SymsplineError",
    "TangentPCA",
    "TimeLaw",
    "ValidationError",
    "convert",
    "estimate",
    "evaluate",
    "fit",
    "fit_many",
    "fit_segments",
    "geo",
    "load",
    "manifolds",
    "measure",
    "num_threads",
    "plot",
    "poses",
    "quantum",
    "riemannian_cubic",
    "rotations",
    "save",
    "set_num_threads",
    "shapes",
    "show_config",
    "subspaces",
    "tangent_pca",
    "tensors",
    "testing",
    "time_law",
]
__all__ += _smoothing.__all__
__all__ += _spaces.__all__

if _threads := _os.environ.get("SYMSPLINE_NUM_THREADS"):
    if not (_threads.isascii() and _threads.isdecimal()) or len(_threads) > 9:
        raise ImportError(f"SYMSPLINE_NUM_THREADS must be a whole number, not {_threads[:99]!r}")
    try:
        set_num_threads(int(_threads))
    except ValidationError as _error:
        raise ImportError(f"SYMSPLINE_NUM_THREADS: {_error}") from None


def __dir__() -> list[str]:
    """The public names; everything else starts with an underscore."""
    return sorted([*__all__, *(name for name in globals() if name.startswith("__"))])
