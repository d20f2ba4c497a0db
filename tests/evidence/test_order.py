"""Every estimate of the proof of order four in docs/theory/order.md, measured on a sphere, SPD(3) and Gr(2, 4)."""

import numpy as np
import pytest
from scipy.linalg import expm

import symspline as ss

SPACES = ["sphere:2", "spd:3", "gr:2,4"]
END = 2.4


class Motion:
    """γ(t) = exp(tA) exp(tB) · o with exact derivatives: g' = Ag + gB."""

    def __init__(self, name, seed=4):
        self.space, rng = ss.space(name), np.random.default_rng(seed)
        self.name = name
        n = self.space.point_shape[0]
        a, b = rng.standard_normal((2, n, n))
        if name != "spd:3":
            a, b = a - a.T, b - b.T
        speed = 0.3 if name == "spd:3" else 0.8
        self.a, self.b = speed * a / np.linalg.norm(a), speed * b / np.linalg.norm(b)
        self.o = np.eye(n) if name == "spd:3" else self.space.random_point(rng)

    def derivatives(self, t):
        """The point, the velocity and the covariant acceleration at times of shape (m,)."""
        a, b = self.a, self.b
        g = np.array([expm(s * a) @ expm(s * b) for s in np.atleast_1d(t)])
        first = a @ g + g @ b
        second = a @ first + first @ b
        if self.name == "spd:3":
            p, left = g @ g.mT, first @ g.mT
            v, w = left + left.mT, second @ g.mT + 2 * first @ first.mT + g @ second.mT
            return p, v, w - v @ np.linalg.inv(p) @ v
        p, v, w = g @ self.o, first @ self.o, second @ self.o
        if self.name == "gr:2,4":
            normal = np.eye(len(a)) - p @ p.mT
            return p, normal @ v, normal @ (w - 2 * v @ (p.mT @ v))
        return p, v, w - np.sum(w * p, axis=-1, keepdims=True) * p

    def embed(self, point, tangent):
        """A vector that does not depend on the basis of a subspace."""
        return tangent @ point.mT + point @ tangent.mT if self.name == "gr:2,4" else tangent

    def errors(self, curve, x):
        """The largest errors of position, velocity and acceleration."""
        p, *exact = self.derivatives(x)
        q = curve(x)
        found = [self.embed(q, curve(x, nu=nu)) - self.embed(p, e) for nu, e in zip((1, 2), exact, strict=True)]
        return np.array([self.space.distance(p, q).max(), *(np.abs(error).max() for error in found)])


def knots(count):
    """Intervals with the ratios 1 : 1.6 : 0.7."""
    steps = np.resize([1.0, 1.6, 0.7], count)
    return np.r_[0, np.cumsum(steps) * END / steps.sum()]


def size(motion, p, v):
    return motion.space.norm(p, v)


def orders(values):
    values = np.array(values)
    return np.log2(values[:-1] / values[1:])[-1]


X = np.linspace(0, END, 601)


@pytest.mark.parametrize("name", SPACES)
def test_bezier_segments_with_exact_velocities(name):
    """Lemma 1: errors of order 4, 3 and 2."""
    motion, found = Motion(name), []
    for count in (24, 48):
        t = knots(count)
        p, v, _ = motion.derivatives(t)
        found.append(motion.errors(ss.HermiteSpline(t, p, v, motion.space), X))
    assert np.all(np.abs(orders(found) - [4, 3, 2]) < 0.25)


@pytest.mark.parametrize("name", SPACES)
def test_consistency(name):
    """Accelerations at exact velocities are exact up to O(h²), from both sides."""
    motion, found = Motion(name), []
    for count in (24, 48):
        t = knots(count)
        p, v, w = motion.derivatives(t)
        off = []
        for i in range(1, count):
            for j, at in ((i, 0), (i - 1, 1)):
                segment = ss.HermiteSpline(t[j : j + 2], p[j : j + 2], v[j : j + 2], motion.space)
                found_there = motion.embed(segment(t[j + at]), segment(t[j + at], nu=2))
                off.append(np.abs(found_there - motion.embed(p[i], w[i])).max())
        found.append(max(off))
    assert abs(orders(found) - 2) < 0.2


