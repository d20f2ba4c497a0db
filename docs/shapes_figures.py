"""Makes the figures of shapes.md, after Figs. 7 to 9 of the paper.

The paper does not give the coordinates of its landmarks: these are our own. As there, the landmarks 0, 1 and 3 of
(C) lie on a line, and the curve crosses the rim of the disc.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import symspline as ss

DRAWINGS = {
    "A": [[0, 0], [1, 0], [1.1, 0.3], [0, 1]],
    "B": [[0, 0], [1, 0.1], [0.75, 1.0], [-0.4, 0.6]],
    "C": [[0, 0], [1, 0], [0.3, 0.9], [-0.4, 0]],
    "D": [[0, 0], [1, -0.2], [0.75, 0.5], [-0.5, -0.6]],
}
CLOSED = np.array([DRAWINGS[name] for name in "ABCDA"])


def drawings() -> Figure:
    """Fig. 7: the four sets of landmarks."""
    figure = Figure(figsize=(9, 2.6), layout="constrained")
    for axes, (name, drawing) in zip(figure.subplots(1, 4), DRAWINGS.items(), strict=True):
        axes.fill(*np.transpose(drawing), facecolor="#0b559f22", edgecolor="#0b559f")
        for number, place in enumerate(drawing):
            axes.plot(*place, "o", color="#0b559f")
            axes.annotate(f"$p_{number}$", place, (4, 4), textcoords="offset points")
        axes.set(aspect="equal", xlim=(-1.1, 1.4), ylim=(-0.8, 1.3), title=f"({name})")
        axes.set_axis_off()
    return figure


def shape_spline() -> ss.CubicSpline:
    """The closed spline (A)–(B)–(C)–(D)–(A) of the shapes measured from landmark 0, on Gr(2, 3)."""
    return ss.CubicSpline(None, ss.shapes.from_landmarks(CLOSED, base=0), "gr:2,3", bc_type="periodic")


def on_disc(shapes: np.ndarray) -> np.ndarray:
    """The stereographic projection (25) of normals in the half sphere z ≤ 0 of (24)."""
    vectors = np.cross(shapes[..., 0], shapes[..., 1])
    x, y, z = np.moveaxis(np.where(vectors[..., 2:] > 0, -vectors, vectors), -1, 0)
    return np.stack([x / (1 - z), y / (1 - z)], axis=-1)


def disc() -> Figure:
    """Fig. 8: the spline in the unit disc, opposite points of whose rim are the same."""
    spline = shape_spline()
    curve = on_disc(spline(np.linspace(0, 4, 2000)))
    (crossings,) = np.nonzero(np.linalg.norm(np.diff(curve, axis=0), axis=1) > 1)
    figure = Figure(figsize=(4.6, 4.6), layout="constrained")
    axes = figure.subplots()
    axes.add_patch(Circle((0, 0), 1, facecolor="#0b559f11", edgecolor="0.4"))
    axes.plot(*np.insert(curve, crossings + 1, np.nan, axis=0).T, color="#0b559f")
    for i in crossings:
        rim = curve[i] / np.linalg.norm(curve[i])
        axes.plot(*np.transpose([rim, -rim]), "o", color="#c1440e", markerfacecolor="white")
    for place, name in zip(on_disc(spline.points[:4]), "ABCD", strict=True):
        axes.plot(*place, "o", color="#0b559f")
        axes.annotate(f"({name})", place, (6, 4), textcoords="offset points")
    axes.set(aspect="equal")
    axes.set_axis_off()
    return figure


def coordinates(shapes: np.ndarray) -> np.ndarray:
    """The a and b with p₂ = a e₀ + b e₁, e₀ = p₁ − p₀ and e₁ = p₃ − p₀."""
    frame = np.moveaxis(shapes[:, [0, 2]], 1, 2)
    return np.linalg.solve(frame, shapes[:, 1, :, None])[..., 0]


def local_coordinates() -> Figure:
    """Fig. 9: in coordinates that three of the landmarks give, the curve goes to infinity at (C)."""
    spline = shape_spline()
    # None of the times is that of (C), where there are no such coordinates.
    x = np.linspace(0, 4, 2000)
    figure = Figure(figsize=(7, 3.2), layout="constrained")
    axes = figure.subplots()
    for values, name in zip(coordinates(spline(x)).T, "ab", strict=True):
        axes.plot(x, np.where(np.abs(values) < 30, values, np.nan), label=f"${name}$")
    axes.set(ylim=(-12, 12), xlabel="t", xticks=range(5), xticklabels=[f"({name})" for name in "ABCDA"])
    axes.legend(frameon=False)
    return figure


def main() -> None:
    folder = Path(__file__).parent
    drawings().savefig(folder / "shapes_drawings.png", dpi=110)
    disc().savefig(folder / "shapes_disc.png", dpi=110)
    shape_spline().plot(folder / "shapes_spline.png")
    local_coordinates().savefig(folder / "shapes_coordinates.png", dpi=110)


if __name__ == "__main__":
    main()
