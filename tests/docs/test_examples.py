"""The recipes run and draw their pictures."""

import runpy
from pathlib import Path

import pytest
from matplotlib.image import imread

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_draws_a_picture(example, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(example))
    (picture,) = tmp_path.iterdir()
    # Neither white nor of one colour.
    assert imread(picture)[..., :3].std() > 0.05


def test_there_are_examples():
    assert len(EXAMPLES) >= 2
