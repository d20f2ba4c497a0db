"""Misaligned and masked arrays of NumPy."""

import numpy as np
import pytest

import symspline as ss
from symspline.geo import from_lonlat

S2 = ss.Sphere(2)
AXES = np.eye(3)


def misaligned(array):
    """The same numbers, contiguous, but beginning between two doubles."""
    array = np.asarray(array, float)
    moved = np.zeros(array.nbytes + 1, np.uint8)[1:].view(float).reshape(array.shape)
    moved[:] = array
    assert moved.flags.c_contiguous and not moved.flags.aligned
    return moved


def test_misaligned_arrays_are_taken():
    t, v, x = [0.0, 1.0, 3.0], [0.0, 1.0, 0.5], [0.5, 2.0]
    expected = ss.CubicSpline(t, AXES, S2, bc_type=((1, v), "natural"))
    spline = ss.CubicSpline(misaligned(t), misaligned(AXES), S2, bc_type=((1, misaligned(v)), "natural"))
    assert spline == expected
    assert np.array_equal(spline(misaligned(x)), expected(x))
    assert np.array_equal(ss.evaluate(t, AXES, misaligned(spline.velocities), S2, x), expected(x))
    assert np.array_equal(S2.log(misaligned(AXES[0]), AXES[1]), S2.log(AXES[0], AXES[1]))
    moved = spline.jvp(misaligned(x), points=misaligned(AXES), t=misaligned(t))
    assert np.array_equal(moved, expected.jvp(x, points=AXES, t=t))
    square = ss.BezierCurve(misaligned(AXES), S2)
    assert np.array_equal(square(misaligned(x[:1])), ss.BezierCurve(AXES, S2)(x[:1]))


MASKED = np.ma.array(AXES, mask=[[0, 0, 0], [0, 0, 1], [1, 0, 0]])
TIMES = np.ma.array([0.0, 1.0, 2.0], mask=[0, 1, 0])


@pytest.mark.parametrize(
    "call, what",
    [
        (lambda: ss.CubicSpline(None, MASKED, S2), r"points\[1, 2\] is masked"),
        (lambda: ss.CubicSpline(None, list(MASKED), S2), r"points\[1, 2\] is masked"),
        (lambda: ss.CubicSpline(TIMES, AXES, S2), r"t\[1\] is masked"),
        (lambda: ss.CubicSpline(None, AXES, S2)(TIMES), r"x\[1\] is masked"),
        (lambda: ss.fit_many([(TIMES, AXES)], S2), r"curve 0: t\[1\] is masked"),
        (lambda: ss.BezierCurve(MASKED, S2), r"control_points\[1, 2\] is masked"),
        (lambda: from_lonlat(TIMES, 0), r"lon\[1\] is masked"),
        (lambda: S2.distance(np.ma.masked, AXES), r"p is masked"),
    ],
)
def test_masked_numbers_are_refused(call, what):
    with pytest.raises(ss.ValidationError, match=what):
        call()


def test_masked_arrays_without_masked_numbers_are_taken():
    points = np.ma.array(AXES)
    spline = ss.CubicSpline(np.ma.array([0.0, 1.0, 2.0], mask=False), points, S2)
    assert spline == ss.CubicSpline(None, list(points), S2) == ss.CubicSpline(None, AXES, S2)
