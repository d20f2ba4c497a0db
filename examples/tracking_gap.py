"""
A tracking gap
==============

A car drives round bends at 8 m/s, and for twelve seconds nobody saw it.
"""

# %%
# The naive way
# -------------
# One spline through all points. It has to join up with the velocities on both sides, over a gap that is a hundred
# times as long as the others: where nobody looked, it draws something, brakes and speeds, and looks like data.

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import Rotation

import symspline as ss

stamps = np.r_[0:5:0.1, 17:20:0.1]
angle = 0.7 * np.sin(0.9 * stamps) + 0.1 * stamps
fine = np.linspace(0, 20, 2001)
drift = 0.7 * np.sin(0.9 * fine) + 0.1 * fine
driven = np.cumsum(8 * np.column_stack([np.cos(drift), np.sin(drift), 0 * drift]), axis=0) * 0.01
places = np.column_stack([np.interp(stamps, fine, axis) for axis in driven.T])
poses = (Rotation.from_rotvec(np.outer(angle, [0, 0, 1])), places)

one = ss.CubicSpline(stamps, poses, "so:3 x r:3")
print(f"longest time between points: {one.report.max_gap:.1f} s")

# %%
# The segments
# ------------
# `fit_segments` fits one curve per segment without a gap. You decide how to fill the gap: not at all, or with a bridge
# that begins and ends with the velocities on either side and is marked as such.

before, after = ss.fit_segments(stamps, poses, "so:3 x r:3", max_gap=0.5)
t0, t1 = before.t[-1], after.t[0]
bridge = ss.CubicSpline(
    [t0, t1],
    tuple(np.stack(ends) for ends in zip(before(t0), after(t1), strict=True)),
    "so:3 x r:3",
    bc_type=((1, before(t0, nu=1)), (1, after(t1, nu=1))),
)


def speed(spline, x):
    return np.linalg.norm(ss.poses.linear_velocity(spline, x), axis=-1)


figure, (above, below) = plt.subplots(1, 2, figsize=(10, 5), layout="constrained")
x = np.linspace(0, stamps[-1], 1000)
above.plot(*one(x)[1][:, :2].T, color="0.7", linewidth=3, label="one curve")
below.plot(x, speed(one, x), color="0.7", linewidth=3)
for segment, style, label in ((before, "C0", "segments"), (after, "C0", None), (bridge, "C1--", "bridge")):
    x = np.linspace(segment.t[0], segment.t[-1], 300)
    above.plot(*segment(x)[1][:, :2].T, style, label=label)
    below.plot(x, speed(segment, x), style)
above.plot(*places[::5, :2].T, "k.", markersize=4, label="seen")
above.set(aspect="equal", xlabel="metres", title="From above")
above.plot(*driven[::10, :2].T, "k:", linewidth=1, label="driven")
above.legend(loc="lower right")
below.set(xlabel="seconds", ylabel="m/s", title="Speed")
plt.show()
