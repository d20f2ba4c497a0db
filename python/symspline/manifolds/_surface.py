"""Surfaces given by an equation, with geodesics from their differential equation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .._base.arrays import short_repr, whole_number
from .._core import ValidationError
from .._spaces import Array
from ._differences import directional_derivative, jacobian
from ._manifold import Manifold
from ._operations import Function

# Newton's iterations, and the size of a step that is the last, relative to the distance.
_MOST = 40
_SMALL = 1e-7
_ROUGH = 1e-5
# Steps of Gragg's method, whose results are extrapolated to order twelve.
_NUMBERS = (2, 4, 6, 8, 10, 12)
# The error of order ten at which that of order twelve is rounding, relative to the largest number.
FINE = 1e-12
_MOST_STEPS = 64
# By what angle a solution may turn in one step that is fine.
_REACH = 0.35


class Surface(Manifold):
    """A level set F = 0 in Rⁿ with the metric of Rⁿ, see `from_surface`."""

    def __init__(self, f: Function, grad: Function, n: int, hess: Function | None, radius: float | None) -> None:
        self._f, self._grad, self._given_hess = f, grad, hess
        for name, function in (("F", f), ("grad", grad), ("hess", grad if hess is None else hess)):
            if not callable(function):
                raise ValidationError(f"{name} must be a function, not {short_repr(function)}")
        super().__init__(
            exp=self._exp,
            log=self._log,
            project_tangent=self._tangential,
            inner=_inner,
            project=self._nearest,
            injectivity_radius=radius,
            point_shape=whole_number(n, "n", 2),
            dim=n - 1,
        )

    def _description(self) -> str:
        return f"{getattr(self._f, '__qualname__', self._f)}, n={self.point_shape[0]}"

    def _key(self) -> tuple[Any, ...]:
        return self._f, self._grad, self._given_hess, self._radius, self._point_shape

    def __reduce__(self) -> tuple[Any, ...]:
        radius = None if np.isinf(self._radius) else self._radius
        return Surface, (self._f, self._grad, self._point_shape[0], self._given_hess, radius)

    # ---- the functions of the manifold ----

    def _exp(self, p: Array, v: Array) -> Array:
        y = integrate(self._geodesic, np.stack([p, v], axis=1), self._turns(p, v))
        return self._nearest(y[:, 0])

    def _log(self, p: Array, q: Array) -> Array:
        """Shooting: Newton's method for the velocity of a geodesic that arrives at q."""
        v = self._tangential(p, q - p)
        chord = np.linalg.norm(q - p, axis=1, keepdims=True)
        size = np.linalg.norm(v, axis=1, keepdims=True)
        v = v * np.divide(chord, size, out=np.ones_like(size), where=size > 0)
        best, kept, step = np.full(len(p), np.inf), v.copy(), np.zeros_like(v)
        found, left, halvings = np.full(p.shape, np.nan), np.arange(len(p)), np.zeros(len(p))
        rough = True
        for _ in range(_MOST):
            # Far from the end of the iteration geodesics need not be exact.
            x, basis, fields = self._spread(p[left], v[left], _ROUGH if rough else FINE)
            error = np.linalg.norm(q[left] - x, axis=1)
            better = error < best[left]
            news = left[better]
            best[news], kept[news], halvings[news] = error[better], v[news], 0
            step[news] = _combined(basis, fields, self._tangential(x, q[left] - x))[better]
            halvings[left[~better]] += 1
            v[left] = kept[left] + 0.5 ** halvings[left, None] * step[left]
            # What is left behind a small step of Newton's is its square.
            there = better & (np.linalg.norm(step[left], axis=1) <= _SMALL * np.maximum(chord[left, 0], _SMALL))
            found[left[there]] = v[left[there]]
            left = left[~there & (halvings[left] < 10) & np.isfinite(v[left]).all(axis=1)]
            if not left.size and rough:
                # Once more, from there.
                rough, left = False, np.flatnonzero(np.isfinite(found).all(axis=1))
                best[left], kept[left], v[left], halvings[left] = np.inf, found[left], found[left], 0
                found[left] = np.nan
            if not left.size:
                break
        return found

    def _dlog(self, p: Array, v: Array, q: Array, w: Array) -> Array:
        """By Jacobi fields: the derivative of exp_p at v in a direction e is J(1) with J(0) = 0, J'(0) = e."""
        _, basis, fields = self._spread(p, v)
        return _combined(basis, fields, w)

    def _tangential(self, p: Array, v: Array) -> Array:
        normal = _unit(self._gradient(p))
        return np.asarray(v - np.sum(v * normal, axis=1, keepdims=True) * normal)

    def _nearest(self, x: Array, most: int = _MOST) -> Array:
        """Newton's method along the gradient: near the surface, the nearest point up to the square of its distance."""
        for _ in range(most):
            g = self._gradient(x)
            change = (np.asarray(self._f(x)) / np.sum(g * g, axis=1))[:, None] * g
            x = x - change
            if not (np.abs(change) > 1e-15 * np.maximum(1.0, np.abs(x))).any():
                break
        return x

    # ---- differential equations ----

    def _gradient(self, x: Array) -> Array:
        return np.asarray(self._grad(x), float)

    def _hess(self, x: Array) -> Array:
        if self._given_hess is None:
            return jacobian(self._gradient, x)
        return np.asarray(self._given_hess(x), float)

    def _turns(self, p: Array, v: Array) -> Array:
        """Return the angle by which geodesics turn, from the curvature at their start."""
        g = self._gradient(p)
        turned = (self._hess(p) @ v[..., None])[..., 0]
        return np.asarray(np.linalg.norm(turned, axis=1) / np.linalg.norm(g, axis=1))

    def _geodesic(self, y: Array) -> Array:
        """Return the derivative of rows of position and velocity: x'' is normal."""
        x, t = y[:, 0], y[:, 1]
        g = self._gradient(x)
        rough = self._given_hess is None
        turned = directional_derivative(self._gradient, x, t) if rough else (self._hess(x) @ t[..., None])[..., 0]
        pull = np.sum(t * turned, axis=1) / np.sum(g * g, axis=1)
        return np.stack([t, -pull[:, None] * g], axis=1)

    def _spread(self, p: Array, v: Array, tol: float = FINE) -> tuple[Array, Array, Array]:
        """Return the end of the geodesic with velocity v, a basis at p, and at the end the Jacobi fields J with
        J(0) = 0 and J'(0) in the basis: shapes (m, n), (m, n − 1, n) twice."""
        basis = np.swapaxes(np.linalg.qr(self._gradient(p)[..., None], "complete").Q[..., 1:], 1, 2)
        # Rows of position, velocity, fields and their covariant derivatives.
        y = np.concatenate([p[:, None], v[:, None], np.zeros_like(basis), basis], axis=1)
        y = integrate(self._jacobi, y, self._turns(p, v), tol)
        return y[:, 0], basis, y[:, 2 : 2 + basis.shape[1]]

    def _jacobi(self, y: Array) -> Array:
        """The geodesic and Jacobi's equation D²J/dt² = −R(J, T)T, with Gauss's equation for R."""
        count = (y.shape[1] - 2) // 2
        x, moving = y[:, 0], y[:, 1:]
        g, h = self._gradient(x), self._hess(x)
        square = np.sum(g * g, axis=1)[:, None]
        # Of T, the fields and their derivatives.
        turned = moving @ h
        along = (moving @ turned[:, 0, :, None])[..., 0]
        across = (turned[:, : count + 1] @ g[..., None])[..., 0]
        tt, jt = along[:, :1], along[:, 1 : count + 1]
        result = np.empty_like(y)
        result[:, 0], result[:, 1], result[:, 2 : count + 2] = moving[:, 0], 0.0, y[:, count + 2 :]
        bent = jt[..., None] * turned[:, :1] - tt[..., None] * turned[:, 1 : count + 1]
        result[:, count + 2 :] = bent / square[..., None]
        # The part that turns with the surface, and the normal part of the curvature.
        along[:, count + 1 :] += (jt * across[:, :1] - tt * across[:, 1:]) / square
        result[:, 1:] -= along[..., None] * (g / square)[:, None]
        return result


