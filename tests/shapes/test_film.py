"""Pictures of films, and the page about shapes."""

import re
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
import shapes_figures as figures
from matplotlib.patches import Polygon
from matplotlib.text import Text
from refused import raises
from test_landmarks import drawings
from test_morph import KNOTS, turned

from symspline.shapes import AffineMorph

PAGE = Path(__file__).parents[2] / "docs/shapes.md"


def rendered(figure):
    """The figure, drawn: any warning would be an error."""
    figure.savefig(BytesIO(), dpi=40)
    return figure


def texts_of(figure):
    return [text.get_text() for text in figure.findobj(Text)]


def outlines(axes):
    return [patch.get_xy()[:-1] for patch in axes.patches if isinstance(patch, Polygon)]


@pytest.mark.parametrize("n", [2, 3])
def test_small_multiples_are_the_film(n):
    x = turned(n, 5)
    morph = AffineMorph(KNOTS, x)
    figure = rendered(morph.plot())
    strip, *multiples = figure.axes
    assert len(outlines(strip)) == 19 + 5 and len(multiples) == 12
    assert "5 given drawings of 6 landmarks, and others between them; colour: time" in texts_of(figure)
    times = np.linspace(0, 4, 12)
    times[np.abs(np.subtract.outer(KNOTS, times)).argmin(axis=1)] = KNOTS
    film = morph(times)
    bold = [axes.spines["left"].get_linewidth() > 1 for axes in multiples]
    assert bold == [x in KNOTS for x in times] and sum(bold) == 5
    for axes, drawing in zip(multiples, film, strict=True):
        (outline,) = outlines(axes)
        if n == 2:
            assert np.abs(outline - drawing).max() < 1e-12
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        assert (outline > [left, low]).all() and (outline < [right, high]).all()
        assert sum(text.get_text() in set("012345") for text in axes.texts) == 6
    assert {"t = 0", "t = 4"} <= set(texts_of(figure))


@pytest.mark.parametrize("count, numbers", [(12, 12), (13, 0), (40, 0)])
def test_many_landmarks_have_no_numbers(count, numbers):
    angles = 2 * np.pi * np.arange(count) / count
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=-1) * (2 + np.sin(3 * angles))[:, None]
    figure = rendered(AffineMorph([0, 1, 2], np.stack([ring, 1.2 * ring + 0.1 * ring**2, ring + 1])).plot())
    for axes in figure.axes[1:]:
        assert sum(text.get_text().isdigit() for text in axes.texts) == numbers
        white = [line.get_xydata() for line in axes.lines if line.get_color() == "white"]
        assert len(white) == (numbers == 0) and all((own == axes.lines[0].get_xydata()[0]).all() for own in white)


def test_the_strip_is_undistorted_and_inside():
    x = turned(2, 5)
    strip = rendered(AffineMorph(KNOTS, x).plot()).axes[0]
    *_, last = outlines(strip)
    paper = strip.transData.transform(last)
    sides, wanted = (np.linalg.norm(np.diff(p, axis=0), axis=1) for p in (paper, x[-1]))
    assert np.abs(sides / sides[0] - wanted / wanted[0]).max() < 1e-9
    everything = np.concatenate(outlines(strip))
    assert everything[:, 0].min() > strip.get_xlim()[0] and everything[:, 0].max() < strip.get_xlim()[1]
    assert np.abs(everything[:, 1]).max() < 1


def test_dates_of_whole_days():
    dates = np.datetime64("2024-01-01") + (10 * KNOTS).astype("m8[D]")
    figure = rendered(AffineMorph(dates, turned(2, 5)).plot())
    labels = [axes.texts[-1].get_text() for axes in figure.axes[1:]]
    assert labels[0] == "2024-01-01 00:00" and labels[1] == "2024-01-04 15:16" and labels[-1] == "2024-02-10 00:00"


def test_four_dimensions_have_no_picture():
    x = drawings(3, landmarks=8, n=4, spread=0.1)
    raises("in 2 or 3 dimensions, not in 4", AffineMorph(None, x).plot)


def test_the_page():
    names = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.S):
        exec(compile(block, PAGE.name, "exec"), names)
    assert names["film"].shape == (100, 4, 2)
    assert np.abs(names["morph"](2.0) - names["C"]).max() < 1e-10


def test_the_figures_of_the_page(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "__file__", str(tmp_path / "figures.py"))
    figures.main()
    made = {path.name for path in tmp_path.iterdir()}
    assert made == set(re.findall(r"\((shapes_\w+\.png)\)", PAGE.read_text("utf-8")))


def test_equations_24_and_25_draw_the_curve_in_the_unit_disc():
    spline = figures.shape_spline()
    x = np.linspace(0, 4, 2001)
    disc = figures.on_disc(spline(x))
    assert np.linalg.norm(disc, axis=1).max() <= 1
    # The kernel of the 2 × 3 matrix of landmarks, by a singular value decomposition.
    landmarks = figures.CLOSED[:, 1:] - figures.CLOSED[:, :1]
    kernels = np.linalg.svd(np.swapaxes(landmarks, 1, 2)).Vh[:, 2]
    kernels = np.where(kernels[:, 2:] > 0, -kernels, kernels)
    expected = kernels[:, :2] / (1 - kernels[:, 2:])
    assert np.abs(figures.on_disc(spline.points) - expected).max() < 1e-14
    # The curve crosses the rim once, to the opposite point.
    (crossings,) = np.nonzero(np.linalg.norm(np.diff(disc, axis=0), axis=1) > 0.1)
    assert len(crossings) == 1
    leaving, returning = disc[crossings[0]], disc[crossings[0] + 1]
    assert np.linalg.norm(leaving) > 0.99 and np.linalg.norm(leaving + returning) < 0.01
