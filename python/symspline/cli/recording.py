"""Rows of recordings put right: out of order, with times twice, with pauses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..spaces import Product, Space
from .errors import Problem
from .times import Times, gap_of

Rows = NDArray[np.int64]
Groups = Mapping[str, Rows]
# Of m <- exp_m(mean of log_m), which contracts where points are near each other: Karcher (1977).
_STEPS = 50
_DONE = 1e-14


@dataclass(frozen=True)
class Repair:
    """What a user asked for.

    Attributes:
        sort: whether rows are put in the order of their times.
        dedup: ``"first"`` or ``"mean"``: what becomes of rows with one time; None if they are an error.
        max_gap: the longest time between neighbours of one curve, as a text; None if there is no limit.
    """

    sort: bool = False
    dedup: str | None = None
    max_gap: str | None = None

    def check(self, has_times: bool) -> None:
        """Raise `Problem` if there are no times to go by."""
        if has_times:
            return
        for option, asked in (("--sort", self.sort), ("--dedup", self.dedup), ("--max-gap", self.max_gap)):
            if asked:
                raise Problem(
                    f"{option} goes by times, and there is no column of times; say which with --time"
                )

    def ordered(self, own: Rows, times: Times) -> tuple[Rows, Rows]:
        """The rows of a curve in order, and where in them each new time begins."""
        if self.sort:
            own = own[np.argsort(times[own], kind="stable")]
        if self.dedup is None or not len(own):
            return own, np.arange(len(own))
        ordered = times[own]
        return own, np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1]))

    def cut(self, groups: Groups, times: Times, labelled: bool) -> tuple[dict[str, Rows], int]:
        """The pieces of curves between gaps, with names of their own, and how many single points are left out."""
        if self.max_gap is None:
            return dict(groups), 0
        pieces: dict[str, Rows] = {}
        alone = 0
        for name, own in groups.items():
            parts = np.split(own, 1 + np.flatnonzero(gap_of(self.max_gap, times[own])))
            good = [part for part in parts if times[part[0]] < times[part[-1]]]
            alone += len(own) - sum(map(len, good))
            for number, part in enumerate(good, 1):
                new = name if labelled and len(good) == 1 else f"{name}/{number}" if labelled else str(number)
                if new in pieces or (new != name and new in groups):
                    raise Problem(f"--max-gap: two curves would have the name {new!r}")
                pieces[new] = part
        return pieces, alone


def means(space: Space, points: Any, starts: Rows) -> Any:
    """The means of the points from each start to the next: where the squared distances from them add up to least.

    Raises:
        CutLocusError: points with one time are too far apart to have one mean.
    """
    if isinstance(space, Product):
        parts = zip(space.factors, points, strict=True)
        return tuple(means(factor, part, starts) for factor, part in parts)
    lengths = np.diff(np.append(starts, len(points)))
    several = np.flatnonzero(lengths > 1)
    found: NDArray[Any] = points[starts]
    if not len(several):
        return found
    counts = lengths[several]
    begins = np.append(0, np.cumsum(counts)[:-1])
    which = np.repeat(starts[several] - begins, counts) + np.arange(counts.sum())
    own, centre = points[which], found[several]
    shape = (-1, *(1,) * len(space.point_shape))
    for _ in range(_STEPS):
        logs = space.log(np.repeat(centre, counts, axis=0), own)
        step = np.add.reduceat(logs, begins, axis=0) / counts.reshape(shape)
        centre = space.project(space.exp(centre, step))
        if (space.norm(found[several], step) <= _DONE * space.rounding(centre)).all():
            break
    found[several] = centre
    return found
