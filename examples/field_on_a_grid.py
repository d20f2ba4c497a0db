"""
A field on a grid, in blocks
============================

The direction of a magnetic field is known at 2592 positions every ten years. A loop over the positions would need all
of them in memory. Here the years between are computed block by block in dask, from one zarr store to another, and a map
shows how fast the field rotates.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

import symspline as ss
import symspline.xarray as sx

stores = Path(tempfile.mkdtemp())
years = np.arange("1900", "2021", 10, dtype="datetime64[Y]").astype("datetime64[s]")
lat, lon = np.arange(-87.5, 90, 5), np.arange(-177.5, 180, 5)
place = ss.geo.from_lonlat(*np.meshgrid(lon, lat))
# A dipole near the Earth's axis that goes round it; with data of your own: xr.open_zarr("field.zarr").direction
age = np.linspace(0, 1, len(years))
axis = ss.geo.from_lonlat(-70 - 60 * age, -78 - 6 * age**2)
field = 3 * np.sum(place[:, :, None] * axis, axis=-1, keepdims=True) * place[:, :, None] - axis
direction = xr.DataArray(
    field / np.linalg.norm(field, axis=-1, keepdims=True),
    dims=("lat", "lon", "time", "q"),
    coords={"lat": lat, "lon": lon, "time": years},
    name="direction",
)
direction.chunk(lat=9).to_zarr(stores / "field.zarr", mode="w", consolidated=False)

blocks = xr.open_zarr(stores / "field.zarr", consolidated=False).direction
sx.fit(blocks, "sphere:2", bc_type="not-a-knot").to_zarr(stores / "curves.zarr", mode="w", consolidated=False)

curves = xr.open_zarr(stores / "curves.zarr", consolidated=False)
middle = np.arange("1900", "2020", dtype="datetime64[Y]").astype("datetime64[s]") + np.timedelta64(182, "D")
speed = np.degrees(sx.speed(curves, middle)) * 365.25 * 86400
fastest = speed.max("time").compute()
print(
    f"{curves.converged.size} curves in {len(blocks.chunks[0])} blocks, {int(curves.converged.sum())} converged; "
    f"the field turns by up to {float(fastest.max()):.2f} degrees a year"
)

figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
figure.colorbar(axes.pcolormesh(lon, lat, fastest, shading="nearest"), label="degrees a year, at most")
axes.set(title="turning of the field's direction", xlabel="longitude", ylabel="latitude")
plt.show()
