"""Proofs by interval arithmetic that C² splines have velocities near given ones.

A symmetric space is given by matrices that span 𝔪, and by the origin o. At each node, a matrix G_i of the group moves o
to the point. All functions are power series of matrices, which the library does not use. The middle sides w are
unknowns beside the velocities u, so that no logarithm is needed:

    exp(w) o = exp(−a) g exp(−b) o,    g = G_i⁻¹ G_{i+1},    a = h u_i/3,    b = h u_{i+1}/3,

and likewise from the other end. Equation (e) of `docs/theorem.md`, multiplied by both S, which commute, is linear in w:

    S(v₋) (w₊ − v₊)/h₊² = S(v₊) (w₋ + v₋)/h₋² .

Newton's method solves these equations to 30 significant digits. The interval method of Krawczyk (R. E. Moore, R. B.
Kearfott and M. J. Cloud, *Introduction to Interval Analysis*, 2009, section 8.2) then proves that a box around the
result contains exactly one zero. Residuals are intervals of mpmath. Derivatives are floating-point numbers with
bounds of their errors.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from mpmath import iv, mp

EPS = np.finfo(float).eps
# Significant digits of the solution and of the intervals.
DIGITS = 40
# The half-width of the box.
WIDTH = 1e-25
# Terms of the power series, of intervals and of floating-point numbers: for the arguments that `series` accepts, the
# first omitted terms are below 1e-35 and 1e-16.
TERMS = (40, 24)
# Turns a sum of fewer than a hundred rounded products of bounds into an upper bound.
UP = 1 + 1e-13


class Undecided(Exception):
    """The intervals are too wide for a proof."""


def number(kind, x):
    return kind(x.item() if isinstance(x, np.generic) else x)


def intervals(array):
    """Numbers as intervals that contain nothing else, up to their last digit."""
    return np.vectorize(lambda x: number(iv.mpf, x), otypes=[object])(array)


def midpoints(array):
    return np.vectorize(lambda x: mp.mpf(x.mid), otypes=[object])(array)


def floats(array):
    return np.vectorize(float, otypes=[float])(array)


def near(array):
    """Floating-point numbers near intervals."""
    return floats(midpoints(array))


def sizes(array):
    """The largest absolute values in intervals, as floating-point numbers that are not smaller."""
    upper = floats(np.vectorize(lambda x: mp.mpf(abs(x).b), otypes=[object])(array))
    return np.nextafter(upper, np.inf)


class Jet:
    """An array of floating-point numbers with derivatives, and bounds of the errors of both.

    Both arrays have a leading axis: the value, then the derivatives by all variables (S. M. Rump, *Verification
    methods*, Acta Numerica 2010, section 9).
    """

    # NumPy leaves operations to this class.
    __array_ufunc__ = None

    def __init__(self, mid, rad):
        self.mid, self.rad = mid, rad

    def __getitem__(self, index):
        index = (slice(None), *(index if isinstance(index, tuple) else (index,)))
        return Jet(self.mid[index], self.rad[index])

    @property
    def T(self):
        return Jet(np.swapaxes(self.mid, -1, -2), np.swapaxes(self.rad, -1, -2))

    def ravel(self):
        return Jet(*(x.reshape(len(x), -1) for x in (self.mid, self.rad)))

    def __neg__(self):
        return Jet(-self.mid, self.rad)

    def __add__(self, other):
        mid = self.mid + other.mid
        return Jet(mid, (self.rad + other.rad + EPS * np.abs(mid)) * UP)

    def __sub__(self, other):
        return self + -other

    def __truediv__(self, divisor):
        """Divide by an integer."""
        mid = self.mid / divisor
        return Jet(mid, (self.rad / divisor + EPS * np.abs(mid)) * UP)

    def product(self, other, multiply):
        a, b, ra, rb = self.mid, other.mid, self.rad, other.rad
        x, y = np.abs(a), np.abs(b)
        value, by = slice(0, 1), slice(1, None)
        mid = multiply(a, b[value])
        mid[by] += multiply(a[value], b[by])

        # At most 40 products are added: their rounding errors are less than 40 ε times the sum of absolute values.
        def bound(i, j):
            return multiply(ra[i], y[j] + rb[j]) + multiply(x[i], rb[j] + 40 * EPS * y[j])

        rad = bound(slice(None), value)
        rad[by] += bound(value, by)
        return Jet(mid, rad * UP + 1e-300)

    def __matmul__(self, other):
        return self.product(other, np.matmul)

    def __mul__(self, other):
        return self.product(other, np.multiply)


def linear(constants, x):
    """Constants times coordinates, which belong to the last axis of the constants. At most 36 are not zero."""
    if isinstance(x, Jet):
        mid = np.tensordot(x.mid, constants, (1, -1))
        return Jet(mid, np.tensordot(x.rad + 40 * EPS * np.abs(x.mid), np.abs(constants), (1, -1)) * UP)
    result = np.full(constants.shape[:-1], 0 * x[0], dtype=object)
    for index in np.argwhere(constants):
        where = tuple(index[:-1])
        result[where] = result[where] + x[index[-1]] * constants[tuple(index)].item()
    return result


def series(matrix, start, divisors):
    """start + matrix start/d₁ + matrix² start/(d₁ d₂) + ⋯

    The series is summed from its last term. Divisors must be at least k, the norm of the matrix at most 2, and those of
    start and of all derivatives at most 100. Then all omitted terms together change the innermost start and its
    derivatives by less than 1000.
    """
    tail = 1000
    terms = TERMS[isinstance(start, Jet)]
    if isinstance(start, Jet):
        size = [np.sqrt(((np.abs(x.mid) + x.rad) ** 2).sum(axis=(-1, -2))) * UP for x in (matrix, start)]
        if size[0][0] > 2 or max(map(np.max, size)) > 100:
            raise Undecided("the argument of a power series is too large")
        result = Jet(start.mid, start.rad + tail)
    else:
        # The derivatives are taken in a neighbourhood of the same matrix, and check it.
        result = start + iv.mpf([-tail, tail]) if isinstance(start.flat[0], iv.mpf) else start
    for k in range(terms, 0, -1):
        result = start + (matrix @ result) / divisors(k)
    return result


class Space:
    """A symmetric space, by matrices that span 𝔪 and are orthogonal to each other.

    Attributes:
        basis: the matrices, shape (N, N, dim): last is the index of the coordinate.
        origin: the vector or matrix o, on which the group acts from the left.
        weights: the squared lengths of the matrices.
    """

    def __init__(self, basis, origin, weights=None):
        self.basis, self.origin = np.stack(basis, axis=-1), origin
        self.dim = len(basis)
        self.weights = weights or [1] * self.dim
        # [E_j, [E_k, E_l]] as combinations of the E_i: the coordinates are multiples of 1/4.
        double = np.zeros((self.dim, self.dim, self.dim, self.dim))
        columns = np.reshape(basis, (self.dim, -1)).T
        for (j, x), (k, y), (i, z) in itertools.product(enumerate(basis), repeat=3):
            inner = y @ z - z @ y
            outer = x @ inner - inner @ x
            found = np.round(4 * np.linalg.lstsq(columns, outer.ravel())[0]) / 4
            assert (columns @ found == outer.ravel()).all(), "𝔪 is not a Lie triple system"
            double[:, i, j, k] = found
        self.double = double.reshape(self.dim, self.dim, -1)

    def moved(self, v, x, sign=1):
        """exp(±v) x"""
        matrix = linear(self.basis, v[:, 0])
        return series(matrix if sign > 0 else -matrix, x, lambda k: k)

    def stretched(self, v, x):
        """S(v) x, with S(v) = 1 + ad²/3! + ad⁴/5! + ⋯"""
        square = (v * v.T).ravel()
        return series(linear(self.double, square), x, lambda k: 2 * k * (2 * k + 1))

    def length(self, v):
        """An upper bound of the length of a vector of intervals."""
        return sizes(iv.sqrt(sum(weight * x**2 for weight, x in zip(self.weights, v, strict=True))))


class Vectors(Space):
    """Spheres, hyperboloids and complex projective spaces: unit vectors, whose tangents are orthogonal to them.

    Complex vectors have their imaginary parts after the real ones.
    """

    def __init__(self, size, curvature=1, is_complex=False):
        self.size, self.curvature, self.is_complex = size, curvature, is_complex
        self.full = size * (1 + is_complex)
        tangents = [i for i in range(self.full) if i % size]
        basis = []
        for i in tangents:
            x = np.zeros((self.full, self.full))
            x[i, 0], x[0, i] = 1, -curvature
            if is_complex:
                # Complex linear: (i ξ) e₀ = ξ (i e₀).
                other = (i + size) % self.full
                sign = 1 if i < size else -1
                x[other, size], x[size, other] = sign, -sign
            basis.append(x)
        super().__init__(basis, np.eye(self.full)[:, :1])
        self.tangents = tangents
        self.metric = np.ones(self.full)
        self.metric[0] = curvature

    def real(self, x):
        """An array of real or complex vectors as intervals."""
        return intervals(np.concatenate([x.real, x.imag], axis=-1) if self.is_complex else x)

    def times_i(self, x):
        return np.concatenate([-x[self.size :], x[: self.size]])

    def frame(self, point):
        """A matrix of the group that moves the origin to the point, and its inverse."""
        if self.curvature < 0:
            # The boost: columns that are orthonormal as they stand, where Gram and Schmidt would lose accuracy.
            point = point / iv.sqrt(-(self.metric * point * point).sum())
            frame = intervals(np.eye(self.size))
            frame[:, 1:] += (point + frame[:, 0])[:, None] * point[1:] / (1 + point[0])
            frame[:, 0] = point
            return frame, self.metric[:, None] * frame.T * self.metric
        weights = np.abs(near(point)).reshape(-1, self.size).sum(axis=0)
        # All axes but the one nearest to the point.
        vectors = [point, *(intervals(np.eye(self.full)[i]) for i in np.argsort(weights)[:-1])]
        columns = []
        for x in vectors:
            for y in columns:
                for z in (y, self.times_i(y)) if self.is_complex else (y,):
                    x = x - z * (z * x).sum()
            columns.append(x / iv.sqrt((x * x).sum()))
        if self.is_complex:
            columns += [self.times_i(x) for x in columns]
        frame = np.stack(columns, axis=1)
        return frame, frame.T

    def coordinates(self, frame, v):
        return (frame[1] @ v)[self.tangents]

    def tangent(self, frame, v):
        """The vector with given coordinates."""
        return frame[0][:, self.tangents] @ v

    def log(self, x):
        """w with exp(w) o = x, for floating-point numbers."""
        x = x[:, 0]
        if self.is_complex:
            x = x[: self.size] + 1j * x[self.size :]
        x = x * (abs(x[0]) / x[0])
        size = np.linalg.norm(x[1:])
        angle = np.arctan2(size, abs(x[0])) if self.curvature > 0 else np.arcsinh(size)
        w = x[1:] * (angle / size if size else 1.0)
        return np.concatenate([w.real, w.imag]) if self.is_complex else w

    def equation(self, x, y):
        """x and y are on one line (x₀ y = y₀ x), real or complex, and x is exp(w) o with |w| < π/2."""
        check = [x] if self.is_complex else [x, y]
        if any(isinstance(z, Jet) and not z.mid[0, 0, 0] > z.rad[0, 0, 0] for z in check):
            raise Undecided("the middle side is too long")
        n = self.size
        if not self.is_complex:
            return [x[:1] * y[1:] - y[:1] * x[1:]]
        (xr, xi), (yr, yi) = ((z[:n], z[n:]) for z in (x, y))
        real = xr[:1] * yr[1:] - xi[:1] * yi[1:] - yr[:1] * xr[1:] + yi[:1] * xi[1:]
        imaginary = xr[:1] * yi[1:] + xi[:1] * yr[1:] - yr[:1] * xi[1:] - yi[:1] * xr[1:]
        return [real, imaginary]


class PositiveDefinite(Space):
    """Symmetric positive definite matrices x xᵀ, with tr p⁻¹u p⁻¹v. The matrices G are Cholesky factors."""

    def __init__(self, size):
        self.pairs = [(i, j) for i in range(size) for j in range(i, size)]
        basis = []
        for i, j in self.pairs:
            x = np.zeros((size, size))
            x[i, j] = x[j, i] = 0.5
            basis.append(x)
        super().__init__(basis, np.eye(size), [1 if i == j else 2 for i, j in self.pairs])

    def real(self, x):
        return intervals(x)

    def frame(self, point):
        n = len(point)
        root, inverse = (np.full((n, n), iv.mpf(0), dtype=object) for _ in range(2))
        for i in range(n):
            for j in range(i + 1):
                rest = point[i, j] - sum(root[i, k] * root[j, k] for k in range(j))
                root[i, j] = iv.sqrt(rest) if i == j else rest / root[j, j]
        for i in range(n):
            inverse[i, i] = 1 / root[i, i]
            for j in range(i):
                inverse[i, j] = -sum(root[i, k] * inverse[k, j] for k in range(j, i)) / root[i, i]
        return root, inverse

    def coordinates(self, frame, v):
        v = frame[1] @ v @ frame[1].T
        return np.array([v[pair] for pair in self.pairs])

    def tangent(self, frame, v):
        matrix = np.full_like(frame[0], iv.mpf(0))
        for (i, j), x in zip(self.pairs, v, strict=True):
            matrix[i, j] = matrix[j, i] = x
        return frame[0] @ matrix @ frame[0].T

    def log(self, x):
        values, vectors = np.linalg.eigh(x @ x.T)
        w = vectors @ np.diag(np.log(values)) @ vectors.T
        return np.array([w[pair] for pair in self.pairs])

    def equation(self, x, y):
        """x xᵀ = y yᵀ"""
        difference = x @ x.T - y @ y.T
        return [difference[i : i + 1, j : j + 1] for i, j in self.pairs]


def product_bounds(inverse, mid, rad, identity=0.0):
    """Upper bounds of the entries of identity − inverse · matrix, for all matrices within bounds."""
    errors = rad + (len(mid) + 10) * EPS * np.abs(mid)
    return (np.abs(identity - inverse @ mid) + np.abs(inverse) @ errors + 4 * EPS * identity) * UP


@dataclass
class Curve:
    """Points with velocities in one of the spaces above, as arrays of intervals.

    Attributes:
        space: the space.
        t: the knots.
        points: the points. Their scale does not matter where they are vectors.
        velocities: the computed velocities, which are projected to tangents.
        given: the velocities at both ends, or None for an end with zero acceleration.
        closed: whether the last point is the first one, where the curve is C² as well.
    """

    space: Space
    t: np.ndarray
    points: np.ndarray
    velocities: np.ndarray
    given: tuple = (None, None)
    closed: bool = False

    def __post_init__(self):
        space, n = self.space, len(self.t) - 1
        self.n, self.h = n, (intervals(self.t[1:]) - intervals(self.t[:-1]))[:, None, None]
        self.frames = [space.frame(p) for p in self.points]
        self.computed = [space.coordinates(*x) for x in zip(self.frames, self.velocities, strict=True)]
        ends = ((0, self.given[0]), (n, self.given[1]))
        self.known = {i: space.coordinates(self.frames[i], v) for i, v in ends if v is not None}
        self.free = [i for i in range(n + (not self.closed)) if i not in self.known]
        self.turns = [(a[1] @ b[0], b[1] @ a[0]) for a, b in itertools.pairwise(self.frames)]

    def handles(self, velocities, constant):
        """The handles at both ends of each segment, for the velocities of free nodes."""
        u = dict(zip(self.free, velocities, strict=True))
        u |= {i: constant(v[:, None]) for i, v in self.known.items()}
        if self.closed:
            u[self.n] = u[0]
        third = [constant(h / 3) for h in self.h]
        return [(third[i] * u[i], third[i] * u[i + 1]) for i in range(self.n)]

    def reached(self, handles, constant):
        """exp(w) o for both ends of each segment: where the inner handle at the other end is, seen from this one."""
        origin = constant(intervals(self.space.origin))
        for (a, b), turns in zip(handles, self.turns, strict=True):
            for v, other, turn, sign in ((a, b, turns[0], -1), (b, a, turns[1], 1)):
                yield self.space.moved(v, constant(turn) @ self.space.moved(other, origin, sign), sign)

    def residual(self, unknowns, constant):
        """The equations, for velocities of free nodes, then middle sides from both ends of each segment.

        Args:
            unknowns: columns of coordinates.
            constant: turns arrays of intervals into arrays of the same kind as the unknowns.
        """
        space, count = self.space, len(self.free)
        handles = self.handles(unknowns[:count], constant)
        middle = unknowns[count:]
        w = list(zip(middle[::2], middle[1::2], strict=True))
        origin = constant(intervals(space.origin))
        result = []
        for side, there in zip(middle, self.reached(handles, constant), strict=True):
            result += space.equation(space.moved(side, origin), there)
        for i in self.free:
            if not self.closed and i == 0:
                result.append(w[0][0] - handles[0][0])
            elif not self.closed and i == self.n:
                result.append(w[-1][1] + handles[-1][1])
            else:
                before, after = handles[i - 1][1], handles[i][0]
                scales = [constant(1 / (h * h)) for h in (self.h[i - 1], self.h[i])]
                right = space.stretched(before, w[i][0] - after) * scales[1]
                result.append(right - space.stretched(after, w[i - 1][1] + before) * scales[0])
        return result

    def derivative(self, z, width=WIDTH):
        """The residual with its derivatives in a box around z, of half-widths for all unknowns or for each."""
        rows = z.reshape(-1, self.space.dim)
        mid, rad = np.zeros((2, 1 + z.size, *rows.shape, 1))
        mid[0, ..., 0] = floats(rows)
        rad[0, ..., 0] = (EPS * np.abs(mid[0, ..., 0]) + np.broadcast_to(width, z.shape).reshape(rows.shape)) * UP
        mid[1:].reshape(z.size, z.size)[...] = np.eye(z.size)

        def constant(array):
            jet = Jet(*np.zeros((2, 1 + z.size, *array.shape)))
            jet.mid[0] = near(array)
            jet.rad[0] = sizes(array - intervals(jet.mid[0]))
            return jet

        all_rows = self.residual([Jet(mid[:, i], rad[:, i]) for i in range(len(rows))], constant)
        return Jet(*(np.concatenate([getattr(x, name) for x in all_rows], axis=1)[..., 0] for name in ("mid", "rad")))

    def columns(self, z):
        return list(z.reshape(-1, self.space.dim, 1))

    def solution(self):
        """Velocities of free nodes and middle sides, which are proved to be within `WIDTH` of exactly one zero."""
        start = [near(self.computed[i])[:, None] for i in self.free]
        there = self.reached(self.handles(start, near), near)
        z = np.concatenate([x.ravel() for x in start] + [self.space.log(floats(x)) for x in there])
        for _ in range(3):
            jet = self.derivative(z)
            z -= np.linalg.solve(jet.mid[1:].T, jet.mid[0])
        inverse = np.linalg.inv(jet.mid[1:].T)
        # One more step doubles the number of significant digits.
        z = np.vectorize(lambda x: number(mp.mpf, x), otypes=[object])(z)
        z = z - inverse.astype(object) @ np.concatenate(self.residual(self.columns(z), midpoints))[:, 0]
        self.prove(z)
        return z

    def prove(self, z):
        """Prove with Krawczyk's operator that exactly one zero is within `WIDTH` of z."""
        residual = np.concatenate(self.residual(self.columns(intervals(z)), lambda x: x))[:, 0]
        jet = self.derivative(z)
        inverse = np.linalg.inv(jet.mid[1:].T)
        off = product_bounds(inverse, jet.mid[1:].T, jet.rad[1:].T, np.eye(z.size))
        if not ((np.abs(inverse) @ sizes(residual) + off.sum(axis=1) * WIDTH) * UP).max() < WIDTH:
            raise Undecided("Krawczyk's operator does not map the box into itself")

    def only_one_within(self, z, radius):
        """Whether the solution z is proved to be the only one with coordinates of velocities within a radius."""
        count = len(self.free) * self.space.dim
        sides = slice(0, z.size - count)
        jet = self.derivative(z)
        inverse, of_sides = np.linalg.inv(jet.mid[1:].T), np.linalg.inv(jet.mid[1:].T[sides, count:])
        width = np.full(z.size, float(radius))
        for _ in range(20):
            try:
                jet = self.derivative(z, width)
            except Undecided:
                return False
            mid, rad = jet.mid[1:].T, jet.rad[1:].T
            # Krawczyk's operator for the middle sides, for all velocities of the box.
            by_velocities = product_bounds(of_sides, mid[sides, :count], rad[sides, :count])
            by_sides = product_bounds(of_sides, mid[sides, count:], rad[sides, count:], np.eye(z.size - count))
            change = by_velocities @ width[:count] + by_sides @ width[count:]
            if (change * UP + WIDTH < width[count:]).all():
                break
            width[count:] = 1.02 * change
        else:
            return False
        # All matrices near the derivative are regular, if 1 minus their products by the inverse contract in some norm.
        off = product_bounds(inverse, mid, rad, np.eye(z.size))
        scale = np.ones(len(off))
        for _ in range(30):
            scale = off @ scale / np.max(off @ scale) + 1e-3
        return bool((off @ scale * UP < scale).all())

    def exact(self, z):
        """Coordinates of the velocities of a solution at all nodes."""
        exact = dict(self.known)
        for i, v in zip(self.free, z.reshape(-1, self.space.dim), strict=False):
            exact[i] = intervals(v) + iv.mpf([-WIDTH, WIDTH])
        if self.closed:
            exact[self.n] = exact[0]
        return [exact[i] for i in range(self.n + 1)]

    def errors(self):
        """Upper bounds of the errors of the computed velocities, one per node."""
        pairs = zip(self.computed, self.exact(self.solution()), strict=True)
        return np.array([self.space.length(computed - exact) for computed, exact in pairs])


