"""Axes with a time axis, and graphs of coordinates, angles and components of points against time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import SubFigure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, MultipleLocator
from numpy.typing import NDArray

from .._core import ValidationError
from .._spaces import Space
from .bands import draw_graph_of, shade_quantiles
from .curves import DOTS, GAPS, KNOTS, LINE, TICKS, Curve, are_compared, common_gaps
from .style import (
    BOTTOM,
    DATA,
    DISTINCT,
    EDGE,
    GAP,
    INK,
    LEFT,
    OWN_AXES,
    RIGHT,
    TOP,
    Array,
    Indices,
    inside,
    legend,
    named_from,
    plain,
    points,
    round_start,
    show_dates,
    size,
)

SUBSCRIPTS = str.maketrans("0123456789,", "₀₁₂₃₄₅₆₇₈₉,")
_NAMED, _OTHERS, _IN_ROW = 12, 100, 6
_COMPARED = 4
"""The largest number of components that are drawn for several curves."""
_STYLES = ["-", "--", ":", "-.", (0, (5, 1)), (0, (1, 1))]
_ROUNDING = 1e-9
"""Numbers that vary by less than this part of others are constant."""
_NARROW, _BESIDE = 1.8, 1.2
"""The largest widths of lines in low axes, and of those with quantiles beside them."""
_RIGHT = 88.0
"""Pictures of larger principal angles, in degrees, explain that they turn back at 90."""
_BETWEEN = 0.3
"""The distance between axes in inches."""
FEW_KNOTS, _TICKS = 40, 300
"""The largest numbers of knots that have lines, and ticks."""


# ---- axes ----


def timelines(
    panel: SubFigure, curves: Sequence[Curve], labels: Sequence[str], top: float = TOP, marked: bool = True
) -> list[Axes]:
    """Add a column of axes with the same time axis, one per label of the vertical axis.

    Unless `marked` is False, they show the times of the given points and long gaps.
    """
    height = (size(panel)[1] - BOTTOM - top + _BETWEEN) / len(labels)
    made = []
    for i, label in enumerate(labels):
        lower, upper = BOTTOM + (len(labels) - 1 - i) * height, top + i * height
        axes = panel.add_axes(inside(panel, LEFT, lower, RIGHT, upper))
        made.append(axes)
        axes.set_gid("time")
        if axes in OWN_AXES:
            _name_axes(axes, curves, label)
            continue
        plain(axes)
        axes.grid(visible=False, axis="x")
        axes.set_ylabel(label)
        # All labels of a figure are aligned, and have at least three numbers beside them.
        right = 0.58 if "\n" in label else 0.68
        axes.yaxis.set_label_coords(-right / (size(panel)[0] - LEFT - RIGHT), 0.5)
        numbers = int(np.clip(height / 0.3, 4, 9))
        axes.yaxis.set_major_locator(MaxNLocator(numbers, steps=[1, 2, 2.5, 5, 10], min_n_ticks=3))
        _set_times(axes, curves, size(panel)[0] - LEFT - RIGHT, lowest=i == len(labels) - 1)
        if marked:
            _mark_knots(axes, curves)
    return made


def _name_axes(axes: Axes, curves: Sequence[Curve], label: str) -> None:
    """Label axes of the user that have no labels, and mark gaps."""
    axis = curves[0].axis
    axes.set(xlabel=axes.get_xlabel() or axis.name, ylabel=axes.get_ylabel() or label)
    if axis.dates:
        show_dates(axes.xaxis, 3, 7)
    _mark_gaps(axes, curves)


def _set_times(axes: Axes, curves: Sequence[Curve], width: float, lowest: bool) -> None:
    first, last = min(curve.times[0] for curve in curves), max(curve.times[-1] for curve in curves)
    axes.set_xlim(first - 0.01 * (last - first), last + 0.01 * (last - first))
    if curves[0].axis.dates:
        # For some spans the locator does not find an interval between narrower limits.
        show_dates(axes.xaxis, *((3, 10) if width > 7 else (2, 5)))
    axes.set_xlabel(curves[0].axis.name if lowest else "")
    axes.tick_params(labelbottom=lowest)
    axes.xaxis.offsetText.set_visible(lowest)


def _mark_knots(axes: Axes, curves: Sequence[Curve]) -> None:
    """Mark knots by thin lines, or by short ticks if lines would be too many. Noisy data have short ticks.

    Bands mark long gaps between points.
    """
    marked = [curve.marks for curve in curves if not curve.faint]
    knots = np.unique(np.concatenate(marked))
    height, style = (1.0, (0, (1, 2))) if len(knots) <= FEW_KNOTS and curves[0].noise is None else (0.04, "-")
    look: Any = {"transform": axes.get_xaxis_transform()}
    line: Any = {"color": EDGE, "linewidth": 0.8, "linestyle": style, "zorder": 1}
    line["label"] = KNOTS if height == 1 else TICKS
    if len(knots) <= _TICKS:
        axes.vlines(knots, 0, height, **look, **line)
    _mark_gaps(axes, curves)


def _mark_gaps(axes: Axes, curves: Sequence[Curve]) -> None:
    gaps = common_gaps(curves)
    if len(gaps):
        look: Any = {"transform": axes.get_xaxis_transform(), "facecolor": GAP, "linewidth": 0, "zorder": 0.5}
        spans = [(start, end - start) for start, end in gaps.tolist()]
        axes.broken_barh(spans, (0, 1), label=GAPS, **look)


# ---- one number ----


def draw_graph(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw the graphs of curves in R¹."""
    draw_coordinates(panel, curves, ["x"])


