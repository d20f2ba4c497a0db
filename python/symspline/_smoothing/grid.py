"""Smoothing of noisy points on a grid."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, Generic, NamedTuple, Self

import numpy as np

from .._base.arrays import as_array, checked_atol, checked_number, one_of, refuse
from .._base.faults import warn
from .._base.report import ConvergenceWarning
from .._base.typing import (
    Extrapolate,
    FloatArray,
    GridCriterion,
    Numbers,
    OnFailure,
    P,
    PointsLike,
    Progress,
    SmoothingWord,
    TimesLike,
)
from .._core import ConvergenceError, ValidationError
from .._curves.options import check_on_failure, check_progress, checked_extrapolate
from .._grid import GridReport, GridSpline
from .._grid.axes import GridAxis, read_axes, read_nodes, validate_nodes
from .._spaces import Array, Doubles, Product, Space, cover_of, factors_of, space_named
from .._splines.archive import Entries, entry, read_array, suffix_of
from ..manifolds._manifold import refuse_functions
from .audit import warn_of_spread
from .grid_rows import LamCriterion, Nodes, SmoothedAxis, SmoothedNodes, noise_level, smooth_axes
from .noise import grouped, is_several, join, per_part, smoothed_spaces, split
from .report import SmoothingWarning

# Ratio of the degrees of freedom to the number of data from which rows follow nearly all data.
_ALL = 0.9
# A jump is a step between neighbouring nodes that is longer than the first number of median steps along the axis, and
# than the second number of times the steps before and after it. Noise and outliers cause no jumps, because the steps
# next to a long step are long as well.
_MEDIANS, _BESIDE = 8.0, 4.0
# Least number of jumps, as a fraction of the number of nodes along a side of the map.
_SHARE = 0.3
# A number for each axis, or for products and poses a tuple with one number per part.
PerAxis = tuple[float | tuple[float, ...], ...]


class SmoothedPart(NamedTuple):
    """Properties of the smoothing in one part of the space.

    Attributes
    ----------
    axes : list of SmoothedAxis
        Properties along every axis.
    variance : ndarray, shape (n_1, ..., n_D)
        Posterior variance at the nodes for noise of variance one.
    df : float
        Effective degrees of freedom of the surface per coordinate.
    sigma : float
        Standard deviation of the noise, given or estimated.
    """

    axes: list[SmoothedAxis]
    variance: Doubles
    df: float
    sigma: float


class SmoothingGridReport(GridReport):
    """Report of a `SmoothingGrid`: that of a `GridSpline`, and properties of the smoothing.

    Properties of the smoothing are tuples with one entry per axis, in the order in which the axes were smoothed. For a
    `Product`, and for poses, each entry is a tuple with one number per factor or part.

    See Also
    --------
    SmoothingGrid.report : The report of a grid.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> u, v = np.linspace(0, 1, 20), np.linspace(0, 1, 30)
    >>> noisy = np.sin(3 * u[:, None] + v) + 0.1 * np.random.default_rng(0).standard_normal((20, 30))
    >>> report = ss.make_smoothing_grid((u, v), noisy[..., None], "r:1").report
    >>> report.converged, report.at_bound, round(report.sigma[0], 1)
    (True, (False, False), 0.1)
    """

    _space: Space[Any]
    _smoothed: list[SmoothedPart]

    @property
    def converged(self) -> bool:
        """Whether the smoothing of all rows converged, and the splines along the first axis."""
        return super().converged and not any(own.failed for part in self._smoothed for own in part.axes)

    @property
    def lam(self) -> PerAxis:
        """Weight λ of the bending energy."""
        return self._per_axis(lambda own, _: own.lam)

    @property
    def at_bound(self) -> PerAxis:
        """Whether the chosen λ is at a bound: rows are geodesics, or pass through nearly all nodes."""
        return self._per_axis(lambda own, _: own.at_bound)

    @property
    def evaluations(self) -> PerAxis:
        """Number of values of λ that were tried; 0 if λ was given."""
        return self._per_axis(lambda own, _: own.evaluations)

    @property
    def df(self) -> PerAxis:
        """Effective degrees of freedom per coordinate, summed over all rows along the axis."""
        return self._per_axis(lambda own, _: own.df)

    @property
    def rss(self) -> PerAxis:
        """Weighted sum of squared distances between the nodes before and after the axis was smoothed."""
        return self._per_axis(lambda own, _: own.rss)

    @property
    def sigma(self) -> PerAxis:
        """Standard deviation of the noise in one coordinate, estimated from the rows along the axis.

        Along the first axis it is that of the data. Along others it is that of nodes that are already smooth along the
        axes before.
        """
        return self._per_axis(lambda own, dim: own.sigma(dim))

    @property
    def iterations(self) -> PerAxis:
        """Largest number of iterations of a row."""
        return self._per_axis(lambda own, _: own.iterations)

    def _per_axis(self, value: Callable[[SmoothedAxis, int], float]) -> PerAxis:
        dims = [space.dim for space in smoothed_spaces(self._space)]
        of_parts = [[value(own, dim) for own in part.axes] for part, dim in zip(self._smoothed, dims, strict=True)]
        each = zip(*of_parts, strict=True)
        return tuple(values if is_several(self._space) else values[0] for values in each)


class SmoothingGrid(GridSpline[P], Generic[P]):
    """A C² surface close to noisy points on a grid.

    `make_smoothing_grid` returns objects of this class; it has no public constructor. All methods of `GridSpline` are
    available. `points` are those of the smooth surface at the nodes. Files keep the data.

    For a `Product`, and for poses, `df`, `sigma` and `std` are tuples with one entry per factor or part.

    See Also
    --------
    make_smoothing_grid : Fit a surface close to noisy points on a grid.
    SmoothingGridReport : Report of the smoothing.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> u, v = np.linspace(0, 1, 20), np.linspace(0, 1, 30)
    >>> noisy = np.sin(3 * u[:, None] + v) + 0.1 * np.random.default_rng(0).standard_normal((20, 30))
    >>> ss.make_smoothing_grid((u, v), noisy[..., None], "r:1")
    <SmoothingGrid on Euclidean(1): 20 x 30 nodes>
    """

    _format = "symspline-smoothing-grid"
    _kind = "Smoothing grid"
    _data: list[Array]
    _weights: Doubles
    _smoothed: list[SmoothedPart]

    def __init__(self) -> None:
        raise TypeError("SmoothingGrid has no public constructor. Use symspline.make_smoothing_grid.")

    @classmethod
    def _through(
        cls,
        axes: Any,
        points: Any,
        space: Any,
        data: list[Array],
        weights: Doubles,
        smoothed: list[SmoothedPart],
        options: dict[str, Any],
    ) -> Self:
        """Return the grid through smooth points."""
        self = cls.__new__(cls)
        self._data, self._weights, self._smoothed = data, weights, smoothed
        GridSpline.__init__(self, axes, points, space, **options)
        return self

    @cached_property
    def report(self) -> SmoothingGridReport:
        """Report of the grid and of the smoothing.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> noisy = np.random.default_rng(0).standard_normal((8, 9, 1))
        >>> ss.make_smoothing_grid((None, None), noisy, "r:1", lam=2.0).report.lam
        (2.0, 2.0)
        """
        report = SmoothingGridReport._of(self._axes, self._factors)
        report._space, report._smoothed = self._space, self._smoothed
        return report

    @property
    def lam(self) -> PerAxis:
        """Weight λ of the bending energy along each axis.

        For products and poses each entry is a tuple with one number per part. `make_smoothing_grid` accepts this value
        as its argument `lam`.
        """
        return self.report.lam

    @property
    def df(self) -> float | tuple[float, ...]:
        """Effective degrees of freedom of the surface per coordinate."""
        df: float | tuple[float, ...] = self._each([part.df for part in self._smoothed])
        return df

    @property
    def sigma(self) -> float | tuple[float, ...]:
        """Standard deviation of the noise of the data in one coordinate, for weight one.

        This is the given value, or else the estimate ``sqrt(sum(weights * distance**2) / (dim * (N - df)))`` with the
        distances of the N data from the surface.
        """
        sigma: float | tuple[float, ...] = self._each([part.sigma for part in self._smoothed])
        return sigma

    @property
    def data(self) -> P:
        """Points that were smoothed, shape (n_1, ..., n_D, *point_shape); NaN where they are missing."""
        data: P = self._joined(self._data)
        return data

    @property
    def residuals(self) -> P:
        """Tangent vectors from the surface to the data at the nodes, shape (n_1, ..., n_D, *point_shape).

        They are logarithms at the surface, and their lengths are the distances. They are NaN at nodes without data.
        """
        found = []
        for factor, data in zip(self._factors, self._data, strict=True):
            used = (self._weights > 0) & factor.space._where_finite(factor.points)
            vectors = np.full(data.shape, np.nan, data.dtype)
            vectors[used] = factor.space._apply("log", p=factor.points[used], q=data[used])
            found.append(vectors)
        residuals: P = self._joined(found)
        return residuals

    def std(self) -> FloatArray | tuple[FloatArray, ...]:
        r"""Compute the standard deviation of the surface at its nodes, in one coordinate of an orthonormal frame.

        Returns
        -------
        ndarray or tuple, shape (n_1, ..., n_D)
            Standard deviations, for products and poses a tuple with one entry per part. NaN where the surface has no
            point.

        See Also
        --------
        SmoothingGrid.sigma : The standard deviation of the noise.

        Notes
        -----
        With equal weights and without missing nodes, the posterior variance of a node is
        :math:`\sigma^2 \prod_k (S_k)_{i_k i_k} / w` with the smoothing matrices :math:`S_k` of the axes. Otherwise it
        follows from the variances along the last axis, whose weights there are those of nodes that are smooth along the
        other axes; correlations between these nodes are not taken into account.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u, v = np.linspace(0, 1, 20), np.linspace(0, 1, 30)
        >>> noisy = np.sin(3 * u[:, None] + v) + 0.1 * np.random.default_rng(0).standard_normal((20, 30))
        >>> std = ss.make_smoothing_grid((u, v), noisy[..., None], "r:1").std()
        >>> bool(std[10, 15] < std[0, 15] < std[0, 0] < 0.1)
        True
        """
        each = [part.sigma * np.sqrt(part.variance) for part in self._smoothed]
        std: FloatArray | tuple[FloatArray, ...] = self._each(each)
        return std

    def _each(self, values: list[Any]) -> Any:
        return tuple(values) if is_several(self._space) else values[0]

    # ---- files and pickles ----

    def _state(self) -> dict[str, Any]:
        state = super()._state()
        state["noise"] = [
            {"axes": [vars(own) for own in part.axes], "df": part.df, "sigma": part.sigma} for part in self._smoothed
        ]
        state["data_weights"] = self._weights
        state |= {"data" + suffix_of(self._space, i): own for i, own in enumerate(self._data)}
        return state | {f"variance_{i}": part.variance for i, part in enumerate(self._smoothed)}

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        self = super()._from_state(state)
        grid = tuple(len(axis.knots) for axis in self._axes)
        self._data = [
            read_array(state, "data" + suffix_of(self._space, i), own) for i, own in enumerate(factors_of(self._space))
        ]
        for own, factor in zip(self._data, self._factors, strict=True):
            if own.shape != factor.points.shape:
                raise ValidationError(f"entry 'data': the data have shape {own.shape}")
        self._weights = _numbers(state, "data_weights", grid)
        with entry("noise"):
            noise = state["noise"]
            if len(noise) != len(smoothed_spaces(self._space)):
                raise ValidationError("it must have one entry per part of the space")
            self._smoothed = []
            for i, part in enumerate(noise):
                axes = [SmoothedAxis(**own) for own in part["axes"]]
                if len(axes) != len(grid):
                    raise ValidationError(f"there are {len(axes)} axes")
                variance = _numbers(state, f"variance_{i}", grid)
                self._smoothed.append(SmoothedPart(axes, variance, float(part["df"]), float(part["sigma"])))
        return self


def _numbers(state: Entries, name: str, shape: tuple[int, ...]) -> Doubles:
    """Return an array of numbers from a file."""
    array: Doubles = state[name]
    with entry(name):
        if array.dtype != np.float64 or array.shape != shape:
            raise ValidationError(f"it is {array.dtype} of shape {array.shape}, but must have shape {shape}")
    return array


def make_smoothing_grid(
    axes: Sequence[TimesLike | None],
    points: PointsLike,
    space: Space[P] | str,
    *,
    lam: Numbers | Sequence[Any] | None = None,
    weights: Numbers | None = None,
    criterion: GridCriterion = "gcv",
    gamma: float = 1.0,
    sigma: Numbers | None = None,
    bc_type: SmoothingWord | Sequence[SmoothingWord | tuple[SmoothingWord, SmoothingWord]] = "natural",
    extrapolate: Extrapolate = None,
    on_failure: OnFailure = "raise",
    atol: float | None = None,
    progress: Progress | None = None,
) -> SmoothingGrid[P]:
    r"""Fit a C² surface close to noisy points on a grid.

    The rows along the first axis are smoothed, then the rows of the smooth points along the second axis, and so on.
    All rows along an axis have the same λ, which the data determine unless `lam` is given. On a Euclidean space the
    result is the tensor-product smoothing spline.

    Parameters
    ----------
    axes : sequence of array_like
        Coordinates of the nodes along each axis, strictly increasing numbers or dates. None means 0, 1, ...,
        n - 1.
    points : array_like, shape (n_1, ..., n_D, *space.point_shape)
        Noisy points at the nodes. For a `Product`, a tuple with one array per factor. Nodes that are NaN or masked are
        missing. They are filled between the data of a row, and remain NaN outside; see Notes.
    space : Space or str
        A space or its name. Points of `SpecialEuclidean` are smoothed as rotations and positions.
    lam : float or sequence, optional
        Weight λ ≥ 0 of the bending energy, in units of weight · length³ of the axis (seconds for dates): one number for
        all axes, or a sequence with one entry per axis. Entries that are None are chosen by `criterion`. For products
        and poses an entry can be a tuple with one number per part.
    weights : array_like, shape (n_1, ..., n_D), optional
        Weights ≥ 0 of the nodes: the inverse variances of their noise up to a common factor. Nodes of weight 0 are
        missing.
    criterion : {"gcv", "cp"}, default "gcv"
        Criterion for λ: generalised cross-validation, or Mallows' C_p, which requires `sigma`.
    gamma : float, default 1.0
        Weight of a degree of freedom in ``"gcv"``, at least 1. A value of 1.2 is safer for grids of fewer than about
        100 nodes, where the surface occasionally passes through all data. On larger grids it smooths too much, and
        standard deviations are then too small.
    sigma : float or tuple, optional
        Standard deviation of the noise in one coordinate for weight one, as a length in the space: radians on the unit
        sphere. For products and poses a tuple with one number per part.
    bc_type : {"natural", "clamped", "periodic"} or sequence, default "natural"
        End conditions for all axes, or a sequence with one entry per axis, each of these or a pair for the start and
        the end. The last nodes along a periodic axis belong to the same points of the surface as the first ones. They
        can be further data, NaN, or copies of the first nodes, which count once.
    extrapolate, on_failure, atol : optional
        As for `GridSpline`.
    progress : callable, optional
        Function that is called after each pass over the grid with the finished and the total number of nodes.

    Returns
    -------
    SmoothingGrid
        A `GridSpline` through the smooth points, with λ, the noise level and standard deviations.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.
    CutLocusError
        If neighbouring points of the surface are at or past each other's cut locus.
    ConvergenceError
        If the smoothing of a row does not converge. The attribute ``spline`` holds the surface.

    Warns
    -----
    SmoothingWarning
        If a chosen λ is at a bound: the rows follow nearly all data, or have no bending energy. If many neighbouring
        nodes are far apart compared with the nodes beside them, as at the boundary of two grains.
    ConvergenceWarning
        If a row fails and `on_failure` is ``"warn"``.
    UserWarning
        If the data are about as far from the surface as random points of a compact space would be.

    See Also
    --------
    GridSpline : Interpolate points on a grid.
    make_smoothing_spline : Fit a curve close to noisy points.

    Notes
    -----
    Let :math:`K_k` be the matrix of the bending energy of the natural spline through the nodes of axis k. On a
    Euclidean space with equal weights w, the points at the nodes are

    .. math:: (1 + \lambda_1 K_1 / w)^{-1} \otimes (1 + \lambda_2 K_2 / w)^{-1} \otimes \dots

    times the data. The natural spline through them is the minimiser of a sum of squares and penalties. On other spaces
    the order of the axes matters, but little for smooth data.

    The criterion for λ is that of the surface: it contains the distances of all data from the surface, and the degrees
    of freedom of the surface. It is minimised along one axis after the other, in two rounds. In grids of more than
    20 000 nodes, rows with about this many nodes in total, which are distributed evenly, determine each λ.

    Missing nodes have weight zero. After the pass along an axis, the row fills the nodes between its first and its last
    datum. The weights of the next pass are the inverse variances that the nodes then have, in units of those in a
    complete row: filled nodes, and nodes beside gaps, count less. A row with a single datum keeps it.

    References
    ----------
    P. Craven, G. Wahba, Smoothing noisy data with spline functions, Numer. Math. 31 (1979).

    L. Xiao, Y. Li, D. Ruppert, Fast bivariate P-splines: the sandwich smoother, J. R. Stat. Soc. B 75 (2013).

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> u, v = np.linspace(0, 1, 20), np.linspace(0, 1, 30)
    >>> turns = np.stack(np.broadcast_arrays(np.sin(2 * u)[:, None], u[:, None] * v, v), axis=-1)
    >>> truth, space = ss.rotations.from_rotation_vectors(turns), ss.space("so:3")
    >>> noisy = space.exp(truth, 0.02 * space.random_tangent(np.random.default_rng(0), truth))
    >>> surface = ss.make_smoothing_grid((u, v), noisy, space)
    >>> bool(space.distance(surface.points, truth).max() < 0.02), round(surface.sigma, 2)
    (True, 0.02)
    """
    space = space_named(space)
    refuse_functions(space, "smoothing grids are not made")
    checked_extrapolate(extrapolate)
    check_on_failure(on_failure)
    check_progress(progress)
    chosen_by = one_of(criterion, "criterion", "gcv", "cp")
    if chosen_by == "cp" and sigma is None:
        raise ValidationError("criterion='cp' needs the standard deviation of the noise. Pass sigma.")
    gamma = checked_number(gamma, "gamma must be a number >= 1", lambda x: 1 <= x < np.inf)
    if not isinstance(axes, (tuple, list)):
        read_axes(axes, None, bc_type)
    data, tols, shape = read_nodes(points, space, len(axes))
    own_axes = _checked_ends(read_axes(axes, shape, bc_type))
    w = _read_weights(weights, shape)
    for array in data:
        array[w == 0] = np.nan
    # Noisy data at both ends of a periodic axis may differ.
    validate_nodes(
        space,
        data,
        tols if atol is None else [checked_atol(atol)] * len(tols),
        [axis._replace(ends=("natural", "natural")) for axis in own_axes],
    )
    w = _without_copies(np.where(factors_of(space)[0]._where_finite(data[0]), w, 0.0), data, own_axes)
    lams, sigmas = _lams(lam, len(shape), space), _in_parts(sigma, "sigma", space)

    bc_types = tuple(axis.bc_type for axis in own_axes)
    # Representatives in quotients are continuous over the grid, so that they are smoothed in the covering space.
    spaces = tuple(map(cover_of, smoothed_spaces(space)))
    arrays = [own for pair in zip(factors_of(space), data, strict=True) for own in split(*pair)]
    size, found = int(np.prod(shape)), []
    for i, (part, array) in enumerate(zip(spaces, arrays, strict=True)):

        def advance(done: int, total: int, i: int = i) -> None:
            if progress is not None:
                progress((i * total + done) * size, len(spaces) * total * size)

        used = np.where((w > 0).reshape(*shape, *[1] * len(part.point_shape)), array, np.nan)
        nodes = Nodes(tuple(axis.knots for axis in own_axes), used, w, part, bc_types)
        rule = LamCriterion(1.0, sigmas[i]) if chosen_by == "cp" else LamCriterion(gamma, None)
        found.append(smooth_axes(nodes, lams[i], rule, advance))

    smoothed = [
        _summary(part, array, w, one, sigma)
        for part, array, one, sigma in zip(spaces, arrays, found, sigmas, strict=True)
    ]
    joined = [
        join(factor, rows)
        for factor, rows in zip(factors_of(space), grouped(space, [o.points for o in found]), strict=True)
    ]
    through: Any = tuple(joined) if isinstance(space, Product) else joined[0]
    options = {
        "bc_type": tuple(axis.bc_type for axis in own_axes),
        "extrapolate": extrapolate,
        "on_failure": on_failure,
    }
    surface: SmoothingGrid[P] = SmoothingGrid._through(tuple(axes), through, space, data, w, smoothed, options)
    _handle_failures(found, surface, on_failure)
    _warn_of_bounds(space, smoothed, lams)
    warn_of_boundaries(list(zip(spaces, arrays, strict=True)), w)
    for part, array, own, one in zip(spaces, arrays, found, smoothed, strict=True):
        rows = (own.points.reshape(-1, *part.point_shape), array.reshape(-1, *part.point_shape), np.ravel(w > 0))
        count = np.count_nonzero(rows[2] & part._where_finite(rows[0]))
        warn_of_spread(part, *rows, count, one.df, "surface")
    return surface


def _checked_ends(axes: list[GridAxis]) -> list[GridAxis]:
    for k, axis in enumerate(axes):
        if axis.ends is not None and "not-a-knot" in axis.ends:
            raise ValidationError(
                f"bc_type 'not-a-knot' of axis {k} is not available for smoothing grids. Use 'natural', 'clamped' or "
                "'periodic'."
            )
        if axis.is_periodic and len(axis.knots) < 4:
            raise ValidationError(f"axis {k} is periodic and needs at least 4 nodes, but has {len(axis.knots)}")
    return axes


def _read_weights(weights: Any, shape: tuple[int, ...]) -> Doubles:
    if weights is None:
        return np.ones(shape)
    array = as_array(weights, "weights")
    if array.shape != shape or array.dtype.kind not in "iufb":
        raise ValidationError(
            f"weights must be numbers of shape {shape}, one per node, not {array.dtype} of shape {array.shape}"
        )
    found = array.astype(np.float64)
    bad = ~(np.isfinite(found) & (found >= 0))
    refuse(bad, "weights", lambda i: f"is {found[i]}, but must be finite and >= 0. Use 0 for missing nodes.")
    return found


def _without_copies(weights: Doubles, data: list[Array], axes: list[GridAxis]) -> Doubles:
    """Return the weights without those of the last nodes of periodic axes that are copies of the first nodes."""
    for k, axis in enumerate(axes):
        if not axis.is_periodic:
            continue
        ends = [(np.take(own, 0, axis=k), np.take(own, -1, axis=k)) for own in (*data, weights)]
        if all(np.array_equal(first, last, equal_nan=True) for first, last in ends):
            np.moveaxis(weights, k, 0)[-1] = 0.0
    if not np.any(weights):
        raise ValidationError("all weights are 0. A surface needs at least one node with data.")
    return weights


def _lams(lam: Any, dims: int, space: Space[Any]) -> list[tuple[float | None, ...]]:
    """Return the given λ of every axis for each part of the space."""
    is_sequence = isinstance(lam, (tuple, list)) or (isinstance(lam, np.ndarray) and lam.ndim > 0)
    if is_sequence and len(lam) != dims:
        raise ValidationError(
            f"lam has {len(lam)} entries, but there are {dims} axes. Pass one number for all, or one entry for each."
        )
    each = [_in_parts(one, f"lam[{k}]", space) for k, one in enumerate(lam)] if is_sequence else None
    per_axis = each or [_in_parts(lam, "lam", space)] * dims
    return [tuple(None if np.isnan(x) else x for x in own) for own in zip(*per_axis, strict=True)]


def _in_parts(value: Any, name: str, space: Space[Any]) -> list[float]:
    """Return a number >= 0 for each part of the space; NaN for None."""
    return [float(one[0]) for one in per_part(space, value, name, ())]


def _summary(space: Space[Any], data: Array, weights: Doubles, found: SmoothedNodes, sigma: float) -> SmoothedPart:
    """Return the properties of the surface in one part of the space."""
    used = (weights > 0) & space._where_finite(found.points)
    distances = space._apply("distance", p=found.points[used], q=data[used])
    df = float(np.sum(weights[used] * found.variance[used]))
    rss = float(np.sum(weights[used] * distances**2))
    estimated = noise_level(rss, int(np.count_nonzero(used)), df, space.dim)
    return SmoothedPart(found.axes, found.variance, df, estimated if np.isnan(sigma) else sigma)


def _handle_failures(found: list[SmoothedNodes], surface: SmoothingGrid[Any], on_failure: str) -> None:
    """Raise an error or warn about rows that did not converge."""
    first = next((own.failed for own in found if own.failed), None)
    if first is None or on_failure == "ignore":
        return
    k, *others = first
    row = ", ".join(map(str, [*others[:k], ":", *others[k:]] if len(surface.axes) > 1 else [":"]))
    failed = sum(axis.failed for own in found for axis in own.axes)
    message = (
        f"No convergence of the smoothing along axis {k} in the row points[{row}]"
        + (f" (and in {failed - 1} more rows)" if failed > 1 else "")
        + ". Check units and signs of the data, or pass a larger lam."
    )
    if on_failure == "warn":
        warn(message, ConvergenceWarning)
        return
    error = ConvergenceError(message)
    error.spline = surface
    raise error


def _warn_of_bounds(space: Space[Any], smoothed: list[SmoothedPart], lams: list[tuple[float | None, ...]]) -> None:
    """Warn once if a chosen λ is at a bound, or close to it."""
    for i, (part, own, given) in enumerate(zip(smoothed_spaces(space), smoothed, lams, strict=True)):
        for k, axis in enumerate(own.axes):
            rough = axis.df > _ALL * axis.count
            if given[k] is not None or not axis.evaluations or not (axis.at_bound or rough):
                continue
            of = f" in part {i}, {part!r}," if is_several(space) else ""
            if rough:
                what = "a lam so small that rows follow nearly all nodes"
                advice = (
                    "The standard deviations are only valid if the data are that accurate. Correlated noise causes "
                    "this. Pass a larger gamma, sigma= with criterion='cp', or lam=."
                )
            else:
                what = "a lam so large that rows are geodesics"
                advice = (
                    "This is correct for data along geodesics. Otherwise the surface bends faster than the nodes "
                    "resolve, or less than their noise: plot the data, and pass lam= to set the smoothness."
                )
            warn(
                f"The smoothing{of} along axis {k} chose {what} ({axis.df:.3g} degrees of freedom for {axis.count} "
                f"nodes). {advice}",
                SmoothingWarning,
            )
            return


# ---- maps with boundaries, such as those between the grains of a crystal ----


def warn_of_boundaries(parts: list[tuple[Space[Any], Array]], weights: Doubles) -> None:
    """Warn once if many neighbouring nodes of a map are far apart compared with the nodes beside them.

    Parameters
    ----------
    parts : list
        Each space with its points, of shape (n_1, ..., n_D, *point_shape).
    weights : ndarray, shape (n_1, ..., n_D)
        Weights; nodes of weight zero do not count.
    """
    for space, points in parts:
        count, first = 0, None
        for k in range(weights.ndim):
            steps = _steps(space, points, weights, k)
            jumps = np.argwhere(_are_jumps(steps))
            count += len(jumps)
            if first is None and len(jumps):
                # Steps have their axis last.
                *others, i = jumps[0].tolist()
                nodes = [[*others[:k], j, *others[k:]] for j in (i, i + 1)]
                first = nodes, float(steps[tuple(jumps[0])]), float(np.nanmedian(steps))
        if first is None or count < _SHARE * weights.size ** (1 - 1 / weights.ndim):
            continue
        nodes, distance, usual = first
        warn(
            f"the map has a boundary that the smooth surface cannot follow: {count} pairs of neighbouring nodes are "
            f"far apart, for example points{nodes[0]} and points{nodes[1]}, whose distance is {distance:.2g}. The "
            f"median distance of neighbours is {usual:.2g}. If the map has regions such as grains, label them, and "
            "smooth each region with weights of zero at all other nodes.",
            SmoothingWarning,
        )
        return


def _steps(space: Space[Any], points: Array, weights: Doubles, k: int) -> Doubles:
    """Return the distances of neighbours along axis k, which becomes the last one; NaN where a node is missing."""
    axis = weights.ndim - 1
    there, rows = np.moveaxis(weights > 0, k, axis), np.moveaxis(points, k, axis)
    left, right = (np.take(rows, range(i, rows.shape[axis] - 1 + i), axis) for i in (0, 1))
    good = there[..., :-1] & there[..., 1:] & space._where_finite(left) & space._where_finite(right)
    steps = np.full(good.shape, np.nan)
    if good.any():
        steps[good] = space._apply("distance", p=left[good], q=right[good])
    return steps


def _are_jumps(steps: Doubles) -> Any:
    """Return a mask of the steps that are much longer than the median step and than the steps next to them."""
    if steps.shape[-1] < 4 or not np.isfinite(steps).any():
        return np.zeros(steps.shape, bool)
    known = np.nan_to_num(steps, nan=0.0)
    # The first and the last step may be long because of an outlier at the end.
    beside = np.full(steps.shape, np.inf)
    beside[..., 1:-1] = np.maximum(known[..., :-2], known[..., 2:])
    return (known > _MEDIANS * np.nanmedian(steps)) & (known > _BESIDE * beside)
