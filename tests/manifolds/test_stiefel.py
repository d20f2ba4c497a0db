"""Stiefel manifolds against independent formulas."""

import numpy as np
import pytest
from cases import loop_over
from made import twin, walk
from pymanopt import manifolds
from refused import raises
from scipy.linalg import expm

import symspline as ss
from symspline.manifolds import from_pymanopt
from symspline.manifolds._operations import frames_along

SIZES = [(1, 2), (1, 4), (2, 3), (2, 4), (2, 5), (3, 4), (3, 5), (3, 6), (2, 20)]
every = pytest.mark.parametrize(("k", "n"), SIZES)


def steps(space, length, count=6, seed=1):
    rng = np.random.default_rng(seed)
    p = space.random_point(rng, count)
    v = space.random_tangent(rng, p)
    return p, length * v / space.norm(p, v)[:, None, None]


@every
def test_exp_is_a_rotation_of_the_whole_space(k, n):
    """exp_p(v) = exp(Ω)p, Ω = (1 − ppᵀ/2)vpᵀ − pvᵀ(1 − ppᵀ/2), by SciPy's Padé approximation."""
    space = ss.Stiefel(k, n)
    for p, v in zip(*steps(space, 1.7), strict=True):
        half = v - p @ (p.T @ v) / 2
        assert np.abs(expm(half @ p.T - p @ half.T) @ p - space.exp(p, v)).max() <= 1e-14


@every
@loop_over("length", [1e-9, 1e-4, 0.1, 1.0, 2.0, 2.7])
def test_log_inverts_exp(k, n, length):
    space = ss.Stiefel(k, n)
    p, v = steps(space, length)
    q = space.exp(p, v)
    space.check_point(q)
    # Near conjugate points rounding counts more.
    allowed = 5e-14 if length < 2.5 else 1e-12
    assert np.abs(space.log(p, q) - v).max() <= allowed
    assert space.distance(p, q) == pytest.approx(length, abs=allowed)


@every
@loop_over("length", [1e-6, 1.0, 2.0])
def test_dlog_is_that_of_differences(k, n, length):
    space = ss.Stiefel(k, n)
    p, v = steps(space, length)
    q = space.exp(p, v)
    w = space.random_tangent(np.random.default_rng(2), q)
    exact, differences = space.dlog(p, q, w), twin(space).dlog(p, q, w)
    space.check_tangent(p, exact)
    # Differences of order four are good to some 1e-12, less near conjugate points.
    assert np.abs(exact - differences).max() <= (2e-11 if length < 1.5 else 2e-9)


def test_all_but_one_vector_is_rotations():
    """The last column of a rotation follows from the others, and the metric of rotations is the canonical one."""
    space, rotations = ss.Stiefel(2, 3), ss.SpecialOrthogonal(3)
    r = rotations.random_point(np.random.default_rng(4), 2)
    v = rotations.log(r[0], r[1])
    assert np.abs(space.log(r[0][:, :2], r[1][:, :2]) - v[:, :2]).max() <= 1e-14
    assert space.distance(r[0][:, :2], r[1][:, :2]) == pytest.approx(rotations.distance(r[0], r[1]), abs=1e-14)
    p = rotations.exp(r[0], 0.4 * rotations.random_tangent(np.random.default_rng(5), np.repeat(r[:1], 6, axis=0)))
    curve, frames = ss.CubicSpline(None, p, rotations), ss.CubicSpline(None, p[..., :2], space)
    x = np.linspace(0, 5, 30)
    assert np.abs(frames(x) - curve(x)[..., :2]).max() <= 1e-11


@loop_over("n", [4, 5])
def test_opposite_frames_have_no_logarithm(n):
    """A turn by π in the plane of the frame, which goes either way."""
    space = ss.Stiefel(2, n)
    p = space.random_point(np.random.default_rng(8))
    for call in (space.log, space.distance):
        raises("pair 0", call, p, -p, error=ss.CutLocusError)


def test_a_logarithm_is_as_accurate_as_the_difference_of_close_points():
    space = ss.Stiefel(2, 4)
    p, v = steps(space, 1e-9)
    q = space.exp(p, v)
    assert np.abs(space.log(p, q) - v).max() <= 2e-16


@loop_over("outside", ["raise", "geodesic"])
def test_derivatives_by_formulas_are_those_by_differences(outside):
    """Of a manifold with the same functions the derivatives are differences."""
    space = ss.Stiefel(2, 4)
    p = walk(space, 0.7, 8, 3)
    x = np.linspace(0, 7, 40) if outside == "raise" else np.linspace(-0.5, 7.5, 40)
    curve, slow = (ss.CubicSpline(None, p, s, bc_type="clamped") for s in (space, twin(space)))
    assert np.abs(curve.velocities - slow.velocities).max() <= 1e-11
    for nu, allowed in [(0, 1e-11), (1, 2e-11), (2, 2e-10)]:
        found = curve(x, nu, extrapolate=outside)
        assert np.abs(found - slow(x, nu, extrapolate=outside)).max() <= allowed
        if nu:
            space.check_tangent(curve(x, extrapolate=outside), found)


def test_invalid_sizes_of_stiefel_manifolds_raise():
    for arguments in [(2, 2), (5, 2), (0, 3), (-1, 3), (1.5, 3), (True, 3)]:
        raises("Stiefel", ss.Stiefel, *arguments)


