"""Precision and compiler options of the tests in JAX."""

import os

import jax
import pytest

# Without these emitters XLA compiles a quarter faster; it reads this when the first array is made. Versions that do not
# know the flag end the process.
if jax.__version__.startswith("0.10."):
    os.environ.setdefault("XLA_FLAGS", "--xla_cpu_use_fusion_emitters=false")


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
