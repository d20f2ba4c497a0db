"""The numbers of which a point is made, against time: the picture for spaces without a better one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import SubFigure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ..spaces import HermitianPositiveDefinite, Space, SymmetricPositiveDefinite
from .curves import Curve
from .style import DISTINCT, INK, size
from .timeline import LEFT, RIGHT, timelines

SUBSCRIPTS = str.maketrans("0123456789,", "₀₁₂₃₄₅₆₇₈₉,")
_NAMED, _OTHERS = 12, 100


def draw_components(panel: SubFigure, curves: Sequence[Curve]) -> None:
    """Every component against time, the first twelve with their names."""
    space = curves[0].space
    kept = independent(space)
    names = component_names(space.point_shape, space.dtype.kind == "c")
    numbers = [curve.marked(lambda points: components(points)[:, kept]) for curve in curves]
    draw_numbers(panel, curves, "components", [names[i] for i in kept], numbers)


def draw_numbers(
    panel: SubFigure,
    curves: Sequence[Curve],
    label: str,
    names: Sequence[str],
    numbers: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> None:
    """Several numbers against time, the first twelve with their names.

    Args:
        label: of the vertical axis.
        names: one a number; "Im ..." follows the real part of the same number.
        numbers: of every curve, one row a time, and of its given points.
    """
    in_row = min(6, int((size(panel)[0] - LEFT - RIGHT) / 0.9))
    looks = _looks(names[:_NAMED])
    handles = [Line2D([], [], linewidth=1.8 if curves[0].alone else 0.9, **look) for look in looks]
    labels = list(names[:_NAMED])
    rest = np.arange(len(names))[_NAMED:]
    if rest.size:
        handles.append(Line2D([], [], color=INK, linewidth=0.4))
        labels.append(f"{rest.size} others")
        rest = rest[:: 1 + len(rest) // _OTHERS]
    rows = -(-len(labels) // in_row)
    (axes,) = timelines(panel, curves, [label], top=0.25 + 0.22 * rows)
    for curve, (values, given) in zip(curves, numbers, strict=True):
        axes.plot(curve.times, values[:, rest], color=INK, linewidth=0.4, alpha=0.4)
        for i, look in enumerate(looks):
            axes.plot(curve.times, values[:, i], linewidth=1.8 if curve.alone else 0.9, **look)
            if curve.alone:
                places = np.column_stack([curve.on_axis(curve.given_x), given[:, i]])
                if curve.noise is None:
                    axes.plot(*places.T, "o", color=look["color"], markersize=3)
                else:
                    curve.draw_dots(axes, places, color=look["color"], alpha=0.4)
    order = [i for column in range(in_row) for i in range(column, len(labels), in_row)]
    place: dict[str, Any] = {
        "loc": "lower right",
        "bbox_to_anchor": (1, 1),
        "ncols": in_row,
        "borderaxespad": 0,
    }
    words: dict[str, Any] = {"labelcolor": INK, "fontsize": 9, "handlelength": 1.6}
    axes.legend([handles[i] for i in order], [labels[i] for i in order], frameon=False, **place, **words)


def _looks(names: Sequence[str]) -> list[dict[str, Any]]:
    """Colour and line style of every number: an imaginary part is dashed in the colour of its real part."""
    is_complex = any(name.startswith("Im ") for name in names)
    made, entry = [], -1
    for name in names:
        imaginary = name.startswith("Im ")
        entry += not imaginary
        first, second = ("--", ":") if imaginary else ("-", "-." if is_complex else "--")
        made.append({"color": DISTINCT[entry % 6], "linestyle": first if entry < 6 else second})
    return made


def components(points: NDArray[Any]) -> NDArray[np.float64]:
    """One row a point; of complex numbers the real and the imaginary parts by turns."""
    flat = points.reshape(len(points), -1)
    parts = [flat.real, flat.imag] if np.iscomplexobj(flat) else [flat]
    return np.stack(parts, axis=-1).reshape(len(points), -1)


def component_names(shape: tuple[int, ...], is_complex: bool) -> list[str]:
    """Such as x₁, x₂ or, for matrices, x₁₁; counted from 1."""
    comma = "," if max(shape) > 9 else ""
    indices = [comma.join(str(i + 1) for i in index) for index in np.ndindex(*shape)]
    names = [f"x{index.translate(SUBSCRIPTS)}" for index in indices]
    return [f"{part} {name}" for name in names for part in ("Re", "Im")] if is_complex else names


def independent(space: Space) -> NDArray[np.intp]:
    """The numbers of the components to draw: of a Hermitian matrix those that do not follow from others."""
    shape = space.point_shape
    if isinstance(space, SymmetricPositiveDefinite):
        return np.flatnonzero(np.triu(np.ones(shape)))
    if isinstance(space, HermitianPositiveDefinite):
        parts = [np.triu(np.ones(shape)), np.triu(np.ones(shape), 1)]
        return np.flatnonzero(np.stack(parts, axis=-1))
    return np.arange(np.prod(shape) * (2 if space.dtype.kind == "c" else 1))
