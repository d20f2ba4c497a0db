"""
A first curve
=============

Four directions at four times, and a smooth curve through them.
"""

# %%
# The naive way
# -------------
# A cubic spline through each of the three coordinates is smooth, but it leaves the sphere: its vectors are shorter or
# longer than one. You can divide them by their lengths, but then the speed depends on how deep the curve was inside.

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import CubicSpline

import symspline as ss

t = [0.0, 1.0, 3.0, 4.0]
points = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0, 0.8]])
x = np.linspace(0, 4, 200)
naive = CubicSpline(t, points, bc_type="natural")(x)
lengths = np.linalg.norm(naive, axis=1)

# %%
# The spline
# ----------
# The spline stays on the sphere at all times.

spline = ss.CubicSpline(t, points, ss.Sphere(2))
error = np.abs(np.linalg.norm(spline(x), axis=1) - 1).max()
print(f"lengths from {lengths.min():.2f} to {lengths.max():.2f}; of the spline 1 ± {error:.0e}")

figure = plt.figure(figsize=(10, 4.6), layout="constrained")
left = figure.add_subplot(1, 2, 1, projection="3d", computed_zorder=False)
lon, lat = np.meshgrid(np.radians(np.arange(0, 361, 15)), np.radians(np.arange(-90, 91, 15)))
globe = np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)
left.plot_surface(*globe, color="#dfe9ef", alpha=0.25, edgecolor="#c3d3de", linewidth=0.4)
left.plot(*naive.T, "C1--", label="coordinates: leaves the sphere")
left.plot(*spline(x).T, "C0", linewidth=3, label="spline on the sphere")
left.plot(*points.T, "o", color="#22303a", markersize=6)
left.view_init(elev=25, azim=40)
left.set_aspect("equal")
left.set_box_aspect(None, zoom=1.5)
left.set_axis_off()
left.legend(loc="lower center")
right = figure.add_subplot(1, 2, 2)
right.plot(x, lengths, "C1--")
right.plot(x, np.linalg.norm(spline(x), axis=1), "C0")
right.plot(t, np.ones(4), "o", color="#22303a")
right.set(xlabel="t", ylabel="length of the vector", ylim=(0, 1.5))

# %%
# `plot` shows the curve on a globe and on a map, with its speed and acceleration.

page = spline.plot()
plt.show()
