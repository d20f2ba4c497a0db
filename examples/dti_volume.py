"""
A DTI volume on finer voxels
============================

Diffusion tensors were measured in voxels of 2.5 mm. For tractography they are to be interpolated to 1.25 mm, inside a
brain mask. The brain is synthetic, so that the truth between the voxels is known.
"""

# %%
# The data
# --------
# White matter with fibres that fan out and turn out of the plane, grey matter around it, and two ventricles. Each voxel
# has 30 noisy signals (b = 1000 s/mm², signal-to-noise ratio 20), to which a tensor is fitted in the usual way.

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import nibabel
import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import distance_transform_edt

import symspline as ss

rng = np.random.default_rng(0)
axes = [np.linspace(-size, size, n) for size, n in ((0.9, 57), (1.1, 69), (0.22, 9))]
x, y, z = np.meshgrid(*axes, indexing="ij")
radius = np.hypot(np.hypot(x / 0.78, y / 0.98), z / 0.9)
fluid = 1 / (1 + np.exp((np.hypot((abs(x) - 0.13) / 0.6, y / 2.2) - 0.14) / 0.02))
white = (1 - fluid) / (1 + np.exp((radius - 0.72 - 0.05 * np.cos(9 * np.arctan2(y, x))) / 0.05))
in_plane = np.arctan2(y - 0.1, 0.25 + abs(x)) * np.tanh(x / 0.12)
out = 1.3 * np.exp(-(((abs(x) - 0.42) / 0.13) ** 2) - (y / 0.28) ** 2)
along = 0.08 + 1.12 * white  # logarithms of the ratios of eigenvalues
sizes = np.exp(np.stack([along, 0.12 * white - along / 2, -0.12 * white - along / 2], axis=-1))
sizes *= (0.75e-3 + 2.2e-3 * fluid + 0.1e-3 * (1 - white) * (1 - fluid))[..., None]  # mm²/s
turn = ss.rotations.from_rotation_vectors(in_plane[..., None] * [0, 0, 1])
turn = turn @ ss.rotations.from_rotation_vectors(out[..., None] * [0, -1, 0])
truth = np.einsum("...ij,...j,...kj->...ik", turn, sizes, turn)

coarse, mask = truth[::2, ::2, ::2], radius[::2, ::2, ::2] < 1
gradients = rng.standard_normal((30, 3))
gradients /= np.linalg.norm(gradients, axis=1, keepdims=True)
clean = np.exp(-1000 * np.einsum("gi,...ij,gj->...g", gradients, coarse, gradients))
signals = np.hypot(clean + 0.05 * rng.standard_normal(clean.shape), 0.05 * rng.standard_normal(clean.shape))
dyads = ss.tensors.to_vectors(gradients[:, :, None] * gradients[:, None, :], order="fsl") * [1, 2, 2, 1, 2, 1]
fitted = np.linalg.lstsq(dyads, -np.log(signals).reshape(-1, 30).T / 1000)[0].T
measured = ss.tensors.from_vectors(fitted.reshape(*mask.shape, 6), order="fsl")

# %%
# The naive way
# -------------
# Interpolate each of the six numbers. SciPy needs values outside the mask, which are those of the nearest voxel here.
# Half way between two thin ellipsoids lies a thick one: where fibres turn, the determinant swells. Cubic interpolation
# oscillates at noise and jumps: some of its tensors have negative eigenvalues, although no fitted tensor has.


def interpolated(values, method):
    nearest = distance_transform_edt(~mask, return_distances=False, return_indices=True)
    nodes = [axis[::2] for axis in axes]
    return RegularGridInterpolator(nodes, values[tuple(nearest)], method=method)((x, y, z))


linear, cubic = interpolated(measured, "linear"), interpolated(measured, "cubic")

# %%
# Log-Euclidean interpolation, and the grid spline
# ------------------------------------------------
# The usual remedy interpolates the six numbers of the matrix logarithm. The grid spline uses the affine-invariant
# metric. It needs no values outside the mask. Both need positive tensors: eigenvalues of fits below 1e-4 mm²/s are
# raised to it first.


def with_eigenvalues(tensors, function):
    values, vectors = np.linalg.eigh(tensors)
    return np.einsum("...ij,...j,...kj->...ik", vectors, function(values), vectors)


def log_euclidean(tensors):
    return with_eigenvalues(interpolated(with_eigenvalues(tensors, np.log), "cubic"), np.exp)


def grid_spline(tensors):
    nodes = np.where(mask[..., None, None], tensors, np.nan)  # voxels outside the mask are missing
    spline = ss.GridSpline((None, None, None), nodes, "spd:3", bc_type="not-a-knot")
    return spline.grid(*(np.arange(n) / 2 for n in truth.shape[:3]))


raised = with_eigenvalues(measured, lambda values: np.maximum(values, 1e-4))
spline, logarithms = grid_spline(raised), log_euclidean(raised)

between = np.isfinite(spline[..., 0, 0])
between[::2, ::2, ::2] = False  # the voxels that were measured


