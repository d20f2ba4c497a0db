"""
A camera path at even speed
===========================

A camera flies past six key poses. The curve through them is smooth, but how fast it goes is decided by the times of
the keys, and these were never chosen with care.
"""

# %%
# The naive way
# -------------
# Keys at times 0, 1, 2, …: where two keys are near each other the camera creeps, where they are far apart it rushes.
# The path itself suffers, too: beside a short step, a long one at the same time makes it swing.

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import Rotation

import symspline as ss

places = np.array([[0, 0, 1], [1, 0.2, 1.2], [5, 1.5, 1.5], [6, 3, 1.5], [5.5, 4, 1.2], [1, 5, 1.0]])
looks = Rotation.from_rotvec(np.outer([0, 10, 40, 90, 140, 190], [0, 0, 1]), degrees=True).as_matrix()
space = ss.space("r:3 x so:3")  # metres and radians apart

naive = ss.CubicSpline(None, (places, looks), space, bc_type="not-a-knot")

# %%
# Even speed
# ----------
# First choose times in proportion to the distances. Then reparametrise: the length of the path up to a time is the
# integral of its speed, and the time at which a length is reached is that function read backwards.

t = np.r_[0, np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))]
path = ss.CubicSpline(t, (places, looks), space, bc_type="not-a-knot")

x = np.linspace(0, t[-1], 2000)


def speed(spline, x):
    return np.linalg.norm(spline(x, nu=1)[0], axis=-1)


v = speed(path, x)
length = np.r_[0, np.cumsum((v[1:] + v[:-1]) / 2 * np.diff(x))]
frames = np.interp(np.linspace(0, length[-1], 241), length, x)  # 10 seconds, 24 frames a second
steps = np.linalg.norm(np.diff(path(frames)[0], axis=0), axis=1)
print(f"from frame to frame {1000 * steps.min():.1f} to {1000 * steps.max():.1f} mm")

figure, (above, below) = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
every = np.linspace(0, 5, 241)
for spline, at, colour, label in (
    (naive, every, "0.6", "times 0, 1, 2, …"),
    (path, frames, "C0", "even speed"),
):
    spots, frame = spline(at)
    above.plot(*spots[:, :2].T, color=colour, label=label)
    above.quiver(*spots[::8, :2].T, *frame[::8, :2, 0].T, color=colour, scale=25, width=0.004)
    moved = np.linalg.norm(np.diff(spots, axis=0), axis=1)
    below.plot(np.linspace(0, 10, 240), 24 * moved, color=colour)
above.plot(*places[:, :2].T, "k.")
above.set(aspect="equal", xlabel="metres", title="From above, and where the camera looks")
above.legend(loc="center")
below.set(xlabel="seconds", ylabel="m/s", ylim=(0, None), title="Speed of the camera")
plt.show()
