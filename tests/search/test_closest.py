"""The nearest points of curves, against a dense search and closed forms."""

import numpy as np
import pytest
from compare import parts
from curves import core_calls, every_kind, points_on
from refused import raises

import symspline as ss

NO_METRIC = ("se:3", "sim:2", "aff:2", "gl:2", "lorentz:2", "ds:2", "r:2 x se:2")


def uneven(n, seed=0):
    """Irregular knots with a long gap."""
    t = np.cumsum(np.random.default_rng(seed).uniform(0.5, 1.2, n))
    t[n // 2 :] += 1.0
    return t


def has_metric(space):
    return not any(
        np.isnan(f.curvature) and not isinstance(f, ss.Manifold) for f in getattr(space, "factors", (space,))
    )


def dense(curve, points, count=100_000):
    """The smallest distances from equidistant samples of one curve; points have one leading axis."""
    space = curve.space
    samples = curve(np.linspace(*curve.domain, count + 1))
    own = parts(points)
    found = []
    for i in range(len(own[0])):
        target = tuple(x[i] for x in own)
        found.append(space.distance(samples, target if isinstance(points, tuple) else target[0]).min())
    return np.array(found)


def curves_on(space, n=9):
    points = points_on(space, n, step=0.6)
    t = uneven(n)
    cubic = ss.CubicSpline(t, points, space)
    yield cubic
    yield ss.PiecewiseGeodesic(t, points, space)
    yield ss.HermiteSpline(t, cubic.points, cubic.velocities, space)
    yield ss.make_smoothing_spline(t, points, space, lam=0.05)
    if not isinstance(space, ss.Product):
        yield ss.BezierCurve(points[:5], space)
        yield ss.BSpline([0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 7, 7], points, 2, space)


@every_kind
def test_not_farther_than_a_dense_search(space):
    if not has_metric(space):
        pytest.skip("there is no distance")
    targets = points_on(space, 6, step=1.0, seed=7)
    for curve in curves_on(space):
        times, distances = curve.closest(targets)
        assert times.shape == distances.shape == (6,)
        assert (distances <= dense(curve, targets, 20_000) + 1e-9).all(), type(curve)
        np.testing.assert_allclose(space.distance(curve(times), targets), distances, atol=1e-9)


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "r:3", "h:2", "spd:2", "cp:2", "so:3 x r:3", "so:3/432"])
def test_long_paths(name):
    space = ss.space(name)
    curve = ss.CubicSpline(uneven(101), points_on(space, 101, step=0.3), space)
    rng = np.random.default_rng(3)
    targets = space.random_point(rng, (12,))
    _, distances = curve.closest(targets)
    # Distances in a quotient take longer.
    count = 5_000 if "/" in name else 100_000
    assert (distances <= dense(curve, targets, count) + 1e-9).all()
    # A point of the curve is at distance zero.
    at = rng.uniform(*curve.domain, 30)
    times, zero = curve.closest(curve(at))
    assert zero.max() < 2e-7
    away = np.abs(times - at) > 1e-6
    # At another time only where the curve crosses itself.
    assert not away.any() or name in ("so:3/432",)


def test_is_the_foot_of_the_perpendicular():
    """On a straight line and on a great circle the nearest points have closed forms."""
    line = ss.CubicSpline([2.0, 4.0], [[0.0, 0.0], [10.0, 0.0]], "r:2")
    times, distances = line.closest([[3.0, 4.0], [-3.0, 4.0], [1e6, 1.0]])
    np.testing.assert_allclose(times, [2.6, 2.0, 4.0], atol=1e-13)
    np.testing.assert_allclose(distances, [4.0, 5.0, np.hypot(1e6 - 10, 1)], rtol=1e-15)
    circle = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0], [-1, 0, 0]], "sphere:2")
    angle, height = 1.1, 0.4
    target = [np.cos(height) * np.cos(angle), np.cos(height) * np.sin(angle), np.sin(height)]
    time, distance = circle.closest(target)
    np.testing.assert_allclose([time, distance], [angle / (np.pi / 2), height], atol=1e-14)


def test_corners_and_ends():
    corner = ss.PiecewiseGeodesic([0, 1, 3], [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]], "r:2")
    times, distances = corner.closest([[1.5, -0.5], [-1.0, 0.0], [1.0, 9.0], [1.2, 1.0], [0.3, -1e-9]])
    np.testing.assert_allclose(times, [1.0, 0.0, 3.0, 2.0, 0.3], atol=1e-13)
    np.testing.assert_allclose(distances, [np.sqrt(0.5), 1.0, 7.0, 0.2, 1e-9], atol=1e-14)


