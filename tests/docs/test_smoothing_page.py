"""The examples of ``docs/smoothing.md`` run."""

from pathlib import Path

import numpy as np
import pytest
import smoothing
from pages import blocks, run

PAGE = Path(smoothing.__file__).with_name("smoothing.md")


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
def test_the_examples_run():
    names = {}
    first, three, _, outliers, matrices, covariances = blocks(PAGE)
    run(first, PAGE, names)
    sphere, t, truth = names["sphere"], names["t"], names["truth"]
    errors = [smoothing.rms(sphere, points, truth) for points in (names["s"](t), names["noisy"])]
    assert errors == pytest.approx([0.012, 0.071], abs=5e-4)
    # Too little and too much smoothing are what the titles claim.
    run(three, PAGE, names)
    little, right, much = (float(axes.get_title().split()[-1][:-1]) for axes in names["figure"].axes)
    assert little > 0.4 * len(names["t"]) and 5 < right < 12 and much < 3
    run(outliers, PAGE, names)
    assert sphere.distance(names["robust"](t), truth).max() < 0.1
    run(matrices, PAGE, names)
    assert f"s.sigma  # {names['s'].sigma:.2f}:" in matrices
    run(covariances, PAGE, names)
    assert f"# {names['factor']:.2f}\n" in covariances
    variances = np.trace(names["smooth"](np.arange(200)), axis1=1, axis2=2) / 3
    assert np.mean(variances) / names["factor"] == pytest.approx(1, abs=0.02)
