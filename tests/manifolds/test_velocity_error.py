"""`report.velocity_error` is a sharp bound of the error of the velocities and detects incorrect functions."""

import numpy as np
import pytest
from cases import WORDS, loop_over
from made import ELLIPSOID, flat, knots, twin, walk

import symspline as ss

SPHERE, SPD, ST52 = ss.Sphere(2), ss.SymmetricPositiveDefinite(3), ss.Stiefel(2, 5)
# Requested residuals: loose, and down to near rounding.
TOLS = 10.0 ** -np.arange(2, 12, 2)


def tensors(n, step, seed):
    """A walk of positive definite matrices that stays near the identity, as diffusion tensors do."""
    rng = np.random.default_rng(seed)
    p = [np.eye(3)]
    for _ in range(n - 1):
        v = SPD.random_tangent(rng, p[-1]) - 0.8 * SPD.log(np.eye(3), p[-1])
        p.append(SPD.exp(p[-1], step / SPD.norm(p[-1], v) * v))
    return np.array(p)


def data(p, ends):
    if ends == "periodic":
        p = np.concatenate([p[:6], p[4::-1]])
    return knots("unequal", len(p), 2), p


def error(space, spline, exact):
    """The largest norm of the error of the velocities."""
    return float(space.norm(exact.points, spline.velocities - exact.velocities).max())


def check(space, p, ends, exact_space):
    t, p = data(p, ends)
    exact = ss.CubicSpline(t, p, exact_space, bc_type=ends, tol=1e-14, on_failure="ignore")
    known = 0
    for tol in TOLS:
        spline = ss.CubicSpline(t, p, space, bc_type=ends, tol=tol)
        bound, true = spline.report.velocity_error, error(exact_space, spline, exact)
        # The reference is one of double precision, too.
        assert true <= bound + 1e-13
        known += np.isfinite(bound)
        if true > 1e-9:
            assert bound <= 10 * true or not np.isfinite(bound)
    # There may be no bound for one of the loosest fits.
    assert known >= len(TOLS) - 1


@pytest.mark.parametrize("ends", WORDS)
@pytest.mark.parametrize("step", [0.2, 0.8, 1.2])
def test_velocity_error_bounds_the_distance_from_the_compiled_solution(step, ends):
    check(twin(SPHERE), walk(SPHERE, step, 10, 1), ends, SPHERE)
    check(twin(SPD), tensors(10, step, 3), ends, SPD)


@pytest.mark.parametrize("ends", WORDS)
def test_velocity_error_bounds_the_distance_from_a_tight_solution(ends):
    for space, step in ((ST52, 0.3), (ST52, 1.2), (ELLIPSOID, 0.6)):
        check(space, walk(space, step, 10, 1), ends, space)


def rough(x):
    """A sine of so short waves that it is as good as noise."""
    return np.sin(1e7 * x + 1)


def moved(space, size, kind):
    """The sphere with a logarithm that is off."""

    def log(p, q):
        v = space.log(p, q)
        if kind == "longer":
            return (1 + size) * v
        return v + size * space.project_tangent(
            p, np.broadcast_to([0.3, -0.5, 0.8], v.shape) * (rough(q) if kind == "noise" else 1.0)
        )

    return twin(space, log=log)


@pytest.mark.parametrize("ends", WORDS)
@loop_over("size", [1e-4, 1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("kind", ["longer", "aside", "noise"])
def test_wrong_logarithms_increase_the_velocity_error(kind, size, ends):
    t, p = data(walk(SPHERE, 0.8, 10, 1), ends)
    exact = ss.CubicSpline(t, p, SPHERE, bc_type=ends)
    spline = ss.CubicSpline(t, p, moved(SPHERE, size, kind), bc_type=ends, on_failure="ignore")
    true = error(SPHERE, spline, exact)
    assert true > 1e-2 * size
    assert true <= spline.report.velocity_error


@pytest.mark.parametrize("size", [1e-3, 1e-6, 1e-9])
def test_a_wrong_derivative_of_the_logarithm_is_noticed(size):
    right = twin(SPHERE)

    def dlog(p, q, w):
        return (1 + size) * right.dlog(p, q, w)

    t, p = data(walk(SPHERE, 0.8, 10, 1), "natural")
    exact = ss.CubicSpline(t, p, SPHERE)
    spline = ss.CubicSpline(t, p, twin(SPHERE, dlog=dlog))
    true = error(SPHERE, spline, exact)
    assert spline.report.residual < 1e-12 and true > 1e-2 * size
    assert true <= spline.report.velocity_error <= 100 * true


def test_velocity_error_has_the_unit_of_velocities():
    p = walk(ST52, 0.8, 8, 5)
    one, other = (ss.CubicSpline(scale * np.arange(8.0), p, ST52, tol=1e-6) for scale in (1.0, 1e3))
    assert one.report.velocity_error == pytest.approx(1e3 * other.report.velocity_error, rel=1e-3)


def test_batches_lists_products_and_files(tmp_path):
    p = np.stack([walk(ST52, 0.3, 5, seed) for seed in range(3)])
    batch = ss.CubicSpline(None, p, ST52, tol=1e-4)
    alone = [ss.CubicSpline(None, own, ST52, tol=1e-4).report.velocity_error for own in p]
    assert np.allclose(batch.report.velocity_error, alone, rtol=1e-6)
    assert batch[1].report.velocity_error == batch.report.velocity_error[1]
    some = ss.CubicSpline(None, p, ST52, tol=1e-4, where=[True, False, True])
    assert np.isnan(some.report.velocity_error).tolist() == [False, True, False]
    many = ss.fit_many([(None, own) for own in p], ST52, tol=1e-4)
    assert np.allclose([one.report.velocity_error for one in many], alone, rtol=1e-6)
    both = ss.CubicSpline(None, (p, p), ss.Product(ST52, ST52), tol=1e-4)
    assert np.allclose(both.report.velocity_error, np.sqrt(2) * np.array(alone), rtol=1e-6)
    batch.save(tmp_path / "curves.npz")
    assert ss.load(tmp_path / "curves.npz").report == batch.report
    assert f"velocities within {max(alone):.1e}" in str(batch.report)


def test_symmetric_spaces_have_none():
    p = walk(SPHERE, 0.5, 6, 1)
    spline = ss.CubicSpline(None, p, SPHERE)
    assert spline.report.velocity_error is None and "within" not in str(spline.report)
    mixed = ss.CubicSpline(None, (p, p), ss.Product(SPHERE, twin(SPHERE)))
    assert mixed.report.velocity_error is None


def test_curves_that_pass_the_cut_locus_have_none():
    p = walk(SPHERE, 0.5, 6, 1)
    p[3] = -p[2]
    spline = ss.CubicSpline(None, [p, walk(SPHERE, 0.5, 6, 2)], twin(SPHERE), on_failure="ignore")
    assert np.isnan(spline.report.velocity_error).tolist() == [True, False]


def test_curves_that_do_not_move():
    assert ss.CubicSpline(None, np.ones((4, 3)), flat(3)).report.velocity_error <= 1e-12
    given = ss.CubicSpline(None, [np.zeros(3), np.ones(3)], flat(3), bc_type="clamped")
    assert given.report.velocity_error == 0.0
