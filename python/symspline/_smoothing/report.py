"""What a smoothing says about itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .._typing import Number


@dataclass(frozen=True)
class SmoothingReport:
    """How a smoothing went, in a space that is no product. For a batch of curves every field but ``method`` is an array
    with the batch axes.

    Attributes:
        method: ``"linearized"`` or ``"newton"``, the way that led to the minimum; of a batch ``"newton"`` if any curve
            needed it.
        converged: whether the last step was below the tolerance.
        iterations: how many splines were fitted.
        step: the last step of the points, in their standard deviations; the largest of all knots.
        rate: contraction of the steps in the last iteration.
        lam: λ.
        at_bound: whether the chosen λ lies at a bound: the curve is a geodesic (``df`` is 2), goes through all
            data, or is the roughest one that was found.
        df: degrees of freedom, for each coordinate: 2 for a geodesic, and the number of data for interpolation.
        sigma: estimated standard deviation of the noise in a coordinate, for weight one.
    """

    method: Literal["linearized", "newton"]
    converged: bool | NDArray[np.bool_]
    iterations: int | NDArray[np.int64]
    step: Number
    rate: Number
    lam: Number
    at_bound: bool | NDArray[np.bool_]
    df: Number
    sigma: Number

    def __str__(self) -> str:
        good = np.asarray(self.converged)
        if good.ndim == 0:
            state = "converged" if good else "NOT converged"
            bound = (
                f" (at its bound: {'a geodesic' if self.is_stiff() else 'rough'})" if self.at_bound else ""
            )
            return (
                f"{state}: {self.method}, {self.iterations} iterations, λ = {self.lam:.3g}{bound}, "
                f"{self.df:.1f} degrees of freedom, noise {self.sigma:.2g}"
            )
        return f"{np.count_nonzero(good)} of {good.size} curves converged: {self.method}"

    def is_stiff(self, index: tuple[int, ...] = ()) -> bool:
        """Whether a curve has hardly more degrees of freedom than one without any bending."""
        return bool(np.asarray(self.df)[index] < 2.5)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, SmoothingReport):
            return NotImplemented
        (ours, *columns), (theirs, *others) = vars(self).values(), vars(other).values()
        return ours == theirs and all(
            np.array_equal(a, b, equal_nan=True) for a, b in zip(columns, others, strict=True)
        )

    def map(self, function: Callable[[Any], Any]) -> SmoothingReport:
        """The report with a function applied to the fields that are per curve."""
        method, *columns = vars(self).values()
        return SmoothingReport(method, *map(function, columns))
