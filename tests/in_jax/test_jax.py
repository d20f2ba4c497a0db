"""The adapter for JAX, under JAX's own gradient checks."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cases import unit_tangent, walk
from jax.test_util import check_grads

import symspline as ss
from symspline.jax import curve

X = np.array([0.3, 1.7, 3.1])
T = np.array([0.0, 1.0, 2.2, 3.0, 4.1])
# Spaces whose projection on a tangent space is orthogonal for arrays, so that their motions off the space, which
# JAX tries too, are those of the projected points.
EMBEDDED = ["r:2", "sphere:2", "so:3", "spd:2"]


def points_of(name, seed=0):
    rng = np.random.default_rng(seed)
    return walk(ss.space(name), 0.5, len(T), rng)


@pytest.mark.parametrize(
    ("name", "bc_type"),
    [*((name, "natural") for name in EMBEDDED), ("sphere:2", "not-a-knot"), ("sphere:2", "clamped")],
)
def test_gradients_pass_the_checks_of_jax(name, bc_type):
    def function(x, t, points):
        return curve(x, t, points, name, bc_type=bc_type)

    data = X, T, points_of(name)
    check_grads(function, data, order=1, modes=["fwd", "rev"], atol=1e-6, rtol=1e-6)
    np.testing.assert_array_equal(jax.jit(function)(*data), function(*data))
    np.testing.assert_allclose(jax.jit(jax.jacrev(function, 2))(*data), jax.jacfwd(function, 2)(*data), atol=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_vectors_at_the_ends_have_gradients(order):
    space, points = ss.Sphere(2), points_of("sphere:2")
    rng = np.random.default_rng(1)
    vectors = [0.3 * unit_tangent(space, points[i], rng) for i in (0, -1)]

    def function(a, b):
        return curve(X, T, points, space, bc_type=((order, a), (order, b)))

    check_grads(function, tuple(vectors), order=1, modes=["fwd", "rev"], atol=1e-6, rtol=1e-6)


@pytest.mark.parametrize("name", ["u:2", "cp:2"])
def test_complex_points_have_gradients(name):
    """Of numbers that do not depend on the phase, along curves of points."""
    space, rng = ss.space(name), np.random.default_rng(2)
    points = points_of(name)
    v, w = (np.array([unit_tangent(space, p, rng) for p in points]) for _ in range(2))

    def function(s):
        moved = points + s[0] * v + s[1] * w
        moved = moved / jnp.linalg.norm(moved, axis=-1, keepdims=True) if name == "cp:2" else moved
        values = curve(X, T, moved, name)
        return jnp.abs(values) ** 2 if name == "cp:2" else values

    check_grads(function, (np.zeros(2),), order=1, modes=["fwd", "rev"], atol=1e-6, rtol=1e-6)


def test_products_and_batches():
    factors = ("sphere:3", "r:3")
    points = tuple(points_of(name) for name in factors)
    values = curve(X, T, points, " x ".join(factors))
    spline = ss.CubicSpline(T, points, ss.Product(*factors))
    for value, expected in zip(values, spline(X), strict=True):
        np.testing.assert_allclose(value, expected, atol=1e-14)
    many = np.stack([points[0], points_of("sphere:3", 1)])
    gradient = jax.grad(lambda t: curve(X, t, many, "sphere:3").sum())(T)
    alone = sum(jax.grad(lambda t, p=p: curve(X, t, p, "sphere:3").sum())(T) for p in many)
    np.testing.assert_allclose(gradient, alone, atol=1e-12)


def test_single_precision_comes_back_in_single_precision():
    with jax.enable_x64(False):
        points = jnp.asarray(points_of("sphere:2"), jnp.float32)
        value, gradient = jax.value_and_grad(lambda p: curve(X, T, p, "sphere:2").sum())(points)
    assert value.dtype == gradient.dtype == jnp.float32


def test_curves_of_a_batch_that_converged_keep_their_derivatives_in_jax():
    options = {"method": "fixed-point", "max_iter": 6, "on_failure": "ignore", "tol": 0.002}
    # Steps of 2.9: Algorithm 1 is slow.
    farther = [[1.0, 0, 0], [np.cos(2.9), np.sin(2.9), 0], [np.cos(2.9), 0, np.sin(2.9)]]
    both = np.stack([np.eye(3), farther])
    assert ss.CubicSpline(None, both, ss.Sphere(2), **options).report.converged.tolist() == [True, False]

    def function(points):
        return curve(0.5, jnp.arange(3.0), points, ss.Sphere(2), **options).sum()

    with jax.enable_x64(True):
        gradient, alone = (jax.grad(function)(jnp.array(points)) for points in (both, np.eye(3)))
    np.testing.assert_array_equal(gradient[0], alone)
    assert np.isfinite(alone).all() and np.isnan(gradient[1]).all()
