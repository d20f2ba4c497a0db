"""Reports of fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from .typing import AnyFunction, Array, BatchIndex, Keywords, Number

# A gap between points is long if it exceeds the median by this factor.
_LONG = 10


# The most segments of a curve that the compiled core solves as a whole, `LONG` of `fit/curves.rs`.
_WHOLE = 512
# Several solutions may exist if a step exceeds this fraction of the injectivity radius.
_FAR, _HALF_WAY, _SLOW = 0.55, 0.4, 16

# In the order of their numbers in the compiled core.
SOLVERS = ("fixed-point", "quasi-newton", "newton", "homotopy", "trust-region")

# What stands in the fields of reports: one value per curve of a type, or one of a few words. An optional number is NaN
# where it is undefined, and the field is None where it is undefined for all curves.
BOOL, INT, FLOAT = ({"dtype": dtype} for dtype in (np.bool_, np.int64, np.float64))
_MAYBE = FLOAT | {"optional": True}


class ConvergenceWarning(UserWarning):
    """Warning that a curve did not converge or meets a cut locus, if ``on_failure="warn"``, or has no derivatives."""


class FarPointsWarning(UserWarning):
    """Warning that most neighbouring points of a curve are far apart.

    Several C² curves may then pass through the points. Often the representation of such data does not suit the space.
    """


def columns_of(kind: type) -> dict[str, type]:
    """Return the fields of a report that have one value per curve, and their types, in their order."""
    return {entry.name: entry.metadata["dtype"] for entry in fields(kind) if "dtype" in entry.metadata}


class Certificate(NamedTuple):
    """Proof that a C² spline exists near computed velocities, and that no other one does.

    Attributes
    ----------
    r : float, tuple of float or ndarray
        A C² spline exists whose velocities differ from the computed ones by at most r, in length. It includes the
        rounding errors of the fit.
    R : float, tuple of float or ndarray
        It is the only one whose velocities differ from the computed ones by at most R. Infinite in flat space.

    See Also
    --------
    Report : Report of a fit, with the conditions of the certificate.

    Examples
    --------
    >>> import symspline as ss
    >>> certificate = ss.CubicSpline(None, [[1, 0, 0], [0.8, 0.6, 0], [0.8, 0, 0.6]], "sphere:2").report.certificate
    >>> certificate.r < 1e-11, round(certificate.R, 1)
    (True, 0.4)
    """

    r: Any
    R: Any


class FitReport:
    """Base of reports, dataclasses whose fields have one value per curve or describe all curves."""

    def __eq__(self, other: object) -> bool:
        """Whether both are equal, with NaN equal to NaN."""
        if type(other) is not type(self):
            return NotImplemented
        pairs = [(mine, getattr(other, name)) for name, mine in vars(self).items()]
        return all(
            bool(a == b)
            if a is None or b is None or isinstance(a, (str, tuple))
            else np.array_equal(a, b, equal_nan=True)
            for a, b in pairs
        )

    def __hash__(self) -> int:
        return hash(tuple(vars(self).values()))

    def map(self, function: AnyFunction) -> Self:
        """Apply a function to all fields that have one value per curve.

        Parameters
        ----------
        function : callable
            Function of one field, such as the selection of some curves.

        Returns
        -------
        FitReport
            Report with the results, of the same class.

        Examples
        --------
        >>> import numpy as np
        >>> import symspline as ss
        >>> curves = ss.CubicSpline(None, np.zeros((3, 4, 1)), "r:1")
        >>> bool(curves.report.map(lambda field: field[0]).iterations == curves[0].report.iterations)
        True
        """
        values = {name: getattr(self, name) for name in columns_of(type(self))}
        return self._replaced({name: value if value is None else function(value) for name, value in values.items()})

    def _replaced(self, columns: Keywords) -> Self:
        return replace(self, **columns)  # type: ignore[type-var]


@dataclass(frozen=True, eq=False)
class Report(FitReport):
    r"""Report of a fit.

    For a batch of curves, every field except ``method``, ``curvature`` and ``skipped`` is an array with the batch
    axes.

    Attributes
    ----------
    method : str
        Solver that computed the curve: ``"fixed-point"``, ``"quasi-newton"``, ``"newton"``, ``"homotopy"`` or
        ``"trust-region"``. For a batch, the last one in this order that any curve needed.
    converged : bool or ndarray of bool
        Whether the residual is below the tolerance, or at the rounding floor (256 ε times the condition number of the
        data), and all control handles are inside the cut locus. For a closed curve this includes the point where its
        ends meet.
    iterations : int or ndarray of int
        Number of evaluations of the C² residual.
    residual : float or ndarray
        Relative C² residual, the largest over all knots; see Notes. If rounding errors of the curve at its knots exceed
        1e-8 and `tol`, they are given instead, relative to the largest speed. Up to 1e-7 the curve has converged;
        between the knots, errors can be ten times as large.
    max_step : float or ndarray
        D of (21), the longest distance between neighbouring points.
    max_gap : float or ndarray
        Longest time between neighbouring points; in seconds for dates.
    curvature : float
        K of (22), the bound of the curvature of the space.
    invariant_radius : float, tuple of float, ndarray or None
        Smallest V of (38), see Notes. None where the theorem does not apply, which is normal for points far apart
        (D + 2V must be less than the injectivity radius), for unequal knots, and for end conditions other than
        natural ends and given velocities; NaN for such curves of a batch. For a product, one value per factor along
        the last axis, in a tuple for a single curve, because the theorem applies to each factor separately.
    rate : float or ndarray
        Mean contraction factor of the residual per iteration.
    alternative_energy : float, ndarray or None
        Lowest bending energy of other C² curves through the points that ``method="auto"`` computed. None if there
        were none, NaN for such curves of a batch. It is lower than that of the curve only if the other curve goes
        around the space: one of its segments is longer than 1.7 times the distance to the cut locus. For a product,
        the alternative differs in one factor.
    contraction_bound : float, ndarray or None
        Bound α < 1 of the contraction factor of Algorithm 1, see Notes. None, or NaN in a batch, where
        `invariant_radius` is None or K D > 0.26058. For a product, the largest bound of its factors.
    guaranteed_sweeps : int, ndarray or None
        Number of sweeps of Algorithm 1 after which, by this bound, all h u/3 are within ``tol`` times
        `invariant_radius` of those of the curve. None, or NaN in a batch, if there is no bound.
    existence_radius : float, tuple of float, ndarray or None
        The first number of `certificate`. None, or NaN in a batch, without one.
    uniqueness_radius : float, tuple of float, ndarray or None
        The second number of `certificate`. None, or NaN in a batch, without one.
    skipped : tuple of str
        Solvers that ``method="auto"`` omitted or stopped early because they would have exceeded its budget. Curves of
        more than 512 segments are solved in sections, without the search for a solution of lower energy: if points are
        far apart, the solvers of that search are listed here. For a batch, those of any curve.

    See Also
    --------
    CubicSpline.report : Report of a spline.
    SmoothingReport : Report of a smoothing fit.

    Notes
    -----
    The residual at a knot is the violation of the C² condition (13) divided by :math:`1/h_{i-1} + 1/h_i`, relative to
    the largest speed, or to a thousandth of the largest distance over time between neighbours if all speeds are
    smaller. At an end with the condition ``"not-a-knot"`` it is the error of the velocity there, divided by
    :math:`1 + h_0/h_1`.

    Let u be the velocities and h the length of an interval. If all :math:`\lVert h u/3 \rVert \le V`, Algorithm 1
    keeps them so (Theorem 3.1). ``contraction_bound`` bounds its contraction per sweep in this region, in the norm of
    the largest velocity. With such a bound, exactly one C² spline through the points has handles no longer than V, and
    Algorithm 1 converges to it from zero velocities. Splines with longer handles may exist however close the points
    are: a great circle can be traversed the long way round. In a product, the handles in each factor must not be
    longer than the V of that factor.

    `certificate` holds at steps that are about five times as long as those of the theorem, on any knots, and for all
    ends except those with a velocity and an acceleration. It follows from a theorem of Newton and Kantorovich at the
    computed velocities. It does not exclude splines with other velocities, and in quotients holds for the
    representatives of the points that were given.

    The theorem needs D + 2V below the injectivity radius. Otherwise the nearest of several geodesics may change, as on
    tori, circles and projective spaces, and two splines with handles no longer than V may exist.

    References
    ----------
    G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
    Anal. 56 (2018), equations (13), (21), (22) and (38), Theorem 3.1.

    Examples
    --------
    >>> import symspline as ss
    >>> spline = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], ss.Sphere(2))
    >>> report = spline.report
    >>> report.method, report.converged, round(report.max_step, 4)
    ('quasi-newton', True, 1.5708)
    """

    method: str = field(metadata={"words": SOLVERS})
    converged: bool | NDArray[np.bool_] = field(metadata=BOOL)
    iterations: int | NDArray[np.int64] = field(metadata=INT)
    residual: Number = field(metadata=FLOAT)
    max_step: Number = field(metadata=FLOAT)
    max_gap: Number = field(metadata=FLOAT)
    curvature: float
    invariant_radius: Number | tuple[float, ...] | None = field(metadata=_MAYBE)
    rate: Number = field(metadata=FLOAT)
    alternative_energy: Number | None = field(default=None, metadata=_MAYBE)
    contraction_bound: Number | None = field(default=None, metadata=_MAYBE)
    guaranteed_sweeps: Number | None = field(default=None, metadata=_MAYBE)
    existence_radius: Number | tuple[float, ...] | None = field(default=None, metadata=_MAYBE)
    uniqueness_radius: Number | tuple[float, ...] | None = field(default=None, metadata=_MAYBE)
    skipped: tuple[str, ...] = ()

    @property
    def certificate(self) -> Certificate | None:
        """Proof that a C² spline exists near the computed velocities, and that no other one does.

        Returns
        -------
        Certificate or None
            Its numbers ``r`` and ``R`` are arrays for a batch, with NaN for curves without a certificate, and have one
            value per factor for a product, as `invariant_radius`. None if no curve has a certificate: steps are then
            too long, or the space has no metric.
        """
        if self.existence_radius is None or self.uniqueness_radius is None:
            return None
        return Certificate(self.existence_radius, self.uniqueness_radius)

    def __str__(self) -> str:
        converged = np.asarray(self.converged)
        if converged.size == 0:
            return f"no curves: {self.method}"
        residual, iterations = _worst(self.residual), np.max(self.iterations)
        if converged.ndim == 0:
            state = "converged" if converged else "NOT converged"
            many = ""
        else:
            state = f"{np.count_nonzero(converged)} of {converged.size} curves converged"
            many = "at most " if converged.size > 1 else ""
        worst = f" (curve {_place_of_worst(self.residual)})" if converged.size > 1 and np.isfinite(residual) else ""
        text = (
            f"{state}: {self.method}, {many}{iterations} iterations, residual {many}{residual:.1e}{worst}, "
            f"longest step {_worst(self.max_step):.3g}, contraction {_worst(self.rate):.2g}"
        )
        if self.invariant_radius is not None and not np.isnan(self.invariant_radius).any():
            radii = np.reshape(self.invariant_radius, (np.size(self.converged), -1)).max(axis=0)
            limits = " and ".join(f"{radius:.3g}" for radius in radii)
            text += f", control handles stay below {limits} (Theorem 3.1)"
        return text

    def __repr__(self) -> str:
        if np.ndim(self.converged):
            # The fields of a batch are long arrays.
            return f"<Report of {np.size(self.converged)} curves: {self}>"
        return f"Report({', '.join(f'{entry.name}={getattr(self, entry.name)!r}' for entry in fields(self))})"

    def _replaced(self, columns: Keywords) -> Self:
        """Replace fields; those of one curve are None instead of NaN, and its number of sweeps is an integer."""
        for name in OPTIONAL:
            if np.ndim(columns[name]) == 0 and columns[name] is not None and np.isnan(columns[name]):
                columns[name] = None
        columns["guaranteed_sweeps"] = _count(columns["guaranteed_sweeps"])
        return replace(self, **columns)


def _worst(values: Any) -> Any:
    """Return the largest value, without those of failed curves, which are NaN."""
    return np.fmax.reduce(np.ravel(values))


def _place_of_worst(values: Any) -> str:
    """Return the index of the largest value in the batch."""
    index = np.unravel_index(np.nanargmax(values), np.shape(values))
    return ", ".join(str(i) for i in index)


# The rows of the two tables of the compiled core.
INTEGERS = ("converged", "iterations", "solver", "skipped")
NUMBERS = (
    *("residual", "max_step", "rate", "invariant_radius", "contraction_bound"),
    *("guaranteed_sweeps", "alternative_energy", "existence_radius", "uniqueness_radius"),
)
OPTIONAL = tuple(entry.name for entry in fields(Report) if entry.metadata.get("optional"))
MAX_STEP = NUMBERS.index("max_step")


class Columns(NamedTuple):
    """Fields of reports as two tables with one row per field and one column per curve.

    Attributes
    ----------
    integers : ndarray, shape (len(INTEGERS), curves)
        Rows in the order of `INTEGERS`. ``"solver"`` is an index into `SOLVERS`, ``"skipped"`` a set of bits.
    numbers : ndarray, shape (len(NUMBERS), curves)
        Rows in the order of `NUMBERS`.
    """

    integers: NDArray[np.int64]
    numbers: NDArray[np.float64]

    def row(self, name: str) -> Array:
        """Return the values of a field, one per curve, as a writable view."""
        is_integer = name in INTEGERS
        return np.asarray(self.integers[INTEGERS.index(name)] if is_integer else self.numbers[NUMBERS.index(name)])

    def part(self, curves: BatchIndex) -> Columns:
        """Return the columns of some curves."""
        return Columns(self.integers[:, curves], self.numbers[:, curves])

    def put(self, curves: Any, other: Columns) -> None:
        """Replace the columns of some curves."""
        self.integers[:, curves], self.numbers[:, curves] = other

    @staticmethod
    def empty(count: int) -> Columns:
        """Return columns for curves that were not fitted."""
        return Columns(np.zeros((len(INTEGERS), count), np.int64), np.full((len(NUMBERS), count), np.nan))


def combined(reports: Sequence[Report], max_step: Any, curvature: float, alternative_energy: Any = None) -> Report:
    """Combine the reports of the factors into the report of a product.

    Most fields are the worst of the factors; the arguments are fields of the whole product.
    """

    def largest(name: str) -> Any:
        result: Array = np.max(np.stack([getattr(report, name) for report in reports]), axis=0)
        return result.item() if result.ndim == 0 else result

    def of_all(name: str, whole: Any) -> Any:
        # Theorem 3.1 applies to each factor separately, and to the product only if it applies to all of them.
        values = [getattr(report, name) for report in reports]
        return None if any(one is None for one in values) else whole(np.stack(values))[()]

    converged: Any = np.all(np.stack([np.asarray(report.converged) for report in reports]), axis=0)
    skipped = {name for report in reports for name in report.skipped}
    return Report(
        method=max((report.method for report in reports), key=SOLVERS.index),
        converged=bool(converged) if np.ndim(converged) == 0 else converged,
        iterations=largest("iterations"),
        residual=largest("residual"),
        max_step=max_step,
        max_gap=largest("max_gap"),
        curvature=curvature,
        invariant_radius=_per_factor(of_all("invariant_radius", np.array)),
        rate=largest("rate"),
        alternative_energy=alternative_energy,
        contraction_bound=of_all("contraction_bound", lambda bounds: np.max(bounds, axis=0)),
        guaranteed_sweeps=_count(of_all("guaranteed_sweeps", lambda bounds: np.max(bounds, axis=0))),
        existence_radius=_per_factor(of_all("existence_radius", np.array)),
        uniqueness_radius=_per_factor(of_all("uniqueness_radius", np.array)),
        skipped=tuple(name for name in SOLVERS if name in skipped),
    )


def _per_factor(values: Any) -> Any:
    """Return one value per factor along the last axis; a tuple for a single curve."""
    if values is None:
        return None
    last = np.moveaxis(values, 0, -1)
    # A curve of a batch has the certificate only if every factor has it.
    last = np.where(np.isnan(last).any(axis=-1, keepdims=True), np.nan, last)
    return tuple(last.tolist()) if last.ndim == 1 else last


def long_gaps(times: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which steps between the knots of one curve are far longer than most.

    The longest of n random steps, those of a Poisson process, is about log2(n) times the median; twice as long a one
    has the probability 1/n.
    """
    steps = np.diff(times)
    return np.asarray(steps > max(_LONG, 2 * np.log2(max(len(steps), 1))) * np.median(steps))


