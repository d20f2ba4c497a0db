"""Splines over several parameters as differentiable functions: curves along one axis after another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Unpack, overload

import jax
import jax.numpy as jnp

from .._adapters import split
from .._base.arrays import short_repr
from .._base.typing import CurveOptions
from .._core import ValidationError
from .._spaces import Product, Space, parts_of, space_named
from ._casteljau import evaluate
from ._compiled import curve
from ._fitting import fit

# Curves along one axis: from coordinates, nodes and points of shape (*batch axes, n, *point_shape) to values, and to
# what else a fit returns.
Along = Callable[[Any, Any, Any], Any]


@overload
def grid_spline(
    x: Sequence[Any],
    axes: Sequence[Any],
    points: Any,
    space: Space | str,
    *,
    grid: bool = False,
    **options: Unpack[CurveOptions],
) -> jax.Array: ...


@overload
def grid_spline(
    x: Sequence[Any],
    axes: Sequence[Any],
    points: Any,
    space: Product,
    *,
    grid: bool = False,
    **options: Unpack[CurveOptions],
) -> tuple[jax.Array, ...]: ...


def grid_spline(
    x: Sequence[Any],
    axes: Sequence[Any],
    points: Any,
    space: Space[Any] | str,
    *,
    grid: bool = False,
    bc_type: Any = "not-a-knot",
    **options: Any,
) -> Any:
    """Evaluate a spline over several parameters by the compiled core, with derivatives in JAX.

    First derivatives with respect to `x`, `axes` and `points` are available in forward and reverse mode. `jax.jit` and
    `jax.vmap` work as for `curve`.

    Parameters
    ----------
    x : sequence of D arrays
        One coordinate per axis. The arrays are broadcast against each other, or combined by an outer product if `grid`
        is True.
    axes : sequence of D arrays, or None for 0, 1, ..., n - 1
        Nodes n_1, ..., n_D of each axis, strictly increasing.
    points : array, shape (n_1, ..., n_D, *space.point_shape)
        Points; for a `Product` a tuple. Points are projected onto the manifold first, so an optimiser may move them off
        it.
    space : Space or str
        Space or its name.
    grid : bool, default False
        Whether to evaluate at all combinations of the coordinates.
    bc_type : str or sequence of D entries, default "not-a-knot"
        End conditions: one word for all axes, or one entry per axis, which is a word or a pair of words for start and
        end.
    **options
        Other options of `CubicSpline`.

    Returns
    -------
    array, shape ``(*shape, *space.point_shape)``
        Values, in the precision of the points; for a `Product` a tuple. Here ``shape`` is the shape of the broadcast
        coordinates, or the shapes of all coordinates one after another if `grid` is True.

    Raises
    ------
    ValidationError
        If shapes do not match, or a point is NaN. Missing nodes are not supported in JAX.

    See Also
    --------
    symspline.GridSpline : The same surface without JAX, faster at many coordinates, and with missing nodes.

    Notes
    -----
    The spline along the first axis through every row of nodes is evaluated at the first coordinate. A spline along the
    second axis passes through the resulting points, and so on. Each axis is one call of the core. If `grid` is False,
    the values of the first axis need memory for ``x.size * n_2 * ... * n_D`` points.

    The notes of `curve` on precision, representatives and convergence apply.

    Examples
    --------
    >>> import jax, numpy as np
    >>> from symspline.jax import grid_spline
    >>> u, v = np.arange(4.0), np.arange(5.0)
    >>> heights = (u[:, None] ** 2 * v)[..., None]
    >>> surface = lambda x, y: grid_spline((x, y), (u, v), heights, "r:1")[0]
    >>> [round(float(d), 3) for d in jax.grad(surface, (0, 1))(1.5, 2.0)]
    [6.0, 2.25]
    """
    space = space_named(space)
    if isinstance(space, Product):
        each = zip(parts_of(points, space, "points"), space.factors, strict=True)
        return tuple(grid_spline(x, axes, p, factor, grid=grid, bc_type=bc_type, **options) for p, factor in each)
    x, axes, points, ends = _checked(x, axes, points, space, bc_type)

    def along(end: Any) -> Along:
        return lambda x, t, rows: (curve(x, t, rows, space, bc_type=end, **options), None)

    return _axis_after_axis([along(end) for end in ends], x, axes, points, grid)[0]


def grid_evaluate(
    axes: Sequence[Any],
    points: Any,
    space: Space | str,
    x: Sequence[Any],
    *,
    grid: bool = False,
    bc_type: Any = "natural",
    steps: int = 40,
) -> tuple[jax.Array, jax.Array]:
    """Evaluate a spline over several parameters, in JAX alone.

    This runs on the device of JAX and has derivatives of any order, in forward and reverse mode. Along each axis it
    calls `fit` and `evaluate`.

    Parameters
    ----------
    axes : sequence of D arrays, or None for 0, 1, ..., n - 1
        Nodes n_1, ..., n_D of each axis, strictly increasing.
    points : array, shape (n_1, ..., n_D, *space.point_shape)
        Points, which are first projected onto the manifold.
    space : Space or str
        ``sphere:n``, ``so:2`` or ``so:3``.
    x : sequence of D arrays
        One coordinate per axis. The arrays are broadcast against each other, or combined by an outer product if `grid`
        is True.
    grid : bool, default False
        Whether to evaluate at all combinations of the coordinates.
    bc_type : {"natural", "clamped"} or sequence of D entries, default "natural"
        End conditions: one word for all axes, or one entry per axis, which is a word or a pair of words for start and
        end.
    steps : int, default 40
        Number of quasi-Newton steps of `fit`.

    Returns
    -------
    values : array, shape ``(*shape, *space.point_shape)``
        Values. Here ``shape`` is the shape of the broadcast coordinates, or the shapes of all coordinates one after
        another if `grid` is True. Outside the nodes they are NaN.
    residual : array, shape (D,)
        Largest relative residual along each axis, see `fit`.

    Raises
    ------
    ValidationError
        If the space or the end conditions are not supported, or shapes do not match.

    See Also
    --------
    grid_spline : The same for every space and all end conditions, by the compiled core.

    Examples
    --------
    >>> import jax, jax.numpy as jnp
    >>> from symspline.jax import grid_evaluate
    >>> points = jnp.array([[[1.0, 0], [0.6, 0.8]], [[0.8, 0.6], [0, 1]]])
    >>> compiled = jax.jit(lambda points: grid_evaluate((None, None), points, "sphere:1", (0.5, [0.2, 0.7])))
    >>> values, residual = compiled(points)
    >>> values.shape, residual.shape
    ((2, 2), (2,))
    """
    space = space_named(space)
    x, axes, points, ends = _checked(x, axes, points, space, bc_type)

    def along(end: Any) -> Along:
        def values(x: Any, t: Any, rows: Any) -> Any:
            velocities, residual = fit(t, rows, space, bc_type=end, steps=steps)
            return evaluate(t, rows, velocities, space, x), residual

        return values

    values, residuals = _axis_after_axis([along(end) for end in ends], x, axes, points, grid)
    return values, jnp.stack([jnp.max(residual, initial=0.0) for residual in residuals])


def _axis_after_axis(
    along: Sequence[Along], x: list[Any], axes: list[Any], points: Any, grid: bool
) -> tuple[Any, list[Any]]:
    """Evaluate curves along the first axis, then curves through their values along the second, and so on.

    Returns the values and what `along` returns beside the values of each axis.
    """
    d = len(axes)
    extras: list[Any] = []
    if grid:
        for k in range(d):
            values, extra = along[k](x[k].ravel(), axes[k], jnp.moveaxis(points, k, d - 1))
            points = jnp.moveaxis(values, d - 1, k)
            extras.append(extra)
        shape = sum((own.shape for own in x), ())
    else:
        x = jnp.broadcast_arrays(*x)
        shape = x[0].shape
        values, extra = along[0](x[0].ravel(), axes[0], jnp.moveaxis(points, 0, d - 1))
        points = jnp.moveaxis(values, d - 1, 0)
        extras.append(extra)
        for k in range(1, d):
            # Every value has rows of its own from here on, and is one element of a batch.
            rows = jnp.moveaxis(points, 1, d - k)
            points, extra = jax.vmap(along[k], (0, None, 0))(x[k].ravel(), axes[k], rows)
            extras.append(extra)
    return points.reshape(*shape, *points.shape[d if grid else 1 :]), extras


def _checked(
    x: Sequence[Any], axes: Sequence[Any], points: Any, space: Space, bc_type: Any
) -> tuple[list[Any], list[Any], Any, list[Any]]:
    """Return coordinates, nodes, points and end conditions for each axis, with matching shapes."""
    points = jnp.asarray(points)
    d = len(axes)
    nodes = points.shape[: points.ndim - len(space.point_shape)]
    if d < 1 or len(nodes) != d or points.shape[len(nodes) :] != space.point_shape:
        wanted = ", ".join([f"n_{k + 1}" for k in range(d)] + [str(n) for n in space.point_shape])
        raise ValidationError(
            f"points has shape {points.shape}, but a grid of {d} axes on {space!r} needs ({wanted}). Pass one array of "
            "nodes per axis."
        )
    if len(x) != d:
        raise ValidationError(f"x has {len(x)} coordinates, but there are {d} axes. Pass one array per axis.")
    if isinstance(bc_type, str):
        ends: list[Any] = [bc_type] * d
    elif len(bc_type) == d:
        ends = list(bc_type)
    else:
        raise ValidationError(
            f"bc_type must be one word or have one entry per axis, {d} in all, not {short_repr(bc_type)}"
        )
    if any(vector is not None for end in ends for vector in split(end)[1]):
        raise ValidationError("bc_type of a grid must not contain vectors. Pass a word or a pair of words per axis.")
    real = jnp.result_type(points.real.dtype, jnp.float32)
    own = [jnp.arange(n, dtype=real) if t is None else jnp.asarray(t, real) for t, n in zip(axes, nodes, strict=True)]
    for k, (t, n) in enumerate(zip(own, nodes, strict=True)):
        if t.shape != (n,):
            raise ValidationError(f"axes[{k}] has shape {t.shape}, but points have {n} nodes along axis {k}")
    return [jnp.asarray(a, real) for a in x], own, points, ends
