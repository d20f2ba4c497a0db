"""De Casteljau's algorithm for cubic Bézier curves of geodesics, (8) of the paper, and covariant derivatives.

Nodes are along the first axis. Axes of a batch may follow.
"""

from __future__ import annotations

from typing import Any

from .. import _spaces
from .._spaces import Space
from .library import Library, adjoint
from .models import Model

_LINES = (_spaces.RealProjective, _spaces.ComplexProjective)
_PLANES = (_spaces.Grassmannian, _spaces.ComplexGrassmannian)
QUOTIENTS = (*_LINES, *_PLANES)
_COLUMN = (_spaces.Sphere, _spaces.RealProjective, _spaces.ComplexProjective)
_COLUMNS = (_spaces.Grassmannian, _spaces.ComplexGrassmannian, _spaces.QuaternionicProjective)
_LORENTZ = (_spaces.Hyperbolic, _spaces.ComplexHyperbolic)


def control(model: Model, h: Any, points: Any, velocities: Any) -> tuple[Any, Any]:
    """Return the starts of the three geodesics of every control polygon, and their velocities.

    The first geodesic leads from the first point to the first handle, the second joins the handles, and the third leads
    from the last point to the second handle. The geodesics of one stage are one computation, because JAX compiles each
    computation.
    """
    stack = model.lib.xp.stack
    p, q = points[:-1], points[1:]
    handles = stack([model.times(h / 3, velocities[:-1]), model.times(-h / 3, velocities[1:])])
    inner = model.exp(stack([p, q]), handles)
    return stack([p, inner[0], q]), stack([handles[0], model.log(inner[0], inner[1]), handles[1]])


def bezier(model: Model, starts: Any, handles: Any, s: Any) -> Any:
    """Evaluate curves at s between 0 and 1, with control polygons as `control` returns them."""
    stack = model.lib.xp.stack
    a, b, c = model.exp(starts, model.times(stack([s, s, 1 - s]), handles))
    left, right = model.between(stack([a, b]), stack([b, c]), s)
    return model.between(left, right, s)


def velocity(space: Space, point: Any, first: Any) -> Any:
    """Return the velocity of a curve from the derivative of its arrays."""
    return _horizontal(space, point, first) if isinstance(space, QUOTIENTS) else first


def acceleration(lib: Library, space: Space, point: Any, first: Any, second: Any) -> Any:
    """Return the covariant acceleration of a curve from the derivatives of its arrays."""
    if isinstance(space, QUOTIENTS):
        return _horizontal(space, point, first, second)
    return second - second_fundamental_form(lib.xp, space, point, first, first)


def _horizontal(space: Space, y: Any, first: Any, second: Any = None) -> Any:
    """Return (I − YY*)Y', or the acceleration (I − YY*)(Y'' − 2Y'(Y*Y')), for any representatives Y of a curve."""
    if len(space.point_shape) == 1:
        columns = (None if a is None else a[..., None] for a in (y, first, second))
        return _horizontal_columns(*columns)[..., 0]
    return _horizontal_columns(y, first, second)


def _horizontal_columns(y: Any, first: Any, second: Any) -> Any:
    change = first if second is None else second - 2 * first @ (adjoint(y) @ first)
    return change - y @ (adjoint(y) @ change)


def second_fundamental_form(xp: Any, space: Space, point: Any, vector: Any, motion: Any) -> Any:
    """Return the derivative of a field of tangent vectors as arrays, minus its covariant derivative.

    Of unit vectors, and of k orthonormal columns X, it is −X Ẋ*V, which keeps X*V = 0 (minus the second fundamental
    form). A field gΩ on a group has the covariant derivative g(Ω' + ½[ω, Ω]) where g moves by gω, and the array
    g(Ω' + ωΩ) as derivative: that is ½g(ωΩ + Ωω) more, or ½(ġ g⁻¹V + V g⁻¹ġ); the same holds for positive definite
    matrices, whose covariant acceleration is γ'' − γ'γ⁻¹γ'.

    Parameters
    ----------
    point : array, shape (..., *point_shape)
        The point γ.
    vector : array
        The field at γ.
    motion : array
        The velocity of γ. The result is linear in it.
    """
    if isinstance(space, _spaces.Euclidean):
        return xp.zeros_like(motion)
    if isinstance(space, _COLUMN):
        return -point * (motion.conj() * vector).sum(axis=-1, keepdims=True)
    if isinstance(space, _LORENTZ):
        products = motion.conj() * vector
        return point * (products[..., 1:].sum(axis=-1, keepdims=True) - products[..., :1])
    if isinstance(space, _COLUMNS):
        return -point @ (adjoint(motion) @ vector)
    inverse = xp.linalg.inv(point)
    return 0.5 * (motion @ inverse @ vector + vector @ inverse @ motion)
