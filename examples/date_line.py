"""
Across the date line
====================

A cyclone crosses the 180th meridian. Its longitude goes from 178 to −177 degrees.
"""

# %%
# The naive way
# -------------
# A spline through longitude and latitude takes the numbers as they are: from +178° to −177° it goes round the world,
# the wrong way, and swings on both sides of it. Unwrapping the longitudes mends this place, and fails at a pole.

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import CubicSpline

import symspline as ss

hours = np.arange(0, 48, 6.0)
lon = np.array([170.0, 172.5, 175.3, 178.1, -178.9, -175.5, -171.4, -166.8])
lat = np.array([-14.0, -14.6, -15.6, -17.0, -18.9, -21.3, -24.0, -27.1])

x = np.linspace(0, 42, 400)
naive = CubicSpline(hours, np.column_stack([lon, lat]))(x)

# %%
# The spline
# ----------
# Positions are unit vectors. Longitude and latitude are only a way to write them down, before and after.

track = ss.CubicSpline(3600 * hours, ss.geo.from_lonlat(lon, lat), "sphere:2", bc_type="not-a-knot")
smooth_lon, smooth_lat = ss.geo.to_lonlat(track(3600 * x))

# %%
# Speed and course need no care for the date line either.

print(f"speed {ss.geo.sog(track, 3600 * 20):.1f} m/s, course {ss.geo.cog(track, 3600 * 20):.0f} degrees")

# %%

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
left.plot(*naive.T, color="0.6", label="spline of longitude and latitude")
left.plot(lon, lat, "k.")
left.plot(
    smooth_lon,
    np.where(np.abs(np.diff(smooth_lon, prepend=smooth_lon[0])) < 180, smooth_lat, np.nan),
    label="spline on the sphere",
)
left.set(xlim=(-190, 190), xlabel="longitude", ylabel="latitude", title="The whole world")
left.legend(loc="upper center")
right.plot(smooth_lon % 360, smooth_lat, "C0")
right.plot(lon % 360, lat, "k.")
right.axvline(180, color="0.8", zorder=0)
right.set(xlabel="degrees east", title="Near the date line")
plt.show()
