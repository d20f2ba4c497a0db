"""Geodesics in closed forms: what de Casteljau's algorithm needs of a space.

Arrays have any axes in front of those of a point. Angles are squared wherever they occur, so the formulas are smooth
where they are zero.
"""

from __future__ import annotations

import numpy as np

from .. import _spaces
from .._base.angles import Rows, quaternion_rows, rotation_rows
from .._spaces import AnySpace
from .library import Library, Tensor, adjoint, hermitian

QUOTIENTS = (_spaces.RealProjective, _spaces.ComplexProjective, _spaces.Grassmannian, _spaces.ComplexGrassmannian)
"""Spaces whose points have many representatives."""


class Model:
    """Flat space; the others override what differs. Points inside may be other arrays than outside."""

    axes = 1

    def __init__(self, lib: Library) -> None:
        self.lib = lib

    def to_internal(self, points: Tensor, velocities: Tensor) -> tuple[Tensor, Tensor]:
        """Return the nearest points of the space, and the nearest tangent vectors there."""
        return points, velocities

    def from_internal(self, points: Tensor) -> Tensor:
        """Return points as the arrays of the user."""
        return points

    def velocities_from_internal(self, points: Tensor, velocities: Tensor) -> Tensor:
        """Return velocities at internal points as the arrays of the user."""
        return velocities

    def exp(self, p: Tensor, v: Tensor) -> Tensor:
        """Return the geodesic from p with velocity v at time 1."""
        return p + v

    def log(self, p: Tensor, q: Tensor) -> Tensor:
        """Return the inverse of `exp`."""
        return q - p

    def between(self, p: Tensor, q: Tensor, t: Tensor) -> Tensor:
        """Return the geodesic from p to q at time t."""
        return self.exp(p, self.times(t, self.log(p, q)))

    def times(self, t: Tensor, v: Tensor) -> Tensor:
        """Multiply vectors by one factor each."""
        return t[(..., *(None,) * self.axes)] * v


class Curved(Model):
    """Spheres for sign 1 and hyperbolic spaces for sign −1: vectors with ⟨p, p⟩ = sign."""

    def __init__(self, lib: Library, sign: int) -> None:
        super().__init__(lib)
        self.sign = sign

    def inner(self, u: Tensor, v: Tensor) -> Tensor:
        """Return the product in which points have length one, with an axis of its own."""
        products = u * v
        if self.sign > 0:
            return products.sum(axis=-1, keepdims=True)
        return products[..., 1:].sum(axis=-1, keepdims=True) - products[..., :1]

    def to_internal(self, points: Tensor, velocities: Tensor) -> tuple[Tensor, Tensor]:
        points = points / self.lib.xp.sqrt(self.sign * self.inner(points, points))
        return points, velocities - self.sign * self.inner(points, velocities) * points

    def exp(self, p: Tensor, v: Tensor) -> Tensor:
        z = self.inner(v, v)
        return self.lib.stumpff(0, self.sign, z) * p + self.lib.stumpff(1, self.sign, z) * v

    def log(self, p: Tensor, q: Tensor) -> Tensor:
        d, s = q - p, q + p
        y = 0.25 * self.inner(d, d)
        return self.lib.arc(y, 0.25 * self.sign * self.inner(s, s), self.sign) * (d + 2 * self.sign * y * p)


class Lines(Model):
    """Unit vectors up to a phase or a sign."""

    def to_internal(self, points: Tensor, velocities: Tensor) -> tuple[Tensor, Tensor]:
        points = points / self.lib.xp.sqrt(_product(points, points).real)
        return points, velocities - points * _product(points, velocities)

    def exp(self, p: Tensor, v: Tensor) -> Tensor:
        z = _product(v, v).real
        return self.lib.stumpff(0, 1, z) * p + self.lib.stumpff(1, 1, z) * v

    def log(self, p: Tensor, q: Tensor) -> Tensor:
        overlap = _product(p, q)
        beside = q - p * overlap
        y = _product(beside, beside).real
        return self.lib.arc(y, _product(overlap, overlap).real, 1) * overlap.conj() * beside


def _product(u: Tensor, v: Tensor) -> Tensor:
    return (u.conj() * v).sum(axis=-1, keepdims=True)


# ---- geodesics of subspaces and of positive definite matrices ----

# Newton's iteration for the nearest orthonormal columns is at rounding after so many steps from singular values
# between .4 and 1.5.
_STEPS = 9
# cos and sin of a matrix are series of what is this many times halved, which angles up to 2³ need.
_HALVINGS = 3
_TERMS = 12


