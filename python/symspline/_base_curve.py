"""Curves made of Bézier segments between knots: what they have whatever their velocities come from."""

from __future__ import annotations

from abc import ABC, abstractmethod
from base64 import b64encode
from collections.abc import Callable, Iterator
from html import escape
from importlib.util import find_spec
from io import BytesIO
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, overload

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from ._arrays import as_array, checked_flag, in_single, is_single, read_only, short_repr
from ._core import ValidationError
from ._curves.band import UncertaintyBand
from ._curves.curve import CurveArrays, Doubles
from ._curves.energy import bending_energy
from ._curves.integrals import integrate
from ._curves.solve import Progress
from ._input import times_of
from ._options import check_progress, checked_extrapolate, outside, quantity_of
from ._spaces import Array, Product, Space, parts_of
from ._time import TimeAxis, onto_ends
from ._typing import AnyArray, AnyArrays, BCType, Extrapolate, File, FloatArray, Number, Out, P

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Per inch, in notebooks.
_DOTS = 60


class Curve(ABC, Generic[P]):
    """A curve, or a batch of them, by knots, points and velocities there."""

    # What a plot says of it.
    _kind: ClassVar[str]

    @property
    @abstractmethod
    def _ends(self) -> str:
        """Conditions at the ends, in words."""

    @property
    def _made_of(self) -> str:
        """What a plot says of the data."""
        return f"{self._t.shape[-1]} points{' each' if self._batch else ''}, {self._ends}"

    def _noise_beside(self, index: tuple[int, ...], x: Doubles) -> UncertaintyBand | None:
        """Noisy data near one curve of a batch, with bands at times x of the core; None where the given points are
        on the curve."""
        return None

    @property
    @abstractmethod
    def _unconverged(self) -> int:
        """How many curves are none."""

    _clock: TimeAxis
    _t: Array
    _curve: CurveArrays
    _extrapolate: Extrapolate
    # What happens outside the knots, as the core calls it.
    _outside: str
    # Conditions at the ends, which say whether curves are closed.
    _bc_type: BCType

    @abstractmethod
    def _with(self, clock: TimeAxis, t: Array, curve: CurveArrays, index: Any) -> Self:
        """Some of the curves of a batch."""

    # ---- the curve ----

    @overload
    def __call__(
        self,
        x: ArrayLike,
        nu: int = 0,
        *,
        extrapolate: Extrapolate = None,
        per_curve: bool = False,
        dtype: None = None,
        progress: Progress | None = None,
        out: None = None,
    ) -> P: ...

    @overload
    def __call__(
        self,
        x: ArrayLike,
        nu: int = 0,
        *,
        extrapolate: Extrapolate = None,
        per_curve: bool = False,
        progress: Progress | None = None,
        out: Out,
    ) -> Out: ...

    @overload
    def __call__(
        self: Curve[AnyArrays],
        x: ArrayLike,
        nu: int = 0,
        *,
        extrapolate: Extrapolate = None,
        per_curve: bool = False,
        dtype: DTypeLike,
        progress: Progress | None = None,
    ) -> AnyArrays: ...

    @overload
    def __call__(
        self: Curve[AnyArray],
        x: ArrayLike,
        nu: int = 0,
        *,
        extrapolate: Extrapolate = None,
        per_curve: bool = False,
        dtype: DTypeLike,
        progress: Progress | None = None,
    ) -> AnyArray: ...

    def __call__(
        self,
        x: ArrayLike,
        nu: int = 0,
        *,
        extrapolate: Extrapolate = None,
        per_curve: bool = False,
        dtype: DTypeLike | None = None,
        progress: Progress | None = None,
        out: AnyArray | AnyArrays | None = None,
    ) -> Any:
        """The curve at times x.

        Args:
            x: times, any shape and order; dates if the knots are. If those had a time zone, dates here have one, any,
                or are ``datetime64`` in UTC; if they had none, neither have these.
            nu: 0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.
            extrapolate: as for the constructor, whose choice holds if None.
            per_curve: whether the leading axes of x are the batch axes: every curve has its own times.
            dtype: ``"float32"`` for results in single precision, of complex points in complex64; they are computed in
                double precision.
            progress: called from time to time with the finished and the total number of points to compute.
            out: an array of the result's shape, for a product a tuple of them, that takes the result and is
                returned. One of another type than the space's, or with gaps in memory, costs a copy.

        Returns:
            Shape batch axes + x.shape + point_shape (x.shape without its batch axes if ``per_curve``).

        Raises:
            ValidationError: a time is not finite, or outside the knots and ``extrapolate`` is None; ``out`` is no
                array that can take the result, or ``dtype`` is given beside it.
        """
        if progress is not None:
            check_progress(progress)
        single = dtype is not None and is_single(dtype)
        if out is not None and dtype is not None:
            raise ValidationError("give dtype or out, not both: results have the type of out")
        values = self._at(x, quantity_of(nu), extrapolate, per_curve, progress, out)
        return in_single(values) if single else values

    def lift(
        self,
        x: ArrayLike,
        start: ArrayLike | tuple[ArrayLike | None, ...] | None = None,
        *,
        nu: int = 0,
        extrapolate: Extrapolate = None,
        per_curve: bool = False,
        progress: Progress | None = None,
    ) -> P:
        """The curve at times x by arrays that move continuously: the horizontal lift.

        A point of a projective space or a Grassmannian is an array up to a unitary factor on its right, a phase, a
        sign or a change of the basis. A call picks one by itself, which jumps at knots. The horizontal lift X is
        continuous, and turns no more than its subspace does: X*X' = 0. It depends neither on the representatives of
        the data nor on the other times that are asked for. Where points have one array only it is the curve itself.

        Args:
            x: times, any shape and order, as in a call.
            start: a representative of the first point, at which the lift starts, shape point_shape or batch axes +
                point_shape; None for the first point as it was given. For a product a tuple with one or None for
                every factor.
            nu: 0 for representatives, 1 for the velocity γ', 2 for the covariant acceleration ∇γ' there. With ``nu=1``
                these are the derivatives of the arrays.
            extrapolate, per_curve, progress: as in a call. A closed curve may come back as another representative,
                by its *holonomy* (on CP¹ the phase of half the enclosed area, Berry's phase); beyond the knots the
                lift goes on with that.

        Returns:
            Shape batch axes + x.shape + point_shape.

        Raises:
            ValidationError: as in a call, and where ``start`` does not represent the first point.

        >>> import numpy as np
        >>> import symspline as ss
        >>> spline = ss.CubicSpline(None, [[1, 0], [0.6, 0.8], [-0.28, -0.96]], "rp:1")
        >>> spline.lift(2.0).round(12)  # the data have the other sign
        array([0.28, 0.96])
        """
        if progress is not None:
            check_progress(progress)
        quantity, where = quantity_of(nu), self._where(extrapolate)
        values: P = call_at_times(
            self._curve,
            self._clock,
            x,
            per_curve,
            lambda curve, x, per_curve: curve.lift(x, quantity, where, per_curve, start, progress),
        )
        return values

    def transport(self, x0: ArrayLike, x1: ArrayLike, v: ArrayLike) -> P:
        """Parallel transport of tangent vectors along the curve, (26a) of the paper.

        Args:
            x0, x1: from when to when, two times between the first and the last knot, in any order. A closed curve is
                gone round as often as times beyond its knots say.
            v: a tangent vector at ``spline(x0)``, shape point_shape, or one for every curve, batch axes + point_shape;
                for a product a tuple.

        Returns:
            Tangent vectors at ``spline(x1)``, shape batch axes + point_shape. On quotient spaces vectors belong to the
            representatives that the two calls give.

        Raises:
            ValidationError: a time is outside the knots, or v is not tangent at ``spline(x0)``.

        >>> import symspline as ss
        >>> quarter = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], ss.Sphere(2))
        >>> quarter.transport(0, 1, [0.0, 1.0, 2.0]).round(12) + 0.0  # a vector ahead, and one across
        array([-1.,  0.,  2.])
        """
        ends = [as_array(times_of(x, name)[0], name) for name, x in (("x0", x0), ("x1", x1))]
        if any(end.ndim for end in ends):
            raise ValidationError("x0 and x1 must be single times, from when to when")
        pair = (
            times_of([x0, x1], "x")[0] if any(end.dtype.kind in "MmU" for end in ends) else np.asarray(ends)
        )
        times, own = self._clock.at(pair, self._batch, False, self._times)
        where = "periodic" if self._outside == "periodic" else "raise"
        try:
            at = evaluated(self._curve, self._clock, pair, "point", where, False, None)
        except ValidationError as error:
            what = str(error).partition("; pass extrapolate")[0]
            raise ValidationError(f"{what}; vectors are carried between the knots, x is (x0, x1)") from None
        vectors = []
        for points, part, one in zip(
            parts_of(at, self.space, "points"), self._curve.parts, parts_of(v, self.space, "v"), strict=True
        ):
            first = np.take(points, 0, axis=len(self._batch))
            # Of curves that were not found there is nothing to check.
            good = np.isfinite(first).all(axis=tuple(range(-len(part.space.point_shape), 0)))
            given = part.space._array(one, "v")
            part.space._doubles(given, "v")
            try:
                given = np.broadcast_to(given, first.shape)
            except ValueError:
                raise ValidationError(
                    f"v has shape {given.shape}, which does not broadcast to {first.shape}"
                ) from None
            part.space.check_tangent(first[good], given[good])
            vectors.append(given)
        if own:
            # Curves that count time from first knots of their own are carried along one by one.
            product = isinstance(self.space, Product)
            each: list[Any] = [
                self[i].transport(x0, x1, tuple(v[i] for v in vectors) if product else vectors[0][i])
                for i in range(len(self))
            ]
            stacked: Any = tuple(map(np.stack, zip(*each, strict=True))) if product else np.stack(each)
            result: P = stacked
            return result
        moved = tuple(vectors) if isinstance(self.space, Product) else vectors[0]
        result = self._curve.transport((float(times[0]), float(times[1])), where, moved)
        return result

    def speed(
        self,
        x: ArrayLike,
        *,
        extrapolate: Extrapolate = None,
        per_curve: bool = False,
        dtype: DTypeLike | None = None,
    ) -> FloatArray:
        """|γ'| at times x, shape batch axes + x.shape; options are those of a call."""
        single = dtype is not None and is_single(dtype)
        values = self._at(x, "speed", extrapolate, per_curve)
        speeds: FloatArray = (in_single(values) if single else values)[()]
        return speeds

    def _at(
        self,
        x: ArrayLike,
        quantity: str,
        extrapolate: Any,
        per_curve: bool,
        progress: Progress | None = None,
        out: Any = None,
    ) -> Any:
        return evaluated(
            self._curve, self._clock, x, quantity, self._where(extrapolate), per_curve, progress, out
        )

    def _where(self, extrapolate: Any) -> str:
        """What happens outside the knots, as the core calls it."""
        return (
            self._outside if extrapolate is None else outside(checked_extrapolate(extrapolate), self._bc_type)
        )

    def length(self) -> Number:
        """Length of the curve from first to last knot, ∫ |γ'| dt; shape of the batch axes."""
        curve = self._curve
        return integrate(
            curve.times, lambda x: curve.evaluate(x, "speed", self._outside, True), curve.batch, curve.exact
        )

    def bending_energy(self) -> Number:
        """∫ |∇γ'|² dt, the energy (1) that Riemannian cubics minimise; shape of the batch axes."""
        return bending_energy(self._curve, self._outside)

    # ---- what it is made of ----

    @property
    def t(self) -> Array:
        """The knots, shape (N+1,) or (..., N+1); numbers or ``datetime64`` as they were given. Times with a time zone
        are in UTC here, as ``datetime64`` has no zone."""
        return read_only(self._t)

    @property
    def points(self) -> P:
        """The points, shape (..., N+1, *point_shape)."""
        points: P = self._curve.points
        return points

    @property
    def velocities(self) -> P:
        """Velocities γ' at the knots, the shape of the points. Together with knots and points they are
        the whole curve."""
        velocities: P = self._curve.velocities
        return velocities

    @property
    def control_points(self) -> P:
        """Control points of the Bézier segments, shape (..., N, 4, *point_shape)."""
        control_points: P = self._curve.control_points()
        return control_points

    @property
    def space(self) -> Space[P]:
        """The space."""
        return self._curve.space

    @property
    def extrapolate(self) -> Extrapolate:
        """What happens outside the knots, as it was given."""
        return self._extrapolate

    @property
    def _batch(self) -> tuple[int, ...]:
        return self._curve.batch

    @property
    def _times(self) -> NDArray[np.float64]:
        """The knots as the core counts them."""
        return self._curve.times

    # ---- a batch as a sequence ----

    def __len__(self) -> int:
        if not self._batch:
            raise TypeError("this is one curve; only a batch of curves has a length (see also .length())")
        return self._batch[0]

    def __getitem__(self, index: int | np.integer[Any] | slice[Any, Any, Any]) -> Self:
        """A curve, or a slice of curves, of a batch."""
        if not self._batch:
            raise TypeError("this is one curve; only a batch of curves can be indexed")
        if not isinstance(index, (int, np.integer, slice)):
            raise TypeError(
                f"a curve is picked by a whole number or a slice as index, not {short_repr(index)}"
            )
        if not isinstance(index, slice) and not -len(self) <= index < len(self):
            raise IndexError(f"index {short_repr(index)} is out of range: there are {len(self)} curves")
        t = self._t[index] if self._times.ndim > 1 else self._t
        return self._with(self._clock.picked(index), t, self._curve.picked(index), index)

    def __bool__(self) -> bool:
        return True

    def __iter__(self) -> Iterator[Self]:
        return (self[i] for i in range(len(self)))

    # ---- as a value ----

    def __eq__(self, other: object) -> bool:
        """Equal space, knots, points and velocities, to the last bit."""
        if type(self) is not type(other) or not isinstance(other, Curve):
            return NotImplemented
        return (
            self.space == other.space
            and self._t.dtype == other._t.dtype
            and np.array_equal(self._t, other._t)
            and all(
                np.array_equal(a.points, b.points, equal_nan=True)
                and np.array_equal(a.velocities, b.velocities, equal_nan=True)
                for a, b in zip(self._curve.parts, other._curve.parts, strict=True)
            )
        )

    __hash__ = None  # type: ignore[assignment]

    def _repr_html_(self) -> str:
        """What notebooks show: a small picture, where matplotlib is there to draw it."""
        text = f"<pre>{escape(repr(self))}</pre>"
        if find_spec("matplotlib") is None:
            return text
        picture = BytesIO()
        try:
            self.plot().savefig(picture, format="png", dpi=_DOTS)
        except ValidationError:
            # There is nothing to plot of curves that failed.
            return text
        data = b64encode(picture.getvalue()).decode()
        return f'{text}<img src="data:image/png;base64,{data}" alt="{escape(repr(self))}">'

    def plot(self, file: File | None = None) -> Figure:
        """A figure with a picture of the curve, and speed |γ'| and |∇γ'| against time.

        The picture depends on the space:

        - S²: a globe and a map; H²: the Poincaré disk; R¹, R² and R³: the graph or the curve.
        - SO(3), O(3), SU(2) and S³ (unit quaternions, scalar first): rotated frames along the time axis.
        - S¹, SO(2), O(2), U(1), RP¹ and Gr(1, 2): the angle against time, without jumps.
        - SE(3): frames on the path of the positions; SE(2): arrow heads on it.
        - CP¹ and the complex Gr(1, 2): the Bloch sphere.
        - RP², Gr(1, 3) and Gr(2, 3): a half sphere, with the normals of planes; a curve that leaves it
          through the rim comes back on the opposite side.
        - Other projective spaces and Grassmannians: the principal angles to the first point.
        - SPD(2) and SPD(3): ellipses and ellipsoids along the time axis.
        - Otherwise the components against time, imaginary parts dashed.

        A smoothing spline has its data as light dots, and a light band that holds the true curve with probability 95 %
        where the space has room for one; so has its speed, but in a product. Of a batch a few curves have them.

        For a product the pictures of its factors. Of a batch at most 50 curves are drawn. Neither pyplot nor
        any setting of matplotlib is touched.

        Args:
            file: where to save the figure, if anywhere: a name such as ``"curve.pdf"``, or an open file.

        Returns:
            The figure, to change or to save.

        Raises:
            ImportError: matplotlib is not installed.
        """
        if find_spec("matplotlib") is None:
            raise ImportError("plots need matplotlib; install it with: pip install 'symspline[plot]'")
        from ._plotting import plot

        return plot(self, file)


