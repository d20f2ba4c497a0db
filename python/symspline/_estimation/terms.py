"""Residuals of measurements at a curve, and their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import as_array, refuse
from .._core import ValidationError
from .._curves.fit import read
from .._smoothing.audit import roots_of
from .._smoothing.factors import join, parts_of_factor, smoothed_spaces, split
from .._smoothing.posterior import coordinates
from .._smoothing.precision import read_precision
from .._spaces import (
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
from .along import STEP, Motion
from .measurements import (
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

_SO3, _S3, _R3 = SpecialOrthogonal(3), Sphere(3), Euclidean(3)
# Directions count as normalised if their lengths differ from those of the references by less than this fraction of σ.
_NORMALISED = 0.1
# Values of the parameters by name.
Values = dict[str, Doubles]


class Linearised(NamedTuple):
    """Residuals at a curve and their derivatives, whitened: their noise has variance one.

    Attributes
    ----------
    residuals : ndarray, shape (n, d)
        What the sensors would read minus what they read.
    jacobians : list
        Derivatives with respect to the move of the curve, its velocity and its acceleration, in coordinates of the
        frames of every part: for each order a dict from parts to arrays of shape (n, d, dim).
    parameters : dict
        Derivatives with respect to the parameters by name, shape (n, d, size).
    """

    residuals: Doubles
    jacobians: list[dict[int, Doubles]]
    parameters: dict[str, Doubles]


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
    nu : int
        Highest derivative that the residuals need.
    noise : ndarray, shape (n, d)
        Standard deviations.
    rows : ndarray of int, shape (n,)
        Indices of these measurements among those passed by the user.
    constants : dict
        Parameters by name.
    """

    nu = 0

    def __init__(self, label: str, given: Measurement, times: Doubles, parts: list[int]) -> None:
        self.label, self.given, self.times, self.parts = label, given, times, parts
        self.constants: dict[str, Constant] = {}
        self.noise: Doubles = np.empty((0, 0))
        self.rows = np.arange(len(times))
        self.time_offset = None if given.time_offset is None else self.name(given.time_offset, "time offset")

    def name(self, constant: Constant, default: str) -> str:
        """Register a parameter and return its name."""
        name = constant.name or default
        self.constants[name] = constant
        return name

    def shifted_times(self, values: Values) -> Doubles:
        """Return the times with the offset that is among the values of the parameters."""
        return self.times + (0.0 if self.time_offset is None else float(values[self.time_offset][0]))

    def measure(self, motion: list[Motion], values: Values) -> Doubles:
        """Return the residuals, shape (n, d)."""
        raise NotImplementedError

    def derivatives(self, motion: list[Motion], values: Values) -> tuple[list[dict[int, Doubles]], dict[str, Doubles]]:
        """Return the derivatives of the residuals by central differences."""
        found: list[dict[int, Doubles]] = [{}, {}, {}]
        for i, (part, own) in enumerate(zip(self.parts, motion, strict=True)):
            for nu in range(self.nu + 1):
                step = own.scale(nu)

                def at(j: int, size: float, i: int = i, own: Motion = own, nu: int = nu) -> Doubles:
                    moved = [*motion[:i], own.moved(j, nu, size), *motion[i + 1 :]]
                    return self.measure(moved, values)

                columns = [(at(j, step) - at(j, -step)) / (2 * step) for j in range(own.space.dim)]
                found[nu][part] = np.stack(columns, axis=-1)
        return found, self.of_parameters(motion, values)

    def of_parameters(self, motion: list[Motion], values: Values) -> dict[str, Doubles]:
        """Return the derivatives with respect to the parameters by central differences."""
        found = {}
        for name, constant in self.constants.items():
            if name == self.time_offset:
                continue
            columns = []
            for k in range(constant.size):
                step = STEP * (1.0 + abs(values[name][k]))

                def at(size: float, name: str = name, k: int = k) -> Doubles:
                    own = values[name].copy()
                    own[k] += size
                    return self.measure(motion, values | {name: own})

                columns.append((at(step) - at(-step)) / (2 * step))
            found[name] = np.stack(columns, axis=-1)
        return found

    def informative(self, residuals: Doubles) -> Doubles:
        """Return whitened residuals for the audit; entries without information are NaN."""
        return residuals

    def linearised(
        self,
        motion_at: Callable[[Doubles, list[int], int], list[Motion]],
        values: Values,
        spacing: float,
        derivatives: bool = True,
    ) -> Linearised:
        """Linearise the measurements.

        Parameters
        ----------
        motion_at : callable
            Function that returns the motion at times, of some parts, with derivatives up to an order.
        values : dict
            Values of the parameters.
        spacing : float
            Mean distance of the knots.
        derivatives : bool
            Whether to compute derivatives in addition to the residuals.
        """
        times = self.shifted_times(values)
        motion = motion_at(times, self.parts, self.nu)
        residuals = self.measure(motion, values)
        if not derivatives:
            return Linearised(residuals / self.noise, [{}, {}, {}], {})
        jacobians, parameters = self.derivatives(motion, values)
        if self.time_offset is not None:
            step = STEP * spacing
            after, before = (
                self.measure(motion_at(times + side, self.parts, self.nu), values) for side in (step, -step)
            )
            parameters[self.time_offset] = ((after - before) / (2 * step))[..., None]
        each = self.noise[..., None]
        return Linearised(
            residuals / self.noise,
            [{part: own / each for part, own in by_part.items()} for by_part in jacobians],
            {name: own / each for name, own in parameters.items()},
        )

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

    def numbers(self, value: Any, name: str, shape: tuple[int, ...]) -> Doubles:
        """Return finite real numbers of a shape."""
        return broadcast(value, f"{self.label}.{name}", shape, SKIPNA)


