"""The public interface, sentence by sentence: what goes in, what comes out, and of what shape."""

import copy
import io
import os
import pickle
import sys
import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from curves import (
    EPS,
    SPACES,
    at_node,
    each,
    largest_difference,
    parts,
    points_on,
    run_python,
    same,
    same_curve,
    tangents_at,
)
from numpy.polynomial import Polynomial
from scipy.integrate import quad
from scipy.interpolate import CubicSpline as FlatSpline

import symspline as ss

every_space = pytest.mark.parametrize("space", SPACES, ids=str)
every_curved = pytest.mark.parametrize("space", [s for s in SPACES if not isinstance(s, ss.Product)], ids=str)
every_batch = pytest.mark.parametrize("batch", [(), (4,), (2, 3)], ids=str)
EPOCH = 1_700_000_000_000_000_000
S2 = ss.Sphere(2)
THREE = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
KNOTS = np.array([0.0, 1.0, 1.5, 3.0, 4.0, 4.5])


def shapes(value):
    return tuple(np.shape(part) for part in parts(value))


def point_shapes(space):
    return space.point_shape if isinstance(space, ss.Product) else (space.point_shape,)


def round_trip(spline):
    file = io.BytesIO()
    spline.save(file)
    file.seek(0)
    return ss.load(file)


@pytest.fixture
def threads():
    """Puts the number of threads back."""
    yield
    ss.set_num_threads(0)


# ---- times ----


def test_t_none_counts_from_zero():
    p = points_on(S2, 5)
    spline = ss.CubicSpline(None, p, S2)
    assert same(spline.t, np.arange(5.0))
    assert spline == ss.CubicSpline(np.arange(5.0), p, S2)


def test_one_row_of_times_serves_all_curves():
    p = points_on(S2, 6, (2, 3))
    spline = ss.CubicSpline(KNOTS, p, S2)
    assert spline.t.shape == (6,)
    for i in np.ndindex(2, 3):
        assert same(spline.velocities[i], ss.CubicSpline(KNOTS, p[i], S2).velocities)


def test_every_curve_may_have_its_own_times():
    p = points_on(S2, 5, (2, 3))
    t = np.cumsum(np.random.default_rng(0).uniform(0.5, 2, (2, 3, 5)), axis=-1)
    spline = ss.CubicSpline(t, p, S2)
    assert same(spline.t, t)
    for i in np.ndindex(2, 3):
        assert same(spline.velocities[i], ss.CubicSpline(t[i], p[i], S2).velocities)


@pytest.mark.parametrize("dtype", ["i1", "u4", "i8", "u8", ">i4", "f2", "f4", "f8", ">f8"])
def test_times_of_any_number_type(dtype):
    p = points_on(S2, 4)
    spline = ss.CubicSpline(np.array([0, 1, 3, 4], dtype), p, S2)
    assert spline.t.dtype == np.float64
    assert spline == ss.CubicSpline([0, 1, 3, 4], p, S2)
    assert same(spline(np.array([1, 4], dtype)), spline([1.0, 4.0]))


@pytest.mark.parametrize("dtype", ["i8", "u8"])
def test_epoch_nanoseconds_lose_nothing(dtype):
    p, small = points_on(S2, 4), np.array([0, 1, 3, 4])
    t = np.array(EPOCH + small, dtype)
    spline, reference = ss.CubicSpline(t, p, S2), ss.CubicSpline(small, p, S2)
    assert same(spline.velocities, reference.velocities)
    assert spline.t.dtype.kind in "iu" and np.array_equal(spline.t, t)
    assert same(spline(t), reference(small))
    assert same(spline(t[1], nu=1), reference(1, nu=1))


@pytest.mark.parametrize("kind", ["int", "date"])
def test_epoch_nanoseconds_lose_nothing_in_every_row(kind):
    p, small = points_on(S2, 4, (2,)), np.array([0, 1, 3, 4])
    t = np.stack([small, EPOCH + small])
    if kind == "date":
        t = t.astype("M8[ns]")
    reference = ss.CubicSpline(small * (1e-9 if kind == "date" else 1), p, S2)
    spline = ss.CubicSpline(t, p, S2)
    assert np.array_equal(spline.t, t)
    assert (
        largest_difference(
            spline.velocities / reference.velocities.max(), reference.velocities / reference.velocities.max()
        )
        < 1e-14
    )
    # The short way of saying it: no row is rounded to the grid of doubles near 2000.


def test_unsigned_times_are_shown_as_given():
    t = np.array([2**63 + 1, 2**63 + 2, 2**63 + 4], np.uint64)
    assert ss.CubicSpline(t, THREE, S2).t.tolist() == t.tolist()


UNITS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0, "m": 60.0, "h": 3600.0, "D": 86400.0, "W": 604800.0}


@pytest.mark.parametrize("unit", UNITS)
def test_dates_give_rates_per_second(unit):
    p, ticks = points_on(S2, 4), np.array([0, 1, 3, 4])
    t = np.datetime64("2024-02-29", unit) + ticks.astype(f"m8[{unit}]")
    # Division by 10⁹ and multiplication with 10⁻⁹ differ in the last bit.
    reference = ss.CubicSpline(ticks * UNITS[unit], p, S2)
    spline = ss.CubicSpline(t, p, S2)
    assert spline.t.dtype == t.dtype and np.array_equal(spline.t, t)
    scale = np.abs(reference.velocities).max()
    assert largest_difference(spline.velocities, reference.velocities) < 1e-14 * scale
    assert largest_difference(spline(t), p) < 4 * EPS
    middle = t[0] + (t[-1] - t[0]) // 2
    speed = reference.speed(2 * UNITS[unit])
    assert spline.speed(middle) == pytest.approx(speed, rel=1e-13)


def test_dates_are_evaluated_at_finer_and_coarser_dates():
    t = np.array(["2024-01-01", "2024-01-02", "2024-01-04", "2024-01-05"], "M8[D]")
    spline = ss.CubicSpline(t, points_on(S2, 4), S2)
    flat = ss.CubicSpline([0, 1, 3, 4], points_on(S2, 4), S2)
    for x, day in [("2024-01-01T12", 0.5), ("2024-01-02T06:00:00.000000000", 1.25), ("2024-01-03", 2)]:
        assert largest_difference(spline(np.datetime64(x)), flat(day)) < 4 * EPS
    assert spline([np.datetime64("2024-01-03"), np.datetime64("2024-01-02T01")]).shape == (2, 3)


def test_months_and_years_become_days():
    spline = ss.CubicSpline(np.array(["2024-01", "2024-02", "2024-04"], "M8[M]"), THREE, S2)
    assert np.array_equal(spline.t, np.array(["2024-01-01", "2024-02-01", "2024-04-01"], "M8[D]"))


def test_dates_in_different_units_far_apart():
    t = np.array(["1500-01-01", "1500-01-02", "2500-01-04"], "M8[D]")
    spline = ss.CubicSpline(t, [[0.0], [1.0], [2.0]], "r:1")
    assert same(spline(np.datetime64("2000-01-01", "ns")), spline(np.datetime64("2000-01-01", "D")))


# ---- points ----


@every_space
@every_batch
def test_leading_axes_are_independent_curves(space, batch):
    p = points_on(space, 6, batch)
    spline = ss.CubicSpline(KNOTS, p, space)
    assert shapes(spline.points) == shapes(spline.velocities) == shapes(p)
    for i in np.ndindex(*batch):
        alone = ss.CubicSpline(KNOTS, each(lambda q, i=i: q[i], p), space)
        assert same(each(lambda u, i=i: u[i], spline.velocities), alone.velocities)


