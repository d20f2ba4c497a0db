"""Recordings cut at gaps, and repeated times."""

import numpy as np
import pytest
from compare import each, factors, largest_difference, parts
from curves import every_kind, points_on
from refused import raises

import symspline as ss

T = np.array([0.0, 1, 2, 3, 15, 16, 17, 40, 60, 61])


@every_kind
def test_segments_are_fitted_independently(space):
    p = points_on(space, len(T), step=0.3)
    first, second, third = ss.fit_segments(T, p, space, max_gap=2, bc_type="not-a-knot")
    for piece, own in ((first, slice(0, 4)), (second, slice(4, 7)), (third, slice(8, 10))):
        alone = ss.CubicSpline(T[own], each(lambda a, own=own: a[own], p), space, bc_type="not-a-knot")
        assert piece == alone and piece.report == alone.report
    (first,) = ss.fit_segments(T, p, space, max_gap=2, min_points=4)
    assert len(first.t) == 4
    # Across the pauses some do not converge.
    options = {"max_iter": 60, "on_failure": "ignore"}
    (whole,) = ss.fit_segments(T, p, space, max_gap=23, **options)
    assert whole == ss.CubicSpline(T, p, space, **options)


@every_kind
def test_duplicate_times_keep_the_first_point_or_the_mean(space):
    p = points_on(space, 8, step=0.3)
    t = [0, 1, 1, 1, 2, 3, 3, 4]
    (found,) = ss.fit_segments(t, p, space, max_gap=9, duplicates="first")
    assert found == ss.CubicSpline(np.arange(5.0), each(lambda a: a[[0, 1, 4, 5, 7]], p), space)
    (found,) = ss.fit_segments(t, p, space, max_gap=9, duplicates="mean")
    for factor, given, means in zip(factors(space), parts(p), parts(found.points), strict=True):
        for i, own in ((1, slice(1, 4)), (3, slice(5, 7))):
            assert np.abs(factor.log(means[i], given[own]).sum(axis=0)).max() < 1e-14
        # The mean of two points is half way.
        middle = factor.geodesic(given[5], given[6], 0.5)
        assert factor.norm(middle, factor.log(middle, means[3])) < 5e-15
    single = each(lambda a: a[[0, 4, 7]], p)
    assert largest_difference(each(lambda a: a[[0, 2, 4]], found.points), single) < 1e-15


def test_times_close_together_are_not_one():
    (found,) = ss.fit_segments([0, 1e-12, 1], [[0], [1], [2]], "r:1", max_gap=2, duplicates="first")
    assert len(found.t) == 3


def test_dates_of_segments():
    t = np.datetime64("2024-01-01T00:00:00.000000001") + (1e9 * T).astype("m8[ns]")
    p = points_on(ss.Sphere(2), len(T))
    longest = [np.timedelta64(2, "s"), np.timedelta64(2000, "ms").item(), 2, 2.0, np.float32(2)]
    for gap in longest:
        pieces = ss.fit_segments(t, p, "sphere:2", max_gap=gap)
        assert [len(piece.t) for piece in pieces] == [4, 3, 2] and pieces[1].t[0] == t[4]


def test_invalid_arguments_of_segments_raise():
    for match, changes in [
        (r"t\[1\] and t\[2\] are both 1.0 \(and 1 more such pairs\). Pass duplicates='first'", {"t": [0, 1, 1, 1, 2]}),
        (r"t\[2\] = 0.5 is before t\[1\] = 1.0. Sort", {"t": [0, 1, 0.5, 2, 3]}),
        (r"t\[2\] is nan; times must be finite", {"t": [0, 1, np.nan, 2, 3]}),
        (r"t has shape \(4,\), but there are 5 points", {"t": range(4)}),
        (
            "no segment has 3 points: 4 of 4 time steps are longer than max_gap=0.5, and the median step is 1",
            {"max_gap": 0.5, "min_points": 3},
        ),
        ("max_gap must be more than 0, not 0", {"max_gap": 0}),
        ("max_gap is 1 seconds, but the times are numbers", {"max_gap": np.timedelta64(1, "s")}),
        (
            "max_gap is '1x', which is not a duration. Pass a number of seconds, a timedelta64, or a text",
            {"max_gap": "1x", "t": np.arange(5).astype("M8[s]")},
        ),
        ("min_points must be at least 2", {"min_points": 1}),
        ("'raise', 'first' or 'mean', not 'last'", {"duplicates": "last"}),
        ("batch axes", {"points": np.ones((2, 5, 1))}),
    ]:
        arguments = {"t": np.arange(5.0), "points": np.ones((5, 1)), "space": "r:1", "max_gap": 1.0} | changes
        raises(match, ss.fit_segments, **arguments)


