"""Groups of real matrices of which one part has positive determinants and the other one negative ones."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import CutLocusError, ValidationError
from .._typing import P
from .base import Array, Space


class DisconnectedGroup(Space[P]):
    """A space of matrices of two parts, which no curve joins: what fails for two points in different ones says so."""

    def _finite(self, operation: str, t: NDArray[np.float64] | None = None, **inputs: ArrayLike) -> Any:
        try:
            return super()._finite(operation, t, **inputs)
        except (CutLocusError, ValidationError):
            if "q" in inputs:
                self._check_same_part(inputs["p"], inputs["q"])
            raise

    def _check_same_part(self, p: ArrayLike, q: ArrayLike) -> None:
        pairs: Array = np.zeros((0, 0), int)
        # Arrays of a wrong shape have an error of their own.
        with np.errstate(all="ignore"), suppress(ValueError):
            signs = [np.sign(np.linalg.det(self._doubles(x, name))) for x, name in ((p, "p"), (q, "q"))]
            pairs = np.argwhere(signs[0] * signs[1] < 0)
        if len(pairs):
            pair = ",".join(map(str, pairs[0])) or "0"
            raise ValidationError(f"pair {pair} has opposite determinants: no curve joins them")
