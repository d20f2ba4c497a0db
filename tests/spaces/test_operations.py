"""Operations of spaces on arrays: shapes, types, and invalid operands."""

import numpy as np
import pytest
from cases import COMMON, EPS, INDEFINITE, SPACES, loop_over
from compare import each, factors, found, largest_difference, off, parts, pick, same, shaped
from curves import S2, at_node, every_kind, every_space, points_on, tangents_at
from refused import NAN, REFLECTION, P, raises

import symspline as ss

OPERATIONS = {
    "exp": lambda s, p, q, u, v: s.exp(p, u),
    "log": lambda s, p, q, u, v: s.log(p, q),
    "geodesic": lambda s, p, q, u, v: s.geodesic(p, q, 0.3),
    "distance": lambda s, p, q, u, v: s.distance(p, q),
    "transvection": lambda s, p, q, u, v: s.transvection(p, u, q),
    "transport": lambda s, p, q, u, v: s.transport(p, q, u),
    "inner": lambda s, p, q, u, v: s.inner(p, u, v),
    "norm": lambda s, p, q, u, v: s.norm(p, u),
    "project": lambda s, p, q, u, v: s.project(p),
    "project_tangent": lambda s, p, q, u, v: s.project_tangent(p, u),
}


# The leading axes of the result for p of (3, 1), q of (4,), u and v of (3, 4).
LEADING = {"project": (3, 1)}


@every_kind
@loop_over("name", OPERATIONS)
def test_operations_broadcast(space, name):
    near = points_on(space, 7, step=0.1)
    p, q = each(lambda a: a[:3, None], near), pick(near, slice(3, None))
    wide = each(lambda a: np.repeat(a, 4, axis=1), p)
    u, v = tangents_at(space, wide, 0.2), tangents_at(space, wide, 0.2, seed=9)
    operation, lead = OPERATIONS[name], LEADING.get(name, (3, 4))
    result = operation(space, p, q, u, v)
    number = name in ("distance", "inner", "norm")
    assert found(result) == ([(lead, np.float64)] if number else shaped(space, lead))
    for i, j in np.ndindex(*lead):
        one = [pick(x, k) for x, k in zip((p, q, u, v), ((i, 0), j, (i, j), (i, j)), strict=True)]
        assert same(pick(result, (i, j)), operation(space, *one))
    if number:
        assert isinstance(operation(space, *(pick(x, (0, 0)) for x in (p, wide, u, v))), float)
    none = operation(space, *[each(lambda a: a[:0], near)] * 4)
    assert found(none) == ([((0,), np.float64)] if number else shaped(space, (0,)))


@every_kind
def test_geodesics_broadcast_their_times(space):
    near = points_on(space, 5, step=0.5)
    p, q = (at_node(space, near, i) for i in (0, 1))
    t = np.linspace(0, 1, 7)
    curve = space.geodesic(p, q, t)
    assert found(curve) == shaped(space, (7,))
    assert off(space, at_node(space, curve, 0), p) < 4 * EPS
    assert off(space, at_node(space, curve, -1), q) < 8 * EPS
    assert np.allclose(space.distance(p, curve), t * space.distance(p, q), rtol=1e-13, atol=1e-15)
    grid = space.geodesic(each(lambda a: a[:, None], near), q, t)
    assert found(grid) == shaped(space, (5, 7))


@every_space
@loop_over("shape", [(), 3, (3,), np.int64(3), (2, 3), 0])
def test_random_points_and_tangents(space, shape):
    rng = np.random.default_rng(0)
    lead = tuple(shape) if isinstance(shape, tuple) else (int(shape),)
    p = space.random_point(rng, shape)
    v = space.random_tangent(rng, p)
    assert found(p) == found(v) == shaped(space, lead) and found(space.random_point(rng)) == shaped(space, ())
    space.check_point(p)
    space.check_tangent(p, v)
    again = np.random.default_rng(0)
    assert same(space.random_point(again, shape), p) and same(space.random_tangent(again, p), v)


# Large spaces draw their vectors without a frame.
LARGE = [ss.space(name) for name in ("sphere:299", "hyperbolic:300", "rp:299", "cp:299", "gr:3,300", "cgr:2,300")]


@pytest.mark.parametrize("space", [*SPACES, *LARGE], ids=str)
def test_random_tangents_are_standard_normal(space):
    # Other numbers than those of the points.
    rng, count = np.random.default_rng(7), 500 if space in LARGE else 4000
    p = at_node(space, points_on(space, 5, step=0.5), 2)
    v = space.random_tangent(rng, each(lambda a: np.broadcast_to(a, (count, *a.shape)), p))
    space.check_tangent(p, v)
    u = each(lambda a: a[0], v)
    # |v|² has mean d and variance 2d, ⟨u, v⟩/|u| has mean 0 and variance 1.
    d = space.dim
    if isinstance(space, INDEFINITE):
        # In coordinates of the frame, which is orthonormal for the indefinite metric only.
        x = np.linalg.lstsq(space.frame(p).reshape(d, -1).T, v.reshape(count, -1).T)[0]
        assert abs(np.mean(x**2) - 1) < 5 * np.sqrt(2 / count / d)
        assert np.abs(np.cov(x) - np.eye(d)).max() < 5 * np.sqrt(2 / count)
        return
    assert abs(np.mean(space.norm(p, v) ** 2) - d) < 5 * np.sqrt(2 * d / count)
    rest = pick(v, slice(1, None))
    shadow = space.inner(p, rest, u) / space.norm(p, u)
    assert abs(np.mean(shadow)) < 5 / np.sqrt(count) and abs(np.var(shadow) - 1) < 5 * np.sqrt(2 / count)


