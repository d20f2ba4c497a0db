"""Points of a curve: arrays of any type and layout, batches, and invalid points."""

import pickle

import numpy as np
import pytest
from cases import COMMON, EPS, loop_over
from compare import each, found, largest_difference, off, parts, same, same_curve, shaped
from curves import KNOTS, S2, THREE, at_node, every_common, every_kind, points_on, tangents_at
from refused import P, fit_error, points, raises
from scipy.interpolate import CubicSpline as FlatSpline

import symspline as ss


@loop_over("dtype", [int, "i1", "u8", "f2", "f4", ">f8", bool])
def test_points_of_any_number_type(dtype):
    p = np.array(THREE, dtype)
    spline = ss.CubicSpline(None, p, S2)
    assert spline.points.dtype == spline.velocities.dtype == spline(0.5).dtype == np.float64
    assert spline == ss.CubicSpline(None, THREE, S2)


@every_kind
def test_single_precision(space):
    p = points_on(space, step=0.5)
    single = each(lambda a: a.astype(np.complex64 if a.dtype.kind == "c" else np.float32), p)
    space.check_point(single)
    spline = ss.CubicSpline(KNOTS, single, space)
    assert found(spline.points) == found(spline.velocities) == shaped(space, (6,))
    assert found(spline(0.5)) == shaped(space, ())
    assert off(space, spline.points, p) < 1e-5
    space.check_point(spline.points)


@every_kind
@loop_over("layout", ["lists", "Fortran", "strided", "backwards", "big-endian", "read-only", "misaligned"])
def test_any_layout(space, layout):
    def laid(array):
        if layout == "lists":
            return array.tolist()
        if layout == "Fortran":
            return np.asfortranarray(array)
        if layout == "backwards":
            return np.ascontiguousarray(array[..., ::-1])[..., ::-1]
        if layout == "big-endian":
            return array.astype(array.dtype.newbyteorder(">"))
        if layout == "read-only":
            array = array.copy()
            array.flags.writeable = False
            return array
        if layout == "misaligned":
            # Contiguous, but beginning between two numbers.
            moved = np.zeros(array.nbytes + 1, np.uint8)[1:].view(array.dtype).reshape(array.shape)
            moved[...] = array
            return moved
        wide = np.full((*array.shape, 2), 7, array.dtype)
        wide[..., 0] = array
        return wide[..., 0]

    p = points_on(space, batch=(2,), step=0.5)
    spline = ss.CubicSpline(KNOTS, p, space)
    assert same_curve(ss.CubicSpline(laid(KNOTS), each(laid, p), space), spline)
    x = np.array([0.5, 2.0])
    assert same(spline(laid(x)), spline(x))
    assert same(space.log(each(laid, p), p), space.log(p, p))
    assert same(ss.evaluate(KNOTS, p, each(laid, spline.velocities), space, x), spline(x))


@every_kind
def test_splines_copy_their_input(space):
    p, t = points_on(space, step=0.5), KNOTS.copy()
    v = tangents_at(space, at_node(space, p, 0))
    spline = ss.CubicSpline(t, p, space, bc_type=((1, v), "natural"))
    before = pickle.loads(pickle.dumps(spline))
    for array in (t, *parts(p), *parts(v)):
        array[...] = 7
    assert same_curve(spline, before) and same(spline.bc_type[0][1], before.bc_type[0][1])
    for array in (spline.t, *parts(spline.points), *parts(spline.velocities), *parts(spline.bc_type[0][1])):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


MASKED = np.ma.array(P, mask=[[0, 0, 0], [0, 0, 1], [1, 0, 0]])
TIMES = np.ma.array([0.0, 1.0, 2.0], mask=[0, 1, 0])


def test_masked_numbers_are_refused():
    for call, what in [
        (lambda: ss.CubicSpline(None, MASKED, S2), r"points\[1, 2\] is masked"),
        (lambda: ss.CubicSpline(None, list(MASKED), S2), r"points\[1, 2\] is masked"),
        (lambda: ss.CubicSpline(TIMES, P, S2), r"t\[1\] is masked"),
        (lambda: ss.CubicSpline(None, P, S2)(TIMES), r"x\[1\] is masked"),
        (lambda: ss.fit_many([(TIMES, P)], S2), r"curve 0: t\[1\] is masked"),
        (lambda: ss.BezierCurve(MASKED, S2), r"control_points\[1, 2\] is masked"),
        (lambda: S2.distance(np.ma.masked, P), r"p is masked"),
    ]:
        raises(what, call)
    # Arrays without masked numbers are taken.
    times, plain = np.ma.array([0.0, 1.0, 2.0], mask=False), np.ma.array(P)
    assert ss.CubicSpline(times, plain, S2) == ss.CubicSpline(None, list(plain), S2) == ss.CubicSpline(None, P, S2)


