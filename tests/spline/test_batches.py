"""A batch of curves as a sequence."""

import numpy as np
import pytest
from curves import (
    S2,
    THREE,
    found,
    same,
    same_curve,
    shaped,
)

import symspline as ss


def test_own_times_are_picked_with_the_curve():
    t = np.array([[0.0, 1, 2], [5, 7, 8]])
    spline = ss.CubicSpline(t, [THREE, THREE], S2)
    assert same(spline[1].t, t[1])
    assert same(spline[1](6.5), spline([[1.0], [6.5]], per_curve=True)[1, 0])
    dates = ss.CubicSpline(t.astype("M8[s]"), [THREE, THREE], S2)
    assert same(dates[1](np.datetime64(7, "s")), dates[1].points[1])


@pytest.mark.parametrize("shape", [(2, 3), (3,), (1, 3)], ids=str)
def test_picked_curves_keep_their_end_conditions(shape):
    v = np.broadcast_to([0, 0.1, 0.2], shape)
    spline = ss.CubicSpline(None, [THREE, THREE], S2, bc_type=((1, v), (2, np.zeros(shape))))
    for some in (spline[1], spline[:1]):
        assert same_curve(ss.CubicSpline(some.t, some.points, S2, bc_type=some.bc_type), some)


def test_a_slice_may_be_empty():
    none = ss.CubicSpline(None, [THREE, THREE], S2)[2:]
    assert len(none) == 0 and none(0.5).shape == (0, 3) and "0 curves" in repr(none)
    assert str(none.report).startswith("no curves") and none.length().shape == (0,)


@pytest.mark.parametrize("name", ["s:2", "so:3", "cp:2", "gr:2,400", "s:2 x r:1"])
def test_a_batch_may_have_no_curves(name, tmp_path):
    """As blocks of a selection are."""
    space = ss.space(name)
    points = space.random_point(np.random.default_rng(0), (2, 0, 5))
    x = np.linspace(0, 4, 7)
    spline = ss.CubicSpline(None, points, space)
    assert str(spline.report).startswith("no curves") and spline.length().shape == (2, 0)
    spline.save(tmp_path / "none.npz")
    for each in (spline, ss.load(tmp_path / "none.npz"), ss.CubicSpline(np.zeros((2, 0, 5)), points, space)):
        for nu in range(3):
            assert found(each(x, nu)) == shaped(space, (2, 0, 7))
    with pytest.raises(ss.ValidationError, match="the batch has no curves"):
        spline.plot()
    assert ss.make_smoothing_spline(None, points, space).report is not None
