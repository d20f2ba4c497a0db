"""What an inertial sensor on a handheld camera would have measured, from its recorded poses: draws imu.png.

The recording is of TUM's RGB-D benchmark (CC BY 4.0), every tenth of its poses; eight seconds are left out as if the
tracking had been lost.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import symspline as ss

FILE = Path(__file__).parents[1] / "docs" / "comparisons" / "data" / "freiburg1_xyz-groundtruth.txt.gz"

t, poses = (values[::10] for values in ss.poses.read_tum(FILE))
t = t - t[0]
seen = (t < 10) | (t > 18)

pieces = ss.fit_segments(t[seen], poses[seen], "se:3", max_gap=0.5, duplicates="mean")
figure = Figure(figsize=(9, 6), layout="constrained")
axes = figure.subplots(2, sharex=True)
for piece in pieces:
    x = np.arange(piece.t[0], piece.t[-1], 0.01)
    for axis, values in zip(axes, ss.poses.imu(piece, x), strict=True):
        axis.set_prop_cycle(None)
        axis.plot(x, values, linewidth=1)
axes[0].set(ylabel="angular velocity, rad/s", title="In the frame of the camera")
axes[0].legend(axes[0].lines[:3], list("xyz"), loc="upper center", ncols=3)
axes[1].set(ylabel="specific force, m/s²", xlabel="seconds")
figure.savefig("imu.png")
