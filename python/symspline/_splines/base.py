"""The base classes of all curves: evaluation, lengths, batches, plots, parts and copies at other times."""

from __future__ import annotations

import re
from abc import abstractmethod
from base64 import b64encode
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import timedelta
from html import escape
from importlib.util import find_spec
from io import BytesIO
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from .._base.arrays import as_array, cast, checked_flag, checked_number, in_single, is_single, refuse, short_repr
from .._base.time import TimeAxis, seconds_of
from .._base.typing import (
    AnyArray,
    AnyArrays,
    AxesLook,
    BCType,
    Extrapolate,
    File,
    FloatArray,
    Number,
    Out,
    P,
    PageLook,
    Progress,
    Time,
    TimesLike,
)
from .._core import ValidationError
from .._curves.composed import Affine, AnyCurve, TimeMap, evaluated, part_of_times
from .._curves.curve import SidePanel, UncertaintyBand
from .._curves.length import ArcLength, bending_energy, length
from .._curves.options import (
    EvaluationOptions,
    check_progress,
    checked_extrapolate,
    extrapolation_mode,
    order_of,
    quantity_of,
    require_matplotlib,
)
from .._spaces import Doubles, factors_of, parts_of
from . import archive
from .search import Searchable

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Relative rounding error of an arc length that a user computed.
_ROUNDING = 1e-12


