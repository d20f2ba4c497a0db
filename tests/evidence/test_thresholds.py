"""The multipliers of Algorithm 1 for zigzags, and their thresholds: `docs/theory/thresholds.md`."""

import numpy as np
import pytest
import thresholds_figure
from scipy.optimize import brentq

import symspline as ss


@pytest.mark.parametrize("name", ["S²", "H²"])
def test_multipliers_of_a_sweep(name):
    space, formula, most = thresholds_figure.SPACES[name]
    for step in np.linspace(0.1, most, 7):
        assert thresholds_figure.multiplier(space, step) == pytest.approx(formula(step), rel=1e-5)


@pytest.mark.parametrize(
    ("name", "step", "waves"), [("S²", 1.0, 40), ("S²", 1.25, 40), ("H²", 1.5, 40), ("H²", 2.4, 40)]
)
def test_no_other_wave_is_multiplied_by_more(name, step, waves):
    space, formula, _ = thresholds_figure.SPACES[name]
    p = thresholds_figure.zigzag(space, step, waves)[:-1]
    matrix = np.empty((2 * waves, 2 * waves))
    # Coordinates along the geodesic and perpendicular to it.
    frame = np.stack(
        [space.log(p, np.roll(p, 1, axis=0)) / step * np.where(np.arange(waves) % 2, 1, -1)[:, None]] * 2, 1
    )
    frame[:, 1] = [0.0, 0.0, 1.0]
    for column in range(2 * waves):
        v = np.zeros_like(p)
        v[column // 2] = 1e-6 * frame[column // 2, column % 2]
        moved = thresholds_figure.swept(space, p, v) / 1e-6
        matrix[:, column] = space.inner(p[:, None], frame, moved[:, None]).ravel()
    assert np.abs(np.linalg.eigvals(matrix)).max() == pytest.approx(abs(formula(step)), rel=1e-5)


@pytest.mark.parametrize(("name", "threshold"), [("S²", 1.306542374), ("H²", 2.575678910)])
def test_the_iteration_converges_below_the_threshold_only(name, threshold):
    space, formula, _ = thresholds_figure.SPACES[name]
    assert brentq(lambda d: abs(formula(d)) - 1, 1, 3) == pytest.approx(threshold, abs=2e-9)
    rng = np.random.default_rng(0)
    for step, converges in ((threshold - 0.06, True), (threshold + 0.06, False)):
        points = thresholds_figure.zigzag(space, step)
        near = space.exp(points, 1e-5 * space.random_tangent(rng, points))
        near[-1] = near[0]
        options = {"bc_type": "periodic", "on_failure": "ignore", "check": False}
        report = ss.CubicSpline(None, near, space, method="fixed-point", max_iter=1500, **options).report
        height = np.abs(
            ss.CubicSpline(None, near, space, method="fixed-point", max_iter=1500, **options).velocities[:, 2]
        )
        if converges:
            assert report.converged and report.rate < abs(formula(step)) + 1e-3 and height.max() < 1e-2
        else:
            assert not report.converged or height.max() > 0.1


def test_two_splines_beyond_the_threshold():
    space = ss.Sphere(2)
    points = thresholds_figure.zigzag(space, 1.4)
    p, v = points[:-1], np.zeros((40, 3))
    v[:, 2] = 0.01 * (-1.0) ** np.arange(40)
    for _ in range(3000):
        v = thresholds_figure.swept(space, p, v)
    assert np.abs(thresholds_figure.swept(space, p, v) - v).max() < 1e-13
    velocities = 3 * np.concatenate([v, v[:1]])
    symmetric, loops = (ss.HermiteSpline(None, points, u, space) for u in (0 * velocities, velocities))
    # Both are C².
    for spline in (symmetric, loops):
        accelerations = [spline(np.arange(1, 40) + side * 1e-9, 2) for side in (-1, 1)]
        np.testing.assert_allclose(*accelerations, atol=1e-7)
    assert loops.bending_energy() < 0.98 * symmetric.bending_energy()


def test_the_second_solution_grows_from_the_threshold():
    """Alternating vectors ±x n solve (13) at steps that increase with x from the threshold on."""
    space, n = ss.Sphere(2), np.array([0.0, 0.0, 1.0])

    def excess(step, x):
        a, b = (np.array([np.cos(step / 2), s * np.sin(step / 2), 0.0]) for s in (-1, 1))
        w = space.log(a, space.transvection(a, -x * n, space.exp(b, x * n)))
        w -= space.log(a, space.transvection(a, x * n, space.exp(b, -x * n)))
        assert np.abs(w[:2]).max() < 1e-14
        return w[2] / x - 2

    for x, step in ((1e-3, 1.3065), (0.1, 1.3124), (0.3, 1.3609)):
        assert brentq(excess, 1, 1.9, args=(x,)) == pytest.approx(step, abs=6e-5)
