"""Some curves of a batch: those that are wanted, and those whose points are valid."""

import tracemalloc
import warnings

import numpy as np
import pytest
from curves import each, parts, points_on
from refused import fit_error

import symspline as ss

X = [0.0, 0.7, 2.9]


@pytest.mark.parametrize("name", ["sphere:2", "spd:3", "cp:1", "sphere:2 x r:3", "sphere:300"])
@pytest.mark.parametrize("own_times", [False, True])
def test_wanted_curves_are_those_of_the_whole_batch(name, own_times):
    space, p = ss.space(name), points_on(ss.space(name), 4, (2, 3), step=0.4)
    t = np.cumsum(np.ones((2, 3, 4)), axis=-1) - 1 if own_times else None
    mask = np.array([[True, False, True], [False, False, True]])
    spoiled = each(lambda part: np.where(mask.reshape(2, 3, *(1,) * (part.ndim - 2)), part, np.nan), p)
    whole = ss.CubicSpline(t, p, space, bc_type="not-a-knot")
    some = ss.CubicSpline(t, spoiled, space, bc_type="not-a-knot", where=mask)
    for found, expected in zip(parts(some(X)), parts(whole(X)), strict=True):
        np.testing.assert_allclose(found[mask], expected[mask], atol=1e-12)
        assert np.isnan(found[~mask]).all()
    assert (some.report.converged == mask).all()
    np.testing.assert_array_equal(some.report.residual[mask], whole.report.residual[mask])


def test_vectors_at_the_ends_go_with_their_curves():
    p = points_on(ss.Sphere(2), 4, (5,), step=0.4)
    v = ss.Sphere(2).random_tangent(np.random.default_rng(0), p[:, 0])
    mask = np.array([True, False, False, True, True])
    whole = ss.CubicSpline(None, p, "s:2", bc_type=((1, v), "natural"))
    some = ss.CubicSpline(None, p, "s:2", bc_type=((1, v), "natural"), where=mask)
    assert np.array_equal(some.velocities[mask], whole.velocities[mask])
    assert np.isnan(some.velocities[~mask]).all()


def test_no_curve_at_all():
    some = ss.CubicSpline(None, points_on(ss.Sphere(2), 4, (5,)), "s:2", where=np.zeros(5, bool))
    assert np.isnan(some(X)).all() and not some.report.converged.any()


@pytest.mark.parametrize("name, value", [("sphere:2", np.nan), ("spd:3", -1.0), ("spd:3", np.nan)])
def test_a_bad_sensor_stops_no_other(name, value):
    p = points_on(ss.space(name), 4, (50,), step=0.4)
    good = ss.CubicSpline(None, p, name)
    p[17, 2], p[30, 0] = value * np.ones_like(p[17, 2]), value * p[30, 0]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        some = ss.CubicSpline(None, p, name, on_failure="ignore")
    keep = np.delete(np.arange(50), [17, 30])
    assert np.array_equal(some.velocities[keep], good.velocities[keep])
    assert np.isnan(some(X)[[17, 30]]).all() and np.count_nonzero(some.report.converged) == 48
    with pytest.warns(
        ss.ConvergenceWarning, match=r"points\[2\] of curve 17 is (off|not).*and 1 more curves failed"
    ):
        ss.CubicSpline(None, p, name, on_failure="warn")
    with pytest.raises(ss.ValidationError, match=r"points\[2\] of curve 17"):
        ss.CubicSpline(None, p, name)


def test_faults_and_errors_name_the_curve_in_the_whole_batch():
    p = points_on(ss.Sphere(2), 4, (2, 3), step=0.4)
    p[1, 1, 1] = -p[1, 1, 0]
    mask = np.array([[False, True, False], [False, True, True]])
    with pytest.raises(ss.CutLocusError, match="of curve 1,1"):
        ss.CubicSpline(None, p, "s:2", where=mask)
    p[1, 2, 1] = np.nan
    with pytest.raises(ss.ValidationError, match=r"points\[1\] of curve 1,2"):
        ss.CubicSpline(None, p, "s:2", where=mask)


@pytest.mark.parametrize("where", [[True], [1, 0], [True, False, True], True])
def test_bad_masks(where):
    fit_error(
        r"where must be True or False for every curve, of shape \(2,\)",
        points=np.stack([np.eye(3)] * 2),
        where=where,
    )


@pytest.mark.parametrize("part", [0.0, 0.5])
def test_a_background_costs_no_more_memory_than_it_fills(part):
    """Input, output and a fifth of both, for a volume of usual size."""
    count = 100_000
    p = np.broadcast_to(np.eye(3), (count, 8, 3, 3)).copy()
    mask = np.arange(count) < part * count
    p[~mask] = 0
    ss.CubicSpline(None, p[:2], "spd:3", where=[part > 0, False])
    tracemalloc.start()
    spline = ss.CubicSpline(None, p, "spd:3", where=mask)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert spline.report.converged.sum() == mask.sum()
    output = spline.points.nbytes + spline.velocities.nbytes
    assert p.nbytes + peak < 1.2 * (p.nbytes + output)
