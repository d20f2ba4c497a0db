"""
Orientations of a cubic crystal
===============================

A scan across a bent crystal measures its orientation at 120 positions, with errors of half a degree. Each measurement
is one of 24 equivalent orientations of a cubic crystal. The rotation of the lattice along the scan is to be estimated,
and then a map.
"""

# %%
# The naive way
# -------------
# A smooth curve of rotations, without the symmetry. It passes between orientations that are equivalent, but far apart.

import warnings

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

rng = np.random.default_rng(0)
cubic = ss.Quotient("so:3", ss.rotations.point_group("432"))


def lattice(x, y=0.0):
    """The true orientation at a position in millimetres."""
    bend = np.stack([0.5 * np.sin(2 * x) + 0 * y, 0.4 * np.cos(3 * y) * x, 0.6 * x**2 + 0.3 * y], axis=-1)
    return ss.rotations.from_rotation_vectors(bend)


def measure(orientations):
    """Errors of half a degree about each axis, and representatives at random."""
    noise = np.radians(0.5) * rng.standard_normal((*orientations.shape[:-2], 3))
    chosen = cubic.group[rng.integers(0, 24, orientations.shape[:-2])]
    return orientations @ ss.rotations.from_rotation_vectors(noise) @ chosen


x = np.linspace(0, 1.5, 120)
scan = measure(lattice(x))

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    naive = ss.make_smoothing_spline(x, scan, "so:3", on_failure="warn")

# %%
# With the symmetry
# -----------------
# On the quotient, equivalent orientations count as one. The curve follows representatives that are continuous.

spline = ss.make_smoothing_spline(x, scan, cubic)

fine = np.linspace(0, 1.5, 1000)
errors = [np.degrees(cubic.distance(curve(fine), lattice(fine))) for curve in (naive, spline)]
print(
    f"median error: {np.median(errors[0]):.1f} degrees without the symmetry, {np.median(errors[1]):.2f} with it"
)

# %%
# A map
# -----
# The same for a map, of which a corner is missing: ``unwrap`` chooses continuous representatives, and a smoothing grid
# on the quotient, which does so itself, removes the noise. The colours show the rotation vector of the orientation.

columns, rows = np.linspace(0, 1.5, 45), np.linspace(-0.6, 0.6, 30)
u, v = np.meshgrid(columns, rows)
area = measure(lattice(u, v))
area[(u < 0.4) & (v > 0.3)] = np.nan
continuous = cubic.unwrap(area, axes=2)
surface = ss.make_smoothing_grid((rows, columns), area, cubic)
smooth = surface.grid(np.linspace(-0.6, 0.6, 117), np.linspace(0, 1.5, 177))

known = np.isfinite(area).all(axis=(-2, -1))
for name, own in (("measured", area), ("smooth", surface.points)):
    off = cubic.distance(own[known], lattice(u, v)[known])
    print(f"{name} map: {np.degrees(np.median(off)):.2f} degrees from the true orientations")


def vectors(orientations):
    """Rotation vectors relative to the middle of the map."""
    valid = np.isfinite(orientations).all(axis=(-2, -1))
    found = np.full((*valid.shape, 3), np.nan)
    found[valid] = ss.rotations.as_rotation_vectors(continuous[15, 22].T @ orientations[valid])
    return found


low, high = (limit(vectors(continuous), axis=(0, 1)) for limit in (np.nanmin, np.nanmax))


def colours(orientations):
    """Red, green and blue for the three numbers of the rotation vector, white for missing nodes."""
    return np.nan_to_num(np.clip((vectors(orientations) - low) / (high - low), 0, 1), nan=1.0)


jumps = [
    np.count_nonzero(np.nan_to_num(np.abs(np.diff(own, axis=0)).max(axis=(-2, -1))) > 0.3)
    for own in (area, continuous)
]
print(f"steps between rows that jump: {jumps[0]} as measured, {jumps[1]} with continuous representatives")

figure = plt.figure(figsize=(11, 6), layout="constrained")
above, below = figure.subfigures(2, height_ratios=[1, 1.1])
axes = above.subplots()
axes.semilogy(fine, errors[0], label="on so:3")
axes.semilogy(fine, errors[1], label="on so:3/432")
axes.set(xlabel="position, mm", ylabel="degrees", title="distance from the true orientation")
axes.legend()
for axes, own, title in zip(
    below.subplots(1, 3),
    (area, continuous, smooth),
    ("orientations as measured", "continuous representatives", "smoothing grid"),
    strict=True,
):
    axes.imshow(colours(own), origin="lower", extent=(0, 1.5, -0.6, 0.6))
    axes.set(xlabel="mm", title=title)
plt.show()
