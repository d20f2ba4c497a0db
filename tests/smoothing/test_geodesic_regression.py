"""Smoothing with an infinite λ: the geodesic with the least sum of squared distances."""

import numpy as np
import pytest
from refused import raises
from scipy.optimize import least_squares

import symspline as ss

# Spaces, and the length of the geodesic: short ones, nearly as long as the cut locus allows, and several turns.
LENGTHS = [
    *(("r:3", 1.0), ("sphere:2", 1.0), ("sphere:2", 2.6), ("sphere:2", 9.0), ("so:3", 1.0), ("so:3", 7.0)),
    *(("spd:3", 1.0), ("h:2", 2.0), ("cp:2", 1.0), ("gr:2,5", 1.0), ("u:2", 1.0), ("so:2", 20.0)),
]


def noisy_geodesic(space, rng, length, count=25, noise=0.05):
    """Irregular times, scaled times around zero, a point and a velocity, and noisy data."""
    t = np.cumsum(rng.uniform(0.2, 2.0, count))
    tau = (t - t.mean()) / np.ptp(t)
    p = space.random_point(rng)
    v = space.random_tangent(rng, p)
    v = v * (length / space.norm(p, v))
    truth = along(space, p, v, tau)
    return t, tau, p, v, space.exp(truth, noise * space.random_tangent(rng, truth))


def along(space, p, v, tau):
    return space.exp(p, tau.reshape(-1, *[1] * v.ndim) * v)


