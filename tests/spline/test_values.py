"""Curves of every class as values: copies, comparison, sequences of curves, and how they print."""

import copy
import pickle

import numpy as np
import pytest
from cases import COMMON, loop_over
from compare import found, parts, pick, same, same_curve, shaped
from curves import KNOTS, S2, THREE, at_node, every_common, points_on, tangents_at, with_ends
from refused import raises
from stored import restored

import symspline as ss

# Of these, reports on AdS hold NaN, because it has no metric. B-splines have no products.
SPACES = [*COMMON, *map(ss.space, ("u:2", "gr:2,5", "ads:4"))]
KINDS = [
    pytest.param(kind, space, id=f"{kind}-{space}")
    for kind in ("CubicSpline", "HermiteSpline", "BSpline", "BezierCurve")
    for space in SPACES
    if kind in ("CubicSpline", "HermiteSpline") or not isinstance(space, ss.Product)
]
every_class = pytest.mark.parametrize(("kind", "space"), KINDS)


def curve_of(kind, space, batch=(), seed=1):
    """A curve of six points on a space."""
    p = points_on(space, 6, batch, step=0.4, seed=seed)
    if kind == "CubicSpline":
        return ss.CubicSpline(KNOTS, p, space, bc_type=with_ends(space, p), extrapolate="geodesic")
    if kind == "HermiteSpline":
        return ss.HermiteSpline(KNOTS, p, tangents_at(space, p), space, extrapolate="geodesic")
    if kind == "BSpline":
        return ss.BSpline([0, 0, 0, 1, 2, 3, 4.5, 4.5, 4.5], p, 2, space)
    return ss.BezierCurve(p, space)


def arrays_of(curve):
    """All arrays that determine a curve."""
    if isinstance(curve, ss.BSpline):
        return [curve.knots, curve.control_points]
    return [curve.t, *parts(curve.points), *parts(curve.velocities)]


def same_values(one, other):
    """Whether two curves agree to the last bit inside the knots and, where they are defined, outside."""
    x = [0.3, 1.0] if isinstance(one, ss.BezierCurve) else [0.3, 4.0]
    x = x if isinstance(one, ss.BSpline) else [-1.0, *x, 9.0]
    return all(same(one(x, nu), other(x, nu)) for nu in range(3))


COPIES = {
    "file": restored,
    "pickle": lambda curve: pickle.loads(pickle.dumps(curve)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}


@every_class
@loop_over("batch", [(), (2, 3)])
@loop_over("how", COPIES)
def test_copies_are_bit_identical(kind, space, batch, how):
    curve = curve_of(kind, space, batch)
    made = COPIES[how](curve)
    assert type(made) is type(curve) and made == curve and made.space == space and repr(made) == repr(curve)
    assert same_values(made, curve)
    assert not any(array.flags.writeable for one in (curve, made) for array in arrays_of(one))
    if kind == "CubicSpline":
        assert made.extrapolate == "geodesic" and made.report == curve.report
        for ours, theirs in zip(curve.bc_type, made.bc_type, strict=True):
            assert ours[0] == theirs[0] and type(ours[1]) is type(theirs[1])
            assert same(ours[1], theirs[1]) and found(ours[1]) == found(theirs[1])


@every_class
def test_curves_compare_and_print(kind, space):
    curve, batch = curve_of(kind, space), curve_of(kind, space, (2, 3))
    assert curve == curve_of(kind, space)
    assert curve != curve_of(kind, space, seed=2) and curve != batch and curve != "curve"
    raises("unhashable", hash, curve, error=TypeError)
    points = "control points, degree" if isinstance(curve, ss.BSpline) else "points"
    assert repr(curve).startswith(f"<{kind} on {space!r}: 6 {points}") and "\n" not in repr(curve)
    assert repr(batch).startswith(f"<{kind} on {space!r}: 2 x 3 curves, 6 {points}")


def test_splines_compare():
    spline = ss.CubicSpline(None, THREE, S2)
    assert spline == ss.CubicSpline([0, 1, 2], THREE, "sphere:2")
    assert spline != ss.CubicSpline([0, 1, 3], THREE, S2)
    assert spline != ss.CubicSpline(None, THREE, S2, bc_type="clamped")
    assert spline != ss.CubicSpline(None, THREE, "r:3")
    assert spline != ss.CubicSpline(None, (THREE, THREE), "sphere:2 x r:3")


@every_class
def test_a_batch_is_a_sequence(kind, space):
    batch, one = curve_of(kind, space, (3, 2)), curve_of(kind, space)
    assert isinstance(batch, ss.Curve) and len(batch) == 3 and [len(curve) for curve in batch] == [2] * 3
    for index in (0, -1, np.int64(2), slice(1, None), slice(0, 2), slice(None, None, -2)):
        assert type(batch[index]) is type(batch)
        for picked, whole in zip(arrays_of(batch[index])[1:], arrays_of(batch)[1:], strict=True):
            assert same(picked, whole[index])
        x = [0.3, 1.0]
        assert same(batch[index](x), pick(batch(x), index))
    for index in (3, -4):
        raises("there are 3 curves", batch.__getitem__, index, error=IndexError)
    for index in ("0", 0.0, (0, 1), None):
        raises("integer or a slice", batch.__getitem__, index, error=TypeError)
    for use in (len, iter, lambda curve: curve[0]):
        raises("batch", use, one, error=TypeError)
    assert one


@every_common
def test_picked_splines_are_those_of_their_points(space):
    p = points_on(space, batch=(3, 2), step=0.5)
    bc_type = with_ends(space, p)
    batch = ss.CubicSpline(KNOTS, p, space, bc_type=bc_type)
    for index in (1, slice(None, None, -2)):
        own = tuple((order, pick(v, index)) for order, v in bc_type)
        one = ss.CubicSpline(KNOTS, pick(p, index), space, bc_type=own)
        assert batch[index] == one and batch[index].report == one.report
        assert all(same(a[1], b[1]) for a, b in zip(batch[index].bc_type, one.bc_type, strict=True))
    start = at_node(space, batch[2][1].points, 0)
    assert found(start) == found(batch[2][1].bc_type[0][1])


@pytest.mark.parametrize("shape", [(2, 3), (3,), (1, 3)], ids=str)
def test_picked_curves_keep_their_end_conditions(shape):
    v = np.broadcast_to([0, 0.1, 0.2], shape)
    spline = ss.CubicSpline(None, [THREE, THREE], S2, bc_type=((1, v), (2, np.zeros(shape))))
    for some in (spline[1], spline[:1]):
        assert same_curve(ss.CubicSpline(some.t, some.points, S2, bc_type=some.bc_type), some)


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
    raises("the batch has no curves", spline.plot)
    assert ss.make_smoothing_spline(None, points, space).report is not None
