"""K of (22) and the injectivity radius of every space, found by search.

K² is the largest |[[a, b], c]| = |R(a, b)c| of unit tangent vectors. For a small sum of tensors it is a
largest singular value, of one vector at a time.
"""

import numpy as np
import pytest
from cases import CASES, EPS, LINEAR, base_point, compact, has_metric, unit_tangent
from lie import Lie, bracket

import symspline as ss

SEED = 22

NAMES = [
    *("euclidean:3", "sphere:2", "hyperbolic:2", "rp:2", "cp:2", "gr:2,4", "cgr:2,3"),
    *("so:3", "so:4", "u:2", "su:3", "spd:3", "hpd:2"),
]
every = pytest.mark.parametrize("name", NAMES)


def triple(space, p, a, b, c):
    """R(a, b)c by the double bracket of the Lie algebra."""
    lie = Lie(space)
    a, b, c = (lie.lift(p, v) for v in (a, b, c))
    return lie.at(bracket(bracket(a, b), c), p)


def orthonormal_basis(space, p, rng):
    basis = []
    while len(basis) < space.dim:
        v = space.random_tangent(rng, p)
        for _ in range(2):
            for e in basis:
                v = v - space.inner(p, e, v) * e
        basis.append(v / space.norm(p, v))
    return np.array(basis)


def curvature_tensor(space, p, rng):
    """⟨R(eᵢ, eⱼ)eₖ, eₗ⟩ of an orthonormal basis."""
    basis = orthonormal_basis(space, p, rng)
    return np.array(
        [
            [[[space.inner(p, d, x) for d in basis] for c in basis for x in [triple(space, p, a, b, c)]] for b in basis]
            for a in basis
        ]
    )


def climb(tensor, rng, steps=300):
    """|R(a, b)c| of unit vectors, made larger in one of them at a time, until it rests."""
    a, b, c = (x / np.linalg.norm(x) for x in rng.standard_normal((3, len(tensor))))
    first = best = np.linalg.norm(np.einsum("ijkl,i,j,k->l", tensor, a, b, c))
    for _ in range(steps):
        a = np.linalg.svd(np.einsum("ijkl,j,k->il", tensor, b, c)).U[:, 0]
        b = np.linalg.svd(np.einsum("ijkl,i,k->jl", tensor, a, c)).U[:, 0]
        c, sizes, _ = np.linalg.svd(np.einsum("ijkl,i,j->kl", tensor, a, b))
        c = c[:, 0]
        if sizes[0] <= best * (1 + 1e-12):
            break
        best = sizes[0]
    return first, max(best, sizes[0])


@every
def test_curvature_is_the_largest_triple_product(name, rng):
    space = ss.space(name)
    p = space.random_point(rng) if compact(space) else base_point(space, rng)
    tensor = curvature_tensor(space, p, rng)
    unit = rng.standard_normal((3, 2000, space.dim))
    unit /= np.linalg.norm(unit, axis=-1, keepdims=True)
    some = np.linalg.norm(np.einsum("ijkl,ni,nj,nk->nl", tensor, *unit, optimize=True), axis=-1)
    square = space.curvature**2
    rounding = 1000 * EPS
    assert some.max() <= square * (1 + 1e-12) + rounding
    found = np.array([climb(tensor, rng) for _ in range(20)])
    assert found.max() <= square * (1 + 1e-10) + rounding
    # Some climbs end on lower tops.
    assert found[:, 1].max() == pytest.approx(square, rel=1e-6, abs=rounding)


def test_curvature_of_products_and_poses():
    assert ss.Product(ss.Sphere(2), ss.ComplexProjective(2), ss.Euclidean(1)).curvature == 2.0
    # The group of poses has no invariant metric, hence no K.
    assert np.isnan(ss.SpecialEuclidean(3).curvature)


def unit(n, i, j, value=1.0):
    e = np.zeros((n, n), dtype=type(value))
    e[i, j] = value
    return e


def shortest_loop(space):
    """A point, and the direction of a shortest closed geodesic there."""
    match space:
        case ss.Sphere() | ss.RealProjective() | ss.ComplexProjective():
            p, v = np.eye(*(2, space.point_shape[0]))
        case ss.Grassmannian() | ss.ComplexGrassmannian():
            n, k = space.point_shape
            p, v = np.eye(n, k), np.eye(n)[:, [k]] * np.eye(k)[0]
        case ss.QuaternionicProjective():
            p, v = np.eye(space.point_shape[0], 2), np.eye(space.point_shape[0])[:, 2:4]
        case ss.SpecialOrthogonal() | ss.Orthogonal():
            n = space.point_shape[0]
            p, v = np.eye(n), unit(n, 1, 0) - unit(n, 0, 1)
        case ss.Unitary():
            n = space.point_shape[0]
            p, v = np.eye(n), unit(n, 0, 0, 1j)
        case ss.SpecialUnitary():
            n = space.point_shape[0]
            p, v = np.eye(n), unit(n, 0, 0, 1j) - unit(n, 1, 1, 1j)
        case ss.Torus():
            p, v = np.zeros(space.point_shape), np.eye(space.point_shape[0])[0]
        case _:
            pytest.fail(f"add a shortest closed geodesic of {type(space).__name__} here")
    return p, v / space.norm(p, v)


@pytest.mark.parametrize("case", [c for c in CASES if compact(c.space)], ids=lambda case: case.name)
def test_injectivity_radius(case, rng):
    space = case.space
    radius = space.injectivity_radius
    p, v = shortest_loop(space)
    # It is closed after twice the radius, and up to there the way back is longer.
    assert space.distance(space.exp(p, 2 * radius * v), p) <= 20 * EPS
    # The angle that decides is π at the most, which rounding of π moves by ε.
    for d in (1e-1, 1e-3, 1e-6, 1e-9):
        assert abs(space.distance(p, space.exp(p, (radius - d) * v)) - (radius - d)) <= 20 * EPS
        assert abs(space.distance(p, space.exp(p, (radius + d) * v)) - (radius - d)) <= 20 * EPS
    # In no direction does a geodesic stop being shortest before.
    directions = [v, *(unit_tangent(space, p, rng) for _ in range(200))]
    for d in (1e-1, 1e-3, 1e-6, 1e-9):
        velocities = (radius - d) * np.array(directions)
        back = space.log(p, space.exp(p, velocities))
        # The logarithm's condition is 1/d.
        assert np.abs(back - velocities).max() <= 50 * EPS / d


@pytest.mark.parametrize("case", [c for c in CASES if not compact(c.space)], ids=lambda case: case.name)
def test_injectivity_radius_is_infinite(case, rng):
    space = case.space
    if not has_metric(space):
        # Half a turn, of real matrices in a plane at least; translations and stretches have no cut locus.
        plane = isinstance(space, (*LINEAR, ss.IndefiniteGrassmannian)) and space.dtype == float
        assert space.injectivity_radius == (np.sqrt(2) * np.pi if plane else np.pi)
        return
    assert space.injectivity_radius == np.inf
    # Distances that e^d times rounding still leaves digits of.
    p = base_point(space, rng)
    v = 8.0 * unit_tangent(space, p, rng)
    assert space.distance(p, space.exp(p, v)) == pytest.approx(8.0, rel=1e-8)
