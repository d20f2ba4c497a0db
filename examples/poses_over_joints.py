"""
Poses over a joint plane
========================

The pose of a tool was measured at seven angles of one joint and five of another, and is needed at all angles between.
"""

# %%
# The naive way
# -------------
# Interpolate the nine numbers of each rotation matrix with SciPy. Between the nodes the results are not rotations:
# their columns are too short, and a box that the tool holds shrinks.

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial.transform import Rotation

import symspline as ss


def tool(q1, q2):
    """Rotation and position, in metres, of the tool of an arm with two joints and a coupled wrist."""
    q1, q2 = np.broadcast_arrays(q1, q2)
    zero = np.zeros_like(q1)
    base = ss.rotations.from_rotation_vectors(np.stack([zero, zero, q1], axis=-1))
    elbow = base @ ss.rotations.from_rotation_vectors(np.stack([zero, q2, zero], axis=-1))
    wrist = elbow @ ss.rotations.from_rotation_vectors(np.stack([0.8 * np.sin(q1) * q2, zero, zero], axis=-1))
    return wrist, base @ [0.0, 0.0, 0.4] + elbow @ [0.6, 0.0, 0.0]


q1, q2 = np.linspace(-0.5, 4, 7), np.linspace(-1.2, 0.8, 5)
rotations, positions = tool(q1[:, None], q2)
fine1, fine2 = np.linspace(-0.5, 4, 181), np.linspace(-1.2, 0.8, 81)
truth, places = tool(fine1[:, None], fine2)
everywhere = tuple(np.meshgrid(fine1, fine2, indexing="ij"))

matrices = RegularGridInterpolator((q1, q2), rotations, method="cubic")(everywhere)
volume = np.linalg.det(RegularGridInterpolator((q1, q2), rotations)(everywhere))
print(f"Linear interpolation shrinks a box to {100 * volume.min():.0f} % of its volume.")

# %%
# Normalised quaternions are rotations, but q and −q are the same one. Here all have w ≥ 0, as many drivers return them,
# so that their sign changes between neighbouring nodes where the tool has turned by half a turn.

quaternions = Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_quat(canonical=True).reshape(7, 5, 4)
between = RegularGridInterpolator((q1, q2), quaternions, method="cubic")(everywhere)
turned = Rotation.from_quat(between.reshape(-1, 4)).as_matrix().reshape(truth.shape)

# %%
# The grid
# --------
# A pose is a point of ``so:3 x r:3``. All values of the grid are poses, and it is smooth in both angles.

grid = ss.GridSpline((q1, q2), (rotations, positions), "so:3 x r:3")
smooth, found = grid.grid(fine1, fine2)
print(f"Largest error of the position: {1000 * np.linalg.norm(found - places, axis=-1).max():.0f} mm")

so3 = ss.SpecialOrthogonal(3)
methods = {"matrices, projected": so3.project(matrices), "quaternions": turned, "GridSpline": smooth}
comparison, axes = plt.subplots(1, 3, figsize=(11, 3.2), sharey=True, layout="constrained")
for panel, (name, values) in zip(axes, methods.items(), strict=True):
    error = np.degrees(so3.distance(values, truth))
    print(f"{name}: largest error {error.max():.1f}°")
    image = panel.pcolormesh(fine1, fine2, np.log10(error + 1e-4).T, vmin=-3, vmax=2, shading="gouraud")
    panel.plot(*np.meshgrid(q1, q2), "k.", markersize=3)
    panel.set(title=f"{name}: up to {error.max():.1f}°", xlabel="first joint, rad")
axes[0].set_ylabel("second joint, rad")
comparison.colorbar(image, ax=axes, label="log₁₀ of the error in degrees")
plt.show()

# %%
# The picture of the grid has a panel per factor: the orientation map, and the surface of the positions.

figure = grid.plot()
