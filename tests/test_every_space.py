"""The public interface over all spaces: real and complex points, vectors, matrices, and products of them."""

import copy
import io
import math
import pickle
from itertools import pairwise

import numpy as np
import pytest
from cases import CASES, QUOTIENTS, apart
from curves import EPS, at_node, each, largest_difference, parts, points_on, same, same_curve, tangents_at

import symspline as ss
from symspline._core import Handle

NAMES = [
    "euclidean:3",
    "sphere:2",
    "hyperbolic:2",
    "rp:2",
    "rp:7",
    "cp:1",
    "cp:7",
    "ch:2",
    "gr:1,3",
    "gr:2,5",
    "cgr:1,2",
    "cgr:2,4",
    "so:2",
    "so:3",
    "so:5",
    "o:2",
    "o:3",
    "u:1",
    "u:2",
    "su:2",
    "su:3",
    "spd:2",
    "spd:8",
    "hpd:1",
    "hpd:2",
    "se:2",
    "se:3",
]
PRODUCTS = ["u:2 x r:3", "cp:1 x so:3", "gr:2,5 x hpd:2 x se:3"]
SINGLE = [ss.space(name) for name in NAMES]
SPACES = SINGLE + [ss.space(name) for name in PRODUCTS]
COMPLEX = [space for space in SINGLE if space.dtype == np.complex128]
every_space = pytest.mark.parametrize("space", SPACES, ids=str)
every_single = pytest.mark.parametrize("space", SINGLE, ids=str)
every_complex = pytest.mark.parametrize("space", COMPLEX, ids=str)
every_batch = pytest.mark.parametrize("batch", [(), (2, 3)], ids=str)

KNOTS = np.array([0.0, 1.0, 1.5, 3.0, 4.0])
N = len(KNOTS)


def points(space, batch=(), n=N, step=0.5):
    return points_on(space, n, batch, step)


def factors(space):
    return space.factors if isinstance(space, ss.Product) else (space,)


def shaped(space, lead):
    """Shapes and types of points or vectors with some leading axes."""
    return [((*lead, *f.point_shape), f.dtype) for f in factors(space)]


def found(value):
    return [(np.shape(part), part.dtype) for part in parts(value)]


def off(space, x, y):
    """How far points are apart, whatever their arrays."""
    return max(
        float(np.max(apart(f, a, b))) for f, a, b in zip(factors(space), parts(x), parts(y), strict=True)
    )


def vectors_off(space, x, u, y, v):
    """How far vectors are apart at points that may have other arrays."""
    return max(
        float(np.abs((f.transport(a, b, p) if isinstance(f, QUOTIENTS) else p) - q).max())
        for f, a, p, b, q in zip(factors(space), *map(parts, (x, u, y, v)), strict=True)
    )


def pick(value, index):
    return each(lambda array: array[index], value)


def with_ends(space, p):
    """End conditions with a vector at either end, for every curve its own."""
    return (
        (1, tangents_at(space, at_node(space, p, 0))),
        (2, tangents_at(space, at_node(space, p, -1), seed=6)),
    )


def test_every_family_is_here():
    assert {name.partition(":")[0] for name in NAMES} == {row[0] for row in Handle.names()}
    assert set(NAMES) <= {case.name for case in CASES}


# ---- fits ----


@every_space
@every_batch
@pytest.mark.parametrize("ends", ["not-a-knot", "vectors"])
def test_leading_axes_are_curves(space, batch, ends):
    p = points(space, batch)
    bc_type = with_ends(space, p) if ends == "vectors" else ends
    spline = ss.CubicSpline(KNOTS, p, space, bc_type=bc_type)
    assert found(spline.points) == found(spline.velocities) == shaped(space, (*batch, N))
    assert np.all(spline.report.converged)
    assert off(space, spline(KNOTS), p) < 100 * EPS
    for i in np.ndindex(*batch):
        own = bc_type if ends != "vectors" else tuple((order, pick(v, i)) for order, v in bc_type)
        alone = ss.CubicSpline(KNOTS, pick(p, i), space, bc_type=own)
        assert same(pick(spline.velocities, i), alone.velocities)


