"""Neighbours that are mostly far apart, as those of data are whose representatives do not fit each other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import CutLocusError
from ._curves.curve import CurveArrays
from ._errors import warn
from ._report import FarPointsWarning, Report
from ._spaces import Array, Space, Unitary
from .manifolds import Manifold

# Parts of the way to the cut locus: from here on several C² curves are common, see docs/solvers.md.
FAR = 0.6
# Curves of fewer steps show no habit.
_LEAST = 4


def warn_of_far_points(curves: Sequence[CurveArrays], reports: Sequence[Sequence[Report] | None]) -> None:
    """Warn once if more than half of the steps of a curve are beyond 0.6 of the way to the cut locus.

    Args:
        curves: those of one fit; of a batch they are one.
        reports: of each curve those in its factors, whose longest steps save a look at near points; None if unknown.
    """
    found: list[tuple[tuple[int, ...], int, int, Space]] = []
    for number, (curve, own) in enumerate(zip(curves, reports, strict=True)):
        steps = curve.times.shape[-1] - 1
        if steps < _LEAST:
            continue
        for k, part in enumerate(curve.parts):
            limit = FAR * part.space.injectivity_radius
            # Deciding angles are at most as large as distances.
            if not limit < np.inf or (own is not None and _all_near(own[k].max_step, limit)):
                continue
            far = np.count_nonzero(cut_fractions(part.space, part.points) > FAR, axis=-1)
            if own is not None:
                # Failures of curves that did not converge are reported elsewhere, as `on_failure` demands.
                far = np.where(own[k].converged, far, 0)
            for index in np.argwhere(far > steps / 2).tolist():
                place = tuple([number] * (len(curves) > 1) + index)
                found.append((place, int(far[tuple(index)]), steps, part.space))
    if not found:
        return
    place, count, steps, space = found[0]
    of = f" of curve {','.join(map(str, place))}" if place else ""
    others = len({place for place, *_ in found}) - 1
    more = f" (and of {others} more curves)" if others else ""
    warn(
        f"more than half of the steps are long: {count} of {steps} steps between neighbouring points{of}{more} are "
        f"beyond {FAR} of the way to the cut locus of {space!r}, where several C² curves may exist. Where points have "
        "equivalent representatives, as orientations of crystals do, take the one nearest to the previous point. Where "
        "phases, signs or bases do not count, remove them, or use a projective space or a Grassmannian. Otherwise put "
        "points in between.",
        FarPointsWarning,
        place,
    )


def _all_near(longest: Any, limit: float) -> bool:
    """Whether no longest step, which may be NaN, is beyond the limit. A single number is compared as it is, which takes
    a tenth of the time."""
    return not (longest > limit if isinstance(longest, float) else np.any(longest > limit))


def cut_fractions(space: Space, points: Array) -> NDArray[np.float64]:
    """The deciding angle between neighbouring points, divided by the angle at which the cut locus is met.

    Parameters
    ----------
    space : Space
        A space that is not a product.
    points : ndarray, shape (..., N+1, *point_shape)

    Returns
    -------
    ndarray, shape (..., N)
        NaN where a point is not finite or the fraction is unknown.
    """
    axes = len(space.point_shape)
    lead = (slice(None),) * (points.ndim - axes - 1)
    finite = np.asarray(np.isfinite(points).all(axis=tuple(range(-axes, 0))))
    good = finite[..., :-1] & finite[..., 1:]
    result = np.full(good.shape, np.nan)
    p, q = points[(*lead, slice(None, -1))][good], points[(*lead, slice(1, None))][good]
    if not len(p):
        return result
    if isinstance(space, Manifold):
        # The distance may be unknown on a manifold that is made of functions.
        with suppress(CutLocusError):
            result[good] = space.distance(p, q) / space.injectivity_radius
        return result
    found = space._apply("cut_fraction", p=p, q=q)
    if isinstance(space, Unitary):
        # A random global phase alone is often below the limit. The root mean square of the angles, doubled, exceeds it
        # more often.
        rms = space.distance(p, q) / math.sqrt(space._parameters[0])
        found = np.maximum(found, math.sqrt(2) * rms / math.pi)
    result[good] = found
    return result