def from_surface(
    F: Function, grad: Function, n: int, *, hess: Function | None = None, injectivity_radius: float | None = None
) -> Surface:
    """Define a surface in Rⁿ by an equation, with lengths as in Rⁿ.

    Parameters
    ----------
    F : callable
        Function of points, shape (m, n), with values of shape (m,). The surface is F = 0. F must be defined near it.
    grad : callable
        Gradient of F, shape (m, n), which must not vanish on the surface.
    n : int
        Dimension of the space around the surface.
    hess : callable, optional
        Second derivatives of F, shape (m, n, n). By default they are differences of order four of the gradient, which
        is slower; geodesics then have errors of about 1e-12.
    injectivity_radius : float, optional
        As for `Manifold`.

    Returns
    -------
    Manifold
        The surface.

    See Also
    --------
    symspline.Manifold : Define a manifold by functions.

    Notes
    -----
    Geodesics are integrated to rounding by an extrapolation method of order twelve. Logarithms are computed by
    shooting, and their derivatives by Jacobi's equation, with Gauss's equation for the curvature.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> axes = np.array([1.0, 1.2, 0.8])
    >>> ellipsoid = ss.manifolds.from_surface(
    ...     lambda x: np.sum((x / axes) ** 2, axis=-1) - 1, lambda x: 2 * x / axes**2, 3,
    ...     hess=lambda x: np.broadcast_to(np.diag(2 / axes**2), (len(x), 3, 3)),
    ... )
    >>> spline = ss.CubicSpline(None, [[1, 0, 0], [0, 1.2, 0], [0, 0, 0.8]], ellipsoid)
    >>> bool(abs(np.sum((spline([0.3, 1.8]) / axes) ** 2, axis=-1) - 1).max() < 1e-14)
    True
    """
    return Surface(F, grad, n, hess, injectivity_radius)


