"""The examples of ``docs/jax.md``."""

from pathlib import Path

import jax
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
    code, names = "\n".join(blocks(PAGE)), {}
    # Derivatives of higher order take half a minute to compile; what they are made of is tested with the functions.
    for given, traced in (
        ("jax.jit(jax.jacfwd(jax.jacfwd(jax.jacfwd(path))))(0.5)", "jax.eval_shape(jax.jacfwd(jax.jacfwd(path)), 0.5)"),
        ("jax.jit(jax.hessian(exact_loss))(points)", "jax.eval_shape(jax.grad(exact_loss), points)"),
    ):
        assert given in code
        code = code.replace(given, traced)
    run(code, PAGE, names)
    assert names["error"] < 1e-5 and names["figure"].axes
    assert names["jerk"].shape == (3,) and names["hessian"].shape == (5, 3)
    surface, h = names["surface"], 1e-5
    differences = [surface(1.5 + h, 0.7) - surface(1.5 - h, 0.7), surface(1.5, 0.7 + h) - surface(1.5, 0.7 - h)]
    np.testing.assert_allclose(names["slope"], np.array(differences)[:, 2] / (2 * h), atol=1e-8)
    grid = ss.GridSpline((names["u"], names["v"]), names["field"], "sphere:2")
    np.testing.assert_allclose(names["values"], grid((np.array([0.3, 1.5]), np.array([0.2, 0.7]))), atol=1e-12)
