"""Rounding errors below the tolerance of a fit are not a failure."""

import numpy as np
import pytest
from scipy.linalg import expm

import symspline as ss


def ellipsoids(condition):
    """Error ellipsoids of fixed shape that turn by 2.5 degrees per step."""
    basis = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    turn = np.array([[0, 1.0, 0.5], [-1, 0, 0.3], [-0.5, -0.3, 0]])
    turned = [basis @ expm(0.3 * t * turn) for t in np.linspace(0, 1, 8)]
    points = np.array([(q * np.geomspace(1, 1 / condition, 3)) @ q.T for q in turned])
    return (points + points.swapaxes(1, 2)) / 2


def test_matrices_of_condition_1e9_converge_to_their_rounding():
    points = ellipsoids(1e9)
    loose = ss.CubicSpline(None, points, "spd:3", tol=1e-6)
    assert loose.report.converged and loose.report.residual <= 1e-6
    np.testing.assert_allclose(loose(np.arange(8.0)), points, atol=1e-6)
    # The errors of the curve are 1.7e-7 of its largest speed, by a computation with 60 digits.
    curve = ss.CubicSpline(None, points, "spd:3")
    assert curve.report.converged and 1e-8 < curve.report.residual < 1e-7
    x = np.linspace(0, 7, 50)
    speed = ss.space("spd:3").norm(points, curve.velocities).max()
    assert ss.space("spd:3").distance(curve(x), loose(x)).max() < 1e-6 * speed


def test_rounding_errors_that_spoil_a_curve_are_an_error():
    """The velocities of condition 1e11 are accurate, but the curve misses its points by 1e-5 to 4 % of its speed: the
    rounding of the points, which is that of the processor, decides."""
    with pytest.raises(ss.ConvergenceError, match=r"rounding errors of the curve are \d\..e-0\d .*put points") as e:
        ss.CubicSpline(None, ellipsoids(1e11), "spd:3", tol=1e-6)
    assert not e.value.spline.report.converged and e.value.value == e.value.spline.report.residual
    with pytest.raises(ss.ConvergenceError, match=r"between points\[\d\] and points\[\d\] has no significant digits"):
        ss.CubicSpline(None, ellipsoids(1e12), "spd:3")


def in_the_disc(radius):
    angles = np.linspace(0, 1, 6)
    return ss.convert.ball_to_hyperboloid(radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1))


# Points of the C² curve through in_the_disc(0.999) at the times 0.5, 1.25 and 2.5, from a solution with 80 digits.
EXACT = np.array(
    [
        [90.286575900356864, 88.492470894037619, 17.881509524612445],
        [93.027405502930086, 91.157180322360094, 18.532853268811916],
        [10.016559550420824, 8.7464417031900481, 4.7782028797262879],
    ]
)


@pytest.mark.parametrize("tol", [1e-12, 1e-9, 1e-7])
def test_points_near_the_rim_of_the_disc(tol):
    curve = ss.CubicSpline(None, in_the_disc(0.999), "h:2", tol=tol)
    assert curve.report.converged and curve.report.residual < 1e-7
    errors = ss.Hyperbolic(2).distance(curve([0.5, 1.25, 2.5]), EXACT)
    assert errors.max() < 1e-6 * ss.Hyperbolic(2).norm(curve.points, curve.velocities).max()


@pytest.mark.parametrize("tol", [1e-12, 1e-7])
def test_points_nearer_to_the_rim_have_no_accurate_curve(tol):
    with pytest.raises(ss.ConvergenceError, match="rounding errors of the curve"):
        ss.CubicSpline(None, in_the_disc(0.99999), "h:2", tol=tol)


@pytest.mark.parametrize(("name", "low", "high"), [("h:2", 6, 20), ("h:5", 6, 20), ("spd:2", 6, 34)])
def test_two_far_points_are_joined_by_their_geodesic(name, low, high):
    space = ss.space(name)
    middle = np.eye(2) if name == "spd:2" else np.eye(space.dim + 1)[0]
    for distance in np.linspace(low, high, 13):
        rng = np.random.default_rng(int(distance))
        v = space.random_tangent(rng, middle)
        ends = [space.exp(middle, s * distance / 2 * v / space.norm(middle, v)) for s in (-1, 1)]
        points = space.project(np.array(ends))
        # Velocities at points far out are not accurate to more digits, although the geodesic is.
        curve = ss.CubicSpline([1, 3], points, space, tol=1e-12 if distance < 18 else 1e-5)
        assert curve.report.converged
        # Points of large norm are not accurate to more digits.
        x = np.array([1.5, 2, 2.25])
        part = ((x - 2) / 2 * distance).reshape(-1, *[1] * v.ndim)
        exact = space.exp(middle, part * v / space.norm(middle, v))
        rounding = np.finfo(float).eps * space._rounding(points).max()
        assert space.distance(curve(x), exact).max() < 1e-10 + 1e3 * rounding


def test_the_best_iterate_within_the_tolerance_has_converged():
    """The last iterate of a solver may be worse than an earlier one."""
    space, rng = ss.Hyperbolic(2), np.random.default_rng(0)
    origin = np.array([1.0, 0, 0])
    points = np.array([space.exp(origin, 3 * space.random_tangent(rng, origin)) for _ in range(8)])
    for max_iter in (20, 45, 60, 90):
        how = {"method": "quasi-newton", "max_iter": max_iter, "on_failure": "ignore"}
        best = ss.CubicSpline(None, points, space, tol=1e-14, **how)
        assert not best.report.converged
        again = ss.CubicSpline(None, points, space, tol=1.01 * best.report.residual, **how)
        assert again.report.converged and again.report.residual <= 1.01 * best.report.residual
