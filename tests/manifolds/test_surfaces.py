"""Surfaces given by an equation, against known properties of their geodesics."""

import pickle

import numpy as np
import pytest
from made import AXES, ELLIPSOID, RADII, TORUS, ellipsoid, ellipsoid_equation, torus, twin
from refused import raises
from scipy.integrate import solve_ivp

import symspline as ss

# As a surface; no radius is given, so that geodesics may be long.
SPHERE = ss.manifolds.from_surface(
    lambda x: np.sum(x * x, axis=-1) - 1,
    lambda x: 2 * x,
    4,
    hess=lambda x: np.broadcast_to(2 * np.eye(4), (len(x), 4, 4)),
)


def steps(space, length, count=5, seed=1):
    rng = np.random.default_rng(seed)
    p = space.random_point(rng, count)
    v = space.random_tangent(rng, p)
    return p, length * v / space.norm(p, v)[:, None]


@pytest.mark.parametrize("length", [1e-9, 1e-3, 0.3, 1.0, 2.5])
def test_the_sphere_is_the_sphere(length):
    exact = ss.Sphere(3)
    p, v = steps(SPHERE, length)
    q = exact.exp(p, v)
    assert np.abs(SPHERE.exp(p, v) - q).max() <= 1e-13
    assert np.abs(SPHERE.log(p, q) - v).max() <= 2e-12
    w = exact.random_tangent(np.random.default_rng(2), q)
    assert np.abs(SPHERE.dlog(p, q, w) - twin(exact).dlog(p, q, w)).max() <= (1e-10 if length < 2 else 1e-8)


@pytest.mark.parametrize("space", [ELLIPSOID, TORUS], ids=["ellipsoid", "torus"])
@pytest.mark.parametrize("length", [1e-6, 0.1, 0.8])
def test_log_inverts_exp_and_dlog_is_its_derivative(space, length):
    p, v = steps(space, length)
    q = space.exp(p, v)
    space.check_point(q)
    assert np.abs(space.log(p, q) - v).max() <= 2e-12
    w = space.random_tangent(np.random.default_rng(3), q)
    # Differences of order four of a logarithm that is known to some 1e-13.
    assert np.abs(space.dlog(p, q, w) - twin(space, injectivity_radius=1.0).dlog(p, q, w)).max() <= 2e-9


def test_geodesics_of_an_ellipsoid_are_those_of_scipy():
    (p,), (v,) = steps(ELLIPSOID, 1.5, 1)

    def rates(_, y):
        x, t = y[:3], y[3:]
        return np.concatenate([t, -np.sum((t / AXES) ** 2) / np.sum((x / AXES**2) ** 2) * x / AXES**2])

    found = solve_ivp(rates, (0, 1), np.concatenate([p, v]), method="DOP853", rtol=1e-13, atol=1e-14)
    assert np.abs(found.y[:3, -1] - ELLIPSOID.exp(p, v)).max() <= 1e-12


def test_circles_of_a_torus():
    """Meridians and the two equators are geodesics."""
    big, small = RADII
    outer, inner = [big + small, 0.0, 0.0], [big - small, 0.0, 0.0]
    angle = 0.9
    around = np.array([np.cos(angle), np.sin(angle), 0.0])
    for start in (outer, inner):
        q = TORUS.exp(start, [0.0, angle * start[0], 0.0])
        assert np.abs(q - start[0] * around).max() <= 1e-13
    q = TORUS.exp(outer, [0.0, 0.0, angle * small])
    assert np.abs(q - [big + small * np.cos(angle), 0.0, small * np.sin(angle)]).max() <= 1e-13
    # On the inner equator curvature is negative: fields spread by cosh.
    curvature = 1 / (small * (big - small))
    w = TORUS.dlog(inner, (big - small) * around, [0.0, 0.0, 1.0])
    length = angle * (big - small) * np.sqrt(curvature)
    assert np.abs(w - [0.0, 0.0, length / np.sinh(length)]).max() <= 1e-12


@pytest.mark.parametrize(("exact", "make"), [(ELLIPSOID, ellipsoid), (TORUS, torus)], ids=["ellipsoid", "torus"])
def test_second_derivatives_may_be_differences(exact, make):
    rough = make()
    p, v = steps(exact, 0.6)
    q = exact.exp(p, v)
    # Differences of the gradient have errors of some 1e-12.
    assert np.abs(rough.exp(p, v) - q).max() <= 1e-11
    assert np.abs(rough.log(p, q) - v).max() <= 1e-11
    w = exact.random_tangent(np.random.default_rng(4), q)
    assert np.abs(rough.dlog(p, q, w) - exact.dlog(p, q, w)).max() <= 1e-10


def test_points_are_projected_and_checked():
    x = np.array([[0.9, 0.3, 0.3], [1.0, 1.0, 1.0]])
    assert np.abs(ellipsoid_equation(ELLIPSOID.project(x))).max() <= 1e-15
    with pytest.raises(ss.ValidationError, match=r"point 1 is off the space by 3\.\d*e-01"):
        ELLIPSOID.check_point([[1.0, 0.0, 0.0], [1.0, 1.0, 0.5]])


def test_it_is_a_value():
    again = pickle.loads(pickle.dumps(ELLIPSOID))
    assert again == ELLIPSOID != TORUS and hash(again) == hash(ELLIPSOID)
    assert repr(ELLIPSOID) == "Surface(ellipsoid_equation, n=3)" and ELLIPSOID.dim == 2


def test_invalid_surfaces_raise():
    for arguments, what in [
        ((1, np.sin, 3), "F must be a function"),
        ((np.sin, None, 3), "grad must be"),
        ((np.sin, np.sin, 1), "n must be"),
    ]:
        raises(what, ss.manifolds.from_surface, *arguments)
