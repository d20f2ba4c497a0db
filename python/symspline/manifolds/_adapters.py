"""Manifolds of other libraries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._base.typing import AnyFunction, Array
from .._core import ValidationError
from ._manifold import Manifold


def from_geomstats(space: Any, *, injectivity_radius: float | None = None, dtype: Any = np.float64) -> Manifold:
    """Use a space of geomstats with its metric, on the NumPy backend.

    Parameters
    ----------
    space : geomstats space
        A space with a metric that has ``exp``, ``log`` and ``inner_product``, such as
        ``geomstats.geometry.stiefel.Stiefel(5, 2)``.
    injectivity_radius : float, optional
        As for `Manifold`.
    dtype : {float64, complex128}, default float64
        Type of the numbers of a point.

    Returns
    -------
    Manifold
        The manifold.

    Raises
    ------
    ValidationError
        If the space has no metric.

    Examples
    --------
    >>> from geomstats.geometry.hypersphere import Hypersphere  # doctest: +SKIP
    >>> symspline.manifolds.from_geomstats(Hypersphere(2))  # doctest: +SKIP
    """
    metric = getattr(space, "metric", None)
    if metric is None:
        raise ValidationError("the space has no metric: call equip_with_metric first")
    return Manifold(
        # In geomstats tangent vectors come before their points.
        exp=_PointLast(metric.exp),
        log=_PointLast(metric.log),
        project_tangent=_PointLast(space.to_tangent),
        inner=_PointLast(metric.inner_product, real=True),
        project=getattr(space, "projection", None),
        injectivity_radius=injectivity_radius,
        point_shape=tuple(space.shape),
        dim=int(space.dim),
        dtype=dtype,
    )


def from_pymanopt(manifold: Any, *, injectivity_radius: float | None = None) -> Manifold:
    """Use a manifold of pymanopt that has ``exp`` and ``log``.

    Parameters
    ----------
    manifold : pymanopt manifold
        Such as ``pymanopt.manifolds.Oblique(3, 4)``. For a product, make a `symspline.Product` of its factors.
    injectivity_radius : float, optional
        As for `Manifold`.

    Returns
    -------
    Manifold
        The manifold.

    Raises
    ------
    ValidationError
        If its points are not arrays, or it has no ``exp`` or ``log``.

    Notes
    -----
    The functions take one point at a time, which is slow. Velocities are tangent vectors as pymanopt defines them:
    those of groups are elements of the Lie algebra.

    Examples
    --------
    >>> from pymanopt.manifolds import Oblique  # doctest: +SKIP
    >>> symspline.manifolds.from_pymanopt(Oblique(3, 4))  # doctest: +SKIP
    """
    missing = [name for name in ("exp", "log") if not _has(manifold, name)]
    if missing:
        raise ValidationError(f"{manifold} has no {' and no '.join(missing)}; pass functions of your own to Manifold")
    # Only a random point has the shape and the type of points. NumPy's global generator is restored.
    state = np.random.get_state()  # noqa: NPY002
    try:
        point = manifold.random_point()
    finally:
        np.random.set_state(state)  # noqa: NPY002
    if not isinstance(point, np.ndarray):
        raise ValidationError(f"points of {manifold} are not arrays; make a symspline.Product of its factors")
    project = manifold.to_tangent_space if _has(manifold, "to_tangent_space") else manifold.projection
    return Manifold(
        exp=_OneByOne(manifold.exp),
        log=_OneByOne(manifold.log),
        project_tangent=_OneByOne(project),
        inner=_OneByOne(manifold.inner_product, real=True),
        transport=_OneByOne(manifold.transport) if _has(manifold, "transport") else None,
        injectivity_radius=injectivity_radius,
        point_shape=point.shape,
        dim=int(manifold.dim),
        dtype=np.complex128 if np.iscomplexobj(point) else np.float64,
    )


def _has(manifold: object, name: str) -> bool:
    """Whether a manifold of pymanopt overrides a method of its base class."""
    bases = [cls for cls in type(manifold).__mro__ if cls.__module__ == "pymanopt.manifolds.manifold"]
    method = getattr(type(manifold), name, None)
    return method is not None and method is not getattr(bases[-1], name, None)


@dataclass(frozen=True)
class _PointLast:
    """A function whose last argument is the point."""

    function: AnyFunction
    real: bool = False

    def __call__(self, p: Array, *vectors: Array) -> Any:
        value = self.function(*vectors, p)
        return np.real(value) if self.real else value


@dataclass(frozen=True)
class _OneByOne:
    """A function of single points, called for every row."""

    function: AnyFunction
    real: bool = False

    def __call__(self, *inputs: Array) -> Array:
        values = np.array([self.function(*row) for row in zip(*inputs, strict=True)])
        return values.real if self.real else values
