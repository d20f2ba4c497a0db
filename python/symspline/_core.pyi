"""The compiled core. Its arrays are contiguous doubles; complex numbers are pairs of them."""

from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ._base.exceptions import ConvergenceError as ConvergenceError
from ._base.exceptions import CutLocusError as CutLocusError
from ._base.exceptions import ValidationError as ValidationError

_Doubles = NDArray[np.float64]
_Progress = Callable[[int, int], object]

@final
class Handle:
    def __new__(cls, name: str, parameters: Sequence[int]) -> Handle: ...
    def name(self) -> tuple[str, list[int]]: ...
    @staticmethod
    def names() -> list[list[str]]: ...
    def point_shape(self) -> list[int]: ...
    def is_complex(self) -> bool: ...
    def fibre(self) -> int: ...
    def dim(self) -> int: ...
    def injectivity_radius(self) -> float: ...
    def curvature(self) -> float: ...
    def apply(self, operation: str, inputs: Sequence[_Doubles], t: _Doubles | None = None) -> _Doubles: ...
    def check_points(self, points: _Doubles, shape: Sequence[int], tol: float, name: str | None = None) -> None: ...
    def tangent_defects(self, points: _Doubles, vectors: _Doubles) -> _Doubles: ...

# Space, knots, points, velocities, and velocities before the knots if they differ.
_FactorOfCurve = tuple[Handle, _Doubles, _Doubles, _Doubles, _Doubles | None]

@final
class Curve:
    def __new__(cls, factors: Sequence[_FactorOfCurve]) -> Curve: ...
    @property
    def batch(self) -> tuple[int, ...]: ...
    def evaluate(
        self,
        x: _Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        progress: _Progress | None = None,
        out: Sequence[_Doubles] | None = None,
    ) -> Any: ...
    def lift(
        self,
        x: _Doubles,
        quantity: str,
        outside: str,
        per_curve: bool,
        start: Sequence[_Doubles | None],
        progress: _Progress | None = None,
    ) -> Any: ...
    def transport(self, times: tuple[float, float], outside: str, vectors: Sequence[_Doubles]) -> list[_Doubles]: ...
    def closest(
        self,
        times: _Doubles,
        lengths: _Doubles,
        samples: Sequence[_Doubles],
        targets: Sequence[_Doubles],
        curve: NDArray[np.int64],
    ) -> tuple[_Doubles, _Doubles]: ...

# A curve of the core, or the norm of a derivative at times of shape (curves, m).
_Norm = Curve | Callable[[_Doubles], _Doubles]

@final
class ArcLength:
    def __new__(cls, knots: _Doubles, speed: _Norm, rtol: float) -> ArcLength: ...
    @property
    def times(self) -> _Doubles: ...
    @property
    def lengths(self) -> _Doubles: ...
    def at(self, x: _Doubles) -> _Doubles: ...
    def between(self, a: _Doubles, b: _Doubles) -> _Doubles: ...
    def times_at(self, s: _Doubles) -> _Doubles: ...

# Gauss points in [0, 1], and the matrices of the integrals to them and to the outputs.
_CubicRule = tuple[_Doubles, _Doubles, _Doubles]

@final
class CurvatureTensor:
    def __new__(cls, handle: Handle) -> CurvatureTensor: ...
    def shoot(self, rule: _CubicRule, steps: int, p: _Doubles, q: _Doubles, start: _Doubles) -> _Doubles: ...
    def points(self, rule: _CubicRule, steps: int, p: _Doubles, start: _Doubles) -> _Doubles: ...

def integrals(knots: _Doubles, norm: _Norm, quantity: str, rtol: float) -> _Doubles: ...

_Ends = Sequence[tuple[str, _Doubles | None]] | None
# Curve, kind, node, value, limit, and what is wrong with a point.
_Fault = tuple[int, str, int | None, float, float, str | None]

