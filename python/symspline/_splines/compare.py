"""One picture of several curves and data."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, overload

from .._base.arrays import short_repr
from .._base.typing import File
from .._core import ValidationError
from .._curves.options import require_matplotlib
from .base import Curve

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    Color = str | tuple[float, ...]
    Item = Curve[Any] | tuple[Any, Any]


@overload
def plot(
    curves: Curve[Any] | Iterable[Item],
    file: File | None = None,
    *,
    labels: Sequence[str | None] | None = None,
    colors: Sequence[Color] | None = None,
    ax: None = None,
    title: str | None = None,
    figsize: tuple[float, float] | None = None,
    show: bool = False,
) -> Figure: ...
@overload
def plot(
    curves: Curve[Any] | Iterable[Item],
    file: None = None,
    *,
    labels: Sequence[str | None] | None = None,
    colors: Sequence[Color] | None = None,
    ax: Axes,
    title: str | None = None,
    figsize: None = None,
    show: bool = False,
) -> Axes: ...
def plot(
    curves: Curve[Any] | Iterable[Item],
    file: File | None = None,
    *,
    labels: Sequence[str | None] | None = None,
    colors: Sequence[Color] | None = None,
    ax: Axes | None = None,
    title: str | None = None,
    figsize: tuple[float, float] | None = None,
    show: bool = False,
) -> Figure | Axes:
    """Compare curves and data in one picture.

    Parameters
    ----------
    curves : sequence
        Curves of any class on one space, such as the list that `fit_many` returns. A pair ``(t, points)`` of arrays is
        drawn as dots; missing points are omitted. At least one entry must be a curve.
    file : str, path or file object, optional
        File to which the figure is saved, such as ``"comparison.pdf"``.
    labels : sequence of str, optional
        Names for the legend, one per entry.
    colors : sequence of color, optional
        Colours, one per entry.
    ax : matplotlib.axes.Axes, optional
        Axes into which the picture is drawn, without further panels; see `Curve.plot`.
    title : str, optional
        Title of the figure, or of `ax`.
    figsize : pair of float, optional
        Width and height of the figure in inches.
    show : bool, default False
        Whether to open a window by pyplot.

    Returns
    -------
    matplotlib.figure.Figure or matplotlib.axes.Axes
        The figure, which you can modify or save, or `ax`.

    Raises
    ------
    ValidationError
        If there is no curve, if an entry is a batch or on another space, or if an option is invalid.
    ImportError
        If Matplotlib is not installed.

    See Also
    --------
    Curve.plot : Plot one curve or a batch.

    Examples
    --------
    >>> import symspline as ss
    >>> points = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> spline, polygon = ss.CubicSpline(None, points, "sphere:2"), ss.PiecewiseGeodesic(None, points, "sphere:2")
    >>> figure = ss.plot([spline, polygon], labels=["C² spline", "geodesics"])
    """
    require_matplotlib()
    from .._plotting import checked_look, compare

    look = checked_look(file, ax, None, None, title, figsize, show)
    items = checked_items(curves)
    drawn: Figure | Axes = compare(items, labels, file, colors=colors, ax=ax, show=show, **look)
    return drawn


def checked_items(curves: Any, name: str = "curves") -> list[Any]:
    if isinstance(curves, Curve):
        curves = [curves]
    if not isinstance(curves, Iterable) or isinstance(curves, (str, bytes, dict)):
        raise TypeError(f"{name} must be a sequence of curves, not {short_repr(curves)}")
    items = list(curves)
    for i, own in enumerate(items):
        is_data = isinstance(own, tuple) and len(own) == 2
        if not (isinstance(own, Curve) or is_data):
            raise TypeError(f"{name}[{i}] must be a curve or a pair (t, points), not {short_repr(own)}")
        if isinstance(own, Curve) and own._batch:
            raise ValidationError(f"{name}[{i}] is a batch of {len(own)} curves. Pass its curves: [*batch].")
    first = next((own for own in items if isinstance(own, Curve)), None)
    if first is None:
        raise ValidationError(f"{name} must contain at least one curve, which determines the space")
    for i, own in enumerate(items):
        if isinstance(own, Curve) and own.space != first.space:
            raise ValidationError(f"{name}[{i}] is on {own.space!r}, but the first curve is on {first.space!r}")
    return items
