"""The formulas of docs/theorem.md, seen through matrices of the Lie algebra and differences: points are long vectors,
on which the group acts by matrices."""

import itertools

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import root

import symspline as ss

REDUCTIVE = ["stiefel:2,4", "stiefel:2,5", "stiefel:3,4", "se:2", "aff:2", "so:3"]
NAMES = ["sphere:2", "so:3", "ds:3", "ads:2", "igr:0,1,1,2", "gl:2"]


class Group:
    """𝔪 at a point of a space, as matrices that act on the numbers of points."""

    def __init__(self, space, p):
        self.space, self.p = space, p
        self.basis = [self.element(e) for e in space.frame(p)]

    def element(self, v):
        """The ξ ∈ 𝔪 with ξ·p = v."""
        p, n = self.p, len(self.p)
        if p.ndim == 2:
            # x ↦ (½ v p⁻¹) x + x (½ p⁻¹ v)
            back = np.linalg.inv(p)
            return np.kron(v @ back, np.eye(n)) / 2 + np.kron(np.eye(n), (back @ v).T) / 2
        eta = np.ones(n)
        if str(self.space) != "sphere:2":
            eta[: 1 if isinstance(self.space, ss.DeSitter) else 2] = -1.0
        rank_two = np.outer(v, eta * p) - np.outer(p, eta * v)
        return rank_two * (eta * p * p).sum()

    def vector(self, xi):
        """ξ·p"""
        return (xi @ self.p.ravel()).reshape(self.p.shape)

    def move(self, g, x):
        return (g @ x.ravel()).reshape(x.shape)

    def log(self, q):
        """L(q)"""
        return self.element(self.space.log(self.p, q))

    def stretch(self, xi, eta):
        """S(ξ)η by its series."""
        total, term = eta, eta
        for j in range(1, 30):
            for _ in range(2):
                term = xi @ term - term @ xi
            term = term / (2 * j * (2 * j + 1))
            total = total + term
        return total

    def unstretch(self, xi, eta):
        """S(ξ)⁻¹η, by the matrix of S(ξ) in a basis of 𝔪."""
        columns = np.array([self.stretch(xi, e).ravel() for e in self.basis]).T
        x, *_ = np.linalg.lstsq(columns, eta.ravel())
        assert np.abs(columns @ x - eta.ravel()).max() < 1e-12 * max(1.0, np.abs(eta).max())
        return np.tensordot(x, self.basis, 1)


class Reductive(Group):
    """𝔪 at a point of a Stiefel manifold, or of a group of matrices with left translations: matrices that multiply
    points from the left."""

    def element(self, v):
        p = self.p
        if p.shape[0] == p.shape[1]:
            return v @ np.linalg.inv(p)
        half = v - p @ (p.T @ v) / 2
        return half @ p.T - p @ half.T

    def vector(self, xi):
        return xi @ self.p

    def move(self, g, x):
        return g @ x

    def project(self, x):
        """π: elements of 𝔥 do not move p."""
        return self.element(self.vector(x))

    def stretch(self, xi, eta):
        """D(ξ)η by the series of dexp."""
        total, term = eta, eta
        for j in range(1, 40):
            term = -(xi @ term - term @ xi) / (j + 1)
            total = total + term
        return self.project(total)


def difference(f, order=1, step=0.02):
    """A derivative of f at 0, by central differences of order eight."""
    if order == 1:
        weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
        return sum(w * (f(k * step) - f(-k * step)) for k, w in weights.items()) / step
    weights = {1: 8 / 5, 2: -1 / 5, 3: 8 / 315, 4: -1 / 560}
    return sum(w * (f(k * step) - 2 * f(0.0) + f(-k * step)) for k, w in weights.items()) / step**2


@pytest.fixture(params=NAMES)
def setting(request):
    """A point with its group, and control points around it."""
    space, rng = ss.space(request.param), np.random.default_rng(5)
    o = space.random_point(rng)
    return Group(space, o), [space.exp(o, 0.35 * space.random_tangent(rng, o)) for _ in range(6)]


@pytest.fixture(params=REDUCTIVE)
def reductive(request):
    """The same with left translations only."""
    space, rng = ss.space(request.param), np.random.default_rng(5)
    o = space.random_point(rng)
    points = [space.exp(o, 0.25 * space.random_tangent(rng, o)) for _ in range(6)]
    return Reductive(space, o), points


def casteljau(space, points, t):
    """(8), also outside of [0, 1]."""
    while len(points) > 1:
        points = [space.geodesic(x, y, t) for x, y in itertools.pairwise(points)]
    return points[0]


def close(found, expected, tol=1e-9):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tol * max(1.0, np.abs(expected).max()))


