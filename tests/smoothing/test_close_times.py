"""Data at nearly equal times: the result is that of their mean, with the sum of their weights."""

import numpy as np
import pytest

import symspline as ss
from symspline import measure

# The standard deviations here are arbitrary, which the audit of residuals reports.
pytestmark = pytest.mark.filterwarnings("ignore:The residuals:symspline.SmoothingWarning")

CRITERIA = [{"criterion": "gcv"}, {"criterion": "reml"}, {"criterion": "cp", "sigma": 0.01}]


def recording(seed, close, line, start=100.0):
    """Times, points, and the same with the four data at nearly equal times merged."""
    rng = np.random.default_rng(seed)
    n = int(rng.choice([9, 37, 77]))
    merged = start + np.sort(rng.uniform(0, 10, n))
    i = n // 2
    t = np.insert(merged, i + 1, merged[i] + close * np.array([1, 2, 5]))

    def motion(t):
        return np.stack([t / 10, t / 5], -1) if line else np.stack([np.sin(t), np.cos(1.5 * t)], -1)

    noise = 0.01 * rng.standard_normal((n + 3, 2))
    weights = np.ones(n)
    weights[i] = 4
    mean = np.delete(noise, [i + 1, i + 2, i + 3], axis=0)
    mean[i] = noise[i : i + 4].mean(axis=0)
    return t, motion(t) + noise, merged, motion(merged) + mean, weights


def assert_same(close, merged, t):
    x = np.linspace(t[0], t[-1], 60)
    for one, other in zip(*(np.atleast_2d(own.std(x, calibrated=False)) for own in (close, merged)), strict=True):
        np.testing.assert_allclose(one, other, rtol=0.05)
    apart = close.space.distance(close(x), merged(x))
    assert np.all(apart < 0.05 * merged.std(x, calibrated=False))


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
@pytest.mark.parametrize("options", CRITERIA, ids=["gcv", "reml", "cp"])
@pytest.mark.parametrize("penalty", ["acceleration", "jerk"])
@pytest.mark.parametrize("line", [True, False])
@pytest.mark.parametrize("close", [1e-4, 1e-7, 1e-11])
def test_close_times_are_like_one_time(options, penalty, line, close):
    for seed in range(3):
        t, y, merged, mean, weights = recording(seed, close, line)
        own = ss.make_smoothing_spline(t, y, "r:2", penalty=penalty, **options)
        # The noise that the four data show is not part of their mean, so that λ and σ are given.
        other = ss.make_smoothing_spline(
            merged, mean, "r:2", own.lam, weights=weights, penalty=penalty, sigma=own.sigma
        )
        assert_same(own, other, t)


@pytest.mark.parametrize("penalty", ["acceleration", "jerk"])
def test_batch_with_own_times(penalty):
    parts = [recording(seed, close, False, start) for seed, close, start in ((1, 1e-9, 0.0), (7, 1e-5, 50.0))]
    count = min(len(part[0]) for part in parts)
    t, y = (np.stack([part[k][:count] for part in parts]) for k in (0, 1))
    batch = ss.make_smoothing_spline(t, y, "r:2", 1e-4, penalty=penalty, sigma=0.01)
    for i in range(2):
        alone = ss.make_smoothing_spline(t[i], y[i], "r:2", 1e-4, penalty=penalty, sigma=0.01)
        # Segments of a cubic with little jerk are stiffer than the data require, and those of the batch are shorter.
        x = np.linspace(t[i, 0], t[i, -1], 60)
        limit = 0.05 if penalty == "acceleration" else 1.0
        assert np.all(np.linalg.norm(batch[i](x) - alone(x), axis=-1) < limit * alone.std(x))


def test_least_squares_and_estimation():
    t, y, merged, mean, weights = recording(2, 1e-9, False)
    own = ss.make_lsq_spline(t, y, 7, "r:2", sigma=0.01)
    assert_same(own, ss.make_lsq_spline(merged, mean, own.t, "r:2", weights=weights, sigma=0.01), t)
    knots = np.linspace(t[0], t[-1], 25)
    measured = ss.estimate([measure.Points(t, y, sigma=np.full(len(t), 0.01))], knots, "r:2", lam=1e-3)
    x = np.linspace(t[0], t[-1], 60)
    once = ss.estimate([measure.Points(merged, mean, sigma=0.01 / np.sqrt(weights))], knots, "r:2", lam=1e-3)
    assert np.all(np.abs(measured(x) - once(x)) < 0.05 * measured.std(x)[..., None])
