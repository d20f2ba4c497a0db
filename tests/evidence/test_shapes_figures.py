"""The figures of the page about shapes."""

import re
from pathlib import Path

import numpy as np
import shapes_figures as figures

PAGE = Path(__file__).parents[2] / "docs/shapes.md"


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
