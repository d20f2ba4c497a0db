"""
An arm with seven joints
========================

A robot arm has seven joints, and every joint has its own limits of speed and acceleration. You have joint angles at a
few poses of the arm, and want the fastest smooth motion through them.
"""

# %%
# Angles as numbers
# -----------------
# The last joint, which holds the tool, has no stops: its angle jumps from 180° to −180°. If you interpolate the
# numbers, it turns the long way round: the joint moves by 20°, and the numbers move by 340°. The other six joints have
# stops, and cannot pass 180°: their angles are numbers.

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import CubicSpline

import symspline as ss

degrees = np.array([
    [0, -30, 0, -100, 0, 70, 170],
    [25, -10, 20, -120, 15, 90, -170],
    [60, 15, 35, -90, 40, 110, -150],
    [85, 30, 20, -60, 20, 95, 175],
    [90, 10, 0, -75, 0, 80, 150],
])  # fmt: skip
angles = np.radians(degrees)
naive = CubicSpline(np.arange(5), degrees)

# %%
# Lines and a circle
# ------------------
# Joints with stops are points of ``"r:1"``, and a joint without stops is one of ``"torus:1"``, where neighbouring
# points are joined the short way round. Every factor of the product has its own limits.

joints = ss.space(" x ".join(["r:1"] * 6 + ["torus:1"]))
path = ss.CubicSpline(None, np.split(angles, 7, axis=1), joints)

# %%
# The fastest traversal
# ---------------------
# `time_law` computes the fastest time law under the limits, from rest to rest. `retime` applies it to the path.

speed = np.radians([150, 150, 150, 180, 180, 225, 225])  # rad/s
acceleration = np.radians([450, 450, 450, 600, 600, 750, 750])  # rad/s²
law = ss.time_law(path, max_speed=tuple(speed), max_acceleration=tuple(acceleration))
motion = path.retime(law)
print(f"the motion takes {law.duration:.2f} s")

t = np.linspace(0, law.duration, 500)
rates = np.concatenate(motion(t, nu=1), axis=1)
used = np.abs(rates) / speed

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
x = np.linspace(0, 4, 500)
left.plot(x, naive(x)[:, 6], color="0.6", label="numbers: the long way round")
turned = np.degrees(np.unwrap(path(x)[6][:, 0]))
left.plot(x, turned, color="C0", label="torus")
left.plot(range(5), degrees[:, 6], "k.")
left.set(xlabel="waypoint", ylabel="last joint in degrees", title="Angles of the last joint")
left.legend()
right.plot(t, 100 * used)
right.axhline(100, color="0.5", linestyle="--", linewidth=0.8)
right.set(xlabel="s", ylabel="% of the limit", ylim=(0, None), title="Speeds of the seven joints")
plt.show()
