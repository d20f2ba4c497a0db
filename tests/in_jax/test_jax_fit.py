"""Fits in JAX against the compiled core."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cases import unit_tangent, walk
from refused import raises

import symspline as ss
from symspline._autodiff.condition import cyclic_reduction
from symspline.jax import curve, evaluate, fit

QUICK = True
T = np.array([0.0, 1.0, 2.2, 3.0, 4.1, 5.0])


def data(name, step=0.8):
    space = ss.space(name)
    points = walk(space, step, len(T), np.random.default_rng(0))
    return space, points, 0.5 * unit_tangent(space, points[0], np.random.default_rng(1))


@pytest.mark.parametrize(
    ("name", "ends"),
    [("sphere:2", "velocity"), ("so:2", "natural"), ("so:3", "clamped"), ("se:3", "velocity"), ("hpd:2", "natural")],
)
def test_velocities_are_those_of_the_core(name, ends):
    space, points, v = data(name)
    bc_type = ((1, v), "natural") if ends == "velocity" else ends
    u, residual = jax.jit(lambda t, p: fit(t, p, space, bc_type=bc_type))(T, points)
    expected = ss.CubicSpline(T, points, space, bc_type=bc_type).velocities
    np.testing.assert_allclose(u, expected, atol=1e-11)
    assert residual < 1e-13


def test_the_residual_says_when_steps_are_too_few():
    space, points, _ = data("sphere:2", 1.2)
    expected = ss.CubicSpline(T, points, space).velocities
    before = 1.0
    for steps in (2, 8):
        u, residual = jax.jit(lambda p, steps=steps: fit(T, p, space, steps=steps))(points)
        error = np.abs(u - expected).max() / np.abs(expected).max()
        assert 0.1 * error < residual < before
        before = residual / 2


def test_batches_are_curves_one_by_one():
    space = ss.space("so:3")
    points = np.stack([walk(space, 0.5, len(T), np.random.default_rng(i)) for i in range(3)])
    knots = T * np.array([[1.0], [1.1], [1.3]])
    together = jax.jit(lambda t, p: fit(t, p, space))
    for t in (T, knots):
        u, residual = together(t, points)
        assert residual.shape == (3,)
        np.testing.assert_allclose(u, ss.CubicSpline(t, points, space).velocities, atol=1e-11)


def test_gradients_through_fit_and_evaluate_are_those_of_the_core():
    """In all of points, knots and the given velocity."""
    space, points, v = data("so:3")
    x, wanted = np.array([0.3, 1.7, 3.1, 4.8]), walk(space, 0.5, 4, np.random.default_rng(5))

    def in_jax(t, points, v):
        u, _ = fit(t, points, space, bc_type=((1, v), "natural"))
        return jnp.sum((evaluate(t, points, u, space, x) - wanted) ** 2)

    def compiled(t, points, v):
        return jnp.sum((curve(x, t, points, space, bc_type=((1, v), "natural")) - wanted) ** 2)

    found = jax.jit(jax.grad(in_jax, (0, 1, 2)))(T, points, v)
    for a, b in zip(found, jax.grad(compiled, (0, 1, 2))(T, points, v), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-11)


def test_derivatives_under_jit_and_vmap_are_those_of_the_core():
    """Of first order beside differences of the core, for two curves with their own knots."""
    space = ss.space("spd:2")
    points = np.stack([walk(space, 0.5, 4, np.random.default_rng(i)) for i in range(2)])
    moves = np.stack([[unit_tangent(space, p, np.random.default_rng(i)) for p in row] for i, row in enumerate(points)])
    knots = np.stack([T[:4], 1.2 * T[:4]])

    def moved(s, t, p, v):
        return t * (1 + s * t), p + s * v

    def velocities(t, p, v):
        return jax.jvp(lambda s: fit(*moved(s, t, p, v), space)[0], (0.0,), (1.0,))

    found, change = jax.jit(jax.vmap(velocities))(knots, points, moves)
    np.testing.assert_allclose(found, ss.CubicSpline(knots, points, space).velocities, atol=1e-11)
    h = 1e-3

    def core(s):
        t, p = moved(s, knots, points, moves)
        return ss.CubicSpline(t, space.project(p), space).velocities

    difference = sum(w * core(k * h) for w, k in ((1, -2), (-8, -1), (8, 1), (-1, 2))) / (12 * h)
    np.testing.assert_allclose(change, difference, atol=1e-8)


def test_second_derivatives_follow_the_refitted_curve():
    """A Hessian in two directions, beside differences of gradients of the core."""
    space, points, _ = data("sphere:2")
    rng = np.random.default_rng(3)
    a, b = (np.array([unit_tangent(space, p, rng) for p in points]) for _ in range(2))

    def moved(s):
        p = points + s[0] * a + s[1] * b
        return p / jnp.linalg.norm(p, axis=-1, keepdims=True)

    def number(s):
        return jnp.sum(fit(T, moved(s), space)[0] ** 3)

    found = jax.jit(jax.hessian(number))(jnp.zeros(2))
    np.testing.assert_allclose(found, found.T, atol=1e-11 * np.abs(found).max())

    def value(s):
        return np.sum(ss.CubicSpline(T, np.asarray(moved(s)), space).velocities ** 3)

    h = 1e-3
    mixed = sum(i * j * value(np.array([i * h, j * h])) for i in (1, -1) for j in (1, -1)) / (4 * h * h)
    # The error of the difference.
    np.testing.assert_allclose(found[0, 1], mixed, rtol=1e-4)


def test_a_curve_that_stands_still_has_a_gradient():
    points = np.tile(np.eye(3)[0], (4, 1))
    gradient = jax.jit(jax.grad(lambda p: jnp.sum(fit(T[:4], p, "sphere:2")[0] ** 2)))(points)
    np.testing.assert_array_equal(gradient, np.zeros((4, 3)))


def test_invalid_arguments_of_jax_fits_raise():
    for space, options, match in [
        ("h:2", {}, "does not support"),
        ("sphere:2", {"bc_type": "periodic"}, "bc_type must be 'natural'"),
        ("sphere:2", {"steps": 0}, "steps must be"),
        ("sphere:2", {"steps": True}, "steps must be"),
        ("sphere:2", {"bc_type": ((1, np.zeros(2)), "natural")}, "start velocity has shape"),
    ]:
        raises(match, fit, T[:3], np.eye(3), space, **options)


@pytest.mark.parametrize("n", [1, 2, 3, 6, 11])
def test_cyclic_reduction_solves_dense_systems(n):
    def solve(diagonal, *columns):
        return [np.linalg.solve(diagonal, a) for a in columns]

    rng = np.random.default_rng(n)
    below, above, rows = rng.standard_normal((3, n, 2, 2, 2))
    diagonal = rng.standard_normal((n, 2, 2, 2)) + 8 * np.eye(2)
    below[0] = above[-1] = 0
    found = cyclic_reduction(np, solve, below, diagonal, above, rows[..., :1])
    dense = np.zeros((2, n, 2, n, 2))
    for i in range(n):
        for j, block in ((i - 1, below), (i, diagonal), (i + 1, above)):
            if 0 <= j < n:
                dense[:, i, :, j] = block[i]
    right = np.moveaxis(rows[..., :1], 1, 0).reshape(2, 2 * n, 1)
    expected = np.linalg.solve(dense.reshape(2, 2 * n, 2 * n), right)
    np.testing.assert_allclose(np.moveaxis(found, 1, 0).reshape(2, 2 * n, 1), expected, atol=1e-12)


@pytest.mark.parametrize("name", ["so:3", "hpd:2"])
def test_single_precision_stays_single_where_double_is_allowed(name):
    space, points, _ = data(name, 0.5)
    single = jnp.asarray(points, jnp.complex64 if np.iscomplexobj(points) else jnp.float32)
    u, residual = jax.jit(lambda p: fit(T, p, space))(single)
    assert u.dtype == single.dtype and residual.dtype == jnp.float32
    expected = ss.CubicSpline(T, points, space).velocities
    np.testing.assert_allclose(u, expected, atol=2e-5 * np.abs(expected).max())


def test_products_of_matrices_keep_single_precision_on_a_gpu():
    """JAX would shorten them there, which no test on a CPU can measure."""
    space, points, _ = data("hpd:2", 0.5)
    single = jnp.asarray(points, jnp.complex64)
    values = jax.jit(lambda p: evaluate(T, p, fit(T, p, space)[0], space, T))
    for function in (values, jax.grad(lambda p: jnp.sum(abs(values(p)) ** 3))):
        products = [line for line in jax.jit(function).lower(single).as_text().splitlines() if "dot_general" in line]
        assert products
        assert all("precision = [HIGHEST, HIGHEST]" in line for line in products)


@pytest.mark.parametrize("name", ["sphere:2", "hpd:2"])
def test_fits_by_cyclic_reduction_are_those_of_the_core(name, monkeypatch):
    """A GPU uses it in place of LAPACK."""
    monkeypatch.setattr(jax.lax, "platform_dependent", lambda *arrays, cpu, default: default(*arrays))
    space, points, _ = data(name, 0.5)
    many = np.stack([points, space.exp(points, 0.1 * space.random_tangent(np.random.default_rng(2), points))])
    u = jax.jit(lambda t, p: fit(t, p, space)[0])(T, many)
    np.testing.assert_allclose(u, ss.CubicSpline(T, many, space).velocities, atol=1e-11)
