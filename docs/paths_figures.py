"""Makes the figures of guide/paths.md from the code of that page."""

import re
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

PAGE = Path(__file__).parent / "guide" / "paths.md"


def names_of_page() -> dict[str, Any]:
    """Run the code of the page up to the first time law, and return its variables."""
    names: dict[str, Any] = {}
    for code in re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.M | re.S)[:3]:
        exec(compile(code, PAGE.name, "exec"), names)
    return names


def closest(names: dict[str, Any]) -> Figure:
    """Draw the curve, points near it, and the geodesics to the nearest points."""
    figure = Figure(figsize=(5, 5))
    axes = figure.add_subplot(projection="3d")
    curve, noisy, feet = names["curve"], names["noisy"], names["feet"]
    axes.plot(*curve(np.linspace(*curve.domain, 400)).T, color="C0")
    paths = curve.space.geodesic(noisy, feet, np.linspace(0, 1, 9)[:, None])
    for path in np.swapaxes(paths, 0, 1):
        axes.plot(*path.T, color="0.5", linewidth=0.8)
    axes.scatter(*noisy.T, color="C1", s=14, depthshade=False)
    axes.scatter(*feet.T, color="C0", s=8, depthshade=False)
    axes.set_aspect("equal")
    axes.view_init(*_direction(noisy.mean(axis=0)))
    axes.set_axis_off()
    return figure


def _direction(p: Any) -> tuple[float, float]:
    return float(np.degrees(np.arcsin(p[2] / np.linalg.norm(p)))), float(np.degrees(np.arctan2(p[1], p[0])))


def law(names: dict[str, Any]) -> Figure:
    """Draw speed and acceleration against time, with their limits."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    acceleration = np.linalg.norm(names["acceleration"], axis=-1)
    rows = ("speed", names["speed"], 1.0), ("acceleration", acceleration, 2.0)
    panels = figure.subplots(2, 1, sharex=True)
    for axes, (label, values, limit) in zip(panels, rows, strict=True):
        axes.axhline(limit, color="0.5", linestyle="--", linewidth=0.8)
        axes.plot(names["seconds"], values)
        axes.set(ylabel=label, ylim=(0, 1.15 * limit))
    panels[-1].set(xlabel="time")
    return figure


def main() -> None:
    names = names_of_page()
    for name, draw in (("closest", closest), ("law", law)):
        draw(names).savefig(PAGE.with_name(f"paths_{name}.png"), dpi=85)


if __name__ == "__main__":
    main()
