"""The interface of smoothing splines: input, output, warnings and errors."""

import dataclasses

import numpy as np
import pytest
from noisy import example
from refused import raises

import symspline as ss
from symspline import _core

S2, T, NOISY, _ = example("sphere:2", 0.05, n=40)


def test_dates_of_smoothing_splines():
    dates = np.datetime64("2024-03-01") + (T * 60).astype("timedelta64[s]")
    spline = ss.make_smoothing_spline(dates, NOISY, S2)
    seconds = (dates - dates[0]) / np.timedelta64(1, "s")
    plain = ss.make_smoothing_spline(seconds, NOISY, S2)
    assert np.array_equal(spline.t, dates) and np.array_equal(spline(dates), plain(seconds))
    assert spline.std(dates[3]) == plain.std(seconds[3]) and spline.lam == plain.lam
    knots = ss.make_smoothing_spline(dates, NOISY, S2, knots=dates[::3])
    assert np.array_equal(knots.t, dates[::3])


def test_is_a_cubic_spline():
    spline = ss.make_smoothing_spline(T, NOISY, S2)
    assert isinstance(spline, ss.CubicSpline)
    through = ss.CubicSpline(spline.t, spline.points, S2)
    x = np.linspace(0, 10, 33)
    for nu in range(3):
        assert np.array_equal(spline(x, nu), through(x, nu))
    assert spline.length() == through.length() and spline.bc_type == "natural"
    assert np.array_equal(spline.lift(x), through.lift(x))
    t, points = spline.data
    assert np.array_equal(t, T) and np.allclose(points, NOISY)
    assert "40 data" in repr(spline) and "degrees of freedom" in str(spline.report)


