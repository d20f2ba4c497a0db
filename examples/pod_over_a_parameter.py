"""Reduced bases of heat conduction between the diffusivities of the snapshots: draws reduced.png."""

import numpy as np
from matplotlib.figure import Figure

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
spline = ss.CubicSpline(diffusivities, bases, ss.Grassmannian(4, n), bc_type="not-a-knot")

mu = 0.55  # without snapshots
basis, small = spline.lift(mu), ss.subspaces.reduced_operator(spline, mu * second + 10 * first, mu)
truth, found = snapshots(mu * second + 10 * first, start), basis @ snapshots(small, basis.T @ start)
figure = Figure(figsize=(9, 3.5), layout="constrained")
left, right = figure.subplots(1, 2)
left.plot(grid, truth[:, ::6], color="0.7", linewidth=3)
left.plot(grid, found[:, ::6], "--", color="C0")
left.set(xlabel="place", ylabel="temperature", title=f"diffusivity {mu}: full (grey) and with 4 numbers")
between = np.linspace(0.1, 1.0, 200)
right.plot(between, spline.lift(between)[:, [20, 40, 60], 0])
right.set(xlabel="diffusivity", title="entries of the basis: no jumps")
figure.savefig("reduced.png")
print(f"4 numbers in place of {n}: off by {np.linalg.norm(found - truth) / np.linalg.norm(truth):.1%}")
