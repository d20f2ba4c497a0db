"""Helpers that inspect figures."""

from unittest import mock

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

import symspline as ss

VIEWS = (
    *("euclidean:1", "euclidean:2", "euclidean:3", "euclidean:5", "sphere:1", "sphere:2", "hyperbolic:2", "rp:1"),
    *("rp:2", "gr:2,5", "cp:1", "ch:2", "gr:2,3", "o:2", "su:2", "u:1", "spd:2", "spd:3", "spd:5", "se:2", "se:3"),
    "stiefel:2,4",
)
"""One space of every view."""


def points_around(space, rng, shape):
    """Points less than a radian or so from each other."""
    middle = space.random_point(rng)
    around = np.broadcast_to(middle, (*shape, *space.point_shape))
    return space.project(space.exp(middle, 0.3 * space.random_tangent(rng, around)))


def spline_on(name, shape=(6,), t=None, **options):
    space = ss.space(name)
    return ss.CubicSpline(t, points_around(space, np.random.default_rng(1), shape), space, **options)


def rendered(figure, layout=False):
    """The figure, as if it were drawn: any warning would be an error. The layout takes half of the time."""
    if not layout:
        figure.set_layout_engine("none")
    figure.draw_without_rendering()
    return figure


def axes_named(figure, label):
    """The axes whose vertical axis has a label, or which have the name themselves."""
    everything = [own for axes in figure.axes for own in (axes, *axes.child_axes)]
    (found,) = [axes for axes in everything if label in (axes.get_ylabel().split("\n")[0], axes.get_label())]
    return found


def rate_axes(figure):
    """The axes of speeds or velocities, and those of accelerations, one per factor."""
    firsts = [(axes, axes.get_ylabel().split("\n")[0]) for axes in figure.axes]
    return [axes for axes, name in firsts if name in ("speed", "velocity")], [
        axes for axes, name in firsts if name == "acceleration"
    ]


def lines_of(axes):
    """The lines of curves in axes with a time axis."""
    return [line.get_xydata() for line in axes.lines if line.get_gid() == "_curve"]


def dots_of(axes):
    """Where the dots of the only curve are, near and far side together: all, and the first."""
    dots = [line.get_xydata() for line in axes.lines if line.get_marker() == "o"]
    return [np.where(np.isnan(far), near, far) for far, near in zip(dots[:2], dots[2:], strict=True)]


def has_title(figure, kind, space):
    """Whether the title names the kind of curve and the space, and perhaps what its points are."""
    name = str(space).replace("euclidean:", "r:").replace("hyperbolic:", "h:")
    return any(text.startswith(kind) and text.endswith(f" on {name}") for text in texts_of(figure))


def texts_of(figure):
    return [text.get_text() for text in figure.findobj(matplotlib.text.Text)]


ROLES = (
    *("start", "end", "given points", "given poses", "some of the poses", "poses of the curve", "control points"),
    *("data", "95 % band", "far side", "curve in a gap", "gap", "limit", "single curves", "other curves", "median"),
    *("5–95 %", "shadow on the floor"),
)


def role(artist):
    """What the legend of a page says of an artist, without details."""
    label = str(artist.get_label()).removeprefix("_")
    return next((own for own in ROLES if label.startswith(own)), label)


def drawn_texts(figure):
    """All texts that are drawn, with their boxes in pixels and their sizes in points."""
    seen, draw = [], matplotlib.text.Text.draw

    def record(text, renderer):
        if text.get_visible() and text.get_text().strip() and text.get_alpha() != 0:
            seen.append((text.get_text(), text.get_window_extent(renderer), text.get_fontsize()))
        return draw(text, renderer)

    canvas = FigureCanvasAgg(figure)
    # The first time, the layout is computed.
    canvas.draw()
    with mock.patch.object(matplotlib.text.Text, "draw", record):
        canvas.draw()
    return seen


def faults_of_texts(figure, smallest=6.0):
    """Texts that are too small, leave the figure or overlap others by more than half a point."""
    texts, point = drawn_texts(figure), figure.dpi / 72
    faults = [f"{text!r} has {size:.1f} points" for text, _, size in texts if size < smallest - 0.01]
    width, height = figure.bbox.width + point, figure.bbox.height + point
    faults += [
        f"{text!r} leaves the figure"
        for text, box, _ in texts
        if min(box.x0, box.y0) < -point or box.x1 > width or box.y1 > height
    ]
    for i, (text, box, _) in enumerate(texts):
        for other, beside, _ in texts[:i]:
            across = min(box.x1, beside.x1) - max(box.x0, beside.x0)
            along = min(box.y1, beside.y1) - max(box.y0, beside.y0)
            if min(across, along) > 0.5 * point:
                faults.append(f"{text!r} overlaps {other!r}")
    return faults