def test_the_setting(setting):
    group, (q, x, *_) = setting
    space, p = group.space, group.p
    v, w = space.log(p, q), space.log(p, x)
    xi, eta = group.element(v), group.element(w)
    close(group.vector(xi), v, 1e-13)
    close(group.move(expm(xi), p), q, 1e-12)
    close(group.move(expm(xi), x), space.transvection(p, v, x), 1e-12)
    # [𝔪, [𝔪, 𝔪]] lies in 𝔪, and S is even.
    s = group.stretch(xi, eta)
    close(group.element(group.vector(s)), s, 1e-12)
    close(group.stretch(-xi, eta), s, 1e-13)
    close(group.unstretch(xi, s), eta, 1e-12)
    # (a)
    close(difference(lambda t: group.move(expm(xi + t * eta), p)), group.move(expm(xi), group.vector(s)))
    # (d), with an element of G that moves p anywhere.
    g = expm(xi) @ expm(eta)
    y = space.exp(p, 0.3 * (v - w))
    moved = space.geodesic(group.move(g, p), y, 0.7)
    close(moved, group.move(g @ expm(0.7 * group.log(group.move(np.linalg.inv(g), y))), p), 1e-11)


def test_normal_coordinates_give_the_covariant_acceleration(setting):
    """(b): against the library's acceleration of a curve, from derivatives of its numbers."""
    group, (q, *rest) = setting
    space = group.space
    points = [group.p, q, *rest[:2]]
    # In the middle of a Bézier curve, whose two halves are not symmetric.
    curve = ss.BezierCurve(np.array(points), space)
    there = Group(space, curve(0.4))
    close(difference(lambda t: space.log(there.p, curve(0.4 + t))), curve(0.4, 1))
    close(difference(lambda t: space.log(there.p, curve(0.4 + t)), 2), curve(0.4, 2), 1e-8)


def test_the_proof_of_the_proposition(setting):
    group, (_, q1, *_) = setting
    _check_proof(*setting)
    v = group.space.log(group.p, group.space.exp(group.p, 0.5 * group.space.log(group.p, q1)))
    moved = group.move(expm(-group.element(v)), q1)
    close(group.space.transvection(group.p, -v, q1), moved, 1e-12)


def test_the_proof_on_reductive_spaces(reductive):
    """With D in place of S."""
    _check_proof(*reductive)


def _check_proof(group, points):
    q0, q1, p1, *_ = points
    space, p = group.space, group.p
    xi = group.log(q0)
    there, back = expm(xi), expm(-xi)
    omega = group.log(group.move(back, q1))
    v, w = group.vector(xi), group.vector(omega)
    close(3 * v, difference(lambda t: space.log(p, casteljau(space, [p, q0, q1, p1], t))))
    alpha = group.unstretch(xi, omega - xi)

    def level(t):
        a, b, c = (space.geodesic(x, y, t) for x, y in itertools.pairwise([p, q0, q1, p1]))
        return a, b, c, space.geodesic(a, b, t), space.geodesic(b, c, t)

    close(difference(lambda t: level(t)[1]), group.move(there, w))
    close(difference(lambda t: level(t)[4]), 2 * group.move(there, w))

    def eta(t):
        return group.log(group.move(expm(-t * xi), level(t)[1]))

    close(difference(eta), alpha)

    def g(t):
        return expm(t * xi) @ expm(t * eta(t))

    def zeta(t):
        return group.log(group.move(np.linalg.inv(g(t)), level(t)[4]))

    close(difference(g), 2 * xi)
    close(difference(zeta), 2 * alpha)
    for t in (-0.1, 0.2):
        close(group.move(g(t), p), level(t)[3], 1e-11)
        gamma = casteljau(space, [p, q0, q1, p1], t)
        close(group.move(g(t) @ expm(t * zeta(t)), p), gamma, 1e-11)

    def x(t):
        return group.log(casteljau(space, [p, q0, q1, p1], t))

    close(difference(x), 3 * xi)
    close(difference(x, 2), 6 * alpha, 1e-8)


