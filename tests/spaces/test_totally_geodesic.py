"""Siegel's half space, quaternionic lines and quadrics as totally geodesic parts of other spaces."""

import numpy as np
from refused import raises

import symspline as ss
from symspline import convert

KNOTS = np.array([0.0, 0.7, 2.0, 2.4, 3.9, 5.0])
X = np.linspace(0, 5, 61)


def turned(x):
    return np.swapaxes(x, -1, -2)


def symplectic(n):
    return np.block([[np.zeros((n, n)), np.eye(n)], [-np.eye(n), np.zeros((n, n))]])


def test_siegel_of_one_dimension_is_the_half_plane():
    ball = 0.6 * np.random.default_rng(1).uniform(-1, 1, (6, 2))
    half = convert.ball_to_half_space(ball)
    hyperbolic_curve = ss.CubicSpline(KNOTS, convert.ball_to_hyperboloid(ball), "h:2", bc_type="not-a-knot")
    # The last coordinate of the half space is the height.
    z = (half[:, 0] + 1j * half[:, 1])[:, None, None]
    curve = ss.CubicSpline(KNOTS, convert.siegel_to_positive_definite(z), "spd:2", bc_type="not-a-knot")
    found = convert.positive_definite_to_siegel(curve(X))[:, 0, 0]
    expected = convert.hyperboloid_to_half_space(hyperbolic_curve(X))
    np.testing.assert_allclose(found, expected[:, 0] + 1j * expected[:, 1], atol=1e-12)


def test_siegel_there_and_back():
    rng = np.random.default_rng(2)
    x, y = rng.standard_normal((2, 7, 3, 3))
    z = x + turned(x) + 1j * (y @ turned(y) + 0.3 * np.eye(3))
    p = convert.siegel_to_positive_definite(z)
    j = symplectic(3)
    assert np.abs(turned(p) @ j @ p - j).max() <= 1e-12 * np.abs(p).max() ** 2
    back = convert.positive_definite_to_siegel(p)
    np.testing.assert_allclose(back, z, atol=1e-11)
    assert np.array_equal(back, turned(back))
    # Symplectic maps act by Möbius transformations on one side, by congruence on the other: here z ↦ −z⁻¹.
    moved = convert.siegel_to_positive_definite(-np.linalg.inv(z))
    np.testing.assert_allclose(moved, j @ p @ j.T, rtol=0, atol=1e-11 * np.abs(p).max())
    # Where the condition is 1e12 rounding may be 1e-4.
    far = convert.positive_definite_to_siegel(convert.siegel_to_positive_definite([[1e3 + 1j]]))
    np.testing.assert_allclose(far, [[1e3 + 1j]], rtol=1e-12)


def test_quaternionic_lines():
    rng = np.random.default_rng(3)
    q = np.add(rng.standard_normal((6, 2, 4)), [[2.0, 0, 0, 0], [0, 0, 0, 0]])
    q /= np.linalg.norm(q, axis=(-2, -1), keepdims=True)
    p = convert.quaternions_to_subspace(q)
    np.testing.assert_allclose(turned(p.conj()) @ p, np.broadcast_to(np.eye(2), (6, 2, 2)), atol=1e-15)
    np.testing.assert_allclose(convert.subspace_to_quaternions(p), q, atol=1e-15)
    curve = ss.CubicSpline(KNOTS, p, "cgr:2,4", bc_type="not-a-knot")
    found = convert.subspace_to_quaternions(curve(X))
    # HP¹ is the sphere of radius ½ in R⁵: (2 q₁ q̄₀, |q₁|² − |q₀|²)/2.
    sphere = ss.CubicSpline(KNOTS, hopf(q), "sphere:4", bc_type="not-a-knot")
    np.testing.assert_allclose(hopf(found), sphere(X), atol=1e-12)


def hopf(q):
    a, b = q[..., 0, :], q[..., 1, :]
    r, v = a[..., :1], -a[..., 1:]
    product = np.concatenate(
        [
            b[..., :1] * r - np.sum(b[..., 1:] * v, -1, keepdims=True),
            b[..., :1] * v + r * b[..., 1:] + np.cross(b[..., 1:], v),
        ],
        axis=-1,
    )
    height = np.sum(b**2, -1, keepdims=True) - np.sum(a**2, -1, keepdims=True)
    return np.concatenate([2 * product, height], axis=-1)


