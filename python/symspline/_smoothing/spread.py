"""Data that are spread over all of a compact space, where a smooth curve through them means little."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from .._curves.curve import CurveArrays
from .._errors import callers_level
from .._spaces import Array, Space, factors_of
from .data import SmoothingData, points_of
from .factors import split

# Of squared distances. Where smoothing still finds the curve, as with noise of half a radian on S², SO(3) or RP², the
# quotient is below; of random points it is above, but where the curve follows them.
_FAR = 0.5
# So many data of a curve tell.
_ENOUGH = 1000


def warn_of_spread(space: Space, curve: CurveArrays, noisy: SmoothingData, dfs: list[Any]) -> None:
    """Warn once if data of a curve are about as far from it as random points of the space would be, but for what it
    follows them with its degrees of freedom."""
    every = -(-noisy.times.shape[-1] // _ENOUGH)
    at = np.ascontiguousarray(noisy.times[..., ::every])
    chosen = (slice(None),) * len(noisy.batch) + (slice(None, None, every),)
    parts = zip(factors_of(space), curve.parts, strict=True)
    at_curve = [
        x for factor, part in parts for x in split(factor, part.evaluate(at, "point", "raise", at.ndim > 1))
    ]
    for x, (factor, own), weighing, df in zip(
        at_curve, points_of(noisy, space), noisy.weighing, dfs, strict=True
    ):
        # Elsewhere no points are random ones, or none are far.
        if not np.isfinite(factor.injectivity_radius) or np.isnan(factor.curvature):
            continue
        found = _median_distance(factor, x, own[chosen], _counts(weighing.weights)[..., ::every])
        random = factor.random_point(np.random.default_rng(0), (2, _ENOUGH))
        expected = float(np.median(factor._apply("distance", p=random[0], q=random[1])))
        count = np.sum(
            np.broadcast_to(_counts(weighing.weights), (*noisy.batch, noisy.times.shape[-1])), axis=-1
        )
        # A curve through all data says nothing of noise.
        far = np.argwhere((found**2 * count > _FAR * expected**2 * (count - df)) & (count - df >= 1))
        if len(far):
            index = tuple(far[0])
            of = f" of curve {','.join(map(str, index))}" if index else ""
            more = f" (and {len(far) - 1} more curves)" if len(far) > 1 else ""
            warnings.warn(
                f"half of the data{of} are {found[index]:.2g} or more from their smooth curve{more}, and half of "
                f"random points of {factor!r} would be {expected:.2g}: data so spread have hardly a mean, and the "
                "curve means little. Check units and signs of the data",
                UserWarning,
                stacklevel=callers_level(),
            )
            return


def _counts(weights: Array) -> Any:
    """Which data have a weight beside that of others."""
    return weights > 1e-6 * weights.max(axis=-1, keepdims=True)


def _median_distance(space: Space, x: Array, y: Array, counts: Any) -> Array:
    """The median distance of the data y that count from the curve at their times; 0 of a curve that was not found."""
    lead = x.shape[: x.ndim - len(space.point_shape)]
    used = np.broadcast_to(counts, lead) & np.isfinite(x).all(axis=tuple(range(len(lead), x.ndim)))
    distances = np.full(lead, np.nan)
    distances[used] = space._apply("distance", p=x[used], q=y[used])
    distances[~used.any(axis=-1)] = 0.0
    return np.asarray(np.nanmedian(distances, axis=-1))
