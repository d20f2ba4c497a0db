"""End conditions: from the argument `bc_type` to the form of the core."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import short_repr
from .._core import ValidationError
from .._spaces import AnySpace, Doubles, Product, Space, factors_of, parts_of

# The kind of an end condition and its prescribed vectors: for "both", velocities and accelerations along an axis after
# those of the batch.
End = tuple[str, Doubles | None]

Index = NDArray[np.intp]

_WORDS = {"natural", "clamped", "not-a-knot"}
_ORDERS = {1: "velocity", 2: "acceleration"}
NATURAL: list[End] = [("natural", None), ("natural", None)]
_HELP = (
    "bc_type must be 'natural', 'clamped', 'not-a-knot' or 'periodic', or a pair with one of 'natural', 'clamped', "
    "'not-a-knot', (1, velocity), (2, acceleration), [(1, velocity), (2, acceleration)] for either end"
)


def ends_of(bc_type: Any, space: Space, batch: tuple[int, ...]) -> list[End] | None:
    """Convert `bc_type` to the conditions at both ends; None for a closed curve."""
    if isinstance(bc_type, str):
        if bc_type == "periodic":
            return None
        if bc_type == "natural":
            return NATURAL
        bc_type = (bc_type, bc_type)
    return [_end(name, word, vector, space, batch) for name, word, vector in split_ends(bc_type)]


def split_ends(bc_type: Any) -> list[tuple[str, str | int, Any]]:
    """Return the name of each end of a pair, its word or order, and the vector that it prescribes or None.

    Raises
    ------
    ValidationError
        If the conditions are not a pair, or an end is neither a word nor a pair of an order and a vector.
    """
    _check_pair(bc_type)
    split: list[tuple[str, str | int, Any]] = []
    for name, end in zip(("start", "end"), bc_type, strict=True):
        if isinstance(end, str) and end in _WORDS:
            split.append((name, end, None))
            continue
        if _is_double(end):
            raise ValidationError(
                f"bc_type prescribes a velocity and an acceleration at the {name}, which is available in CubicSpline "
                "only. Prescribe one of them."
            )
        pair = isinstance(end, (tuple, list)) and len(end) == 2
        if not pair or not isinstance(end[0], (int, np.integer)) or end[0] not in _ORDERS:
            raise ValidationError(f"{_HELP}; the {name} is {short_repr(end)}")
        split.append((name, int(end[0]), end[1]))
    return split


def split_accelerations(bc_type: Any) -> tuple[Any, Any]:
    """Separate the accelerations from ends at which a velocity and an acceleration are prescribed.

    Returns
    -------
    bc_type : str or pair
        The end conditions without these accelerations.
    accelerations : pair or None
        For each end, ``(2, acceleration)`` if there are two conditions, and otherwise ``"natural"``. None if no end has
        two conditions.
    """
    if isinstance(bc_type, str):
        return bc_type, None
    _check_pair(bc_type)
    doubles = [dict(end) if _is_double(end) else None for end in bc_type]
    if not any(doubles):
        return bc_type, None
    velocities = tuple(
        (1, conditions[1]) if conditions else end for conditions, end in zip(doubles, bc_type, strict=True)
    )
    return velocities, tuple((2, conditions[2]) if conditions else "natural" for conditions in doubles)


def both(first: list[End] | None, second: list[End] | None, batch: tuple[int, ...]) -> list[End]:
    """Combine the velocities at ends with the accelerations there, of which other ends have none."""
    ends: list[End] = []
    for end, (_, acceleration) in zip(first or [], second or [], strict=True):
        if acceleration is not None and end[1] is not None:
            end = ("both", np.stack([end[1], acceleration], axis=len(batch)))
        ends.append(end)
    return ends


def original_nodes(ends: list[End] | None, nodes: int) -> Index:
    """Return the nodes of a curve except those that ends with two conditions add."""
    kinds = [kind for kind, _ in ends or []]
    added = [node for node, end in ((1, kinds[:1]), (nodes - 2, kinds[1:])) if end == ["both"]]
    return np.delete(np.arange(nodes), added)


def _check_pair(bc_type: object) -> None:
    if not isinstance(bc_type, (tuple, list)) or len(bc_type) != 2:
        raise ValidationError(f"{_HELP}; got {short_repr(bc_type)}")


def _is_double(end: object) -> bool:
    """Whether an end has the form [(1, velocity), (2, acceleration)], in any order."""
    if not isinstance(end, (tuple, list)) or len(end) != 2:
        return False
    if not all(isinstance(condition, (tuple, list)) and len(condition) == 2 for condition in end):
        return False
    orders = [condition[0] for condition in end]
    return all(isinstance(order, (int, np.integer)) for order in orders) and sorted(orders) == [1, 2]


def _end(name: str, word: str | int, vector: Any, space: Space, batch: tuple[int, ...]) -> End:
    shape = batch + space._doubles_shape
    if isinstance(word, str):
        return ("velocity", np.zeros(shape)) if word == "clamped" else (word, None)
    kind = _ORDERS[word]
    value = space._doubles(vector, f"the {name} {kind}")
    try:
        return kind, np.ascontiguousarray(np.broadcast_to(value, shape))
    except ValueError:
        raise ValidationError(
            f"the {name} {kind} has shape {np.shape(vector)}, which does not broadcast to {batch + space.point_shape}"
        ) from None


def map_ends(ends: list[End] | None, function: Callable[[Any], Any]) -> list[End] | None:
    """Apply a function to the vectors of end conditions."""
    return ends and [(kind, None if vector is None else function(vector)) for kind, vector in ends]


def freeze_bc_type(bc_type: Any) -> Any:
    """Copy end conditions, so that later changes of the caller's arrays have no effect."""
    if isinstance(bc_type, str):
        return bc_type
    return tuple(end if isinstance(end, str) else (int(end[0]), _copy(end[1])) for end in bc_type)


