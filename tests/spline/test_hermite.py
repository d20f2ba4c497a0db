"""The interface of `HermiteSpline`."""

import numpy as np
import pytest
from compare import each, largest_difference, off, vectors_off
from curves import KNOTS, S2, THREE, bezier, every_batch, every_kind, points_on, tangents_at
from refused import raises
from scipy.interpolate import CubicHermiteSpline

import symspline as ss

X = np.linspace(0, 4.5, 41)


def curve(space, batch=(), **options):
    p = points_on(space, 6, batch, step=0.4)
    return ss.HermiteSpline(KNOTS, p, tangents_at(space, p), space, **options)


def test_flat_space_of_hermite_splines_is_scipys():
    rng = np.random.default_rng(0)
    p, v = rng.standard_normal((2, 6, 3))
    ours, scipy = ss.HermiteSpline(KNOTS, p, v, "r:3"), CubicHermiteSpline(KNOTS, p, v)
    # At knots, too, where the acceleration jumps.
    x = np.concatenate([X, KNOTS])
    for nu in range(3):
        assert np.abs(ours(x, nu=nu) - scipy(x, nu)).max() < 1e-13


@every_kind
@every_batch
def test_hermite_spline_with_spline_velocities_is_the_spline(space, batch):
    p = points_on(space, 6, batch, step=0.4)
    spline = ss.CubicSpline(KNOTS, p, space)
    found = ss.HermiteSpline(KNOTS, p, spline.velocities, space)
    for nu in range(2):
        assert largest_difference(found(X, nu=nu), spline(X, nu=nu)) < 1e-13
    assert np.allclose(found.speed(X), spline.speed(X), rtol=1e-12)
    assert np.allclose(found.length(), spline.length(), rtol=1e-12)
    assert found.speed(X).shape == (*batch, 41)


@every_kind
def test_segments_are_bezier_curves(space):
    found = curve(space)
    for i, tau in ((0, 0.3), (2, 0.8), (4, 0.5)):
        control = each(lambda c, i=i: c[i], found.control_points)
        x = KNOTS[i] + tau * (KNOTS[i + 1] - KNOTS[i])
        assert off(space, bezier(space, control, tau), found(x)) < 1e-14


@every_kind
def test_hermite_spline_has_the_given_points_and_velocities(space):
    p = points_on(space, 6, step=0.4)
    v = tangents_at(space, p)
    found = ss.HermiteSpline(KNOTS, p, v, space)
    assert off(space, found(KNOTS), p) < 1e-14
    # From both sides of every knot.
    for x, own in ((KNOTS[:-1], slice(0, -1)), (np.nextafter(KNOTS[1:], 0), slice(1, None))):
        here, there = (each(lambda a, own=own: a[own], value) for value in (p, v))
        assert vectors_off(space, found(x), found(x, nu=1), here, there) < 1e-13
    assert largest_difference(found.velocities, v) < 1e-14
    assert largest_difference(found.points, p) < 1e-14


ZERO = np.zeros((3, 3))


def test_invalid_arguments_of_hermite_splines_raise():
    for match, changes in [
        (r"velocities has shape \(2, 3\), but points \(3, 3\)", {"velocities": np.zeros((2, 3))}),
        (r"velocities\[1, 2\] is not finite", {"velocities": [[0, 0, 0], [0, 0, np.inf], [0, 0, 0]]}),
        (r"velocities\[1\] is not tangent .* use space.project_tangent", {"velocities": [[0, 1, 0]] * 3}),
        ("velocities must be a tuple of 2 arrays", {"points": (THREE, ZERO[:, :1]), "space": "sphere:2 x r:1"}),
        ("the space by", {"points": 2 * np.eye(3)}),
        (r"t\[1\]", {"t": [0, 0, 1]}),
        ("extrapolate must be", {"extrapolate": "linear"}),
        ("unknown space", {"space": "round:2"}),
    ]:
        arguments = {"t": None, "points": THREE, "velocities": ZERO, "space": S2} | changes
        raises(match, ss.HermiteSpline, **arguments)


def test_control_points_beyond_reach_raise():
    for batch, curve in [((), ""), ((2,), " of curve 1"), ((2, 3), " of curve 1,2")]:
        velocities = np.zeros((*batch, 3, 3))
        # The second segment's inner points are (1, 0, 0) and its antipode.
        velocities[(*(n - 1 for n in batch), 2, 0)] = 1.5 * np.pi
        points = np.broadcast_to([[0.0, 1, 0], [1, 0, 0], [0, 1, 0]], velocities.shape)
        with pytest.raises(
            ss.CutLocusError, match=rf"segment 1{curve}.*between t\[1\] and t\[2\].*Reduce the velocities at its ends"
        ):
            ss.HermiteSpline(None, points, velocities, S2)


def test_an_empty_batch_and_rounded_velocities():
    empty = ss.HermiteSpline(None, np.zeros((0, 3, 3)), np.zeros((0, 3, 3)), "sphere:2")
    assert empty(0.5).shape == (0, 3)
    # Off the tangent space by what files may round.
    p = points_on(S2)
    v = S2.project_tangent(p, np.roll(p, 1, axis=1))
    curve = ss.HermiteSpline(None, p, v + 1e-10 * p, S2)
    assert np.abs(np.sum(curve.points * curve.velocities, axis=-1)).max() < 1e-15
    assert np.abs(curve.velocities - v).max() < 1e-15
    # Off the tangent space by what single precision may round.
    rounded = np.array([[1e-6 / 3, 1 / 3, 1 / 7], [1 / 7, 0, 1 / 3], [1 / 3, 1 / 7, 0]])
    assert ss.HermiteSpline(None, np.eye(3), rounded.astype(np.float32), "sphere:2").velocities[0, 0] == 0
    with pytest.raises(ss.ValidationError, match=r"velocities\[0\] is not tangent .* \(allowed: 1e-8\)") as caught:
        ss.HermiteSpline(None, np.eye(3), rounded, "sphere:2")
    assert caught.value.curve == () and caught.value.node == 0
