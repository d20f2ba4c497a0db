"""
Diffusion tensors that do not swell
===================================

Two bundles of fibres cross the picture at right angles to each other, and a tensor between them is to be computed.
"""

# %%
# The naive way
# -------------
# Interpolate the six numbers. Half way between two thin ellipsoids lies a thick one: its volume, the determinant, is
# larger than that of both. A scan in which water moves no faster shows more of it.

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import CubicSpline

import symspline as ss

t = np.array([0.0, 1.0, 2.0])
# Of FSL's order: xx, xy, xz, yy, yz, zz, in 1e-3 mm²/s.
numbers = np.array([[1.7, 0, 0, 0.2, 0, 0.2], [0.6, 0.5, 0, 0.8, 0, 0.3], [0.2, 0, 0, 1.7, 0, 0.2]])
x = np.linspace(0, 2, 201)
naive = ss.tensors.from_vectors(CubicSpline(t, numbers, bc_type="natural")(x), order="fsl")

# %%
# The spline
# ----------
# In the affine-invariant metric of ``spd:3`` the logarithm of the determinant is a cubic spline of its own: where the
# three given determinants do not grow, neither does that between them.

spline = ss.CubicSpline(t, ss.tensors.from_vectors(numbers, order="fsl"), "spd:3")
volume = np.sqrt(np.linalg.det(spline(x)))
flat = CubicSpline(t, np.log(np.linalg.det(spline.points)), bc_type="natural")(x)
print(f"log det off a cubic spline by {np.abs(np.log(np.linalg.det(spline(x))) - flat).max():.0e}")


def draw(axes, tensors, row, colour):
    angle = np.linspace(0, 2 * np.pi, 100)
    for i in range(0, 201, 20):
        ring = np.linalg.cholesky(tensors[i, :2, :2]) @ [np.cos(angle), np.sin(angle)]
        axes.fill(x[i] + 0.06 * ring[0], row + 0.06 * ring[1], color=colour)


figure, (above, below) = plt.subplots(2, figsize=(9, 5), height_ratios=(2, 3), layout="constrained")
draw(above, spline(x), 0, "C0")
draw(above, naive, 0.25, "0.6")
above.set(
    aspect="equal",
    yticks=[0, 0.25],
    yticklabels=["spline", "six numbers"],
    title="In the plane of the bundles",
)
below.plot(x, np.sqrt(np.linalg.det(naive)), color="0.6", label="six numbers")
below.plot(x, volume, label="spline")
below.plot(t, np.sqrt(np.linalg.det(spline.points)), "k.")
below.set(xlabel="place", ylabel="√determinant", ylim=(0, None))
below.legend()
plt.show()
