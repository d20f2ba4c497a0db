"""Several curves and data in one picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib import rcParams

from .._base.arrays import short_repr
from .._base.time import TimeAxis, knots_of
from .._core import ValidationError
from .._spaces import Product, Space, cover_of, factors_of, parts_of
from .collect import OTHERS, axis_of, curves_of, finite_rows, scatter_of
from .curves import Curve
from .figure import FRAMES, finish
from .looks import checked_color
from .page import draw_page
from .panels import check_axes, draw_into, has_dark_background
from .style import DATA, DISTINCT, time_colors
from .theme import is_dark, kept_color
from .titles import title_on


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
    dark = has_dark_background(ax) if ax is not None else is_dark(rcParams["figure.facecolor"])
    chosen = _checked_colors(colors, items, space, dark)
    data = [_data_of(own, space, i) if isinstance(own, tuple) else None for i, own in enumerate(items)]
    _check_times(items, data, first._time_axis)
    ends = [own.domain if given is None else given[:2] for own, given in zip(items, data, strict=True)]
    axis = axis_of(ends, first._time_axis, raw=ax is not None)
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
        return draw_into(ax, drawn, title, show)
    count = sum(own.has_line for own in drawn)
    words = [f"{count} curve{'s' if count > 1 else ''}"]
    if count < len(drawn):
        words.append(f"{sum(len(own.x) for own in drawn if not own.has_line)} data")
    title = title or ("Tracks" if radius is not None else title_on("Comparison", space))
    return finish(draw_page(drawn, title, ", ".join(words), figsize, show).figure, file, show)


def _checked_labels(labels: Any, count: int) -> list[str | None]:
    if labels is None:
        return [None] * count
    if isinstance(labels, str) or not isinstance(labels, Sequence) or len(labels) != count:
        raise ValidationError(f"labels must be a list of {count} strings, one per curve, not {short_repr(labels)}")
    for i, own in enumerate(labels):
        if own is not None and not isinstance(own, str):
            raise TypeError(f"labels[{i}] must be a string, not {short_repr(own)}")
    return list(labels)


def _checked_colors(colors: Any, items: Sequence[Any], space: Space[Any], dark: bool) -> list[Any]:
    """Return the colours of the user, or distinct ones for curves and grey ones for data."""
    if colors is not None:
        if isinstance(colors, str) or not isinstance(colors, Sequence) or len(colors) != len(items):
            raise ValidationError(
                f"colors must be a list of {len(items)} colours, one per curve, not {short_repr(colors)}"
            )
        return [kept_color(checked_color(own, f"colors[{i}]"), dark) for i, own in enumerate(colors)]
    count = sum(not isinstance(own, tuple) for own in items)
    # Frames have colours of their own.
    usual = OTHERS if any(str(cover_of(own)) in FRAMES for own in factors_of(space)) else DISTINCT
    lines = iter(usual if count <= len(usual) else map(tuple, time_colors(np.linspace(0, 1, count))))
    dots = iter([DATA, *DISTINCT[::-1]] * len(items))
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
        kept = finite_rows(parts)
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
