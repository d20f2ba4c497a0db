"""Parts of curves between knots, curves one after the other, other time laws, and derivatives as functions."""

import io
import pickle

import numpy as np
import pytest
from compare import close, each
from curves import KNOTS, every_batch, every_kind, points_on
from refused import raises
from scipy.interpolate import PchipInterpolator
from stored import restored

import symspline as ss

# Neither is a knot.
A, B = KNOTS[1] + 0.3 * (KNOTS[2] - KNOTS[1]), KNOTS[-2] + 0.6 * (KNOTS[-1] - KNOTS[-2])
INSIDE = np.sort(np.random.default_rng(3).uniform(A, B, 23))


@every_kind
@every_batch
def test_parts_and_their_union_are_the_curve(space, batch):
    curve = ss.CubicSpline(KNOTS, points_on(space, batch=batch, step=0.5), space)
    part = curve.restrict(A, B)
    assert part.domain == (A, B)
    whole = curve.restrict(b=A).concatenate(part).concatenate(curve.restrict(B))
    assert whole.domain == curve.domain
    for nu in (0, 1, 2):
        # The points are the same numbers, since the same curve is evaluated at the same times.
        assert close(part(INSIDE, nu), curve(INSIDE, nu), 0)
        assert close(whole(INSIDE, nu), curve(INSIDE, nu), 0)
        assert close(part(A, nu), curve(A, nu), 0) and close(whole(B, nu), curve(B, nu), 0)
        shapes = [getattr(own(B, nu), "shape", None) for own in (part, whole, curve)]
        assert shapes[0] == shapes[1] == shapes[2]
    assert close(part.speed(INSIDE), curve.speed(INSIDE), 0)
    assert np.shape(part.speed(A)) == np.shape(whole.speed(A)) == batch
    assert close(part.length(), curve.length(A, B))
    assert close(whole.length(), curve.length(), 1e-11)
    back = part.reverse()
    assert close(back.speed(INSIDE), curve.speed(A + B - INSIDE))
    assert np.max(space.distance(back(INSIDE), curve(A + B - INSIDE))) < 1e-7
    assert close(back(INSIDE, 1), each(np.negative, part(A + B - INSIDE, 1)))


@pytest.mark.parametrize("cut", [1, 3])
def test_parts_between_knots_join_to_one_spline(cut, rng):
    points = np.array([0, 0, 3]) + np.cumsum(rng.standard_normal((2, len(KNOTS), 3)) * 0.4, axis=1)
    curve = ss.HermiteSpline.from_points(KNOTS, ss.Sphere(2).project(points), "sphere:2", method="akima")
    whole = curve.restrict(b=KNOTS[cut]).concatenate(curve.restrict(KNOTS[cut]))
    assert isinstance(whole, ss.HermiteSpline)
    assert whole == curve


def test_other_kinds_of_curves(rng):
    points = ss.Sphere(2).project(np.array([0, 0, 2]) + np.cumsum(rng.standard_normal((7, 3)) * 0.3, axis=0))
    bezier = ss.BezierCurve(points, "sphere:2")
    bspline = ss.BSpline([0, 0, 0, 0, 1, 2.5, 3, 4, 4, 4, 4], points, 3, "sphere:2")
    geodesics = ss.PiecewiseGeodesic([0, 1, 1.5, 4, 5, 7, 7.5], points, "sphere:2")
    smooth = ss.make_smoothing_spline(np.r_[0:3:60j], np.tile(points[:1], (60, 1)), "sphere:2", lam=1.0)
    for curve in (bezier, bspline, geodesics, smooth):
        first, last = curve.domain
        a, b = first + 0.21 * (last - first), first + 0.83 * (last - first)
        x = np.linspace(a, b, 9)
        part, back, later = curve.restrict(a, b), curve.reverse(), curve.shift(-3.5)
        assert isinstance(part, ss.RetimedCurve)
        for nu in (0, 1, 2):
            assert close(part(x, nu), curve(x, nu), 0)
            assert close(back(first + last - x, nu), (-1) ** nu * curve(x, nu), 1e-11)
            assert close(later(x - 3.5, nu), curve(x, nu), 1e-11)
        assert later.domain == (first - 3.5, last - 3.5)
        assert part.arc_length(part.at_length(part.length() / 3)) == pytest.approx(part.length() / 3, rel=1e-10)
        joined = part.concatenate(part.reverse().shift(b - a))
        assert isinstance(joined, ss.SegmentedCurve)
        assert joined.length() == pytest.approx(2 * part.length(), rel=1e-12)
        for own in (part, back, later, joined):
            again = restored(own)
            assert again == own == pickle.loads(pickle.dumps(own))
            assert close(again(np.mean(own.domain), 1), own(np.mean(own.domain), 1), 0)
            assert again != part.restrict(b=(a + b) / 2)
    # A part of a part refers to the original curve.
    assert close(bezier.restrict(0.2, 0.9).restrict(0.3, 0.8)(0.5), bezier(0.5), 0)
    raises("nu must be 0, 1 or 2, not 3", bezier.restrict(0.2, 0.9), 0.5, 3)


