"""The examples of ``docs/jax.md``, and the table of times."""

from pathlib import Path

import jax
import jax_times
import numpy as np
import pytest
from pages import blocks, run

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
    height, h = names["height"], 1e-5
    differences = [height(1.5 + h, 0.7) - height(1.5 - h, 0.7), height(1.5, 0.7 + h) - height(1.5, 0.7 - h)]
    np.testing.assert_allclose(names["slope"], np.array(differences) / (2 * h), atol=1e-8)


def test_the_table_can_be_made():
    lines = jax_times.times_table(curves=2, runs=1).splitlines()
    assert len(lines) == 6 and all(line.count("|") == 4 for line in lines)
