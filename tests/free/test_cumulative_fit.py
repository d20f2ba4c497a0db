"""`CumulativeBSpline.fit`: the least-squares curve, its minimality, weights, batches, reports and errors."""

import numpy as np
import pytest
from cases import walk
from refused import raises
from scipy.interpolate import make_lsq_spline
from stored import restored

import symspline as ss

SEED = 2020
GROUPS = [
    "so:2",
    "so:3",
    "so:4",
    "u:1",
    "u:2",
    "su:2",
    "su:3",
    "se:2",
    "se:3",
    "gl:2",
    "cgl:2",
    "aff:2",
    "sim:3",
    "sl:2",
]


def noisy(name, rng, count=120, sigma=0.05, knots=7):
    """Irregular times with a gap, noisy points near a known curve, and the knots."""
    space = ss.space(name)
    inner = np.sort(np.append(rng.uniform(0, 5, knots - 2), [0, 5]))
    t = np.sort(np.append(rng.uniform(0, 5, count - 2), [0, 5]))
    truth = ss.CumulativeBSpline(np.r_[[0] * 3, inner, [5] * 3], walk(space, 0.3, knots + 2, rng), space)
    points = truth(t)
    return t, space.exp(points, sigma * space.random_tangent(rng, points)), inner, truth


def cost(curve, t, points, weights=1.0):
    return np.sum(weights * curve.space.distance(curve(t), points) ** 2)


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_vectors_are_those_of_scipy(degree, rng):
    t = np.sort(rng.uniform(0, 10, 200))
    y, w = (
        np.stack([np.sin(t), 1e3 * np.cos(2 * t)], axis=1) + 0.1 * rng.normal(size=(200, 2)),
        rng.uniform(0.1, 5, 200),
    )
    inner = np.r_[t[0], np.sort(rng.uniform(1, 9, 6)), t[-1]]
    curve = ss.CumulativeBSpline.fit(t, y, inner, "r:2", weights=w, degree=degree)
    wanted = make_lsq_spline(t, y, np.r_[[t[0]] * degree, inner, [t[-1]] * degree], degree, w=np.sqrt(w))
    assert np.array_equal(curve.knots, wanted.t)
    assert np.abs(curve.control_points - wanted.c).max(axis=0) == pytest.approx([0, 0], abs=1e-9)
    assert np.abs(curve(t) - wanted(t)).max() < 1e-10
    assert curve.report.converged and curve.report.iterations <= 2


@pytest.mark.parametrize("name", GROUPS)
def test_exact_data_give_their_curve(name, rng):
    t, points, inner, truth = noisy(name, rng, sigma=0)
    curve = ss.CumulativeBSpline.fit(t, points, inner, name)
    assert np.abs(curve.control_points - truth.control_points).max() < 1e-9 * (1 + np.abs(points).max())
    assert curve.report.converged and curve.report.residual_sum < 1e-20 * (1 + np.abs(points).max() ** 4)


@pytest.mark.parametrize("name", GROUPS)
def test_the_curve_is_the_minimum(name, rng):
    """Independent of the Jacobians: the gradient of the cost by central differences is zero."""
    t, points, inner, _ = noisy(name, rng, sigma=0.1)
    weights = rng.uniform(0.2, 3, len(t))
    curve = ss.CumulativeBSpline.fit(t, points, inner, name, weights=weights)
    space, least = curve.space, cost(curve, t, points, weights)
    assert curve.report.converged and curve.report.residual_sum == pytest.approx(least, rel=1e-10)
    h = 1e-4
    for _ in range(12):
        step = space.random_tangent(rng, curve.control_points)
        ways = [
            cost(
                ss.CumulativeBSpline(curve.knots, space.exp(curve.control_points, e * h * step), space),
                t,
                points,
                weights,
            )
            for e in (1, -1)
        ]
        curvature = (sum(ways) - 2 * least) / h**2
        assert curvature > 0 and abs(ways[0] - ways[1]) / (2 * h) < 1e-6 * curvature


def test_weights_and_repeated_times(rng):
    t, points, inner, _ = noisy("so:3", rng, count=60, knots=5)
    weights = np.where(np.arange(60) % 3 == 1, 0.0, 1.0)
    kept = weights > 0
    outlier = points.copy()
    outlier[~kept] = np.eye(3)
    some = ss.CumulativeBSpline.fit(t, outlier, inner, "so:3", weights=weights)
    only = ss.CumulativeBSpline.fit(t[kept], points[kept], inner, "so:3")
    assert np.abs(some.control_points - only.control_points).max() < 1e-9
    # A datum with weight two is a datum that is given twice. The sum of squares does not see smaller steps.
    twice = ss.CumulativeBSpline.fit(np.repeat(t, 2), np.repeat(points, 2, axis=0), inner, "so:3")
    double = ss.CumulativeBSpline.fit(t, points, inner, "so:3", weights=np.full(60, 2.0))
    assert np.abs(twice.control_points - double.control_points).max() < 3e-8


