"""Riemannian cubics through the points of splines."""

import warnings
from contextlib import nullcontext
from itertools import pairwise

import numpy as np
import pytest
from motions import knots, track, tumble
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import root

import symspline as ss

SPHERE = ss.Sphere(2)
SPACES = ["sphere:2", "hyperbolic:2", "so:3", "cp:2", "gr:2,5", "spd:3", "su:2"]
each_space = pytest.mark.parametrize("name", SPACES)
T = np.array([0.0, 0.7, 1.9, 2.6, 3.4])


def scattered(space, n=5, step=0.8):
    """Points at equal distances in random directions."""
    rng = np.random.default_rng(4)
    points = [space.random_point(rng)]
    while len(points) < n:
        v = space.random_tangent(rng, points[-1])
        points.append(space.exp(points[-1], step / max(space.curvature, 0.5) * v / space.norm(points[-1], v)))
    return np.array(points)


def smooth(space):
    """A function that returns points of a smooth curve."""
    rng = np.random.default_rng(5)
    base = space.random_point(rng)
    vectors = np.array([space.random_tangent(rng, base) for _ in range(3)])
    factors = np.array([1.0, 0.5, 0.4]) / space.norm(base, vectors) / max(space.curvature, 0.5)

    def motion(t):
        waves = np.stack([np.sin(t), np.cos(2 * t), np.sin(1.7 * t + 1)], axis=-1)
        return space.exp(base, np.tensordot(waves * factors, vectors, 1))

    return motion


def slope_and_rise(space, fine, points, seed, step=1e-3):
    """The derivative of the energy of a curve if it moves along a field that is zero at the times T, and the smaller
    rise for a step in either direction, relative to the energy."""
    field = [space.random_tangent(np.random.default_rng(seed), points[0])]
    for p, q in pairwise(points):
        field.append(space.transport(p, q, field[-1]))
    factor = np.prod(fine[:, None] - T, axis=1)
    field = np.array(field) * factor.reshape(-1, *(1 for _ in space.point_shape))
    still, there, back = (
        ss.CubicSpline(fine, space.exp(points, epsilon * field), space).bending_energy()
        for epsilon in (0.0, step, -step)
    )
    return abs(there - back) / (2 * step * still), min(there, back) / still - 1


@each_space
def test_energy_is_stationary_and_a_minimum(name):
    space = ss.space(name)
    spline = ss.CubicSpline(T, scattered(space), space)
    found = ss.riemannian_cubic(spline)
    assert found.converged and found.is_minimum and found.iterations <= 6
    assert found.energy < spline.bending_energy() * (1 - 1e-6)
    assert space.distance(found.curve(T), spline.points).max() < 1e-7
    fine = found.curve.t
    moved = [slope_and_rise(space, fine, found.curve.points, seed) for seed in range(3)]
    slopes = np.array([slope for slope, _ in moved])
    before = [slope_and_rise(space, fine, spline(fine), seed)[0] for seed in range(3)]
    assert min(rise for _, rise in moved) > 0 and slopes.max() < max(before) / 300


@each_space
def test_distance_to_the_spline_is_of_fourth_order(name):
    space = ss.space(name)
    motion, found = smooth(space), []
    for n in (17, 33):
        t = np.linspace(0, 3, n)
        spline = ss.CubicSpline(t, motion(t), space)
        cubic = ss.riemannian_cubic(spline)
        found.append((cubic.distance, spline.bending_energy() / cubic.energy - 1))
    assert np.log2(np.divide(*found)) == pytest.approx([4, 4], abs=0.2)


@pytest.mark.parametrize(
    ("space", "motion", "expected"),
    [
        # Found by the solvers of SciPy and interpolatepy.
        ("sphere:2", track, {3: 2.7591, 6: 27.3914, 12: 30.3639, 24: 31.1776, 48: 31.4946}),
        ("so:3", tumble, {3: 34.8204, 6: 229.909, 12: 287.290, 24: 304.512, 48: 311.919}),
    ],
)
def test_energies_that_other_solvers_found(space, motion, expected):
    for n, energy in expected.items():
        found = ss.riemannian_cubic(ss.CubicSpline(knots(n), motion(knots(n)), space))
        assert found.energy == pytest.approx(energy, rel=2e-6) and found.is_minimum


# ---- the same curves from initial values ----


