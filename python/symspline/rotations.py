"""Rotations: angular velocity, quaternions without jumps of sign, rotation vectors, six-number representations.

Rotations map vectors from the body frame to the world frame, as the matrices of SciPy's ``Rotation`` do. You can pass
points as a ``Rotation`` or as matrices of shape (..., 3, 3). Curves are on ``so:3``, on ``se:3``, or on a product with
one of them, such as ``so:3 x r:3``.

Examples
--------
>>> import numpy as np, symspline as ss
>>> from symspline import rotations
>>> turning = rotations.from_rotation_vectors([[0, 0, 0], [0, 0, 1], [0, 0, 2.0]])
>>> spline = ss.CubicSpline([0, 1, 2], turning, "so:3")
>>> rotations.angular_velocity(spline, 0.5).round(12) + 0.0
array([0., 0., 1.])
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, overload
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from ._base.arrays import (
    REMOVE,
    as_array,
    check_finite,
    checked_flag,
    filled,
    length,
    one_of,
    real_numbers,
    refuse,
    short_repr,
    unchecked_numbers,
)
from ._base.faults import warn
from ._base.input import times_of
from ._base.time import knots_of
from ._base.typing import Array, Extrapolate, Frame, Keywords, RateInterpolation, RotationOrder, TimesLike
from ._core import ValidationError
from ._curves.composed import Joined, Retimed, evaluated
from ._curves.curve import ControlledCurve, CurveArrays
from ._curves.fit import curve_of
from ._curves.missing import missing_times, recounted, refuse_nan_times
from ._estimation.rates import integrated
from ._estimation.uncertainty import Jacobians, Motion, check_uncertain, standard_errors
from ._smoothing.noise import smoothed_spaces
from ._spaces import Doubles, SpecialEuclidean, SpecialOrthogonal, Sphere, cover_of
from ._spaces.finite_groups import elements, proper_symbol
from ._splines.base import check_timed
from ._splines.bsplines import CumulativeBSpline
from ._splines.cubic import AnyCubicSpline
from ._splines.piecewise import HermiteSpline
from .convert._quaternions import checked_order, converted, matrix_to_quaternion, quaternion_form, quaternion_to_matrix

if TYPE_CHECKING:
    from orix.quaternion import Misorientation, Orientation, Symmetry
    from scipy.spatial.transform import Rotation

__all__ = [
    "angular_acceleration",
    "angular_velocity",
    "as_orix",
    "as_quaternions",
    "as_rotation_6d",
    "as_rotation_vectors",
    "from_quaternions",
    "from_rotation_6d",
    "from_rotation_vectors",
    "integrate",
    "point_group",
    "quaternion",
    "rotation",
    "velocities",
]


def __dir__() -> list[str]:
    return __all__


Spline = AnyCubicSpline | HermiteSpline[Any] | CumulativeBSpline[Any]

_SO3, _SE3, _S3 = SpecialOrthogonal(3), SpecialEuclidean(3), Sphere(3)
_SIX = ("columns", "rows", "interleaved")
# If the two vectors are closer to parallel than this, the third is not determined in single precision.
_PARALLEL = 1e-6
# Noise of rates is amplified by about a tenth of the ratio of adjacent time steps if the interpolation is cubic.
_UNEVEN = 100
# A larger angle of one step, in radians, leaves less than eight significant digits for the rotation.
_LARGEST = 1e8
# Caches of derived curves, whose computation processes all knots: the rotations of poses, and the curves on S³ above
# curves on SO(3).
_ATTITUDES: WeakKeyDictionary[CurveArrays, CurveArrays] = WeakKeyDictionary()
_LIFTS: WeakKeyDictionary[CurveArrays, CurveArrays] = WeakKeyDictionary()


# ---- along a curve ----


def rotation(spline: Spline, x: TimesLike, *, extrapolate: Extrapolate = None, per_curve: bool = False) -> Rotation:
    """Evaluate a curve as a SciPy ``Rotation``.

    Parameters
    ----------
    spline : CubicSpline, HermiteSpline or CumulativeBSpline
        Curve on ``so:3``, ``se:3``, or a product with one of them.
    x : array_like
        Times.
    extrapolate : bool or str, optional
        Extrapolation policy, as for ``spline(x)``.
    per_curve : bool, default False
        True if every curve of a batch has its own times.

    Returns
    -------
    scipy.spatial.transform.Rotation, shape ``(*batch axes, *x.shape)``
        Rotations. SciPy before 1.17 supports at most one axis.

    Raises
    ------
    ImportError
        If SciPy is not installed.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> turning = from_rotation_vectors([[0, 0, 0], [0, 0, 1], [0, 0, 2.0]])
    >>> rotation(ss.CubicSpline(None, turning, "so:3"), 0.5).as_rotvec().round(12)
    array([0. , 0. , 0.5])
    """
    return rotation_of(_at(spline, x, "point", extrapolate, per_curve))


def rotation_of(matrices: Array) -> Rotation:
    """Return the ``Rotation`` of points of a curve."""
    try:
        from scipy.spatial.transform import Rotation
    except ImportError:
        raise ImportError("rotation returns a SciPy Rotation; install SciPy with: pip install scipy") from None
    missing = np.argwhere(np.isnan(matrices[..., 0, 0]))
    if len(missing):
        raise ValidationError(
            f"the value at index {missing[0].tolist()} is NaN, which SciPy's Rotation cannot hold: its curve was not "
            "fitted, or its time is outside the knots. Use spline(x), or remove these values"
        )
    # The conversion of matrices by SciPy orthogonalises them, which takes ten times as long.
    turns: Rotation = Rotation.from_quat(matrix_to_quaternion(matrices, scalar_first=False))
    return turns


@overload
def angular_velocity(
    spline: Spline,
    x: TimesLike,
    frame: Frame = "body",
    *,
    extrapolate: Extrapolate = None,
    per_curve: bool = False,
    return_std: Literal[False] = False,
) -> Array: ...


@overload
def angular_velocity(
    spline: Spline,
    x: TimesLike,
    frame: Frame = "body",
    *,
    extrapolate: Extrapolate = None,
    per_curve: bool = False,
    return_std: Literal[True],
) -> tuple[Array, Array]: ...


def angular_velocity(
    spline: Spline,
    x: TimesLike,
    frame: Frame = "body",
    *,
    extrapolate: Extrapolate = None,
    per_curve: bool = False,
    return_std: bool = False,
) -> Array | tuple[Array, Array]:
    r"""Compute the angular velocity of a curve.

    Parameters
    ----------
    spline : CubicSpline, HermiteSpline or CumulativeBSpline
        Curve on ``so:3``, ``se:3``, or a product with one of them.
    x : array_like
        Times.
    frame : {"body", "world"}, default "body"
        ``"body"`` for ω, as measured by a gyroscope and as returned by SciPy's ``RotationSpline(t, R)(x, 1)``;
        ``"world"`` for Rω.
    extrapolate : bool or str, optional
        Extrapolation policy, as for ``spline(x)``.
    per_curve : bool, default False
        True if every curve of a batch has its own times.
    return_std : bool, default False
        True to return standard errors as well. `spline` must then be a `SmoothingSpline`.

    Returns
    -------
    omega : ndarray, shape ``(*batch axes, *x.shape, 3)``
        Radians per unit of time (per second for dates).
    std : ndarray, shape ``(*batch axes, *x.shape, 3)``
        Standard error of each component in the same unit, only if `return_std` is True.

    Raises
    ------
    ValidationError
        If the curve does not contain exactly one rotation, `frame` is invalid, or standard errors are requested of a
        curve without a covariance or beyond its knots.

    See Also
    --------
    integrate : Compute rotations from angular velocities.
    symspline.SmoothingSpline.cov : Compute the covariance of a curve.

    Notes
    -----
    The angular velocity ω in the body frame satisfies :math:`R' = R \hat\omega`. If the curve moves by ξ in parallel
    frames along it, whose vectors are the columns of Q in the body frame, then to first order

    .. math:: \delta\omega = Q\xi' + \tfrac12\, \omega \times Q\xi, \qquad
        \delta(R\omega) = R\,(Q\xi' - \tfrac12\, \omega \times Q\xi).

    Standard errors follow from the covariance of ξ and ξ'.

    Examples
    --------
    >>> import symspline as ss
    >>> turning = from_rotation_vectors([[0, 0, 0], [0, 0, 1], [0, 0, 2.0]])
    >>> angular_velocity(ss.CubicSpline([0, 0.5, 1], turning, "so:3"), 0.3).round(12) + 0.0
    array([0., 0., 2.])

    Noisy attitudes of a body that swings about its axis, and the standard error of its rate:

    >>> import numpy as np
    >>> rng, t = np.random.default_rng(0), np.linspace(0, 3, 151)
    >>> seen = from_rotation_vectors(np.sin(2 * t)[:, None] * [0, 0, 1] + 0.01 * rng.standard_normal((151, 3)))
    >>> omega, std = angular_velocity(ss.make_smoothing_spline(t, seen, "so:3"), 1.5, return_std=True)
    >>> bool(np.all(np.abs(omega - [0, 0, 2 * np.cos(3)]) < 3 * std)), bool(np.all(std < 0.05))
    (True, True)
    """
    omega = _rate(spline, x, "velocity", frame, extrapolate, per_curve)
    if not checked_flag(return_std, "return_std"):
        return omega
    curve = check_uncertain(spline)
    part = smoothed_spaces(curve.space).index(_SO3)

    def jacobians(motions: list[Motion]) -> Jacobians:
        return rate_jacobians(motions[0], part, frame)

    return omega, standard_errors(curve, x, [part], jacobians, curve._where(extrapolate), per_curve)


def rate_jacobians(motion: Motion, part: int, frame: str) -> Jacobians:
    """Return the derivatives of the angular velocity with respect to the move of a curve and its velocity."""
    omega, vectors = _vectors(motion.p, motion.v), _vectors(motion.p[:, None], motion.frames)
    # With η = Σ ξ_j B_j, and B_j' = −[ω, B_j]/2 in parallel frames, δω = η' + [ω, η] = Σ ξ_j' B_j + ξ_j [ω, B_j]/2.
    moved, changed = (np.swapaxes(array, -1, -2) for array in (0.5 * np.cross(omega[:, None], vectors), vectors))
    if frame == "world":
        # The rotation of the frame by η turns Rω by R(η × ω), which reverses the sign of the half.
        moved, changed = (motion.p @ array for array in (-moved, changed))
    return [{part: moved}, {part: changed}]


def _vectors(p: Array, v: Array) -> Array:
    """Return the rotation vectors of pᵀv for tangent vectors v at rotations p."""
    turned = np.swapaxes(p, -1, -2) @ v
    return np.stack([turned[..., 2, 1], turned[..., 0, 2], turned[..., 1, 0]], axis=-1)


def angular_acceleration(
    spline: Spline, x: TimesLike, frame: Frame = "body", *, extrapolate: Extrapolate = None, per_curve: bool = False
) -> Array:
    """Compute the angular acceleration of a curve, which is continuous.

    Parameters
    ----------
    spline : CubicSpline, HermiteSpline or CumulativeBSpline
        Curve on ``so:3``, ``se:3``, or a product with one of them.
    x : array_like
        Times.
    frame : {"body", "world"}, default "body"
        ``"body"`` for ω', as returned by SciPy's ``RotationSpline(t, R)(x, 2)``; ``"world"`` for (Rω)' = Rω'.
    extrapolate : bool or str, optional
        Extrapolation policy, as for ``spline(x)``.
    per_curve : bool, default False
        True if every curve of a batch has its own times.

    Returns
    -------
    ndarray, shape ``(*batch axes, *x.shape, 3)``
        Radians per unit of time squared.

    Raises
    ------
    ValidationError
        If the curve does not contain exactly one rotation, or `frame` is invalid.

    Examples
    --------
    >>> import symspline as ss
    >>> turning = from_rotation_vectors([[0, 0, 0], [0, 0, 1], [0, 0, 0.0]])
    >>> angular_acceleration(ss.CubicSpline(None, turning, "so:3"), 1).round(12) + 0.0
    array([ 0.,  0., -3.])
    """
    return _rate(spline, x, "acceleration", frame, extrapolate, per_curve)


def quaternion(
    spline: Spline,
    x: TimesLike,
    *,
    scalar_first: bool | None = None,
    extrapolate: Extrapolate = None,
    per_curve: bool = False,
) -> Array:
    """Evaluate a curve as unit quaternions without jumps of sign.

    The quaternions form one continuous curve on S³. It begins at the quaternion of the first point whose scalar part is
    not negative. After one period of a closed curve, the quaternion may be −q instead of q; the sign then depends on
    the number of periods.

    Parameters
    ----------
    spline : CubicSpline or HermiteSpline
        Curve on ``so:3``, ``se:3``, or a product with one of them.
    x : array_like
        Times. The first call for a curve also processes all knots.
    scalar_first : bool
        Required. True for (w, x, y, z), False for (x, y, z, w) as in SciPy and ROS.
    extrapolate : bool or str, optional
        Extrapolation policy, as for ``spline(x)``.
    per_curve : bool, default False
        True if every curve of a batch has its own times.

    Returns
    -------
    ndarray, shape ``(*batch axes, *x.shape, 4)``
        Unit quaternions.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> turns = ss.CubicSpline(None, from_rotation_vectors([[0, 0, i] for i in range(8)]), "so:3")
    >>> quaternion(turns, [0, 2 * np.pi], scalar_first=True).round(8) + 0.0
    array([[ 1.,  0.,  0.,  0.],
           [-1.,  0.,  0.,  0.]])
    """
    first = checked_order(scalar_first)
    curve = _lift(attitude(spline))
    where = spline._where(extrapolate)
    # Only curves with knots are periodic.
    ends = (curve.points[..., 0, :], curve.points[..., -1, :]) if where == "periodic" else None
    if ends is not None and np.any(_dot(*ends) < 0):
        times, per_curve = spline._time_axis.at(x, curve.batch, per_curve, curve.times)
        times, turns = _wrapped(curve, times, per_curve)
        q = curve.evaluate(times, "point", "raise", True)
        flipped = (_dot(*ends) < 0).reshape(curve.batch + (1,) * (turns.ndim - len(curve.batch)))
        q = np.where((flipped & (turns % 2 == 1))[..., None], -q, q)
    else:
        q = evaluated(curve, spline._time_axis, x, "point", where, per_curve)
    return q if first else np.roll(q, -1, axis=-1)


def velocities(rotations: ArrayLike | Rotation, rates: ArrayLike, frame: Frame = "body") -> Array:
    """Convert angular velocities to tangent vectors at rotations.

    This is the inverse of `angular_velocity`. Use the result as velocities of a `symspline.HermiteSpline` or as end
    vectors.

    Parameters
    ----------
    rotations : array_like, shape (..., 3, 3), or scipy.spatial.transform.Rotation
        Points of ``so:3``.
    rates : array_like, shape (..., 3)
        Angular velocities ω in radians per unit of time.
    frame : {"body", "world"}, default "body"
        Frame of `rates`; ``"body"`` for rates as a gyroscope measures them.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Tangent vectors :math:`R \\hat\\omega` (body) or :math:`\\hat\\omega R` (world).

    Examples
    --------
    >>> velocities(np.eye(3), [0, 0, 2])
    array([[ 0., -2.,  0.],
           [ 2.,  0.,  0.],
           [ 0.,  0.,  0.]])
    """
    one_of(frame, "frame", "body", "world")
    r, hat = _given(rotations), _hat(real_numbers(rates, "rates", (3,))[0])
    _SO3.check_point(r)
    return (r @ hat if frame == "body" else hat @ r) + 0.0


def check_motion(spline: Any) -> None:
    """Raise TypeError unless an argument is a curve whose rates can be computed."""
    if not isinstance(spline, CumulativeBSpline):
        check_timed(spline)


def attitude(spline: Spline) -> Any:
    """Return the curve of the rotations alone, on SO(3).

    Raises
    ------
    ValidationError
        If the curve does not contain exactly one rotation.
    """
    check_motion(spline)
    turning = [part for part in spline._curve.parts if cover_of(part.space) in (_SO3, _SE3)]
    if len(turning) != 1:
        raise ValidationError(
            f"the curve must be on so:3, se:3, or a product with one of them, not on {spline.space}; to convert "
            "quaternions to points of so:3, use symspline.rotations.from_quaternions"
        )
    return _rotations_of(turning[0])


def _rotations_of(curve: Any) -> Any:
    """Return the curve of the rotations of a curve on SO(3) or SE(3)."""
    if cover_of(curve.space) == _SO3:
        return curve
    if isinstance(curve, (Joined, Retimed)):
        return curve.map(_rotations_of)
    if isinstance(curve, ControlledCurve):
        return curve.with_control_points(_SO3, curve.control_points[..., :3, :3])
    if curve not in _ATTITUDES:
        # The rotation of a screw motion is a geodesic of SO(3), and so the control points are those of its curve.
        parts = [np.ascontiguousarray(array[..., :3, :3]) for array in (curve.points, curve.velocities)]
        _ATTITUDES[curve] = curve_of(_SO3, curve.times, [(parts[0], parts[1])], fitted=False)
    return _ATTITUDES[curve]


def _at(spline: Spline, x: TimesLike, quantity: str, extrapolate: object, per_curve: bool) -> Array:
    curve, where = attitude(spline), spline._where(extrapolate)
    values: Array = evaluated(curve, spline._time_axis, x, quantity, where, per_curve)
    return values


def _rate(spline: Spline, x: TimesLike, quantity: str, frame: str, extrapolate: object, per_curve: bool) -> Array:
    """Return the angular velocity or acceleration in the given frame."""
    one_of(frame, "frame", "body", "world")
    body = _at(spline, x, f"body {quantity}", extrapolate, per_curve)
    return body if frame == "body" else turned(_at(spline, x, "point", extrapolate, per_curve), body)


def _vee(r: Array, d: Array) -> Array:
    """Return the vector of RᵀD, half the difference of its entries across the diagonal."""
    after, before = [1, 2, 0], [2, 0, 1]
    result: Array = (r[..., before] * d[..., after] - r[..., after] * d[..., before]).sum(axis=-2) / 2
    return result


def turned(r: Array, v: Array) -> Array:
    """Return Rv for matrices R and vectors v."""
    return np.asarray(np.einsum("...ij,...j->...i", r, v))


def _dot(p: Array, q: Array) -> Array:
    result: Array = (p * q).sum(axis=-1)
    return result


def _lift(curve: Any) -> Any:
    """Return the curve on S³ above a curve on SO(3).

    The Bézier segments of one are above those of the other if neighbouring control points differ by less than half a
    turn. The signs at the knots follow from the quaternions of the control points.
    """
    if isinstance(curve, Retimed):
        return curve.map(_lift)
    if isinstance(curve, Joined):
        return _without_jumps(curve.map(_lift))
    if isinstance(curve, ControlledCurve):
        raise TypeError(
            "spline must be a curve of cubic segments, such as a symspline.CubicSpline, not a cumulative B-spline. Use "
            "rotations.as_quaternions of its points; their signs are not continuous."
        )
    if curve not in _LIFTS:
        q = matrix_to_quaternion(curve.points, scalar_first=True)
        # q' = ½ q (0, ω), and so half the velocity of the rotation in the frame that q makes.
        rate = quaternion_velocity(q, _vee(curve.points, curve.velocities))
        control = _above(curve, q, rate).control_points()
        changes = np.where(_dot(control[..., 1, :], control[..., 2, :]) < 0, -1.0, 1.0)
        signs = np.ones((*q.shape[:-1], 1))
        np.cumprod(changes, axis=-1, out=signs[..., 1:, 0])
        _LIFTS[curve] = _above(curve, signs * q, signs * rate)
    return _LIFTS[curve]


def _without_jumps(curve: Joined) -> Joined:
    """Return a curve on S³ with signs such that each section begins near the end of the one before."""
    sections = [curve.sections[0]]
    for section in curve.sections[1:]:
        times = np.asarray(sections[-1].times[-1]), np.asarray(section.times[0])
        end, start = (
            part.evaluate(x, "point", "raise", False) for part, x in zip((sections[-1], section), times, strict=True)
        )
        sections.append(_multiplied(section, np.where(_dot(end, start) < 0, -1.0, 1.0)))
    return Joined(sections, curve.offsets)


def _multiplied(curve: Any, sign: Any) -> Any:
    """Return a curve on S³ multiplied by 1 or -1, one number per curve."""
    if isinstance(curve, (Joined, Retimed)):
        return curve.map(lambda section: _multiplied(section, sign))
    factor = np.asarray(sign)[..., None, None]
    return _above(curve, factor * curve.points, factor * curve.velocities)


def _above(curve: CurveArrays, q: Array, velocities: Array) -> CurveArrays:
    """Return a curve on S³ with the times of another curve."""
    # The core reads memory in order.
    pair = np.ascontiguousarray(q), np.ascontiguousarray(velocities)
    return curve_of(_S3, curve.times, [pair], fitted=False)


def quaternion_velocity(q: Array, omega: Array) -> Array:
    """Return ½ q (0, ω), scalar first, for angular velocities ω in the frame of the body."""
    w, v = q[..., :1], q[..., 1:]
    return np.concatenate([-_dot(v, omega)[..., None], w * omega + np.cross(v, omega)], axis=-1) / 2


def _wrapped(curve: CurveArrays, times: Doubles, per_curve: bool) -> tuple[Doubles, Doubles]:
    """Move times into the knots by whole periods, and return them with the number of periods."""
    batch = curve.batch
    axes = times.shape[len(batch) :] if per_curve else times.shape
    times = np.broadcast_to(times, batch + axes)
    knots = np.broadcast_to(curve.times, (*batch, curve.times.shape[-1]))
    start, end = (knots[..., i].reshape(batch + (1,) * len(axes)) for i in (0, -1))
    turns = np.floor((times - start) / (end - start))
    return np.clip(times - turns * (end - start), start, end), turns


# ---- from rates ----


def integrate(
    t: TimesLike | None,
    omega: ArrayLike,
    start: ArrayLike | Rotation | None = None,
    frame: Frame = "body",
    *,
    interpolation: RateInterpolation = "cubic",
    skipna: bool = False,
) -> Array:
    r"""Compute rotations from angular velocities, such as those of a gyroscope.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (n,) or (..., n), or None
        Strictly increasing times, shared by all recordings or one row per recording. None means 0, 1, ..., n - 1.
    omega : array_like, shape (..., n, 3)
        Angular velocities in radians per unit of time (per second for dates). Leading axes are batch axes.
    start : array_like, shape (..., 3, 3), or scipy.spatial.transform.Rotation, optional
        Rotation at the first time, the identity by default.
    frame : {"body", "world"}, default "body"
        Frame of `omega`; ``"body"`` for rates as a gyroscope measures them.
    interpolation : {"cubic", "linear"}, default "cubic"
        Interpolation of `omega` between the times. ``"cubic"`` is a not-a-knot spline, and the error of the rotations
        is of fourth order in the time step. With ``"linear"`` it is of second order. Use it for noisy rates with very
        uneven times.
    skipna : bool, default False
        True to omit missing samples, where a rate or the time is NaN, NaT or masked. The rates are interpolated across
        them, and their rotations are NaN. `start` is then the rotation at the first time that is present.

    Returns
    -------
    ndarray, shape (..., n, 3, 3)
        Rotations at all times, points of ``so:3``.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.

    Warns
    -----
    UserWarning
        If times are so uneven that a cubic amplifies the noise of the rates.

    See Also
    --------
    angular_velocity : Compute the angular velocity of a curve.
    symspline.estimate : Combine rates with other measurements, and estimate the bias of a gyroscope.

    Notes
    -----
    The result solves :math:`R' = R\hat\omega` in the body frame, or :math:`R' = \hat\omega R` in the world frame. A
    step is the exponential of the Magnus expansion of fourth order ([1]_, [2]_). For the interpolant, and the time s
    measured from the middle of a step of length h,

    .. math:: \Omega = m_0 \pm m_0 \times m_1, \quad m_0 = \int \omega\,ds, \quad
        m_1 = \frac1h \int s\,\omega\,ds,

    with the positive sign in the body frame. Noise and bias of a gyroscope accumulate: a bias of 0.01 rad/s turns the
    result by 0.6 rad within a minute. White noise of standard deviation σ in the rates, sampled every h seconds, turns
    it by about :math:`\sigma\sqrt{ht}` about each axis within t seconds.

    References
    ----------
    .. [1] A. Iserles, H. Z. Munthe-Kaas, S. P. Nørsett, A. Zanna, "Lie-group methods", Acta Numerica 9 (2000), Section
       5.
    .. [2] S. Blanes, F. Casas, J. A. Oteo, J. Ros, "The Magnus expansion and some of its applications", Physics Reports
       470 (2009), Section 5.

    Examples
    --------
    A quarter turn about the vertical axis, at an increasing rate:

    >>> import numpy as np
    >>> t = np.linspace(0, 1, 11)
    >>> omega = np.pi * t[:, None] * [0, 0, 1]
    >>> as_rotation_vectors(integrate(t, omega))[-1].round(8) + 0.0
    array([0.        , 0.        , 1.57079633])
    """
    one_of(frame, "frame", "body", "world")
    one_of(interpolation, "interpolation", "cubic", "linear")
    if checked_flag(skipna, "skipna"):
        return _integrated_present(filled(t), filled(omega), start, frame, interpolation)
    rates, _ = unchecked_numbers(omega, "omega", (None, 3))
    batch, n = rates.shape[:-2], rates.shape[-2]
    _, shown, times = knots_of(t, batch, n)
    check_finite(rates, "omega", f"{REMOVE}, or pass skipna=True to omit such samples")
    refuse_nan_times(times)
    steps = np.diff(times)
    advice = "times must increase. Sort times and rates together, and remove repeated times."
    later = shown[..., 1:]
    refuse(~(steps > 0), "t", lambda i: f"is {shown[i]} and the next time is {later[i]}, but {advice}")
    with np.errstate(over="ignore"):
        angles = length(rates)[..., :-1] * steps
    too_large = "Check the units of the rates and times."
    refuse(
        ~(angles < _LARGEST), "omega", lambda i: f"is {rates[i]}, which is {angles[i]:.3g} rad in one step. {too_large}"
    )
    if interpolation == "cubic":
        _warn_of_uneven(steps)
    first = np.eye(3) if start is None else _SO3._array(start, "start")
    if first.shape[-2:] != (3, 3) or not _broadcasts(first.shape[:-2], batch):
        raise ValidationError(
            f"start has shape {first.shape}, but (3, 3) is needed"
            + (f", or one rotation per recording of the batch {batch}" if batch else "")
        )
    try:
        _SO3.check_point(first)
    except ValidationError as error:
        raise ValidationError(f"start: {error}") from None
    first = np.asarray(_SO3.project(first))[..., None, :, :]
    if frame == "body":
        return np.asarray(first @ _integral(times, rates, interpolation))
    # The transposed equation is (Rᵀ)' = −Rᵀω.
    return np.asarray(_swapped(_integral(times, -rates, interpolation)) @ first)


def _integrated_present(
    t: ArrayLike, omega: Any, start: object, frame: Frame, interpolation: RateInterpolation
) -> Array:
    """Integrate the samples that are present in each recording. The rotations of the others are NaN."""
    rates, _ = unchecked_numbers(omega, "omega", (None, 3))
    present = np.asarray(~np.isnan(rates).any(axis=-1))
    times = None if t is None else as_array(times_of(t, "t")[0], "t")
    fits = times is None or times.shape in (present.shape, present.shape[-1:])
    if times is not None and fits:
        present = present & ~missing_times(times)
    options: Keywords = {"frame": frame, "interpolation": interpolation}
    if present.all() or not fits:
        return integrate(t, rates, start, **options)
    turned = np.full((*present.shape, 3, 3), np.nan)
    batch = present.shape[:-1]
    starts = None if start is None else np.broadcast_to(_SO3._array(start, "start"), (*batch, 3, 3))
    for i in np.ndindex(batch):
        rows = np.flatnonzero(present[i])
        if not len(rows):
            continue
        chosen = rows if times is None else times[i][rows] if times.ndim > 1 else times[rows]
        try:
            turned[i][rows] = integrate(chosen, rates[i][rows], None if starts is None else starts[i], **options)
        except ValidationError as error:
            raise recounted(error, [rows]) from None
    return turned


def _integral(times: Doubles, rates: Array, interpolation: str) -> Array:
    """Return the rotations that begin with the identity."""
    return quaternion_to_matrix(integrated(times, rates, interpolation), scalar_first=True)


def _warn_of_uneven(steps: Array) -> None:
    """Warn if a time step is much shorter than a neighbouring one."""
    before, after = steps[..., :-1], steps[..., 1:]
    uneven = np.argwhere((after > _UNEVEN * before) | (before > _UNEVEN * after))
    if len(uneven):
        i = int(uneven[0][-1])
        warn(
            f"The time steps before and after t[{i + 1}] differ by a factor of more than {_UNEVEN}. Cubic "
            'interpolation amplifies noise there: pass interpolation="linear" if the rates are noisy.',
            UserWarning,
        )


def _broadcasts(shape: tuple[int, ...], batch: tuple[int, ...]) -> bool:
    try:
        return np.broadcast_shapes(shape, batch) == batch
    except ValueError:
        return False


# ---- other forms of rotations ----


def as_quaternions(rotations: ArrayLike | Rotation, *, scalar_first: bool | None = None) -> Array:
    """Convert rotations to unit quaternions with non-negative scalar part.

    For quaternions along a curve without jumps of sign, use `quaternion`.

    Parameters
    ----------
    rotations : array_like, shape (..., 3, 3), or scipy.spatial.transform.Rotation
        Points of ``so:3``.
    scalar_first : bool
        Required. True for (w, x, y, z), False for (x, y, z, w) as in SciPy and ROS.

    Returns
    -------
    ndarray, shape (..., 4)
        Unit quaternions.

    Raises
    ------
    ValidationError
        If a matrix is not a rotation, or `scalar_first` is missing.

    References
    ----------
    Shepperd, "Quaternion from rotation matrix", 1978.

    Examples
    --------
    >>> as_quaternions([[0, -1, 0], [1, 0, 0], [0, 0, 1]], scalar_first=False).round(8)
    array([0.        , 0.        , 0.70710678, 0.70710678])
    """
    if hasattr(rotations, "as_quat"):
        # Two conversions of SciPy's own quaternions would take ten times as long.
        first = checked_order(scalar_first)
        q = np.asarray(rotations.as_quat())
        q = np.where(q[..., 3:] < 0, -q, q) + 0.0
        return np.roll(q, 1, axis=-1) if first else q
    return converted(_given(rotations), "rotations", "matrix", quaternion_form(scalar_first))


def from_quaternions(
    quaternions: ArrayLike, *, scalar_first: bool | None = None, atol: float | None = None, skipna: bool = False
) -> Array:
    """Convert unit quaternions to rotations; q and −q give the same rotation.

    Parameters
    ----------
    quaternions : array_like, shape (..., 4)
        Unit quaternions.
    scalar_first : bool
        Required. True for (w, x, y, z), False for (x, y, z, w) as in SciPy and ROS.
    atol : float, optional
        Largest deviation of the norms from 1. By default, the accuracy of the numbers determines it, as for points of
        `symspline.CubicSpline`: 1e-8 in double precision, 1e-4 for numbers of single precision or of six decimals.
    skipna : bool, default False
        True to return NaN for quaternions with NaN or masked numbers, which otherwise raise `ValidationError`.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Points of ``so:3``.

    Raises
    ------
    ValidationError
        If the norm of a quaternion is not 1, or `scalar_first` is missing.

    Examples
    --------
    >>> from_quaternions([1, 0, 0, 0], scalar_first=True)
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    return converted(quaternions, "quaternions", quaternion_form(scalar_first), "matrix", atol, skipna)


def as_orix(
    rotations: ArrayLike | Rotation, symmetry: Symmetry | tuple[Symmetry, Symmetry] | None = None
) -> Orientation | Misorientation:
    """Convert rotations to orientations or misorientations of orix.

    In the other direction, objects of orix are accepted wherever points of ``so:3`` are, and `symspline.Quotient`
    accepts them as groups.

    Parameters
    ----------
    rotations : array_like, shape (..., 3, 3), or scipy.spatial.transform.Rotation
        Points of ``so:3``, such as the values of a curve on ``Quotient("so:3", orientations)``.
    symmetry : orix.quaternion.Symmetry or pair, optional
        The symmetry of the crystal; or for misorientations a pair, for the first and the second crystal. By default
        there is none.

    Returns
    -------
    orix.quaternion.Orientation or orix.quaternion.Misorientation
        The same rotations, in the same shape.

    Raises
    ------
    ImportError
        If orix is not installed.
    ValidationError
        If a matrix is not a rotation.

    See Also
    --------
    symspline.Quotient : Orientations up to the symmetry of a crystal.

    Notes
    -----
    Orientations of orix map vectors of the sample to vectors of the crystal, so that symmetry multiplies their
    matrices from the left.

    Examples
    --------
    >>> from orix.quaternion import symmetry  # doctest: +SKIP
    >>> as_orix([[0, -1, 0], [1, 0, 0], [0, 0, 1]], symmetry.Oh)  # doctest: +SKIP
    Orientation () m-3m
    [0.7071 0.     0.     0.7071]
    """
    quaternions = as_quaternions(rotations, scalar_first=True)
    try:
        from orix.quaternion import Misorientation, Orientation
    except ImportError:
        raise ImportError("this conversion needs orix; install it with: pip install orix") from None
    kind = Misorientation if isinstance(symmetry, tuple) else Orientation
    return kind(quaternions, symmetry=symmetry)


def as_rotation_vectors(rotations: ArrayLike | Rotation) -> Array:
    """Convert rotations to rotation vectors.

    Parameters
    ----------
    rotations : array_like, shape (..., 3, 3), or scipy.spatial.transform.Rotation
        Points of ``so:3``.

    Returns
    -------
    ndarray, shape (..., 3)
        Axis times angle in radians, with the angle from 0 to π.

    Examples
    --------
    >>> as_rotation_vectors([[0, -1, 0], [1, 0, 0], [0, 0, 1]]).round(8)
    array([0.        , 0.        , 1.57079633])
    """
    if hasattr(rotations, "as_rotvec"):
        return np.array(rotations.as_rotvec())
    return converted(_given(rotations), "rotations", "matrix", "vector")


def from_rotation_vectors(vectors: ArrayLike, *, skipna: bool = False) -> Array:
    """Convert rotation vectors to rotations.

    Parameters
    ----------
    vectors : array_like, shape (..., 3)
        Axis times angle in radians.
    skipna : bool, default False
        True to return NaN for vectors with NaN or masked numbers, which otherwise raise `ValidationError`.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Points of ``so:3``.

    Examples
    --------
    >>> from_rotation_vectors([0, 0, np.pi / 2]).round(8) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    return converted(vectors, "vectors", "vector", "matrix", skipna=skipna)


def as_rotation_6d(rotations: ArrayLike | Rotation, *, order: RotationOrder | None = None) -> Array:
    """Convert rotations to the 6-D representation of machine learning.

    The representation consists of two columns, or rows, of the matrix. It is continuous over all rotations [1]_.

    Parameters
    ----------
    rotations : array_like, shape (..., 3, 3), or scipy.spatial.transform.Rotation
        Points of ``so:3``.
    order : {"columns", "rows", "interleaved"}
        Required. ``"columns"`` for the first column and then the second, as in [1]_; ``"rows"`` for the first two rows,
        as in PyTorch3D; ``"interleaved"`` for the 3 × 2 matrix of the two columns row by row, as in SPIN.

    Returns
    -------
    ndarray, shape (..., 6)
        Six numbers per rotation.

    See Also
    --------
    from_rotation_6d : The inverse.

    References
    ----------
    .. [1] Zhou, Barnes, Lu, Yang & Li, "On the Continuity of Rotation Representations in Neural Networks", CVPR 2019.

    Examples
    --------
    >>> as_rotation_6d([[0, -1, 0], [1, 0, 0], [0, 0, 1]], order="columns")
    array([ 0.,  1.,  0., -1.,  0.,  0.])
    """
    _check_six(order)
    given = _given(rotations)
    _SO3.check_point(given)
    r = np.asarray(given, dtype=float)
    six = r[..., :2, :] if order == "rows" else r[..., :2] if order == "interleaved" else _swapped(r[..., :2])
    return six.reshape(*r.shape[:-2], 6)


def from_rotation_6d(numbers: ArrayLike, *, order: RotationOrder | None = None) -> Array:
    """Convert the 6-D representation, such as the output of a neural network, to rotations.

    The two vectors are orthonormalised by the Gram–Schmidt process ([1]_, equation 15).

    Parameters
    ----------
    numbers : array_like, shape (..., 6)
        Two vectors of any length that are not parallel.
    order : {"columns", "rows", "interleaved"}
        Required. See `as_rotation_6d`.

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Points of ``so:3``.

    Raises
    ------
    ValidationError
        If a vector is zero, or the two vectors are parallel.

    References
    ----------
    .. [1] Zhou, Barnes, Lu, Yang & Li, "On the Continuity of Rotation Representations in Neural Networks", CVPR 2019.

    Examples
    --------
    >>> from_rotation_6d([2, 0, 0, 1, 1, 0], order="columns")
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    _check_six(order)
    six, _ = real_numbers(numbers, "numbers", (6,))
    two = six.reshape(*six.shape[:-1], *((3, 2) if order == "interleaved" else (2, 3)))
    a, b = np.moveaxis(two, -1 if order == "interleaved" else -2, 0)
    sizes = length(a), length(b)
    with np.errstate(invalid="ignore", divide="ignore"):
        first, second = a / sizes[0][..., None], b / sizes[1][..., None]
        second = second - _dot(first, second)[..., None] * first
        sine = length(second)
        advice = "the two vectors must be nonzero and not parallel"
        refuse(~(sine > _PARALLEL), "numbers", lambda i: f"are {a[i]} and {b[i]}, but {advice}")
        second = second / sine[..., None]
    rows = np.stack([first, second, np.cross(first, second)], axis=-2)
    return _SO3.project(rows if order == "rows" else _swapped(rows))


# ---- symmetry ----


def point_group(symbol: str) -> Doubles:
    """Return the rotations of a point group of crystals.

    Parameters
    ----------
    symbol : str
        Hermann–Mauguin or Schoenflies symbol of one of the eleven proper point groups: 1 (C1), 2 (C2), 222 (D2),
        4 (C4), 422 (D4), 3 (C3), 32 (D3), 6 (C6), 622 (D6), 23 (T) and 432 (O). The symbol of a Laue group, such as
        m-3m (Oh), denotes its rotations.

    Returns
    -------
    ndarray, shape (k, 3, 3)
        The rotations, the identity first.

    Raises
    ------
    ValidationError
        If the symbol is unknown.

    See Also
    --------
    symspline.Quotient : Orientations up to the symmetry of a crystal.

    Notes
    -----
    The conventions are those of orix: the main axis is z, and the two-fold axes of 32 and 622 include x. The two-fold
    axis of 2 is z.

    Examples
    --------
    >>> point_group("m-3m").shape
    (24, 3, 3)
    >>> point_group("C2")[1]
    array([[-1.,  0.,  0.],
           [ 0., -1.,  0.],
           [ 0.,  0.,  1.]])
    """
    return elements(proper_symbol(symbol)) + 0.0


def _hat(v: Array) -> Array:
    """Return the matrix of the cross product with a vector."""
    hat = np.zeros((*v.shape[:-1], 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        hat[..., k, j], hat[..., j, k] = v[..., i], -v[..., i]
    return hat


def _given(rotations: object) -> Array:
    return _SO3._array(rotations, "rotations")


def _swapped(x: Array) -> Array:
    return np.swapaxes(x, -1, -2)


def _check_six(order: Any) -> None:
    if not isinstance(order, str) or order not in _SIX:
        raise ValidationError(
            "order is required, because the six numbers do not show it: pass order='columns' (Zhou et al.), "
            f"'rows' (PyTorch3D) or 'interleaved' (SPIN); got {short_repr(order)}"
        )