def compare(case, results):
    for name, found in results.items():
        own, true = found[between], truth[between]
        off = np.linalg.norm(own - true, axis=(1, 2)) / np.linalg.norm(true, axis=(1, 2))
        eigenvalues = np.linalg.eigvalsh(own)
        positive = eigenvalues[:, 0] > 0
        swelling = np.linalg.det(own[positive]) / np.linalg.det(true[positive])
        print(
            f"{case}, {name:22} off by {100 * np.median(off):.2f} %, determinant up to {swelling.max():.1f} times "
            f"the true one, {np.sum(~positive)} tensors not positive"
        )


exact = {
    "six numbers, linear": interpolated(coarse, "linear"),
    "log-Euclidean, cubic": log_euclidean(coarse),
    "grid spline": grid_spline(coarse),
}
compare("noisy", {"six numbers, linear": linear, "six numbers, cubic": cubic})
compare("noisy", {"log-Euclidean, cubic": logarithms, "grid spline": spline})
compare("clean", exact)

# %%
# On data without noise, log-Euclidean interpolation is a little closer to the truth than the grid spline. On noisy data
# the error is mostly noise in the nodes: linear interpolation averages neighbours and has the smallest error, and any
# interpolant through the nodes keeps their noise (smooth the data first if that matters). The grid spline does not
# depend on the unit or the frame of the tensors, needs no preparation outside the mask, and is twice continuously
# differentiable, as tractography by integration assumes.
#
# From file to file
# -----------------
# ``nibabel`` reads and writes NIfTI files. FSL writes six numbers per voxel, which are zero outside the mask. The new
# voxels have half the size and the same first centre, which determines their affine map. The header of the old file is
# kept, with its units and texts.

folder = Path(tempfile.mkdtemp())
six = np.where(mask[..., None], ss.tensors.to_vectors(raised, order="fsl"), 0.0)
nibabel.save(nibabel.Nifti1Image(six, np.diag([2.5, 2.5, 2.5, 1])), folder / "dti.nii.gz")

image = nibabel.load(folder / "dti.nii.gz")
mask = image.get_fdata().any(axis=-1)
fine = grid_spline(ss.tensors.from_vectors(image.get_fdata(), order="fsl"))
six = np.nan_to_num(ss.tensors.to_vectors(fine, order="fsl"))
finer = nibabel.Nifti1Image(six, image.affine @ np.diag([0.5, 0.5, 0.5, 1]), image.header)
finer.header.set_sform(finer.affine, int(image.header["sform_code"]))
finer.header.set_qform(finer.affine, int(image.header["qform_code"]))
nibabel.save(finer, folder / "fine.nii.gz")
print(
    f"{mask.sum()} voxels of 2.5 mm, {np.isfinite(fine[..., 0, 0]).sum()} of {finer.header.get_zooms()[0]} mm"
)


def colours(tensors):
    """The direction of the fibres as red, green and blue, as bright as the fractional anisotropy."""
    values, vectors = np.linalg.eigh(np.nan_to_num(tensors))
    spread = np.linalg.norm(values - values.mean(axis=-1, keepdims=True), axis=-1)
    anisotropy = np.sqrt(1.5) * spread / np.maximum(np.linalg.norm(values, axis=-1), 1e-9)
    return np.clip(1.2 * anisotropy[..., None] * abs(vectors[..., -1]), 0, 1)


figure = plt.figure(figsize=(9, 6.4), layout="constrained")
above, below = figure.subfigures(2, height_ratios=(3, 2))
level = 4  # a slice that was measured
inside = np.isfinite(spline[:, :, level])
pictures = {
    "measured, 2.5 mm": np.where(mask[:, :, level // 2, None, None], measured[:, :, level // 2], 0),
    "six numbers, linear": np.where(inside, linear[:, :, level], 0),
    "grid spline, 1.25 mm": spline[:, :, level],
    "truth": np.where(inside, truth[:, :, level], 0),
}
for axis, (title, tensors) in zip(above.subplots(1, 4), pictures.items(), strict=True):
    axis.imshow(colours(tensors).swapaxes(0, 1), origin="lower", interpolation="nearest")
    axis.set(title=title, xticks=[], yticks=[])
left, right = below.subplots(1, 2)
across = (slice(16, 41), 31, level)  # between two rows of voxels, through the fan and both ventricles
styles = dict(
    zip(
        exact,
        ({"color": "0.6"}, {"color": "C1", "linestyle": "--", "zorder": 3}, {"color": "C0"}),
        strict=True,
    )
)
for name, found in exact.items():
    swelling = np.linalg.det(found[across]) / np.linalg.det(truth[across])
    left.plot(1.25 * np.arange(-12, 13), swelling, **styles[name])
    off = np.linalg.norm(found[between] - truth[between], axis=(1, 2)) / np.linalg.norm(
        truth[between], axis=(1, 2)
    )
    right.semilogx(np.sort(100 * off), np.linspace(0, 100, off.size), **styles[name], label=name)
left.set(title="without noise", xlabel="position, mm", ylabel="determinant / true one")
right.legend(loc="upper left", fontsize="small")
right.set(title="without noise", xlabel="error, %", ylabel="% of voxels below it", xlim=(1e-3, 100))
plt.show()
