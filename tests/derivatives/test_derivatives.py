"""Derivatives of curves with respect to their data: against finite differences, and both directions against
each other."""

import warnings

import numpy as np
import pytest
from cases import CASES, ENDS, LARGE, LOOPS, Case, grouped, loop, loop_over, unit_tangent, walk
from changes import by_differences, data, inside, motion, moved
from curves import S2
from refused import raises

import symspline as ss

ALL_ENDS = [*ENDS, "turned"]

# A few spaces with all ends, the other families with two of them, which take turns. Loops have no formula of a space of
# their own.
THOROUGH = ("sphere:2", "so:3", "gr:2,5")
TURNS = [sorted({("mixed", "periodic")[i % 2], end}) for i, end in enumerate(ALL_ENDS)]
EACH = {
    case.name: [(case, end) for end in (ALL_ENDS if case.name in THOROUGH else TURNS[i % len(TURNS)])]
    for i, case in enumerate(case for case in CASES if case.interface)
}
FURTHER = {case.name: [(case, "mixed")] for case in LARGE if case.name in ("so:8", "spd:8")}


def assert_differences(spline, data, change, x, orders=(0, 1, 2)):
    """`jvp` is the change by finite differences."""
    for nu, expected in enumerate(by_differences(*data, change, x, orders)):
        found = spline.jvp(x, *change, nu=nu)
        # Of the differences: the fourth power of the step, and residuals of 1e-14 divided by it.
        assert np.abs(found - expected).max() <= 1e-8 * max(1.0, np.abs(expected).max()), nu


def assert_transpose(spline, change, x, rng, orders=(0, 1, 2)):
    """`vjp` is the transpose of `jvp`."""
    vectors, knots, ends = change
    for nu in orders:
        cotangent = rng.normal(size=spline(x).shape)
        if spline.space.dtype.kind == "c":
            cotangent = cotangent + 1j * rng.normal(size=cotangent.shape)
        gradient = spline.vjp(x, cotangent, nu=nu)
        pairs = [(cotangent, spline.jvp(x, *change, nu=nu)), (gradient.points, vectors), (gradient.t, knots)]
        pairs += [(g, e) for g, e in zip(gradient.ends, ends, strict=True) if e is not None]
        left, *right = [np.vdot(a, b).real for a, b in pairs]
        scale = sum(np.linalg.norm(a) * np.linalg.norm(b) for a, b in pairs)
        # Rounding errors of interpolated motions grow with the fourth power of the degree in the second derivative.
        assert abs(left - sum(right)) <= (1e-11 if nu == 2 else 1e-12) * scale, nu
        spline.space.check_tangent(spline.points, gradient.points)


@pytest.mark.slow
@grouped("case, end", EACH | FURTHER)
def test_derivatives_match_finite_differences(case, end):
    rng = np.random.default_rng(5)
    given = data(case, end, n=4 if case in LARGE else 6)
    change = motion(*given, rng)
    assert_differences(moved(*given, change, 0.0), given, change, inside(given[1], rng))


@grouped("case, end", dict(list(EACH.items())[::3]))
def test_the_gradient_is_the_transpose(case, end):
    rng = np.random.default_rng(6)
    space, t, points, bc = data(case, end)
    change = motion(space, t, points, bc, rng)
    x = inside(t, rng)
    assert_transpose(ss.CubicSpline(t, points, space, bc_type=bc), change, x, rng)


@pytest.mark.slow
def test_flat_derivatives_match_scipy():
    """The curve is linear in points there: a column of a jvp is a cardinal spline."""
    scipy = pytest.importorskip("scipy.interpolate")
    t, x = np.array([0.0, 0.7, 2.0, 2.5, 4.0]), np.linspace(0, 4, 9)
    for bc in ("natural", "clamped", "not-a-knot"):
        spline = ss.CubicSpline(t, np.zeros((5, 1)), "r:1", bc_type=bc)
        for k in range(5):
            e = np.eye(5)[k]
            expected = scipy.CubicSpline(t, e, bc_type=bc)
            for nu in (0, 1, 2):
                found = spline.jvp(x, points=e[:, None], nu=nu)[:, 0]
                np.testing.assert_allclose(found, expected(x, nu), atol=1e-14)


