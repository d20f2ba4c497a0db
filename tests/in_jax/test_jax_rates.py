"""Velocities and covariant accelerations of the compiled spline in JAX, and their sensitivity to the data."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cases import unit_tangent, walk
from refused import raises

import symspline as ss
from symspline.jax import curve

X = np.array([0.3, 1.7, 3.1])
T = np.array([0.0, 1.0, 2.2, 3.0, 4.1])
LATER = 0.1 * np.arange(5.0)
PLAIN = ["r:2", "sphere:2", "h:2", "so:3", "u:2", "spd:2", "hpd:2", "siegel:1", "se:3"]
QUOTIENTS = ["rp:2", "cp:2", "gr:2,5", "cgr:2,4", "hp:1", "ch:2"]


def data(name):
    space, rng = ss.space(name), np.random.default_rng(1)
    points = walk(space, 0.5, 5, np.random.default_rng(0))
    return space, points, np.array([unit_tangent(space, p, rng) for p in points])


def function(name, nu):
    """γ⁽ᵛ⁾; on quotients times γ*, which does not depend on the representative."""

    def value(x, t, points):
        found = curve(x, t, points, name, nu=nu)
        if name not in QUOTIENTS:
            return found
        point = curve(x, t, points, name)
        if point.ndim == 2:
            found, point = found[..., None], point[..., None]
        return found @ jnp.conj(jnp.swapaxes(point, -1, -2))

    return value


def difference(value, h=1e-3):
    """Of order six."""
    weights = {1: 0.75, 2: -0.15, 3: 1 / 60}
    return sum(w * (value(k * h) - value(-k * h)) for k, w in weights.items()) / h


@pytest.mark.parametrize("nu", [1, 2])
@pytest.mark.parametrize("name", [*PLAIN, *QUOTIENTS])
def test_values_are_those_of_the_spline(name, nu):
    _, points, _ = data(name)
    np.testing.assert_array_equal(curve(X, T, points, name, nu=nu), ss.CubicSpline(T, points, name)(X, nu=nu))


@pytest.mark.parametrize(
    ("name", "nu", "dx"),
    # Points, velocities and accelerations, with and without moving times, on spaces of each second fundamental form.
    [
        *(("gr:2,5", 0, 1.0), ("sphere:2", 1, 1.0), ("spd:2", 1, 0.0)),
        *(("h:2", 2, 0.0), ("se:3", 2, 0.0), ("hp:1", 2, 0.0)),
    ],
)
def test_rates_differentiate_with_respect_to_data(name, nu, dx):
    """The derivative of the arrays, with their normal parts; and its transpose."""
    space, points, steps = data(name)
    value = function(name, nu)

    def moved(e):
        return value(X + e * dx, T + e * LATER, space.exp(points, e * steps))

    def of_data(t, points):
        return value(X, t, points)

    if dx:
        primals, tangents, call = (X, T, points), (np.full(3, dx), LATER, steps), value
    else:
        # ∇γ' cannot be asked for its derivative in x.
        primals, tangents, call = (T, points), (LATER, steps), of_data
    found, push = jax.jvp(call, primals, tangents)
    # The error of the difference.
    np.testing.assert_allclose(push, difference(moved), atol=1e-10 * np.abs(push).max())
    rng = np.random.default_rng(2)
    cotangent = jnp.asarray(rng.standard_normal(found.shape), found.dtype)
    pulled = jax.vjp(call, *primals)[1](cotangent)
    total = sum(jnp.sum(g * s).real for g, s in zip(pulled, tangents, strict=True))
    # Derivatives of accelerations on spaces without a closed rule are interpolated.
    tol = (1e-11 if nu == 2 else 1e-12) * np.linalg.norm(cotangent) * np.linalg.norm(push)
    np.testing.assert_allclose(total, jnp.sum(cotangent * push).real, rtol=0.0, atol=tol)


def test_the_second_derivative_as_an_array_is_that_of_the_velocity():
    _, points, _ = data("sphere:2")
    along = jax.jacfwd(lambda x: curve(x, T, points, "sphere:2", nu=1))
    twice = jax.vmap(along)(X)
    position, velocity, acceleration = (curve(X, T, points, "sphere:2", nu=nu) for nu in (0, 1, 2))
    speed2 = jnp.sum(velocity**2, axis=-1, keepdims=True)
    np.testing.assert_allclose(twice, acceleration - speed2 * position, atol=1e-14)


def test_unknown_names_raise():
    _, points, _ = data("sphere:2")
    raises(
        "third derivative", jax.jacfwd(lambda x: curve(x, T, points, "sphere:2", nu=2)), X, error=NotImplementedError
    )
    number = jax.grad(lambda p: jnp.sum(curve(X, T, p, "sphere:2") ** 2))
    raises("any order", jax.jacfwd(number), points, error=NotImplementedError)
    raises("nu must be 0, 1 or 2, not 3", curve, X, T, points, "sphere:2", nu=3)
