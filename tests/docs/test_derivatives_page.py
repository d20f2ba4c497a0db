"""The examples and the figure of ``docs/derivatives.md``."""

import re
from pathlib import Path

import derivatives_figure as figure

PAGE = Path(__file__).parents[2] / "docs/derivatives.md"


def test_examples_run():
    names = {}
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    assert len(blocks) == 2
    for block in blocks:
        exec(compile(block, PAGE.name, "exec"), names)
    assert names["gradient"].points.shape == (5, 3)


def test_the_figure_can_be_made(tmp_path, monkeypatch):
    monkeypatch.setattr(figure, "__file__", str(tmp_path / "figure.py"))
    figure.main()
    assert (tmp_path / "derivatives.png").stat().st_size > 10_000