@grouped("case, end", {name: pairs for name, pairs in EACH.items() if not pairs[0][0].few})
def test_derivatives_are_finite_at_coinciding_points(case, end):
    space, t, points, bc = data(case, end)
    points[3] = points[2]
    if end != "periodic":
        points[4] = points[2]
    spline = ss.CubicSpline(t, points, space, bc_type=bc)
    rng = np.random.default_rng(7)
    x = inside(t, rng)
    gradient = spline.vjp(x, np.ones(spline(x).shape))
    assert all(np.isfinite(g).all() for g in (gradient.points, gradient.t))
    # A curve that stands still.
    still = np.repeat(points[:1], len(t), axis=0)
    spline = ss.CubicSpline(t, still, space, bc_type="periodic" if end == "periodic" else "natural")
    for nu in (0, 1, 2):
        assert np.isfinite(spline.vjp(x, np.ones(spline(x).shape), nu=nu).points).all()


def one_of(bc, i):
    """The end conditions of a curve of a batch."""
    return bc if isinstance(bc, str) else tuple(end if isinstance(end, str) else (end[0], end[1][i]) for end in bc)


@pytest.mark.parametrize("nodes", [2, 3, 9])
@pytest.mark.parametrize("end", ["natural", "not-a-knot", "periodic", "vectors"])
@pytest.mark.parametrize("name", ["so:3", "rp:2", "spd:2", "gr:2,4", "aff:1"])
def test_derivatives_of_batches_are_those_of_single_curves(name, end, nodes):
    """Eleven curves fill some lanes and leave others; knots are shared or not."""
    space, rng = ss.space(name), np.random.default_rng(8)
    points = np.array([walk(space, 0.5, nodes, rng) for _ in range(11)])
    t = 3 + np.cumsum(rng.uniform(0.7, 1.3, (11, nodes) if nodes == 9 else nodes), axis=-1)
    t = (t - t[..., :1]) / (t[..., -1:] - t[..., :1])
    bc = end
    if end == "periodic":
        points[:, -1] = -points[:, 0] if name == "rp:2" else points[:, 0]
    if end == "vectors":
        vectors = 0.3 * np.array([[unit_tangent(space, p, rng) for p in row] for row in points[:, [0, -1]]])
        bc = ((1, vectors[:, 0]), (2, vectors[:, 1]))
    spline = ss.CubicSpline(t, points, space, bc_type=bc, check=False)
    x = rng.uniform(0, 1, (2, 3))
    steps = np.array([[unit_tangent(space, p, rng) for p in row] for row in points])
    if end == "periodic":
        steps[:, -1] = -steps[:, 0] if name == "rp:2" else steps[:, 0]
    later = 0.1 * rng.standard_normal(t.shape)
    for nu in (0, 1, 2):
        push = spline.jvp(x, steps, later, nu=nu)
        cotangent = rng.standard_normal(push.shape)
        gradient, by_t = spline.vjp(x, cotangent, nu=nu), []
        for i in range(11):
            own = t[i] if t.ndim == 2 else t
            one = ss.CubicSpline(own, points[i], space, bc_type=one_of(bc, i), check=False)
            size = np.abs(push[i]).max()
            shift = later[i] if t.ndim == 2 else later
            np.testing.assert_allclose(push[i], one.jvp(x, steps[i], shift, nu=nu), atol=1e-11 * size + 1e-12)
            expected = one.vjp(x, cotangent[i], nu=nu)
            size = np.abs(expected.points).max() + np.abs(expected.t).max()
            np.testing.assert_allclose(gradient.points[i], expected.points, atol=1e-10 * size + 1e-12)
            by_t.append(expected.t)
            if end == "vectors":
                for found, wanted in zip(gradient.ends, expected.ends, strict=True):
                    np.testing.assert_allclose(found[i], wanted, atol=1e-11 * size + 1e-12)
        wanted = np.array(by_t) if t.ndim == 2 else np.sum(by_t, axis=0)
        np.testing.assert_allclose(gradient.t, wanted, atol=1e-10 * np.abs(wanted).max() + 1e-12)


