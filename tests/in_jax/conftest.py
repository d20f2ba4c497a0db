"""Precision and optimisation of the tests in JAX."""

import jax
import pytest


@pytest.fixture(autouse=True)
def double_precision(request):
    """Double precision. In modules with ``QUICK`` XLA does not optimise, which would take most of their time."""
    before = jax.config.read("jax_disable_most_optimizations")
    jax.config.update("jax_disable_most_optimizations", before or getattr(request.module, "QUICK", False))
    try:
        with jax.enable_x64(True):
            yield
    finally:
        jax.config.update("jax_disable_most_optimizations", before)


@pytest.fixture(scope="module", autouse=True)
def memory_of_a_module():
    """What XLA compiled for a module is not kept for the next one."""
    yield
    jax.clear_caches()
