"""CH¹ is the hyperbolic plane with half its distances, and CHⁿ contains Hⁿ."""

import numpy as np
import pytest
from cases import walk

import symspline as ss

SEED = 20

LINE, PLANE = ss.ComplexHyperbolic(1), ss.Hyperbolic(2)
T = np.array([0, 1, 1.7, 3, 3.4, 4.4, 5.4, 6])


def to_plane(z, dz=None):
    """|z₀|² + |z₁|² and 2 z̄₀z₁, as Hopf's map of CP¹; or the tangent vector there of dz."""
    a, b = z[..., 0], z[..., 1]
    if dz is None:
        across = 2 * a.conj() * b
        return np.stack([np.abs(a) ** 2 + np.abs(b) ** 2, across.real, across.imag], axis=-1)
    da, db = dz[..., 0], dz[..., 1]
    height, across = 2 * (a.conj() * da + b.conj() * db).real, 2 * (da.conj() * b + a.conj() * db)
    return np.stack([height, across.real, across.imag], axis=-1)


def turned(z, rng):
    """The same points at other phases."""
    return z * np.exp(1j * rng.uniform(0, 2 * np.pi, z.shape[:-1]))[..., None]


def test_distances_are_half_of_those_of_the_hyperbolic_plane(rng):
    p, q = LINE.random_point(rng, (2, 100))
    np.testing.assert_allclose(LINE.distance(p, q), PLANE.distance(to_plane(p), to_plane(q)) / 2, rtol=1e-12)
    v = LINE.random_tangent(rng, p)
    np.testing.assert_allclose(LINE.norm(p, v), PLANE.norm(to_plane(p), to_plane(p, v)) / 2, rtol=1e-12)
    assert LINE.curvature == 2 * PLANE.curvature
    np.testing.assert_allclose(
        to_plane(LINE.geodesic(p, q, 0.3)), PLANE.geodesic(to_plane(p), to_plane(q), 0.3), rtol=1e-12, atol=1e-12
    )


@pytest.mark.parametrize("ends", ["natural", "not-a-knot", "clamped"])
def test_splines_are_those_of_the_hyperbolic_plane(ends, rng):
    z = turned(walk(LINE, 0.6, len(T), rng), rng)
    spline = ss.CubicSpline(T, z, LINE, bc_type=ends)
    expected = ss.CubicSpline(T, to_plane(z), PLANE, bc_type=ends)
    x = np.linspace(0, 6, 100)
    scale = np.abs(expected(x)).max()
    for nu, allowed in zip(range(3), (1e-12, 1e-11, 1e-10), strict=True):
        found = to_plane(spline(x)) if nu == 0 else to_plane(spline(x), spline(x, nu))
        np.testing.assert_allclose(found, expected(x, nu), atol=allowed * scale)


@pytest.mark.parametrize("n", [2, 3])
def test_real_points_are_hyperbolic_space(n, rng):
    """Hⁿ lies in CHⁿ as the points that conjugation leaves: a spline of real points is real, and that of Hⁿ."""
    space, small = ss.ComplexHyperbolic(n), ss.Hyperbolic(n)
    p = walk(small, 0.5, len(T), rng)
    spline = ss.CubicSpline(T, p.astype(complex), space)
    expected = ss.CubicSpline(T, p, small)
    x = np.linspace(0, 6, 50)
    for nu, allowed in zip(range(3), (1e-12, 1e-11, 1e-10), strict=True):
        np.testing.assert_allclose(spline(x, nu), expected(x, nu), atol=allowed * np.abs(p).max())
