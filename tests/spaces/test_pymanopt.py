"""The geometry against pymanopt."""

import numpy as np
import pytest
from cases import EPS, QUOTIENTS, base_point, loop_over, unit_tangent
from pymanopt import manifolds

import symspline as ss

SEED = 40


def plain(space, x):
    """Subspaces as projectors."""
    return x @ np.swapaxes(x, -1, -2).conj() if isinstance(space, QUOTIENTS) else x


ROOT = np.sqrt(2)


# Its lengths in groups are those of Re tr u*v, and its tangent vectors there are p⁻¹v.
PYMANOPT = [
    ("sphere:3", manifolds.Sphere(4), 1.0),
    ("gr:2,5", manifolds.Grassmann(5, 2), 1.0),
    ("gr:3,4", manifolds.Grassmann(4, 3), 1.0),
    ("cgr:2,4", manifolds.ComplexGrassmann(4, 2), 1.0),
    ("cgr:1,3", manifolds.ComplexGrassmann(3, 1), 1.0),
    ("so:3", manifolds.SpecialOrthogonalGroup(3), ROOT),
    ("so:5", manifolds.SpecialOrthogonalGroup(5), ROOT),
    ("u:2", manifolds.UnitaryGroup(2), 1.0),
    ("u:4", manifolds.UnitaryGroup(4), 1.0),
    ("spd:2", manifolds.SymmetricPositiveDefinite(2), 1.0),
    ("spd:5", manifolds.SymmetricPositiveDefinite(5), 1.0),
    ("hpd:3", manifolds.HermitianPositiveDefinite(3), 1.0),
]


@pytest.mark.parametrize(("name", "theirs", "scale"), PYMANOPT, ids=[row[0] for row in PYMANOPT])
@loop_over("length", [1e-3, 0.1, 0.7, 1.4])
def test_geometry_is_that_of_pymanopt(name, theirs, scale, length, rng):
    space = ss.space(name)
    group = isinstance(space, ss.SpecialOrthogonal | ss.Unitary)

    def there(p, v):
        return p.conj().T @ v if group else v

    for _ in range(4):
        p = base_point(space, rng)
        v, w = length * unit_tangent(space, p, rng), unit_tangent(space, p, rng)
        q = space.exp(p, v)
        size = max(np.linalg.cond(p), np.linalg.cond(q)) if name[1:3] == "pd" else 1.0
        allowed = 200 * EPS * size
        # Arc cosines, of which theirs are made, lose half the digits for small angles.
        lost = 1e-7 if isinstance(space, (*QUOTIENTS, ss.Sphere)) else allowed
        assert np.abs(plain(space, theirs.exp(p, there(p, v))) - plain(space, q)).max() <= allowed
        log_lost = 1e-9 if isinstance(space, ss.Sphere) else allowed
        assert np.abs(theirs.log(p, q) - there(p, v)).max() <= log_lost
        assert abs(theirs.dist(p, q) - scale * length) <= lost
        # One of their metrics has a complex type.
        product = np.real(theirs.inner_product(p, there(p, v), there(p, w)))
        assert product == pytest.approx(scale**2 * space.inner(p, v, w), abs=allowed)


def test_hyperbolic_space_is_that_of_pymanopt(rng):
    """Through the Poincaré ball."""
    space, theirs = ss.Hyperbolic(3), manifolds.PoincareBall(3)
    for length in (1e-3, 0.5, 2.0):
        p = base_point(space, rng)
        v = length * unit_tangent(space, p, rng)
        q = space.exp(p, v)
        a, b = ss.convert.hyperboloid_to_ball([p, q])
        assert theirs.dist(a, b) == pytest.approx(length, rel=1e-9)
        middle = theirs.exp(a, theirs.log(a, b) / 2)
        there = ss.convert.hyperboloid_to_ball(space.geodesic(p, q, 0.5))
        assert np.abs(middle - there).max() <= 1000 * EPS
