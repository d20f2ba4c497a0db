"""What one can do without smoothing on the space itself: components smoothed as numbers, and means of neighbours."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_smoothing_spline
from scipy.spatial.transform import Rotation

import symspline as ss

Array = NDArray[np.float64]

BANDWIDTHS = 2.0 ** np.arange(-0.5, 5.6, 0.5)
"""Of means of neighbours, in samples."""


class Chart(NamedTuple):
    """Points as rows of numbers, and back."""

    numbers: Array
    points: Callable[[Array], Array]


def tangent(space: ss.Space, points: Array) -> Chart:
    """Orthonormal coordinates of the logarithms at the mean of all points."""
    mean = points[len(points) // 2]
    for _ in range(100):
        # Full steps to the mean would go astray in hyperbolic space.
        mean = space.exp(mean, 0.3 * _logarithms(space, mean, points).mean(axis=0))
    vectors = _logarithms(space, mean, points)
    shape = vectors.shape
    rows = vectors.reshape(len(points), -1)
    basis = np.linalg.svd(rows, full_matrices=False)[2][: space.dim]

    def back(numbers: Array) -> Array:
        return np.asarray(space.exp(np.broadcast_to(mean, shape), (numbers @ basis).reshape(shape)))

    return Chart(rows @ basis.T, back)


def _logarithms(space: ss.Space, mean: Array, points: Array) -> Array:
    return np.asarray(space.log(np.broadcast_to(mean, points.shape), points))


def ambient(space: ss.Space, points: Array) -> Chart:
    """Components: of vectors; of quaternions for rotations, the place beside them for poses; of projectors for
    subspaces; of symmetric matrices. Back by what is nearest or usual."""
    kind = type(space).__name__
    if kind == "SpecialOrthogonal":
        return Chart(_quaternions(points), _rotations)
    if kind == "SpecialEuclidean":
        numbers = np.concatenate([_quaternions(points[:, :3, :3]), points[:, :3, 3]], axis=-1)

        def pose(rows: Array) -> Array:
            out = np.zeros((len(rows), 4, 4))
            out[:, :3, :3], out[:, :3, 3], out[:, 3, 3] = _rotations(rows[:, :4]), rows[:, 4:], 1.0
            return out

        return Chart(numbers, pose)
    if kind == "Grassmannian":
        n, k = points.shape[1:]
        projectors = points @ np.swapaxes(points, -1, -2)
        return Chart(_upper(projectors), lambda rows: np.linalg.eigh(_symmetric(rows, n))[1][..., n - k :])
    if kind == "SymmetricPositiveDefinite":
        return Chart(_upper(points), lambda rows: _definite(_symmetric(rows, points.shape[-1])))
    return Chart(points, lambda rows: np.asarray(space.project(rows)))


def _quaternions(matrices: Array) -> Array:
    found = Rotation.from_matrix(matrices).as_quat()
    signs = np.where(np.sum(found[1:] * found[:-1], axis=-1) < 0, -1.0, 1.0)
    return found * np.cumprod(np.concatenate([[1.0], signs]))[:, None]


def _rotations(quaternions: Array) -> Array:
    return Rotation.from_quat(quaternions).as_matrix()


def _upper(matrices: Array) -> Array:
    return np.asarray(matrices[:, *np.triu_indices(matrices.shape[-1])])


def _symmetric(rows: Array, n: int) -> Array:
    out = np.zeros((len(rows), n, n))
    i, j = np.triu_indices(n)
    out[:, i, j] = out[:, j, i] = rows
    return out


def _definite(matrices: Array) -> Array:
    """Eigenvalues that are not positive become a thousandth of the largest."""
    values, vectors = np.linalg.eigh(matrices)
    values = np.maximum(values, 1e-3 * values[..., -1:])
    return np.asarray((vectors * values[..., None, :]) @ np.swapaxes(vectors, -1, -2))


def scipy_spline(t: Array, chart: Chart) -> Array:
    """SciPy's smoothing spline of every number, each with its own λ by GCV."""
    columns = [_column(t, column) for column in chart.numbers.T]
    return chart.points(np.stack(columns, axis=-1))


def _column(t: Array, y: Array) -> Array:
    return y if np.ptp(y) < 1e-12 else make_smoothing_spline(t, y)(t)


def moving_averages(count: int) -> Array:
    """Matrices that take the mean of so many neighbours on either side; fewer near the ends."""
    i = np.arange(count)
    near = [np.abs(i[:, None] - i) <= width for width in np.unique(np.round(BANDWIDTHS))]
    return np.array([w / w.sum(axis=1, keepdims=True) for w in near])


def local_lines(count: int) -> Array:
    """Matrices of the value of the line that fits best under a Gaussian weight."""
    i = np.arange(float(count))
    x = i - i[:, None]
    found = []
    for width in BANDWIDTHS[1:]:
        w = np.exp(-0.5 * (x / width) ** 2)
        zeroth, first, second = (np.sum(w * x**k, axis=1, keepdims=True) for k in range(3))
        found.append(w * (second - first * x) / (zeroth * second - first**2))
    return np.array(found)