def test_the_derivative_on_reductive_spaces(reductive):
    """(a*), that D has an odd part, that it is invariant and that the projection π[v, ·] is its first-order part."""
    group, (q, x, *_) = reductive
    space, p = group.space, group.p
    xi, eta = group.log(q), group.log(x)
    close(group.move(expm(xi), p), q, 1e-12)
    close(group.project(xi), xi, 1e-13)
    s = group.stretch(xi, eta)
    close(difference(lambda t: group.move(expm(xi + t * eta), p)), group.move(expm(xi), group.vector(s)))
    bracket = group.project(xi @ eta - eta @ xi)
    odd = group.stretch(xi, eta) - group.stretch(-xi, eta)
    assert np.abs(odd).max() > 1e-3
    close(difference(lambda t: group.stretch(t * xi, eta) - group.stretch(-t * xi, eta)), -bracket)
    close(difference(lambda t: group.unstretch(t * xi, eta) - group.unstretch(-t * xi, eta)), bracket)
    # Ad_g maps 𝔪 at p to 𝔪 at g·p.
    g = expm(xi) @ expm(eta)
    moved = Reductive(space, group.move(g, p))
    close(moved.project(g @ eta @ np.linalg.inv(g)), g @ eta @ np.linalg.inv(g), 1e-12)


def test_stiefel_manifolds_are_naturally_reductive():
    """⟨π[X, Y], Z⟩ + ⟨Y, π[X, Z]⟩ = 0 in the canonical metric, and the parallel fields along a geodesic."""
    space, rng = ss.Stiefel(2, 5), np.random.default_rng(3)
    p = space.random_point(rng)
    group = Reductive(space, p)
    u, v, w = (0.4 * space.random_tangent(rng, p) for _ in range(3))
    x, y, z = (group.element(a) for a in (u, v, w))
    close(-np.trace(x @ y) / 2, space.inner(p, u, v), 1e-13)
    left, right = (group.vector(group.project(x @ a - a @ x)) for a in (y, z))
    assert abs(space.inner(p, left, w)) > 1e-3
    close(space.inner(p, left, w), -space.inner(p, v, right), 1e-13)

    basis = np.array(group.basis)
    ad = np.array([group.project(x @ e - e @ x) for e in basis])
    ad = np.einsum("aij,bij->ba", ad, basis) / 2

    def field(t):
        turned = expm(-t / 2 * ad) @ (np.einsum("ij,bij->b", y, basis) / 2)
        return expm(t * x) @ group.vector(np.tensordot(turned, basis, 1))

    # Christoffel's form of the canonical metric (Edelman, Arias & Smith 1998, equation 2.41) on two arguments.
    t = 0.3
    q, velocity, value = expm(t * x) @ p, expm(t * x) @ u, field(t)
    normal = np.eye(5) - q @ q.T
    form = (velocity @ value.T + value @ velocity.T) @ q + q @ (
        velocity.T @ normal @ value + value.T @ normal @ velocity
    )
    rate = difference(lambda s: field(t + s))
    assert np.abs(rate).max() > 1e-2
    close(rate + form / 2, np.zeros((5, 2)))


def test_left_translations_turn_the_formulas_of_both(reductive):
    """D(ξ) = e^{−ad/2} S(v), ω_S = e^{ad/2} ω, and that both give the same acceleration."""
    group, (q0, q1, *_) = reductive
    space, p = group.space, group.p
    if p.shape[0] != p.shape[1]:
        return
    xi = group.log(q0)
    half, v = expm(xi / 2), group.vector(xi)
    omega = group.log(group.move(expm(-xi), q1))
    both = group.element(space.log(p, space.transvection(p, -v, q1)))
    close(both, half @ omega @ np.linalg.inv(half), 1e-12)
    even = Group.stretch(group, xi / 2, omega - xi)
    close(group.stretch(xi, omega - xi), np.linalg.inv(half) @ even @ half, 1e-12)
    alpha = group.unstretch(xi, omega - xi)
    close(Group.stretch(group, xi / 2, alpha), both - xi, 1e-12)


def test_condition_13_on_equal_knots(setting):
    """Of control points with (12), those with (13) are the C² ones; a change of (13) is a jump of 6 S⁻¹ times it."""
    group, (q, inner, _, far, _, outer) = setting
    space, p = group.space, group.p
    v = space.log(p, q)
    plus, minus = q, space.exp(p, -v)
    left = space.log(p, space.transvection(p, v, inner)) + v
    # The control point behind is what (13) makes of the one before.
    right = space.transvection(p, v, space.exp(p, left + v))
    for push in (0.0, 0.2):
        behind = space.transvection(p, v, space.exp(p, left + v + push * v + push * space.log(p, outer)))
        if push == 0.0:
            close(behind, right, 1e-12)
        after = difference(lambda t, b=behind: space.log(p, casteljau(space, [p, plus, b, outer], t)), 2)
        before = difference(lambda t: space.log(p, casteljau(space, [p, minus, inner, far], t)), 2)
        change = group.element(push * v + push * space.log(p, outer))
        jump = group.vector(6 * group.unstretch(group.element(v), change))
        close(after - before, jump, 1e-7)


