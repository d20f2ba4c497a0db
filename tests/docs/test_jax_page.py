"""The examples of ``docs/jax.md``, and the table of times."""

import re
from pathlib import Path

import jax
import jax_times
import numpy as np
import pytest

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
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    assert len(blocks) == 2
    for block in blocks:
        # A Hessian takes half a minute to compile; what it is made of is tested with the functions.
        exec(compile(block.replace("jax.hessian(", "jax.grad("), PAGE.name, "exec"), names)
    assert names["error"] < 1e-5 and np.isfinite(names["jerk"]).all()
    assert names["hessian"].shape == (5, 3)


def test_the_table_can_be_made():
    lines = jax_times.times_table(curves=2, runs=1).splitlines()
    assert len(lines) == 6 and all(line.count("|") == 4 for line in lines)
