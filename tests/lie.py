"""Groups, Lie algebras and the splitting g = h + m of the paper's appendix A, with matrices.

An element of the algebra of a group that acts by pairs is an array of two matrices, so that sums, brackets and
exponentials are the same for all spaces.
"""

import numpy as np
from cases import HYPERBOLIC
from scipy.linalg import expm

import symspline as ss

FLAT = (ss.Euclidean, ss.Torus)
CONGRUENT = (
    ss.LogEuclidean,
    ss.SymmetricPositiveDefinite,
    ss.HermitianPositiveDefinite,
    ss.SpecialPositiveDefinite,
    ss.Siegel,
)
GROUPS = (
    *(ss.SpecialOrthogonal, ss.Orthogonal, ss.SpecialUnitary, ss.Unitary, ss.SpecialEuclidean),
    *(ss.GeneralLinear, ss.ComplexGeneralLinear, ss.Affine, ss.Similarity),
    *(ss.SpecialLinear, ss.Symplectic, ss.Lorentz),
)


def adjoint(x):
    return np.swapaxes(np.conj(x), -1, -2)


def bracket(x, y):
    return x @ y - y @ x


def columns(x):
    """Vectors as matrices of one column."""
    return x[..., None] if x.ndim == 1 else x


def negative_axes(space):
    """How many of the first axes have a negative sign in the form that the group preserves."""
    if isinstance(space, ss.IndefiniteGrassmannian):
        return int(str(space).split(",")[2])
    return 2 if isinstance(space, ss.AntiDeSitter) else isinstance(space, (*HYPERBOLIC, ss.DeSitter))


class Lie:
    """The group of a space, by formulas that are linear in matrices."""

    def __init__(self, space):
        self.space = space
        form = np.ones(space.point_shape[0])
        form[: negative_axes(space)] = -1.0
        self.form = np.diag(form)

    def noise(self, rng, *shape):
        x = rng.standard_normal(shape)
        return x + 1j * rng.standard_normal(shape) if self.space.dtype == complex else x

    def algebra(self, rng):
        """A random element of g."""
        space, n = self.space, self.space.point_shape[0]
        if isinstance(space, FLAT):
            x = np.zeros((n + 1, n + 1))
            turn = rng.standard_normal((n, n))
            x[:n, :n], x[:n, n] = turn - turn.T, rng.standard_normal(n)
            if isinstance(space, ss.Torus):
                # Its isometries are shifts and signed permutations.
                x[:n, :n] = 0
            return x
        if isinstance(space, ss.LogEuclidean):
            x = rng.standard_normal((n, n))
            return x - x.T
        if isinstance(space, ss.Siegel):
            x = rng.standard_normal((n, n))
            return np.kron([[0.0, 1.0], [-1.0, 0.0]], np.eye(n // 2)) @ (x + x.T) / 2
        if isinstance(space, ss.SpecialPositiveDefinite):
            x = rng.standard_normal((n, n))
            return x - np.eye(n) * np.trace(x) / n
        if isinstance(space, CONGRUENT):
            return self.noise(rng, n, n)
        if isinstance(space, GROUPS):
            one = space.project(np.eye(n))
            pair = space.random_tangent(rng, np.array([one, one]))
            return np.asarray(pair)
        x = self.noise(rng, n, n)
        if isinstance(space, ss.QuaternionicProjective):
            j = np.kron(np.eye(n // 2), [[0.0, -1.0], [1.0, 0.0]])
            x = (x - j @ x.conj() @ j) / 2
        # g*J + Jg = 0.
        return (x - self.form @ adjoint(x) @ self.form) / 2

    def exp(self, x):
        return expm(x)

    def element(self, rng, size=0.5):
        """A random element of G, in another component than the unit where there is one."""
        g = self.exp(size * self.algebra(rng))
        flip = np.eye(g.shape[-1])
        last = 0 if isinstance(self.space, FLAT) else -1
        flip[last, last] = -1.0
        if isinstance(self.space, ss.Orthogonal):
            return np.array([g[0] @ flip, g[1]])
        if isinstance(self.space, (*GROUPS, ss.QuaternionicProjective, ss.Siegel)):
            return g
        return g @ flip

    def given(self, g):
        """As `Space.act` takes it."""
        return tuple(g) if isinstance(self.space, GROUPS) else g

    def act(self, g, x):
        return self.space.act(self.given(g), x)

    def push(self, g, v):
        """g · v of a tangent vector."""
        space = self.space
        if isinstance(space, FLAT):
            return g[:-1, :-1] @ v
        if isinstance(space, ss.IndefiniteGrassmannian):
            return g @ v @ np.linalg.inv(g)
        if isinstance(space, GROUPS):
            return g[0] @ v @ np.linalg.inv(g[1])
        if isinstance(space, CONGRUENT):
            return g @ v @ adjoint(g)
        return g @ v

    def at(self, x, p):
        """The infinitesimal action (5), a tangent vector at p."""
        space = self.space
        if isinstance(space, FLAT):
            return x[:-1, :-1] @ p + x[:-1, -1]
        if isinstance(space, GROUPS):
            return x[0] @ p - p @ x[1]
        if isinstance(space, CONGRUENT):
            return x @ p + p @ adjoint(x)
        # What turns a basis within its subspace, or a phase, is no movement.
        return space.project_tangent(p, x @ p)

    def lift(self, p, v):
        """The element of m_p that moves p with velocity v: the connection ϖ of (26)."""
        space = self.space
        if isinstance(space, FLAT):
            x = np.zeros((len(p) + 1, len(p) + 1))
            x[:-1, -1] = v
            return x
        if isinstance(space, GROUPS):
            return np.array([v @ np.linalg.inv(p), -np.linalg.solve(p, v)]) / 2
        if isinstance(space, CONGRUENT):
            return v @ np.linalg.inv(p) / 2
        p, v = columns(p), columns(v)
        square = np.sign((adjoint(p) @ self.form @ p)[0, 0].real)
        return square * (v @ adjoint(p) - p @ adjoint(v)) @ self.form

    def involution(self, p, x):
        """Conjugation by the symmetry at p: 1 on h_p, −1 on m_p."""
        space = self.space
        if isinstance(space, FLAT):
            s = -np.eye(len(p) + 1)
            s[:-1, -1], s[-1, -1] = 2 * p, 1.0
            return s @ x @ s
        if isinstance(space, GROUPS):
            return np.array([p @ x[1] @ np.linalg.inv(p), np.linalg.solve(p, x[0] @ p)])
        if isinstance(space, CONGRUENT):
            return -p @ adjoint(x) @ np.linalg.inv(p)
        p = columns(p)
        square = np.sign((adjoint(p) @ self.form @ p)[0, 0].real)
        s = 2 * square * p @ adjoint(p) @ self.form - np.eye(len(p))
        return s @ x @ s

    def onto_m(self, p, x):
        """The projection π_p: g → m_p."""
        return (x - self.involution(p, x)) / 2

    def dexp(self, x, y, terms=60):
        """dexp_x(y), the sum of ad_x^k y / (k + 1)!."""
        total, term = 0 * y, y
        for k in range(1, terms + 1):
            total = total + term
            term = bracket(x, term) / (k + 1)
        return total
