"""
A drone from GPS and IMU
========================

GPS measures the position of a drone four times per second with an error of half a metre. An inertial measurement unit
(IMU) measures angular velocity and specific force a hundred times per second, both with an unknown bias. Together they
determine position, attitude and biases, although no sensor measures the attitude. The data are synthetic.
"""

# %%
# The naive approach
# ------------------
# A smooth curve through the positions has no attitude, and passes between its noisy positions as well as it can.

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

rng = np.random.default_rng(1)
end, gravity = 30.0, np.array([0, 0, -9.80665])  # seconds, m/s²
grid = np.linspace(0, end, 1201)
path = np.stack([12 * np.sin(0.5 * grid), 8 * np.sin(grid), 20 + 2 * np.sin(0.7 * grid)], axis=-1)
angles = np.stack([0.3 * np.sin(1.1 * grid), 0.25 * np.cos(0.9 * grid), 0.8 * np.sin(0.3 * grid)], axis=-1)
space = ss.space("so:3 x r:3")
truth = ss.CubicSpline(grid, (ss.rotations.from_rotation_vectors(angles), path), space, bc_type="not-a-knot")
turning = ss.CubicSpline(grid, truth(grid)[0], "so:3", bc_type="not-a-knot")

t = np.sort(rng.uniform(0, end, 120))  # irregular times of GPS
gps = truth(t)[1] + 0.5 * rng.standard_normal((len(t), 3))
s = np.sort(rng.uniform(0, end, 3000))  # irregular times of the IMU
biases = {"gyro bias": np.array([0.02, -0.03, 0.01]), "accelerometer bias": np.array([0.15, -0.1, 0.2])}
attitude, acceleration = truth(s)[0], truth(s, nu=2)[1]
rates = ss.rotations.angular_velocity(turning, s) + biases["gyro bias"]
force = np.einsum("nij,ni->nj", attitude, acceleration - gravity) + biases["accelerometer bias"]
rates += 0.01 * rng.standard_normal(rates.shape)
force += 0.1 * rng.standard_normal(force.shape)

alone = ss.make_smoothing_spline(t, gps, "r:3")

# %%
# All sensors
# -----------
# The accelerometer measures the second derivative. The penalty on the jerk leaves accelerations free at the ends.

curve = ss.estimate(
    [
        ss.measure.Points(t, gps, sigma=0.5, factor=1),  # positions are the second factor of the space
        ss.measure.BodyRates(s, rates, sigma=0.01, bias=ss.measure.Constant(3)),
        ss.measure.SpecificForce(s, force, sigma=0.1, gravity=gravity, bias=ss.measure.Constant(3)),
    ],
    np.linspace(0, end, 151),
    space,
    penalty="jerk",
)

x = np.linspace(t[0], t[-1], 1000)
rotations, positions = curve(x)
off = ss.space("so:3").distance(rotations, truth(x)[0])
miss = [np.linalg.norm(own - truth(x)[1], axis=1) for own in (alone(x), positions)]
print(f"positions: {miss[0].mean():.2f} m off with GPS only, {miss[1].mean():.2f} m with the IMU")
print(f"attitude: {np.degrees(off.mean()):.2f} degrees off")

figure = plt.figure(figsize=(10, 5), layout="constrained")
axes = figure.subplot_mosaic([["map", "gyro bias"], ["map", "accelerometer bias"]], width_ratios=(3, 2))
axes["map"].plot(*gps[:, :2].T, ".", color="0.7", label="GPS")
axes["map"].plot(*alone(x)[:, :2].T, "C1", linewidth=1, label="GPS only")
axes["map"].plot(*positions[:, :2].T, "C0", label="GPS and IMU")
axes["map"].plot(*truth(x)[1][:, :2].T, "k--", linewidth=1, label="truth")
axes["map"].quiver(*positions[::40, :2].T, *rotations[::40, :2, 0].T, color="C0", width=0.004, scale=20)
axes["map"].set(aspect="equal", xlabel="metres", ylabel="metres", title="From above; arrows: heading")
axes["map"].legend(loc=(0.14, 0.38))
for name, unit in (("gyro bias", "rad/s"), ("accelerometer bias", "m/s²")):
    own = curve.parameters[name]
    axes[name].errorbar(range(3), own.value, 1.96 * own.std, fmt="o", capsize=6, label="estimate, 95 %")
    axes[name].plot(range(3), biases[name], "kx", markersize=9, label="truth")
    axes[name].axhline(0, color="0.8", linewidth=1)
    axes[name].set(xticks=range(3), xticklabels="xyz", xlim=(-0.5, 2.5), ylabel=unit, title=name.capitalize())
axes["gyro bias"].legend()
plt.show()