class PointTerm(Term):
    """Points with equal noise in all directions: the residual is −log_γ(y)."""

    def __init__(self, label: str, given: Points, times: Doubles, part: int, y: Array, noise: Doubles) -> None:
        super().__init__(label, given, times, [part])
        self.y, self.noise = y, noise

    def measure(self, motion: list[Motion], values: Values) -> Doubles:
        (own,) = motion
        return -own.coordinates(own.space._apply("log", p=own.p, q=self.y))

    def derivatives(self, motion: list[Motion], values: Values) -> tuple[list[dict[int, Doubles]], dict[str, Doubles]]:
        # The gradient of d²/2 is −log_γ(y), so that the identity yields the exact gradient.
        m = motion[0].space.dim
        unit = np.broadcast_to(np.eye(m), (len(self.times), m, m))
        return [{self.parts[0]: unit}, {}, {}], {}

    def precision(self, n: int) -> Doubles:
        """Return the inverse variances of all n points; those of points without weight are 0."""
        found = np.zeros(n)
        found[self.rows] = self.noise[:, 0] ** -2.0
        return found


class InformationTerm(Term):
    """Points with information matrices: the residual is R log_y(γ) in a frame at y, with the matrices RᵀR."""

    def __init__(
        self, label: str, given: Points, times: Doubles, part: int, y: Array, roots: Doubles, known: NDArray[np.bool_]
    ) -> None:
        super().__init__(label, given, times, [part])
        self.y, self.roots, self.known = y, roots, known

    def measure(self, motion: list[Motion], values: Values) -> Doubles:
        (own,) = motion
        logs = own.space._apply("log", p=self.y, q=own.p)
        result: Doubles = np.einsum(
            "nij,nj->ni", self.roots, coordinates(own.space, self.y, own.space.frame(self.y), logs)
        )
        return result

    def informative(self, residuals: Doubles) -> Doubles:
        return np.where(self.known, residuals, np.nan)

    def precision(self, n: int) -> Doubles:
        """Return the inverse covariances of all n points; those of points without weight are 0."""
        found = np.zeros((n, *self.roots.shape[1:]))
        found[self.rows] = np.swapaxes(self.roots, -1, -2) @ self.roots / self.noise[..., None] ** 2
        return found


