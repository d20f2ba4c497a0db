"""Measurements on the parts of a space, and the problem of an estimate, in the form that the core reads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import starmap
from operator import itemgetter
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._base.arrays import as_array, refuse
from .._base.typing import Loss, Progress
from .._core import ValidationError
from .._curves.fit import read
from .._smoothing.audit import roots_of
from .._smoothing.noise import grouped, join, parts_of_factor, read_precision, smoothed_spaces, split
from .._smoothing.report import Posterior, SmoothingReport, coordinates
from .._spaces import (
    AnySpace,
    Array,
    Doubles,
    Euclidean,
    Product,
    Space,
    SpecialEuclidean,
    SpecialOrthogonal,
    Sphere,
    factors_of,
    parts_of,
)
from .._spaces.actions import Group
from ..convert._quaternions import quaternion_to_matrix
from ..measure import (
    SKIPNA,
    BodyRates,
    Constant,
    Directions,
    Function,
    Measurement,
    Points,
    SpecificForce,
    Velocities,
    broadcast,
)
from .functions import Arguments, UserFunction

_SO3, _S3, _R3 = SpecialOrthogonal(3), Sphere(3), Euclidean(3)
# Directions count as normalised if their lengths differ from those of the references by less than this fraction of σ.
_NORMALISED = 0.1
# Values of the parameters by name.
Values = dict[str, Doubles]


class Term:
    """Measurements of one kind on the parts of a space.

    Attributes
    ----------
    label : str
        Name in messages.
    times : ndarray, shape (n,)
        Times of the core, without their unknown offset.
    parts : list of int
        Parts of the space on which the residuals depend.
    noise : ndarray, shape (n, d)
        Standard deviations.
    loss : str
        Loss of the residuals.
    rows : ndarray of int, shape (n,)
        Indices of these measurements among those passed by the user.
    constants : dict
        Parameters by name.
    arrays : list of ndarray
        Arrays of the sensor as the core reads them.
    slots : list of str or None
        Names of the parameters of the sensor in the order of the core.
    """

    sensor: str

    def __init__(self, label: str, given: Measurement, times: Doubles, parts: list[int]) -> None:
        self.label, self.given, self.times, self.parts = label, given, times, parts
        self.loss: Loss = given.loss or "linear"
        self.constants: dict[str, Constant] = {}
        self.noise: Doubles = np.empty((0, 0))
        self.rows = np.arange(len(times))
        self.time_offset = None if given.time_offset is None else self.name(given.time_offset, "time offset")
        self.arrays: list[Doubles] = []
        self.slots: list[str | None] = []

    def name(self, constant: Constant, default: str) -> str:
        """Register a parameter and return its name."""
        name = constant.name or default
        self.constants[name] = constant
        return name

    def shifted_times(self, values: Values) -> Doubles:
        """Return the times with the offset that is among the values of the parameters."""
        return self.times + (0.0 if self.time_offset is None else float(values[self.time_offset][0]))

    def informative(self, residuals: Doubles) -> Doubles:
        """Return whitened residuals for the audit; entries without information are NaN."""
        return residuals

    def spread(self, size: int) -> None:
        """Set the standard deviations of `size` residuals per measurement."""
        sigma: Any = self.given.sigma
        if sigma is None:
            raise ValidationError(f"{self.label} has no sigma. Pass the standard deviation of its noise.")
        array = as_array(sigma, f"{self.label}.sigma")
        if array.ndim == 1:
            array = array[:, None]
        self.noise = broadcast(array, f"{self.label}.sigma", (len(self.times), size))
        refuse(~(self.noise > 0), f"{self.label}.sigma", lambda i: f"must be > 0, not {self.noise[i]}")

    def numbers(self, value: ArrayLike, name: str, shape: tuple[int, ...]) -> Doubles:
        """Return finite real numbers of a shape."""
        return broadcast(value, f"{self.label}.{name}", shape, SKIPNA)

    def in_core(self, columns: dict[str, slice]) -> tuple[object, ...]:
        """Return the term in the form of the core, for the columns of all parameters."""
        places: list[tuple[int, int] | None] = []
        for name in self.slots:
            places.append(None if name is None else (columns[name].start, self.constants[name].size))
        offset = None if self.time_offset is None else columns[self.time_offset].start
        function = self.function(columns)
        # Functions return residuals in standard deviations.
        arrays = [self.times, self.noise if function is None else np.empty(0), *self.arrays]
        times, noise, *others = map(np.ascontiguousarray, arrays)
        return self.sensor, self.parts, times, noise, self.loss, offset, others, places, function

    def function(
        self, columns: dict[str, slice]
    ) -> tuple[Callable[..., Doubles], int, Callable[..., Doubles] | None] | None:
        """Return the function of the user, its highest derivative and its derivatives; None for sensors of the core."""
        return None


class PointTerm(Term):
    """Points. The residual is −log_γ(y), or R log_y(γ) in a frame at y for information matrices RᵀR.

    Attributes
    ----------
    y : ndarray, shape (n, *point_shape)
        Points.
    roots : ndarray, shape (n, m, m), or None
        Matrices R; None for equal noise in all directions.
    known : ndarray of bool, shape (n, m), or None
        Which of their rows have information.
    """

    def __init__(
        self,
        label: str,
        given: Points,
        times: Doubles,
        part: int,
        space: Space,
        y: Array,
        noise: Doubles,
        roots: Doubles | None = None,
        known: NDArray[np.bool_] | None = None,
    ) -> None:
        super().__init__(label, given, times, [part])
        self.y, self.noise, self.roots, self.known = y, noise, roots, known
        self.sensor = "points" if roots is None else "information"
        self.arrays = [_doubles(space, y)]
        if roots is not None:
            self.arrays += [_doubles(space, space.frame(y)), roots]

    @property
    def scales(self) -> Doubles:
        """Usual standard deviation of a coordinate of every point."""
        if self.roots is None:
            return self.noise[:, 0]
        information = np.mean(self.roots**2, axis=-1).sum(axis=-1)
        return np.asarray(self.noise[:, 0] / np.sqrt(np.maximum(information, np.finfo(float).tiny)))

    def informative(self, residuals: Doubles) -> Doubles:
        return residuals if self.known is None else np.where(self.known, residuals, np.nan)

    def precision(self, n: int) -> Doubles:
        """Return the inverse variances or covariances of all n points; those of points without weight are 0."""
        precisions = self.noise[:, 0] ** -2.0
        if self.roots is not None:
            precisions = np.swapaxes(self.roots, -1, -2) @ self.roots / self.noise[..., None] ** 2
        whole = np.zeros((n, *precisions.shape[1:]))
        whole[self.rows] = precisions
        return whole

    def residuals_at(self, space: Space, p: Array, frames: Array) -> Doubles:
        """Return the residuals at the points p of a curve with frames, before they are divided by σ."""
        if self.roots is None:
            return -coordinates(space, p, frames, space._apply("log", p=p, q=self.y))
        logs = coordinates(space, self.y, space.frame(self.y), space._apply("log", p=self.y, q=p))
        return np.asarray((self.roots @ logs[..., None])[..., 0])


class VelocityTerm(Term):
    """Velocities at measured points: the residual is the transported velocity minus the measured one."""

    sensor = "velocities"

    def __init__(self, label: str, given: Velocities, times: Doubles, part: int, space: Space, y: Any, v: Any) -> None:
        super().__init__(label, given, times, [part])
        self.y = points_on(space, y, len(times), f"{label}.y")
        vectors = space._numbers(space._doubles(v, f"{label}.v"))
        if vectors.shape != self.y.shape:
            raise ValidationError(f"{label}.v has shape {np.shape(v)}, but {self.y.shape} is needed")
        try:
            space.check_tangent(self.y, vectors)
        except ValidationError as error:
            raise ValidationError(f"{label}.v: {error}") from None
        self.arrays = [_doubles(space, x) for x in (self.y, vectors, space.frame(self.y))]
        self.spread(space.dim)


class RateTerm(Term):
    """Velocities in the moving frame of a group."""

    sensor = "rates"

    def __init__(self, label: str, given: BodyRates, times: Doubles, part: int, space: Space) -> None:
        super().__init__(label, given, times, [part])
        self.body = body_of(space)
        self.omega = self.body.components(given.omega, f"{label}.omega", len(times))
        self.spread(self.body.size)
        self.bias = None
        if given.bias is not None:
            self.bias = self.name(_of_size(given.bias, self.body.size, f"{label}.bias"), "gyro bias")
        self.arrays, self.slots = [self.omega, self.body.inverse], [self.bias]


class DirectionTerm(Term):
    """Known directions in the frame of the body: the residual is Rᵀr − s."""

    sensor = "directions"

    def __init__(self, label: str, given: Directions, times: Doubles, part: int, space: Space) -> None:
        super().__init__(label, given, times, [part])
        if space not in (_SO3, _S3):
            raise ValidationError(f"{label} needs rotations 'so:3', 'sphere:3' or 'se:3', not {space!r}")
        n = len(times)
        seen = as_array(given.seen, f"{label}.seen")
        if seen.ndim not in (2, 3) or seen.shape[-1] != 3 or seen.shape[0] != n:
            raise ValidationError(f"{label}.seen has shape {seen.shape}, but ({n}, 3) or ({n}, k, 3) is needed")
        several = seen.ndim == 3
        shape = (n, seen.shape[1] if several else 1, 3)
        self.seen = self.numbers(seen if several else seen[:, None], "seen", shape)
        reference = as_array(given.reference, f"{label}.reference")
        if not several and reference.ndim == 2:
            reference = reference[:, None]
        self.reference = self.numbers(reference, "reference", shape)
        self.spread(3 * shape[1])
        self.arrays = [self.seen, self.reference]

    def informative(self, residuals: Doubles) -> Doubles:
        lengths, known = (np.linalg.norm(vectors, axis=-1) for vectors in (self.seen, self.reference))
        sigma = self.noise.reshape(self.seen.shape)[..., 0]
        if np.any(np.abs(lengths - known) > _NORMALISED * sigma) or np.any(lengths == 0):
            return residuals
        # Normalised vectors have no noise along their direction, so that the residuals have two coordinates.
        along = np.eye(3)[np.abs(self.seen).argmin(axis=-1)]
        first = np.cross(self.seen, along)
        first /= np.linalg.norm(first, axis=-1, keepdims=True)
        second = np.cross(self.seen / lengths[..., None], first)
        rows = residuals.reshape(self.seen.shape)
        flat = np.stack([(rows * axis).sum(axis=-1) for axis in (first, second)], axis=-1)
        return flat.reshape(len(residuals), -1)


class ForceTerm(Term):
    """Accelerations without gravity in the frame of the body."""

    sensor = "force"

    def __init__(self, label: str, given: SpecificForce, times: Doubles, parts: list[int]) -> None:
        super().__init__(label, given, times, parts)
        self.f = self.numbers(given.f, "f", (len(times), 3))
        self.gravity = self.numbers(given.gravity, "gravity", (3,))
        bias = arm = None
        fixed_arm = np.empty(0)
        if given.bias is not None:
            bias = self.name(_of_size(given.bias, 3, f"{label}.bias"), "accelerometer bias")
        if isinstance(given.lever_arm, Constant):
            arm = self.name(_of_size(given.lever_arm, 3, f"{label}.lever_arm"), "lever arm")
        elif given.lever_arm is not None:
            fixed_arm = self.numbers(given.lever_arm, "lever_arm", (3,))
        self.spread(3)
        self.arrays, self.slots = [self.f, self.gravity, fixed_arm], [bias, arm]


class FunctionTerm(Term):
    """Measurements given by a function of the user."""

    sensor = "function"

    def __init__(self, label: str, given: Function, times: Doubles, parts: list[int], spaces: Sequence[Space]) -> None:
        super().__init__(label, given, times, parts)
        self.nu = given.nu
        # The space of the points that the function receives, and its parts.
        self.space, *self.spaces = spaces
        self.names = {key: self.name(constant, key) for key, constant in given.parameters.items()}
        self.slots = list(self.names.values())
        self.user = UserFunction(label, given)

    def function(self, columns: dict[str, slice]) -> tuple[Callable[..., Doubles], int, Callable[..., Doubles] | None]:
        """Return the function that the core calls with the motion and all parameters, with its derivatives."""

        def arguments(states: list[list[Doubles]], values: Doubles) -> Arguments:
            motion = [self._joined(state, float(nu == 0)) for nu, state in enumerate(states)]
            return Arguments(motion, {key: values[columns[name]].copy() for key, name in self.names.items()})

        def whitened(states: list[list[Doubles]], values: Doubles) -> Doubles:
            return np.ascontiguousarray(self._checked(self.user(arguments(states, values))) / self.noise)

        def derivatives(
            states: list[list[Doubles]], values: Doubles, changes: list[tuple[int, list[Doubles]]]
        ) -> Doubles:
            at, directions = arguments(states, values), []
            for part, arrays in changes:
                moved = [[np.zeros_like(rows) for rows in state] for state in states]
                for state, rows in zip(moved, arrays, strict=False):
                    # Empty arrays vanish.
                    state[part] = rows if rows.size else state[part]
                directions.append([self._joined(state, 0.0) for state in moved])
            found = self.user.derivatives(at, directions)
            return np.ascontiguousarray((found / self.noise[..., None]).reshape(-1, found.shape[-1]))

        return whitened, self.nu, None if self.user.given.jacobian is None else derivatives

    def _checked(self, value: ArrayLike) -> Doubles:
        n = len(self.times)
        array = np.asarray(value)
        if array.dtype.kind not in "iufb" or array.ndim not in (1, 2) or array.shape[0] != n:
            raise ValidationError(
                f"{self.label}: the function returned {array.dtype} of shape {array.shape}, but real residuals of "
                f"shape ({n}, k) or ({n},) are needed, one row per time"
            )
        result = array.reshape(n, -1).astype(np.float64)
        bad = np.flatnonzero(~np.isfinite(result).all(axis=1))
        if len(bad):
            raise ValidationError(
                f"{self.label}: the residual of sample {bad[0]} is {result[bad[0]]}. Return finite residuals, or leave "
                "that sample out."
            )
        if not self.noise.size:
            self.spread(result.shape[1])
        elif result.shape != self.noise.shape:
            raise ValidationError(f"{self.label}: the number of residuals changed from {self.noise.shape[1]}")
        return result

    def informative(self, residuals: Doubles) -> Doubles:
        # Functions return 0 for samples without a measurement.
        return np.where(residuals == 0, np.nan, residuals)

    def _joined(self, state: list[Doubles], corner: float) -> Any:
        """Combine the arrays of all parts into those of the space."""
        rest = [space._numbers(doubles) for space, doubles in zip(self.spaces, state, strict=True)]
        points_of_factors = []
        for factor in factors_of(self.space):
            count = len(parts_of_factor(factor))
            points_of_factors.append(join(factor, rest[:count], corner))
            rest = rest[count:]
        return tuple(points_of_factors) if isinstance(self.space, Product) else points_of_factors[0]


class Body:
    """Velocities of a curve in a group in the moving frame.

    Attributes
    ----------
    is_rotation : bool
        Whether the components are those of an angular velocity.
    size : int
        Number of components.
    inverse : ndarray, shape (size, numbers) or (0,)
        Matrix that converts matrices g⁻¹g' to their coordinates in the frame at the identity; empty for rotations.
    """

    def __init__(self, space: Space) -> None:
        self.space = space
        self.is_rotation = space in (_SO3, _S3)
        self.size = 3 if self.is_rotation else space.dim
        self.inverse: Doubles = np.empty(0)
        if not self.is_rotation:
            frame = space._as_doubles(space.frame(np.eye(space.point_shape[0], dtype=space.dtype)))
            self.inverse = np.asarray(np.linalg.pinv(frame.reshape(self.size, -1).T), np.float64)

    def matrices(self, p: Array) -> Doubles:
        """Return rotation matrices."""
        return p if self.space == _SO3 else quaternion_to_matrix(p, scalar_first=True)

    def components(self, omega: ArrayLike, name: str, n: int) -> Doubles:
        """Return components from the user's angular velocities or matrices."""
        if self.is_rotation:
            return broadcast(_exact(omega, name, (n, 3)), name, (n, 3), SKIPNA)
        vectors = self.space._numbers(self.space._doubles(omega, name))
        _exact(vectors, name, (n, *self.space.point_shape))
        refuse(~self.space._where_finite(vectors), name, lambda i: f"is not finite{SKIPNA}")
        return _doubles(self.space, vectors).reshape(n, -1) @ self.inverse.T