def test_a_product_speaks_in_tuples():
    space = ss.Product(ss.Sphere(3), ss.Euclidean(2))
    p = points_on(space, 5)
    spline = ss.CubicSpline(None, p, space)
    x = [0.5, 2.0]
    for value in (spline.points, spline.velocities, spline.control_points, spline(0.5), spline(x, nu=1)):
        assert isinstance(value, tuple) and len(value) == 2
    assert shapes(spline(x)) == ((2, 4), (2, 2))
    for i, factor in enumerate(space.factors):
        alone = ss.CubicSpline(None, p[i], factor)
        assert all(same(spline(x, nu=nu)[i], alone(x, nu=nu)) for nu in range(3))
    assert spline == ss.CubicSpline(None, list(p), space)


@pytest.mark.parametrize("dtype", [int, "i1", "u8", "f2", "f4", ">f8", bool])
def test_points_of_any_number_type(dtype):
    p = np.array(THREE, dtype)
    spline = ss.CubicSpline(None, p, S2)
    assert spline.points.dtype == spline.velocities.dtype == spline(0.5).dtype == np.float64
    assert spline == ss.CubicSpline(None, THREE, S2)


@every_space
def test_lists_are_fine(space):
    p = points_on(space, 4)
    assert ss.CubicSpline([0, 1, 2, 3], each(np.ndarray.tolist, p), space) == ss.CubicSpline(None, p, space)


@every_space
def test_any_memory_layout(space):
    p = points_on(space, 6, (4,))
    reference = ss.CubicSpline(KNOTS, p, space)

    def strided(a):
        wide = np.full((*a.shape, 2), 7.0)
        wide[..., 0] = a
        return wide[..., 0]

    layouts = [np.asfortranarray, strided, lambda a: np.ascontiguousarray(a[:, ::-1])[:, ::-1]]
    for layout in layouts:
        q = each(layout, p)
        assert same_curve(ss.CubicSpline(strided(KNOTS), q, space), reference)
    assert same(reference(strided(np.array([0.5, 2.0]))), reference([0.5, 2.0]))


@every_space
def test_input_is_never_changed(space):
    # Slightly off the space, so that there is something to change.
    p = each(lambda q: q * (1 + 1e-9), points_on(space, 6))
    v = tangents_at(space, at_node(space, p, 0))
    t, x = KNOTS.copy(), np.array([3.0, 0.1])
    arrays = [t, x, *parts(p), *parts(v)]
    copies = [a.copy() for a in arrays]
    spline = ss.CubicSpline(t, p, space, bc_type=((1, v), "natural"))
    spline(x), spline(x, nu=2), spline.length(), spline.control_points
    ss.evaluate(x, t, p, spline.velocities, space)
    space.project(p), space.exp(at_node(space, p, 0), v)
    assert all(same(a, b) for a, b in zip(arrays, copies, strict=True))


@every_space
def test_read_only_input(space):
    p, t = points_on(space, 6), KNOTS.copy()
    reference = ss.CubicSpline(t, p, space)
    for array in (t, *parts(p)):
        array.flags.writeable = False
    assert same_curve(ss.CubicSpline(t, p, space), reference)


def test_a_spline_does_not_depend_on_its_input_arrays():
    p, t, v = points_on(S2, 6), KNOTS.copy(), np.zeros(3)
    spline = ss.CubicSpline(t, p, S2, bc_type=((1, v), "natural"))
    points, knots = spline.points.copy(), spline.t.copy()
    p[:], t[:] = 7, 7
    assert same(spline.points, points) and same(spline.t, knots)


def test_end_conditions_do_not_depend_on_their_input_array():
    v = np.array([0.0, 0.1, 0.0])
    spline = ss.CubicSpline(None, THREE, S2, bc_type=((1, v), "natural"))
    v[:] = 7
    assert same(spline.bc_type[0][1], np.array([0.0, 0.1, 0.0]))


@pytest.mark.parametrize("dtype, off", [("f8", 9e-9), ("f4", 9e-5)])
def test_points_nearly_on_the_space_are_projected(dtype, off):
    p = points_on(S2, 5)
    spline = ss.CubicSpline(None, (p * (1 + off)).astype(dtype), S2)
    assert np.abs(np.linalg.norm(spline.points, axis=-1) - 1).max() <= 2 * EPS
    assert np.abs(spline.points - p).max() < 1.2 * np.finfo(dtype).eps
    h = points_on(ss.Hyperbolic(2), 5)
    spline = ss.CubicSpline(None, (h * [1 + off, 1, 1]).astype(dtype), "h:2")
    squares = spline.points**2 @ [-1, 1, 1]
    assert np.abs(squares + 1).max() <= 8 * EPS * np.square(h).max()


@pytest.mark.parametrize("dtype, off", [("f8", 1.1e-8), ("f4", 1.1e-4)])
def test_points_farther_off_are_an_error(dtype, off):
    p = points_on(S2, 5)
    with pytest.raises(ss.ValidationError, match=r"points\[0\] is off the space by 1\.1\d+e-[48]"):
        ss.CubicSpline(None, (p * (1 + off)).astype(dtype), S2)


@every_space
def test_the_curve_passes_through_its_points(space):
    spline = ss.CubicSpline(KNOTS, points_on(space, 6), space)
    assert largest_difference(spline(KNOTS), spline.points) < 20 * EPS


def test_check_false_gives_the_same_curve():
    p = points_on(S2, 6)
    checked, unchecked = (ss.CubicSpline(KNOTS, p, S2, check=c) for c in (True, False))
    # Checking projects once more, which may turn a last bit.
    assert np.abs(checked.velocities - unchecked.velocities).max() < 20 * EPS


def test_check_false_skips_the_checks():
    assert same(ss.CubicSpline(None, 2 * np.eye(3), S2, check=False).points, 2 * np.eye(3))


# ---- end conditions ----


def held_at(space, spline, e, end):
    """How far an end condition is from being fulfilled: end 0 or -1."""
    if end == "not-a-knot":
        return 0.0
    p = at_node(space, spline.points, e)
    order, vector = (
        {"natural": (2, None), "clamped": (1, None)}.get(end, end) if isinstance(end, str) else end
    )
    found = spline(spline.t[e], nu=order)
    wanted = vector if vector is not None else each(np.zeros_like, p)
    return largest_difference(found, np.broadcast_to(wanted, found.shape) if space is S2 else wanted)


def ends_for(space, p, e):
    q = at_node(space, p, e)
    v, a = tangents_at(space, q, seed=3), tangents_at(space, q, seed=4)
    return ["natural", "clamped", "not-a-knot", (1, v), (2, a)]


@every_space
@pytest.mark.parametrize("left", range(5))
@pytest.mark.parametrize("right", range(5))
def test_every_pair_of_end_conditions(space, left, right):
    p = points_on(space, 6)
    bc_type = (ends_for(space, p, 0)[left], ends_for(space, p, -1)[right])
    spline = ss.CubicSpline(KNOTS, p, space, bc_type=bc_type)
    assert spline.report.converged
    # The acceleration at a knot is known to 50 ε/h².
    assert held_at(space, spline, 0, bc_type[0]) < 1e-12
    assert held_at(space, spline, -1, bc_type[1]) < 1e-12


@pytest.mark.parametrize("word", ["natural", "clamped", "not-a-knot"])
def test_a_word_holds_at_both_ends(word):
    p = points_on(S2, 6)
    spline = ss.CubicSpline(KNOTS, p, S2, bc_type=word)
    assert spline.bc_type == word
    assert same_curve(spline, ss.CubicSpline(KNOTS, p, S2, bc_type=(word, word)))
    assert same_curve(spline, ss.CubicSpline(KNOTS, p, S2, bc_type=[word, word]))


def test_natural_is_the_default():
    p = points_on(S2, 6)
    assert ss.CubicSpline(KNOTS, p, S2) == ss.CubicSpline(KNOTS, p, S2, bc_type="natural")
    assert ss.CubicSpline(KNOTS, p, S2).bc_type == "natural"


