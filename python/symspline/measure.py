"""Measurements of a curve, from which `symspline.estimate` fits it.

Each class describes what a sensor reports, and when. Standard deviations are in the units of the measurement.

Examples
--------
>>> import numpy as np
>>> import symspline as ss
>>> gyro = ss.measure.BodyRates([0.0, 0.1], np.zeros((2, 3)), sigma=0.02, bias=ss.measure.Constant(3))
>>> gyro.bias.size
3
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from importlib.util import find_spec
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ._base.arrays import as_array, cast, filled, one_of, refuse, short_repr, whole_number
from ._base.input import times_of
from ._base.typing import AnyFunction, FloatArray, Keywords, Loss, Numbers, PointsLike, TimesLike
from ._core import ValidationError
from ._curves.missing import Mask, missing_times, rows_of
from ._curves.options import order_of
from ._spaces import Doubles

__all__ = [
    "BodyRates",
    "Constant",
    "Directions",
    "Function",
    "Points",
    "SpecificForce",
    "Velocities",
]


def __dir__() -> list[str]:
    return __all__


# Acceleration of free fall in m/s², the default of `SpecificForce`.
GRAVITY = (0.0, 0.0, -9.80665)


class Constant:
    """An unknown constant, such as the bias of a sensor.

    The same object in several measurements is one parameter. `Curve.parameters` of the estimated curve holds its value.

    Parameters
    ----------
    size : int
        Number of entries.
    start : float or array_like, shape (size,), default 0
        Initial value, and the mean of the prior if `sigma` is given.
    sigma : float or array_like, optional
        Standard deviation of the prior. By default there is no prior, and the measurements must determine the value.
    name : str, optional
        Key in ``curve.parameters``. By default, ``"gyro bias"``, ``"accelerometer bias"``, ``"lever arm"`` or
        ``"time offset"``, after the argument in which it is used.

    Raises
    ------
    ValidationError
        If an argument is invalid.

    See Also
    --------
    symspline.estimate : Fit a curve to measurements of any kind.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.measure.Constant(3, name="gyro bias").size
    3
    """

    size: int
    start: FloatArray
    sigma: FloatArray | None
    name: str | None

    def __init__(
        self, size: int, start: ArrayLike = 0.0, sigma: ArrayLike | None = None, name: str | None = None
    ) -> None:
        self.size = whole_number(size, "size", 1)
        self.start = broadcast(start, "start", (self.size,))
        self.sigma = None if sigma is None else broadcast(sigma, "sigma", (self.size,))
        if self.sigma is not None:
            refuse(~(self.sigma > 0), "sigma", lambda i: "must be > 0")
        self.name = name

    def __repr__(self) -> str:
        return f"<Constant {self.name!r} of size {self.size}>" if self.name else f"<Constant of size {self.size}>"


class Measurement:
    """Measurements of one kind, with the options that all kinds have."""

    t: TimesLike
    sigma: Numbers | None
    factor: int | None
    time_offset: Constant | None
    loss: Loss | None

    def __init__(
        self,
        t: TimesLike,
        sigma: Numbers | None,
        factor: int | None = None,
        time_offset: Constant | None = None,
        loss: Loss | None = None,
    ) -> None:
        if time_offset is not None and (not isinstance(time_offset, Constant) or time_offset.size != 1):
            raise ValidationError(f"time_offset must be a Constant of size 1, not {short_repr(time_offset)}")
        if loss is not None:
            one_of(loss, "loss", "linear", "huber", "cauchy")
        self.t, self.sigma, self.factor, self.time_offset, self.loss = t, sigma, factor, time_offset, loss

    def __repr__(self) -> str:
        return f"<{type(self).__name__} at {len(np.atleast_1d(np.asarray(self.t)))} times>"


class Points(Measurement):
    """Noisy points of the curve, the data of `make_smoothing_spline`.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (n,)
        Times in any order, possibly repeated.
    y : array_like, shape (n, *point_shape)
        Points of the space, or of the factor; for a product, a tuple of arrays. For poses also their positions alone,
        shape (n, 3), or their rotations, shape (n, 3, 3).
    sigma : float, array_like of shape (n,), or tuple, optional
        Standard deviation of the noise in one coordinate, as a length in the space. For a product or for poses also a
        tuple with one entry per part. By default it is estimated, which requires that there are no other measurements.
    weights : array_like, optional
        Weights ≥ 0, or information matrices of shape (n, m, m), as for `make_smoothing_spline`. Points of weight 0
        are ignored and may be NaN. The variance of the noise is ``sigma**2 / weights``.
    frames : array_like, optional
        Tangent vectors to which information matrices refer, as for `make_smoothing_spline`.
    factor : int, optional
        Factor of a product to which the points belong.
    time_offset : Constant, optional
        Unknown offset of one entry that is added to `t`.
    loss : {"linear", "huber", "cauchy"}, optional
        Loss, by default that of `estimate`.

    Examples
    --------
    >>> import numpy as np
    >>> import symspline as ss
    >>> t = np.linspace(0, 1, 30)
    >>> y = np.sin(3 * t) + 0.01 * np.random.default_rng(0).standard_normal(30)
    >>> points = ss.measure.Points(t, y[:, None], sigma=0.01)
    >>> float(ss.estimate([points], 8, "r:1")(0.5).round(1)[0])
    1.0
    """

    y: PointsLike
    weights: Numbers | None
    frames: Numbers | None

    def __init__(
        self,
        t: TimesLike,
        y: PointsLike,
        *,
        sigma: Numbers | None = None,
        weights: Numbers | None = None,
        frames: Numbers | None = None,
        factor: int | None = None,
        time_offset: Constant | None = None,
        loss: Loss | None = None,
    ) -> None:
        super().__init__(t, sigma, factor, time_offset, loss)
        self.y, self.weights, self.frames = y, weights, frames

    def _with_sigma(self, sigma: Numbers) -> Points:
        """Return the same points with other standard deviations."""
        points = copy(self)
        points.sigma = sigma
        return points


class Velocities(Measurement):
    """Velocities at measured points, such as speed and course of a ship, or Doppler velocities.

    The noise of the point does not enter: pass `Points` for the positions themselves.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (n,)
        Times in any order.
    y : array_like, shape (n, *point_shape)
        Points near the curve at which the velocities are tangent.
    v : array_like, shape (n, *point_shape)
        Tangent vectors at y, per unit of time (per second for dates).
    sigma : float or array_like of shape (n,)
        Standard deviation of a coordinate of the velocity.
    factor, time_offset, loss : optional
        As for `Points`.

    Notes
    -----
    The residual is :math:`P_{\\gamma\\to y}\\gamma' - v`, where P is parallel transport along the geodesic.

    Examples
    --------
    >>> import numpy as np
    >>> import symspline as ss
    >>> t = np.linspace(0, 1, 20)
    >>> noise = np.random.default_rng(0).standard_normal((2, 20, 1))
    >>> x, v = np.sin(3 * t)[:, None] + 0.01 * noise[0], 3 * np.cos(3 * t)[:, None] + 0.1 * noise[1]
    >>> both = [ss.measure.Points(t, x, sigma=0.01), ss.measure.Velocities(t, x, v, sigma=0.1)]
    >>> float(ss.estimate(both, 8, "r:1")(0.5).round(1)[0])
    1.0
    """

    y: PointsLike
    v: PointsLike

    def __init__(
        self,
        t: TimesLike,
        y: PointsLike,
        v: PointsLike,
        *,
        sigma: Numbers,
        factor: int | None = None,
        time_offset: Constant | None = None,
        loss: Loss | None = None,
    ) -> None:
        super().__init__(t, sigma, factor, time_offset, loss)
        self.y, self.v = y, v


class BodyRates(Measurement):
    """Velocities of a curve in a group in the moving frame, as a gyroscope measures them.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (n,)
        Times in any order.
    omega : array_like, shape (n, 3) or (n, *point_shape)
        For rotations ``so:3``, quaternions ``sphere:3`` and poses ``se:3``, the angular velocity ω in the frame of the
        body, in radians per unit of time (per second for dates). For other groups of matrices, :math:`g^{-1}g'`.
    sigma : float or array_like
        Standard deviation of one component, of shape (), (n,) or (n, components).
    bias : Constant, optional
        Unknown constant that the sensor adds. Its components are those of ω, or for other groups the coordinates in
        ``space.frame(identity)``.
    factor, time_offset, loss : optional
        As for `Points`.

    Notes
    -----
    If the curve moves by η in the frame of the body, ω changes by :math:`\\eta' + [\\omega, \\eta]`.

    Examples
    --------
    >>> import numpy as np
    >>> import symspline as ss
    >>> t = np.linspace(0, 1, 50)
    >>> start = ss.measure.Points([0], [np.eye(3)], sigma=0.01)
    >>> gyro = ss.measure.BodyRates(t, np.tile([0, 0, 1.0], (50, 1)), sigma=0.02)
    >>> curve = ss.estimate([start, gyro], 5, "so:3", lam=1e-3)
    >>> ss.rotations.as_rotation_vectors(curve(1.0)).round(3) + 0.0
    array([0., 0., 1.])
    """

    omega: ArrayLike
    bias: Constant | None

    def __init__(
        self,
        t: TimesLike,
        omega: ArrayLike,
        *,
        sigma: ArrayLike,
        bias: Constant | None = None,
        factor: int | None = None,
        time_offset: Constant | None = None,
        loss: Loss | None = None,
    ) -> None:
        super().__init__(t, sigma, factor, time_offset, loss)
        self.omega, self.bias = omega, bias


class Directions(Measurement):
    """Known directions seen from a rotating body, as star trackers, magnetometers and sun sensors report them.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (n,)
        Times in any order.
    seen : array_like, shape (n, 3) or (n, k, 3)
        Vectors in the frame of the body: one per time, or k of them.
    reference : array_like, shape (3,), (n, 3), (k, 3) or (n, k, 3)
        The same vectors in the fixed frame.
    sigma : float or array_like
        Standard deviation of one component: for unit vectors, an angle in radians.
    factor, time_offset, loss : optional
        As for `Points`.

    Notes
    -----
    The residual is :math:`R^T r - s` for the reference r and the vector s that is seen.

    Examples
    --------
    >>> import numpy as np
    >>> import symspline as ss
    >>> t = np.linspace(0, 1, 30)
    >>> turning = ss.rotations.from_rotation_vectors(t[:, None] * [0, 0, 1.0])
    >>> axes = np.eye(3)
    >>> stars = ss.measure.Directions(t, axes @ turning, axes, sigma=1e-3)
    >>> curve = ss.estimate([stars], 5, "so:3", lam=1e-6)
    >>> ss.rotations.as_rotation_vectors(curve(0.5)).round(3) + 0.0
    array([0. , 0. , 0.5])
    """

    seen: ArrayLike
    reference: ArrayLike

    def __init__(
        self,
        t: TimesLike,
        seen: ArrayLike,
        reference: ArrayLike,
        *,
        sigma: ArrayLike,
        factor: int | None = None,
        time_offset: Constant | None = None,
        loss: Loss | None = None,
    ) -> None:
        super().__init__(t, sigma, factor, time_offset, loss)
        self.seen, self.reference = seen, reference


class SpecificForce(Measurement):
    """Accelerations as an accelerometer measures them: without gravity, in the frame of the body.

    The space must have one rotation ``so:3`` and one position ``r:3``, such as ``so:3 x r:3`` or ``se:3``.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (n,)
        Times in any order.
    f : array_like, shape (n, 3)
        Specific force.
    sigma : float or array_like
        Standard deviation of one component, of shape (), (n,) or (n, 3).
    gravity : array_like, shape (3,), default (0, 0, -9.80665)
        Acceleration of free fall in the fixed frame, in the units of the positions and times.
    bias : Constant, optional
        Unknown constant that the sensor adds.
    lever_arm : array_like of shape (3,), or Constant, optional
        Position of the sensor in the frame of the body.
    time_offset, loss : optional
        As for `Points`.

    Notes
    -----
    With the lever arm l the sensor reads :math:`R^T(a - g) + \\omega' \\times l + \\omega \\times (\\omega \\times l)`.

    Examples
    --------
    >>> import numpy as np
    >>> import symspline as ss
    >>> t = np.linspace(0, 1, 40)
    >>> turn = ss.rotations.from_rotation_vectors(0 * t[:, None] * np.ones(3))
    >>> fall = np.stack([0 * t, 0 * t, -t**2], axis=-1)
    >>> known = ss.measure.Points(t, (turn, fall), sigma=(1e-3, 1e-3))
    >>> imu = ss.measure.SpecificForce(t, np.tile([0, 0, 7.80665], (40, 1)), sigma=0.01)
    >>> curve = ss.estimate([known, imu], 6, "so:3 x r:3", penalty="jerk", lam=1e-6)
    >>> curve(0.5)[1].round(2) + 0.0
    array([ 0.  ,  0.  , -0.25])
    """

    f: ArrayLike
    gravity: ArrayLike
    bias: Constant | None
    lever_arm: ArrayLike | Constant | None

    def __init__(
        self,
        t: TimesLike,
        f: ArrayLike,
        *,
        sigma: ArrayLike,
        gravity: ArrayLike = GRAVITY,
        bias: Constant | None = None,
        lever_arm: ArrayLike | Constant | None = None,
        time_offset: Constant | None = None,
        loss: Loss | None = None,
    ) -> None:
        super().__init__(t, sigma, None, time_offset, loss)
        self.f, self.gravity, self.bias, self.lever_arm = f, gravity, bias, lever_arm


class Function(Measurement):
    """Measurements of any kind, given by a function of the motion.

    Parameters
    ----------
    t : array_like of float or datetime64, shape (n,)
        Times, in the order in which the function expects the motion.
    residual : callable
        Function that returns the residuals, shape (n, k) or (n,): what the sensor would read minus what it reads. It
        is called with the points, shape (n, *point_shape), then with the velocities if ``nu >= 1`` and the covariant
        accelerations if ``nu == 2``, and last with a dict of the values of `parameters` if there are any. On a product
        without `factor`, points and vectors are tuples. Arrays contain all n samples. Without `jacobian`, one iteration
        calls the function a few times per coordinate.
    sigma : float or array_like
        Standard deviation of one residual, of shape (), (n,) or (n, k).
    nu : {0, 1, 2}, default 0
        Highest derivative that the function needs.
    parameters : Mapping of str to Constant, optional
        Unknown constants by the name under which the function receives them.
    jacobian : callable, "jax" or None, default None
        Derivatives of `residual`. A function receives the same arguments, and returns the partial derivatives with
        respect to each of them: an array if there is one argument, otherwise a tuple. The derivative with respect to an
        array of shape (n, ...) has shape (n, k, ...), or (n, ...) if `residual` returns shape (n,): row i of the
        residuals depends on row i of the points only. All entries of the points count as independent, also those of
        matrices and unit vectors. The derivative with respect to the dict of parameters is a dict of arrays of shape
        (n, k, size), or (n, size). Return None where all vanish. A product has a tuple of arrays per argument. With
        respect to complex entries x + iy, return ∂r/∂x + i ∂r/∂y. The first result is compared with differences.
        ``"jax"`` differentiates `residual`, which must be written with ``jax.numpy``, by ``jax.jacfwd``. None selects
        central differences.
    factor, time_offset, loss : optional
        As for `Points`.

    Raises
    ------
    ValidationError
        If `jacobian` is ``"jax"`` and JAX is not installed. `estimate` raises it if a derivative has the wrong shape or
        differs from that of `residual`.

    Examples
    --------
    >>> import numpy as np
    >>> import symspline as ss
    >>> t = np.linspace(0, 1, 50)
    >>> beacons, path = np.array([[0.0, 2], [3, 1], [-1, -2]]), np.stack([t, t**2], axis=-1)
    >>> noise = 0.01 * np.random.default_rng(0).standard_normal((50, 3))
    >>> ranges = np.linalg.norm(path[:, None] - beacons, axis=-1) + noise
    >>> measured = ss.measure.Function(
    ...     t, lambda x: np.linalg.norm(x[:, None] - beacons, axis=-1) - ranges, sigma=0.01
    ... )
    >>> bool(np.all(np.abs(ss.estimate([measured], 6, "r:2", lam=1e-6)(0.5) - [0.5, 0.25]) < 0.02))
    True

    With the derivatives of the ranges, which are unit vectors, the estimate is the same:

    >>> def directions(x):
    ...     away = x[:, None] - beacons
    ...     return away / np.linalg.norm(away, axis=-1, keepdims=True)
    >>> measured = ss.measure.Function(t, measured.residual, sigma=0.01, jacobian=directions)
    >>> bool(np.all(np.abs(ss.estimate([measured], 6, "r:2", lam=1e-6)(0.5) - [0.5, 0.25]) < 0.02))
    True
    """

    residual: AnyFunction
    nu: int
    parameters: dict[str, Constant]
    jacobian: AnyFunction | Literal["jax"] | None

    def __init__(
        self,
        t: TimesLike,
        residual: AnyFunction,
        *,
        sigma: ArrayLike,
        nu: int = 0,
        parameters: Mapping[str, Constant] | None = None,
        jacobian: AnyFunction | Literal["jax"] | None = None,
        factor: int | None = None,
        time_offset: Constant | None = None,
        loss: Loss | None = None,
    ) -> None:
        super().__init__(t, sigma, factor, time_offset, loss)
        if not callable(residual):
            raise ValidationError(f"residual must be a function, not {short_repr(residual)}")
        given = {} if parameters is None else parameters
        if not isinstance(given, Mapping) or not all(isinstance(constant, Constant) for constant in given.values()):
            raise ValidationError("parameters must be a mapping from names to symspline.measure.Constant")
        if not (jacobian is None or callable(jacobian) or (isinstance(jacobian, str) and jacobian == "jax")):
            raise ValidationError(f"jacobian must be a function, 'jax' or None, not {short_repr(jacobian)}")
        if isinstance(jacobian, str) and find_spec("jax") is None:
            raise ValidationError(
                "jacobian='jax' needs JAX, which is not installed. Run `pip install symspline[jax]`, pass a function "
                "that returns the derivatives, or omit jacobian for central differences."
            )
        self.residual, self.nu, self.parameters = residual, order_of(nu), dict(given)
        self.jacobian = jacobian


# Remedy in messages about missing samples.
SKIPNA = ". Pass skipna=True to omit missing samples."


def broadcast(value: ArrayLike, name: str, shape: tuple[int, ...], remedy: str = "") -> Doubles:
    """Return finite real numbers of a shape to which the value broadcasts."""
    array = as_array(value, name)
    if array.dtype.kind not in "iufb":
        raise ValidationError(f"{name} must be real numbers, not {array.dtype}")
    refuse(
        ~np.isfinite(array), name, lambda i: f"is {array[i]}, but must be finite{remedy if np.isnan(array[i]) else ''}"
    )
    try:
        return np.array(np.broadcast_to(cast(array), shape))
    except ValueError:
        raise ValidationError(f"{name} has shape {array.shape}, but {shape} is needed") from None


# ---- measurements without missing samples ----


def measurement_without_missing(given: Measurement) -> Measurement:
    """Return a measurement without the samples in which a number or the time is NaN, NaT or masked."""
    present = present_in(given)
    if present.all():
        return given
    measurement = copy(given)
    for name, value in {"t": filled(given.t), **_values(given)}.items():
        setattr(measurement, name, _rows(value, present))
    return measurement


def _values(given: Measurement) -> Keywords:
    """Return the arrays of a measurement besides its times."""
    return {
        name: filled(value)
        for name, value in vars(given).items()
        if name != "t" and not isinstance(value, (Constant, str)) and value is not None
    }


def present_in(given: Measurement) -> Mask:
    """Return which samples are complete."""
    t = as_array(times_of(filled(given.t), "t")[0], "t")
    present = ~missing_times(t)
    if isinstance(given, Function) or t.ndim != 1:
        return np.ones_like(present)
    for name, value in _values(given).items():
        if name not in ("sigma", "weights", "frames"):
            present = present & _present(value, len(t))
    return present


def _present(value: object, count: int) -> Mask:
    if isinstance(value, tuple):
        return np.asarray(np.all([_present(part, count) for part in map(filled, value)], axis=0))
    array = np.asarray(value)
    if array.dtype.kind not in "fc" or array.shape[:1] != (count,):
        return np.ones(count, bool)
    return np.asarray(~np.isnan(array).any(axis=tuple(range(1, array.ndim))))


def _rows(value: object, present: Mask) -> Any:
    return (
        tuple(_rows(filled(part), present) for part in value) if isinstance(value, tuple) else rows_of(value, present)
    )