def test_distances_from_polygons():
    """The exact distance from a segment is that of the projection, restricted to the segment."""
    rng = np.random.default_rng(8)
    vertices, points = rng.uniform(0, 3, (60, 2)), rng.uniform(0, 3, (300, 2))
    # Points close to the vertices, where the velocity jumps.
    points[::2] = vertices[rng.integers(0, 60, 150)] + rng.normal(0, 0.02, (150, 2))
    start, side = vertices[:-1], np.diff(vertices, axis=0)
    share = np.sum((points[:, None] - start) * side, axis=-1) / np.sum(side**2, axis=-1)
    feet = start + np.clip(share, 0, 1)[..., None] * side
    exact = np.linalg.norm(points[:, None] - feet, axis=-1).min(axis=1)
    _, distances = ss.PiecewiseGeodesic(uneven(60), vertices, "r:2").closest(points)
    np.testing.assert_allclose(distances, exact, atol=1e-13)


def test_constant_curves_and_the_cut_locus():
    pole = [0.0, 0.0, 1.0]
    rest = ss.CubicSpline([1.0, 2.0, 5.0], [pole] * 3, "sphere:2")
    times, distances = rest.closest([pole, [1, 0, 0], [0, 0, -1]])
    assert times.tolist() == [1.0, 1.0, 1.0]
    np.testing.assert_allclose(distances, [0, np.pi / 2, np.pi], atol=1e-15)
    # All points of the equator are at the same distance from the pole, and in the projective plane on its cut locus.
    for name in ("sphere:2", "rp:2"):
        equator = ss.CubicSpline(None, [[1, 0, 0], [0.6, 0.8, 0], [0, 1, 0]], name)
        _, distance = equator.closest(pole)
        assert abs(distance - np.pi / 2) < 1e-12
    # A rotation by 180° away from all poses, which move along a line.
    poses = ss.CubicSpline(None, (np.stack([np.eye(3)] * 4), np.arange(12.0).reshape(4, 3)), "so:3 x r:3")
    time, distance = poses.closest((np.diag([1.0, -1, -1]), [4.11, 5.11, 6.11]))
    np.testing.assert_allclose([time, distance], [1.37, np.pi], atol=1e-12)


def test_factors_at_rest_on_the_cut_locus():
    """The distance of one factor is π everywhere, and has no derivative: the other one decides."""
    pole = np.array([0, 0, 1.0])
    curve = ss.CubicSpline(None, (np.tile(pole, (4, 1)), [[0.0], [1.0], [3.0], [4.0]]), "sphere:2 x r:1")
    # The core searches splines, Python parts of them.
    for own in (curve, curve.restrict(0.1, 2.9)):
        for x in np.random.default_rng(0).uniform(0.3, 3.7, 8):
            time, distance = own.closest((-pole, [x]))
            assert own(time)[1][0] == pytest.approx(x, abs=1e-6) and distance == pytest.approx(np.pi)


def test_closed_curves_with_equally_near_branches():
    angles = np.linspace(0, 2 * np.pi, 9)
    loop = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    loop[-1] = loop[0]
    curve = ss.CubicSpline(angles, loop, "r:2", bc_type="periodic")
    _, distance = curve.closest([0.0, 0.0])
    assert distance <= dense(curve, np.zeros((1, 2)))[0] + 1e-9
    time, distance = curve.closest([3.0, 0.0])
    assert min(time, 2 * np.pi - time) < 1e-12 and abs(distance - 2) < 1e-12


def sphere_of_functions():
    sphere = ss.space("sphere:2")
    functions = {name: getattr(sphere, name) for name in ("exp", "log", "project_tangent", "inner", "project")}
    return ss.Manifold(**functions, point_shape=3)


def test_manifolds_of_functions():
    sphere, twin = ss.space("sphere:2"), sphere_of_functions()
    points, targets = points_on(sphere, 7), points_on(sphere, 5, seed=9)
    reference = ss.CubicSpline(None, points, sphere).closest(targets)
    np.testing.assert_allclose(ss.CubicSpline(None, points, twin).closest(targets), reference, atol=1e-7)
    # There is no logarithm at the opposite point.
    away = ss.CubicSpline(None, [points[0], points[1]], twin).closest(-points[0])
    np.testing.assert_allclose(away, [1.0, np.pi - sphere.distance(points[0], points[1])], atol=1e-7)


@pytest.mark.parametrize("own_knots", [False, True])
def test_batches_of_nearest_points(own_knots):
    space = ss.space("so:3")
    points = points_on(space, 6, (2, 3))
    t = np.cumsum(np.random.default_rng(1).uniform(0.5, 2, (2, 3, 6)), axis=-1) if own_knots else None
    curves = ss.CubicSpline(t, points, space)
    targets = points_on(space, 4, (5,), seed=8)
    times, distances = curves.closest(targets)
    assert times.shape == distances.shape == (2, 3, 5, 4)
    own = points_on(space, 4, (2, 3), seed=8)
    pairs = curves.closest(own, per_curve=True)
    assert pairs[0].shape == (2, 3, 4)
    for i in range(2):
        for j in range(3):
            single = curves[i][j].closest(targets)
            np.testing.assert_allclose([times[i, j], distances[i, j]], single, atol=1e-12)
            np.testing.assert_allclose([x[i, j] for x in pairs], curves[i][j].closest(own[i, j]), atol=1e-12)