def best_geodesic(space, tau, p, v, points):
    """Minimise over a point and a velocity, by SciPy with differences as derivatives."""
    frame, at_data = space.frame(p), space.frame(points)
    dim = len(frame)

    def geodesic(x):
        q = space.exp(p, np.tensordot(x[:dim], frame, 1))
        return along(space, q, space.transport(p, q, v + np.tensordot(x[dim:], frame, 1)), tau)

    def residuals(x):
        return space.inner(points[:, None], at_data, space.log(points, geodesic(x))[:, None]).ravel()

    found = least_squares(residuals, np.zeros(2 * dim), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return geodesic(found.x), 2 * found.cost


@pytest.mark.parametrize(("name", "length"), LENGTHS)
def test_the_geodesic_minimises_the_squared_distances(name, length):
    space, rng = ss.space(name), np.random.default_rng(0)
    t, tau, p, v, points = noisy_geodesic(space, rng, length)
    best, least = best_geodesic(space, tau, p, v, points)
    spline = ss.make_smoothing_spline(t, points, space, lam=np.inf, tol=1e-9)
    assert space.distance(spline(t), best).max() < 1e-7
    assert np.sum(space.distance(spline(t), points) ** 2) == pytest.approx(least, abs=1e-7)
    assert spline.bending_energy() < 1e-14 and spline.report.lam == np.inf and not spline.report.at_bound
    assert spline.df == pytest.approx(2, abs=1e-5)
    assert len(spline.t) == 2 if length < 2.7 else len(spline.t) > 2
    # The tolerance of other smoothing splines is a fraction of a standard deviation.
    usual = ss.make_smoothing_spline(t, points, space, lam=np.inf)
    assert space.distance(usual(t), best).max() < 1e-4


def test_flat_regression_is_ordinary_least_squares():
    rng = np.random.default_rng(1)
    t = 1e5 + np.cumsum(rng.uniform(0.2, 2.0, 40))
    y = np.stack([3e4 + 2 * t, -1e-3 * t], axis=-1) + rng.standard_normal((40, 2)) * [1.0, 1e-3]
    w = rng.uniform(0.1, 2, 40)
    spline = ss.make_smoothing_spline(t, y, "r:2", lam=np.inf, weights=w)
    centred = t - np.average(t, weights=w)
    design = np.stack([np.ones(40), centred], axis=-1)
    solution = np.linalg.lstsq(np.sqrt(w)[:, None] * design, np.sqrt(w)[:, None] * y, rcond=None)[0]
    np.testing.assert_allclose(spline(t), design @ solution, rtol=1e-12)
    np.testing.assert_allclose(spline(t, nu=1), np.broadcast_to(solution[1], (40, 2)), rtol=1e-9)
    # The standard error of a regression line.
    rss = np.sum(w[:, None] * (y - design @ solution) ** 2)
    sigma = np.sqrt(rss / (2 * (40 - 2)))
    line = sigma * np.sqrt(np.sum(design @ np.linalg.inv(design.T @ (w[:, None] * design)) * design, axis=1))
    np.testing.assert_allclose(spline.std(t), line, rtol=1e-6)


def test_products_and_batches_are_regressions_of_each():
    rng = np.random.default_rng(2)
    sphere, rotations = ss.Sphere(2), ss.SpecialOrthogonal(3)
    t = np.linspace(0, 3, 20)
    data = [[noisy_geodesic(space, rng, 1.5, 20)[4] for _ in range(3)] for space in (sphere, rotations)]
    points = tuple(np.stack(own) for own in data)
    both = ss.make_smoothing_spline(t, points, "sphere:2 x so:3", lam=np.inf)
    for space, own, curve in zip((sphere, rotations), points, both(t), strict=True):
        for i in range(3):
            alone = ss.make_smoothing_spline(t, own[i], space, lam=np.inf)
            assert space.distance(alone(t), curve[i]).max() < 1e-6
    assert both.bending_energy().max() < 1e-14 and all(np.isinf(r.lam).all() for r in both.report)
    # One factor is a geodesic, the other is smooth.
    mixed = ss.make_smoothing_spline(t, (points[0][0], points[1][0]), "sphere:2 x so:3", lam=(np.inf, 1e-3))
    assert sphere.distance(mixed(t)[0], both(t)[0][0]).max() < 1e-4
    assert mixed.report[0].lam == np.inf and mixed.report[1].lam == 1e-3
    curves = ss.make_smoothing_spline(t, points[0], sphere, lam=[np.inf, 1e-3, 1.0], where=[True, True, False])
    np.testing.assert_array_equal(curves.report.lam[:2], [np.inf, 1e-3])
    assert sphere.distance(curves(t)[0], both(t)[0][0]).max() < 1e-4


def test_dates_losses_and_poses():
    rng = np.random.default_rng(3)
    t, _, _, _, points = noisy_geodesic(ss.Sphere(2), rng, 1.0)
    dates = np.datetime64("2026-03-01") + (1e6 * t).astype("timedelta64[us]")
    dated = ss.make_smoothing_spline(dates, points, "sphere:2", lam=np.inf)
    plain = ss.make_smoothing_spline((dates - dates[0]) / np.timedelta64(1, "s"), points, "sphere:2", lam=np.inf)
    np.testing.assert_allclose(dated(dates), plain((dates - dates[0]) / np.timedelta64(1, "s")), atol=1e-9)
    outlier = points.copy()
    outlier[7] = ss.Sphere(2).random_point(rng)
    robust = ss.make_smoothing_spline(t, outlier, "sphere:2", lam=np.inf, loss="cauchy")
    clean = ss.make_smoothing_spline(t, points, "sphere:2", lam=np.inf)
    assert ss.Sphere(2).distance(robust(t), clean(t)).max() < 0.05
    turns = noisy_geodesic(ss.SpecialOrthogonal(3), rng, 1.0)[4]
    positions = np.outer(t, [1, 2, 3]) + rng.standard_normal((25, 3))
    poses = ss.make_smoothing_spline(t, ss.poses.join(turns, positions), "se:3", lam=np.inf)
    apart = ss.make_smoothing_spline(t, (turns, positions), "so:3 x r:3", lam=np.inf)
    np.testing.assert_allclose(poses(t)[:, :3, 3], apart(t)[1], atol=1e-3)
    assert ss.SpecialOrthogonal(3).distance(poses(t)[:, :3, :3], apart(t)[0]).max() < 1e-4


def test_conditions_that_no_geodesic_has_raise():
    t, y = np.arange(9.0), np.zeros((9, 1))
    for options, name in (
        ({"bc_type": "periodic"}, "bc_type"),
        ({"bc_type": "clamped"}, "bc_type"),
        ({"penalty": "jerk"}, "penalty"),
    ):
        with pytest.raises(ss.ValidationError, match=f"lam=inf fits a geodesic, whose {name} is"):
            ss.make_smoothing_spline(t, y, "r:1", lam=np.inf, **options)
    raises("lam must be >= 0", ss.make_smoothing_spline, t, y, "r:1", lam=-np.inf)
    raises("sigma must be finite", ss.make_smoothing_spline, t, y, "r:1", sigma=np.inf)
