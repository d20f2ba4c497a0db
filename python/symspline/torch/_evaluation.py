"""Curves with given velocities by de Casteljau's algorithm, written in PyTorch."""

from __future__ import annotations

from typing import Any, overload

import torch

from .._closed_forms import casteljau
from .._closed_forms.models import Model
from .._core import ValidationError
from .._curves.options import order_of
from .._spaces import Product, Space, parts_of, refuse_quotients, space_named
from ._arrays import model_of, points_and_knots, tensor
from ._functions import LIBRARY, along


@overload
def evaluate(t: Any, points: Any, velocities: Any, space: Space | str, x: Any, *, nu: int = 0) -> torch.Tensor: ...


@overload
def evaluate(
    t: Any, points: Any, velocities: Any, space: Product, x: Any, *, nu: int = 0
) -> tuple[torch.Tensor, ...]: ...


def evaluate(t: Any, points: Any, velocities: Any, space: Space[Any] | str, x: Any, *, nu: int = 0) -> Any:
    """Evaluate curves with given knots, points and velocities, in PyTorch alone.

    This is `symspline.evaluate` written in PyTorch. It runs on the device and in the precision of the points, and is
    differentiable with respect to all tensors, any number of times.

    Parameters
    ----------
    t : tensor, shape (n,) or (..., n)
        Strictly increasing knots, shared by all curves or one row per curve.
    points : tensor, shape (..., n, *space.point_shape)
        Points; for a `Product` a tuple. Leading axes are batch axes.
    velocities : tensor, shape of points
        Velocities, such as those of `symspline.torch.fit`.
    space : Space or str
        Space or its name: ``r``, ``sphere``, ``hyperbolic``, ``spd``, ``so:2``, ``so:3``, ``se:2``, ``se:3`` or
        products of them.
    x : tensor
        Times, any shape. Values at times outside the knots are NaN.
    nu : {0, 1, 2}, default 0
        0 for points, 1 for the velocity γ', 2 for the covariant acceleration ∇γ'.

    Returns
    -------
    tensor, shape ``(*batch axes, *x.shape, *space.point_shape)``
        Values; for a `Product` a tuple.

    Raises
    ------
    ValidationError
        If the space is not supported, or shapes do not match.

    See Also
    --------
    fit : Compute the velocities of a C² spline.
    curve : Evaluate a spline on any space by the compiled core.

    Notes
    -----
    Between two knots the curve is the cubic Bézier curve of geodesics, (8) of the paper. Derivatives are finite also
    where points coincide, velocities are zero or eigenvalues repeat.

    Points are first projected onto the manifold and velocities onto the tangent spaces, so derivatives are tangent as
    well. Values are not validated, because this would wait for the device: for matrices far off the manifold and for
    knots that do not increase, results are NaN or meaningless.

    Examples
    --------
    >>> import torch
    >>> from symspline.torch import evaluate
    >>> p = torch.tensor([[1.0, 0, 0], [0, 1, 0]], requires_grad=True)
    >>> value = evaluate([0.0, 1.0], p, torch.zeros(2, 3), "sphere:2", 0.5)
    >>> value[0].backward()
    >>> p.grad.shape
    torch.Size([2, 3])
    """
    nu = order_of(nu)
    space = space_named(space)
    refuse_quotients(space, "functions of PyTorch are not made")
    if isinstance(space, Product):
        each = zip(
            parts_of(points, space, "points"), parts_of(velocities, space, "velocities"), space.factors, strict=True
        )
        return tuple(evaluate(t, p, v, factor, x, nu=nu) for p, v, factor in each)
    model = model_of(space, "evaluate")
    points, knots = points_and_knots(t, points, space)
    rates = tensor(velocities, "velocities", points)
    lead = points.ndim - len(space.point_shape)
    if rates.ndim != points.ndim or rates.movedim(lead - 1, 0).shape != points.shape:
        expected = tuple(points.movedim(0, lead - 1).shape)
        raise ValidationError(f"velocities has shape {tuple(rates.shape)}, but points {expected}")
    x = tensor(x, "x", points)
    found = _values(model, space, knots, points, rates.movedim(lead - 1, 0), x.reshape(-1), nu)
    return found.movedim(0, lead - 1).reshape(*points.shape[1:lead], *x.shape, *space.point_shape)


def _values(model: Model, space: Space, t: Any, points: Any, velocities: Any, x: Any, nu: int) -> Any:
    """Return values with the axis of the times x first, then those of the batch.

    Parameters
    ----------
    t : tensor, shape (n, *batch)
    points, velocities : tensor, shape (n, *batch, *space.point_shape)
    x : tensor, shape (m,)
    """
    t, x = t.contiguous(), x.reshape(-1, *(1,) * (t.ndim - 1)).expand(-1, *t.shape[1:]).contiguous()
    h = t[1:] - t[:-1]
    starts, handles = casteljau.control(model, h, *model.to_internal(points, velocities))
    # `searchsorted` searches along the last axis.
    at = [a.detach().movedim(0, -1).contiguous() for a in (t, x)]
    i = (torch.searchsorted(*at, right=True) - 1).clamp(0, len(h) - 1).movedim(-1, 0)
    begin, length = t.gather(0, i), h.gather(0, i)
    starts, handles = _rows(starts, i), _rows(handles, i)

    def curve(x: Any) -> Any:
        return model.from_internal(casteljau.bezier(model, starts, handles, (x - begin) / length))

    def velocity(x: Any) -> Any:
        return along(curve, x)

    if nu == 0:
        found = curve(x)
    elif nu == 1:
        found = casteljau.velocity(space, *velocity(x))
    else:
        (point, first), (_, second) = along(velocity, x)
        found = casteljau.acceleration(LIBRARY, space, point, first, second)
    # As in `symspline._time.onto_ends`, a few units in the last place beyond the ends are rounding.
    reach = 4 * torch.finfo(x.dtype).eps * torch.maximum(t[0].abs(), t[-1].abs())
    inside = ((x >= t[0] - reach) & (x <= t[-1] + reach)).detach()
    return torch.where(inside[(..., *(None,) * len(space.point_shape))], found, float("nan"))


def _rows(polygons: Any, i: Any) -> Any:
    """Take the segments i, shape (m, *batch), of polygons of shape (3, n - 1, *batch, *point shape)."""
    if i[0].numel() == 1:
        # All curves have the same knots.
        return polygons[:, i.reshape(-1)]
    index = i[(None, ..., *(None,) * (polygons.ndim - 1 - i.ndim))]
    return torch.take_along_dim(polygons, index, dim=1)