def test_distances_of_parts():
    rng = np.random.default_rng(6)
    q = rng.standard_normal((2, 3, 4))
    q /= np.linalg.norm(q, axis=(-2, -1), keepdims=True)
    p = convert.quaternions_to_subspace(q)
    # |⟨p, q⟩| of vectors of quaternions is the size of one complex block of p*q.
    size = np.linalg.norm(turned(p[0].conj()) @ p[1]) / np.sqrt(2)
    distance = ss.QuaternionicProjective(2).distance(*p)
    np.testing.assert_allclose(distance, np.sqrt(2) * np.arccos(size), rtol=1e-14)
    # Siegel (1943), §2: with the eigenvalues r of the cross-ratio, d² = Σ log²((1 + √r)/(1 − √r)).
    x, y = rng.standard_normal((2, 2, 3, 3))
    z, w = x + turned(x) + 1j * (y @ turned(y) + 0.3 * np.eye(3))
    ratio = (z - w) @ np.linalg.inv(z - w.conj()) @ (z.conj() - w.conj()) @ np.linalg.inv(z.conj() - w)
    r = np.sqrt(np.linalg.eigvals(ratio).real)
    expected = np.sqrt(2 * np.sum(np.log((1 + r) / (1 - r)) ** 2))
    found = ss.Siegel(3).distance(*convert.siegel_to_positive_definite(np.array([z, w])))
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_vectors_that_leave_a_part_are_refused():
    p = convert.siegel_to_positive_definite([[[1j]], [[1 + 2j]]])
    raises("not tangent", ss.CubicSpline, None, p, "siegel:1", bc_type=((1, np.eye(2)), "natural"))
    q = convert.quaternions_to_subspace([[[1.0, 0, 0, 0], [0, 0, 0, 0]], [[0.6, 0, 0, 0], [0, 0, 0.8, 0]]])
    v = np.zeros((4, 2), complex)
    v[2, 0] = 1.0
    raises("not tangent", ss.CubicSpline, None, q, "hp:1", bc_type=((1, v), "natural"))
    v[3, 1] = 1.0
    assert ss.CubicSpline(None, q, "hp:1", bc_type=((1, v), "natural")).report.converged


def test_invalid_quadric_points_raise():
    for space, points, why in [
        ("siegel:1", [np.eye(2), np.diag([2.0, 1.0])], r"points\[1\] is off .* it is not symplectic"),
        (
            "siegel:1",
            convert.siegel_to_positive_definite(np.array([[[1e6 / 3 + 1j]], [[1e6 / 3 + 2j]]])),
            "condition number of 1.2e22 is too large to verify .*; move all points by one isometry",
        ),
        # Curves through such points had values that are no numbers.
        (
            "spd:2",
            convert.siegel_to_positive_definite(np.array([[[1e7 + 1j]], [[1e7 + 2j]]])),
            "smallest eigenvalue is .* which is rounding beside the others",
        ),
        ("siegel:2", np.eye(2) * np.ones((3, 1, 1)) * 1j, "siegel_to_positive_definite converts"),
        ("hp:1", [np.eye(4)[:, :2], np.eye(4)[:, ::2]], r"points\[1\] is off .* no quaternionic line"),
        ("hp:1", np.eye(4)[:2] * np.ones((3, 1, 1)), "looks like vectors of quaternions"),
    ]:
        raises(why, ss.CubicSpline, None, points, space)


def test_invalid_subspaces_raise():
    for call, value, why in [
        (convert.siegel_to_positive_definite, [[[1j, 0], [1, 1j]]], r"z\[0\] is not symmetric"),
        (convert.siegel_to_positive_definite, [[1.0]], "imaginary part that is not positive definite"),
        (convert.siegel_to_positive_definite, [[1j, 0]], "square matrices"),
        (convert.positive_definite_to_siegel, np.diag([2.0, 1.0]), "not symplectic"),
        (convert.positive_definite_to_siegel, np.diag([1e6, 5e-6]), "not symplectic"),
        (convert.positive_definite_to_siegel, -np.eye(2), "not positive definite: its smallest .* -1"),
        (convert.positive_definite_to_siegel, [[1.0, 0.5], [0, 1]], "not symmetric: entries differ by 5"),
        (convert.positive_definite_to_siegel, [[0.0, 1], [-1, 0]], "not symmetric"),
        (convert.positive_definite_to_siegel, np.eye(3), "2n, 2n"),
        (convert.quaternions_to_subspace, [[1.0, 0, 0, 1]], "has length 1.41421356, not 1"),
        (convert.quaternions_to_subspace, [[1.0, 0, 0]], "must be real, of shape"),
        (convert.subspace_to_quaternions, np.eye(4)[:, ::2], "does not span a quaternionic line"),
        (convert.subspace_to_quaternions, np.eye(3), "2n . 2, 2"),
    ]:
        raises(why, call, value)