@every_space
def test_bare_clamped_is_zero_velocity(space):
    p = points_on(space, 6)
    zero = each(np.zeros_like, at_node(space, p, 0))
    spline = ss.CubicSpline(KNOTS, p, space, bc_type="clamped")
    assert same_curve(spline, ss.CubicSpline(KNOTS, p, space, bc_type=((1, zero), (1, zero))))
    assert spline.speed(KNOTS[[0, -1]]).max() < 4 * EPS


def test_a_given_velocity_is_kept_to_the_last_bits():
    p = points_on(S2, 6)
    v, w = tangents_at(S2, p[0]), tangents_at(S2, p[-1])
    spline = ss.CubicSpline(KNOTS, p, S2, bc_type=((1, v), (1, w)))
    assert np.abs(spline.velocities[0] - v).max() < 4 * EPS
    assert np.abs(spline.velocities[-1] - w).max() < 4 * EPS


@every_space
def test_periodic_is_smooth_across_the_seam(space):
    p = each(lambda q: np.concatenate([q, q[:1]]), points_on(space, 5))
    spline = ss.CubicSpline(KNOTS, p, space, bc_type="periodic")
    for nu in range(3):
        assert largest_difference(spline(KNOTS[0], nu=nu), spline(KNOTS[-1], nu=nu)) < 1e-12


@pytest.mark.parametrize(
    "bc_type", ["natural", "clamped", "not-a-knot", ((1, [1.0, 2]), (2, [0.5, -1]))], ids=str
)
def test_end_conditions_mean_what_they_mean_in_scipy(bc_type):
    p = points_on(ss.Euclidean(2), 6)
    spline, flat = ss.CubicSpline(KNOTS, p, "r:2", bc_type=bc_type), FlatSpline(KNOTS, p, bc_type=bc_type)
    assert np.abs(spline.velocities - flat(KNOTS, 1)).max() < 1e-13


@pytest.mark.parametrize("shape", [(), (3,), (1,), (2, 1), (1, 3), (2, 3)], ids=str)
@pytest.mark.parametrize("order", [1, 2])
def test_end_vectors_broadcast_to_the_batch(shape, order):
    p = np.array(points_on(S2, 6, (2, 3)))
    # One start for all curves, so that one vector is tangent to all.
    p[..., 0, :] = p[0, 0, 0]
    v = tangents_at(S2, np.broadcast_to(p[0, 0, 0], (*shape, 3)))
    spline = ss.CubicSpline(KNOTS, p, S2, bc_type=((order, v), "natural"))
    for i in np.ndindex(2, 3):
        own = np.broadcast_to(v, (2, 3, 3))[i]
        alone = ss.CubicSpline(KNOTS, p[i], S2, bc_type=((order, own), "natural"))
        assert same(spline.velocities[i], alone.velocities)


# ---- methods ----


@every_space
def test_methods_agree(space):
    p = points_on(space, 6)
    reference = ss.CubicSpline(KNOTS, p, space)
    for method in ("fixed-point", "quasi-newton"):
        spline = ss.CubicSpline(KNOTS, p, space, method=method)
        assert spline.report.method == method
        assert spline.report.converged
        assert largest_difference(spline.velocities, reference.velocities) < 1e-12


def test_newton_is_a_method():
    p = points_on(S2, 6)
    newton, auto = (ss.CubicSpline(KNOTS, p, S2, method=method) for method in ("newton", "auto"))
    assert newton.report.method == "newton"
    assert newton.report.iterations < auto.report.iterations
    assert largest_difference(newton.velocities, auto.velocities) < 1e-12


def test_tol_and_max_iter_bound_the_work():
    p = points_on(S2, 6)
    fine, rough = (ss.CubicSpline(KNOTS, p, S2, tol=tol).report for tol in (1e-12, 1e-3))
    assert rough.iterations < fine.iterations
    assert fine.residual <= 1e-12 and rough.residual <= 1e-3
    few = ss.CubicSpline(KNOTS, p, S2, max_iter=2, on_failure="ignore").report
    assert few.iterations == 2 and not few.converged
    enough = ss.CubicSpline(KNOTS, p, S2, max_iter=fine.iterations).report
    assert enough.converged


# ---- evaluation ----


@every_space
@every_batch
def test_shape_of_the_result(space, batch):
    spline = ss.CubicSpline(KNOTS, points_on(space, 6, batch), space)
    for x_shape in [(), (0,), (5,), (2, 3), (2, 0, 3), (1, 1, 1)]:
        x = np.full(x_shape, 0.7)
        for nu in range(3):
            assert shapes(spline(x, nu=nu)) == tuple(batch + x_shape + s for s in point_shapes(space))
        assert spline.speed(x).shape == batch + x_shape


@every_space
def test_any_order_of_times(space):
    spline = ss.CubicSpline(KNOTS, points_on(space, 6, (2,)), space)
    x = np.random.default_rng(2).uniform(0, 4.5, (3, 50))
    order = np.argsort(x, axis=None)
    for nu in range(3):
        at_once = spline(x, nu=nu)
        sorted_ones = spline(x.ravel()[order], nu=nu)
        flat = each(lambda y: y.reshape(2, 150, *y.shape[3:])[:, order], at_once)
        assert same(flat, sorted_ones)


@pytest.mark.parametrize("x", [2, 2.0, np.float32(2), np.int8(2), np.array(2.0), True + 1], ids=repr)
def test_one_time_gives_one_point(x):
    spline = ss.CubicSpline(KNOTS, points_on(S2, 6), S2)
    assert same(spline(x), spline([2.0])[0])


def test_many_times_equal_one_by_one():
    spline = ss.CubicSpline(KNOTS, points_on(S2, 6), S2)
    x = np.linspace(0, 4.5, 37)
    for nu in range(3):
        assert same(spline(x, nu=nu), np.array([spline(y, nu=nu) for y in x]))


@every_space
def test_per_curve(space):
    spline = ss.CubicSpline(KNOTS, points_on(space, 6, (2, 3)), space)
    for own in [(), (4,), (2, 2)]:
        x = np.random.default_rng(1).uniform(0, 4.5, (2, 3, *own))
        value, speed = spline(x, nu=1, per_curve=True), spline.speed(x, per_curve=True)
        assert shapes(value) == tuple(x.shape + s for s in point_shapes(space))
        assert speed.shape == x.shape
        for i, j in np.ndindex(2, 3):
            assert same(each(lambda v, i=i, j=j: v[i, j], value), spline[i][j](x[i, j], nu=1))


def test_per_curve_of_one_curve_changes_nothing():
    spline = ss.CubicSpline(KNOTS, points_on(S2, 6), S2)
    assert same(spline([0.5, 2], per_curve=True), spline([0.5, 2]))


@every_space
def test_speed_is_the_norm_of_the_velocity(space):
    spline = ss.CubicSpline(KNOTS, points_on(space, 6, (2,)), space)
    x = np.linspace(0, 4.5, 20)
    assert np.allclose(spline.speed(x), space.norm(spline(x), spline(x, nu=1)), rtol=1e-13, atol=0)


# ---- extrapolation ----


def bezier(space, control, tau):
    """De Casteljau's algorithm with geodesics, (8)."""
    while len(control) > 1:
        control = [space.geodesic(p, q, tau) for p, q in pairwise(control)]
    return control[0]


def control_points_of(space, spline, i):
    return [at_node(space, each(lambda c: c[i], spline.control_points), k) for k in range(4)]


OUTSIDE = [-0.5, 5.25]


@every_space
def test_none_raises_outside(space):
    spline = ss.CubicSpline(KNOTS, points_on(space, 6), space)
    for x in OUTSIDE:
        with pytest.raises(ss.ValidationError, match="outside the knots"):
            spline(x)
        with pytest.raises(ss.ValidationError, match="outside the knots"):
            spline.speed(x)


