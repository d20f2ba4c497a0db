"""De Sitter and anti-de Sitter space and the subspaces of an indefinite form: closed forms at fifty digits, isometries,
and the spaces of definite metric that lie in them."""

import mpmath
import numpy as np
import pytest
from cases import EPS, base_point, centre_of, condition, jumps, loop_over, walk
from refused import raises
from scipy.linalg import expm

import symspline as ss

SEED = 8
QUADRICS = ["ds:2", "ds:3", "ads:2", "ads:3"]
NAMES = [*QUADRICS, "igr:0,1,1,2", "igr:1,0,2,1", "igr:1,1,2,2"]
quadrics = pytest.mark.parametrize("name", QUADRICS)
every = pytest.mark.parametrize("name", NAMES)
KNOTS = np.array([0.0, 0.7, 2.0, 2.4, 3.9, 5.0])


def signs(name):
    """The diagonal of the form."""
    family, _, numbers = name.partition(":")
    *_, p, q = [0, *map(int, numbers.split(","))]
    if family != "igr":
        p, q = (1, q) if family == "ds" else (2, q - 1)
    return np.repeat([-1.0, 1.0], [p, q])


def kappa(name):
    return 1 if name.startswith("ds") else -1


def group_element(eta, rng, size=0.4):
    """A random element of O(p, q), of any determinant."""
    x = size * rng.standard_normal((len(eta), len(eta)))
    flips = np.diag(rng.choice([-1.0, 1.0], len(eta)))
    return flips @ expm(eta[:, None] * (x - x.T))


def origin(name):
    return centre_of(ss.space(name)).astype(float)


def null_vector(name, p, rng):
    """A tangent vector at p on which the form is zero."""
    space = ss.space(name)
    e = space.frame(p)
    return 0.8 * (e[0] + e[1])


@quadrics
@loop_over("kind", ["positive", "negative", "null", "nearly null"])
@loop_over("size", [1e-8, 1e-3, 0.3, 1.0, 2.5])
def test_exp_and_log_at_fifty_digits(name, kind, size, rng):
    space, eta = ss.space(name), signs(name)
    p = space.exp(origin(name), 0.3 * space.random_tangent(rng, origin(name)))
    e = space.frame(p)
    v = (
        size
        * {
            "positive": e[1] + 0.3 * e[0],
            "negative": e[0] - 0.4 * e[1],
            "null": e[0] + e[1],
            "nearly null": e[0] + (1 + 1e-9) * e[1],
        }[kind]
    )
    with mpmath.workdps(50):
        point, vector = [mpmath.mpf(float(x)) for x in p], [mpmath.mpf(float(x)) for x in v]
        square = kappa(name) * sum(s * x * x for s, x in zip(eta, vector, strict=True))
        root = mpmath.sqrt(square)
        sinc = 1 if square == 0 else mpmath.sin(root) / root
        q = [(mpmath.cos(root) * x + sinc * y).real for x, y in zip(point, vector, strict=True)]
        q = np.array(q, dtype=float)
    allowed = 50 * EPS * condition(space, [p, q])
    assert np.abs(space.exp(p, v) - q).max() <= allowed
    # The logarithm's condition is θ/sin θ on closed geodesics.
    theta = float(abs(root)) if square > 0 else 0.0
    assert np.abs(space.log(p, q) - v).max() <= allowed / max(np.sinc(theta / np.pi), 0.05)
    np.testing.assert_allclose(
        space.invariant_form(p, v, v), (eta * v * v).sum(), rtol=0, atol=10 * EPS * np.sum(v * v)
    )


@quadrics
@loop_over("gap", [1e-1, 1e-3, 1e-6, 1e-9])
def test_the_logarithm_up_to_the_antipode(name, gap, rng):
    space = ss.space(name)
    p = origin(name)
    e = space.frame(p)
    round_, open_ = (e[1], e[0]) if kappa(name) > 0 else (e[0], e[1])
    v = (np.pi - gap) * (1.25 * round_ + 0.75 * open_)
    q = space.exp(p, v)
    # Rounding of q turns the direction by so much.
    assert np.abs(space.log(p, q) - v).max() <= 100 * EPS / gap
    assert np.abs(space.exp(p, space.log(p, q)) - q).max() <= 200 * EPS