@pytest.mark.parametrize("name", SPACES)
def test_geodesics_in_normal_coordinates(name):
    """R is O(h³) for general points at the distance h, and O(h⁴) within O(h²) of one line."""
    space, rng = ss.space(name), np.random.default_rng(2)
    o = space.random_point(rng)
    e, a, b = (space.random_tangent(rng, o) for _ in range(3))
    for near, order in ((False, 3), (True, 4)):
        found = []
        for h in (0.04, 0.02):
            x, y = (0.3 * h * e + h**2 * a, 0.8 * h * e + h**2 * b) if near else (0.3 * h * a, 0.8 * h * b)
            s = 0.37
            point = space.geodesic(space.exp(o, x), space.exp(o, y), s)
            found.append(space.norm(o, space.log(o, point) - (1 - s) * x - s * y))
        assert abs(orders(found) - order) < 0.15


def test_motion_is_within_second_order_of_a_line():
    """The control points of a smooth motion lie within O(h²) of one line through the knot."""
    motion, found = Motion("spd:3"), []
    space = motion.space
    for h in (0.1, 0.05):
        p, v, _ = motion.derivatives([0.3, 0.3 + h])
        points = [space.exp(p[0], h * v[0] / 3), space.exp(p[1], -h * v[1] / 3), p[1]]
        line = [h * v[0] * c for c in (1 / 3, 2 / 3, 1)]
        found.append(max(space.norm(p[0], space.log(p[0], q) - x) for q, x in zip(points, line, strict=True)))
    assert abs(orders(found) - 2) < 0.15


@pytest.mark.parametrize("name", SPACES)
def test_derivative_of_the_acceleration(name):
    """Lemma 2: G, a sixth of the acceleration for h = 1, is x − ζ − 2ξ, and its derivative differs by O(h²)."""
    space, rng = ss.space(name), np.random.default_rng(6)
    o = space.random_point(rng)
    x, xi, zeta, dxi, dzeta = (space.random_tangent(rng, o) for _ in range(5))

    def g(x, xi, zeta):
        q = space.exp(o, x)
        velocities = np.stack([3 * xi, 3 * space.transport(o, q, zeta)])
        return ss.HermiteSpline([0, 1], np.stack([o, q]), velocities, space)(0.0, nu=2) / 6

    # G is odd: the point reflection at o.
    assert space.norm(o, g(0.3 * x, 0.2 * xi, 0.1 * zeta) + g(-0.3 * x, -0.2 * xi, -0.1 * zeta)) < 1e-12
    found, d = [], 1e-3
    for h in (0.2, 0.1):
        slope = (
            g(h * x, h * xi + d * dxi, h * zeta + d * dzeta) - g(h * x, h * xi - d * dxi, h * zeta - d * dzeta)
        ) / (2 * d)
        found.append(space.norm(o, slope + 2 * dxi + dzeta))
    assert abs(orders(found) - 2) < 0.2


def matrix(h, ends):
    """T of (m) with the rows of newton.md."""
    n = len(h) + 1
    t = np.zeros((n, n))
    for i in range(1, n - 1):
        t[i, i - 1 : i + 2] = 1 / h[i - 1], 2 / h[i - 1] + 2 / h[i], 1 / h[i]
    for i, j, near, far in ((0, 1, h[0], h[1]), (n - 1, n - 2, h[-1], h[-2])):
        rows = {"velocity": (1, 0), "acceleration": (2 / near, 1 / near), "not-a-knot": (1, 1 + near / far)}
        t[i, [i, j]] = rows[ends]
    return t


@pytest.mark.parametrize("ends", ["velocity", "acceleration", "not-a-knot"])
def test_inverse_of_the_flat_matrix(ends):
    """Lemma 3: the bounds of T⁻¹, on any knots."""
    rng = np.random.default_rng(1)
    for _ in range(200):
        h = np.exp(rng.uniform(-3, 3, rng.integers(3, 12)))
        inverse = np.linalg.inv(matrix(h, ends))
        y = rng.choice([-1, 1], len(h) + 1) * rng.uniform(0, 1, len(h) + 1)
        inner = 1 / (1 / h[:-1] + 1 / h[1:])
        bound = np.max(np.abs(y[1:-1]) * inner)
        x = inverse @ y
        if ends == "velocity":
            assert np.abs(x).max() <= max(bound, abs(y[0]), abs(y[-1])) * (1 + 1e-12)
        if ends == "acceleration":
            assert np.abs(x).max() <= max(bound, abs(y[0]) * h[0], abs(y[-1]) * h[-1]) * (1 + 1e-12)
        if ends == "not-a-knot":
            sides = [h[0] * abs(y[1]) + abs(y[0]), h[-1] * abs(y[-2]) + abs(y[-1])]
            assert np.abs(x[1:-1]).max() <= max(bound, *sides) * (1 + 1e-12)
    # A right-hand side at one end decays by a half per knot at least.
    decay = np.abs(np.linalg.inv(matrix(np.exp(rng.uniform(-3, 3, 12)), "acceleration"))[:, 0])
    assert np.all(decay[1:] <= decay[:-1] / 2)


