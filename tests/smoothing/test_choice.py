"""The quality of the chosen λ, of the bands and of robust losses, on fixed random data."""

import numpy as np
import pytest
from noisy import beside

import symspline as ss


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_robust_curves_of_numbers_are_where_their_loss_is_least(loss):
    rng = np.random.default_rng(1)
    t = np.linspace(0, 1, 30)
    y = np.sin(5 * t) + 0.1 * rng.standard_normal(30)
    y[[4, 17]] += 3
    spline = ss.make_smoothing_spline(t, y[:, None], "r:1", 1e-3, loss=loss, sigma=0.1, tol=1e-9, max_iter=400)
    # χ²₁ is below these with probability .82 and .95.
    corner = 0.1 * {"huber": 1.3407550336902165, "cauchy": 1.959963984540054}[loss]

    def value(points):
        q = (points - y) ** 2 / corner**2
        rho = np.where(q > 1, 2 * np.sqrt(q) - 1, q) if loss == "huber" else np.log1p(q)
        energy = ss.CubicSpline(t, points[:, None], "r:1").bending_energy()
        return corner**2 * rho.sum() + 1e-3 * energy

    points = spline.points[:, 0]
    here = value(points)
    for direction in rng.standard_normal((5, 30)):
        up, down = value(points + 1e-5 * direction), value(points - 1e-5 * direction)
        slope, bend = (up - down) / 2e-5, (up + down - 2 * here) / 1e-10
        assert bend > 0 and abs(slope / bend) < 1e-6


@pytest.mark.parametrize(
    ("name", "length", "lam"),
    [("sphere:2", 4.0, 0.1), ("so:3", 5.0, 1.0), ("hyperbolic:2", 3.0, 0.1)],
)
def test_degrees_of_freedom_are_the_trace_of_the_influence(name, length, lam):
    """The trace by differences of curves of the full Gauss-Newton solver.

    The data lie on a geodesic, where the influence is that of small changes.
    """
    space, rng = ss.space(name), np.random.default_rng(1)
    p = space.random_point(rng)
    v = space.random_tangent(rng, p)
    t = np.linspace(0, 1, 15)
    data = space.exp(p, (length / space.norm(p, v)) * np.multiply.outer(t, v))
    frame = space.frame(data)
    step = 1e-4
    moved = np.broadcast_to(data, (len(t), space.dim, 2, *data.shape)).copy()
    for k in range(len(t)):
        for way, sign in enumerate((step, -step)):
            moved[k, :, way, k] = space.exp(data[k], sign * frame[k])
    curves = ss.make_smoothing_spline(t, moved, space, lam, tol=1e-9, max_iter=100, method="newton")
    ends = np.stack([curves(t)[k, :, :, k] for k in range(len(t))])
    logs = space.log(data[:, None, None], ends)
    followed = space.inner(data[:, None], logs[:, :, 0] - logs[:, :, 1], frame) / (2 * step)
    # The flat matrix has the curvature at knots only: an error of second order in their distance.
    found = ss.make_smoothing_spline(t, data, space, lam).df
    assert found == pytest.approx(np.sum(followed) / space.dim, rel=6e-4)


def test_knots_of_a_batch_are_enough_for_its_roughest_curve():
    rng, sphere = np.random.default_rng(0), ss.Sphere(2)
    t = np.sort(rng.uniform(0, 10, 2000))
    height = 0.5 * np.sin(6 * t)
    wavy = np.stack([np.cos(t) * np.cos(height), np.sin(t) * np.cos(height), np.sin(height)], -1)
    straight = np.stack([np.cos(t / 5), np.sin(t / 5), 0 * t], -1)
    noisy = np.array([beside(sphere, curve, 0.05) for curve in (wavy, straight)])
    alone = ss.make_smoothing_spline(t, noisy[0], sphere)
    for stiff in (1e9, 1e12):
        both = ss.make_smoothing_spline(t, noisy, sphere, np.array([alone.lam, stiff]))
        assert both.df[0] == pytest.approx(alone.df, rel=0.01) and both.df[1] == pytest.approx(2, abs=0.05)
        assert sphere.distance(both(t)[0], alone(t)).max() < 0.1 * alone.std(5.0)


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
def test_a_lambda_that_does_not_settle_is_reported():
    """Random walks for which the choice at one curve leads to another curve, with another choice, and back."""
    sphere, unsettled = ss.Sphere(2), []
    for seed, gamma, weighed in ((826, 1.4, False), (1129, 1.0, True)):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(4, 40))
        t, base = np.cumsum(rng.exponential(size=n)), sphere.random_point(rng)
        if weighed:
            walk = np.array([2.0, 0, 0]) + np.cumsum(0.3 * rng.standard_normal((n, 3)), axis=0)
        else:
            start = np.repeat(base[None], n, 0)
            walk = sphere.exp(start, 10 ** rng.uniform(-1, 0) * sphere.random_tangent(rng, start))
        points = walk / np.linalg.norm(walk, axis=1, keepdims=True)
        weights = 10 ** rng.uniform(-3, 3, n) if weighed else None
        spline = ss.make_smoothing_spline(t, points, sphere, gamma=gamma, weights=weights, on_failure="ignore")
        unsettled.append(not spline.report.converged)
        # The λ that the message proposes has a curve.
        assert ss.make_smoothing_spline(t, points, sphere, spline.lam, weights=weights).report.converged
    # Rounding may settle one of them elsewhere.
    assert any(unsettled)