class CurveBase(Searchable[P]):
    """The part of `Curve` that does not make new curves, except those of a batch."""

    # Name of the format in files and pickles.
    _format: ClassVar[str]
    _curve: AnyCurve
    _time_axis: TimeAxis

    def __init_subclass__(cls) -> None:
        if "_format" in vars(cls):
            archive.FORMATS[cls._format] = cls

    @abstractmethod
    def __call__(self, x: ArrayLike, nu: int = 0) -> P:
        """Evaluate the curve or its derivatives.

        Parameters
        ----------
        x : array_like
            Times, of any shape and in any order.
        nu : {0, 1, 2}, default 0
            Order of the derivative: 0 for points, 1 for the velocity, 2 for the covariant acceleration.

        Returns
        -------
        ndarray or tuple of ndarray
            Points or tangent vectors, shape ``(*batch axes, *x.shape, *point_shape)``.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.BezierCurve([[0.0], [3.0]], "r:1")([0.5, 1.0], nu=1)
        array([[3.],
               [3.]])
        """

    @abstractmethod
    def speed(self, x: ArrayLike) -> Number:
        """Compute the speed of the curve, the norm of the velocity.

        Parameters
        ----------
        x : array_like
            Times, of any shape and in any order.

        Returns
        -------
        ndarray, shape ``(*batch axes, *x.shape)``
            The speed.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.BezierCurve([[0.0], [3.0]], "r:1").speed([0.5, 1.0])
        array([3., 3.])
        """

    @property
    @abstractmethod
    def domain(self) -> tuple[Time, Time]:
        """First and last time. They are arrays with the batch axes if every curve has its own times."""

    def length(self, a: TimesLike | None = None, b: TimesLike | None = None) -> Number:
        r"""Compute the length of the curve, or of the part between two times.

        Parameters
        ----------
        a, b : array_like of float or datetime64, optional
            Start and end of the part; b must not be before a. Both must be in the domain of the curve. Arrays are
            broadcast. By default, the first and the last time of the domain.

        Returns
        -------
        ndarray or float, shape ``(*batch axes, *shape of the times)``
            The integral of the speed, :math:`\int_a^b \lVert\gamma'\rVert \, dt`.

        Raises
        ------
        ValidationError
            If a time is not in the domain of the curve, or b is before a.

        See Also
        --------
        Curve.arc_length : Compute the length from the start of the domain to many times.

        Examples
        --------
        >>> import symspline as ss
        >>> quarter = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], ss.Sphere(2))
        >>> round(float(quarter.length()), 8)
        1.57079633
        >>> quarter.length([0, 0.25], [0.5, 1]).round(8)
        array([0.78539816, 1.17809725])
        """
        curve = self._curve
        if a is None and b is None:
            return length(curve)
        ends = [
            self._domain_ends[number] if x is None else self._core_times(x, name)
            for number, (x, name) in enumerate([(a, "a"), (b, "b")])
        ]
        shapes = [x.shape[len(self._batch) * own :] for x, own in ends]
        start, stop = (self._with_batch(x, own, max(map(len, shapes))) for x, own in ends)
        try:
            start, stop = np.broadcast_arrays(start, stop)
        except ValueError:
            raise ValidationError(f"a and b have shapes {shapes[0]} and {shapes[1]}, which do not broadcast") from None
        refuse(stop < start, "b", lambda _: "is before a. Exchange a and b.")
        return self._by_columns(ArcLength.between, start, stop)

    def arc_length(self, x: TimesLike, *, per_curve: bool = False) -> Number:
        """Compute the length of the curve from the start of its domain to given times.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times in the domain of the curve, of any shape and in any order.
        per_curve : bool, default False
            True if every curve of a batch has its own times. The leading axes of x are then the batch axes.

        Returns
        -------
        ndarray or float, shape ``(*batch axes, *x.shape)``
            Arc lengths. With `per_curve`, the batch axes appear only once.

        Raises
        ------
        ValidationError
            If a time is not in the domain of the curve.

        See Also
        --------
        Curve.at_length : Compute the times at which the curve has given arc lengths.

        Examples
        --------
        >>> import symspline as ss
        >>> curve = ss.HermiteSpline([0, 1], [[0.0], [1.0]], [[0.0], [2.0]], "r:1")  # x = t²
        >>> curve.arc_length([0.0, 0.5, 1.0]).round(12)
        array([0.  , 0.25, 1.  ])
        """
        times, own = self._core_times(x, "x", checked_flag(per_curve, "per_curve"))
        return self._by_columns(ArcLength.at, self._with_batch(times, own, times.ndim - len(self._batch) * own))

    def at_length(self, s: ArrayLike, *, per_curve: bool = False) -> Time:
        """Compute the times at which the curve has given arc lengths.

        Use it to sample a curve at constant speed, that is at equal distances along the curve.

        Parameters
        ----------
        s : array_like
            Arc lengths from the start of the domain, between 0 and the length of the curve, of any shape.
        per_curve : bool, default False
            True if every curve of a batch has its own arc lengths. The leading axes of s are then the batch axes.

        Returns
        -------
        ndarray or float, shape ``(*batch axes, *s.shape)``
            Times, the inverse of `arc_length`. If the curve rests, this is the first time with this arc length. Dates
            are in nanoseconds. Curves that failed have NaN or NaT.

        Raises
        ------
        ValidationError
            If an arc length is negative or exceeds the length of the curve.

        See Also
        --------
        Curve.arc_length : Compute the length of the curve from its start to given times.

        Examples
        --------
        Five points at equal distances along a curve:

        >>> import numpy as np
        >>> import symspline as ss
        >>> curve = ss.HermiteSpline([0, 1], [[0.0], [1.0]], [[0.0], [2.0]], "r:1")  # x = t²
        >>> t = curve.at_length(np.linspace(0, curve.length(), 5))
        >>> curve(t)[:, 0].round(12)
        array([0.  , 0.25, 0.5 , 0.75, 1.  ])
        """
        array = as_array(s, "s")
        if array.dtype.kind not in "biuf":
            raise ValidationError(f"s must be real numbers, not {array.dtype}")
        batch, own = self._batch, checked_flag(per_curve, "per_curve")
        if own and array.shape[: len(batch)] != batch:
            raise ValidationError(
                f"with per_curve=True the shape of s must begin with the batch axes {batch}; got {array.shape}"
            )
        wanted = self._with_batch(cast(array), own, array.ndim - len(batch) * own)
        if 0 in batch:
            return self._shown_times(wanted)
        total = self._arc.lengths[:, -1].reshape(batch + (1,) * (wanted.ndim - len(batch)))
        # An arc length that exceeds the length by rounding is the length, such as the last of np.linspace.
        reach = _ROUNDING * total
        wrong = ~((wanted >= -reach) & (wanted <= total + reach)) & ~np.isnan(total)
        refuse(
            wrong | np.isnan(wanted),
            "s",
            lambda i: (
                f"= {wanted[i]} is not an arc length of the curve: it must be between 0 and "
                f"{np.broadcast_to(total, wanted.shape)[i]}"
            ),
        )
        times = np.asarray(self._by_columns(ArcLength.times_at, np.clip(wanted, 0.0, total)))
        found: Time = self._shown_times(times)[()]
        return found

    @abstractmethod
    def _core_times(self, x: TimesLike, name: str, per_curve: bool = False) -> tuple[Doubles, bool]:
        """Return times as numbers of the core, and whether each curve then has its own times.

        Raises
        ------
        ValidationError
            If a time is not in the domain of the curve.
        """

    @property
    def _domain_ends(self) -> list[tuple[Doubles, bool]]:
        """First and last time as numbers of the core, and whether each curve has its own."""
        times = self._curve.times
        return [(np.asarray(times[..., i]), times.ndim > 1) for i in (0, -1)]

    def _with_batch(self, x: Doubles, own: bool, inner: int) -> Doubles:
        """Return an array of one value per curve and sample, shape (*batch, ...) with `inner` axes of samples."""
        batch = self._batch
        lead, shape = (batch, x.shape[len(batch) :]) if own else ((1,) * len(batch), x.shape)
        ones = (1,) * (inner - len(shape))
        return np.broadcast_to(x.reshape(lead + ones + shape), batch + ones + shape)

    def _by_columns(self, call: Callable[..., Doubles], *arrays: Doubles) -> Number:
        """Call a method of the arc length, which takes shape (*batch, m), for any number of axes of samples."""
        shape = arrays[0].shape
        if 0 in shape:
            return np.zeros(shape)
        values: Number = call(self._arc, *arrays)[()]
        return values

    def bending_energy(self) -> Number:
        r"""Compute the bending energy of the curve.

        Returns
        -------
        ndarray or float, shape ``batch axes``
            The integral of the squared covariant acceleration.

        Notes
        -----
        The bending energy is :math:`\int \lVert\nabla_{\gamma'}\gamma'\rVert^2 \, dt`, equation (1) of the paper.
        Riemannian cubics minimise it.

        References
        ----------
        G. Bogfjellmo, K. Modin, O. Verdier, A Numerical Algorithm for C²-Splines on Symmetric Spaces, SIAM J. Numer.
        Anal. 56 (2018), equation (1).

        Examples
        --------
        >>> import symspline as ss
        >>> wave = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1")
        >>> round(float(wave.bending_energy()), 8)
        6.0
        """
        return bending_energy(self._curve)

    @classmethod
    def _of(cls, *parts: Any) -> Self:
        """Return a curve with the given state, without checks or a fit."""
        self = cls.__new__(cls)
        self._fill(*parts)
        return self

    @abstractmethod
    def _fill(self, *parts: Any) -> None:
        """Set the state of the curve."""

    # ---- batches ----

    @property
    def _batch(self) -> tuple[int, ...]:
        return self._curve.batch

    @property
    def _batch_text(self) -> str:
        """The batch in the representation of the curve."""
        return f"{' x '.join(map(str, self._batch))} curves, " if self._batch else ""

    @property
    def _span_text(self) -> str:
        """The domain in the representation of the curve."""
        first, last = self.domain
        if np.ndim(first):
            return "each with its own times"
        return f"from {_time_text(first)} to {_time_text(last)}"

    @abstractmethod
    def _picked(self, index: Any) -> Self:
        """Return one curve of a batch, or a slice of the batch."""

    def __len__(self) -> int:
        if not self._batch:
            raise TypeError("this is one curve; only a batch of curves has a length (see also .length())")
        return self._batch[0]

    def __getitem__(self, index: int | np.integer[Any] | slice[Any, Any, Any]) -> Self:
        """Return one curve of a batch, or a slice of the batch."""
        if not self._batch:
            raise TypeError("this is one curve; only a batch of curves can be indexed")
        if not isinstance(index, (int, np.integer, slice)):
            raise TypeError(f"the index of a curve must be an integer or a slice, not {short_repr(index)}")
        if not isinstance(index, slice) and not -len(self) <= index < len(self):
            raise IndexError(f"index {short_repr(index)} is out of range: there are {len(self)} curves")
        return self._picked(index)

    def __bool__(self) -> bool:
        return True

    def __iter__(self) -> Iterator[Self]:
        return (self[i] for i in range(len(self)))

    # ---- files and pickles ----

    __hash__: ClassVar[None] = None  # type: ignore[assignment]

    def save(self, file: File) -> None:
        """Write the curve to an NPZ file.

        `load` reads it back without a new fit.

        Parameters
        ----------
        file : str, path or file object
            Name of the file, or a binary file that is open for writing. An existing file of this name is replaced only
            when the new one is complete.

        Raises
        ------
        ValidationError
            If the space is a `Manifold` made of functions, which cannot be stored.
        OSError
            If the file cannot be written.

        See Also
        --------
        load : Read a curve.
        save : Write several curves to one file.

        Examples
        --------
        >>> import io, symspline as ss
        >>> file = io.BytesIO()
        >>> ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], "sphere:2").save(file)
        >>> _ = file.seek(0)
        >>> ss.load(file)
        <CubicSpline on Sphere(2): 2 points, from 0 to 1, natural>
        """
        archive.write(file, self._state())

    def __reduce__(self) -> tuple[Any, ...]:
        return archive.restore, (self._state(),)

    @abstractmethod
    def _state(self) -> dict[str, Any]:
        """Return the entries of files and pickles."""

    @classmethod
    @abstractmethod
    def _from_state(cls, state: archive.Entries) -> Self:
        """Return the curve of a state."""


