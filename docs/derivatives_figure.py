"""Makes derivatives.png: how a curve on the sphere follows one of its points, and a gradient."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import symspline as ss

ANGLES = np.radians([[10, -60], [35, -35], [5, -10], [30, 20], [0, 45], [25, 70]])


def main() -> None:
    lat, lon = ANGLES.T
    points = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)
    spline = ss.CubicSpline(None, points, "sphere:2")
    figure = Figure(figsize=(10, 3.3), layout="constrained")
    moved, pulled = figure.subplots(1, 2)
    x = np.linspace(0, 5, 61)

    motion = np.zeros_like(points)
    motion[2] = spline.space.project_tangent(points[2], [0.0, 0.0, 0.25])
    _curve(moved, spline, x)
    _arrows(moved, spline(x), spline.jvp(x, points=motion), "tab:blue")
    _arrows(moved, points, motion, "tab:red")
    moved.set_title("jvp: a point moves (red), the curve with it (blue)")

    # Towards a point above the middle of a segment.
    target = spline.space.project(spline(2.5) + np.array([0, 0, 0.3]))
    gradient = spline.vjp(2.5, 2 * (spline(2.5) - target))
    _curve(pulled, spline, x)
    _arrows(pulled, spline(2.5)[None], (target - spline(2.5))[None], "tab:blue")
    _arrows(pulled, points, -0.5 * gradient.points, "tab:red")
    pulled.set_title("vjp: to move the curve (blue), move the points (red)")
    figure.savefig(Path(__file__).with_name("derivatives.png"), dpi=110)


def _curve(axes, spline, x):
    axes.plot(*_map(spline(np.linspace(x[0], x[-1], 400))), color="0.3", lw=1.2)
    axes.plot(*_map(spline.points), "o", color="0.2", ms=4)
    axes.set(aspect="equal", xlabel="longitude (degrees)", ylabel="latitude (degrees)", ylim=(-15, 60))


def _map(p):
    return np.degrees([np.arctan2(p[..., 1], p[..., 0]), np.arcsin(p[..., 2])])


def _arrows(axes, at, vectors, color):
    """Tangent vectors as they look on the map."""
    start, end = _map(at), _map(at + 1e-6 * vectors)
    move = (end - start) * 1e6
    large = np.linalg.norm(move, axis=0) > 0.05
    axes.quiver(
        *start[:, large], *move[:, large], angles="xy", scale_units="xy", scale=1, color=color, width=0.004
    )


if __name__ == "__main__":
    main()
