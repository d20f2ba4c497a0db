"""Rounding errors below the tolerance of a fit are not a failure."""

import numpy as np
from scipy.linalg import expm

import symspline as ss


def test_matrices_of_condition_1e9_converge_to_a_tolerance_above_rounding():
    """An error ellipsoid of fixed shape turns by 2.5 degrees per step; the rounding errors of its curve are 2e-8."""
    basis = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    turn = np.array([[0, 1.0, 0.5], [-1, 0, 0.3], [-0.5, -0.3, 0]])
    turned = [basis @ expm(0.3 * t * turn) for t in np.linspace(0, 1, 8)]
    points = np.array([(q * np.geomspace(1, 1e-9, 3)) @ q.T for q in turned])
    points = (points + points.swapaxes(1, 2)) / 2
    curve = ss.CubicSpline(None, points, "spd:3", tol=1e-6)
    assert curve.report.converged and curve.report.residual <= 1e-6
    np.testing.assert_allclose(curve(np.arange(8.0)), points, atol=1e-6)
    strict = ss.CubicSpline(None, points, "spd:3", on_failure="ignore")
    assert not strict.report.converged
