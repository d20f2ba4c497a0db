"""Derivatives of functions of the user: by a function, by JAX, and by differences."""

import re

import numpy as np
import pytest
from test_linearisation import check, problem, rows_of

import symspline as ss
from symspline import measure

T = np.linspace(0.2, 5.8, 9)
BEACONS = np.array([[0.0, 2.0], [3.0, 1.0], [-1.0, -2.0]])


def raises(message, function, *args, **kwargs):
    with pytest.raises(ss.ValidationError, match=re.escape(message)):
        function(*args, **kwargs)


class Functional:
    """Residuals Re Σ conj(c) x + sin(first parameter) d, linear in the points, velocities and accelerations."""

    def __init__(self, rng, name, k=2):
        self.space = ss.space(name)
        self.factors = self.space.factors if isinstance(self.space, ss.Product) else (self.space,)
        self.k = k

        def numbers(shape, dtype):
            real = rng.standard_normal((len(T), k, *shape))
            return real + 1j * rng.standard_normal(real.shape) if dtype.kind == "c" else real

        self.c = [[numbers(own.point_shape, own.dtype) for own in self.factors] for _ in range(3)]
        self.d = rng.standard_normal((len(T), k, 2))

    def tuples(self, x):
        return x if isinstance(self.space, ss.Product) else (x,)

    def residual(self, p, v, a, parameters, numpy=np):
        total = numpy.zeros((len(T), self.k))
        for x, coefficients in zip((p, v, a), self.c, strict=True):
            for array, c in zip(self.tuples(x), coefficients, strict=True):
                flat = numpy.conj(c).reshape(len(T), self.k, -1) @ array.reshape(len(T), -1, 1)
                total = total + numpy.real(flat[..., 0])
        return total + self.d @ numpy.sin(parameters["b"])

    def jacobian(self, p, v, a, parameters):
        of_motion = [tuple(c) if isinstance(self.space, ss.Product) else c[0] for c in self.c]
        return (*of_motion, {"b": self.d * np.cos(parameters["b"])})

    def given(self, jacobian, residual=None):
        return measure.Function(
            T,
            residual or self.residual,
            nu=2,
            sigma=0.3,
            parameters={"b": measure.Constant(2)},
            jacobian=jacobian,
        )


@pytest.mark.parametrize("name", ["r:2", "sphere:2", "so:3", "spd:2", "u:2", "gl:2", "so:3 x r:3", "se:3"])
@pytest.mark.parametrize("by", ["function", "jax"])
def test_derivatives_agree_with_differences(name, by):
    own = Functional(np.random.default_rng(1), name)
    if by == "jax":
        jnp = pytest.importorskip("jax.numpy")
        given = own.given("jax", lambda *arguments: own.residual(*arguments, numpy=jnp))
    else:
        given = own.given(own.jacobian)
    rows, plain = (rows_of(problem(name, [one], np.random.default_rng(2))) for one in (given, own.given(None)))
    assert np.abs(rows.residuals - plain.residuals).max() < 1e-12 * np.abs(plain.residuals).max()
    for found, expected in zip([*rows.jacobians, rows.parameters], [*plain.jacobians, plain.parameters], strict=True):
        assert np.abs(found - expected).max() < 1e-8 * (1 + np.abs(expected).max())


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "r:3"])
def test_derivatives_agree_with_moves_of_the_curve(name):
    """The oracle of all other measurements: differences of a formula at moved curves."""
    own = Functional(np.random.default_rng(3), name)

    def residuals(motion, values):
        return own.residual(motion[0].p, motion[0].v, motion[0].a, values)

    check(problem(name, [own.given(own.jacobian)], np.random.default_rng(4)), T, residuals, 0.3)