def check_curve(spline: Any, name: str = "spline") -> None:
    """Raise TypeError unless an argument is a curve that was fitted."""
    if not isinstance(spline, Curve):
        raise TypeError(f"{name} must be a curve, such as a symspline.CubicSpline, not {short_repr(spline)}")


def evaluated(
    curve: CurveArrays,
    clock: TimeAxis,
    x: ArrayLike,
    quantity: str,
    outside: str,
    per_curve: bool,
    progress: Progress | None,
    out: Any = None,
) -> Any:
    """A quantity at times as the user gives them."""

    def call(curve: CurveArrays, x: Doubles, per_curve: bool) -> Any:
        if out is None:
            return curve.evaluate(x, quantity, outside, per_curve, progress)
        return curve.write(out, x, quantity, outside, per_curve, progress)

    return call_at_times(curve, clock, x, per_curve, call)


def call_at_times(
    curve: CurveArrays,
    clock: TimeAxis,
    x: ArrayLike,
    per_curve: bool,
    call: Callable[[CurveArrays, Doubles, bool], Any],
) -> Any:
    """What a curve has at times as the user gives them."""
    per_curve = checked_flag(per_curve, "per_curve")
    if clock.plain and type(x) is float:
        # A single time is worth a short way.
        times, knots = np.array(x), curve.times
        if knots.ndim > 1 or not knots[0] <= x <= knots[-1]:
            times, per_curve = onto_ends(times, knots, curve.batch, per_curve)
    else:
        times, per_curve = clock.at(x, curve.batch, per_curve, curve.times)
    try:
        return call(curve, times, per_curve)
    except ValidationError as error:
        raise clock.explain(error) from None