class VelocityTerm(Term):
    """Velocities at measured points: the residual is the transported velocity minus the measured one."""

    nu = 1

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
        self.v, self.frame = vectors, space.frame(self.y)
        self.spread(space.dim)

    def measure(self, motion: list[Motion], values: Values) -> Doubles:
        (own,) = motion
        there = own.space._apply("transport", p=own.p, q=self.y, v=own.v)
        return coordinates(own.space, self.y, self.frame, there - self.v)


class RateTerm(Term):
    """Velocities in the moving frame of a group."""

    nu = 1

    def __init__(self, label: str, given: BodyRates, times: Doubles, part: int, space: Space) -> None:
        super().__init__(label, given, times, [part])
        self.body = Body(space)
        given_rates = self.body.components(given.omega, f"{label}.omega", len(times))
        self.omega = given_rates
        self.spread(self.body.size)
        self.bias = None
        if given.bias is not None:
            self.bias = self.name(_of_size(given.bias, self.body.size, f"{label}.bias"), "gyro bias")

    def measure(self, motion: list[Motion], values: Values) -> Doubles:
        (own,) = motion
        read = self.body.rates(own.p, own.v)
        return (read if self.bias is None else read + values[self.bias]) - self.omega

    def derivatives(self, motion: list[Motion], values: Values) -> tuple[list[dict[int, Doubles]], dict[str, Doubles]]:
        (own,) = motion
        half, first = self.body.derivatives(own.p, own.v, own.frames)
        part = self.parts[0]
        parameters = {}
        if self.bias is not None:
            size = self.body.size
            parameters[self.bias] = np.broadcast_to(np.eye(size), (len(self.times), size, size))
        return [{part: half}, {part: first}, {}], parameters


class DirectionTerm(Term):
    """Known directions in the frame of the body: the residual is Rᵀr − s."""

    def __init__(self, label: str, given: Directions, times: Doubles, part: int, space: Space) -> None:
        super().__init__(label, given, times, [part])
        if space not in (_SO3, _S3):
            raise ValidationError(f"{label} needs rotations 'so:3', 'sphere:3' or 'se:3', not {space!r}")
        self.body, n = Body(space), len(times)
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

    def _turned(self, p: Array) -> Doubles:
        """Return Rᵀr, shape (n, k, 3)."""
        return np.asarray(np.einsum("nij,nki->nkj", self.body.matrices(p), self.reference))

    def measure(self, motion: list[Motion], values: Values) -> Doubles:
        return (self._turned(motion[0].p) - self.seen).reshape(len(self.times), -1)

    def informative(self, residuals: Doubles) -> Doubles:
        lengths, known = (np.linalg.norm(own, axis=-1) for own in (self.seen, self.reference))
        sigma = self.noise.reshape(self.seen.shape)[..., 0]
        if np.any(np.abs(lengths - known) > _NORMALISED * sigma) or np.any(lengths == 0):
            return residuals
        # Normalised vectors have no noise along their direction, so that the residuals have two coordinates.
        along = np.eye(3)[np.abs(self.seen).argmin(axis=-1)]
        first = np.cross(self.seen, along)
        first /= np.linalg.norm(first, axis=-1, keepdims=True)
        second = np.cross(self.seen / lengths[..., None], first)
        each = residuals.reshape(self.seen.shape)
        flat = np.stack([(each * own).sum(axis=-1) for own in (first, second)], axis=-1)
        return flat.reshape(len(residuals), -1)

    def derivatives(self, motion: list[Motion], values: Values) -> tuple[list[dict[int, Doubles]], dict[str, Doubles]]:
        # δ(Rᵀr) = −η × Rᵀr.
        (own,) = motion
        turned = self._turned(own.p)
        columns = [
            np.cross(turned, self.body.rates(own.p, own.frames[:, j])[:, None]).reshape(len(self.times), -1)
            for j in range(own.space.dim)
        ]
        return [{self.parts[0]: np.stack(columns, axis=-1)}, {}, {}], {}