def on_sphere(_, y):
    """∇³γ' = −R(∇γ', γ')γ' with R(a, v)v = |v|²a − ⟨a, v⟩v, in coordinates of space."""
    x, v, a, j = y.reshape(4, 3)
    return np.concatenate([v, a - v @ v * x, j - v @ a * x, v @ a * v - v @ v * a - v @ j * x])


def hat(w):
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def vee(m):
    return np.array([m[2, 1], m[0, 2], m[1, 0]])


def of_rotations(_, y):
    """ω''' = ω'' × ω for the angular velocity in the body (Noakes, Heinzinger and Paden 1989)."""
    g, (w, a, b) = y[:9].reshape(3, 3), y[9:].reshape(3, 3)
    return np.concatenate([(g @ hat(w)).ravel(), a, b, hat(b) @ w])


def initial_on_sphere(spline):
    """The point, and coordinates of γ', ∇γ' and ∇²γ', with their basis."""
    p, u, a = (spline(spline.t, nu=nu) for nu in range(3))
    basis = spline.space.frame(p)
    j = np.diff(a, axis=0) / np.diff(spline.t)[:, None]
    start = np.stack([np.einsum("nij,nj->ni", basis[:-1], x) for x in (u[:-1], a[:-1], j)], axis=1)
    lifted = lambda z: np.concatenate([p[:-1, None], np.einsum("nki,nij->nkj", z, basis[:-1])], axis=1)  # noqa: E731
    missed = lambda end, i: basis[i] @ end[0]  # noqa: E731
    return start, lifted, missed, lambda end, i: [basis[i] @ end[1], basis[i] @ end[2]]


def initial_of_rotations(spline):
    p = spline.points
    w, a = (np.array([vee(q.T @ x) for q, x in zip(p, spline(spline.t, nu=nu), strict=True)]) for nu in (1, 2))
    start = np.stack([w[:-1], a[:-1], np.diff(a, axis=0) / np.diff(spline.t)[:, None]], axis=1)
    lifted = lambda z: np.concatenate([p[:-1], z], axis=1)  # noqa: E731
    missed = lambda end, i: vee(p[i].T @ end[:3])  # noqa: E731
    return start, lifted, missed, lambda end, i: [end[3], end[4]]


@pytest.mark.parametrize(
    ("space", "rate", "initial", "acceleration"),
    [
        ("sphere:2", on_sphere, initial_on_sphere, slice(6, 9)),
        ("so:3", of_rotations, initial_of_rotations, slice(12, 15)),
    ],
)
def test_shooting_with_a_solver_of_initial_value_problems(space, rate, initial, acceleration):
    space = ss.space(space)
    t = T[:3]
    spline = ss.CubicSpline(t, scattered(space, 3), space)
    start, lifted, missed, joined = initial(spline)

    def solutions(z):
        return [
            solve_ivp(rate, (0, h), y.ravel(), method="DOP853", rtol=1e-12, atol=1e-12, dense_output=True)
            for h, y in zip(np.diff(t), lifted(z.reshape(start.shape)), strict=True)
        ]

    def equations(z):
        ends = [found.y[:, -1].reshape(-1, 3) for found in solutions(z)]
        begins = lifted(z.reshape(start.shape))
        jump = np.subtract(joined(ends[0], 1), joined(begins[1], 1)).ravel()
        last = joined(ends[1], 2)[1]
        return np.concatenate([missed(ends[0], 1), missed(ends[1], 2), jump, joined(begins[0], 0)[1], last])

    z = root(equations, start.ravel(), tol=1e-11).x
    assert np.abs(equations(z)).max() < 1e-10
    found = ss.riemannian_cubic(spline, refinement=16)
    x, weights = np.polynomial.legendre.leggauss(20)
    energy = 0.0
    for k, (h, one) in enumerate(zip(np.diff(t), solutions(z), strict=True)):
        energy += h / 2 * weights @ np.sum(one.sol(h * (x + 1) / 2)[acceleration] ** 2, axis=0)
        times = np.linspace(0, h, 17)
        points = one.sol(times)[: np.prod(space.point_shape)].T.reshape(-1, *space.point_shape)
        assert space.distance(found.curve(t[k] + times), points).max() < 1e-9
    assert found.energy == pytest.approx(energy, rel=1e-11)


# ---- flat spaces ----


