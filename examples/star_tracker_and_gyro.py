"""
Attitude from a star tracker and a gyroscope
============================================

A satellite measures its attitude every two seconds with a star tracker, which is blind for 20 seconds, and its angular
velocity ten times per second with a gyroscope that has an unknown bias. Attitude, angular velocity and bias are
estimated together. The data are synthetic.
"""

# %%
# The naive approach
# ------------------
# A smooth curve through the attitudes of the star tracker ignores the gyroscope. In the gap it is a guess.

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

rng = np.random.default_rng(0)
so3, end = ss.SpecialOrthogonal(3), 80.0  # seconds
grid = np.linspace(0, end, 801)
vectors = np.stack([0.3 * np.sin(grid / 6), 0.2 * np.sin(grid / 4 + 1), 0.5 * np.sin(grid / 9)], axis=-1)
truth = ss.CubicSpline(grid, ss.rotations.from_rotation_vectors(vectors), so3, bc_type="not-a-knot")

t = np.sort(rng.uniform(0, end, 40))  # irregular times of the star tracker
t = t[(t < 35) | (t > 55)]
noise = np.radians(0.5) * rng.standard_normal((len(t), 3))
stars = truth(t) @ ss.rotations.from_rotation_vectors(noise)

s = np.sort(rng.uniform(0, end, 800))  # irregular times of the gyroscope
bias = np.radians([0.6, -0.4, 0.8])  # rad/s
rates = ss.rotations.angular_velocity(truth, s) + bias + np.radians(0.3) * rng.standard_normal((len(s), 3))

alone = ss.make_smoothing_spline(t, stars, so3)

# %%
# Both sensors
# ------------
# Each sensor has its own times. The bias is a `Constant`, which `estimate` determines together with the curve.

curve = ss.estimate(
    [
        ss.measure.Points(t, stars, sigma=np.radians(0.5)),
        ss.measure.BodyRates(s, rates, sigma=np.radians(0.3), bias=ss.measure.Constant(3)),
    ],
    np.linspace(0, end, 81),
    so3,
    penalty="jerk",
)
found = curve.parameters["gyro bias"]
print(
    "gyro bias, degrees/s:",
    ", ".join(f"{value:.2f} ± {std:.2f}" for value, std in np.degrees([found.value, found.std]).T),
)

x = np.linspace(t[0], t[-1], 600)
figure, (angle, error) = plt.subplots(2, sharex=True, figsize=(9, 6), layout="constrained")
for axes in (angle, error):
    axes.axvspan(35, 55, color="0.93")
angle.plot(grid, np.degrees(vectors[:, 2]), "k--", linewidth=1, label="truth", zorder=3)
angle.plot(
    t, np.degrees(ss.rotations.as_rotation_vectors(stars)[:, 2]), ".", color="0.5", label="star tracker"
)
for own, name, colour in ((alone, "star tracker only", "C1"), (curve, "star tracker and gyroscope", "C0")):
    angle.plot(x, np.degrees(ss.rotations.as_rotation_vectors(own(x))[:, 2]), colour, label=name)
    error.plot(x, np.degrees(so3.distance(own(x), truth(x))), colour, label=name)
error.fill_between(x, 0, np.degrees(curve.band(x)), color="C0", alpha=0.25, label="95 % band")
angle.set(ylabel="degrees", title="Rotation about the z axis. In grey, the star tracker is blind")
angle.legend(loc="lower right")
error.set(ylabel="degrees", xlabel="seconds", ylim=(0, 4), title="Distance of the attitude from the truth")
error.legend(loc="upper left")
plt.show()
