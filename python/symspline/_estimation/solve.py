"""The problem of an estimate, and its solution by the core."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .. import _core
from .._base.arrays import as_array, short_repr
from .._base.typing import Progress
from .._core import ValidationError
from .._smoothing.report import SmoothingReport
from .._spaces import Array, Doubles, Space
from ..measure import Constant
from .terms import Body, Term, Values, is_compact_group

# If the curve turns by more than this angle between two knots, the solution of the linear problem may differ from the
# minimum. The difference is then estimated from this number of samples.
_TURN, _SAMPLES = 0.9, 6
_FAILURES = {
    "undetermined": "The measurements do not determine the curve: no measurement depends on one of its factors, or on "
    "one of its knots. Pass fewer knots, a larger lam, or more measurements.",
    "infinite": "The linear problem has no finite solution: its numbers are too different in size. Check sigma and the "
    "units of the measurements, or pass fewer knots.",
    "no curve": "No spline joins the points of the next iteration. Pass more knots, or a larger lam.",
    "unconverged": "No convergence of the estimate: the last step is {step:.1e} standard deviations after {number} "
    "iterations (tol {tol:.1e}). Check sigma and the units, or pass lam or a better `start`.",
}


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

    @property
    def columns(self) -> dict[str, slice]:
        """Columns of the parameters by name, in the order of the core."""
        stops = np.cumsum([constant.size for constant in self.constants.values()]).tolist()
        sizes = {name: constant.size for name, constant in self.constants.items()}
        return {name: slice(stop - size, stop) for (name, size), stop in zip(sizes.items(), stops, strict=True)}

    @property
    def least_squares(self) -> bool:
        """Whether no loss is robust."""
        return all(term.loss == "linear" for term in self.terms)

    def state(self, points: list[Array], values: Values) -> tuple[list[Doubles], Doubles]:
        """Return points and values of parameters in the form of the core; missing values are those of the start."""
        doubles = [
            np.ascontiguousarray(space._as_doubles(rows)) for space, rows in zip(self.spaces, points, strict=True)
        ]
        each = [values.get(name, constant.start) for name, constant in self.constants.items()]
        return doubles, np.concatenate([np.empty(0), *each])

    def in_core(self) -> tuple[Any, ...]:
        """Return the problem in the form of the core."""
        columns, priors = self.columns, [np.empty((0, 2))]
        for constant in self.constants.values():
            precision = np.zeros(constant.size) if constant.sigma is None else constant.sigma**-2.0
            priors.append(np.stack([constant.start, precision], axis=-1))
        handles = [space._handle for space in self.spaces]
        groups = [
            np.ascontiguousarray(Body(space).inverse) if is_compact_group(space) else None for space in self.spaces
        ]
        terms = [term.in_core(columns) for term in self.terms]
        return handles, groups, self.knots, self.penalty, np.concatenate(priors), terms


class Rows(NamedTuple):
    """Whitened residuals of one term, and their derivatives.

    Attributes
    ----------
    residuals : ndarray, shape (n, d)
        What the sensors would read minus what they read, in standard deviations.
    jacobians : list of ndarray or None, shape (n, d, m)
        Derivatives with respect to the move of the curve, its velocity and its acceleration, in coordinates of the
        frames of all parts; None where they vanish.
    parameters : ndarray or None, shape (n, d, p)
        Derivatives with respect to all parameters.
    roots : ndarray or None, shape (n, 1)
        Roots of the weights of a robust loss.
    """

    residuals: Doubles
    jacobians: list[Doubles | None]
    parameters: Doubles | None
    roots: Doubles | None


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
    rows : list of Rows
        Residuals of each term.
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
    rows: list[Rows]
    variances: Doubles
    loss: float
    turn: float
    distance: float
    failure: str


def iterate(setup: Setup, points: list[Array], values: Values, progress: Progress | None) -> Solution:
    """Iterate from points at the knots until the step is small."""
    problem, (start, constants) = setup.in_core(), setup.state(points, values)
    lams, criterion, gamma = setup.lams.tolist(), setup.criterion, setup.gamma
    found = _core.estimate(problem, start, constants, lams, criterion, gamma, setup.tol, setup.max_iter, progress)
    if isinstance(found, np.ndarray):
        raise _undetermined(setup, found)
    failed, number, step = found["failure"], found["iterations"], found["step"]
    reports = [
        SmoothingReport("linearized", failed is None, number, step, found["rate"], lam, bound, df, found["sigma"])
        for lam, bound, df in zip(found["lams"], found["at_bound"], found["df"], strict=True)
    ]
    information, covariance = found["information"], np.full_like(found["information"], np.nan)
    if np.isfinite(information).all():
        covariance = np.asarray(np.linalg.pinv(information, hermitian=True), np.float64)
    distance = 0.0
    if failed is None and found["turn"] > _TURN:
        normal = np.random.default_rng(0).standard_normal((_SAMPLES, found["variances"].size))
        distance = _core.distance_from_minimum(
            problem, found["points"], found["values"], found["lams"], found["matrices"][0], normal
        )
    return Solution(
        [space._numbers(rows) for space, rows in zip(setup.spaces, found["points"], strict=True)],
        {name: found["values"][own] for name, own in setup.columns.items()},
        reports,
        found["matrices"],
        covariance,
        [Rows(*rows) for rows in found["terms"]],
        found["variances"],
        found["loss"],
        found["turn"],
        distance,
        "" if failed is None else _FAILURES[failed].format(step=step, number=number, tol=setup.tol),
    )


def residuals(setup: Setup, points: list[Array], values: Values) -> list[Doubles] | None:
    """Return the residuals of all terms for the spline through points at the knots; None if it does not exist."""
    found = _core.linearise(setup.in_core(), *setup.state(points, values), False)
    return None if found is None else [Rows(*rows).residuals for rows in found]


def _undetermined(setup: Setup, information: Doubles) -> ValidationError:
    """Return the error that names the parameters that the measurements do not determine."""
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    unit = np.where(size > 0, size, 1.0)
    vectors = np.linalg.eigh(information / unit / unit[:, None])[1]
    vector = vectors[:, 0] / unit if np.all(size > 0) else (size == 0).astype(float)
    vector = vector / vector[np.abs(vector).argmax()]
    parts = {name: vector[own] for name, own in setup.columns.items()}
    described = {name: np.round(own, 3).tolist() for name, own in parts.items() if np.abs(own).max() > 1e-3}
    return ValidationError(
        f"The measurements do not determine {' and '.join(map(repr, described))} in the direction {described}. Pass "
        "a Constant with sigma, which is a prior, or measurements that depend on it."
    )


def read_lams(value: Any, count: int) -> Doubles:
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