def rotations(points, velocities):
    """Quaternions, whose lengths are half those of rotations."""
    result = []
    for rotation, velocity in zip(points, velocities, strict=True):
        r = mp.matrix(rotation.tolist())
        for _ in range(4):
            r = (r + mp.inverse(r).T) / 2
        # Of these four multiples of the quaternion, the longest.
        x, y, z = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
        trace = r[0, 0] + r[1, 1] + r[2, 2]
        rows = [[1 + trace, x, y, z]]
        for i, w in enumerate((x, y, z)):
            rows.append([w, *(r[i, j] + r[j, i] + (1 - trace if i == j else 0) for j in range(3))])
        q = np.array(max(rows, key=lambda row: mp.norm(row)), dtype=object)
        q = intervals(q / mp.norm(list(q)))
        if result and (result[-1][0] * q).sum() < 0:
            q = -q
        rate = intervals(rotation).T @ intervals(velocity)
        a, b, c = ((rate[j, i] - rate[i, j]) / 4 for i, j in ((1, 2), (2, 0), (0, 1)))
        w, x, y, z = q
        turned = [-x * a - y * b - z * c, w * a + y * c - z * b, w * b + z * a - x * c, w * c + x * b - y * a]
        result.append((q, np.array(turned)))
    return [tuple(map(np.array, zip(*result, strict=True)))]


