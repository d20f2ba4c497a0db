"""
A first curve
=============

Four directions at four times, and a smooth curve through them.
"""

# %%
# The naive way
# -------------
# A cubic spline through each of the three coordinates: it is smooth, and no direction any more. Divided by its length
# it is one again, but how fast it goes depends on how deep it was inside the sphere.

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import CubicSpline

import symspline as ss

t = [0.0, 1.0, 3.0, 4.0]
points = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0, 0.8]]
x = np.linspace(0, 4, 200)
naive = np.linalg.norm(CubicSpline(t, points, bc_type="natural")(x), axis=1)

# %%
# The spline
# ----------

spline = ss.CubicSpline(t, points, ss.Sphere(2))
length = np.linalg.norm(spline(x), axis=1)
print(
    f"lengths from {naive.min():.2f} to {naive.max():.2f}; of the spline 1 ± {np.abs(length - 1).max():.0e}"
)
curve = spline.plot()
plt.show()
