"""Plots and animations of all curves."""

from __future__ import annotations

from base64 import b64encode
from html import escape
from importlib.util import find_spec
from io import BytesIO
from typing import TYPE_CHECKING, ClassVar, Unpack, overload

import numpy as np

from .._base.typing import AxesLook, File, P, PageLook
from .._core import ValidationError
from .._curves.curve import SidePanel, UncertaintyBand
from .._curves.options import require_matplotlib
from .._spaces import Doubles
from .curve_base import CurveBase

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
