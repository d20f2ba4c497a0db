"""Horizontal lifts: representatives that are continuous and turn no more than their subspaces."""

import numpy as np
import pytest
from cases import EPS, loop_over, walk
from compare import same
from refused import raises

import symspline as ss

SEED = 11
NAMES = ["rp:2", "rp:3", "cp:1", "cp:3", "gr:2,5", "gr:2,3", "cgr:2,4", "hp:2", "ch:2"]
KNOTS = np.array([0.0, 0.4, 1.9, 2.3, 3.6, 4.0, 5.1])


def wide(space, x):
    """As matrices."""
    return x.reshape(*x.shape[: x.ndim - len(space.point_shape)], space.point_shape[0], -1)


def turned(space, points, rng):
    """The same points with random unitary factors on their right."""
    matrices = wide(space, points)
    k = matrices.shape[-1]
    noise = rng.normal(size=(*matrices.shape[:-2], k, k))
    if np.iscomplexobj(points):
        noise = noise + 1j * rng.normal(size=noise.shape)
    q, r = np.linalg.qr(noise)
    # With the phases that QR takes away.
    phases = np.diagonal(r, axis1=-2, axis2=-1)
    return (matrices @ (q * (phases / np.abs(phases))[..., None, :])).reshape(points.shape)


def points_of(name, rng, step=0.8):
    """Points that are `step` apart, with representatives in disorder."""
    space = ss.space(name)
    return space, turned(space, walk(space, step, len(KNOTS), rng), rng)


def inner(space, x, y):
    """X*Y, with the form of complex hyperbolic space there."""
    x, y = wide(space, x), wide(space, y)
    if isinstance(space, ss.ComplexHyperbolic):
        x = x * np.array([[-1.0], *[[1.0]] * (x.shape[-2] - 1)])
    return np.swapaxes(x.conj(), -1, -2) @ y


@pytest.mark.parametrize("name", NAMES)
def test_lift_is_horizontal_and_projects_to_the_curve(name, rng):
    space, points = points_of(name, rng)
    spline = ss.CubicSpline(KNOTS, points, space)
    x = np.sort(np.append(rng.uniform(0, KNOTS[-1], 200), KNOTS))
    lifted, moving = spline.lift(x), spline.lift(x, nu=1)
    assert np.max(space.distance(lifted, spline(x))) < 100 * EPS * np.max(space._rounding(lifted))
    assert np.abs(inner(space, lifted, moving)).max() < 100 * EPS * np.max(space._rounding(lifted))
    # nu = 1 is the derivative of the arrays, nu = 2 its horizontal part, by central differences of order four.
    h, x = 1e-3, x[(np.abs(x[:, None] - KNOTS) > 3e-3).all(axis=1)]
    around = [spline.lift(x + i * h, nu=0) for i in (-2, -1, 1, 2)]
    slope = (around[0] - 8 * around[1] + 8 * around[2] - around[3]) / (12 * h)
    np.testing.assert_allclose(slope, spline.lift(x, nu=1), rtol=0, atol=3e-9 * np.abs(slope).max() + 1e-9)
    around = [spline.lift(x + i * h, nu=1) for i in (-2, -1, 1, 2)]
    slope = (around[0] - 8 * around[1] + 8 * around[2] - around[3]) / (12 * h)
    bend = space.project_tangent(spline.lift(x), slope)
    np.testing.assert_allclose(bend, spline.lift(x, nu=2), rtol=0, atol=1e-7 * np.abs(bend).max())


@pytest.mark.parametrize("name", NAMES)
@loop_over("nu", [0, 1, 2])
def test_lift_is_continuous_at_knots(name, nu, rng):
    space, points = points_of(name, rng)
    spline = ss.CubicSpline(KNOTS, points, space, bc_type="not-a-knot")
    inner_knots = KNOTS[1:-1]
    left, right = spline.lift(inner_knots - 1e-13, nu=nu), spline.lift(inner_knots, nu=nu)
    # The jump of a curve within 1e-13 is that times its next derivative.
    size = np.abs(spline.lift(KNOTS, nu=min(nu + 1, 2))).max() + np.abs(spline.lift(KNOTS, nu=2)).max() / 0.4
    assert np.abs(left - right).max() < 1e-12 * np.max(space._rounding(points)) * size
    # The call itself jumps there, or this test shows nothing.
    if nu == 0:
        assert np.abs(spline(inner_knots - 1e-13) - spline(inner_knots)).max() > 0.1


