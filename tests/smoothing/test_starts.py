"""Smoothing from several starts: directions with much noise, and bodies that turn far between two samples."""

import warnings

import numpy as np
import pytest

import symspline as ss


def wrapped(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def test_directions_with_much_noise_have_the_least_objective_that_is_known():
    """The other curve is a critical point for the same λ: angles that are unrolled along it, smoothed linearly."""
    for seed in (3, 8, 11, 19, 23):
        rng = np.random.default_rng(seed)
        t = 100 + np.sort(rng.uniform(0, 10, 120))
        truth = 2 * np.sin(0.7 * t) + 0.5 * t
        y = truth + 0.8 * rng.standard_normal(120)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ss.SmoothingWarning)
            spline = ss.make_smoothing_spline(t, y[:, None], "torus:1")
        curve = truth
        for _ in range(15):
            line = ss.make_smoothing_spline(t, (curve + wrapped(y - curve))[:, None], "r:1", lam=spline.lam)
            curve = line(t)[:, 0]

        def objective(values, one, lam=spline.lam, y=y):
            return np.sum(wrapped(y - values) ** 2) + lam * one.bending_energy()

        assert objective(spline(t)[:, 0], spline) < objective(curve, line) * (1 + 1e-4)


@pytest.mark.parametrize("name", ["sphere:2", "rp:2", "gr:1,3", "torus:2"])
def test_noise_that_hides_the_turns_is_reported(name):
    space, rng = ss.space(name), np.random.default_rng(2)
    points = space.random_point(rng, (30,))
    with pytest.warns(
        ss.SmoothingWarning, match="so large a part of the distance|nearly equally well|turn by more than half"
    ):
        warnings.filterwarnings("ignore", "half of the data|more than half of the steps")
        ss.make_smoothing_spline(None, points, space, 100.0)


def test_one_doubtful_curve_of_a_batch_changes_no_other():
    rng, t = np.random.default_rng(1), np.linspace(0, 10, 100)
    angles = np.sin(t) + np.array([0.1, 0.75])[:, None] * rng.standard_normal((2, 100))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SmoothingWarning)
        both = ss.make_smoothing_spline(t, angles[..., None], "torus:1")
        for i in range(2):
            alone = ss.make_smoothing_spline(t, angles[i][:, None], "torus:1")
            assert np.abs(wrapped(both[i](t) - alone(t))).max() < 1e-9
            assert both.report.df[i] == pytest.approx(alone.report.df)
