"""`jax.vmap` of the compiled spline and of its derivatives: one call of the core, and the numbers of single curves."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cases import unit_tangent, walk
from refused import raises

import symspline as ss
from symspline.jax import curve

CURVES = 4
X = np.array([0.3, 1.7, 3.1]) + 0.1 * np.arange(CURVES)[:, None]
T = np.array([0.0, 1.0, 2.2, 3.0, 4.1]) * (1 + 0.1 * np.arange(CURVES)[:, None])
SPHERE = ss.Sphere(2)
POINTS = np.stack([walk(SPHERE, 0.5, 5, np.random.default_rng(seed)) for seed in range(CURVES)])
ENDS = np.stack([0.3 * unit_tangent(SPHERE, p[0], np.random.default_rng(9)) for p in POINTS])


@pytest.fixture
def calls(monkeypatch):
    """How often a spline was fitted, for one curve or many."""
    made, construct = [], ss.CubicSpline.__init__

    def counted(self, *arguments, **options):
        made.append(arguments)
        construct(self, *arguments, **options)

    monkeypatch.setattr(ss.CubicSpline, "__init__", counted)
    return made


def function(x, t, points, end):
    return curve(x, t, points, SPHERE, bc_type=((1, end), "not-a-knot"))


def energy(*data):
    return jnp.sum(function(*data) ** 3)


def some(axes):
    """Data of which those without an axis are the same for all curves, and of each curve."""
    data = [a if axis == 0 else a[0] for a, axis in zip((X, T, POINTS, ENDS), axes, strict=True)]
    return data, [[a[i] if axis == 0 else a for a, axis in zip(data, axes, strict=True)] for i in range(CURVES)]


# One of them, some, and all.
AXES = [tuple(0 if i == k else None for i in range(4)) for k in range(4)] + [(None, 0, 0, None), (0, 0, 0, 0)]


@pytest.mark.parametrize("axes", AXES)
def test_values_and_gradients_of_many_curves_are_those_of_each(axes, calls):
    data, each = some(axes)
    every = tuple(range(4))
    values = jax.vmap(function, axes)(*data)
    assert len(calls) == 1
    gradients = jax.vmap(jax.grad(energy, every), axes)(*data)
    assert len(calls) == 2
    summed = jax.grad(lambda *data: jax.vmap(energy, axes)(*data).sum(), every)(*data)
    assert len(calls) == 3
    np.testing.assert_array_equal(values, [function(*one) for one in each])
    alone = [jax.grad(energy, every)(*one) for one in each]
    for i, axis in enumerate(axes):
        own = np.stack([one[i] for one in alone])
        # Sums in another order.
        np.testing.assert_allclose(gradients[i], own, atol=1e-14)
        np.testing.assert_allclose(summed[i], own if axis == 0 else own.sum(axis=0), atol=1e-14)


@pytest.mark.parametrize("axes", [(0, None, None, None), (None, 0, None, None), (0, 0, 0, 0)])
def test_directions_of_many_curves_are_those_of_each(axes):
    data, each = some(axes)
    rng = np.random.default_rng(0)
    steps = [0.1 * rng.standard_normal(a.shape) for a in data]

    def pushed(data, steps):
        return jax.jvp(function, tuple(data), tuple(steps))[1]

    found = jax.vmap(pushed, (list(axes), list(axes)))(data, steps)
    for i, one in enumerate(each):
        own = [s[i] if axis == 0 else s for s, axis in zip(steps, axes, strict=True)]
        np.testing.assert_allclose(found[i], pushed(one, own), atol=1e-14)


@pytest.mark.parametrize("nu", [0, 2])
def test_nested_maps_are_one_call(nu, calls):
    """Times along one axis, curves along another, and batch axes of the points."""
    rng = np.random.default_rng(1)
    batch = SPHERE.project(POINTS[:, None, None] + 0.1 * rng.standard_normal((CURVES, 2, 3, 5, 3)))

    def value(x, points):
        return curve(x, T[0], points, SPHERE, nu=nu)

    def number(x, points):
        return jnp.sum(value(x, points) ** 2)

    grid = jax.vmap(jax.vmap(value, (0, None)), (None, 0))
    values = grid(X, batch)
    assert len(calls) == 1
    expected = value(X, batch)  # curves, 2, 3, rows of X, times
    np.testing.assert_array_equal(values, np.moveaxis(expected, 3, 1))
    gradient = jax.grad(lambda p: jnp.sum(grid(X, p) ** 2))(batch)
    np.testing.assert_allclose(gradient, jax.grad(lambda p: number(X, p))(batch), atol=2e-12)
    rows = jax.vmap(jax.vmap(jax.grad(number, 1), (0, None)), (None, 0))(X, batch)
    for i, j in itertools.product(range(CURVES), repeat=2):
        np.testing.assert_allclose(rows[i, j], jax.grad(number, 1)(X[j], batch[i]), atol=1e-12)


@pytest.mark.parametrize("axis", [0, None])
def test_knots_and_end_vectors_have_batch_axes_of_their_own(axis):
    """Behind the axis of `jax.vmap`; and the end vectors may have none of them."""
    rng = np.random.default_rng(2)
    points = SPHERE.project(POINTS[:, None] + 0.1 * rng.standard_normal((CURVES, 2, 5, 3)))
    knots = np.stack([T, 1.1 * T], axis=1)
    axes = (None, axis, 0, 0)
    data = (X[0], knots if axis == 0 else knots[0], points, ENDS)
    gradients = jax.vmap(jax.grad(energy, (1, 2, 3)), axes)(*data)
    for i in range(CURVES):
        one = [a[i] if axis == 0 else a for a, axis in zip(data, axes, strict=True)]
        for found, own in zip(gradients, jax.grad(energy, (1, 2, 3))(*one), strict=True):
            np.testing.assert_allclose(found[i], own, atol=1e-13)


def test_products_and_complex_points_are_mapped():
    names = ("u:2", "r:3")
    points = tuple(
        np.stack([walk(ss.space(n), 0.4, 5, np.random.default_rng(i)) for i in range(CURVES)]) for n in names
    )

    def number(p, q):
        a, b = curve(X[0], T[0], (p, q), "u:2 x r:3")
        return jnp.sum(jnp.abs(a - 0.3j) ** 2) + jnp.sum(b**3)

    found = jax.vmap(jax.grad(number, (0, 1)))(*points)
    for i in range(CURVES):
        for gradient, own in zip(found, jax.grad(number, (0, 1))(points[0][i], points[1][i]), strict=True):
            np.testing.assert_allclose(gradient[i], own, atol=1e-13)


def test_errors_name_the_curve():
    far = POINTS.copy()
    far[2, 1] = -far[2, 0]
    many = jax.vmap(lambda p: curve(0.5, T[0], p, SPHERE))
    raises("curve 2", many, far, error=ss.CutLocusError)
    if jax.default_backend() == "cpu":
        # Compiled functions on a GPU may lose it.
        raises("curve 2", jax.jit(many), far, error=jax.errors.JaxRuntimeError)