def _time_text(x: Any) -> str:
    """Return a time in a few characters; dates without the zeros at their end."""
    if isinstance(x, np.datetime64):
        return re.sub(r"(:00)?\.?0*$", "", str(x)) if "." in str(x) else str(x)
    return f"{float(x):.6g}" if abs(float(x)) < 1e6 else f"{float(x):.13g}"


# ---- plots and animations of all curves ----

# Resolution of pictures in notebooks, in dots per inch.
_DOTS = 60


class CurvePlots(CurveBase[P]):
    """The part of `Curve` that draws."""

    # ---- what a plot shows, which classes of curves override ----

    # Title of plots.
    _kind: ClassVar[str] = "Curve"

    def _made_of(self, radius: float | None = None) -> str:
        """Return a description of the data, for the title of a plot; noise in metres on a globe of a given radius."""
        return ""

    @property
    def _unconverged(self) -> int:
        """Number of curves that failed."""
        return 0

    @property
    def _node_times(self) -> Doubles:
        """Times of the core at which one curve passes through given points; empty if there are none."""
        return np.empty(0)

    @property
    def _rate_limits(self) -> list[tuple[float, float]]:
        """Limits of speed and acceleration in each factor of the space; empty if there are none."""
        return []

    @property
    def _breaks(self) -> Doubles:
        """Starts and ends of gaps in the curve as times of the core, shape (m, 2)."""
        return np.empty((0, 2))

    def _noise_beside(self, index: tuple[int, ...], x: Doubles) -> UncertaintyBand | None:
        """Return the noisy data of one curve of a batch, with uncertainty bands at times x of the core.

        Curves that pass through their points have none and return None.
        """
        return None

    def _panels_below(self, x: Doubles) -> list[SidePanel]:
        """Return the bands at times x of the core, and the residuals of measurements that are not points, for plots."""
        return []

    # ---- plots ----

    def _repr_html_(self) -> str:
        """Return the representation for notebooks, with a small plot if Matplotlib is installed."""
        text = f"<pre>{escape(repr(self))}</pre>"
        if find_spec("matplotlib") is None:
            return text
        picture = BytesIO()
        try:
            self.plot().savefig(picture, format="png", dpi=_DOTS)
        except ValidationError:
            # Curves that failed cannot be plotted.
            return text
        data = b64encode(picture.getvalue()).decode()
        return f'{text}<img src="data:image/png;base64,{data}" alt="{escape(repr(self))}">'

    @overload
    def plot(
        self,
        file: File | None = None,
        *,
        ax: None = None,
        **look: Unpack[PageLook],
    ) -> Figure: ...
    @overload
    def plot(
        self,
        file: None = None,
        *,
        ax: Axes,
        **look: Unpack[AxesLook],
    ) -> Axes: ...
    def plot(
        self,
        file: File | None = None,
        *,
        ax: Axes | None = None,
        color: str | tuple[float, ...] | None = None,
        label: str | None = None,
        title: str | None = None,
        figsize: tuple[float, float] | None = None,
        show: bool = False,
    ) -> Figure | Axes:
        """Plot the curve, its velocity and its covariant acceleration.

        Without `ax`, a figure with several panels is created. The first panel depends on the space:

        - S²: a globe and a map, or an enlarged part; H²: the Poincaré disk; R¹, R² and R³: the graph or the curve.
        - SO(3), O(3), SU(2) and S³ (unit quaternions, scalar first): rotated frames along the time axis. Graphs of the
          rotation vectors, if rotations are small, noisy, have long gaps, or are beside other curves or factors.
        - S¹, SO(2), O(2), U(1), RP¹ and Gr(1, 2): the continuous angle against time.
        - SE(3): frames along the path of the positions; SE(2): arrow heads on it.
        - CP¹ and the complex Gr(1, 2): the Bloch sphere.
        - RP², Gr(1, 3) and Gr(2, 3): a hemisphere, with the normals of planes. A curve that leaves it through the rim
          re-enters on the opposite side.
        - Other projective spaces and Grassmannians: the principal angles to the first point.
        - SPD(2) and SPD(3): ellipses and ellipsoids along the time axis; larger SPD(n), as covariance matrices: their
          standard deviations and correlations.
        - Tori: the angles in degrees; lines break where an angle passes 180 degrees.
        - Stiefel manifolds: the components of each column against time.
        - All other spaces: the components against time, with dashed imaginary parts. If there are more than twelve,
          the twelve with the largest ranges have names.

        A product has one such panel per factor. The other panels show the speed |γ'| and the size |∇γ'| of the
        covariant acceleration, with one panel per factor of a product. In one dimension both have a sign. For poses,
        rates of rotation and of translation have separate panels, because their units differ. Dashed lines show the
        limits of a curve that was retimed by a law of `time_law`. Rates that are small per second are per hour, day or
        year.

        Parameters
        ----------
        file : str, path or file object, optional
            File to which the figure is saved, such as ``"curve.pdf"``.
        ax : matplotlib.axes.Axes, optional
            Axes into which the first panel is drawn, without the others. R³ and SE(3) need axes with
            ``projection="3d"``, all other spaces ordinary ones. The axes keep their style, and numbers stay as they
            are on the time axis.
        color : color, optional
            Colour of the curve, in any form that Matplotlib accepts. By default, the next colour of the property cycle
            of `ax`, or a dark blue. On a page, components of a point have colours of their own.
        label : str, optional
            Name of the curve in legends.
        title : str, optional
            Title of the figure, or of `ax`.
        figsize : pair of float, optional
            Width and height of the figure in inches. Text is smaller on a page that is smaller than the default.
        show : bool, default False
            Whether to open a window by pyplot, in which you can rotate three-dimensional pictures.

        Returns
        -------
        matplotlib.figure.Figure or matplotlib.axes.Axes
            The figure, which you can modify or save, or `ax`.

        Raises
        ------
        ValidationError
            If an argument is invalid, if `ax` does not suit the space, or if no curve of a batch is finite.
        ImportError
            If Matplotlib is not installed.

        See Also
        --------
        plot : Compare several curves and data.
        Curve.animate : Show the motion along the curve.

        Notes
        -----
        A smoothing spline is drawn with its data and, where possible, with 95 % bands of the curve and the speed. A
        curve of `estimate` is drawn with all points among its measurements. It has a panel with the residuals of every
        other measurement in standard deviations, and one with the radius of the 95 % band if the first panel does not
        show the band.

        Of a batch of more than five curves, three are drawn with their points, or their mean if they are close to it.
        Areas between the 5 % and the 95 % quantile represent the others where numbers are drawn against time, and thin
        lines do so elsewhere.

        Times that are far from zero, such as seconds since 1970, are shown as differences from a round number, which
        the label of the axis names.

        Fonts, font sizes and dark backgrounds follow your settings of Matplotlib. The method does not change them, and
        it uses pyplot only if `show` is True.

        Examples
        --------
        >>> import symspline as ss
        >>> quarter = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], ss.Sphere(2))
        >>> figure = quarter.plot()

        Draw into existing axes:

        >>> from matplotlib.figure import Figure
        >>> ax = Figure().add_subplot()
        >>> ax = quarter.plot(ax=ax, label="quarter")
        >>> legend = ax.legend()
        """
        require_matplotlib()
        from .._plotting import checked_look, plot

        look = checked_look(file, ax, color, label, title, figsize, show)
        drawn: Figure | Axes = plot(self, file, ax=ax, show=show, **look)
        return drawn

    def animate(
        self,
        file: File | None = None,
        *,
        frames: int = 60,
        fps: float = 15,
        color: str | tuple[float, ...] | None = None,
        title: str | None = None,
        figsize: tuple[float, float] | None = None,
    ) -> FuncAnimation:
        """Animate the motion along the curve.

        The pages of `plot` are shown with a marker, or a frame for rotations and poses, that moves along the curve. A
        vertical line marks the time in all panels with a time axis, and the time is printed in the upper right corner.

        Parameters
        ----------
        file : str or path, optional
            File to which the animation is saved, such as ``"curve.gif"`` or ``"curve.mp4"``. The latter needs ffmpeg.
        frames : int, default 60
            Number of frames, at equal distances in time.
        fps : float, default 15
            Frames per second.
        color : color, optional
            Colour of the curve.
        title : str, optional
            Title of the figure.
        figsize : pair of float, optional
            Width and height of the figure in inches.

        Returns
        -------
        matplotlib.animation.FuncAnimation
            The animation. In a notebook, show it by ``IPython.display.HTML(animation.to_jshtml())``.

        Raises
        ------
        ValidationError
            If an argument is invalid, if this is a batch, or if ffmpeg is needed and not installed.
        ImportError
            If Matplotlib is not installed.

        See Also
        --------
        Curve.plot : Plot the curve.

        Examples
        --------
        >>> import io, symspline as ss
        >>> turn = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "sphere:2")
        >>> animation = turn.animate("turn.gif", frames=2)  # doctest: +SKIP
        """
        require_matplotlib()
        from .._plotting import animate, checked_look

        look = checked_look(file, None, color, None, title, figsize, False)
        moving: FuncAnimation = animate(self, file, frames, fps, **look)
        return moving


