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


@pytest.mark.parametrize("degrees", [126, 170])
def test_bodies_that_turn_far_between_data(degrees):
    rng, t = np.random.default_rng(degrees), 5 + 0.01 * np.arange(80)
    axis = np.array([0.2, 0.3, 1.0]) / np.linalg.norm([0.2, 0.3, 1.0])
    around, so3 = ss.rotations.from_rotation_vectors, ss.SpecialOrthogonal(3)
    truth = around(np.outer(np.radians(degrees) * np.arange(80), axis))
    noisy = so3.exp(truth, 0.01 * so3.random_tangent(rng, truth))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        spline = ss.make_smoothing_spline(t, noisy, so3)
    assert so3.distance(spline(t), truth).max() < 0.03
    assert spline.sigma == pytest.approx(0.01, rel=0.2)
    # The truth is a geodesic.
    known = ("half of the steps are long", "correct for data along a geodesic")
    assert all(any(words in str(one.message) for words in known) for one in caught)


def test_weights_are_not_noise():
    rng, t = np.random.default_rng(0), np.linspace(0, 5, 60)
    y = np.sin(t) + 0.01 * rng.standard_normal(60)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        spline = ss.make_smoothing_spline(t, y[:, None], "torus:1", weights=np.full(60, 1e4))
    assert spline.sigma == pytest.approx(1, rel=0.3)


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
