"""Splines as differentiable functions in JAX.

>>> import jax
>>> import jax.numpy as jnp
>>> from symspline.jax import curve
>>> points = jnp.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
>>> curve(0.5, jnp.arange(3.0), points, "sphere:2").shape
(3,)
>>> jax.grad(lambda t: curve(0.5, t, points, "sphere:2")[0])(jnp.arange(3.0)).shape
(3,)
"""

from ._compiled import curve
from ._native import evaluate, fit

__all__ = ["curve", "evaluate", "fit"]


def __dir__() -> list[str]:
    return __all__
