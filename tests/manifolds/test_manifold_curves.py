"""Curves on manifolds made of functions are C² splines."""

import numpy as np
import pytest
from cases import loop_over
from cases import walk as space_walk
from made import ELLIPSOID, flat, jump, knots, twin, walk
from pymanopt import manifolds
from scipy.interpolate import CubicSpline as FlatSpline

import symspline as ss

ST52 = ss.Stiefel(2, 5)
OBLIQUE = ss.manifolds.from_pymanopt(manifolds.Oblique(3, 3))
OBLIQUE_START = np.eye(3) + 0.1
OBLIQUE_START /= np.linalg.norm(OBLIQUE_START, axis=0)
# A space, its start, and how large jumps of acceleration may be, relative to the acceleration: second differences of
# logarithms to rounding have errors of 2e-12, of those integrated to 1e-13 some 1e-10, and of pymanopt's, made with an
# arc cosine, more.
SPACES = {
    "St(2, 5)": (ST52, None, 2e-10),
    "St(3, 4)": (ss.Stiefel(3, 4), None, 2e-10),
    "St(3, 6)": (ss.Stiefel(3, 6), None, 2e-10),
    "ellipsoid": (ELLIPSOID, None, 2e-9),
    "pymanopt": (OBLIQUE, OBLIQUE_START, 5e-8),
}
every = pytest.mark.parametrize("name", SPACES)


def ends_on(kind, space, p):
    velocities = 0.8 * space.log(p[0], p[1]), 0.3 * space.log(p[-1], p[-2])
    return {
        "velocity": ((1, velocities[0]), (1, velocities[1])),
        "acceleration": ((2, velocities[0]), (2, velocities[1])),
        "mixed": ("not-a-knot", (1, velocities[1])),
    }.get(kind, kind)


@every
@loop_over("spacing", ["equal", "unequal"])
def test_acceleration_is_continuous(name, spacing):
    space, start, allowed = SPACES[name]
    p = walk(space, 0.5, 7, 1, start)
    spline = ss.CubicSpline(knots(spacing, len(p), 2), p, space)
    assert np.abs(spline(spline.t) - p).max() <= 1e-13
    assert jump(spline, 1) <= allowed
    assert jump(spline) <= allowed
    # A quasi-Newton method with this matrix contracts by a tenth or better.
    assert spline.report.converged and spline.report.iterations <= 15


