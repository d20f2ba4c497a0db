"""Stiefel manifolds: orthonormal frames of subspaces."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._arrays import short_repr
from .._core import CutLocusError, ValidationError
from .._spaces import Array, Space, SpecialOrthogonal
from ._manifold import Manifold
from ._operations import rows_or_nan

# Of Rentmeesters, Algorithms for data fitting on some common homogeneous spaces (2013), Theorem 5.5.
_RADIUS = np.sqrt(0.8) * np.pi
# The block of a logarithm that must vanish is rounding below this.
_TOL = 1e-14
_MOST = 60


class Stiefel(Manifold):
    """Define the Stiefel manifold of frames of k orthonormal vectors in Rⁿ.

    Points are n × k matrices with orthonormal columns. The metric is the canonical metric
    ⟨u, v⟩ = tr uᵀ(1 − pp ᵀ/2)v of Edelman, Arias and Smith [1]_.

    Parameters
    ----------
    k : int
        Number of vectors, from 1 to n − 1.
    n : int
        Dimension of the space of the vectors.

    Raises
    ------
    ValidationError
        If k and n are not integers with 1 ≤ k < n.

    See Also
    --------
    Grassmannian : Subspaces, without a basis.
    SpecialOrthogonal : Frames of the whole space.

    Notes
    -----
    The manifold is symmetric only for k = 1, the sphere, so its curves are those of `Manifold`. On `Grassmannian` a
    curve joins subspaces; here it joins their bases, column by column. The logarithm is computed by the iteration of
    Zimmermann and Hüper [2]_.

    References
    ----------
    .. [1] A. Edelman, T. A. Arias, S. T. Smith, "The geometry of algorithms with orthogonality constraints", SIAM J.
           Matrix Anal. Appl. 20 (1998).
    .. [2] R. Zimmermann, K. Hüper, "Computing the Riemannian logarithm on the Stiefel manifold", SIAM J. Matrix Anal.
           Appl. 43 (2022).

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> space = ss.Stiefel(2, 5)
    >>> p, q = space.random_point(np.random.default_rng(0), 2)
    >>> bool(np.abs(space.exp(p, space.log(p, q)) - q).max() < 1e-13)
    True
    """

    _name = "stiefel"
    _aliases = ("st",)

    def __init__(self, k: int, n: int) -> None:
        for value in (k, n):
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
                raise ValidationError(f"Stiefel takes whole numbers k and n, not {short_repr(value)}")
        if not k < n:
            raise ValidationError(f"Stiefel({k}, {n}) needs k < n: frames of all of R^n are SpecialOrthogonal({n})")
        self._k, self._n = self._parameters = int(k), int(n)
        super().__init__(
            exp=self._exp,
            log=self._log,
            project_tangent=_tangential,
            inner=_inner,
            project=_project,
            injectivity_radius=_RADIUS,
            point_shape=(self._n, self._k),
            dim=k * n - k * (k + 1) // 2,
        )
        # Dimension of the span of a frame and its motion.
        self._m = min(2 * self._k, self._n)
        self._rotations = SpecialOrthogonal(self._m)

    def _key(self) -> tuple[Any, ...]:
        return self._parameters

    # Unlike other manifolds, it has a name.
    def __str__(self) -> str:
        return Space.__str__(self)

    def __repr__(self) -> str:
        return Space.__repr__(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return Space.__reduce__(self)

    def _exp(self, p: Array, v: Array) -> Array:
        frame, a, b = self._reduced(p, v)
        turn = self._rotations._apply("exp", p=np.eye(self._m), v=_generator(a, b))
        return np.asarray(frame @ turn[..., : self._k])

    def _log(self, p: Array, q: Array) -> Array:
        frame = self._frame(p, q)
        turned = _transposed(frame) @ q
        found = _generator_to(self._rotations, turned, self._k)
        return np.asarray(frame @ found[..., : self._k])

    def _frame(self, p: Array, v: Array) -> Array:
        """Return orthonormal columns that span the columns of p and of v, p first."""
        both = np.concatenate([p, v - p @ (_transposed(p) @ v)], axis=-1)
        # Householder's vectors are orthogonal for any rank.
        rest = np.linalg.qr(both)[0][..., self._k :]
        return np.concatenate([p, rest], axis=-1)

    def _reduced(self, p: Array, v: Array) -> tuple[Array, Array, Array]:
        """A frame, and v = frame (a, b) with a antisymmetric."""
        frame = self._frame(p, v)
        parts = _transposed(frame) @ v
        a = parts[..., : self._k, :]
        return frame, (a - _transposed(a)) / 2, parts[..., self._k :, :]

    def _dlog(self, p: Array, v: Array, q: Array, w: Array) -> Array:
        """The inverse of the derivative of exp_p at v, which is exp(Ω)'s in the frame."""
        frame, a, b = self._reduced(p, v)
        k, m = self._k, self._m
        # Ω is i times a Hermitian matrix, and D exp(Ω)[H] = exp(Ω) ψ(ad)(H) with divided differences.
        x, z = np.linalg.eigh(-1j * _generator(a, b))
        half = (x[..., :, None] - x[..., None, :]) / 2
        # exp(-Ω) D exp(Ω)[H] in the basis of eigenvectors.
        divided = np.exp(-1j * half) * np.sinc(half / np.pi)
        unit = _units(k, m)
        z, divided = z[:, None], divided[:, None]
        moved = z @ (divided * (_adjoint(z) @ unit @ z)) @ _adjoint(z)
        # The first k columns of D exp[H] and of w, both multiplied by exp(-Ω).
        columns = _lower(moved.real[..., :k], k)
        back = (z[:, 0] * np.exp(-1j * x)[..., None, :]) @ _adjoint(z[:, 0])
        inside = back.real @ (_transposed(frame) @ w)
        solved = np.linalg.solve(np.swapaxes(columns, -1, -2), _lower(inside, k)[..., None])[..., 0]
        generator = np.einsum("...a,aij->...ij", solved, unit)
        result = frame @ generator[..., :k]
        if m < self._n:
            # The part orthogonal to the frame stays orthogonal and is multiplied by the mean of exp(sΩ).
            outside = w - frame @ (_transposed(frame) @ w)
            mean = (z[:, 0] * (np.exp(0.5j * x) * np.sinc(x / (2 * np.pi)))[..., None, :]) @ _adjoint(z[:, 0])
            result = result + _transposed(np.linalg.solve(_transposed(mean.real[..., :k, :k]), _transposed(outside)))
        return np.asarray(result)


