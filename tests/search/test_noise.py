"""Extrema and crossings of densely sampled motions, whose derivatives consist of rounding errors."""

import numpy as np
import pytest

import symspline as ss

AXIS = np.array([0.3, 0.6, 0.9])


def swing(rate, seconds, start=0.0):
    """A rotation by sin(2πt/10) about a fixed axis, and its times."""
    t = start + np.arange(0, seconds, 1 / rate)
    return t, ss.rotations.from_rotation_vectors(np.sin(2 * np.pi * t / 10)[:, None] * AXIS)


@pytest.mark.parametrize(("rate", "start"), [(1000, 0.0), (400, 3.7), (4000, 0.0)])
def test_dense_samples_have_the_extrema_of_the_motion(rate, start):
    seconds = 12 if rate < 2000 else 3.5
    t, points = swing(rate, seconds, start)
    curve = ss.CubicSpline(t, points, "so:3", bc_type="not-a-knot")
    # The acceleration of a rotation about a fixed axis is that of its angle, times √2 in this metric.
    scale = np.linalg.norm(AXIS) * (2 * np.pi / 10) ** 2
    wanted = np.arange(2.5, 40, 5)
    wanted = wanted[(wanted > t[0] + 0.1) & (wanted < t[-1] - 0.1)]
    times, values = curve.extrema("acceleration")
    inside = (times > t[0] + 0.1) & (times < t[-1] - 0.1)
    # Where the maximum lies is as uncertain as the square root of the relative noise.
    noise = 1e-14 * rate**2 / scale
    assert np.allclose(times[inside], wanted, atol=20 * np.sqrt(noise) + 1e-3)
    ratio = values[inside] / scale
    assert np.allclose(ratio, ratio[0], rtol=100 * noise) and len(times) <= len(wanted) + 2


def test_crossings_of_dense_samples():
    t, points = swing(1000, 20)
    curve = ss.CubicSpline(t, points, "so:3", bc_type="not-a-knot")
    peak = curve.extrema("acceleration")[1].max()
    times = curve.solve("acceleration", peak / 2)
    wanted = np.array([np.arcsin(0.5), np.pi - np.arcsin(0.5)]) * 10 / (2 * np.pi)
    assert np.allclose(times, np.concatenate([wanted + 5 * k for k in range(4)]), atol=1e-5)


def test_points_far_from_the_origin_have_larger_errors():
    """UTM coordinates in metres at 200 Hz: errors of 1e-9 m are accelerations of 4e-5 m/s²."""
    t = np.arange(0, 20, 1 / 200)
    points = np.array([5e5, 4e6]) + 10 * np.stack([np.cos(t / 2), 0.6 * np.sin(t / 2)], axis=-1)
    times, _ = ss.CubicSpline(t, points, "r:2", bc_type="not-a-knot").extrema("acceleration")
    # The long axis of the ellipse has the largest acceleration, at multiples of 2π.
    inside = (times > 0.5) & (times < 19.5)
    assert np.allclose(times[inside], 2 * np.pi * np.arange(1, 4), atol=0.3)


def test_small_extrema_of_sparse_samples_are_found():
    """Small extrema that exceed rounding errors are found: a ripple of 1e-7 of the speed at 10 Hz."""
    t = np.arange(0, 20, 0.1)
    curve = ss.CubicSpline(t, (t + 1e-7 * np.sin(2 * t) / 2)[:, None], "r:1", bc_type="not-a-knot")
    times, values = curve.extrema("speed")
    inside = (times > 0.5) & (times < 19.5)
    assert np.allclose(times[inside], np.arange(np.pi, 19.5, np.pi), atol=0.02)
    assert np.allclose(values[inside] - 1, 1e-7, rtol=0.02)
