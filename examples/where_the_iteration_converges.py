"""
Where the paper's iteration converges (Fig. 10)
===============================================

Algorithm 1 of the paper is a fixed-point iteration. Theorem 3.1 proves that it converges if neighbouring points are
near enough. This page shows how near that is in theory, and that the iteration converges far beyond the theorem.
"""

# %%
# The naive way
# -------------
# Take any solver, and trust that it finds *the* spline. These points on a sphere are far apart and have several C²
# splines: quasi-Newton and Algorithm 1 find different ones. The default, ``"auto"``, runs both here and keeps the curve
# with the least bending energy.

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

sphere = ss.Sphere(2)
zigzag = ss.geo.from_lonlat(np.degrees([0, 1.5] * 10), np.degrees(0.1 * np.arange(20) - 1))
for method in ("quasi-newton", "fixed-point", "auto"):
    spline = ss.CubicSpline(None, zigzag, sphere, method=method)
    print(f"{method}: {spline.report.iterations} iterations, bending energy {spline.bending_energy():.0f}")

# %%
# The region of (38)
# ------------------
# D is the largest distance between neighbours, K the square root of the curvature. The theorem needs a V with
#
# .. code-block:: text
#
#     ½ u/sin(u) (u − KV) ≤ KV,   u = KD + 2KV < π,
#
# so that control handles that begin below V stay below it. It is the blue region of the paper's Fig. 10; the smallest V
# is ``report.invariant_radius``. The paper draws a lower rectangle, "sufficiently small", without numbers. In its place
# is the region where :doc:`a bound α of the contraction </convergence>` is below 1; at the smallest V it is
# ``report.contraction_bound``. The dots are random walks, each at the longest handle of its curve and coloured by how
# fast the iteration contracts.

kd, kv = np.meshgrid(np.linspace(0, 0.36, 400), np.linspace(0, 1, 400))
u = kd + 2 * kv
with np.errstate(divide="ignore", invalid="ignore"):
    holds = (u < np.pi) & (0.5 * u / np.sin(u) * (u - kv) <= kv)
    stretch = np.where(kv > 0, np.sinh(kv) / kv, 1)
    own = (2 - u / np.tan(u)) * stretch - 1 + u * np.where(kv > 0, (np.cosh(kv) - 1) / kv, 0)
    contracts = (u < np.pi) & ((u / np.sin(u) * stretch + own) / 2 < 1)


def walk(step, seed, count=12):
    rng = np.random.default_rng(seed)
    points = [np.array([1.0, 0, 0])]
    for _ in range(count - 1):
        v = sphere.random_tangent(rng, points[-1])
        points.append(sphere.exp(points[-1], step * v / np.linalg.norm(v)))
    return np.stack(points)


def contraction(points):
    """Of the residual, per iteration: from the 8th to the 20th."""
    residuals = [
        ss.CubicSpline(
            None, points, sphere, method="fixed-point", max_iter=n, on_failure="ignore"
        ).report.residual
        for n in (8, 20)
    ]
    return (residuals[1] / residuals[0]) ** (1 / 12)


steps = np.r_[np.linspace(0.02, 0.34, 40), np.linspace(0.4, 2.4, 40)]
walks = [walk(step, seed) for seed, step in enumerate(steps)]
rates = [contraction(points) for points in walks]
legs = [
    np.linalg.norm(ss.CubicSpline(None, points, sphere, on_failure="ignore").velocities, axis=-1).max() / 3
    for points in walks
]
report = ss.CubicSpline(None, walk(0.2, 0), sphere).report
radius = report.invariant_radius
print(
    f"K D = 0.2: smallest V {radius:.3f}; bound of the contraction {report.contraction_bound:.3f},", end=" "
)
print(f"measured {contraction(walk(0.2, 0)):.2f}")

figure, (near, far) = plt.subplots(1, 2, figsize=(10, 4.4), layout="constrained")
near.contourf(kd, kv, holds, levels=[0.5, 1.5], colors=["#bcd9ee"])
near.contourf(kd, kv, contracts, levels=[0.5, 1.5], colors=["#f3c98b"], alpha=0.6)
near.plot(0.2, radius, "k*", label="report.invariant_radius")
for axes in (near, far):
    dots = axes.scatter(steps, legs, c=rates, s=16, vmin=0.45, vmax=1)
near.set(
    xlim=(0, 0.36), ylim=(0, 1), xlabel="K D", ylabel="K V", title="Blue: (38) holds; orange: sweeps contract"
)
near.legend()
far.set(xlabel="K D", ylabel="K V", title="Far beyond the theorem")
figure.colorbar(dots, label="contraction per iteration")
plt.show()