def test_shared_end_vector_sums_the_gradients():
    space = ss.Euclidean(2)
    points = np.random.default_rng(9).normal(size=(3, 4, 2))
    spline = ss.CubicSpline(None, points, space, bc_type=((1, [1.0, 0.0]), "natural"))
    gradient = spline.vjp(0.5, np.ones((3, 2)))
    one = ss.CubicSpline(None, points[0], space, bc_type=((1, [1.0, 0.0]), "natural")).vjp(0.5, np.ones(2))
    assert gradient.ends[0].shape == (2,)
    np.testing.assert_allclose(gradient.ends[0], 3 * one.ends[0], rtol=1e-14)


def test_products_and_dates():
    space = ss.Product("sphere:2", "r:1")
    rng = np.random.default_rng(10)
    points = walk(ss.Sphere(2), 0.5, 4, rng), rng.normal(size=(4, 1))
    t = np.datetime64("2024-01-01") + np.array([0, 10, 25, 30]).astype("m8[s]")
    spline = ss.CubicSpline(t, points, space)
    x = t[1] + np.timedelta64(3, "s")
    alone = ss.CubicSpline([0, 10, 25, 30], points, space)
    cotangent = (np.ones(3), np.ones(1))
    found, expected = spline.vjp(x, cotangent), alone.vjp(13, cotangent)
    np.testing.assert_allclose(found.t, expected.t, atol=1e-13)
    for a, b in zip(found.points, expected.points, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-13)
    moved = spline.jvp(x, points=expected.points, t=expected.t)
    right = sum(np.sum(g * g) for g in expected.points) + np.sum(expected.t**2)
    assert np.isclose(sum(np.sum(m) for m in moved), right, rtol=1e-12)


def test_invalid_arguments_of_derivatives_raise():
    spline = ss.CubicSpline(None, walk(ss.Sphere(2), 0.5, 4, np.random.default_rng(12)), "sphere:2")
    for change, match in [
        ({"x": 9.0}, r"x = 9.0 is outside the domain \[0.0, 3.0\] of the curve"),
        ({"nu": 3}, "nu must be 0, 1 or 2"),
        ({"points": np.zeros((3, 3))}, r"points has shape \(3, 3\), but \(4, 3\) is needed"),
        ({"t": [1.0]}, r"t has shape \(1,\), but \(4,\) is needed"),
        ({"ends": (np.zeros(3), None)}, "no vector was given at the start"),
        ({"ends": 3}, "ends must be a pair"),
    ]:
        raises(match, spline.jvp, **{"x": 0.5, **change})
    raises(r"cotangent has shape \(2, 3\), but \(3, 3\) is needed", spline.vjp, [0, 1, 2], np.ones((2, 3)))
    large = ss.CubicSpline(None, np.eye(300)[:3], "sphere:299")
    raises("not available, because the dimension of", large.vjp, 0.5, np.ones(300))


@loop_over("n", [2, 3, 4])
@loop_over("end", ["not-a-knot", "mixed", "turned", "natural", "acceleration"])
@pytest.mark.parametrize("name", ["r:1", "sphere:2", "so:3", "gr:2,5", "se:3", "spd:2"])
def test_derivatives_of_curves_of_few_points(name, end, n):
    rng = np.random.default_rng(14)
    given = data(Case(name), end, n=n)
    change = motion(*given, rng)
    assert_differences(moved(*given, change, 0.0), given, change, inside(given[1], rng), (0, 1))


@pytest.mark.parametrize("name", LOOPS)
def test_derivatives_of_a_loop(name, rng):
    space = ss.space(name)
    t, p = loop(space, 6, rng)
    change = motion(space, t, p, "periodic", rng)
    x = inside(t, rng)
    spline = ss.CubicSpline(t, p, space, bc_type="periodic")
    assert_differences(spline, (space, t, p, "periodic"), change, x, (0, 1))
    assert_transpose(spline, change, x, rng, (0, 1))


