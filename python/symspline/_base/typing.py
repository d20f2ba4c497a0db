"""Types of arguments and results: points, and the words that options accept.

A point is an array, or a tuple of arrays on a product of spaces. Spaces and curves are generic in this type:
``CubicSpline(t, points, Sphere(2))`` is a ``CubicSpline[NDArray[np.float64]]``. Type checkers do not read names of
spaces, so that ``"sphere:2"`` gives ``NDArray[Any]``. An annotation without a parameter, such as ``CubicSpline``,
means the same. Annotate with ``CubicSpline[Any]`` to accept curves on products as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import date, timedelta
from os import PathLike
from types import EllipsisType
from typing import IO, TYPE_CHECKING, Any, Literal, Protocol, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[Any]
FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
# A point of a product whose factors a type checker does not know.
AnyArrays = tuple[Array, ...]
# A number of one curve, or the numbers of a batch.
Number = float | NDArray[np.float64]

if TYPE_CHECKING:
    # Type checkers bring this module with them; Python has defaults of type variables from 3.13 on.
    from typing_extensions import TypeVar

    # The type of a point.
    P = TypeVar("P", bound=Array | tuple[Array, ...], covariant=True, default=Array)
    # The type of a point of a product.
    PProduct = TypeVar("PProduct", bound=tuple[Array, ...], covariant=True, default=tuple[Array, ...])
    # Arrays that results are written into.
    Out = TypeVar("Out", bound=Array | tuple[Array, ...])
else:
    from typing import TypeVar

    P = TypeVar("P", covariant=True)
    PProduct = TypeVar("PProduct", covariant=True)
    Out = TypeVar("Out")


class _Rotations(Protocol):
    """What SciPy's ``Rotation`` has."""

    def as_matrix(self) -> Any: ...


# A time of a curve, or the times of the curves of a batch.
Time = float | np.datetime64 | Array
# Selects curves of a batch, or rows of arrays.
BatchIndex = (
    int | np.integer[Any] | slice | EllipsisType | NDArray[np.integer[Any]] | NDArray[np.bool_] | tuple[Any, ...]
)
# Points, also as rotations of SciPy, or as lists of objects such as quantum states.
PointsLike = ArrayLike | list[Any] | tuple[Any, ...] | _Rotations
# Times: numbers, dates or durations, or arrays or lists of one of them.
TimesLike = ArrayLike | date | timedelta | Sequence[date] | Sequence[timedelta]
# Called with the finished and the total number of points.
Progress = Callable[[int, int], object]
File = str | PathLike[str] | IO[bytes]
TextFile = str | PathLike[str] | IO[str]
# A function of the user, or one whose arguments depend on the space.
AnyFunction = Callable[..., Any]
Color = str | tuple[float, ...]


# Options of artists of matplotlib.
Look = dict[str, Any]
# Keywords that a function passes on as ``**keywords``.
Keywords = dict[str, Any]
# What files and pickles hold of an object.
State = dict[str, Any]


class AxesLook(TypedDict, total=False):
    """The options of plots into existing axes."""

    color: Color | None
    label: str | None
    title: str | None
    show: bool


class PageLook(AxesLook, total=False):
    """The options of plots that create a figure."""

    figsize: tuple[float, float] | float | None


class GridAxesLook(TypedDict, total=False):
    """The options of plots of grids into existing axes."""

    title: str | None
    show: bool
    axis_names: Sequence[str] | None
    direction: ArrayLike | None


class GridLook(GridAxesLook, total=False):
    """The options of plots of grids that create a figure."""

    figsize: tuple[float, float] | float | None


Extrapolate = Literal["raise", "geodesic", "periodic"] | bool | None
OnFailure = Literal["raise", "warn", "ignore"]
Method = Literal["auto", "quasi-newton", "newton", "fixed-point", "homotopy"]

# The condition at one end: a word, or the order of a derivative and its value.
End = Literal["natural", "clamped", "not-a-knot"] | tuple[int, ArrayLike]
BCType = Literal["natural", "clamped", "not-a-knot", "periodic"] | tuple[End, End]
# A velocity and an acceleration at one end, as pairs of an order and a value.
TwoConditions = list[tuple[int, ArrayLike]] | tuple[tuple[int, ArrayLike], tuple[int, ArrayLike]]
CubicBCType = BCType | tuple[End | TwoConditions, End | TwoConditions]

SmoothingWord = Literal["natural", "clamped", "periodic"]
SmoothingEnd = Literal["natural", "clamped"] | tuple[int, ArrayLike]
SmoothingBCType = Literal["natural", "clamped", "periodic", "not-a-knot"] | tuple[SmoothingEnd, SmoothingEnd]
SmoothingMethod = Literal["auto", "linearized", "newton"]
SmoothingPenalty = Literal["acceleration", "jerk"]
CovarianceOrder = Literal[0, 1, "joint"]
Criterion = Literal["gcv", "reml", "cp"]
GridCriterion = Literal["gcv", "cp"]
Loss = Literal["linear", "huber", "cauchy"]
SmoothingNoise = Literal["constant", "adaptive"]
# One number, one for each curve of a batch, or a tuple with one of these for each factor of a product.
Numbers = ArrayLike | tuple[ArrayLike | None, ...]

Duplicates = Literal["raise", "first", "mean"]
Frame = Literal["body", "world"]
RateInterpolation = Literal["cubic", "linear"]
RotationOrder = Literal["columns", "rows", "interleaved"]
TensorOrder = Literal["dipy", "fsl", "mrtrix", "itk"]


class SolverOptions(TypedDict, total=False):
    """Keywords of `CubicSpline` that functions for other libraries pass on."""

    method: Method
    tol: float
    max_iter: int | None
    extrapolate: Extrapolate
    on_failure: OnFailure
    atol: float | None


class CurveOptions(SolverOptions, total=False):
    """The keywords of the functions for automatic differentiation that do not affect the type of the result."""

    bc_type: CubicBCType


class FitOptions(SolverOptions, total=False):
    """The keywords of `CubicSpline`."""

    bc_type: BCType
    check: bool
    where: ArrayLike | None
    progress: Progress | None
    skipna: bool


class SmoothingSolver(TypedDict, total=False):
    """The keywords that all functions for smoothing splines have."""

    loss: Loss
    penalty: SmoothingPenalty
    sigma: Numbers | None
    noise: SmoothingNoise | tuple[SmoothingNoise, ...]
    bc_type: SmoothingBCType | None
    method: SmoothingMethod
    tol: float
    max_iter: int
    extrapolate: Extrapolate
    on_failure: OnFailure
    atol: float | None


class LsqOptions(SmoothingSolver, total=False):
    """The keywords of `make_lsq_spline`."""

    weights: Numbers | None
    frames: Numbers | None
    where: ArrayLike | None
    progress: Progress | None
    skipna: bool


class ChoiceOptions(LsqOptions, total=False):
    """The keywords of `make_smoothing_spline`."""

    knots: TimesLike | None
    criterion: Criterion
    gamma: float


class SmoothOptions(SmoothingSolver, total=False):
    """The keywords of `symspline.xarray.smooth` that it passes to `make_smoothing_spline`."""

    lam: Numbers | None
    knots: TimesLike | None
    criterion: Criterion
    gamma: float


class SmoothingOptions(ChoiceOptions, total=False):
    """The keywords of `make_smoothing_spline`, and λ."""

    lam: Numbers | None