def spline_of(motion, t, ends):
    p, v, w = motion.derivatives(t)
    bc_type = {
        "velocity": ((1, v[0]), (1, v[-1])),
        "acceleration": ((2, w[0]), (2, w[-1])),
        "not-a-knot": "not-a-knot",
        "natural": "natural",
    }[ends]
    spline = ss.CubicSpline(t, p, motion.space, bc_type=bc_type)
    return spline, size(motion, p, spline.velocities - v)


@pytest.mark.parametrize("ends", ["velocity", "acceleration", "not-a-knot"])
@pytest.mark.parametrize("name", SPACES)
def test_the_theorem(name, ends):
    """Velocities at the knots of order 3 on unequal knots, and the curve of order 4, 3 and 2."""
    motion, found = Motion(name), []
    for count in (48, 96):
        spline, off = spline_of(motion, knots(count), ends)
        found.append(np.r_[off.max(), motion.errors(spline, X)])
    assert np.all(np.abs(orders(found) - [3, 4, 3, 2]) < 0.45)


def test_the_theorem_with_periodic_ends():
    sphere, found = ss.Sphere(2), []

    def motion(t):
        c, s = np.cos(t), np.sin(t)
        q = np.stack([0.8 * c * (2 + s), 0.8 * s * (2 + s), 2 + np.cos(2 * t)], axis=-1)
        return q / np.linalg.norm(q, axis=-1, keepdims=True)

    for count in (96, 192):
        t = knots(count) * 2 * np.pi / END
        p = motion(t)
        p[-1] = p[0]
        x = np.linspace(0, 2 * np.pi, 601)
        found.append(sphere.distance(ss.CubicSpline(t, p, sphere, bc_type="periodic")(x), motion(x)).max())
    assert abs(orders(found) - 4) < 0.3


@pytest.mark.parametrize("name", SPACES)
def test_natural_ends(name):
    """The errors of velocities decay by a half per knot at least, down to the order 3 of the other ends."""
    motion, middle, whole = Motion(name), [], []
    for count in (48, 96):
        t = knots(count)
        spline, off = spline_of(motion, t, "natural")
        exact, other = spline_of(motion, t, "acceleration")
        _, _, w = motion.derivatives(t[[0, -1]])
        first, last = size(motion, exact.points[[0, -1]], w)
        i = np.arange(count + 1)
        bound = 0.55**i * first * (t[1] - t[0]) / 2 + 0.55 ** i[::-1] * last * (t[-1] - t[-2]) / 2
        assert np.all(off <= 1.05 * bound + other.max())
        whole.append(motion.errors(spline, X)[0])
        middle.append(motion.errors(spline, X[200:400])[0])
    assert abs(orders(whole) - 2) < 0.25 and abs(orders(middle) - 4) < 0.25


@pytest.mark.parametrize("name", SPACES)
def test_explicit_bound_from_the_contraction(name):
    """The error of handles is at most the change in one sweep from the exact ones, divided by 1 − α."""
    motion = Motion(name)
    t = np.linspace(0, END, 41)
    p, v, _ = motion.derivatives(t)
    space, h = motion.space, t[1]
    spline = ss.CubicSpline(t, p, space, bc_type=((1, v[0]), (1, v[-1])))
    alpha, radius = spline.report.contraction_bound, spline.report.invariant_radius
    exact, found = h * v / 3, h * spline.velocities / 3
    assert size(motion, p, exact).max() < radius
    w = space.log(p[1:-1], space.transvection(p[1:-1], -exact[1:-1], space.exp(p[2:], -exact[2:])))
    w -= space.log(p[1:-1], space.transvection(p[1:-1], exact[1:-1], space.exp(p[:-2], exact[:-2])))
    change = size(motion, p[1:-1], w / 4 - exact[1:-1] / 2).max()
    error = size(motion, p, found - exact).max()
    assert 0.3 * change < error <= change / (1 - alpha)
