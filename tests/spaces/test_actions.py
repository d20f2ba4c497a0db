"""Geodesic symmetries and the action of the group: `Space.symmetry` and `Space.act`."""

import numpy as np
import pytest
from cases import CASES, EPS, apart, base_point, condition, every_family, has_metric, loop_over, unit_tangent, walk
from lie import Lie
from refused import raises

import symspline as ss

SEED = 1703
one_per_family = pytest.mark.parametrize("case", [c for c in CASES if c.interface], ids=lambda case: case.name)


@every_family
@loop_over("length", [1e-9, 1e-3, 0.4, 0.9])
def test_symmetry_reverses_geodesics(case, length, rng):
    space = case.space
    p = base_point(space, rng)
    v = length * min(1.6, space.injectivity_radius) * unit_tangent(space, p, rng)
    x, mirrored = space.exp(p, v), space.exp(p, -v)
    allowed = 40 * EPS * condition(space, [p, x, mirrored])
    assert apart(space, space.symmetry(p, x), mirrored) <= allowed
    assert apart(space, space.symmetry(p, space.symmetry(p, x)), x) <= 4 * allowed
    assert apart(space, space.symmetry(p, p), p) <= allowed


# A point, one at its cut locus, and the image of that one.
HALF_TURN = np.diag([1.0, -1, -1])
AT_THE_CUT_LOCUS = [
    ("sphere:2", [0, 0, 1], [0, 0, -1], [0, 0, -1]),
    ("rp:2", [0, 0, 1], [0.6, 0.8, 0], [0.6, 0.8, 0]),
    ("cp:1", [0, 1], [1j, 0], [1, 0]),
    ("gr:1,3", [[0], [0], [1]], [[0.6], [0.8], [0]], [[0.6], [0.8], [0]]),
    ("gr:2,4", np.eye(4)[:, :2], np.eye(4)[:, 2:], np.eye(4)[:, 2:]),
    ("so:3", np.eye(3), HALF_TURN, HALF_TURN),
    ("u:2", np.eye(2), np.diag([-1, 1j]), np.diag([-1, -1j])),
]


@pytest.mark.parametrize(("name", "p", "x", "image"), AT_THE_CUT_LOCUS, ids=[row[0] for row in AT_THE_CUT_LOCUS])
def test_symmetry_at_the_cut_locus(name, p, x, image):
    space = ss.space(name)
    assert apart(space, space.symmetry(p, x), image) <= 4 * EPS


@every_family
def test_symmetries_are_conjugate_by_the_group(case, rng):
    """σ_{g·p}(g·x) = g·σ_p(x)."""
    space, lie = case.space, Lie(case.space)
    p = base_point(space, rng)
    x = space.exp(p, 0.5 * unit_tangent(space, p, rng))
    g = lie.element(rng)
    moved = lie.act(g, space.symmetry(p, x))
    there = space.symmetry(lie.act(g, p), lie.act(g, x))
    assert apart(space, there, moved) <= 100 * EPS * condition(space, [p, x, moved]) ** 2


@every_family
def test_elements_act_as_a_group(case, rng):
    space, lie = case.space, Lie(case.space)
    x = base_point(space, rng)
    g, h = lie.element(rng), lie.element(rng)
    one = np.broadcast_to(np.eye(g.shape[-1]), g.shape)
    assert apart(space, lie.act(one, x), x) <= 4 * EPS * condition(space, x)
    both = lie.act(g @ h, x)
    # g costs as much as the points that it makes.
    allowed = 50 * EPS * condition(space, [x, both, lie.act(h, x)]) * np.linalg.cond(g).max() ** 2
    assert apart(space, both, lie.act(g, lie.act(h, x))) <= allowed
    space.check_point(both)


@every_family
def test_elements_are_isometries(case, rng):
    """g·exp_p(v) = exp_{g·p}(g·v); distances and inner products stay, where there is an invariant metric."""
    space, lie = case.space, Lie(case.space)
    p = base_point(space, rng)
    v, w = (0.6 * unit_tangent(space, p, rng) for _ in range(2))
    q, g = space.exp(p, v), lie.element(rng)
    there = lie.act(g, p)
    allowed = 100 * EPS * condition(space, [p, q, there]) * np.linalg.cond(g).max() ** 2
    assert apart(space, lie.act(g, q), space.exp(there, lie.push(g, v))) <= allowed
    if has_metric(space):
        assert abs(space.distance(there, lie.act(g, q)) - space.distance(p, q)) <= allowed
        moved = space.inner(there, lie.push(g, v), lie.push(g, w))
        assert abs(moved - space.inner(p, v, w)) <= allowed
    assert np.abs(space.log(there, lie.act(g, q)) - lie.push(g, v)).max() <= allowed


@every_family
@loop_over("ends", ["natural", "not-a-knot"])
def test_the_spline_commutes_with_the_group(case, ends, rng):
    space, lie = case.space, Lie(case.space)
    p = walk(space, 0.4, 7, rng)
    t = np.cumsum(rng.uniform(0.5, 1.5, len(p)))
    g, x = lie.element(rng), np.linspace(t[0], t[-1], 30)
    moved = lie.act(g, p)
    here = ss.CubicSpline(t, p, space, bc_type=ends)
    there = ss.CubicSpline(t, moved, space, bc_type=ends)
    allowed = 200 * EPS * condition(space, [*p, *moved]) * np.linalg.cond(g).max() ** 2
    assert apart(space, there(x), lie.act(g, here(x))) <= allowed