def test_batches_products_and_files(rng):
    t, turns, inner, _ = noisy("so:3", rng)
    _, other, _, _ = noisy("so:3", rng)
    path = np.cumsum(rng.normal(size=(120, 3)), axis=0)
    both = ss.CumulativeBSpline.fit(t, np.stack([turns, other]), inner, "so:3")
    alone = [ss.CumulativeBSpline.fit(t, own, inner, "so:3") for own in (turns, other)]
    assert np.array_equal(both.control_points, [own.control_points for own in alone])
    assert both.report.converged.tolist() == [True, True] and both[1].report == alone[1].report
    product = ss.CumulativeBSpline.fit(t, (turns, path), inner, "so:3 x r:3")
    assert np.array_equal(product.control_points[0], alone[0].control_points)
    flat = ss.CumulativeBSpline.fit(t, path, inner, "r:3")
    assert product.report.residual_sum == pytest.approx(flat.report.residual_sum + alone[0].report.residual_sum)
    for curve in (both, product):
        again = restored(curve)
        assert again == curve and np.array_equal(again.report.step, curve.report.step)


def test_a_product_has_converged_if_all_factors_have(rng):
    t = np.linspace(0, 1, 40)
    turns = 2.5 * np.sin(6 * t)[:, None] * [0.3, 0.4, 1] + 0.3 * rng.normal(size=(40, 3))
    data = {"r:1": t[:, None], "so:3": ss.rotations.from_rotation_vectors(turns)}
    # A vector space needs one step.
    options = {"max_iter": 2, "on_failure": "ignore"}
    line, turning = (ss.CumulativeBSpline.fit(t, y, 6, name, **options).report for name, y in data.items())
    assert line.converged and not turning.converged
    both = ss.CumulativeBSpline.fit(t, tuple(data.values()), 6, " x ".join(data), **options).report
    assert not both.converged and both.step == turning.step > line.step


def test_the_report_has_the_length_of_the_last_step(rng):
    """The largest coordinate of the step to the last iterate, relative to that of steps between control points."""
    t, y, inner, _ = noisy("so:3", rng)
    p, q = (
        ss.CumulativeBSpline.fit(t, y, inner, "so:3", max_iter=n, on_failure="ignore").control_points for n in (1, 2)
    )
    step, between = (
        np.abs(ss.rotations.as_rotation_vectors(np.swapaxes(a, 1, 2) @ b)).max() for a, b in ((p, q), (p[:-1], p[1:]))
    )
    report = ss.CumulativeBSpline.fit(t, y, inner, "so:3", max_iter=2, on_failure="ignore").report
    assert 1e-6 < report.step == pytest.approx(step / between, rel=1e-6)


def test_a_number_of_knots_and_unequal_weights_of_curves(rng):
    t, points, _, _ = noisy("so:3", rng)
    curve = ss.CumulativeBSpline.fit(t, points, 8, "so:3")
    assert np.allclose(curve.t, np.linspace(0, 5, 8))
    none = ss.CumulativeBSpline.fit(None, points, 8, "so:3")
    assert none.domain == (0.0, 119.0)
    rows = ss.CumulativeBSpline.fit(t, np.stack([points] * 2), 8, "so:3", weights=rng.uniform(1, 2, (2, 120)))
    assert not np.array_equal(rows.control_points[0], rows.control_points[1])


def test_invalid_input_and_failures(rng):
    t, points, inner, _ = noisy("so:3", rng, sigma=0.3)
    fit = ss.CumulativeBSpline.fit
    raises("not a group", fit, None, np.eye(3), 2, "sphere:2")
    raises("t must be 120 real numbers", fit, t[:-1], points, inner, "so:3")
    raises("t.1. = .* is before t.0.", fit, t[::-1], points, inner, "so:3")
    raises("t.3. = nan is not finite", fit, np.where(np.arange(120) == 3, np.nan, t), points, inner, "so:3")
    raises("must cover the times", fit, t, points, inner[:-1], "so:3")
    raises("knots.1. = .* is not after", fit, t, points, [0, 0, 5], "so:3")
    raises("knots = 400 exceeds", fit, t, points, 400, "so:3")
    raises("knots must be at least 2", fit, t, points, 1, "so:3")
    raises("too few data determine it", fit, t, points, np.r_[0, 1 + 1e-9 * np.arange(5), 5], "so:3")
    raises("weights.2. = -1", fit, t, points, inner, "so:3", weights=np.where(np.arange(120) == 2, -1.0, 1))
    raises("weights has shape", fit, t, points, inner, "so:3", weights=np.ones(7))
    raises("tol must be", fit, t, points, inner, "so:3", tol=-1)
    raises("on_failure must be", fit, t, points, inner, "so:3", on_failure="no")
    raises("points.4.", fit, t, np.where(np.arange(120)[:, None, None] == 4, np.nan, points), inner, "so:3")
    error = raises("did not converge", fit, t, points, inner, "so:3", max_iter=1, error=ss.ConvergenceError)
    assert not error.spline.report.converged
    with pytest.warns(ss.ConvergenceWarning, match="did not converge"):
        curve = fit(t, points, inner, "so:3", max_iter=1, on_failure="warn")
    assert curve == error.spline
    flips = np.where((np.arange(120) > 60)[:, None, None], np.diag([-1.0, -1, 1]), np.eye(3))
    raises("are not joined by a unique", fit, t, flips, inner, "so:3", error=ss.CutLocusError)