@loop_over("end", ["not-a-knot", "mixed", "natural", "periodic"])
@pytest.mark.parametrize("name", ["r:2", "hyperbolic:2", "so:3", "so:4", "se:3", "gr:2,5", "cp:2", "spd:2", "aff:2"])
def test_derivatives_of_curves_of_many_points(name, end):
    """The knots are divided into runs, whose lengths differ here; some segments have many samples, some none."""
    rng = np.random.default_rng(15)
    space, t, points, bc = data(Case(name), end, n=24, step=0.25)
    t = 5.0 + np.cumsum(rng.uniform(0.3, 2.0, len(t)))
    given = space, t, points, bc
    change = motion(*given, rng)
    x = np.concatenate([inside(t, rng, 5), rng.uniform(t[7] + 0.05, t[8] - 0.05, 11)])
    spline = moved(*given, change, 0.0)
    assert_differences(spline, given, change, x, (0,))
    assert_transpose(spline, change, x, rng)
    assert_transpose(spline, change, t[[0, 3, -1]], rng)


def test_accelerations_of_lines_move_with_the_data(rng):
    """Against their lengths, which do not depend on the signs of arrays: real lines are a sphere up to sign."""
    line, sphere = ss.RealProjective(2), ss.Sphere(2)
    t, points = np.cumsum(rng.uniform(0.3, 2.0, 20)), walk(sphere, 0.5, 20, rng)
    signs = rng.choice([-1.0, 1.0], 20)[:, None]
    vectors, x = sphere.random_tangent(rng, points), rng.uniform(t[0], t[-1], 30)
    expected = ss.CubicSpline(t, points, sphere)
    found = ss.CubicSpline(t, signs * points, line)
    sign = np.sign(np.sum(found(x) * expected(x), axis=1))[:, None]
    for nu in (0, 1, 2):
        changes = expected.jvp(x, vectors, nu=nu)
        np.testing.assert_allclose(sign * found.jvp(x, signs * vectors, nu=nu), changes, atol=1e-9)
        cotangent = sphere.random_tangent(rng, expected(x))
        gradient = expected.vjp(x, cotangent, nu=nu).points
        np.testing.assert_allclose(signs * found.vjp(x, sign * cotangent, nu=nu).points, gradient, atol=1e-8)


def test_no_times_have_no_derivatives():
    spline = ss.CubicSpline(None, walk(ss.Sphere(2), 0.5, 4, np.random.default_rng(12)), "sphere:2")
    for nu in (0, 1, 2):
        assert spline.jvp([], points=np.zeros((4, 3)), nu=nu).shape == (0, 3)
        assert not spline.vjp([], np.zeros((0, 3)), nu=nu).points.any()


@pytest.mark.parametrize("name", ["rp:2", "cp:2", "gr:2,5", "cgr:2,4"])
def test_derivatives_of_a_loop_that_ends_in_another_array(name, rng):
    space = ss.space(name)
    t, p = loop(space, 5, rng)
    vectors, knots, _ = motion(space, t, p, "periodic", rng)
    turn = ss.space("u:2" if name.startswith("cgr") else "o:2").random_point(rng)
    turn = {"rp:2": -1.0, "cp:2": np.exp(0.7j)}.get(name, turn)

    def other(x):
        return np.concatenate([x[:-1], [x[-1] @ turn if np.ndim(turn) else x[-1] * turn]])

    x = inside(t, rng)
    one, two = (ss.CubicSpline(t, points, space, bc_type="periodic") for points in (p, other(p)))
    for nu in (0, 1):
        here, there = one.jvp(x, vectors, knots, nu=nu), two.jvp(x, other(vectors), knots, nu=nu)
        assert np.abs(space.transport(two(x), one(x), there) - here).max() <= 1e-12 * np.abs(here).max()