@every_space
def test_true_continues_the_last_segment(space):
    spline = ss.CubicSpline(KNOTS, points_on(space, 6), space, extrapolate=True)
    first = bezier(space, control_points_of(space, spline, 0), -0.5)
    last = bezier(space, control_points_of(space, spline, -1), 2.5)
    assert largest_difference(spline(OUTSIDE[0]), first) < 1e-13
    assert largest_difference(spline(OUTSIDE[1]), last) < 1e-13


def test_true_is_scipys_in_flat_space():
    p = points_on(ss.Euclidean(2), 6)
    spline, flat = ss.CubicSpline(KNOTS, p, "r:2", extrapolate=True), FlatSpline(KNOTS, p, bc_type="natural")
    for nu in range(3):
        assert np.abs(spline(OUTSIDE, nu=nu) - flat(OUTSIDE, nu)).max() < 1e-12


@every_space
def test_geodesic_goes_on_with_constant_velocity(space):
    spline = ss.CubicSpline(KNOTS, points_on(space, 6), space, bc_type="not-a-knot", extrapolate="geodesic")
    for x, e in zip(OUTSIDE, (0, -1), strict=True):
        p, u = at_node(space, spline.points, e), at_node(space, spline.velocities, e)
        reached = space.exp(p, each(lambda v, x=x, e=e: (x - KNOTS[e]) * v, u))
        assert largest_difference(spline(x), reached) < 20 * EPS
        assert spline.speed(x) == pytest.approx(space.norm(p, u), rel=1e-13)
        assert largest_difference(spline(x, nu=1), space.transport(p, reached, u)) < 1e-13
        assert largest_difference(spline(x, nu=2), each(np.zeros_like, u)) < 1e-13


@every_space
@pytest.mark.parametrize(
    "bc_type, extrapolate", [("periodic", None), ("periodic", "periodic"), ("natural", "periodic")]
)
def test_periodic_wraps(space, bc_type, extrapolate):
    p = each(lambda q: np.concatenate([q, q[:1]]), points_on(space, 5))
    # A period that doubles hold exactly, so that wrapping rounds nothing.
    spline = ss.CubicSpline(np.arange(6) * 0.5, p, space, bc_type=bc_type, extrapolate=extrapolate)
    x = np.array([0.25, 1.75, 2.0])
    for rounds in (-4, -1, 1, 10):
        for nu in range(3):
            assert same(spline(x + 2.5 * rounds, nu=nu), spline(x, nu=nu))


@every_space
def test_the_policy_of_a_call_wins(space):
    p = points_on(space, 6)
    plain = ss.CubicSpline(KNOTS, p, space)
    for policy in (True, "geodesic", "periodic"):
        spline = ss.CubicSpline(KNOTS, p, space, extrapolate=policy)
        assert spline.extrapolate == policy
        assert same(spline(OUTSIDE), plain(OUTSIDE, extrapolate=policy))
        assert same(spline.speed(OUTSIDE), plain.speed(OUTSIDE, extrapolate=policy))
        assert same(spline(OUTSIDE, extrapolate="geodesic"), plain(OUTSIDE, extrapolate="geodesic"))


@every_space
@pytest.mark.parametrize("policy", [None, True, "geodesic", "periodic"])
def test_policies_differ_only_outside(space, policy):
    spline, x = ss.CubicSpline(KNOTS, points_on(space, 6), space), np.linspace(0, 4.5, 31)
    for nu in range(3):
        assert same(spline(x, nu=nu, extrapolate=policy), spline(x, nu=nu))


def test_dates_extrapolate_too():
    t = np.datetime64("2024-01-01") + np.arange(4)
    spline = ss.CubicSpline(t, points_on(S2, 4), S2, extrapolate="periodic")
    assert largest_difference(spline(t[1] + 3), spline(t[1])) < 4 * EPS


# ---- failures ----


def failing(kind):
    """Three curves of which the middle one fails, and the options with which it does."""
    good = points_on(S2, 20, (3,), step=0.2)
    if kind == "cut locus":
        good[1, 4] = -good[1, 3]
        return good, {}
    # Steps this long take Algorithm 1 hundreds of sweeps, short ones about forty.
    good[1] = points_on(S2, 20, step=2.2, seed=3)
    return good, {"method": "fixed-point", "max_iter": 60}


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
    with pytest.raises((ss.CutLocusError, ss.ConvergenceError), match=r"put more points|choose times"):
        ss.CubicSpline(t, circle, S2)


# ---- the report ----

FIELDS = [
    "method",
    "converged",
    "iterations",
    "residual",
    "max_step",
    "curvature",
    "invariant_radius",
    "rate",
]


@every_space
def test_report_of_one_curve(space):
    p = points_on(space, 6, step=0.8)
    report = ss.CubicSpline(KNOTS, p, space).report
    assert list(vars(report)) == FIELDS
    assert report.method in ("fixed-point", "quasi-newton", "newton")
    assert report.converged is True
    assert isinstance(report.iterations, int) and report.iterations >= 1
    assert 0 <= report.residual <= 1e-12
    assert report.curvature == space.curvature
    assert 0 <= report.rate < 1


@every_curved
@every_batch
def test_max_step_is_the_longest_distance(space, batch):
    p = points_on(space, 6, batch) * 1.0
    p[..., 3, :] = space.exp(p[..., 2, :], 1.4 * space.log(p[..., 2, :], p[..., 3, :]))
    steps = space.distance(p[..., :-1, :], p[..., 1:, :]).max(axis=-1)
    found = ss.CubicSpline(KNOTS, p, space).report.max_step
    assert np.allclose(found, steps, rtol=1e-13, atol=0)


def test_max_step_of_a_product():
    space = ss.Product("r:1", "r:1")
    p = np.array([[0.0], [3], [3]]), np.array([[0.0], [0], [4]])
    # The steps are 3 and 4; no two neighbours are 5 apart.
    assert ss.CubicSpline(None, p, space).report.max_step == pytest.approx(4)


@every_space
@pytest.mark.parametrize("batch", [(1,), (4,), (2, 3)], ids=str)
def test_report_of_a_batch(space, batch):
    report = ss.CubicSpline(KNOTS, points_on(space, 6, batch), space).report
    for name in ("converged", "iterations", "residual", "max_step", "rate"):
        assert getattr(report, name).shape == batch
    assert report.converged.dtype == bool and report.iterations.dtype.kind == "i"
    assert isinstance(report.method, str) and report.curvature == space.curvature


@every_space
@every_batch
def test_report_reads_as_one_line(space, batch):
    spline = ss.CubicSpline(KNOTS, points_on(space, 6, batch), space)
    line = str(spline.report)
    assert "\n" not in line and 20 < len(line) < 160
    assert "converged" in line and spline.report.method in line


def test_report_says_what_failed():
    p, options = failing("cut locus")
    spline = ss.CubicSpline(None, p, S2, on_failure="ignore", **options)
    assert "2 of 3 curves converged" in str(spline.report)
    assert "NOT converged" in str(spline[1].report)


def test_invariant_radius_of_close_points():
    # (38) has a solution V exactly if KD ≤ 0.2610895, where KV = 0.4420886.
    spline = ss.CubicSpline(None, points_on(S2, 6, step=0.26), S2)
    assert 0 < spline.report.invariant_radius < 0.4420887


def test_no_invariant_radius_for_far_points():
    assert ss.CubicSpline(None, points_on(S2, 6, step=0.27), S2).report.invariant_radius is None


# ---- spaces ----

