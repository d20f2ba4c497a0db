"""
What makes the curve C² (Figs. 2 and 3)
=======================================

Bézier curves that share the velocity at a point make a C¹ curve. One more condition, (13) of the paper, makes it C².
"""

# %%
# The naive way
# -------------
# Velocities from the neighbours, as in Catmull–Rom splines: half the way from the point before to the point after.
# Speed is continuous, acceleration jumps at every point.

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

sphere = ss.Sphere(2)
points = ss.geo.from_lonlat([-60, -10, 15, 65, 90], [0, 40, -5, 30, 0])
t = np.arange(5.0)

halves = (sphere.log(points[1:-1], points[2:]) - sphere.log(points[1:-1], points[:-2])) / 2
first, last = sphere.log(points[0], points[1]), -sphere.log(points[-1], points[-2])
hermite = ss.HermiteSpline(t, points, np.stack([first, *halves, last]), sphere)
spline = ss.CubicSpline(t, points, sphere)

# %%
# Movement and logarithm (Fig. 2)
# -------------------------------
# The movement E_p(v) is the motion of the whole space that takes p along its geodesic: `transvection`. It moves every
# other point x, too. The logarithm is the v that takes p to q.

p, q, x = points[1], points[2], points[3]
v = sphere.log(p, q)
path = np.stack([sphere.transvection(p, s * v, x) for s in np.linspace(0, 1, 50)])
assert sphere.distance(sphere.transvection(p, v, p), q) < 1e-14

# %%
# The condition (Fig. 3)
# ----------------------
# At pᵢ, with the control points qᵢ± on either side and vᵢ = log(pᵢ, qᵢ⁺) = −log(pᵢ, qᵢ⁻), two sums of two vectors must
# be the same, for knots at equal distances:
#
# .. code-block:: text
#
#     log(pᵢ, E(−vᵢ)·qᵢ₊₁⁻) + log(pᵢ, qᵢ⁻)  =  log(pᵢ, E(vᵢ)·qᵢ₋₁⁺) + log(pᵢ, qᵢ⁺)
#
# In the picture the geodesics of these vectors are dashed green and dotted purple, as in Fig. 3. For the curve of
# Catmull and Rom they differ; the solver makes the difference zero.


def sides(curve, i):
    """The points that the four vectors at point i lead to, two on either side of (13)."""
    p, (before, after) = curve.points[i], curve.control_points[i - 1 : i + 1]
    v = sphere.log(p, after[1])
    return (sphere.transvection(p, -v, after[2]), before[2]), (sphere.transvection(p, v, before[1]), after[1])


def defect(curve, i):
    left, right = (sum(sphere.log(curve.points[i], q) for q in side) for side in sides(curve, i))
    return np.linalg.norm(left - right)


for name, curve in (("Catmull–Rom", hermite), ("C² spline", spline)):
    print(f"{name}: the two sides differ by", *(f"{defect(curve, i):.1e}" for i in (1, 2, 3)))

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
left.add_patch(plt.Circle((0, 0), 1, facecolor="0.97", edgecolor="0.7"))
left.set(aspect="equal", xlim=(-1.02, 1.02), ylim=(-0.5, 1.02), title="Figs. 2 and 3")
left.set_axis_off()
fine = np.linspace(0, 4, 400)
left.plot(*spline(fine).T[[1, 2]], "k", linewidth=2)
left.plot(*sphere.geodesic(p, q, np.linspace(0, 1, 50)).T[[1, 2]], "C0", label="from p to q")
left.plot(*path.T[[1, 2]], "C1", label="x moves with them")
for side, style in zip(sides(spline, 2), ("C2--", "C4:"), strict=True):
    for end in side:
        left.plot(*sphere.geodesic(points[2], end, np.linspace(0, 1, 50)).T[[1, 2]], style, linewidth=2)
left.plot([], [], "C2--", label="left side of (13)")
left.plot([], [], "C4:", label="right side of (13)")
left.plot(*points.T[[1, 2]], "ko")
left.legend(loc="lower left", fontsize="small")
for curve, colour, name in ((hermite, "0.6", "Catmull–Rom"), (spline, "C0", "C² spline")):
    acceleration = np.linalg.norm(curve(fine, nu=2), axis=-1)
    right.plot(fine, acceleration, color=colour, label=name)
right.set(xlabel="t", xticks=t, title="|∇γ'|: acceleration")
right.legend()
plt.show()
