"""The interface of curves on manifolds made of functions, and its errors."""

import pickle

import numpy as np
import pytest
from made import knots, twin, walk
from refused import raises
from stored import restored

import symspline as ss

SPACE = ss.Stiefel(2, 5)
POINTS = walk(SPACE, 0.5, 6, 1)
SPLINE = ss.CubicSpline(knots("unequal", 6, 2), POINTS, SPACE)
FUNCTIONS = SPACE.functions._asdict()
NAMELESS = ss.Manifold(**FUNCTIONS, point_shape=(5, 2))


def batch():
    return np.stack([walk(SPACE, 0.5, 6, seed) for seed in range(3)])


def test_a_batch_of_manifolds_is_its_curves():
    t = np.stack([knots("unequal", 6, seed) for seed in range(3)])
    curves = ss.CubicSpline(t, batch(), SPACE)
    x = [0.3, 2.2, 3.9]
    for i, p in enumerate(batch()):
        one = ss.CubicSpline(t[i], p, SPACE)
        assert np.array_equal(curves[i].velocities, one.velocities)
        # Rows of matrix products are rounded in groups.
        assert np.abs(curves(x, nu=1)[i] - one(x, nu=1)).max() <= 1e-12
    assert curves([[0.3], [2.2], [3.9]], per_curve=True).shape == (3, 1, 5, 2)
    assert curves.report.iterations.shape == (3,) and len(curves) == 3
    listed = ss.fit_many([(t[0], batch()[0]), (None, batch()[1][:3])], SPACE, bc_type="not-a-knot")
    assert [len(curve.t) for curve in listed] == [6, 3]
    assert listed[0] == ss.CubicSpline(t[0], batch()[0], SPACE, bc_type="not-a-knot")


def test_control_points_and_lengths():
    control = SPLINE.control_points
    assert control.shape == (5, 4, 5, 2)
    assert np.array_equal(control[:, 0], SPLINE.points[:-1])
    assert np.array_equal(control[:, 3], SPLINE.points[1:])
    leg = 3 * SPACE.log(control[0, 0], control[0, 1]) / SPLINE.t[1]
    assert np.abs(leg - SPLINE(0.0, nu=1)).max() <= 1e-12
    # Gauss's rule on every segment.
    nodes, weights = np.polynomial.legendre.leggauss(12)
    h = np.diff(SPLINE.t)[:, None]
    x = SPLINE.t[:-1, None] + h * (nodes + 1) / 2
    assert SPLINE.length() == pytest.approx(np.sum(SPLINE.speed(x) * weights * h) / 2, rel=1e-8)
    bend = SPACE.norm(SPLINE(x), SPLINE(x, nu=2))
    assert SPLINE.bending_energy() == pytest.approx(np.sum(bend**2 * weights * h) / 2, rel=1e-8)


def test_outside_the_knots_of_manifolds():
    end = SPLINE.t[-1]
    raises(r"x\[1\] = 9 is outside the knots", SPLINE, [1.0, 9.0])
    onward = SPLINE([-0.5, end + 0.5], extrapolate="geodesic")
    assert np.abs(onward[0] - SPACE.exp(POINTS[0], -0.5 * SPLINE.velocities[0])).max() <= 1e-14
    assert np.abs(onward[1] - SPACE.exp(POINTS[-1], 0.5 * SPLINE.velocities[-1])).max() <= 1e-14
    assert np.abs(SPLINE([-0.5, end + 0.5], nu=2, extrapolate="geodesic")).max() <= 1e-10
    assert np.abs(SPLINE(end + 0.1, extrapolate=True) - SPLINE(end, nu=0)).max() < 0.1
    assert np.abs(SPLINE(end + 0.7, extrapolate="periodic") - SPLINE(0.7)).max() <= 1e-14
    assert SPLINE([], nu=2).shape == (0, 5, 2)