@pytest.mark.parametrize("bc_type", ["natural", "clamped", ((1, [0.3, -1.0]), "natural"), "periodic"])
def test_on_flat_space_it_is_the_spline(bc_type):
    points = np.random.default_rng(2).normal(size=(5, 2))
    points[-1] = points[0]
    ours = ss.riemannian_cubic(ss.CubicSpline(T, points, "r:2", bc_type=bc_type))
    theirs = CubicSpline(T, points, bc_type=((1, [0.3, -1.0]), (2, [0.0, 0.0])) if bc_type[1] == "natural" else bc_type)
    x = np.linspace(0, 3.4, 50)
    for nu in range(3):
        np.testing.assert_allclose(ours.curve(x, nu=nu), theirs(x, nu), atol=1e-11)
    assert ours.distance < 1e-14 and ours.is_minimum
    # Squares of second derivatives are quadratic on each segment, and Simpson's rule is exact.
    first, middle, last = (theirs(z, 2) ** 2 for z in (T[:-1], (T[:-1] + T[1:]) / 2, T[1:]))
    assert ours.energy == pytest.approx(np.diff(T) / 6 @ (first + 4 * middle + last).sum(axis=1), rel=1e-12)


@pytest.mark.parametrize("name", ["sphere:1", "so:2", "u:1", "torus:1", "rp:1"])
def test_on_circles_it_is_the_spline(name):
    space = ss.space(name)
    rng = np.random.default_rng(0)
    points = [space.random_point(rng)]
    for angle in (0.5, 0.9, -0.4, 0.8):
        e = space.frame(points[-1])[0]
        points.append(space.exp(points[-1], angle * e))
    spline = ss.CubicSpline(T, np.array(points), space)
    found = ss.riemannian_cubic(spline)
    assert found.distance < 1e-7 and found.energy == pytest.approx(spline.bending_energy(), rel=1e-12)


# ---- ends, batches and products ----


def test_given_velocities_are_kept():
    space, v = ss.Sphere(2), np.array([0.3, -0.2])
    points = scattered(space)
    u = space.frame(points[0]).T @ v
    found = ss.riemannian_cubic(ss.CubicSpline(T, points, space, bc_type=((1, u), "clamped")))
    np.testing.assert_allclose(found.curve([0.0, 3.4], nu=1), [u, np.zeros(3)], atol=1e-12)
    free = ss.riemannian_cubic(ss.CubicSpline(T, points, space))
    assert free.energy < found.energy
    # The velocities of the minimiser among curves with free ends lead to the same minimiser.
    ends = free.curve(T[[0, -1]], nu=1)
    again = ss.riemannian_cubic(ss.CubicSpline(T, points, space, bc_type=((1, ends[0]), (1, ends[1]))))
    assert again.energy == pytest.approx(free.energy, rel=1e-6)


@pytest.mark.parametrize("name", ["sphere:2", "gr:2,5"])
def test_closed_curves_have_no_first_point(name):
    space, n = ss.space(name), 7
    base, angles = space.random_point(np.random.default_rng(0)), 2 * np.pi * np.arange(n) / n
    e, f = space.frame(base)[:2]
    points = np.array(
        [space.exp(base, 0.6 * np.cos(a) * e + (0.5 * np.sin(a) + 0.2 * np.cos(2 * a)) * f) for a in angles]
    )
    h = np.array([0.7, 1.2, 0.7, 0.8, 1.0, 0.9, 0.6])
    found = []
    for first in (0, 3):
        closed = np.roll(points, -first, axis=0)[[*range(n), 0]]
        if name == "gr:2,5":
            # Another basis of the same subspace.
            closed[-1] = closed[-1] @ [[0.6, -0.8], [0.8, 0.6]]
        t = np.concatenate([[0], np.cumsum(np.roll(h, -first))])
        spline = ss.CubicSpline(t, closed, space, bc_type="periodic")
        found.append(ss.riemannian_cubic(spline))
        assert found[-1].is_minimum and found[-1].energy < spline.bending_energy()
        # With a wrong entry of the matrix, convergence is linear.
        assert found[-1].iterations <= 4
    x = np.linspace(0, h.sum(), 20)
    assert found[0].energy == pytest.approx(found[1].energy, rel=1e-12)
    apart = space.distance(found[0].curve(h[:3].sum() + x), found[1].curve(x))
    assert apart.max() < 1e-7