@quadrics
def test_points_without_a_geodesic_raise(name):
    space = ss.space(name)
    p = origin(name)
    e = space.frame(p)
    q = -space.exp(p, 0.5 * (e[0] if kappa(name) > 0 else e[1]))
    assert kappa(name) * (signs(name) * p * q).sum() < -1.1
    for operation in (space.log, space.distance):
        raises("cut locus", operation, p, q, error=ss.CutLocusError)
    raises(r"points\[1\]", ss.CubicSpline, None, [p, p, q], space, error=ss.CutLocusError)


@every
def test_transport_preserves_the_invariant_form(name, rng):
    space = ss.space(name)
    p = walk(space, 0.4, 6, rng)
    u, v = (space.random_tangent(rng, p[:-1]) for _ in range(2))
    moved = [space.transport(p[:-1], p[1:], x) for x in (u, v)]
    before, after = space.invariant_form(p[:-1], u, v), space.invariant_form(p[1:], *moved)
    np.testing.assert_allclose(after, before, rtol=0, atol=1e-12 * np.abs(p).max() ** 2)
    # Frames are orthonormal for the form.
    e = space.frame(p[0])
    gram = space.invariant_form(p[0], e[:, None], e[None])
    if name.startswith("igr"):
        gram = gram * 8
    np.testing.assert_allclose(np.abs(gram), np.eye(space.dim), rtol=0, atol=1e-12)
    assert np.linalg.eigvalsh(gram).min() < -0.9 and (np.linalg.eigvalsh(gram).max() > 0.9)


KINDS = {"space-like": (0.3, 1.0), "time-like": (1.0, 0.3), "nearly null": (1.0, 1.0 + 1e-9)}


def walk_of_kind(space, kind, rng, n=8, step=0.4):
    """Points whose steps have a direction in which the metric has a given sign, or is all but zero."""
    p = [base_point(space, rng)]
    e = space.frame(p[0])
    direction = KINDS[kind][0] * e[0] + KINDS[kind][1] * e[1]
    for k in range(n - 1):
        turn = 0.0 if kind == "nearly null" else 0.05 * (-1) ** k
        q = space.exp(p[-1], step * direction + turn * space.random_tangent(rng, p[-1]))
        direction = space.transport(p[-1], q, direction)
        p.append(q)
    return np.array(p)


@quadrics
@loop_over("kind", KINDS)
@pytest.mark.parametrize("method", ["fixed-point", "quasi-newton", "newton", "homotopy", "auto"])
def test_curves_are_c2_along_steps_of_every_kind(name, kind, method, rng):
    space = ss.space(name)
    p = walk_of_kind(space, kind, rng)
    steps = space.log(p[:-1], p[1:])
    square = space.invariant_form(p[:-1], steps, steps) / np.sum(steps**2, axis=-1)
    expected = {"space-like": 1, "time-like": -1, "nearly null": 0}[kind]
    assert (np.where(np.abs(square) < 1e-6, 0, np.sign(square)) == expected).all()
    t = np.cumsum(rng.uniform(0.8, 1.25, len(p)))
    closed = np.concatenate([p[:5], p[3::-1]])
    v, w = 0.8 * space.log(p[0], p[1]), 0.3 * space.log(p[-1], p[-2])
    ends = ["natural", "clamped", "not-a-knot", ((1, v), (1, w)), ((2, v), (2, w)), ("not-a-knot", (1, w))]
    for bc_type, points, times in [*((e, p, t) for e in ends), ("periodic", closed, np.arange(9.0))]:
        spline = ss.CubicSpline(times, points, space, bc_type=bc_type, method=method, tol=1e-14, on_failure="ignore")
        # Rounding may leave a little more than the tolerance.
        assert np.max(spline.report.residual) < 1e-13, bc_type
        assert np.max(jumps(spline)) <= 1.0, (bc_type, jumps(spline))


