"""Velocities and accelerations against time, signed in one dimension, and residuals of measurements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from .._base.typing import FloatArray, Look
from .._curves.curve import SidePanel
from .._spaces import AnySpace, Euclidean, Product, SpecialEuclidean, Sphere, Torus, cover_of, factors_of, short_name
from .curves import Curve
from .panels import ALPHA, FEW_KNOTS, LINE, Panel, fill_band, fresh, plot_line, shade_quantiles, time_axes
from .style import DATA, MARK, axes_size, distinct, ink, letters_in

NORMAL = 1.96
"""Half width of the 95 % interval of a normal distribution, in standard deviations."""
IN_ROW = 3
"""The largest number of factors whose pictures are in one row."""
# Spaces and families, besides spheres and tori, in which distances are angles.
_ANGULAR = {"so:2", "so:3", "o:2", "o:3", "u:1", "su:2", "rp", "cp", "hp", "gr", "cgr"}
_STATES = {"cp:1", "cgr:1,2"}
"""Spaces whose distances are half of the angles that their picture shows."""
_SLOW = 0.01
"""Rates that are smaller per second are per hour, day or year."""
_LONG = (3600, "h"), (86_400, "d"), (31_557_600, "yr")
"""Longer units of time in seconds, and their names."""
QUATERNIONS = {"sphere:3", "su:2"}
"""Spaces whose points turn frames, at an angular velocity ω of twice their speed."""
_LEAST = 3.6
"""The smallest limit of residuals. Those far beyond most others are drawn at the edge."""
_LONGEST = 10
"""Number of letters of a space in the label of an axis."""
At = Callable[[str], Any]


class Rate(NamedTuple):
    """A number against time.

    Attributes
    ----------
    label : str
        Label of the vertical axis.
    order : int
        1 for velocities, 2 for accelerations, 0 for distances.
    values : callable
        Takes a function that evaluates a quantity, and returns numbers.
    signed : bool
        Whether the numbers have a sign.
    scale : float
        Factor from the lengths of tangent vectors to the numbers.
    whole : bool
        Whether the number is the whole length of a vector, which can have a limit.
    speed : callable
        As ``values``, for the length of the velocity to which the number belongs.
    """

    label: str
    order: int
    values: Callable[[At], FloatArray]
    signed: bool = False
    scale: float = 1.0
    whole: bool = True
    speed: Callable[[At], FloatArray] = lambda at: at("speed")


def _turned(p: Any, v: Any) -> FloatArray:
    """Return the component of a vector along the direction in which the angle of a unit vector increases."""
    return np.asarray(p[..., 0] * v[..., 1] - p[..., 1] * v[..., 0])


def _of_column(p: Any, v: Any) -> FloatArray:
    return _turned(p[..., 0], v[..., 0])


# Spaces of dimension one: a number with the sign of a velocity or an acceleration v at p.
_SIGNS: dict[str, Callable[[Any, Any], FloatArray]] = {
    "euclidean:1": lambda p, v: v[..., 0],
    "sphere:1": _turned,
    "hyperbolic:1": lambda p, v: v[..., 1],
    "rp:1": _turned,
    "gr:1,2": _of_column,
    "so:2": _of_column,
    "o:2": _of_column,
    "torus:1": lambda p, v: v[..., 0],
    "u:1": lambda p, v: np.imag(np.conj(p) * v)[..., 0, 0],
    "spd:1": lambda p, v: v[..., 0, 0],
}


def is_angular(space: AnySpace) -> bool:
    """Whether distances are angles."""
    cover = cover_of(space)
    return isinstance(cover, (Sphere, Torus)) or bool(_ANGULAR & {str(cover), str(cover).partition(":")[0]})


def rates_of(space: AnySpace, seconds: bool) -> list[Rate]:
    """Return the rates of a space that is not a product."""
    cover = cover_of(space)
    per, unit = [", 1/s", ", 1/s²"] if seconds else ["", ""], 1.0
    if isinstance(cover, Euclidean) and seconds:
        per = [", units/s", ", units/s²"]
    if is_angular(space):
        # Pictures of angles are in degrees.
        in_degrees = isinstance(cover, Torus) or (str(cover) in _SIGNS and str(cover) != "torus:1")
        unit = float(np.degrees(1.0)) if in_degrees else 1.0
        name, time = "°" if in_degrees else "rad", "s" if seconds else "t"
        per = [f", {name}/{time}", f", {name}/{time}²"]
    more = [" = |ω|/2", " = |ω′|/2"] if str(cover) in QUATERNIONS else [" of states" * (str(cover) in _STATES)] * 2
    if isinstance(cover, SpecialEuclidean):
        return _rates_of_poses(cover, seconds)
    sign = _SIGNS.get(str(cover))
    if sign is None:
        return [
            Rate(f"speed\n|γ′|{more[0]}{per[0]}", 1, lambda at: unit * at("speed"), scale=unit),
            Rate(f"acceleration\n|∇γ′|{more[1]}{per[1]}", 2, lambda at: unit * at("bend"), scale=unit),
        ]
    return [
        Rate(
            f"{name}\n{symbol}{per[order - 1]}",
            order,
            lambda at, size=size, vector=vector: unit * np.copysign(at(size), sign(at("point"), at(vector))),  # type: ignore[misc]
            True,
            unit,
        )
        for order, name, symbol, size, vector in (
            (1, "velocity", "γ′", "speed", "velocity"),
            (2, "acceleration", "∇γ′", "bend", "acceleration"),
        )
    ]


def _rates_of_poses(space: SpecialEuclidean, seconds: bool) -> list[Rate]:
    """Return rates of turning and of moving, which have different units.

    A tangent vector at (R, p) is (R ω̂, R v) with the twist (ω, v) in the body. The length of R ω̂ is √2 |ω|, and that of
    its covariant derivative √2 |ω′|. The covariant derivative of p′ = R v is R v′ = p″ − Ω × p′ with the angular
    velocity Ω in the fixed frame; the acceleration of the position is p″.
    """
    n = space.point_shape[0] - 1
    turn = ["rad/s", "rad/s²"] if seconds else ["rad/t", "rad/t²"]
    move = [", units/s", ", units/s²"] if seconds else ["", ""]

    def turning(quantity: str) -> Callable[[At], FloatArray]:
        if n == 2:
            return lambda at: _of_column(at("point")[..., :2, :2], at(quantity)[..., :2, :2])
        return lambda at: np.linalg.norm(at(quantity)[..., :n, :n], axis=(-2, -1)) / np.sqrt(2)

    def moving(at: At) -> FloatArray:
        return np.asarray(np.linalg.norm(at("velocity")[..., :n, n], axis=-1))

    def accelerated(at: At) -> FloatArray:
        rate, turns = at("velocity"), at("point")[..., :n, :n]
        spin = rate[..., :n, :n] @ turns.swapaxes(-1, -2)
        return np.asarray(np.linalg.norm((at("acceleration")[..., :n, n:] + spin @ rate[..., :n, n:])[..., 0], axis=-1))

    first, second = ("ω", "ω′") if n == 2 else ("|ω|", "|ω′|")
    rates = [
        Rate(f"turning rate\n{first}, {turn[0]}", 1, turning("velocity"), n == 2),
        Rate(f"turning accel.\n{second}, {turn[1]}", 2, turning("acceleration"), n == 2),
        Rate(f"speed\n|p′|{move[0]}", 1, moving),
        Rate(f"acceleration\n|p″|{move[1]}", 2, accelerated),
    ]
    speeds = (turning("velocity"), turning("velocity"), moving, moving)
    return [rate._replace(whole=False, speed=speed) for rate, speed in zip(rates, speeds, strict=True)]


def columns_of(
    curve: Curve, seconds: bool, most: int, wide: bool, in_row: int = IN_ROW
) -> list[list[tuple[int | None, Rate]]]:
    """Return the rates of a curve in columns, with the number of the factor of a product.

    In wide figures, turning and moving have a column each, and so have up to ``in_row`` factors, below their pictures.
    More of them have one for velocities and one for accelerations, or one for all if pictures are not in rows.
    """
    space = curve.space
    if curve.radius is not None and not isinstance(space, Product):
        return [[(None, rate) for rate in _on_earth(curve, seconds)]]
    if not isinstance(space, Product):
        rates: list[tuple[int | None, Rate]] = [(None, rate) for rate in rates_of(space, seconds)]
        if curve.is_mean and not isinstance(cover_of(space), SpecialEuclidean):
            unit = next((unit for unit in ("rad", "°") if f", {unit}/" in rates[0][1].label), "")
            rates.insert(0, (None, _deviation(curve, f", {unit}" * bool(unit), rates[0][1].scale)))
            return [rates]
        return [rates[:2], rates[2:]] if wide and len(rates) > 2 else [rates]
    factors = factors_of(space)
    parts = [curve.part(i) for i in range(min(most, len(factors)))]
    by_factor = [rates_of(part.space, seconds) if part.radius is None else _on_earth(part, seconds) for part in parts]
    if wide and len(by_factor) <= in_row:
        return [[(i, rate) for rate in group] for i, group in enumerate(by_factor)]
    names = [_cut(short_name(factor)) for factor in factors]
    if len(set(names)) < len(names):
        names = [f"factor {i}" for i in range(len(names))]
    rows: list[tuple[int | None, Rate]] = [
        (i, rate._replace(label=f"{rate.label} of {names[i]}")) for i, group in enumerate(by_factor) for rate in group
    ]
    return [[row for row in rows if row[1].order == order] for order in (1, 2)] if wide and in_row > 1 else [rows]


def _cut(name: str) -> str:
    """Return a name that fits into the label of an axis."""
    return name if len(name) <= _LONGEST else f"{name[: _LONGEST - 1]}…"


def _deviation(mean: Curve, unit: str, scale: float = 1.0) -> Rate:
    """Return the number that is the distance of a curve from the mean of its batch."""

    def distances(at: At) -> FloatArray:
        assert mean.batch is not None
        middle = mean.data.evaluate(mean.batch.x, "point", "raise", False)
        return scale * mean.space.distance(middle, at("point"))

    return Rate(f"distance\nfrom mean{unit}", 0, distances, scale=scale)


def _on_earth(curve: Curve, seconds: bool) -> list[Rate]:
    """Return rates on the Earth, whose radius is in metres."""
    radius = curve.radius or 0.0
    first, second = (3.6 * radius, radius) if seconds else (radius / 1000,) * 2
    names = ("km/h", "m/s²") if seconds else ("km per unit of t", "km per unit of t²")
    return [_deviation(curve, ", km", radius / 1000)] * curve.is_mean + [
        Rate(f"speed\n{names[0]}", 1, lambda at: first * at("speed"), scale=first),
        Rate(f"acceleration\n{names[1]}", 2, lambda at: second * at("bend"), scale=second),
    ]


def draw_rates(axes: list[Axes], curves: Sequence[Curve], column: Sequence[tuple[int | None, Rate]]) -> None:
    """Draw the rates of one of the columns of `columns_of`."""
    curves = [curve for curve in curves if curve.has_line and not curve.faint]
    parts = [curves if number is None else [curve.part(number) for curve in curves] for number, _ in column]
    rates = [rate for _, rate in column]
    if curves[0].axis.seconds and curves[0].radius is None:
        rates = [_in_longer_units(*pair) for pair in zip(rates, parts, strict=True)]
    time_axes(Panel(axes, mine=True), curves, [rate.label for rate in rates])
    for drawn in zip(axes, parts, rates, strict=True):
        _draw_rate(*drawn)


def _in_longer_units(rate: Rate, curves: Sequence[Curve]) -> Rate:
    """Return a rate per second, or per hour, day or year if it is small."""
    fastest = max(float(np.max(rate.speed(curve.at))) for curve in curves)
    if fastest >= _SLOW or fastest * max(curve.x[-1] - curve.x[0] for curve in curves) < 1e-9:
        return rate
    length, name = next((unit for unit in _LONG if unit[0] * fastest >= _SLOW), _LONG[-1])
    factor = length**rate.order
    label = rate.label.replace("/s", f"/{name}")
    return rate._replace(label=label, scale=factor * rate.scale, values=lambda at: factor * rate.values(at))


def _draw_rate(axes: Axes, curves: Sequence[Curve], rate: Rate) -> None:
    """Draw one rate. Its axis includes zero, and rounding errors of constants are not magnified."""
    batch = curves[0].batch
    drawn = [0.0, *(shade_quantiles(axes, batch, rate.values(batch.at)) if batch else ())]
    top, rounding, moves = 0.0, 0.0, False
    for curve in curves:
        speeds = rate.scale * np.abs(rate.speed(curve.at))
        errors = rate.scale * _rounding(curve)
        top, rounding = max(top, float(speeds.max())), max(rounding, float(errors.max()))
        moves |= bool((speeds > errors).any())
        if curve.is_mean and batch:
            # A mean of curves is smoother than they are, so that its rates are smaller than most of theirs.
            median = np.median(rate.values(batch.at), axis=0)
            axes.plot(batch.times, median, color=ink(), linewidth=1.8, label=f"median of {batch.count} curves")
            drawn += [float(median.min()), float(median.max())]
        else:
            drawn += _draw_values(axes, curve, rate)
    for limit in {curve.limits[0][rate.order - 1] for curve in curves if curve.limits and rate.whole} - {np.inf}:
        for bound in (limit, -limit) if rate.signed else (limit,):
            look: Look = {"color": MARK, "linewidth": 1, "linestyle": "--", "zorder": 2}
            axes.axhline(rate.scale * bound, label=fresh(axes, "limit"), **look)
            drawn.append(rate.scale * bound)
    top, rounding = (top, 0.0) if moves else (1.0, rounding)
    unit = top * max(curve.x[-1] - curve.x[0] for curve in curves) ** (1 - rate.order)
    _set_limits(axes, min(drawn), max(drawn), unit, rounding if rate.order == 1 else 1e-9 * unit, rate.signed)


def _draw_values(axes: Axes, curve: Curve, rate: Rate) -> list[float]:
    """Draw the rate of a curve with its band, if it has one, and return the limits."""
    values = rate.values(curve.at)
    deviation = curve.noise.speed if rate.order == 1 and curve.noise is not None else None
    if deviation is None:
        # Without data or a band, a smooth line would look like a measurement.
        values = curve.outside_gaps(values)
    if rate.order == 2 and curve.noise is not None and isinstance(cover_of(curve.space), SpecialEuclidean):
        # The position of smoothed poses has no acceleration at natural ends, but the curve through them has no change
        # of its twist. It adapts within one segment.
        knots = np.asarray(curve.data.times)
        values = np.where((curve.x < knots[1]) | (curve.x > knots[-2]), np.nan, values)
    spread = 0.0 if deviation is None else rate.scale * NORMAL * deviation
    low, high = values - spread, values + spread
    low = low if rate.signed or deviation is None else np.maximum(low, 0)
    width = 1.1
    if curve.alone:
        width = 1.8 if len(curve.marks) <= FEW_KNOTS or curve.noise is not None else 1.0
    for part in curve.unbroken:
        at = np.searchsorted(curve.x, part.x)
        line = np.column_stack([part.times, values[at]])
        plot_line(axes, part, line, color=part.color, linewidth=width, label=LINE)
        if deviation is not None:
            fill_band(axes, part, low[at], high[at])
    return [float(np.nanmin(low)), float(np.nanmax(high))]


def _rounding(curve: Curve) -> FloatArray:
    """Return the speeds that rounding errors of points explain, at all times; a curve at rest has them."""
    knots = np.asarray(curve.data.times)
    segment = np.clip(np.searchsorted(knots, curve.x, side="right") - 1, 0, len(knots) - 2)
    return np.asarray(1e-15 * np.abs(curve.points).max() / np.diff(knots)[segment])


def _set_limits(axes: Axes, low: float, high: float, unit: float, small: float, signed: bool) -> None:
    """Set the limits of the vertical axis, those of a unit if all values are small."""
    if max(high, -low) <= small:
        low, high = (-unit if signed else 0.0), unit
    if signed:
        axes.axhline(0.0, color=ink(0.4), linewidth=0.8, zorder=1)
    margin = 0.08 * (high - low)
    axes.set_ylim(low - margin if signed else 0.0, high + margin)


# ---- radii of bands, and residuals ----


def residuals_of(spline: Any, curve: Curve, has_band: Sequence[bool]) -> list[SidePanel]:
    """Return the panels of a spline, without the bands of factors whose picture shows them; a batch has none."""
    if not curve.alone or curve.is_mean:
        return []
    panels = spline._panels_below(curve.x)
    return [panel for panel in panels if len(panel.x) and (panel.factor is None or not has_band[panel.factor])]


def draw_residuals(axes: list[Axes], curve: Curve, panels: Sequence[SidePanel]) -> None:
    """Draw radii of bands, residuals in standard deviations, and λ and the noise where they vary."""
    time_axes(Panel(axes, mine=True), [curve], [panel.label for panel in panels], marked=False)
    for one, panel in zip(axes, panels, strict=True):
        words = _DRAWN[panel.kind](one, curve, panel)
        words = fill(words, letters_in(axes_size(one)[0]))
        one.set_title(words, loc="right", fontsize="small", weight="normal", pad=3)


def _draw_radii(axes: Axes, curve: Curve, panel: SidePanel) -> str:
    """Draw the radius of a band against time."""
    radii = panel.values[:, 0]
    axes.fill_between(curve.times, 0, radii, color=curve.color, alpha=ALPHA, linewidth=0, label=curve.band_name)
    axes.plot(curve.times, radii, color=curve.color, linewidth=1.2)
    axes.set_ylim(0, 1.15 * radii.max())
    return "radius of the ball that contains the true point with 95 % probability"


def _draw_lam(axes: Axes, curve: Curve, panel: SidePanel) -> str:
    """Draw the weight of every segment on a logarithmic axis."""
    lam = panel.values[:, 0]
    axes.set_yscale("log")
    axes.plot(curve.on_axis(panel.x), lam, color=curve.color, linewidth=1.2, drawstyle="steps-post")
    # At least two decades, so that the axis has numbers.
    low, high = np.log10(lam.min()), np.log10(lam.max())
    margin = max(0.06 * (high - low), 0.5 * (2.2 - (high - low)))
    axes.set_ylim(10 ** (low - margin), 10 ** (high + margin))
    axes.yaxis.set_major_locator(LogLocator(numticks=5))
    axes.yaxis.set_minor_locator(NullLocator())
    return "weight of the penalty, per segment"


def _draw_noise(axes: Axes, curve: Curve, panel: SidePanel) -> str:
    """Draw the standard deviation of the noise against time, in metres on the Earth."""
    radius = None if isinstance(panel.space, Euclidean) else curve.radius
    sigma = panel.values[:, 0] * (radius or 1)
    axes.plot(curve.on_axis(panel.x), sigma, color=curve.color, linewidth=1.2)
    axes.set_ylim(0, 1.15 * sigma.max())
    if radius is not None:
        axes.set_ylabel(f"{panel.label}, m")
    elif panel.space is not None and is_angular(panel.space):
        axes.set_ylabel(f"{panel.label}, rad")
    return "standard deviation of the noise in one coordinate"


def _draw_deviations(axes: Axes, curve: Curve, panel: SidePanel) -> str:
    """Draw residuals, and the limits between which 95 % of them should lie."""
    times, values, sizes = curve.on_axis(panel.x), panel.values, np.abs(panel.values)
    top = max(_LEAST, min(1.1 * float(sizes.max()), 1.5 * float(np.quantile(sizes, 0.99))))
    axes.set_ylim(-top, top)
    axes.axhspan(-NORMAL, NORMAL, facecolor=curve.color, alpha=0.08, linewidth=0, zorder=0.6)
    axes.axhline(0.0, color=ink(0.4), linewidth=0.8, zorder=1)
    look: Look = {"linestyle": "none", "markeredgewidth": 0, "zorder": 3, "rasterized": values.size > 5000}
    size = float(np.clip(40 / np.sqrt(values.size), 2.2, 4.0))
    colors = distinct() if panel.names else [DATA]
    for k, column in enumerate(values.T):
        look["color"] = colors[k % len(colors)]
        kept = np.abs(column) <= top
        label = f"residual in {panel.names[k]}" if panel.names else "_residual"
        axes.plot(times[kept], column[kept], marker="o", markersize=size, alpha=0.6, label=label, **look)
        for sign, marker in ((1, "^"), (-1, "v")):
            far = sign * column > top
            axes.plot(times[far], np.full(int(far.sum()), 0.95 * sign * top), marker=marker, markersize=6, **look)
    words = f"{100 * np.mean(sizes > NORMAL):.1f} % beyond ±{NORMAL} (5 % expected)"
    beyond = int((sizes > top).sum())
    return words + (f"; {beyond} beyond the axis (triangles)" if beyond else "")


_DRAWN: dict[str, Callable[[Axes, Curve, SidePanel], str]] = {
    "residuals": _draw_deviations,
    "radii": _draw_radii,
    "lam": _draw_lam,
    "sigma": _draw_noise,
}
