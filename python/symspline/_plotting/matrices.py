"""Matrices as symbols along a time axis or a path.

Rotations are frames, as in Fig. 5 of Bogfjellmo, Modin and Verdier (2018), and so are rigid motions. Positive definite
matrices are ellipses and ellipsoids. Their semi-axes are parallel to the eigenvectors and as long as the square roots
of the eigenvalues: one standard deviation, if the matrices are covariances.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgba, to_rgba_array
from matplotlib.transforms import Affine2DBase

from .._base.angles import matrices_of_quaternions
from .._base.typing import Array, FloatArray, Look
from .._core import CutLocusError, convert_rotations
from .._spaces import SpecialOrthogonal, cover_of
from .curves import Curve, Mover, are_compared
from .globe import caps, centre_of
from .graphs import Graphs, component_names, components
from .panels import FEW_KNOTS, FRAME, Panel, View, fresh, mark_knots, time_axes, timeline
from .rates import QUATERNIONS
from .style import AXES, MARK, SUBSCRIPTS, Numbers, apart, axes_size, evenly, ink, round_below, time_colors

ROTATIONS = SpecialOrthogonal(3)
VIEW = np.array([[-0.5, 0.866, 0.0], [-0.296, -0.171, 0.940], [0.814, 0.470, 0.342]])
"""Directions to the right, up and towards the viewer, who sees the first axis point forwards and the third up."""
REACH = 0.5
"""The largest distance in inches by which a symbol extends to the left and right."""
_LEAST_ROW = 0.6
"""The smallest height of a row in inches."""
_LEAST, _SHORT, _CROWDED = 8.0, 0.32, 5.0
"""Arrows are shorter than the time axis by a factor, the smallest length in inches if there are many, and the width of
axes in which fewer of them are drawn."""
_BESIDE = 20
"""The largest number of curves of a batch that are drawn beside their mean."""
_PAIRS = 15
"""The largest number of correlations that have names."""
_SMALL = np.radians(12)
"""Rotations by less than this are graphs."""
_LARGE = np.radians(150)
"""Rotations by less than this from the first or the middle one are graphs if there are gaps, noise or other factors."""
_JUMP = np.radians(170)
"""Rotation vectors are drawn up to this length."""
_ANGLES = np.linspace(0, 2 * np.pi, 97)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), 0 * _ANGLES], axis=-1)


# ---- symbols in rows along a time axis ----


class Inches(Affine2DBase):
    """Inches in axes of their present size, which later become longer or shorter with the smaller side of the axes."""

    def __init__(self, axes: Axes) -> None:
        super().__init__()
        self.box, self.size = axes.bbox, axes_size(axes)
        self.set_children(axes.bbox)

    def get_matrix(self) -> FloatArray:
        """Return the matrix for the size that the axes have now."""
        scale = min(self.box.width / self.size[0], self.box.height / self.size[1])
        return np.diag([scale, scale, 1.0])


class _Row(NamedTuple):
    """One row of symbols.

    Attributes
    ----------
    curve : Curve
        Curve of the row.
    name : {"given", "data", "curve", ""}
        Whether the row has given points, noisy data or samples of the curve; empty for one of several curves.
    """

    curve: Curve
    name: str

    @property
    def has_given(self) -> bool:
        """Whether the symbols are given points."""
        return self.name in ("given", "data") or not self.curve.has_line

    def symbols(self, width: float, reach: float, apart_by: float) -> tuple[FloatArray, Any, FloatArray | None]:
        """Return times on matplotlib's axis, points, and the radii of the band, for symbols that fit into the row.

        The time axis has ``width`` inches, and symbols extend by at most ``reach`` inches to the left and right. Given
        points that are closer together than ``apart_by`` times this are omitted; samples of the curve are equidistant.
        If all given points have a symbol, the curve has one below each of them, and equidistant ones between.
        """
        curve = self.curve
        if self.has_given:
            times = curve.on_axis(curve.given_x)
            kept = apart(times, apart_by * reach / width * (curve.times[-1] - curve.times[0]))
            return times[kept], curve.given[kept], None
        number = max(2, int(width / (2 * reach)) + 1)
        wanted = np.linspace(curve.x[0], curve.x[-1], number)
        step = wanted[1] - wanted[0]
        nodes = curve.x[curve.knots]
        shortest, part = np.diff(nodes).min(initial=np.inf), 0.49 * apart_by
        if curve.noise is None and curve.has_nodes and self.name and shortest > part * step:
            inner = [
                np.linspace(*ends, 1 + max(1, int((ends[1] - ends[0]) / step + 1 - part))) for ends in pairwise(nodes)
            ]
            wanted = np.unique(np.concatenate(inner))
        even = np.searchsorted(curve.x, wanted)
        # There are no samples in gaps.
        even = np.unique(even[curve.x[even] - wanted < 0.1 * step])
        # Short segments have a symbol, too.
        bounds = np.searchsorted(curve.x, [[part.x[0], part.x[-1]] for part in curve.unbroken])
        empty = [(first + last) // 2 for first, last in bounds if not ((even >= first) & (even <= last)).any()]
        even = np.union1d(even, np.array(empty, int))
        return curve.times[even], curve.points[even], None if curve.radii is None else curve.radii[even]

    def title(self, shown: int, mine: bool) -> str:
        """Return the name beside the row, with the number of given points that have a symbol, if not all have."""
        curve, given = self.curve, len(self.curve.given)
        name = "mean\ncurve" if curve.is_mean else self.name
        if name and curve.label and not mine:
            name = f"{curve.label}: {name}"
        if not name:
            name = "\n".join(wrap(curve.label, 13, max_lines=3, placeholder=" …")) if curve.label else "━━"
        return name + (f"\n{shown} of {given}" if self.has_given and shown < given else "")


class _Rows:
    """Axes with rows of symbols; row i is at height −i.

    The only curve of a figure has two rows: its given points, and the curve at equidistant times. Each of several
    curves has one row.
    """

    def __init__(self, panel: Panel, curves: Sequence[Curve]) -> None:
        (axes,) = time_axes(panel, curves, [""])
        width, high = axes_size(axes)
        if not panel.mine:
            # Other axes have margins for the symbols at both ends.
            start, stop = min(curve.times[0] for curve in curves), max(curve.times[-1] for curve in curves)
            reach = min(REACH, width / 8)
            margin = reach * (stop - start) / (width - 2 * reach)
            axes.set_xlim(start - margin, stop + margin)
            width -= 2 * reach
        first = curves[0]
        if len(curves) == 1 and first.has_line:
            self.rows = [_Row(first, "curve")]
            if len(first.given) and (first.noise is not None or first.has_nodes) and not first.is_mean:
                self.rows.insert(0, _Row(first, "given" if first.noise is None else "data"))
        else:
            self.rows = [_Row(curves[i], "") for i in evenly(len(curves), max(1, int(high // _LEAST_ROW)))]
        axes.set_ylim(0.5 - len(self.rows), 0.5)
        axes.grid(visible=False, axis="y")
        self.panel, self.axes, self.width, self.height = panel, axes, width, high / len(self.rows)
        shown = len(self.rows), len(curves)
        self.words = f"{shown[0]} of {shown[1]} curves" if not self.rows[0].name and shown[0] < shown[1] else ""

    def reach_between(self) -> float:
        """Return the reach of symbols of which one fits between any two given points."""
        row = self.rows[-1]
        return self.width / (4.2 * len(row.curve.given)) if row.name == "curve" and row.curve.noise is None else REACH

    def symbols(self, reach: float, apart_by: float) -> list[tuple[FloatArray, Any, FloatArray | None]]:
        """Name the rows, and return their symbols, which extend by ``reach`` inches and are ``apart_by`` times that."""
        made = [row.symbols(self.width, reach, apart_by) for row in self.rows]
        names = [row.title(len(symbols[0]), self.panel.mine) for row, symbols in zip(self.rows, made, strict=True)]
        self.axes.set_yticks([-i for i in range(len(names))], names, fontsize="small")
        self.axes.tick_params(axis="y", length=0)
        if self.panel.mine:
            for label, row in zip(self.axes.get_yticklabels(), self.rows, strict=True):
                label.set_color(ink() if row.name else row.curve.color)
            self.axes.spines["left"].set_visible(False)
            # The layout leaves space for symbols at both ends of the axis.
            self.axes.tick_params(axis="y", pad=72 * reach)
            self.axes.annotate(".", (1, 0.5), (72 * reach, 0), **_BESIDE_AXES, alpha=0)
        return made

    def in_inches(self, times: FloatArray, row: int) -> Look:
        """Return the options of a collection with paths in inches around times in a row."""
        return {
            "offsets": np.column_stack([times, np.full(len(times), -row)]),
            "offset_transform": self.axes.transData,
            "transform": Inches(self.axes),
            "clip_on": False,
        }

    @property
    def view_width(self) -> float:
        """Width in inches of the axes of space above the right corner."""
        return 0.13 * float(rcParams["font.size"])

    def draw_view(self) -> None:
        """Draw the axes of space above the right corner, as they are seen. Axes of the user have no space for them."""
        if not self.panel.mine:
            return
        axes, size = self.axes, 0.01 * rcParams["font.size"]
        inches = 10 * size / np.array(axes_size(axes))
        foot = np.array([1.0, 1.0]) + [-0.3, 0.16] * inches
        look: Look = {"units": "inches", "scale_units": "inches", "angles": "uv", "in_layout": False, "clip_on": False}
        look |= {"scale": 0.4 / size, "width": 0.14 * size, "color": ink(), "transform": axes.transAxes}
        axes.quiver(*foot[:, None].repeat(3, 1), *VIEW[:2], **look)
        look = {"transform": axes.transAxes, "fontsize": "small", "ha": "center", "va": "center"}
        for name, end in zip(("x₁", "x₂", "x₃", "view"), (*VIEW[:2].T, np.array([-1.6, 0])), strict=True):
            x, y = foot + 0.36 * end * inches
            axes.text(x, y, name, **look)


_BESIDE_AXES: Look = {"xycoords": "axes fraction", "textcoords": "offset points", "ha": "right", "va": "center"}


# ---- rotations ----


# Points of S³ are unit quaternions, scalar first. Those of SU(2) act on R³ as rotations.
MATRICES: dict[str, Numbers] = {
    "sphere:3": matrices_of_quaternions,
    "so:3": np.asarray,
    "o:3": np.asarray,
    "su:2": lambda matrices: matrices_of_quaternions(quaternions(matrices)),
}
"""Matrices of rotations, shape (..., 3, 3)."""


def quaternions(matrices: Array) -> FloatArray:
    """Return the unit quaternions w, x, y, z of matrices w − i(xσ₁ + yσ₂ + zσ₃) of SU(2), shape (..., 4)."""
    a, b = matrices[..., 0, 0], matrices[..., 1, 0]
    return np.stack([a.real, -b.imag, b.real, -a.imag], axis=-1)


def rotations(curves: Sequence[Curve]) -> View:
    """Return the view of rotations: frames along a time axis, or graphs of rotation vectors.

    Frames would look equal, would not show long gaps or noisy data, or have no space beside other factors of a product
    and other curves.
    """
    curves = [curve for curve in curves if not curve.faint]
    name = str(cover_of(curves[0].space))
    matrices = MATRICES[name]
    first = matrices(curves[0].first_point)
    # Points of O(3) have one determinant along a curve.
    turned = np.concatenate([first.T @ matrices(curve.extent) for curve in curves])
    largest = ROTATIONS.distance(np.eye(3), turned).max()
    start = "start of the " + "mean " * curves[0].is_mean + "curve"
    if largest < _SMALL:
        return _rotation_vectors(matrices, first, start)
    if are_compared(curves) or any(curve.is_factor or len(curve.gaps) or curve.noise is not None for curve in curves):
        if largest < _LARGE:
            return _rotation_vectors(matrices, first, start)
        try:
            middle = centre_of(ROTATIONS, turned[:: 1 + len(turned) // 2000])
        except CutLocusError:
            pass
        else:
            if ROTATIONS.distance(middle, turned).max() < _LARGE:
                return _rotation_vectors(matrices, first @ middle, "middle rotation")
    frames = partial(_draw_rotations, matrices=matrices, name="unit quaternions" * (name in QUATERNIONS))
    return timeline(frames, 3.6, in_rows=True)


def _rotation_vectors(matrices: Numbers, first: FloatArray, name: str) -> View:
    """Return the view of the rotation vectors of rotations from a given one."""

    def numbers(_: Any, points: Array) -> FloatArray:
        turned = np.ascontiguousarray(matrices(points) @ first.T)
        vectors = convert_rotations(turned, "matrix", "vector", 1e-7)[0]
        # In long gaps the vector may jump where the angle reaches half a turn.
        return np.where(np.linalg.norm(vectors, axis=1, keepdims=True) < _JUMP, vectors, np.nan)

    return (
        Graphs(
            f"rotation vector log(R R₀ᵀ) in rad, R₀: {name}",
            ["about x₁", "about x₂", "about x₃"],
            numbers,
            # The largest singular value of the inverse of the left Jacobian.
            growth=lambda angles: np.asarray(1 / np.sinc(angles / 2 / np.pi)),
            has_title=True,
            equal_scales=True,
        )
        .view(4.8)
        ._replace(has_many=True)
    )


def _draw_rotations(panel: Panel, curves: Sequence[Curve], matrices: Numbers, name: str) -> None:
    """Draw the columns of rotation matrices as arrows along a time axis.

    Discs at the tips contain the true direction of an axis with the probability of the band.
    """
    rows = _Rows(panel, curves)
    length = min(max(_SHORT, min(REACH, 1.2 * rows.reach_between())), 0.48 * rows.height, rows.width / _LEAST)
    words = [f"frames: rotations by {name}"] * bool(name) + [rows.words]
    apart_by = 1.8 if rows.width < _CROWDED else 1.1
    made = rows.symbols(0.8 * length, apart_by)
    for i, (row, (times, symbols, radii)) in enumerate(zip(rows.rows, made, strict=True)):
        frames = matrices(symbols)
        if radii is not None:
            _draw_discs(rows, i, times, length, frames, radii)
        light = np.full(len(times), row.name == "data")
        if row.name == "curve" and row.curve.noise is None and row.curve.has_nodes:
            light = ~np.isin(times, row.curve.times[row.curve.knots])
            words.append("lighter: between given ones")
        frames = frames * np.where(light, 0.75, 1.0)[:, None, None]
        _draw_arrows(rows.axes, times, -i, length * frames, np.where(light, 0.5, 1.0))
    for color, axis in zip(AXES, FRAME, strict=True):
        # For legends.
        rows.axes.plot([], [], color=color, linewidth=2.4, label=fresh(rows.axes, axis))
    panel.explain("; ".join(filter(None, words)), rows.view_width)
    rows.draw_view()

    def body() -> Mover:
        curve, row = curves[0], len(rows.rows) - 1
        arrows = _draw_arrows(rows.axes, curve.times[:1], -row, np.eye(3)[None], np.ones(1))
        arrows.set(zorder=9, color=AXES)
        drawn = 1.2 * length * VIEW[:2] @ matrices(curve.points)

        def move(sample: int) -> None:
            arrows.set_offsets(np.column_stack([curve.times[sample].repeat(3), np.full(3, -row)]))
            arrows.set_UVC(*drawn[sample])

        return move

    curves[0].bodies.append((curves[0].x, body))


def _draw_arrows(axes: Axes, times: FloatArray, row: int, frames: FloatArray, opacity: FloatArray) -> Any:
    """Draw the columns of matrices, shape (m, 3, 3), in inches. Nearer columns cover farther ones."""
    seen = VIEW @ frames
    order = np.argsort(seen[:, 2], axis=-1)
    right, up, _ = np.moveaxis(np.take_along_axis(seen, order[:, None], axis=-1), 1, 0)
    # Layouts would add the length of the arrows in data to their extent.
    look: Look = {"units": "inches", "scale_units": "height", "scale": axes_size(axes)[1], "clip_on": False}
    look |= {"in_layout": False, "headwidth": 3.5, "headlength": 4.5, "headaxislength": 4.2, "zorder": 4}
    look["width"] = 0.028 if opacity.max() == 1 else 0.018
    colors = to_rgba_array(np.array(AXES)[order.ravel()])
    colors[:, 3] = np.repeat(opacity, 3)
    positions = np.repeat(times, 3), np.full(3 * len(times), row)
    return axes.quiver(*positions, right.ravel(), up.ravel(), color=colors, **look)


def _draw_discs(rows: _Rows, row: int, times: FloatArray, length: float, frames: FloatArray, radii: FloatArray) -> None:
    """Draw the caps of angular radii ``radii`` around the columns of rotation matrices, shape (m, 3, 3).

    The rotations by angles up to r move a unit vector to all points of the cap of radius r around it.
    """
    for i, color in enumerate(AXES):
        rings = length * caps(frames[:, :, i], radii) @ VIEW[:2].T
        label = fresh(rows.axes, rows.rows[row].curve.band_name)
        look: Look = {"facecolors": [to_rgba(color, 0.3)], "linewidths": 0, "label": label, "zorder": 5}
        rows.axes.add_collection(PolyCollection(list(rings), **look, **rows.in_inches(times, row)))


# ---- positive definite matrices ----


def outlines(matrices: FloatArray) -> FloatArray:
    """Return the ellipses of matrices or the outlines of ellipsoids, shape (m, 97, 2)."""
    roots, axes = _half_axes(matrices[:, :2, :2])
    return np.asarray(_CIRCLE[:, :2] * roots[:, None] @ axes)


def sections(matrices: FloatArray) -> FloatArray:
    """Return the near halves of the sections through two semi-axes, shape (m, 3, 97, 2); the far halves are NaN."""
    roots, axes = (array[:, None] for array in _half_axes(matrices))
    rings = np.stack([np.roll(_CIRCLE[:, [1, 0, 2]], i + 1, axis=1) for i in range(3)])
    normals = rings / roots[..., None, :] @ axes
    return np.asarray(np.where(normals[..., 2:] > 0, (rings * roots[..., None, :] @ axes)[..., :2], np.nan))


def _half_axes(matrices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the square roots of the eigenvalues, and the eigenvectors in rows."""
    values, vectors = np.linalg.eigh(matrices)
    # Rounding can make an eigenvalue 0 or negative.
    return np.sqrt(np.maximum(values, 1e-16 * values[:, -1:])), vectors.swapaxes(1, 2)


