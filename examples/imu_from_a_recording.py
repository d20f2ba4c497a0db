"""
Poses and an IMU
================

What would an inertial sensor on a handheld camera have measured? The camera's poses were recorded; every tenth pose
is used. The recording is from TUM's RGB-D benchmark (CC BY 4.0). Eight seconds are removed, as if the tracking had been
lost.
"""

# %%
# The naive way
# -------------
# Divide differences of positions by differences of times, twice. The acceleration is a staircase in the wrong
# frame. In the gap it is zero, as if the camera had been at rest, and looks like data.

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

# A notebook, which has no file, runs in the folder of the examples.
HERE = Path(globals().get("__file__", "notebook")).resolve()
FILE = HERE.parents[1] / "docs" / "comparisons" / "data" / "freiburg1_xyz-groundtruth.txt.gz"

t, poses = (values[::10] for values in ss.poses.read_tum(FILE))
t = t - t[0]
seen = (t < 10) | (t > 18)
t, poses = t[seen], poses[seen]

velocity = np.diff(poses[:, :3, 3], axis=0) / np.diff(t)[:, None]
middle = (t[1:] + t[:-1]) / 2
acceleration = np.diff(velocity, axis=0) / np.diff(middle)[:, None]

# %%
# The spline
# ----------
# `fit_segments` splits the recording at its gaps. Attitude and position are two independent factors of a product.
# `ss.poses.imu` computes the signals of a gyroscope and an accelerometer in the frame of the camera, gravity included.

segments = ss.fit_segments(t, ss.poses.split(poses), "so:3 x r:3", max_gap=0.5, duplicates="mean")

figure, axes = plt.subplots(3, figsize=(9, 8), sharex=True, layout="constrained")
axes[0].plot(t[1:-1], acceleration, drawstyle="steps-mid", linewidth=1)
axes[0].set(ylabel="m/s²", ylim=(-3, 3), title="Differences of differences of positions, in the world")
for segment in segments:
    x = np.arange(segment.t[0], segment.t[-1], 0.01)
    for ax, values in zip(axes[1:], ss.poses.imu(segment, x), strict=True):
        ax.set_prop_cycle(None)
        ax.plot(x, values, linewidth=1)
axes[1].set(ylabel="angular velocity, rad/s", title="From the spline, in the frame of the camera")
axes[1].legend(axes[1].lines[:3], list("xyz"), loc="upper center", ncols=3)
axes[2].set(ylabel="specific force, m/s²", xlabel="seconds")
plt.show()