def shaped(columns: Columns, times: NDArray[np.float64], batch: tuple[int, ...], space: Any, method: str) -> Report:
    """Return the report of curves with these knots from its columns; `method` is the requested one."""
    rows = zip((*INTEGERS, *NUMBERS), (*columns.integers, *columns.numbers), strict=True)
    values: Keywords = {name: row.reshape(batch) for name, row in rows}
    _certify(values, space.injectivity_radius)
    if method == "auto" and times.shape[-1] > _WHOLE + 1:
        values["skipped"] = values["skipped"] | _unsearched(values, space.injectivity_radius)
    values["converged"] = values["converged"].astype(bool)
    solvers, skipped = values.pop("solver"), int(np.bitwise_or.reduce(values.pop("skipped"), axis=None))
    used = SOLVERS[solvers.max()] if solvers.size else "quasi-newton" if method == "auto" else method
    if not batch:
        values = {name: value.item() for name, value in values.items()}
    for name in OPTIONAL:
        if np.isnan(values[name]).all():
            values[name] = None
    values["guaranteed_sweeps"] = _count(values["guaranteed_sweeps"])
    # Times that were not checked may be infinite.
    with np.errstate(all="ignore"):
        gap = np.max(np.diff(times), axis=-1)
    max_gap = np.broadcast_to(gap, batch).copy() if batch else float(gap)
    return Report(used, max_gap=max_gap, curvature=space.curvature, skipped=_skipped(skipped), **values)


