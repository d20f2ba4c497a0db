"""Robust losses where few data deviate: outliers, alone and in runs, and noise far below what the sampling shows."""

import warnings

import numpy as np
import pytest
from tests.trust import robust

import symspline as ss
from symspline import _core

START = 7200.5


def path(space, t):
    """A smooth path over ten seconds."""
    u = np.asarray(t) - START
    v = np.stack([np.sin(u), np.cos(0.7 * u), 0.4 * np.sin(1.3 * u)], axis=-1)
    if space == ss.space("so:3"):
        return ss.rotations.from_rotation_vectors(v)
    if space == ss.space("sphere:2"):
        return space.exp(np.broadcast_to([0.0, 0.0, 1.0], v.shape), v * [1, 1, 0])
    return 20 * v


def recording(name, noise, first=(), length=1, seed=0, count=200):
    """Times, data and which of them are outliers: runs of a length that are displaced together."""
    rng, space = np.random.default_rng(seed), ss.space(name)
    t = START + np.sort(rng.uniform(0, 10, count))
    points = path(space, t)
    points = space.exp(points, noise * space.random_tangent(rng, points))
    bad = np.zeros(count, bool)
    for i in first:
        own = slice(i, i + length)
        v = space.random_tangent(rng, points[i])
        v *= (30 if name == "r:3" else 1.2) / space.norm(points[i], v)
        same = np.broadcast_to(points[i], points[own].shape)
        moved = v if length == 1 else space.transport(same, points[own], np.broadcast_to(v, same.shape))
        points[own] = space.exp(points[own], moved)
        bad[own] = True
    return space, t, points, bad


def largest(space, spline, t):
    """The largest error between the outermost data."""
    x = np.linspace(t[4], t[-5], 500)
    return space.distance(spline(x), path(space, x)).max()


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
@pytest.mark.parametrize(
    ("name", "noise", "first", "length"),
    [("so:3", 1e-8, range(9, 190, 11), 1), ("sphere:2", 1e-6, (40, 120), 8), ("r:3", 2e-2, (40, 120), 8)],
)
def test_outliers_cost_nothing_where_noise_is_small(name, loss, noise, first, length):
    space, t, points, bad = recording(name, noise, first, length)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SmoothingWarning)
        robust = ss.make_smoothing_spline(t, points, space, loss=loss)
        # Cross-validation does not choose curves that follow such precise data.
        clean = ss.make_smoothing_spline(t[~bad], points[~bad], space, criterion="reml")
    # With Huber's loss, the influence of every outlier is limited to the corner, a fraction of the noise.
    most = 3.5 if loss == "huber" and noise > 1e-3 else 1.6
    assert largest(space, robust, t) < most * largest(space, clean, t)


def test_a_curve_through_nearly_all_data_warns_once():
    space, t, points, bad = recording("r:3", 1e-8, (30, 60, 90))
    with pytest.warns(ss.SmoothingWarning) as caught:
        ss.make_smoothing_spline(t, points, space, loss="cauchy")
    assert len(caught) == 1
    assert "It rejected 3 data" in str(caught[0].message) and "Pass sigma=" in str(caught[0].message)
    # With a given noise level, no warning is needed.
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        spline = ss.make_smoothing_spline(t, points, space, sigma=1e-8, criterion="reml", lam=1e-16, loss="cauchy")
    assert np.all(space.distance(spline(t[bad]), points[bad]) > 1)


def test_a_recording_that_rests_and_moves_keeps_its_motion():
    rng, t = np.random.default_rng(3), np.arange(300) * 0.01
    moving = np.clip(t - 1.5, 0, None)
    truth = np.stack([np.sin(2 * moving) ** 2, 5 * moving**3, 0 * t], axis=-1)
    points = truth + 1e-3 * rng.standard_normal(truth.shape)
    points[[40, 41, 200, 250]] += 3
    spline = ss.make_smoothing_spline(t, points, "r:3", loss="cauchy")
    error = np.linalg.norm(spline(t) - truth, axis=-1)
    # Natural ends cannot follow the acceleration at the end, as under least squares.
    assert error[:-5].max() < 2.5e-3 and error.max() < 7e-3


def test_parts_of_a_product_reject_data_of_their_own():
    so3, t, turns, _ = recording("so:3", 0.01, (50, 90))
    r3, _, places, bad = recording("r:3", 0.5, (20, 120))
    both = ss.make_smoothing_spline(t, (turns, places), "so:3 x r:3", loss="cauchy")
    alone = [ss.make_smoothing_spline(t, own, name, loss="cauchy") for own, name in ((turns, "so:3"), (places, "r:3"))]
    for space, own, one in zip((so3, r3), both(t), alone, strict=True):
        assert space.distance(own, one(t)).max() < 1e-9
    batch = ss.make_smoothing_spline(t, np.stack([places, places[::-1]]), "r:3", loss="cauchy")
    np.testing.assert_allclose(batch[0](t), alone[1](t), atol=1e-9)
    weights = np.where(bad, 0.0, 1.0)
    told = ss.make_smoothing_spline(t, places, "r:3", weights=weights)
    assert r3.distance(alone[1](t), told(t)).max() < 0.5