class Planes(Model):
    """Orthonormal columns up to a unitary factor on their right: Edelman, Arias & Smith (1998)."""

    axes = 2

    def to_internal(self, points: Tensor, velocities: Tensor) -> tuple[Tensor, Tensor]:
        points = orthonormal(self.lib, points)
        return points, velocities - points @ (adjoint(points) @ velocities)

    def exp(self, p: Tensor, v: Tensor) -> Tensor:
        cosine, sine = _trigonometric(self.lib, adjoint(v) @ v)
        return p @ cosine + v @ sine

    def log(self, p: Tensor, q: Tensor) -> Tensor:
        assert self.lib.arcs is not None
        overlap = adjoint(p) @ q
        beside = q - p @ overlap
        return beside @ self.lib.arcs(adjoint(beside) @ beside) @ adjoint(overlap)


class Positive(Model):
    """Positive definite matrices with the affine-invariant metric."""

    axes = 2

    def to_internal(self, points: Tensor, velocities: Tensor) -> tuple[Tensor, Tensor]:
        return hermitian(points), hermitian(velocities)

    def exp(self, p: Tensor, v: Tensor) -> Tensor:
        root = self.lib.xp.linalg.cholesky(p)
        return root @ self.lib.exponential(whitened(self.lib, root, v)) @ adjoint(root)

    def log(self, p: Tensor, q: Tensor) -> Tensor:
        root = self.lib.xp.linalg.cholesky(p)
        return root @ self.lib.logarithm(whitened(self.lib, root, q)) @ adjoint(root)

    def between(self, p: Tensor, q: Tensor, t: Tensor) -> Tensor:
        root = self.lib.xp.linalg.cholesky(p)
        step = self.lib.logarithm(whitened(self.lib, root, q))
        return root @ self.lib.exponential(self.times(t, step)) @ adjoint(root)


def identity(lib: Library, like: Tensor) -> Tensor:
    """Return the identity matrix of the size of the last axis."""
    return lib.constant(np.eye(like.shape[-1]), like)


def orthonormal(lib: Library, columns: Tensor) -> Tensor:
    """Return the nearest orthonormal columns; NaN where the given ones are too far off for the iteration."""
    one = identity(lib, columns)
    for _ in range(_STEPS):
        columns = 0.5 * columns @ (3 * one - adjoint(columns) @ columns)
    off = lib.xp.amax(abs(adjoint(columns) @ columns - one), (-2, -1))[..., None, None]
    return lib.xp.where(off < 1e-5, columns, float("nan"))


def _trigonometric(lib: Library, square: Tensor) -> tuple[Tensor, Tensor]:
    """cos √z and sin √z / √z of Hermitian matrices z without negative eigenvalues."""
    one = identity(lib, square)
    z = square / 4**_HALVINGS
    cosine = sine = one
    for n in range(_TERMS, 0, -1):
        cosine = one - z @ cosine / (2 * n * (2 * n - 1))
        sine = one - z @ sine / (2 * n * (2 * n + 1))
    for _ in range(_HALVINGS):
        cosine, sine, z = one - 2 * z @ sine @ sine, cosine @ sine, 4 * z
    return cosine, sine


def whitened(lib: Library, root: Tensor, x: Tensor) -> Tensor:
    """L⁻¹ x L⁻* for a Hermitian x."""
    left = lib.solve_lower(root, x)
    return hermitian(adjoint(lib.solve_lower(root, adjoint(left))))


# ---- geodesics of rotations and rigid motions, by unit quaternions (scalar first) of either sign ----


class Rotations(Lines):
    """Rotations of space or of the plane as unit quaternions up to their sign: half an angle is a distance there."""

    def __init__(self, lib: Library, size: int) -> None:
        super().__init__(lib)
        self.size = size

    def to_internal(self, points: Tensor, velocities: Tensor) -> tuple[Tensor, Tensor]:
        quaternion, turn = _motion_of(self.lib, points, velocities)
        return quaternion, product(self.lib, quaternion, _imaginary(self.lib, 0.5 * turn))

    def from_internal(self, points: Tensor) -> Tensor:
        return matrix_of(self.lib, points)[..., : self.size, : self.size]

    def velocities_from_internal(self, points: Tensor, velocities: Tensor) -> Tensor:
        turn = 2 * product(self.lib, _conjugate(self.lib, points), velocities)[..., 1:]
        moved = matrix_of(self.lib, points) @ cross_matrix(self.lib, turn)
        return moved[..., : self.size, : self.size]