@pytest.mark.parametrize("name", NAMES)
def test_lift_does_not_depend_on_representatives(name, rng):
    space, points = points_of(name, rng)
    other = turned(space, points, rng)
    x = rng.uniform(-0.5, KNOTS[-1] + 0.5, 50)
    for outside in (True, "geodesic"):
        a, b = (ss.CubicSpline(KNOTS, p, space, extrapolate=outside) for p in (points, other))
        for nu in range(3):
            expected = a.lift(x, nu=nu)
            size = np.abs(expected).max() * np.max(space._rounding(expected if nu == 0 else points))
            np.testing.assert_allclose(b.lift(x, points[0], nu=nu), expected, rtol=0, atol=3e-13 * size)


def test_a_line_field_of_half_turns_comes_back_with_the_other_sign():
    angle = np.linspace(0, np.pi, 9)
    spline = ss.CubicSpline(None, np.stack([np.cos(angle), np.sin(angle)], axis=-1), "rp:1", bc_type="periodic")
    np.testing.assert_allclose(spline.lift([8.0, 16.0, -8.0])[:, 0], [-1, 1, -1], atol=1e-14)


def test_spaces_with_unique_arrays_are_evaluated():
    rng = np.random.default_rng(2)
    for name in ("sphere:2", "so:3", "spd:2", "se:3", "u:2", "h:2", "r:3"):
        space = ss.space(name)
        points = walk(space, 0.5, 4, rng)
        spline = ss.CubicSpline(None, points, space)
        x = np.linspace(0, 3, 7)
        for nu in range(3):
            assert same(spline.lift(x, nu=nu), spline(x, nu))
        assert same(spline.lift(x, points[0]), spline(x))
        raises("away from the nearest", spline.lift, x, points[1])


def test_batches_products_and_large_spaces_of_lifts(rng):
    space, points = points_of("cp:2", rng)
    both = np.stack([points, turned(space, points, rng)])
    knots = np.stack([KNOTS, 2 * KNOTS])
    batch = ss.CubicSpline(knots, both, space)
    x = np.stack([np.linspace(0, 5, 9), np.linspace(0, 10, 9)])
    found = batch.lift(x, points[0], per_curve=True)
    np.testing.assert_allclose(found[0], found[1], atol=1e-14)
    assert same(found[0], ss.CubicSpline(KNOTS, points, space).lift(x[0]))
    assert same(batch[1].lift(x[1], points[0]), found[1])
    pair = ss.CubicSpline(KNOTS, (points, points.real.cumsum(axis=0)), "cp:2 x r:3")
    lifted, plain = pair.lift(x[0], (points[0] * 1j, None))
    assert same(plain, pair(x[0])[1])
    np.testing.assert_allclose(lifted, 1j * found[0], atol=1e-15)
    # The same curve in a subspace of many dimensions.
    rotation = np.linalg.qr(rng.normal(size=(300, 3)))[0]
    large = ss.CubicSpline(KNOTS, points @ rotation.T, "cp:299")
    np.testing.assert_allclose(
        large.lift(x[0], nu=1), ss.CubicSpline(KNOTS, points, space).lift(x[0], nu=1) @ rotation.T, atol=1e-13
    )


def test_invalid_representatives_raise():
    spline = ss.CubicSpline(None, [[1, 0, 0], [0.6, 0.8, 0]], "rp:2")
    for start, what in [
        ([0.8, 0.6, 0.0], r"start is 6\.325e-01 away from the nearest representative of the first point"),
        ([-2.0, 0.0, 0.0], r"start is 1\.000e\+00 away"),
        ([1.0, 0.0], r"start has shape \(2,\), but RealProjective\(2\) needs shape"),
        ([np.nan, 0.0, 0.0], r"start is nan away"),
        (["1", "0", "0"], r"start must be an array of real numbers, not of <U1"),
        ([None, 0.0, 0.0], r"start.* must be an array of numbers, not of object"),
        ([[1.0], [0.0, 0.0]], r"start is not an array of equally long rows"),
        ([1j, 0.0, 0.0], r"start must be .*complex128"),
    ]:
        raises(what, spline.lift, 0.5, start)


def test_a_lift_is_followed_so_far_and_no_further():
    spline = ss.CubicSpline(None, [[1, 0], [0.6, 0.8j]], "cp:1", extrapolate=True)
    assert np.isfinite(spline.lift([-99.0, 99.0])).all()
    raises(r"x\[1\] = 102.0 is more than 100 lengths of the last segment", spline.lift, [0.5, 102.0])
    raises("outside the knots", ss.CubicSpline(None, [[1, 0], [0.6, 0.8j]], "cp:1").lift, 1.5)