def noisy(space, seed=0):
    """A recording of 60 points with a pause, each off by about 0.05."""
    t = np.r_[np.linspace(0, 3, 30), np.linspace(13, 16, 30)]
    rng = np.random.default_rng(seed)
    p = points_on(space, 8, step=0.2)
    smooth = ss.CubicSpline(np.linspace(0, 16, 8), p, space)(t)
    both = [
        factor.exp(part, 0.05 * factor.random_tangent(rng, part))
        for factor, part in zip(factors(space), parts(smooth), strict=True)
    ]
    return t, tuple(both) if isinstance(smooth, tuple) else both[0]


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
@pytest.mark.parametrize("name", ["r:2", "sphere:2", "so:3", "spd:3", "so:3 x r:3"])
def test_noisy_segments_are_smoothed_independently(name):
    space = ss.space(name)
    t, p = noisy(space)
    pieces = ss.fit_segments(t, p, space, max_gap=2, smooth=True, criterion="reml")
    assert len(pieces) == 2
    for piece, own in zip(pieces, (slice(0, 30), slice(30, 60)), strict=True):
        alone = ss.make_smoothing_spline(t[own], each(lambda a, own=own: a[own], p), space, criterion="reml")
        assert piece == alone and piece.report == alone.report
        for found, expected in ((piece.residuals, alone.residuals), (piece.band(t[own]), alone.band(t[own]))):
            assert all(map(np.array_equal, parts(found), parts(expected)))
        assert all(0.02 < sigma < 0.08 for sigma in np.atleast_1d(piece.sigma))


def test_weights_go_with_their_points_and_none_makes_a_pause():
    space = ss.space("sphere:2")
    t, p = noisy(space)
    weights = np.random.default_rng(1).uniform(1, 2, 60)
    weights[[3, *range(10, 20)]] = 0
    p[weights == 0] = np.nan
    pieces = ss.fit_segments(t, p, space, max_gap=0.5, smooth=True, weights=weights, lam=0.1)
    assert [len(piece.data[0]) for piece in pieces] == [9, 10, 30]
    for piece in pieces:
        own = np.isin(t, piece.data[0])
        assert piece == ss.make_smoothing_spline(t[own], p[own], space, 0.1, weights=weights[own])


def test_failed_noisy_segments_are_all_kept():
    t, p = noisy(ss.space("sphere:2"))
    with pytest.raises(ss.ConvergenceError, match=r"curve 0: .* Raise max_iter.*and 1 more") as caught:
        ss.fit_segments(t, p, "sphere:2", max_gap=2, smooth=True, max_iter=1)
    assert [len(piece.t) for piece in caught.value.spline] == [30, 30]
    with pytest.warns(ss.ConvergenceWarning, match="curve 0: "):
        ss.fit_segments(t, p, "sphere:2", max_gap=2, smooth=True, max_iter=1, on_failure="warn")
    assert len(ss.fit_segments(t, p, "sphere:2", max_gap=2, smooth=True, max_iter=1, on_failure="ignore")) == 2


def test_invalid_smoothing_options_raise():
    t, p = noisy(ss.space("sphere:2"))
    for options, says in [
        ({"smooth": "gcv"}, "smooth must be True or False, not 'gcv'. Pass lam, criterion"),
        ({"duplicates": "mean"}, "all points with equal times count"),
        ({"knots": [0.0, 1.0]}, "must be the number of knots of each segment"),
        ({"weights": [1.0]}, r"weights has shape \(1,\), but 60 points need \(60,\)"),
        ({"weights": np.zeros(60)}, "no segment has 2 points"),
        ({"criterion": "aic"}, "curve 0: "),
        ({"bc_type": "not-a-knot"}, "bc_type"),
    ]:
        with pytest.raises((ss.ValidationError, TypeError), match=says):
            ss.fit_segments(t, p, "sphere:2", **{"max_gap": 2, "smooth": True, **options})
