"""The code of the page about shapes runs."""

import re
from pathlib import Path

import numpy as np

PAGE = Path(__file__).parents[2] / "docs/shapes.md"


def test_the_page():
    names = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.S):
        exec(compile(block, PAGE.name, "exec"), names)
    film, first = names["film"], names["A"] - names["A"][0]
    assert film.shape == (101, 3, 2) and np.abs(film[0] - first[1:]).max() < 1e-14
    # Every drawing of the film has the shape of the spline.
    shapes = names["ss"].shapes.from_landmarks(np.insert(film, 0, 0.0, axis=1), base=0)
    assert names["spline"].space.distance(shapes, names["spline"](names["x"])).max() < 1e-11