@every_space
def test_end_vectors_are_kept(space):
    p = points(space)
    bc_type = with_ends(space, p)
    spline = ss.CubicSpline(KNOTS, p, space, bc_type=bc_type)
    p0, p1 = (at_node(space, spline.points, e) for e in (0, -1))
    velocity, acceleration = spline(KNOTS[0], nu=1), spline(KNOTS[-1], nu=2)
    assert vectors_off(space, spline(KNOTS[0]), velocity, p0, bc_type[0][1]) < 1e-13
    assert vectors_off(space, spline(KNOTS[-1]), acceleration, p1, bc_type[1][1]) < 1e-11


@every_space
def test_a_closed_curve(space):
    p = points(space)
    p = each(lambda a, b: np.concatenate([a, b]), p, pick(p, slice(-2, None, -1)))
    spline = ss.CubicSpline(None, p, space, bc_type="periodic")
    x, y = spline(0.0), spline(2.0 * N - 2)
    assert off(space, x, y) < 100 * EPS
    for nu in (1, 2):
        assert vectors_off(space, x, spline(0.0, nu), y, spline(2.0 * N - 2, nu)) < 1e-11


@every_space
@every_batch
def test_fit_and_evaluate_are_the_class(space, batch):
    p = points(space, batch)
    options = {"bc_type": ("not-a-knot", with_ends(space, p)[1]), "tol": 1e-10}
    spline = ss.CubicSpline(KNOTS, p, space, **options)
    u, report = ss.fit(KNOTS, p, str(space), **options)
    assert same(u, spline.velocities) and report == spline.report
    x = np.linspace(-0.5, 4.5, 7)
    for nu in range(3):
        values = ss.evaluate(x, KNOTS, spline.points, u, space, nu, extrapolate="geodesic")
        assert same(values, spline(x, nu, extrapolate="geodesic"))


@every_space
def test_fit_many_is_one_at_a_time(space):
    curves = []
    for i, n in enumerate([5, 2, 9, 3]):
        t = None if i % 2 else np.cumsum(np.random.default_rng(i).uniform(0.5, 1.5, n))
        curves.append((t, points_on(space, n, step=0.4, seed=i)))
    starts = each(lambda *rows: np.stack(rows), *(at_node(space, p, 0) for _, p in curves))
    v = tangents_at(space, starts)
    fitted = ss.fit_many(curves, str(space), bc_type=((1, v), "natural"))
    for i, (t, p) in enumerate(curves):
        alone = ss.CubicSpline(t, p, space, bc_type=((1, pick(v, i)), "natural"))
        assert same_curve(fitted[i], alone)
        assert same(fitted[i].bc_type[0][1], alone.bc_type[0][1])


# ---- evaluation ----


@every_space
@every_batch
def test_what_evaluation_returns(space, batch):
    spline = ss.CubicSpline(KNOTS, points(space, batch), space)
    for x in (0.7, np.float32(0.7), np.array(2), np.zeros(0), [0.5, 4.0], np.ones((2, 1, 3)), [[1, 2]]):
        lead = (*batch, *np.shape(x))
        for nu in range(3):
            assert found(spline(x, nu=nu)) == shaped(space, lead)
        assert np.shape(spline.speed(x)) == lead and spline.speed(x).dtype == np.float64
    x = np.linspace(0, 4, math.prod(batch) * 2).reshape(*batch, 2)
    for nu in range(3):
        own = spline(x, nu, per_curve=True)
        assert found(own) == shaped(space, x.shape)
        for i in np.ndindex(*batch):
            assert same(pick(own, i), pick(spline(x[i], nu), i))


