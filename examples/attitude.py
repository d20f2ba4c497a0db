"""
Attitude of a spacecraft
========================

Four pointings are given as SciPy rotations. The attitude, its rate and the torque between them are to be computed.
"""

# %%
# The naive way
# -------------
# `Slerp` turns from one pointing to the next about a fixed axis. At every pointing axis and speed change at once: an
# infinite torque.

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import Rotation, Slerp

import symspline as ss

minutes = [0, 4, 9, 12]
pointings = Rotation.from_euler("ZYX", [[0, 0, 0], [80, 30, 0], [200, -20, 45], [300, 0, 0]], degrees=True)
slerp = Slerp(minutes, pointings)

x = np.linspace(0, 12, 500)
step = 1e-3
mid = x[:-1] + step / 2
slerp_rate = (slerp(mid).inv() * slerp(mid + step)).as_rotvec(degrees=True) / step

# %%
# The spline
# ----------
# Rate and torque are continuous, and the spacecraft is at rest before and after: the ends are clamped.

attitude = ss.CubicSpline(minutes, pointings, "so:3", bc_type="clamped")

# %%
# Everything else is a method away, and a `Rotation` comes back where one went in.

pointing = ss.rotations.rotation(attitude, 6.5)
print("at 6.5 minutes:", pointing.as_euler("ZYX", degrees=True).round(2))

# %%
# Slerp's rate above, the spline's below:

figure, axes = plt.subplots(4, figsize=(9, 9), sharex=True, layout="constrained")
axes[0].plot(mid, slerp_rate)
axes[1].plot(x, np.degrees(ss.rotations.angular_velocity(attitude, x)), label=list("xyz"))
axes[2].plot(x, np.degrees(ss.rotations.angular_acceleration(attitude, x)), label=list("xyz"))
axes[3].plot(x, ss.rotations.quaternion(attitude, x, scalar_first=True), label=list("wxyz"))
axes[0].set(ylabel="Slerp: rate in the body\ndegrees/min", title="A slew through four pointings")
axes[1].set(ylabel="spline: rate\ndegrees/min")
axes[2].set(ylabel="its derivative\ndegrees/min²")
axes[3].set(ylabel="quaternion", xlabel="minutes", xticks=minutes)
for ax in axes:
    ax.grid(axis="x")
for ax in axes[1:]:
    ax.legend(loc="center left", bbox_to_anchor=(1, 0.5))
plt.show()