OPERATIONS = {
    "exp": lambda s, p, q, u, v: s.exp(p, u),
    "log": lambda s, p, q, u, v: s.log(p, q),
    "geodesic": lambda s, p, q, u, v: s.geodesic(p, q, 0.3),
    "distance": lambda s, p, q, u, v: s.distance(p, q),
    "transvection": lambda s, p, q, u, v: s.transvection(p, u, q),
    "transport": lambda s, p, q, u, v: s.transport(p, q, u),
    "inner": lambda s, p, q, u, v: s.inner(p, u, v),
    "norm": lambda s, p, q, u, v: s.norm(p, u),
    "project": lambda s, p, q, u, v: s.project(p),
    "project_tangent": lambda s, p, q, u, v: s.project_tangent(p, u),
}
# The leading axes of the result for p of (3, 1), q of (4,), u and v of (3, 4).
LEADING = {"log": (3, 4), "project": (3, 1)}


def operands(space):
    rng = np.random.default_rng(7)
    near = points_on(space, 8, step=0.2)
    p = each(lambda a: a[:3, None], near)
    q = each(lambda a: a[4:], near)
    wide = each(lambda a: np.repeat(a, 4, axis=1), p)
    return p, q, space.random_tangent(rng, wide), space.random_tangent(rng, wide)


@every_space
@pytest.mark.parametrize("name", OPERATIONS)
def test_operations_broadcast(space, name):
    p, q, u, v = operands(space)
    result = OPERATIONS[name](space, p, q, u, v)
    lead = LEADING.get(name, (3, 4))
    if name in ("distance", "inner", "norm"):
        assert result.shape == lead
    else:
        assert shapes(result) == tuple(lead + s for s in point_shapes(space))
    for i, j in np.ndindex(*lead):
        one = [
            each(lambda a, k=k: a[k], x)
            for x, k in zip((p, q, u, v), ((i, 0), j, (i, j), (i, j)), strict=True)
        ]
        assert same(each(lambda a, i=i, j=j: a[i, j], result), OPERATIONS[name](space, *one))


@every_space
@pytest.mark.parametrize("name", OPERATIONS)
def test_operations_on_no_points(space, name):
    empty = each(lambda a: a[:0], points_on(space, 3))
    result = OPERATIONS[name](space, *[empty] * 4)
    assert shapes(result) == (
        ((0,),) if name in ("distance", "inner", "norm") else tuple((0, *s) for s in point_shapes(space))
    )


@every_space
def test_numbers_come_out_as_numbers(space):
    p, q = (at_node(space, points_on(space, 2), i) for i in (0, 1))
    v = tangents_at(space, p)
    for number in (space.distance(p, q), space.inner(p, v, v), space.norm(p, v)):
        assert isinstance(number, float)


@every_space
def test_geodesic_broadcasts_its_times(space):
    points = points_on(space, 5)
    p, q = (at_node(space, points, i) for i in (0, 1))
    t = np.linspace(0, 1, 7)
    curve = space.geodesic(p, q, t)
    assert shapes(curve) == tuple((7, *s) for s in point_shapes(space))
    assert largest_difference(at_node(space, curve, 0), p) < 4 * EPS
    assert largest_difference(at_node(space, curve, -1), q) < 8 * EPS
    assert np.allclose(space.distance(p, curve), t * space.distance(p, q), rtol=1e-13, atol=1e-15)
    many = space.geodesic(each(lambda a: a[:, None], points), q, t)
    assert shapes(many) == tuple((5, 7, *s) for s in point_shapes(space))


@every_space
def test_operations_fit_together(space):
    points = points_on(space, 5)
    p, q = (each(lambda a, k=k: a[k], points) for k in (slice(None, -1), slice(1, None)))
    v = space.log(p, q)
    assert largest_difference(space.exp(p, v), q) < 20 * EPS
    assert np.allclose(space.norm(p, v), space.distance(p, q), rtol=1e-13)
    assert np.allclose(space.inner(p, v, v), space.norm(p, v) ** 2, rtol=1e-14)
    assert largest_difference(space.transvection(p, v, p), q) < 20 * EPS
    assert largest_difference(space.transport(p, q, v), each(np.negative, space.log(q, p))) < 40 * EPS


@every_space
def test_project_and_check(space):
    p = points_on(space, 5)
    off = each(lambda a: a * (1 + 1e-6), p)
    assert largest_difference(space.project(off), p) < 1e-5
    assert space.check_point(p) is None
    assert space.check_point(space.project(off)) is None
    noise = each(np.ones_like, p)
    v = space.project_tangent(p, noise)
    assert space.check_tangent(p, v) is None
    # Coordinates on the hyperboloid are up to 20 here, and count squared.
    assert largest_difference(space.project_tangent(p, v), v) < 400 * EPS


@every_curved
def test_checks_raise(space):
    p = points_on(space, 5)
    bad = p.copy()
    bad[3] = np.nan
    with pytest.raises(ss.ValidationError, match=r"point 3 .*project"):
        space.check_point(bad)
    if space.curvature:
        with pytest.raises(ss.ValidationError, match=r"vector 0 is not tangent .*project_tangent"):
            space.check_tangent(p, p)


@every_space
@pytest.mark.parametrize("shape", [(), 3, (3,), (2, 3), 0], ids=str)
def test_random_points_and_tangents(space, shape):
    rng = np.random.default_rng(0)
    lead = (shape,) if isinstance(shape, int) else shape
    p = space.random_point(rng, shape)
    assert shapes(p) == tuple(lead + s for s in point_shapes(space))
    v = space.random_tangent(rng, p)
    assert shapes(v) == shapes(p)
    space.check_point(p)
    space.check_tangent(p, v)
    again = np.random.default_rng(0)
    assert same(space.random_point(again, shape), p)
    assert same(space.random_tangent(again, p), v)


def test_random_point_is_one_point_by_default():
    assert S2.random_point(np.random.default_rng(0)).shape == (3,)


INF = float("inf")


@pytest.mark.parametrize(
    "space, point_shape, dim, radius, curvature",
    [
        (ss.Euclidean(3), (3,), 3, INF, 0),
        (ss.Sphere(2), (3,), 2, np.pi, 1),
        (ss.Hyperbolic(2), (3,), 2, INF, 1),
        (ss.Product(ss.Sphere(3), ss.Euclidean(2)), ((4,), (2,)), 5, np.pi, 1),
        (ss.Product("h:2", "r:1", "h:3"), ((3,), (1,), (4,)), 6, INF, 1),
    ],
    ids=str,
)
def test_what_a_space_says_about_itself(space, point_shape, dim, radius, curvature):
    assert space.point_shape == point_shape
    assert space.dim == dim
    assert space.injectivity_radius == radius
    assert space.curvature == curvature


@pytest.mark.parametrize(
    "name, space",
    [
        ("euclidean:3", ss.Euclidean(3)),
        ("r:3", ss.Euclidean(3)),
        ("sphere:2", ss.Sphere(2)),
        ("Sphere:2", ss.Sphere(2)),
        ("hyperbolic:4", ss.Hyperbolic(4)),
        ("h:4", ss.Hyperbolic(4)),
        ("sphere:3 x r:3", ss.Product(ss.Sphere(3), ss.Euclidean(3))),
        ("h:2 x sphere:2 x r:1", ss.Product(ss.Hyperbolic(2), ss.Sphere(2), ss.Euclidean(1))),
    ],
)
def test_names_of_spaces(name, space):
    assert ss.space(name) == space
    assert ss.CubicSpline(None, points_on(space, 3), name).space == space


@every_space
def test_str_and_repr_read_back(space):
    assert ss.space(str(space)) == space
    assert eval(repr(space), vars(ss)) == space
    assert ss.space(space) is space


def test_names_are_the_documented_ones():
    assert [str(s) for s in SPACES] == ["euclidean:3", "sphere:2", "hyperbolic:2", "sphere:3 x euclidean:2"]
    assert repr(SPACES[3]) == "Product(Sphere(3), Euclidean(2))"


def test_a_product_of_products_is_flat():
    inner = ss.Product("sphere:2", "r:1")
    assert ss.Product(inner, "h:2") == ss.Product("sphere:2", "r:1", "h:2")


