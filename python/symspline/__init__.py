"""Smooth C² curves through points on curved spaces.

>>> import symspline as ss
>>> spline = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], ss.Sphere(2))
>>> spline(0.5).round(8)
array([ 0.61308303,  0.76368565, -0.20227067])

The method is that of Bogfjellmo, Modin and Verdier, *A Numerical Algorithm for C²-splines on
Symmetric Spaces* (2018), extended to any knots and many end conditions.
"""

import os as _os
from pathlib import Path as _Path

from . import _cpu

_cpu.load(_Path(__file__).parent)

from . import convert, geo, manifolds, measure, poses, quantum, rotations, shapes, subspaces, tensors, testing  # noqa: E402
from ._base.config import show_config  # noqa: E402
from ._base.exceptions import SymsplineError  # noqa: E402
from ._base.report import ConvergenceWarning, CumulativeReport, FarPointsWarning, Report  # noqa: E402
from ._base.threads import set_num_threads  # noqa: E402
from ._base.version import VERSION  # noqa: E402
from ._core import ConvergenceError, CutLocusError, ValidationError, num_threads  # noqa: E402
from ._curves.derivatives import Gradient  # noqa: E402
from ._estimation import estimate  # noqa: E402
from ._grid import GridReport, GridSpline  # noqa: E402
from ._smoothing import (  # noqa: E402
    SmoothingGrid,
    SmoothingGridReport,
    SmoothingReport,
    SmoothingSpline,
    SmoothingWarning,
    make_lsq_spline,
    make_smoothing_grid,
    make_smoothing_spline,
)
from ._smoothing.segments import fit_segments  # noqa: E402
from ._spaces import (  # noqa: E402
    Affine,
    AmbiguousMeanWarning,
    AntiDeSitter,
    ComplexGeneralLinear,
    ComplexGrassmannian,
    ComplexHyperbolic,
    ComplexProjective,
    DeSitter,
    Euclidean,
    GeneralLinear,
    Grassmannian,
    HermitianPositiveDefinite,
    Hyperbolic,
    IndefiniteGrassmannian,
    LogEuclidean,
    Lorentz,
    Orthogonal,
    Product,
    QuaternionicProjective,
    Quotient,
    RealProjective,
    Siegel,
    Similarity,
    Space,
    SpecialEuclidean,
    SpecialLinear,
    SpecialOrthogonal,
    SpecialPositiveDefinite,
    SpecialUnitary,
    Sphere,
    SymmetricPositiveDefinite,
    Symplectic,
    Torus,
    Unitary,
    space,
)
from ._splines.bspline import BezierCurve, BSpline  # noqa: E402
from ._splines.compare import plot  # noqa: E402
from ._splines.composed import RetimedCurve, SegmentedCurve  # noqa: E402
from ._splines.cubic import CubicSpline  # noqa: E402
from ._splines.cumulative import CumulativeBSpline  # noqa: E402
from ._splines.curve import Curve, Derivative  # noqa: E402
from ._splines.files import load, save  # noqa: E402
from ._splines.functional import evaluate, fit, fit_many  # noqa: E402
from ._splines.geodesics import PiecewiseGeodesic  # noqa: E402
from ._splines.hermite import HermiteSpline  # noqa: E402
from ._splines.time_law import TimeLaw, time_law  # noqa: E402
from ._statistics import TangentPCA, tangent_pca  # noqa: E402
from .manifolds import Manifold, Stiefel  # noqa: E402

__version__ = VERSION
__all__ = [
    "Affine",
    "AmbiguousMeanWarning",
    "AntiDeSitter",
    "BSpline",
    "BezierCurve",
    "ComplexGeneralLinear",
    "ComplexGrassmannian",
    "ComplexHyperbolic",
    "ComplexProjective",
    "ConvergenceError",
    "ConvergenceWarning",
    "CubicSpline",
    "CumulativeBSpline",
    "CumulativeReport",
    "Curve",
    "CutLocusError",
    "DeSitter",
    "Derivative",
    "Euclidean",
    "FarPointsWarning",
    "GeneralLinear",
    "Gradient",
    "Grassmannian",
    "GridReport",
    "GridSpline",
    "HermiteSpline",
    "HermitianPositiveDefinite",
    "Hyperbolic",
    "IndefiniteGrassmannian",
    "LogEuclidean",
    "Lorentz",
    "Manifold",
    "Orthogonal",
    "PiecewiseGeodesic",
    "Product",
    "QuaternionicProjective",
    "Quotient",
    "RealProjective",
    "Report",
    "RetimedCurve",
    "SegmentedCurve",
    "Siegel",
    "Similarity",
    "SmoothingGrid",
    "SmoothingGridReport",
    "SmoothingReport",
    "SmoothingSpline",
    "SmoothingWarning",
    "Space",
    "SpecialEuclidean",
    "SpecialLinear",
    "SpecialOrthogonal",
    "SpecialPositiveDefinite",
    "SpecialUnitary",
    "Sphere",
    "Stiefel",
    "SymmetricPositiveDefinite",
    "Symplectic",
    "SymsplineError",
    "TangentPCA",
    "TimeLaw",
    "Torus",
    "Unitary",
    "ValidationError",
    "convert",
    "estimate",
    "evaluate",
    "fit",
    "fit_many",
    "fit_segments",
    "geo",
    "load",
    "make_lsq_spline",
    "make_smoothing_grid",
    "make_smoothing_spline",
    "manifolds",
    "measure",
    "num_threads",
    "plot",
    "poses",
    "quantum",
    "rotations",
    "save",
    "set_num_threads",
    "shapes",
    "show_config",
    "space",
    "subspaces",
    "tangent_pca",
    "tensors",
    "testing",
    "time_law",
]

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
