"""Warning about unit quaternions of opposite sign, which are one rotation but two points of S³."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._curves.fit import Points
from ._errors import callers_level
from ._spaces import Array, Space, Sphere, factors_of

# Points closer together than this, slightly less than π/2, have a positive inner product.
_NEAR = 1.57
# Remedies for users of the Python interface.
IN_PYTHON = (
    "For rotations, use so:3 (symspline.rotations.from_quaternions returns its points) or rp:3, where q and -q are the "
    "same point. For other data, silence this warning with "
    "warnings.filterwarnings('ignore', message='neighbours of opposite sign')"
)


def warn_of_signs(
    space: Space, curves: Sequence[list[Points] | None], steps: Sequence[Any] | None = None
) -> None:
    """Warn once if neighbouring points on S³ are more than a quarter turn apart.

    As quaternions they would be closer with the opposite sign. The curve between them turns the long way round.

    Parameters
    ----------
    curves : sequence of list of Points or None
        Points of each curve in every factor; a batch is one entry. None for masked curves.
    steps : sequence, optional
        Longest distances between neighbours in every factor, which make the check cheap for near points.
    """
    looked_at = [
        isinstance(factor, Sphere)
        and factor._parameters == (3,)
        and (steps is None or not _longest(steps[k]) < _NEAR)
        for k, factor in enumerate(factors_of(space))
    ]
    if True not in looked_at:
        return
    found = [
        (number, index, part.doubles)
        for number, parts in enumerate(curves)
        if parts is not None
        for part, wanted in zip(parts, looked_at, strict=True)
        if wanted
        for index in _opposite(part.doubles)
    ]
    if not found:
        return
    number, index, points = found[0]
    *batch, i = index.tolist()
    curve = [number] * (len(curves) > 1) + batch
    of = f" of curve {','.join(map(str, curve))}" if curve else ""
    more = f" (and {len(found) - 1} more pairs)" if len(found) > 1 else ""
    product = float(points[(*batch, i)] @ points[(*batch, i + 1)])
    warnings.warn(
        f"neighbours of opposite sign on sphere:3: points[{i}] and points[{i + 1}]{of} have inner product "
        f"{product:.3g}{more}. The quaternions q and -q are the same rotation, but here the curve turns the long way "
        f"round. "
        f"{IN_PYTHON}",
        UserWarning,
        stacklevel=callers_level(),
    )


def _longest(steps: Any) -> Any:
    """Return the longest step of one curve or of several."""
    return steps if isinstance(steps, float) else np.max(steps, initial=0.0)


def _opposite(points: Array) -> NDArray[np.intp]:
    """Return the indices of points whose inner product with the next point is negative."""
    return np.argwhere(np.einsum("...i,...i", points[..., :-1, :], points[..., 1:, :]) < 0)
