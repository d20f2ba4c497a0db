"""Warning about data that are spread over all of a compact space, so that a smooth curve has little meaning."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._curves.curve import CurveArrays
from .._errors import warn
from .._spaces import Array, Space, factors_of
from .data import SmoothingData, points_of
from .factors import split

# Limit of the ratio of squared distances. The ratio is below it where smoothing still recovers the curve, as with noise
# of half a radian on S², SO(3) or RP². It is above it for random points, unless the curve follows them.
_FAR = 0.5
# Number of data of a curve that are enough for the check.
_ENOUGH = 1000


def warn_of_spread(space: Space, curve: CurveArrays, noisy: SmoothingData, dfs: list[Any]) -> None:
    """Warn once if data of a curve are about as far from it as random points of the space would be.

    The degrees of freedom with which the curve follows the data are taken into account.
    """
    every = -(-noisy.times.shape[-1] // _ENOUGH)
    at = np.ascontiguousarray(noisy.times[..., ::every])
    chosen = (slice(None),) * len(noisy.batch) + (slice(None, None, every),)
    parts = zip(factors_of(space), curve.parts, strict=True)
    at_curve = [
        x for factor, part in parts for x in split(factor, part.evaluate(at, "point", "raise", at.ndim > 1))
    ]
    for x, (factor, own), precision, df in zip(
        at_curve, points_of(noisy, space), noisy.precisions, dfs, strict=True
    ):
        # Other spaces have no uniform distribution of points, or no largest distance.
        if not np.isfinite(factor.injectivity_radius) or np.isnan(factor.curvature):
            continue
        found = _median_distance(factor, x, own[chosen], _counts(precision.weights)[..., ::every])
        random = factor.random_point(np.random.default_rng(0), (2, _ENOUGH))
        expected = float(np.median(factor._apply("distance", p=random[0], q=random[1])))
        count = np.sum(
            np.broadcast_to(_counts(precision.weights), (*noisy.batch, noisy.times.shape[-1])), axis=-1
        )
        # A curve through all data has no residuals to compare.
        far = np.argwhere((found**2 * count > _FAR * expected**2 * (count - df)) & (count - df >= 1))
        if len(far):
            index = tuple(map(int, far[0]))
            of = f" of curve {','.join(map(str, index))}" if index else ""
            more = f" (and {len(far) - 1} more curves)" if len(far) > 1 else ""
            warn(
                f"half of the data{of} are {found[index]:.2g} or more away from their smooth curve{more}. For random "
                f"points of {factor!r} this distance is {expected:.2g}, so the curve has little meaning. Check the "
                "units and signs of the data.",
                UserWarning,
                index,
            )
            return


def _counts(weights: Array) -> Any:
    """Return which data have a weight that is not negligible."""
    return weights > 1e-6 * weights.max(axis=-1, keepdims=True)


def _median_distance(space: Space, x: Array, y: Array, counts: Any) -> Array:
    """Return the median distance between the curve and the data that count; 0 for curves that failed."""
    lead = x.shape[: x.ndim - len(space.point_shape)]
    used = np.broadcast_to(counts, lead) & np.isfinite(x).all(axis=tuple(range(len(lead), x.ndim)))
    distances = np.full(lead, np.nan)
    distances[used] = space._apply("distance", p=x[used], q=y[used])
    distances[~used.any(axis=-1)] = 0.0
    return np.asarray(np.nanmedian(distances, axis=-1))