def test_curve_that_turns_back_at_every_point():
    points = [[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [1.0, 0.0, 0.0]]
    found = ss.riemannian_cubic(ss.CubicSpline(None, points, "sphere:2", bc_type="periodic"))
    assert found.converged and found.distance < 1e-7


def test_batches_give_the_curves_one_at_a_time():
    rng = np.random.default_rng(1)
    points = ss.Sphere(2).project(np.cumsum(rng.normal(size=(2, 3, 6, 3)) * 0.3, axis=-2) + np.eye(3)[0])
    splines = ss.CubicSpline(np.cumsum(rng.uniform(0.5, 1.5, (2, 3, 6)), axis=-1), points, "sphere:2")
    found = ss.riemannian_cubic(splines)
    assert found.energy.shape == found.distance.shape == found.converged.shape == found.is_minimum.shape == (2, 3)
    one = ss.riemannian_cubic(splines[1][2])
    assert found.energy[1, 2] == pytest.approx(one.energy, rel=1e-11)
    assert found.distance[1, 2] == pytest.approx(one.distance, rel=1e-6)
    np.testing.assert_allclose(found.curve[1][2].points, one.curve.points, atol=1e-12)


def test_products_are_computed_by_factor():
    space = ss.space("sphere:2 x so:3 x r:3")
    points = (*map(scattered, space.factors[:2]), np.random.default_rng(0).normal(size=(5, 3)))
    found = ss.riemannian_cubic(ss.CubicSpline(T, points, space))
    parts = [
        ss.riemannian_cubic(ss.CubicSpline(T, of_factor, factor))
        for of_factor, factor in zip(points, space.factors, strict=True)
    ]
    assert found.energy == pytest.approx(sum(part.energy for part in parts), rel=1e-12)
    assert max(part.distance for part in parts) < found.distance < sum(part.distance for part in parts)
    for ours, part in zip(found.curve(1.2), parts, strict=True):
        np.testing.assert_allclose(ours, part.curve(1.2), atol=1e-6)


def test_dates():
    points, hours = scattered(ss.Sphere(2)), (T * 36000).astype("timedelta64[s]")
    found = ss.riemannian_cubic(ss.CubicSpline(np.datetime64("2024-01-01") + hours, points, "sphere:2"))
    same = ss.riemannian_cubic(ss.CubicSpline(T, points, "sphere:2"))
    assert found.energy * 36000.0**3 == pytest.approx(same.energy, rel=1e-9)
    assert found.curve.t[-1] == np.datetime64("2024-01-01") + hours[-1]


def test_quotients_have_the_curve_of_continuous_representatives():
    rotations = tumble(knots(12))
    space = ss.Quotient("so:3", ss.rotations.point_group("222"))
    turned = rotations.copy()
    turned[::2] = turned[::2] @ np.diag([1.0, -1.0, -1.0])
    ours, plain = (ss.riemannian_cubic(ss.CubicSpline(None, p, s)) for p, s in ((turned, space), (rotations, "so:3")))
    assert ours.energy == pytest.approx(plain.energy, rel=1e-9)


def test_the_curve_approaches_the_cubic_with_the_fourth_power_of_the_refinement():
    spline = ss.CubicSpline(T, scattered(ss.Sphere(2)), "sphere:2")
    excess = [
        found.curve.bending_energy() / found.energy - 1
        for found in (ss.riemannian_cubic(spline, refinement=n) for n in (8, 16))
    ]
    assert excess[1] > 0 and np.log2(excess[0] / excess[1]) == pytest.approx(4, abs=0.1)
    assert len(ss.riemannian_cubic(spline, refinement=3).curve.t) - 1 >= 3 * 4


# ---- failures ----


@pytest.mark.filterwarnings("ignore::symspline.FarPointsWarning")
@pytest.mark.parametrize(("angle", "expected"), [(1.3, True), (1.35, True), (1.4, False), (1.8, False)])
def test_a_saddle_is_reported(angle, expected):
    # A zigzag on a great circle is a Riemannian cubic at any angle. It is not a minimum if points are far apart.
    zigzag = [[1.0, 0.0, 0.0], [np.cos(angle), np.sin(angle), 0.0]] * 6
    spline = ss.CubicSpline(None, zigzag, "sphere:2", method="newton")
    with nullcontext() if expected else pytest.warns(ss.ConvergenceWarning, match="no local minimum"):
        found = ss.riemannian_cubic(spline)
    assert found.converged and found.distance < 1e-7 and found.is_minimum == expected
    # Loops on alternating sides of the great circle, smaller towards the ends.
    fine, space = found.curve.t, spline.space
    aside = 0.01 * np.sin(np.pi * fine) * np.sin(np.pi * (fine + 0.5) / 12)
    looped = ss.CubicSpline(fine, space.exp(spline(fine), aside[:, None] * [0.0, 0.0, 1.0]), space)
    assert (looped.bending_energy() > found.energy) == expected


def test_iterations_that_do_not_converge_are_reported():
    spline = ss.CubicSpline(T, scattered(ss.Sphere(2)), "sphere:2")
    with pytest.warns(ss.ConvergenceWarning, match="did not converge"):
        found = ss.riemannian_cubic(spline, max_iter=1)
    assert not found.converged and not found.is_minimum and found.iterations == 1


POINTS = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.6, 0.8]]


