"""`BSpline` and `BezierCurve` as values: arrays, copies, and invalid input."""

import math
import warnings

import numpy as np
import pytest
from cases import every_family, loop_over, walk
from curves import clamped
from refused import CLAMPED, INF, NAN, REFLECTION, P, raises

import symspline as ss

SEED = 2007


@every_family
@loop_over("batch", [(), (2, 3)])
def test_batches_of_free_curves(case, batch, rng):
    space = case.space
    points = np.array([walk(space, 0.4, 5, rng) for _ in range(math.prod(batch))])
    points = points.reshape(*batch, 5, *space.point_shape)
    curve = ss.BSpline(clamped([1.3], 3), points, 3, space)
    alone = {i: ss.BSpline(curve.knots, points[i], 3, space) for i in np.ndindex(*batch)}
    for x in (0.7, np.array(2), np.zeros(0), [0.5, 3.0], np.ones((2, 1, 3)), np.linspace(0, 3, 40)):
        for nu in range(3):
            value = curve(x, nu=nu)
            assert value.shape == (*batch, *np.shape(x), *space.point_shape) and value.dtype == space.dtype
            for i, one in alone.items():
                assert np.array_equal(value[i], one(x, nu=nu))
        assert np.shape(curve.speed(x)) == (*batch, *np.shape(x))


def test_a_bezier_curve_is_a_bspline(rng):
    points = walk(ss.Sphere(2), 0.4, 4, rng)
    curve = ss.BezierCurve(points, "sphere:2")
    assert curve == ss.BSpline([0] * 4 + [1] * 4, points, 3, "sphere:2")
    assert curve.domain == (0.0, 1.0) and isinstance(curve, ss.BSpline)


def test_several_curves_share_a_file(rng, tmp_path):
    points = walk(ss.Sphere(2), 0.4, 5, rng)
    short, long = (
        ss.BSpline(knots, points[:n], 3, "sphere:2") for knots, n in ((clamped([], 3), 4), (clamped([1.0], 3), 5))
    )
    ss.save({"short": short, "long": long}, tmp_path / "several.npz")
    assert ss.load(tmp_path / "several.npz") == {"short": short, "long": long}
    for missing in ("lift", "transport", "velocities", "t", "report"):
        assert not hasattr(short, missing)


def test_damaged_files_of_control_points_raise(rng, tmp_path):
    points = walk(ss.Sphere(2), 0.4, 4, rng)
    for curve, changes in (
        (ss.BSpline(clamped([], 3), points, 3, "sphere:2"), {"knots": np.arange(8.0)[::-1]}),
        (ss.BSpline(clamped([], 3), points, 3, "sphere:2"), {"degree": "2.5"}),
        (ss.BezierCurve(points, "sphere:2"), {"control_points": 2 * points}),
        (ss.BezierCurve(points, "sphere:2"), {"knots": np.r_[np.zeros(4), 2 * np.ones(4)]}),
        (ss.BezierCurve(points, "sphere:2"), {"space": "sphere:2 x r:1"}),
    ):
        curve.save(tmp_path / "good.npz")
        np.savez(tmp_path / "bad.npz", **dict(np.load(tmp_path / "good.npz")) | changes)
        name = next(iter(changes))
        raises(f"bad.npz: .*({name}|Product)", ss.load, tmp_path / "bad.npz")


def test_length_and_energy_of_flat_curves(rng):
    """Against SciPy, on knots at which the acceleration jumps."""
    from scipy.integrate import quad
    from scipy.interpolate import BSpline

    points, knots = rng.standard_normal((2, 6, 3)), clamped([1.0, 1.5], 3)
    curve = ss.BSpline(knots, points, 3, "r:3")
    assert curve.length().shape == curve.bending_energy().shape == (2,)
    for one, length, energy in zip(points, curve.length(), curve.bending_energy(), strict=True):
        flat = [BSpline(knots, one, 3).derivative(nu) for nu in (1, 2)]
        expected = [
            sum(quad(f, a, b, epsabs=1e-12)[0] for a, b in ((0, 1), (1, 1.5), (1.5, 3)))
            for f in (lambda x, d=flat[0]: np.linalg.norm(d(x)), lambda x, d=flat[1]: np.sum(d(x) ** 2))
        ]
        assert (length, energy) == pytest.approx(tuple(expected), rel=1e-9)


