"""Storms of a table in which fixes are missing: where each was at every hour, and how fast; draws storms.png."""

from importlib.resources import files

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import symspline as ss
from symspline.hurdat import read_sample

# The package's storms of 2021 and 2022 (NOAA), with what many tables have: rows without a place, and a pause.
table = pd.concat(
    pd.DataFrame({"storm": s.label, "time": s.times, "lat": s.lat, "lon": s.lon}) for s in read_sample()
)
table["time"] = table["time"].dt.tz_localize("UTC")
table.loc[np.arange(len(table)) % 9 == 4, ["lat", "lon"]] = np.nan
lost = (table["storm"] == "Larry 2021") & table["time"].between("2021-09-05", "2021-09-07")

fixes = table[~lost].dropna()
hourly = ss.geo.resample(fixes, "1h", by="storm", time="time", max_gap=np.timedelta64(12, "h"))
fastest = hourly.loc[hourly["sog"].idxmax()]
print(
    f"{hourly['storm'].nunique()} storms, {len(fixes)} fixes, {len(hourly)} hours; fastest: {fastest['storm']}"
)

figure = Figure(figsize=(9, 5.2), layout="constrained")
axes = figure.subplots()
axes.plot(
    *pd.read_csv(files("symspline") / "data" / "coastline.csv").to_numpy().T, color="0.75", linewidth=0.7
)
dots = axes.scatter(hourly["lon"], hourly["lat"], c=3.6 * hourly["sog"], s=2, vmax=80, cmap="plasma")
axes.plot(fixes["lon"], fixes["lat"], "k.", markersize=1.5)
pause = hourly[hourly["storm"] == "Larry 2021"].set_index("time")["2021-09-04":"2021-09-08"]
axes.annotate(
    "Larry's pause", (pause["lon"].mean(), pause["lat"].mean()), (-40, 28), arrowprops={"arrowstyle": "-"}
)
figure.colorbar(dots, label="speed over ground, km/h", extend="max")
axes.set(xlim=(-140, 0), ylim=(5, 67), xlabel="longitude", ylabel="latitude", title="Every hour of 37 storms")
figure.savefig("storms.png")
