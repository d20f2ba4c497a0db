"""Groups of invertible matrices and their subgroups, against independent computations."""

import mpmath
import numpy as np
import pytest
from cases import EPS, LINEAR
from refused import raises
from scipy.linalg import expm, logm

import symspline as ss

SEED = 8
NAMES = ["gl:2", "gl:3", "cgl:2", "aff:2", "sim:3", "sl:3", "sp:4", "so:1,3"]
every = pytest.mark.parametrize("name", NAMES)


@every
def test_exp_and_log_are_those_of_scipy(name, rng):
    space = ss.space(name)
    for size in (1e-6, 0.1, 0.5, 1.0):
        p = space.random_point(rng)
        v = size * space.random_tangent(rng, p)
        omega = np.linalg.solve(p, v)
        q = space.exp(p, v)
        room = 2000 * EPS * np.linalg.cond(p) * np.linalg.cond(expm(omega))
        np.testing.assert_allclose(q, p @ expm(omega), rtol=0, atol=room)
        # SciPy's logarithm of nearly the identity keeps no small digits.
        np.testing.assert_allclose(space.log(p, q), p @ logm(np.linalg.solve(p, q)), rtol=0, atol=room)


@pytest.mark.parametrize("theta", [1e-9, 0.3, 2.0, 3.0, 3.14, np.pi - 1e-5, np.pi - 1e-9])
@pytest.mark.parametrize("stretch", [1.0, 30.0])
def test_the_logarithm_up_to_the_cut_locus(theta, stretch):
    # A turn in skew axes: p = s R s⁻¹ and log p = s (log R) s⁻¹, at fifty digits.
    with mpmath.workdps(50):
        s = mpmath.matrix([[1, 0.25], [0, stretch]])
        c, w = mpmath.cos(theta), mpmath.sin(theta)
        p = s * mpmath.matrix([[c, -w], [w, c]]) * s**-1
        log = s * mpmath.matrix([[0, -theta], [theta, 0]]) * s**-1
        p, log = (np.array(m.tolist(), dtype=float) for m in (p, log))
    found = ss.GeneralLinear(2).log(np.eye(2), p)
    # The angle is the derivative of an eigenvalue's argument: rounding of p turns it by ε/sin θ.
    room = 40 * EPS * stretch * theta * max(1.0, stretch / np.sin(theta))
    np.testing.assert_allclose(found, log, rtol=0, atol=room)


@pytest.mark.parametrize("values", [(-1.0, -1.0), (-1.0, -2.0), (-3.0, -3.0, 1.0)])
def test_negative_eigenvalues_are_on_the_cut_locus(values):
    n = len(values)
    raises("cut locus", ss.GeneralLinear(n).log, np.eye(n), np.diag(values), error=ss.CutLocusError)
    # A nilpotent part is no angle.
    shear = np.array([[1.0, 1e3], [0, 1.0]])
    np.testing.assert_allclose(ss.GeneralLinear(2).log(np.eye(2), shear), [[0, 1e3], [0, 0]], atol=1e-9)


def test_determinants_of_opposite_signs():
    p = [np.eye(2), np.diag([1.0, 2.0]), np.diag([1.0, -2.0])]
    raises(r"points\[1\] and points\[2\] have opposite determinants", ss.CubicSpline, None, p, "gl:2")
    raises("pair 0 has opposite determinants: no curve joins them", ss.GeneralLinear(2).distance, p[0], p[2])
    # Both may be negative.
    ss.CubicSpline(None, np.array(p)[:2] @ np.diag([1.0, -1.0]), "gl:2")


def test_non_members_raise():
    for name, point, why in [
        ("gl:2", [[1, 2], [2, 4]], "singular: its condition number is"),
        ("gl:2", [[0.1, 0.2], [0.3, 0.6]], "singular: its condition number is"),
        ("gl:2", np.zeros((2, 2)), "it is zero, or"),
        ("gl:2", 1e300 * np.eye(2), "squares of its entries overflow or underflow"),
        ("gl:2", 1e-300 * np.eye(2), "squares of its entries overflow or underflow"),
        ("aff:1", [[1, 2], [1, 4]], r"its last row is \[1.0, 4.0\], not"),
        ("sim:2", np.diag([2.0, -2, 1]), "linear part is a reflection"),
        ("sim:2", np.diag([2.0, 3, 1]), "not a multiple of a rotation"),
        ("sl:2", [[2, 0], [0, 1]], "its determinant is 2.0+e0, not 1"),
        ("sl:2", [[-1, 0], [0, 1]], "its determinant is -1.0+e0, not 1"),
        ("sp:2", [[2, 0], [0, 1]], "not symplectic"),
        ("so:1,1", [[1, 0], [0, 2]], "does not preserve"),
        ("so:1,1", [[1, 0], [0, -1]], "its determinant is -1: it is a reflection"),
        ("so:1,1", [[-1, 0], [0, -1]], "turns time round"),
    ]:
        space = ss.space(name)
        good = np.eye(len(point))
        raises(rf"points\[1\].*{why}", ss.CubicSpline, None, [good, point, good], space)


@every
def test_points_beside_the_group_are_brought_back(name, rng):
    space = ss.space(name)
    p = space.random_point(rng)
    near = p + 1e-9 * rng.standard_normal(p.shape)
    found = space.project(near)
    space.check_point(found)
    assert np.abs(space.project(found) - found).max() <= 50 * EPS * np.abs(p).max() ** 2
    # Not farther than it need be, but for a factor.
    assert np.abs(found - near).max() <= 1e-8 * np.linalg.cond(p)


def test_every_class_is_here():
    assert {type(ss.space(name)) for name in NAMES} == set(LINEAR)


def test_the_radius_is_that_of_the_nearest_matrix_without_a_logarithm():
    # -1 as a rotation of a plane by pi, and as one number.
    for name, turn in (("gl:2", np.array([[0, -1], [1, 0]])), ("cgl:1", np.array([[1j]]))):
        space, one = ss.space(name), np.eye(len(turn))
        assert space.injectivity_radius == pytest.approx(space.norm(one, np.pi * turn), rel=1e-15)
