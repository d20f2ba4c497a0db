"""The examples of ``docs/guide/adaptive.md`` run, and their numbers are right."""

import numpy as np
import pytest
import smoothing_adaptive
from pages import blocks, run

import symspline as ss


def test_the_examples_run():
    page = smoothing_adaptive.PAGE
    names = {}
    first, figure, repeated, noise = blocks(page)
    with pytest.warns(ss.SmoothingWarning, match="adaptive"):
        run(first, page, names)
    sphere, t, curve = names["sphere"], names["t"], names["curve"]
    assert f"report.gain  # {curve.report.gain:.0f}:" in first
    assert curve.lam_at([10.0, 30.0]) == pytest.approx([500, 0.0005], rel=0.1)
    errors = [np.sqrt(np.mean(sphere.distance(c(t), names["truth"]) ** 2)) for c in (names["one"], curve)]
    assert errors == pytest.approx([0.021, 0.0095], rel=0.02)
    run(figure, page, names)
    assert len(names["figure"].axes) == 6
    run(repeated, page, names)
    assert sphere.distance(names["again"](t), curve(t)).max() < 1e-4
    run(noise, page, names)
    assert names["both"].sigma_at([10.0, 50.0]) == pytest.approx([0.011, 0.069], rel=0.05)
