"""The code of the page about shapes runs."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import procrustes

PAGE = Path(__file__).parents[2] / "docs/shapes.md"


def test_the_page():
    names = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.S):
        exec(compile(block, PAGE.name, "exec"), names)
    # Kendall's distance is the angle of Procrustes analysis, and does not see position, size and rotation.
    space, kendall, house = names["space"], names["kendall"], names["house"]
    disparity = procrustes(house, names["sheared"])[2]
    angle = space.distance(kendall(house), kendall(names["sheared"]))
    assert angle == pytest.approx(np.arcsin(np.sqrt(disparity)), abs=1e-12) == pytest.approx(0.225, abs=5e-4)
    moved = 3 * house @ [[0.6, 0.8], [-0.8, 0.6]] + [4, 5]
    assert space.distance(kendall(house), kendall(moved)) < 1e-7
    film, first = names["film"], names["A"] - names["A"][0]
    assert film.shape == (101, 3, 2) and np.abs(film[0] - first[1:]).max() < 1e-14
    # Every drawing of the film has the shape of the spline.
    shapes = names["ss"].shapes.from_landmarks(np.insert(film, 0, 0.0, axis=1), base=0)
    assert names["spline"].space.distance(shapes, names["spline"](names["x"])).max() < 1e-11
