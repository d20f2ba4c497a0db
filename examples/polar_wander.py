"""
A polar wander path
===================

Mean poles of rocks of twenty ages, some known better than others, and the path of the pole through time. The poles are
made up: they are off a given path by as much as their circles of 95 % confidence, A95, say.
"""

# %%
# The naive way
# -------------
# A running mean over five poles, as the literature has it: it treats good and bad poles alike, and has nothing to say
# at the ends. And near the pole of the globe, where the path begins, means of longitudes mean nothing.

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

sphere, rng = ss.Sphere(2), np.random.default_rng(7)
path = ss.CubicSpline([0, 70, 140, 200], ss.geo.from_lonlat([0, 190, 200, 120], [90, 72, 55, 60]), sphere)
ages, a95 = np.linspace(5, 195, 20), np.radians(rng.uniform(2, 10, 20))  # million years
spread = a95 / np.sqrt(-2 * np.log(0.05))  # in one direction, if errors are Gaussian
poles = sphere.exp(path(ages), spread[:, None] * sphere.random_tangent(rng, path(ages)))

# %%
# The smooth path
# ---------------
# The weights say how large the errors are, not only which are larger: sigma is 1.

smooth = ss.make_smoothing_spline(ages, poles, sphere, weights=1 / spread**2, sigma=1.0, criterion="cp")
x = np.linspace(5, 195, 300)
print(
    f"{smooth.df:.0f} degrees of freedom; 100 million years ago A95 is {np.degrees(smooth.band(100)):.1f} degrees"
)

centre = ss.geo.from_lonlat(190, 68)
across = np.stack(ss.geo.compass(centre), axis=1)


def seen(points):
    return np.where(points @ centre > 0, (points @ across).T, np.nan)


def circle(pole, radius):
    angle = np.linspace(0, 2 * np.pi, 100)
    directions = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ np.stack(ss.geo.compass(pole))
    return seen(sphere.exp(pole, radius * directions))


figure = plt.figure(figsize=(8, 6.5), layout="constrained")
axes = figure.subplots()
for lat in (30, 45, 60, 75):
    axes.plot(*seen(ss.geo.from_lonlat(np.arange(361), lat)), color="0.85", linewidth=0.7)
coast = np.genfromtxt(
    Path(ss.__file__).parents[2] / "examples" / "storms" / "coastline.csv", delimiter=",", skip_header=1
)
for piece in np.split(coast, np.flatnonzero(np.isnan(coast[:, 0]))):
    axes.plot(*seen(ss.geo.from_lonlat(*piece[1:].T)), color="0.75", linewidth=0.8)
for pole, radius in zip(smooth(x), smooth.band(x), strict=True):
    axes.fill(*circle(pole, radius), color="#cfe2f3")
dots = axes.scatter(*seen(poles), c=ages, s=30, cmap="plasma", zorder=3, label="mean poles and their A95")
for pole, radius, colour in zip(poles, a95, dots.to_rgba(ages), strict=True):
    axes.plot(*circle(pole, radius), color=colour, linewidth=0.8)
running = sphere.project(np.stack([poles[i - 2 : i + 3].mean(axis=0) for i in range(2, 18)]))
axes.plot(*seen(running), color="0.4", linewidth=1, label="running mean")
axes.plot(*seen(smooth(x)), label="smooth, and its A95")
axes.plot(*seen(path(x)), "k--", linewidth=1, label="true")
figure.colorbar(dots, label="age, million years", shrink=0.8)
axes.set(aspect="equal", xlim=(-0.65, 0.65), ylim=(-0.55, 0.7), xticks=[], yticks=[])
axes.legend(loc="lower left")
plt.show()
