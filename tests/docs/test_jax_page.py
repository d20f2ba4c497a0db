"""The examples of ``docs/jax.md``, and the table of times."""

from pathlib import Path

import jax
import jax_times
import numpy as np
import pytest
from pages import blocks, run

import symspline as ss

PAGE = Path(__file__).parents[2] / "docs/jax.md"


@pytest.fixture(autouse=True)
def double_precision():
    """XLA's optimisation would take most of the time. The page sets the precision for all that follows."""
    before = {name: jax.config.read(name) for name in ("jax_enable_x64", "jax_disable_most_optimizations")}
    for name in before:
        jax.config.update(name, True)
    yield
    for name, value in before.items():
        jax.config.update(name, value)


def test_examples_run():
    names = {}
    # A Hessian takes half a minute to compile; what it is made of is tested with the functions.
    run("\n".join(blocks(PAGE)).replace("jax.hessian(", "jax.grad("), PAGE, names)
    assert names["error"] < 1e-5 and np.isfinite(names["jerk"]).all()
    assert names["hessian"].shape == (5, 3) and names["figure"].axes
    surface, h = names["surface"], 1e-5
    differences = [surface(1.5 + h, 0.7) - surface(1.5 - h, 0.7), surface(1.5, 0.7 + h) - surface(1.5, 0.7 - h)]
    np.testing.assert_allclose(names["slope"], np.array(differences)[:, 2] / (2 * h), atol=1e-8)
    grid = ss.GridSpline((names["u"], names["v"]), names["field"], "sphere:2")
    np.testing.assert_allclose(names["values"], grid((np.array([0.3, 1.5]), np.array([0.2, 0.7]))), atol=1e-12)


def test_the_table_can_be_made():
    lines = jax_times.times_table(curves=2, runs=1).splitlines()
    assert len(lines) == 6 and all(line.count("|") == 4 for line in lines)
