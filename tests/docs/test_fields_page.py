"""The code of the page on fields runs."""

from pathlib import Path

import numpy as np
from pages import blocks, run

import symspline as ss

PAGE = Path(__file__).parents[2] / "docs/guide/fields.md"


def test_the_code_of_the_guide(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in blocks(PAGE):
        run(block, PAGE, names)
    assert names["fine"].shape == (39, 47, 31, 3, 3)
    np.testing.assert_allclose(names["fine"][::2, ::2, ::2], names["tensors"], rtol=0, atol=1e-15)
    with np.load("finer.npz") as finer:
        np.testing.assert_allclose(finer["wind"][::2, ::2], names["wind"], atol=1e-14)
    assert ss.load("spline.npz") == names["spline"]
