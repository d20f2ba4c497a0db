"""Laws that every space obeys, over all spaces and over decades of magnitude."""

import itertools

import numpy as np
import pytest
from cases import (
    CASES,
    EPS,
    FAMILIES,
    LARGE,
    apart,
    base_point,
    condition,
    every_family,
    has_metric,
    steep_tangent,
    unit_tangent,
)

SEED = 20180308
every = pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)


# Lengths over decades, close together around the switches between series (angles of a step whose
# square is 0.1 or 2.5, or whose 1 − cos is 0.0075 or 0.09).
LENGTHS = [
    *(10.0**e for e in range(-12, 0)),
    *(s * (1 + d) for s in (0.1225, 0.316, 0.427, 1.581) for d in (-1e-2, -1e-6, 1e-6, 1e-2)),
    1.0,
    2.0,
    3.0,
]


def test_every_family_is_in_the_suite():
    families = {row[0] for row in FAMILIES}
    assert families == {case.name.partition(":")[0] for case in CASES}
    assert families == {case.name.partition(":")[0] for case in CASES if case.interface}


def lengths(space):
    """Lengths inside the cut locus, up to just before it."""
    radius = space.injectivity_radius
    if not np.isfinite(radius):
        return LENGTHS
    return [x for x in LENGTHS if x < radius] + [radius - 10.0**e for e in range(-13, 0)]


@pytest.mark.parametrize("case", CASES + LARGE, ids=lambda case: case.name)
def test_exp_and_log_are_inverse(case, rng):
    space = case.space
    for length, direction in itertools.product(lengths(space), (unit_tangent, steep_tangent)):
        p = base_point(space, rng)
        v = length * direction(space, p, rng)
        q = space.exp(p, v)
        space.check_point(q)
        # Rounding of points, and the condition 1/(limit − angle) of the logarithm.
        allowed = 20 * EPS * condition(space, [p, q])
        near_cut = length / min(1.0, (space.injectivity_radius - length))
        assert apart(space, space.exp(p, space.log(p, q)), q) <= allowed, length
        if length > 1e-7:
            assert np.abs(space.log(p, q) - v).max() <= allowed * max(1.0, near_cut), length
        assert abs(space.distance(p, q) - length) <= allowed * max(1.0, length), length


@every_family
def test_geodesic_divides_the_distance(case, rng):
    space = case.space
    for length in (1e-8, 1e-3, 0.5, 0.9 * min(3.2, space.injectivity_radius)):
        p = base_point(space, rng)
        q = space.exp(p, length * unit_tangent(space, p, rng))
        t = np.array([-0.3, 0.0, 0.25, 0.5, 1.0])
        x = space.geodesic(p, q, t)
        # Near the antipode the direction of the geodesic is known to ε/(π − 2.9).
        allowed = 50 * EPS * condition(space, x)
        assert apart(space, x[1], p) <= allowed
        assert np.abs(space.distance(p, x) - np.abs(t) * length).max() <= allowed
        assert apart(space, x[4], q) <= allowed


def symmetry(space, p, x):
    return space.exp(p, -space.log(p, x))


@every_family
def test_transvection_is_the_product_of_two_symmetries(case, rng):
    space = case.space
    for length in [x for x in lengths(space) if x < min(2.5, 0.9 * space.injectivity_radius)]:
        p = base_point(space, rng)
        v = length * unit_tangent(space, p, rng)
        x = space.exp(p, 0.4 * unit_tangent(space, p, rng))
        middle = space.exp(p, v / 2)
        moved = space.transvection(p, v, x)
        twice = symmetry(space, middle, symmetry(space, p, x))
        allowed = 100 * EPS * condition(space, [p, x, moved])
        assert apart(space, moved, twice) <= allowed, length
        assert apart(space, space.transvection(p, v, p), space.exp(p, v)) <= allowed, length


@every_family
def test_transvection_carries_exp_and_keeps_length(case, rng):
    space = case.space
    for length in [x for x in lengths(space) if x < 3.0]:
        p = base_point(space, rng)
        v = length * unit_tangent(space, p, rng)
        q = space.exp(p, v)
        w = 0.7 * unit_tangent(space, p, rng)
        carried = space.transport(p, q, w)
        # Parallel transport needs log(p, q), whose direction is known to ε/length for short steps,
        # but then it matters by length only.
        allowed = 100 * EPS * condition(space, [p, q]) / min(1.0, (space.injectivity_radius - length))
        if has_metric(space):
            assert abs(space.norm(q, carried) - 0.7) <= allowed, length
        moved = space.transvection(p, v, space.exp(p, w))
        assert apart(space, moved, space.exp(q, carried)) <= 4 * allowed, length
        assert np.abs(space.transport(p, q, v) + space.log(q, p)).max() <= allowed, length


@every_family
def test_inner_product_is_that_of_distance(case, rng):
    space = case.space
    p = base_point(space, rng)
    u, v = (space.random_tangent(rng, p) for _ in range(2))
    space.check_tangent(p, u)
    e = 1e-4
    square = space.distance(space.exp(p, e * u), space.exp(p, e * v)) ** 2 / e**2
    if not has_metric(space):
        # There is no invariant metric: distances are those from the first point.
        square = space.distance(p, space.exp(p, e * (u - v))) ** 2 / e**2
    # Curvature enters at e² relative; distances carry ε/e.
    assert square == pytest.approx(space.norm(p, u - v) ** 2, rel=1e-6, abs=1e-6)
    expanded = space.inner(p, u, u) - 2 * space.inner(p, u, v) + space.inner(p, v, v)
    assert expanded == pytest.approx(space.norm(p, u - v) ** 2, rel=1e-12, abs=1e-12)
