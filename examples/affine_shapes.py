"""
Affine shapes without coordinates (Figs. 7–9)
=============================================

§4.3 of the paper: four sets of four landmarks in the plane. Up to affine maps each is a point of the Grassmannian
Gr(2, 3), and a closed spline goes through (A)–(B)–(C)–(D)–(A). The paper gives the method and draws the
landmarks, but not their coordinates. We chose these so that, as there, the landmarks 0, 1 and 3 of (C) lie on a line,
and so that the curve crosses the rim of the disc in Fig. 8.
"""

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

A = [[0, 0], [1, 0], [1.1, 0.3], [0, 1]]
B = [[0, 0], [1, 0.1], [0.75, 1.0], [-0.4, 0.6]]
C = [[0, 0], [1, 0], [0.3, 0.9], [-0.4, 0]]
D = [[0, 0], [1, -0.2], [0.75, 0.5], [-0.5, -0.6]]

fig7, axes = plt.subplots(1, 4, figsize=(9, 2.6), layout="constrained")
for ax, drawing, name in zip(axes, (A, B, C, D), "ABCD", strict=True):
    ax.fill(*np.transpose(drawing), facecolor="#0b559f22", edgecolor="#0b559f")
    for number, place in enumerate(drawing):
        ax.plot(*place, "o", color="#0b559f")
        ax.annotate(f"$p_{number}$", place, (4, 4), textcoords="offset points")
    ax.set(aspect="equal", xlim=(-1.1, 1.4), ylim=(-0.8, 1.3), title=f"({name})")
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
coordinates_of_curve = coordinates(spline(x))
drawn = np.where(np.abs(coordinates_of_curve) < 30, coordinates_of_curve, np.nan)
fig9, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
left.plot(x, drawn, label=["a", "b"])
left.axvline(2, color="0.6", linewidth=0.8, linestyle="--")
left.set(ylim=(-6, 6), xticks=range(5), xticklabels=[f"({name})" for name in "ABCDA"])
left.set_title("Fig. 9: a and b are infinite at (C)")
left.legend()
right.plot(*drawn.T, color="0.6")
for number, name in enumerate("ABD"):
    place = coordinates(shapes[[0, 1, 3]])[number]
    right.plot(*place, "o", color="C0")
    right.annotate(f"({name})", place, (6, -12), textcoords="offset points")
right.set(xlim=(-6, 6), ylim=(-6, 6), aspect="equal", xlabel="a", ylabel="b", title="(C) is at infinity")

# %%
# The kernel of the 2 × 3 matrix of a shape is the normal of its plane. It meets the half sphere (24) once, and the
# stereographic projection (25) draws it in the unit disc (Fig. 8). Opposite points of the rim are the same shape: the
# curve leaves at one of the two marked points, comes back at the other, and is closed.


def normals(shapes):
    """Unit normals of the planes, in the half sphere z ≤ 0 of (24)."""
    vectors = np.cross(shapes[..., 0], shapes[..., 1])
    return np.where(vectors[..., 2:] > 0, -vectors, vectors)


def on_disc(shapes):
    """The stereographic projection (25) from (0, 0, 1)."""
    x, y, z = np.moveaxis(normals(shapes), -1, 0)
    return np.stack([x / (1 - z), y / (1 - z)], axis=-1)


fig8, ax = plt.subplots(figsize=(4.6, 4.6), layout="constrained")
disc = on_disc(spline(x))
(crossings,) = np.nonzero(np.linalg.norm(np.diff(disc, axis=0), axis=1) > 1)
ax.add_patch(plt.Circle((0, 0), 1, facecolor="#0b559f11", edgecolor="0.4"))
ax.plot(*np.insert(disc, crossings + 1, np.nan, axis=0).T, color="#0b559f")
for i in crossings:
    rim = disc[i] / np.linalg.norm(disc[i])
    ax.plot(*np.transpose([rim, -rim]), "o", color="#c1440e", markerfacecolor="white")
for place, name in zip(on_disc(shapes[:4]), "ABCD", strict=True):
    ax.plot(*place, "o", color="#0b559f")
    ax.annotate(f"({name})", place, (6, 4), textcoords="offset points")
ax.set(aspect="equal", title="Fig. 8: opposite points of the rim are the same")
ax.set_axis_off()
print(
    f"the curve crosses the rim {len(crossings)} time; largest speed {spline.speed(x).max():.2f}, also near (C)"
)

# %%
# ``plot`` draws the half sphere itself.

dome = spline.plot()
plt.show()