def test_progress_is_shown():
    seen = []
    ss.make_smoothing_spline(T, NOISY, S2, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (40, 40)


def test_curves_of_a_batch_may_have_times_of_their_own():
    own = np.stack([T, 2 * T])
    batch = ss.make_smoothing_spline(own, np.stack([NOISY, NOISY]), S2, [0.1, 0.8])
    assert np.array_equal(batch.t, own)
    assert S2.distance(batch[0].points, batch[1].points).max() < 1e-12
    assert batch.std(own, nu=0, calibrated=False).shape == (2, 2, 40)


def test_failed_curves_are_reported_and_kept():
    with pytest.raises(ss.ConvergenceError, match="Raise max_iter") as caught:
        ss.make_smoothing_spline(T, NOISY, S2, max_iter=1)
    assert not caught.value.spline.report.converged
    with pytest.warns(ss.ConvergenceWarning):
        spline = ss.make_smoothing_spline(T, NOISY, S2, max_iter=1, on_failure="warn")
    assert "NOT converged" in str(spline.report)


def test_a_lambda_at_its_bound_warns():
    """White noise has no curve: the smoothest one is chosen. With much too small a noise level the data are met."""
    noise = np.random.default_rng(1).standard_normal((40, 1))
    with pytest.warns(ss.SmoothingWarning, match=r"The smoothing chose the largest lam.*\(2\.0\d degrees"):
        stiff = ss.make_smoothing_spline(T, 0.3 * T[:, None] + noise, "r:1", criterion="reml")
    assert "at its bound: a geodesic" in str(stiff.report)
    with pytest.warns(ss.SmoothingWarning, match=r"follows nearly all data .* criterion='reml'"):
        rough = ss.make_smoothing_spline(T, noise, "r:1", criterion="cp", sigma=1e-6)
    assert rough.df > 39
    both = np.stack([noise, np.sin(T)[:, None] + 0.1 * np.random.default_rng(0).standard_normal((40, 1))])
    with pytest.warns(ss.SmoothingWarning, match=r"of curve 0 chose the largest lam"):
        ss.make_smoothing_spline(T, both, "r:1", criterion="reml")
    with pytest.warns(ss.SmoothingWarning, match=r"in factor 1, Euclidean\(1\) chose"):
        ss.make_smoothing_spline(T, (both[1], both[0]), "r:1 x r:1", criterion="reml")
    # A λ that was given is nobody's choice.
    ss.make_smoothing_spline(T, noise, "r:1", 1e12)
    for df, is_stiff in ((2.49, True), (2.51, False)):
        assert dataclasses.replace(stiff.report, df=df).is_stiff() == is_stiff


def test_invalid_input_of_smoothing_splines_raises():
    for change, message in [
        ({"t": T[::-1]}, r"t\[1\] = 9.7\d* is before t\[0\] = 10"),
        ({"t": 1e101 * T}, r"t spans more than 1e\+100, too much for smoothing"),
        ({"t": np.where(T > 5, np.nan, T)}, "is nan"),
        ({"t": np.zeros(40)}, "have one time only"),
        ({"lam": -1.0}, "lam must be >= 0, not -1.0"),
        ({"weights": -np.ones(40)}, r"weights\[0\] is -1.0"),
        ({"weights": np.ones(39)}, "weights has shape"),
        ({"weights": np.eye(1, 40)[0]}, "have one time only"),
        ({"knots": 1}, "knots must be at least 2"),
        ({"knots": "many"}, "knots must be None, a number"),
        ({"knots": np.eye(3)}, r"must have shape \(K,\)"),
        ({"knots": [0.0, 5.0]}, "from the first to the last time"),
        ({"knots": [0.0, 5.0, 5.0, 10.0]}, r"knots\[2\] is not after knots\[1\]"),
        ({"criterion": "aic"}, "criterion must be"),
        ({"criterion": 3}, "criterion must be a word, not 3"),
        ({"bc_type": "periodic", "knots": 3}, "A closed curve needs at least 4 knots"),
        ({"criterion": "cp"}, "Pass sigma"),
        ({"gamma": 0.9}, "gamma must be a number >= 1"),
        ({"loss": "l1"}, "loss must be"),
        ({"bc_type": "not-a-knot"}, "is not available for smoothing splines"),
        ({"bc_type": ((1, NOISY[0]), "natural")}, "tangent"),
        ({"method": "fast"}, "method must be"),
        ({"tol": 0.0}, "tol must be"),
        ({"max_iter": 0}, "max_iter must be at least 1"),
        ({"points": np.where(T[:, None] > 5, np.nan, NOISY)}, r"points\[20\]"),
    ]:
        arguments = {"t": T, "points": NOISY, "space": S2, **change}
        raises(message, ss.make_smoothing_spline, **arguments)


def test_band_and_deviation_check_their_arguments():
    spline = ss.make_smoothing_spline(T, NOISY, S2)
    assert spline.band(2.0, 0.5) < spline.band(2.0) == pytest.approx(np.sqrt(5.991464547) * spline.std(2.0))
    raises("nu must be 0 or 1", spline.std, 2.0, nu=2)
    raises("level must lie", spline.band, 2.0, 95)
    raises("make_smoothing_spline", ss.SmoothingSpline, error=TypeError)


@pytest.mark.filterwarnings("ignore:The residuals of the smoothing:symspline.SmoothingWarning")
@pytest.mark.parametrize("options", [{}, {"criterion": "reml"}, {"loss": "cauchy"}, {"criterion": "cp", "sigma": 0.1}])
def test_between_two_knots_there_is_the_nearest_geodesic(options):
    two = ss.make_smoothing_spline([3.0, 5e6], NOISY[:2], S2, **options)
    assert np.abs(two.points - NOISY[:2]).max() < 1e-12 and two.df == pytest.approx(2)
    own = np.array([[0.0, 1.0], [0.0, 9.0]])
    assert ss.make_smoothing_spline(own, np.stack([NOISY[:2]] * 2), S2, **options).points.shape == (2, 2, 3)
    y = np.array([[0.0], [0.1], [0.04], [1.0], [1.2], [1.1]])
    several = ss.make_smoothing_spline([0, 0, 0, 1, 1, 1], y, "r:1", **options)
    assert several.df == pytest.approx(2) and np.abs(several.points - [[0.05], [1.1]]).max() < 0.01
    if "sigma" not in options:
        assert several.sigma == pytest.approx(np.std(several.residuals) * np.sqrt(6 / 4), rel=0.1)
    if "loss" not in options:
        line = np.polyfit(T, NOISY, 1)
        straight = ss.make_smoothing_spline(T, NOISY, "r:3", knots=2, **options)
        assert np.abs(straight(T) - T[:, None] * line[0] - line[1]).max() < 1e-12


def test_data_and_weights_whose_squares_overflow_raise():
    for size in (1e-200, 1e200):
        with pytest.raises(ss.ConvergenceError):
            ss.make_smoothing_spline(T, size * np.random.default_rng(0).standard_normal((40, 2)), "r:2")
    with pytest.raises(ss.ConvergenceError, match=r"do not determine .* remove data with tiny weights"):
        ss.make_smoothing_spline(T, NOISY, S2, weights=np.r_[1e300, np.ones(39)])


@pytest.mark.filterwarnings("ignore:The noise of the data:symspline.SmoothingWarning")
@pytest.mark.filterwarnings("ignore:The data turn by more than half:symspline.SmoothingWarning")
@pytest.mark.filterwarnings("ignore:Two curves fit the data:symspline.SmoothingWarning")
def test_data_spread_over_the_whole_space_warn():
    space = ss.Sphere(2)
    points = space.random_point(np.random.default_rng(4), 200)
    with pytest.warns(UserWarning, match=r"half of the data are \d.* For random points of .* this distance is \d"):
        spline = ss.make_smoothing_spline(None, points, space, lam=1e6)
    # Of a batch the curve is named; weights of zero do not count.
    good = spline(np.full(200, 99.5))
    batch = np.array([good, points, points])
    with pytest.warns(UserWarning, match=r"data of curve 1 are .* \(and 1 more curves\)"):
        ss.make_smoothing_spline(None, batch, space, lam=1e6)
    mixed = np.concatenate([points, good])
    ss.make_smoothing_spline(None, mixed, space, lam=1e6, weights=np.repeat([0.0, 1.0], 200))


def test_the_same_knots_are_not_fitted_again(monkeypatch):
    """A long recording is thinned to 2000 knots, which are enough here."""
    n, calls = 4500, []
    smooth = _core.smooth
    monkeypatch.setattr(_core, "smooth", lambda *args: calls.append(len(np.ravel(args[1]))) or smooth(*args))
    t = np.linspace(0, 10, n)
    y = np.sin(t) + 0.1 * np.random.default_rng(0).standard_normal(n)
    ss.make_smoothing_spline(t, y[:, None], "r:1")
    assert calls.count(n) == 1


def test_a_rough_curve_of_a_long_recording_has_three_knots_per_degree_of_freedom():
    t = np.linspace(0, 10, 9000)
    y = np.sin(150 * t) + 0.1 * np.random.default_rng(0).standard_normal(len(t))
    spline = ss.make_smoothing_spline(t, y[:, None], "r:1")
    assert spline.df > 1000 and len(spline.t) > 3 * spline.df
