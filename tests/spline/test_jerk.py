"""The covariant derivative of the acceleration."""

from itertools import pairwise

import numpy as np
import pytest
from compare import each, largest_difference, parts
from curves import KNOTS, S2, THREE, every_single, points_on
from refused import raises
from scipy.interpolate import CubicSpline

import symspline as ss

# Inside segments, with room for differences.
X = np.array([0.2, 0.6, 1.2, 2.0, 2.7, 3.4, 4.2])


def moved(space, p, q, vectors):
    """Vectors transported along geodesics, point by point."""
    return np.stack([space.transport(*one) for one in zip(p, q, vectors, strict=True)])


def differences(curve, x, step=0.02):
    """The derivative of the acceleration by central differences of eighth order."""
    space, here, total = curve.space, curve(x), 0
    for k, weight in enumerate([4 / 5, -1 / 5, 4 / 105, -1 / 280], 1):
        for sign in (1, -1):
            at = x + sign * k * step
            total = total + sign * weight / step * moved(space, curve(at), here, curve(at, nu=2))
    return total


@every_single
def test_jerk_is_the_derivative_of_the_acceleration(space):
    curve = ss.CubicSpline(KNOTS, points_on(space, 6, step=0.4), space)
    expected = differences(curve, X)
    assert np.abs(curve(X, nu=3) - expected).max() < 1e-9 * max(1, np.abs(expected).max())


@pytest.mark.parametrize("name", ["cp:2", "gr:2,5", "cgr:2,4"])
def test_jerk_of_uneven_and_wide_segments(name, rng):
    space = ss.space(name)
    t = 3 + np.cumsum([0, 1.9, 0.4, 1.2, 0.3, 1.6])
    curve = ss.CubicSpline(t, points_on(space, 6, step=0.7), space)
    x = np.concatenate([np.linspace(a, b, 9)[1:-1] for a, b in pairwise(t)])
    expected = differences(curve, x, step=0.002)
    assert np.abs(curve(x, nu=3) - expected).max() < 1e-8 * np.abs(expected).max()


def test_flat_space_of_the_jerk_is_scipys():
    rng = np.random.default_rng(0)
    for unit in (1.0, 1e-6, 1e5):
        t, y = unit * np.cumsum(rng.uniform(0.1, 2, 9)), rng.standard_normal((9, 2))
        x = np.concatenate([rng.uniform(t[0], t[-1], 50), t])
        expected = CubicSpline(t, y, bc_type="natural")(x, 3)
        assert np.abs(ss.CubicSpline(t, y, "r:2")(x, nu=3) - expected).max() < 1e-9 * np.abs(expected).max()


def test_jerk_is_continuous_from_the_right():
    curve = ss.CubicSpline(KNOTS, points_on(S2, 6, step=0.4), S2)
    at, before, after = (curve(KNOTS[1:-1] + shift, nu=3) for shift in (0, -1e-9, 1e-9))
    assert np.abs(at - after).max() < 1e-6
    assert np.abs(at - before).max() > 0.1
    # At the last knot, the jerk is that of the last segment.
    assert np.abs(curve(4.5, nu=3) - curve(4.5 - 1e-9, nu=3)).max() < 1e-6


def test_products_batches_and_own_times():
    space = ss.Product("so:3", "r:3")
    times = np.stack([KNOTS, 2 * KNOTS + 1])
    points = points_on(space, 6, (2,), step=0.4)
    curves = ss.CubicSpline(times, points, space)
    x = np.stack([X, 2 * X + 1])
    found = curves(x, nu=3, per_curve=True)
    for i in range(2):
        assert largest_difference(each(lambda a, i=i: a[i], found), curves[i](x[i], nu=3)) < 1e-12
        for k, factor in enumerate(space.factors):
            own = ss.CubicSpline(times[i], points[k][i], factor)
            assert np.abs(found[k][i] - own(x[i], nu=3)).max() < 1e-12
    # The same times for all curves.
    shared = curves([1.5, 3.0], nu=3)
    assert [own.shape for own in shared] == [(2, 2, 3, 3), (2, 2, 3)]
    assert largest_difference(each(lambda a: a[1], shared), curves[1]([1.5, 3.0], nu=3)) < 1e-12
    assert [own.dtype.name for own in curves(2.0, nu=3, dtype="float32")] == ["float32"] * 2
    out = each(np.empty_like, shared)
    assert curves([1.5, 3.0], nu=3, out=out) is out
    assert largest_difference(out, shared) == 0
    raises("out has shape", curves, [1.5], nu=3, out=out)


def test_outside_the_knots_of_the_jerk():
    points = points_on(S2, 6, step=0.4)
    curve = ss.CubicSpline(KNOTS, points, S2)
    raises("outside", curve, 5.0, nu=3)
    assert np.abs(curve([-0.5, 5.0], nu=3, extrapolate="geodesic")).max() < 1e-10
    assert np.isnan(curve(5.0, nu=3, extrapolate=False)).all()
    beyond = np.array([-0.2, 4.7])
    for x in beyond:
        own = curve([x], nu=3, extrapolate=True)
        step = 1e-3
        at = [curve([x + sign * step], nu=nu, extrapolate=True) for sign in (1, -1) for nu in (0, 2)]
        here = curve([x], extrapolate=True)
        ahead, behind = moved(S2, at[0], here, at[1]), moved(S2, at[2], here, at[3])
        assert np.abs((ahead - behind) / (2 * step) - own).max() < 1e-3
    closed = ss.CubicSpline(None, [*THREE, THREE[0]], S2, bc_type="periodic")
    assert np.abs(closed(4.25, nu=3) - closed(1.25, nu=3)).max() < 1e-10
    assert np.abs(closed(-0.25, nu=3) - closed(2.75, nu=3)).max() < 1e-10


@pytest.mark.parametrize("dated", [False, True])
def test_other_curves(dated):
    t = np.datetime64("2024-05-01") + (1e3 * KNOTS).astype("m8[ms]") if dated else KNOTS
    points = points_on(S2, 6, step=0.4)
    x = t[0] + np.timedelta64(1200, "ms") if dated else 1.2
    geodesics, local = ss.PiecewiseGeodesic(t, points, S2), ss.HermiteSpline.from_points(t, points, S2)
    assert np.abs(geodesics(x, nu=3)).max() < 1e-10
    plain = ss.HermiteSpline.from_points(KNOTS, points, S2)
    assert np.abs(local(x, nu=3) - differences(plain, np.array([1.2]))[0]).max() < 1e-9
    assert all(np.isfinite(own).all() for own in parts(local(t, nu=3)))