def test_the_condition_on_any_knots(setting):
    """(e), and that the library's splines satisfy it."""
    group, points = setting
    space = group.space
    t = np.array([0.0, 0.4, 1.5, 1.9, 3.0, 4.1])
    centre = points[0]
    near = np.array([space.exp(centre, 0.4 * space.log(centre, q)) for q in points])
    spline = ss.CubicSpline(t, near, space, tol=1e-14)
    controls = spline.control_points
    for i in range(1, 5):
        here = Group(space, near[i])
        sides = []
        for h, handle, other, end in ((t[i + 1] - t[i], *controls[i, 1:]), (t[i] - t[i - 1], *controls[i - 1, 2::-1])):
            v = space.log(near[i], handle)
            w = space.log(near[i], space.transvection(near[i], -v, other))
            side = here.vector(here.unstretch(here.element(v), here.element(w - v))) / h**2
            found = difference(
                lambda s, h=h, a=handle, b=other, c=end, i=i: space.log(
                    near[i], casteljau(space, [near[i], a, b, c], s / h)
                ),
                2,
            )
            close(found, 6 * side, 1e-6)
            sides.append(side)
        close(sides[0], sides[1], 1e-10)


def test_the_condition_on_reductive_spaces(reductive):
    """(e*): the accelerations of both sides, and that the library's splines satisfy it."""
    group, points = reductive
    space = group.space
    t = np.array([0.0, 0.4, 1.5, 1.9, 3.0, 4.1])
    centre = points[0]
    near = np.array([space.exp(centre, 0.5 * space.log(centre, q)) for q in points])
    spline = ss.CubicSpline(t, near, space)
    third = spline.velocities / 3
    for i in range(1, 5):
        here, sides = Reductive(space, near[i]), []
        for h, j in ((t[i + 1] - t[i], i + 1), (t[i - 1] - t[i], i - 1)):
            v = h * third[i]
            handle, other = space.exp(near[i], v), space.exp(near[j], -h * third[j])
            omega = here.log(here.move(expm(-here.element(v)), other))
            side = here.vector(here.unstretch(here.element(v), omega - here.element(v))) / h**2
            controls = [near[i], handle, other, near[j]]
            found = difference(lambda s, h=h, c=controls, i=i: space.log(near[i], casteljau(space, c, s / h)), 2)
            close(found, 6 * side, 1e-6)
            sides.append(side)
        close(sides[0], sides[1], 1e-10)


def test_two_splines_through_points_far_apart():
    """Both solve (12) and (13) with natural ends, and have the energies of the page."""
    space, i = ss.Sphere(2), np.arange(20)
    lon, lat = 2.0 * (i % 2), 0.1 * (i - 10)
    p = ss.geo.from_lonlat(np.degrees(lon), np.degrees(lat))
    east = np.stack([-np.sin(lon), np.cos(lon), 0 * lon], axis=-1)
    axes = np.stack([east, np.cross(p, east)], axis=1)

    def residual(x):
        v = np.einsum("ik,ikj->ij", x.reshape(20, 2), axes) / 3
        plus, minus = space.exp(p, v), space.exp(p, -v)
        w_plus = space.log(p[:-1], space.transvection(p[:-1], -v[:-1], minus[1:])) - v[:-1]
        w_minus = space.log(p[1:], space.transvection(p[1:], v[1:], plus[:-1])) + v[1:]
        r = np.concatenate([w_plus, np.zeros((1, 3))]) - np.concatenate([np.zeros((1, 3)), w_minus])
        return np.einsum("ij,ikj->ik", r, axes).ravel()

    back = ss.CubicSpline(None, p, space, method="newton")
    assert np.abs(residual(np.einsum("ij,ikj->ik", back.velocities, axes).ravel())).max() < 1e-12
    assert back.bending_energy() == pytest.approx(593.20, abs=0.005)
    start = np.stack([np.pi * np.cos(lat), 0.1 + 0 * lat], axis=-1)
    found = root(residual, start.ravel(), tol=1e-12).x
    assert np.abs(residual(found)).max() < 1e-12
    round_ = ss.HermiteSpline(None, p, np.einsum("ik,ikj->ij", found.reshape(20, 2), axes), space)
    for curve, turns in ((back, 0), (round_, 4)):
        x, y, _ = curve(np.linspace(6, 15, 4001)).T
        assert np.ptp(np.unwrap(np.arctan2(y, x))) == pytest.approx(2.0 + 2 * np.pi * turns, abs=0.5)
    assert round_.bending_energy() == pytest.approx(336.67, abs=0.005)
    knots = np.arange(1, 19.0)
    jump = round_(knots - 1e-9, 2) - round_(knots + 1e-9, 2)
    assert np.abs(jump).max() < 1e-6 and back.bending_energy() > 1.5 * round_.bending_energy()
