"""
Wind directions over a year
===========================

Monthly mean wind directions of a coast with monsoon, in degrees. The year is closed: after December comes January.
"""

# %%
# The naive way
# -------------
# Interpolate the degrees. North is 0 and 360: between 340° in November and 10° in December the curve turns through
# south, and the year does not close.

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import CubicSpline

import symspline as ss

months = np.arange(13.0)  # the middle of January, February, …, and of the next January
degrees = np.array([25, 40, 75, 130, 190, 215, 225, 230, 260, 310, 340, 10, 25.0])

x = np.linspace(0, 12, 600)
naive = CubicSpline(months, degrees)(x)

# %%
# The spline
# ----------
# Directions are points of the circle, S¹, and the curve is periodic: it is C² from December to January, too.

angle = np.radians(degrees)
directions = np.column_stack([np.sin(angle), np.cos(angle)])  # east, north
spline = ss.CubicSpline(months, directions, "sphere:1", bc_type="periodic")
smooth = np.degrees(np.arctan2(*spline(x).T)) % 360
turning = np.degrees(spline.speed(x))

figure = plt.figure(figsize=(10, 4.2), layout="constrained")
left = figure.add_subplot(1, 2, 1)
left.plot(x, naive, color="0.6", label="spline of the degrees")
left.plot(
    x,
    np.where(np.abs(np.diff(smooth, prepend=smooth[0])) < 180, smooth, np.nan),
    label="spline on the circle",
)
left.plot(months, degrees, "k.")
left.set(
    xticks=months, xticklabels=list("JFMAMJJASONDJ"), yticks=range(0, 361, 90), ylabel="wind from, degrees"
)
left.legend(loc="upper left")
right = figure.add_subplot(1, 2, 2, projection="polar", theta_offset=np.pi / 2, theta_direction=-1)
right.plot(np.radians(smooth), 1 + x / 12, "C0")
right.plot(angle, 1 + months / 12, "k.")
right.set(rmin=0, yticks=[], xticks=np.radians([0, 90, 180, 270]), xticklabels=list("NESW"))
right.set_title("outwards: January to January")
print(
    f"on 1 December (x = 10.5) from {smooth[525]:.0f} degrees, and the spline of the degrees gives {naive[525]:.0f}"
)
plt.show()
