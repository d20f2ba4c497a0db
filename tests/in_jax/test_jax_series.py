"""The series and matrix functions of geodesics in JAX, and their derivatives, against mpmath."""

from functools import partial
from itertools import combinations

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest

from symspline._autodiff.library import divided_arc, divided_logarithm
from symspline._autodiff.models import inverse_series
from symspline.jax._native import LIBRARY

QUICK = True


@pytest.fixture(autouse=True)
def forty_digits():
    with mp.workdps(40):
        yield


def worst(function, exact, at, orders=3):
    """The largest relative error of derivatives of some orders."""
    errors = []
    for k in range(orders):
        found = jax.jit(jax.vmap(function))(jnp.asarray(at))
        errors.append(
            max(abs(float(f) / float(mp.diff(exact, mp.mpf(z), k)) - 1) for f, z in zip(found, at, strict=True))
        )
        function = jax.grad(function)
    return errors


@pytest.mark.parametrize("n, sign", [(0, 1), (3, 1), (1, -1)])
def test_stumpff_on_both_sides_of_the_switch(n, sign):
    def exact(z):
        return sum((-sign * z) ** k / mp.factorial(2 * k + n) for k in range(80))

    at = [0.0, 1e-8, 0.3, 3.99, 4.01, 9.0, 30.0]
    # Recurrences lose a digit an order.
    assert max(worst(lambda z: LIBRARY.stumpff(n, sign, z), exact, at)) < 1e-12


@pytest.mark.parametrize("sign", [1, -1])
def test_arc_on_both_sides_of_the_switch(sign):
    def exact(y):
        angle = mp.asin(mp.sqrt(y)) if sign > 0 else mp.asinh(mp.sqrt(y))
        return angle / mp.sqrt(y * (1 - sign * y))

    at = [1e-8, 0.05, 0.299, 0.301, 0.6, 0.95]
    assert max(worst(lambda y: LIBRARY.arc(y, 1 - sign * y, sign), exact, at)) < 1e-13
    assert float(jax.grad(lambda y: LIBRARY.arc(y, 1 - y))(0.0)) == pytest.approx(2 / 3, rel=1e-15)


def test_the_inverse_series_inverts_the_integral():
    def exact(z):
        half = mp.sqrt(z) / 2
        return (1 - half * mp.cot(half)) / z

    assert max(worst(partial(inverse_series, LIBRARY), exact, [1e-6, 0.5, 4.0, 20.0])) < 1e-13


DIVIDED = {
    "log": (partial(divided_logarithm, jnp, LIBRARY.constant), mp.log, [0.1, 0.1, 0.101, 2.0, 20.0]),
    "arc": (
        partial(divided_arc, jnp, LIBRARY.constant, LIBRARY.arc),
        lambda y: mp.asin(mp.sqrt(y)) / mp.sqrt(y * (1 - y)),
        [1e-3, 0.2, 0.2, 0.21, 0.85],
    ),
}


@pytest.mark.parametrize("name", DIVIDED)
def test_divided_differences(name):
    """By their definition in 40 digits, at numbers far from each other, near, and equal but for 1e-9."""
    differences, function, numbers = DIVIDED[name]
    for k in (1, 2, 3, 4):
        for chosen in combinations(numbers, k):
            x = [mp.mpf(a) + mp.mpf(10) ** -9 * i * (len(set(chosen)) < k) for i, a in enumerate(chosen)]
            column = [function(a) for a in x]
            for j in range(1, k):
                column = [(column[i + 1] - column[i]) / (x[i + j] - x[i]) for i in range(len(column) - 1)]
            found = differences(*(jnp.array(float(a)) for a in x))
            np.testing.assert_allclose(float(found), float(column[0]), rtol=5e-14)
