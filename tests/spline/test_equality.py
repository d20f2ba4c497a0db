"""Results that contain arrays are equal to their copies, also to those of a pickle."""

import copy
import pickle

import numpy as np
import pytest

import symspline as ss

T = np.arange(5.0)
CURVE = ss.CubicSpline(T, np.sin(T)[:, None] * [1.0, 2.0], "r:2")


def estimated(sigma):
    m = ss.measure
    drift = m.Constant(2, sigma=1.0, name="drift")
    seen = m.Function(T, lambda x, p: x + p["drift"] - CURVE.points, sigma=sigma, parameters={"drift": drift})
    return ss.estimate([m.Points(T, CURVE.points, sigma=0.1), seen], 3, "r:2", lam=1.0).parameters["drift"]


MADE = {
    "gradient": lambda own: CURVE.vjp(0.5, [own, 1.0]),
    "gradient of a product": lambda own: ss.CubicSpline(T, (np.eye(5), np.ones((5, 1))), "r:5 x r:1").vjp(
        0.5, (np.ones(5), [own])
    ),
    "law": lambda own: ss.time_law(CURVE, max_acceleration=own),
    "pca": lambda own: ss.tangent_pca(own * np.random.default_rng(0).standard_normal((6, 2)), "r:2"),
    "parameter": estimated,
}


@pytest.mark.parametrize("name", MADE)
def test_copies_are_equal(name):
    first, second = MADE[name](1.0), MADE[name](2.0)
    for other in (copy.deepcopy(first), MADE[name](1.0), pickle.loads(pickle.dumps(first))):
        assert (first == other) is True and (first != other) is False
    assert (first == second) is False and (first != second) is True
    assert first != 1


def test_a_curve_with_a_law_equals_its_pickle():
    curve = CURVE.retime(ss.time_law(CURVE, max_acceleration=1.0))
    assert pickle.loads(pickle.dumps(curve)) == curve
