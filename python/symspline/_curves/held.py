"""Warn about recordings in which the last point of a sensor was repeated at new times (sample and hold)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._base.faults import of_index
from .._base.warnings import warn
from .._spaces import Array

# Least number of points, and of runs of equal points that are not cut off at an end.
FEWEST_HELD, _RUNS = 12, 5
# Least share of copies among the points, and of runs with a copy: a body at rest is one long run.
_COPIES, _REPEATED = 0.2, 0.2
# Least share of runs that are not much longer than the median, and of runs whose point occurs in no other run. Points
# of low resolution differ: they return to earlier values, and stay the same longest where the motion reverses.
_REGULAR, _NEW = 0.9, 0.9


def warn_of_held_points(
    times: Array,
    points: list[Array],
    batch: tuple[int, ...],
    category: type[Warning] = UserWarning,
    name: str = "points",
    curve: tuple[int, ...] = (),
) -> bool:
    """Warn once if many points of a curve are exact copies of the point before, at a later time.

    Parameters
    ----------
    times : ndarray, shape (n,) or (*batch, n)
        Times.
    points : list of ndarray, shape (*batch, n, ...)
        Points in every factor.
    category : type
        Category of the warning.
    name : str
        Name of the points in the message.
    curve : tuple of int
        Leading indices of the curve, which precede those in the batch.

    Returns
    -------
    bool
        Whether the warning was issued.
    """
    axis, nodes = len(batch), times.shape[-1]
    if nodes < FEWEST_HELD or times.dtype.kind not in "iufM":
        return False
    for own in points:
        if own.dtype.kind not in "iufc":
            return False
        # Nearly always the first numbers of the points show that few are copies.
        first = own.reshape(-1)[:: math.prod(own.shape[axis + 1 :]) or 1]
        if np.count_nonzero(first[1:] == first[:-1]) < _COPIES * (nodes - 1):
            return False
    equal = np.broadcast_to(np.diff(times) > 0, (*batch, times.shape[-1] - 1))
    for own in points:
        rows = own.reshape(*own.shape[: axis + 1], -1)
        equal = equal & np.all(rows[..., 1:, :] == rows[..., :-1, :], axis=-1)
    shares = equal.mean(axis=-1)
    for index in map(tuple, np.argwhere(shares >= _COPIES).tolist()):
        if not _are_held(equal[index], [own[index].reshape(times.shape[-1], -1) for own in points]):
            continue
        i = int(np.argmax(equal[index]))
        axes = tuple(range(1, points[0].ndim - axis))
        of = of_index((*curve, *index))
        warn(
            f"{100 * shares[index]:.0f} % of the {name}{of} are exact copies of the point before at a later time, for "
            f"example {name}[{i + 1}]. The sensor was probably slower than the log, which repeated its last point. The "
            "curve has steps, and estimates of noise and velocities are wrong. Keep the first of equal points: "
            f"new = np.append(True, np.any({name}[1:] != {name}[:-1], axis={axes})); pass t[new] and {name}[new].",
            category,
            (*curve, *index),
            i + 1,
        )
        return True
    return False


def _are_held(equal: NDArray[np.bool_], points: list[Array]) -> bool:
    """Whether the runs of equal points are like those of a log that is faster than its sensor."""
    starts = np.append(0, np.flatnonzero(~equal) + 1)
    runs: Any = np.diff(np.append(starts, len(equal) + 1))[1:-1]
    if len(runs) < _RUNS or np.mean(runs > 1) < _REPEATED:
        return False
    regular = np.mean(runs <= 2 * np.median(runs) + 1) >= _REGULAR
    values = np.concatenate([own[starts] for own in points], axis=1)
    return bool(regular and len(np.unique(values, axis=0)) >= _NEW * len(starts))