def test_dates_shapes_and_failed_curves():
    t = np.datetime64("2026-03-01T12:00") + np.arange(3) * np.timedelta64(1, "h")
    curve = ss.CubicSpline(t, [[0.0], [1.0], [2.0]], "r:1")
    time, distance = curve.closest([0.25])
    assert time == np.datetime64("2026-03-01T12:15") and distance == 0
    assert curve.closest(np.zeros((0, 4, 1)))[0].shape == (0, 4)
    assert ss.CubicSpline(None, np.zeros((0, 3, 1)), "r:1").closest([1.0])[1].shape == (0,)
    points = np.stack([points_on(ss.space("sphere:2"), 4), points_on(ss.space("sphere:2"), 4, seed=2)])
    mask = [True, False]
    curves = ss.CubicSpline(None, points, "sphere:2", where=mask)
    times, distances = curves.closest([1, 0, 0])
    assert np.isfinite([times[0], distances[0]]).all() and np.isnan([times[1], distances[1]]).all()


def test_composed_curves():
    space = ss.space("so:3")
    curve = ss.CubicSpline(uneven(8), points_on(space, 8), space)
    targets = points_on(space, 5, seed=3)
    start, stop = curve.domain
    part = curve.restrict(start + 0.4, stop - 0.3)
    assert (part.closest(targets)[1] <= dense(part, targets, 20_000) + 1e-9).all()
    # Two halves with a gap between them, in which there are no points.
    halves = ss.SegmentedCurve([curve.restrict(b=curve.t[3]), curve.restrict(a=curve.t[4]).shift(5.0)])
    each = [segment.closest(targets) for segment in halves]
    times, distances = halves.closest(targets)
    np.testing.assert_array_equal(distances, np.minimum(each[0][1], each[1][1]))
    np.testing.assert_allclose(space.distance(halves(times), targets), distances, atol=1e-9)


@pytest.mark.parametrize("name", NO_METRIC)
def test_spaces_without_a_metric_raise(name):
    space = ss.space(name)
    curve = ss.CubicSpline(None, points_on(space, 4, step=0.2), space)
    raises("has no invariant metric", curve.closest, points_on(space, 1, step=0.2))


def test_invalid_points_to_search_from_raise():
    curve = ss.CubicSpline(None, points_on(ss.space("sphere:2"), 4), "sphere:2")
    raises(r"points\[1\] is off the space", curve.closest, [[1, 0, 0], [1, 1, 0]])
    raises("points is off the space", curve.closest, [1, 1, 0])
    raises("points are invalid", ss.CubicSpline(None, curve.points, sphere_of_functions()).closest, [[1, 1, 0]])
    raises("points has shape", curve.closest, [1.0, 0.0])
    raises(
        "points must be a tuple of 2 arrays",
        ss.CubicSpline(None, points_on(ss.space("so:3 x r:3"), 4), "so:3 x r:3").closest,
        np.eye(3),
    )


def test_all_points_of_a_circle_are_equally_near():
    """No interval can be excluded: there are more of them than are searched together, which bounds the memory."""
    angles = np.linspace(0, 3, 400)
    circle = ss.CubicSpline(angles, np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1), "sphere:2")
    targets = np.stack([[0.0, 0.0, 1.0]] * 200)
    _, distances = circle.closest(targets)
    np.testing.assert_allclose(distances, np.pi / 2, atol=1e-12)


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "spd:2", "cp:2", "torus:2", "so:3 x r:3"])
@pytest.mark.parametrize("batch", [(), (3,)])
def test_distances_by_functions_give_the_same(name, batch):
    """Curves that the core cannot evaluate have the same search, with distances from Python."""
    space = ss.space(name)
    curve = ss.CubicSpline(uneven(20), points_on(space, 20, batch), space)
    targets = points_on(space, 30, step=1.0, seed=4)
    assert curve._closest._compiled is not None
    found = curve.closest(targets)
    vars(curve._closest)["_compiled"] = None
    again = curve.closest(targets)
    np.testing.assert_allclose(found[1], again[1], rtol=1e-12)
    np.testing.assert_allclose(found[0], again[0], atol=1e-9)


def test_all_points_are_one_call_of_the_core():
    space = ss.space("so:3")
    curve = ss.CubicSpline(None, points_on(space, 101), space)
    targets = space.random_point(np.random.default_rng(0), (1000,))
    assert core_calls("closest", lambda: curve.closest(targets)) == 1