@pytest.mark.parametrize("ends", ["not-a-knot", "clamped", "periodic", "velocity", "acceleration", "mixed"])
@loop_over("n", [3, 4, 8])
@loop_over("step", [0.3, 1.2])
def test_all_ends_on_a_stiefel_manifold(ends, n, step):
    p = walk(ST52, step, n, 3)
    if ends == "periodic":
        p = np.concatenate([p[: n // 2 + 1], p[n // 2 - 1 :: -1]])
    t = knots("unequal", len(p), 4)
    bc = ends_on(ends, ST52, p)
    spline = ss.CubicSpline(t, p, ST52, bc_type=bc)
    assert jump(spline) <= 5e-10
    first, last = (spline(t[i], nu=2) for i in (0, -1))
    if ends == "acceleration":
        assert np.abs(first - bc[0][1]).max() <= 1e-9 and np.abs(last - bc[1][1]).max() <= 1e-9
    if ends in ("velocity", "clamped"):
        given = [end[1] for end in bc] if ends == "velocity" else (0.0, 0.0)
        assert np.abs(spline(t[0], nu=1) - given[0]).max() <= 1e-10
        assert np.abs(spline(t[-1], nu=1) - given[1]).max() <= 1e-10


@every
def test_a_smooth_curve_is_recovered_at_order_four(name):
    space, start, _ = SPACES[name]
    rng = np.random.default_rng(5)
    base = space.random_point(rng) if start is None else start
    axes = [space.random_tangent(rng, base) for _ in range(2)]
    axes = [0.5 * v / space.norm(base, v) for v in axes]

    def curve(t):
        v = sum(np.multiply.outer(w, a) for w, a in zip((t + 0.3 * np.sin(3 * t), np.cos(2 * t)), axes, strict=True))
        return space.exp(base, v)

    errors = []
    for n in (10, 20):
        s = np.linspace(0, 1, n + 1)
        t = s + 0.2 * s * (1 - s)
        spline = ss.CubicSpline(t, curve(t), space, bc_type="not-a-knot")
        x = (t[:-1, None] + np.diff(t)[:, None] * [0.3, 0.7]).ravel()
        errors.append(np.abs(spline(x) - curve(x)).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.7)


@pytest.mark.parametrize("name", ["sphere:2", "cp:2", "so:3"])
@loop_over("ends", ["natural", "clamped", "not-a-knot", "periodic", "velocity", "mixed"])
def test_symmetric_spaces_give_the_same_curve(name, ends):
    """The compiled core solves the S-form of the paper."""
    space = ss.space(name)
    rng = np.random.default_rng(6)
    p = space_walk(space, 0.4, 9, rng)
    if ends == "periodic":
        p = np.concatenate([p[:5], p[3::-1]])
    t = knots("unequal", len(p), 7)
    bc = ends_on(ends, space, p)
    ours = ss.CubicSpline(t, p, twin(space), bc_type=bc)
    core = ss.CubicSpline(t, p, space, bc_type=bc)
    # Differences in place of dlog, and two residuals below 1e-12.
    assert np.abs(ours.velocities - core.velocities).max() <= 1e-11
    x = np.linspace(t[0], t[-1], 60)
    assert space.distance(ours(x), core(x)).max() <= 2e-12
    for nu, allowed in ((1, 1e-10), (2, 1e-9)):
        moved = core(x, nu)
        if name == "cp:2":
            moved = space.transport(core(x), ours(x), moved)
        assert np.abs(ours(x, nu) - moved).max() <= allowed


@pytest.mark.parametrize("ends", ["natural", "clamped", "not-a-knot", "periodic", "velocity", "acceleration", "mixed"])
@loop_over("n", [2, 3, 4, 5, 9])
def test_flat_space_of_curves_on_manifolds_is_scipy(ends, n):
    space, rng = flat(3), np.random.default_rng(8)
    t, p = knots("unequal", n, 9), rng.standard_normal((n, 3))
    if ends == "periodic":
        p[-1] = p[0]
    bc = ends_on(ends, space, p)
    ours, theirs = ss.CubicSpline(t, p, space, bc_type=bc), FlatSpline(t, p, bc_type=bc)
    x = np.linspace(t[0] - 0.3, t[-1] + 0.3, 50)
    for nu, allowed in ((0, 1e-11), (1, 1e-10), (2, 1e-8)):
        assert np.abs(ours(x, nu, extrapolate=True) - theirs(x, nu, extrapolate=True)).max() <= allowed
    # Differences of a linear function are exact, and the matrix is that of the spline.
    assert ours.report.iterations <= 3


def test_points_near_each_other_and_equal():
    p = ST52.random_point(np.random.default_rng(13))
    for size in (0.0, 1e-9, 1e-5):
        near = ST52.exp(p, size * ST52.random_tangent(np.random.default_rng(14), np.repeat(p[None], 5, axis=0)))
        spline = ss.CubicSpline(None, near, ST52)
        assert spline.report.converged
        assert np.abs(spline([0.5, 2.5]) - p).max() <= 10 * size + 1e-14


@pytest.mark.parametrize("ends", ["not-a-knot", "clamped", "acceleration"])
def test_functions_may_return_arrays_that_cannot_be_written_to(ends):
    def frozen(function):
        def call(*arguments):
            found = np.array(function(*arguments))
            found.flags.writeable = False
            return found

        return call

    names = ("exp", "log", "project_tangent", "inner", "dlog")
    made = {name: getattr(ST52.functions, name) for name in names}
    space = ss.Manifold(point_shape=ST52.point_shape, **{k: f and frozen(f) for k, f in made.items()})
    p = walk(ST52, 0.3, 5, 1)
    bc = ends_on(ends, ST52, p)
    curves = [ss.CubicSpline(None, p, one, bc_type=bc) for one in (ST52, space)]
    assert np.abs(curves[0](1.3) - curves[1](1.3)).max() <= 1e-9


def pulled_back(p, q, w):
    """E_p(−v) in place of D log, on Stiefel manifolds: then the condition is (13) of the paper."""
    v = ST52.log(p, q)
    a = np.swapaxes(p, -1, -2) @ v
    half = v - p @ a / 2
    omega = half @ np.swapaxes(p, -1, -2) - p @ np.swapaxes(half, -1, -2)
    return ss.SpecialOrthogonal(5).exp(np.eye(5), -omega) @ w


def test_equation_13_is_not_enough():
    """The paper's outlook expects (13) to hold on reductive spaces. It has a solution, which is not C²."""
    p = walk(ST52, 0.8, 8, 11)
    space = ss.Manifold(**ST52.functions._asdict() | {"dlog": pulled_back}, point_shape=(5, 2))
    wrong = ss.CubicSpline(None, p, space)
    assert wrong.report.residual <= 1e-12
    assert jump(wrong) > 0.02
    assert jump(ss.CubicSpline(None, p, ST52)) < 1e-10