@cache
def body_of(space: Space) -> Body:
    """Return the body that turns as a curve on a space does."""
    return Body(space)


def projected(space: Space, points: Array) -> Array:
    """Return the points of a space that are closest to the given ones, without checks."""
    rows = _doubles(space, points)
    return space._numbers(space._handle.apply("project", [rows]).reshape(rows.shape))


def _doubles(space: Space, rows: Array) -> Doubles:
    return np.ascontiguousarray(space._as_doubles(rows))


def _exact(value: ArrayLike, name: str, shape: tuple[int, ...]) -> Array:
    array = as_array(value, name)
    if array.shape != shape:
        raise ValidationError(f"{name} has shape {array.shape}, but {shape} is needed: one row per time")
    return array


def _of_size(constant: object, size: int, name: str) -> Constant:
    if not isinstance(constant, Constant) or constant.size != size:
        raise ValidationError(f"{name} must be a Constant of size {size}")
    return constant


def points_on(space: Space, y: ArrayLike, n: int, name: str) -> Array:
    """Return n points of a space."""
    array = space._array(y, name)
    doubles = space._doubles(array, name)
    points = space._numbers(doubles)
    if points.shape != (n, *space.point_shape):
        raise ValidationError(f"{name} has shape {array.shape}, but {(n, *space.point_shape)} is needed")
    refuse(
        ~space._where_finite(points),
        name,
        lambda i: f"is not finite. Remove it{', or pass skipna=True' if np.isnan(points[i]).any() else ''}.",
    )
    try:
        space._handle.check_points(space._rows(doubles, (n,)), (n,), space._tol(array))
    except ValidationError as error:
        raise ValidationError(f"{name}: {error}") from None
    return projected(space, points)