@every_space
def test_velocity_and_speed(space):
    spline = ss.CubicSpline(KNOTS, points(space, (2,)), space)
    x = np.linspace(0, 4, 9)
    y, v = spline(x), spline(x, nu=1)
    space.check_point(y)
    space.check_tangent(y, v)
    space.check_tangent(y, spline(x, nu=2))
    assert np.allclose(spline.speed(x), space.norm(y, v), rtol=1e-12, atol=0)


@every_space
def test_length_and_energy_of_a_geodesic(space):
    p = points(space, n=2)
    ends = at_node(space, p, 0), at_node(space, p, 1)
    spline = ss.CubicSpline(KNOTS, space.geodesic(*ends, KNOTS / 4), space, bc_type="not-a-knot")
    distance = space.distance(*ends)
    assert isinstance(spline.length(), float)
    assert spline.length() == pytest.approx(distance, rel=1e-12)
    assert spline.speed(np.linspace(0, 4, 9)) == pytest.approx(distance / 4, rel=1e-11)
    assert spline.bending_energy() < 1e-20


@every_space
@every_batch
def test_length_and_energy_by_quadrature(space, batch):
    spline = ss.CubicSpline(KNOTS, points(space, batch), space)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    length = energy = 0.0
    for a, b in pairwise(KNOTS):
        x = (a + b) / 2 + (b - a) / 2 * nodes
        length = length + spline.speed(x) @ weights * (b - a) / 2
        energy = energy + space.norm(spline(x), spline(x, 2)) ** 2 @ weights * (b - a) / 2
    assert np.shape(spline.length()) == np.shape(spline.bending_energy()) == batch
    assert np.allclose(spline.length(), length, rtol=1e-6)
    assert np.allclose(spline.bending_energy(), energy, rtol=1e-6)


# ---- outside ----


@every_space
def test_none_raises_outside(space):
    spline = ss.CubicSpline(KNOTS, points(space), space)
    for x in (-0.5, 4.25):
        with pytest.raises(ss.ValidationError, match="outside the knots"):
            spline(x)


@every_space
def test_true_continues_the_last_segment(space):
    spline = ss.CubicSpline(KNOTS, points(space), space, extrapolate=True)
    for segment, x, tau in ((0, -0.25, -0.25), (-1, 4.25, 1.25)):
        control = pick(spline.control_points, segment)
        control = [pick(control, k) for k in range(4)]
        while len(control) > 1:
            control = [space.geodesic(p, q, tau) for p, q in pairwise(control)]
        assert off(space, spline(x), control[0]) < 1e-12


@every_space
def test_geodesic_keeps_the_velocity(space):
    spline = ss.CubicSpline(KNOTS, points(space), space, bc_type="not-a-knot", extrapolate="geodesic")
    for x, e in ((-0.5, 0), (4.25, -1)):
        p, u = at_node(space, spline.points, e), at_node(space, spline.velocities, e)
        h = x - KNOTS[e]
        reached = space.exp(p, each(lambda v, h=h: h * v, u))
        carried = space.transport(p, reached, u)
        assert off(space, spline(x), reached) < 100 * EPS
        assert vectors_off(space, spline(x), spline(x, nu=1), reached, carried) < 1e-13
        assert largest_difference(spline(x, nu=2), each(np.zeros_like, u)) < 1e-12


@every_space
def test_periodic_wraps(space):
    spline = ss.CubicSpline(KNOTS, points(space), space, extrapolate="periodic")
    x = np.array([0.25, 1.75, 3.5])
    for nu in range(3):
        assert same(spline(x + 8.0, nu), spline(x, nu)) and same(spline(x - 4.0, nu), spline(x, nu))


# ---- what goes in ----


