"""The formulas of docs/theory that no other test checks, against other closed forms, differences and dense matrices."""

import numpy as np
import pytest
from scipy.linalg import expm, logm, sqrtm

import symspline as ss


def points_near(space, count, step=0.4, seed=3):
    """Points of a random walk."""
    rng = np.random.default_rng(seed)
    points = [space.random_point(rng)]
    for _ in range(count - 1):
        v = space.random_tangent(rng, points[-1])
        points.append(space.exp(points[-1], step * v / space.norm(points[-1], v)))
    return np.stack(points)


def close(found, expected, tol=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=tol * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("name", ["r:3", "sphere:2", "h:3", "so:3", "spd:3"])
def test_handles_and_end_velocities(name):
    """(f), (g) and (h) of de_casteljau.md."""
    space = ss.space(name)
    p0, q0, q1, p1 = points_near(space, 4)
    curve = ss.BezierCurve(np.stack([p0, q0, q1, p1]), space)
    v0, v1 = space.log(p0, q0), -space.log(p1, q1)
    for t in (0.25, 0.7):
        a, b, c = space.exp(p0, t * v0), space.geodesic(q0, q1, t), space.exp(p1, -(1 - t) * v1)
        close(space.geodesic(space.geodesic(a, b, t), space.geodesic(b, c, t), t), curve(t))
    close(curve(0.0, 1), 3 * v0, 1e-11)
    close(curve(1.0, 1), 3 * v1, 1e-11)
    h = 1.7
    spline = ss.HermiteSpline([2, 2 + h], np.stack([p0, p1]), np.stack([v0, v1]) * 3 / h, space)
    close(spline.control_points[0], np.stack([p0, q0, q1, p1]), 1e-11)


def test_examples_of_symmetric_spaces():
    """The table of symmetric_spaces.md, and the formulas in the docstrings of these spaces."""
    for name in ("sphere:3", "h:3", "so:4", "spd:3", "gr:2,5"):
        space = ss.space(name)
        p, q, x = points_near(space, 3, 0.7)
        v = space.log(p, q)
        if name == "sphere:3":
            size = np.linalg.norm(v)
            angle = np.arccos(p @ q)
            out = np.cos(size) * p + np.sin(size) / size * v
            back = angle / np.sin(angle) * (q - np.cos(angle) * p)
            c, s = np.cos(size), np.sin(size) / size
            moved = x + (p @ x) * ((c - 1) * p + s * v) + (v @ x) * ((c - 1) / size**2 * v - s * p)
        elif name == "h:3":
            size = space.norm(p, v)
            length = np.arccosh(p[0] * q[0] - p[1:] @ q[1:])
            out = np.cosh(size) * p + np.sinh(size) / size * v
            back = length / np.sinh(length) * (q - np.cosh(length) * p)
            moved = space.symmetry(space.exp(p, v / 2), space.symmetry(p, x))
        elif name == "so:4":
            omega = p.T @ v
            out, back = p @ expm(omega), p @ logm(p.T @ q).real
            moved = p @ expm(omega / 2) @ p.T @ x @ expm(omega / 2)
        elif name == "spd:3":
            root = sqrtm(p).real
            inner = np.linalg.inv(root)
            out, back = root @ expm(inner @ v @ inner) @ root, root @ logm(inner @ q @ inner).real @ root
            g = expm(v @ np.linalg.inv(p) / 2)
            moved = g @ x @ g.T
        else:
            u, theta, vt = np.linalg.svd(v, full_matrices=False)
            out = p @ vt.T @ np.diag(np.cos(theta)) @ vt + u @ np.diag(np.sin(theta)) @ vt
            u, tangent, vt = np.linalg.svd((q - p @ p.T @ q) @ np.linalg.inv(p.T @ q), full_matrices=False)
            back = u @ np.diag(np.arctan(tangent)) @ vt
            moved = expm(v @ p.T - p @ v.T) @ x
        assert space.distance(space.exp(p, v), out) < 1e-7 > space.distance(space.transvection(p, v, x), moved)
        close(space.log(p, q), back)
        if name != "gr:2,5":
            close(space.exp(p, v), out)
            close(space.transvection(p, v, x), moved)
        # (i): two symmetries.
        middle = space.exp(p, v / 2)
        twice = space.symmetry(middle, space.symmetry(p, x))
        assert space.distance(twice, space.transvection(p, v, x)) < 1e-7


def sides(space, t, p, u, i):
    """w₊, v₊, w₋ and v₋ of (e) at an inner knot."""
    before, after = t[i] - t[i - 1], t[i + 1] - t[i]
    plus, minus = after * u[i] / 3, before * u[i] / 3
    ahead = space.exp(p[i + 1], -after * u[i + 1] / 3)
    behind = space.exp(p[i - 1], before * u[i - 1] / 3)
    return (
        space.log(p[i], space.transvection(p[i], -plus, ahead)),
        plus,
        space.log(p[i], space.transvection(p[i], minus, behind)),
        minus,
    )


def stretch_on_sphere(v, x):
    """S(v)x on the unit sphere: sin θ/θ on vectors perpendicular to v."""
    theta = np.linalg.norm(v)
    along = v * (v @ x) / theta**2
    return along + np.sin(theta) / theta * (x - along)


def residual(t, p, u, i):
    """(j) on the sphere."""
    w_plus, plus, w_minus, minus = sides(ss.Sphere(p.shape[1] - 1), t, p, u, i)
    return (
        stretch_on_sphere(minus, w_plus - plus) / (t[i + 1] - t[i]) ** 2
        - stretch_on_sphere(plus, w_minus + minus) / (t[i] - t[i - 1]) ** 2
    )


T = np.array([0.0, 0.7, 1.0, 2.4, 3.1])


def test_condition_on_any_knots():
    """(j) vanishes at the spline, and (c) with S by its eigenvalues is the acceleration."""
    sphere = ss.Sphere(2)
    p = points_near(sphere, 5)
    spline = ss.CubicSpline(T, p, sphere, bc_type="not-a-knot")
    u = spline.velocities
    for i in (1, 2, 3):
        assert np.abs(residual(T, p, u, i)).max() < 1e-11
        w, plus, _, _ = sides(sphere, T, p, u, i)
        # S(v) ∇γ' = (6/h²) (w − v)
        close(stretch_on_sphere(plus, spline(T[i], 2)), 6 / (T[i + 1] - T[i]) ** 2 * (w - plus), 1e-10)
    moved = u + 0.01 * sphere.project_tangent(p, np.ones(3))
    assert np.abs(residual(T, p, moved, 2)).max() > 1e-3


def test_sweeps_on_any_knots():
    """(k): each iterate of the library's fixed-point method follows from the one before."""
    sphere = ss.Sphere(2)
    p = points_near(sphere, 5)
    first, second = (
        ss.CubicSpline(T, p, sphere, method="fixed-point", max_iter=n, on_failure="ignore").velocities for n in (6, 7)
    )
    for i in (1, 2, 3):
        # The ends of a sweep are those of the present inner velocities.
        u = first.copy()
        h = np.diff(T)
        u[0] = sphere.log(p[0], sphere.exp(p[1], -h[0] * u[1] / 3)) / 2 * 3 / h[0]
        u[-1] = -sphere.log(p[-1], sphere.exp(p[-2], h[-1] * u[-2] / 3)) / 2 * 3 / h[-1]
        expected = u[i] + 3 * residual(T, p, u, i) / (2 / h[i - 1] + 2 / h[i])
        close(second[i], expected, 1e-12)


@pytest.mark.parametrize("ends", ["natural", "velocities", "not-a-knot"])
def test_the_flat_matrix_solves_in_one_step(ends):
    """(m) with the end rows of newton.md, from zero velocities."""
    h, p = np.diff(T), np.array([0.3, -1.0, 0.5, 2.0, 1.0])
    steps, n = np.diff(p), len(T)
    matrix, r = np.zeros((n, n)), np.zeros(n)
    for i in range(1, n - 1):
        matrix[i, i - 1 : i + 2] = 1 / h[i - 1], 2 / h[i - 1] + 2 / h[i], 1 / h[i]
        # (j) in flat space.
        r[i] = steps[i] / h[i] ** 2 + steps[i - 1] / h[i - 1] ** 2
    for end, near, far, node, beside in ((0, 0, 1, 0, 1), (1, -1, -2, -1, -2)):
        if ends == "natural":
            matrix[node, [node, beside]] = 2 / h[near], 1 / h[near]
            r[node] = steps[near] / h[near] ** 2
        elif ends == "velocities":
            matrix[node, node] = 1
            r[node] = (0.4, -0.2)[end] / 3
        else:
            h0, h1 = h[near], h[far]
            matrix[node, [node, beside]] = 1, 1 + h0 / h1
            # (o) without its term of u₁.
            chord = (2 / h0 + 1 / (h0 + h1)) * steps[near] + h0**2 / h1**2 / (h0 + h1) * steps[far]
            r[node] = chord / 3
    bc_type = ((1, [0.4]), (1, [-0.2])) if ends == "velocities" else ends
    spline = ss.CubicSpline(T, p[:, None], "r:1", bc_type=bc_type)
    close(np.linalg.solve(matrix, 3 * r), spline.velocities[:, 0], 1e-12)


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "spd:2", "gr:2,4"])
def test_not_a_knot_velocity(name):
    """(o) at both ends, with the derivative of the exponential by differences of order four."""
    space = ss.space(name)
    p = points_near(space, 5, 0.3)
    if name == "gr:2,4":
        # Bases along the curve, so that arrays of velocities can be compared.
        for i in range(1, 5):
            p[i] = space.exp(p[i - 1], space.log(p[i - 1], p[i]))
    spline = ss.CubicSpline(T, p, space, bc_type="not-a-knot")
    for t, points, u in ((T, p, spline.velocities), (-T[::-1], p[::-1], -spline.velocities[::-1])):
        h0, h1 = np.diff(t)[:2]
        x0, x2 = space.log(points[1], points[0]), space.log(points[1], points[2])
        c = -(1 + h0 / h1) * u[1] - (2 / h0 + 1 / (h0 + h1)) * x0 + h0**2 / (h1**2 * (h0 + h1)) * x2
        step = 1e-3
        moved = [space.exp(points[1], x0 + k * step * c) for k in (-2, -1, 1, 2)]
        if name == "gr:2,4":
            moved = [x @ x.T @ points[0] for x in moved]
        slope = (moved[0] - 8 * moved[1] + 8 * moved[2] - moved[3]) / (12 * step)
        close(space.project_tangent(points[0], slope), u[0], 1e-7)


