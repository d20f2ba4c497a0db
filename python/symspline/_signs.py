"""Unit quaternions of opposite sign: one rotation, but two points of S³."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._curves.fit import Points
from ._errors import callers_level
from ._spaces import Array, Space, Sphere, factors_of

# Points nearer to each other than this, a little less than π/2, have a positive inner product.
_NEAR = 1.57
# What a program may do about it.
IN_PYTHON = (
    "Curves of rotations are on so:3 (symspline.rotations.from_quaternions makes its points) or on rp:3, where signs "
    "do not count. If these are no rotations: "
    "warnings.filterwarnings('ignore', message='neighbours of opposite sign')"
)


def warn_of_signs(
    space: Space[Any], curves: Sequence[list[Points] | None], steps: Sequence[Any] | None = None
) -> None:
    """Warn once if neighbours on S³ are more than a quarter turn apart: as quaternions they are closer with the other
    sign, and the curve between them turns the long way round.

    Args:
        curves: the points of each curve in every factor; of a batch they are one; None for those left out.
        steps: the longest distances of neighbours in every factor, where they are known: near ones need no look.
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
        f"{product:.3g}{more}. As quaternions q and -q are one rotation, but here the curve turns the long way round. "
        f"{IN_PYTHON}",
        UserWarning,
        stacklevel=callers_level(),
    )


def _longest(steps: Any) -> Any:
    """The longest step of some curves, or of one."""
    return steps if isinstance(steps, float) else np.max(steps, initial=0.0)


def _opposite(points: Array) -> NDArray[np.intp]:
    """Indices of points with a negative product with the next one."""
    return np.argwhere(np.einsum("...i,...i", points[..., :-1, :], points[..., 1:, :]) < 0)
