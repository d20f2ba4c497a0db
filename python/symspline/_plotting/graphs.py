"""Graphs of coordinates, angles and components of points against time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator

from .._base.typing import Array, FloatArray, Look
from .._core import ValidationError
from .._spaces import Space
from .curves import Curve, are_compared
from .panels import (
    DOTS,
    FEW_KNOTS,
    LINE,
    Panel,
    View,
    draw_dots,
    draw_graph_of,
    fresh,
    plot_line,
    shade_quantiles,
    time_axes,
    timeline,
)
from .style import DATA, SUBSCRIPTS, Indices, Numbers, axes_size, distinct, ink, legend, named_from, round_start

_Drawn = Sequence[tuple[FloatArray, FloatArray]]
"""Numbers of the samples of each curve, and of its given points."""
_NAMED, _OTHERS = 12, 100
"""The largest numbers of components with a name, and of others."""
_COMPARED = 4
"""The largest number of components that are drawn for several curves."""
_STYLES = ["-", "--", ":", "-.", (0, (5, 1)), (0, (1, 1))]
_ROUNDING = 1e-9
"""Numbers that vary by less than this part of others are constant."""
_NARROW, _BESIDE = 1.8, 1.2
"""The largest widths of lines in low axes, and of those with quantiles beside them."""
_RIGHT = 88.0
"""Pictures of larger principal angles, in degrees, explain that they turn back at 90."""
_COLUMNS = 4
"""The largest number of columns of matrices that have axes each. Rows have distinct colours, of which there are six."""


@dataclass(frozen=True)
class Graphs:
    """Numbers of points against time, in groups that have axes each.

    The number of a group of one has bands, and the colours of curves. Numbers of larger groups have colours of their
    own, and at most twelve of them have names: those with the largest ranges.

    Attributes
    ----------
    label : str
        Label of the vertical axis if all numbers are in the same axes.
    names : sequence of str
        Names of the numbers. The name "Im ..." follows that of the real part.
    numbers : callable
        Takes the first point of a curve and several points, and returns one row per point.
    groups : sequence of tuple, optional
        Labels and numbers of the groups. By default, every number is alone.
    growth : callable, optional
        Bounds, from the lengths of these rows, of how much the numbers differ if points have the distance 1. Without
        it, there are no bands.
    period : float
        Numbers that differ by multiples of it are equal. They are drawn without jumps.
    has_title : bool
        Whether the label is also above several axes.
    equal_scales : bool
        Whether all axes have the same scale.
    wraps : bool
        Whether lines break where numbers leave the middle period, unless there is a batch.
    """

    label: str
    names: Sequence[str]
    numbers: Callable[[Any, Any], FloatArray]
    groups: Sequence[tuple[str, Sequence[int]]] = ()
    growth: Callable[[FloatArray], FloatArray] | None = None
    period: float = np.inf
    has_title: bool = False
    equal_scales: bool = False
    wraps: bool = False

    def view(self, height: float = 3.8) -> View:
        """Return the view that has these graphs."""
        return timeline(self.draw, height, len(self.groups) or len(self.names), has_band=self.growth is not None)

    def draw(self, panel: Panel, curves: Sequence[Curve]) -> None:
        """Draw the numbers of curves; all of them in the same axes if those are of the user."""
        drawn = _without_jumps(curves, lambda curve: partial(self.numbers, curve.first_point), self.period)
        wraps = self.wraps and curves[0].batch is None and _leave(drawn, self.period)
        if wraps:
            drawn = [(_broken(line, self.period), _wrapped(given, self.period)) for line, given in drawn]
        groups = self.groups or [(name, [i]) for i, name in enumerate(self.names)]
        if not panel.mine and len(self.names) > 1:
            groups = [(self.label, range(len(self.names)))]
        starts = [
            _start(drawn, i) if panel.mine and len(members) == 1 else 0 for _, members in groups for i in members[:1]
        ]
        labels = [named_from(label, start) for (label, _), start in zip(groups, starts, strict=True)]
        made = time_axes(panel, curves, labels)
        if self.has_title and panel.mine:
            panel.explain(self.label)
        for axes, (_, numbers), start in zip(made, groups, starts, strict=True):
            if len(numbers) == 1:
                self._draw_one(axes, curves, drawn, numbers[0], start, len(groups) > 1)
            else:
                self._draw_several(panel, axes, curves, drawn, numbers)
        self._set_limits(made, drawn)
        for axes in made if wraps else ():
            # Whole periods, so that both sides of a break are at the edges.
            axes.set_ylim(-0.53 * self.period, 0.53 * self.period)
            axes.set_yticks(self.period * np.arange(-2, 3) / 4)

    def _draw_one(
        self, axes: Axes, curves: Sequence[Curve], drawn: _Drawn, number: int, start: float, is_low: bool
    ) -> None:
        """Draw one number, with thinner lines and smaller dots in axes that are one of several."""
        batch = curves[0].batch
        if batch is not None:
            points = batch.at("point")
            many = self.numbers(curves[0].first_point, points.reshape(-1, *points.shape[2:]))
            many = _unwrapped(many.reshape(*points.shape[:2], -1), self.period, drawn[0][0][0])
            shade_quantiles(axes, batch, many[..., number] - start)
        for curve, (line, given) in zip(curves, drawn, strict=True):
            dense = len(given) > FEW_KNOTS
            look: Look = {"color": DATA if dense else ink()} if curve.noise is None and curve.alone else {}
            look |= {"markersize": float(np.clip(30 / np.sqrt(max(len(given), 1)), 2, 3))}
            look |= {"zorder": 1.8} if dense else {}
            values = curve.graph(line[:, number] - start)
            unit = self.growth and self.growth(np.linalg.norm(line, axis=1))
            draw_graph_of(axes, curve, values, given[:, number] - start, unit, **look if is_low else {})
        if is_low:
            axes.margins(y=0.1)
            for artist in axes.lines:
                if artist.get_gid() == LINE:
                    artist.set_linewidth(min(artist.get_linewidth(), _NARROW if batch is None else _BESIDE))

    def _draw_several(
        self, panel: Panel, axes: Axes, curves: Sequence[Curve], drawn: _Drawn, numbers: Sequence[int]
    ) -> None:
        """Draw several numbers, and their names above the first axes."""
        width = 1.8 if curves[0].alone else 0.9
        ranges = np.max([np.ptp(line, axis=0) for line, _ in drawn], axis=0)
        named, rest = _choose(self.names, ranges, numbers)
        looks = _looks([self.names[i] for i in named])
        for curve, (values, given) in zip(curves, drawn, strict=True):
            if curve.has_line and len(rest):
                axes.plot(curve.times, values[:, rest[:: 1 + len(rest) // _OTHERS]], color=ink(), lw=0.4, alpha=0.4)
            for k, (i, look) in enumerate(zip(named, looks, strict=True)):
                name = self.names[i]
                if not panel.mine and (curve.label or not curve.alone):
                    # The colour distinguishes curves, and the line style numbers.
                    look = {"color": curve.color, "linestyle": _STYLES[k % len(_STYLES)]}
                if curve.has_line:
                    # Axes of the user get the names, and a legend only if the user adds one.
                    label = LINE if panel.mine else f"{curve.label}: {name}" if curve.label else fresh(axes, name)
                    line = np.column_stack([curve.times, curve.graph(values[:, i])])
                    plot_line(axes, curve, line, linewidth=width, label=label, **look)
                positions, color = np.column_stack([curve.on_axis(curve.given_x), given[:, i]]), look["color"]
                if not curve.has_line or (curve.alone and curve.noise is None and curve.has_nodes):
                    axes.plot(*positions.T, "o", color=color, markersize=3, label=fresh(axes, DOTS))
                elif curve.alone:
                    draw_dots(axes, curve, positions, color=color, alpha=0.4)
        if panel.mine and axes is panel.axes[0]:
            handles = [Line2D([], [], linewidth=width, **look) for look in looks]
            labels = [self.names[i] for i in named]
            if len(rest):
                handles.append(Line2D([], [], color=ink(), linewidth=0.4))
                labels.append(f"{len(rest)} others")
            legend(axes, handles, labels, axes_size(axes)[0], loc="lower right", bbox_to_anchor=(1, 1))

    def _set_limits(self, made: Sequence[Axes], drawn: _Drawn) -> None:
        """Give several axes the same scale if they must have it, and do not magnify rounding errors of constants."""
        if len(made) == 1:
            return
        largest = max(
            np.ptp(rows[np.isfinite(rows[:, 0])], axis=0).max() for pair in drawn for rows in pair if len(rows)
        )
        limits = np.array([axes.get_ylim() for axes in made])
        widest = np.ptp(limits, axis=1).max()
        for axes, (low, high) in zip(made, limits.tolist(), strict=True):
            if self.groups:
                axes.set_ylim(limits[:, 0].min(), limits[:, 1].max())
            elif self.equal_scales or high - low < _ROUNDING * largest:
                axes.set_ylim((low + high - widest) / 2, (low + high + widest) / 2)


def _start(drawn: _Drawn, number: int) -> Any:
    """Return the round number from which a number is counted if it is far from zero."""
    values = np.concatenate([rows[:, number] for pair in drawn for rows in pair])
    return round_start(np.nanmin(values), np.nanmax(values))


def _without_jumps(
    curves: Sequence[Curve], numbers: Callable[[Curve], Numbers], period: float
) -> list[tuple[FloatArray, FloatArray]]:
    """Return numbers of the samples and of the given points of every curve, without jumps by the period.

    All curves begin close to the first one. Data are close to it at their times.
    """
    made: list[tuple[FloatArray, FloatArray]] = []
    for curve in curves:
        line, given = curve.marked(numbers(curve))
        if np.isfinite(period):
            near = made[0][0] if made else line
            if curve.has_line:
                line = _unwrapped(line, period, near[0])
            else:
                near = np.stack([np.interp(curve.times, curves[0].times, column) for column in near.T], axis=1)
                line = line + period * np.rint((near - line) / period)
            given = given + period * np.rint((curve.closest_samples(line) - given) / period)
        made.append((line, given))
    return made


def _leave(drawn: _Drawn, period: float) -> bool:
    """Return whether numbers leave the middle period."""
    return any(len(rows) > 0 and bool(np.nanmax(np.abs(rows)) > period / 2) for pair in drawn for rows in pair)


def _wrapped(rows: FloatArray, period: float) -> FloatArray:
    """Return the numbers of the middle period that differ from others by multiples of it."""
    return np.asarray(rows - period * np.rint(rows / period))


def _broken(line: FloatArray, period: float) -> FloatArray:
    """Return a line in the middle period, without the samples at which it leaves it."""
    line = _wrapped(line, period)
    line[1:][np.abs(np.diff(line, axis=0)) > period / 2] = np.nan
    return line


def _unwrapped(lines: FloatArray, period: float, start: FloatArray) -> FloatArray:
    """Return numbers that begin close to a start and do not jump in time, which is the last axis but one."""
    if np.isinf(period):
        return lines
    lines = np.unwrap(lines, period=period, axis=-2)
    return np.asarray(lines - period * np.rint((lines[..., :1, :] - start) / period))


def _choose(names: Sequence[str], ranges: FloatArray, numbers: Sequence[int]) -> tuple[list[int], list[int]]:
    """Return the numbers with names, and the others. Real and imaginary parts stay together."""
    if len(numbers) <= _NAMED:
        return list(numbers), []
    groups: list[list[int]] = []
    for i in numbers:
        if names[i].startswith("Im ") and groups:
            groups[-1].append(i)
        else:
            groups.append([i])
    groups.sort(key=lambda group: -ranges[group].max())
    named: list[int] = []
    for group in groups:
        if len(named) + len(group) > _NAMED:
            break
        named += group
    return named, sorted(set(numbers) - set(named))


def _looks(names: Sequence[str]) -> list[Look]:
    """Return colour and line style of every number. An imaginary part is dashed in the colour of its real part."""
    is_complex = any(name.startswith("Im ") for name in names)
    made, entry = [], -1
    for name in names:
        imaginary = name.startswith("Im ")
        entry += not imaginary
        first, second = ("--", ":") if imaginary else ("-", "-." if is_complex else "--")
        made.append({"color": distinct()[entry % 6], "linestyle": first if entry < 6 else second})
    return made


# Points of S¹ have the angle of a unit vector. Points of RP¹ and Gr(1, 2) are lines, whose angle has the period π.
# Points of SO(2) and O(2) have the angle of the first axis, and points of U(1) their phase.
ANGLES: dict[str, tuple[Numbers, float]] = {
    "sphere:1": (lambda points: np.arctan2(points[:, 1], points[:, 0]), 2 * np.pi),
    "rp:1 gr:1,2": (lambda lines: np.arctan2(lines[:, 1], lines[:, 0]).ravel(), np.pi),
    "so:2 o:2": (lambda matrices: np.arctan2(matrices[:, 1, 0], matrices[:, 0, 0]), 2 * np.pi),
    "u:1": (lambda numbers: np.angle(numbers[:, 0, 0]), 2 * np.pi),
}
"""The angle of points, and its period."""


def angle(angles: Numbers, period: float) -> View:
    """Return the view of an angle against time, without jumps."""
    graph = Graphs(
        "",
        ["angle, degrees"],
        lambda _, points: np.degrees(angles(points))[:, None],
        growth=lambda lengths: np.full_like(lengths, np.degrees(1.0)),
        period=np.degrees(period),
    )
    return graph.view(3.2)


def coordinates(names: Sequence[str]) -> View:
    """Return the view of the coordinates of vectors."""
    return Graphs("", names, lambda _, points: np.asarray(points), growth=np.ones_like).view(3.2)


def _several(
    curves: Sequence[Curve],
    label: str,
    names: Sequence[str],
    numbers: Callable[[Any, Any], FloatArray],
    period: float = np.inf,
    wraps: bool = False,
) -> View:
    """Return the view of several numbers in the same axes.

    For several curves, the numbers with the largest ranges have axes of their own, where curves have their colours.
    """
    whole = Graphs(label, names, numbers, [(label, range(len(names)))], period=period, wraps=wraps)
    if not are_compared(curves):
        return whole.view()
    first = curves[0].first_point
    drawn = [numbers(first, part.points) for curve in curves if not curve.faint for part in curve.unbroken]
    drawn = drawn if np.isinf(period) else [np.unwrap(line, period=period, axis=0) for line in drawn]
    ranges = np.max([np.ptp(line, axis=0) for line in drawn], axis=0)
    kept = np.sort(np.argsort(-ranges, kind="stable")[:_COMPARED])
    words = " ".join(label.split())
    if len(kept) < len(names):
        words += f", {len(kept)} of {len(names)}: those with the largest ranges"
    some = [names[i] for i in kept]
    some_of = lambda _, points: numbers(first, points)[:, kept]  # noqa: E731
    few = Graphs(words, some, some_of, period=period, has_title=True, wraps=wraps)
    return few.view()._replace(draw=lambda panel, curves: (few if panel.mine else whole).draw(panel, curves))


# ---- the numbers of some spaces ----


def components(curves: Sequence[Curve]) -> View:
    """Return the view of the components of points, for spaces without a view of their own."""
    space = curves[0].space
    kept = independent(space)
    names = component_names(space.point_shape, space.dtype.kind == "c")
    return _several(curves, "components", [names[i] for i in kept], lambda _, points: real_numbers(points)[:, kept])


def real_numbers(points: Array) -> FloatArray:
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
        columns = real_numbers(np.stack([space.random_point(rng) for _ in range(3)])).T
    except (NotImplementedError, ValidationError):
        return np.arange(int(np.prod(space.point_shape)) * (2 if space.dtype.kind == "c" else 1))
    kept: list[int] = []
    for i, column in enumerate(columns):
        others = [sign * columns[j] for j in kept for sign in (1, -1)]
        if np.ptp(column) > 1e-9 and not any(np.allclose(column, other, rtol=1e-9, atol=0) for other in others):
            kept.append(i)
    return np.array(kept, np.intp)


def torus_angles(curves: Sequence[Curve]) -> View:
    """Return the view of angles in degrees between −180 and 180, where lines break."""
    names = component_names(curves[0].space.point_shape, False)
    return _several(curves, "angles, degrees", names, lambda _, points: np.degrees(points), 360, wraps=True)


def ratios(curves: Sequence[Curve]) -> View:
    """Return the view of the ratios zᵢ/z₀ on complex hyperbolic space, which do not depend on the phase."""
    n = curves[0].points.shape[1] - 1
    names = [f"{part} z{i + 1}/z0".translate(SUBSCRIPTS) for i in range(n) for part in ("Re", "Im")]
    label = "coordinates\nin the unit ball"
    return _several(curves, label, names, lambda _, points: real_numbers(points[:, 1:] / points[:, :1]))


def angles_to_first(curves: Sequence[Curve]) -> View:
    """Return the view of the principal angles to the first point, for Grassmannians and projective spaces."""
    n, k = np.reshape(curves[0].points[0], (len(curves[0].points[0]), -1)).shape
    names = [f"θ{i + 1}".translate(SUBSCRIPTS) for i in range(min(k, n - k))]

    def numbers(first: Any, points: Array) -> FloatArray:
        return principal_angles(points, first)[:, : len(names)]

    view = _several(curves, "principal angles to\nfirst point, degrees", names, numbers)

    def draw(panel: Panel, curves: Sequence[Curve]) -> None:
        view.draw(panel, curves)
        largest = max(numbers(curve.first_point, curve.points).max() for curve in curves)
        if panel.mine and largest > _RIGHT and view.rows == 1:
            # The names of the angles are to the right.
            words = "principal angles are at most 90°: they turn back there, but the curve is smooth"
            panel.explain(words, 0.4 * axes_size(panel.axes[0])[0])
            panel.axes[0].yaxis.set_major_locator(MultipleLocator(30))
            panel.axes[0].axhline(90, color=ink(0.4), linewidth=0.8, zorder=1)

    return view._replace(draw=draw)


def principal_angles(points: Array, first: Array) -> FloatArray:
    """Return the principal angles between a subspace and others in degrees, the largest first; shape (m, k).

    The sines are accurate for small angles, and the cosines for large ones.
    """
    bases = points.reshape(*points.shape[:2], -1)
    base = first.reshape(bases.shape[1:])
    shadow = base.conj().T @ bases
    cosines = np.linalg.svd(shadow, compute_uv=False)[:, ::-1]
    sines = np.linalg.svd(bases - base @ shadow, compute_uv=False)
    return np.degrees(np.arctan2(sines, cosines))


def matrix_columns(curves: Sequence[Curve]) -> View:
    """Return the view of matrices such as orthonormal frames: the entries of every column in axes of their own.

    Entries have the colours of their rows. Large matrices, and several curves, have graphs of all components.
    """
    n, k = curves[0].space.point_shape
    if k > _COLUMNS or n > len(distinct()) or are_compared(curves):
        return components(curves)
    # The legend of the first column has the names of rows.
    names = [f"x{i + 1}".translate(SUBSCRIPTS) for i in range(n) for _ in range(k)]
    groups = [(f"column {j + 1}", range(j, n * k, k)) for j in range(k)]
    graphs = Graphs("components", names, lambda _, points: points.reshape(len(points), -1), groups)
    return graphs.view(4.6)._replace(
        draw=lambda panel, curves: graphs.draw(panel, curves) if panel.mine else components(curves).draw(panel, curves)
    )
