"""Isometric spaces, and spaces that lie totally geodesically in others, agree in geometry and whole splines."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from cases import EPS, QUOTIENTS, base_point, closed_walk, condition, loop_over, unit_tangent, walk

import symspline as ss

SEED = 1729


def adjoint(x):
    return np.swapaxes(x, -1, -2).conj()


def columns(space, x):
    return x[..., None] if len(space.point_shape) == 1 else x


def plain(space, x):
    """Points as arrays that do not depend on the representative."""
    if not isinstance(space, QUOTIENTS):
        return x
    y = columns(space, x)
    return y @ adjoint(y)


def plain_vector(space, x, v):
    """Tangent vectors as arrays that do not depend on the representative."""
    if not isinstance(space, QUOTIENTS):
        return v
    y, d = columns(space, x), columns(space, v)
    return d @ adjoint(y) + y @ adjoint(d)


@dataclass(frozen=True)
class Identity:
    """A map from a space to another that multiplies all lengths by a number.

    Attributes:
        source, target: names of the spaces.
        scale: length there, divided by length here; None where one of both has no metric.
        f: points to points.
        df: its derivative, of points p, vectors v, and points f(p).
    """

    source: str
    target: str
    scale: float | None
    f: Callable
    df: Callable


def linear(source, target, scale, f):
    return Identity(source, target, scale, f, lambda p, v, fp: f(v))


def quadratic(source, target, scale, f):
    """Of a homogeneous f of second degree the derivative is a difference, exactly."""
    return Identity(source, target, scale, f, lambda p, v, fp: (f(p + v) - f(p - v)) / 2)


def matrices(*rows):
    return np.stack([np.stack(np.broadcast_arrays(*row), axis=-1) for row in rows], axis=-2)


def bloch(psi):
    a, b = np.moveaxis(psi, -1, 0)
    c = 2 * a.conj() * b
    return np.stack([c.real, c.imag, np.abs(a) ** 2 - np.abs(b) ** 2], axis=-1)


def rotation(q):
    w, x, y, z = np.moveaxis(q, -1, 0)
    return matrices(
        (w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )


def quaternion_in_su2(q):
    w, x, y, z = np.moveaxis(q, -1, 0)
    return matrices((w + 1j * z, y + 1j * x), (-y + 1j * x, w - 1j * z))


def minkowski_in_hermitian(x):
    """The quadratic form of H² or H³ is the determinant."""
    t, a, b, *c = np.moveaxis(x, -1, 0)
    off = b + 1j * c[0] if c else b
    return matrices((t + a, off), (np.conj(off), t - a))


def turn_in_plane(x):
    c, s = np.moveaxis(x, -1, 0)
    return matrices((c, -s), (s, c))


def complement(y):
    return np.linalg.svd(y).U[..., y.shape[-1] :]


def pose(rotation=None, place=None):
    """Homogeneous matrices; without a part, that of the identity."""
    some = rotation if place is None else place
    n = some.shape[-1]
    g = np.zeros((*(some.shape[:-2] if place is None else some.shape[:-1]), n + 1, n + 1))
    g[..., :n, :n] = np.eye(n) if rotation is None else rotation
    g[..., n, n] = 1
    if place is not None:
        g[..., :n, n] = place
    return g


def posing(source, target, part):
    """R or t alone in a pose; the derivative has zeros elsewhere."""

    def df(p, v, fp):
        return pose(**{part: v}) - pose(**{part: np.zeros_like(v)})

    return Identity(source, target, 1.0, lambda p: pose(**{part: p}), df)


def reflection(signs, square=1):
    """The map from vectors or bases to the reflections 2P − 1, for a form with signs and the square of points in it."""

    def f(x):
        y = x[..., None] if x.shape[-1] == len(signs) else x
        return 2 * square * y @ adjoint(y) * np.array(signs) - np.eye(len(signs))

    return f


def part_of(source, target, scale=None):
    """Points of a subspace, which are points of the whole."""
    return linear(source, target, scale, lambda x: x)


def as_complex(source, target, scale=1.0):
    return linear(source, target, scale, lambda x: x.astype(complex))


def complementary(family, k, n):
    return Identity(
        f"{family}:{k},{n}",
        f"{family}:{n - k},{n}",
        1.0,
        complement,
        # The projector is 1 − P, its derivative −P'.
        lambda y, v, z: -y @ (adjoint(v) @ z),
    )


ROOT = np.sqrt(2)
IDENTITIES = [
    linear("gr:1,5", "rp:4", 1.0, lambda y: y[..., 0]),
    # The Bloch sphere has radius ½.
    quadratic("cp:1", "sphere:2", 2.0, bloch),
    # A rotation turns by twice the angle of its quaternion.
    quadratic("rp:3", "so:3", 2.0, rotation),
    linear("sphere:3", "su:2", ROOT, quaternion_in_su2),
    linear("u:1", "sphere:1", 1.0, lambda z: np.stack([z[..., 0, 0].real, z[..., 0, 0].imag], axis=-1)),
    linear("sphere:1", "so:2", 1.0, turn_in_plane),
    Identity("spd:1", "euclidean:1", 1.0, lambda p: np.log(p[..., 0]), lambda p, v, fp: v[..., 0] / p[..., 0]),
    linear("hyperbolic:2", "spd:2", ROOT, minkowski_in_hermitian),
    linear("hyperbolic:3", "hpd:2", ROOT, minkowski_in_hermitian),
    complementary("gr", 2, 5),
    complementary("cgr", 2, 5),
    as_complex("rp:3", "cp:3"),
    as_complex("spd:3", "hpd:3"),
    posing("euclidean:2", "se:2", "place"),
    posing("so:3", "se:3", "rotation"),
    # The line of z becomes the matrix J + 2zz* of U(1, 2).
    quadratic("ch:2", "hpd:3", 2 * ROOT, lambda z: np.diag([-1.0, 1, 1]) + 2 * z[..., None] * z[..., None, :].conj()),
    quadratic("gr:2,5", "o:5", 2.0, reflection([1.0] * 5)),
    part_of("sspd:3", "spd:3", 1.0),
    part_of("siegel:2", "spd:4", 1.0),
    part_of("hp:2", "cgr:2,6", 1.0),
    # Without a metric: a form that is not definite, and groups.
    linear("sphere:2", "ds:3", None, lambda x: np.insert(x, 0, 0.0, axis=-1)),
    linear("hyperbolic:2", "ads:3", None, lambda x: np.insert(x, 1, 0.0, axis=-1)),
    quadratic("ds:2", "igr:0,1,1,2", None, reflection([-1.0, 1, 1])),
    quadratic("ads:3", "igr:1,0,2,2", None, reflection([-1.0, -1, 1, 1], -1)),
    *(part_of(*pair) for pair in (("se:3", "gl:4"), ("se:2", "aff:2"), ("u:2", "cgl:2"), ("sim:3", "gl:4"))),
    part_of("lorentz:3", "gl:4"),
    Identity("gl:1", "euclidean:1", None, lambda p: np.log(p[..., 0]), lambda p, v, fp: v[..., 0] / p[..., 0]),
]
every = pytest.mark.parametrize("case", IDENTITIES, ids=lambda case: f"{case.source}={case.target}")


@every
@loop_over("length", [1e-12, 1e-4, 0.3, 1.2])
def test_geometry_agrees(case, length, rng):
    here, there = ss.space(case.source), ss.space(case.target)
    for _ in range(3):
        p = base_point(here, rng)
        v, w = length * unit_tangent(here, p, rng), unit_tangent(here, p, rng)
        q, x = here.exp(p, v), here.exp(p, 0.4 * w)
        fp, fq, fx = case.f(np.stack([p, q, x]))
        fv, fw = case.df(p, v, fp), case.df(p, w, fp)
        there.check_tangent([fp, fp], [fv, fw])
        allowed = 50 * EPS * condition(here, [p, q, x]) * condition(there, [fp, fq, fx])
        if case.scale is not None:
            assert abs(there.distance(fp, fq) - case.scale * length) <= allowed
            assert there.inner(fp, fv, fw) == pytest.approx(case.scale**2 * here.inner(p, v, w), abs=allowed)
        assert np.abs(plain(there, there.exp(fp, fv)) - plain(there, fq)).max() <= allowed
        assert np.abs(there.log(fp, fq) - fv).max() <= allowed
        for t in (-0.5, 0.3, 2.0):
            if t * length < 1.5:
                a, b = case.f(here.geodesic(p, q, t)), there.geodesic(fp, fq, t)
                assert np.abs(plain(there, a) - plain(there, b)).max() <= 2 * allowed
        a, b = case.f(here.transvection(p, v, x)), there.transvection(fp, fv, fx)
        assert np.abs(plain(there, a) - plain(there, b)).max() <= 4 * allowed
        a, b = case.df(q, here.transport(p, q, w), fq), there.transport(fp, fq, fw)
        assert np.abs(a - b).max() <= 4 * allowed


def end_conditions(space, p, ends, moved):
    """End conditions of a curve, and those of another one, of which vectors at the i-th point are moved."""
    if ends not in ("velocity", "acceleration"):
        return ends, ends
    order = 1 if ends == "velocity" else 2
    vectors = {i: 0.7 * space.log(p[i], p[j]) for i, j in ((0, 1), (-1, -2))}
    return [(order, v) for v in vectors.values()], [(order, moved(v, i)) for i, v in vectors.items()]


def assert_same_curves(case, one, other, allowed):
    here, there = one.space, other.space
    x = np.concatenate([one.t, np.linspace(one.t[0], one.t[-1], 60)])
    y, fy = one(x), other(x)
    image = case.f(y)
    assert np.abs(plain(there, image) - plain(there, fy)).max() <= allowed
    for nu in (1, 2):
        v, w = one(x, nu), other(x, nu)
        # Accelerations are second differences, with steps from 0.7.
        if case.scale is not None:
            assert np.abs(case.scale * here.norm(y, v) - there.norm(fy, w)).max() <= 10**nu * allowed
        mapped = plain_vector(there, image, case.df(y, v, image))
        assert np.abs(mapped - plain_vector(there, fy, w)).max() <= 10**nu * allowed


@pytest.mark.parametrize("case", IDENTITIES[::3], ids=lambda case: f"{case.source}={case.target}")
@loop_over(
    "step, ends", [(1e-6, "natural"), (0.1, "not-a-knot"), (0.1, "velocity"), (0.7, "periodic"), (0.7, "acceleration")]
)
def test_splines_agree(case, ends, step, rng):
    here, there = ss.space(case.source), ss.space(case.target)
    p = (closed_walk if ends == "periodic" else walk)(here, step, 12, rng)
    if ends == "periodic":
        p[-1] = p[0]
    fp = case.f(p)
    t = np.concatenate([[0.0], np.cumsum(rng.uniform(0.7, 1.3, len(p) - 1))])
    bc, fbc = end_conditions(here, p, ends, lambda v, i: case.df(p[i], v, fp[i]))
    one, other = (ss.CubicSpline(t, p, here, bc_type=bc, tol=0.0), ss.CubicSpline(t, fp, there, bc_type=fbc, tol=0.0))
    # Rounding of the points, through two solvers and two formulas.
    assert_same_curves(case, one, other, 50 * EPS * condition(here, p) * condition(there, fp))


def test_rotations_have_two_quaternions(rng):
    """Distances past the equator of S³: the other quaternion is nearer."""
    p, q = ss.Sphere(3).random_point(rng, (2, 200))
    angle = ss.Sphere(3).distance(p, q)
    there = ss.SpecialOrthogonal(3).distance(rotation(p), rotation(q))
    assert np.abs(there - 2 * np.minimum(angle, np.pi - angle)).max() <= 50 * EPS
    assert np.abs(ss.RealProjective(3).distance(p, q) - there / 2).max() <= 50 * EPS


def gauges(space, n, rng):
    """Random signs, phases, unit quaternions, orthogonal or unitary matrices, which multiply points from the right."""
    if isinstance(space, ss.QuaternionicProjective):
        return ss.SpecialUnitary(2).random_point(rng, n)
    if len(space.point_shape) == 1:
        noise = rng.standard_normal((n, 1)) + (1j * rng.standard_normal((n, 1)) if space.dtype.kind == "c" else 0)
        return noise / np.abs(noise)
    k = space.point_shape[1]
    noise = rng.standard_normal((n, k, k)) + (1j * rng.standard_normal((n, k, k)) if space.dtype.kind == "c" else 0)
    return np.linalg.qr(noise).Q


@pytest.mark.parametrize("name", ["rp:3", "cp:3", "hp:2", "gr:2,5", "cgr:2,4"])
@loop_over("ends", ["natural", "not-a-knot", "periodic", "velocity", "acceleration"])
@loop_over("method", ["fixed-point", "quasi-newton"])
def test_representatives_do_not_matter(name, ends, method, rng):
    space = ss.space(name)

    def multiply(x, g):
        return x * g if len(space.point_shape) == 1 else x @ g

    same = linear(name, name, 1.0, lambda x: x)
    for step in (1e-6, 0.7, 1.1):
        p = (closed_walk if ends == "periodic" else walk)(space, step, 14, rng)
        g = gauges(space, len(p), rng)
        t = np.concatenate([[0.0], np.cumsum(rng.uniform(0.7, 1.3, len(p) - 1))])
        bc = end_conditions(space, p, ends, lambda v, i, g=g: multiply(v, g[i]))
        one, other = (
            ss.CubicSpline(t, points, space, bc_type=end, method=method, tol=0.0)
            for points, end in zip((p, multiply(p, g)), bc, strict=True)
        )
        assert_same_curves(same, one, other, 100 * EPS)
        if step == 0.7:
            assert one.length() == pytest.approx(other.length(), rel=1e-12)
