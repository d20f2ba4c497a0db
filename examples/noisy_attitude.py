"""
Angular velocity of a noisy attitude
====================================

A sensor measures the attitude ten times a second, with errors of one degree about each axis. The angular velocity is to
be estimated.
"""

# %%
# The naive way
# -------------
# A curve through all measurements. Its rates are noise: one degree in a tenth of a second is ten degrees a second.

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import Rotation

import symspline as ss

rng = np.random.default_rng(0)
t = np.arange(0, 20, 0.1)  # seconds
truth = Rotation.from_euler(
    "ZYX", np.stack([90 * np.sin(t / 3), 20 * np.sin(t), 8 * t], axis=-1), degrees=True
)
measured = truth * Rotation.from_rotvec(np.radians(1) * rng.standard_normal((len(t), 3)))

through = ss.CubicSpline(t, measured, "so:3")

# %%
# The smooth curve
# ----------------
# How smooth is found from the data, and bands say how sure the rates are.

near = ss.make_smoothing_spline(t, measured, "so:3")
x = np.linspace(0, t[-1], 1000)
exact = ss.rotations.angular_velocity(ss.CubicSpline(t, truth, "so:3", bc_type="not-a-knot"), x)

figure = plt.figure(figsize=(9, 6), layout="constrained")
before, after = figure.subplots(2, sharex=True)
before.plot(x, np.degrees(ss.rotations.angular_velocity(through, x)), linewidth=0.7)
rates, band = ss.rotations.angular_velocity(near, x), 1.96 * near.std(x, nu=1)
for i, name in enumerate("xyz"):
    after.fill_between(x, *np.degrees([rates[:, i] - band, rates[:, i] + band]), alpha=0.3)
    after.plot(x, np.degrees(rates[:, i]), f"C{i}", label=name)
    after.plot(x, np.degrees(exact[:, i]), "k:", linewidth=1)
before.set(
    ylabel="degrees/s", title="Angular velocity in the body: of the curve through the measured attitudes"
)
after.set(
    ylabel="degrees/s", xlabel="seconds", title="of the smooth curve, with 95 % bands; dotted, the truth"
)
after.legend(loc="lower left", ncols=3)
off = near.space.distance(near(t), truth.as_matrix())
print(
    f"noise {np.degrees(near.sigma):.2f} degrees found; the curve is off by {np.degrees(off.mean()):.2f} degrees"
)
plt.show()
