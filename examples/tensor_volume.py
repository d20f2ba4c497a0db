"""
A volume of diffusion tensors
=============================

The tensors of all voxels of a brain were measured on four days after a stroke. You need them for a day between, in the
order of MRtrix. The brain is a phantom: white matter with fibres around the ventricles, grey matter and a lesion.
"""

# %%
# The naive way
# -------------
# Loop over the voxels and fit one curve each, with one call from Python per voxel. Instead, all voxels can be one
# batch: one call on all cores, with bit-identical results.

import tempfile
import time
from pathlib import Path

import matplotlib.pyplot as plt
import nibabel
import numpy as np

import symspline as ss

rng = np.random.default_rng(0)
days = np.array([0.0, 7.0, 21.0, 56.0])
x, y, z = np.meshgrid(
    np.linspace(-1, 1, 40), np.linspace(-1.2, 1.2, 48), np.linspace(-0.2, 0.2, 3), indexing="ij"
)
radius, angle = np.hypot(x / 0.9, y / 1.1), np.arctan2(y / 1.1, x / 0.9)
mask = radius < 1
ventricles = np.hypot((np.abs(x) - 0.17) / 0.11, y / 0.45) < 1
white = (radius + 0.03 * np.cos(8 * angle) > 0.35) & (radius + 0.05 * np.cos(12 * angle) < 0.75) & ~ventricles
lesion = np.hypot(x - 0.5, y - 0.25) < 0.2

# %%
# Fibres run around the ventricles. The tensors of a voxel are D = a 1 + (b − a) f fᵀ, with the fibre f.

fibres = np.stack([-0.9 * np.sin(angle), 1.1 * np.cos(angle), 0.3 * np.ones_like(x)], axis=-1)
fibres /= np.linalg.norm(fibres, axis=-1, keepdims=True)
across = np.where(ventricles, 2.8e-3, np.where(white, 0.45e-3, 0.8e-3))[..., None, None]
along = np.where(white, 1.5e-3, across[..., 0, 0])[..., None, None]
tensors = across * np.eye(3) + (along - across) * fibres[..., :, None] * fibres[..., None, :]
# Diffusion in the lesion is low at first, and high in the end.
factor = np.where(lesion[..., None], [0.45, 0.55, 0.9, 1.5], 1.0) * np.exp(
    0.03 * rng.normal(size=(*x.shape, 4))
)
measured = factor[..., None, None] * tensors[..., None, :, :]

# %%
# The scanner software wrote one file per day, with the six entries in the order of FSL.

folder = Path(tempfile.mkdtemp())
names = [folder / f"day{day:02.0f}.nii.gz" for day in days]
for i, name in enumerate(names):
    six = ss.tensors.to_vectors(measured[:, :, :, i], order="fsl") * mask[..., None]
    nibabel.save(nibabel.Nifti1Image(six, np.diag([4.0, 4.0, 4.0, 1.0])), name)

images = [nibabel.load(name) for name in names]
six = np.stack([image.get_fdata()[mask] for image in images], axis=1)  # voxels inside the mask, four days
matrices = ss.tensors.from_vectors(six, order="fsl")

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

six = np.zeros((*mask.shape, 6))
six[mask] = ss.tensors.to_vectors(tensors, order="mrtrix")
nibabel.save(nibabel.Nifti1Image(six, images[0].affine, images[0].header), folder / "day30.nii.gz")

# %%
# The middle slice. Red fibres run to the left and right, green ones from front to back. The lesion is dark on day 7
# and bright on day 56; on day 30, when nothing was measured, it has almost the diffusivity of its surroundings.


def in_slice(values):
    volume = np.full((*mask.shape, *values.shape[1:]), np.nan)
    volume[mask] = values
    return np.swapaxes(volume[:, :, 1], 0, 1)


sizes, vectors = np.linalg.eigh(tensors)
anisotropy = np.sqrt(1.5) * np.std(sizes, axis=1) * np.sqrt(3) / np.linalg.norm(sizes, axis=1)
directions = np.abs(vectors[:, :, 2]) * anisotropy[:, None]
figure, axes = plt.subplots(1, 4, figsize=(11, 3.6), layout="constrained")
axes[0].imshow(np.nan_to_num(in_slice(directions)), origin="lower")
axes[0].set(title="fibres, day 30")
for panel, day in zip(axes[1:], (7.0, 30.0, 56.0), strict=True):
    diffusivity = 1e3 * np.trace(curves(day), axis1=1, axis2=2) / 3
    image = panel.imshow(in_slice(diffusivity), origin="lower", vmin=0.3, vmax=1.5, cmap="gray")
    panel.set(title=f"day {day:.0f}" + ", interpolated" * (day == 30))
for panel in axes:
    panel.set(xticks=[], yticks=[])
    panel.spines[:].set_visible(False)
figure.colorbar(image, ax=axes, label="mean diffusivity, 10⁻³ mm²/s", extend="max")
plt.show()
