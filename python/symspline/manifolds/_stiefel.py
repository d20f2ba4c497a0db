"""Stiefel manifolds: orthonormal frames of subspaces."""

from __future__ import annotations

import numpy as np

from .._base.arrays import short_repr
from .._base.typing import AnyFunction, Array
from .._core import ValidationError, stiefel
from .._spaces import Doubles, Space
from ._manifold import Manifold
from ._operations import Operations

# Of Rentmeesters, Algorithms for data fitting on some common homogeneous spaces (2013), Theorem 5.5.
_RADIUS = np.sqrt(0.8) * np.pi


class Stiefel(Manifold):
    r"""Define the Stiefel manifold of frames of k orthonormal vectors in Rⁿ.

    Points are n × k matrices with orthonormal columns. The metric is the canonical metric
    :math:`\langle u, v \rangle = \operatorname{tr} u^T (1 - pp^T/2) v` of Edelman, Arias and Smith [1]_.

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
    Quotient : Bases whose columns have arbitrary signs.
    SpecialOrthogonal : Frames of the whole space.

    Notes
    -----
    The manifold is symmetric only for k = 1, the sphere, so its curves are those of `Manifold`. On `Grassmannian` a
    curve joins subspaces; here it joins their bases, column by column. Where the signs of columns are arbitrary, as
    those of eigenvectors and singular vectors are, fit ``Quotient(space, "signs")``. The logarithm is computed by the
    iteration of Zimmermann and Hüper [2]_.

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
    _remedy = (
        "put a point between them, or fit symspline.Quotient(space, 'signs') if the signs of columns are arbitrary, as "
        "those of eigenvectors and singular vectors are"
    )

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
            inner=self._inner,
            project=_project,
            injectivity_radius=_RADIUS,
            point_shape=(self._n, self._k),
            dim=k * n - k * (k + 1) // 2,
        )
        self.operations: _Compiled = _Compiled(self)
        self._handle = self.operations

    def _key(self) -> tuple[object, ...]:
        return self._parameters

    # Unlike other manifolds, it has a name.
    def __str__(self) -> str:
        return Space.__str__(self)

    def __repr__(self) -> str:
        return Space.__repr__(self)

    def __reduce__(self) -> tuple[object, ...]:
        return Space.__reduce__(self)

    def _exp(self, p: Array, v: Array) -> Array:
        return self._computed("exp", p, v)

    def _log(self, p: Array, q: Array) -> Array:
        return self._computed("log", p, q)

    def _dlog(self, p: Array, v: Array, q: Array, w: Array) -> Array:
        return self._computed("dlog", p, v, w)

    def _inner(self, p: Array, u: Array, v: Array) -> Array:
        return self._computed("inner", p, u, v)

    def _computed(self, operation: str, *inputs: Array) -> Array:
        same = all(x.shape == inputs[0].shape for x in inputs)
        arrays = inputs if same else np.broadcast_arrays(*inputs)
        shape = arrays[0].shape if operation != "inner" else arrays[0].shape[:-2]
        return _run(self, operation, *arrays).reshape(shape)


class _Compiled(Operations):
    """Compiled operations, which take any leading axes, and give NaN where a number is not finite."""

    def __init__(self, space: Stiefel) -> None:
        super().__init__(space)
        self.differentiates: bool = space._parameters == (2, 4)

    def _applied(self, name: str, function: AnyFunction, inputs: tuple[Array, ...]) -> Array:
        # Decompositions of NumPy refuse numbers that are not finite.
        return super()._applied(name, function, inputs) if name == "project" else np.asarray(function(*inputs))

    def bends(self, p: Array, v: Array) -> Array:
        values = _run(self.space, "bends", p[0], v[0], p[1], v[1])
        return values.reshape(*p.shape[1:3], 2, *p.shape[3:]).transpose(2, 0, 1, 3, 4)

    def basis(self, p: Array) -> Array:
        return _run(self.space, "basis", p).reshape(*p.shape[:-2], self.dim(), -1)

    def turns(self, p: Array, basis: Array) -> Doubles:
        dim = self.dim()
        values = _run(self.space, "turn", p[:, :-1], p[:, 1:]).reshape(len(p), -1, dim, dim)
        return np.where(np.isfinite(values), np.swapaxes(values, -1, -2), np.eye(dim))

    def forms(self, p: Array, frames: Array) -> Array:
        half = frames.reshape(*frames.shape[:-1], *p.shape[-2:]) / 2
        p = p[:, :, None]
        return frames - (p @ (_transposed(p) @ half)).reshape(frames.shape)

    def curve(self, order: int, tau: Doubles, p: Array, v: Array, q: Array, w: Array) -> tuple[Array, ...]:
        operation = ("point", "velocity", "acceleration")[order]
        values = _run(self.space, operation, p[0], v[0], q[0], w[0], p[1], v[1], tau)
        parts = values.reshape(len(tau), 1 if order == 0 else 2, *p.shape[-2:])
        return tuple(np.ascontiguousarray(parts[:, i]) for i in range(parts.shape[1]))


def _run(space: Stiefel, operation: str, *inputs: Array) -> Array:
    arrays = [np.ascontiguousarray(x, dtype=np.float64) for x in inputs]
    return stiefel(space._k, space._n, operation, arrays)


def _transposed(x: Array) -> Array:
    return np.swapaxes(x, -1, -2)


def _tangential(p: Array, v: Array) -> Array:
    inside = _transposed(p) @ v
    return np.asarray(v - p @ (inside + _transposed(inside)) / 2)


def _project(x: Array) -> Array:
    """The nearest matrix with orthonormal columns."""
    gram = _transposed(x) @ x
    off = np.abs(gram - np.eye(x.shape[-1])).max(axis=(-2, -1))
    # One step of Newton and Schulz (Higham, Functions of Matrices, 2008, section 8.3) squares the distance.
    nearest = 1.5 * x - 0.5 * (x @ gram)
    far = ~(off <= 1e-8)
    if far.any():
        u, _, v = np.linalg.svd(x[far], full_matrices=False)
        nearest[far] = u @ v
    return np.asarray(nearest)
