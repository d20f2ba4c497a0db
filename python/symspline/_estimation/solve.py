"""The iteration of an estimate: linearise all measurements, solve the banded problem, move the curve."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import count
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._base.arrays import as_array, short_repr
from .._core import ValidationError
from .._curves.curve import CurveArrays
from .._curves.ends import end_kinds
from .._curves.fit import FitProblem, Points, fit, read_ends
from .._curves.solve import DEFAULTS
from .._smoothing.audit import corner_of
from .._smoothing.posterior import Posterior, frames_at
from .._smoothing.report import SmoothingReport
from .._spaces import Array, Doubles, Euclidean, Space
from .along import Motion
from .measurements import Constant
from .terms import Body, Linearised, Term, Values, is_compact_group

# λ has converged if its logarithm changes by less than the first number; after so many rounds it is kept.
_SETTLED, _ROUNDS = 3e-3, 12
# Steps of more standard deviations than this lead from a linearisation that is not yet informative about λ.
_NEAR = 3.0
# The number of times that a step is halved.
_RETREATS = 6
# Steps whose ratio to the one before is below this number alternate in direction and are shortened.
_BACK = -0.3
# The relative accuracy of the objective: a step changes it by less where the gradient is that of the linear problem.
_ROUNDING = 1e-5
# If the curve turns by more than this angle between two knots, the solution of the linear problem may differ from the
# minimum. The difference is then estimated from this number of samples, with steps of this fraction of a standard
# deviation.
_TURN, _SAMPLES, _SMALL = 0.9, 6, 0.05
# Parameters are not determined if the measurements leave less than this fraction of their information.
_SINGULAR = 1e-12


class Setup(NamedTuple):
    """The problem and the options of an estimate.

    Attributes
    ----------
    spaces : tuple of Space
        The parts of the space.
    knots : ndarray
        Knots in the units of the core.
    terms : list of Term
        Measurements.
    losses : list of str
        Loss of each term.
    constants : dict
        Parameters by name.
    penalty, criterion : str
        Options.
    gamma, tol : float
        Options.
    lams : ndarray
        Given λ of each part, NaN if it is to be chosen.
    max_iter : int
        Largest number of iterations.
    automatic : bool
        Whether the knots are still to be chosen.
    """

    spaces: tuple[Space, ...]
    knots: Doubles
    terms: list[Term]
    losses: list[str]
    constants: dict[str, Constant]
    penalty: str
    criterion: str
    gamma: float
    tol: float
    lams: Doubles
    max_iter: int
    automatic: bool = False

    @property
    def bc_type(self) -> str:
        """End conditions of the curves."""
        return "natural" if self.penalty == "acceleration" else "not-a-knot"


class Solution(NamedTuple):
    """The result of the iteration.

    Attributes
    ----------
    points : list of ndarray
        Points at the knots in every part.
    values : dict
        Parameters by name.
    reports : list of SmoothingReport
        Reports of all parts.
    matrices : list of ndarray
        Band, side and corner of the matrix of the linear problem.
    covariance : ndarray, shape (p, p)
        Covariance of the parameters for noise of variance one.
    linearised : list of Linearised
        Whitened residuals of each term, and their derivatives.
    roots : list of ndarray or None
        Roots of the weights of a robust loss.
    variances : ndarray, shape (knots, m)
        Variances of the coordinates at the knots for noise of variance one.
    loss : float
        Sum of the losses of all measurements and of the priors.
    turn : float
        Largest distance that the curve covers between two knots, in units of the radius of curvature of its space.
    distance : float
        Distance from the minimum in standard deviations; 0 if `turn` is so small that it is not computed.
    failure : str
        Description of a failure, or "".
    """

    points: list[Array]
    values: Values
    reports: list[SmoothingReport]
    matrices: list[Doubles]
    covariance: Doubles
    linearised: list[Linearised]
    roots: list[Doubles | None]
    variances: Doubles
    loss: float
    turn: float
    distance: float
    failure: str


class Linear(NamedTuple):
    """The solution of the linear problem at a curve, as the core returns it.

    Attributes
    ----------
    lams : ndarray
        λ of every part, and whether it is at a bound.
    at_bound : list of bool
        Whether λ is at a bound.
    step : ndarray, shape (knots, m)
        Move of the curve in the frames at the knots.
    changes : ndarray, shape (p,)
        Changes of the parameters.
    variances : list of ndarray
        Variances of the coordinates at the knots, and of the parameters.
    df : ndarray
        Degrees of freedom of every part per coordinate.
    freedom : float
        All degrees of freedom.
    information : ndarray, shape (p, p)
        Information about the parameters.
    determined : bool
        Whether the measurements determine the curve.
    squares, number : float, int
        Sum of squared residuals, and their number.
    matrices : list of ndarray
        Band, side and corner of the matrix.
    """

    lams: Doubles
    at_bound: list[bool]
    step: Doubles
    changes: Doubles
    variances: list[Doubles]
    df: Doubles
    freedom: float
    information: Doubles
    determined: bool
    squares: float
    number: int
    matrices: list[Doubles]


class Step(NamedTuple):
    """A step: where it begins, tangent vectors at the points in every part, and changes of the parameters."""

    points: list[Array]
    values: Values
    tangents: list[Array]
    changes: Doubles


class Choice:
    """The choice of λ during the iteration."""

    def __init__(self, lams: Doubles) -> None:
        self.lams, self.found = lams, np.full(len(lams), np.nan)
        self.settled, self._rounds = bool(np.isfinite(lams).all()), 0

    def asked(self, size: float) -> tuple[Doubles, Doubles]:
        """Return the λ that are fixed and those near which the others are chosen, after a step of a size."""
        nothing = np.full_like(self.lams, np.nan)
        if self.settled:
            return np.where(np.isnan(self.lams), self.found, self.lams), nothing
        # Far from the solution, λ is chosen from its whole range.
        return self.lams, self.found if size < _NEAR else nothing

    def update(self, lams: Doubles, size: float) -> None:
        """Record the λ that were chosen after a step of a size."""
        if self.settled:
            return
        self._rounds += size < _NEAR
        moved = np.abs(np.log(lams / self.found))[np.isnan(self.lams)]
        self.settled = (size < _NEAR and bool(np.all(moved < _SETTLED))) or self._rounds >= _ROUNDS
        # If λ oscillates, the mean is used.
        oscillates = self._rounds > _ROUNDS // 2 and not self.settled
        self.found = np.sqrt(lams * self.found) if oscillates else lams


class Relaxation:
    """Shorten steps while the iteration oscillates.

    The linear problem does not contain the interaction of a time offset with fast motion, so that steps may be twice as
    long as the distance to the solution. The factor is that of the secant through two steps.

    References
    ----------
    J. Barzilai, J. M. Borwein, Two-point step size gradient methods, IMA J. Numer. Anal. 8 (1988).
    """

    def __init__(self) -> None:
        self._last: Doubles | None = None
        self._factor = 1.0

    def factor(self, found: Linear) -> float:
        """Return the fraction of a step that is to be taken."""
        of_points, of_parameters = found.variances
        step = np.concatenate([(found.step / np.sqrt(of_points)).ravel(), found.changes / np.sqrt(of_parameters)])
        last, self._last = self._last, step
        square = 0.0 if last is None else float(last @ last)
        if last is None or not 0 < square < np.inf:
            return 1.0
        ratio = float(step @ last) / square
        shortened = self._factor < 1.0 or ratio < _BACK
        self._factor = float(np.clip(self._factor / (1 - ratio), 0.1, 1.0)) if shortened and ratio < 1 else 1.0
        return self._factor


def fitted(setup: Setup, points: list[Array]) -> list[CurveArrays] | None:
    """Return the splines through points in every part, or None if one of them does not exist."""
    curves: list[Any] = []
    for space, rows in zip(setup.spaces, points, strict=True):
        data = Points(np.ascontiguousarray(space._as_doubles(rows)), 0.0, (), len(setup.knots))
        ends = read_ends(setup.bc_type, space, ())
        found = fit(FitProblem(space, setup.knots, [data], ends, DEFAULTS, check=False))
        if any(fault.failed for fault in found.faults):
            return None
        curves.append(found.curve)
    return curves


class Iteration:
    """The iteration of one estimate."""

    def __init__(
        self,
        setup: Setup,
        points: list[Array],
        progress: Callable[[int, int], object] | None,
        values: Values | None = None,
    ) -> None:
        self.setup, self.points, self.progress = setup, points, progress
        self.values: Values = {name: np.array(own.start) for name, own in setup.constants.items()}
        self.values |= values or {}
        self.first = np.cumsum([0, *(space.dim for space in setup.spaces)]).tolist()
        self.curves: list[Any] = []

    def motion_at(self, x: Doubles, parts: list[int], nu: int) -> list[Motion]:
        """Return the motion of parts at times x, with derivatives up to the order `nu`."""
        knots = self.setup.knots
        outside = np.flatnonzero((x < knots[0]) | (x > knots[-1]))
        if len(outside):
            raise ValidationError(
                f"the time offset moves measurement {outside[0]} beyond the knots. Extend the knots beyond the "
                "measurements."
            )
        found = []
        for part in parts:
            curve, space = self.curves[part], self.setup.spaces[part]
            p = curve.evaluate(x, "point", "raise", False)
            empty = np.empty(0)
            v = curve.evaluate(x, "velocity", "raise", False) if nu > 0 else empty
            a = curve.evaluate(x, "acceleration", "raise", False) if nu > 1 else empty
            found.append(Motion(space, self.first[part], p, v, a, self._frames(part, x, p)))
        return found

    def _frames(self, part: int, x: Doubles, p: Array) -> Array:
        return frames_at(self.setup.spaces[part], self.setup.knots, self.points[part], x, p)

    def run(self) -> Solution:
        """Iterate until the step is small."""
        setup = self.setup
        choice = Choice(setup.lams)
        before: Step | None = None
        objective, retreats, last, rate, size = np.inf, 0, np.inf, np.nan, np.inf
        failure, relaxation = "", Relaxation()
        curves = fitted(setup, self.points)
        if curves is None:
            raise ValidationError("No spline joins the initial points. Pass more knots, or `start`.")
        for number in count(1):
            self.curves = curves
            linear = self._linearised()
            weights, loss = self._weighted(linear)
            found = self._solve(linear, weights, *choice.asked(size))
            energies = [energy(own, setup.penalty) for own in curves]
            value = loss + sum(float(lam) * own for lam, own in zip(found.lams, energies, strict=True))
            if self.progress is not None:
                self.progress(number, setup.max_iter)
            if not found.determined:
                failure = (
                    "The measurements do not determine the curve: no measurement depends on one of its factors, or on "
                    "one of its knots. Pass fewer knots, a larger lam, or more measurements."
                )
                break
            if np.isfinite(found.information).all():
                self._check_parameters(found.information)
            if not _is_finite(found):
                failure = (
                    "The linear problem has no finite solution: its numbers are too different in size. Check sigma and "
                    "the units of the measurements, or pass fewer knots."
                )
                break
            if choice.settled and before and value > objective * (1 + _ROUNDING) and retreats < _RETREATS:
                # The last step was too long.
                retreats += 1
                curves = self._moved(before, 0.5**retreats)
            else:
                retreats, objective = 0, value if choice.settled else np.inf
                choice.update(found.lams, size)
                size = _largest(found)
                longest = float(np.abs(found.step).max())
                rate, last = longest / last if 0 < last < np.inf else np.nan, longest
                if choice.settled and (size <= setup.tol or longest == 0.0):
                    break
                before = Step(self.points, self.values, self._tangents(found.step), found.changes)
                curves = self._moved(before, relaxation.factor(found))
            while curves is None and retreats < _RETREATS:
                retreats += 1
                curves = self._moved(before, 0.5**retreats)
            if curves is None:
                failure = "No spline joins the points of the next iteration. Pass more knots, or a larger lam."
                break
            if number >= setup.max_iter:
                failure = (
                    f"No convergence of the estimate: the last step is {size:.1e} standard deviations after {number} "
                    f"iterations (tol {setup.tol:.1e}). Check sigma and the units, or pass lam or a better `start`."
                )
                break
        left = found.number - found.freedom
        sigma = float(np.sqrt(found.squares / left)) if left > 1e-9 * found.number else float("nan")
        reports = [
            SmoothingReport("linearized", not failure, number, size, rate, float(lam), bool(bound), float(df), sigma)
            for lam, bound, df in zip(found.lams, found.at_bound, found.df, strict=True)
        ]
        covariance = np.full_like(found.information, np.nan)
        if np.isfinite(found.information).all():
            covariance = np.asarray(np.linalg.pinv(found.information, hermitian=True), np.float64)
        turn = max(_turn(space, curve) for space, curve in zip(setup.spaces, self.curves, strict=True))
        distance = self._distance(found) if turn > _TURN and not failure else 0.0
        return Solution(
            self.points,
            self.values,
            reports,
            found.matrices,
            covariance,
            linear,
            weights,
            found.variances[0],
            loss,
            turn,
            distance,
            failure,
        )

    def _objective(self, lams: Doubles) -> float:
        """Return the sum of all losses and of the penalties at the present curves."""
        _, value = self._weighted(self._linearised(derivatives=False))
        return value + sum(
            float(lam) * energy(own, self.setup.penalty) for lam, own in zip(lams, self.curves, strict=True)
        )

    def _distance(self, found: Linear) -> float:
        """Return the distance from the minimum of the objective in standard deviations, the Newton decrement.

        The linear problem moves the curve by splines in frames along it. Where the curve turns far between knots, these
        differ from the splines through the moved points, and the minima differ as well. With samples ξ of the posterior
        N(0, A⁻¹) and the gradient g, the squared decrement gᵀA⁻¹g is the mean of (gᵀξ)².
        """
        setup, points, curves = self.setup, self.points, self.curves
        band = found.matrices[0]
        m = band.shape[1] // 4
        posterior, kinds = Posterior.of(band, np.zeros((0, 0)), m), end_kinds(setup.bc_type)
        joint = Euclidean(m)
        moves = posterior.samples(joint, setup.knots, (), kinds, np.random.default_rng(0), _SAMPLES)
        slopes = []
        for move in moves.reshape(_SAMPLES, len(setup.knots), m):
            step = Step(
                points, self.values, self._tangents(move), np.zeros(sum(x.size for x in setup.constants.values()))
            )
            sides = []
            for size in (_SMALL, -_SMALL):
                moved = self._moved(step, size)
                if moved is not None:
                    self.curves = moved
                    sides.append(self._objective(found.lams))
                self.points, self.curves = points, curves
            if len(sides) == 2:
                slopes.append((sides[0] - sides[1]) / (4 * _SMALL))
        return float(np.sqrt(np.mean(np.square(slopes)))) if slopes else 0.0

    def _linearised(self, derivatives: bool = True) -> list[Linearised]:
        setup = self.setup
        spacing = float(setup.knots[-1] - setup.knots[0]) / (len(setup.knots) - 1)
        return [term.linearised(self.motion_at, self.values, spacing, derivatives) for term in setup.terms]

    def _weighted(self, linear: list[Linearised]) -> tuple[list[Doubles | None], float]:
        """Return the roots of the weights of a robust loss, and the sum of all losses."""
        weights: list[Doubles | None] = []
        value = 0.0
        for own, loss in zip(linear, self.setup.losses, strict=True):
            squares = np.sum(own.residuals**2, axis=1)
            if loss == "linear":
                weights.append(None)
                value += float(squares.sum())
                continue
            corner = corner_of(loss, own.residuals.shape[1])
            if loss == "huber":
                factor = np.minimum(1.0, np.sqrt(corner / np.maximum(squares, corner)))
                value += float(np.where(squares > corner, 2 * np.sqrt(corner * squares) - corner, squares).sum())
            else:
                factor = 1.0 / (1.0 + squares / corner)
                value += float(corner * np.log1p(squares / corner).sum())
            weights.append(np.sqrt(factor)[:, None])
        for name, constant in self.setup.constants.items():
            if constant.sigma is not None:
                value += float(np.sum(((self.values[name] - constant.start) / constant.sigma) ** 2))
        return weights, value

    def _solve(self, linear: list[Linearised], weights: list[Any], given: Doubles, near: Doubles) -> Linear:
        setup = self.setup
        factors, priors, terms = [], [], []
        for part, (space, curve) in enumerate(zip(setup.spaces, self.curves, strict=True)):
            speeds, accelerations = bending(curve)
            factors.append((space._handle, speeds, accelerations, self._half_brackets(part)))
        for name, constant in setup.constants.items():
            off = self.values[name] - np.asarray(constant.start)
            precision = np.zeros(constant.size) if constant.sigma is None else np.asarray(constant.sigma) ** -2.0
            priors.append(np.stack([precision, off], axis=-1))
        for term, own, weight in zip(setup.terms, linear, weights, strict=True):
            residuals, shape = own.residuals, own.residuals.shape
            jacobians = [in_columns(setup.spaces, x, shape) if x else None for x in own.jacobians]
            parameters = parameter_columns(setup, own) if own.parameters else None
            if weight is not None:
                residuals = residuals * weight
                jacobians = [None if x is None else np.ascontiguousarray(x * weight[..., None]) for x in jacobians]
                parameters = None if parameters is None else np.ascontiguousarray(parameters * weight[..., None])
            terms.append((term.shifted_times(self.values), np.ascontiguousarray(residuals), jacobians, parameters))
        flat = np.ascontiguousarray(np.concatenate(priors)) if priors else np.empty((0, 2))
        found = _core.estimate(
            setup.knots, setup.penalty, factors, flat, terms, given, near, setup.criterion, setup.gamma
        )
        return Linear(*found)

    def _half_brackets(self, part: int) -> Doubles | None:
        """Return half the brackets of the frame vectors on compact groups; they are the same at all knots."""
        space, knots, points = self.setup.spaces[part], self.setup.knots[:1], self.points[part]
        if not is_compact_group(space):
            return None
        return Body(space).half_brackets(points[0], self._frames(part, knots, points[:1])[0])

    def _check_parameters(self, information: Doubles) -> None:
        """Raise ValidationError if the measurements do not determine the parameters."""
        if not len(information):
            return
        size = np.sqrt(np.maximum(np.diag(information), 0.0))
        scaled = information / np.where(size > 0, size, 1.0) / np.where(size > 0, size, 1.0)[:, None]
        values, vectors = np.linalg.eigh(scaled)
        if values[0] > _SINGULAR and np.all(size > 0):
            return
        vector = vectors[:, 0] / np.where(size > 0, size, 1.0) if np.all(size > 0) else (size == 0).astype(float)
        vector = vector / vector[np.abs(vector).argmax()]
        names = [name for name, own in self.setup.constants.items() for _ in range(own.size)]
        involved = list(dict.fromkeys(name for name, x in zip(names, vector, strict=True) if abs(x) > 1e-3))
        described = {
            name: [round(float(x), 3) for own, x in zip(names, vector, strict=True) if own == name] for name in involved
        }
        raise ValidationError(
            f"The measurements do not determine {' and '.join(map(repr, involved))} in the direction {described}. Pass "
            "a Constant with sigma, which is a prior, or measurements that depend on it."
        )

    def _tangents(self, step: Doubles) -> list[Array]:
        """Return the step at the knots as tangent vectors in every part."""
        found: list[Array] = []
        for i in range(len(self.setup.spaces)):
            frames = self._frames(i, self.setup.knots, self.points[i])
            own = step[:, self.first[i] : self.first[i + 1]]
            found.append(np.einsum("ij,ij...->i...", own, frames))
        return found

    def _moved(self, step: Step, factor: float) -> list[CurveArrays] | None:
        """Move points and parameters by a part of a step, and return the new curves if there are any."""
        self.points = [
            np.asarray(space.project(space._apply("exp", p=p, v=factor * v)))
            for space, p, v in zip(self.setup.spaces, step.points, step.tangents, strict=True)
        ]
        found, first = {}, 0
        for name, constant in self.setup.constants.items():
            found[name] = step.values[name] + factor * step.changes[first : first + constant.size]
            first += constant.size
        self.values = found
        return fitted(self.setup, self.points)


def bending(curve: CurveArrays) -> list[Doubles]:
    """Return velocities and accelerations at the knots in frames along the curve, in units of their mean distance."""
    space = curve.space
    points, velocities = (np.ascontiguousarray(space._as_doubles(x)) for x in (curve.points, curve.velocities))
    return _core.bending(space._handle, curve.times, points, velocities)


def in_columns(spaces: Sequence[Space], by_part: dict[int, Doubles], shape: tuple[int, ...]) -> Doubles:
    """Return derivatives with respect to the coordinates of all parts from those by part, zero for other parts."""
    first = np.cumsum([0, *(space.dim for space in spaces)])
    out = np.zeros((*shape, first[-1]))
    for part, own in by_part.items():
        out[..., first[part] : first[part + 1]] = own
    return out


def parameter_columns(setup: Setup, own: Linearised) -> Doubles:
    """Return derivatives with respect to all parameters, zero for those on which a measurement does not depend."""
    shape = own.residuals.shape
    columns = [own.parameters.get(name, np.zeros((*shape, x.size))) for name, x in setup.constants.items()]
    return np.ascontiguousarray(np.concatenate([np.zeros((*shape, 0)), *columns], axis=-1))


def energy(curve: CurveArrays, penalty: str) -> float:
    """Return the integral of the squared acceleration or jerk, by two points per segment or from the knots."""
    knots = curve.times
    h = np.diff(knots)
    if penalty == "jerk":
        spacing = (knots[-1] - knots[0]) / len(h)
        accelerations = bending(curve)[1] / spacing**2
        return float(np.sum(np.diff(accelerations, axis=0) ** 2 / h[:, None]))
    root = 0.5 / np.sqrt(3.0)
    x = (knots[:-1, None] + h[:, None] * np.array([0.5 - root, 0.5 + root])).ravel()
    squares = curve.evaluate(x, "bend", "raise", False) ** 2
    return float(np.sum(np.repeat(h / 2, 2) * squares))


def _is_finite(found: Linear) -> bool:
    numbers = (found.step, found.changes, found.information, *found.variances)
    return all(bool(np.isfinite(own).all()) for own in numbers)


def _turn(space: Space, curve: CurveArrays) -> float:
    """Return the largest distance that a curve covers between two knots, in units of the radius of curvature.

    Spaces without curvature have none.
    """
    if space.curvature == 0 or not np.isfinite(space.injectivity_radius):
        return 0.0
    speeds = np.linalg.norm(bending(curve)[0], axis=1) * len(curve.times[1:]) / np.ptp(curve.times)
    steps = np.diff(curve.times)
    return float(np.max(np.maximum(speeds[1:], speeds[:-1]) * steps)) * np.pi / space.injectivity_radius


def _largest(found: Linear) -> float:
    """Return the largest step in standard deviations of the points and parameters."""
    of_points, of_parameters = found.variances
    lengths = np.linalg.norm(found.step, axis=1) / np.sqrt(of_points.sum(axis=1))
    return float(np.max(np.concatenate([lengths, np.abs(found.changes) / np.sqrt(of_parameters)])))


def read_lams(value: Any, count: int) -> NDArray[np.float64]:
    """Return λ of each part; NaN if it is to be chosen."""
    values = value if isinstance(value, tuple) else (value,) * count
    if len(values) != count:
        raise ValidationError(f"lam has {len(values)} entries, but there are {count} parts. Pass one entry per part.")
    found = np.full(count, np.nan)
    for i, own in enumerate(values):
        if own is None:
            continue
        array = as_array(own, "lam")
        if array.ndim or array.dtype.kind not in "iuf" or not (np.isfinite(array) and array >= 0):
            raise ValidationError(f"lam must be a number >= 0, or a tuple with one per part, not {short_repr(own)}")
        found[i] = float(array)
    return found
