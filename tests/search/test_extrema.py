"""Extrema and crossings, against SciPy's piecewise polynomials, closed forms and dense samples."""

import numpy as np
import pytest
from curves import points_on
from refused import raises
from scipy.interpolate import CubicSpline

import symspline as ss


def uneven(n, seed=0):
    t = np.cumsum(np.random.default_rng(seed).uniform(0.3, 1.5, n))
    t[n // 2 :] += 2.0
    return t


@pytest.mark.parametrize("seed", range(3))
def test_roots_and_extrema_of_polynomials(seed):
    t = uneven(30, seed)
    y = np.random.default_rng(seed).normal(size=30)
    ours, scipy = ss.CubicSpline(t, y[:, None], "r:1"), CubicSpline(t, y, bc_type="natural")

    def height(x):
        return ours(x)[..., 0]

    np.testing.assert_allclose(ours.solve(height, 0.3), scipy.solve(0.3, extrapolate=False), rtol=1e-12)
    # A root at an end of the domain counts.
    assert ours.solve(height, y[0])[0] == t[0]
    turns = np.sort(scipy.derivative().roots(extrapolate=False))
    maxima, minima = (ours.extrema(height, kind=kind) for kind in ("max", "min"))
    inner = np.sort(np.concatenate([x[(x > t[0]) & (x < t[-1])] for x in (maxima[0], minima[0])]))
    np.testing.assert_allclose(inner, turns, rtol=1e-9)
    np.testing.assert_allclose(maxima[1], scipy(maxima[0]), atol=1e-12)
    assert (scipy(maxima[0][1:-1], 2) <= 1e-9).all() and (scipy(minima[0][1:-1], 2) >= -1e-9).all()
    # Beside the kinks of a distance, which are no knots, there are no maxima: they are turns away from the level.
    times, _ = ours.extrema(lambda x: np.abs(height(x) - 0.3))
    outward = turns[(scipy(turns) - 0.3) * scipy(turns, 2) < 0]
    np.testing.assert_allclose(times[(times > t[0]) & (times < t[-1])], outward, rtol=1e-9)
    # The norm of the acceleration has a kink at the knots. Its maxima are there.
    times, values = ours.extrema("acceleration")
    assert np.abs(times[:, None] - t).min(axis=1).max() < 1e-9
    np.testing.assert_allclose(values, np.abs(scipy(times, 2)), atol=1e-9)
    # Its minima are the zeros of the second derivative.
    zeros = scipy.derivative(2).roots(extrapolate=False)
    times, values = ours.extrema("acceleration", kind="min")
    assert np.abs(times[:, None] - zeros).min(axis=0).max() < 1e-9 and values.min() < 1e-8


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "h:2", "spd:2", "so:3 x r:3", "se:3"])
@pytest.mark.parametrize("quantity", ["speed", "acceleration"])
def test_on_spaces(name, quantity):
    space = ss.space(name)
    curve = ss.CubicSpline(uneven(12), points_on(space, 12, step=0.4), space)
    x = np.linspace(*curve.domain, 200_001)
    dense = curve.speed(x) if quantity == "speed" else space.norm(curve(x), curve(x, nu=2))
    for kind, sign in (("max", 1), ("min", -1)):
        times, values = curve.extrema(quantity, kind=kind)
        samples = sign * dense
        local = np.flatnonzero((samples[1:-1] > samples[:-2]) & (samples[1:-1] > samples[2:])) + 1
        assert np.abs(times[:, None] - x[local]).min(axis=0).max() < 1e-3
        assert (sign * values).max() >= samples.max() - 1e-9
        assert len(times) <= len(local) + 2
    level = 1.0001 * np.median(dense)
    crossed = np.flatnonzero(np.diff(np.sign(dense - level)))
    np.testing.assert_allclose(curve.solve(quantity, level), x[crossed], atol=2 * (x[1] - x[0]))


def test_constant_speed_and_jumps():
    geodesic = ss.CubicSpline([0.0, 2.0], [[1, 0, 0], [0, 1, 0]], "sphere:2")
    times, speeds = geodesic.extrema()
    assert times.tolist() == [0.0, 2.0] and np.ptp(speeds) < 1e-12
    assert len(geodesic.solve("speed", 3.0)) == 0
    steps = ss.PiecewiseGeodesic([0.0, 1.0, 3.0], [[0.0], [2.0], [3.0]], "r:1")
    np.testing.assert_allclose(steps.solve("speed", 1.0), [1.0], atol=1e-12)
    # A constant part at the value is one crossing.
    line = ss.CubicSpline([1, 2, 3, 4], [[1.0], [2.0], [3.0], [4.0]], "r:1")
    (time,) = line.solve(lambda x: np.where(x < 2, x - 2, np.where(x > 3, x - 3, 0.0)))
    assert 2 <= time <= 3


def test_dates_of_extrema():
    t = np.datetime64("2026-03-01T12:00") + np.arange(3) * np.timedelta64(1, "h")
    curve = ss.CubicSpline(t, [[0.0], [1.0], [0.0]], "r:1")
    times, values = curve.extrema(lambda x: curve(x)[..., 0])
    assert abs(times - t[1]) <= np.timedelta64(1000, "ns") and abs(values - 1).max() < 1e-12


def test_bezier_curves():
    curve = ss.BezierCurve([[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]], "r:2")
    times, values = curve.extrema(lambda x: curve(x)[..., 1])
    np.testing.assert_allclose([times, values], [[0.5], [1.0]], atol=1e-12)
    np.testing.assert_allclose(curve.solve(lambda x: curve(x)[..., 1], 0.75), [0.25, 0.75], atol=1e-12)


def test_invalid_input_of_extrema_raises():
    curve = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1")
    raises("kind must be 'max' or 'min'", curve.extrema, kind="both")
    raises("function must be 'speed'", curve.extrema, "jerk")
    raises("function must return one real number per time", curve.extrema, curve)
    raises("function must return finite numbers", curve.solve, lambda x: x + np.nan)
    raises("value must be a finite number", curve.solve, "speed", np.inf)
    batch = ss.CubicSpline(None, np.zeros((2, 3, 1)), "r:1")
    raises("is a batch", batch.extrema)
