"""Makes the eight pictures of ``index.md`` from the code of that page.

``python docs/home_figures.py``
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import guide_figures
import matplotlib.style
import numpy as np
from matplotlib.figure import Figure
from scipy.interpolate import CubicSpline

import symspline as ss

PAGE = Path(__file__).with_name("index.md")
SIZE = (4.4, 3.1)


def names_of_page() -> dict[str, Any]:
    """Run the code of the page, and return its variables."""
    names: dict[str, Any] = {}
    for code in guide_figures.code_of(PAGE):
        exec(compile(code, PAGE.name, "exec"), names)
    return names


def _panel(**options: Any) -> tuple[Figure, Any]:
    figure = Figure(figsize=SIZE, layout="constrained")
    return figure, figure.subplots(**options)


def track(names: dict[str, Any]) -> Figure:
    """Draw the track on a map with land."""
    figure, axes = _panel()
    ss.geo.plot(names["track"], ax=axes, title="")
    return figure


def poses(names: dict[str, Any]) -> Figure:
    """Draw the path of the positions with frames of the attitudes, and the path within the hole in another colour."""
    figure, axes = _panel()
    flight, t = names["flight"], names["t"]
    hole = t[np.argmax(np.diff(t))], t[np.argmax(np.diff(t)) + 1]
    x = np.linspace(*flight.domain, 400)
    at = flight(x)[1]
    inside = (x >= hole[0]) & (x <= hole[1])
    axes.plot(*np.where(inside[:, None], np.nan, at)[:, :2].T, color="C0", label="curve")
    axes.plot(*np.where(inside[:, None], at, np.nan)[:, :2].T, color="C1", label="in the hole")
    axes.plot(*flight.points[1][:, :2].T, ".", color="C0", markersize=5, label="data")
    for moment in np.arange(0.4, t[-1], 0.8):
        rotation, place = flight(moment)
        for axis, color in ((0, "C3"), (1, "C2")):
            end = place + 1.3 * rotation[:, axis]
            axes.plot([place[0], end[0]], [place[1], end[1]], color=color, linewidth=1.2)
    axes.set(xlabel="x, m", ylabel="y, m", aspect="equal")
    axes.legend(loc="center")
    return figure


def covariances(names: dict[str, Any]) -> Figure:
    """Draw the ellipses of the data above those of the curve."""
    figure, axes = _panel()
    circle = np.stack([np.cos(a := np.linspace(0, 2 * np.pi, 60)), np.sin(a)])
    months = np.arange(0, 48, 4) + 1
    for row, color, matrices in (
        (1, "0.45", names["covariances"][months]),
        (0, "C0", names["smooth"](np.clip(months, *names["smooth"].domain))),
    ):
        for month, matrix in zip(months, matrices, strict=True):
            if np.isfinite(matrix).all():
                ellipse = np.linalg.cholesky(matrix) @ circle
                axes.plot(month + 0.9 * ellipse[0], row + 0.2 * ellipse[1], color=color, linewidth=1.4)
    axes.axvspan(19.5, 25.5, color="C1", alpha=0.12, linewidth=0)
    axes.set(xlabel="month", yticks=[0, 1], ylim=(-0.6, 1.6))
    axes.set_yticklabels(["smooth", "data"])
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    return figure


def crystals(names: dict[str, Any]) -> Figure:
    """Draw the disorientation from the middle of the map, as measured and as smoothed."""
    figure, panels = _panel(ncols=2, sharey=True)
    grain = names["grain"]
    middle = grain.points[25, 15]
    for axes, points, title in zip(
        panels, (names["matrices"], grain.points), ("measured", "smooth"), strict=True
    ):
        angles = np.degrees(grain.space.distance(points, middle))
        image = axes.imshow(angles.T, origin="lower", cmap="viridis", vmin=0, vmax=20, aspect="auto")
        axes.set_title(title)
        axes.set(xlabel="x")
    panels[0].set(ylabel="y")
    figure.colorbar(image, ax=panels, location="bottom", label="disorientation from the middle, degrees")
    return figure


def robot(names: dict[str, Any]) -> Figure:
    """Draw the speeds of the joints in per cent of their limits."""
    figure, axes = _panel()
    motion, law = names["motion"], names["law"]
    x = np.linspace(0, law.duration, 400)
    for i, (rates, limit) in enumerate(zip(motion(x, nu=1), (2, 2, 3), strict=True)):
        axes.plot(x, 100 * np.abs(rates[:, 0]) / limit, label=f"joint {i + 1}")
    axes.axhline(100, color="0.5", linestyle="--", linewidth=0.8)
    axes.set(xlabel="time, s", ylabel="speed, % of the limit", ylim=(0, 135))
    axes.legend(ncols=3, loc="upper center")
    return figure


def subspaces(names: dict[str, Any]) -> Figure:
    """Draw how much of the snapshots the basis misses, against the parameter."""
    figure, axes = _panel()
    frequencies, z = names["frequencies"], names["z"]
    numbers = CubicSpline(frequencies, names["bases"])
    between = np.linspace(frequencies[0], frequencies[-1], 161)
    missed: dict[str, list[float]] = {"interpolated numbers": [], "spline of subspaces": []}
    for frequency in between:
        waves = np.cos(frequency * z + np.linspace(0, 3, 30))
        for label, basis in zip(
            missed, (np.linalg.qr(numbers(frequency))[0], names["reduced"](frequency)), strict=True
        ):
            rest = waves - basis @ (basis.T @ waves)
            missed[label].append(100 * np.linalg.norm(rest) / np.linalg.norm(waves))
    for (label, values), style in zip(missed.items(), ("C1", "C0"), strict=True):
        axes.plot(between, values, color=style, label=label)
    axes.set(xlabel="frequency", ylabel="missed by the basis, %", ylim=(0, 90))
    axes.legend()
    return figure


def sensors(names: dict[str, Any]) -> Figure:
    """Draw the measured rates, and the error of the estimate and of the gyroscope."""
    figure, axes = _panel()
    s = names["s"]
    estimated = ss.rotations.angular_velocity(names["attitude"], s)[:, 2]
    axes.plot(s, names["rates"][:, 2] - np.cos(s), ".", color="0.6", markersize=2, label="gyroscope")
    axes.plot(s, estimated - np.cos(s), color="C0", label="estimate")
    axes.axhline(0, color="0.5", linewidth=0.8)
    axes.set(xlabel="time, s", ylabel="error of the rate, rad/s", ylim=(-0.08, 0.26))
    axes.legend(loc="upper right", ncols=2)
    return figure


def batch(names: dict[str, Any]) -> Figure:
    """Draw some of the curves on a sphere."""
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.add_subplot(projection="3d")
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 40), np.linspace(0, np.pi, 20))
    axes.plot_surface(
        np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v), color="0.9", alpha=0.35, linewidth=0
    )
    for i, curve in enumerate(names["samples"][:60]):
        axes.plot(*(1.01 * curve.T), color=f"C{i % 6}", linewidth=0.7)
    axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    axes.set_box_aspect((1, 1, 1), zoom=1.6)
    axes.view_init(15, 10)
    axes.set_axis_off()
    return figure


PICTURES = (track, poses, covariances, crystals, robot, subspaces, sensors, batch)


def main() -> None:
    with matplotlib.style.context(guide_figures.STYLE.resolve()):
        names = names_of_page()
        for draw in PICTURES:
            draw(names).savefig(PAGE.with_name(f"home_{draw.__name__}.png"), dpi=110)


if __name__ == "__main__":
    main()
