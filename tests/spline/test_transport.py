"""Parallel transport along curves."""

from itertools import pairwise

import numpy as np
import pytest
from cases import EPS, has_metric, unit_tangent, walk
from refused import raises

import symspline as ss

SEED = 4
NAMES = ["sphere:2", "sphere:3", "h:3", "so:3", "o:3", "so:4", "u:3", "su:3", "cp:1", "cp:2", "rp:2", "gr:2,5"]
NAMES += ["cgr:2,4", "se:2", "se:3", "spd:3", "hpd:2", "ch:2", "r:3", "so:2", "gr:3,5"]
KNOTS = np.array([0.0, 0.4, 1.9, 2.3, 3.6, 4.0])


def by_polygons(spline, a, b, v):
    """Transport along polygons of geodesics, whose error is a series in the square of the step: extrapolated."""
    inner = spline.t[(spline.t > a) & (spline.t < b)]
    pieces = list(zip([a, *inner], [*inner, b], strict=True))

    def along(steps):
        x = np.concatenate([[a], *(np.linspace(c, d, steps + 1)[1:] for c, d in pieces)])
        points, moved = spline(x), v
        for p, q in pairwise(points):
            moved = spline.space.transport(p, q, moved)
        return moved

    rows = [[along(2**j)] for j in range(2, 9)]
    for j in range(1, len(rows)):
        for k in range(1, j + 1):
            rows[j].append(rows[j][k - 1] + (rows[j][k - 1] - rows[j - 1][k - 1]) / (4**k - 1))
    return rows[-1][-1]


@pytest.mark.parametrize("name", NAMES)
def test_transport_is_the_limit_of_short_geodesics(name, rng):
    space = ss.space(name)
    spline = ss.CubicSpline(KNOTS, walk(space, 0.6, len(KNOTS), rng), space)
    a, b = 0.3, 3.7
    v = unit_tangent(space, spline(a), rng)
    found = spline.transport(a, b, v)
    scale = np.abs(found).max() * np.max(space._rounding(spline(np.linspace(a, b, 20))))
    # Two thousand transports leave some thousand rounding errors.
    np.testing.assert_allclose(found, by_polygons(spline, a, b, v), rtol=0, atol=5e-12 * scale)
    np.testing.assert_allclose(spline.transport(b, a, found), v, rtol=0, atol=500 * EPS * scale)
    # In parts.
    half = spline.transport(a, 1.9, v)
    np.testing.assert_allclose(spline.transport(1.9, b, half), found, rtol=0, atol=500 * EPS * scale)
    if has_metric(space):
        assert space.norm(spline(b), found) == pytest.approx(1.0, abs=200 * EPS * scale)


@pytest.mark.parametrize("turns", [1, 2, -1])
def test_round_a_curve_on_the_sphere_a_vector_turns_by_the_enclosed_area(turns):
    """Gauss–Bonnet."""
    t = np.linspace(0, 1, 31)
    tilt = 0.7 + 0.2 * np.sin(4 * np.pi * t)
    phi = 2 * np.pi * t
    points = np.stack([np.sin(tilt) * np.cos(phi), np.sin(tilt) * np.sin(phi), np.cos(tilt)], axis=-1)
    points[-1] = points[0]
    spline = ss.CubicSpline(t, points, "sphere:2", bc_type="periodic")
    # The area by Gauss quadrature, which is exact between knots: ∫ (1 − z) dφ.
    nodes, weights = np.polynomial.legendre.leggauss(30)
    x = (t[:-1, None] + np.diff(t)[:, None] * (nodes + 1) / 2).ravel()
    (x1, y1, z1), (u, v, _) = spline(x).T, spline(x, nu=1).T
    area = np.sum((1 - z1) * (x1 * v - y1 * u) / (x1**2 + y1**2) * np.tile(weights, 30) / 60)
    start = points[0]
    ahead = np.cross([0, 1.0, 0], start)
    ahead /= np.linalg.norm(ahead)
    across = np.cross(start, ahead)
    expected = np.cos(turns * area) * ahead + np.sin(turns * area) * across
    np.testing.assert_allclose(spline.transport(0, turns, ahead), expected, atol=2e-13)


def test_batches_products_and_large_spaces(rng):
    space = ss.Sphere(2)
    points = np.stack([walk(space, 0.5, len(KNOTS), rng) for _ in range(3)])
    batch = ss.CubicSpline(KNOTS, points, space)
    v = space.random_tangent(rng, batch(0.2))
    found = batch.transport(0.2, 3.0, v)
    assert np.array_equal(found, np.stack([one.transport(0.2, 3.0, w) for one, w in zip(batch, v, strict=True)]))
    pair = ss.CubicSpline(KNOTS, (points[0], KNOTS[:, None]), "sphere:2 x r:1")
    moved, flat = pair.transport(0.2, 3.0, (v[0], np.array([2.0])))
    assert np.array_equal(moved, found[0]) and flat == 2.0
    # A great sphere of many dimensions, and what is orthogonal to it.
    basis = np.linalg.qr(rng.normal(size=(300, 4)))[0]
    large = ss.CubicSpline(KNOTS, points[0] @ basis[:, :3].T, ss.Sphere(299))
    there = large.transport(0.2, 3.0, v[0] @ basis[:, :3].T + 0.5 * basis[:, 3])
    np.testing.assert_allclose(there, found[0] @ basis[:, :3].T + 0.5 * basis[:, 3], atol=1e-14)
    days = np.datetime64("2026-01-01") + np.arange(len(KNOTS))
    dated = ss.CubicSpline(days, points[0], space)
    expected = ss.CubicSpline(np.arange(len(KNOTS)) * 86400.0, points[0], space)
    assert np.array_equal(
        dated.transport(days[0], days[3], dated(days[0], nu=1)),
        expected.transport(0, 3 * 86400.0, dated(days[0], nu=1)),
    )


def test_invalid_vectors_to_transport_raise():
    spline = ss.CubicSpline(None, np.eye(3), "sphere:2", extrapolate="geodesic")
    for x0, x1, v, match in [
        (0, 2.5, [0, 1.0, 0], r"x\[1\] = 2.5 is outside the domain"),
        (-1, 1, [0, 1.0, 0], "vectors are transported between the first"),
        (0, [1, 2], [0, 1.0, 0], "x0 and x1 must be single times"),
        (0, 1, ["a", "b", "c"], "v must be an array of real numbers"),
        (0, 1, [1.0, 1.0, 0], "not tangent"),
        (0, 1, [1.0, 1.0], "shape"),
    ]:
        raises(match, spline.transport, x0, x1, v)


def test_curves_that_were_not_found_stop_no_other():
    points = [[[1, 0, 0], [-1, 0, 0]], [[1, 0, 0], [0, 1, 0]]]
    spline = ss.CubicSpline(None, points, "sphere:2", on_failure="ignore")
    found = spline.transport(0, 1, [0, 1.0, 2.0])
    assert np.isnan(found[0]).all()
    np.testing.assert_allclose(found[1], [-1, 0, 2], atol=1e-15)