def bind(measurement: Measurement, label: str, times: Doubles, space: AnySpace, loss: Loss = "linear") -> list[Term]:
    """Return the terms of a measurement on a space, after all checks. `loss` is for measurements without their own."""
    terms = _terms_of(measurement, label, times, space)
    for term in terms:
        term.loss = measurement.loss or loss
    return terms


def _terms_of(measurement: Measurement, label: str, times: Doubles, space: AnySpace) -> list[Term]:
    spaces, chosen = smoothed_spaces(space), space
    parts, spaces_of_parts = list(range(len(spaces))), list(spaces)
    number = measurement.factor
    if number is not None:
        factors = factors_of(space)
        if isinstance(number, bool) or not isinstance(number, (int, np.integer)) or not 0 <= number < len(factors):
            raise ValidationError(f"{label}.factor must be a factor of {space!r}, 0 to {len(factors) - 1}")
        chosen = factors[number]
        parts, spaces_of_parts = grouped(space, parts)[number], grouped(space, spaces)[number]
    if isinstance(measurement, Points):
        y: Any = measurement.y
        if isinstance(chosen, SpecialEuclidean) and not isinstance(y, tuple):
            # The positions or the rotations of poses.
            y = chosen._array(y, f"{label}.y")
            shape = y.shape[1:]
            for part in parts:
                if shape == spaces[part].point_shape:
                    return _points(measurement, label, times, spaces[part], {part: spaces[part]})
        return _points(measurement, label, times, chosen, dict(zip(parts, spaces_of_parts, strict=True)))
    if isinstance(measurement, Function):
        return [FunctionTerm(label, measurement, times, parts, [chosen, *spaces_of_parts])]
    if isinstance(measurement, SpecificForce):
        turning = [part for part, one in zip(parts, spaces_of_parts, strict=True) if one in (_SO3, _S3)]
        moving = [part for part, one in zip(parts, spaces_of_parts, strict=True) if one == _R3]
        if len(turning) != 1 or len(moving) != 1:
            raise ValidationError(f"{label} needs one rotation and one position, such as 'so:3 x r:3', not {space!r}")
        return [ForceTerm(label, measurement, times, [turning[0], moving[0]])]
    if isinstance(measurement, (BodyRates, Directions)):
        groups = [part for part in parts if _is_group(spaces[part])]
        if len(groups) != 1:
            raise ValidationError(f"{label} needs one group, such as 'so:3'. Pass factor= if {space!r} has several.")
        part = groups[0]
        kind: Any = RateTerm if isinstance(measurement, BodyRates) else DirectionTerm
        return [kind(label, measurement, times, part, spaces[part])]
    assert isinstance(measurement, Velocities)
    terms: list[Term] = []
    points = _in_parts(measurement.y, chosen, f"{label}.y")
    vectors = _in_parts(measurement.v, chosen, f"{label}.v")
    for part, y, v, sigma in zip(parts, points, vectors, _sigmas(measurement, len(parts), label), strict=True):
        term = Velocities(measurement.t, y, v, sigma=sigma, time_offset=measurement.time_offset, loss=measurement.loss)
        terms.append(VelocityTerm(label, term, times, part, spaces[part], y, v))
    return terms


