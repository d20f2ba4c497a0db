"""Warnings about motions and noise that vary along a recording."""

import re
import warnings

import numpy as np
import pytest

import symspline as ss
from symspline import _core
from symspline._smoothing.audit import varying

FASTER, NOISIER = "the motion is faster between", "the residuals are larger between"


def recording(kind, n, m, seed):
    """Irregular times within a minute, and noisy data with a burst of motion, a part with more noise, or neither."""
    rng = np.random.default_rng([seed, n, m])
    t = 500 + np.sort(rng.uniform(0, 60, n))
    phases = rng.uniform(0, 6, (2, m))
    y = np.sin(0.7 * t[:, None] + phases[0]) + 0.7 * np.sin(1.1 * t[:, None] + phases[1])
    sigma = np.full(n, 0.1)
    if kind == "burst":
        y *= 0.3
        y += (np.exp(-(((t - 535) / 2) ** 2)) * np.sin(7 * t))[:, None]
    if kind == "noise":
        sigma[(t > 520) & (t < 540)] *= 5
    return t, y + sigma[:, None] * rng.standard_normal((n, m)), sigma


def both_tests(times, squares, knots, energy, leverage, m):
    """Results of both tests for data with weight one."""
    return _core.are_constant(*(x[None] for x in (times, np.ones(400), leverage, squares, knots, energy)), m)[0]


def interval(message):
    return [float(x) for x in re.search(r"between t = (\S+) and (\S+?)[ ,]", message).groups()]


@pytest.mark.parametrize(("first", "last"), [(100, 149), (0, 49), (350, 399), (175, 199)])
def test_interval_of_a_fast_part_is_exact(first, last):
    # With a leverage of 1/4, bins of at least 6 degrees of freedom have 25 data: 100 degrees of freedom in 16 bins.
    index, rate = np.arange(400.0), np.ones(400)
    rate[first : last + 1] = 40
    edges = np.arange(401) - 0.5
    energy = np.append(0.0, np.cumsum(rate))
    constant = np.full(400, 0.25)
    message = varying(7 + index, both_tests(index, np.ones(400), edges, energy, constant, 3))
    assert FASTER in message
    assert interval(message) == [7 + first, 7 + last]


def test_interval_of_larger_residuals_is_exact():
    # 300 degrees of freedom of the residuals in 50 bins of 8 data.
    index, squares = np.arange(400.0), np.ones(400)
    squares[96:144] = 30
    edges = np.arange(401) - 0.5
    message = varying(7 + index, both_tests(index, squares, edges, 1.0 * np.arange(401), np.full(400, 0.25), 3))
    assert NOISIER in message
    assert interval(message) == [103, 150]


@pytest.mark.parametrize("m", [1, 3])
def test_a_burst_is_named(m):
    t, y, _ = recording("burst", 600, m, 1)
    with pytest.warns(ss.SmoothingWarning, match=FASTER) as caught:
        ss.make_smoothing_spline(t, y, f"r:{m}")
    assert len(caught) == 1
    first, last = interval(str(caught[0].message))
    assert 528 < first < 535 < last < 542


def test_varying_noise_is_named_and_weights_help():
    t, y, sigma = recording("noise", 600, 3, 2)
    with pytest.warns(ss.SmoothingWarning, match=NOISIER) as caught:
        ss.make_smoothing_spline(t, y, "r:3")
    first, last = interval(str(caught[0].message))
    assert 516 < first < 524 and 536 < last < 544
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ss.make_smoothing_spline(t, y, "r:3", weights=sigma**-2)


def test_products_and_batches_name_the_curve():
    t, steady, _ = recording("steady", 500, 2, 3)
    _, y, _ = recording("burst", 500, 2, 3)
    with pytest.warns(ss.SmoothingWarning, match=rf"of curve 1 \(and of curves 2\), {FASTER}") as caught:
        ss.make_smoothing_spline(t, np.stack([steady, y, y]), "r:2")
    assert caught[0].message.curve == (1,)
    with pytest.warns(ss.SmoothingWarning, match=rf"in factor 1, .*{FASTER}"):
        ss.make_smoothing_spline(t, (steady, y), "r:2 x r:2")


@pytest.mark.parametrize("name", ["r:3", "sphere:2", "so:3"])
def test_sound_recordings_do_not_warn(name):
    space = ss.space(name)
    base = {"sphere:2": np.array([0.0, 0.0, 1.0]), "so:3": np.eye(3)}.get(name, np.zeros(3))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for seed in range(4):
            t, y, _ = recording("steady", 300, space.dim, seed)
            points = space.exp(base, 0.2 * np.tensordot(y, space.frame(base), 1))
            ss.make_smoothing_spline(t, points, space)


def test_given_lam_is_not_tested():
    t, y, _ = recording("burst", 300, 1, 5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ss.make_smoothing_spline(t, y, "r:1", 1e-2)


def test_robust_losses_have_the_test_of_the_motion_only():
    # Noise that varies cannot be told from outliers.
    index, rate, squares = np.arange(400.0), np.ones(400), np.ones(400)
    rate[100:150], squares[96:144] = 40, 30
    energy, constant = np.append(0.0, np.cumsum(rate)), np.full(400, 0.25)
    both = both_tests(index, squares, np.arange(401) - 0.5, energy, constant, 3)
    assert NOISIER in varying(index, [(0.0, [0, 0], 1.0), both[1]])
    message = varying(index, both, robust=True)
    assert FASTER in message and "or the curve follows outliers" in message
    assert varying(index, [(0.0, [0, 0], 1.0), both[1]], robust=True) is None
