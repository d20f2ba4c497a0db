"""Pictures in axes of the user: which axes they need, colours, legends, and styles."""

import matplotlib
import matplotlib.style
import numpy as np
import pytest
from drawn import VIEWS, rendered, spline_on
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from refused import raises

import symspline as ss


def axes_for(name, figure=None):
    projection = "3d" if name in ("euclidean:3", "se:3") else None
    return (figure or Figure(figsize=(6, 5))).add_subplot(projection=projection)


@pytest.mark.parametrize("name", VIEWS)
def test_every_picture_is_drawn_into_axes(name):
    ax = axes_for(name)
    assert spline_on(name).plot(ax=ax, title="mine") is ax
    assert ax.get_title() == "mine"
    assert ax.get_figure().axes == [ax]
    rendered(ax.get_figure())


def test_the_projection_is_checked():
    flat, solid = axes_for("r:2"), axes_for("se:3")
    raises(r"needs axes with projection='3d'", spline_on("r:3").plot, ax=flat)
    raises(r"needs axes with no projection", spline_on("r:2").plot, ax=solid)
    raises("one picture per factor", spline_on_product().plot, ax=flat)
    raises(r"^ax must be axes of matplotlib", spline_on("r:2").plot, ax="left", error=TypeError)


def spline_on_product():
    return ss.CubicSpline(None, (np.arange(4.0)[:, None], np.arange(4.0)[:, None]), "r:1 x r:1")


def test_colours_and_legends():
    """Colours come from the property cycle, and the start of the first curve is named."""
    ax = axes_for("r:2")
    first, second = spline_on("r:2"), ss.CubicSpline(None, np.random.default_rng(5).normal(size=(4, 2)), "r:2")
    first.plot(ax=ax, label="first")
    second.plot(ax=ax, label="second")
    second.plot(ax=ax, color="tab:red", label="third")
    lines = [line for line in ax.lines if line.get_gid() == "_curve"]
    assert [to_hex(line.get_color()) for line in lines] == ["#1f77b4", "#ff7f0e", "#d62728"]
    assert ax.get_legend_handles_labels()[1] == ["first", "start", "second", "third"]
    # The limits contain all curves.
    for line in lines:
        (low, high), x = ax.get_xlim(), line.get_xdata()
        assert low <= x.min() and x.max() <= high


def test_views_that_depend_on_the_curves_are_drawn_once():
    ax = axes_for("sphere:2")
    spline_on("sphere:2").plot(ax=ax)
    raises(r"symspline.plot\(\[first, second\], ax=ax\)", spline_on("sphere:2").plot, ax=ax)


def test_invalid_options():
    plot = spline_on("r:2").plot
    raises("color must be a colour of matplotlib", plot, color="no colour")
    raises("figsize must be a width in inches, or width and height", plot, figsize=(1, -1))
    raises("figsize must be a width in inches, or width and height", plot, figsize=(1, np.nan))
    raises("figsize must be a width in inches, or width and height", plot, figsize=0)
    raises("figsize and ax exclude each other", plot, figsize=(5, 4), ax=axes_for("r:2"))
    raises("file and ax exclude each other", plot, "a.png", ax=axes_for("r:2"))
    for name in ("label", "title", "show"):
        raises(f"^{name} must be", plot, **{name: 3}, error=TypeError)


def test_title_colour_label_and_size_of_a_page():
    figure = spline_on("r:2").plot(title="A drive", color="tab:green", label="car", figsize=(9, 5))
    assert figure.get_size_inches().tolist() == [9, 5]
    texts = [text.get_text() for text in figure.findobj(matplotlib.text.Text)]
    assert {"A drive", "car", "start", "given points"} <= set(texts)
    assert {line.get_color() for axes in figure.axes for line in axes.lines if line.get_gid()} == {"tab:green"}


def test_windows_use_pyplot(monkeypatch):
    from matplotlib import pyplot

    monkeypatch.setattr(pyplot, "show", lambda: shown.append(pyplot.get_fignums()))
    pyplot.switch_backend("agg")
    shown = []
    figure = spline_on("r:3").plot(show=True)
    assert shown == [[figure.number]]
    pyplot.close(figure)
