"""Unit quaternions of opposite sign warn on S³, and only there."""

import warnings

import numpy as np
import pytest
from curves import S3, points_on

import symspline as ss


def motion():
    """A turn by 180 degrees in steps of 20, as quaternions."""
    half = np.radians(10) * np.arange(10)
    return np.stack([np.cos(half), np.sin(half), 0 * half, 0 * half], axis=-1)


def flipped(*samples):
    q = motion()
    q[list(samples)] *= -1
    return q


def silent(call):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return call()


def test_a_flipped_sample_warns_once_with_advice():
    with pytest.warns(UserWarning) as caught:
        ss.CubicSpline(None, flipped(4), "sphere:3", method="newton")
    (warning,) = caught
    message = str(warning.message)
    assert message.startswith(
        "neighbours of opposite sign on sphere:3: points[3] and points[4] have inner product -0.985"
    )
    assert "(and 1 more pairs)" in message and "so:3" in message and "rp:3" in message
    assert "warnings.filterwarnings('ignore', message='neighbours of opposite sign')" in message
    # It points to the line above, not into the package.
    assert warning.filename == __file__
    assert warning.category is UserWarning


def test_warning_names_the_curve():
    good, bad, late = motion(), flipped(3), flipped(9)
    for call, curve in (
        (lambda: ss.CubicSpline(None, np.stack([good, late]), S3), " of curve 1"),
        (lambda: ss.fit_many([(None, good), (None, late)], S3), " of curve 1"),
        (lambda: ss.fit_many([(None, bad), (None, late)], S3, where=[False, True]), " of curve 1"),
        (lambda: ss.CubicSpline(None, (np.zeros((10, 2)), late), "r:2 x sphere:3"), ""),
    ):
        with pytest.warns(UserWarning, match=rf"points\[8\] and points\[9\]{curve} have"):
            call()
    silent(lambda: ss.fit_many([(None, bad)], S3, where=[False]))


@pytest.mark.filterwarnings("error")
def test_it_can_be_silenced_as_it_says():
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="neighbours of opposite sign")
        ss.CubicSpline(None, flipped(9), "sphere:3")


def test_other_motions_do_not_warn():
    q, turns = motion(), ss.rotations.from_quaternions(flipped(4), scalar_first=True)
    # Of two quaternions at right angles neither sign is the nearer one.
    for space, points in ((S3, q), (S3, -q), (S3, q[::-1]), (S3, np.eye(4)[:3]), ("rp:3", flipped(4)), ("so:3", turns)):
        silent(lambda space=space, points=points: ss.CubicSpline(None, points, space))
    silent(lambda: ss.CubicSpline(None, points_on(ss.Sphere(2), step=1.8), "sphere:2", on_failure="ignore"))
    q[3] = -q[2]
    with pytest.raises(ss.CutLocusError):
        silent(lambda: ss.CubicSpline(None, q, S3))


def test_noisy_quaternions_and_those_with_velocities():
    for make in (
        lambda q: ss.make_smoothing_spline(None, q, "sphere:3", 1.0),
        lambda q: ss.HermiteSpline(None, q, 0 * q, "sphere:3"),
    ):
        silent(lambda make=make: make(motion()))
        with pytest.warns(UserWarning, match=r"points\[3\] and points\[4\] have") as caught:
            make(flipped(4))
        assert caught[0].filename == __file__