def test_residuals_of_one_number_and_missing_derivatives():
    rng = np.random.default_rng(5)
    height, speed = rng.standard_normal((2, len(T)))

    def residual(p, v, parameters):
        return p[:, 2] - height + 0 * speed + parameters["offset"][0]

    def jacobian(p, v, parameters):
        return np.broadcast_to([0.0, 0, 1], (len(T), 3)), None, {"offset": np.ones((len(T), 1))}

    constants = {"offset": measure.Constant(1), "other": measure.Constant(3)}
    given = measure.Function(T, residual, sigma=0.1, nu=1, parameters=constants, jacobian=jacobian)
    rows = rows_of(problem("r:3", [given], rng))
    assert np.array_equal(rows.jacobians[0][:, 0], np.broadcast_to([0, 0, 10.0], (len(T), 3)))
    assert not rows.jacobians[1].any()
    assert np.array_equal(rows.parameters[:, 0], np.broadcast_to([10.0, 0, 0, 0], (len(T), 4)))


def ranges(numpy=np):
    t = np.linspace(0, 1, 50)
    path = np.stack([t, t**2], axis=-1)
    seen = np.linalg.norm(path[:, None] - BEACONS, axis=-1)
    seen = seen + 0.01 * np.random.default_rng(0).standard_normal(seen.shape)
    calls = []

    def residual(x):
        calls.append(1)
        return numpy.linalg.norm(x[:, None] - BEACONS, axis=-1) - seen

    return t, residual, calls


def directions(x):
    away = x[:, None] - BEACONS
    return away / np.linalg.norm(away, axis=-1, keepdims=True)


def test_estimates_are_the_same_with_fewer_calls():
    t, residual, calls = ranges()
    plain = ss.estimate([measure.Function(t, residual, sigma=0.01)], 9, "r:2")
    count = len(calls)
    given = ss.estimate([measure.Function(t, residual, sigma=0.01, jacobian=directions)], 9, "r:2")
    assert np.abs(given(t) - plain(t)).max() < 1e-7
    # Two calls per coordinate are for the check of the first derivatives, and later ones have none.
    assert len(calls) - count < count / 2 + 6
    jnp = pytest.importorskip("jax.numpy")
    by_jax = ss.estimate([measure.Function(t, ranges(jnp)[1], sigma=0.01, jacobian="jax")], 9, "r:2")
    assert np.abs(by_jax(t) - plain(t)).max() < 1e-7


def test_wrong_derivatives_raise():
    t, residual, _ = ranges()

    def with_jacobian(jacobian, residual=residual):
        given = measure.Function(t, residual, sigma=0.01, jacobian=jacobian)
        return ss.estimate([given], 9, "r:2")

    raises("jacobian is wrong: the derivative of residual [0, 1]", with_jacobian, lambda x: -directions(x))
    raises("with respect to the points along [1.0, 0.0] is", with_jacobian, lambda x: -directions(x))
    raises(
        "float64 of shape (50, 2, 2), but numbers of shape (50, 3, 2)", with_jacobian, lambda x: directions(x)[:, :2]
    )
    raises("entry [3, 0, 1] of the derivative", with_jacobian, lambda x: spoiled(directions(x)))
    raises("jacobian must be a function, 'jax' or None, not 'torch'", with_jacobian, "torch")
    constants = {"c": measure.Constant(1)}
    given = measure.Function(t, lambda x, c: residual(x), sigma=0.01, parameters=constants)
    given.jacobian = lambda x, c: directions(x)
    raises("must return a tuple of 2 derivatives", ss.estimate, [given], 9, "r:2")
    given.jacobian = lambda x, c: (directions(x), {"d": np.zeros((50, 3, 1))})
    raises("a dict with some of ['c']", ss.estimate, [given], 9, "r:2")
    pair = measure.Function(t, lambda x: residual(x[1]), sigma=0.01, jacobian=lambda x: (None,))
    raises("must return 2 arrays for the points", ss.estimate, [pair], 9, "r:1 x r:2", lam=1.0)


def spoiled(x):
    x[3, 0, 1] = np.nan
    return x


def test_functions_that_jax_cannot_differentiate_raise(monkeypatch):
    t, residual, _ = ranges()
    monkeypatch.setattr(measure, "find_spec", lambda name: None)
    raises("pip install symspline[jax]", measure.Function, t, residual, sigma=0.01, jacobian="jax")
    monkeypatch.undo()
    pytest.importorskip("jax")
    given = measure.Function(t, lambda x: np.asarray(residual(x)), sigma=0.01, jacobian="jax")
    raises("Write it with jax.numpy", ss.estimate, [given], 9, "r:2")