# ---- the base class of all curves, with parts, copies in other times, and curves one after the other ----

_LARGEST = float(np.finfo(np.float64).max)
# Largest distance between the points at which two curves meet, relative to large coordinates.
_MEETING = 1e-8
# Times at which the values of a law are compared with the domain of the curve.
_SAMPLES = 1001
# Rounding errors of a knot by which its times differ, if they are computed in two ways.
_KNOT_ROUNDING = 16
# Steps of bisection from any interval to neighbouring floating-point numbers near its middle.
_BISECTIONS = 60


@dataclass(frozen=True)
class Derivative(Generic[P]):
    """A derivative of a curve, as a function of time.

    `Curve.derivative` returns objects of this class.

    Attributes
    ----------
    curve : Curve
        The curve.
    nu : int
        Order of the derivative.

    Examples
    --------
    >>> import symspline as ss
    >>> velocity = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1").derivative()
    >>> velocity([0.0, 2.0])[:, 0]
    array([ 1.5, -1.5])
    """

    curve: Curve[P]
    nu: int

    def __call__(self, x: TimesLike, nu: int = 0, **options: Any) -> P:
        """Evaluate the derivative, or a further derivative of it.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, as in a call of the curve.
        nu : int, default 0
            Order of the further derivative.
        **options
            Keyword arguments of a call of the curve.

        Returns
        -------
        ndarray or tuple of ndarray
            Tangent vectors, shape ``(*batch axes, *x.shape, *point_shape)``.
        """
        most = self.curve._curve.max_nu - self.nu
        order = order_of(nu, most) if most else order_of(nu, 0)
        at: Any = x
        values: P = self.curve(at, self.nu + order, **options)
        return values

    def derivative(self, nu: int = 1) -> Derivative[P]:
        """Return a further derivative.

        Parameters
        ----------
        nu : int, default 1
            Order of the further derivative.

        Returns
        -------
        Derivative
            The derivative of the curve of order ``self.nu + nu``.

        Examples
        --------
        >>> import symspline as ss
        >>> curve = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1")
        >>> curve.derivative().derivative()(1.0)
        array([-3.])
        """
        return self.curve.derivative(self.nu + order_of(nu, 3))


