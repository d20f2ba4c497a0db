"""Log-Euclidean splines against SciPy's splines of matrix logarithms, with differences as derivatives."""

import numpy as np
import pytest
from refused import raises
from scipy.interpolate import CubicSpline
from scipy.linalg import expm, expm_frechet

import symspline as ss


def tensors(rng, n, count=9, spread=1.0, scale=1.0):
    """Irregular times, and matrices with eigenvalues that differ by factors of about exp(3 spread)."""
    h = rng.standard_normal((count, n, n)) * spread
    return np.cumsum(rng.uniform(0.3, 2.0, count)), scale * np.stack([expm(x + x.T) for x in h])


def logs(p):
    values, vectors = np.linalg.eigh(p)
    return (vectors * np.log(values)[..., None, :]) @ np.swapaxes(vectors, -1, -2)


def exps(y):
    return np.stack([expm(x) for x in y])


def derivatives(f, x):
    """Velocities and covariant accelerations of exp(f): the derivative of exp in the directions f' and f''."""
    return (np.stack([expm_frechet(f(s), f(s, nu), compute_expm=False) for s in x]) for nu in (1, 2))


@pytest.mark.parametrize("n", [1, 2, 3, 6])
@pytest.mark.parametrize("spread", [1e-8, 1e-4, 0.1, 0.7])
def test_splines_are_exponentials_of_splines_of_logarithms(n, spread):
    t, p = tensors(np.random.default_rng(n), n, spread=spread, scale=1e-3)
    space = ss.LogEuclidean(n)
    x = np.linspace(t[0], t[-1], 41)
    for bc_type in ("natural", "not-a-knot"):
        f, spline = CubicSpline(t, logs(p), bc_type=bc_type), ss.CubicSpline(t, p, space, bc_type=bc_type)
        rounding = 1e-13 * space._rounding(spline(x)).max()
        assert np.abs(spline(x) - exps(f(x))).max() < rounding * np.abs(p).max()
        for nu, expected in zip((1, 2), derivatives(f, x), strict=True):
            size = np.abs(p).max() * np.abs(f(x, nu)).max()
            # Differences of logarithms of nearly equal matrices lose digits in both programs.
            assert np.abs(spline(x, nu) - expected).max() < 100 * rounding * (size + np.abs(p).max())
    # A difference quotient of the exponential, as an independent check of the covariant acceleration.
    s, h = 0.5 * (t[3] + t[4]), 1e-5
    moved = [expm(f(s) + sign * h * f(s, 2)) for sign in (1, -1)]
    quotient = (moved[0] - moved[1]) / (2 * h)
    np.testing.assert_allclose(spline(s, 2), quotient, atol=1e-6 * np.abs(quotient).max() + 1e-14 * np.abs(p).max() / h)


def test_operations_are_those_of_logarithms():
    rng = np.random.default_rng(5)
    space = ss.LogEuclidean(3)
    _, p = tensors(rng, 3, 12)
    _, q = tensors(rng, 3, 12)
    a, b = logs(p), logs(q)
    np.testing.assert_allclose(space.distance(p, q), np.linalg.norm(b - a, axis=(-2, -1)), rtol=1e-10)
    v = np.stack([expm_frechet(x, y - x, compute_expm=False) for x, y in zip(a, b, strict=True)])
    np.testing.assert_allclose(space.log(p, q), v, rtol=1e-8, atol=1e-10 * np.abs(v).max())
    np.testing.assert_allclose(space.exp(p, v), q, rtol=1e-8, atol=1e-10 * np.abs(q).max())
    np.testing.assert_allclose(space.norm(p, v), space.distance(p, q), rtol=1e-9)
    moved = space.transport(p, q, v)
    np.testing.assert_allclose(
        space.exp(q, moved), exps(2 * b - a), rtol=1e-7, atol=1e-8 * np.abs(exps(2 * b - a)).max()
    )
    weights = rng.uniform(size=12)
    mean = expm(np.average(a, axis=0, weights=weights))
    np.testing.assert_allclose(space.mean(p, weights), mean, rtol=1e-10, atol=1e-12 * np.abs(mean).max())


def test_the_group_is_that_of_similarities():
    space = ss.LogEuclidean(2)
    p = np.array([[2.0, 0.5], [0.5, 1.0]])
    turned = [[0.6, -0.8], [0.8, 0.6]]
    np.testing.assert_allclose(space.act(3 * np.array(turned), p), 9 * np.array(turned) @ p @ np.transpose(turned))
    raises("multiple of an orthogonal matrix", space.act, [[1.0, 1], [0, 1]], p)