def test_dates_and_progress():
    days = np.datetime64("2026-01-01") + np.arange(6)
    seen = []
    spline = ss.CubicSpline(days, POINTS, SPACE, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (6, 6)
    assert np.abs(spline(days[2]) - POINTS[2]).max() <= 1e-15
    spline(days, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (6, 6)


def test_pickles_and_files():
    assert pickle.loads(pickle.dumps(SPLINE)) == SPLINE
    made = ss.Manifold(
        exp=np.add, log=np.subtract, project_tangent=np.add, inner=np.add, point_shape=2, injectivity_radius=2
    )
    assert pickle.loads(pickle.dumps(made)) == made
    assert restored(SPLINE) == SPLINE


def test_missing_operations_raise():
    for call, what in [
        (lambda s: s.lift(0.5), "no horizontal lift is known"),
        (lambda s: s.transport(0, 1, s(0, nu=1)), "parallel transport along curves is not made"),
        (lambda s: s.jvp(0.5, points=0 * POINTS), "derivatives with respect to the data"),
        (lambda s: s.vjp(0.5, POINTS[0]), "derivatives with respect to the data"),
        (lambda s: s.save("no.npz"), "curves are not saved"),
        (lambda s: ss.save({"a": s}, "no.npz"), "curves are not saved"),
        (lambda s: ss.BezierCurve(POINTS, s.space), "B-spline and Bézier curves are not made"),
        (lambda s: ss.make_smoothing_spline(None, POINTS, s.space), "smoothing splines are not made"),
        (lambda s: ss.CubicSpline(None, POINTS, s.space, method="newton"), "method 'newton' is not available"),
        (lambda s: ss.rotations.angular_velocity(s, 0.5), "so:3|rotations"),
    ]:
        raises(what, call, ss.CubicSpline(None, POINTS, NAMELESS))


def test_invalid_points_of_manifolds_raise():
    for index, value, error, what in [
        ((2, 0, 0), POINTS[2, 0, 0] + 0.1, ss.ValidationError, r"points\[2\]{} is off the space by"),
        ((3, 1, 1), np.nan, ss.ValidationError, r"points\[3\]{} is off the space: it is not finite"),
        (2, -POINTS[1], ss.CutLocusError, r"points\[1\] and points\[2\]{} have no geodesic between them"),
    ]:
        changed = POINTS.copy()
        changed[index] = value
        raises(what.format(""), ss.CubicSpline, None, changed, SPACE, error=error)
        two = np.stack([POINTS, changed])
        raises(what.format(" of curve 1"), ss.CubicSpline, None, two, SPACE, error=error)
        kept = ss.CubicSpline(None, two, SPACE, on_failure="ignore")
        assert kept.report.converged.tolist() == [True, False]
        assert np.isnan(kept(0.5)[1]).all()
        assert np.array_equal(kept[0].velocities, ss.CubicSpline(None, POINTS, SPACE).velocities)


def test_far_points_name_distance_and_limit():
    space = ss.Manifold(**FUNCTIONS, injectivity_radius=0.4, point_shape=(5, 2))
    with pytest.raises(ss.CutLocusError, match=r"points\[1\] are 0\.5 apart, the injectivity radius is 0\.4"):
        ss.CubicSpline(None, POINTS, space)
    with pytest.raises(ss.CutLocusError) as caught:
        ss.CubicSpline(None, np.stack([POINTS, POINTS]), space)
    assert caught.value.spline.report.converged.tolist() == [False, False]


def test_far_control_points():
    """Neighbours are near enough, but the curve swings out."""
    space = twin(ss.Sphere(2), injectivity_radius=1.0)
    near = ss.Sphere(2).exp([1.0, 0, 0], [[0, 0.9 * (i % 2), 0.0] for i in range(5)])
    with pytest.raises(ss.CutLocusError, match=r"the control points between points\[\d\] and points\[\d\]"):
        ss.CubicSpline([0, 1, 1.1, 2.1, 2.2], near, space)


def test_no_convergence_keeps_the_best():
    with pytest.raises(ss.ConvergenceError, match=r"no convergence: residual .* after 3 iterations"):
        ss.CubicSpline(None, POINTS, SPACE, max_iter=3)
    with pytest.warns(ss.ConvergenceWarning, match="no convergence of curve 0"):
        kept = ss.CubicSpline(None, POINTS[None], SPACE, max_iter=3, on_failure="warn")
    assert not kept.report.converged[0] and np.isfinite(kept(0.5)).all()
    best = ss.CubicSpline(None, POINTS, SPACE)
    assert np.abs(kept(0.5)[0] - best(0.5)).max() < 0.01


def test_functions_that_do_not_fit_do_not_converge():
    """dlog that is not linear: the residual stays."""
    space = ss.Manifold(**FUNCTIONS | {"dlog": lambda p, q, w: w + 0.1 * np.sign(w)}, point_shape=(5, 2))
    with pytest.raises(ss.ConvergenceError, match="exp, log and dlog must fit each other"):
        ss.CubicSpline(None, POINTS, space, max_iter=40)


def test_invalid_ends_raise():
    for bc, what in [
        (((1, POINTS[0]), "natural"), "the start velocity is not tangent"),
        (("natural", (2, POINTS[-1])), "the end acceleration is not tangent"),
        (((1, 40 * SPACE.log(POINTS[0], POINTS[1])), "natural"), "the start velocity has speed 20, too fast"),
        ("periodic", "needs a closed curve"),
        ("smooth", "bc_type must be 'natural'"),
    ]:
        raises(what, ss.CubicSpline, None, POINTS, SPACE, bc_type=bc)


def test_invalid_manifolds_raise():
    for changes, what in [
        ({"transport": 3}, "transport must be a function, not 3"),
        ({"point_shape": ()}, "point_shape must be a whole number or a tuple"),
        ({"point_shape": (2, 0)}, "point_shape must be at least 1"),
        ({"injectivity_radius": -1.0}, "injectivity_radius must be a positive number"),
        ({"dim": 0}, "dim must be at least 1"),
        ({"dtype": np.float32}, "dtype must be float64 or complex128"),
    ]:
        raises(what, ss.Manifold, **FUNCTIONS | {"point_shape": (5, 2)} | changes)


def test_results_of_functions_are_checked():
    for changes, what in (
        ({"exp": lambda p, v: p[0]}, r"the function exp .* gave an array of shape \(5, 2\) for 6 points"),
        ({"inner": lambda p, u, v: u}, r"the function inner .* gave an array of shape"),
        ({"log": lambda p, q: 1j * p}, "the function log .* gave numbers of type complex128"),
        ({"project_tangent": lambda p, v: v[:, :1]}, "the function project_tangent .* gave an array of shape"),
    ):
        raises(
            what,
            ss.CubicSpline,
            None,
            POINTS,
            ss.Manifold(**FUNCTIONS | {"project": None} | changes, point_shape=(5, 2)),
        )


def test_missing_functions_of_a_manifold_raise():
    space = ss.Manifold(**FUNCTIONS | {"project": None}, point_shape=(5, 2))
    p, q = POINTS[:2]
    for call, what in (
        (lambda: space.dim, "made without dim="),
        (lambda: space.transport(p, q, 0 * p), "made without transport="),
        (lambda: space.random_point(np.random.default_rng(0)), "made without project="),
        (lambda: space.transvection(p, 0 * p, q), "no transvections"),
    ):
        raises(what, call)
    assert np.isinf(space.injectivity_radius) and np.isnan(space.curvature)
    assert "exp=Stiefel" in repr(space) == str(space)


@pytest.mark.parametrize(("digits", "allowed"), [(9, 1e-4), (10, 1e-5), (11, 1e-6), (12, 1e-7)])
def test_noise_of_a_logarithm_does_not_shorten_steps(digits, allowed):
    """Noise does not shrink with the steps of differences, and the shortest make most of it."""
    sphere = ss.Sphere(2)
    noisy = twin(sphere, log=lambda p, q: sphere.project_tangent(p, np.round(sphere.log(p, q), digits)))
    points = ss.geo.from_lonlat([0, 20, 40, 60], [0, 10, -5, 10])
    core = ss.CubicSpline(None, points, sphere)
    spline = ss.HermiteSpline(None, points, core.velocities, noisy)
    x = np.linspace(0, 3, 31)
    assert np.abs(spline(x, 2) - core(x, 2)).max() <= allowed * np.abs(core(x, 2)).max()
