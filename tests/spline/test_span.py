"""Curves of high ambient dimension, which are made in the span of their points."""

import pickle
import sys
from functools import partial

import numpy as np
import pytest
from cases import QUOTIENTS, apart, closed_walk, unit_tangent, walk
from curves import run_python

import symspline as ss
from symspline.curves import in_span as _span

# Large enough that the span of the data is smaller, and that computing without it is no trouble.
NAMES = ["sphere:59", "hyperbolic:60", "rp:59", "cp:39", "gr:3,50", "cgr:2,40"]
every_space = pytest.mark.parametrize("space", [ss.space(name) for name in NAMES], ids=str)
N = 7


@pytest.fixture
def rng():
    return np.random.default_rng(1_000_000)


@pytest.fixture
def two_ways(monkeypatch):
    """Calls a function twice: with the span of the points, and without."""

    def both(function):
        results = []
        for large in (1, 10**9):
            monkeypatch.setattr(_span, "_LARGE", large)
            results.append(function())
        return results

    return both


def data(space, rng, kind="natural", n=N):
    """Times, points, and end conditions."""
    p = (closed_walk if kind == "periodic" else walk)(space, 0.5, n, rng)
    t = np.cumsum(rng.uniform(0.7, 1.3, len(p)))
    v, w = (0.6 * unit_tangent(space, p[i], rng) for i in (0, -1))
    ends = {"velocity": ((1, v), (1, w)), "acceleration": ((2, v), (2, w)), "mixed": ((1, v), "not-a-knot")}
    return t, p, ends.get(kind, kind)


def near(space, x, y, factor=1.0):
    """Whether points agree up to rounding."""
    return apart(space, x, y) <= 2e-13 * factor


def vectors_near(space, x, u, y, v, factor=1.0):
    if isinstance(space, QUOTIENTS):
        u = space.transport(x, y, u)
    return np.abs(u - v).max() <= 1e-11 * factor * max(1.0, np.abs(v).max())


def agree(space, here, there):
    """Whether two splines are the same curve up to rounding."""
    assert here.report.converged == pytest.approx(there.report.converged)
    assert np.array_equal(here.points, there.points)
    assert vectors_near(space, here.points, here.velocities, there.points, there.velocities)
    assert np.allclose(here.report.max_step, there.report.max_step, rtol=1e-12)


@every_space
@pytest.mark.parametrize("method", ["auto", "fixed-point", "newton"])
def test_solvers(space, method, rng, two_ways):
    t, p, _ = data(space, rng)
    here, there = two_ways(lambda: ss.CubicSpline(t, p, space, method=method))
    agree(space, here, there)
    assert here.report.method == there.report.method
    assert here.report.curvature == space.curvature == there.report.curvature


@every_space
@pytest.mark.parametrize(
    "kind", ["natural", "clamped", "not-a-knot", "periodic", "velocity", "acceleration", "mixed"]
)
def test_curves(space, kind, rng, two_ways):
    t, p, bc_type = data(space, rng, kind)
    x = np.linspace(t[0], t[-1], 40)

    def values():
        spline = ss.CubicSpline(t, p, space, bc_type=bc_type)
        return (
            spline,
            [spline(x, nu) for nu in range(3)],
            spline.speed(x),
            spline.length(),
            spline.bending_energy(),
        )

    (here, ours, *numbers), (there, theirs, *their_numbers) = two_ways(values)
    assert isinstance(here._curve, _span.InSpan) and not isinstance(there._curve, _span.InSpan)
    agree(space, here, there)
    assert near(space, ours[0], theirs[0])
    for nu in (1, 2):
        assert vectors_near(space, ours[0], ours[nu], theirs[0], theirs[nu], 10)
    for a, b in zip(numbers, their_numbers, strict=True):
        assert np.allclose(a, b, rtol=1e-10)
    space.check_point(ours[0])
    space.check_tangent(ours[0], ours[1])
    assert near(space, here(t), p)


@every_space
def test_outside(space, rng, two_ways):
    t, p, _ = data(space, rng)
    x = [t[0] - 0.4, t[-1] + 0.3]

    def values():
        spline = ss.CubicSpline(t, p, space, bc_type="not-a-knot")
        return [[spline(x, nu, extrapolate=e) for nu in range(3)] for e in (True, "geodesic", "periodic")]

    for ours, theirs in zip(*two_ways(values), strict=True):
        assert near(space, ours[0], theirs[0], 10)
        for nu in (1, 2):
            assert vectors_near(space, ours[0], ours[nu], theirs[0], theirs[nu], 30)


