"""The spaces of the fit in NumPy, see `benchmarks.vectorised`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

import symspline as ss

from .data import Array
from .vectorised import Geometry, fit


def velocities(points: Array, space: ss.Space) -> Array:
    """Velocities of the C² splines through points, shape (curves, knots, *point_shape)."""
    shape, geometry = points.shape, _geometry(space)
    if geometry is None:
        raise ValueError(f"{space!r} has no fit in NumPy")
    # Points of spheres and projective spaces are matrices of one column.
    found = fit(points.reshape(*shape[:3], -1), geometry).reshape(shape)
    return found if np.iscomplexobj(points) else found.real


def known(space: ss.Space) -> bool:
    """Whether there is a fit in NumPy."""
    return _geometry(space) is not None


def _geometry(space: ss.Space) -> Geometry | None:
    match space:
        case ss.SymmetricPositiveDefinite() | ss.HermitianPositiveDefinite() | ss.SpecialPositiveDefinite():
            return PositiveDefinite()
        case ss.Siegel():
            return PositiveDefinite()
        case ss.SpecialOrthogonal() if space == ss.SpecialOrthogonal(3):
            return Rotations()
        case ss.Unitary() | ss.SpecialUnitary() | ss.SpecialOrthogonal() | ss.Orthogonal():
            return Unitary()
        case ss.SpecialEuclidean() if space == ss.SpecialEuclidean(3):
            return Motions()
        case ss.Grassmannian() | ss.ComplexGrassmannian() | ss.QuaternionicProjective():
            return Subspaces(space.point_shape[1])
        # For short steps a sphere is the real projective space.
        case ss.Sphere() | ss.RealProjective() | ss.ComplexProjective():
            return Subspaces(1)
    return None


class _Matrices(ABC):
    """Points are square matrices p = ab, tangent vectors avb."""

    @abstractmethod
    def start(self, p: Array) -> tuple[Array, Array]:
        """A frame at p."""

    @abstractmethod
    def exp(self, v: Array) -> Array:
        """e^v."""

    @abstractmethod
    def log(self, x: Array) -> Array:
        """Its inverse."""

    def half(self, v: Array) -> Array:
        return self.exp(v / 2)

    def logs(self, before: Array, middle: Array, after: Array) -> tuple[Array, Array]:
        m, n = before @ middle @ after, after @ middle @ before
        return self.log(m @ n), -self.log(n @ m)

    def unroll(self, points: Array) -> tuple[Array, Any]:
        frames, chords = [self.start(points[:, 0])], []
        for p in np.moveaxis(points[:, 1:], 1, 0):
            a, b = frames[-1]
            chords.append(self.log(np.linalg.inv(a) @ p @ np.linalg.inv(b)))
            half = self.half(chords[-1])
            frames.append((a @ half, half @ b))
        return np.stack(chords, axis=1), [np.stack(side, axis=1) for side in zip(*frames, strict=True)]

    def tangents(self, frames: Any, v: Array) -> Array:
        a, b = frames
        return a @ v @ b


class PositiveDefinite(_Matrices):
    """Positive definite matrices, symmetric or Hermitian."""

    def start(self, p: Array) -> tuple[Array, Array]:
        a = np.linalg.cholesky(p)
        return a, _adjoint(a)

    def exp(self, v: Array) -> Array:
        w, q = np.linalg.eigh(v)
        return _compose(q, np.exp(w))

    def log(self, x: Array) -> Array:
        w, q = np.linalg.eigh(x)
        return _compose(q, np.log(w))

    def logs(self, before: Array, middle: Array, after: Array) -> tuple[Array, Array]:
        # n = m*. If mm* has eigenvalues w and eigenvectors q, those of m*m are w and m*q/√w.
        m = before @ middle @ after
        w, q = np.linalg.eigh(m @ _adjoint(m))
        return _compose(q, np.log(w)), _compose(_adjoint(m) @ q, -np.log(w) / w)


class _Group(_Matrices):
    def start(self, p: Array) -> tuple[Array, Array]:
        return p, np.broadcast_to(np.eye(p.shape[-1]), p.shape)


class Unitary(_Group):
    """U(n), for angles below π/2."""

    def exp(self, v: Array) -> Array:
        w, q = np.linalg.eigh(-1j * v)
        return _compose(q, np.exp(1j * w))

    def log(self, x: Array) -> Array:
        angles, q = _angles(x)
        return _compose(q, 1j * angles)

    def logs(self, before: Array, middle: Array, after: Array) -> tuple[Array, Array]:
        # nm = n(mn)n⁻¹: the same angles, and eigenvectors nq.
        m, n = before @ middle @ after, after @ middle @ before
        angles, q = _angles(m @ n)
        return _compose(q, 1j * angles), _compose(n @ q, -1j * angles)


class Rotations(_Group):
    """SO(3), by Rodrigues' formula, for angles below π."""

    def exp(self, v: Array) -> Array:
        theta = _length(v)
        return np.eye(3) + _sinc(theta) * v + 0.5 * _sinc(theta / 2) ** 2 * (v @ v)

    def log(self, x: Array) -> Array:
        skew = 0.5 * (x - _adjoint(x))
        cosine = 0.5 * (np.trace(x, axis1=-2, axis2=-1)[..., None, None] - 1)
        return skew / _sinc(np.arctan2(_length(skew), cosine))


