"""
Affine shapes without coordinates (Figs. 7–9)
=============================================

§4.3 of the paper: four sets of four landmarks in the plane. Up to affine maps each is a point of the Grassmannian
Gr(2, 3), and a closed spline goes through (A)–(B)–(C)–(D)–(A). The paper does not give coordinates of its landmarks;
these are drawn so that, as there, in (C) the landmarks 0, 1 and 3 lie on a line.
"""

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

A = [[0, 0], [1, 0], [1.1, 1], [0, 1]]
B = [[0, 0], [1, 0.1], [0.6, 1.2], [-0.3, 0.7]]
C = [[0, 0], [1, 0], [0.2, 0.9], [-0.8, 0]]
D = [[0, 0], [1, -0.3], [0.7, 0.9], [-0.2, 0.5]]

fig7, axes = plt.subplots(1, 4, figsize=(9, 2.6), layout="constrained")
for ax, drawing, name in zip(axes, (A, B, C, D), "ABCD", strict=True):
    ax.fill(*np.transpose(drawing), facecolor="#0b559f22", edgecolor="#0b559f")
    for number, place in enumerate(drawing):
        ax.plot(*place, "o", color="#0b559f")
        ax.annotate(f"$p_{number}$", place, (4, 4), textcoords="offset points")
    ax.set(aspect="equal", xlim=(-1.1, 1.4), ylim=(-0.5, 1.5), title=f"({name})")
    ax.set_axis_off()

# %%
# The naive way
# -------------
# With landmark 0 as origin and landmarks 1 and 3 as unit vectors, the coordinates (a, b) of landmark 2 say which shape
# it is. But not of every shape: at (C) the unit vectors are parallel, and b is infinite (Fig. 9). A spline through
# these coordinates does not exist, and other coordinates have their own such shapes.


def coordinates(shapes):
    frame = np.moveaxis(shapes[:, [0, 2]], 1, 2)
    return np.linalg.solve(frame, shapes[:, 1, :, None])[..., 0]


# %%
# The spline
# ----------
# In the Grassmannian nothing happens at (C).

shapes = ss.shapes.from_landmarks([A, B, C, D, A], base=0)
spline = ss.CubicSpline(None, shapes, "gr:2,3", bc_type="periodic")

x = np.linspace(0, 4, 2000)  # none of them is the time of (C)
fig9, ax = plt.subplots(figsize=(7, 3.2), layout="constrained")
for values, name in zip(coordinates(spline(x)).T, "ab", strict=True):
    ax.plot(x, np.where(np.abs(values) < 30, values, np.nan), label=f"${name}$")
ax.set(
    ylim=(-12, 12), xticks=range(5), xticklabels=[f"({name})" for name in "ABCDA"], title="Fig. 9: a and b"
)
ax.legend(frameon=False)

# %%
# Gr(2, 3) is a half sphere, opposite points of whose rim are the same: the normals of the planes draw the closed spline
# (Fig. 8).

fig8 = spline.plot()
print(f"largest speed {spline.speed(x).max():.2f}, also near (C)")
plt.show()
# sphinx_gallery_thumbnail_number = 3
