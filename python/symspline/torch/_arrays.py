"""Arguments as tensors on one device and in one precision."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from .._base.arrays import short_repr
from .._closed_forms import registry
from .._closed_forms.casteljau import QUOTIENTS
from .._closed_forms.models import Model
from .._core import ValidationError
from .._spaces import Space
from ._functions import LIBRARY

_SUPPORTED = "r:n, sphere:n, hyperbolic:n, spd:n, so:2, so:3, se:2 and se:3"


def tensor(value: Any, name: str, like: torch.Tensor | None = None) -> torch.Tensor:
    """Convert an argument to a tensor of real floating-point numbers.

    Parameters
    ----------
    like : tensor, optional
        Tensor whose precision and device the result has. By default, those of `value`; integers have the default
        precision of PyTorch.

    Raises
    ------
    ValidationError
        If `value` does not consist of real numbers.
    """
    if isinstance(value, np.ndarray):
        # PyTorch warns of arrays that are read-only, such as those of a spline, and refuses other byte orders.
        value = np.array(value, value.dtype.newbyteorder("="))
    try:
        found = torch.as_tensor(value)
    except (TypeError, ValueError, RuntimeError, OverflowError):
        raise ValidationError(f"{name} must be a tensor of real numbers, not {short_repr(value)}") from None
    if found.is_complex() or found.dtype == torch.bool:
        raise ValidationError(f"{name} must be a tensor of real numbers, not of {found.dtype}")
    if like is not None:
        return found.to(like)
    return found if found.is_floating_point() else found.to(torch.get_default_dtype())


def points_and_knots(t: Any, points: Any, space: Space[Any]) -> tuple[torch.Tensor, torch.Tensor]:
    """Convert points and knots, and validate their shapes.

    Returns
    -------
    points : tensor, shape (n, *batch, *space.point_shape)
    t : tensor, shape (n, *batch), where axes of the batch have length 1 if all curves have the same knots
    """
    points = tensor(points, "points")
    core = len(space.point_shape)
    lead = points.ndim - core
    if lead < 1 or tuple(points.shape[lead:]) != space.point_shape or points.shape[lead - 1] < 2:
        raise ValidationError(
            f"points has shape {tuple(points.shape)}; a curve in {space} needs (..., n, *{space.point_shape}), n >= 2"
        )
    t = tensor(t, "t", points)
    shape = tuple(points.shape[:lead])
    if tuple(t.shape) not in (shape[-1:], shape):
        raise ValidationError(
            f"t has shape {tuple(t.shape)}; points of shape {tuple(points.shape)} need {shape[-1:]}, or one row per "
            f"curve, {shape}"
        )
    t = t.reshape(*(1,) * (lead - t.ndim), *t.shape)
    return points.movedim(lead - 1, 0), t.movedim(-1, 0)


def model_of(space: Space[Any], name: str) -> Model:
    """Return the model of a space, which is not a product.

    Raises
    ------
    ValidationError
        If the function `name` does not support the space.
    """
    model = registry.model_of(LIBRARY, space)
    if model is None or space.dtype.kind == "c" or isinstance(space, QUOTIENTS):
        raise ValidationError(
            f"symspline.torch.{name} does not support {space}, but only {_SUPPORTED}, and products of them; use "
            "symspline.torch.curve, which supports every space"
        )
    return model