def _is_group(space: Space) -> bool:
    return space == _S3 or isinstance(space, Group)


def is_compact_group(space: Space) -> bool:
    """Whether a space is a group whose metric is invariant on both sides."""
    return space == _S3 or (isinstance(space, Group) and space._unitary)


def _in_parts(value: Any, space: AnySpace, name: str) -> list[Array]:
    """Return the points or vectors of each part."""
    values = parts_of(value, space, name) if isinstance(space, Product) else (value,)
    values_of_parts: list[Array] = []
    for factor, of_factor in zip(factors_of(space), values, strict=True):
        if len(parts_of_factor(factor)) > 1:
            of_factor = factor._numbers(factor._doubles(of_factor, name))
        values_of_parts += split(factor, of_factor)
    return values_of_parts


def _sigmas(measurement: Measurement, count: int, label: str) -> Sequence[Any]:
    """Return the standard deviation of each part."""
    sigma = measurement.sigma
    if not isinstance(sigma, tuple):
        return [sigma] * count
    if len(sigma) != count:
        raise ValidationError(
            f"{label}.sigma has {len(sigma)} entries, but there are {count} parts. Pass one per part."
        )
    return sigma


def _points(given: Points, label: str, times: Doubles, space: AnySpace, parts: dict[int, Space]) -> list[Term]:
    """Return the terms of points of a space with these parts, by their numbers."""
    n = len(times)
    precisions = None
    if given.weights is not None:
        if n < 2:
            raise ValidationError(f"{label}.weights needs at least two points. Pass sigma instead.")
        precisions = read_precision(given.weights, given.frames, space, read(given.y, space))
    terms: list[Term] = []
    arrays, sigmas = _in_parts(given.y, space, f"{label}.y"), _sigmas(given, len(parts), label)
    for k, ((part, space_of_part), y, sigma) in enumerate(zip(parts.items(), arrays, sigmas, strict=True)):
        information = None if precisions is None else precisions[k].information
        if sigma is None:
            if information is None:
                raise ValidationError(f"{label} has no sigma. Pass the standard deviation of its noise.")
            # Information matrices are inverse covariances.
            sigma = 1.0
        scale = broadcast(sigma, f"{label}.sigma", (n,))
        refuse(~(scale > 0), f"{label}.sigma", lambda i: "must be > 0")
        used = np.ones(n, bool) if precisions is None else precisions[k].weights > 0
        rows = space_of_part._numbers(space_of_part._doubles(y, f"{label}.y"))
        if rows.shape[:1] != (n,):
            raise ValidationError(f"{label}.y has {len(rows)} points, but there are {n} times")
        good = points_on(space_of_part, rows[used], int(used.sum()), f"{label}.y")
        scale = scale[used]
        roots = () if information is None else roots_of(information[used])
        if information is None and precisions is not None:
            scale = scale / np.sqrt(precisions[k].weights[used])
        noise = np.repeat(scale[:, None], space_of_part.dim, axis=1)
        term = PointTerm(label, given, times[used], part, space_of_part, good, noise, *roots)
        term.rows = np.flatnonzero(used)
        terms.append(term)
    return terms