class Poses(Model):
    """Rigid motions, seven numbers: a unit quaternion of the rotation, and the translation. A velocity is the twist of
    the body, six numbers: angular velocity and velocity. Geodesics are screw motions (Murray, Li & Sastry 1994, §2.3).
    """

    def __init__(self, lib: Library, size: int) -> None:
        super().__init__(lib)
        self.size = size

    def to_internal(self, points: Tensor, velocities: Tensor) -> tuple[Tensor, Tensor]:
        n, xp = self.size, self.lib.xp
        quaternion, turn = _motion_of(self.lib, points[..., :n, :n], velocities[..., :n, :n])
        place, ahead = points[..., :n, n], velocities[..., :n, n]
        if n == 2:
            place, ahead = (xp.concatenate([x, xp.zeros_like(x[..., :1])], axis=-1) for x in (place, ahead))
        pose = xp.concatenate([quaternion, place], axis=-1)
        return pose, xp.concatenate([turn, turned(self.lib, _conjugate(self.lib, quaternion), ahead)], axis=-1)

    def from_internal(self, points: Tensor) -> Tensor:
        top = self._top(matrix_of(self.lib, points[..., :4]), points[..., 4:])
        last = identity(self.lib, top)[self.size :]
        return self.lib.xp.concatenate([top, self.lib.xp.zeros_like(top[..., :1, :]) + last], axis=-2)

    def velocities_from_internal(self, points: Tensor, velocities: Tensor) -> Tensor:
        quaternion = points[..., :4]
        spin = matrix_of(self.lib, quaternion) @ cross_matrix(self.lib, velocities[..., :3])
        top = self._top(spin, turned(self.lib, quaternion, velocities[..., 3:]))
        return self.lib.xp.concatenate([top, self.lib.xp.zeros_like(top[..., :1, :])], axis=-2)

    def _top(self, matrix: Tensor, column: Tensor) -> Tensor:
        """Return the rows of a pose, or of its velocity, except the last."""
        n = self.size
        return self.lib.xp.concatenate([matrix[..., :n, :n], column[..., :n, None]], axis=-1)

    def exp(self, p: Tensor, v: Tensor) -> Tensor:
        xp, stumpff, cross = self.lib.xp, self.lib.stumpff, self.lib.xp.linalg.cross
        quaternion, place = p[..., :4], p[..., 4:]
        turn, ahead = v[..., :3], v[..., 3:]
        z = (turn * turn).sum(axis=-1, keepdims=True)
        # V(ω)v = v + (1 − cos θ)/θ² ω×v + (θ − sin θ)/θ³ ω×(ω×v)
        across = cross(turn, ahead)
        moved = ahead + stumpff(2, 1, z) * across + stumpff(3, 1, z) * cross(turn, across)
        step = xp.concatenate([1 - 0.125 * z * stumpff(1, 1, z / 16) ** 2, 0.5 * stumpff(1, 1, z / 4) * turn], axis=-1)
        return xp.concatenate(
            [product(self.lib, quaternion, step), place + turned(self.lib, quaternion, moved)], axis=-1
        )

    def log(self, p: Tensor, q: Tensor) -> Tensor:
        xp, cross = self.lib.xp, self.lib.xp.linalg.cross
        back = _conjugate(self.lib, p[..., :4])
        step = product(self.lib, back, q[..., :4])
        scalar, vector = step[..., :1], step[..., 1:]
        y = (vector * vector).sum(axis=-1, keepdims=True)
        turn = 2 * self.lib.arc(y, scalar * scalar, 1) * scalar * vector
        apart = turned(self.lib, back, q[..., 4:] - p[..., 4:])
        z = (turn * turn).sum(axis=-1, keepdims=True)
        across = cross(turn, apart)
        ahead = apart - 0.5 * across + inverse_series(self.lib, z) * cross(turn, across)
        return xp.concatenate([turn, ahead], axis=-1)


def inverse_series(lib: Library, z: Tensor) -> Tensor:
    """(1 − φ cot φ) / z for z = 4φ² < 4π²: the factor of ω×(ω×v) in the inverse of V(ω) = ∫ exp(sω) ds."""
    u = z / 4
    return (lib.stumpff(2, 1, u) - lib.stumpff(3, 1, u)) / (4 * lib.stumpff(1, 1, u))


def product(lib: Library, p: Tensor, q: Tensor) -> Tensor:
    """Return the product of quaternions."""
    a, u, b, v = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    scalar = a * b - (u * v).sum(axis=-1, keepdims=True)
    return lib.xp.concatenate([scalar, a * v + b * u + lib.xp.linalg.cross(u, v)], axis=-1)