class Curve(CurvePlots[P]):
    """A curve on a space, or a batch of curves.

    This is the base class of `CubicSpline`, `HermiteSpline`, `PiecewiseGeodesic`, `SmoothingSpline`, `BSpline`,
    `BezierCurve` and `CumulativeBSpline`. Call a curve to evaluate it or its derivatives. A batch is a sequence of
    curves.

    Examples
    --------
    >>> import symspline as ss
    >>> points = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> curves = ss.CubicSpline(None, points, "sphere:2"), ss.BezierCurve(points, "sphere:2")
    >>> [isinstance(curve, ss.Curve) for curve in curves]
    [True, True]
    >>> [curve.length().round(4).item() for curve in curves]
    [3.2601, 2.4139]
    """

    def restrict(self, a: TimesLike | None = None, b: TimesLike | None = None) -> Curve[P]:
        """Return the part of the curve between two times.

        Parameters
        ----------
        a, b : float or datetime64, optional
            Start and end of the part. By default, the start and the end of the curve.

        Returns
        -------
        Curve
            A curve with the domain from a to b. A curve of cubic segments that is cut at its knots gives a
            `HermiteSpline`, a `PiecewiseGeodesic` one of the same class, and a `SegmentedCurve` one with fewer
            segments. All other curves give a `RetimedCurve`.

        Raises
        ------
        ValidationError
            If a time is not in the domain of the curve, or b is not after a.

        See Also
        --------
        Curve.concatenate : Join two curves.

        Notes
        -----
        The part is exact. On a curved space part of a segment is in general not a cubic Bézier curve. Between knots,
        the result therefore refers to the whole curve.

        Examples
        --------
        >>> import symspline as ss
        >>> spline = ss.CubicSpline(None, [[0.0], [1.0], [0.0], [2.0]], "r:1")
        >>> spline.restrict(1, 3)
        <HermiteSpline on Euclidean(1): 3 points, from 1 to 3>
        >>> part = spline.restrict(0.5, 2.5)
        >>> part.domain, bool(part(1.5) == spline(1.5))
        ((np.float64(0.5), np.float64(2.5)), True)
        """
        return self._restricted(*self._part_ends(a, b))

    def concatenate(self, other: Curve[P]) -> Curve[P]:
        """Return this curve followed by another one.

        Parameters
        ----------
        other : Curve
            A curve on the same space that begins at the time and the point at which this curve ends.

        Returns
        -------
        Curve
            A `HermiteSpline` if both curves consist of cubic segments and their velocities agree where they meet, and
            a `SegmentedCurve` otherwise. At the common time, derivatives are those of the second curve.

        Raises
        ------
        ValidationError
            If the curves are on different spaces, or do not meet.

        See Also
        --------
        Curve.shift : Move a curve in time.
        SegmentedCurve : Join curves with gaps between them.

        Notes
        -----
        Both curves remain as they are. The velocity of the result jumps if their velocities differ where they meet.

        Examples
        --------
        >>> import symspline as ss
        >>> spline = ss.CubicSpline(None, [[0.0], [1.0], [0.0], [2.0]], "r:1")
        >>> spline.restrict(0, 1).concatenate(spline.restrict(1, 3))
        <HermiteSpline on Euclidean(1): 4 points, from 0 to 3>
        """
        if not isinstance(other, Curve):
            raise TypeError(f"other must be a curve, not {short_repr(other)}")
        _check_meeting(self, other)
        merged = self._merged(other)
        if merged is not None:
            return merged
        # Without nesting, the depth of curves that are joined in a loop does not grow.
        found: Curve[P] = archive.FORMATS["symspline-segments"]([*self._in_segments(), *other._in_segments()])
        return found

    def reverse(self) -> Curve[P]:
        """Return the curve in the opposite direction, over the same domain.

        Returns
        -------
        Curve
            A curve whose point at time x is that of this curve at time ``a + b - x``, where a and b are the ends of the
            domain. A curve of cubic segments gives a `HermiteSpline`, a `PiecewiseGeodesic` one of the same class, and
            all other curves a `RetimedCurve`.

        Notes
        -----
        The result is exact, and its covariant acceleration is continuous where that of the curve is.

        Examples
        --------
        >>> import symspline as ss
        >>> spline = ss.CubicSpline([0, 1, 4], [[0.0], [1.0], [0.0]], "r:1")
        >>> spline.reverse()(3.0)
        array([1.])
        """
        return self._reversed()

    def shift(self, dt: float | str | timedelta | np.timedelta64) -> Curve[P]:
        """Return the curve at times that are later by a constant.

        Parameters
        ----------
        dt : float, str or timedelta64
            Time by which the curve moves. If its times are dates, a ``timedelta``, a ``timedelta64`` or a text such as
            ``"3h"``, otherwise a number. Negative values move the curve to earlier times.

        Returns
        -------
        Curve
            A curve whose point at time ``x + dt`` is that of this curve at time x. A curve of cubic segments gives a
            `HermiteSpline`, a `PiecewiseGeodesic` and a `SegmentedCurve` one of the same class, and all other curves a
            `RetimedCurve`.

        Raises
        ------
        ValidationError
            If `dt` is invalid, or so large that times coincide after rounding.

        Examples
        --------
        >>> import symspline as ss
        >>> ss.CubicSpline([0, 1, 4], [[0.0], [1.0], [0.0]], "r:1").shift(10).domain
        (np.float64(10.0), np.float64(14.0))
        """
        return self._shifted(_checked_shift(self._time_axis, dt))

    def retime(self, law: Callable[..., Any], *, domain: ArrayLike | None = None) -> Curve[P]:
        r"""Return the same path with another time law.

        Parameters
        ----------
        law : callable
            Function σ that takes a time x of the new curve, and as second argument the order of a derivative. It
            returns a time of this curve: seconds since its start if its times are dates. Pass a result of `time_law`,
            or a SciPy spline such as ``PchipInterpolator``.
        domain : array_like, shape (2,), optional
            First and last time of the new curve. By default, the domain of the law.

        Returns
        -------
        RetimedCurve
            The curve :math:`x \mapsto \gamma(\sigma(x))`. Its times are numbers.

        Raises
        ------
        ValidationError
            If the law is invalid, or returns a time outside the domain of this curve.

        See Also
        --------
        time_law : Compute the fastest law within limits of speed and acceleration.

        Notes
        -----
        By the chain rule the velocity is :math:`\sigma' \gamma'`, and the covariant acceleration is
        :math:`\sigma'^2 \nabla_{\gamma'}\gamma' + \sigma'' \gamma'`.

        Examples
        --------
        Traverse a curve with a smooth start and a smooth end:

        >>> import symspline as ss
        >>> from scipy.interpolate import CubicHermiteSpline
        >>> curve = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], "sphere:2")
        >>> slow = curve.retime(CubicHermiteSpline([0, 4], [0, 1], [0, 0]))
        >>> slow.speed([0.0, 2.0, 4.0]).round(4)
        array([0.   , 0.589, 0.   ])
        """
        if self._curve.times.ndim > 1:
            raise ValidationError(
                "retime needs curves that share their times. Retime the curves of the batch one by one."
            )
        start, stop = _law_domain(law, domain)
        origin = 0.0 if self._time_axis.plain or self._time_axis.dates else float(self._time_axis.origin)
        shifted = _Law(law, origin)
        times = _smooth_parts(shifted, start, stop, self._curve.times)
        curve: Curve[P] = _retimed(self, TimeAxis(), shifted, times)
        # The values of the law must be in the domain, also between its knots.
        curve(np.concatenate([times, np.linspace(start, stop, _SAMPLES)]))
        return curve

    def derivative(self, nu: int = 1) -> Derivative[P]:
        """Return a derivative of the curve as a function of time.

        Parameters
        ----------
        nu : int, default 1
            Order of the derivative, at most 3 (2 for B-spline and Bézier curves, and for general time laws).

        Returns
        -------
        Derivative
            Function of x that returns ``curve(x, nu)``.

        Examples
        --------
        >>> import symspline as ss
        >>> curve = ss.CubicSpline(None, [[0.0], [1.0], [0.0]], "r:1")
        >>> acceleration = curve.derivative(2)
        >>> acceleration([0.5, 1.0])[:, 0]
        array([-1.5, -3. ])
        """
        return Derivative(self, order_of(nu, self._curve.max_nu))

    # ---- hooks that classes of curves override ----

    def _restricted(self, start: Doubles, stop: Doubles) -> Curve[P]:
        """Return the part between two times of the core, one per curve if each curve has its own times."""
        times = part_of_times(self._curve.times, start, stop, self._batch)
        curve: Curve[P] = _retimed(self, self._time_axis, Affine(), times)
        return curve

    def _reversed(self) -> Curve[P]:
        times = self._curve.times
        law = Affine(-1, times[..., 0] + times[..., -1])
        mirrored = np.clip(np.asarray(law(times))[..., ::-1], times[..., :1], times[..., -1:])
        curve: Curve[P] = _retimed(self, self._time_axis, law, np.ascontiguousarray(mirrored))
        return curve

    def _shifted(self, step: Any) -> Curve[P]:
        time_axis, times, law = self._time_axis, self._curve.times, Affine()
        if time_axis.plain:
            times, law = times + step, Affine(1, -float(step))
            check_increasing(times)
        else:
            time_axis = replace(time_axis, origin=time_axis.origin + step)
        curve: Curve[P] = _retimed(self, time_axis, law, times)
        return curve

    def _part_ends(self, a: TimesLike | None, b: TimesLike | None) -> tuple[Doubles, Doubles]:
        """Return the ends of a part as numbers of the core, one per curve if each curve has its own times."""
        ends = []
        for number, (x, name) in enumerate([(a, "a"), (b, "b")]):
            own_axes = self._domain_ends[number]
            time, own = own_axes if x is None else self._core_times(x, name)
            if time.ndim > len(self._batch) * own:
                raise ValidationError(f"{name} must be a single time, not an array of shape {time.shape}")
            ends.append(time)
        start, stop = ends
        if not (start < stop).all():
            raise ValidationError("b must be after a. Exchange a and b, or omit one of them.")
        return start, stop

    def _in_segments(self) -> Sequence[Curve[P]]:
        """Return the segments of which the curve consists."""
        return [self]

    def _merged(self, other: Curve[P]) -> Curve[P] | None:
        """Return this curve and another one as one curve of cubic segments, or None if this is not possible."""
        return None


