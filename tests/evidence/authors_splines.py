"""Makes ``authors_splines.npz``: splines by the package of the paper's authors, bsplinelab.

The package is https://github.com/olivierverdier/bsplinelab (its setup.py says MIT), which imports
https://github.com/olivierverdier/padexp. Neither is on PyPI. To make the file anew, clone both and run, with the two
checkouts on the path::

    PYTHONPATH=bsplinelab:padexp python tests/evidence/authors_splines.py

The stored arrays were made with commit b0deb91 of bsplinelab. Nothing of the package is changed but the two numbers at
which its iteration stops: with a tolerance of 0 it makes ``SWEEPS`` sweeps, so that it ends at rounding.
"""

from pathlib import Path

import numpy as np

SWEEPS = 500
FILE = Path(__file__).with_suffix(".npz")


def unit(x):
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


def walk(rng, n, count, step):
    """Random unit vectors, each about `step` from the one before."""
    points = [unit(rng.standard_normal(n))]
    for _ in range(count - 1):
        points.append(unit(points[-1] + step * unit(rng.standard_normal(n))))
    return np.array(points)


def subspaces(rng, k, n, count, step):
    """Random n × k matrices with orthonormal columns, each near the one before."""
    points = [np.linalg.qr(rng.standard_normal((n, k)))[0]]
    for _ in range(count - 1):
        points.append(np.linalg.qr(points[-1] + step * rng.standard_normal((n, k)))[0])
    return np.array(points)


def tangent(p, v):
    """The tangential part of v at a point of a sphere or, for matrices, of a Grassmannian."""
    p, v = (x.reshape(len(p), -1) for x in (p, v))
    return v - p @ (p.T @ v)


def data_sets():
    """Name of the data, of the space, points, and velocities at the ends or None for natural ends."""
    rng = np.random.default_rng(20180308)
    frames = [[0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1], [-0.3, 0.8, 1]]
    sets = [
        ("random points, as in appendix D", "r:4", rng.uniform(size=(10, 4)), False),
        ("given velocities", "r:2", rng.uniform(size=(6, 2)), True),
        ("three points, as in appendix D", "sphere:2", np.eye(3), False),
        ("a walk", "sphere:2", walk(rng, 3, 12, 0.5), False),
        ("a walk with given velocities", "sphere:2", walk(rng, 3, 8, 0.7), True),
        ("five unit quaternions", "sphere:3", walk(rng, 4, 5, 0.8), False),
        ("a walk in five dimensions", "sphere:5", walk(rng, 6, 20, 0.3), False),
        ("lines", "gr:1,3", unit(np.array(frames, float))[..., None], False),
        ("planes", "gr:2,4", subspaces(rng, 2, 4, 6, 0.3), False),
        ("planes with given velocities", "gr:2,5", subspaces(rng, 2, 5, 5, 0.3), True),
        ("subspaces of seven dimensions", "gr:3,7", subspaces(rng, 3, 7, 9, 0.2), False),
    ]
    for name, space, points, clamped in sets:
        ends = None
        if clamped:
            ends = np.array([0.5 * rng.standard_normal(p.shape) for p in (points[0], points[-1])])
            if not space.startswith("r:"):
                pairs = zip((points[0], points[-1]), ends, strict=True)
                ends = np.array([tangent(p, v).reshape(p.shape) for p, v in pairs])
        yield name, space, points, ends


def main():
    from bspline.geometry import Flat, Grassmannian, Sphere
    from bspline.interpolation import Symmetric, cubic_spline
    from bspline.interpolation.interpolator import Interpolator

    Interpolator.tolerance, Interpolator.max_iter = 0.0, SWEEPS
    geometries = {"r": Flat, "sphere": Sphere, "gr": Grassmannian}
    arrays = {}
    for i, (name, space, points, ends) in enumerate(data_sets()):
        geometry = geometries[space.partition(":")[0]]()
        boundaries = (None, None) if ends is None else tuple(ends)
        curve = cubic_spline(Symmetric, points, boundaries=boundaries, geometry=geometry)
        # Within the segments, whose ends are points of the data.
        times = np.concatenate([k + np.linspace(0.03, 0.97, 7) for k in range(len(points) - 1)])
        values = np.array([np.asarray(curve(t)).reshape(points.shape[1:]) for t in times])
        given = np.zeros((0, *points.shape[1:])) if ends is None else ends
        arrays |= {f"{i}_name": name, f"{i}_space": space, f"{i}_points": points, f"{i}_ends": given}
        arrays |= {f"{i}_times": times, f"{i}_values": values}
    np.savez_compressed(FILE, **arrays)


if __name__ == "__main__":
    main()