@every_space
def test_project_and_check(space):
    p = points_on(space, 5, (2,), 0.5)
    rng = np.random.default_rng(3)
    nearby = each(lambda a: a + 1e-6 * rng.standard_normal(a.shape), p)
    projected = space.project(nearby)
    assert space.check_point(p) is None and space.check_point(projected) is None
    assert off(space, projected, p) < 1e-4
    assert off(space, space.project(projected), projected) < 20 * EPS
    noise = each(
        lambda a: rng.standard_normal(a.shape) + (1j * rng.standard_normal(a.shape) if a.dtype.kind == "c" else 0), p
    )
    v = space.project_tangent(p, noise)
    assert space.check_tangent(p, v) is None
    assert largest_difference(space.project_tangent(p, v), v) < 400 * EPS
    w = space.random_tangent(rng, p)
    assert largest_difference(space.project_tangent(p, w), w) < 400 * EPS


@every_space
def test_checks_name_the_index(space):
    p = points_on(space, 5, (2,), 0.5)
    bad = each(np.copy, p)
    parts(bad)[0][1, 3] = np.nan
    raises(r"point 1,3 .*correct it or remove it", space.check_point, bad)
    if isinstance(space, (ss.Euclidean, ss.Torus, ss.GeneralLinear, ss.ComplexGeneralLinear)):
        # Every array is tangent.
        return
    v = each(np.zeros_like, p)
    first = factors(space)[0]
    # A multiple of the point itself, and of i times it, is tangent to few spaces.
    parts(v)[0][1, 3] = parts(p)[0][1, 3]
    if isinstance(first, (ss.SymmetricPositiveDefinite, ss.LogEuclidean, ss.HermitianPositiveDefinite)):
        parts(v)[0][1, 3, 0, -1] += 7 if first.point_shape[0] > 1 else 7j
    raises(r"vector 1,3 is not tangent .*project_tangent", space.check_tangent, p, v)


def test_invalid_operands_raise():
    for call, match in [
        (lambda: S2.exp([1, 0], [0, 1]), r"p has shape \(2,\), but Sphere\(2\) needs shape \(\.\.\., 3\)"),
        (lambda: S2.exp(P, np.zeros((4, 3))), r"the leading axes do not broadcast: p \(3, 3\), v \(4, 3\)"),
        (lambda: S2.geodesic(P[0], P, [0, 1]), r"the leading axes do not broadcast"),
        (lambda: S2.geodesic(P[0], P[1], "x"), "t must be real numbers, not <U1"),
        (lambda: S2.geodesic(P[0], P[1], 1j), "t must be real numbers, not complex128"),
        (lambda: S2.distance(P, P + 0j), r"q must be an array of real numbers, not of complex128"),
        (lambda: S2.project(np.zeros((2, 3))), r"x\[0\] cannot be projected: it is not finite, or no point of"),
        (lambda: S2.log(P[0], [NAN, 0, 0]), "pair 0 contains a number that is not finite"),
        (lambda: S2.project([1, NAN, 0]), r"x cannot be projected"),
        (lambda: ss.Hyperbolic(2).project([NAN, 0, 0]), "x cannot be projected"),
        (lambda: S2.check_point(2 * P), r"point 0 is off the space by 1\.000e0: its norm is 2"),
        (lambda: S2.check_tangent(P, P), r"vector 0 is not tangent .*normal component is 1\.000e\+00"),
        (lambda: S2.check_tangent(P, NAN * P), r"vector 0 is not tangent"),
        (lambda: S2.check_tangent(P[:2], np.zeros((3, 3))), r"p \(2, 3\) and v \(3, 3\) do not broadcast"),
        (lambda: S2.check_tangent(2 * P, P), r"point 0 is off the space"),
    ]:
        raises(match, call)


@pytest.mark.parametrize("operation", ["distance", "log", "geodesic", "transport"])
def test_no_geodesic_joins_a_rotation_and_a_reflection(operation):
    space = ss.Orthogonal(3)
    extra = {"geodesic": (0.5,), "transport": (np.zeros((3, 3)),)}.get(operation, ())
    call = getattr(space, operation)
    raises(r"pair 0 has opposite determinants: no curve joins", call, np.eye(3), REFLECTION, *extra)
    both = np.array([np.eye(3), REFLECTION])
    raises(r"pair 1 has opposite determinants", call, np.eye(3), both, *extra)
    raises(r"leading axes do not broadcast", call, both, np.array([np.eye(3)] * 3), *extra)
    # Half a turn is another matter.
    if operation != "distance":
        raises("pair 0", call, np.eye(3), np.diag([-1.0, -1, 1]), *extra, error=ss.CutLocusError)


@pytest.mark.parametrize("space", COMMON[:3], ids=str)
def test_operations_do_not_depend_on_the_number_of_threads(threads, space):
    p = np.tile(points_on(space, 100, step=0.3), (300, 1))
    q = np.roll(p, 1, axis=0)
    results = []
    for n in (1, 2):
        ss.set_num_threads(n)
        v = space.log(p, q)
        results.append((v, space.exp(p, v), space.distance(p, q)))
    assert all(map(same, *results))
