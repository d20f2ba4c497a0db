"""What the tests in JAX run with."""

import contextlib
import os

import jax

# Without these emitters XLA compiles a quarter faster; it reads this when the first array is made. Versions that do not
# know the flag end the process.
if jax.__version__.startswith("0.10."):
    os.environ.setdefault("XLA_FLAGS", "--xla_cpu_use_fusion_emitters=false")


@contextlib.contextmanager
def double_and_quickly_compiled():
    """In double precision; XLA's optimisation would take most of the time of a test."""
    before = jax.config.read("jax_disable_most_optimizations")
    jax.config.update("jax_disable_most_optimizations", True)
    try:
        with jax.enable_x64(True):
            yield
    finally:
        jax.config.update("jax_disable_most_optimizations", before)
