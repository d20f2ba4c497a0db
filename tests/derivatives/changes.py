"""Small changes of the data, and their effect on the curve by finite differences."""

import numpy as np
from cases import closed_walk, end_conditions, unit_tangent, walk

import symspline as ss

STEP = 2e-3


def data(case, end, seed=0, n=6, step=None):
    """Knots, points and end conditions of a curve."""
    rng = np.random.default_rng(seed)
    space = case.space
    size = step or min(0.6, case.far / 2)
    points = closed_walk(space, size, n, rng) if end == "periodic" else walk(space, size, n, rng)
    n = len(points)
    t = np.cumsum(rng.uniform(0.7, 1.3, n))
    vectors = [0.4 * unit_tangent(space, points[i], rng) for i in (0, -1)]
    bc = end_conditions(end, *vectors)
    return space, t, points, bc


def motion(space, t, points, bc, rng):
    """A random change of all data."""
    vectors = np.array([unit_tangent(space, p, rng) for p in points])
    if isinstance(bc, str) and bc == "periodic":
        vectors[-1] = space.transport(points[0], points[-1], vectors[0])
    ends = tuple(
        None if isinstance(bc, str) or isinstance(b, str) else unit_tangent(space, points[-i], rng)
        for i, b in enumerate(bc if not isinstance(bc, str) else (bc, bc))
    )
    return vectors, 0.3 * rng.normal(size=len(t)), ends


def moved(space, t, points, bc, change, size):
    """The spline through data that moved; vectors at the ends go with their points in parallel."""
    vectors, knots, ends = change
    new = space.project(space.exp(points, size * vectors))
    if isinstance(bc, str):
        if bc == "periodic":
            new[-1] = new[0]
        return ss.CubicSpline(t + size * knots, new, space, bc_type=bc)
    conditions = []
    for i, (given, end) in enumerate(zip(bc, ends, strict=True)):
        if not isinstance(given, str):
            order, vector = given
            vector = vector + size * end
            if size:
                vector = space.transport(points[-i], new[-i], vector)
            given = (order, space.project_tangent(new[-i], vector))
        conditions.append(given)
    return ss.CubicSpline(t + size * knots, new, space, bc_type=tuple(conditions))


def by_differences(space, t, points, bc, change, x, orders=(0, 1, 2)):
    """The changes of the curve and its derivatives at times x, by central differences of order four."""
    splines = {k: moved(space, t, points, bc, change, k * STEP) for k in range(-2, 3)}
    base = splines[0](x)

    def seen(k, nu):
        if nu == 0:
            return space.log(base, splines[k](x))
        return space.transport(splines[k](x), base, splines[k](x, nu))

    return [(8 * (seen(1, nu) - seen(-1, nu)) - (seen(2, nu) - seen(-2, nu))) / (12 * STEP) for nu in orders]


def inside(t, rng, n=7):
    """Times between the knots that stay there when the knots move a little."""
    x = rng.uniform(t[0] + 0.05, t[-1] - 0.05, n)
    nearest = t[np.abs(x[:, None] - t).argmin(axis=1)]
    # A time must not change its segment when the knots move by the steps of finite differences.
    return np.sort(np.where(np.abs(x - nearest) < 0.01, nearest + 0.01, x))
