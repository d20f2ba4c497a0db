"""Hermite splines whose velocities follow from neighbouring points."""

import numpy as np
import pytest
from compare import each, largest_difference, off
from curves import KNOTS, S2, THREE, every_kind, points_on
from scipy.interpolate import Akima1DInterpolator, CubicHermiteSpline, PchipInterpolator
from scipy.spatial.transform import Rotation

import symspline as ss

METHODS = ["catmull-rom", "akima", "pchip"]
every_method = pytest.mark.parametrize("method", METHODS)
from_points = ss.HermiteSpline.from_points


def recorded(n, size, seed=0):
    """Irregular times, and noisy numbers with repeats, straight parts and turns."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.02, 2, n))
    y = np.cumsum(rng.standard_normal((n, 3)), axis=0)
    y[n // 3] = y[n // 3 - 1]
    y[n // 2 :, 1] = y[n // 2, 1]
    y[:, 2] = np.sort(y[:, 2])
    return t, size * y


def catmull_rom(t, y):
    """Derivatives of parabolas through three points, at the end points those of the outer parabolas."""
    n = len(t)
    found = []
    for i in range(n):
        first = min(max(i - 1, 0), max(n - 3, 0))
        own = slice(first, first + 3)
        polynomials = [np.polyfit(t[own] - t[i], column, len(t[own]) - 1) for column in y[own].T]
        found.append([polynomial[-2] for polynomial in polynomials])
    return CubicHermiteSpline(t, y, np.array(found))


@every_method
@pytest.mark.parametrize("n", [2, 3, 4, 5, 40])
@pytest.mark.parametrize("size", [1.0, 1e-200, 1e150])
def test_flat_space_of_local_velocities_is_scipys(method, n, size):
    if method == "akima" and n == 2:
        pytest.skip("SciPy needs three points")
    t, y = recorded(n, size)
    scipy = {"catmull-rom": lambda t, y: catmull_rom(t, y / size), "akima": Akima1DInterpolator}
    x = np.concatenate([np.linspace(t[0], t[-1], 201), t])
    expected = scipy.get(method, PchipInterpolator)(t, y)(x)
    ours = from_points(t, y, "r:3", method=method)(x)
    assert np.abs(ours / size - expected / (1 if method == "catmull-rom" else size)).max() < 1e-11


@every_kind
@every_method
def test_points_and_neighbours_determine_the_curve(space, method):
    points = points_on(space, 6, (2,), step=0.4)
    curve = from_points(KNOTS, points, space, method=method)
    assert off(space, curve(KNOTS), points) < 1e-13
    again = ss.HermiteSpline(KNOTS, curve.points, curve.velocities, space)
    assert largest_difference(again.velocities, curve.velocities) < 1e-13
    # The first two segments depend on the first five points only.
    shorter = from_points(KNOTS[:5], each(lambda p: p[:, :5], points), space, method=method)
    x = np.linspace(0, 1.5, 21)
    assert largest_difference(shorter(x), curve(x)) < 1e-10


@every_method
@pytest.mark.parametrize("name", ["sphere:2", "so:3", "spd:3", "h:2", "gr:2,4"])
def test_points_on_a_geodesic_stay_on_it(name, method):
    space = ss.space(name)
    p = space.random_point(np.random.default_rng(0))
    v = space.random_tangent(np.random.default_rng(1), p)
    v = v / space.norm(p, v)
    s = np.array([0.0, 0.2, 0.5, 0.5, 0.7, 0.4, 0.45])
    t = np.cumsum([0, 0.3, 0.1, 1, 1, 0.5, 2])
    points = space.exp(p, s.reshape(-1, *(1,) * len(space.point_shape)) * v)
    flat = from_points(t, s[:, None], "r:1", method=method)
    x = np.linspace(t[0], t[-1], 101)
    expected = space.exp(p, flat(x).reshape(-1, *(1,) * len(space.point_shape)) * v)
    assert space.distance(from_points(t, points, space, method=method)(x), expected).max() < 1e-7


def test_catmull_rom_on_a_sphere():
    # At the middle point, the mean of the velocities of both geodesics, weighted by the other intervals.
    curve = from_points([0, 1, 3], THREE, S2)
    assert np.allclose(curve.velocities[1], np.pi / 2 * np.array([-2 / 3, 0, 1 / 6]))
    # At the ends, twice the velocity of the geodesic minus that of the parabola, transported.
    turned = S2.transport(THREE[1], THREE[0], curve.velocities[1])
    assert np.allclose(curve.velocities[0], np.pi * np.array([0, 1, 0]) - turned)


def test_pchip_stops_where_the_curve_turns_back():
    there = S2.geodesic(THREE[0], THREE[1], [0, 0.4, 0.9, 0.5, 0.1])
    curve = from_points(None, there, S2, method="pchip")
    assert curve.speed(2) < 1e-12
    # At a right angle, the harmonic mean of both speeds times the cosine of 45 degrees.
    corner = from_points(None, THREE, S2, method="pchip")
    assert np.allclose(corner.velocities[1], np.pi / 2 * np.array([-1, 0, 1]) / 2)


def test_dates_and_quotients():
    dates = np.datetime64("2024-05-01") + (1e3 * KNOTS).astype("m8[ms]")
    axes = ss.Quotient("sphere:2", [np.eye(3), -np.eye(3)])
    points = points_on(S2, 6, step=0.4)
    signs = np.array([1, -1, -1, 1, -1, 1])[:, None]
    dated, plain = from_points(dates, signs * points, axes), from_points(KNOTS, points, S2)
    assert np.abs(dated(dates[0] + np.timedelta64(1300, "ms")) - plain(1.3)).max() < 1e-14


def test_invalid_arguments_of_local_velocities_raise():
    with pytest.raises(ss.ValidationError, match="method must be one of 'catmull-rom', 'akima', 'pchip', not 'cubic'"):
        from_points(None, THREE, S2, method="cubic")
    with pytest.raises(ss.CutLocusError, match=r"points\[0\] and points\[1\]"):
        from_points(None, [[1, 0, 0], [-1, 0, 0], [1, 0, 0]], S2)


@pytest.mark.parametrize("method", ["catmull-rom", "akima", "pchip"])
def test_an_opposite_pair_affects_the_segments_next_to_it_only(method, tmp_path):
    first, second = points_on(S2, 6, step=0.4), points_on(S2, 5, step=0.3)
    # The first point of the second part is opposite to the last one of the first part.
    second = Rotation.align_vectors([-first[-1]], [second[0]])[0].apply(second)
    second[0] = -first[-1]
    points = np.concatenate([first, second])
    with pytest.warns(ss.FarPointsWarning, match=r"points\[5\] and points\[6\]"):
        curve = from_points(None, points, S2, method=method)
    before, after = np.linspace(0, 3.9, 30), np.linspace(7, 10, 30)
    np.testing.assert_allclose(curve(before), from_points(None, first, S2, method=method)(before), atol=1e-15)
    np.testing.assert_allclose(curve(after), from_points(None, second, S2, method=method)(after - 6), atol=1e-15)
    assert np.isnan(curve([4.5, 5.5, 6.5])).all()
    curve.save(tmp_path / "a.npz")
    np.testing.assert_array_equal(ss.load(tmp_path / "a.npz")(before), curve(before))
    with pytest.warns(ss.FarPointsWarning, match="of curve 1"):
        both = from_points(None, np.stack([np.roll(points, 5, axis=0), points]), S2, method=method)
    np.testing.assert_array_equal(both(before)[1], curve(before))