def _transposed(x: Array) -> Array:
    return np.swapaxes(x, -1, -2)


def _adjoint(x: Array) -> Array:
    return np.swapaxes(x.conj(), -1, -2)


def _tangential(p: Array, v: Array) -> Array:
    inside = _transposed(p) @ v
    return np.asarray(v - p @ (inside + _transposed(inside)) / 2)


def _inner(p: Array, u: Array, v: Array) -> Array:
    a, b = _transposed(p) @ u, _transposed(p) @ v
    return np.asarray(np.sum(u * v, axis=(-2, -1)) - np.sum(a * b, axis=(-2, -1)) / 2)


def _project(x: Array) -> Array:
    """The nearest matrix with orthonormal columns."""
    u, _, v = np.linalg.svd(x, full_matrices=False)
    return np.asarray(u @ v)


def _generator(a: Array, b: Array) -> Array:
    """((a, −bᵀ), (b, 0))."""
    zero = np.zeros((*b.shape[:-1], b.shape[-2]))
    return np.asarray(np.block([[a, -_transposed(b)], [b, zero]]))


def _units(k: int, m: int) -> Array:
    """A basis of the antisymmetric m × m matrices whose last block is zero: one 1 below the diagonal each."""
    rows, columns = _lower_indices(k, m)
    unit = np.zeros((len(rows), m, m))
    number = np.arange(len(rows))
    unit[number, rows, columns], unit[number, columns, rows] = 1.0, -1.0
    return unit


def _lower_indices(k: int, m: int) -> tuple[Array, Array]:
    rows, columns = np.tril_indices(m, -1)
    return rows[columns < k], columns[columns < k]


def _lower(x: Array, k: int) -> Array:
    """The entries below the diagonal of the first k columns."""
    rows, columns = _lower_indices(k, x.shape[-2])
    return x[..., rows, columns]


def _generator_to(rotations: SpecialOrthogonal, first: Array, k: int) -> Array:
    """The logarithm of a rotation with given first k columns whose last block is zero.

    Rotations with these columns differ by one of the last columns. Zimmermann and Hüper (2022), Algorithm 4: the
    block C of the logarithm that must vanish is taken off by exp(Γ), where SΓ + ΓS = C with S = BBᵀ/12 − 1/2 accounts
    for the first terms of the Baker–Campbell–Hausdorff series.
    """
    turn = _completed(first, k)
    rest = first.shape[-2] - k
    found = np.full(turn.shape, np.nan)
    left = np.arange(len(turn))

    def log(p: Array, q: Array) -> Array:
        return rotations._apply("log", p=p, q=q)

    for _ in range(_MOST):
        eye = np.broadcast_to(np.eye(k + rest), turn[left].shape)
        logs = rows_or_nan(log, eye, turn[left], (CutLocusError, ValidationError))
        size = np.abs(logs[..., k:, k:]).reshape(len(left), -1).max(axis=1, initial=0.0)
        there = size <= _TOL
        found[left[there]] = logs[there]
        # A rotation without a logarithm is not changed further.
        on = ~there & np.isfinite(size)
        left, logs = left[on], logs[on]
        if not left.size:
            break
        b, block = logs[..., k:, :k], logs[..., k:, k:]
        values, z = np.linalg.eigh(b @ _transposed(b) / 12 - np.eye(rest) / 2)
        sums = values[..., :, None] + values[..., None, :]
        change = z @ (_transposed(z) @ block @ z / sums) @ _transposed(z)
        small = SpecialOrthogonal(rest)._apply("exp", p=np.eye(rest), v=(change - _transposed(change)) / 2)
        turn[left, :, k:] = turn[left, :, k:] @ small
    return found


def _completed(first: Array, k: int) -> Array:
    """A rotation with given first columns, whose last block is symmetric: not far from the identity."""
    columns: Array = np.linalg.qr(first, "complete").Q
    columns = columns[..., k:]
    u, _, v = np.linalg.svd(columns[..., k:, :])
    last = columns @ _transposed(u @ v)
    turn = np.concatenate([first, last], axis=-1)
    # Of two with opposite determinants one is a rotation: the smallest singular value changes its sign.
    flipped = u.copy()
    flipped[..., -1] *= -1
    other = columns @ _transposed(flipped @ v)
    turn[..., k:] = np.where((np.linalg.det(turn) < 0)[:, None, None], other, last)
    return turn