def test_invalid_knots_and_degrees_raise():
    for knots, degree, match in [
        (CLAMPED[1:], 2, r"3 control points of degree 2 need 6 knots, got 5"),
        ([], 2, r"need 6 knots, got 0"),
        ([0, 0, 0, 1, 0.5, 1], 2, r"knots\[4\] = 0\.5 is before knots\[3\]"),
        ([0, 0, NAN, 1, 1, 1], 2, r"knots\[2\] = nan is not finite"),
        ([0, 0, 0, 1, 1, INF], 2, r"knots\[5\] = inf is not finite"),
        ([CLAMPED, CLAMPED], 2, r"knots must be a one-dimensional array of real numbers, not int64 of shape \(2, 6\)"),
        ([0, 0, 0, 1, 1, 1j], 2, r"knots must be a one-dimensional array of real numbers, not complex128"),
        (list("aaabbb"), 2, r"knots must be a one-dimensional array of real numbers, not <U1"),
        (np.array(CLAMPED, "M8[s]"), 2, r"knots must be a one-dimensional array of real numbers, not datetime64"),
        ([[0, 0], [1]], 2, r"knots is not an array of equally long rows"),
        ([0, 0, 0, 0, 1, 1], 2, r"knots repeat 0\.0 4 times; with degree 2 a knot may repeat at most 3 times"),
        ([0, 1, 2, 2, 3, 4], 2, r"the domain of the curve is empty: knots\[2\] and knots\[3\] are equal"),
        ([-1e308] * 3 + [1e308] * 3, 2, r"knots span more than the floating-point range"),
        (CLAMPED, 3, r"degree 3 needs at least 4 control points, got 3"),
        (CLAMPED, 0, r"degree must be at least 1"),
        (CLAMPED, -1, r"degree must be at least 1"),
        (CLAMPED, 1.5, r"degree must be a whole number, not 1\.5"),
        (CLAMPED, True, r"degree must be a whole number, not True"),
        (CLAMPED, None, r"degree must be a whole number, not None"),
        (CLAMPED, 10**30, r"degree must be "),
    ]:
        with warnings.catch_warnings(), pytest.raises(ss.ValidationError, match=match):
            warnings.simplefilter("error")
            ss.BSpline(knots, P, degree, "sphere:2")


@pytest.mark.parametrize("kind", ["BSpline", "BezierCurve"])
@pytest.mark.parametrize(
    "points, match",
    [
        (P[0], r"control_points has shape \(3,\); a curve needs shape \(\.\.\., n, 3\) with n >= 2"),
        (P[:1], r"control_points has shape \(1, 3\); a curve needs .* n >= 2"),
        (P[:0], r"control_points has shape \(0, 3\); a curve needs"),
        (np.ones((0, 3, 3)), r"control_points has shape \(0, 3, 3\); a curve needs"),
        ([], r"control_points has shape \(0,\); a curve needs"),
        (None, r"control_points must be an array of numbers, not of object: it is a NoneType"),
        (np.eye(4)[:3], r"control_points has shape \(3, 4\), but Sphere\(2\) needs shape \(\.\.\., 3\)"),
        (P + 0j, r"control_points must be .*complex128; did you mean ComplexProjective"),
        (P.astype(str), r"control_points must be an array of real numbers"),
        ([[1, 0, 0], [1]], r"control_points is not an array of equally long rows"),
        (2 * P, r"control_points\[0\] is off the space by 1\.000e0: its norm is 2"),
        ([P[0], P[1], [0, 0, 0]], r"control_points\[2\] is off .*zero vector"),
        ([P[0], P[1], [NAN, 0, 0]], r"control_points\[2\] is off the space"),
        ([P, [P[0], 2 * P[1], P[2]]], r"control_points\[1\] of curve 1 is off the space by 1\.000e0"),
    ],
    ids=lambda x: None if isinstance(x, str) else str(np.shape(x)) if not isinstance(x, list) else "list",
)
def test_control_points_of_free_curves(kind, points, match):
    with pytest.raises(ss.ValidationError, match=match):
        ss.BSpline(CLAMPED, points, 2, "sphere:2") if kind == "BSpline" else ss.BezierCurve(points, "sphere:2")


def test_control_points_in_two_components_raise():
    match = r"control_points\[0\] and control_points\[1\] have opposite determinants"
    raises(match, ss.BezierCurve, [np.eye(3), REFLECTION], "o:3")
    raises(r"control_points\[1\] is off .*reflection", ss.BezierCurve, [np.eye(3), REFLECTION], "so:3")


def test_control_points_in_a_product_raise():
    for make in (lambda s: ss.BezierCurve((P, P), s), lambda s: ss.BSpline(CLAMPED, (P, P), 2, s)):
        raises("Make one curve for each factor", make, "sphere:2 x r:3")


def test_calls_take_the_options_of_all_curves():
    curve = ss.BezierCurve([[[0.0], [1.0]], [[0.0], [2.0]]], "r:1")
    assert np.isnan(curve([-1.0, 0.5], extrapolate=False)).ravel().tolist() == [True, False] * 2
    assert curve([[0.5], [0.25]], per_curve=True).ravel().tolist() == [0.5, 0.5]
    out = np.empty((2, 1))
    assert curve(0.5, out=out) is out and out.ravel().tolist() == [0.5, 1.0]
    assert curve.speed(0.5, dtype="float32").dtype == np.float32
    assert curve.extrapolate is None
    raises("extrapolate must be None, 'raise' or False, not True, for a BezierCurve", curve, 0.5, extrapolate=True)
