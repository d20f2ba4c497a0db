"""Reports and warnings of smoothing fits."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .._base.report import BOOL, FLOAT, INT, FitReport
from .._base.typing import Number

METHODS: tuple[Literal["linearized", "newton"], ...] = ("linearized", "newton")


class SmoothingWarning(UserWarning):
    """Warning that a statistical fit cannot be trusted.

    Reasons are a chosen λ at a bound, residuals that are not those of independent noise with the given standard
    deviations, a robust loss that may have rejected the wrong data, another curve that may fit as well, and a gap in
    which the error of the curve cannot be estimated.
    """


@dataclass(frozen=True, eq=False)
class SmoothingReport(FitReport):
    """Report of a smoothing fit in a space that is not a product.

    For a batch of curves, every field except ``method`` is an array with the batch axes.

    Attributes
    ----------
    method : str
        Solver that found the minimum, ``"linearized"`` or ``"newton"``. For a batch, ``"newton"`` if any curve needed
        it.
    converged : bool or ndarray of bool
        Whether the last step was below the tolerance.
    iterations : int or ndarray of int
        Number of splines that were fitted.
    step : float or ndarray
        Last step of the points, in their standard deviations; the largest over all knots.
    rate : float or ndarray
        Contraction factor of the steps in the last iteration.
    lam : float or ndarray
        Weight λ of the bending energy.
    at_bound : bool or ndarray of bool
        Whether the chosen λ is at a bound: the curve is a geodesic, passes through all data, or is the roughest one
        that was found.
    df : float or ndarray
        Effective degrees of freedom per coordinate: 2 for a geodesic, and the number of data for interpolation.
    sigma : float or ndarray
        Estimated standard deviation of the noise in one coordinate, for weight one. For `estimate` with given standard
        deviations, the ratio of the residuals and these.

    See Also
    --------
    SmoothingSpline.report : Report of a smoothing spline.

    Examples
    --------
    >>> import numpy as np
    >>> import symspline as ss
    >>> t = np.linspace(0, 1, 50)
    >>> y = np.sin(6 * t) + 0.1 * np.random.default_rng(0).standard_normal(50)
    >>> report = ss.make_smoothing_spline(t, y[:, None], "r:1").report
    >>> report.method, report.converged, report.at_bound
    ('linearized', True, False)
    """

    method: Literal["linearized", "newton"] = field(metadata={"words": METHODS})
    converged: bool | NDArray[np.bool_] = field(metadata=BOOL)
    iterations: int | NDArray[np.int64] = field(metadata=INT)
    step: Number = field(metadata=FLOAT)
    rate: Number = field(metadata=FLOAT)
    lam: Number = field(metadata=FLOAT)
    at_bound: bool | NDArray[np.bool_] = field(metadata=BOOL)
    df: Number = field(metadata=FLOAT)
    sigma: Number = field(metadata=FLOAT)

    def __str__(self) -> str:
        good = np.asarray(self.converged)
        if good.ndim == 0:
            state = "converged" if good else "NOT converged"
            bound = f" (at its bound: {'a geodesic' if self.is_stiff() else 'rough'})" if self.at_bound else ""
            return (
                f"{state}: {self.method}, {self.iterations} iterations, λ = {self.lam:.3g}{bound}, "
                f"{self.df:.1f} degrees of freedom, noise {self.sigma:.2g}"
            )
        return f"{np.count_nonzero(good)} of {good.size} curves converged: {self.method}"

    def is_stiff(self, index: tuple[int, ...] = ()) -> bool:
        """Whether a curve has hardly more degrees of freedom than a geodesic.

        Parameters
        ----------
        index : tuple of int, default ()
            Index of the curve in the batch.

        Returns
        -------
        bool
            True if the curve has less than 2.5 degrees of freedom per coordinate.

        Examples
        --------
        >>> import symspline as ss
        >>> line = ss.make_smoothing_spline([0, 1, 2, 3], [[0.0], [1.1], [1.9], [3.0]], "r:1", lam=1e6)
        >>> line.report.is_stiff()
        True
        """
        return bool(np.asarray(self.df)[index] < 2.5)