def test_given_acceleration():
    """(n)"""
    sphere = ss.Sphere(2)
    p = points_near(sphere, 5)
    a = sphere.project_tangent(p[0], np.array([0.3, -0.5, 0.2]))
    spline = ss.CubicSpline(T, p, sphere, bc_type=((2, a), "natural"))
    h, u = T[1] - T[0], spline.velocities
    v = h * u[0] / 3
    w = sphere.log(p[0], sphere.transvection(p[0], -v, sphere.exp(p[1], -h * u[1] / 3)))
    close(w - v, h**2 / 6 * stretch_on_sphere(v, a), 1e-12)


def test_the_smoother_of_flat_space():
    """(q), (r) and (s) by dense matrices, for irregular times and weights."""
    rng = np.random.default_rng(2)
    n, lam = 40, 0.03
    t = np.sort(rng.uniform(0, 10, n))
    w = rng.uniform(0.5, 2, n)
    y = np.stack([np.sin(t), np.cos(2 * t)], 1) + 0.1 * rng.standard_normal((n, 2))
    h = np.diff(t)
    q, r = np.zeros((n, n - 2)), np.zeros((n - 2, n - 2))
    for k in range(n - 2):
        q[k : k + 3, k] = 1 / h[k], -1 / h[k] - 1 / h[k + 1], 1 / h[k + 1]
        r[k, k] = (h[k] + h[k + 1]) / 3
        if k:
            r[k, k - 1] = r[k - 1, k] = h[k] / 6
    inverse = np.linalg.inv(np.diag(w) + lam * q @ np.linalg.solve(r, q.T))
    x = inverse @ (w[:, None] * y)
    df = np.trace(inverse * w)
    rss = (w[:, None] * (y - x) ** 2).sum()
    sigma2 = rss / (2 * (n - df))
    s = ss.make_smoothing_spline(t, y, "r:2", lam=lam, weights=w)
    close(s(t), x, 1e-9)
    assert s.df == pytest.approx(df, rel=1e-9) and s.sigma == pytest.approx(np.sqrt(sigma2), rel=1e-9)
    close(s.std(t), np.sqrt(sigma2 * np.diag(inverse)), 1e-9)

    # (r): the λ that the library chooses is a minimum.
    def gcv(lam):
        smooth = np.linalg.inv(np.diag(w) + lam * q @ np.linalg.solve(r, q.T)) * w
        left = (w[:, None] * (y - smooth @ y) ** 2).sum()
        return n * left / (n - 1.2 * np.trace(smooth)) ** 2

    best = ss.make_smoothing_spline(t, y, "r:2", weights=w).lam
    assert gcv(best) < min(gcv(best * 1.3), gcv(best / 1.3))