def _draw_angle(angles: Callable[[Any], Array], period: float, panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw an angle against time, without jumps."""
    numbers = lambda points: np.degrees(angles(points))[:, None]  # noqa: E731
    unit = lambda lengths: np.full_like(lengths, np.degrees(1.0))  # noqa: E731
    draw_coordinates(panel, curves, ["angle, degrees"], numbers, unit, period=np.degrees(period))


# Points of S¹ have the angle of a unit vector. Points of RP¹ and Gr(1, 2) are lines, whose angle has the period π.
# Points of SO(2) and O(2) have the angle of the first axis, and points of U(1) their phase.
ANGLES: dict[str, tuple[Callable[[Any], Array], float]] = {
    "sphere:1": (lambda points: np.arctan2(points[:, 1], points[:, 0]), 2 * np.pi),
    "rp:1 gr:1,2": (lambda lines: np.arctan2(lines[:, 1], lines[:, 0]).ravel(), np.pi),
    "so:2 o:2": (lambda matrices: np.arctan2(matrices[:, 1, 0], matrices[:, 0, 0]), 2 * np.pi),
    "u:1": (lambda numbers: np.angle(numbers[:, 0, 0]), 2 * np.pi),
}
"""The angle of points, and its period."""
draw_circle, draw_slope, draw_turn, draw_phase = (partial(_draw_angle, *own) for own in ANGLES.values())


# ---- several numbers ----


def draw_coordinates(
    panel: SubFigure,
    curves: Sequence[Curve],
    names: Sequence[str],
    numbers: Callable[[Any], Array] = np.asarray,
    growth: Callable[[Array], Array] = np.ones_like,
    title: str = "",
    equal_scales: bool = False,
    period: float = np.inf,
) -> None:
    """Draw a few numbers against time, each in axes of its own.

    Parameters
    ----------
    panel, curves : SubFigure, sequence of Curve
        Panel to draw into, and curves to draw.
    names : sequence of str
        Names of the numbers.
    numbers : callable
        Function of several points, with one row per point.
    growth : callable
        Bounds, from the lengths of these rows, of how much the numbers differ if points have the distance 1.
    title : str
        Description of the numbers, above the axes. If the user gave axes, which show all numbers, it is their label.
    equal_scales : bool
        Whether all axes have the same scale.
    period : float
        Numbers that differ by multiples of it are equal. They are drawn without jumps.
    """
    own_axes, several = not isinstance(panel, SubFigure), len(names) > 1
    if own_axes and several:
        draw_numbers(panel, curves, title, names, lambda _, own: numbers(own), period)
        return
    drawn = _without_jumps(curves, lambda _: numbers, period)
    everything = np.concatenate([rows for pair in drawn for rows in pair])
    lowest, highest = np.nanmin(everything, axis=0), np.nanmax(everything, axis=0)
    largest = float((highest - lowest).max())
    # In axes of the user, others draw too.
    starts = [0 if own_axes else round_start(*ends) for ends in zip(lowest, highest, strict=True)]
    made = timelines(panel, curves, [named_from(*own) for own in zip(names, starts, strict=True)])
    if title:
        made[0].set_title(title, loc="left", color=INK, fontsize=points(9), pad=3)
    batch = curves[0].batch
    if batch is not None:
        everywhere = batch.at("point")
        many = numbers(everywhere.reshape(-1, *everywhere.shape[2:])).reshape(*everywhere.shape[:2], len(names))
        many = _unwrapped(many, period, drawn[0][0][0])
    for i, axes in enumerate(made):
        if several:
            axes.margins(y=0.1)
        if batch is not None:
            shade_quantiles(axes, batch, many[..., i] - starts[i])
        for curve, (line, given) in zip(curves, drawn, strict=True):
            size = float(np.clip(30 / np.sqrt(max(len(given), 1)), 1.2, 3))
            dense = len(given) > FEW_KNOTS
            look: Any = {"color": DATA if dense else INK} if curve.noise is None and curve.alone else {}
            look |= {"markersize": size} | ({"zorder": 1.8} if dense else {})
            look = look if several else {}
            size_of_band = growth(np.linalg.norm(line, axis=1))
            own = curve.graph(line[:, i] - starts[i])
            draw_graph_of(axes, curve, own, given[:, i] - starts[i], size_of_band, **look)
        for artist in axes.lines:
            if several and artist.get_gid() == LINE:
                artist.set_linewidth(min(artist.get_linewidth(), _NARROW if batch is None else _BESIDE))
    limits = np.array([axes.get_ylim() for axes in made])
    widest = np.ptp(limits, axis=1).max()
    for axes, (low, high) in zip(made, limits.tolist(), strict=True):
        # Rounding errors of a constant would look like a curve.
        if equal_scales or (several and high - low < _ROUNDING * largest):
            axes.set_ylim((low + high - widest) / 2, (low + high + widest) / 2)


def _without_jumps(
    curves: Sequence[Curve], numbers: Callable[[Curve], Callable[[Any], Array]], period: float
) -> list[tuple[Array, Array]]:
    """Return numbers of the samples and of the given points of every curve, without jumps by the period.

    All curves begin close to the first one. Data are close to it at their times.
    """
    made: list[tuple[Array, Array]] = []
    for curve in curves:
        line, given = curve.marked(numbers(curve))
        if np.isfinite(period):
            near = made[0][0] if made else line
            if curve.has_line:
                line = _unwrapped(line, period, near[0])
            else:
                near = np.stack([np.interp(curve.times, curves[0].times, own) for own in near.T], axis=1)
                line = line + period * np.rint((near - line) / period)
            given = given + period * np.rint((curve.closest_samples(line) - given) / period)
        made.append((line, given))
    return made


def _unwrapped(lines: Array, period: float, start: Array) -> Array:
    """Return numbers that begin close to a start and do not jump in time, which is the last axis but one."""
    if np.isinf(period):
        return lines
    lines = np.unwrap(lines, period=period, axis=-2)
    return np.asarray(lines - period * np.rint((lines[..., :1, :] - start) / period))


def draw_numbers(
    panel: SubFigure,
    curves: Sequence[Curve],
    label: str,
    names: Sequence[str],
    numbers: Callable[[Any, Any], Array],
    period: float = np.inf,
) -> None:
    """Draw several numbers against time, at most twelve with their names.

    If there are more, those with the largest ranges have names, in the order of their ranges.

    Parameters
    ----------
    panel : SubFigure
        Panel to draw into.
    curves : sequence of Curve
        Curves to draw.
    label : str
        Label of the vertical axis.
    names : sequence of str
        Names of the numbers. The name "Im ..." follows that of the real part.
    numbers : callable
        Function of the first point of a curve and of several points, with one row per point.
    period : float
        Numbers that differ by multiples of it are equal. They are drawn without jumps.
    """
    if isinstance(panel, SubFigure) and are_compared(curves):
        _compare_numbers(panel, curves, label, names, numbers, period)
        return
    space = size(panel)[0] - LEFT - RIGHT
    width = 1.8 if curves[0].alone else 0.9
    drawn = _without_jumps(curves, lambda curve: partial(numbers, curve.first_point), period)
    named, rest = _choose(names, np.max([np.ptp(line, axis=0) for line, _ in drawn], axis=0))
    labels = [names[i] for i in named]
    looks = _looks(labels)
    handles = [Line2D([], [], linewidth=width, **look) for look in looks]
    if len(rest):
        handles.append(Line2D([], [], color=INK, linewidth=0.4))
        labels.append(f"{len(rest)} others")
        rest = rest[:: 1 + len(rest) // _OTHERS]
    rows = -(-len(labels) // max(1, min(_IN_ROW, int(space / 0.9))))
    (axes,) = timelines(panel, curves, [label], top=0.25 + 0.22 * rows)
    for curve, (values, given) in zip(curves, drawn, strict=True):
        if curve.has_line:
            for i in rest:
                axes.plot(curve.times, values[:, i], color=INK, linewidth=0.4, alpha=0.4)
        for k, (i, look) in enumerate(zip(named, looks, strict=True)):
            if axes in OWN_AXES and (curve.label or not curve.alone):
                # The colour distinguishes curves, and the line style numbers.
                look = {"color": curve.color, "linestyle": _STYLES[k % len(_STYLES)]}
            if curve.has_line:
                # Axes of the user get the names, and a legend only if the user adds one.
                own = f"{curve.label}: {names[i]}" if curve.label else names[i]
                label = own if axes in OWN_AXES and (curve.label or curve is curves[0]) else LINE
                line = np.column_stack([curve.times, curve.graph(values[:, i])])
                curve.plot_line(axes, line, linewidth=width, label=label, **look)
            positions, color = np.column_stack([curve.on_axis(curve.given_x), given[:, i]]), look["color"]
            if not curve.has_line or (curve.alone and curve.noise is None and curve.has_nodes):
                axes.plot(*positions.T, "o", color=color, markersize=3, label=DOTS)
            elif curve.alone:
                curve.draw_dots(axes, positions, color=color, alpha=0.4)
    if axes in OWN_AXES:
        return
    anchor: Any = {"loc": "lower right", "bbox_to_anchor": (1, 1), "borderaxespad": 0}
    legend(axes, handles, labels, rows=rows, handlelength=1.6, **anchor)


def _compare_numbers(
    panel: SubFigure,
    curves: Sequence[Curve],
    label: str,
    names: Sequence[str],
    numbers: Callable[[Any, Any], Array],
    period: float,
) -> None:
    """Draw the numbers with the largest ranges in axes of their own, where several curves have their colours."""
    first = curves[0].first_point
    drawn = _without_jumps(curves, lambda _: partial(numbers, first), period)
    ranges = np.max([np.ptp(line, axis=0) for line, _ in drawn], axis=0)
    kept = np.sort(np.argsort(-ranges, kind="stable")[:_COMPARED])
    few = lambda points: numbers(first, points)[:, kept]  # noqa: E731
    words = " ".join(label.split())
    title = words if len(kept) == len(names) else f"{words}, {len(kept)} of {len(names)}: those with the largest ranges"
    draw_coordinates(panel, curves, [names[i] for i in kept], few, title=title, period=period)


def _choose(names: Sequence[str], ranges: Array) -> tuple[Indices, Indices]:
    """Return the numbers with names, and the others. Real and imaginary parts stay together."""
    if len(names) <= _NAMED:
        return np.arange(len(names)), np.arange(0)
    groups: list[list[int]] = []
    for i, name in enumerate(names):
        if name.startswith("Im ") and groups:
            groups[-1].append(i)
        else:
            groups.append([i])
    groups.sort(key=lambda own: -ranges[own].max())
    named: list[int] = []
    for own in groups:
        if len(named) + len(own) > _NAMED:
            break
        named += own
    return np.array(named), np.setdiff1d(np.arange(len(names)), named)


def _looks(names: Sequence[str]) -> list[dict[str, Any]]:
    """Return colour and line style of every number. An imaginary part is dashed in the colour of its real part."""
    is_complex = any(name.startswith("Im ") for name in names)
    made, entry = [], -1
    for name in names:
        imaginary = name.startswith("Im ")
        entry += not imaginary
        first, second = ("--", ":") if imaginary else ("-", "-." if is_complex else "--")
        made.append({"color": DISTINCT[entry % 6], "linestyle": first if entry < 6 else second})
    return made


def draw_components(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw the components of points, for spaces without a picture of their own."""
    space = curves[0].space
    kept = independent(space)
    names = component_names(space.point_shape, space.dtype.kind == "c")
    numbers = lambda _, points: components(points)[:, kept]  # noqa: E731
    draw_numbers(panel, curves, "components", [names[i] for i in kept], numbers)


def components(points: NDArray[Any]) -> Array:
    """Return one row per point, in which the real and imaginary parts of complex numbers alternate."""
    flat = np.ascontiguousarray(points.reshape(len(points), -1))
    return flat.view(np.float64) if np.iscomplexobj(flat) else flat


def component_names(shape: tuple[int, ...], is_complex: bool) -> list[str]:
    """Return names such as x₁, x₂ or, for matrices, x₁₁."""
    comma = "," if max(shape) > 9 else ""
    indices = [comma.join(str(i + 1) for i in index) for index in np.ndindex(*shape)]
    names = [f"x{index.translate(SUBSCRIPTS)}" for index in indices]
    return [f"{part} {name}" for name in names for part in ("Re", "Im")] if is_complex else names


@lru_cache(maxsize=100)
def independent(space: Space) -> Indices:
    """Return the indices of the components to draw: those that are neither the same in all points nor repeated.

    Symmetric matrices repeat entries, up to the sign of imaginary parts, and the last row of affine maps is constant.
    """
    rng = np.random.default_rng(0)
    try:
        columns = components(np.stack([space.random_point(rng) for _ in range(3)])).T
    except (NotImplementedError, ValidationError):
        return np.arange(int(np.prod(space.point_shape)) * (2 if space.dtype.kind == "c" else 1))
    kept: list[int] = []
    for i, own in enumerate(columns):
        others = [sign * columns[j] for j in kept for sign in (1, -1)]
        if np.ptp(own) > 1e-9 and not any(np.allclose(own, other, rtol=1e-9, atol=0) for other in others):
            kept.append(i)
    return np.array(kept, np.intp)


def draw_torus(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw angles in degrees, without jumps. The first ones are between −180 and 180 degrees."""
    names = component_names(curves[0].space.point_shape, False)
    degrees = lambda _, points: np.degrees(points)  # noqa: E731
    draw_numbers(panel, curves, "angles, degrees", names, degrees, 360)


def draw_ratios(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw the ratios zᵢ/z₀ of points of complex hyperbolic space, which do not depend on the phase."""
    n = curves[0].points.shape[1] - 1
    names = [f"{part} z{i + 1}/z0".translate(SUBSCRIPTS) for i in range(n) for part in ("Re", "Im")]
    ratios = lambda _, points: components(points[:, 1:] / points[:, :1])  # noqa: E731
    draw_numbers(panel, curves, "coordinates\nin the unit ball", names, ratios)


def draw_principal_angles(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Draw the principal angles to the first point, for Grassmannians and projective spaces."""
    n, k = np.reshape(curves[0].points[0], (len(curves[0].points[0]), -1)).shape
    names = [f"θ{i + 1}".translate(SUBSCRIPTS) for i in range(min(k, n - k))]

    def numbers(first: Any, points: Any) -> Array:
        return principal_angles(points, first)[:, : len(names)]

    draw_numbers(panel, curves, "principal angles to\nfirst point, degrees", names, numbers)
    largest = max(numbers(own.first_point, own.points).max() for own in curves)
    if isinstance(panel, SubFigure) and largest > _RIGHT and len(panel.axes) == 1:
        words = "principal angles are at most 90°: they turn back there, but the curve is smooth"
        axes: Any = panel.axes[0]
        axes.set_title(words, loc="left", color=INK, fontsize=points(9), pad=3)
        axes.yaxis.set_major_locator(MultipleLocator(30))
        axes.axhline(90, color=EDGE, linewidth=0.8, zorder=1)


def principal_angles(points: NDArray[Any], first: NDArray[Any]) -> Array:
    """Return the principal angles between a subspace and others in degrees, the largest first; shape (m, k).

    The sines are accurate for small angles, and the cosines for large ones.
    """
    bases = points.reshape(*points.shape[:2], -1)
    base = first.reshape(bases.shape[1:])
    shadow = base.conj().T @ bases
    cosines = np.linalg.svd(shadow, compute_uv=False)[:, ::-1]
    sines = np.linalg.svd(bases - base @ shadow, compute_uv=False)
    return np.degrees(np.arctan2(sines, cosines))
