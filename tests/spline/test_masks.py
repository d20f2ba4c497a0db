"""Masks: curves of a batch that are not fitted, and curves with invalid points."""

import tracemalloc

import numpy as np
import pytest
from compare import each, parts
from curves import points_on
from refused import fit_error, raises

import symspline as ss

X = [0.0, 0.7, 2.9]


@pytest.mark.parametrize("name", ["sphere:2", "spd:3", "cp:1", "sphere:2 x r:3", "sphere:300"])
@pytest.mark.parametrize("own_times", [False, True])
def test_unmasked_curves_equal_those_of_the_whole_batch(name, own_times):
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
    none = ss.CubicSpline(t, p, space, where=np.zeros((2, 3), bool))
    assert all(np.isnan(part).all() for part in parts(none(X))) and not none.report.converged.any()


def test_errors_and_times_name_the_curve_in_the_whole_batch():
    p = points_on(ss.Sphere(2), 4, (2, 3), step=0.4)
    p[1, 1, 1] = -p[1, 1, 0]
    mask = np.array([[False, True, False], [False, True, True]])
    raises("of curve 1,1", ss.CubicSpline, None, p, "s:2", error=ss.CutLocusError, where=mask)
    p[1, 2, 1] = np.nan
    raises(r"points\[1\] of curve 1,2", ss.CubicSpline, None, p, "s:2", where=mask)
    t, mask = [[0, 1, 2], [0, 1, 2], [0, 2, 1]], np.array([False, True, True])
    match = r"t\[2\]\[2\] = 1 is before t\[2\]\[1\] = 2"
    raises(match, ss.CubicSpline, t, [np.eye(3)] * 3, "s:2", where=mask)
    raises(match, ss.fit_many, [(row, np.eye(3)) for row in t], "s:2", where=mask)


@pytest.mark.parametrize("name", ["sphere:2", "cp:1", "sphere:2 x r:3", "sphere:300"])
def test_masks_of_curves_of_different_lengths(name):
    space = ss.space(name)
    pairs = [(np.arange(n) + 3.0, points_on(space, n, step=0.4)) for n in (4, 2, 5, 3)]
    start = points_on(space, 4, (4,), step=0.4)
    v = [tuple(0 * part[:, 0] for part in parts(start))] if len(parts(start)) > 1 else [0 * start[:, 0]]
    options = {"bc_type": ((1, v[0]), "natural"), "extrapolate": True}
    whole = ss.fit_many(pairs, space, **options)
    pairs[1] = pairs[1][0], each(lambda part: np.nan * part, pairs[1][1])
    mask = np.array([True, False, False, True])
    some = ss.fit_many(pairs, space, where=mask, **options)
    for found, expected, wanted in zip(some, whole, mask, strict=True):
        assert np.array_equal(found.t, expected.t) and found.report.converged == wanted
        if wanted:
            assert found == expected and found.report == expected.report
        else:
            assert all(np.isnan(part).all() for part in (*parts(found(3.5)), *parts(found.points)))
    assert not any(one.report.converged for one in ss.fit_many(pairs, space, where=~(mask | ~mask)))
    assert ss.fit_many([], space, where=[]) == []


def test_errors_name_the_curve_in_the_whole_list_and_the_shape_of_masks():
    bad = [(None, np.eye(3)), (None, np.eye(3)), (None, np.eye(3)[[0, 0]] * [[1], [-1]])]
    mask = np.array([False, True, True])
    error = raises("of curve 2 ", ss.fit_many, bad, "s:2", error=ss.CutLocusError, where=mask)
    assert [one.report.converged for one in error.spline] == [False, True, False]
    bad[2] = (None, 2 * np.eye(3))
    raises(r"points\[0\] of curve 2 is off", ss.fit_many, bad, "s:2", where=mask)
    bad[1] = (None, np.eye(3, dtype=np.float32))
    bad[2] = (None, (1 + 1e-6 / 3) * np.eye(3))
    raises(r"^curve 2: points\[0\] is off", ss.fit_many, bad, "s:2", where=mask)
    raises(r"where must be a Boolean array of shape \(3,\)", ss.fit_many, bad, "s:2", where=mask[:2])
    for where in ([True], [1, 0], [True, False, True], True):
        fit_error(r"where must be a Boolean array of shape \(2,\)", points=np.stack([np.eye(3)] * 2), where=where)


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


@pytest.mark.parametrize("name", ["se:2", "se:3", "aff:2", "sim:3", "so:3"])
def test_matrices_of_masked_curves_are_nan_throughout(name):
    space = ss.space(name)
    p = points_on(space, 4, batch=(3,), step=0.2)
    spline = ss.CubicSpline(None, p, space, where=[True, False, True])
    for nu in (0, 1, 2):
        for values in (spline(0.5, nu=nu), spline(0.5, nu=nu, out=np.empty_like(spline(0.5)))):
            assert np.isnan(values[1]).all() and np.isfinite(values[[0, 2]]).all()
    many = ss.fit_many([(None, own) for own in p], space, where=[True, False, True])
    assert np.isnan(many[1]([0.5, 1.0])).all()
