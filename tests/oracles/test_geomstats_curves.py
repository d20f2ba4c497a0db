"""Curves on spaces of geomstats, and our Stiefel manifolds beside theirs."""

import numpy as np
import pytest
from cases import one_sided
from geomstats.geometry.hypersphere import Hypersphere
from geomstats.geometry.spd_matrices import SPDBuresWassersteinMetric, SPDMatrices
from geomstats.geometry.stiefel import Stiefel

import symspline as ss
from symspline.manifolds import from_geomstats


def walk(space, step, n, start, seed=1):
    rng = np.random.default_rng(seed)
    p, v = [start], space.random_tangent(rng, start)
    for _ in range(n - 1):
        v = v / space.norm(p[-1], v)
        q = space.exp(p[-1], step * v)
        v = -space.log(q, p[-1]) / step + 0.5 * space.random_tangent(rng, q)
        p.append(q)
    return np.array(p)


def jump(spline):
    starts, ends = one_sided(spline, 2)
    return np.abs(ends[:-1] - starts[1:]).max() / np.abs(starts).max()


# Far from singular matrices, where geodesics end: a curve between small ones has small steps.
MIDDLE = np.array([[9.0, 1.0], [1.0, 6.0]])


def bures():
    space = SPDMatrices(2, equip=False)
    space.equip_with_metric(SPDBuresWassersteinMetric)
    return from_geomstats(space)


@pytest.mark.parametrize(("k", "n"), [(2, 5), (3, 4), (3, 6)])
@pytest.mark.parametrize("length", [0.01, 0.5, 1.2])
def test_stiefel_manifolds_are_those_of_geomstats(k, n, length):
    ours, theirs = ss.Stiefel(k, n), Stiefel(n, k).metric
    rng = np.random.default_rng(2)
    p = ours.random_point(rng, 4)
    v, w = (ours.random_tangent(rng, p) for _ in range(2))
    v = length * v / ours.norm(p, v)[:, None, None]
    q = ours.exp(p, v)
    assert np.abs(theirs.exp(v, p) - q).max() <= 1e-12
    assert np.abs(theirs.inner_product(v, w, p) - ours.inner(p, v, w)).max() <= 1e-12
    # Their logarithm stops at 1e-6.
    assert np.abs(theirs.log(q, p) - ours.log(p, q)).max() <= 1e-5


def test_the_sphere_of_geomstats():
    space, ours = from_geomstats(Hypersphere(2)), ss.Sphere(2)
    p = walk(ours, 0.6, 6, np.array([1.0, 0.0, 0.0]))
    spline, core = ss.CubicSpline(None, p, space), ss.CubicSpline(None, p, ours)
    x = np.linspace(0, 5, 21)
    # Their logarithm is a series near zero, to 1e-12 or so.
    assert np.abs(spline(x) - core(x)).max() <= 1e-9


@pytest.mark.parametrize("ends", ["natural", "not-a-knot", "clamped"])
@pytest.mark.parametrize("spacing", ["equal", "unequal"])
def test_a_space_that_is_not_symmetric(spacing, ends):
    """Covariances with the Bures–Wasserstein metric, that of transport between normal distributions."""
    space = bures()
    p = walk(space, 0.4, 7, MIDDLE)
    t = np.arange(7.0) if spacing == "equal" else np.cumsum(np.random.default_rng(3).uniform(0.5, 1.5, 7))
    spline = ss.CubicSpline(t, p, space, bc_type=ends)
    assert spline.report.converged and spline.report.iterations <= 15
    assert jump(spline) <= 1e-8
    assert np.linalg.eigvalsh(spline(np.linspace(t[0], t[-1], 50))).min() > 0


def test_not_a_knot_is_of_order_four():
    space = bures()

    def truth(t):
        a, b, c = 9 + np.sin(t), 1 + np.cos(2 * t), 6 + 0.5 * np.sin(1.5 * t)
        return np.stack([np.stack([a, b], -1), np.stack([b, c], -1)], -2)

    x = np.linspace(0, 2, 301)
    errors = []
    for n in (9, 17, 33):
        t = np.linspace(0, 2, n)
        errors.append(np.abs(ss.CubicSpline(t, truth(t), space, bc_type="not-a-knot")(x) - truth(x)).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all((orders > 3.6) & (orders < 4.8)), (errors, orders)


def test_the_suite_of_laws():
    found = ss.testing.check(bures(), point=MIDDLE, length=0.4, tol=1e-9)
    assert found.deviations["acceleration is continuous"] <= 1e-7