@every_space
def test_batches(space, rng, two_ways):
    p = np.stack([[walk(space, 0.5, N, rng) for _ in range(3)] for _ in range(2)])
    t = np.cumsum(rng.uniform(0.7, 1.3, (2, 3, N)), axis=-1)
    v = 0.5 * space.random_tangent(rng, p[:, :, 0]) / np.sqrt(space.dim)
    x = t[..., :1] + rng.uniform(0, 3.5, (2, 3, 4))

    def values(own):
        times, bc_type = (t if own else t[0, 0]), ((1, v), "natural")
        spline = ss.CubicSpline(times, p, space, bc_type=bc_type)
        return spline, spline(x, 1, per_curve=True) if own else spline(x[0, 0], 1)

    for own in (True, False):
        (here, ours), (there, theirs) = two_ways(partial(values, own))
        assert ours.shape == theirs.shape and here.report.converged.all()
        assert near(space, here.points, there.points)
        assert vectors_near(space, here.points, here.velocities, there.points, there.velocities)
        # Vectors at one point have one array, that which the curve has there.
        assert np.allclose(np.linalg.norm(ours), np.linalg.norm(theirs), rtol=1e-10)


LARGE = ["sphere:299", "hyperbolic:300", "rp:299", "cp:299", "gr:3,300", "cgr:2,300"]
every_large = pytest.mark.parametrize("space", [ss.space(name) for name in LARGE], ids=str)


@every_large
def test_a_batch_is_its_curves_bit_for_bit(space, rng):
    p = np.stack([walk(space, 0.4, 6, rng) for _ in range(3)])
    v = 0.3 * space.random_tangent(rng, p[:, 0]) / np.sqrt(space.dim)
    batch = ss.CubicSpline(None, p, space, bc_type=((1, v), "natural"))
    many = ss.fit_many([(None, q) for q in p], space, bc_type=((1, v), "natural"))
    x = np.linspace(0, 5, 11)
    for i in range(3):
        one = ss.CubicSpline(None, p[i], space, bc_type=((1, v[i]), "natural"))
        assert batch[i] == many[i] == one
        assert batch[i].report == many[i].report == one.report
        for nu in range(3):
            assert np.array_equal(batch(x, nu)[i], one(x, nu)) and np.array_equal(many[i](x, nu), one(x, nu))


@every_large
def test_fit_many(space, rng):
    curves = [
        (None, walk(space, 0.4, 6, rng)),
        ([0.0, 2.0], walk(space, 0.4, 2, rng)),
        (None, walk(space, 0.4, 9, rng)),
    ]
    calls = []
    fitted = ss.fit_many(curves, space, bc_type="not-a-knot", progress=lambda *call: calls.append(call))
    for spline, (t, p) in zip(fitted, curves, strict=True):
        alone = ss.CubicSpline(t, p, space, bc_type="not-a-knot")
        assert spline == alone and spline.report == alone.report
    assert all(0 <= done <= total == 17 for done, total in calls) and sorted(calls) == calls


def test_the_bad_curve_of_many_is_named(rng):
    space = ss.Sphere(299)
    good = walk(space, 0.4, 5, rng)
    far = good.copy()
    far[3] = -far[2]
    with pytest.raises(ss.CutLocusError, match=r"points\[2\] and points\[3\] of curve 1 lie") as caught:
        ss.fit_many([(None, good), (None, far), (None, good[:3])], space)
    splines = caught.value.spline
    assert [s.report.converged for s in splines] == [True, False, True]
    assert splines[2] == ss.CubicSpline(None, good[:3], space)
    assert np.isnan(splines[1](0.5)).all()
    with pytest.raises(ss.CutLocusError, match=r"points\[2\] and points\[3\] of curve 1 lie"):
        ss.CubicSpline(None, np.stack([good, far]), space)
    with pytest.raises(ss.ValidationError, match=r"points\[1\] of curve 1 is off the space"):
        ss.fit_many([(None, good), (None, good * [[1.0], [2], [1], [1], [1]])], space)


@every_large
def test_copies(space, rng):
    spline = ss.CubicSpline(None, walk(space, 0.4, 6, rng), space, extrapolate="geodesic")
    x = [-1.0, 0.3, 2.0, 7.0]
    before = [spline(x, nu) for nu in range(3)]
    made = pickle.loads(pickle.dumps(spline))
    assert made == spline and made.report == spline.report
    assert all(np.array_equal(made(x, nu), y) for nu, y in enumerate(before))