@every_space
@pytest.mark.parametrize("layout", ["lists", "Fortran", "strided", "big-endian", "read-only"])
def test_any_layout(space, layout):
    def laid(array):
        if layout == "lists":
            return array.tolist()
        if layout == "Fortran":
            return np.asfortranarray(array)
        if layout == "big-endian":
            return array.astype(array.dtype.newbyteorder(">"))
        if layout == "read-only":
            array = array.copy()
            array.flags.writeable = False
            return array
        wide = np.full((*array.shape, 2), 7, array.dtype)
        wide[..., 0] = array
        return wide[..., 0]

    p = points(space, (2,))
    assert same_curve(ss.CubicSpline(KNOTS, each(laid, p), space), ss.CubicSpline(KNOTS, p, space))


@every_space
def test_single_precision(space):
    p = points(space)
    single = each(lambda a: a.astype(np.complex64 if a.dtype.kind == "c" else np.float32), p)
    space.check_point(single)
    spline = ss.CubicSpline(KNOTS, single, space)
    assert found(spline.points) == found(spline.velocities) == shaped(space, (N,))
    assert found(spline(0.5)) == shaped(space, ())
    assert off(space, spline.points, p) < 1e-5
    space.check_point(spline.points)


def origin(space):
    """A point of whole numbers."""
    shape = space.point_shape
    return np.eye(*shape, dtype=int) if len(shape) == 2 else np.eye(1, *shape, dtype=int)[0]


@every_single
@pytest.mark.parametrize("dtype", ["i8", "i1", "f2", "f4", "f8"])
def test_whole_numbers(space, dtype):
    p = np.stack([origin(space)] * 3).astype(dtype)
    spline = ss.CubicSpline(None, p, space)
    assert spline.points.dtype == spline.velocities.dtype == spline(0.5).dtype == space.dtype
    assert same(spline.points, p.astype(space.dtype))
    assert spline == ss.CubicSpline(None, p.astype(float), space)
    assert not spline.velocities.any()


REAL = {"cp": "rp", "cgr": "gr", "u": "so", "su": "so", "hpd": "spd"}


@pytest.mark.parametrize("name", ["cp:2", "cgr:2,5", "u:2", "u:3", "su:2", "su:5", "hpd:2", "hpd:5"])
def test_real_points_of_a_complex_space(name):
    """They run in the real space inside it."""
    space = ss.space(name)
    family, _, size = name.partition(":")
    inside = ss.space(f"{REAL[family]}:{size}")
    p = points(inside)
    v = tangents_at(inside, p[0])
    spline = ss.CubicSpline(KNOTS, p, space, bc_type=((1, v), "natural"))
    assert same_curve(spline, ss.CubicSpline(KNOTS, p + 0j, space, bc_type=((1, v + 0j), "natural")))
    real = ss.CubicSpline(KNOTS, p, inside, bc_type=((1, v), "natural"))
    x = np.linspace(0, 4, 9)
    assert spline(x).dtype == np.complex128
    assert off(space, spline(x), real(x) + 0j) < 1e-12
    assert space.exp(p, 0 * p).dtype == space.log(p[0], p[1]).dtype == np.complex128


@every_space
def test_input_is_never_changed(space):
    # Slightly off the space, so that there is something to change.
    p = each(lambda a: a + 1e-10 * np.ones_like(a), points(space))
    q = at_node(space, p, 0)
    v, t, x = tangents_at(space, q), KNOTS.copy(), np.array([3.0, 0.1])
    arrays = [t, x, *parts(p), *parts(v)]
    copies = [a.copy() for a in arrays]
    spline = ss.CubicSpline(t, p, space, bc_type=((1, v), "not-a-knot"))
    spline(x), spline(x, nu=2), spline.speed(x), spline.length(), spline.control_points
    ss.evaluate(x, t, p, spline.velocities, space)
    ss.fit_many([(t, p)], space)
    space.check_point(p), space.project(p), space.project_tangent(q, v), space.exp(q, v), space.norm(q, v)
    space.distance(q, p), space.log(q, at_node(space, p, 1)), space.random_tangent(np.random.default_rng(), p)
    assert all(same(a, b) for a, b in zip(arrays, copies, strict=True))