def test_rounded_data_that_mostly_repeat_are_not_outliers():
    rng, t = np.random.default_rng(0), np.arange(200.0)
    level = np.round(0.3 * rng.standard_normal(200))
    level[70] = 40
    assert np.mean(level == 0) > 0.8
    spline = ss.make_smoothing_spline(t, level[:, None], "r:1", loss="cauchy")
    assert np.abs(spline(t)).max() < 1
    with pytest.warns(ss.SmoothingWarning, match="noise is smaller than their sampling can show"):
        spline = ss.make_smoothing_spline(t, np.where(t == 70, 40.0, 2.0)[:, None], "r:1", loss="cauchy")
    assert np.abs(spline(t) - 2).max() < 1e-9


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_a_burst_that_a_robust_loss_rejects(loss):
    """Consecutive data that deviate may be a motion; isolated ones are outliers."""
    rng = np.random.default_rng(7)
    t = 100 + np.sort(rng.uniform(0, 20, 400))
    y = np.stack([np.sin(t / 3), np.cos(t / 4)], axis=-1) + 0.02 * rng.standard_normal((400, 2))
    isolated = y.copy()
    isolated[::10] += 1.5
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ss.make_smoothing_spline(t, isolated, "r:2", loss=loss)
    burst = y.copy()
    burst[200:215] += [1.0, -0.5]
    with pytest.warns(ss.SmoothingWarning, match=r"the loss rejects all data from index 200 to 214.*loss='linear'"):
        ss.make_smoothing_spline(t, burst, "r:2", loss=loss)


@pytest.mark.parametrize("even", [False, True])
@pytest.mark.parametrize("name", ["r:3", "so:3", "sphere:2"])
def test_runs_that_the_path_could_reach_are_rejected(name, even):
    # The steps at the ends of the runs are at most six times those of the path, as in a fast part of it.
    space, rng, n = ss.space(name), np.random.default_rng(3), 100
    t = START + (np.linspace(0, 10, n) if even else np.sort(rng.uniform(0, 10, n)))
    points = path(space, t)
    points = space.exp(points, 1e-7 * space.random_tangent(rng, points))
    bad = np.zeros(n, bool)
    for first, length in ((20, 10), (52, 5), (80, 8)):
        own = slice(first, first + length)
        v = space.random_tangent(rng, points[first])
        v *= (12 if name == "r:3" else 0.6) / space.norm(points[first], v)
        same = np.broadcast_to(points[first], points[own].shape)
        points[own] = space.exp(points[own], space.transport(same, points[own], np.broadcast_to(v, same.shape)))
        bad[own] = True
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SmoothingWarning)
        robust = ss.make_smoothing_spline(t, points, space, loss="cauchy")
        clean = ss.make_smoothing_spline(t[~bad], points[~bad], space, criterion="reml")
    assert largest(space, robust, t) < 1.5 * largest(space, clean, t)


@pytest.mark.parametrize("name", ["r:3", "so:3"])
def test_an_outlier_in_a_gap_moves_the_curve_under_huber(name):
    """Huber's loss bounds the force of an outlier, but in a gap nothing else holds the curve."""
    space, rng = ss.space(name), np.random.default_rng(1)
    t = START + np.sort(rng.uniform(0, 10, 300))
    t = np.sort(np.append(t[np.abs(t - START - 5) > 1], START + 5))
    points = path(space, t) if name == "so:3" else path(space, t) / 20
    points = space.exp(points, 0.005 * space.random_tangent(rng, points))
    alone = int(np.searchsorted(t, START + 5))
    points[alone] = space.exp(points[alone], 0.8 * space.random_tangent(rng, points[alone]))
    with pytest.warns(ss.SmoothingWarning, match="has an outlier that moves the curve.*cauchy"):
        ss.make_smoothing_spline(t, points, space, loss="huber")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ss.make_smoothing_spline(t, points, space, loss="cauchy")
        ss.make_smoothing_spline(np.delete(t, alone), np.delete(points, alone, axis=0), space, loss="huber")


@pytest.mark.parametrize("name", ["r:3", "so:3", "sphere:2"])
def test_data_beside_a_part_that_a_curve_follows(name):
    """A smooth curve that follows a run of displaced data leaves good data on both sides of it."""
    space, t, points, _ = recording(name, 0.02, first=[70], length=10, count=160, seed=4)
    truth, weights = path(space, t), np.ones(160)

    def part(at):
        data = [np.ascontiguousarray(own)[None] for own in (t, at, points, weights)]
        rows, unknown = space.distance(at, points)[None, :, None], np.full((1, len(t)), np.nan)
        found = _core.examine_curves(space._handle, data, rows, unknown, np.zeros(1), np.array([0.02]), 6.0)
        return found[0][1] if found else None

    # The curve goes from the truth to the displaced data and back within some data on both sides.
    share = np.interp(np.arange(160), [66, 72, 77, 83], [0, 1, 1, 0])
    shift = space.log(truth[75:76], points[75:76])
    v = space.transport(np.broadcast_to(truth[75], truth.shape), truth, np.broadcast_to(shift, truth.shape))
    follows = space.exp(truth, share.reshape(-1, *[1] * (v.ndim - 1)) * v)
    first, last = part(follows)
    assert 68 <= first <= 73 and 76 <= last <= 81
    # The true curve is near the data on both sides, and outliers are not near any curve.
    assert part(truth) is None
    points[[40, 43, 44, 120, 121, 124]] = points[[140, 143, 20, 20, 21, 24]]
    assert part(truth) is None


def test_a_run_that_the_curve_follows():
    space, t, points, bad, _ = ss.space("so:3"), *robust.recording("so:3", 2443)
    with pytest.warns(ss.SmoothingWarning, match="rejects data on both sides of the part from index 50 to 54"):
        ss.make_smoothing_spline(t, points, space, loss="cauchy")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ss.make_smoothing_spline(t[~bad], points[~bad], space, loss="cauchy")