@every_space
def test_any_velocities(space, rng, two_ways):
    """Velocities that need not lie in the span of the points."""
    t, p, _ = data(space, rng)
    u = space.random_tangent(rng, p)
    u *= 0.3 / space.norm(p, u).reshape(-1, *[1] * len(space.point_shape))
    x = np.linspace(t[0], t[-1], 20)
    ours, theirs = two_ways(lambda: [ss.evaluate(x, t, p, u, space, nu) for nu in range(3)])
    assert near(space, ours[0], theirs[0])
    for nu in (1, 2):
        assert vectors_near(space, ours[0], ours[nu], theirs[0], theirs[nu], 10)


@every_space
def test_few_and_many_points(space, rng, two_ways):
    """Two points, points that stay where they are, and more points than dimensions."""
    p = walk(space, 0.4, 30 if len(space.point_shape) == 2 else 80, rng)
    for points in (p[:2], p[[0, 0, 0]], p[[0, 1, 0, 1]], p):
        here, there = two_ways(partial(ss.CubicSpline, None, points, space))
        agree(space, here, there)
        a, b = two_ways(partial(here, 0.5))
        assert near(space, a, b)


@every_space
def test_curves_with_control_points(space, rng, two_ways):
    points = np.stack([walk(space, 0.4, 6, rng) for _ in range(2)])
    knots, x = [0, 0, 0, 0, 0.5, 1, 2, 2, 2, 2], np.linspace(0, 2, 21).reshape(3, 7)

    def values():
        curve = ss.BSpline(knots, points, 3, space)
        return [curve(x, nu) for nu in range(3)], curve.speed(x)

    (ours, speed), (theirs, their_speed) = two_ways(values)
    assert near(space, ours[0], theirs[0])
    for nu in (1, 2):
        assert vectors_near(space, ours[0], ours[nu], theirs[0], theirs[nu], 10)
    assert np.allclose(speed, their_speed, rtol=1e-11)


def test_products_have_large_factors(rng):
    space = ss.space("sphere:299 x so:3")
    p = tuple(walk(factor, 0.4, 6, rng) for factor in space.factors)
    spline = ss.CubicSpline(None, p, space)
    alone = ss.CubicSpline(None, p[0], "sphere:299")
    assert np.array_equal(spline(2.5)[0], alone(2.5))


# ---- random tangent vectors ----


@every_large
def test_random_tangents(space, rng):
    p = space.random_point(rng, 2)
    v = space.random_tangent(rng, np.broadcast_to(p[0], (500, *p[0].shape)))
    space.check_tangent(p[0], v)
    d = space.dim
    # |v|² has mean d and variance 2d, ⟨u, v⟩/|u| has mean 0 and variance 1.
    assert abs(np.mean(space.norm(p[0], v) ** 2) - d) < 5 * np.sqrt(2 * d / 500)
    shadow = space.inner(p[0], v[1:], v[0]) / space.norm(p[0], v[0])
    assert abs(np.mean(shadow)) < 5 / np.sqrt(499) and abs(np.var(shadow) - 1) < 5 * np.sqrt(2 / 499)
    assert space.random_tangent(rng, p).shape == p.shape
    again = [space.random_tangent(np.random.default_rng(3), p) for _ in range(2)]
    assert np.array_equal(*again)


# ---- really large ----

SMOKE = """
import numpy as np, symspline as ss, sys
space = ss.space(sys.argv[1])
rng = np.random.default_rng(0)
start = np.eye(1, space.point_shape[0])[0] if sys.argv[1][0] == "h" else space.random_point(rng)
v = space.random_tangent(rng, np.broadcast_to(start, (20, *start.shape)))
p = space.exp(start, 0.3 / np.sqrt(space.dim) * v)
w = 0.2 / np.sqrt(space.dim) * space.random_tangent(rng, p[0])
for bc_type in ("not-a-knot", ((1, w), "natural")):
    spline = ss.CubicSpline(None, p, space, bc_type=bc_type)
    assert spline.report.converged
    for nu in range(3):
        assert np.isfinite(spline([0.5, 7.3], nu)).all()
assert space.distance(spline(np.arange(20.0)), p).max() < 1e-12
assert spline.length() > 1
many = ss.fit_many([(None, p[:7]), (None, p)], space)
assert many[1] == ss.CubicSpline(None, p, space)
assert np.isfinite(ss.BezierCurve(p[:4], space)([0.0, 0.5], nu=2)).all()
print(*(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads the memory used in /proc")
@pytest.mark.parametrize("name", ["sphere:199999", "gr:3,20000", "hyperbolic:20000", "cp:20000"])
def test_really_large_spaces(name):
    """Seconds, where an n × n array would be 3 GB at least."""
    peak = run_python(SMOKE, name, timeout=60)
    assert int(peak) < 1_500_000