# ---- the problem and its solution ----

# If the curve turns by more than this angle between two knots, the solution of the linear problem may differ from the
# minimum. The difference is then estimated from this number of samples.
_TURN, _SAMPLES = 0.9, 6
# Number of times that the way in which λ varies is found.
_ADAPTATIONS = 2
_FAILURES = {
    "undetermined": "The measurements do not determine the curve: no measurement depends on one of its factors, or on "
    "one of its knots. Pass fewer knots, a larger lam, or more measurements.",
    "infinite": "The linear problem has no finite solution: its numbers are too different in size. Check sigma and the "
    "units of the measurements, or pass fewer knots.",
    "no curve": "No spline joins the points of the next iteration. Pass more knots, or a larger lam.",
    "unconverged": "No convergence of the estimate: the last step is {step:.1e} standard deviations after {number} "
    "iterations (tol {tol:.1e}). Check sigma and the units, or pass lam or a better `start`.",
}


@dataclass
class Setup:
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
    adapts : tuple of bool
        Whether λ varies along the curve if the measurements require it, for each part.
    profiles : tuple of ndarray or None, shape (knots - 1,)
        λ of the segments divided by λ, for each part; None for one λ.
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
    adapts: tuple[bool, ...] = ()
    profiles: tuple[Doubles | None, ...] = ()

    @property
    def bc_type(self) -> Literal["natural", "not-a-knot"]:
        """End conditions of the curves."""
        return "natural" if self.penalty == "acceleration" else "not-a-knot"

    def with_knots(self, knots: Doubles) -> Setup:
        """Return the same problem for other knots."""
        # Both have the same arrays.
        _ = self._arrays
        other = copy(self)
        other.knots = knots
        return other

    def with_profiles(self, profiles: Sequence[Doubles | None]) -> Setup:
        """Return the same problem with λ of the segments of each part."""
        _ = self._arrays
        other = copy(self)
        other.profiles = tuple(profiles)
        return other

    @cached_property
    def columns(self) -> dict[str, slice]:
        """Columns of the parameters by name, in the order of the core."""
        columns, start = {}, 0
        for name, constant in self.constants.items():
            columns[name] = slice(start, start + constant.size)
            start += constant.size
        return columns

    @cached_property
    def least_squares(self) -> bool:
        """Whether no loss is robust."""
        return {term.loss for term in self.terms} <= {"linear"}

    def in_core(self, points: list[Array], values: Values) -> tuple[_core._Problem, list[Doubles], Doubles]:
        """Return the problem, and points and values of parameters, in the form of the core.

        Missing values are those of the start.
        """
        handles, groups, priors, terms = self._arrays
        starts = [np.empty(0)]
        for name, constant in self.constants.items():
            starts.append(values.get(name, constant.start))
        profiles = list(self.profiles) or [None] * len(self.spaces)
        problem = handles, groups, self.knots, self.penalty, priors, terms, profiles
        return problem, list(map(_doubles, self.spaces, points)), np.concatenate(starts)

    @cached_property
    def _arrays(self) -> tuple[list[_core.Handle], list[Doubles | None], Doubles, list[tuple[object, ...]]]:
        """The part of `in_core` that does not depend on the knots."""
        priors = [np.empty((0, 2))]
        for constant in self.constants.values():
            precision = np.zeros(constant.size) if constant.sigma is None else constant.sigma**-2.0
            priors.append(np.stack([constant.start, precision], axis=-1))
        handles: list[_core.Handle] = []
        groups: list[Doubles | None] = []
        for space in self.spaces:
            handles.append(space._handle)
            groups.append(np.ascontiguousarray(body_of(space).inverse) if is_compact_group(space) else None)
        terms = []
        for term in self.terms:
            terms.append(term.in_core(self.columns))
        return handles, groups, np.concatenate(priors), terms


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
    posterior : Posterior
        The matrix of the linear problem, which couples the coordinates of all parts and the parameters.
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
    failure : str
        Description of a failure, or "".
    """

    points: list[Array]
    values: Values
    reports: list[SmoothingReport]
    posterior: Posterior
    covariance: Doubles
    rows: list[Rows]
    variances: Doubles
    loss: float
    turn: float
    failure: str


def iterate(
    setup: Setup, points: list[Array], values: Values, progress: Progress | None, near: list[float] | None = None
) -> Solution:
    """Iterate from points at the knots until the step is small; `near` are λ of a curve close to the result."""
    problem, start, constants = setup.in_core(points, values)
    lams = setup.lams.tolist()
    options = setup.criterion, setup.gamma, setup.tol, setup.max_iter
    raw = _core.estimate(problem, start, constants, lams, near or [np.nan] * len(lams), *options, progress)
    if isinstance(raw, np.ndarray):
        raise _undetermined(setup, raw)
    failed, number, step = raw["failure"], raw["iterations"], raw["step"]
    reports, solved_points = [], []
    solved_values: Values = {}
    for lam, bound, df in zip(raw["lams"], raw["at_bound"], raw["df"], strict=True):
        report = SmoothingReport("linearized", failed is None, number, step, raw["rate"], lam, bound, df, raw["sigma"])
        reports.append(report)
    for space, rows in zip(setup.spaces, raw["points"], strict=True):
        solved_points.append(space._numbers(rows))
    for name, index in setup.columns.items():
        solved_values[name] = raw["values"][index]
    information, covariance = raw["information"], np.full_like(raw["information"], np.nan)
    if np.isfinite(information).all():
        covariance = np.asarray(np.linalg.pinv(information, hermitian=True), np.float64)
    band, side, corner = raw["matrices"]
    return Solution(
        solved_points,
        solved_values,
        reports,
        Posterior(band, np.zeros((0, 0)), raw["variances"].shape[1], side, corner),
        covariance,
        list(starmap(Rows, raw["terms"])),
        raw["variances"],
        raw["loss"],
        raw["turn"],
        "" if failed is None else _FAILURES[failed].format(step=step, number=number, tol=setup.tol),
    )


def with_varying_lams(setup: Setup, solution: Solution, progress: Progress | None) -> tuple[Setup, Solution]:
    """Let λ vary along the curve where the measurements require it, from a solution with one λ in each part."""
    parts = [part for part, adapts in enumerate(setup.adapts) if adapts]
    if not parts or solution.failure:
        return setup, solution
    varied, best = setup, solution
    for _ in range(_ADAPTATIONS):
        lams = [float(report.lam) for report in best.reports]
        gains: list[float | None] = [None] * len(setup.spaces)
        profiles: list[Doubles | None] = list(setup.profiles) or [None] * len(setup.spaces)
        varying = _core.varying_lams(*setup.in_core(best.points, best.values), lams, parts)
        for part, (gain, profile) in zip(parts, varying, strict=True):
            gains[part], profiles[part] = gain, profile
        varied = setup.with_profiles(profiles)
        constant = not any(profile is not None for _, profile in varying)
        best = solution if constant else iterate(varied, best.points, best.values, progress)
        pairs = zip(best.reports, gains, strict=True)
        best = best._replace(reports=[replace(report, gain=gain) for report, gain in pairs])
        if best.failure or constant:
            break
    return varied, best


def distance_from_minimum(setup: Setup, solution: Solution) -> float:
    """Return the distance of a solution from the minimum in standard deviations; 0 if it turns little between knots."""
    if solution.turn <= _TURN:
        return 0.0
    lams = [float(report.lam) for report in solution.reports]
    normal = np.random.default_rng(0).standard_normal((_SAMPLES, solution.variances.size))
    problem = setup.in_core(solution.points, solution.values)
    return _core.distance_from_minimum(*problem, lams, solution.posterior.band, normal)


def residuals(setup: Setup, points: list[Array], values: Values) -> list[Doubles] | None:
    """Return the residuals of all terms for the spline through points at the knots; None if it does not exist."""
    of_terms = _core.linearise(*setup.in_core(points, values), False)
    # The first entry of the rows of each term.
    return None if of_terms is None else list(map(itemgetter(0), of_terms))


def _undetermined(setup: Setup, information: Doubles) -> ValidationError:
    """Return the error that names the parameters that the measurements do not determine."""
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    unit = np.where(size > 0, size, 1.0)
    vectors = np.linalg.eigh(information / unit / unit[:, None])[1]
    vector = vectors[:, 0] / unit if np.all(size > 0) else (size == 0).astype(float)
    vector = vector / vector[np.abs(vector).argmax()]
    parts = {name: vector[index] for name, index in setup.columns.items()}
    described = {name: np.round(part, 3).tolist() for name, part in parts.items() if np.abs(part).max() > 1e-3}
    return ValidationError(
        f"The measurements do not determine {' and '.join(map(repr, described))} in the direction {described}. Pass "
        "a Constant with sigma, which is a prior, or measurements that depend on it."
    )
