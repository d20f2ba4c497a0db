"""Diffusion tensors of a volume at four times: all voxels at any time between, as MRtrix reads them, and a picture of
one slice, tensors.png."""

import numpy as np
from matplotlib.figure import Figure

import symspline as ss

rng = np.random.default_rng(0)
days = np.array([0.0, 7.0, 21.0, 56.0])
mask = np.linalg.norm(np.indices((10, 10, 10)) - 4.5, axis=0) < 4
# With nibabel: np.stack([ss.tensors.read_nifti(name, "fsl", mask).tensors for name in names], axis=1)
recorded = np.tile([1.5e-3, 1e-4, 0, 6e-4, 0, 4e-4], (mask.sum(), 4, 1))
recorded *= rng.uniform(0.9, 1.1, (mask.sum(), 4, 1))

curves = ss.CubicSpline(days, ss.tensors.from_vectors(recorded, order="fsl"), "spd:3")
tensors = curves(30.0)
values = np.linalg.eigvalsh(tensors)
print(
    f"{len(curves)} voxels, mean diffusivity {values.mean():.2e} mm²/s, all positive: {bool((values > 0).all())}"
)
volume = np.zeros((*mask.shape, 6))
volume[mask] = ss.tensors.to_vectors(tensors, order="mrtrix")
np.save("day30.npy", volume)

figure = Figure(figsize=(5, 4), layout="constrained")
axes = figure.subplots()
diffusivity = np.full(mask.shape, np.nan)
diffusivity[mask] = values.mean(axis=-1)
figure.colorbar(axes.imshow(diffusivity[5], origin="lower"), label="mean diffusivity, mm²/s")
axes.set(title="day 30, slice 5", xticks=[], yticks=[])
figure.savefig("tensors.png")
