"""
A volume of diffusion tensors
=============================

Tensors of all voxels were measured on four days. They are to be interpolated for a day between, in the order of MRtrix.
"""

# %%
# The naive way
# -------------
# Loop over the voxels and fit one curve each, with one call from Python per voxel. Instead, all voxels can be one
# batch: one call on all cores, with bit-identical results.

import tempfile
import time
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import nibabel
import numpy as np

import symspline as ss

rng = np.random.default_rng(0)
days = np.array([0.0, 7.0, 21.0, 56.0])
mask = np.linalg.norm(np.indices((10, 10, 10)) - 4.5, axis=0) < 4
recorded = np.zeros((*mask.shape, len(days), 6))
recorded[mask] = np.array([1.5e-3, 1e-4, 0, 6e-4, 0, 4e-4]) * rng.uniform(
    0.9, 1.1, (mask.sum(), len(days), 1)
)
folder = Path(tempfile.mkdtemp())
names = [folder / f"day{day:02.0f}.nii.gz" for day in days]
for i, name in enumerate(names):  # as FSL would have written them
    nibabel.save(nibabel.Nifti1Image(recorded[..., i, :], np.eye(4)), name)

volumes = [ss.tensors.read_nifti(name, order="fsl", mask=mask) for name in names]
matrices = np.stack([volume.tensors for volume in volumes], axis=1)

start = time.perf_counter()
one_by_one = np.stack([ss.CubicSpline(days, of_voxel, "spd:3")(30.0) for of_voxel in matrices])
loop = time.perf_counter() - start

# %%
# One batch
# ---------

start = time.perf_counter()
curves = ss.CubicSpline(days, matrices, "spd:3")
tensors = curves(30.0)
together = time.perf_counter() - start

values = np.linalg.eigvalsh(tensors)
print(
    f"{len(curves)} voxels, mean diffusivity {values.mean():.2e} mm²/s, all positive: {bool((values > 0).all())}"
)
print(
    f"bit-identical: {np.array_equal(tensors, one_by_one)}; loop {1e3 * loop:.1f} ms, batch {1e3 * together:.1f} ms"
)

ss.tensors.write_nifti(folder / "day30.nii.gz", replace(volumes[0], tensors=tensors), order="mrtrix")

figure, axes = plt.subplots(figsize=(5, 4), layout="constrained")
diffusivity = np.full(mask.shape, np.nan)
diffusivity[mask] = values.mean(axis=-1)
figure.colorbar(axes.imshow(diffusivity[5], origin="lower"), label="mean diffusivity, mm²/s")
axes.set(title="day 30, slice 5", xticks=[], yticks=[])
plt.show()