class ForceTerm(Term):
    """Accelerations without gravity in the frame of the body."""

    nu = 2

    def __init__(self, label: str, given: SpecificForce, times: Doubles, parts: list[int]) -> None:
        super().__init__(label, given, times, parts)
        self.f = self.numbers(given.f, "f", (len(times), 3))
        self.gravity = self.numbers(given.gravity, "gravity", (3,))
        self.bias = self.arm = None
        self.fixed_arm: Doubles | None = None
        if given.bias is not None:
            self.bias = self.name(_of_size(given.bias, 3, f"{label}.bias"), "accelerometer bias")
        if isinstance(given.lever_arm, Constant):
            self.arm = self.name(_of_size(given.lever_arm, 3, f"{label}.lever_arm"), "lever arm")
        elif given.lever_arm is not None:
            self.fixed_arm = self.numbers(given.lever_arm, "lever_arm", (3,))
        self.spread(3)

    def measure(self, motion: list[Motion], values: Values) -> Doubles:
        turning, moving = motion
        body = Body(turning.space)
        read: Doubles = np.einsum("nij,ni->nj", body.matrices(turning.p), moving.a - self.gravity)
        arm = self.fixed_arm if self.arm is None else values[self.arm]
        if arm is not None:
            omega, change = body.rates(turning.p, turning.v), body.rates(turning.p, turning.a)
            read = read + np.cross(change, arm) + np.cross(omega, np.cross(omega, arm))
        return (read if self.bias is None else read + values[self.bias]) - self.f


class FunctionTerm(Term):
    """Measurements given by a function of the user."""

    def __init__(self, label: str, given: Function, times: Doubles, parts: list[int], space: Space[Any]) -> None:
        super().__init__(label, given, times, parts)
        self.function, self.nu, self.space = given.residual, given.nu, space
        self.names = {key: self.name(own, key) for key, own in given.parameters.items()}

    def measure(self, motion: list[Motion], values: Values) -> Doubles:
        states = [
            self._joined([(own.p, own.v, own.a)[nu] for own in motion], float(nu == 0)) for nu in range(self.nu + 1)
        ]
        if self.names:
            states.append({key: values[name].copy() for key, name in self.names.items()})
        n = len(self.times)
        found = np.asarray(self.function(*states))
        if found.dtype.kind not in "iufb" or found.ndim not in (1, 2) or found.shape[0] != n:
            raise ValidationError(
                f"{self.label}: the function returned {found.dtype} of shape {found.shape}, but real residuals of "
                f"shape ({n}, k) or ({n},) are needed, one row per time"
            )
        result = found.reshape(n, -1).astype(np.float64)
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

    def _joined(self, arrays: list[Array], corner: float) -> Any:
        """Combine the arrays of all parts into those of the space."""
        rest, found = list(arrays), []
        for factor in factors_of(self.space):
            count = len(parts_of_factor(factor))
            found.append(join(factor, rest[:count], corner))
            rest = rest[count:]
        return tuple(found) if isinstance(self.space, Product) else found[0]


