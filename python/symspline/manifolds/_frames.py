"""Orthonormal frames along the points, in which all neighbours are related by the identity.

Vectors at different points can then be added as if space were flat, which is what makes the tridiagonal matrix of the
flat spline a good approximation of the derivative of the C² condition. Nothing but the speed of the solver depends on
the frames.
"""

from __future__ import annotations

import math

import numpy as np

from .._core import ValidationError
from .._spaces import Array
from ._operations import Operations

# Squared lengths, relative to the longest, below which vectors are not independent.
_RANK = 1e-8
# Numbers that are worked on at a time.
_AT_ONCE = 1 << 22


def basis_at(operations: Operations, p: Array) -> Array:
    """Orthonormal tangent vectors at points: shape (..., dim, numbers of a point).

    They are made of the projections of all arrays with a single 1 (and i).

    Raises:
        ValidationError: projections and products are not those of tangent spaces of one dimension.
    """
    space = operations.space
    shape = space.point_shape
    rows = p.reshape(-1, *shape)
    units = np.eye(rows[0].size).reshape(-1, *shape) if len(rows) else np.empty((0, *shape))
    if space._complex:
        units = np.concatenate([units, 1j * units])
    pairs = len(rows), len(units), *shape
    points = np.broadcast_to(rows[:, None], pairs)
    vectors = operations.project_tangent(points, np.broadcast_to(units.astype(space.dtype), pairs))
    gram = products(operations, points[:, 0], vectors, vectors)
    if not np.isfinite(gram).all():
        index = int(np.argwhere(~np.isfinite(gram))[0, 0])
        raise ValidationError(f"inner or project_tangent of {space!r} is not finite at points[{index}]")
    values, turned = np.linalg.eigh((gram + np.swapaxes(gram, -1, -2)) / 2)
    large = values > _RANK * np.abs(values).max(axis=1, keepdims=True)
    dims = np.count_nonzero(large, axis=1)
    if len(dims) and (dims.min() == 0 or (dims != dims[0]).any()):
        raise ValidationError(
            f"project_tangent and inner of {space!r} give tangent spaces of {sorted(set(dims.tolist()))} dimensions; "
            "inner must be positive, and all tangent spaces have one dimension"
        )
    dim = int(dims[0]) if len(dims) else 0
    values, turned = values[:, -dim:], turned[:, :, -dim:]
    flat = vectors.reshape(*vectors.shape[:2], -1)
    frames = np.swapaxes(turned / np.sqrt(values)[:, None, :], -1, -2) @ flat
    return np.asarray(frames).reshape(*p.shape[: p.ndim - len(shape)], dim, -1)


def products(operations: Operations, p: Array, a: Array, b: Array) -> Array:
    """All inner products of two rows of tangent vectors: p of shape (m, ...), a and b (m, rows, ...)."""
    m, shape = len(p), operations.space.point_shape
    result = np.empty((m, a.shape[1], b.shape[1]))
    pairs = a.shape[1] * b.shape[1] * math.prod(shape)
    for some in np.array_split(np.arange(m), max(1, min(m, math.ceil(m * pairs / _AT_ONCE)))):
        full = len(some), a.shape[1], b.shape[1], *shape
        expanded = [
            p[some].reshape(-1, 1, 1, *shape),
            a[some].reshape(-1, a.shape[1], 1, *shape),
            b[some].reshape(-1, 1, b.shape[1], *shape),
        ]
        result[some] = operations.inner(*(np.broadcast_to(x, full) for x in expanded))
    return result


def frames_along(operations: Operations, p: Array) -> Array:
    """Frames at the points of curves, p of shape (curves, nodes, ...), each transported from the one before.

    Returns:
        Shape (curves, nodes, dim, numbers of a point).
    """
    space = operations.space
    curves, nodes = p.shape[:2]
    basis = basis_at(operations, p)
    dim = basis.shape[2]
    tangents = basis.reshape(curves, nodes, dim, *space.point_shape)
    shape = (curves, nodes - 1, dim, *space.point_shape)
    here, there = (np.broadcast_to(x[:, :, None], shape) for x in (p[:, :-1], p[:, 1:]))
    if space.functions.transport is None:
        transported = operations.project_tangent(there, tangents[:, :-1])
    else:
        transported = operations.transport(here, there, tangents[:, :-1])
    at = p[:, 1:].reshape(-1, *space.point_shape)
    maps = products(
        operations,
        at,
        transported.reshape(-1, dim, *space.point_shape),
        tangents[:, 1:].reshape(-1, dim, *space.point_shape),
    ).reshape(curves, nodes - 1, dim, dim)
    # The rotation nearest to the map between tangent spaces: transport is one, projection nearly.
    u, _, v = np.linalg.svd(np.where(np.isfinite(maps), maps, np.eye(dim)))
    turns = u @ v
    total = np.empty((curves, nodes, dim, dim))
    total[:, 0] = np.eye(dim)
    for i in range(nodes - 1):
        np.matmul(total[:, i], turns[:, i], out=total[:, i + 1])
    return np.asarray(total @ basis)
