"""Grids beside what people use today: SciPy and dipy on the components of tensors, SciPy on rotation matrices."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial.transform import Rotation

import symspline as ss

from .memory import peak
from .tables import count, table, verdict, versus
from .timing import Effort, Work, measure, ready, seconds

Array = NDArray[np.float64]
SIX = np.triu_indices(3)
HERE, ALL = "symspline, one core", "symspline, all cores"


@dataclass(frozen=True)
class Sizes:
    """The nodes of the volume and of the map, and the number of scattered coordinates."""

    volume: tuple[int, int, int]
    map: int
    scattered: int
    goals: bool


FULL, QUICK = Sizes((96, 96, 60), 41, 100_000, True), Sizes((8, 7, 6), 8, 50, False)


def exponential(log: Array) -> Array:
    """The matrix exponential of symmetric matrices."""
    values, vectors = np.linalg.eigh(log)
    product: Array = np.einsum("...ij,...j,...kj->...ik", vectors, np.exp(values), vectors)
    return product


def logarithm(tensors: Array) -> Array:
    """The six components of the matrix logarithm."""
    values, vectors = np.linalg.eigh(tensors)
    return np.einsum("...ij,...j,...kj->...ik", vectors, np.log(values), vectors)[..., *SIX]


def from_six(six: Array) -> Array:
    """The tensors whose logarithms have these components."""
    log = np.zeros((*six.shape[:-1], 3, 3))
    log[..., *SIX] = six
    log[..., SIX[1], SIX[0]] = six
    return exponential(log)


def tensors(x: Array, y: Array, z: Array) -> Array:
    """A smooth field of positive definite tensors on the outer product of coordinates."""
    g = np.meshgrid(x, y, z, indexing="ij")
    log = np.zeros((*g[0].shape, 3, 3))
    for i in range(3):
        for j in range(i, 3):
            wave = 2 * np.pi * (g[0] * (i + 1) / 2 + 0.3 * g[1] * (j + 1) + 0.7 * g[2] * (i + j))
            log[..., i, j] = log[..., j, i] = 0.25 * np.sin(wave)
    return exponential(log)


def turns(x: Array, y: Array) -> Array:
    """A smooth field of rotation matrices."""
    vectors = np.stack([np.sin(3 * x + 2 * y), np.cos(2 * x - y), x * y], axis=-1)
    return Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(*vectors.shape, 3)


def pieces(sizes: Sizes, threads: int, effort: Effort) -> Iterator[str]:
    """The measured part of the README, paragraph by paragraph."""
    yield "## Grids"
    yield _volume(sizes, threads, effort)
    yield _map(sizes, threads, effort)


def _volume(sizes: Sizes, threads: int, effort: Effort) -> str:
    """A volume of tensors, doubled along each axis; fits included."""
    axes = [np.linspace(0, 1, n) for n in sizes.volume]
    fine = [np.linspace(0, 1, 2 * n) for n in sizes.volume]
    data, truth = tensors(*axes), tensors(*fine)
    six = logarithm(data)

    def ours() -> Array:
        return ss.GridSpline(axes, data, "spd:3", check=False).grid(*fine)

    def scipy(method: str) -> Array:
        found: Any = RegularGridInterpolator(axes, logarithm(data), method=method)(
            tuple(np.meshgrid(*fine, indexing="ij"))
        )
        return from_six(found)

    works: dict[str, Work] = {
        "SciPy, linear, log-Euclidean": lambda: scipy("linear"),
        "SciPy, cubic, log-Euclidean": lambda: scipy("cubic"),
    }
    if find_spec("dipy"):
        from dipy.align.reslice import reslice

        def dipy() -> Array:
            # What `reslice` does to a volume with six channels; its voxels lie elsewhere, so that only its time counts.
            found, _ = reslice(
                six, np.eye(4), (2.0, 2.0, 2.0), (1.0, 1.0, 1.0), order=3, num_processes=threads
            )
            return from_six(found)

        works["dipy, order 3, log-Euclidean"] = dipy
    contestants = {HERE: ready(ours), ALL: ready(ours, threads)} | {
        name: ready(work) for name, work in works.items()
    }
    results = measure(contestants, effort)
    rows = []
    for name, result in results.items():
        work = works.get(name, ours)
        error = None if name.startswith("dipy") else f"{np.abs(work() - truth).max():.1e}"
        rows.append([name, result, *versus(results, name, ALL), error])
    values = int(np.prod([len(x) for x in fine]))
    memory = _memory(sizes)
    goal = ""
    if sizes.goals:
        median = getattr(results[ALL], "median", np.inf)
        reached = verdict(5 / median, 1), verdict(1e9 / memory, 1)
        goal = f" Goals: 5 s on two cores ({reached[0]}), 1 GB ({reached[1]})."
    text = table(
        (f"{count(values)} tensors, fit included", "time", "beside symspline", "largest error"), rows
    )
    return f"{text}\n\nThe process of symspline has a peak of {memory / 1e9:.2f} GB.{goal}"


def _memory(sizes: Sizes) -> int:
    """Peak memory of a process that does the same."""
    command = [sys.executable, "-m", "benchmarks.grids", *map(str, sizes.volume)]
    root = Path(__file__).parents[1]
    answer = subprocess.run(command, cwd=root, check=True, stdout=subprocess.PIPE, text=True).stdout
    return int(json.loads(answer))


def _map(sizes: Sizes, threads: int, effort: Effort) -> str:
    """Scattered coordinates on a map of rotations; fits included."""
    u = np.linspace(0, 1, sizes.map)
    data = turns(*np.meshgrid(u, u, indexing="ij"))
    x, y = np.random.default_rng(0).uniform(0, 1, (2, sizes.scattered))
    truth = turns(x, y)

    def ours() -> Array:
        return ss.GridSpline((u, u), data, "so:3", check=False)((x, y))

    def scipy() -> Array:
        found: Any = RegularGridInterpolator((u, u), data, method="cubic")((x, y))
        return ss.SpecialOrthogonal(3).project(found)

    results = measure({HERE: ready(ours), ALL: ready(ours, threads), "SciPy": ready(scipy)}, effort)
    rows = [
        ["symspline, one core", results[HERE], None, f"{np.abs(ours() - truth).max():.1e}"],
        ["symspline, all cores", results[ALL], None, None],
        [
            "SciPy, cubic, nine entries, projected",
            results["SciPy"],
            versus(results, "SciPy", ALL)[0],
            f"{np.abs(scipy() - truth).max():.1e}",
        ],
    ]
    head = (f"{count(sizes.scattered)} scattered rotations on {sizes.map} × {sizes.map} nodes", "time")
    text = table((*head, "beside symspline", "largest error"), rows)
    if not sizes.goals:
        return text
    median = getattr(results[ALL], "median", np.inf)
    return f"{text}\n\nGoal: {seconds(0.5)} on two cores, {verdict(0.5 / median, 1)}."


if __name__ == "__main__":
    nodes = [np.linspace(0, 1, int(n)) for n in sys.argv[1:]]
    volume = tensors(*nodes)
    ss.GridSpline(nodes, volume, "spd:3", check=False).grid(*(np.linspace(0, 1, 2 * len(x)) for x in nodes))
    print(json.dumps(peak()))