def _draw_ellipses(panel: Panel, curves: Sequence[Curve], view: FloatArray) -> None:
    """Draw rows of ellipses along the time axis, coloured by time and on the same scale. Given ones are filled.

    The rows of ``view`` are the directions to the right, up and, for ellipsoids, towards the viewer.
    """
    rows = _Rows(panel, curves)
    # The largest horizontal and vertical half widths of the ellipses.
    across, high = (
        np.sqrt(max(float((view[i] @ row.curve.extent @ view[i]).max()) for row in rows.rows)) for i in (0, 1)
    )
    inches = min(max(0.65 * REACH, min(REACH, rows.reach_between())) / across, 0.45 * rows.height / high)
    for i, (row, (times, symbols, radii)) in enumerate(
        zip(rows.rows, rows.symbols(1.05 * inches * across, 2.0), strict=True)
    ):
        _draw_row(rows, i, inches, times, view @ symbols @ view.T, radii)
        if row.curve.is_mean and row.curve.batch is not None:
            batch = row.curve.batch
            others = batch.at("point")[:, np.searchsorted(batch.times, times).clip(max=len(batch.x) - 1)]
            for one in others[evenly(len(others), _BESIDE)]:
                look: Look = {"facecolors": "none", "edgecolors": [ink(0.7)], "alpha": 0.3, "linewidths": 0.6}
                look |= {"label": fresh(rows.axes, "single curves"), "zorder": 3.5} | rows.in_inches(times, i)
                rows.axes.add_collection(PolyCollection(list(inches * outlines(view @ one @ view.T)), **look))
    length = round_below(0.8 / inches)
    words = [f"half axes: √eigenvalues, bar: {length:g}", "arcs: front halves of principal sections" * (len(view) == 3)]
    words += ["colour: time" * (not curves[0].is_mean), rows.words]
    right = rows.view_width if len(view) == 3 and panel.mine else 0.05
    panel.explain("; ".join(filter(None, words)), right + inches * length + 0.1)
    draw_bar(rows.axes, inches * length, right, 0.12 if panel.mine else -0.1)
    if len(view) == 3:
        rows.draw_view()

    def body() -> Mover:
        curve, row = curves[0], len(rows.rows) - 1
        drawn = inches * outlines(view @ curve.points @ view.T)
        look = rows.in_inches(curve.times[:1], row)
        ellipse = PolyCollection([drawn[0]], facecolors="none", edgecolors=MARK, linewidths=2.2, zorder=9, **look)
        rows.axes.add_collection(ellipse, autolim=False)

        def move(sample: int) -> None:
            ellipse.set_verts([drawn[sample]])
            ellipse.set_offsets([[curve.times[sample], -row]])

        return move

    curves[0].bodies.append((curves[0].x, body))


