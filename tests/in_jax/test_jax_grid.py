"""Splines over several parameters in JAX, beside curves of the core along one axis after another."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cases import unit_tangent
from refused import raises

import symspline as ss
from symspline.jax import grid_evaluate, grid_spline

QUICK = True
U = np.array([0.0, 1.0, 1.7, 3.0, 4.1])
V = np.array([-2.0, -1.1, 0.0, 0.4])
W = np.array([10.0, 11.0, 12.5])
X = np.array([[0.3], [1.7], [4.1]]), np.array([-1.9, 0.1])
FLAT = np.array([0.3, 1.7, 4.1]), np.array([-1.9, 0.1, -0.4])


def field(name, axes=(U, V), seed=0):
    """Points on a smooth field, with noise, on the nodes of the axes."""
    space, rng = ss.space(name), np.random.default_rng(seed)
    mesh = np.meshgrid(*axes, indexing="ij")
    base = space.random_point(rng)
    tangents = [unit_tangent(space, base, rng) for _ in range(2 * len(axes) + 1)]
    along = [f(0.7 * m + i) for m in mesh for i, f in enumerate((np.sin, np.cos))] + [rng.normal(0, 0.1, mesh[0].shape)]
    v = sum(0.25 * a.reshape(*a.shape, *[1] * base.ndim) * t for a, t in zip(along, tangents, strict=True))
    return space.exp(np.broadcast_to(base, v.shape), v)


def one_value(space, axes, points, x, ends):
    """The definition, for one query: splines through all rows at the first coordinate, then along the other axes."""
    for t, own, end in zip(axes, x, ends, strict=True):
        rows = np.moveaxis(points, 0, points.ndim - 1 - len(space.point_shape))
        points = ss.CubicSpline(t, rows, space, bc_type=end)(own)
    return points


@pytest.mark.parametrize("name", ["r:2", "sphere:2", "so:3", "se:3", "spd:2", "gr:2,5", "cp:2", "h:2"])
def test_values_are_those_of_the_definition(name):
    space, points = ss.space(name), field(name)
    ends = ("natural", ("clamped", "not-a-knot"))
    values = jax.jit(lambda p: grid_spline(X, (U, V), p, space, bc_type=ends))(points)
    assert values.shape == (3, 2, *space.point_shape)
    for i, j in np.ndindex(3, 2):
        expected = one_value(space, (U, V), points, (X[0][i, 0], X[1][j]), ends)
        assert space.distance(np.asarray(values[i, j]), expected) < 1e-7
        np.testing.assert_allclose(space.project(np.asarray(values[i, j])), values[i, j], atol=1e-12)
    assert space.distance(np.asarray(values), ss.GridSpline((U, V), points, space, bc_type=ends)(X)).max() < 1e-7
    outer = grid_spline((X[0][:, 0], X[1]), (U, V), points, space, bc_type=ends, grid=True)
    assert space.distance(np.asarray(outer), np.asarray(values)).max() < 1e-7


def test_flat_values_are_exact_and_products_have_parts():
    """Cubic polynomials are reproduced, and the factors of a product are independent."""

    def cubic(u, v):
        return np.stack([u**3 * v - v**2, 1 + u * v**3], axis=-1)

    flat, turns = cubic(U[:, None], V), field("so:3")
    values, rotations = grid_spline(X, (U, V), (flat, turns), ss.Product("r:2", "so:3"))
    np.testing.assert_allclose(values, cubic(*X), atol=1e-12)
    np.testing.assert_array_equal(rotations, grid_spline(X, (U, V), turns, "so:3"))


def test_one_and_three_axes():
    space, axes = ss.Sphere(2), (U, V, W)
    points = field("sphere:2", axes)
    x = (*FLAT[:2], np.array([10.2, 12.4, 11.0]))
    values = grid_spline(x, axes, points, space)
    ends = ("not-a-knot",) * 3
    for i in range(3):
        expected = one_value(space, axes, points, [own[i] for own in x], ends)
        np.testing.assert_allclose(values[i], expected, atol=1e-14)
    outer = grid_spline((x[0], x[1][:2], 11.3), axes, points, space, grid=True)
    assert outer.shape == (3, 2, 3)
    for i, j in np.ndindex(3, 2):
        expected = one_value(space, axes, points, (x[0][i], x[1][j], 11.3), ends)
        np.testing.assert_allclose(outer[i, j], expected, atol=1e-14)
    curve = ss.CubicSpline(U, points[:, 0, 0], space, bc_type="not-a-knot")
    np.testing.assert_array_equal(grid_spline((x[0],), (U,), points[:, 0, 0], space), curve(x[0]))


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "spd:2"])
@pytest.mark.parametrize("grid", [False, True])
def test_gradients_are_differences(name, grid):
    """With respect to both coordinates, the nodes of both axes, and the points, which move along the space."""
    space, points = ss.space(name), field(name)
    rng = np.random.default_rng(3)
    weights = rng.standard_normal(space.point_shape)
    tangents = np.array([[unit_tangent(space, p, rng) for p in row] for row in points])

    @jax.jit
    def number(x, y, u, v, points):
        return jnp.sum(grid_spline((x, y), (u, v), points, space, grid=grid) * weights)

    data = [*FLAT, U, V, points]
    found = jax.jit(jax.grad(number, tuple(range(5))))(*data)
    steps = [rng.standard_normal(a.shape) for a in data[:4]] + [tangents]
    h = 1e-5
    for i, step in enumerate(steps):
        # The ends of an axis stay, so that all coordinates remain inside.
        if i in (2, 3):
            step[[0, -1]] = 0
        if i == 0:
            step[-1] = 0
        ahead, behind = list(data), list(data)
        if i < 4:
            ahead[i], behind[i] = data[i] + h * step, data[i] - h * step
        else:
            ahead[i], behind[i] = space.exp(points, h * step), space.exp(points, -h * step)
        difference = (number(*ahead) - number(*behind)) / (2 * h)
        np.testing.assert_allclose(np.sum(found[i] * step), difference, rtol=1e-7, atol=1e-8)


def test_gradients_of_subspaces_do_not_depend_on_the_basis():
    space, points = ss.space("gr:2,5"), field("gr:2,5")
    rng = np.random.default_rng(4)
    turned = points @ np.linalg.qr(rng.standard_normal((*points.shape[:2], 2, 2)))[0]
    weights = rng.standard_normal((5, 5))
    tangents = np.array([[unit_tangent(space, p, rng) for p in row] for row in points])

    @jax.jit
    def number(s, x, points, tangents):
        y = grid_spline((x, FLAT[1]), (U, V), points + s * tangents, space)
        return jnp.sum((y @ jnp.swapaxes(y, -1, -2)) * weights)

    gradient = jax.grad(number, (0, 1))
    h = 1e-5
    found = gradient(0.0, FLAT[0], points, tangents)
    moved = tangents @ (np.swapaxes(points, -1, -2) @ turned)
    for a, b in zip(found, gradient(0.0, FLAT[0], turned, moved), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-10)
    difference = (number(h, FLAT[0], points, tangents) - number(-h, FLAT[0], points, tangents)) / (2 * h)
    np.testing.assert_allclose(found[0], difference, rtol=1e-7)


def test_maps_over_queries_and_over_fields():
    fields = np.stack([field("sphere:2", seed=i) for i in range(3)])

    def value(x, y, points):
        return grid_spline((x, y), (U, V), points, "sphere:2")

    alone = value(*FLAT, fields[0])
    np.testing.assert_allclose(jax.vmap(value, (0, 0, None))(*FLAT, fields[0]), alone, atol=1e-15)
    each = jax.vmap(value, (None, None, 0))(*FLAT, fields)
    for found, points in zip(each, fields, strict=True):
        np.testing.assert_allclose(found, value(*FLAT, points), atol=1e-15)
    gradient = jax.vmap(jax.grad(lambda p: value(*FLAT, p).sum()))(fields)
    np.testing.assert_allclose(gradient[2], jax.grad(lambda p: value(*FLAT, p).sum())(fields[2]), atol=1e-13)


ENDS = ("natural", ("clamped", "natural"))


def test_the_residual_in_jax_alone_describes_the_error():
    points = field("so:3")
    values, residual = jax.jit(lambda p: grid_evaluate((U, V), p, "so:3", FLAT, grid=True, bc_type=ENDS, steps=3))(
        points
    )
    error = np.abs(values - grid_spline(FLAT, (U, V), points, "so:3", grid=True, bc_type=ENDS)).max()
    assert residual.shape == (2,)
    assert residual.min() > 1e-12 and 0.1 * error < residual.max() < 1e-4, (residual, error)


def test_jax_alone_has_the_values_and_derivatives_of_the_core():
    """Along one direction of the coordinates. Tests of `fit` and `evaluate` cover their other derivatives."""
    points = field("sphere:2")

    def alone(s):
        return grid_evaluate((U, V), points, "sphere:2", (0.7 + 0.1 * s, 0.1 - 0.2 * s), bc_type=ENDS)

    def compiled(s):
        return grid_spline((0.7 + 0.1 * s, 0.1 - 0.2 * s), (U, V), points, "sphere:2", bc_type=ENDS)

    (value, residual), (velocity, _) = jax.jit(lambda s: jax.jvp(alone, (s,), (1.0,)))(0.0)
    expected, expected_velocity = jax.jvp(compiled, (0.0,), (1.0,))
    np.testing.assert_allclose(value, expected, atol=1e-13)
    np.testing.assert_allclose(velocity, expected_velocity, atol=1e-13)
    assert residual.max() < 1e-14


def test_invalid_grids_raise():
    points = field("sphere:2")
    for match, call in [
        (r"needs \(n_1, n_2, n_3, 3\)", lambda: grid_spline(FLAT, (U, V, W), points, "sphere:2")),
        (r"axes\[1\] has shape \(5,\), but points have 4", lambda: grid_spline(FLAT, (U, U), points, "sphere:2")),
        ("x has 1 coordinates, but there are 2 axes", lambda: grid_spline(FLAT[:1], (U, V), points, "sphere:2")),
        ("one entry per axis, 2 in all", lambda: grid_spline(FLAT, (U, V), points, "sphere:2", bc_type=["natural"])),
        (
            "must not contain vectors",
            lambda: grid_spline(FLAT, (U, V), points, "sphere:2", bc_type=("natural", ((1, np.zeros(3)), "natural"))),
        ),
        ("it is not finite", lambda: grid_spline(FLAT, (U, V), np.where(points > 0.9, np.nan, points), "sphere:2")),
        ("does not support", lambda: grid_evaluate((U, V), field("u:2"), "u:2", FLAT)),
    ]:
        raises(match, call)
