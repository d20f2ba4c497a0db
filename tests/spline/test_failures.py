"""Curves that fail: errors, warnings, and what becomes of the others."""

import pickle
import warnings

import numpy as np
import pytest
from cases import (
    EPS,
)
from curves import (
    S2,
    failing,
    largest_difference,
    points_on,
    same,
    same_curve,
)

import symspline as ss

ERRORS = {"cut locus": ss.CutLocusError, "no convergence": ss.ConvergenceError}


every_failure = pytest.mark.parametrize("kind", ERRORS)


@every_failure
def test_on_failure_raise_is_the_default(kind):
    p, options = failing(kind)
    for on_failure in ({}, {"on_failure": "raise"}):
        with pytest.raises(ERRORS[kind], match="of curve 1") as caught:
            ss.CubicSpline(None, p, S2, **options, **on_failure)
        assert caught.value.spline.report.converged.tolist() == [True, False, True]


@every_failure
def test_on_failure_warn(kind):
    p, options = failing(kind)
    with pytest.warns(ss.ConvergenceWarning, match="of curve 1") as caught:
        spline = ss.CubicSpline(None, p, S2, on_failure="warn", **options)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert spline.report.converged.tolist() == [True, False, True]


@pytest.mark.parametrize("function", ["fit", "fit_many"])
def test_warnings_of_functions_point_at_the_caller(function):
    p, options = failing("cut locus")
    with pytest.warns(ss.ConvergenceWarning) as caught:
        if function == "fit":
            ss.fit(None, p, S2, on_failure="warn", **options)
        else:
            ss.fit_many([(None, q) for q in p], S2, on_failure="warn", **options)
    assert caught[0].filename == __file__


@every_failure
def test_on_failure_ignore_is_silent(kind):
    p, options = failing(kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        spline = ss.CubicSpline(None, p, S2, on_failure="ignore", **options)
    assert spline.report.converged.tolist() == [True, False, True]


@every_failure
def test_a_bad_curve_never_spoils_the_others(kind):
    p, options = failing(kind)
    with pytest.raises(ERRORS[kind]) as caught:
        ss.CubicSpline(None, p, S2, **options)
    spline = caught.value.spline
    x = np.linspace(0, 19, 50)
    for i in (0, 2):
        alone = ss.CubicSpline(None, p[i], S2, **options)
        assert same_curve(spline[i], alone)
        for nu in range(3):
            assert same(spline(x, nu=nu)[i], alone(x, nu=nu))


def test_a_bad_curve_never_spoils_the_others_in_any_place():
    good = points_on(S2, 12, (19,), step=0.3)
    reference = ss.CubicSpline(None, good, S2)
    for bad in range(19):
        p = good.copy()
        p[bad, 5] = -p[bad, 6]
        spline = ss.CubicSpline(None, p, S2, on_failure="ignore")
        others = np.arange(19) != bad
        assert same(spline.velocities[others], reference.velocities[others])


def test_a_curve_with_a_cut_locus_fault_is_nan():
    p, options = failing("cut locus")
    spline = ss.CubicSpline(None, p, S2, on_failure="ignore", **options)
    for nu in range(3):
        assert np.isnan(spline([0.5, 10], nu=nu)[1]).all()
    assert np.isnan(spline.length()[1])


def test_an_unconverged_curve_keeps_its_best_iterate():
    p, options = failing("no convergence")
    spline = ss.CubicSpline(None, p, S2, on_failure="ignore", **options)[1]
    assert np.isfinite(spline.velocities).all()
    assert largest_difference(spline(spline.t), spline.points) < 20 * EPS
    for method in ("fixed-point", "quasi-newton"):
        residuals = [
            ss.CubicSpline(None, p[1], S2, method=method, max_iter=n, on_failure="ignore").report.residual
            for n in range(1, 40)
        ]
        assert (np.diff(residuals) <= 0).all()


@every_failure
def test_a_single_failing_curve_is_attached_too(kind):
    p, options = failing(kind)
    with pytest.raises(ERRORS[kind]) as caught:
        ss.CubicSpline(None, p[1], S2, **options)
    assert caught.value.spline.report.converged is False
    assert np.abs(caught.value.spline.points - p[1]).max() <= 2 * EPS


@every_failure
def test_failures_in_a_product(kind):
    p, options = failing(kind)
    flat = points_on(ss.Euclidean(1), 20, (3,))
    space = ss.Product("r:1", S2)
    with pytest.raises(ERRORS[kind], match="of curve 1") as caught:
        ss.CubicSpline(None, (flat, p), space, **options)
    spline = caught.value.spline
    assert spline.report.converged.tolist() == [True, False, True]
    assert same_curve(spline[2], ss.CubicSpline(None, (flat[2], p[2]), space, **options))
    with pytest.warns(ss.ConvergenceWarning):
        ss.CubicSpline(None, (flat, p), space, on_failure="warn", **options)
    ss.CubicSpline(None, (flat, p), space, on_failure="ignore", **options)


@every_failure
def test_failures_in_fit_and_fit_many(kind):
    p, options = failing(kind)
    with pytest.raises(ERRORS[kind]) as caught:
        ss.fit(None, p, S2, **options)
    assert caught.value.spline.report.converged.tolist() == [True, False, True]
    curves = [(None, p[0]), (None, p[1]), (None, p[2][:7])]
    with pytest.raises(ERRORS[kind], match="of curve 1") as caught:
        ss.fit_many(curves, S2, **options)
    splines = caught.value.spline
    assert [s.report.converged for s in splines] == [True, False, True]
    assert same_curve(splines[2], ss.CubicSpline(None, p[2][:7], S2, **options))


def test_a_leg_past_the_cut_locus_is_a_cut_locus_error():
    # No point is far from its neighbour, but times that change too fast make a leg too long.
    q = points_on(S2, 2, step=1.0)
    e = S2.log(*q)
    circle = S2.exp(q[0], np.arange(8)[:, None] * 1.2 * e)
    t = [0, 1, 2, 3, 3.01, 13, 14, 15]
    with pytest.raises((ss.CutLocusError, ss.ConvergenceError), match=r"more points|choose times|too close"):
        ss.CubicSpline(t, circle, S2)


@every_failure
def test_exceptions_pickle(kind):
    p, options = failing(kind)
    with pytest.raises(ERRORS[kind]) as caught:
        ss.CubicSpline(None, p, S2, **options)
    made = pickle.loads(pickle.dumps(caught.value))
    assert type(made) is ERRORS[kind] and str(made) == str(caught.value)
    assert made.spline == caught.value.spline


def test_kinds_of_errors():
    assert issubclass(ss.ValidationError, ValueError)
    assert issubclass(ss.CutLocusError, ValueError)
    assert issubclass(ss.ConvergenceError, RuntimeError)
    assert issubclass(ss.ConvergenceWarning, UserWarning)


def test_nan_curves_warn_of_nothing():
    p = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0]])
    with warnings.catch_warnings(), np.errstate(all="raise"):
        warnings.simplefilter("error")
        spline = ss.CubicSpline(None, [p, np.roll(p, 1, axis=0)[[0, 1, 0]]], S2, on_failure="ignore")
        assert np.isnan(spline(0.5)[0]).all()
        assert np.isnan(spline.length()[0]) and np.isnan(spline.bending_energy()[0])
        assert np.isnan(spline.control_points[0, 0, 1]).all()
        assert "1 of 2" in str(spline.report)