@dataclass(frozen=True)
class _Law:
    """A time law, with values that are counted from an origin."""

    function: Callable[..., Any]
    origin: float

    def __call__(self, x: Any, nu: int = 0, /) -> Any:
        try:
            values = np.asarray(self.function(x, nu), np.float64)
        except TypeError as error:
            raise ValidationError(
                f"law must take times and the order of a derivative, as law(x, nu); it raises: {error}"
            ) from None
        if values.shape != np.shape(x):
            raise ValidationError(f"law returns shape {values.shape} for times of shape {np.shape(x)}")
        return values if nu else values - self.origin


def _checked_shift(time_axis: TimeAxis, dt: Any) -> Any:
    """Return the time by which knots move, in a type that can be added to them."""
    if time_axis.dates:
        if isinstance(dt, str):
            dt = np.timedelta64(round(1e9 * seconds_of(dt.removeprefix("-"), "dt")), "ns") * (-1) ** dt.startswith("-")
        if not isinstance(dt, (timedelta, np.timedelta64)) or np.isnat(np.timedelta64(dt)):
            raise ValidationError(
                f"the knots are dates, so dt must be a timedelta64 or a text such as '3h', not {short_repr(dt)}"
            )
        return getattr(dt, "asm8", np.timedelta64(dt))
    if isinstance(dt, np.timedelta64):
        raise ValidationError(f"the times are numbers, so dt must be a finite number, not {short_repr(dt)}")
    # Comparison is exact for integers of any size.
    step = checked_number(dt, "the knots are numbers, so dt must be a finite number", lambda x: abs(x) <= _LARGEST)
    exact = isinstance(dt, (int, np.integer)) and abs(int(dt)) < 2**62
    return int(dt) if exact else step


