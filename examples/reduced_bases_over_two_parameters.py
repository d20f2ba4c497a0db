"""
Reduced bases over two parameters
=================================

A cloud spreads in the wind. It is simulated for four diffusivities and sixteen directions of the wind, and a basis of
four vectors (proper orthogonal decomposition, POD) is computed for each pair. A small model is to be found for other
diffusivities and directions without another simulation.
"""

# %%
# The naive way
# -------------
# Interpolate the numbers of the bases by bicubic splines. But a basis is one of many of the same subspace. Where the
# singular value decomposition returns other signs or another order from node to node, the interpolated vectors are
# wrong. The first axis is the logarithm of the diffusivity, because the solutions vary evenly with it.

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.linalg import expm

import symspline as ss

m, k = 13, 4
place = np.linspace(0, 1, m + 2)[1:-1]
first = (np.eye(m, k=1) - np.eye(m, k=-1)) * (m + 1) / 2
second = (np.eye(m, k=1) - 2 * np.eye(m) + np.eye(m, k=-1)) * (m + 1) ** 2
laplace = np.kron(second, np.eye(m)) + np.kron(np.eye(m), second)
start = np.exp(-60 * ((place[:, None] - 0.5) ** 2 + (place - 0.5) ** 2)).ravel()


def operator(log_diffusivity, direction):
    along = np.cos(direction) * np.kron(first, np.eye(m)) + np.sin(direction) * np.kron(np.eye(m), first)
    return np.exp(log_diffusivity) * laplace - 10 * along


def path(matrix, state):
    step, states = expm(0.002 * matrix), [state]
    for _ in range(20):
        states.append(step @ states[-1])
    return np.stack(states, axis=-1)


axes = np.log([0.2, 0.35, 0.6, 1.0]), np.linspace(0, 2 * np.pi, 17)
snapshots = [[path(operator(nu, angle), start) for angle in axes[1]] for nu in axes[0]]
bases = ss.subspaces.from_snapshots(snapshots, rank=k)


def numbers(nu, angles):
    rows = make_interp_spline(axes[0], bases)(nu)
    return np.linalg.qr(make_interp_spline(axes[1], rows)(angles))[0]


# %%
# The spline
# ----------
# Subspaces are points of the Grassmannian. `GridSpline` interpolates them, whatever their bases are, and the axis of
# directions is periodic. All directions are one call.

grid = ss.GridSpline(axes, bases, ss.Grassmannian(k, m * m), bc_type=("not-a-knot", "periodic"))
nu, directions = np.log(0.27), np.radians(np.arange(4, 360, 8))  # without simulations
found = {"numbers interpolated": numbers(nu, directions), "GridSpline": grid.grid(nu, directions)}


def solve(basis, matrix):
    return basis @ path(basis.T @ matrix @ basis, basis.T @ start)


def error(solution, truth):
    return np.linalg.norm(solution - truth) / np.linalg.norm(truth)


matrices = [operator(nu, angle) for angle in directions]
truths = [path(matrix, start) for matrix in matrices]
found["own simulation"] = ss.subspaces.from_snapshots(truths, k)
errors = {
    name: [error(solve(*each), truth) for *each, truth in zip(own, matrices, truths, strict=True)]
    for name, own in found.items()
}
print("largest error: " + ", ".join(f"{name} {max(each):.1%}" for name, each in errors.items()))

# %%
# Operators that are known at the nodes only
# ------------------------------------------
# Then the small matrices must be interpolated, which makes sense only in bases that fit together. `OperatorSpline`
# aligns them with one reference. One reference suits directions of a quarter of the circle, but not all of them.

quarter = axes[1][:5]
whole = np.array([[operator(a, b) for b in quarter] for a in axes[0]])
small = bases[:, :5].swapaxes(-1, -2) @ whole @ bases[:, :5]
models = ss.subspaces.OperatorSpline((axes[0], quarter), small, bases[:, :5])
i = 4
basis = ss.subspaces.align(found["GridSpline"][i], models.reference)
solution = basis @ path(models((nu, directions[i])), basis.T @ start)
print(f"from {k} x {k} matrices at the nodes: {error(solution, truths[i]):.1%}")

# %%
worst = int(np.argmax(errors["numbers interpolated"]))
clouds = {"full": truths[worst]}
clouds |= {
    name: solve(found[name][worst], matrices[worst]) for name in ("numbers interpolated", "GridSpline")
}
figure = plt.figure(figsize=(10, 3.3), layout="constrained")
left, right = figure.subfigures(1, 2, width_ratios=(1.5, 1))
levels = np.arange(-0.075, 1.05, 0.05) * truths[worst][:, -1].max()
for panel, (title, cloud) in zip(left.subplots(1, 3, sharey=True), clouds.items(), strict=True):
    panel.contourf(place, place, cloud[:, -1].reshape(m, m).T, levels, extend="both")
    panel.set(title=title, aspect="equal", xticks=[], yticks=[])
left.suptitle(f"the cloud at the end, wind to {np.degrees(directions[worst]):.0f}°")
panel = right.subplots()
for (name, each), style in zip(errors.items(), ("C1:", "C0", "k--"), strict=True):
    panel.semilogy(np.degrees(directions), each, style, label=name)
panel.set(
    xlabel="direction of the wind, °", title="error of the reduced model", xticks=[0, 90, 180, 270, 360]
)
panel.legend()
plt.show()
