"""Some curves of a batch fitted, the others left out: NaN, and no work done for them."""

from __future__ import annotations

import math
import re
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._core import ValidationError
from ..arrays import as_array
from ..report import Columns
from ..spaces import Array, Space, factors_of
from .ends import End
from .fit import Asked, Fit, Points, finished, first_faults, fit, fit_many, solve_factors
from .solve import Fault, Options, Progress, Solved

Numbers = NDArray[np.int64]

# Numbers of points that are worked on at a time.
_AT_ONCE = 1 << 18


def mask_of(where: Any, batch: tuple[int, ...]) -> NDArray[np.bool_]:
    """Which curves are wanted."""
    mask = as_array(where, "where")
    if mask.dtype != bool or mask.shape != batch:
        raise ValidationError(
            f"where must be True or False for every curve, of shape {batch}, not {mask.dtype} of shape {mask.shape}"
        )
    return mask


def _invalid(space: Space, points: list[Points], wanted: Numbers) -> list[Fault]:
    """Curves with points that are none, found by halves: the few bad ones of many cost little."""
    found: dict[int, str] = {}
    for factor, part in zip(factors_of(space), points, strict=True):
        rows = part.doubles.reshape(-1, part.nodes, *factor._doubles_shape)
        width = rows[0].size // part.nodes

        def search(
            own: Numbers, factor: Space = factor, part: Points = part, rows: Any = rows, n: int = width
        ) -> None:
            count = len(own) * part.nodes
            try:
                factor._handle.check_points(
                    np.ascontiguousarray(rows[own]).reshape(count, n), [count], part.tol
                )
            except ValidationError as error:
                if len(own) > 1:
                    search(own[: len(own) // 2])
                    search(own[len(own) // 2 :])
                    return
                of = f" of curve {_place(int(own[0]), part.batch)}" if part.batch else ""
                found.setdefault(int(own[0]), re.sub(r"^point (\d+)", rf"points[\1]{of}", str(error)))

        if len(wanted):
            search(wanted)
    return [(number, "invalid", found[number]) for number in sorted(found)]


def fit_wanted(asked: Asked, progress: Progress | None, mask: NDArray[np.bool_] | None) -> Fit:
    """The curves of a batch that are wanted; all without a mask."""
    if mask is None or mask.all():
        return fit(asked, progress)
    return fit_chosen(asked, progress, np.flatnonzero(mask))


def fit_sound(asked: Asked, progress: Progress | None, mask: NDArray[np.bool_] | None) -> Fit:
    """The same, but without those with points that are none, which are among the faults."""
    batch, refused = asked.points[0].batch, None
    if mask is None:
        # Mostly all are good, and a fit looks at them before it begins.
        try:
            return fit(asked, progress)
        except ValidationError as error:
            refused = error
    sound = np.ones(batch, bool) if mask is None else mask.copy()
    bad = _invalid(asked.space, asked.points, np.flatnonzero(sound))
    if refused and not bad:
        raise refused
    sound.flat[[number for number, *_ in bad]] = False
    found = fit_wanted(asked, progress, sound)
    return found._replace(faults=sorted(bad + found.faults))


def fit_chosen(asked: Asked, progress: Progress | None, chosen: Numbers) -> Fit:
    """The curves with these numbers; the others are NaN. They are made some at a time, so that little memory is needed
    beside the results."""
    points, factors = asked.points, factors_of(asked.space)
    batch, nodes = points[0].batch, points[0].nodes
    spread = [_left_out(factor, part) for factor, part in zip(factors, points, strict=True)]
    numbers = max(part.doubles.size for part in points) // max(1, math.prod(batch))
    parts = np.array_split(chosen, max(1, math.ceil(len(chosen) * numbers / _AT_ONCE))) if len(chosen) else []
    faults: list[Fault] = []
    done, each = 0, len(factors) * nodes
    for own in parts:
        advance = progress and partial(_advance, progress, done * each, len(chosen) * each)
        try:
            solved = solve_factors(_some(asked, own), advance)
        except ValidationError as error:
            raise ValidationError(_renamed(str(error), own, batch)) from None
        done += len(own)
        for whole, found in zip(spread, solved, strict=True):
            _place_some(whole, found, own)
        faults += [(int(own[i]), kind, _renamed(why, own, batch)) for i, kind, why in first_faults(solved)]
    return finished(asked, spread)._replace(faults=faults)


class ManyAsked(NamedTuple):
    """What to fit: single curves of different lengths, with one entry a curve in ``times`` and ``points``, and one a
    factor in ``ends``."""

    space: Space
    times: list[NDArray[np.float64]]
    points: list[list[Points]]
    ends: list[list[End] | None]
    options: Options
    check: bool


def fit_many_wanted(
    asked: ManyAsked, progress: Progress | None, mask: NDArray[np.bool_] | None
) -> tuple[list[Fit], list[Fault]]:
    """The curves that are wanted; all without a mask."""
    if mask is None:
        return fit_many(*asked, progress)
    return fit_many_chosen(asked, progress, np.flatnonzero(mask))


def fit_many_sound(
    asked: ManyAsked, progress: Progress | None, mask: NDArray[np.bool_] | None
) -> tuple[list[Fit], list[Fault]]:
    """The same, but without those with points that are none, which are among the faults."""
    sound = np.ones(len(asked.times), bool) if mask is None else mask.copy()
    bad: list[Fault] = []
    for number in np.flatnonzero(sound).tolist():
        for _, kind, why in _invalid(asked.space, asked.points[number], np.zeros(1, np.int64)):
            bad.append((number, kind, f"curve {number}: {why}"))
            sound[number] = False
    fits, faults = fit_many_wanted(asked, progress, sound if bad else mask)
    return fits, sorted(bad + faults)


def fit_many_chosen(
    asked: ManyAsked, progress: Progress | None, chosen: Numbers
) -> tuple[list[Fit], list[Fault]]:
    """The same of single curves of different lengths."""
    space, times, points, ends, options, check = asked
    found: list[Fit] = []
    faults: list[Fault] = []
    if len(chosen):
        some = [times[i] for i in chosen], [points[i] for i in chosen], _some_ends(space, ends, chosen)
        try:
            found, faults = fit_many(space, *some, options, check, progress)
        except ValidationError as error:
            raise ValidationError(_renamed(str(error), chosen, (len(times),))) from None
    fitted = dict(zip(chosen.tolist(), found, strict=True))

    def left_out(i: int) -> Fit:
        parts = zip(factors_of(space), points[i], strict=True)
        return finished(
            Asked(space, times[i], points[i], [], options, check),
            [_left_out(factor, part) for factor, part in parts],
        )

    fits = [fitted[i] if i in fitted else left_out(i) for i in range(len(times))]
    return fits, [(int(chosen[i]), kind, _renamed(why, chosen, (len(times),))) for i, kind, why in faults]


def _some(asked: Asked, chosen: Numbers) -> Asked:
    """These curves alone."""

    def picked(rows: Array, axes: int) -> Array:
        return _rows(rows, axes, chosen)

    factors = factors_of(asked.space)
    return asked._replace(
        times=picked(asked.times, 1) if asked.times.ndim > 1 else asked.times,
        points=[
            part._replace(doubles=picked(part.doubles, 1 + len(factor.point_shape)), batch=(len(chosen),))
            for factor, part in zip(factors, asked.points, strict=True)
        ],
        ends=_some_ends(asked.space, asked.ends, chosen),
    )


def _some_ends(space: Space, ends: list[list[End] | None], chosen: Numbers) -> list[list[End] | None]:
    return [
        own and [(kind, None if v is None else _rows(v, len(factor.point_shape), chosen)) for kind, v in own]
        for factor, own in zip(factors_of(space), ends, strict=True)
    ]


def _rows(rows: Array, axes: int, chosen: Numbers) -> Array:
    """The chosen rows of an array that has the batch axes, then some more."""
    return np.ascontiguousarray(rows.reshape(-1, *rows.shape[rows.ndim - axes :])[chosen])


def _left_out(space: Space, points: Points) -> Solved:
    """No curve at any place of the batch."""
    count = math.prod(points.batch)
    shape = (*points.batch, points.nodes, *space.point_shape)
    places, velocities = (np.full(shape, np.nan, space.dtype) for _ in range(2))
    return Solved(places, velocities, Columns.empty(count), [])


def _place_some(whole: Solved, found: Solved, chosen: Numbers) -> None:
    """Curves at their places in the whole batch."""
    for all_rows, rows in ((whole.points, found.points), (whole.velocities, found.velocities)):
        all_rows.reshape(-1, *rows.shape[1:])[chosen] = rows
    whole.columns.put(chosen, found.columns)


def _advance(progress: Progress, before: int, total: int, finished: int, _: int) -> object:
    return progress(before + finished, total)


def _renamed(message: str, chosen: Numbers, batch: tuple[int, ...]) -> str:
    """A message with the places of its curves in the whole batch, where it names points or times of them."""

    def there(found: re.Match[str]) -> str:
        return found[1] + _place(int(chosen[int(found[2])]), batch)

    return re.sub(r"(of curve |^curve |\bt\[(?=\d+\]\[))(\d+)", there, message)


def _place(number: int, batch: tuple[int, ...]) -> str:
    return ",".join(map(str, np.unravel_index(number, batch)))