@pytest.mark.parametrize(
    ("make", "options", "message"),
    [
        (lambda: POINTS, {}, "spline must be a CubicSpline"),
        (lambda: ss.HermiteSpline.from_points(None, POINTS, "sphere:2"), {}, "spline must be a CubicSpline"),
        (
            lambda: ss.CubicSpline(None, POINTS, "sphere:2", bc_type="not-a-knot"),
            {},
            "first end of spline is 'not-a-knot'",
        ),
        (
            lambda: ss.CubicSpline(None, POINTS, "sphere:2", bc_type=("natural", (2, [1.0, 0.0, 0.0]))),
            {},
            "last end of spline is 'acceleration'",
        ),
        (lambda: ss.CubicSpline(None, POINTS, "sphere:2", velocities={1: [1, 0, 0]}), {}, "prescribed velocities"),
        (
            lambda: ss.CubicSpline(None, np.stack([np.eye(4)] * 3), "se:3"),
            {},
            r"SpecialEuclidean\(3\) has no invariant",
        ),
        (lambda: ss.CubicSpline(None, np.eye(60)[:3], "sphere:59"), {}, "dimension 59"),
        (lambda: ss.CubicSpline(None, POINTS, "sphere:2"), {"tol": 0}, "tol must be a positive number"),
        (lambda: ss.CubicSpline(None, POINTS, "sphere:2"), {"refinement": 0}, "refinement"),
        (lambda: ss.CubicSpline(None, POINTS, "sphere:2"), {"max_iter": 0}, "max_iter"),
        (
            lambda: ss.CubicSpline(None, [POINTS, [[np.nan] * 3] * 4], "sphere:2", on_failure="ignore"),
            {},
            "did not converge, or is NaN",
        ),
        (
            lambda: ss.CubicSpline(None, np.eye(4)[:3, :, None], ss.Stiefel(1, 4)),
            {},
            "is not symmetric",
        ),
    ],
)
def test_invalid_arguments_raise(make, options, message):
    with pytest.raises(ss.ValidationError, match=message):
        ss.riemannian_cubic(make(), **options)


def test_a_curve_of_larger_energy_than_the_spline_has_a_warning():
    """A long gap beside short steps: Newton's method ends in another local minimum."""
    worse = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        t = np.cumsum(rng.exponential(1, 20) + 0.05)
        t[10:] += 30
        points = [SPHERE.random_point(rng)]
        for _ in t[1:]:
            v = SPHERE.random_tangent(rng, points[-1])
            points.append(SPHERE.exp(points[-1], 0.3 * v / np.linalg.norm(v)))
        spline = ss.CubicSpline(t, points, SPHERE, on_failure="ignore")
        if not spline.report.converged:
            continue
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                found = ss.riemannian_cubic(spline)
        except ss.ConvergenceError as error:
            assert "Put points between" in str(error)
            continue
        if found.energy > spline.bending_energy() * (1 + 1e-6):
            worse += 1
            assert any(issubclass(one.category, ss.ConvergenceWarning) for one in caught)
    assert worse > 0


def test_an_empty_batch_is_an_error():
    empty = ss.CubicSpline(None, np.zeros((0, 5, 3)), SPHERE)
    with pytest.raises(ss.ValidationError, match="empty batch"):
        ss.riemannian_cubic(empty)