def test_batches_of_composed_curves_with_their_own_knots(rng):
    t = np.cumsum(rng.uniform(0.5, 2, (3, 6)), axis=-1)
    curves = ss.CubicSpline(t, np.cumsum(rng.standard_normal((3, 6, 2)), axis=1), "r:2")
    a, b = t[:, 0].max() + 0.01, t[:, -1].min() - 0.01
    part, x = curves.restrict(a, b), np.linspace(a, b, 7)
    assert close(part(x, 1), curves(x, 1), 0)
    assert close(part.length(), curves.length(a, b))
    assert part.arc_length(x).shape == (3, 7)
    for i in range(3):
        assert close(part[i](x), curves[i](x), 0)
    assert restored(part) == part


def test_dates_of_composed_curves(rng):
    hours = np.datetime64("2026-03-01T00", "h") + np.array([0, 5, 6, 30, 31, 47])
    points = ss.Sphere(2).project(rng.standard_normal((6, 3)) * 0.3 + [1, 0, 0])
    curve = ss.CubicSpline(hours, points, "sphere:2")
    half = np.datetime64("2026-03-01T02:30")
    part = curve.restrict(half, hours[4] + np.timedelta64(1, "h"))
    assert part.domain == (half, hours[4] + np.timedelta64(1, "h"))
    later = part.shift(np.timedelta64(1, "D"))
    assert later.domain[0] == half + np.timedelta64(1, "D")
    x = half + np.arange(0, 28 * 60, 97) * np.timedelta64(1, "m")
    assert close(part(x), curve(x)) and close(later(x + np.timedelta64(1, "D"), 1), curve(x, 1))
    for own in (part, later, part.reverse()):
        assert restored(own) == own
        assert close(restored(own)(own.domain[0]), own(own.domain[0]), 0)
    raises("dt must be a timedelta64", part.shift, 3.0)
    # A time law counts seconds since the start.
    slow = curve.retime(PchipInterpolator([0, 10], [0, 47 * 3600.0]))
    assert slow.domain == (0, 10)
    assert close(slow(5.0), curve(hours[0] + np.timedelta64(47 * 30, "m")))


def test_segments_are_a_function_of_time(rng):
    t = np.concatenate([np.cumsum(rng.uniform(0.1, 0.5, 20)), 30 + np.cumsum(rng.uniform(0.1, 0.5, 15))])
    points = ss.space("so:3 x r:3").project(
        (np.eye(3) + 0.2 * rng.standard_normal((35, 3, 3)), 50 * rng.standard_normal((35, 3)))
    )
    found = ss.fit_segments(t, points, "so:3 x r:3", max_gap=5)
    first, second = found
    assert len(found) == 2 and found[1] is second and list(found[:1]) == [first]
    assert found.gaps == [(t[19], t[20])]
    x = np.concatenate([[t[0], t[19], 20.0, t[20]], rng.uniform(t[0], t[-1], 60)])
    missing = (x > t[19]) & (x < t[20])
    for nu in (0, 1, 2):
        values = (found(x, nu), first(x, nu, extrapolate=False), second(x, nu, extrapolate=False))
        for own, a, b in zip(*values, strict=True):
            expected = np.where((x < 25).reshape(-1, *[1] * (a.ndim - 1)), a, b)
            np.testing.assert_array_equal(own, expected)
            assert np.isnan(own[missing]).all() and not np.isnan(own[~missing]).any()
    assert found.length() == pytest.approx(first.length() + second.length())
    assert found.bending_energy() == pytest.approx(first.bending_energy() + second.bending_energy())
    part = found.restrict(t[4], t[-3] - 0.01)
    assert [type(own).__name__ for own in part] == ["HermiteSpline", "RetimedCurve"]
    assert np.isnan(found(t[-1] + 1, extrapolate=False)[0]).all()
    for own in (found, part, found.shift(-7)):
        assert restored(own) == own == pickle.loads(pickle.dumps(own))
    for call in (ss.rotations.angular_velocity, ss.rotations.angular_acceleration):
        np.testing.assert_allclose(
            call(found, x), np.where((x < 25)[:, None], *(call(own, x, extrapolate=False) for own in found))
        )
    signals = ss.poses.imu(found, x)
    np.testing.assert_allclose(signals.gyro[~missing & (x < 25)], ss.poses.imu(first, x[~missing & (x < 25)]).gyro)
    file = io.StringIO()
    ss.poses.write_tum(file, x, found(x))
    assert len(file.getvalue().splitlines()) == np.sum(~missing)


