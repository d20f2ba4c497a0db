"""The example of ``docs/manifolds.md``."""

import manifolds
from pages import blocks, run


def test_the_example_of_the_manifolds_page_runs(capsys):
    names = {}
    for block in blocks(manifolds.PAGE):
        run(block, manifolds.PAGE, names)
    assert names["spline"].report.converged
    assert "acceleration is continuous" in capsys.readouterr().out


def test_the_page_shows_the_surface_of_the_tables():
    assert manifolds.PAGE.with_name("manifolds_surface.py").read_text("utf-8") in blocks(manifolds.PAGE)