@one_per_family
def test_act_and_symmetry_broadcast(case, rng):
    space, lie = case.space, Lie(case.space)
    p = walk(space, 0.3, 3, rng)
    elements = np.array([lie.element(rng) for _ in range(2)])
    # Axes: those of the pair, if there is one, then the batch.
    batch = np.moveaxis(elements, 0, -3)[..., None, :, :]
    images = lie.act(batch, p)
    assert images.shape == (2, 3, *space.point_shape)
    for i, j in np.ndindex(2, 3):
        assert np.array_equal(images[i, j], lie.act(elements[i], p[j]))
    table = space.symmetry(p[:, None], p)
    assert table.shape == (3, 3, *space.point_shape)
    assert np.abs(table[0, 2] - space.symmetry(p[0], p[2])).max() <= 10 * EPS * condition(space, p)
    assert lie.act(elements[0], p[:0]).shape == (0, *space.point_shape)


def test_products_act_by_factors(rng):
    space = ss.space("sphere:2 x so:3 x r:2")
    g = tuple(Lie(f).given(Lie(f).element(rng)) for f in space.factors)
    p, x = (space.random_point(rng, 4) for _ in range(2))
    moved, mirrored = space.act(g, x), space.symmetry(p, x)
    for i, factor in enumerate(space.factors):
        assert np.array_equal(moved[i], factor.act(g[i], x[i]))
        assert np.array_equal(mirrored[i], factor.symmetry(p[i], x[i]))
    assert np.allclose(space.distance(space.act(g, p), moved), space.distance(p, x), atol=1e-14)


def test_single_precision_elements_have_its_tolerance():
    g = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]], np.float32)
    assert ss.Sphere(1).act(g, [1.0, 0.0]) == pytest.approx([np.cos(0.3), np.sin(0.3)], abs=1e-7)
    raises(r"\|gᵀg − 1\| is", ss.Sphere(1).act, (1 + 1e-6 / 3) * g.astype(float), [1.0, 0.0])


TURN = np.eye(3)
INVALID = [
    ("sphere:2", 1.1 * TURN, r"^g is not in the group of Sphere\(2\): \|gᵀg − 1\| is 2.100e-01 .*qr\(g\)"),
    ("sphere:2", [TURN, 2 * TURN], r"^g\[1\] is not in the group"),
    ("sphere:2", np.eye(2), r"^g has shape \(2, 2\), .* Pass an array of shape \(\.\.\., 3, 3\)"),
    ("sphere:2", np.full((3, 3), np.nan), r"^g has entries that are not finite\. Pass"),
    ("sphere:2", 1e200 * TURN, "is not in the group|is not finite"),
    ("spd:2", 1e200 * np.eye(2), "act of row .* is not finite"),
    ("sphere:2", [TURN] * 3, "do not broadcast"),
    ("rp:2", 1j * TURN, "needs real numbers"),
    ("cp:2", 2j * TURN, r"\|g\*g − 1\| is 3"),
    ("h:2", 1.1 * TURN, r"\|gᵀJg − J\| .* J = diag\(−1, 1, …, 1\)"),
    ("h:2", -TURN, r"−g\[0, 0\] is .* Pass −g"),
    ("ch:2", np.diag([1, 1, 2]), r"\|g\*Jg − J\|"),
    ("hp:1", np.diag([1j, 1j, 1, 1]), r"\|gJ − Jḡ\| is .* blocks"),
    ("r:2", 2 * TURN, r"last row .* Pass \[\[A, b\], \[0, 1\]\]"),
    ("r:2", np.diag([2.0, 1, 1]), r"\|AᵀA − 1\| of its linear part"),
    ("so:3", TURN, r"must be a pair \(a, b\) .* Pass \(g, numpy.eye\(3\)\)"),
    ("so:3", (TURN, 2 * TURN), r"^g\[1\] is not an element of the group of SpecialOrthogonal\(3\)"),
    ("so:3", (-TURN, TURN), r"^g\[0\] is not an element"),
    ("se:2", (TURN, 1.1 * TURN), r"^g\[1\] is not an element"),
    ("spd:2", np.diag([1.0, 0.0]), "condition number is inf .* Pass an invertible matrix"),
    ("sspd:2", 2 * np.eye(2), r"\|det g\| − 1 is 3"),
    ("siegel:1", 2 * np.eye(2), r"\|gᵀJg − J\| .* symplectic"),
    ("st:2,3", TURN, "not known to be symmetric: it has no group"),
    ("r:1 x r:1", np.eye(2), "one per factor"),
]


@pytest.mark.parametrize(("name", "g", "message"), INVALID)
def test_invalid_elements_raise(name, g, message, rng):
    space = ss.space(name)
    x = space.random_point(rng, 2) if isinstance(g, list) else space.random_point(rng)
    with np.errstate(all="raise"), pytest.raises(ss.ValidationError, match=message):
        space.act(g, x)


def test_invalid_points_of_a_symmetry_raise():
    for space, p, x, match in [
        (ss.Sphere(2), [1, 0, 0], [1, 0], r"x has shape \(2,\)"),
        (ss.Sphere(2), np.eye(3), np.eye(3)[:2], "do not broadcast"),
        (ss.SymmetricPositiveDefinite(2), np.eye(2), -np.eye(2), "symmetry failed: a matrix is not a point"),
        (ss.Stiefel(1, 3), np.eye(3, 1), np.eye(3, 1), "it has no geodesic symmetries"),
    ]:
        raises(match, space.symmetry, p, x)