def test_retimed_curves_obey_the_chain_rule(rng):
    for name in ("sphere:2", "so:3", "spd:2", "h:3", "sphere:2 x r:3"):
        space = ss.space(name)
        curve = ss.CubicSpline(KNOTS, points_on(space, step=0.5), space)
        law = PchipInterpolator([-1, 0.5, 4], [KNOTS[0], KNOTS[2] + 0.1, KNOTS[-1]])
        slow = curve.retime(law)
        assert slow.domain == (-1, 4)
        # Lengths do not depend on the time law.
        assert slow.length() == pytest.approx(curve.length(), rel=1e-12)
        assert curve.at_length(slow.arc_length(1.7)) == pytest.approx(law(1.7), abs=1e-9)
        x, h = np.array([-0.4, 0.9, 2.2, 3.1]), 1e-4
        for nu in (0, 1):
            ends = slow(x - h, nu), slow(x + h, nu), slow(x, nu + 1), slow(x), slow(x - h), slow(x + h)
            for a, b, own, p, before, after, factor in zip(
                *(v if isinstance(v, tuple) else (v,) for v in ends), ss_factors(space), strict=True
            ):
                if nu:
                    a, b = factor.transport(before, p, a), factor.transport(after, p, b)
                    difference = (b - a) / (2 * h)
                else:
                    difference = (factor.log(p, b) - factor.log(p, a)) / (2 * h)
                np.testing.assert_allclose(own, difference, atol=2e-6 * max(1, np.abs(own).max()))
        norms = slow(x, 2)
        parts = norms if isinstance(norms, tuple) else (norms,)
        points = slow(x) if isinstance(norms, tuple) else (slow(x),)
        sizes = [f.norm(p, v) for f, p, v in zip(ss_factors(space), points, parts, strict=True)]
        bend = slow._curve.evaluate(x, "bend", "raise", False)
        np.testing.assert_allclose(bend, np.linalg.norm(sizes, axis=0), rtol=1e-12)


def ss_factors(space):
    return space.factors if isinstance(space, ss.Product) else (space,)


def test_derivatives_are_functions():
    curve = ss.CubicSpline(KNOTS, points_on(ss.Sphere(2)), "sphere:2")
    velocity = curve.derivative()
    assert close(velocity(INSIDE), curve(INSIDE, 1), 0)
    assert close(velocity(INSIDE, 1), curve(INSIDE, 2), 0)
    assert close(velocity.derivative(2)(INSIDE), curve(INSIDE, 3), 0)
    assert close(curve.derivative(0)(INSIDE), curve(INSIDE), 0)
    assert np.isnan(velocity(99.0, extrapolate=False)).all()
    raises("nu must be", curve.derivative, 4)
    raises("nu must be", velocity, 0.5, 3)


def test_invalid_arguments_of_composed_curves_raise(rng):
    curve = ss.CubicSpline(None, rng.standard_normal((5, 2)), "r:2")
    other = ss.CubicSpline([4, 5], rng.standard_normal((2, 2)), "r:2")
    raises(r"other begins at 0\.0, but the curve ends at 4\.0", curve.concatenate, curve)
    raises("Both must be one point", curve.concatenate, other)
    raises(r"other is on Sphere\(2\)", curve.concatenate, ss.CubicSpline([4, 5], [[1, 0, 0], [0, 1, 0]], "sphere:2"))
    raises("other must be a curve", curve.concatenate, 3, error=TypeError)
    raises("the law has no domain", curve.retime, lambda x, nu=0: x)
    raises(r"law must take times and the order", curve.retime, lambda x: x, domain=(0, 1))
    raises(r"law returns 6\.0 at x = 3\.0, outside the domain", curve.retime, PchipInterpolator([0, 3], [0, 6]))
    raises("domain must be two increasing", curve.retime, PchipInterpolator([0, 3], [0, 4]), domain=(2, 1))
    raises("law must be a function", curve.retime, "fast")
    raises(r"curves\[1\] begins at 0\.0, before curves\[0\] ends at 4\.0", ss.SegmentedCurve, [curve, curve])
    raises("curves is empty", ss.SegmentedCurve, [])
    raises(r"curves\[1\] must be a curve, not 3", ss.SegmentedCurve, [curve, 3], error=TypeError)
    raises("extrapolate must be None, 'raise' or False", ss.SegmentedCurve([curve]), 9, extrapolate="geodesic")
    raises("outside the domain", curve.restrict(0.5, 2.5), 3)
    dated = ss.CubicSpline(np.arange("2024-01-01", "2024-01-06", dtype="M8[D]"), curve.points, "r:2")
    raises(r"curves\[1\] has times of another kind", ss.SegmentedCurve, [curve, dated])
    raises("no public constructor", ss.RetimedCurve, error=TypeError)
    slow = curve.retime(PchipInterpolator([0, 3], [0, 4]))
    raises("not saved", slow.save, io.BytesIO())
    assert pickle.loads(pickle.dumps(slow))(1.0).tolist() == slow(1.0).tolist()