@quadrics
def test_points_on_a_null_geodesic(name, rng):
    """The spline through them is the null geodesic, at the speed of a cubic spline in R."""
    space = ss.space(name)
    p = space.exp(origin(name), 0.3 * space.random_tangent(rng, origin(name)))
    v = null_vector(name, p, rng)
    s = np.array([0.0, 0.4, 0.5, 1.3, 1.1, 2.0])
    spline = ss.CubicSpline(KNOTS, p + s[:, None] * v, space, tol=1e-14)
    flat = ss.CubicSpline(KNOTS, s[:, None], "r:1", tol=1e-14)
    x = np.linspace(0, 5, 41)
    np.testing.assert_allclose(spline(x), p + flat(x) * v, rtol=0, atol=1e-12)
    np.testing.assert_allclose(spline(x, 2), flat(x, 2) * v, rtol=0, atol=1e-10)


@pytest.mark.parametrize("name", ["igr:1,1,2,2", "igr:0,2,1,3", "igr:1,2,2,3"])
def test_bases_and_reflections(name, rng):
    a, b, p, _ = map(int, name.partition(":")[2].split(","))
    space, eta = ss.space(name), signs(name)
    points = space.random_point(rng, 20)
    basis = ss.convert.reflection_to_basis(points, negative=p)
    gram = np.swapaxes(basis, -1, -2) @ (eta[:, None] * basis)
    np.testing.assert_allclose(gram, [np.diag(np.repeat([-1.0, 1.0], [a, b]))] * 20, rtol=0, atol=1e-13)
    mixed = basis @ rng.standard_normal((a + b, a + b))
    np.testing.assert_allclose(ss.convert.basis_to_reflection(mixed, negative=p), points, rtol=0, atol=1e-11)


NULL = [[1.0], [1.0], [0.0]]


def test_invalid_points_and_subspaces_raise(rng):
    other, turned = ss.space("igr:0,1,1,2"), group_element(np.array([-1.0, 1, 1]), rng)
    far = [[np.sinh(16.0), np.cosh(16.0), 0.0]] * 2
    for call, match in [
        (lambda: ss.convert.basis_to_reflection(NULL, negative=1), "the form is degenerate on it"),
        (lambda: ss.convert.basis_to_reflection(np.ones((3, 2)), negative=1), "linearly independent columns"),
        (lambda: ss.convert.basis_to_reflection(NULL, negative=4), "must be a whole number from 0 to 3, not 4"),
        (lambda: ss.convert.reflection_to_basis(np.eye(2)[::-1], negative=1), "does not preserve the form"),
        (lambda: ss.convert.reflection_to_basis(np.eye(2), negative=1), "must leave a proper subspace fixed"),
        (lambda: ss.convert.reflection_to_basis(-np.eye(2), negative=1), "must leave a proper subspace fixed"),
        (lambda: other.check_point(2 * np.eye(3)), "the form with 1 negative squares first"),
        (lambda: other.check_point(turned), "it is not a reflection"),
        (lambda: ss.DeSitter(2).check_point([0.0, 1.0, 1.0]), r"-x0² \+ x1² \+ … is 2, not 1"),
        (lambda: ss.AntiDeSitter(2).check_point([0.0, 0.0, 1.0]), r"-x0² - x1² \+ x2² \+ … is 1, not -1"),
        (lambda: ss.CubicSpline(None, far, "ds:2"), "move all points by one isometry"),
    ]:
        raises(match, call)
    for name in ("igr:1,0,1,2", "igr:1,1,1,2", "igr:0,2,1,2"):
        raises("form has another signature than", ss.space(name).check_point, other.random_point(rng))