def _inner(p: Array, u: Array, v: Array) -> Array:
    return np.asarray(np.sum(u * v, axis=1))


def _unit(g: Array) -> Array:
    return np.asarray(g / np.linalg.norm(g, axis=1, keepdims=True))


def _combined(basis: Array, fields: Array, w: Array) -> Array:
    """Σ cₐ eₐ where w = Σ cₐ Jₐ."""
    gram = np.einsum("mai,mbi->mab", fields, fields)
    right = np.einsum("mai,mi->ma", fields, w)
    solvable = np.isfinite(gram).all(axis=(1, 2)) & (np.linalg.cond(np.where(np.isfinite(gram), gram, 0.0)) < 1e15)
    c = np.full(right.shape, np.nan)
    c[solvable] = np.linalg.solve(gram[solvable], right[solvable][..., None])[..., 0]
    return np.asarray(np.einsum("ma,mai->mi", c, basis))


# ---- ordinary differential equations: extrapolation (Hairer, Nørsett and Wanner, Solving ordinary differential
# equations I, 1993, II.9) ----


def integrate(f: Callable[[Array], Array], y: Array, turns: Array, tol: float = FINE) -> Array:
    """y(1) of y' = f(y), of rows y: each by as many steps of order twelve as it needs; NaN where 64 are too few.

    Args:
        turns: approximate angle by which the solution turns, one per row; it sets the first number of steps.
        tol: largest error of order ten.
    """
    result = np.full_like(y, np.nan)
    reach = _REACH * (tol / FINE) ** 0.1
    steps = 2.0 ** np.clip(np.rint(np.log2(np.maximum(turns, 1e-300) / reach)), 0, np.log2(_MOST_STEPS))
    left = np.arange(len(y))
    while left.size:
        # All that need the fewest steps.
        count = steps[left].min()
        own = left[steps[left] == count]
        now, error = y[own], np.zeros(len(own))
        with np.errstate(all="ignore"):
            for _ in range(int(count)):
                now, more = _step(f, now, 1 / count)
                error += more
            excess = error / (tol * np.maximum(1.0, _sizes(now)))
            # It falls with the tenth power of the steps.
            factor = 2.0 ** np.ceil(np.maximum(1.0, np.log2(excess) / 10))
        done = excess <= 1
        result[own[done]] = now[done]
        steps[own] = np.where(done | ~(count * factor <= _MOST_STEPS), np.inf, count * factor)
        left = left[np.isfinite(steps[left])]
    return result


def _sizes(y: Array) -> Array:
    return np.asarray(np.abs(y).reshape(len(y), -1).max(axis=1))


def _step(f: Callable[[Array], Array], y: Array, h: float) -> tuple[Array, Array]:
    """One step, and the error of the order before."""
    start = f(y)
    table: list[Array] = []
    for j, n in enumerate(_NUMBERS):
        row = [_midpoint(f, y, start, h / n, n)]
        for k in range(1, j + 1):
            ratio = (n / _NUMBERS[j - k]) ** 2 - 1
            row.append(row[-1] + (row[-1] - table[k - 1]) / ratio)
        table = row
    return table[-1], _sizes(table[-1] - table[-2])


def _midpoint(f: Callable[[Array], Array], y: Array, start: Array, h: float, n: int) -> Array:
    """Gragg's method, whose error is a series in h²."""
    before, now = y, y + h * start
    for _ in range(n - 1):
        before, now = now, before + 2 * h * f(now)
    return np.asarray((before + now + h * f(now)) / 2)
