"""
How a curve is made of geodesics (Figs. 1 and 4)
================================================

A segment of the spline is a cubic Bézier curve on the space. De Casteljau's algorithm draws it by nothing but
geodesics.
"""

# %%
# The naive way
# -------------
# The cubic Bézier polynomial of the same four control points, in space: it leaves the sphere.

from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

sphere = ss.Sphere(2)
control = ss.geo.from_lonlat([-50, -35, 30, 55], [-20, 45, 50, -10])
t = np.linspace(0, 1, 200)[:, None]
p0, p1, p2, p3 = control
polynomial = (1 - t) ** 3 * p0 + 3 * t * (1 - t) ** 2 * p1 + 3 * t**2 * (1 - t) * p2 + t**3 * p3
print(f"the polynomial is as deep as {1 - np.linalg.norm(polynomial, axis=1).min():.2f} under the sphere")

# %%
# De Casteljau's algorithm (Fig. 1)
# ---------------------------------
# On each of the three geodesics between the control points go to t = 0.25; on the two geodesics between these points
# again, and on the last one. What is left is the point of the curve.


def de_casteljau(points, t):
    """All points of the construction, level by level."""
    levels = [points]
    while len(levels[-1]) > 1:
        levels.append(sphere.geodesic(levels[-1][:-1], levels[-1][1:], t))
    return levels


def draw_geodesics(axes, points, **style):
    for p, q in pairwise(points):
        axes.plot(*sphere.geodesic(p, q, np.linspace(0, 1, 50)).T[[1, 2]], **style)


levels = de_casteljau(control, 0.25)
curve = ss.BezierCurve(control, sphere)
print(f"compiled and by hand: {sphere.distance(curve(0.25), levels[-1][0]):.0e} apart")


def globe(axes, title):
    axes.add_patch(plt.Circle((0, 0), 1, facecolor="0.97", edgecolor="0.7"))
    axes.set(aspect="equal", xlim=(-1.02, 1.02), ylim=(-0.5, 1.02), title=title)
    axes.set_axis_off()


figure, left = plt.subplots(figsize=(8, 5), layout="constrained")
globe(left, "Fig. 1: de Casteljau's algorithm at t = 0.25")
left.plot(*polynomial.T[[1, 2]], color="0.6", linestyle=":", label="polynomial")
left.plot(*curve(t[:, 0]).T[[1, 2]], "k", linewidth=2, label="curve")
for points, colour in zip(levels, ("C0", "C1", "C2", "C3"), strict=True):
    draw_geodesics(left, points, color=colour)
    left.plot(*points.T[[1, 2]], "o", color=colour)
left.legend(loc="lower center")

# %%
# From velocities to control points (Fig. 4)
# ------------------------------------------
# A spline has its points pᵢ and velocities vᵢ there, and from these its control points: qᵢ⁺ = exp(pᵢ, vᵢ/3) and
# qᵢ₊₁⁻ = exp(pᵢ₊₁, −vᵢ₊₁/3). (The paper's vᵢ are these thirds.)

data = ss.geo.from_lonlat([-60, -15, 20, 60], [0, 45, 0, 30])
spline = ss.CubicSpline(None, data, sphere)
plus, minus = sphere.exp(data, spline.velocities / 3), sphere.exp(data, -spline.velocities / 3)
np.testing.assert_allclose(spline.control_points[:, 1], plus[:-1], atol=1e-14)
np.testing.assert_allclose(spline.control_points[:, 2], minus[1:], atol=1e-14)

figure, right = plt.subplots(figsize=(8, 5), layout="constrained")
globe(right, "Fig. 4: velocities and control points")
right.plot(*spline(np.linspace(0, 3, 300)).T[[1, 2]], "k", linewidth=2)
for i in range(4):
    ends = [minus[i]] * (i > 0) + [data[i]] + [plus[i]] * (i < 3)
    draw_geodesics(right, ends, color="C0")
right.plot(*data.T[[1, 2]], "ko")
right.plot(*plus[:-1].T[[1, 2]], "o", color="C0", label="$q_i^+$")
right.plot(*minus[1:].T[[1, 2]], "s", color="C1", label="$q_i^-$")
right.legend(loc="lower center")
plt.show()