def test_searches_and_reversal_of_segments():
    first = ss.CubicSpline(np.arange(5.0), np.sin(np.arange(5.0))[:, None], "r:1")
    second = ss.CubicSpline(np.arange(8.0, 13), 3 * np.sin(np.arange(5.0))[:, None], "r:1")
    curve = ss.SegmentedCurve([first, second])
    times, speeds = curve.extrema("speed")
    # The largest speed is at the start of the second segment.
    assert speeds.max() == pytest.approx(curve.speed(8.0)) and times[speeds.argmax()] == 8.0
    heights = curve.extrema(lambda x: curve(x)[..., 0])[0]
    np.testing.assert_allclose(heights[1] - heights[0], 8.0)
    # The ends of a gap are not crossings.
    np.testing.assert_allclose(
        ss.SegmentedCurve([first, first.shift(8)]).solve("speed", 0.2),
        np.concatenate([first.solve("speed", 0.2), 8 + first.solve("speed", 0.2)]),
    )
    # Where segments meet, only jumps count.
    whole = first.restrict(b=2.3).concatenate(first.restrict(2.3))
    for kind in ("max", "min"):
        np.testing.assert_allclose(whole.extrema(kind=kind)[0], first.extrema(kind=kind)[0], atol=1e-9)
    faster = first.concatenate(ss.HermiteSpline([4, 5], [first(4.0), [1.0]], [[3.0], [0.0]], "r:1"))
    assert 4.0 in faster.extrema()[0] and 4.0 in faster.solve("speed", 2.0)
    back = curve.reverse()
    assert isinstance(back, ss.SegmentedCurve) and back.gaps == [(4.0, 8.0)]
    assert back.length() == pytest.approx(curve.length())
    x = np.array([0.5, 3.9, 6.0, 8.2, 12.0])
    np.testing.assert_allclose(back(x), curve(12 - x), atol=1e-13)
    outside = ss.fit_segments([0, 1, 2, 9, 10.0], [[0.0], [1], [2], [1], [1]], "r:1", max_gap=3, extrapolate=False)
    assert np.isnan(outside(11.0)).all()


def test_integrals_along_a_time_law(rng):
    """The second derivative of a time law jumps between its many knots."""
    points = ss.Sphere(2).project(np.array([3, 0, 0]) + np.cumsum(0.3 * rng.standard_normal((9, 3)), axis=0))
    curve = ss.CubicSpline(np.cumsum(rng.uniform(0.5, 1.5, 9)), points, "sphere:2")
    law = ss.time_law(curve, max_speed=1, max_acceleration=2)
    motion = curve.retime(law)
    assert motion.length() == pytest.approx(curve.length(), rel=1e-13)
    # Midpoints of many short intervals between the knots of the law.
    fine = np.concatenate([np.linspace(a, b, 21) for a, b in zip(law.knots[:-1], law.knots[1:], strict=True)])
    steps = np.diff(fine)
    middle = fine[:-1] + steps / 2
    norms = curve.space.norm(motion(middle), motion(middle, nu=2))
    assert motion.bending_energy() == pytest.approx(np.sum(norms**2 * steps), rel=1e-6)


def test_a_small_jump_of_the_velocity_is_kept():
    first = ss.HermiteSpline([0, 1], [[0.0], [1.0]], [[1.0], [1.0]], "r:1")
    second = ss.HermiteSpline([1, 2], [[1.0], [2.0]], [[1.0 + 1e-9], [1.0]], "r:1")
    assert isinstance(first.concatenate(second), ss.SegmentedCurve)


@pytest.mark.filterwarnings("ignore::symspline.ConvergenceWarning")
def test_failed_segments_are_not_the_nearest():
    x, y = np.eye(3)[:2]
    failed = ss.CubicSpline([0, 1], [x, -x], "sphere:2", on_failure="ignore")
    segments = [failed, ss.CubicSpline([2, 3], [x, y], "sphere:2"), failed.shift(4.0)]
    time, distance = ss.SegmentedCurve(segments).closest(y)
    assert time == pytest.approx(3) and distance == pytest.approx(0, abs=1e-7)
