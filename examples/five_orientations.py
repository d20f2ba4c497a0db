"""
Orientations and quaternions of either sign (Fig. 5)
====================================================

A quaternion q and its negative are the same rotation, and sensors send either. §4.1 of the paper interpolates five
orientations on S³, the unit quaternions, and draws them as frames. It does not give the orientations; we chose these.
"""

# %%
# The naive way
# -------------
# A cubic spline through the four numbers, made a unit vector again. One of the five quaternions has the other sign:
# the curve takes the long way round through it, and turns far where nothing should happen.

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import symspline as ss

t = np.arange(5.0)
given = Rotation.from_rotvec([[0, 0, 0], [1.2, 0, 0], [1.2, 0.8, 0], [0.4, 1.4, 0.6], [0, 0.6, 1.5]])
quaternions = given.as_quat()
quaternions[2] *= -1

x = np.linspace(0, 4, 400)
components = CubicSpline(t, quaternions, bc_type="natural")(x)
naive = Rotation.from_quat(components)

# %%
# The spline
# ----------
# ``so:3`` is the space of rotations: signs play no part in it. (On ``sphere:3`` they do, and a warning is issued.)

spline = ss.CubicSpline(t, ss.rotations.from_quaternions(quaternions, scalar_first=False), "so:3")


def degrees_per_unit(rotations):
    return np.degrees((rotations[:-1].inv() * rotations[1:]).magnitude()) / np.diff(x)


figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
axes.plot(x[1:], degrees_per_unit(naive), color="0.6", label="components, one sign flipped")
axes.plot(x[1:], degrees_per_unit(ss.rotations.rotation(spline, x)), label="spline in SO(3)")
axes.set(xlabel="t", ylabel="degrees per unit of time", xticks=t)
axes.legend()

# %%
# Quaternions come out without jumps of sign, whatever came in.

out = ss.rotations.quaternion(spline, x, scalar_first=False)
print(f"largest step of a component: {np.abs(np.diff(out, axis=0)).max():.3f}")

# %%
# The paper fits unit quaternions on S³ itself. With signs such that neighbours are near it is the same curve,
# up to the sign of the quaternions, because S³ covers SO(3) twice and geodesics go to geodesics.

wxyz = np.roll(quaternions, 1, axis=1)
turned = np.sum(wxyz[1:] * wxyz[:-1], axis=1) < 0
signs = np.cumprod(np.append(1, np.where(turned, -1, 1)))
on_s3 = ss.CubicSpline(t, signs[:, None] * wxyz, "sphere:3")

of_so3 = ss.rotations.quaternion(spline, x, scalar_first=True)
up_to_sign = np.minimum(np.abs(on_s3(x) - of_so3).max(axis=1), np.abs(on_s3(x) + of_so3).max(axis=1))
assert up_to_sign.max() < 1e-12
print(f"on S³ and on SO(3): {up_to_sign.max():.0e} apart")

# %%
# As in Fig. 5 of the paper, a rotation is drawn as the frame that it makes of the three axes; bold are the data. On the
# left the spline on S³, on the right that on SO(3). The frames are the same; speed and acceleration on SO(3) are twice
# those on S³, because the angle of a rotation is twice that of its quaternion.

frames_of_s3 = on_s3.plot()
frames_of_so3 = spline.plot()
plt.show()
