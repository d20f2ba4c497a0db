"""Warnings about neighbouring points in inconsistent representations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._base.faults import of_index
from .._base.report import MAX_STEP, Columns, FarPointsWarning
from .._base.warnings import warn
from .._core import CutLocusError
from .._spaces import Array, Doubles, Euclidean, Space, Sphere, Torus, Unitary, cover_of, factors_of
from ..manifolds import Manifold
from .curve import CurveArrays
from .fit import Points

# The fraction of the cut angle from which several C² curves are common, see docs/solvers.md.
FAR = 0.6
# Fewer steps are too few to show a pattern.
_LEAST = 4
# Points closer to each other than this, slightly less than π/2, have a positive inner product.
_NEAR = 1.57
# Remedies for quaternions of opposite sign, for users of the Python interface.
IN_PYTHON = (
    "For rotations, use so:3 (symspline.rotations.from_quaternions returns its points) or rp:3, where q and -q are the "
    "same point. For other data, silence this warning with "
    "warnings.filterwarnings('ignore', message='neighbours of opposite sign')"
)


def warn_of_representatives(
    space: Space[Any],
    points: Sequence[list[Points] | None],
    curves: Sequence[CurveArrays],
    longest_steps: Sequence[Sequence[Columns | Doubles]],
) -> None:
    """Warn about signs and about far points, for curves through their points.

    Parameters
    ----------
    points, curves, longest_steps
        As for `warn_of_signs` and `warn_of_far_points`.
    """
    for curve, each in zip(curves, longest_steps, strict=True):
        for (factor, *_), own in zip(curve.factors, each, strict=True):
            limit = factor.__dict__.get("_longest_near_step") or _longest_near_step(factor)
            longest = own.numbers[MAX_STEP] if isinstance(own, Columns) else own
            # Operations on arrays would take longer than the rest of this module's work for one curve.
            if longest.item() > limit if longest.size == 1 else (longest > limit).any():
                warn_of_signs(space, points)
                warn_of_far_points(curves, longest_steps)
                return


def _longest(steps: Columns | Doubles) -> Doubles:
    """Return the longest step of every curve."""
    return steps.numbers[MAX_STEP] if isinstance(steps, Columns) else steps


def _longest_near_step(space: Space[Any]) -> float:
    """Return the longest step that never leads to a warning, cached for each space."""
    limit = FAR * space.injectivity_radius
    if _has_quaternions(space):
        limit = min(limit, _NEAR)
    space.__dict__["_longest_near_step"] = limit
    return limit


def _has_quaternions(space: Space[Any]) -> bool:
    return isinstance(space, Sphere) and space._parameters == (3,)


# ---- quaternions of opposite sign ----


def warn_of_signs(space: Space[Any], curves: Sequence[list[Points] | None]) -> None:
    """Warn if neighbouring points on S³ are more than a quarter turn apart.

    As quaternions they would be closer with the opposite sign. The curve between them turns the long way round.

    Parameters
    ----------
    curves : sequence of list of Points
        The given points of each curve in every factor. A batch counts as one curve. None for masked curves.
    """
    found = [
        (number, index, part.numbers)
        for number, parts in enumerate(curves)
        for part, factor in zip(parts or (), factors_of(space), strict=parts is not None)
        if _has_quaternions(factor)
        for index in _opposite(part.numbers)
    ]
    if not found:
        return
    number, index, points = found[0]
    *batch, i = index.tolist()
    curve = [number] * (len(curves) > 1) + batch
    of, more = of_index(curve), f" (and {len(found) - 1} more pairs)" if len(found) > 1 else ""
    product = float(points[(*batch, i)] @ points[(*batch, i + 1)])
    message = (
        f"neighbours of opposite sign on sphere:3: points[{i}] and points[{i + 1}]{of} have inner product "
        f"{product:.3g}{more}. The quaternions q and -q are the same rotation, but here the curve turns the long way "
        f"round. {IN_PYTHON}"
    )
    warn(message, UserWarning, tuple(curve), i)


def _opposite(points: Array) -> NDArray[np.intp]:
    """Return the indices of points whose inner product with the next point is negative."""
    return np.argwhere(np.einsum("...i,...i", points[..., :-1, :], points[..., 1:, :]) < 0)


# ---- long steps ----


def warn_of_far_points(curves: Sequence[CurveArrays], longest_steps: Sequence[Sequence[Columns | Doubles]]) -> None:
    """Warn if more than half of the steps of a curve exceed 0.6 of the distance to the cut locus.

    Parameters
    ----------
    curves : sequence of CurveArrays
        The curves of one fit.
    longest_steps : sequence of sequence of Columns or ndarray
        The longest steps of each curve in every factor, or its reports. Points need not be examined if these are short.
    """
    found: list[_Far] = []
    for number, curve in enumerate(curves):
        steps = curve.times.shape[-1] - 1
        if steps < _LEAST:
            continue
        for k, part in enumerate(curve.parts):
            limit = FAR * part.space.injectivity_radius
            own = longest_steps[number][k]
            # The deciding angle never exceeds the distance.
            if not (_longest(own) > limit).any():
                continue
            far = _count_far(part.space, part.points)
            if isinstance(own, Columns):
                # Curves that did not converge are reported elsewhere, according to `on_failure`.
                far = np.where(own.row("converged").reshape(curve.batch), far, 0)
            for index in np.argwhere(far > steps / 2).tolist():
                place = tuple([number] * (len(curves) > 1) + index)
                found.append(_Far(place, int(far[tuple(index)]), steps, part.space))
    _warn_of_far(found)


def warn_of_far_data(space: Space[Any], data: Sequence[Points]) -> bool:
    """Warn in the same way about data in every factor that a curve need not pass through, and return whether it did."""
    found = []
    for factor, part in zip(factors_of(space), data, strict=True):
        steps = part.nodes - 1
        if steps < _LEAST:
            continue
        far = _count_far(factor, factor._numbers(part.numbers))
        found += [
            _Far(tuple(index), int(far[tuple(index)]), steps, factor) for index in np.argwhere(far > steps / 2).tolist()
        ]
    _warn_of_far(found)
    return bool(found)


class _Far(NamedTuple):
    """A curve with long steps: its index, the numbers of long and of all steps, and their space."""

    place: tuple[int, ...]
    far: int
    steps: int
    space: Space[Any]


def _count_far(space: Space[Any], points: Array) -> NDArray[np.intp]:
    """Return the number of long steps of every curve."""
    if isinstance(space, Euclidean):
        return np.zeros(points.shape[:-2], np.intp)
    return np.asarray(np.count_nonzero(cut_fractions(space, points) > FAR, axis=-1))


def _warn_of_far(found: list[_Far]) -> None:
    if not found:
        return
    place, count, steps, space = found[0]
    of = of_index(place)
    others = len({place for place, *_ in found}) - 1
    more = f" (and of {others} more curves)" if others else ""
    # Steps of degrees look like steps at random on a torus.
    angles = " Angles must be in radians." if isinstance(cover_of(space), Torus) else ""
    warn(
        f"more than half of the steps are long: {count} of {steps} steps between neighbouring points{of}{more} are "
        f"beyond {FAR} of the way to the cut locus of {cover_of(space)!r}, where several C² curves may exist.{angles} "
        "Where points have equivalent representatives, as orientations of crystals do, use a Quotient, whose method "
        "unwrap takes the one nearest to the previous point. Where phases, signs or bases do not count, use a "
        "Quotient, a projective space, or a Grassmannian, whose curves give continuous bases by their method lift. "
        "Otherwise put points in between.",
        FarPointsWarning,
        place,
    )


def cut_fractions(space: Space[Any], points: Array) -> Doubles:
    """Return the deciding angle between neighbouring points, divided by the angle at which the cut locus is reached.

    Parameters
    ----------
    space : Space
        A space that is not a product.
    points : ndarray, shape (..., N+1, *point_shape)
        Points.

    Returns
    -------
    ndarray, shape (..., N)
        NaN where a point is not finite or the fraction is unknown.
    """
    space = cover_of(space)
    finite = space._where_finite(points)
    good = finite[..., :-1] & finite[..., 1:]
    result = np.full(good.shape, np.nan)
    p, q = (x[good] for x in space._neighbours(points))
    if not len(p):
        return result
    if isinstance(space, Manifold):
        # The distance may be unknown on a manifold made of functions.
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
