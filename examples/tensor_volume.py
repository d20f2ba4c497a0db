"""
A volume of diffusion tensors
=============================

Tensors of all voxels were measured on four days, and are wanted on a day between, in the order that MRtrix reads.
"""

# %%
# The naive way
# -------------
# A loop over the voxels, each with a curve of its own: Python is called for each. Instead, all voxels are one batch:
# one call, on all cores, with the same bits.

import time

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

rng = np.random.default_rng(0)
days = np.array([0.0, 7.0, 21.0, 56.0])
mask = np.linalg.norm(np.indices((10, 10, 10)) - 4.5, axis=0) < 4
# With nibabel: np.stack([ss.tensors.read_nifti(name, "fsl", mask).tensors for name in names], axis=1)
recorded = np.tile([1.5e-3, 1e-4, 0, 6e-4, 0, 4e-4], (mask.sum(), 4, 1))
recorded *= rng.uniform(0.9, 1.1, (mask.sum(), 4, 1))
matrices = ss.tensors.from_vectors(recorded, order="fsl")

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
    f"the same bits: {np.array_equal(tensors, one_by_one)}; loop {1e3 * loop:.1f} ms, batch {1e3 * together:.1f} ms"
)

volume = np.zeros((*mask.shape, 6))
volume[mask] = ss.tensors.to_vectors(tensors, order="mrtrix")  # ss.tensors.write_nifti writes files

figure, axes = plt.subplots(figsize=(5, 4), layout="constrained")
diffusivity = np.full(mask.shape, np.nan)
diffusivity[mask] = values.mean(axis=-1)
figure.colorbar(axes.imshow(diffusivity[5], origin="lower"), label="mean diffusivity, mm²/s")
axes.set(title="day 30, slice 5", xticks=[], yticks=[])
plt.show()
