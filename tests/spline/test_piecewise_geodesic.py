"""Curves of geodesics between neighbouring points."""

import pickle

import numpy as np
import pytest
from compare import largest_difference, off, parts
from curves import KNOTS, S2, THREE, every_batch, every_kind, points_on
from refused import raises
from scipy.spatial.transform import Rotation, Slerp
from stored import load, stored

import symspline as ss

# Inside segments, and all knots.
X = np.sort(np.append(np.linspace(0.02, 4.48, 37), KNOTS))


def segments(x):
    """Numbers of the segments, and the positions on them."""
    i = np.clip(np.searchsorted(KNOTS, x, side="right") - 1, 0, len(KNOTS) - 2)
    return i, (x - KNOTS[i]) / (KNOTS[i + 1] - KNOTS[i])


def expected(space, points, x):
    """Points of `Space.geodesic` on every segment, and velocities there."""
    if isinstance(space, ss.Product):
        found = [expected(f, p, x) for f, p in zip(space.factors, points, strict=True)]
        return tuple(zip(*found, strict=True))
    i, tau = segments(x)
    axis = points.ndim - len(space.point_shape) - 1
    p, q = (np.take(points, k, axis=axis) for k in (i, i + 1))
    here, there = space.geodesic(p, q, tau), space.geodesic(p, q, np.where(tau < 0.5, tau + 0.5, tau - 0.5))
    h = np.diff(KNOTS)[i].reshape(-1, *(1,) * len(space.point_shape))
    way = np.where(tau < 0.5, 2.0, -2.0).reshape(h.shape)
    return here, way * space.log(here, there) / h


@every_kind
@every_batch
def test_segments_are_geodesics(space, batch):
    points = points_on(space, 6, batch, step=0.4)
    curve = ss.PiecewiseGeodesic(KNOTS, points, space)
    here, velocity = expected(space, points, X)
    assert off(space, curve(X), here) < 1e-13
    # Representatives of the data of projective spaces may differ from those of `Space.geodesic`.
    size = sum(f.norm(p, v) ** 2 for f, p, v in zip(factors(space), parts(here), parts(velocity), strict=True)) ** 0.5
    assert np.allclose(curve.speed(X), size, rtol=1e-9)
    assert max(np.abs(own).max() for own in parts(curve(X, nu=2))) < 1e-6
    assert largest_difference(curve.velocities, curve(KNOTS, nu=1)) < 1e-9
    assert curve.speed(X).shape == (*batch, len(X))
    assert np.shape(curve.length()) == batch


def factors(space):
    return space.factors if isinstance(space, ss.Product) else (space,)


@every_kind
def test_length_is_the_sum_of_distances(space):
    points = points_on(space, 6, step=0.4)
    curve = ss.PiecewiseGeodesic(KNOTS, points, space)
    steps = np.sqrt(
        sum(f.norm(p[:-1], f.log(p[:-1], p[1:])) ** 2 for f, p in zip(factors(space), parts(points), strict=True))
    )
    # Lengths of translations and shears are not those of their logarithms where the metric is not invariant.
    if not any(np.isnan(f.curvature) for f in factors(space)):
        assert abs(curve.length() - steps.sum()) < 1e-9 * steps.sum()


def test_rotations_are_those_of_slerp():
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.01, 2, 60))
    given = Rotation.random(60, random_state=3)
    x = np.concatenate([rng.uniform(t[0], t[-1], 500), t])
    curve = ss.PiecewiseGeodesic(t, given.as_matrix(), "so:3")
    assert np.abs(curve(x) - Slerp(t, given)(x).as_matrix()).max() < 1e-12
    assert np.abs(ss.rotations.rotation(curve, x).as_matrix() - curve(x)).max() < 1e-12
    rates = (given[:-1].inv() * given[1:]).as_rotvec() / np.diff(t)[:, None]
    assert np.abs(ss.rotations.angular_velocity(curve, t[:-1], frame="body") - rates).max() < 1e-9


def test_flat_space_is_linear_interpolation():
    rng = np.random.default_rng(4)
    t, y = np.cumsum(rng.uniform(1e-3, 1e3, 50)), 1e6 * rng.standard_normal(50)
    x = rng.uniform(t[0], t[-1], 200)
    curve = ss.PiecewiseGeodesic(t, y[:, None], "r:1")
    assert np.allclose(curve(x)[:, 0], np.interp(x, t, y), rtol=1e-12, atol=1e-9)
    slopes = np.diff(y) / np.diff(t)
    assert np.allclose(curve(t, nu=1)[:, 0], np.append(slopes, slopes[-1]), rtol=1e-12)
    assert np.allclose(curve(np.nextafter(t[1:], 0), nu=1)[:, 0], slopes, rtol=1e-12)


