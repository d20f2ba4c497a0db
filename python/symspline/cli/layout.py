"""How a point stands in columns: number by number, a matrix row by row, a complex number in two columns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..spaces import Product, Space, factors_of

Doubles = NDArray[np.float64]

RE, IM = "_re", "_im"


def is_complex(space: Space) -> bool:
    """Whether points of a space, not a product, are complex."""
    return bool(space.dtype.kind == "c")


def complex_numbers(space: Space) -> list[bool]:
    """For every number of a point whether it is complex."""
    return [is_complex(factor) for factor in factors_of(space) for _ in range(math.prod(factor.point_shape))]


# ---- names ----


def labels(space: Space) -> list[str]:
    """Names for the numbers of a point: x0, x1, … of vectors, m11, m12, … of a matrix, and of several
    matrices in a product m1_11, m1_12, …, m2_11, …"""
    matrices = [factor for factor in factors_of(space) if _is_matrix(factor)]
    names: list[str] = []
    vectors = number = 0
    for factor in factors_of(space):
        if _is_matrix(factor):
            number += 1
            start = f"m{number}_" if len(matrices) > 1 else "m"
            names += [start + entry for entry in _entries(factor)]
        else:
            (length,) = factor.point_shape
            names += [f"x{i}" for i in range(vectors, vectors + length)]
            vectors += length
    return names


def _entries(space: Space) -> list[str]:
    """Rows and columns of the entries of a matrix, counted from 1."""
    between = "_" if max(space.point_shape) > 9 else ""
    return [f"{i + 1}{between}{j + 1}" for i, j in np.ndindex(*space.point_shape)]


def column_names(space: Space, names: Sequence[str], nu: int = 0) -> list[str]:
    """The columns of points, velocities or accelerations, by the names of a point's numbers."""
    derivative = f"_d{nu}" if nu else ""
    columns: list[str] = []
    for name, two in zip(names, complex_numbers(space), strict=True):
        columns += [name + derivative + part for part in ((RE, IM) if two else ("",))]
    return columns


def described(space: Space) -> str:
    """How many numbers a point has, and in what order."""
    parts = [_described(factor) for factor in factors_of(space)]
    if len(parts) == 1:
        return parts[0]
    each = "; ".join(f"{factor}: {part}" for factor, part in zip(factors_of(space), parts, strict=True))
    return f"{len(labels(space))} numbers ({each})"


def _described(space: Space) -> str:
    count = math.prod(space.point_shape)
    kind = "complex number" if is_complex(space) else "number"
    text = f"{count} {kind}" + ("s" if count > 1 else "")
    if is_complex(space):
        text += f", A{RE} and A{IM} each"
    return f"{text}, a {matrix(space)}" if _is_matrix(space) else text


def matrix(space: Space) -> str:
    """Of a space of matrices, how they stand in columns; empty for vectors."""
    return f"{' x '.join(map(str, space.point_shape))} matrix row by row" if _is_matrix(space) else ""


def _is_matrix(space: Space) -> bool:
    return len(space.point_shape) > 1


# ---- numbers ----


def flatten(space: Space, values: Any) -> Doubles:
    """Points or vectors of shape (rows, *point_shape) as columns, shape (rows, columns)."""
    parts = values if isinstance(space, Product) else (values,)
    return np.concatenate([_flat(np.asarray(part)) for part in parts], axis=1)


def unflatten(space: Space, columns: Doubles) -> list[NDArray[Any]]:
    """The points of which these are the columns, in every factor."""
    parts: list[NDArray[Any]] = []
    start = 0
    for factor in factors_of(space):
        width = math.prod(factor.point_shape) * (2 if is_complex(factor) else 1)
        part = np.ascontiguousarray(columns[:, start : start + width]).view(factor.dtype)
        parts.append(part.reshape(len(columns), *factor.point_shape))
        start += width
    return parts


def _flat(values: NDArray[Any]) -> Doubles:
    return np.ascontiguousarray(values.reshape(len(values), -1)).view(np.float64)
