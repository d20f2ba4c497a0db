"""Geodesic regression, the smoothing with an infinite λ."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from .._core import ValidationError
from .._spaces import Doubles, Space, SpecialEuclidean, factors_of
from .factors import smoothed_spaces
from .knots import Knots, thin_knots
from .solve import Smoothed, SolverOptions

# Number of knots from which the length of the geodesic is determined.
_FIRST = 32
# Two knots are joined by one geodesic if they are closer than this fraction of the injectivity radius.
_NEAR, _STEP = 0.9, 0.3
# Largest dimension in which the full Gauss–Newton solver is used; its matrices have (2 dim)² entries.
_LARGE = 64


def is_infinite(lams: list[Doubles]) -> bool:
    """Whether all curves are geodesics."""
    return all(np.isinf(lam).all() and lam.size for lam in lams)


def check_infinite(lams: list[Doubles], bc_type: Any, penalty: str) -> None:
    """Raise ValidationError if λ is infinite where the curve is not a geodesic."""
    if not any(np.isinf(lam).any() for lam in lams):
        return
    for name, value, required in (("penalty", penalty, "acceleration"), ("bc_type", bc_type, "natural")):
        if value != required:
            raise ValidationError(
                f"lam=inf fits a geodesic, whose {name} is {required!r}, not {value!r}. Pass a finite lam, or omit "
                f"{name}."
            )


def geodesic_options(space: Space, options: SolverOptions) -> SolverOptions:
    """Return the options for a geodesic, by default those of the full Gauss–Newton solver.

    The linearised solver is inaccurate for one long segment.
    """
    if options.method != "auto" or any(own.dim > _LARGE for own in smoothed_spaces(space)):
        return options
    return options._replace(method="newton")


def geodesic_knots(every: Knots, space: Space, run: Callable[[Knots], list[Any]]) -> Knots:
    """Return the two knots of a geodesic, or more if it is so long that two knots do not determine it.

    Poses keep all knots: rotations and positions on geodesics are not a geodesic of poses.

    Parameters
    ----------
    every : Knots
        The times of the data, or the knots that were given.
    run : callable
        Function that fits curves with given knots.
    """
    if any(isinstance(factor, SpecialEuclidean) for factor in factors_of(space)):
        return every
    found = run(thin_knots(every, _FIRST))
    ratio = 0.0
    for part, (rows, _, _) in zip(smoothed_spaces(space), found, strict=True):
        starts, ends = part._neighbours(rows)
        good = part._where_finite(starts) & part._where_finite(ends)
        steps = np.zeros(good.shape)
        steps[good] = part.distance(starts[good], ends[good])
        ratio = max(ratio, float(np.max(steps.sum(axis=-1), initial=0.0)) / part.injectivity_radius)
    return thin_knots(every, 2 if ratio < _NEAR else 1 + int(np.ceil(ratio / _STEP)))


def with_infinite_lam(part: Smoothed, lam: Doubles, batch: tuple[int, ...]) -> Smoothed:
    """Return the properties of a fit, whose report has the λ that was given where it is infinite."""
    given = lam.reshape(batch) if batch else lam[0]
    infinite = np.isinf(given)
    if not infinite.any():
        return part
    lams: Any = np.where(infinite, given, part.report.lam)
    bound: Any = part.report.at_bound & ~infinite
    if not batch:
        lams, bound = float(lams), bool(bound)
    return part._replace(report=replace(part.report, lam=lams, at_bound=bound))