def test_names_of_stiefel_manifolds():
    assert ss.space("stiefel:2,5") == ss.space("st:2,5") == ss.Stiefel(2, 5) != ss.Stiefel(2, 6)
    assert str(ss.Stiefel(2, 5)) == "stiefel:2,5" and repr(ss.Stiefel(2, 5)) == "Stiefel(2, 5)"
    assert ss.Stiefel(2, 5).dim == 7 and ss.Stiefel(2, 5).point_shape == (5, 2)
    assert hash(ss.Stiefel(2, 5)) == hash(ss.space("st:2,5"))


def test_the_curve_is_that_of_our_space():
    for theirs, ours in [
        (manifolds.SymmetricPositiveDefinite(2), ss.SymmetricPositiveDefinite(2)),
        (manifolds.Grassmann(4, 2), ss.Grassmannian(2, 4)),
        (manifolds.ComplexGrassmann(3, 1), ss.ComplexGrassmannian(1, 3)),
    ]:
        space = from_pymanopt(theirs)
        assert space.point_shape == ours.point_shape and space.dim == ours.dim and space.dtype == ours.dtype
        p = walk(ours, 0.4, 5, 1)
        spline, core = ss.CubicSpline(None, p, space), ss.CubicSpline(None, p, ours)
        x = np.linspace(0, 4, 9)
        # Their logarithms are good to 1e-12 or so. Points of a quotient have many arrays.
        assert ours.distance(ours.project(spline(x)), core(x)).max() <= 1e-10
        assert np.abs(spline.speed(x) - core.speed(x)).max() <= 1e-9


def test_rotations_have_velocities_in_the_lie_algebra():
    space = from_pymanopt(manifolds.SpecialOrthogonalGroup(2))
    turns = np.array([0.0, 0.5, 0.7])
    p = np.stack([np.stack([np.cos(turns), -np.sin(turns)], -1), np.stack([np.sin(turns), np.cos(turns)], -1)], -2)
    spline = ss.CubicSpline(None, p, space)
    flat = ss.CubicSpline(None, turns[:, None], "r:1")
    assert np.abs(spline.velocities[:, 1, 0] - flat.velocities[:, 0]).max() <= 1e-11
    assert np.abs(spline.velocities + np.swapaxes(spline.velocities, 1, 2)).max() <= 1e-15


def test_adapters_are_values_and_invalid_ones_raise():
    sphere = manifolds.Sphere(3)
    assert from_pymanopt(sphere) == from_pymanopt(sphere) != from_pymanopt(manifolds.Sphere(3))
    for theirs, what in [
        (manifolds.Stiefel(5, 2), "has no log"),
        (manifolds.FixedRankEmbedded(4, 3, 2), "has no exp and no log"),
        (manifolds.Product([manifolds.Sphere(3), manifolds.Sphere(2)]), "make a symspline.Product"),
    ]:
        raises(what, from_pymanopt, theirs)
    raises("has no metric", ss.manifolds.from_geomstats, object())


@pytest.mark.parametrize(("k", "n"), [(1, 3), (2, 4), (2, 5), (3, 6)])
def test_frames_are_transported_in_parallel(k, n):
    """∇X = X' + Γ(γ', X) = 0 for the vectors X of the frames along a geodesic, where Γ is the polarised form of
    equation 2.41 of Edelman, Arias & Smith (1998)."""
    space = ss.Stiefel(k, n)
    p, v = steps(space, 1.0, 3)

    def frames(t):
        path = np.stack([p, space.exp(p, t * v)], axis=1)
        return frames_along(space.operations, path).reshape(3, 2, space.dim, n, k)

    points = np.stack([p, space.exp(p, 0.9 * v)], axis=1).reshape(-1, n, k)
    for x, at in zip(frames(0.9).reshape(-1, space.dim, n, k), points, strict=True):
        gram = [[space.inner(at, a, b) for a in x] for b in x]
        assert np.abs(gram - np.eye(space.dim)).max() <= 5e-15
        space.check_tangent(np.broadcast_to(at, x.shape), x)
    start, h = frames(0.5)[:, 0], 1e-3
    assert np.abs(frames(0.0)[:, 1] - start).max() <= 5e-15
    rate = (frames(h) - frames(-h))[:, 1] / (2 * h)
    normal = (np.eye(n) - p @ np.swapaxes(p, 1, 2))[:, None]
    p, v = p[:, None], v[:, None]
    square = v @ np.swapaxes(start, -1, -2) @ p + p @ np.swapaxes(v, -1, -2) @ normal @ start
    other = start @ np.swapaxes(v, -1, -2) @ p + p @ np.swapaxes(start, -1, -2) @ normal @ v
    assert np.abs(rate).max() > 0.1
    assert np.abs(rate + (square + other) / 2).max() <= 1e-6


def test_curves_of_a_batch_are_those_fitted_alone():
    space = ss.Stiefel(2, 4)
    p = np.stack([walk(space, step, 9, seed) for seed, step in enumerate([0.2, 1.4, 0.7, 2.0])])
    batch = ss.CubicSpline(None, p, space)
    for i, points in enumerate(p):
        alone = ss.CubicSpline(None, points, space)
        assert np.abs(batch.velocities[i] - alone.velocities).max() <= 1e-14
        assert batch.report.iterations[i] == alone.report.iterations
