"""Figures: their content, batches, times and files, and no changes of global state."""

import base64
import html
import re
import subprocess
import sys
from io import BytesIO

import numpy as np
import pytest
from drawn import VIEWS, axes_named, has_title, lines_of, points_around, rate_axes, rendered, spline_on, texts_of
from matplotlib.dates import date2num
from matplotlib.figure import Figure
from refused import raises

import symspline as ss

SIGNED = {"euclidean:1", "sphere:1", "hyperbolic:1", "rp:1", "gr:1,2", "so:2", "o:2", "u:1", "spd:1"}


@pytest.mark.parametrize(("name", "shape"), list(zip(VIEWS[::2], [(6,), (3, 6), (6,)] * 4, strict=False)), ids=str)
def test_every_space_has_figures(name, shape):
    """Alternately one curve and a batch."""
    spline = spline_on(name, shape)
    figure = rendered(spline.plot(), layout=True)
    assert isinstance(figure, Figure)
    assert has_title(figure, "C² spline", spline.space)
    curves = spline if len(shape) > 1 else [spline]
    if name.startswith("se:"):
        check_rates_of_poses(figure, spline.space, curves)
        return
    for (axes,), nu in zip(rate_axes(figure), (1, 2), strict=True):
        lines = lines_of(axes)
        assert len(lines) == len(curves)
        signed = name in SIGNED
        assert (axes.get_ylabel().split("\n")[1].split(",")[0] in ("γ′", "∇γ′")) == signed
        assert ("°/t" in axes.get_ylabel()) == (name in SIGNED - {"euclidean:1", "hyperbolic:1", "spd:1"})
        for line, curve in zip(lines, curves, strict=True):
            norm = spline.space.norm(curve(line[:, 0]), curve(line[:, 0], nu))
            # Rates of angles are in degrees, as their pictures are.
            norm = np.degrees(norm) if "°" in axes.get_ylabel() else norm
            np.testing.assert_allclose(np.abs(line[:, 1]), norm, atol=1e-6)
            if signed:
                # No kinks at zeros: the second difference is that of a smooth function inside segments.
                x = np.linspace(*curve.domain, 2001)[1:-1]
                drawn = np.interp(x, *line.T)
                assert np.abs(np.diff(drawn)).max() < 0.02 * np.ptp(drawn) + 1e-9
            else:
                assert line[:, 1].min() >= 0


def check_rates_of_poses(figure, space, curves):
    """Rates of rotation and of translation are those of the frame, by differences of rotations and positions."""
    n, step = space.point_shape[0] - 1, 1e-5
    turning, moving = axes_named(figure, "turning rate"), axes_named(figure, "speed")
    for line, other, curve in zip(lines_of(turning), lines_of(moving), curves, strict=True):
        x = line[200:-200:50, 0]
        before, after = curve(x - step), curve(x + step)
        angles = ss.SpecialOrthogonal(n).distance(before[:, :n, :n], after[:, :n, :n])
        # The norm of SO(n) is that of the rotation vector.
        np.testing.assert_allclose(np.abs(line[200:-200:50, 1]), angles / (2 * step), atol=1e-5)
        moved = np.linalg.norm(after[:, :n, n] - before[:, :n, n], axis=1) / (2 * step)
        np.testing.assert_allclose(other[200:-200:50, 1], moved, atol=1e-5)
    pairs = [
        [axes for axes in figure.axes if axes.get_ylabel().startswith(name)]
        for name in ("turning accel", "acceleration")
    ]
    for (first,), (second,) in [pairs]:
        for line, other, curve in zip(lines_of(first), lines_of(second), curves, strict=True):
            # The rest of the covariant acceleration belongs to the rotation.
            norm, column = space.norm(curve(line[:, 0]), curve(line[:, 0], 2)), curve(line[:, 0], 2)[:, :n, n]
            turned = np.sqrt(np.maximum(norm**2 - np.sum(column**2, axis=1), 0))
            np.testing.assert_allclose(np.abs(line[:, 1]), turned, atol=1e-6)
            x = line[200:-200:50, 0]
            moved = np.linalg.norm((curve(x + step, 1) - curve(x - step, 1))[:, :n, n], axis=1) / (2 * step)
            np.testing.assert_allclose(other[200:-200:50, 1], moved, atol=1e-4)


