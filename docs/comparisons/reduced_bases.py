"""Reduced bases between the nodes of a grid of two parameters, by six ways of interpolation.

python docs/comparisons/reduced_bases.py [--write]
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from convection import Array, Problem, Unseen, drift, wind
from page import insert, parser, table, versions
from scipy.interpolate import RegularGridInterpolator

import symspline as ss

ENTRIES, ALIGNED = "entries", "aligned entries"
BILINEAR, BICUBIC, LOCAL = "tangent space, bilinear", "tangent space, bicubic", "tangent spaces, 4 × 4 nodes"
GRID = "GridSpline"
# Nodes of both axes, and of the diffusivity with those of the direction.
DRIFT_SIZES = tuple((n, n) for n in range(4, 10))
WIND_SIZES = ((4, 9), (4, 13), (4, 17))
Errors = dict[str, tuple[float, float]]


def interpolated(problem: Problem, size: tuple[int, int], parameters: Array) -> dict[str, Array]:
    """Bases at parameters, by method, from the bases at the nodes of a grid."""
    axes = [np.linspace(*ends, n) for ends, n in zip(problem.ranges, size, strict=True)]
    nodes = problem.bases(axes[0][:, None], axes[1])
    n, k = nodes.shape[-2:]
    space, middle = ss.Grassmannian(k, n), nodes[tuple((m - 1) // 2 for m in size)]

    def between(values: Array, method: str) -> Array:
        return np.asarray(RegularGridInterpolator(axes, values, method=method)(parameters.T))

    found = {ENTRIES: np.linalg.qr(between(nodes, "cubic"))[0]}
    with warnings.catch_warnings():
        # Subspaces that are nearly orthogonal to the reference are part of the comparison.
        warnings.simplefilter("ignore", UserWarning)
        found[ALIGNED] = np.linalg.qr(between(ss.subspaces.align(nodes, middle), "cubic"))[0]
    # Amsallem & Farhat (2008): logarithms at one reference are interpolated.
    logs = space.log(np.broadcast_to(middle, nodes.shape), nodes)
    for name, method in ((BILINEAR, "linear"), (BICUBIC, "cubic")):
        tangents = between(logs, method)
        found[name] = np.asarray(space.exp(np.broadcast_to(middle, tangents.shape), tangents))
    found[LOCAL] = np.stack([_local(problem, axes, nodes, mu) for mu in parameters.T])
    found[GRID] = ss.GridSpline(axes, nodes, space, bc_type=problem.bc_type)(tuple(parameters))
    return found


def _local(problem: Problem, axes: list[Array], nodes: Array, mu: Array) -> Array:
    """One basis by logarithms at the nearest of the 4 × 4 nodes around the parameters, which cubics interpolate."""
    own = []
    for axis, (t, x, ends) in enumerate(zip(axes, mu, problem.bc_type, strict=True)):
        n, first = len(t), np.searchsorted(t, x) - 2
        chosen = np.arange(4) + (first if ends == "periodic" else np.clip(first, 0, n - 4))
        laps, index = np.divmod(chosen, n - 1) if ends == "periodic" else (0, chosen)
        own.append(t[index] + laps * (t[-1] - t[0]))
        nodes = nodes.take(index, axis=axis)
    nearest = tuple(int(np.argmin(np.abs(t - x))) for t, x in zip(own, mu, strict=True))
    space, reference = ss.Grassmannian(*nodes.shape[:-3:-1]), nodes[nearest]
    logs = space.log(np.broadcast_to(reference, nodes.shape), nodes)
    return np.asarray(space.exp(reference, RegularGridInterpolator(own, logs, method="cubic")(mu)[0]))


def errors(unseen: Unseen, size: tuple[int, int]) -> Errors:
    """Root mean squares of the subspace error in radians, and of the relative error of the reduced model."""
    found = interpolated(unseen.problem, size, unseen.parameters)
    return {name: (_rms(unseen.distances(b)), _rms(unseen.model_errors(b))) for name, b in found.items()}


def text(title: str, unseen: Unseen, sizes: Sequence[tuple[int, int]]) -> str:
    """Both tables of a problem."""
    rows = [(f"{a} × {b}", errors(unseen, (a, b))) for a, b in sizes]
    names = list(rows[0][1])
    subspaces = table(["nodes", *names], [[size, *(f"{row[m][0]:.1e}" for m in names)] for size, row in rows])
    models = table(["nodes", *names], [[size, *(f"{row[m][1]:.2%}" for m in names)] for size, row in rows])
    best = _rms(unseen.model_errors(unseen.own))
    return (
        f"**{title}**, subspace error rms in rad\n\n{subspaces}\n\n"
        f"**{title}**, error of the reduced model rms; with the basis of the same simulation {best:.2%}\n\n{models}"
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def main() -> None:
    given = parser(__doc__).parse_args()
    parts = [
        text("Drift on an interval", Unseen(drift(), 40), DRIFT_SIZES),
        text("Wind from every direction", Unseen(wind(), 40), WIND_SIZES),
    ]
    found = "\n\n".join([*parts, versions("symspline", "scipy")])
    print(found)
    if given.write:
        insert("bases", found)


if __name__ == "__main__":
    main()