def test_numpy_integers_make_spaces():
    assert ss.Sphere(np.int64(2)) == S2 and repr(ss.Sphere(np.int8(2))) == "Sphere(2)"


# ---- splines and spaces as values ----

COPIES = {"pickle": lambda x: pickle.loads(pickle.dumps(x)), "copy": copy.copy, "deepcopy": copy.deepcopy}
every_copy = pytest.mark.parametrize("how", COPIES)


@every_space
@every_copy
def test_spaces_copy(space, how):
    made = COPIES[how](space)
    assert made == space and hash(made) == hash(space) and repr(made) == repr(space)
    assert made.dim == space.dim


def test_spaces_compare():
    assert len({*SPACES, *map(copy.copy, SPACES)}) == len(SPACES)
    assert ss.Sphere(2) != ss.Sphere(3)
    assert ss.Sphere(2) != ss.Hyperbolic(2)
    assert ss.Sphere(2) != "sphere:2"


@every_space
@every_copy
@every_batch
def test_splines_copy(space, how, batch):
    spline = ss.CubicSpline(KNOTS, points_on(space, 6, batch), space, extrapolate="geodesic")
    made = COPIES[how](spline)
    assert type(made) is type(spline) and same_curve(made, spline)
    assert (made.bc_type, made.extrapolate, made.space) == ("natural", "geodesic", space)
    assert same(made([0.3, 9.0], nu=2), spline([0.3, 9.0], nu=2))


@every_copy
def test_splines_over_dates_copy(how):
    spline = ss.CubicSpline(np.datetime64("2024-01-01") + np.arange(3), THREE, S2)
    made = COPIES[how](spline)
    assert made == spline and made.t.dtype == spline.t.dtype
    assert same(made(spline.t), spline(spline.t))


def test_the_arrays_of_a_spline_cannot_be_changed():
    spline = ss.CubicSpline(None, THREE, S2)
    for array in (spline.t, spline.points, spline.velocities):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize("how", ["pickle", "deepcopy"])
def test_the_arrays_of_a_copy_cannot_be_changed(how):
    made = COPIES[how](ss.CubicSpline(None, THREE, S2))
    assert not made.points.flags.writeable and not made.velocities.flags.writeable


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


def test_splines_compare():
    spline = ss.CubicSpline(None, THREE, S2)
    assert spline == ss.CubicSpline([0, 1, 2], THREE, "sphere:2")
    assert spline != ss.CubicSpline([0, 1, 3], THREE, S2)
    assert spline != ss.CubicSpline(None, THREE[::-1], S2)
    assert spline != ss.CubicSpline(None, THREE, S2, bc_type="clamped")
    assert spline != ss.CubicSpline(None, THREE, "r:3")
    assert spline != ss.CubicSpline(None, [THREE], S2)
    assert spline != ss.CubicSpline(None, (THREE, THREE), "sphere:2 x r:3")
    assert spline != "spline"
    with pytest.raises(TypeError, match="unhashable"):
        hash(spline)


@every_space
@every_batch
def test_splines_print(space, batch):
    line = repr(ss.CubicSpline(KNOTS, points_on(space, 6, batch), space))
    assert (
        line.startswith("<CubicSpline") and repr(space) in line and "6 points" in line and "natural" in line
    )
    assert "\n" not in line
    assert not batch or " x ".join(map(str, batch)) in line


# ---- a batch as a sequence ----


@every_space
def test_a_batch_is_a_sequence(space):
    p = points_on(space, 6, (4, 2))
    spline = ss.CubicSpline(KNOTS, p, space)
    assert len(spline) == 4
    for i in (0, 3, -1, np.int64(2)):
        assert same_curve(spline[i], ss.CubicSpline(KNOTS, each(lambda q, i=i: q[i], p), space))
    assert same_curve(spline[1][-1], ss.CubicSpline(KNOTS, each(lambda q: q[1, 1], p), space))
    for part in (slice(1, 3), slice(None, None, -1), slice(0, 4, 2), slice(3, None)):
        assert same_curve(spline[part], ss.CubicSpline(KNOTS, each(lambda q, s=part: q[s], p), space))
    assert [len(one) for one in spline] == [2] * 4
    with pytest.raises(IndexError):
        spline[4]
    with pytest.raises(IndexError):
        spline[-5]


def test_own_times_are_picked_with_the_curve():
    t = np.array([[0.0, 1, 2], [5, 7, 8]])
    spline = ss.CubicSpline(t, [THREE, THREE], S2)
    assert same(spline[1].t, t[1])
    assert same(spline[1](6.5), spline([[1.0], [6.5]], per_curve=True)[1, 0])
    dates = ss.CubicSpline(t.astype("M8[s]"), [THREE, THREE], S2)
    assert same(dates[1](np.datetime64(7, "s")), dates[1].points[1])


def test_one_curve_is_no_sequence():
    spline = ss.CubicSpline(None, THREE, S2)
    for use in (len, iter, lambda s: s[0]):
        with pytest.raises(TypeError, match="batch"):
            use(spline)
    batch = ss.CubicSpline(None, [THREE] * 2, S2)
    for index in ("0", 0.0, (0, 1), None):
        with pytest.raises(TypeError, match="whole number or a slice"):
            batch[index]


@pytest.mark.parametrize(
    "shape",
    [
        (2, 3),
        (3,),
        (1, 3),
    ],
    ids=str,
)
def test_picked_curves_know_their_end_conditions(shape):
    v = np.broadcast_to([0, 0.1, 0.2], shape)
    spline = ss.CubicSpline(None, [THREE, THREE], S2, bc_type=((1, v), (2, np.zeros(shape))))
    one = spline[1]
    assert same_curve(ss.CubicSpline(one.t, one.points, S2, bc_type=one.bc_type), one)
    some = spline[:1]
    assert same_curve(ss.CubicSpline(some.t, some.points, S2, bc_type=some.bc_type), some)


def test_a_slice_may_be_empty():
    none = ss.CubicSpline(None, [THREE, THREE], S2)[2:]
    assert len(none) == 0 and none(0.5).shape == (0, 3) and "0 curves" in repr(none)


@pytest.mark.parametrize("use", [lambda s: str(s.report), lambda s: s.length()], ids=["report", "length"])
def test_an_empty_slice_can_be_used(use):
    use(ss.CubicSpline(None, [THREE, THREE], S2)[2:])


# ---- control points, length, energy ----


@every_space
@every_batch
def test_control_points(space, batch):
    spline = ss.CubicSpline(KNOTS, points_on(space, 6, batch), space)
    control = spline.control_points
    assert shapes(control) == tuple((*batch, 5, 4, *s) for s in point_shapes(space))
    i = tuple(0 for _ in batch)
    for k, h in enumerate(np.diff(KNOTS)):
        p, q, r, s = (at_node(space, each(lambda c, i=i, k=k: c[i][k], control), j) for j in range(4))
        ends = [at_node(space, each(lambda c, i=i: c[i], spline.points), j) for j in (k, k + 1)]
        u, w = (at_node(space, each(lambda c, i=i: c[i], spline.velocities), j) for j in (k, k + 1))
        assert same(p, ends[0]) and same(s, ends[1])
        assert largest_difference(q, space.exp(p, each(lambda v, h=h: v * h / 3, u))) < 20 * EPS
        assert largest_difference(r, space.exp(s, each(lambda v, h=h: -v * h / 3, w))) < 20 * EPS
        middle = each(lambda x, i=i: x[i], spline(KNOTS[k] + 0.4 * h))
        assert largest_difference(middle, bezier(space, [p, q, r, s], 0.4)) < 20 * EPS


