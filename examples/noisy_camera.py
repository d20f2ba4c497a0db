"""
A noisy camera path
===================

A camera goes round a table, and its tracking is off by 4 cm and 3 degrees.
"""

# %%
# The naive way
# -------------
# A spline through the poses keeps all of their noise.

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import Rotation

import symspline as ss

rng = np.random.default_rng(0)
t = np.arange(0, 12, 0.1)  # seconds
turn = 2 * np.pi * t / 12
truth = (
    np.stack([2 * np.cos(turn), 1.3 * np.sin(turn), 1.5 + 0.1 * np.sin(5 * turn)], axis=-1),
    Rotation.from_euler("ZY", np.stack([turn + np.pi, 0.3 + 0.1 * np.sin(3 * turn)], axis=-1)).as_matrix(),
)
space = ss.space("r:3 x so:3")
noise = [0.04 * rng.standard_normal((len(t), 3)), np.radians(3) * rng.standard_normal((len(t), 3))]
tracked = (truth[0] + noise[0], truth[1] @ Rotation.from_rotvec(noise[1]).as_matrix())

place, attitude = ss.CubicSpline(t, tracked, space)(t)

# %%
# A λ for each
# ------------
# Positions and attitudes are smoothed separately, each with its own λ and noise level.

path = ss.make_smoothing_spline(t, tracked, space)
print(
    "λ = {:.2g}, noise {:.3f} m; λ = {:.2g}, noise {:.3f} rad".format(
        *np.stack([path.lam, path.sigma]).T.flat
    )
)

for name, places, attitudes in (("through the poses", place, attitude), ("smooth", *path(t))):
    off = ss.space("r:3").distance(places, truth[0]), ss.space("so:3").distance(attitudes, truth[1])
    print(f"{name}: off by {100 * off[0].mean():.1f} cm, {np.degrees(off[1].mean()):.2f} degrees")

figure = plt.figure(figsize=(10, 4.5), layout="constrained")
axes = figure.subplot_mosaic([["above", "r:3"], ["above", "so:3"]], width_ratios=(5, 4))
axes["above"].plot(*tracked[0][:, :2].T, ".", color="0.75", label="tracked")
axes["above"].plot(*path.points[0][:, :2].T, label="smooth")
for colour, (places, attitudes) in (("0.75", tracked), ("C0", path(t))):
    axes["above"].quiver(*places[::4, :2].T, *attitudes[::4, :2, 0].T, color=colour, scale=15, width=0.004)
axes["above"].set(aspect="equal", title="From above: positions, and where the camera looks", xlabel="metres")
axes["above"].legend(loc="center")
for name, seen, whole, smooth, true, unit in zip(
    ["r:3", "so:3"], tracked, (place, attitude), path(t), truth, [100, 180 / np.pi], strict=True
):
    axes[name].plot(t, unit * ss.space(name).distance(seen, true), ".", color="0.75")
    axes[name].plot(
        t, unit * ss.space(name).distance(whole, true), color="C1", linewidth=1, label="through the poses"
    )
    axes[name].plot(t, unit * ss.space(name).distance(smooth, true))
axes["r:3"].set(title="Distance from the truth", ylabel="centimetres", xticklabels=[])
axes["r:3"].legend(loc="upper left")
axes["so:3"].set(ylabel="degrees", xlabel="seconds")
plt.show()