def fit(
    factors: Sequence[tuple[Handle, _Doubles, _Ends, float | None, list[tuple[int, _Doubles]] | None, float | None]],
    t: _Doubles,
    method: str,
    tol: float,
    max_iter: int | None,
    offsets: Sequence[int] | None = None,
    mask: Sequence[bool] | None = None,
    skip_invalid: bool = False,
    progress: _Progress | None = None,
) -> list[tuple[_Doubles, _Doubles, tuple[NDArray[np.int64], _Doubles], list[_Fault]]]: ...
def validate(
    handle: Handle,
    t: _Doubles,
    points: _Doubles,
    ends: _Ends,
    point_tol: float,
    offsets: Sequence[int] | None = None,
    mask: Sequence[bool] | None = None,
    skip_invalid: bool = False,
) -> tuple[_Doubles, list[_Fault]]: ...
def closest(
    times: _Doubles,
    lengths: _Doubles,
    curve: NDArray[np.int64],
    of_samples: Callable[[NDArray[np.int64], NDArray[np.int64]], _Doubles],
    at: Callable[[NDArray[np.int64], _Doubles], tuple[_Doubles, _Doubles]],
) -> tuple[_Doubles, _Doubles]: ...
def roots(
    f: Callable[[NDArray[np.int64], _Doubles], _Doubles],
    ends: tuple[_Doubles, _Doubles],
    values: tuple[_Doubles, _Doubles],
    guess: _Doubles,
) -> _Doubles: ...
def time_law(
    h: _Doubles, most: _Doubles, forms: Sequence[_Doubles], limits: _Doubles, start: float | None
) -> tuple[float, _Doubles]: ...
def stiefel(k: int, n: int, operation: str, inputs: Sequence[_Doubles]) -> _Doubles: ...
def convert_rotations(rotations: _Doubles, form: str, wanted: str, tol: float) -> tuple[_Doubles, bool]: ...
def quaternion_products(quaternions: _Doubles) -> _Doubles: ...
def number_lines(rows: _Doubles, separator: str) -> str: ...
def solve_tridiagonal(matrix: _Doubles, right: _Doubles) -> _Doubles: ...
def hermite(
    handle: Handle, t: _Doubles, points: _Doubles, velocities: _Doubles, point_tol: float, tangent_tol: float
) -> list[_Doubles]: ...
def evaluate_bspline(
    handle: Handle,
    knots: _Doubles,
    control: _Doubles,
    degree: int,
    x: _Doubles,
    quantity: str,
    steps: _Doubles | None = None,
) -> _Doubles: ...
def cumulative_steps(handle: Handle, control: _Doubles) -> _Doubles: ...
def fit_cumulative(
    handle: Handle,
    knots: _Doubles,
    degree: int,
    t: _Doubles,
    points: _Doubles,
    weights: _Doubles,
    tol: float,
    max_iter: int,
) -> tuple[_Doubles, list[bool], list[int], list[float], list[float]]: ...
def push(handle: Handle, curves: object, points: _Doubles, knots: _Doubles, ends: list[_Doubles]) -> _Doubles: ...
def pull(handle: Handle, curves: object, cotangent: _Doubles) -> tuple[_Doubles, _Doubles, _Doubles, _Doubles]: ...

# Space, points, weights, information matrices, λ, σ, ends, initial points at the knots, λ of the segments divided by λ,
# and whether λ and σ vary.
_Smoothable = tuple[
    Handle,
    _Doubles,
    _Doubles,
    _Doubles | None,
    _Doubles,
    _Doubles,
    _Ends,
    _Doubles | None,
    _Doubles | None,
    tuple[bool, bool],
]
# Points, bands, columns of the report, systems, and λ, ln σ² and gains if they vary.
_SmoothResult = tuple[
    _Doubles, _Doubles, tuple[NDArray[Any], ...], tuple[_Doubles, _Doubles, int], list[_Doubles] | None
]

def smooth(
    factors: Sequence[_Smoothable],
    t: _Doubles,
    knots: _Doubles,
    criterion: str,
    gamma: float,
    penalty: str,
    loss: str,
    method: str,
    tol: float,
    max_iter: int,
    raise_lam: bool,
    progress: _Progress | None,
) -> list[_SmoothResult]: ...
def smoothing_variance(
    knots: _Doubles,
    band: _Doubles,
    lam: _Doubles,
    profile: _Doubles | None,
    x: _Doubles,
    nu: int,
    kinds: Sequence[str] | None,
) -> _Doubles: ...
def smoothing_inverse(
    knots: _Doubles,
    times: _Doubles,
    weights: _Doubles,
    lam: float,
    profile: _Doubles | None,
    penalty: str,
    kinds: Sequence[str] | None,
) -> _Doubles: ...
def process_variance(
    times: _Doubles,
    weights: _Doubles,
    lam: float,
    profile: list[_Doubles] | None,
    period: float | None,
    x: _Doubles,
    nu: int,
) -> _Doubles: ...
def residuals_at(
    handle: Handle, times: _Doubles, at: _Doubles, points: _Doubles, weights: _Doubles
) -> list[_Doubles]: ...

# The fields of a `Finding`.
_Finding = tuple[float, float, float, bool, bool, bool, int | None, list[int], float, float, list[int] | None]

def examine(rows: _Doubles, leverage: float, between: float, corner: float | None, exact: bool) -> _Finding: ...
def examine_curves(
    handle: Handle,
    data: Sequence[_Doubles],
    rows: _Doubles,
    neighbours: _Doubles,
    leverages: _Doubles,
    sigmas: _Doubles,
    corner: float | None,
) -> list[
    tuple[
        int,
        list[int] | None,
        _Finding | None,
        tuple[float, float, tuple[int, int, float], list[int] | None] | None,
    ]
]: ...
def are_constant(
    times: _Doubles,
    weights: _Doubles,
    leverages: _Doubles,
    squares: _Doubles,
    knots: _Doubles,
    energy: _Doubles,
    m: int,
) -> list[list[tuple[float, list[int], float]] | None]: ...
def usual_turns(handle: Handle, points: _Doubles) -> tuple[_Doubles, list[bool]]: ...
def frames_along(handle: Handle, knots: _Doubles, points: _Doubles, x: _Doubles, gammas: _Doubles) -> _Doubles: ...

