"""Logs that are faster than their sensor and repeat its last point."""

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline import measure

# Copies are correlated noise, which the audit of residuals finds, too.
pytestmark = pytest.mark.filterwarnings("ignore:.*residuals:symspline.SmoothingWarning")

HELD = "exact copies of the point before"


def rotations(t, seed=0):
    own = np.random.default_rng(seed)
    return Rotation.from_rotvec(0.5 * np.sin(t[:, None] * [1, 1.3, 0.7]) + 0.01 * own.standard_normal((len(t), 3)))


def held(repeats, n=120, seed=0):
    """Times from 1000 on, and rotations, each repeated as often as the entries of `repeats` specify in turn."""
    fresh = np.cumsum(np.resize(repeats, n)) - repeats[0]
    t = 1000 + 0.01 * np.arange(fresh[-1] + 1)
    which = np.searchsorted(fresh, np.arange(len(t)), side="right") - 1
    return t, rotations(0.01 * fresh, seed)[which].as_matrix()


@pytest.mark.parametrize("repeats", [[2], [4], [2, 3, 4], [1, 1, 2], [2, 3]])
def test_copies_warn_everywhere(repeats):
    t, points = held(repeats)
    with pytest.warns(ss.SmoothingWarning, match=HELD) as caught:
        ss.make_smoothing_spline(t, points, "so:3", 1e-5)
    assert f"points[{caught[0].message.node}]" in str(caught[0].message)
    with pytest.warns(UserWarning, match=HELD):
        ss.CubicSpline(t, points, "so:3")
    for smooth in (False, True):
        with pytest.warns(UserWarning, match=HELD) as caught:
            ss.fit_segments(t, points, "so:3", max_gap=1, smooth=smooth)
        assert sum(HELD in str(one.message) for one in caught) == 1
    with pytest.warns(ss.SmoothingWarning, match=HELD) as caught:
        ss.estimate([measure.Points(t, points, sigma=0.01)], 20, "so:3", lam=1e-5)
    assert sum(HELD in str(one.message) for one in caught) == 1


def test_advice_of_the_message():
    t, points = held([3])
    new = np.append(True, np.any(points[1:] != points[:-1], axis=(1, 2)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        s = ss.make_smoothing_spline(t[new], points[new], "so:3")
    # The noise that was added.
    assert abs(s.sigma / 0.01 - 1) < 0.2


def test_batch_and_product():
    t, points = held([2])
    moving = rotations(t - 1000).as_matrix()
    with pytest.warns(UserWarning, match=r"% of the points of curve 1 are exact") as caught:
        ss.CubicSpline(t, np.stack([moving, points]), "so:3")
    assert caught[0].message.curve == (1,)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Another factor moves between the copies.
        ss.CubicSpline(t, (points, t[:, None]), "so:3 x r:1")


@pytest.mark.parametrize("kind", ["moving", "at rest", "low resolution", "few"])
def test_other_data_do_not_warn(kind):
    own = np.random.default_rng(1)
    t = np.cumsum(own.uniform(0.5, 1.5, 300)) / 100
    y = np.sin(2 * t) + 0.01 * own.standard_normal(300)
    if kind == "at rest":
        y[40:200] = y[40]
    if kind == "low resolution":
        y = np.round(20 * y) / 20
    if kind == "few":
        y[100:110] = np.repeat(y[100:105], 2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ss.CubicSpline(t, y[:, None], "r:1")