@pytest.mark.parametrize("name", ["sphere:2", "h:2", "so:3"])
def test_geodesics_near_the_origin_of_normal_coordinates(name):
    """The estimate of accuracy.md: the distance from a straight line is about K² |y − x| times the area."""
    space = ss.space(name)
    p, a, b = points_near(space, 3, 0.1)
    x, y = space.log(p, a), space.log(p, b)
    inner = [[space.inner(p, u, v) for v in (x, y)] for u in (x, y)]
    area = np.sqrt(np.linalg.det(inner))
    middle = space.log(p, space.geodesic(a, b, 0.5))
    off = space.norm(p, middle - (x + y) / 2)
    assert 0.05 < off / (space.norm(p, y - x) * area * space.curvature**2) < 0.5


@pytest.mark.parametrize("name", ["sphere:2", "h:2", "so:3", "spd:2", "gr:2,4"])
def test_orders_of_accuracy(name):
    """Fourth order with not-a-knot ends, in the middle also with natural ones, second order at natural ends."""
    space, rng = ss.space(name), np.random.default_rng(8)
    o = space.random_point(rng)
    a, b, c = (space.random_tangent(rng, o) for _ in range(3))

    def motion(t):
        s = np.asarray(t).reshape(-1, *[1] * o.ndim)
        return space.exp(o, 0.3 * (np.sin(s) * a + np.cos(1.3 * s) * b + np.sin(1.7 * s + 1) * c))

    x = np.linspace(0, 4, 801)
    inside = (x > 1.2) & (x < 2.8)
    errors = {"natural": [], "not-a-knot": [], "middle": []}
    for count in (41, 81):
        t = np.linspace(0, 4, count)
        for ends in ("natural", "not-a-knot"):
            off = space.distance(ss.CubicSpline(t, motion(t), space, bc_type=ends)(x), motion(x))
            errors[ends].append(off.max())
        off = space.distance(ss.CubicSpline(t, motion(t), space)(x), motion(x))
        errors["middle"].append(off[inside].max())
    order = {name: np.log2(first / second) for name, (first, second) in errors.items()}
    assert abs(order["natural"] - 2) < 0.2 and abs(order["not-a-knot"] - 4) < 0.4 and abs(order["middle"] - 4) < 0.4