@every_space
def test_length_and_energy_by_quadrature(space):
    spline = ss.CubicSpline(KNOTS, points_on(space, 6), space, bc_type="not-a-knot")

    def bend(x):
        return space.norm(spline(x), spline(x, nu=2)) ** 2

    for found, f in ((spline.length(), spline.speed), (spline.bending_energy(), bend)):
        assert isinstance(found, float)
        pieces = [quad(f, *span, epsabs=1e-13, epsrel=1e-13)[0] for span in pairwise(KNOTS)]
        assert found == pytest.approx(sum(pieces), rel=1e-12)


@every_space
@every_batch
def test_length_and_energy_of_a_batch(space, batch):
    p = points_on(space, 6, batch)
    t = np.cumsum(np.random.default_rng(0).uniform(0.5, 2, (*batch, 6)), axis=-1)
    spline = ss.CubicSpline(t, p, space)
    length, energy = spline.length(), spline.bending_energy()
    assert np.shape(length) == np.shape(energy) == batch
    for i in np.ndindex(*batch):
        alone = ss.CubicSpline(t[i], each(lambda q, i=i: q[i], p), space)
        assert length[i] == pytest.approx(alone.length(), rel=1e-13)
        assert energy[i] == pytest.approx(alone.bending_energy(), rel=1e-13)


def on_a_geodesic(space, theta, t):
    """The curve with one segment that runs along a geodesic as the polynomial theta does."""
    p = at_node(space, points_on(space, 1), 0)
    e = tangents_at(space, p)
    e = each(lambda x: x / space.norm(p, e), e)
    ends = [space.exp(p, each(lambda x, s=s: theta(s) * x, e)) for s in t]
    start = [space.transport(p, q, e) for q in ends]
    bc = tuple((1, each(lambda x, s=s: theta.deriv()(s) * x, v)) for s, v in zip(t, start, strict=True))
    points = each(lambda a, b: np.stack([a, b]), *ends)
    return ss.CubicSpline(t, points, space, bc_type=bc)


@every_space
@pytest.mark.parametrize(
    "theta", [Polynomial([0, 0.5]), Polynomial([0.2, 0, 0.25]), Polynomial([0, 0.3, 0.1, 0.05])], ids=str
)
def test_length_speed_and_energy_in_closed_form(space, theta):
    t = np.array([0.0, 1.5])
    spline, x = on_a_geodesic(space, theta, t), np.linspace(0, 1.5, 13)
    rate, bend = theta.deriv(), theta.deriv(2)
    assert np.allclose(spline.speed(x), np.abs(rate(x)), rtol=1e-13, atol=1e-14)
    assert spline.length() == pytest.approx(theta(1.5) - theta(0), rel=1e-13)
    if bend != Polynomial([0]):
        assert spline.bending_energy() == pytest.approx((bend**2).integ()(1.5), rel=1e-12)


def test_length_of_a_curve_that_turns():
    # θ = t(1 − t) goes to 1/4 and back: |θ'| has a kink.
    spline = on_a_geodesic(S2, Polynomial([0, 1, -1]), np.array([0.0, 1.0]))
    assert spline.length() == pytest.approx(0.5, rel=1e-13)
    assert spline.bending_energy() == pytest.approx(4, rel=1e-12)


@every_curved
def test_a_geodesic_through_many_points(space):
    p = points_on(space, 2)
    curve = space.geodesic(p[0], p[1], KNOTS)
    spline = ss.CubicSpline(KNOTS, curve, space)
    distance = space.distance(p[0], p[1])
    assert np.allclose(spline.speed(np.linspace(0, 4.5, 30)), distance, rtol=1e-12)
    assert spline.length() == pytest.approx(4.5 * distance, rel=1e-13)


RESTS = """
import sys, numpy as np, symspline as ss
space = ss.space("sphere:2")
p = space.project([[1.5, 0.3, 0.2], [1.7, 0.5, 0.4], [0.2, 0.9, 0.5]])
t = [0, 1, 1.5, 3, 4, 4.5]
a = np.arange(4) * 1e-3
far = np.stack([np.cosh(10 + 0 * a), np.sinh(10) * np.cos(a), np.sinh(10) * np.sin(a)], axis=1)
"""


# In processes of their own: an integral that does not end takes all memory.
@pytest.mark.parametrize(
    "code",
    [
        "ss.CubicSpline(None, space.geodesic(p[0], p[1], np.linspace(0, 1, 8)), space).bending_energy() < 1e-24",
        "ss.CubicSpline(t, p[[0] * 6], space).length() < 1e-14",
        "ss.CubicSpline(t, np.stack([p[[0] * 6], p[[0, 1] * 3]]), space).length()[0] < 1e-14",
        "ss.CubicSpline(None, far, 'h:2').bending_energy() > 1",
    ],
    ids=["geodesic", "still", "one still in a batch", "far out"],
)
def test_integrals_come_to_rest_at_the_rounding_floor(code):
    run_python(f"{RESTS}\nassert {code}", timeout=3)


def test_lengths_add_as_in_pythagoras_in_a_product():
    p = points_on(S2, 6)
    one, both = ss.CubicSpline(KNOTS, p, S2), ss.CubicSpline(KNOTS, (p, p), ss.Product(S2, S2))
    x = np.linspace(0, 4.5, 11)
    assert np.allclose(both.speed(x), np.sqrt(2) * one.speed(x), rtol=1e-14)
    assert both.length() == pytest.approx(np.sqrt(2) * one.length(), rel=1e-13)
    assert both.bending_energy() == pytest.approx(2 * one.bending_energy(), rel=1e-13)


# ---- files ----


def saved_curves():
    v = tangents_at(S2, np.array([1.0, 0, 0]))
    product = ss.Product("sphere:3", "r:2")
    ends = [(1, tangents_at(product, at_node(product, points_on(product, 4), e))) for e in (0, -1)]
    cut, options = failing("cut locus")
    hour = np.datetime64("2024-01-01T00", "h")
    return {
        "one": ss.CubicSpline(None, THREE, S2),
        "own ends": ss.CubicSpline([0, 1, 3], THREE, S2, bc_type=((1, v), "not-a-knot"), extrapolate=True),
        "periodic": ss.CubicSpline(None, [*THREE, THREE[0]], S2, bc_type="periodic", extrapolate="geodesic"),
        "batch": ss.CubicSpline(KNOTS, points_on(S2, 6, (2, 3)), S2),
        "own times": ss.CubicSpline(
            [[0, 1, 2], [0, 2, 3.0]], [THREE, THREE], S2, bc_type=((2, [v, -v]), "natural")
        ),
        "dates": ss.CubicSpline(hour + np.array([0, 1, 3]), THREE, S2),
        "own dates": ss.CubicSpline(hour + np.array([[0, 1, 3], [1, 2, 3]]), [THREE, THREE], S2),
        "nanoseconds": ss.CubicSpline(np.int64(EPOCH) + np.array([0, 1, 3]), THREE, S2),
        "product": ss.CubicSpline(None, points_on(product, 4), product, bc_type=tuple(ends)),
        "product batch": ss.CubicSpline(KNOTS, points_on(product, 6, (2,)), product),
        "flat": ss.CubicSpline(KNOTS, points_on(ss.Euclidean(1), 6), "r:1"),
        "hyperbolic": ss.CubicSpline(KNOTS, points_on(ss.Hyperbolic(3), 6), "h:3"),
        "one bad curve": ss.CubicSpline(None, cut, S2, on_failure="ignore", **options),
    }


SAVED = saved_curves()


@pytest.mark.parametrize("name", SAVED)
def test_files_keep_everything(name):
    spline = SAVED[name]
    read = round_trip(spline)
    assert same_curve(read, spline)
    assert read.t.dtype == spline.t.dtype and read.space == spline.space
    assert read.extrapolate == spline.extrapolate
    assert repr(read) == repr(spline) and str(read.report) == str(spline.report)
    x = spline.t.ravel()[1:2]
    for nu in range(3):
        assert same(read(x, nu=nu), spline(x, nu=nu))
    if isinstance(spline.bc_type, str):
        assert read.bc_type == spline.bc_type
    for ours, theirs in zip(spline.bc_type, read.bc_type, strict=True):
        assert isinstance(ours, str) or (ours[0] == theirs[0] and same(tuple(ours[1]), tuple(theirs[1])))


