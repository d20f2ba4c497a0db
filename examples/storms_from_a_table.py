"""
Storms from a table
===================

Where was each of 37 storms at every hour, and how fast? The table has a fix every six hours, rows without a
position, and a gap. The storms are NOAA's best tracks of 2021 and 2022, in the folder of the demonstration.
"""

# %%
# The naive way
# -------------
# Interpolate latitude and longitude in pandas. Tracks get corners at the fixes, and the speed jumps from one fix to the
# next.

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import symspline as ss

STORMS = Path(ss.__file__).parents[2] / "examples" / "storms"
sys.path.append(str(STORMS))
from hurdat import read_sample  # noqa: E402

table = pd.concat(
    pd.DataFrame({"storm": s.label, "time": s.times, "lat": s.lat, "lon": s.lon}) for s in read_sample()
)
table["time"] = table["time"].dt.tz_localize("UTC")
table.loc[np.arange(len(table)) % 9 == 4, ["lat", "lon"]] = np.nan
lost = (table["storm"] == "Larry 2021") & table["time"].between("2021-09-05", "2021-09-07")
fixes = table[~lost].dropna()

larry = fixes[fixes["storm"] == "Larry 2021"].set_index("time")[["lat", "lon"]]
naive = larry.resample("1h").mean().interpolate("linear")
step = ss.Sphere(2).distance(
    ss.geo.from_lonlat(naive["lon"][:-1], naive["lat"][:-1]),
    ss.geo.from_lonlat(naive["lon"][1:], naive["lat"][1:]),
)
naive_speed = ss.geo.EARTH_RADIUS * step / 1000  # km/h

# %%
# The splines
# -----------
# One call: a curve for each storm, cut where there is no fix for twelve hours, at regular times, with speed and course
# over ground.

hourly = ss.geo.resample(fixes, "1h", by="storm", time="time", max_gap=np.timedelta64(12, "h"))
fastest = hourly.loc[hourly["sog"].idxmax()]
print(
    f"{hourly['storm'].nunique()} storms, {len(fixes)} fixes, {len(hourly)} hours; fastest: {fastest['storm']}"
)

of_larry = hourly[hourly["storm"] == "Larry 2021"].set_index("time")["sog"].resample("1h").mean()
figure, axes = plt.subplots(figsize=(9, 3), layout="constrained")
axes.plot(naive.index[1:], naive_speed, color="0.6", label="latitude and longitude, linear")
axes.plot(of_larry.index, 3.6 * of_larry, label="spline on the sphere, in two segments")
axes.set(ylabel="km/h", title="Speed of Larry, 2021")
axes.legend()

# %%
# All storms, coloured by speed:

coast = pd.read_csv(STORMS / "coastline.csv")
figure, axes = plt.subplots(figsize=(9, 5.2), layout="constrained")
axes.plot(*coast.to_numpy().T, color="0.75", linewidth=0.7)
dots = axes.scatter(hourly["lon"], hourly["lat"], c=3.6 * hourly["sog"], s=2, vmax=80, cmap="plasma")
axes.plot(fixes["lon"], fixes["lat"], "k.", markersize=1.5)
pause = hourly[hourly["storm"] == "Larry 2021"].set_index("time")["2021-09-04":"2021-09-08"]
axes.annotate(
    "Larry's pause", (pause["lon"].mean(), pause["lat"].mean()), (-40, 28), arrowprops={"arrowstyle": "-"}
)
figure.colorbar(dots, label="speed over ground, km/h", extend="max")
axes.set(xlim=(-140, 0), ylim=(5, 67), xlabel="longitude", ylabel="latitude", title="Every hour of 37 storms")
plt.show()