def _unsearched(values: Keywords, injectivity_radius: float) -> NDArray[np.int64]:
    """Return the solvers of the search for the minimum-energy solution that a curve in sections did not run, as bits.

    The conditions are those of `far_apart` in `fit/minimum_energy.rs`.
    """
    part = values["max_step"] / injectivity_radius
    far = (part > _FAR) | ((part > _HALF_WAY) & (values["iterations"] >= _SLOW))
    search = sum(1 << i for i, name in enumerate(SOLVERS) if name != "quasi-newton")
    return np.where(far & values["converged"], search & ~(1 << values["solver"]), 0)


def _certify(values: Keywords, injectivity_radius: float) -> None:
    """Drop the numbers of Theorem 3.1 where shortest geodesics in its region may not be unique.

    By (37) the logarithms of the C² condition have lengths up to D + 2V. Beyond the injectivity radius they jump, and
    the bounds of the compiled core, which come from the curvature alone, do not hold.
    """
    with np.errstate(invalid="ignore"):
        known = values["max_step"] + 2 * values["invariant_radius"] < injectivity_radius
    for name in ("invariant_radius", "contraction_bound", "guaranteed_sweeps"):
        values[name] = np.where(known, values[name], np.nan)


def _count(value: Any) -> Any:
    """Return an integer for one curve. Arrays may hold NaN and stay floats."""
    return value if value is None or np.ndim(value) else int(value)


