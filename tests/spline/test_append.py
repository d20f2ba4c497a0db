"""Splines with further points at their end."""

import numpy as np
import pytest
from curves import every_kind, points_on
from refused import raises

import symspline as ss


def path(space, n, rng, step=0.3):
    """Points of a random walk."""
    points = [space.random_point(rng)]
    for _ in range(n - 1):
        points.append(space.exp(points[-1], step * space.random_tangent(rng, points[-1])))
    return np.array(points)


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "spd:2", "h:2", "r:3"])
@pytest.mark.parametrize("bc_type", ["natural", "not-a-knot", "clamped"])
def test_a_fixed_lag_is_near_the_fit_of_all_points(name, bc_type, rng):
    space = ss.space(name)
    t, points = np.cumsum(rng.uniform(0.3, 2, 90)), path(space, 90, rng)
    spline = ss.CubicSpline(t[:40], points[:40], space, bc_type=bc_type)
    long, short = spline, spline
    for i in range(40, 90):
        long, short = long.append(t[i], points[i], lag=20), short.append(t[i], points[i], lag=4)
    whole = ss.CubicSpline(t, points, space, bc_type=bc_type)
    scale = np.abs(whole.velocities).max()
    assert np.abs(long.velocities - whole.velocities).max() < 1e-8 * scale
    # The lag matters.
    assert 1e-6 * scale < np.abs(short.velocities - whole.velocities).max() < 1e-1 * scale
    assert long.t.tolist() == t.tolist() and np.abs(long.points - points).max() < 1e-12
    assert long.bc_type == bc_type and long.report.converged
    assert long.report.max_step == pytest.approx(whole.report.max_step)
    assert long.report.max_gap == pytest.approx(whole.report.max_gap)
    # All segments are fitted again.
    assert spline.append(t[40:], points[40:], lag=None) == whole
    assert np.abs(spline.append(t[40:], points[40:]).velocities - whole.velocities).max() < 1e-5 * scale


@pytest.mark.parametrize("lag", [2, 3, 5])
def test_append_changes_the_last_lag_segments_only(lag, rng):
    points = path(ss.Sphere(2), 12, rng)
    before = ss.CubicSpline(None, points[:11], "sphere:2")
    after = before.append(11.0, points[11], lag=lag)
    kept = np.abs(after.velocities[:11] - before.velocities).max(axis=1) < 1e-13
    assert kept.tolist() == [True] * (11 - lag) + [False] * lag


def test_append_does_not_forget_a_failure(rng):
    points = path(ss.Sphere(2), 30, rng)
    poor = ss.CubicSpline(None, points[:20], "sphere:2", max_iter=1, on_failure="ignore")
    longer = poor.append(np.arange(20.0, 30), points[20:], lag=2)
    assert not poor.report.converged and not longer.report.converged


@every_kind
def test_every_space(space, rng):
    t = np.array([0.0, 0.4, 1.5, 1.9, 3.0, 3.3])
    points = points_on(space, n=6, step=0.4, batch=(2,))
    first, rest, last = (
        tuple(p[:, own] for p in points) if isinstance(points, tuple) else points[:, own]
        for own in (slice(4), slice(4, 6), 5)
    )
    spline = ss.CubicSpline(t[:4], first, space)
    whole = ss.CubicSpline(t, points, space)
    # The lag covers the whole curve.
    assert spline.append(t[4:], rest) == whole
    near = spline.append(t[4:], rest, lag=2)
    for a, b in zip(near._curve.parts, whole._curve.parts, strict=True):
        assert np.abs(a.velocities - b.velocities).max() < 0.3 * max(1, np.abs(b.velocities).max())
    five = tuple(p[:, :5] for p in points) if isinstance(points, tuple) else points[:, :5]
    one = ss.CubicSpline(t[:5], five, space)
    assert one.append(t[5], last, lag=None) == whole


def test_dates_and_files(rng, tmp_path):
    t = np.datetime64("2026-01-01", "s") + np.cumsum(rng.integers(1, 9, 30))
    points = path(ss.Sphere(2), 30, rng)
    ss.CubicSpline(t[:29], points[:29], "sphere:2").save(tmp_path / "a.npz")
    spline = ss.load(tmp_path / "a.npz").append(t[29], points[29], lag=25)
    whole = ss.CubicSpline(t, points, "sphere:2")
    assert spline.t.tolist() == t.tolist()
    assert np.abs(spline.velocities - whole.velocities).max() < 1e-10
    assert spline.report.max_step == pytest.approx(whole.report.max_step)
    # Batches count times from their own first knots.
    both = ss.CubicSpline(np.stack([t[:20], t[:20] + 5]), np.stack([points[:20]] * 2), "sphere:2")
    later = both.append(np.stack([t[20:22], t[20:22] + 5]), np.stack([points[20:22]] * 2), lag=8)
    own = ss.CubicSpline(t[:20], points[:20], "sphere:2").append(t[20:22], points[20:22], lag=8)
    assert np.abs(later.velocities - own.velocities).max() < 1e-13


def test_invalid_points_to_append_raise(rng):
    spline = ss.CubicSpline(None, rng.standard_normal((5, 2)), "r:2")
    for call, message in [
        (
            lambda: spline.append(4.0, [0, 0]),
            "t is 4.0, but times must be finite and increase from the last knot 4.0 on",
        ),
        (lambda: spline.append([5, 5], np.zeros((2, 2))), r"t\[1\] is 5, but times must be finite and increase"),
        (lambda: spline.append([5, np.inf], np.zeros((2, 2))), r"t\[1\] is inf, but times must be finite"),
        (lambda: spline.append([[5]], [0, 0]), "t has shape"),
        (lambda: spline.append(5, [0, 0, 0]), "points has shape"),
        (lambda: spline.append([5, 6], [[0, 0]]), "points has shape"),
        (lambda: spline.append(5, [0, np.nan]), "points"),
        (lambda: spline.append(5, [0, 0], lag=1), "lag must be"),
        (lambda: spline.append(np.datetime64("2026-01-01"), [0, 0]), "must be numbers"),
    ]:
        raises(message, call)
    angles = np.linspace(0, 3, 30)
    arc = ss.CubicSpline(angles, np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1), "sphere:2")
    with pytest.raises(ss.CutLocusError, match=r"points\[29\] and points\[30\]") as caught:
        arc.append(4.0, -arc.points[-1])
    assert caught.value.node == 29 and len(caught.value.spline.t) == 31
    square = ss.CubicSpline(None, [[0, 0], [1, 0], [1, 1], [0, 0]], "r:2", bc_type="periodic")
    raises("closed curve has no end", square.append, 9, [0, 0])
    smooth = ss.make_smoothing_spline(np.arange(30.0), rng.standard_normal((30, 1)), "r:1", lam=1.0)
    raises("cannot be appended to a SmoothingSpline", smooth.append, 40, [0])


def test_durations():
    t, points = np.arange(9) * np.timedelta64(1500, "ms"), np.random.default_rng(1).standard_normal((9, 2))
    found = (
        ss.CubicSpline(t[:6], points[:6], "r:2").append(t[6], points[6], lag=None).append(t[7:], points[7:], lag=None)
    )
    assert found == ss.CubicSpline(t, points, "r:2")
