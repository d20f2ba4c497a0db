"""Times outside the knots: the policies of `extrapolate` in every kind of curve and call."""

import numpy as np
import pytest
import scipy.interpolate
from curves import parts, points_on

import symspline as ss
from symspline import rotations

T = np.array([0.0, 1.0, 3.0, 3.5, 5.0])
X = np.array([-1.0, 0.0, 0.5, 5.0, 5.1, np.nextafter(5.0, 6.0)])
OUTSIDE = np.array([True, False, False, False, True, False])
SPACES = ["r:2", "sphere:2", "rp:2", "so:3", "se:3", "cp:1", "sphere:2 x r:3", "sphere:60"]


def spline(name, **options):
    space = ss.space(name)
    return ss.CubicSpline(T, points_on(space, len(T), step=0.4), space, **options)


@pytest.mark.parametrize("name", SPACES)
@pytest.mark.parametrize("nu", [0, 1, 2])
def test_false_gives_nan_outside_and_the_curve_inside(name, nu):
    curve = spline(name, extrapolate=False)
    inside = spline(name)(X[~OUTSIDE], nu)
    for values, expected in zip(parts(curve(X, nu)), parts(inside), strict=True):
        assert np.isnan(values[OUTSIDE]).all()
        np.testing.assert_array_equal(values[~OUTSIDE], expected)
    assert all(np.isnan(value).all() for value in parts(curve(-1.0, nu)))


@pytest.mark.parametrize("name", SPACES)
def test_false_holds_for_speed_and_lift(name):
    curve = spline(name, extrapolate=False)
    assert np.isnan(curve.speed(9.0)) and np.isfinite(curve.speed(5.0))
    np.testing.assert_array_equal(np.isnan(curve.speed(X)), OUTSIDE)
    assert all(np.isnan(own[OUTSIDE]).all() and np.isfinite(own[~OUTSIDE]).all() for own in parts(curve.lift(X)))
    assert np.isfinite(curve.length()) and np.isfinite(curve.bending_energy())


def test_false_is_that_of_scipy():
    points = points_on(ss.space("r:2"), len(T))
    ours = ss.CubicSpline(T, points, "r:2", extrapolate=False)
    flat = scipy.interpolate.CubicSpline(T, points, bc_type="natural", extrapolate=False)
    np.testing.assert_allclose(ours(X[:-1]), flat(X[:-1]), rtol=0, atol=1e-14)


def test_curves_with_knots_of_their_own_have_their_own_nan():
    t = np.stack([T, T + 1])
    points = points_on(ss.space("sphere:2"), len(T), batch=(2,))
    curve = ss.CubicSpline(t, points, "sphere:2", extrapolate=False)
    assert np.isnan(curve([0.5, 5.5])[..., 0]).tolist() == [[False, True], [True, False]]
    each = [[0.5, 5.5], [0.5, 5.5]]
    np.testing.assert_array_equal(curve(each, per_curve=True), curve([0.5, 5.5]))


@pytest.mark.parametrize("policy", ["raise", None, False])
def test_only_none_lets_closed_curves_wrap(policy):
    points = points_on(ss.space("sphere:2"), 4, step=0.4)
    points = np.concatenate([points, points[:1]])
    curve = ss.CubicSpline(T, points, "sphere:2", bc_type="periodic", extrapolate=policy)
    if policy == "raise":
        with pytest.raises(ss.ValidationError, match="outside the knots"):
            curve(6.0)
    elif policy is None:
        np.testing.assert_allclose(curve(6.0), curve(1.0), atol=1e-15)
    else:
        assert np.isnan(curve(6.0)).all()


def test_a_call_overrides_the_policy_of_the_curve():
    curve = spline("sphere:2", extrapolate=True)
    assert np.isnan(curve(6.0, extrapolate=False)).all()
    with pytest.raises(ss.ValidationError, match="outside the knots"):
        curve(6.0, extrapolate="raise")
    out = np.zeros((2, 3))
    assert curve([1.0, 6.0], extrapolate=False, out=out) is out
    assert np.isfinite(out[0]).all() and np.isnan(out[1]).all()


def test_other_entries_take_false():
    curve = spline("sphere:2")
    values = ss.evaluate(T, curve.points, curve.velocities, curve.space, [1.0, 9.0], extrapolate=False)
    assert np.isnan(values[1]).all() and np.isfinite(values[0]).all()
    hermite = ss.HermiteSpline(T, curve.points, curve.velocities, "sphere:2", extrapolate=False)
    assert np.isnan(hermite(9.0)).all()
    dates = np.datetime64("2026-01-01") + np.arange(len(T))
    dated = ss.CubicSpline(dates, curve.points, "sphere:2", extrapolate=False)
    assert np.isnan(dated(np.datetime64("2025-01-01"))).all()


def test_rotations_of_scipy_refuse_nan():
    turning = spline("so:3", extrapolate=False)
    with pytest.raises(ss.ValidationError, match=r"index \[1\] is NaN"):
        rotations.rotation(turning, [1.0, 9.0])
    assert np.isnan(rotations.angular_velocity(turning, 9.0)).all()


@pytest.mark.parametrize("time", [np.nan, np.inf])
def test_times_that_are_not_finite_raise_under_every_policy(time):
    with pytest.raises(ss.ValidationError, match="finite"):
        spline("sphere:2", extrapolate=False)([1.0, time])


@pytest.mark.parametrize("wrong", [0, 1, "nan", "linear", 2.0, [True]])
def test_unknown_policies_raise(wrong):
    with pytest.raises(ss.ValidationError, match="extrapolate must be"):
        spline("r:2", extrapolate=wrong)


def test_false_holds_on_a_manifold_made_of_functions():
    space, rng = ss.Stiefel(2, 4), np.random.default_rng(0)
    first = space.random_point(rng)
    vectors = space.random_tangent(rng, np.broadcast_to(first, (len(T), 4, 2)))
    curve = ss.CubicSpline(T, space.exp(first, 0.2 * vectors), space, extrapolate=False)
    assert np.isnan(curve(X)[..., 0, 0]).tolist() == OUTSIDE.tolist()


def test_files_keep_the_policy(tmp_path):
    spline("sphere:2", extrapolate=False).save(tmp_path / "a.npz")
    assert ss.load(tmp_path / "a.npz").extrapolate is False
