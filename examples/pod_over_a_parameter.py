"""
Reduced bases over a parameter
==============================

Heat conduction is simulated for five diffusivities, and a basis of four vectors (proper orthogonal decomposition, POD)
is computed for each. A basis for another diffusivity is to be found without another simulation.
"""

# %%
# The naive way
# -------------
# Interpolate the numbers of the bases. But a basis is one of many of the same subspace: signs and rotations of its
# vectors are accidents of the singular value decomposition. Where they change from one parameter to the next, the
# interpolated vectors lie in a subspace that has nothing to do with either.

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import CubicSpline

import symspline as ss

n = 80
grid, times = np.linspace(0, 1, n + 2)[1:-1], np.linspace(0, 0.1, 30)
second = (np.eye(n, k=1) - 2 * np.eye(n) + np.eye(n, k=-1)) * (n + 1) ** 2
first = (np.eye(n, k=1) - np.eye(n, k=-1)) * (n + 1) / 2


def snapshots(operator, start):
    values, vectors = np.linalg.eig(operator)
    return (vectors * np.linalg.solve(vectors, start) @ np.exp(np.outer(values, times))).real


start = np.exp(-100 * (grid - 0.4) ** 2)
diffusivities = [0.1, 0.3, 0.4, 0.7, 1.0]
bases = ss.subspaces.from_snapshots(
    [snapshots(mu * second + 10 * first, start) for mu in diffusivities], rank=4
)
bases = bases * np.where(np.arange(5) % 2, -1, 1)[:, None, None]  # signs as other programs give them

# %%
# The spline
# ----------
# Subspaces are points of the Grassmannian, and any of their bases represents them.

spline = ss.CubicSpline(diffusivities, bases, ss.Grassmannian(4, n), bc_type="not-a-knot")

mu = 0.55  # without snapshots
operator = mu * second + 10 * first
basis, small = spline.lift(mu), ss.subspaces.reduced_operator(spline, operator, mu)
truth, found = snapshots(operator, start), basis @ snapshots(small, basis.T @ start)
numbers = np.linalg.qr(CubicSpline(diffusivities, bases)(mu))[0]
naive = numbers @ snapshots(numbers.T @ operator @ numbers, numbers.T @ start)


def off(solution):
    return np.linalg.norm(solution - truth) / np.linalg.norm(truth)


print(f"4 numbers in place of {n}: off by {off(found):.1%}; with interpolated numbers by {off(naive):.1%}")

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.5), layout="constrained")
for solution, style, label in (
    (truth, {"color": "0.7", "linewidth": 4}, "full"),
    (naive, {"color": "C1", "linestyle": ":"}, "numbers interpolated"),
    (found, {"color": "C0", "linestyle": "--"}, "spline, 4 numbers"),
):
    lines = left.plot(grid, solution[:, ::8], **style)
    lines[0].set_label(label)
left.set(xlabel="place", ylabel="temperature", title=f"diffusivity {mu}")
left.legend()
between = np.linspace(0.1, 1.0, 200)
right.plot(between, CubicSpline(diffusivities, bases)(between)[:, 20, 0], color="C1", linestyle=":")
right.plot(between, spline.lift(between)[:, [20, 40, 60], 0])
right.set(xlabel="diffusivity", title="entries of the basis: no jumps")
plt.show()
