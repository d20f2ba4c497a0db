"""
Two recordings with an unknown time offset
==========================================

A camera measures the attitude of a hand-held device, and a logger records its gyroscope. The two started at different
times. The offset between the recordings is to be estimated. The data are synthetic.
"""

# %%
# The naive approach
# ------------------
# The rates of a curve through the attitudes of the camera look like those of the gyroscope, but later. Shifting one of
# them by eye, or by the maximum of a correlation, is accurate to about one sampling interval.

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

rng = np.random.default_rng(4)
so3, end, late = ss.SpecialOrthogonal(3), 12.0, 0.437  # seconds
grid = np.linspace(0, end, 481)
vectors = np.stack(
    [0.5 * np.sin(1.7 * grid), 0.4 * np.sin(2.3 * grid + 1), 0.8 * np.sin(1.1 * grid)], axis=-1
)
truth = ss.CubicSpline(grid, ss.rotations.from_rotation_vectors(vectors), so3, bc_type="not-a-knot")

t = np.sort(rng.uniform(0, end, 200))  # irregular times of the camera
noise = np.radians(1) * rng.standard_normal((len(t), 3))
seen = truth(t) @ ss.rotations.from_rotation_vectors(noise)
s = np.sort(rng.uniform(1, end - 1, 600))  # times of the gyroscope, as the camera would count them
rates = ss.rotations.angular_velocity(truth, s) + 0.05 * rng.standard_normal((len(s), 3))
logged = s - late  # the times of the logger

camera = ss.make_smoothing_spline(t, seen, so3)

# %%
# The offset as a parameter
# -------------------------
# The offset is a `Constant` that is added to the times of the logger. It is estimated together with the curve. The
# knots extend beyond the measurements of the logger, so that their times can move.

curve = ss.estimate(
    [
        ss.measure.Points(t, seen, sigma=np.radians(1)),
        ss.measure.BodyRates(logged, rates, sigma=0.05, time_offset=ss.measure.Constant(1)),
    ],
    np.linspace(0, end, 100),
    so3,
    penalty="jerk",
)
offset = curve.parameters["time offset"]
(found,), (std,) = offset.value, offset.std
print(f"offset {1000 * found:.1f} ± {1000 * std:.1f} ms; the true offset is {1000 * late:.0f} ms")

x = np.linspace(t[0], t[-1], 800)
figure, (before, after) = plt.subplots(2, sharex=True, sharey=True, figsize=(9, 6), layout="constrained")
for axes, times, own, label in (
    (before, logged, camera, "camera only"),
    (after, logged + found, curve, "camera and gyroscope"),
):
    axes.plot(times, rates[:, 2], ".", color="0.6", markersize=3, label="gyroscope")
    axes.plot(x, ss.rotations.angular_velocity(own, x)[:, 2], label=label)
    axes.set(ylabel="rate about z, rad/s", xlim=(0, end), ylim=(-1.5, 1.2))
    axes.legend(loc="lower left", ncols=2)
before.set_title("Times as recorded: the gyroscope is early")
after.set_title(
    f"Times of the gyroscope shifted by the estimated offset, {1000 * found:.1f} ± {1000 * std:.1f} ms"
)
after.set_xlabel("seconds of the camera")
plt.show()
