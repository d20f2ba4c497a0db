"""The spaces whose curves are made in JAX itself."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
from jax.scipy.linalg import expm, solve_triangular

from .._closed_forms import condition, registry
from .._closed_forms.library import Library
from .._closed_forms.models import Model
from .._core import ValidationError
from .._spaces import Space
from ._series import arc, stumpff
from ._spectral import arcs, logarithm


def _constant(array: Any, like: Any) -> Any:
    return jnp.asarray(array, like.dtype)


def _solve_lower(root: Any, x: Any) -> Any:
    return solve_triangular(root, x, lower=True)


def _fold(step: Any, start: Any, numbers: Any) -> Any:
    # One compiled step, where a loop of Python would compile as many as there are numbers.
    return jax.lax.scan(
        lambda value, number: (step(value, number), None), start, jnp.asarray(numbers, start.real.dtype)
    )[0]


LIBRARY = Library(jnp, _constant, stumpff, arc, logarithm, expm, arcs, _solve_lower, _fold)


def model_of(space: Space) -> Model:
    """Return the model of a space, except products.

    Raises
    ------
    ValidationError
        If the space is not supported in JAX.
    """
    model = registry.model_of(LIBRARY, space)
    if model is None:
        raise ValidationError(
            f"symspline.jax.evaluate does not support {space}, but only r, sphere, hyperbolic, rp, cp, gr, cgr, spd, "
            "hpd, so:2, so:3, se:2 and se:3; use symspline.jax.curve, which supports every space"
        )
    return model


def chain_of(space: Space) -> condition.Chain:
    """Return the nodes of a space for a fit.

    Raises
    ------
    ValidationError
        If fits in the space are not supported in JAX.
    """
    chain = condition.chain_of(registry.model_of(LIBRARY, space))
    if chain is None:
        raise ValidationError(
            f"symspline.jax.fit does not support {space}, but only r, sphere, spd, hpd, so:2, so:3, se:2 and se:3; use "
            "symspline.jax.curve, which supports every space"
        )
    return chain
