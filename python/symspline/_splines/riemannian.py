"""Riemannian cubics, the curves of least bending energy through the points of a spline."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, cast

import numpy as np

from .._base.arrays import checked_number, short_repr, whole_number
from .._base.faults import warn
from .._base.report import ConvergenceWarning
from .._base.typing import Number, P
from .._core import ValidationError
from .._curves import riemannian
from .._curves.ends import end_kinds, is_closed
from .._curves.failures import raise_or_warn
from .._curves.fit import Problem, fit, read, read_ends
from .._curves.solve import DEFAULTS
from .._spaces import AnySpace, cover_of, factors_of
from ..manifolds import Manifold
from .cubic import CubicSpline

# Largest dimension of a factor: the curvature tensor has the fourth power of it as its number of entries.
_MOST = 48
# Relative errors of the energy of a spline, which is computed by quadrature.
_ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class RiemannianCubic(Generic[P]):
    """The result of `riemannian_cubic`.

    For a batch, all attributes except `curve` and `iterations` are arrays with the shape of the batch axes.

    Attributes
    ----------
    curve : CubicSpline
        The Riemannian cubic, as a C² spline through points of it at equal steps in every segment.
    energy : float
        Bending energy of the Riemannian cubic.
    distance : float
        Largest distance between the Riemannian cubic and the spline at the knots of `curve`.
    converged : bool
        Whether Newton's method converged.
    is_minimum : bool
        Whether the second variation of the energy is positive definite, so that the curve is a strict local minimum.
    iterations : int
        Number of iterations of Newton's method.

    See Also
    --------
    riemannian_cubic : Compute Riemannian cubics.

    Examples
    --------
    >>> import symspline as ss
    >>> found = ss.riemannian_cubic(ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1"))
    >>> bool(found.converged), bool(found.is_minimum), round(float(found.energy), 8)
    (True, True, 6.0)
    """

    curve: CubicSpline[P]
    energy: Number
    distance: Number
    converged: Any
    is_minimum: Any
    iterations: int


def riemannian_cubic(
    spline: CubicSpline[P], *, refinement: int = 8, tol: float = 1e-7, max_iter: int = 50
) -> RiemannianCubic[P]:
    r"""Compute the curve of least bending energy through the points of a spline.

    Riemannian cubics minimise :math:`\int \lVert\nabla\gamma'\rVert^2 \, dt` among the curves that pass through the
    points at their times. They are C² as the spline is, but computing them takes longer. The result is a local minimum
    near the spline.

    Parameters
    ----------
    spline : CubicSpline
        A spline, or a batch of splines, on a Riemannian symmetric space. Its ends must be natural, clamped, periodic,
        or have given velocities. The minimum is taken over all curves with the same velocities at ends that are
        clamped or have given velocities. Natural ends are free.
    refinement : int, default 8
        Smallest number of segments of the resulting curve per segment of the spline.
    tol : float, default 1e-7
        Newton's method ends after a step that changes the velocities by less than this part of the largest velocity.
        The remaining error is about the square of it.
    max_iter : int, default 50
        Largest number of iterations of Newton's method.

    Returns
    -------
    RiemannianCubic
        The curve, its bending energy, and its distance from the spline.

    Raises
    ------
    ValidationError
        If `spline` is not a `CubicSpline`, has no curves, did not converge, has other end conditions, or has velocities
        that are prescribed at inner points. Also if the space does not have an invariant Riemannian metric or its
        dimension exceeds 48.
    ConvergenceError
        If points are so far apart that Newton's method cannot start from the spline.

    Warns
    -----
    ConvergenceWarning
        If Newton's method does not converge, or converges to a curve that is not a local minimum, or that has a larger
        bending energy than the spline.

    See Also
    --------
    CubicSpline : Interpolate points by a C² cubic spline.
    Curve.bending_energy : Compute the bending energy of a curve.

    Notes
    -----
    Between the points, a minimiser satisfies

    .. math:: \nabla^3\gamma' + R(\nabla\gamma', \gamma')\gamma' = 0,

    and :math:`\nabla\gamma'` is continuous at the points and zero at natural ends [1]_ [2]_. For the existence of
    minimisers see [3]_ and [4]_. Several local minima may exist if points are far apart. In a frame that is parallel
    along the curve, the equation is an ordinary differential equation with constant coefficients. It is solved by
    collocation at Gauss points. Newton's method starts from the spline. Each of its steps solves a block tridiagonal
    system for the velocities at the points, so that the time is linear in the number of points.

    `RiemannianCubic.energy` is computed from the solution of the differential equation, with a relative error of about
    1e-12. `RiemannianCubic.curve` is a spline through points of the solution. Its distance from the exact curve
    decreases with the fourth power of `refinement`, as the distance between a spline and a Riemannian cubic does. With
    the default, it is about 1/4000 of `RiemannianCubic.distance`, and less if points are far apart.

    The second variation is positive definite if the matrix of the linear system is, and if no segment has a conjugate
    point. The latter is tested at the ends of the steps of the integration.

    References
    ----------
    .. [1] L. Noakes, G. Heinzinger, B. Paden, Cubic Splines on Curved Spaces, IMA J. Math. Control Inform. 6 (1989).
    .. [2] P. Crouch, F. Silva Leite, The Dynamic Interpolation Problem: On Riemannian Manifolds, Lie Groups, and
           Symmetric Spaces, J. Dyn. Control Syst. 1 (1995).
    .. [3] D. Corona, R. Giambò, P. Piccione, arXiv:2407.18408 (2024).
    .. [4] B. Heeren, M. Rumpf, B. Wirth, Variational Time Discretization of Riemannian Splines, IMA J. Numer. Anal. 39
           (2019).

    Examples
    --------
    >>> import symspline as ss
    >>> points = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> spline = ss.CubicSpline([0, 1, 3], points, "sphere:2")
    >>> found = ss.riemannian_cubic(spline)
    >>> bool(found.energy < spline.bending_energy()), bool(found.is_minimum)
    (True, True)
    >>> found.curve(1.0).round(12) + 0.0
    array([0., 1., 0.])
    """
    fixed, closed = _checked_ends(spline)
    refinement = whole_number(refinement, "refinement", 1)
    max_iter = whole_number(max_iter, "max_iter", 1)
    tol = checked_number(tol, "tol must be a positive number", lambda x: x > 0)
    curve, batch = spline._curve, spline._batch
    times = curve.times
    h = np.broadcast_to(np.diff(times), (*batch, times.shape[-1] - 1))
    h = h.reshape(-1, h.shape[-1])
    starts = [
        _start(cover_of(factor), part, h, fixed, closed)
        for factor, part in zip(factors_of(spline.space), curve.parts, strict=True)
    ]
    steps = max(map(riemannian.steps_of, starts))
    outputs = -(-refinement // steps)
    solutions = [riemannian.solve(start, steps, outputs, tol, max_iter) for start in starts]

    count = steps * outputs
    fine = np.repeat(times[..., :-1], count, axis=-1)
    fine += np.repeat(np.diff(times), count, axis=-1) * np.tile(np.arange(count) / count, times.shape[-1] - 1)
    fine = np.concatenate([fine, times[..., -1:]], axis=-1)
    arrays = [found.points.reshape(*batch, -1, *found.points.shape[2:]) for found in solutions]
    points = curve._joined(arrays)
    ends = read_ends(spline._bc_type, spline.space, batch)
    problem = Problem(spline.space, fine, read(points, spline.space), ends, DEFAULTS)
    solution = fit(problem)
    axis = spline._time_axis
    result: CubicSpline[P] = CubicSpline._fitted(
        axis, axis.shown(fine, batch), solution.curve, spline._bc_type, spline._extrapolate, solution
    )
    if solution.faults:
        raise_or_warn(solution.faults, "raise", result)
    there = curve.evaluate(fine, "point", "continue", fine.ndim > 1)
    distances = np.asarray(spline.space.distance(points, there))
    converged = np.all([found.converged for found in solutions], axis=0).reshape(batch)
    minimum = np.all([found.minimum for found in solutions], axis=0).reshape(batch)
    energy = np.sum([found.energy for found in solutions], axis=0).reshape(batch)
    higher = energy > (1 + _ROUNDING) * np.asarray(spline.bending_energy())
    _warn(converged, minimum, higher)
    return RiemannianCubic(
        result,
        energy[()],
        distances.max(axis=-1)[()],
        converged[()],
        minimum[()],
        max(found.iterations for found in solutions),
    )


def _warn(converged: Any, minimum: Any, higher: Any) -> None:
    for failed, problem in (
        (~converged, "Newton's method did not converge to a Riemannian cubic"),
        (converged & ~minimum, "the bending energy has no local minimum at the Riemannian cubic that was found"),
        (
            converged & minimum & higher,
            "the Riemannian cubic that was found has a larger bending energy than the spline",
        ),
    ):
        if failed.any():
            which = f" for {np.sum(failed)} of {failed.size} curves" if failed.ndim else ""
            warn(f"{problem}{which}. Add points where they are far apart.", ConvergenceWarning)


def _checked_ends(spline: Any) -> tuple[tuple[bool, bool], bool]:
    """Return whether the velocities at the two ends are given, and whether the curve is closed.

    Raises
    ------
    ValidationError
        If there is no Riemannian cubic for the spline, or it cannot be computed.
    """
    if not isinstance(spline, CubicSpline):
        raise ValidationError(f"spline must be a CubicSpline, not {short_repr(spline)}")
    if 0 in spline._batch:
        raise ValidationError(f"spline is an empty batch of shape {spline._batch}. Pass at least one curve.")
    for factor in factors_of(spline.space):
        if isinstance(factor, Manifold) or not np.isfinite(factor.curvature):
            raise ValidationError(
                f"Riemannian cubics need a Riemannian symmetric space, but {factor!r} has no invariant metric that is "
                "positive definite, or is not symmetric. Use a product such as 'so:3 x r:3' for poses."
            )
        if factor.dim > _MOST:
            raise ValidationError(
                f"Riemannian cubics are available up to dimension {_MOST}, but {factor!r} has dimension {factor.dim}"
            )
    if spline._c1_nodes:
        raise ValidationError(
            f"spline has prescribed velocities at the inner points {spline._c1_nodes}. Compute the Riemannian cubics "
            "between these points separately, with their velocities in bc_type."
        )
    if spline._unconverged or not all(np.isfinite(part.velocities).all() for part in spline._curve.parts):
        raise ValidationError("spline did not converge, or is NaN for a curve of the batch. Pass converged splines.")
    if is_closed(spline._bc_type):
        return (False, False), True
    kinds = end_kinds(spline._bc_type)
    for kind, end in zip(kinds or (), ("first", "last"), strict=True):
        if kind not in ("natural", "velocity"):
            raise ValidationError(
                f"the {end} end of spline is {kind!r}, but the bending energy has a minimum only for natural, clamped "
                "or periodic ends and for given velocities. Fit the spline with one of these values of bc_type."
            )
    first, last = (kind == "velocity" for kind in cast("list[str]", kinds))
    return (first, last), False


def _start(space: AnySpace, part: Any, h: Any, fixed: tuple[bool, bool], closed: bool) -> riemannian.Start:
    """Return the spline in one factor as the start of Newton's method."""
    times = part.times
    per_curve = times.ndim > 1
    at, accelerations = (part.evaluate(times, name, "continue", per_curve) for name in ("point", "acceleration"))
    # Accelerations are tangent at representatives that may differ from those of the points.
    accelerations = np.asarray(space.transport(at, part.points, accelerations))
    nodes, shape = times.shape[-1], space.point_shape
    points, velocities, accelerations = (
        np.reshape(x, (-1, nodes, *shape)) for x in (part.points, part.velocities, accelerations)
    )
    return riemannian.Start(space, h, points, velocities, accelerations, fixed, closed)