ELLIPSES, ELLIPSOIDS = (timeline(partial(_draw_ellipses, view=view), 3.6, in_rows=True) for view in (np.eye(2), VIEW))
"""The views of positive definite matrices of order 2 and 3."""


def draw_bar(axes: Axes, length: float, right: float, above: float) -> None:
    """Draw a bar of a length in inches, from the upper right corner of axes by inches to the left and upwards."""
    tick = [[(x, above - 0.04), (x, above + 0.04)] for x in (-right - length, -right)]
    look: Look = {"offsets": [(1, 1)], "offset_transform": axes.transAxes, "clip_on": False, "in_layout": False}
    look |= {"transform": Inches(axes), "colors": [ink()], "linewidths": 1.2}
    line = [(-right - length, above), (-right, above)]
    axes.add_collection(LineCollection([line, *tick], **look), autolim=False)


def _draw_row(
    rows: _Rows, row: int, inches: float, times: FloatArray, matrices: FloatArray, radii: FloatArray | None
) -> None:
    """Draw ellipses in a row, coloured by time; those of noisy data have one colour.

    ``inches`` is the length of 1 on paper, as the time axis has another scale. Bands are shaded. The matrices at
    distances up to r from P in the affine-invariant metric have ellipses between those of exp(−r)P and exp(r)P, and
    touch both.
    """
    axes, name, curve = rows.axes, rows.rows[row].name, rows.rows[row].curve
    first, last = (edge([float(line.curve.times[i]) for line in rows.rows]) for edge, i in ((min, 0), (max, -1)))
    colors = time_colors((times - first) / (last - first))
    if name == "data" or curve.is_mean:
        colors[:] = to_rgba(ink() if name == "data" else curve.color)
    rings, look = inches * outlines(matrices), rows.in_inches(times, row)
    if radii is not None:
        scales = np.exp(radii / 2)[:, None, None]
        shaded = np.concatenate([scales * rings, (rings / scales)[:, ::-1]], axis=1)
        shade: Look = {"facecolors": colors * [1, 1, 1, 0.3], "linewidths": 0, "label": fresh(axes, curve.band_name)}
        axes.add_collection(PolyCollection(list(shaded), **shade, **look))
    look |= {"edgecolors": colors, "linewidths": {"given": 1.6, "data": 0.8}.get(name, 1.2), "zorder": 4}
    filled = colors * [1, 1, 1, {"given": 0.45, "": 0.25}.get(name, 0.0)]
    axes.add_collection(PolyCollection(list(rings), facecolors=filled, **look))
    if matrices.shape[1] == 3:
        look["linewidths"] = 0.6 * look["linewidths"]
        for lines in inches * sections(matrices).swapaxes(0, 1):
            axes.add_collection(LineCollection(list(lines), **look))


