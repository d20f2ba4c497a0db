"""A batch of curves as a sequence."""

import numpy as np
import pytest
from curves import (
    KNOTS,
    S2,
    THREE,
    every_kind,
    found,
    pick,
    points_on,
    same,
    same_curve,
    shaped,
    with_ends,
)

import symspline as ss


@every_kind
def test_a_batch_is_a_sequence(space):
    p = points_on(space, batch=(3, 2), step=0.5)
    bc_type = with_ends(space, p)
    spline = ss.CubicSpline(KNOTS, p, space, bc_type=bc_type)
    assert len(spline) == 3 and [len(one) for one in spline] == [2] * 3
    for index in (0, -1, np.int64(2), slice(1, None), slice(0, 2), slice(None, None, -2)):
        own = tuple((order, pick(v, index)) for order, v in bc_type)
        one = ss.CubicSpline(KNOTS, pick(p, index), space, bc_type=own)
        assert same_curve(spline[index], one)
        assert all(same(a[1], b[1]) for a, b in zip(spline[index].bc_type, one.bc_type, strict=True))
    assert same_curve(spline[2][1], ss.CubicSpline(KNOTS, pick(p, (2, 1)), space, bc_type=spline[2][1].bc_type))


def test_own_times_are_picked_with_the_curve():
    t = np.array([[0.0, 1, 2], [5, 7, 8]])
    spline = ss.CubicSpline(t, [THREE, THREE], S2)
    assert same(spline[1].t, t[1])
    assert same(spline[1](6.5), spline([[1.0], [6.5]], per_curve=True)[1, 0])
    dates = ss.CubicSpline(t.astype("M8[s]"), [THREE, THREE], S2)
    assert same(dates[1](np.datetime64(7, "s")), dates[1].points[1])


def test_single_curve_is_not_a_sequence():
    spline = ss.CubicSpline(None, THREE, S2)
    for use in (len, iter, lambda s: s[0]):
        with pytest.raises(TypeError, match="batch"):
            use(spline)
    batch = ss.CubicSpline(None, [THREE] * 2, S2)
    for index in ("0", 0.0, (0, 1), None):
        with pytest.raises(TypeError, match="integer or a slice"):
            batch[index]
    for index in (2, -3):
        with pytest.raises(IndexError, match="there are 2 curves"):
            batch[index]


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
