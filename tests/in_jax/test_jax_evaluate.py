"""De Casteljau's algorithm in JAX against the compiled core, and derivatives near singular formulas."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cases import QUOTIENTS, condition, unit_tangent, walk
from refused import raises

import symspline as ss
from symspline.jax import evaluate

QUICK = True
T = np.array([0.0, 1.0, 2.2, 3.0, 4.1])
X = np.concatenate([np.linspace(0, 4.1, 12), [1.0, 2.2]])
# Of each formula one; tests of fits evaluate curves on spheres, of rotations and of positive definite matrices.
SPACES = ["h:2", "se:2", "cp:2", "cgr:2,4", "so:3"]
# Second derivatives run operation by operation: to compile them takes longer.
RATES = ["cp:2", "so:3"]


def projector(value, point):
    """What does not depend on the representative: V γ*."""
    if point.ndim == 2:
        value, point = value[..., None], point[..., None]
    return value @ jnp.conj(jnp.swapaxes(point, -1, -2))


@pytest.mark.parametrize("name", SPACES)
def test_curves_are_those_of_the_core(name):
    space = ss.space(name)
    points = walk(space, 0.8, 5, np.random.default_rng(0))
    spline = ss.CubicSpline(T, points, space)

    def value_at(*data, nu=0):
        return evaluate(*data, space, X, nu=nu)

    data = T, points, spline.velocities
    found = {0: jax.jit(value_at)(*data)} | ({2: value_at(*data, nu=2)} if name in RATES else {})
    for nu, value in found.items():
        expected = spline(X, nu=nu)
        if isinstance(space, QUOTIENTS):
            value, expected = projector(value, found[0]), projector(expected, spline(X))
        tol = 1e-14 * condition(space, points) * max(1.0, np.abs(expected).max())
        np.testing.assert_allclose(value, expected, atol=(20 if nu else 2) * tol)


def test_curves_that_stand_still_have_derivatives():
    """Equal points, zero velocities and equal eigenvalues."""
    space = ss.space("spd:2")
    points = np.stack([np.eye(2), np.eye(2)])
    rng = np.random.default_rng(1)
    v, w = (np.array([unit_tangent(space, p, rng) for p in points]) for _ in range(2))

    def number(s):
        # Points move along straight lines, and are brought back to the space.
        return jnp.sum(evaluate(T[:2], points + s * v, s * w, space, jnp.array([0.3])) ** 3)

    h = 1e-2
    # A gradient is a derivative forward, transposed. One function is compiled for all of it.
    both = jax.jit(jax.value_and_grad(number))
    values, (_, _, backward, _, _) = zip(*(both(h * k) for k in range(-2, 3)), strict=True)
    # The errors of differences of fourth order.
    np.testing.assert_allclose(backward, np.dot([1, -8, 0, 8, -1], values) / (12 * h), atol=2e-6)


def test_batches_products_and_maps():
    names = ("sphere:2", "r:3")
    points = tuple(np.stack([walk(ss.space(n), 0.5, 5, np.random.default_rng(i)) for i in range(3)]) for n in names)
    knots = T * np.array([[1.0], [1.1], [1.3]])
    spline = ss.CubicSpline(knots, points, " x ".join(names))

    @jax.jit
    def both(*data):
        one = lambda t, p, u: evaluate(t, p, u, spline.space, X)  # noqa: E731
        return one(*data), jax.vmap(one)(*data)

    found, mapped = both(knots, points, spline.velocities)
    for value, other, expected in zip(found, mapped, spline(X), strict=True):
        np.testing.assert_allclose(value, expected, atol=1e-14)
        np.testing.assert_allclose(other, expected, atol=1e-14)


def test_outside_the_knots_and_off_the_space_is_nan():
    points, u = np.eye(3)[:2], np.zeros((2, 3))
    found = jax.jit(lambda p, u: evaluate([0.0, 1.0], p, u, "sphere:2", [-0.1, 0.5, 1.1]))(points, u)
    np.testing.assert_array_equal(np.isnan(found).all(axis=-1), [True, False, True])
    mirror = np.stack([np.diag([1.0, 1, -1])] * 2)
    assert np.isnan(jax.jit(lambda p: evaluate([0.0, 1.0], p, 0 * p, "so:3", 0.5))(mirror)).all()


def test_invalid_arguments_of_jax_evaluation_raise():
    p = np.eye(3)[:2]
    raises("does not support u:2", evaluate, [0, 1], np.stack([np.eye(2)] * 2), np.zeros((2, 2, 2)), "u:2", 0.5)
    raises(r"velocities has shape \(1, 3\)", evaluate, [0, 1], p, p[:1], "sphere:2", 0.5)
    raises(r"t has shape \(3,\)", evaluate, [0, 1, 2], p, p, "sphere:2", 0.5)
    raises(r"points has shape \(2, 3\)", evaluate, [0, 1], p, p, "sphere:3", 0.5)
    raises("nu must be", evaluate, [0, 1], p, p, "sphere:2", 0.5, nu=3)
