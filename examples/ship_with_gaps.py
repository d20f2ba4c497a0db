"""
A ship's track from position, speed and course
==============================================

A ship reports its position, speed and course at irregular times with gaps of up to 48 minutes. Speed and course show
how the ship turned in between. The data are synthetic.
"""

# %%
# The naive approach
# ------------------
# A spline through the positions ignores the reported speed and course, and cuts the corners in the gaps.

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

rng = np.random.default_rng(2)
globe, radius = ss.Sphere(2), ss.geo.EARTH_RADIUS
grid = np.arange(0.0, 6 * 3600 + 1, 60.0)  # seconds
sog = 6.0 + 1.5 * np.cos(grid / 4000)  # m/s
cog = np.radians(60 + 70 * np.sin(2 * np.pi * grid / 9000))  # clockwise from north
north, east = (np.cumsum(sog * own) * 60 / radius for own in (np.cos(cog), np.sin(cog)))
lat = 57.0 + np.degrees(north)
lon = 10.8 + np.degrees(east / np.cos(np.radians(lat)))
truth = ss.CubicSpline(grid, ss.geo.from_lonlat(lon, lat), globe, bc_type="not-a-knot")

t = np.sort(rng.uniform(0, grid[-1], 14))
metres, metres_per_second = 50.0, 0.2  # standard deviations
y = globe.exp(truth(t), metres / radius * globe.random_tangent(rng, truth(t)))

# %%
# Position, speed and course
# --------------------------
# Speed and course at a measured position are a tangent vector there, in radians per second: north and east are two unit
# vectors, and the course is the angle from north.

lon_y, lat_y = np.radians(ss.geo.to_lonlat(y))
to_east = np.stack([-np.sin(lon_y), np.cos(lon_y), 0 * lon_y], axis=-1)
to_north = np.cross(y, to_east)
speed = ss.geo.sog(truth, t) + metres_per_second * rng.standard_normal(len(t))
course = np.radians(ss.geo.cog(truth, t)) + 0.03 * rng.standard_normal(len(t))
v = (speed * (np.cos(course) * to_north.T + np.sin(course) * to_east.T)).T / radius

positions = ss.measure.Points(t, y, sigma=metres / radius)
alone = ss.CubicSpline(t, y, globe)
curve = ss.estimate(
    [positions, ss.measure.Velocities(t, y, v, sigma=metres_per_second / radius)],
    60,
    globe,
)

x = np.linspace(t[0], t[-1], 800)
for name, own in (("through the positions", alone), ("with speed and course", curve)):
    print(f"{name}: up to {radius * globe.distance(own(x), truth(x)).max() / 1000:.1f} km off")
lengths = radius * curve.sample(rng, 200).length() / 1000
print(f"distance sailed: {lengths.mean():.1f} ± {lengths.std():.1f} km")

figure, axes = plt.subplots(figsize=(9, 5), layout="constrained")
axes.plot(*ss.geo.to_lonlat(truth(x)), "k--", linewidth=1.5, label="truth", zorder=3)
drawn = curve.sample(rng, 40)
for i in range(40):
    axes.plot(*ss.geo.to_lonlat(drawn[i](x)), "C0", alpha=0.1, linewidth=1)
axes.plot(*ss.geo.to_lonlat(alone(x)), "C1", label="through the positions")
axes.plot(*ss.geo.to_lonlat(curve(x)), "C0", label="positions, speed and course, with 40 samples")
axes.quiver(*np.degrees([lon_y, lat_y]), np.sin(course), np.cos(course), color="0.2", width=0.004, zorder=4)
axes.plot(*np.degrees([lon_y, lat_y]), "o", color="0.2", label="reports with course", zorder=4)
axes.set(aspect=1 / np.cos(np.radians(57.2)), xlabel="longitude, degrees", ylabel="latitude, degrees")
axes.set_title(f"{len(t)} reports of a ship in six hours")
axes.legend(loc="upper left")
plt.show()