def test_files_keep_dates_that_count_in_tens():
    spline = ss.CubicSpline(np.array([0, 1, 3], "M8[10s]"), THREE, S2)
    assert np.array_equal(round_trip(spline).t, spline.t)


@pytest.mark.parametrize("kind", [str, Path])
@pytest.mark.parametrize("name", ["curve.npz", "curve", "Kurve äöü.spline"])
def test_files_have_the_name_they_were_given(tmp_path, kind, name):
    SAVED["one"].save(kind(tmp_path / name))
    assert os.listdir(tmp_path) == [name]
    assert ss.load(kind(tmp_path / name)) == SAVED["one"]


def test_files_are_replaced_whole(tmp_path):
    path = tmp_path / "curve.npz"
    SAVED["batch"].save(path)
    SAVED["one"].save(path)
    assert ss.load(path) == SAVED["one"]
    with pytest.raises(OSError):
        SAVED["one"].save(tmp_path / "missing" / "curve.npz")
    assert os.listdir(tmp_path) == ["curve.npz"]


def test_open_files(tmp_path):
    with open(tmp_path / "curve.npz", "w+b") as file:
        SAVED["batch"].save(file)
        file.seek(0)
        assert ss.load(file) == SAVED["batch"]
        assert not file.closed


def test_what_is_in_a_file():
    names = ["format", "version", "space", "t", "t_unit", "bc_type", "extrapolate", "report"]
    for spline, suffixes in ((SAVED["dates"], [""]), (SAVED["product"], ["_0", "_1"])):
        file = io.BytesIO()
        spline.save(file)
        file.seek(0)
        with np.load(file, allow_pickle=False) as arrays:
            expected = names + [kind + s for kind in ("points", "velocities") for s in suffixes]
            assert sorted(arrays.files) == sorted(expected)
            assert str(arrays["space"]) == str(spline.space)
            assert str(arrays["t_unit"]) == ("h" if spline is SAVED["dates"] else "")
            for suffix, points, velocities in zip(
                suffixes, parts(spline.points), parts(spline.velocities), strict=True
            ):
                assert same(arrays["points" + suffix], points)
                assert same(arrays["velocities" + suffix], velocities)


# ---- threads ----


def test_set_num_threads(threads):
    for n in (1, 2, 3):
        ss.set_num_threads(n)
        assert ss.num_threads() == n
    ss.set_num_threads(0)
    assert 1 <= ss.num_threads() <= os.cpu_count()


@pytest.mark.parametrize("n", [1, 3])
def test_threads_from_the_environment(n):
    printed = run_python("import symspline as ss; print(ss.num_threads())", SYMSPLINE_NUM_THREADS=str(n))
    assert int(printed) == n


def test_a_bad_number_of_threads_in_the_environment():
    code = """
try:
    import symspline
except ImportError as error:
    print(error)
"""
    assert "SYMSPLINE_NUM_THREADS must be a whole number, not 'many'" in run_python(
        code, SYMSPLINE_NUM_THREADS="many"
    )
    assert run_python(code, SYMSPLINE_NUM_THREADS="") == ""


@pytest.mark.skipif(sys.platform != "linux", reason="counts threads in /proc")
@pytest.mark.parametrize(
    "counts, most",
    [
        ([1], 0),
        ([2], 2),
        ([2, 3] * 8, 5),
    ],
    ids=str,
)
def test_no_more_threads_than_allowed(counts, most):
    code = """
import json, os, sys, numpy as np, symspline as ss
spline = ss.CubicSpline(None, np.eye(3), "sphere:2")
x = np.linspace(0, 2, 200_000)
before = len(os.listdir("/proc/self/task"))
for n in json.loads(sys.argv[1]):
    ss.set_num_threads(n)
    spline(x)
print(len(os.listdir("/proc/self/task")) - before)
"""
    assert int(run_python(code, counts)) <= most


# ---- functions on arrays ----


@every_space
@every_batch
def test_fit_and_evaluate_equal_the_class(space, batch):
    p = points_on(space, 6, batch)
    q = at_node(space, p, 0)
    options = {"bc_type": ((1, tangents_at(space, q)), "not-a-knot"), "method": "fixed-point", "tol": 1e-10}
    spline = ss.CubicSpline(KNOTS, p, space, **options)
    u, report = ss.fit(KNOTS, p, space, **options)
    assert same(u, spline.velocities) and report == spline.report
    x = np.linspace(-1, 5, 11)
    for nu in range(3):
        found = ss.evaluate(x, KNOTS, spline.points, u, str(space), nu, extrapolate="geodesic")
        assert same(found, spline(x, nu, extrapolate="geodesic"))
    with pytest.raises(ss.ValidationError, match="outside the knots"):
        ss.evaluate(x, KNOTS, spline.points, u, space)


@every_space
def test_evaluate_per_curve(space):
    spline = ss.CubicSpline(None, points_on(space, 5, (2,)), space)
    x = np.array([[0.5, 1], [2, 3.5]])
    found = ss.evaluate(x, None, spline.points, spline.velocities, space, per_curve=True)
    assert same(found, spline(x, per_curve=True))


def test_evaluate_over_dates():
    spline = SAVED["dates"]
    x = spline.t[0] + np.timedelta64(90, "m")
    assert same(ss.evaluate(x, spline.t, spline.points, spline.velocities, S2, 1), spline(x, nu=1))


@every_space
@pytest.mark.parametrize("bc_type", ["natural", "not-a-knot", "clamped"])
def test_fit_many_equals_one_at_a_time(space, bc_type):
    curves = []
    for i, n in enumerate([6, 2, 3, 6, 40, 2, 7, 3, 6, 6, 600]):
        t = None if i % 3 == 0 else np.cumsum(np.random.default_rng(i).uniform(0.5, 1.5, n))
        curves.append((t, points_on(space, n, step=0.4, seed=i)))
    fitted = ss.fit_many(iter(curves), str(space), bc_type=bc_type, extrapolate=True)
    assert isinstance(fitted, list) and len(fitted) == len(curves)
    for spline, (t, p) in zip(fitted, curves, strict=True):
        alone = ss.CubicSpline(t, p, space, bc_type=bc_type, extrapolate=True)
        assert type(spline) is type(alone) and same_curve(spline, alone)
        assert (spline.bc_type, spline.extrapolate) == (bc_type, True)


def test_fit_many_with_a_vector_for_every_curve():
    v = tangents_at(S2, np.broadcast_to([1.0, 0, 0], (2, 3)))
    curves = [(None, THREE), ([0, 2], THREE[:2])]
    fitted = ss.fit_many(curves, S2, bc_type=((1, v), "natural"))
    for i, (t, p) in enumerate(curves):
        assert same_curve(fitted[i], ss.CubicSpline(t, p, S2, bc_type=((1, v[i]), "natural")))
        assert same(fitted[i].bc_type[0][1], v[i])


def test_fit_many_of_closed_curves_and_of_dates():
    closed = [(None, [*THREE, THREE[0]]), (np.datetime64("2024-01-01") + np.arange(4), [*THREE, THREE[0]])]
    for spline, (t, p) in zip(ss.fit_many(closed, S2, bc_type="periodic"), closed, strict=True):
        assert same_curve(spline, ss.CubicSpline(t, p, S2, bc_type="periodic"))


def test_fit_many_of_nothing():
    assert ss.fit_many([], S2) == []


def test_everything_is_exported():
    for name in ss.__all__:
        assert getattr(ss, name) is not None
    assert {"CubicSpline", "fit", "evaluate", "fit_many", "load", "space", "Product"} <= set(ss.__all__)