@pytest.mark.parametrize("own_knots", [False, True])
def test_derivatives_of_an_empty_batch(own_knots):
    t = np.tile(np.arange(3.0), (2, 1)) if own_knots else None
    none = ss.CubicSpline(t, np.stack([np.eye(3), np.eye(3)[[1, 0, 2]]]), S2, bc_type=((1, np.zeros(3)), "natural"))[:0]
    assert none.jvp([0.5, 1.0], points=none.points).shape == (0, 2, 3)
    gradient = none.vjp([0.5, 1.0], np.zeros((0, 2, 3)))
    assert gradient.points.shape == (0, 3, 3)
    # What all curves share has the gradient of a sum over none.
    assert np.array_equal(gradient.t, np.zeros((0, 3) if own_knots else 3))
    assert np.array_equal(gradient.ends[0], np.zeros(3))


@pytest.mark.parametrize("name", ["so:3", "spd:2", "cp:2", "gl:2", "gr:2,4"])
def test_derivatives_do_not_depend_on_the_origin_of_time(name):
    """Seconds of today's clocks are of the order of 2³¹; these times are exact there."""
    space, rng, late = ss.space(name), np.random.default_rng(3), 2.0**31
    t = np.cumsum(rng.integers(2, 9, 6)) / 8
    x = rng.integers(64 * t[0], 64 * t[-1], 12) / 64
    points = walk(space, 0.4, 6, rng)
    steps = np.array([unit_tangent(space, p, rng) for p in points])
    early, moved = (ss.CubicSpline(t + origin, points, space) for origin in (0.0, late))
    for nu in (0, 1, 2):
        push = early.jvp(x, steps, 0.1 * t, nu=nu)
        np.testing.assert_array_equal(moved.jvp(x + late, steps, 0.1 * t, nu=nu), push)
        ones = np.ones(push.shape)
        np.testing.assert_array_equal(moved.vjp(x + late, ones, nu=nu).points, early.vjp(x, ones, nu=nu).points)


@pytest.mark.parametrize("name", ["gl:2", "aff:2"])
def test_derivatives_exist_wherever_the_curve_does(name):
    """Segments of far points do not continue far beyond their ends."""
    space, rng = ss.space(name), np.random.default_rng(7)
    points = np.array([walk(space, 0.8, 8, rng) for _ in range(60)])
    t = np.cumsum(np.exp(rng.uniform(-1.5, 1.5, 8)))
    spline = ss.CubicSpline(t, points, space, on_failure="ignore")
    x = np.linspace(t[0], t[-1], 43)
    steps = np.array([[unit_tangent(space, p, rng) for p in row] for row in points])
    for nu in (1, 2):
        values = np.isfinite(spline(x, nu)).all(axis=(1, 2, 3)) & spline.report.converged
        push = spline.jvp(x, steps, nu=nu)
        assert values.any() and np.isfinite(push[values]).all()
        assert np.isfinite(spline.vjp(x, np.ones(push.shape), nu=nu).points[values]).all()


def test_singular_derivatives_are_nan_with_a_warning():
    """Uneven times and long steps lead to a curve from which others branch."""
    space, rng = ss.space("hp:1"), np.random.default_rng(1397)
    rng.choice(7), rng.choice(7), rng.choice(4), rng.choice(4)
    curves = []
    for _ in range(8):
        points = [space.random_point(rng)]
        for _ in range(59):
            v = space.random_tangent(rng, points[-1])
            length = 0.5 * rng.choice([0, 1, 1, 1])
            points.append(space.exp(points[-1], length / max(space.norm(points[-1], v), 1e-9) * v))
        curves.append(points)
    t = np.cumsum(np.append(0.0, np.exp(rng.uniform(-1.5, 1.5, 59))))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*exact copies of the point before")
        spline = ss.CubicSpline(t, np.array(curves)[[7, 6]], space)
    x = 0.5 * (t[1:] + t[:-1])
    with pytest.warns(ss.ConvergenceWarning, match="of curve 0 are NaN: its linear system is singular") as seen:
        push = spline.jvp(x, np.ones(spline.points.shape))
    assert len(seen) == 1 and seen[0].filename == __file__
    assert np.isnan(push[0]).all() and np.isfinite(push[1]).all()
    with pytest.warns(ss.ConvergenceWarning, match="of curve 0 are NaN"):
        pull = spline.vjp(x, np.ones(push.shape)).points
    assert np.isnan(pull[0]).any() and np.isfinite(pull[1]).all()