def test_outside_the_knots_of_piecewise_geodesics():
    curve = ss.PiecewiseGeodesic([0, 1, 3], THREE, S2)
    raises("outside", curve, 3.5)
    further = S2.geodesic(THREE[1], THREE[2], 1.25)
    for policy in (True, "geodesic"):
        assert np.abs(curve(3.5, extrapolate=policy) - further).max() < 1e-15
    assert np.abs(curve(3.5, extrapolate="periodic") - curve(0.5)).max() < 1e-15
    assert np.isnan(curve(3.5, extrapolate=False)).all()


def test_bending_energy_is_infinite_at_kinks():
    straight = S2.geodesic(THREE[0], THREE[1], [0, 0.1, 0.35, 1])
    points = [straight, S2.geodesic(THREE[0], THREE[1], [0, 0.1, 0.5, 1]), [THREE[0]] * 4]
    curve = ss.PiecewiseGeodesic([0, 0.1, 0.35, 1], points, S2)
    assert curve.bending_energy().tolist() == [0, np.inf, 0]
    assert curve[0].bending_energy() == 0
    assert ss.PiecewiseGeodesic(None, THREE[:2], S2).bending_energy() == 0
    # A point at rest that starts to move.
    assert ss.PiecewiseGeodesic(None, [[0.0], [0.0], [1.0]], "r:1").bending_energy() == np.inf


@pytest.mark.parametrize("name", ["sphere:2", "so:3 x r:3", "cp:2"])
def test_files_and_pickles_of_piecewise_geodesics(name):
    space = ss.space(name)
    dates = np.datetime64("2024-05-01") + (1e3 * KNOTS).astype("m8[ms]")
    curve = ss.PiecewiseGeodesic(dates, points_on(space, 6, (2,), step=0.4), space, extrapolate="geodesic")
    for copy in (load(stored(curve)), pickle.loads(pickle.dumps(curve))):
        assert copy == curve
        assert copy.extrapolate == "geodesic"
        x = dates[0] + np.timedelta64(700, "ms")
        for a, b in zip(parts(copy(x)), parts(curve(x)), strict=True):
            assert np.array_equal(a, b)
    again = pickle.loads(pickle.dumps(curve._curve))
    assert all(np.array_equal(a, b) for a, b in zip(parts(again.points), parts(curve.points), strict=True))


def test_batches_are_single_curves():
    points = points_on(S2, 6, (3,), step=0.4)
    times = np.stack([KNOTS, KNOTS + 1, 2 * KNOTS])
    curves = ss.PiecewiseGeodesic(times, points, S2)
    x = np.array([[0.3, 2.0], [1.3, 4.0], [0.3, 8.0]])
    for i, curve in enumerate(curves):
        assert curve == ss.PiecewiseGeodesic(times[i], points[i], S2)
        assert np.array_equal(curves(x, per_curve=True)[i], curve(x[i]))
    assert len(curves[1:]) == 2
    assert repr(curves) == "<PiecewiseGeodesic on Sphere(2): 3 curves, 6 points, each with its own times>"


def test_quotients_take_the_nearest_representative():
    axes = ss.Quotient("sphere:2", [np.eye(3), -np.eye(3)])
    points = points_on(S2, 6, step=0.4)
    signs = np.array([1, -1, -1, 1, -1, 1])[:, None]
    curve, plain = (ss.PiecewiseGeodesic(KNOTS, *each) for each in ((signs * points, axes), (points, S2)))
    assert np.abs(curve(X) - plain(X)).max() < 1e-14


def test_large_spaces_and_manifolds():
    sphere = ss.Sphere(400)
    rng = np.random.default_rng(6)
    points = sphere.project(rng.standard_normal((6, 401)))
    curve = ss.PiecewiseGeodesic(KNOTS, points, sphere)
    assert np.abs(curve(X) - expected(sphere, points, X)[0]).max() < 1e-13
    stiefel = ss.Stiefel(2, 4)
    points = [stiefel.random_point(rng)]
    for _ in range(3):
        points.append(stiefel.exp(points[-1], 0.3 * stiefel.random_tangent(rng, points[-1])))
    curve = ss.PiecewiseGeodesic(None, points, stiefel)
    assert np.abs(curve(1.25) - stiefel.geodesic(points[1], points[2], 0.25)).max() < 1e-9


