"""
A camera path at constant speed
===============================

A camera flies past six key poses. You have the poses, but no times. This page chooses times, fits a smooth path, and
traverses it at constant speed.
"""

# %%
# Times without a choice
# ----------------------
# With the times 0, 1, 2, … the camera moves slowly where two key poses are close together, and fast where they are far
# apart. The shape of the path suffers too: next to a short step, a long step in the same time makes the path swing.

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import Rotation

import symspline as ss

places = np.array([[0, 0, 1], [1, 0.2, 1.2], [5, 1.5, 1.5], [6, 3, 1.5], [5.5, 4, 1.2], [1, 5, 1.0]])
looks = Rotation.from_rotvec(np.outer([0, 10, 40, 90, 140, 190], [0, 0, 1]), degrees=True)
space = ss.space("r:3 x so:3")  # metres and radians have their own factors

naive = ss.CubicSpline(None, (places, looks), space, bc_type="not-a-knot")

# %%
# Constant speed
# --------------
# Times in proportion to the distances give a path without swings. `at_length` then returns the times at which the
# camera has flown equal distances. The factors of a product are independent, so the curve of the positions alone has
# the same path.

t = np.r_[0, np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))]
path = ss.CubicSpline(t, (places, looks), space, bc_type="not-a-knot")
positions = ss.CubicSpline(t, places, "r:3", bc_type="not-a-knot")
frames = positions.at_length(np.linspace(0, positions.length(), 241))  # 10 seconds, 24 frames per second
steps = np.linalg.norm(np.diff(positions(frames), axis=0), axis=1)
print(f"from frame to frame {1000 * steps.min():.1f} to {1000 * steps.max():.1f} mm")

figure, (above, below) = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
for spline, at, colour, label in (
    (naive, np.linspace(0, 5, 241), "0.6", "times 0, 1, 2, …"),
    (path, frames, "C0", "constant speed"),
):
    spots, frame = spline(at)
    above.plot(*spots[:, :2].T, color=colour, label=label)
    above.quiver(*spots[::8, :2].T, *frame[::8, :2, 0].T, color=colour, scale=25, width=0.004)
    moved = np.linalg.norm(np.diff(spots, axis=0), axis=1)
    below.plot(np.linspace(0, 10, 240), 24 * moved, color=colour, label=label)
above.plot(*places[:, :2].T, "k.")
above.set(aspect="equal", xlabel="m", ylabel="m", title="Path from above, with the viewing directions")
above.legend(loc="center")
below.set(xlabel="s", ylabel="m/s", ylim=(0, None), title="Speed of the camera")
plt.show()