def test_invalid_shapes_and_types_of_points_raise():
    for wrong, match in [
        (np.ones((3, 4)), r"points has shape \(3, 4\), but Sphere\(2\) needs shape \(\.\.\., 3\)"),
        (np.ones((3, 1)), r"points has shape \(3, 1\), but Sphere\(2\) needs"),
        (np.ones(3), r"shape \(3,\), which is one point; a curve needs shape \(\.\.\., N\+1, \*point_shape\)"),
        (np.ones(()), r"no points given; a curve needs at least two"),
        ([], r"no points given; a curve needs at least two"),
        (np.ones((0, 3)), r"no points given; a curve needs at least two"),
        ([[1, 0, 0]], r"at least two points; got one"),
        (np.ones((4, 1, 3)), r"at least two points; got one"),
    ]:
        fit_error(match, points=wrong)
    for wrong in (P + 0j, P.astype(str), P.astype(int).astype(object), P.astype("M8[s]"), None, "points"):
        fit_error(r"points must be an array of (real )?numbers, not of|no points given", points=wrong)


def test_ragged_lists_raise():
    ragged, match = [[1, 0, 0], [0, 1]], "is not an array of equally long rows"
    raises(match, ss.CubicSpline(None, P, S2), ragged)
    for changes in ({"bc_type": ((1, ragged), "natural")}, {"points": ragged}, {"t": ragged}):
        raises(match, ss.CubicSpline, **{"t": None, "points": P, "space": S2} | changes)


def test_complex_points_of_a_real_space():
    for name, meant in [
        ("sphere:3", "ComplexProjective"),
        ("rp:2", "ComplexProjective"),
        ("gr:2,5", "ComplexGrassmannian"),
        ("so:3", "SpecialUnitary"),
        ("o:3", "Unitary"),
        ("spd:2", "HermitianPositiveDefinite"),
    ]:
        p, advice = points(name) + 0j, rf"did you mean {meant}\?"
        fit_error(rf"points must be an array of real numbers, not of complex128; {advice}", points=p, space=name)
        fit_error(rf"factor 1, .*{advice}", points=(np.zeros((4, 1)), p), space=f"r:1 x {name}")
        raises(rf"p must be .*{advice}", ss.space(name).exp, p, p)
        assert hasattr(ss, meant)


@pytest.mark.parametrize("name", ["sphere:3", "so:3", "sphere:3 x r:1", "cp:2"])
def test_rounded_points_are_taken_within_atol(name):
    space = ss.space(name)
    exact = points_on(space, 5)
    rounded = tuple(part.round(6) for part in exact) if isinstance(exact, tuple) else exact.round(6)
    # The numbers have full double precision, so the distance is not a rounding error.
    third = 1 + 1e-6 / 3
    wrong = tuple(part * third for part in exact) if isinstance(exact, tuple) else exact * third
    raises("off the space", ss.CubicSpline, None, wrong, space)
    assert ss.CubicSpline(None, rounded, space) == ss.CubicSpline(None, rounded, space, atol=1e-5)
    spline = ss.CubicSpline(None, rounded, space, atol=1e-5)
    space.check_point(spline.points)
    assert np.max(space.distance(spline.points, exact)) < 1e-5
    assert ss.fit_many([(None, rounded)], space, atol=1e-5) == [spline]
    raises(r"off the space.*within 1e-7 are", ss.CubicSpline, None, rounded, space, atol=1e-7)


@loop_over("atol", [-1, 1, np.nan, "1e-5", True, [1e-5]])
def test_invalid_atol_raises(atol):
    fit_error("atol must be a number from 0 to 1, not", atol=atol)


@every_common
@loop_over("bc_type", ["natural", "clamped", "not-a-knot", "periodic"])
@loop_over("n", [2, 3, 4, 30])
def test_a_curve_that_stands_still(space, bc_type, n):
    p = each(lambda q: np.repeat(q, n, axis=0), points_on(space, 1))
    spline = ss.CubicSpline(None, p, space, bc_type=bc_type)
    assert spline.report.converged
    x = np.linspace(0, n - 1, 50)
    here = each(lambda q: q[0], p)
    assert largest_difference(spline(x), here) < 20 * EPS
    for nu in (1, 2):
        # Rounding of points, which the hyperboloid counts squared, over h or h².
        assert largest_difference(spline(x, nu=nu), each(np.zeros_like, here)) < 500 * EPS


@pytest.mark.parametrize("space", COMMON[:3], ids=str)
@loop_over("size", [1e-9, 1e-12, 1e-15, 1e-100])
@pytest.mark.parametrize("bc_type", ["natural", "clamped", "not-a-knot"])
def test_points_a_hair_apart_are_as_in_flat_space(space, size, bc_type):
    rng = np.random.default_rng(3)
    p = points_on(space, 1)[0]
    t = np.array([0.0, 1, 1.5, 3, 4, 4.5])
    v = size * space.random_tangent(rng, np.broadcast_to(p, (6, *p.shape)))
    spline = ss.CubicSpline(t, space.exp(p, v), space, bc_type=bc_type)
    assert spline.report.converged
    flat, x = FlatSpline(t, v, bc_type=bc_type), np.linspace(0, 4.5, 30)
    # Curvature counts with size³; what is left is the rounding of points.
    assert largest_difference(spline(x), p + flat(x)) < 20 * EPS
    assert largest_difference(spline(x, nu=1), flat(x, 1)) < 200 * EPS
