"""What the tests in JAX run with."""

import contextlib

import jax


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