def covariances(curves: Sequence[Curve]) -> View:
    """Return the view of the standard deviations and correlations of covariance matrices; components of several."""
    whole, n = components(curves), curves[0].space.point_shape[0]
    if are_compared(curves):
        return whole
    entries = np.reshape(component_names((n, n), False), (n, n))[np.triu_indices(n, 1)]
    names = [f"σ{i + 1}".translate(SUBSCRIPTS) for i in range(n)]
    roots = lambda _, points: np.sqrt(np.diagonal(points, axis1=1, axis2=2))  # noqa: E731
    deviations = Graphs("", names, roots, [("standard\ndeviations", range(n))])

    def draw(panel: Panel, curves: Sequence[Curve]) -> None:
        if not panel.mine:
            whole.draw(panel, curves)
            return
        above, below = (Panel([axes], mine=True) for axes in panel.axes)
        deviations.draw(above, curves)
        above.axes[0].set_xlabel("")
        _draw_correlations(below, curves, [f"ρ{entry[1:]}" for entry in entries.tolist()])

    return timeline(draw, 5.8, 2)


def _draw_correlations(panel: Panel, curves: Sequence[Curve], names: Sequence[str]) -> None:
    """Draw the correlations of pairs as colours, one row per pair."""
    (axes,) = time_axes(panel, curves, ["correlations"], marked=False)
    axes.grid(visible=False)
    axes.set_ylim(len(names), 0)
    every = -(-len(names) // _PAIRS)
    axes.set_yticks(np.arange(len(names))[::every] + 0.5, names[::every])
    axes.tick_params(axis="y", length=0)
    rows, columns = np.triu_indices(curves[0].space.point_shape[0], 1)
    look: Look = {"cmap": "RdBu_r", "vmin": -1, "vmax": 1, "shading": "gouraud", "rasterized": True}
    for curve in curves:
        roots = np.sqrt(np.diagonal(curve.points, axis1=1, axis2=2))
        shares = curve.outside_gaps(curve.points[:, rows, columns] / (roots[:, rows] * roots[:, columns]))
        # One row of pixels per pair needs two equal rows of samples.
        for k, share in enumerate(shares.T):
            image = axes.pcolormesh(curve.times, [k + 0.03, k + 0.97], np.stack([share, share]), **look)
    if len(curves[0].marks) <= FEW_KNOTS:
        mark_knots(axes, curves)
    bar = axes.figure.colorbar(image, cax=axes.inset_axes((1.01, 0, 0.012, 1)), ticks=[-1, 0, 1])
    bar.ax.tick_params(labelsize="small", length=0)
    bar.outline.set_visible(False)