# The sensor, parts, times, standard deviations, loss, column of the time offset, arrays, columns of the parameters with
# their numbers, and the function with its highest derivative and the function that returns its derivatives.
_Term = tuple[Any, ...]
# Parts of the space, matrices of groups, knots, penalty, means and precisions of the parameters, and terms.
_Problem = tuple[
    Sequence[Handle],
    Sequence[_Doubles | None],
    _Doubles,
    str,
    _Doubles,
    Sequence[_Term],
    Sequence[_Doubles | None],
]
# Whitened residuals, their derivatives by the motion and by the parameters, and the roots of robust weights.
_TermRows = tuple[_Doubles, list[_Doubles | None], _Doubles | None, _Doubles | None]

def estimate(
    problem: _Problem,
    points: Sequence[_Doubles],
    values: _Doubles,
    lams: Sequence[float],
    near: Sequence[float],
    criterion: str,
    gamma: float,
    tol: float,
    max_iter: int,
    progress: _Progress | None = None,
) -> dict[str, Any] | _Doubles: ...
def linearise(
    problem: _Problem, points: Sequence[_Doubles], values: _Doubles, derivatives: bool
) -> list[_TermRows] | None: ...
def varying_lams(
    problem: _Problem, points: list[_Doubles], values: _Doubles, lams: list[float], parts: list[int]
) -> list[tuple[float, _Doubles | None]]: ...
def distance_from_minimum(
    problem: _Problem,
    points: Sequence[_Doubles],
    values: _Doubles,
    lams: Sequence[float],
    band: _Doubles,
    normal: _Doubles,
) -> float: ...

# Band, side and corner of A, the number of coupled coordinates, the kinds of the ends, and the holonomy.
_Known = tuple[Sequence[_Doubles], int, Sequence[str] | None, _Doubles]

def posterior_covariance(
    knots: _Doubles, known: _Known, x: _Doubles, y: _Doubles | None, orders: Sequence[int]
) -> _Doubles: ...
def coefficient_factors(
    knots: _Doubles, kinds: Sequence[str] | None, x: _Doubles, nu: int
) -> tuple[NDArray[np.int64], _Doubles]: ...

# First coefficients, and factors of coefficients and of parameters.
_Rows = tuple[NDArray[np.int64], _Doubles, _Doubles]

def predictions_without(
    knots: _Doubles,
    known: _Known,
    data: _Rows,
    residuals: _Doubles,
    probes: _Rows,
    omitted: NDArray[np.int64],
    blocks: Sequence[Sequence[int]],
) -> tuple[_Doubles, _Doubles]: ...

# Times, first coefficients, factors of coefficients and parameters, residuals and errors, which data count, weights and
# numbers of observed coordinates, and the number of coordinates.
_Linearised = tuple[
    _Doubles,
    NDArray[np.int64],
    Sequence[_Doubles],
    Sequence[_Doubles],
    NDArray[np.bool_],
    Sequence[_Doubles],
    int,
]

def gap_factors(
    knots: _Doubles,
    known: _Known,
    evidence: _Linearised,
    gaps: Sequence[Sequence[float]],
    width: float,
    at_data: float,
    period: float | None,
    changes: tuple[_Doubles, _Doubles, str] | None,
) -> list[tuple[float, int]]: ...
def end_factors(
    knots: _Doubles,
    known: _Known,
    evidence: _Linearised,
    course: tuple[Sequence[_Doubles], int, float, float],
    usual: float,
) -> tuple[list[list[float]], int]: ...
def chi_squared_ratio(m: int, n: int, probability: float) -> float: ...
def posterior_freedom(knots: _Doubles, known: _Known) -> int: ...
def posterior_samples(knots: _Doubles, known: _Known, normal: _Doubles) -> _Doubles: ...
def chi_squared(m: int, probability: float) -> float: ...
def set_num_threads(n: int) -> None: ...
def num_threads() -> int: ...

# Knots, conditions at both ends or None for a periodic axis, and the extrapolation policy.
_GridAxis = tuple[_Doubles, Sequence[str] | None, str]
# Failed rows; axis, kind, node, value, limit and residual of the first; the largest residual, step and iterations.
_GridFound = tuple[int, tuple[int, str, int | None, float, float, float] | None, float, float, int]

def grid_rows(
    handle: Handle, axis: _GridAxis, rows: _Doubles, progress: _Progress | None
) -> tuple[_Doubles, _GridFound]: ...
def grid_product(
    handle: Handle,
    arrays: object,
    x: Sequence[_Doubles],
    along: int | None,
    last: int,
    progress: _Progress | None = None,
) -> tuple[_Doubles, _Doubles | None, _GridFound]: ...
def grid_scattered(
    handle: Handle, arrays: object, x: _Doubles, along: int | None, last: int, progress: _Progress | None = None
) -> tuple[_Doubles, _Doubles | None, _GridFound]: ...
def grid_midpoint(
    handle: Handle, points: tuple[_Doubles, _Doubles], vectors: Sequence[_Doubles] | None
) -> tuple[_Doubles, _Doubles | None]: ...
