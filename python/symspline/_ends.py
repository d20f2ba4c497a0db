"""End conditions: what a user may write, made into what the core solves."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import ValidationError
from .spaces import Space

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
        raise ValidationError(f"{_HELP}; got {bc_type!r}")
    return [_end(end, name, space, batch) for end, name in zip(bc_type, ("start", "end"), strict=True)]


def _end(end: Any, name: str, space: Space, batch: tuple[int, ...]) -> End:
    shape = batch + space.point_shape
    if isinstance(end, str):
        if end not in _WORDS:
            raise ValidationError(f"{_HELP}; the {name} is {end!r}")
        return ("velocity", np.zeros(shape)) if end == "clamped" else (end, None)
    if not isinstance(end, (tuple, list)) or len(end) != 2 or end[0] not in _ORDERS:
        raise ValidationError(f"{_HELP}; the {name} is {end!r}")
    kind = _ORDERS[end[0]]
    value = space._doubles(end[1], f"the {name} {kind}")
    try:
        return kind, np.ascontiguousarray(np.broadcast_to(value, shape))
    except ValueError:
        raise ValidationError(
            f"the {name} {kind} has shape {value.shape}, which does not broadcast to {shape}"
        ) from None
