"""Reports of smoothing fits, their warnings, and the posterior distribution of the curve, in frames along it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._base.arrays import same
from .._base.report import BOOL, FLOAT, INT, FitReport
from .._base.typing import FloatArray, Number
from .._spaces import Array, Doubles, Space

# Index of a curve in its batch.
Index = tuple[int, ...]
# Kinds of the ends, as the core names them; None for closed curves.
Kinds = list[str] | None
# The arrays of the matrix A, the number of coordinates that it couples, the kinds of the ends, and the holonomy.
Known = tuple[list[Doubles], int, Kinds, Doubles]
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
    gain : float, ndarray or None
        Increase of twice the logarithm of the restricted likelihood if λ or σ varies, which they do if it exceeds 6,
        and 18 for both. NaN if the curve then does not converge, so that neither varies. None if it was not asked for,
        see `make_smoothing_spline`.

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
    gain: Number | None = field(default=None, metadata=FLOAT | {"optional": True})

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


def fields_of(report: SmoothingReport, varies: bool = False) -> dict[str, Any]:
    """Return the fields of a report for files.

    Older versions refuse a report with a gain, as they should if λ or σ `varies`. They read all other curves.
    """
    fields = dict(vars(report))
    if report.gain is None and not varies:
        del fields["gain"]
    return fields


# ---- posterior ----


class Parameter(NamedTuple):
    """An estimated constant.

    Attributes
    ----------
    value : ndarray, shape (size,)
        Estimate.
    cov : ndarray, shape (size, size)
        Covariance.
    """

    value: FloatArray
    cov: FloatArray

    @property
    def std(self) -> FloatArray:
        """Standard deviations, shape (size,)."""
        return np.sqrt(np.diag(self.cov))

    def __eq__(self, other: object) -> bool:
        """Whether both have equal arrays."""
        return same(tuple(self), tuple(other)) if isinstance(other, Parameter) else NotImplemented

    def __ne__(self, other: object) -> bool:
        return not self == other


class Posterior(NamedTuple):
    """The matrix A of the linear problem.

    Its inverse is the covariance of the coefficients for noise of variance one.

    Attributes
    ----------
    band : ndarray, shape (..., coefficients · size, 4 size)
        Its band: the entries (i, i − d).
    turn : ndarray, shape (..., size, size) or (..., 0, 0)
        Holonomy of a closed curve.
    size : int
        Number of coordinates that A couples: 1 if it is the same for every coordinate.
    side, corner : ndarray, shape (coefficients · size, p) and (p, p)
        Rows and columns of the parameters.
    first : int
        Number of the first of the coordinates of the space among the coupled ones.
    """

    band: Doubles
    turn: Doubles
    size: int
    side: Doubles
    corner: Doubles
    first: int = 0

    @classmethod
    def of(cls, band: Doubles, turn: Doubles, size: int) -> Posterior:
        """Return the posterior of a curve without parameters."""
        return cls(band, turn, size, np.zeros((band.shape[-2], 0)), np.zeros((0, 0)))

    def map(self, function: Callable[[Array], Array]) -> Posterior:
        """Apply a function to the arrays with batch axes, such as the selection of some curves."""
        return self._replace(band=function(self.band), turn=function(self.turn))

    def known(self, index: Index, kinds: Kinds) -> Known:
        """Return the matrix A of one curve and its end conditions, in the form that the core expects."""
        arrays = list(map(np.ascontiguousarray, (self.band[index], self.side, self.corner)))
        return arrays, self.size, kinds, np.ascontiguousarray(self.turn[index])

    def covariance(
        self, space: Space, knots: Doubles, index: Index, kinds: Kinds, x: Doubles, y: Doubles | None, orders: list[int]
    ) -> Doubles:
        """Return covariances of one curve at times x for noise of variance one.

        Parameters
        ----------
        space : Space
            The space of the coordinates.
        knots : ndarray
            Knots of the curve.
        index : tuple of int
            Index of the curve in the batch.
        kinds : list of str or None
            Kinds of the ends.
        x, y : ndarray
            Times; y is None for the covariance of derivatives at the same time.
        orders : list of int
            Orders of the derivatives.

        Returns
        -------
        ndarray, shape (n, d, d)
            Covariances, with d = ``len(orders) * space.dim``.
        """
        count, m = len(orders), space.dim
        if self.size == 1 and m > 1:
            of_coordinate = self.coupled(knots, index, kinds, x, y, orders, np.arange(1))
            whole = np.zeros((len(x), count, m, count, m))
            index_of_coordinate = np.arange(m)
            whole[:, :, index_of_coordinate, :, index_of_coordinate] = of_coordinate
            return whole.reshape(len(x), count * m, count * m)
        return self.coupled(knots, index, kinds, x, y, orders, np.arange(self.first, self.first + m))

    def coupled(
        self, knots: Doubles, index: Index, kinds: Kinds, x: Doubles, y: Doubles | None, orders: list[int], rows: Array
    ) -> Doubles:
        """Return the same for some of the coordinates that A couples, given by their numbers `rows`."""
        covariances = _core.posterior_covariance(knots, self.known(index, kinds), x, y, orders)
        count, d = len(orders), len(orders) * len(rows)
        square = covariances.reshape(len(x), count, self.size, count, self.size)[:, :, rows][..., rows]
        return np.ascontiguousarray(square.reshape(len(x), d, d))

    def samples(
        self, space: Space, knots: Doubles, index: Index, kinds: Kinds, rng: np.random.Generator, n: int
    ) -> Doubles:
        """Return moves of one curve at its knots, shape (n, knots, size or dim), for noise of variance one."""
        known = self.known(index, kinds)
        rows = n * space.dim if self.size == 1 else n
        normal = np.empty((rows, _core.posterior_freedom(knots, known)))
        # The same numbers as in one call. Python handles signals between the rows.
        for row in normal:
            rng.standard_normal(out=row)
        moves = _core.posterior_samples(knots, known, normal)
        if self.size == 1:
            return np.moveaxis(moves.reshape(n, space.dim, len(knots)), 1, 2)
        return moves.reshape(n, len(knots), self.size)


def frames_at(space: Space, knots: Doubles, points: Array, x: Doubles, p: Array) -> Array:
    """Return frames along a curve at the points p for the times x, shape (n, dim, *point_shape)."""
    doubles = [np.ascontiguousarray(space._as_doubles(rows)) for rows in (points, p)]
    frames = _core.frames_along(space._handle, knots, doubles[0], np.ascontiguousarray(x), doubles[1])
    return space._numbers(frames.reshape(len(x), space.dim, *space._doubles_shape))


def coordinates(space: Space, p: Array, frames: Array, vectors: Array) -> Doubles:
    """Return the coordinates of tangent vectors at p in frames, shape (n, dim)."""
    if not np.isnan(space.curvature):
        products = space._apply("inner", p=p[:, None], u=frames, v=np.broadcast_to(vectors[:, None], frames.shape))
        return np.ascontiguousarray(products)
    # Groups without a metric have frames that are not orthonormal.
    flat, rows = _flat(space, frames), _flat(space, vectors)
    gram = flat @ np.swapaxes(flat, -1, -2)
    return np.ascontiguousarray(np.linalg.solve(gram, flat @ rows[..., None])[..., 0])


def _flat(space: Space, vectors: Array) -> Doubles:
    """Return vectors as rows of real numbers."""
    doubles = space._as_doubles(np.ascontiguousarray(vectors))
    return doubles.reshape(*vectors.shape[: vectors.ndim - len(space.point_shape)], -1)


def process_ratio(
    times: Doubles,
    weights: Doubles,
    knots: Doubles,
    band: Doubles | None,
    lam: float,
    profile: Doubles | None,
    kinds: Kinds,
    x: Doubles,
    nu: int,
) -> Doubles:
    """Return the variance of the process divided by that of a cubic spline with the same data and the same λ.

    The posterior mean of the process is a quintic spline. At the data, its variance is nearly that of the cubic spline.
    Between the data, the process is stiffer than the one whose mean is a cubic spline.

    Parameters
    ----------
    times, weights : ndarray, shape (N,)
        Times and weights of the data.
    knots : ndarray
        Knots of the cubic spline.
    band : ndarray or None
        Band of A⁻¹. None if coordinates are coupled; the ratio is then that of uncoupled coordinates.
    lam : float
        Weight of the penalty.
    profile : ndarray or None, shape (knots - 1,)
        Factors of λ in the segments.
    kinds : list of str or None
        Kinds of the ends; None for a closed curve.
    x : ndarray, shape (n,)
        Times.
    nu : {0, 1}
        0 for the point, 1 for the velocity.
    """
    used = weights > 0
    times, weights, knots, x = (np.ascontiguousarray(array) for array in (times[used], weights[used], knots, x))
    if not (lam > 0 and np.isfinite(lam)):
        return np.ones(len(x))
    if band is None:
        band = _core.smoothing_inverse(knots, times, weights, lam, profile, "jerk", kinds).reshape(-1, 4)
    period = knots[-1] - knots[0] if kinds is None else None
    spline = _core.smoothing_variance(knots, np.ascontiguousarray(band), np.zeros(1), None, x, nu, kinds)
    factors = None if profile is None else [knots, profile]
    return np.asarray(_core.process_variance(times, weights, lam, factors, period, x, nu) / spline)