class Body:
    """Velocities of a curve in a group in the moving frame.

    Attributes
    ----------
    size : int
        Number of components.
    """

    def __init__(self, space: Space) -> None:
        self.space = space
        self.is_rotation = space in (_SO3, _S3)
        self.size = 3 if self.is_rotation else space.dim
        if not self.is_rotation:
            n = space.point_shape[0]
            self.identity = np.eye(n, dtype=space.dtype)
            self.frame = space.frame(self.identity)

    def matrices(self, p: Array) -> Doubles:
        """Return rotation matrices."""
        return p if self.space == _SO3 else quaternion_to_matrix(p, scalar_first=True)

    def elements(self, p: Array, v: Array) -> Array:
        """Return g⁻¹v: angular velocities, or matrices."""
        if self.space == _SO3:
            turned = np.swapaxes(p, -1, -2) @ v
            return np.stack([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]], axis=-1)
        if self.space == _S3:
            w, x = p[:, :1], p[:, 1:]
            return np.asarray(2 * (w * v[:, 1:] - v[:, :1] * x - np.cross(x, v[:, 1:])))
        return np.linalg.solve(p, v)

    def bracket(self, a: Array, b: Array) -> Array:
        """Return [a, b]."""
        return np.asarray(np.cross(a, b) if self.is_rotation else a @ b - b @ a)

    def of(self, element: Array) -> Doubles:
        """Return the components of an element."""
        if self.is_rotation:
            return element
        shape = (len(element), *self.frame.shape)
        at = np.broadcast_to(self.identity, element.shape)
        return coordinates(self.space, at, np.broadcast_to(self.frame, shape), element)

    def rates(self, p: Array, v: Array) -> Doubles:
        """Return the components of g⁻¹v."""
        return self.of(self.elements(p, v))

    def derivatives(self, p: Array, v: Array, frames: Array) -> tuple[Doubles, Doubles]:
        """Return the derivatives of the rates with respect to the coordinates of a move, and their time derivatives.

        With η = Σ ξ_j B_j, and B_j' = −[ω, B_j]/2 in parallel frames, δω = η' + [ω, η] = Σ ξ_j' B_j + ξ_j [ω, B_j]/2.
        The columns of the second array are the B_j.
        """
        omega = self.elements(p, v)
        vectors = [self.elements(p, frames[:, j]) for j in range(frames.shape[1])]
        half = [0.5 * self.of(self.bracket(omega, vector)) for vector in vectors]
        return np.stack(half, axis=-1), np.stack([self.of(vector) for vector in vectors], axis=-1)

    def half_brackets(self, p: Array, frame: Array) -> Doubles:
        """Return the matrices of ξ ↦ [e, ξ]/2 for the vectors e of a frame at p, in its coordinates."""
        at = np.repeat(p[None], len(frame), axis=0)
        halves, vectors = self.derivatives(at, frame, np.broadcast_to(frame, (len(frame), *frame.shape)))
        return np.ascontiguousarray(np.linalg.solve(vectors, halves))

    def components(self, omega: Any, name: str, n: int) -> Doubles:
        """Return components from the user's angular velocities or matrices."""
        if self.is_rotation:
            return broadcast(_exact(omega, name, (n, 3)), name, (n, 3), SKIPNA)
        vectors = self.space._numbers(self.space._doubles(omega, name))
        _exact(vectors, name, (n, *self.space.point_shape))
        refuse(~self.space._where_finite(vectors), name, lambda i: f"is not finite{SKIPNA}")
        return self.of(vectors)


def _exact(value: Any, name: str, shape: tuple[int, ...]) -> Any:
    array = as_array(value, name)
    if array.shape != shape:
        raise ValidationError(f"{name} has shape {array.shape}, but {shape} is needed: one row per time")
    return array


def _of_size(constant: Any, size: int, name: str) -> Constant:
    if not isinstance(constant, Constant) or constant.size != size:
        raise ValidationError(f"{name} must be a Constant of size {size}")
    return constant


def points_on(space: Space, y: Any, n: int, name: str) -> Array:
    """Return n points of a space."""
    array = space._array(y, name)
    points = space._numbers(space._doubles(array, name))
    if points.shape != (n, *space.point_shape):
        raise ValidationError(f"{name} has shape {array.shape}, but {(n, *space.point_shape)} is needed")
    refuse(
        ~space._where_finite(points),
        name,
        lambda i: f"is not finite. Remove it{', or pass skipna=True' if np.isnan(points[i]).any() else ''}.",
    )
    try:
        space.check_point(array)
    except ValidationError as error:
        raise ValidationError(f"{name}: {error}") from None
    return np.asarray(space.project(points))