def check_increasing(times: Doubles) -> None:
    """Raise ValidationError if times coincide after a shift."""
    if not (np.diff(times) > 0).all():
        raise ValidationError("knots coincide after rounding. Use a smaller dt, or dates.")


def _retimed(source: Curve[Any], time_axis: TimeAxis, law: TimeMap, times: Doubles) -> Any:
    return archive.FORMATS["symspline-retimed"]._of(source, time_axis, law, times)


def _law_domain(law: Any, domain: Any) -> tuple[float, float]:
    """Return the first and last time of a law, from the user or from the attributes that laws of SciPy have."""
    if not callable(law):
        raise ValidationError(f"law must be a function law(x, nu), not {short_repr(law)}")
    if domain is None:
        domain = getattr(law, "domain", None)
    knots = getattr(law, "x", None)
    if domain is None and isinstance(knots, np.ndarray) and knots.ndim == 1:
        domain = knots[[0, -1]]
    if domain is None:
        raise ValidationError("the law has no domain. Pass the first and the last time of the new curve as domain.")
    ends = as_array(domain, "domain")
    if ends.shape != (2,) or ends.dtype.kind not in "iuf" or not np.isfinite(ends).all() or not ends[0] < ends[1]:
        raise ValidationError(f"domain must be two increasing finite numbers, not {short_repr(domain)}")
    return float(ends[0]), float(ends[1])


def _smooth_parts(law: _Law, start: float, stop: float, knots: Doubles) -> Doubles:
    """Return times between which the retimed curve is smooth: the knots of the law, and where it meets a knot.

    If the law does not increase, knots of the curve are not sought. Integrals then take more evaluations.
    """
    own = np.asarray(getattr(law.function, "x", getattr(law.function, "knots", ())), np.float64).ravel()
    times = np.unique(np.concatenate([[start], own[(own > start) & (own < stop)], [stop]]))
    sampled = np.unique(np.concatenate([times, np.linspace(start, stop, 4 * len(knots) + 1)]))
    values = law(sampled)
    if not (np.diff(values) >= 0).all():
        return times
    inner = knots[(knots > values[0]) & (knots < values[-1])]
    after = np.searchsorted(values, inner)
    low, high = sampled[after - 1], sampled[after]
    for _ in range(_BISECTIONS):
        middle = low / 2 + high / 2
        before = law(middle) < inner
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    # If a knot of the law coincides with a knot of the curve, both are in the list, with different rounding errors.
    after = np.clip(np.searchsorted(times, high), 1, len(times) - 1)
    near = np.where(high - times[after - 1] < times[after] - high, times[after - 1], times[after])
    same_value = np.abs(law(near) - inner) <= _KNOT_ROUNDING * np.spacing(np.abs(knots).max())
    same_time = np.abs(near - high) <= _KNOT_ROUNDING * np.spacing(np.abs(times).max())
    return np.unique(np.concatenate([times, high[~(same_value | same_time)]]))


def _check_meeting(first: Curve[Any], second: Curve[Any]) -> None:
    """Raise ValidationError unless the second curve begins at the time and the point at which the first ends."""
    if first.space != second.space:
        raise ValidationError(f"other is on {second.space!r}, but the curve is on {first.space!r}")
    if first._batch != second._batch:
        raise ValidationError(f"other has batch axes {second._batch}, but the curve has {first._batch}")
    if first._curve.times.ndim > 1 or second._curve.times.ndim > 1:
        raise ValidationError("curves of a batch must share their times. Concatenate them one by one.")
    stop: Any = first.domain[1]
    start: Any = second.domain[0]
    try:
        apart = abs((start - stop) / (np.timedelta64(1, "s") if first._time_axis.dates else 1))
        size = 0.0 if first._time_axis.dates else max(abs(start), abs(stop))
    except TypeError:
        raise ValidationError(
            f"other begins at {start}, but the curve ends at {stop}. Use numbers for both, or dates for both."
        ) from None
    if apart > 4 * np.spacing(size):
        raise ValidationError(
            f"other begins at {start}, but the curve ends at {stop}. Move it by other.shift(dt), or pass both curves "
            "to SegmentedCurve, which allows a gap."
        )
    for space, p, q in zip(
        factors_of(first.space),
        parts_of(first(stop), first.space, "points"),
        parts_of(second(start), second.space, "points"),
        strict=True,
    ):
        p, q = (np.reshape(own, (-1, *space.point_shape)) for own in (p, q))
        valid = space._where_finite(p) & space._where_finite(q)
        close = np.abs(p - q)[valid] <= _MEETING * np.maximum(1.0, np.abs(p)[valid])
        # Different arrays can represent one point of a quotient space.
        if not close.all() and not (space.distance(p[valid], q[valid]) <= _MEETING).all():
            raise ValidationError(
                f"other begins at {short_repr(q[0])}, but the curve ends at {short_repr(p[0])}. Both must be one point."
            )


# ---- the base class of curves whose times are numbers, dates or durations ----