def planes(points, velocities):
    """Two spheres: oriented planes in R⁴ are pairs of a self-dual and an anti-self-dual bivector."""
    # Neighbours have orientations for which the bivectors are near to each other.
    signs = np.cumprod([1, *(np.sign(np.linalg.det(p.T @ q)) for p, q in itertools.pairwise(points))])
    result = []
    for dual in (1, -1):

        def bivector(x, y, dual=dual):
            def of(i, j):
                return x[i] * y[j] - x[j] * y[i]

            return np.array([of(0, 1) + dual * of(2, 3), of(0, 2) - dual * of(1, 3), of(0, 3) + dual * of(1, 2)])

        places, rates = [], []
        for plane, velocity, sign in zip(points, velocities, signs, strict=True):
            (a, b), (da, db) = intervals(plane).T, intervals(velocity).T
            place = bivector(a, b)
            scale = int(sign) / iv.sqrt((place * place).sum())
            places.append(place * scale)
            rates.append((bivector(da, b) + bivector(a, db)) * scale)
        result.append((np.array(places), np.array(rates)))
    return result


@dataclass
class Model:
    """How a space of the library is one of the spaces above, or a product of two.

    Attributes:
        space: the space of each factor.
        arrays: turns points and velocities into those of each factor.
        scale: the length of a vector of the library, for one whose parts have the length 1 together.
    """

    space: Space
    arrays: Callable
    scale: float = 1.0

    def curves(self, t, points, velocities, given=(None, None), closed=False):
        ends = velocities.copy()
        for i, v in zip((0, -1), given, strict=True):
            ends[i] = 0 if v is None else v
        factors = zip(self.arrays(points, velocities), self.arrays(points, ends), strict=True)
        for (p, u), (_, v) in factors:
            known = tuple(None if x is None else v[i] for i, x in zip((0, -1), given, strict=True))
            yield Curve(self.space, t, p, u, known, closed)

    def length(self, parts):
        """Upper bounds of lengths, from those of the parts in each factor."""
        return self.scale * np.sqrt(sum(np.square(x) for x in parts)) * UP

    def errors(self, *curve):
        """Upper bounds of the lengths of the errors of velocities, one per node."""
        return self.length([factor.errors() for factor in self.curves(*curve)])


def vectors(space):
    return Model(space, lambda points, velocities: [(space.real(points), space.real(velocities))])


MODELS = {
    "sphere:2": vectors(Vectors(3)),
    "hyperbolic:2": vectors(Vectors(3, curvature=-1)),
    "so:3": Model(Vectors(4), rotations, 2.0),
    "cp:2": vectors(Vectors(3, is_complex=True)),
    "gr:2,4": Model(Vectors(3), planes, float(np.nextafter(np.sqrt(0.5), 1))),
    "spd:3": vectors(PositiveDefinite(3)),
}
