"""Bézier and B-spline curves, whose control points may be anything."""

import pickle

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import symspline as ss
from fuzz.fits import times
from fuzz.outcomes import Refusal, attempt
from fuzz.places import parts, points, spaces
from fuzz.values import GOOD, ODD, array_like, moods, nonsense, rarely, seeds


@given(st.data())
def test_bsplines(data):
    draw = data.draw
    mood, space = draw(moods), draw(spaces)
    batch, n = draw(st.sampled_from([(), (), (1,), (3,), (2, 2)])), draw(st.integers(1, 7))
    control = draw(array_like(draw(points(parts(space)[0], (*batch, n))), mood))
    degree = draw(st.integers(1, 4))
    rng = np.random.default_rng(draw(seeds))
    knots = np.sort(rng.choice([0, 1, 2, 3, 4.5], n + degree + 1)) * 10.0 ** draw(st.sampled_from([0, 0, -9, 200]))
    if draw(st.booleans()):
        knots = np.r_[[0.0] * (degree + 1), np.arange(1.0, n - degree), [max(n - degree, 1)] * (degree + 1)]
    knots = draw(array_like(knots, mood))
    if mood == ODD and rarely(draw, 3):
        degree = draw(nonsense)
    bezier = draw(st.booleans())
    curve = attempt(
        lambda: ss.BezierCurve(control, space) if bezier else ss.BSpline(knots, control, degree, space),
        control, knots, wrong_types=mood == ODD,
    )  # fmt: skip
    if isinstance(curve, Refusal):
        return
    assert pickle.loads(pickle.dumps(curve)) == curve and repr(curve)
    x, nu = draw(times(np.array(curve.domain), mood)), draw(st.sampled_from([0, 1, 2]))
    if mood == ODD and rarely(draw, 3):
        nu = draw(nonsense)
    values = attempt(lambda: curve(x, nu), x, wrong_types=mood == ODD)
    if not isinstance(values, Refusal):
        assert (
            values.shape
            == curve.control_points.shape[: curve.control_points.ndim - 1 - len(curve.space.point_shape)]
            + np.shape(x)
            + curve.space.point_shape
        )
        assert mood != GOOD or np.isfinite(values).all()
    speed = attempt(lambda: curve.speed(x), x, wrong_types=mood == ODD)
    assert isinstance(speed, Refusal) or not (speed < 0).any()