class TimedCurve(Curve[P]):
    """Base class of curves with a time axis and an extrapolation policy."""

    _curve: AnyCurve
    _extrapolate: Extrapolate
    # Extrapolation policy, by its name in the core.
    _extrapolation_mode: str
    # End conditions, which determine whether curves are closed.
    _bc_type: BCType = "natural"

    @overload
    def __call__(
        self, x: TimesLike, nu: int = 0, *, dtype: None = None, out: None = None, **options: Unpack[EvaluationOptions]
    ) -> P: ...
    @overload
    def __call__(self, x: TimesLike, nu: int = 0, *, out: Out, **options: Unpack[EvaluationOptions]) -> Out: ...
    @overload
    def __call__(
        self: Curve[AnyArrays], x: TimesLike, nu: int = 0, *, dtype: DTypeLike, **options: Unpack[EvaluationOptions]
    ) -> AnyArrays: ...
    @overload
    def __call__(
        self: Curve[AnyArray], x: TimesLike, nu: int = 0, *, dtype: DTypeLike, **options: Unpack[EvaluationOptions]
    ) -> AnyArray: ...
    def __call__(
        self,
        x: TimesLike,
        nu: int = 0,
        *,
        extrapolate: Extrapolate = None,
        per_curve: bool = False,
        dtype: DTypeLike | None = None,
        progress: Progress | None = None,
        out: AnyArray | AnyArrays | None = None,
    ) -> Any:
        """Evaluate the curve or its derivatives.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape and in any order. If the knots are dates, times must be dates as well. If the knots had
            a time zone, pass times with any time zone, or ``datetime64`` in UTC; otherwise pass times without one.
        nu : {0, 1, 2, 3}, default 0
            Order of the derivative: 0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ', 3 for
            the covariant jerk ∇∇γ'. The jerk jumps at knots, where it is that of the segment after the knot.
        extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
            Extrapolation policy for this call. None means the policy of the curve.
        per_curve : bool, default False
            True if every curve of a batch has its own times. The leading axes of x are then the batch axes.
        dtype : {"float32", "float64"}, optional
            Precision of the result; ``"float32"`` gives complex64 on complex spaces. The computation is always in
            double precision.
        progress : callable, optional
            Function that is called from time to time with the finished and the total number of points.
        out : ndarray or tuple of ndarray, optional
            Array into which the result is written, and which is returned. For a `Product`, a tuple with one array per
            factor. An array that is not contiguous, or not of the type of the space, requires an additional copy.

        Returns
        -------
        ndarray or tuple of ndarray
            Points or tangent vectors, shape ``(*batch axes, *x.shape, *point_shape)``. With `per_curve`, the batch
            axes appear only once. For a `Product`, a tuple with one array per factor.

        Raises
        ------
        ValidationError
            If a time is not finite, if a time lies outside the knots and the policy does not allow it, if `out` cannot
            hold the result, or if both `out` and `dtype` are given.

        Notes
        -----
        The jerk is computed by differentiation of a polynomial that interpolates the acceleration on half a segment.
        Let a be the largest size of the acceleration on a segment and h the length of its interval. Errors are about
        1e-12 of a/h, and up to 1e-8 of it if the step between two points exceeds half of the distance to the cut locus.
        A `Manifold` must have a function `transport`, and errors are larger there, because accelerations are
        differences. If segments have many times, the jerk takes about three times as long as the acceleration.
        """
        if progress is not None:
            check_progress(progress)
        single = dtype is not None and is_single(dtype)
        if out is not None and dtype is not None:
            raise ValidationError("dtype and out are both given. Pass one of them; the result has the type of out.")
        quantity = quantity_of(nu, self._curve.max_nu)
        where = self._extrapolation_mode if extrapolate is None else self._where(extrapolate)
        values = evaluated(self._curve, self._time_axis, x, quantity, where, per_curve, progress, out)
        return in_single(values) if single else values

    def speed(
        self, x: TimesLike, *, extrapolate: Extrapolate = None, per_curve: bool = False, dtype: DTypeLike | None = None
    ) -> FloatArray:
        """Compute the speed of the curve.

        Parameters
        ----------
        x : array_like of float or datetime64
            Times, of any shape and in any order, as in a call of the curve.
        extrapolate : {None, "raise", True, False, "geodesic", "periodic"}, default None
            Extrapolation policy for this call. None means the policy of the curve.
        per_curve : bool, default False
            True if every curve of a batch has its own times.
        dtype : {"float32", "float64"}, optional
            Precision of the result.

        Returns
        -------
        ndarray or float, shape ``(*batch axes, *x.shape)``
            The norm of the velocity γ'.

        Raises
        ------
        ValidationError
            If `x` is invalid, as in a call of the curve.

        Examples
        --------
        >>> import symspline as ss
        >>> line = ss.CubicSpline([0, 2], [[0.0], [3.0]], "r:1")
        >>> line.speed([0.5, 1.0])
        array([1.5, 1.5])
        """
        single = dtype is not None and is_single(dtype)
        values = evaluated(self._curve, self._time_axis, x, "speed", self._where(extrapolate), per_curve)
        speeds: FloatArray = (in_single(values) if single else values)[()]
        return speeds

    def _where(self, extrapolate: Any) -> str:
        """Return the core's name of the extrapolation policy."""
        return (
            self._extrapolation_mode
            if extrapolate is None
            else extrapolation_mode(checked_extrapolate(extrapolate), self._bc_type)
        )

    def _core_times(self, x: Any, name: str, per_curve: bool = False) -> tuple[Doubles, bool]:
        batch, knots = self._batch, self._curve.times
        if per_curve and np.shape(x)[: len(batch)] != batch:
            raise ValidationError(
                f"with per_curve=True the shape of {name} must begin with the batch axes {batch}; got {np.shape(x)}"
            )
        times, own = self._time_axis.at(x, batch, per_curve, knots, name)
        if knots.ndim > 1 and not own:
            times, own = np.broadcast_to(times, batch + times.shape), True
        samples = (1,) * (times.ndim - len(batch) if own else 0)
        first, last = (
            end.reshape(end.shape + samples) if knots.ndim > 1 else end for end in (knots[..., 0], knots[..., -1])
        )

        def say(i: Any) -> str:
            ends = [np.broadcast_to(end, times.shape)[i] for end in (first, last)]
            where = f"outside the knots [{ends[0]}, {ends[1]}]" if np.isfinite(times[i]) else "not finite"
            return f"= {times[i]} is {where}"

        try:
            refuse(~((times >= first) & (times <= last)), name, say)
        except ValidationError as error:
            raise self._time_axis.explain(error) from None
        return times, own

    def _shown_times(self, x: Doubles) -> NDArray[Any]:
        return self._time_axis.shown(x, self._batch)

    @property
    def extrapolate(self) -> Extrapolate:
        """Extrapolation policy, as passed to the constructor."""
        return self._extrapolate


def check_timed(spline: Any, name: str = "spline") -> None:
    """Raise TypeError unless an argument is a curve with a time axis."""
    if not isinstance(spline, TimedCurve):
        what = "a curve with knots and velocities, such as a symspline.CubicSpline, or made of such curves"
        raise TypeError(f"{name} must be {what}, not {short_repr(spline)}")
