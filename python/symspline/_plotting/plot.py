"""Plots of one curve, and of several curves and data: a page, or one picture in axes of the user."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib import rc_context, rcParams
from matplotlib.axes import Axes
from matplotlib.colors import is_color_like
from matplotlib.figure import Figure

from .._base.arrays import as_array, short_repr
from .._base.disk import path_of, replacing
from .._base.time import TimeAxis, knots_of
from .._core import ValidationError
from .._spaces import Product, Space, SpecialEuclidean, cover_of, factors_of, parts_of
from .curves import OTHERS, Axis, Curve, common_gaps, curves_of, scatter_of
from .lines import FRAME, LEGEND, START
from .page import draw_page
from .panels import Panel
from .rates import is_angular, residuals_of
from .style import DATA, distinct, scale_of, shrink, time_colors
from .views import FACTORS, FRAMES, title_on, view_of, views_of_factors

_LARGEST = 200.0
"""The largest side of a figure in inches."""
_METRICS = dict.fromkeys(("spd", "hpd", "sspd"), "affine-invariant") | {"logspd": "log-Euclidean"}
"""Metrics of families for which several are in use."""
_MOVING = (".gif", ".mp4", ".apng", ".webm", ".mov", ".avi")


# ---- one curve ----


def plot(
    curve: Any,
    file: Any = None,
    *,
    ax: Any = None,
    show: bool = False,
    color: Any = None,
    label: str | None = None,
    radius: float | None = None,
    **look: Any,
) -> Any:
    """Draw a curve, on the Earth if its radius in metres is given. See `symspline.CubicSpline.plot`."""
    if ax is None:
        return finish(page_of(curve, color, label, radius, show=show, **look)[0], file, show)
    check_axes(ax, curve.space)
    curves, _ = curves_of(curve, _axis(curve, raw=True), color or _next_color(ax), label)
    return _draw_into(ax, [own.on_earth(radius) for own in curves], show=show, **look)


def page_of(
    curve: Any,
    color: Any = None,
    label: str | None = None,
    radius: float | None = None,
    title: str | None = None,
    figsize: tuple[float, float] | None = None,
    show: bool = False,
) -> tuple[Figure, list[Curve]]:
    """Return the page of a curve, and the curves that it shows."""
    curves, words = curves_of(curve, _axis(curve), color, label)
    curves = [own.on_earth(radius) for own in curves]
    space = curve.space
    views = views_of_factors(curves[:1]) if isinstance(space, Product) else [(view_of(curves[:1]), curves)]
    residuals = residuals_of(curve, curves[0], [view.has_band for view, _ in views])
    title = title or title_on(curve._kind, space)
    return draw_page(curves, title, words + _description(curve, curves), figsize, show, residuals), curves


def _axis(curve: Any, raw: bool = False) -> Axis:
    return Axis.of([curve.domain], curve._time_axis, raw)


def _description(spline: Any, curves: Sequence[Curve]) -> str:
    """Describe the data, the convergence of the solver, the number of curves with bands, and the number of gaps."""
    words = [spline._made_of(curves[0].radius)]
    if isinstance(cover_of(spline.space), SpecialEuclidean):
        # The acceleration of the position is that of a body in such a motion.
        words[0] = words[0].replace("natural ends", "natural ends (constant twist)")
    if ", noise " in words[0] and curves[0].radius is None and is_angular(spline.space):
        words[0] += " rad"
    family = str(cover_of(spline.space)).partition(":")[0]
    if family in _METRICS:
        words.append(f"{_METRICS[family]} metric")
    factors = len(factors_of(spline.space))
    if factors > FACTORS:
        words.append(f"{FACTORS} of {factors} factors")
    if spline._unconverged:
        words.append(f"{spline._unconverged} failed" if spline._curve.batch else "not converged")
    if curves[0].noise is not None:
        words.append("band 95 %")
    if len(curves[0].breaks):
        count = int(np.sum(curves[0].breaks[:, 1] > curves[0].breaks[:, 0]))
        words.append(f"{count} gap{'s' if count != 1 else ''}")
    elif gaps := len(common_gaps(curves)):
        words.append(f"{gaps} long gap{'s' if gaps > 1 else ''}")
    return ", ".join(filter(None, words))


# ---- several curves and data ----


def compare(
    items: Sequence[Any],
    labels: Any,
    file: Any = None,
    *,
    colors: Any = None,
    ax: Any = None,
    show: bool = False,
    title: str | None = None,
    figsize: Any = None,
    radius: float | None = None,
) -> Any:
    """Draw curves and data, on the Earth if its radius in metres is given. See `symspline.plot`."""
    first = next(own for own in items if not isinstance(own, tuple))
    space = first.space
    if ax is not None:
        check_axes(ax, space)
    names = _checked_labels(labels, len(items))
    chosen = _checked_colors(colors, items, space)
    data = [_data_of(own, space, i) if isinstance(own, tuple) else None for i, own in enumerate(items)]
    _check_times(items, data, first._time_axis)
    ends = [own.domain if given is None else given[:2] for own, given in zip(items, data, strict=True)]
    axis = Axis.of(ends, first._time_axis, raw=ax is not None)
    drawn: list[Curve] = []
    has_data = any(given is not None for given in data)
    for item, given, name, color in zip(items, data, names, chosen, strict=True):
        if given is None:
            own = curves_of(item, axis, color, name, alone=False)[0]
            # Beside data, markers of starting points would be a second kind of circles.
            drawn += [replace(curve, has_start=not has_data) for curve in own]
        else:
            start, _, times, points = given
            drawn.append(scatter_of(space, start, times, points, axis, color, name))
    drawn = [own.on_earth(radius) for own in drawn]
    # Lines are in front of data, and the first of them determines the view.
    drawn.sort(key=lambda own: not own.has_line)
    if ax is not None:
        return _draw_into(ax, drawn, title, show)
    count = sum(own.has_line for own in drawn)
    words = [f"{count} curve{'s' if count > 1 else ''}"]
    if count < len(drawn):
        words.append(f"{sum(len(own.x) for own in drawn if not own.has_line)} data")
    title = title or ("Tracks" if radius is not None else title_on("Comparison", space))
    return finish(draw_page(drawn, title, ", ".join(words), figsize, show), file, show)


def _checked_labels(labels: Any, count: int) -> list[str | None]:
    if labels is None:
        return [None] * count
    if isinstance(labels, str) or not isinstance(labels, Sequence) or len(labels) != count:
        raise ValidationError(f"labels must be a list of {count} strings, one per curve, not {short_repr(labels)}")
    for i, own in enumerate(labels):
        if own is not None and not isinstance(own, str):
            raise TypeError(f"labels[{i}] must be a string, not {short_repr(own)}")
    return list(labels)


def _checked_colors(colors: Any, items: Sequence[Any], space: Space[Any]) -> list[Any]:
    """Return the colours of the user, or distinct ones for curves and grey ones for data."""
    if colors is not None:
        if isinstance(colors, str) or not isinstance(colors, Sequence) or len(colors) != len(items):
            raise ValidationError(
                f"colors must be a list of {len(items)} colours, one per curve, not {short_repr(colors)}"
            )
        return [_checked_color(own, f"colors[{i}]") for i, own in enumerate(colors)]
    count = sum(not isinstance(own, tuple) for own in items)
    # Frames have colours of their own.
    usual = OTHERS if any(str(cover_of(own)) in FRAMES for own in factors_of(space)) else distinct()
    lines = iter(usual if count <= len(usual) else map(tuple, time_colors(np.linspace(0, 1, count))))
    dots = iter([DATA, *distinct()[::-1]] * len(items))
    return [next(dots) if isinstance(own, tuple) else next(lines) for own in items]


def _data_of(pair: tuple[Any, Any], space: Any, i: int) -> tuple[Any, Any, Any, Any]:
    """Return first and last time, times on the axis of the core and points, without missing ones and sorted."""
    t, points = pair
    name = f"curves[{i}]"
    try:
        pairs = zip(factors_of(space), parts_of(points, space, "points"), strict=True)
        parts = [factor._array(own, "points") for factor, own in pairs]
        for own, factor in zip(parts, factors_of(space), strict=True):
            if own.shape[1:] != factor.point_shape or not len(own):
                raise ValidationError(
                    f"points have shape {own.shape}, but data on {factor!r} need shape {('n', *factor.point_shape)}"
                )
        _, shown, times = knots_of(t, (), len(parts[0]))
        kept = np.all([np.isfinite(own.reshape(len(own), -1)).all(axis=1) for own in parts], axis=0)
        if not kept.any():
            raise ValidationError("all points are missing")
        parts = [
            factor.project(own[kept].astype(factor.dtype)) for own, factor in zip(parts, factors_of(space), strict=True)
        ]
    except ValidationError as error:
        raise ValidationError(f"{name}: {error}") from None
    if not np.isfinite(times).all():
        raise ValidationError(f"{name}: t must be finite")
    order = np.argsort(times[kept], kind="stable")
    parts = [own[order] for own in parts]
    shown, times = shown[kept][order], times[kept][order]
    return shown[0], shown[-1], times, tuple(parts) if isinstance(space, Product) else parts[0]


def _check_times(items: Sequence[Any], data: Sequence[Any], reference: TimeAxis) -> None:
    """Raise ValidationError unless all times are numbers, or all are dates."""
    for i, (item, given) in enumerate(zip(items, data, strict=True)):
        dates = item._time_axis.dates if given is None else isinstance(given[0], np.datetime64)
        if dates != reference.dates:
            raise ValidationError(
                f"curves[{i}] has {'dates' if dates else 'numbers'} as times, but other curves have "
                f"{'numbers' if dates else 'dates'}. Use one kind of times."
            )


# ---- axes of the user ----


def check_axes(ax: Any, space: Space) -> None:
    """Raise an error unless a picture of the space can be drawn into axes."""
    if not isinstance(ax, Axes):
        raise TypeError(f"ax must be axes of matplotlib, not {short_repr(ax)}")
    if isinstance(space, Product):
        raise ValidationError(
            f"ax is one set of axes, but a curve on {space!r} has one picture per factor. Omit ax to draw a page."
        )


def _draw_into(ax: Axes, curves: Sequence[Curve], title: str | None = None, show: bool = False) -> Any:
    """Draw the picture of curves into axes that `check_axes` has accepted."""
    view = view_of(curves)
    if ax.has_data() and (view.is_turned or view.in_rows):
        why = (
            "the view of this picture depends on the curves"
            if view.is_turned
            else "symbols of several curves would overlap"
        )
        raise ValidationError(
            f"ax already contains a picture, and {why}. Draw all of them in one call: "
            "symspline.plot([first, second], ax=ax)."
        )
    return draw_picture_into(ax, view.projection, lambda panel: view.draw_into(panel, curves), title, show)


def draw_picture_into(
    ax: Any, projection: str | None, draw: Callable[[Panel], None], title: str | None, show: bool
) -> Any:
    """Draw a picture into axes of the user, whose limits then contain what was there, too."""
    wanted = projection or "rectilinear"
    if ax.name != wanted:
        kind = f"projection='{wanted}'" if projection else "no projection"
        raise ValidationError(
            f"ax has the projection {ax.name!r}, but this picture needs axes with {kind}. Create them by "
            + (f"figure.add_subplot(projection='{wanted}')." if projection else "figure.add_subplot().")
        )
    before, factor = set(ax.get_children()), scale_of(ax)
    limits = {name: getattr(ax, f"get_{name}lim")() for name in ax._axis_map if ax.has_data()}
    with rc_context({"font.size": max(0.75, factor) * rcParams["font.size"]}):
        draw(Panel([ax], mine=False))
    for name, (low, high) in limits.items():
        # Pictures with limits of their own must not hide what was there.
        if not getattr(ax, f"get_autoscale{name}_on")():
            own = getattr(ax, f"get_{name}lim")()
            getattr(ax, f"set_{name}lim")(min(low, own[0]), max(high, own[1]))
    new = [artist for artist in ax.get_children() if artist not in before]
    shrink(new, factor)
    hidden = tuple(own for own in LEGEND if own not in (START, *FRAME))
    for artist in new:
        # Legends of the user have the names of curves.
        if str(artist.get_label()).startswith(hidden):
            artist.set_label(f"_{artist.get_label()}")
    if title is not None:
        ax.set_title(title)
    if show:
        from matplotlib import pyplot

        pyplot.show()
    return ax


def _next_color(ax: Any) -> Any:
    """Return the next colour of the property cycle of axes."""
    (probe,) = ax.plot(*[[]] * (3 if ax.name == "3d" else 2))
    color = probe.get_color()
    probe.remove()
    return color


# ---- files and options ----


def finish(figure: Figure, file: Any, show: bool) -> Figure:
    """Save the figure if there is a file, and open windows."""
    if file is not None:
        save(figure, file)
    if show:
        from matplotlib import pyplot

        pyplot.show()
    return figure


def save(figure: Figure, file: Any) -> None:
    """Write a figure to an open file, or to a path whose suffix selects the format."""
    path = path_of(file, method="write")
    if path is None:
        figure.savefig(file)
        return
    known = sorted(set(figure.canvas.get_supported_filetypes()) - {own[1:] for own in _MOVING})
    ending = path.suffix[1:].lower()
    if not ending:
        ending = figure.canvas.get_default_filetype()
        path = path.with_name(f"{path.name}.{ending}")
    if f".{ending}" in _MOVING:
        raise ValidationError(
            f"file = {short_repr(str(path))} is an animation, but plot writes still images. Use the method animate of "
            "a curve, or a name such as 'curve.png'."
        )
    if ending not in known:
        raise ValidationError(f"file = {short_repr(str(path))}: the name of a picture must end in .{', .'.join(known)}")
    with replacing(path) as temporary:
        figure.savefig(temporary, format=ending)


def checked_look(file: Any, ax: Any, color: Any, label: Any, title: Any, figsize: Any, show: Any) -> dict[str, Any]:
    """Return the options that were given as keyword arguments of the function that draws.

    Raises
    ------
    ValidationError
        If an option is invalid.
    """
    if not isinstance(show, bool):
        raise TypeError(f"show must be True or False, not {short_repr(show)}")
    look: dict[str, Any] = {}
    if color is not None:
        look["color"] = _checked_color(color, "color")
    for name, text in (("label", label), ("title", title)):
        if text is not None:
            if not isinstance(text, str):
                raise TypeError(f"{name} must be a string, not {short_repr(text)}")
            look[name] = text
    if figsize is not None:
        look["figsize"] = _checked_size(figsize)
    if ax is not None and figsize is not None:
        raise ValidationError("figsize and ax exclude each other. The size of ax is that of its figure.")
    if ax is not None and file is not None:
        raise ValidationError("file and ax exclude each other. Save the figure of ax: ax.figure.savefig(file).")
    return look


def _checked_color(color: Any, name: str) -> Any:
    """Return a colour in any form that matplotlib accepts."""
    try:
        valid = is_color_like(color)
    except (TypeError, ValueError):
        valid = False
    if not valid:
        raise ValidationError(f"{name} must be a colour of matplotlib, such as 'tab:red', not {short_repr(color)}")
    return color


def _checked_size(figsize: Any) -> tuple[float, float]:
    size = as_array(figsize, "figsize")
    valid = size.shape == (2,) and size.dtype.kind in "iuf"
    if not (valid and np.isfinite(size).all() and (size > 0).all() and (size <= _LARGEST).all()):
        raise ValidationError(
            f"figsize must be width and height in inches, two positive numbers up to {_LARGEST:g}, not "
            f"{short_repr(figsize)}"
        )
    return float(size[0]), float(size[1])
