"""Poses of other libraries and 4 × 4 matrices as points of so:3 x r:3, wherever points are taken."""

import re

import numpy as np
import pytest
from refused import raises

import symspline as ss

transform = pytest.importorskip("scipy.spatial.transform")
RigidTransform = getattr(transform, "RigidTransform", None)
pytestmark = pytest.mark.skipif(RigidTransform is None, reason="SciPy 1.16")

T = np.array([0.3, 1.0, 1.7, 3.1, 4.0, 4.4])
TURNS = np.outer(np.sin(T), [0.1, 0.3, -0.2])
PLACES = np.c_[100 * T, 0.5 * T**2, -T]


def poses():
    return RigidTransform.from_components(PLACES, transform.Rotation.from_rotvec(TURNS))


FORMS = {
    "RigidTransform": poses,
    "list": lambda: [poses()[i] for i in range(len(T))],
    "matrices": lambda: poses().as_matrix(),
    "single precision": lambda: poses().as_matrix().astype(np.float32),
}
FUNCTIONS = {
    "CubicSpline": lambda p, s: ss.CubicSpline(T, p, s),
    "skipna": lambda p, s: ss.CubicSpline(T, p, s, skipna=True),
    "HermiteSpline": lambda p, s: ss.HermiteSpline.from_points(T, p, s),
    "PiecewiseGeodesic": lambda p, s: ss.PiecewiseGeodesic(T, p, s),
    "fit_many": lambda p, s: ss.fit_many([(T, p)], s)[0],
    "fit_segments": lambda p, s: ss.fit_segments(T, p, s, max_gap=3)[0],
    "smoothing": lambda p, s: ss.make_smoothing_spline(T, p, s, (1e-3, 1e-3)),
    "estimate": lambda p, s: ss.estimate([ss.measure.Points(T, p)], 5, s, lam=1e-3),
    "estimate with a gyroscope": lambda p, s: ss.estimate(
        [ss.measure.Points(T, p, sigma=(0.01, 0.1)), ss.measure.BodyRates(T, TURNS, sigma=0.1)], 5, s, lam=1e-3
    ),
    "mean": lambda p, s: ss.space(s).mean(p),
    "grid": lambda p, s: ss.GridSpline([T], p, s),
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("function", FUNCTIONS)
def test_poses_are_points_of_the_product(function, form):
    make, given = FUNCTIONS[function], FORMS[form]()
    pair = transform.Rotation.from_rotvec(TURNS).as_matrix(), PLACES
    expected = make(pair, "so:3 x r:3")
    for space, order in (("so:3 x r:3", (0, 1)), ("r:3 x so:3", (1, 0))):
        if space == "r:3 x so:3" and "estimate" in function:
            continue
        found = make(given, space)
        values = [x if isinstance(x, tuple) else x(2.0) for x in (found, expected)]
        for i, j in enumerate(order):
            np.testing.assert_allclose(values[0][i], values[1][j], rtol=1e-6, atol=2e-6)


def test_wrong_matrices_name_the_pose_and_the_remedy():
    g = poses().as_matrix()
    for call in (ss.poses.split, lambda p: ss.CubicSpline(T, p, "so:3 x r:3")):
        raises(r"\[0\] has the last row .*transposed: pass np.swapaxes\(p\w+, -1, -2\)", call, np.swapaxes(g, -1, -2))
        scaled = g.copy()
        scaled[3] *= 2
        raises(r"\[3\] has the last row \[0.0, 0.0, 0.0, 2.0\].*Divide", call, scaled)
    # Gaps of a recording are NaN.
    g[2] = np.nan
    assert np.isnan(ss.poses.split(g)[0][2]).all()


def test_gates_that_are_known_up_to_a_phase():
    rng = np.random.default_rng(0)
    for n in (2, 3):
        space = ss.space(f"pu:{n}")
        first = space.random_point(rng)
        exact = space.exp(first, 0.2 * np.arange(8)[:, None, None] * space.random_tangent(rng, first))
        given = exact * np.exp(1j * rng.uniform(-3, 3, 8))[:, None, None]
        assert space.distance(exact, given).max() < 1e-7
        curve = ss.CubicSpline(T[0] + np.arange(8), given, space)
        assert space.distance(curve(curve.t), exact).max() < 1e-7
        assert curve.length() == pytest.approx(ss.CubicSpline(None, exact, space).length(), rel=1e-9)
        for fit in (
            lambda p, s=space: ss.HermiteSpline.from_points(None, p, s),
            lambda p, s=space: ss.make_smoothing_spline(None, p, s, 1e-6),
            lambda p, s=space: ss.fit_segments(np.arange(8.0), p, s, max_gap=2)[0],
        ):
            assert space.distance(fit(given)(3.0), exact[3]).max() < 1e-3
        raises(
            r"points\[2\] is off the space",
            ss.CubicSpline,
            None,
            given * np.where(np.arange(8) == 2, 1.1, 1)[:, None, None],
            space,
        )


def test_tables_of_poses_name_their_conversion():
    turns = transform.Rotation.from_rotvec(np.outer(np.arange(4), [0.1, 0.2, 0.3]))
    positions = np.arange(12.0).reshape(4, 3)
    a = np.concatenate([positions, turns.as_quat()], axis=1)
    with pytest.raises(ss.ValidationError, match=r"columns of your array a are x, y, z, qx") as caught:
        ss.CubicSpline(None, a, "so:3 x r:3")
    # What the message says to pass.
    given = re.search(r"pass (\(.*\))\.$", str(caught.value))[1]
    curve = ss.CubicSpline(None, eval(given, {"symspline": ss, "a": a}), "so:3 x r:3")
    assert np.abs(curve.points[0] - turns.as_matrix()).max() < 1e-15 and (curve.points[1] == positions).all()