def test_invalid_arguments_of_piecewise_geodesics_raise():
    for match, changes in [
        ("the space by", {"points": 2 * np.eye(3)}),
        (r"t\[1\]", {"t": [0, 0, 1]}),
        ("extrapolate must be", {"extrapolate": "linear"}),
        ("not finite", {"points": [[1, 0, 0], [np.nan, 0, 0], [0, 1, 0]]}),
    ]:
        raises(match, ss.PiecewiseGeodesic, **{"t": None, "points": THREE, "space": S2} | changes)


def test_points_without_a_unique_geodesic_raise():
    for match, points in [
        (r"points\[0\] and points\[1\] lie at or past", [[1, 0, 0], [-1, 0, 0], [1, 0, 0]]),
        (r"points\[0\] and points\[1\] of curve 0 lie .* Put a point", [[[1, 0, 0], [-1, 0, 0]]] * 2),
    ]:
        raises(match, ss.PiecewiseGeodesic, None, points, S2, error=ss.CutLocusError)


def test_an_opposite_pair_affects_its_own_segment_only(tmp_path):
    """Directions that are rounded to ten degrees."""
    angles = np.radians([[10.0], [20], [30], [210], [220], [230]])
    match = r"points\[2\] and points\[3\] lie .* NaN there.*fit_segments"
    with pytest.warns(ss.FarPointsWarning, match=match) as caught:
        curve = ss.PiecewiseGeodesic(None, angles, "torus:1")
    assert caught[0].message.node == 2
    x = np.array([0, 0.5, 1.9, 2, 2.5, 3, 4.5])
    expected = [10, 15, 29, 30, np.nan, 210, 225]
    turned = np.degrees(curve(x)[:, 0]) % 360
    np.testing.assert_allclose(turned, expected, rtol=1e-14)
    assert np.isnan(curve.length()) and np.isnan(curve.bending_energy())
    np.testing.assert_array_equal(np.isnan(curve(x, nu=1)[:, 0]), x // 1 == 2)
    curve.save(tmp_path / "a.npz")
    with pytest.warns(ss.FarPointsWarning):
        np.testing.assert_array_equal(ss.load(tmp_path / "a.npz")(x), curve(x))
    # In a batch and in a product, other curves and factors are as they are alone.
    near = angles / 10
    with pytest.warns(ss.FarPointsWarning, match=r"points\[2\] and points\[3\] of curve 1 "):
        both = ss.PiecewiseGeodesic(None, np.stack([near, angles]), "torus:1")
    np.testing.assert_array_equal(both(x), [ss.PiecewiseGeodesic(None, near, "torus:1")(x), curve(x)])
    np.testing.assert_array_equal(both(np.stack([x, x]), per_curve=True), both(x))
    with pytest.warns(ss.FarPointsWarning):
        product = ss.PiecewiseGeodesic(None, (angles, near), "torus:1 x r:1")
    assert np.isnan(product(2.5)[0]).all() and product(2.5)[1] == near[2:4].mean()
    np.testing.assert_array_equal(product(2.0)[0], angles[2])


@pytest.mark.parametrize("distance", [7.0, 15, 22, 30])
def test_long_geodesics_of_the_hyperbolic_plane(distance):
    """Points far out on both sides of the origin: the closed form in coordinates."""
    at = lambda s: np.stack([np.cosh(s), np.sinh(s), 0 * s], axis=-1)  # noqa: E731
    x = np.linspace(0, 1, 41)
    points = ss.Hyperbolic(2).project(at(np.array([-0.5, 0.5]) * distance))
    exact = at((x - 0.5) * distance)
    for curve in (ss.PiecewiseGeodesic(None, points, "h:2"), ss.CubicSpline(None, points, "h:2", tol=1e-5)):
        assert (np.abs(curve(x) - exact).max(axis=-1) < 1e-12 * exact[:, 0]).all()
        # Vectors are less accurate than points by the square of the time-like coordinate.
        assert np.abs(curve.speed(x) / distance - 1).max() < 1e-12 + 1e-15 * exact[0, 0] ** 2
