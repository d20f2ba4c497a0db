"""Geometry with 40 digits, by formulas that the library does not use: square roots, Cayley transforms, singular
values, power series, and transvections as products of two symmetries."""

import mpmath as mp
import numpy as np

DIGITS = 40


def exact(array):
    """An array of doubles as a matrix of mpmath; a vector becomes a column."""
    array = np.asarray(array)
    rows = array.reshape(len(array), -1)
    number = mp.mpc if array.dtype.kind == "c" else mp.mpf
    return mp.matrix([[number(x.item()) for x in row] for row in rows])


def doubles(matrix, like):
    """A matrix of mpmath as an array of the shape and kind of another."""
    like = np.asarray(like)
    number = complex if like.dtype.kind == "c" else (lambda x: float(mp.re(x)))
    values = [number(matrix[i, j]) for i in range(matrix.rows) for j in range(matrix.cols)]
    return np.reshape(np.array(values, dtype=like.dtype), like.shape)


def size(matrix):
    return mp.sqrt(sum(abs(x) ** 2 for x in matrix))


def hermitian(function, h):
    """A function of a Hermitian matrix, by its eigenvalues."""
    values, vectors = mp.eighe((h + h.H) / 2)
    return vectors * mp.diag([function(x) for x in values]) * vectors.H


def orthonormal(x):
    """The matrix with orthonormal columns nearest to x."""
    return x * hermitian(lambda value: 1 / mp.sqrt(value), x.H * x)


class Sphere:
    point = staticmethod(orthonormal)

    def exp(self, p, v):
        angle = size(v)
        return p * mp.cos(angle) + v * mp.sinc(angle)

    def log(self, p, q):
        away = q - p * (p.T * q)[0]
        return away * (mp.atan2(size(away), (p.T * q)[0]) / size(away))

    def distance(self, p, q):
        return size(self.log(p, q))

    def symmetry(self, p, x):
        return 2 * p * (p.T * x) - x


class Subspaces:
    """Grassmannians, real and complex."""

    point = staticmethod(orthonormal)

    def exp(self, p, v):
        u, angles, w = mp.svd(v, full_matrices=False)
        return p * w.H * mp.diag([mp.cos(x) for x in angles]) * w + u * mp.diag([mp.sin(x) for x in angles]) * w

    def log(self, p, q):
        u, tangents, w = mp.svd((q - p * (p.H * q)) * mp.inverse(p.H * q), full_matrices=False)
        return u * mp.diag([mp.atan(x) for x in tangents]) * w

    def distance(self, p, q):
        cosines = mp.svd(p.H * q, compute_uv=False)
        return mp.sqrt(sum(mp.acos(min(x, 1)) ** 2 for x in cosines))

    def symmetry(self, p, x):
        return 2 * p * (p.H * x) - x


def unitary_log(u):
    """The logarithm of a unitary matrix by its Cayley transform, whose eigenvalues are tan θ/2."""
    one = mp.eye(u.rows)
    return hermitian(lambda x: 2 * mp.atan(x), 1j * (one - u) * mp.inverse(one + u)) * 1j


class Unitary:
    """Unitary and orthogonal groups; lengths are for Re tr u*v."""

    point = staticmethod(orthonormal)

    def exp(self, p, v):
        return p * mp.expm(p.H * v, method="taylor")

    def log(self, p, q):
        return p * unitary_log(p.H * q)

    def distance(self, p, q):
        return size(unitary_log(p.H * q))

    def symmetry(self, p, x):
        return p * x.H * p


class PositiveDefinite:
    """Symmetric and Hermitian."""

    def point(self, x):
        return (x + x.H) / 2

    def exp(self, p, v):
        root, inverse = self.roots(p)
        return root * hermitian(mp.exp, inverse * v * inverse) * root

    def log(self, p, q):
        root, inverse = self.roots(p)
        return root * hermitian(mp.log, inverse * q * inverse) * root

    def distance(self, p, q):
        _, inverse = self.roots(p)
        return size(hermitian(mp.log, inverse * q * inverse))

    def symmetry(self, p, x):
        return p * mp.inverse(x) * p

    def roots(self, p):
        root = hermitian(mp.sqrt, p)
        return root, mp.inverse(root)


class Poses:
    """Rigid motions, with geodesics g exp(tξ)."""

    def point(self, x):
        n = x.rows - 1
        return self.pose(orthonormal(x[:n, :n]), x[:n, n], 1)

    def pose(self, turn, place, corner):
        n = turn.rows
        rows = [[turn[i, j] for j in range(n)] + [place[i]] for i in range(n)]
        return mp.matrix([*rows, [0] * n + [corner]])

    def exp(self, p, v):
        return p * mp.expm(mp.inverse(p) * v, method="taylor")

    def rates(self, p, q):
        """Of g = exp ξ the place is V v, with V the mean of exp sω over s from 0 to 1."""
        g = mp.inverse(p) * q
        n = g.rows - 1
        turn = unitary_log(g[:n, :n]).apply(mp.re)
        term = mean = mp.eye(n)
        for j in range(2, 100):
            term = term * turn / j
            mean = mean + term
        return self.pose(turn, mp.inverse(mean) * g[:n, n], 0)

    def log(self, p, q):
        return p * self.rates(p, q)

    def distance(self, p, q):
        """|(ω, v)|, with ½ tr ωᵀω."""
        rates = self.rates(p, q)
        n = p.rows - 1
        return mp.sqrt(size(rates[:n, :n]) ** 2 / 2 + size(rates[:n, n]) ** 2)

    def symmetry(self, p, x):
        return p * mp.inverse(x) * p


def transvection(geometry, p, v, x):
    """The product of the symmetries at p and halfway to exp(v)."""
    return geometry.symmetry(geometry.exp(p, v / 2), geometry.symmetry(p, x))