def _copy(vector: object) -> Any:
    """Return a read-only copy of a vector; for a product, a tuple of copies."""
    if isinstance(vector, tuple):
        return tuple(_copy(part) for part in vector)
    array = np.array(vector)
    array = array.astype(np.complex128 if array.dtype.kind == "c" else np.float64)
    array.flags.writeable = False
    return array


def is_closed(bc_type: object) -> bool:
    """Whether the curve is periodic."""
    return isinstance(bc_type, str) and bc_type == "periodic"


def end_kinds(bc_type: Any) -> list[str] | None:
    """Return the kind of each end as the core names it, without vectors; None for a closed curve."""
    if is_closed(bc_type):
        return None
    ends = (bc_type, bc_type) if isinstance(bc_type, str) else bc_type
    return ["velocity" if end == "clamped" else end if isinstance(end, str) else _ORDERS[end[0]] for end in ends]


def take_batch(bc_type: Any, index: object, batch_axes: int, space: AnySpace) -> Any:
    """Return the end conditions of one curve or a slice of curves along the first batch axis."""
    if isinstance(bc_type, str):
        return bc_type
    if isinstance(space, Product):
        factors = zip(ends_in_factors(bc_type, space), space.factors, strict=True)
        return _joined([take_batch(ends, index, batch_axes, factor) for ends, factor in factors])

    def pick(end: Any) -> Any:
        if isinstance(end, str):
            return end
        vector = end[1]
        if vector.ndim < batch_axes + len(space.point_shape):
            return end
        if vector.shape[0] == 1:
            # The vector is shared along this axis.
            return (end[0], vector if isinstance(index, slice) else vector[0])
        return (end[0], vector[index])

    return tuple(pick(end) for end in bc_type)


# ---- products, whose prescribed vectors are tuples ----


def ends_in_factors(bc_type: Any, space: AnySpace) -> list[Any]:
    """Return the end conditions of each factor; outside products, a list of one entry."""
    factors = factors_of(space)
    if isinstance(bc_type, str) or len(factors) == 1:
        return [bc_type] * len(factors)
    start, end = (
        (word,) * len(factors)
        if isinstance(word, str)
        else tuple((word, part) for part in parts_of(vector, space, "an end vector"))
        for _, word, vector in split_ends(bc_type)
    )
    return list(zip(start, end, strict=True))


def _joined(ends: list[Any]) -> Any:
    """Combine end conditions of the factors. This is the inverse of `ends_in_factors`."""

    def both(e: int) -> Any:
        first = ends[0][e]
        return first if isinstance(first, str) else (first[0], tuple(end[e][1] for end in ends))

    return both(0), both(1)
