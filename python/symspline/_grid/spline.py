"""C² interpolation of points on a grid."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import checked_atol, checked_flag, short_repr, whole_number
from .._base.typing import (
    Array,
    Extrapolate,
    File,
    GridAxesLook,
    GridLook,
    OnFailure,
    P,
    PointsLike,
    Progress,
    State,
    TimesLike,
)
from .._core import ValidationError
from .._curves.derivatives import read_cotangent
from .._curves.failures import raise_or_warn
from .._curves.options import check_on_failure, check_policies, check_progress, checked_extrapolate, require_matplotlib
from .._spaces import AnySpace, Product, Space, cover_of, factors_of, parts_of, product_norm, space_named
from .._splines.archive import (
    FORMATS,
    Entries,
    entry,
    head_of,
    read_array,
    read_space,
    read_times,
    restore,
    suffix_of,
    times_state,
    write,
)
from .._splines.cubic import CubicSpline
from .axes import GridAxis, Sites, check_steps, coordinates, read_axes, read_nodes, sites_of, validate_nodes
from .evaluation import CompiledGrid, FactorGrid, Outcome, orders_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class GridSpline(Generic[P]):
    r"""Interpolate points on a grid by a C² spline in every parameter.

    The value at :math:`(x_1, \dots, x_D)` is computed axis after axis: a `CubicSpline` along the first axis through
    every row of nodes is evaluated at :math:`x_1`, then a spline along the second axis through these points is
    evaluated at :math:`x_2`, and so on. On a Euclidean space the result is the tensor-product spline.

    Parameters
    ----------
    axes : sequence of array_like
        Knots of each axis, strictly increasing numbers or dates. None means 0, 1, ..., n - 1.
    points : array_like, shape (n_1, ..., n_D, *point_shape)
        Points at the nodes. For a `Product`, a tuple with one array per factor. Nodes that are NaN or masked are
        missing: they divide a row into runs with a spline each, and values whose row has no run there are NaN.
    space : Space or str
        A space or its name, such as ``SpecialOrthogonal(3)`` or ``"so:3"``.
    bc_type : str or sequence, default "not-a-knot"
        End conditions: ``"not-a-knot"``, ``"natural"``, ``"clamped"`` (zero velocity) or ``"periodic"`` for all axes,
        or a sequence with one entry per axis, each of these or a pair of conditions for the start and the end. The
        last nodes of a periodic axis repeat the first ones. Beside missing nodes, runs end naturally on natural axes,
        and with not-a-knot otherwise.
    symmetric : bool, default False
        Whether to evaluate the midpoint between the given and the reverse order of axes, so that reversing the axes
        changes nothing. Values then cost twice as much.
    extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
        Extrapolation policy as in `CubicSpline`, for all axes. None raises, except along periodic axes, which repeat.
    on_failure : {"raise", "warn", "ignore"}, default "raise"
        Action if a spline does not converge or meets a cut locus, here or in an evaluation. With ``"warn"`` and
        ``"ignore"`` the values that depend on a row at its cut locus are NaN.
    check : bool, default True
        Whether to validate the points. If False, they are not projected either.
    atol : float, optional
        Largest distance of a point from the manifold. By default, the accuracy of the points determines it, as for
        `CubicSpline`.
    progress : callable, optional
        Function that is called from time to time with the finished and the total number of nodes.

    Raises
    ------
    ValidationError
        If the input does not meet the requirements above.
    CutLocusError
        If two neighbouring nodes are not joined by a unique shortest geodesic.
    ConvergenceError
        If a spline along the first axis does not converge. Its attribute ``spline`` holds the grid.

    Warns
    -----
    FarPointsWarning
        If more than half of the steps along an axis exceed 0.6 of the distance to the cut locus.
    ConvergenceWarning
        If a spline fails and `on_failure` is ``"warn"``.

    See Also
    --------
    CubicSpline : Interpolate points along one axis.

    Notes
    -----
    The result passes through the points, and is twice continuously differentiable as a composition of C² maps. For
    smooth data its error is of order 4 in the spacing. Exchanging the axes changes it with order 8, see
    `GridReport.axis_order_gap`.

    At scattered coordinates, the splines along all axes but the first use the 24 nodes on either side: the influence
    of a node decays by a factor of 0.27 per node, and :math:`0.27^{24} = 2 \cdot 10^{-14}`.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> u, v = np.linspace(0, 1, 11), np.linspace(0, 1, 9)
    >>> turns = np.stack(np.broadcast_arrays(u[:, None], u[:, None] * v, v), axis=-1)
    >>> grid = ss.GridSpline((u, v), ss.rotations.from_rotation_vectors(turns), "so:3")
    >>> ss.rotations.as_rotation_vectors(grid((0.33, 0.47))).round(4)
    array([0.33  , 0.1551, 0.47  ])
    >>> grid.grid(np.linspace(0, 1, 5), [0.1, 0.2]).shape
    (5, 2, 3, 3)
    """

    _format: ClassVar[str] = "symspline-grid"
    _kind: ClassVar[str] = "C² grid"
    _axes: list[GridAxis]
    _factors: list[FactorGrid]
    _symmetric: bool
    _extrapolate: Extrapolate
    _on_failure: OnFailure
    # A grid is a single function.
    _batch: ClassVar[tuple[int, ...]] = ()

    def __init_subclass__(cls) -> None:
        FORMATS[cls._format] = cls

    def __init__(
        self,
        axes: Sequence[TimesLike | None],
        points: PointsLike,
        space: Space[P] | str,
        *,
        bc_type: str | Sequence[str | tuple[str, str]] = "not-a-knot",
        symmetric: bool = False,
        extrapolate: Extrapolate = None,
        on_failure: OnFailure = "raise",
        check: bool = True,
        atol: float | None = None,
        progress: Progress | None = None,
    ) -> None:
        self._space: AnySpace = space_named(space)
        self._symmetric = checked_flag(symmetric, "symmetric")
        check_policies(extrapolate, on_failure, progress)
        self._extrapolate, self._on_failure = extrapolate, on_failure
        if not isinstance(axes, (tuple, list)):
            read_axes(axes, None, bc_type)
        arrays, tols, shape = read_nodes(points, self._space, len(axes))
        self._axes = read_axes(axes, shape, bc_type)
        if checked_flag(check, "check"):
            validate_nodes(self._space, arrays, tols if atol is None else [checked_atol(atol)] * len(tols), self._axes)
            check_steps(self._space, arrays, len(shape), on_failure == "raise")
        self._fill(arrays, None, progress)
        self._handle(self.report._outcome, "the nodes")

    def _fill(
        self, arrays: list[Array], velocities: list[Array | None] | None, progress: Progress | None = None
    ) -> None:
        given: list[Array | None] = velocities or [None] * len(arrays)
        self._factors = [
            FactorGrid(cover_of(factor), self._axes, points, self._symmetric, vectors, progress)
            for factor, points, vectors in zip(factors_of(self._space), arrays, given, strict=True)
        ]
        for array in arrays:
            array.flags.writeable = False

    def _handle(self, outcome: Outcome, where: str) -> None:
        """Raise an error or warn about rows that failed."""
        if outcome.fault is None:
            return
        more = f" ({outcome.failed} rows failed)" if outcome.failed > 1 else ""
        what = f"{outcome.fault.message(())}{more}, in the evaluation of {where}"
        remedy = "pass on_failure='warn' to get the other values" if self._on_failure == "raise" else ""
        raise_or_warn([outcome.fault._replace(what=what, remedy=remedy)], self._on_failure, self)

    # ---- data ----

    @property
    def space(self) -> Space[P]:
        """Space of the points."""
        return self._space

    @property
    def axes(self) -> tuple[Array, ...]:
        """Knots of each axis, as passed to the constructor."""
        return tuple(axis.t for axis in self._axes)

    @property
    def points(self) -> P:
        """Points at the nodes, on the space; NaN for missing nodes."""
        points: P = self._joined([factor.points for factor in self._factors])
        return points

    @property
    def bc_type(self) -> tuple[str | tuple[str, str], ...]:
        """End conditions of each axis."""
        return tuple(axis.bc_type for axis in self._axes)

    @property
    def symmetric(self) -> bool:
        """Whether values are midpoints of both orders of axes."""
        return self._symmetric

    @cached_property
    def report(self) -> GridReport:
        """Report of the grid: convergence, missing nodes, and the effect of the order of axes.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u = np.linspace(0, 1, 8)
        >>> ss.GridSpline((u, u), (u[:, None] * u)[..., None], "r:1").report.converged
        True
        """
        return GridReport._of(self._axes, self._factors)

    def _joined(self, parts: list[Any]) -> Any:
        """Return results of all factors as points or vectors of the space."""
        return tuple(parts) if isinstance(self._space, Product) else parts[0]

    # ---- evaluation ----

    def __call__(
        self,
        x: Any,
        nu: Sequence[int] | int | None = None,
        *,
        extrapolate: Extrapolate = None,
        progress: Progress | None = None,
    ) -> P:
        """Evaluate the grid or its derivatives at scattered coordinates.

        Parameters
        ----------
        x : tuple of array_like, or array_like of shape (..., D)
            The coordinates: one array per axis, which broadcast against each other, or one array whose last axis holds
            the D coordinates.
        nu : tuple of int, optional
            Order of the derivative along each axis, at most 2 in total. By default, points are computed. Second
            derivatives are covariant; mixed ones do not depend on the order.
        extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
            Extrapolation policy; by default that of the grid.
        progress : callable, optional
            Function that is called from time to time with the finished and the total number of points.

        Returns
        -------
        ndarray or tuple of ndarray, shape (*broadcast shape, *point_shape)
            Points or tangent vectors; NaN where nodes are missing.

        Raises
        ------
        ValidationError
            If a coordinate is outside its axis, or a derivative is not available.
        CutLocusError, ConvergenceError
            If a spline fails; see `on_failure` in `GridSpline`.

        See Also
        --------
        GridSpline.grid : Evaluate on an outer product of coordinates, which is much faster.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u = np.linspace(0, 1, 8)
        >>> surface = ss.GridSpline((u, u), (u[:, None] * u)[..., None], "r:1")
        >>> surface((0.5, [0.25, 0.75]))[:, 0].round(6)
        array([0.125, 0.375])
        >>> surface([0.5, 0.25], nu=(1, 0)).round(6)
        array([0.25])
        """
        values: P = self._evaluate(*coordinates(self._axes, x, False), nu, extrapolate, progress)
        return values

    def grid(
        self,
        *x: TimesLike,
        nu: Sequence[int] | int | None = None,
        extrapolate: Extrapolate = None,
        progress: Progress | None = None,
    ) -> P:
        """Evaluate the grid or its derivatives on the outer product of coordinates.

        The cost is linear in the number of values, and the working memory is bounded.

        Parameters
        ----------
        *x : array_like
            Coordinates along each axis: a number or a vector each.
        nu : tuple of int, optional
            Order of the derivative along each axis, as in `GridSpline.__call__`.
        extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
            Extrapolation policy; by default that of the grid.
        progress : callable, optional
            Function that is called from time to time with the finished and the total number of points.

        Returns
        -------
        ndarray or tuple of ndarray, shape (*lengths of the coordinates, *point_shape)
            Points or tangent vectors; NaN where nodes are missing. A number as coordinate gives no axis.

        Raises
        ------
        ValidationError
            If a coordinate is outside its axis, or a derivative is not available.
        CutLocusError, ConvergenceError
            If a spline fails; see `on_failure` in `GridSpline`.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u = np.linspace(0, 1, 8)
        >>> surface = ss.GridSpline((u, u), (u[:, None] * u)[..., None], "r:1")
        >>> surface.grid([0.25, 0.5], [0.5, 1.0])[..., 0].round(6)
        array([[0.125, 0.25 ],
               [0.25 , 0.5  ]])
        """
        values: P = self._evaluate(*coordinates(self._axes, x, True), nu, extrapolate, progress)
        return values

    def _evaluate(
        self,
        x: list[Any],
        shape: tuple[int, ...],
        outer: bool,
        nu: object,
        extrapolate: Extrapolate,
        progress: Progress | None,
    ) -> Any:
        orders = orders_of(nu, len(self._axes))
        check_progress(progress)
        policy = self._extrapolate if extrapolate is None else checked_extrapolate(extrapolate)
        sites, missing = sites_of(self._axes, x, outer, policy)
        if sum(orders) and "geodesic" in sites.modes and any(orders[:-1]):
            raise ValidationError(
                "extrapolate='geodesic' has derivatives along the last axis only; pass extrapolate=True for others"
            )
        results, outcome = [], Outcome()
        for factor in self._factors:
            values, outcome_of_factor = factor.evaluate(sites, orders, progress)
            values = np.asarray(values)
            for k, bad in enumerate(missing):
                if bad.any():
                    values[(slice(None),) * k + (bad,) if outer else bad] = np.nan
            results.append(values.reshape(*shape, *factor.space.point_shape))
            outcome = outcome.merged(outcome_of_factor)
        self._handle(outcome, "the grid")
        return self._joined(results)

    def vjp(self, x: Any, cotangent: PointsLike, *, grid: bool = False) -> P:
        """Compute the gradient of a function of the values with respect to the nodes.

        The function is ``sum(cotangent * values)``, where the values are those of `GridSpline.__call__` or of
        `GridSpline.grid`. This is reverse mode: the transpose of the evaluation.

        Parameters
        ----------
        x : tuple of array_like, or array_like of shape (..., D)
            Coordinates inside the axes, as for `GridSpline.__call__`. Periodic axes repeat.
        cotangent : array_like, shape of the values
            Weights of the numbers of the values. For a `Product`, a tuple with one array per factor. Weights of values
            that are NaN have no effect. For complex numbers, real and imaginary parts are multiplied separately.
        grid : bool, default False
            Whether `x` is a tuple with the coordinates along each axis, numbers or vectors, whose outer product is
            evaluated as by `GridSpline.grid`.

        Returns
        -------
        ndarray or tuple of ndarray, shape of `points`
            Tangent vectors at the nodes, with the convention of `CubicSpline.vjp`: if the nodes move with the tangent
            vectors v, ``sum(cotangent * values)`` changes by ``sum(gradient * v)``. Vectors are zero at missing nodes,
            and at the last nodes of periodic axes, which move with the first ones.

        Raises
        ------
        ValidationError
            If the input does not meet the requirements above, the space is a `Manifold` that is made of functions, or
            its dimension is too large.
        CutLocusError, ConvergenceError
            If a spline fails; see `on_failure` in `GridSpline`.

        See Also
        --------
        CubicSpline.vjp : Compute the gradient of a function of a curve.

        Notes
        -----
        The splines along all axes are evaluated first. Their gradients follow in the reverse order of the axes. Splines
        that did not converge, kept by `on_failure`, are differentiated as if they had. The working memory is bounded.
        Outer products are much faster than the same coordinates scattered, whose splines use all nodes here.

        Examples
        --------
        Weights of the nodes in one value:

        >>> import numpy as np, symspline as ss
        >>> u = np.linspace(0, 1, 4)
        >>> surface = ss.GridSpline((u, u), (u[:, None] * u)[..., None], "r:1")
        >>> weights = surface.vjp((0.5, 0.0), [1.0])
        >>> weights.shape
        (4, 4, 1)
        >>> weights[:, 0, 0].round(6)
        array([-0.0625,  0.5625,  0.5625, -0.0625])
        """
        outer = checked_flag(grid, "grid")
        if outer and not isinstance(x, (tuple, list)):
            raise ValidationError(
                f"x must be a tuple with the coordinates along each axis, such as (u, v), not {short_repr(x)}. Pass "
                "grid=False for scattered coordinates."
            )
        numbers, shape, outer = coordinates(self._axes, x, outer)
        remedy = "derivatives with respect to the nodes exist only inside. Remove the coordinate."
        sites, _ = sites_of(self._axes, numbers, outer, None, remedy)
        gradients, outcome = [], Outcome()
        cotangents = parts_of(cotangent, self._space, "cotangent")
        for factor, of_factor in zip(self._factors, cotangents, strict=True):
            weights = read_cotangent(factor.space, of_factor, shape)
            gradient, outcome_of_factor = factor.gradient(
                sites, weights.reshape(*sites.shape, *factor.space.point_shape)
            )
            gradients.append(gradient)
            outcome = outcome.merged(outcome_of_factor)
        self._handle(outcome, "the grid")
        joined: P = self._joined(gradients)
        return joined

    def section(self, axis: int, at: Any) -> CubicSpline[P] | GridSpline[P]:
        """Return the section at a fixed coordinate along one axis.

        Parameters
        ----------
        axis : int
            Axis of the fixed coordinate.
        at : float or datetime64
            The coordinate.

        Returns
        -------
        CubicSpline or GridSpline
            The spline over the other axes, with their end conditions: a `CubicSpline` if there is one such axis. For
            ``axis=0`` it equals the grid. For other axes it passes through the values at the nodes of the other axes,
            and differs from the grid between them as much as the order of axes matters (`GridReport.axis_order_gap`).

        Raises
        ------
        ValidationError
            If the grid has one axis only, the coordinate is outside the axis, or a curve would have missing nodes.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u = np.linspace(0, 1, 8)
        >>> surface = ss.GridSpline((u, u), (u[:, None] * u)[..., None], "r:1")
        >>> surface.section(axis=0, at=0.5)(0.25).round(6)
        array([0.125])
        """
        dims = len(self._axes)
        if dims == 1:
            raise ValidationError("the grid has one axis only, so that a section is a point: call the grid instead")
        number = whole_number(axis, "axis", 0)
        if number >= dims:
            raise ValidationError(f"axis must be less than {dims}, not {short_repr(axis)}")
        others = [grid_axis for k, grid_axis in enumerate(self._axes) if k != number]
        nodes = self.grid(*(at if k == number else grid_axis.t for k, grid_axis in enumerate(self._axes)))
        if dims > 2:
            return GridSpline(
                tuple(grid_axis.t for grid_axis in others),
                nodes,
                self._space,
                bc_type=tuple(grid_axis.bc_type for grid_axis in others),
                symmetric=self._symmetric,
                extrapolate=self._extrapolate,
                on_failure=self._on_failure,
            )
        first = nodes[0] if isinstance(nodes, tuple) else nodes
        gaps = np.flatnonzero(~factors_of(self._space)[0]._where_finite(first))
        if gaps.size:
            raise ValidationError(
                f"the section at {at} has no points at the nodes {short_repr(gaps.tolist())} of the other axis. "
                "Evaluate the grid itself, which gives NaN there."
            )
        bc: Any = others[0].bc_type
        return CubicSpline(
            others[0].t, nodes, self._space, bc_type=bc, extrapolate=self._extrapolate, on_failure=self._on_failure
        )

    # ---- plots ----

    @overload
    def plot(self, file: File | None = None, *, ax: None = None, **look: Unpack[GridLook]) -> Figure: ...
    @overload
    def plot(self, file: None = None, *, ax: Axes, **look: Unpack[GridAxesLook]) -> Axes: ...
    def plot(
        self,
        file: File | None = None,
        *,
        ax: Axes | None = None,
        title: str | None = None,
        figsize: tuple[float, float] | float | None = None,
        show: bool = False,
        axis_names: Sequence[str] | None = None,
        direction: ArrayLike | None = None,
    ) -> Figure | Axes:
        """Plot the points over the first two axes.

        As in xarray, axis 0 is vertical and axis 1 is horizontal, and both have their coordinates. Use
        ``figure.axes[0].invert_yaxis()`` for an image whose first row is at the top, as ``imshow`` shows it.

        The picture depends on the space:

        - S²: arrows of the first two coordinates over an image of the angle to the third axis; CP¹ and the complex
          Gr(1, 2) likewise, with Bloch vectors.
        - SO(3), SU(2) and S³ (unit quaternions, scalar first): an orientation map. The colour is the direction of the
          axis that moves most; lines show the rotation from the node with a ring.
        - Quotients of SO(3) by the point groups 222, 422, 622 and 432, for maps of crystals: the colours of inverse
          pole figures, and lines of the disorientation to the node with a ring.
        - SPD(2) and SPD(3): ellipses over an image of the anisotropy, for SPD(3) with the colours of the longest axis.
        - S¹, SO(2), O(2), U(1), RP¹ and Gr(1, 2): the angle.
        - R¹: an image. R²: arrows over an image of their lengths. R³: a surface; SE(3): a surface with frames.
        - All other spaces: the distance to the node with a ring.

        A product has one panel per factor. Dots are nodes; areas without values are blank.

        Parameters
        ----------
        file : str, path or file object, optional
            File to which the figure is saved, such as ``"grid.pdf"``.
        ax : matplotlib.axes.Axes, optional
            Axes into which the picture is drawn, with its key to the right of them. R³ and SE(3) need axes with
            ``projection="3d"``, all other spaces ordinary ones.
        title, figsize, show : optional
            As for `symspline.Curve.plot`.
        axis_names : sequence of str, optional
            Names of all axes of the grid, such as ``["latitude", "longitude"]``.
        direction : array_like, shape (3,), optional
            Direction of the sample whose crystal direction the colours of a crystal map show, x₃ by default.

        Returns
        -------
        matplotlib.figure.Figure or matplotlib.axes.Axes
            The figure, which you can modify or save, or `ax`.

        Raises
        ------
        ImportError
            If Matplotlib is not installed.
        ValidationError
            If an argument is invalid, all nodes of the section are missing, or the only axis has missing nodes.

        Notes
        -----
        A grid with one axis has the figure of its `CubicSpline`. For three and more axes, the figure shows the section
        at the middle nodes of the further axes, which the heading names.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u = np.linspace(0, 1, 8)
        >>> grid = ss.GridSpline((u, 2 * u), (u[:, None] * u)[..., None], "r:1")
        >>> axes = grid.plot(axis_names=["latitude", "longitude"]).axes[0]
        >>> axes.get_xlabel(), axes.get_ylabel()
        ('longitude', 'latitude')
        """
        require_matplotlib()
        from .._plotting import checked_axis_names, checked_direction, checked_look, plot, plot_grid

        look = checked_look(file, ax, None, None, title, figsize, show) | {"ax": ax, "show": show}
        names = checked_axis_names(axis_names, len(self._axes))
        sample = checked_direction(direction, self._space)
        drawn: Figure | Axes
        if len(self._axes) > 1:
            drawn = plot_grid(self, file, axis_names=names, direction=sample, **look)
            return drawn
        if self.report.missing:
            raise ValidationError(
                "the only axis of the grid has missing nodes, so that it is not one curve. Plot the curves of "
                "fit_segments instead."
            )
        bc: Any = self._axes[0].bc_type
        curve = CubicSpline(self._axes[0].t, self.points, self._space, bc_type=bc, on_failure=self._on_failure)
        drawn = plot(curve, file, **look)
        return drawn

    def _values_of(self, factor: FactorGrid, x: list[Any]) -> Array:
        """Evaluate a factor on an outer product of coordinates of the core; NaN where splines fail."""
        return factor.evaluate(Sites(x, True, ["continue"] * len(x)), (0,) * len(x))[0]

    # ---- files, pickles and text ----

    def save(self, file: File) -> None:
        """Write the grid to an NPZ file that `symspline.load` reads.

        Parameters
        ----------
        file : path or binary file
            File to write. An existing file is replaced as a whole once all data are on disk.

        Raises
        ------
        ValidationError
            If the space is a `Manifold` that is made of functions.
        OSError
            If the file cannot be written.

        Examples
        --------
        >>> import io, numpy as np, symspline as ss
        >>> u = np.linspace(0, 1, 8)
        >>> surface = ss.GridSpline((u, u), (u[:, None] * u)[..., None], "r:1")
        >>> file = io.BytesIO()
        >>> surface.save(file)
        >>> _ = file.seek(0)
        >>> ss.load(file) == surface
        True
        """
        write(file, self._state())

    def _state(self) -> State:
        options = {"symmetric": self._symmetric, "on_failure": self._on_failure}
        state = head_of(self) | {
            "extrapolate": self._extrapolate,
            "grid": {"bc_type": [axis.bc_type for axis in self._axes], **options},
        }
        for k, axis in enumerate(self._axes):
            state |= times_state(f"axis_{k}", axis.t, axis.time_axis)
        for i, factor in enumerate(self._factors):
            suffix = suffix_of(self._space, i)
            state[f"points{suffix}"] = np.asarray(factor.points)
            if isinstance(factor.forward, CompiledGrid) and factor.forward.span is None:
                state[f"velocities{suffix}"] = np.ascontiguousarray(factor.forward.velocities)
        return state

    @classmethod
    def _from_state(cls, state: Entries) -> Self:
        self = cls.__new__(cls)
        self._space = read_space(state)
        self._extrapolate = state.read("extrapolate", checked_extrapolate)
        with entry("grid"):
            options = state["grid"]
            conditions = [word if isinstance(word, str) else tuple(word) for word in options["bc_type"]]
            self._symmetric = checked_flag(options["symmetric"], "symmetric")
            self._on_failure = options["on_failure"]
            check_on_failure(self._on_failure)
            knots = [read_times(state, f"axis_{k}")[1] for k in range(len(conditions))]
        arrays: list[Array] = []
        velocities: list[Array | None] = []
        for i, factor in enumerate(factors_of(self._space)):
            suffix = suffix_of(self._space, i)
            with entry(f"points{suffix}"):
                arrays.append(read_array(state, f"points{suffix}", factor))
                shape = arrays[-1].shape[: arrays[-1].ndim - len(factor.point_shape)]
                self._axes = read_axes(tuple(knots), shape, conditions)
            name = f"velocities{suffix}"
            with entry(name):
                velocities.append(read_array(state, name, factor) if name in state else None)
                if velocities[-1] is not None and velocities[-1].shape != arrays[-1].shape:
                    raise ValidationError(f"its shape {velocities[-1].shape} is not that of the points")
        self._fill(arrays, velocities)
        return self

    def __reduce__(self) -> tuple[object, ...]:
        return restore, (self._state(),)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self) or not isinstance(other, GridSpline):
            return NotImplemented
        mine, theirs = self._state(), other._state()
        return mine.keys() == theirs.keys() and all(
            np.array_equal(value, theirs[name], equal_nan=value.dtype.kind in "fc")
            if isinstance(value, np.ndarray)
            else value == theirs[name]
            for name, value in mine.items()
        )

    __hash__: ClassVar[None] = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        nodes = " x ".join(str(len(axis.knots)) for axis in self._axes)
        return f"<{type(self).__name__} on {self._space!r}: {nodes} nodes>"


FORMATS.update({GridSpline._format: GridSpline})


# ---- the report of a grid ----

# The number of cell centres at which the two orders of axes are compared.
_COMPARED = 4096


class GridReport:
    """Report of a `GridSpline`.

    Splines along the first axis are fitted when the grid is made, and those along the other axes when it is evaluated.

    See Also
    --------
    GridSpline.report : Report of a grid.

    Examples
    --------
    >>> import numpy as np, symspline as ss
    >>> u, v = np.linspace(0, 1, 9), np.linspace(0, 1, 8)
    >>> points = np.stack([u[:, None] + 0 * v, u[:, None] * v], axis=-1)
    >>> report = ss.GridSpline((u, v), points, "r:2").report
    >>> report.converged, report.missing, report.axis_order_gap < 1e-12
    (True, 0, True)
    """

    _axes: list[GridAxis]
    _factors: list[FactorGrid]

    @classmethod
    def _of(cls, axes: list[GridAxis], factors: list[FactorGrid]) -> Self:
        self = cls()
        self._axes, self._factors = axes, factors
        return self

    @cached_property
    def _outcome(self) -> Outcome:
        outcome = Outcome()
        for factor in self._factors:
            outcome = outcome.merged(factor.forward.outcome)
        return outcome

    @property
    def converged(self) -> bool:
        """Whether all splines along the first axis converged."""
        return self._outcome.failed == 0

    @property
    def residual(self) -> float:
        """Largest relative C² residual of the splines along the first axis."""
        return self._outcome.residual

    @cached_property
    def missing(self) -> int:
        """Number of missing nodes.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u = np.linspace(0, 1, 8)
        >>> surface = ss.GridSpline((u, u), (u[:, None] * u)[..., None], "r:1")
        >>> surface.report.missing
        0
        """
        first = self._factors[0]
        return int(np.count_nonzero(~first.space._where_finite(first.points)))

    @cached_property
    def max_step(self) -> tuple[float, ...]:
        """Longest distance between neighbouring nodes along each axis.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u = np.linspace(0, 1, 8)
        >>> surface = ss.GridSpline((u, u), (u[:, None] * u)[..., None], "r:1")
        >>> [round(step, 4) for step in surface.report.max_step]
        [0.1429, 0.1429]
        """
        longest: list[float] = []
        for k in range(len(self._axes)):
            steps = []
            for factor in self._factors:
                p, q = factor.space._neighbours(np.moveaxis(factor.points, k, len(self._axes) - 1))
                valid = factor.space._where_finite(p) & factor.space._where_finite(q)
                steps.append(factor.space.distance(p[valid], q[valid]))
            longest.append(float(np.max(product_norm(tuple(steps)), initial=0.0)))
        return tuple(longest)

    @cached_property
    def axis_order_gap(self) -> float:
        """Largest distance between the values in the given and in the reverse order of axes.

        It is computed on first access, over the centres of up to 4096 cells. For smooth data it is of order 8 in the
        spacing; it is large for rough or noisy data, whose interpolant then depends on an arbitrary choice.

        Examples
        --------
        >>> import numpy as np, symspline as ss
        >>> u = np.linspace(0, 1, 8)
        >>> surface = ss.GridSpline((u, u), (u[:, None] * u)[..., None], "r:1")
        >>> surface.report.axis_order_gap < 1e-12
        True
        """
        dims = len(self._axes)
        most = max(1, int(_COMPARED ** (1 / dims)))
        x = []
        for axis in self._axes:
            centres = (axis.knots[1:] + axis.knots[:-1]) / 2
            chosen = np.linspace(0, len(centres) - 1, min(most, len(centres))).round().astype(int)
            x.append(centres[chosen])
        sites = Sites(x, True, ["continue"] * dims)
        gaps = product_norm(tuple(factor.gap(sites) for factor in self._factors))
        return float(np.max(gaps, initial=0.0, where=np.isfinite(gaps)))

    def __repr__(self) -> str:
        state = "converged" if self.converged else "NOT converged"
        return f"<GridReport: {state}, residual {self.residual:.1e}, {self.missing} missing nodes>"
