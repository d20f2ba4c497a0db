"""
Noisy GPS
=========

A bicycle ride with a GPS error of 5 to 10 m in every fix, as reported by the receiver. Speed and course are to be
estimated.
"""

# %%
# The naive way
# -------------
# A spline through the fixes. Its speed is that of the noise: several times that of any bicycle.

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

rng = np.random.default_rng(3)
t = np.arange(300.0)  # seconds
speed, course = 5 + 3 * np.cos(t / 25), 150 + 70 * np.sin(t / 45)  # m/s, degrees clockwise from north
metres = np.cumsum(speed * [np.sin(np.radians(course)), np.cos(np.radians(course))], axis=1)
accuracy = rng.uniform(5, 10, len(t))  # metres, as reported by the receiver
metres += accuracy * rng.standard_normal((2, len(t)))
degree, narrow = np.radians(1) * ss.geo.EARTH_RADIUS, np.cos(np.radians(57.7))
lon, lat = 11.97 + metres[0] / degree / narrow, 57.7 + metres[1] / degree

places = ss.geo.from_lonlat(lon, lat)
through = ss.CubicSpline(t, places, "sphere:2")

# %%
# The smooth ride
# ---------------
# Each fix has the weight of its accuracy.

ride = ss.make_smoothing_spline(t, places, "sphere:2", weights=1 / accuracy**2)
x = np.linspace(0, t[-1], 1000)
fast, off = ss.geo.sog(ride, x), ss.geo.EARTH_RADIUS * ride.std(x, nu=1)  # m/s, off in one direction
print(f"{ride.df:.0f} degrees of freedom; half way known to {ss.geo.EARTH_RADIUS * ride.band(150.0):.1f} m")

figure = plt.figure(figsize=(10, 5), layout="constrained")
axes = figure.subplot_mosaic([["map", "speed"], ["map", "course"]], width_ratios=(2, 3))
axes["map"].plot(lon, lat, ".", color="0.7", label="GPS")
axes["map"].plot(*ss.geo.to_lonlat(ride(x)), label="smooth")
axes["map"].set(aspect=1 / narrow, xlabel="longitude", ylabel="latitude")
axes["map"].ticklabel_format(useOffset=False)
axes["map"].locator_params("x", nbins=3)
axes["map"].legend()
for name, true, found, band in (
    ("speed", 3.6 * speed, 3.6 * fast, 1.96 * 3.6 * off),
    ("course", course, ss.geo.cog(ride, x), 1.96 * np.degrees(off / fast)),
):
    axes[name].fill_between(x, found - band, found + band, alpha=0.3, label="95 % band")
    axes[name].plot(x, found, label="smooth")
    axes[name].plot(t, true, "k--", linewidth=1, label="true")
axes["speed"].plot(x, 3.6 * ss.geo.sog(through, x), color="0.8", linewidth=0.5, zorder=0)
axes["speed"].text(5, 95, "grey: through the fixes", color="0.5")
axes["speed"].set(ylim=(0, 110), ylabel="speed, km/h", xticklabels=[])
axes["course"].set(ylabel="course, degrees", xlabel="seconds")
axes["course"].legend()
plt.show()