def bind(measurement: Measurement, label: str, times: Doubles, space: Space[Any]) -> list[Term]:
    """Return the terms of a measurement on a space, after all checks."""
    factors = factors_of(space)
    counts = [len(parts_of_factor(factor)) for factor in factors]
    spaces = smoothed_spaces(space)
    chosen: Space[Any] = space
    parts = list(range(len(spaces)))
    if measurement.factor is not None:
        number = measurement.factor
        if isinstance(number, bool) or not isinstance(number, (int, np.integer)) or not 0 <= number < len(factors):
            raise ValidationError(f"{label}.factor must be a factor of {space!r}, 0 to {len(factors) - 1}")
        chosen = factors[number]
        first = sum(counts[:number])
        parts = list(range(first, first + counts[number]))
    own = [spaces[part] for part in parts]
    if isinstance(measurement, Points):
        y: Any = measurement.y
        if isinstance(chosen, SpecialEuclidean) and not isinstance(y, tuple):
            # The positions or the rotations of poses.
            y = chosen._array(y, f"{label}.y")
            shape = y.shape[1:]
            for part in parts:
                if shape == spaces[part].point_shape:
                    return _points(measurement, label, times, spaces[part], [part])
        return _points(measurement, label, times, chosen, parts)
    if isinstance(measurement, Function):
        return [FunctionTerm(label, measurement, times, parts, chosen)]
    if isinstance(measurement, SpecificForce):
        turning = [part for part, each in zip(parts, own, strict=True) if each in (_SO3, _S3)]
        moving = [part for part, each in zip(parts, own, strict=True) if each == _R3]
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
    each_y = _in_parts(measurement.y, chosen, f"{label}.y")
    each_v = _in_parts(measurement.v, chosen, f"{label}.v")
    for part, y, v, sigma in zip(parts, each_y, each_v, _sigmas(measurement, len(parts), label), strict=True):
        term = Velocities(measurement.t, y, v, sigma=sigma, time_offset=measurement.time_offset, loss=measurement.loss)
        terms.append(VelocityTerm(label, term, times, part, spaces[part], y, v))
    return terms


def _is_group(space: Space) -> bool:
    return space == _S3 or isinstance(space, Group)


def is_compact_group(space: Space) -> bool:
    """Whether a space is a group whose metric is invariant on both sides."""
    return space == _S3 or (isinstance(space, Group) and space._unitary)


def _in_parts(value: Any, space: Space[Any], name: str) -> list[Any]:
    """Return the points or vectors of each part."""
    values = parts_of(value, space, name) if isinstance(space, Product) else (value,)
    found: list[Any] = []
    for factor, own in zip(factors_of(space), values, strict=True):
        if len(parts_of_factor(factor)) > 1:
            own = factor._numbers(factor._doubles(own, name))
        found += split(factor, own)
    return found


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


def _points(given: Points, label: str, times: Doubles, space: Space[Any], parts: list[int]) -> list[Term]:
    n = len(times)
    precisions = None
    if given.weights is not None:
        if n < 2:
            raise ValidationError(f"{label}.weights needs at least two points. Pass sigma instead.")
        precisions = read_precision(given.weights, given.frames, space, read(given.y, space))
    terms: list[Term] = []
    each = zip(parts, _in_parts(given.y, space, f"{label}.y"), _sigmas(given, len(parts), label), strict=True)
    spaces = [part for factor in factors_of(space) for part in parts_of_factor(factor)]
    for k, ((part, y, sigma), own) in enumerate(zip(each, spaces, strict=True)):
        information = None if precisions is None else precisions[k].information
        if sigma is None:
            if information is None:
                raise ValidationError(f"{label} has no sigma. Pass the standard deviation of its noise.")
            # Information matrices are inverse covariances.
            sigma = 1.0
        scale = broadcast(sigma, f"{label}.sigma", (n,))
        refuse(~(scale > 0), f"{label}.sigma", lambda i: "must be > 0")
        used = np.ones(n, bool) if precisions is None else precisions[k].weights > 0
        rows = own._numbers(own._doubles(y, f"{label}.y"))
        if rows.shape[:1] != (n,):
            raise ValidationError(f"{label}.y has {len(rows)} points, but there are {n} times")
        good = points_on(own, rows[used], int(used.sum()), f"{label}.y")
        if information is not None:
            term: Term = InformationTerm(label, given, times[used], part, good, *roots_of(information[used]))
            term.noise = np.repeat(scale[used, None], own.dim, axis=1)
        else:
            weights = 1.0 if precisions is None else precisions[k].weights[used]
            noise = np.repeat((scale[used] / np.sqrt(weights))[:, None], own.dim, axis=1)
            term = PointTerm(label, given, times[used], part, good, noise)
        term.rows = np.flatnonzero(used)
        terms.append(term)
    return terms