class Motions(_Group):
    """SE(3): [[R, t], [0, 1]] is the exponential of [[ω, u], [0, 0]] with R = e^ω, t = ((e^ω − 1)/ω) u."""

    def exp(self, v: Array) -> Array:
        omega, u = v[..., :3, :3], v[..., :3, 3:]
        x = np.zeros_like(v)
        x[..., :3, :3], x[..., :3, 3:], x[..., 3, 3] = Rotations().exp(omega), _slope(omega) @ u, 1
        return x

    def log(self, x: Array) -> Array:
        omega = Rotations().log(x[..., :3, :3])
        v = np.zeros_like(x)
        v[..., :3, :3], v[..., :3, 3:] = omega, np.linalg.solve(_slope(omega), x[..., :3, 3:])
        return v


class Subspaces:
    """Grassmannians, real or complex: points are n × k matrices with orthonormal columns.

    A frame is a unitary matrix a whose first k columns span the subspace, and the (n − k) × k matrix v stands
    for a [[0], [v]]. With V = [[0, −v*], [v, 0]] the reflections e^{2V} are part of U(n), where the formulas hold
    with 2V for v: e^{v/2} is e^V. If the first columns of e^V are [[x], [y]], then yx⁻¹ = tan v.
    """

    def __init__(self, k: int) -> None:
        self._k = k

    def unroll(self, points: Array) -> tuple[Array, Any]:
        curves, knots, n, k = points.shape
        basis = None
        if n > knots * k:
            # The whole curve lies in the sum of its subspaces.
            basis = np.linalg.qr(np.moveaxis(points, 1, 2).reshape(curves, n, knots * k))[0][:, None]
            points = _adjoint(basis) @ points
        frames, chords = [np.linalg.qr(points[:, 0], mode="complete")[0]], []
        for p in np.moveaxis(points[:, 1:], 1, 0):
            chords.append(self.log(_adjoint(frames[-1]) @ p))
            frames.append(frames[-1] @ self.half(chords[-1]))
        return np.stack(chords, axis=1), (np.stack(frames, axis=1), points, basis)

    def half(self, v: Array) -> Array:
        m, k = v.shape[-2:]
        s, q = _singular(v)
        sine, versed = v @ _compose(q, _sinc(s)), _compose(q, 0.5 * _sinc(s / 2) ** 2)
        x = np.empty((*v.shape[:-2], k + m, k + m), v.dtype)
        x[..., :k, :k], x[..., :k, k:] = _compose(q, np.cos(s)), -_adjoint(sine)
        x[..., k:, :k], x[..., k:, k:] = sine, np.eye(m) - v @ versed @ _adjoint(v)
        return x

    def log(self, x: Array) -> Array:
        """v from the first columns of e^V."""
        tangent = x[..., self._k :, :] @ np.linalg.inv(x[..., : self._k, :])
        s, q = _singular(tangent)
        return tangent @ _compose(q, np.arctan(s) / s)

    def logs(self, before: Array, middle: Array, after: Array) -> tuple[Array, Array]:
        # Of the subspaces moved to the first columns of 1, m makes the end of w⁺, and m* = m⁻¹ that of w⁻.
        columns = before @ (middle @ after[..., : self._k])
        rows = before[..., : self._k, :] @ middle @ after
        return self.log(columns), self.log(_adjoint(rows))

    def tangents(self, frames: Any, v: Array) -> Array:
        a, points, basis = frames
        k = self._k
        # The columns of the points are not those of the frames.
        u = a[..., k:] @ v @ (_adjoint(a[..., :k]) @ points)
        return u if basis is None else basis @ u


def _adjoint(a: Array) -> Array:
    return np.swapaxes(a.conj(), -1, -2)


def _compose(q: Array, w: Array) -> Array:
    """q w q* with a diagonal w."""
    return q * w[..., None, :] @ _adjoint(q)


def _singular(v: Array) -> tuple[Array, Array]:
    """Singular values s > 0 and right singular vectors: all that is made of them is smooth in s²."""
    squares, q = np.linalg.eigh(_adjoint(v) @ v)
    return np.sqrt(np.maximum(squares, 1e-300)), q


def _angles(x: Array) -> tuple[Array, Array]:
    """θ of the eigenvalues e^{iθ} of unitary matrices, and eigenvectors: (x − x*)/2i has sin θ."""
    sines, q = np.linalg.eigh(-0.5j * (x - _adjoint(x)))
    return np.arcsin(sines), q


def _length(v: Array) -> Array:
    """|ω| of skew 3 × 3 matrices."""
    return np.sqrt(v[..., 0, 1] ** 2 + v[..., 0, 2] ** 2 + v[..., 1, 2] ** 2)[..., None, None]


def _sinc(x: Array) -> Array:
    """sin x / x."""
    return np.sinc(x / np.pi)


def _slope(omega: Array) -> Array:
    """(e^ω − 1)/ω = 1 + ω (1 − cos θ)/θ² + ω² (θ − sin θ)/θ³."""
    theta = _length(omega)
    # Below this angle the series is exact to all digits.
    small = theta < 0.01
    safe = np.where(small, 1.0, theta)
    cubic = np.where(small, 1 / 6 - theta**2 / 120 + theta**4 / 5040, (safe - np.sin(safe)) / safe**3)
    return np.eye(3) + 0.5 * _sinc(theta / 2) ** 2 * omega + cubic * (omega @ omega)
