"""Groups of real matrices with two components, of positive and of negative determinant."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import CutLocusError, ValidationError
from .._typing import P
from .base import Array, Space


class DisconnectedGroup(Space[P]):
    """Group with two components. Operations on points in different components fail with an explanation."""

    def _finite(self, operation: str, t: NDArray[np.float64] | None = None, **inputs: ArrayLike) -> Any:
        try:
            return super()._finite(operation, t, **inputs)
        except (CutLocusError, ValidationError):
            if "q" in inputs:
                self._check_same_part(inputs["p"], inputs["q"])
            raise

    def _check_same_part(self, p: ArrayLike, q: ArrayLike) -> None:
        pairs: Array = np.zeros((0, 0), int)
        # Arrays of a wrong shape raise an error elsewhere.
        with np.errstate(all="ignore"), suppress(ValueError):
            signs = [np.sign(np.linalg.det(self._doubles(x, name))) for x, name in ((p, "p"), (q, "q"))]
            pairs = np.argwhere(signs[0] * signs[1] < 0)
        if len(pairs):
            pair = ",".join(map(str, pairs[0])) or "0"
            raise ValidationError(f"pair {pair} has opposite determinants: no curve joins them")