def _skipped(bits: int) -> tuple[str, ...]:
    return tuple(name for i, name in enumerate(SOLVERS) if bits >> i & 1) if bits else ()


@dataclass(frozen=True, eq=False)
class CumulativeReport(FitReport):
    """Report of a least-squares fit of a `CumulativeBSpline`.

    For a batch of curves, every field is an array with the batch axes.

    Attributes
    ----------
    converged : bool or ndarray of bool
        Whether the last step was below the tolerance, or at the level of rounding errors.
    iterations : int or ndarray of int
        Number of Gauss–Newton steps. For a product, the largest number of its factors.
    step : float or ndarray
        Last step of a control point, relative to the longest step between control points.
    residual_sum : float or ndarray
        Weighted sum of the squared distances between the curve and the data.

    See Also
    --------
    CumulativeBSpline.fit : Fit a cumulative B-spline by least squares.

    Examples
    --------
    >>> import symspline as ss
    >>> curve = ss.CumulativeBSpline.fit(None, [[0.0], [1.0], [4.0], [9.0], [16.0]], 2, "r:1")
    >>> curve.report.converged, round(curve.report.residual_sum, 12)
    (True, 0.0)
    """

    converged: bool | NDArray[np.bool_] = field(metadata=BOOL)
    iterations: int | NDArray[np.int64] = field(metadata=INT)
    step: Number = field(metadata=FLOAT)
    residual_sum: Number = field(metadata=FLOAT)

    def _replaced(self, columns: Keywords) -> Self:
        return replace(self, **{name: x if np.ndim(x) else x.item() for name, x in columns.items()})
