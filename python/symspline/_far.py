"""Warning about neighbouring points that are mostly far apart, such as points in inconsistent representations."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import CutLocusError
from ._curves.curve import CurveArrays
from ._errors import callers_level
from ._report import FarPointsWarning, Report
from ._spaces import (
    Affine,
    Array,
    ComplexGeneralLinear,
    ComplexGrassmannian,
    ComplexProjective,
    GeneralLinear,
    Grassmannian,
    Orthogonal,
    RealProjective,
    Similarity,
    Space,
    SpecialEuclidean,
    SpecialLinear,
    SpecialOrthogonal,
    SpecialUnitary,
    Sphere,
    Symplectic,
    Unitary,
)

# Fraction of the distance to the cut locus from which several C² curves are common, see docs/solvers.md.
FAR = 0.6
# Fewer steps are too few to show a pattern.
_LEAST = 4
_GROUPS = (
    SpecialOrthogonal,
    Orthogonal,
    Unitary,
    SpecialUnitary,
    SpecialEuclidean,
    GeneralLinear,
    ComplexGeneralLinear,
    Affine,
    Similarity,
    SpecialLinear,
    Symplectic,
)


def warn_of_far_points(curves: Sequence[CurveArrays], reports: Sequence[Sequence[Report] | None]) -> None:
    """Warn once if more than half of the steps of a curve exceed 0.6 of the distance to the cut locus.

    Parameters
    ----------
    curves : sequence of CurveArrays
        Curves of one fit; a batch is one entry.
    reports : sequence of sequence of Report or None
        Reports of each curve in its factors, whose longest steps make the check cheap for near points. None if there
        are no reports.
    """
    found: list[tuple[tuple[int, ...], int, int, Space]] = []
    for number, (curve, own) in enumerate(zip(curves, reports, strict=True)):
        steps = curve.times.shape[-1] - 1
        if steps < _LEAST:
            continue
        for k, part in enumerate(curve.parts):
            limit = FAR * part.space.injectivity_radius
            # The deciding angle never exceeds the distance.
            if not limit < np.inf or (own is not None and _all_near(own[k].max_step, limit)):
                continue
            far = np.count_nonzero(_parts_of_the_way(part.space, part.points) > FAR, axis=-1)
            if own is not None:
                # Curves that did not converge are reported elsewhere, according to `on_failure`.
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
    warnings.warn(
        f"more than half of the steps are long: {count} of {steps} steps between neighbouring points{of}{more} are "
        f"beyond {FAR} of the way to the cut locus of {space!r}, where several C² curves may exist. Where points have "
        "equivalent representatives, as orientations of crystals do, take the one nearest to the previous point. Where "
        "phases, signs or bases do not count, remove them, or use a projective space or a Grassmannian. Otherwise put "
        "points in between.",
        FarPointsWarning,
        stacklevel=callers_level(),
    )


def _all_near(longest: Any, limit: float) -> bool:
    """Whether no longest step exceeds the limit. Steps may be NaN.

    A single number is compared directly, which takes a tenth of the time.
    """
    return not (longest > limit if isinstance(longest, float) else np.any(longest > limit))


def _parts_of_the_way(space: Space, points: Array) -> NDArray[np.float64]:
    """Return the step from every point to the next as a fraction of the distance to the cut locus.

    The fraction refers to the angle that decides whether the geodesic is unique. It is NaN where a point is invalid.

    Parameters
    ----------
    points : ndarray, shape (..., n, *point_shape)

    Returns
    -------
    ndarray, shape (..., n - 1)
    """
    axes = len(space.point_shape)
    lead = (slice(None),) * (points.ndim - axes - 1)
    p, q = points[(*lead, slice(None, -1))], points[(*lead, slice(1, None))]
    if isinstance(space, (Sphere, RealProjective, ComplexProjective)):
        cosines = np.einsum("...i,...i", p.conj(), q)
        if not isinstance(space, Sphere):
            cosines = np.abs(cosines)
        return np.asarray(np.arccos(np.clip(cosines, -1, 1)) / space.injectivity_radius)
    finite = np.asarray(np.isfinite(points).all(axis=tuple(range(-axes, 0))))
    good = finite[..., :-1] & finite[..., 1:]
    result = np.full(good.shape, np.nan)
    a, b = p[good], q[good]
    if not len(a):
        return result
    if isinstance(space, _GROUPS):
        # p⁻¹q has no logarithm nearby where an eigenvalue is negative. Lengths of translations do not count.
        angles = np.abs(np.angle(np.linalg.eigvals(np.linalg.solve(a, b))))
        largest = angles.max(axis=-1)
        if isinstance(space, Unitary):
            # The largest angle of a random global phase is often below 0.6 π. The root mean square counts as well, with
            # the factor √2 that makes it the distance of 2 × 2 gates.
            largest = np.maximum(largest, math.sqrt(2) * np.sqrt(np.mean(angles**2, axis=-1)))
        result[good] = largest / math.pi
    elif isinstance(space, (Grassmannian, ComplexGrassmannian)):
        cosines = np.linalg.svd(np.swapaxes(a.conj(), -1, -2) @ b, compute_uv=False)
        result[good] = np.arccos(np.clip(cosines[..., -1], -1, 1)) / (math.pi / 2)
    else:
        try:
            result[good] = space.distance(a, b) / space.injectivity_radius
        except CutLocusError:
            # The logarithm of a manifold made of functions may not exist.
            return result
    return result