@every_space
def test_a_spline_keeps_its_own_arrays(space):
    p, t = points(space), KNOTS.copy()
    v = tangents_at(space, at_node(space, p, 0))
    spline = ss.CubicSpline(t, p, space, bc_type=((1, v), "natural"))
    before = pickle.loads(pickle.dumps(spline))
    for array in (t, *parts(p), *parts(v)):
        array[...] = 7
    assert same_curve(spline, before) and same(spline.bc_type[0][1], before.bc_type[0][1])
    for array in (spline.t, *parts(spline.points), *parts(spline.velocities), *parts(spline.bc_type[0][1])):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


# ---- splines as values ----


def saved_and_loaded(spline):
    file = io.BytesIO()
    spline.save(file)
    file.seek(0)
    return ss.load(file)


COPIES = {
    "file": saved_and_loaded,
    "pickle": lambda spline: pickle.loads(pickle.dumps(spline)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}


@every_space
@every_batch
@pytest.mark.parametrize("how", COPIES)
def test_copies_are_the_same_to_the_last_bit(space, batch, how):
    p = points(space, batch)
    spline = ss.CubicSpline(KNOTS, p, space, bc_type=with_ends(space, p), extrapolate="geodesic")
    made = COPIES[how](spline)
    assert type(made) is type(spline) and same_curve(made, spline)
    assert made.space == space and made.extrapolate == "geodesic" and repr(made) == repr(spline)
    for ours, theirs in zip(spline.bc_type, made.bc_type, strict=True):
        assert ours[0] == theirs[0] and type(ours[1]) is type(theirs[1])
        assert same(ours[1], theirs[1]) and found(ours[1]) == found(theirs[1])
    x = [-1.0, 0.3, 4.0, 9.0]
    for nu in range(3):
        assert same(made(x, nu), spline(x, nu))
    # End conditions that were read back say the same again.
    again = ss.CubicSpline(KNOTS, p, space, bc_type=made.bc_type, extrapolate="geodesic")
    assert same_curve(again, spline)


@every_space
def test_many_curves_in_one_file(space):
    curves = {str(n): ss.CubicSpline(None, points(space, n=n), space) for n in (2, 5, 3)}
    file = io.BytesIO()
    ss.save_many(curves, file)
    file.seek(0)
    read = ss.load_many(file)
    assert list(read) == list(curves)
    assert all(same_curve(read[name], curves[name]) for name in curves)


@every_space
def test_a_batch_is_a_sequence(space):
    p = points(space, (3, 2))
    bc_type = with_ends(space, p)
    spline = ss.CubicSpline(KNOTS, p, space, bc_type=bc_type)
    assert len(spline) == 3 and [len(one) for one in spline] == [2] * 3
    for index in (0, -1, slice(1, None), slice(None, None, -2)):
        own = tuple((order, pick(v, index)) for order, v in bc_type)
        one = ss.CubicSpline(KNOTS, pick(p, index), space, bc_type=own)
        assert same_curve(spline[index], one)
        assert all(same(a[1], b[1]) for a, b in zip(spline[index].bc_type, one.bc_type, strict=True))
    assert same_curve(
        spline[2][1], ss.CubicSpline(KNOTS, pick(p, (2, 1)), space, bc_type=spline[2][1].bc_type)
    )


@every_space
def test_curves_compare(space):
    p = points(space)
    spline = ss.CubicSpline(KNOTS, p, space)
    assert spline == ss.CubicSpline(KNOTS, p, str(space))
    assert spline != ss.CubicSpline(None, p, space)
    assert spline != ss.CubicSpline(KNOTS, p, space, bc_type="clamped")
    assert spline != ss.CubicSpline(KNOTS, pick(p, slice(None, None, -1)), space)
    assert spline != ss.CubicSpline(KNOTS, points(ss.Sphere(5)), "sphere:5")


@every_space
@every_batch
def test_curves_print(space, batch):
    spline = ss.CubicSpline(KNOTS, points(space, batch), space)
    assert repr(space) in repr(spline) and "5 points, natural" in repr(spline)
    assert "\n" not in repr(spline) + str(spline.report) and "converged" in str(spline.report)


# ---- spaces ----


@pytest.mark.parametrize("aliases", Handle.names(), ids=lambda aliases: aliases[0])
def test_names(aliases):
    short = aliases[0]
    sizes = [name.partition(":")[2] for name in NAMES if name.partition(":")[0] == short]
    for size in sizes:
        space = ss.space(f"{short}:{size}")
        assert str(space) == f"{short}:{size}"
        assert repr(space) == f"{type(space).__name__}({size.replace(',', ', ')})"
        for alias in aliases:
            for name in (f"{alias}:{size}", f" {alias.upper()} : {size.replace(',', ' , ')} "):
                assert ss.space(name) == space and hash(ss.space(name)) == hash(space)


@every_space
def test_spaces_as_values(space):
    assert ss.space(str(space)) == space and ss.space(space) is space
    assert eval(repr(space), vars(ss)) == space
    for made in (pickle.loads(pickle.dumps(space)), copy.copy(space), copy.deepcopy(space)):
        assert made == space and hash(made) == hash(space) and made.dim == space.dim
        assert type(made) is type(space)
    assert [other for other in SPACES if other == space] == [space]


DIMENSIONS = {
    "euclidean": lambda n: n,
    "sphere": lambda n: n,
    "hyperbolic": lambda n: n,
    "rp": lambda n: n,
    "cp": lambda n: 2 * n,
    "ch": lambda n: 2 * n,
    "gr": lambda k, n: k * (n - k),
    "cgr": lambda k, n: 2 * k * (n - k),
    "so": lambda n: n * (n - 1) // 2,
    "o": lambda n: n * (n - 1) // 2,
    "u": lambda n: n * n,
    "su": lambda n: n * n - 1,
    "spd": lambda n: n * (n + 1) // 2,
    "hpd": lambda n: n * n,
    "se": lambda n: n * (n + 1) // 2,
}
COMPLEX_FAMILIES = {"cp", "ch", "cgr", "u", "su", "hpd"}


@pytest.mark.parametrize("name", NAMES)
def test_what_a_space_says_of_itself(name):
    space = ss.space(name)
    family, _, size = name.partition(":")
    assert space.dim == DIMENSIONS[family](*map(int, size.split(",")))
    assert space.dtype == (np.complex128 if family in COMPLEX_FAMILIES else np.float64)
    assert space.injectivity_radius > 0
    # Poses have no invariant metric, and so no K.
    assert np.isnan(space.curvature) if family == "se" else space.curvature >= 0
    assert points(space).shape[1:] == space.point_shape


def test_what_a_product_says_of_itself():
    space = ss.space("u:2 x cp:1 x r:3")
    assert space.dim == 4 + 2 + 3 and space.point_shape == ((2, 2), (2,), (3,))
    assert space.curvature == 2.0 and space.injectivity_radius == ss.ComplexProjective(1).injectivity_radius
    assert all(np.isnan(ss.space(name).curvature) for name in ("se:3 x s:2", "s:2 x se:3"))


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


@every_space
@pytest.mark.parametrize("name", OPERATIONS)
def test_operations_broadcast(space, name):
    near = points(space, n=7, step=0.1)
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
    empty = operation(space, *(pick(x, slice(0, 0)) for x in (p, wide, u, v)))
    assert found(empty)[0][0][0] == 0


@every_space
def test_geodesics_broadcast_their_times(space):
    near = points(space, n=3)
    p, q = (at_node(space, near, i) for i in (0, 1))
    t = np.linspace(0, 1, 5)
    curve = space.geodesic(p, q, t)
    assert found(curve) == shaped(space, (5,))
    assert np.allclose(space.distance(p, curve), t * space.distance(p, q), rtol=1e-12, atol=1e-14)
    grid = space.geodesic(each(lambda a: a[:, None], near), q, t)
    assert found(grid) == shaped(space, (3, 5))


@every_space
def test_operations_fit_together(space):
    near = points(space)
    p, q = pick(near, slice(None, -1)), pick(near, slice(1, None))
    v = space.log(p, q)
    assert off(space, space.exp(p, v), q) < 100 * EPS
    assert np.allclose(space.norm(p, v), space.distance(p, q), rtol=1e-12)
    assert np.allclose(space.inner(p, v, v), space.norm(p, v) ** 2, rtol=1e-13)
    assert off(space, space.transvection(p, v, p), q) < 100 * EPS
    assert largest_difference(space.transport(p, q, v), each(np.negative, space.log(q, p))) < 200 * EPS


@every_space
@pytest.mark.parametrize("shape", [(), 3, np.int64(3), (2, 3), 0], ids=str)
def test_random_points_and_tangents(space, shape):
    rng = np.random.default_rng(0)
    lead = tuple(shape) if isinstance(shape, tuple) else (int(shape),)
    p = space.random_point(rng, shape)
    v = space.random_tangent(rng, p)
    assert found(p) == found(v) == shaped(space, lead)
    space.check_point(p)
    space.check_tangent(p, v)
    again = np.random.default_rng(0)
    assert same(space.random_point(again, shape), p) and same(space.random_tangent(again, p), v)


@every_space
def test_random_tangents_are_standard_normal(space):
    rng = np.random.default_rng(1)
    p = at_node(space, points(space), 2)
    v = space.random_tangent(rng, each(lambda a: np.broadcast_to(a, (4000, *a.shape)), p))
    u = each(lambda a: a[0], v)
    # |v|² has mean d and variance 2d, ⟨u, v⟩/|u| has mean 0 and variance 1.
    d = space.dim
    assert abs(np.mean(space.norm(p, v) ** 2) - d) < 5 * np.sqrt(2 * d / 4000)
    rest = pick(v, slice(1, None))
    shadow = space.inner(p, rest, u) / space.norm(p, u)
    assert abs(np.mean(shadow)) < 5 / np.sqrt(4000) and abs(np.var(shadow) - 1) < 5 * np.sqrt(2 / 4000)


@every_space
def test_project_and_check(space):
    p = points(space, (2,))
    rng = np.random.default_rng(3)
    nearby = each(lambda a: a + 1e-6 * rng.standard_normal(a.shape), p)
    projected = space.project(nearby)
    space.check_point(projected)
    assert off(space, projected, p) < 1e-4
    assert off(space, space.project(projected), projected) < 20 * EPS
    noise = each(
        lambda a: (
            rng.standard_normal(a.shape) + (1j * rng.standard_normal(a.shape) if a.dtype.kind == "c" else 0)
        ),
        p,
    )
    v = space.project_tangent(p, noise)
    space.check_tangent(p, v)
    assert largest_difference(space.project_tangent(p, v), v) < 400 * EPS
    w = space.random_tangent(rng, p)
    assert largest_difference(space.project_tangent(p, w), w) < 400 * EPS


@every_space
def test_checks_name_the_place(space):
    p = points(space, (2,))
    bad = each(np.copy, p)
    parts(bad)[0][1, 3] = np.nan
    with pytest.raises(ss.ValidationError, match=r"point 1,3 .*project"):
        space.check_point(bad)
    if isinstance(space, ss.Euclidean):
        return
    v = each(np.zeros_like, p)
    first = factors(space)[0]
    # A multiple of the point itself, and of i times it, is tangent to few spaces.
    parts(v)[0][1, 3] = parts(p)[0][1, 3]
    if isinstance(first, (ss.SymmetricPositiveDefinite, ss.HermitianPositiveDefinite)):
        parts(v)[0][1, 3, 0, -1] += 7 if first.point_shape[0] > 1 else 7j
    with pytest.raises(ss.ValidationError, match=r"vector 1,3 is not tangent .*project_tangent"):
        space.check_tangent(p, v)
