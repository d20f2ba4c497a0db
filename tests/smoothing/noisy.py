"""Noisy data that the tests share."""

import numpy as np

import symspline as ss


def truth(space, seed=0, segments=6, step=0.6, end=10.0):
    """A smooth curve with random directions."""
    rng = np.random.default_rng(seed)
    points = [space.random_point(rng)]
    for _ in range(segments):
        v = space.random_tangent(rng, points[-1])
        points.append(space.exp(points[-1], v * step / np.sqrt(space.inner(points[-1], v, v))))
    return ss.CubicSpline(np.linspace(0, end, segments + 1), np.array(points), space)


def beside(space, points, sigma, seed=0):
    """Points with noise."""
    rng = np.random.default_rng(1000 + seed)
    return space.exp(points, sigma * space.random_tangent(rng, points))


def example(name, sigma=0.1, n=60, seed=0, **options):
    """Space, times, noisy points and the true ones."""
    space = ss.space(name)
    t = np.linspace(0, 10, n)
    points = truth(space, seed, **options)(t)
    return space, t, beside(space, points, sigma, seed), points


def rms(space, p, q):
    """Root mean squared distance."""
    return np.sqrt(np.mean(space.distance(p, q) ** 2, axis=-1))


def each(value):
    """One value, or those of the parts of a product or of poses."""
    return value if isinstance(value, tuple) else (value,)


TIGHT = {"tol": 1e-8, "max_iter": 200}
"""Steps of the search that end it, in standard deviations; the linearised solver stagnates at rounding."""


def both_solvers(*data, **options):
    """The splines of the linearised and of the full Gauss-Newton solver, which both converge."""
    splines = [ss.make_smoothing_spline(*data, method=method, **options) for method in ("linearized", "newton")]
    for spline, method in zip(splines, ("linearized", "newton"), strict=True):
        assert spline.report.converged and spline.report.method == method
    return splines


def acceleration_energy(space, spline, lam):
    """λ ∫ |∇γ'|² dt, by two Gauss points per segment."""
    h = np.diff(spline.t)[:, None]
    x = spline.t[:-1, None] + h * (0.5 + np.array([-0.5, 0.5]) / np.sqrt(3))
    at, bends = spline(x), spline(x, nu=2)
    return lam * np.sum(0.5 * h * space.inner(at, bends, bends))


def distance_to_minimum(space, points, objective, step=1e-4, seed=2):
    """How far an objective of points is from its minimum in random directions: slope over curvature."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(3):
        v = space.random_tangent(rng, points)
        here, up, down = (objective(space.exp(points, s * step * v)) for s in (0, 1, -1))
        slope, bend = (up - down) / (2 * step), (up + down - 2 * here) / step**2
        assert bend > 0
        found.append(abs(slope / bend))
    return max(found)
