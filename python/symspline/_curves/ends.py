"""End conditions: what a user may write, made into what the core solves."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import short_repr
from .._core import ValidationError
from .._spaces import Product, Space, factors_of, parts_of

# A kind, and the vectors that it prescribes.
End = tuple[str, NDArray[np.float64] | None]

_WORDS = {"natural", "clamped", "not-a-knot"}
_ORDERS = {1: "velocity", 2: "acceleration"}
_NATURAL: list[End] = [("natural", None), ("natural", None)]
_HELP = (
    "bc_type is 'natural', 'clamped', 'not-a-knot' or 'periodic', or a pair with one of 'natural', 'clamped', "
    "'not-a-knot', (1, velocity), (2, acceleration) for either end"
)


def ends_of(bc_type: Any, space: Space, batch: tuple[int, ...]) -> list[End] | None:
    """The conditions at both ends, None for a closed curve."""
    if isinstance(bc_type, str):
        if bc_type == "periodic":
            return None
        if bc_type == "natural":
            return _NATURAL
        bc_type = (bc_type, bc_type)
    if not isinstance(bc_type, (tuple, list)) or len(bc_type) != 2:
        raise ValidationError(f"{_HELP}; got {short_repr(bc_type)}")
    return [_end(end, name, space, batch) for end, name in zip(bc_type, ("start", "end"), strict=True)]


def _end(end: Any, name: str, space: Space, batch: tuple[int, ...]) -> End:
    shape = batch + space._doubles_shape
    if isinstance(end, str):
        if end not in _WORDS:
            raise ValidationError(f"{_HELP}; the {name} is {short_repr(end)}")
        return ("velocity", np.zeros(shape)) if end == "clamped" else (end, None)
    pair = isinstance(end, (tuple, list)) and len(end) == 2
    if not pair or not isinstance(end[0], (int, np.integer)) or end[0] not in _ORDERS:
        raise ValidationError(f"{_HELP}; the {name} is {short_repr(end)}")
    kind = _ORDERS[int(end[0])]
    value = space._doubles(end[1], f"the {name} {kind}")
    try:
        return kind, np.ascontiguousarray(np.broadcast_to(value, shape))
    except ValueError:
        raise ValidationError(
            f"the {name} {kind} has shape {np.shape(end[1])}, which does not broadcast to {batch + space.point_shape}"
        ) from None


def freeze_bc_type(bc_type: Any) -> Any:
    """End conditions with copies of their vectors, which the caller may change."""
    if isinstance(bc_type, str):
        return bc_type
    return tuple(end if isinstance(end, str) else (int(end[0]), _copy(end[1])) for end in bc_type)


def _copy(vector: Any) -> Any:
    """A read-only copy; for a product a tuple of them."""
    if isinstance(vector, tuple):
        return tuple(_copy(part) for part in vector)
    array = np.array(vector)
    array = array.astype(np.complex128 if array.dtype.kind == "c" else np.float64)
    array.flags.writeable = False
    return array


def is_closed(bc_type: Any) -> bool:
    """Whether the curve goes on at its start where it ends."""
    return isinstance(bc_type, str) and bc_type == "periodic"


def fixed_velocities(bc_type: Any) -> tuple[bool, bool] | None:
    """Which ends have a given velocity; None for a closed curve."""
    if is_closed(bc_type):
        return None
    first, last = (bc_type, bc_type) if isinstance(bc_type, str) else bc_type
    fixed = [end == "clamped" if isinstance(end, str) else end[0] == 1 for end in (first, last)]
    return fixed[0], fixed[1]


def picked(bc_type: Any, index: Any, batch_axes: int, space: Space[Any]) -> Any:
    """The end conditions of part of a batch: prescribed vectors may have the batch axes."""
    if isinstance(bc_type, str):
        return bc_type
    if isinstance(space, Product):
        each = zip(ends_in_factors(bc_type, space), space.factors, strict=True)
        return _joined([picked(ends, index, batch_axes, factor) for ends, factor in each])

    def pick(end: Any) -> Any:
        if isinstance(end, str):
            return end
        vector = end[1]
        if vector.ndim < batch_axes + len(space.point_shape):
            return end
        if vector.shape[0] == 1:
            # It broadcast along this axis.
            return (end[0], vector if isinstance(index, slice) else vector[0])
        return (end[0], vector[index])

    return tuple(pick(end) for end in bc_type)


# ---- in a product, where prescribed vectors are tuples ----


def ends_in_factors(bc_type: Any, space: Space[Any]) -> list[Any]:
    """End conditions for each factor; those of a space that is no product are the only ones."""
    factors = factors_of(space)
    if isinstance(bc_type, str) or len(factors) == 1:
        return [bc_type] * len(factors)
    if not isinstance(bc_type, (tuple, list)) or len(bc_type) != 2:
        raise ValidationError(f"bc_type must be a word or a pair, not {short_repr(bc_type)}")

    def vectors(end: Any) -> Any:
        if isinstance(end, str):
            return (end,) * len(factors)
        if not isinstance(end, (tuple, list)) or len(end) != 2:
            raise ValidationError(
                f"an end condition is a word or a pair (order, tuple of vectors), not {short_repr(end)}"
            )
        return tuple((end[0], vector) for vector in parts_of(end[1], space, "an end vector"))

    return list(zip(*map(vectors, bc_type), strict=True))


def _joined(ends: list[Any]) -> Any:
    """The inverse of `ends_in_factors`."""

    def both(e: int) -> Any:
        first = ends[0][e]
        return first if isinstance(first, str) else (first[0], tuple(end[e][1] for end in ends))

    return both(0), both(1)