def test_legs_that_doubles_cannot_hold():
    p = [np.eye(2), np.diag([2.0, 0.5])]
    with pytest.raises(ss.ConvergenceError, match=r"control leg at points\[0\] has length 21\.2"):
        ss.CubicSpline(None, p, "spd:2", bc_type=((1, np.diag([45.0, -45.0])), "natural"))
    assert ss.CubicSpline(None, p, "spd:2", bc_type=((1, np.diag([30.0, -30.0])), "natural")).report.converged


def test_a_leg_is_measured_by_the_longer_of_its_segments():
    """On the hyperbolic line the spline is that of flat space: a short segment makes the next one overshoot."""
    space, x = ss.Hyperbolic(1), 0.8 * np.arange(5)
    p = np.stack([np.cosh(x), np.sinh(x)], axis=-1)
    with pytest.raises(ss.ConvergenceError, match=r"control leg at points\[[12]\] has length"):
        ss.CubicSpline([0, 1, 1.05, 5.05, 6.05], p, space)


def test_legs_that_doubles_cannot_hold_are_an_error():
    # Given velocities are a solution at once, but ε cosh²(30) is far above 1.
    p, v = [[1.0, 0, 0], [np.cosh(1), np.sinh(1), 0]], np.array([0, 0, 90.0])
    with pytest.raises(ss.ConvergenceError, match=r"control leg at points\[0\] has length 30\.0, .*times"):
        ss.CubicSpline(None, p, "h:2", bc_type=((1, v), (1, v)))
    assert np.isfinite(ss.CubicSpline(None, p, "h:2", bc_type=((1, v / 10), (1, v / 10)))(0.5)).all()


def test_legs_that_doubles_cannot_hold_in_complex_hyperbolic_space():
    p = np.array([[1, 0], [np.cosh(1), np.sinh(1)]], dtype=complex)
    v = 57 * np.array([[0, 1j], [np.sinh(1), np.cosh(1)]])
    with pytest.raises(ss.ConvergenceError, match=r"control leg at points\[0\] has length 19\.0"):
        ss.CubicSpline(None, p, "ch:1", bc_type=((1, v[0]), (1, v[1])))
    assert np.isfinite(ss.CubicSpline(None, p, "ch:1", bc_type=((1, v[0] / 10), (1, v[1] / 10)))(0.5)).all()


@pytest.mark.parametrize("where", [None, [True, True, True, False]])
def test_bad_points_of_one_of_many_curves(where):
    good = points_on(S2)
    curves = [(None, good), (None, good[:4] * 1.5), (None, good[:3]), (None, good)]
    with pytest.raises(ss.ValidationError, match=r"points\[0\] of curve 1"):
        ss.fit_many(curves, S2, where=where)
    with pytest.warns(ss.ConvergenceWarning, match=r"curve 1: points\[0\] is off"):
        found = ss.fit_many(curves, S2, where=where, on_failure="warn")
    assert [s.report.converged for s in found] == [True, False, True, where is None]
    assert np.isnan(found[1].velocities).all()
    assert same_curve(found[2], ss.CubicSpline(None, good[:3], S2))