def turned(lib: Library, quaternion: Tensor, vector: Tensor) -> Tensor:
    """Return vectors turned by unit quaternions."""
    a, u = quaternion[..., :1], quaternion[..., 1:]
    twice = 2 * lib.xp.linalg.cross(u, vector)
    return vector + a * twice + lib.xp.linalg.cross(u, twice)


def matrix_of(lib: Library, quaternion: Tensor) -> Tensor:
    """Return the rotation matrices of unit quaternions."""
    return _matrices(lib, rotation_rows(*lib.xp.moveaxis(quaternion, -1, 0)))


def _matrices(lib: Library, rows: Rows) -> Tensor:
    return lib.xp.stack([lib.xp.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_of(lib: Library, matrix: Tensor) -> Tensor:
    """Return a unit quaternion of rotation matrices; NaN for reflections.

    The longest of the four rows of 4qqᵀ is far from zero (Shepperd 1978).
    """
    xp = lib.xp
    rows = quaternion_rows(matrix)
    longest = xp.argmax(xp.stack([rows[i][i] for i in range(4)], axis=-1), axis=-1)[..., None]
    first, *others = (xp.stack(row, axis=-1) for row in rows)
    row = first
    for i, other in enumerate(others, 1):
        row = xp.where(longest == i, other, row)
    unit = row / xp.sqrt((row * row).sum(axis=-1, keepdims=True))
    return xp.where(xp.linalg.det(matrix)[..., None] > 0, unit, float("nan"))


def axis_of(lib: Library, matrix: Tensor) -> Tensor:
    """Return the vector ω of the skew part of matrices [ω]×."""
    skew = 0.5 * (matrix - matrix.swapaxes(-1, -2))
    return lib.xp.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)


def cross_matrix(lib: Library, vector: Tensor) -> Tensor:
    """Return the matrices [ω]× of vectors ω."""
    x, y, z = (vector[..., i] for i in range(3))
    zero = lib.xp.zeros_like(x)
    return _matrices(lib, ((zero, -z, y), (z, zero, -x), (-y, x, zero)))


def _imaginary(lib: Library, vector: Tensor) -> Tensor:
    return lib.xp.concatenate([lib.xp.zeros_like(vector[..., :1]), vector], axis=-1)


def _conjugate(lib: Library, quaternion: Tensor) -> Tensor:
    return lib.xp.concatenate([quaternion[..., :1], -quaternion[..., 1:]], axis=-1)


def _motion_of(lib: Library, matrices: Tensor, velocities: Tensor) -> tuple[Tensor, Tensor]:
    """Unit quaternions of rotations of the plane or of space, and their angular velocities in the body."""
    matrices = orthonormal(lib, matrices)
    turn = matrices.swapaxes(-1, -2) @ velocities
    if matrices.shape[-1] == 2:
        # Rotations of the plane turn about the third axis of space.
        matrices, turn = _about_third(lib, matrices, 1.0), _about_third(lib, turn, 0.0)
    return quaternion_of(lib, matrices), axis_of(lib, turn)


def _about_third(lib: Library, matrix: Tensor, corner: float) -> Tensor:
    """Return matrices of size 2 with a third row and column, which are zero except for the corner."""
    (a, b), (c, d) = ([matrix[..., i, j] for j in range(2)] for i in range(2))
    zero = lib.xp.zeros_like(a)
    return _matrices(lib, ((a, b, zero), (c, d, zero), (zero, zero, zero + corner)))


# ---- the models of spaces ----


def model_of(lib: Library, space: AnySpace) -> Model | None:
    """Return the model of a space, which is not a product; None if there is none."""
    if not lib.general and (space.dtype.kind == "c" or isinstance(space, QUOTIENTS)):
        return None
    if isinstance(space, _spaces.Euclidean):
        return Model(lib)
    if isinstance(space, _spaces.Sphere):
        return Curved(lib, 1)
    if isinstance(space, _spaces.Hyperbolic):
        return Curved(lib, -1)
    if isinstance(space, QUOTIENTS):
        return Lines(lib) if len(space.point_shape) == 1 else Planes(lib)
    if isinstance(space, (_spaces.SymmetricPositiveDefinite, _spaces.HermitianPositiveDefinite)):
        return Positive(lib)
    if isinstance(space, _spaces.SpecialOrthogonal) and space.point_shape[0] in (2, 3):
        return Rotations(lib, space.point_shape[0])
    if isinstance(space, _spaces.SpecialEuclidean):
        return Poses(lib, space.point_shape[0] - 1)
    return None