@pytest.mark.parametrize(
    "name, unit, step",
    [("r:1", "us", 500), ("r:2", "h", 10), ("r:2", "D", 300)],
)
def test_dates_of_figures(name, unit, step):
    t = np.datetime64("2024-02-27", unit) + step * np.array([0, 1, 2, 4, 5]).astype(f"timedelta64[{unit}]")
    figure = rendered(spline_on(name, (5,), t).plot())
    ((axes,), _) = rate_axes(figure)
    np.testing.assert_allclose(lines_of(axes)[0][[0, -1], 0], date2num(t[[0, -1]]), rtol=0, atol=2e-11)
    unit = axes.get_ylabel().rpartition("units/")[2]
    length = {"s": 1, "h": 3600, "d": 86_400, "yr": 365.25 * 86_400}[unit]
    assert length == 1 or lines_of(axes)[0][:, 1].max() >= 0.01
    curve, (x, rate) = spline_on(name, (5,), t), lines_of(axes)[0][[0, 600, -1]].T
    at = t[0] + np.rint(86_400e6 * (x - x[0])).astype("timedelta64[us]")
    np.testing.assert_allclose(np.abs(rate), length * curve.speed(at), rtol=1e-2)
    labels = [text.get_text() for text in axes_named(figure, "acceleration").get_xticklabels()]
    assert 2 <= sum(map(bool, labels)) <= 12


@pytest.mark.slow
@pytest.mark.parametrize(("name", "shape"), [("sphere:3 x r:4", (5,)), ("gr:2,3 x u:3", (3, 5))], ids=str)
def test_product_has_a_picture_a_factor(name, shape):
    space = ss.space(name)
    rng = np.random.default_rng(2)
    spline = ss.CubicSpline(None, tuple(points_around(s, rng, shape) for s in space.factors), space)
    figure = rendered(spline.plot())
    texts = texts_of(figure)
    assert all(f"{factor}".replace("euclidean:", "r:") in " ".join(texts) for factor in space.factors)
    first = spline[0] if len(shape) > 1 else spline
    for i, (axes, factor) in enumerate(zip(rate_axes(figure)[0], space.factors, strict=True)):
        line = lines_of(axes)[0]
        norm = factor.norm(first(line[:, 0])[i], first(line[:, 0], 1)[i])
        np.testing.assert_allclose(line[:, 1], norm, atol=1e-12)
    # Several curves have axes of their own for each of four components, and rotations for three coordinates.
    more = 3 * (name.count("r:4") + name.count("u:3")) * (len(shape) > 1) + 2 * name.count("sphere:3")
    assert len(figure.axes) == 3 * len(space.factors) + more


@pytest.mark.slow
def test_figure_is_saved(tmp_path):
    spline = spline_on("r:2")
    for suffix, start in (("pdf", b"%PDF"), ("svg", b"<?xml")):
        path = tmp_path / f"curve.{suffix}"
        assert isinstance(spline.plot(path), Figure) and path.read_bytes().startswith(start)
    file = BytesIO()
    assert spline.plot(file)._repr_png_().startswith(b"\x89PNG") and file.getvalue().startswith(b"\x89PNG")


def test_notebooks_show_a_small_picture_and_the_text(monkeypatch):
    spline = ss.CubicSpline(None, np.eye(3), "s:2")
    text = f"<pre>{html.escape(repr(spline))}</pre>"
    shown = spline._repr_html_()
    picture = base64.b64decode(re.search(r'base64,([^"]*)"', shown)[1])
    assert shown.startswith(f"{text}<img ") and picture.startswith(b"\x89PNG") and len(picture) < 200_000
    lost = ss.CubicSpline(None, [[1, 0, 0], [-1, 0, 0], [0, 1, 0]], "s:2", on_failure="ignore")
    assert "<img" not in lost._repr_html_()
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert spline._repr_html_() == text


def test_without_matplotlib(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    raises(r"^plots need matplotlib.*pip install 'symspline\[plot\]'$", spline_on("r:2").plot, error=ImportError)


@pytest.mark.slow
def test_nothing_global_is_touched(tmp_path):
    code = """
import sys, warnings
warnings.simplefilter("error")
import symspline as ss, numpy as np
assert "matplotlib" not in sys.modules
import matplotlib
def settings():  # read so that matplotlib does not choose a backend on the way
    return {name: dict.__getitem__(matplotlib.rcParams, name) for name in matplotlib.rcParams}
before = settings()
ss.CubicSpline(None, np.eye(3), "sphere:2").plot("a.png")
ss.CubicSpline(np.arange(3).astype("datetime64[D]"), np.eye(3), "r:3").plot("b.png")
assert settings() == before
assert "matplotlib.pyplot" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], check=True, cwd=tmp_path)
