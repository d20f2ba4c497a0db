"""Geodesics of symspline beside those of pyriemann and pymanopt, on one core."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np

import symspline as ss

from .data import Array
from .tables import table, versus
from .timing import Contestant, Effort, Work, measure, ready, shared

OPERATIONS = ("geodesic", "exp", "log")
PEERS = ("pyriemann", "pymanopt")

POSITIVE = (ss.SymmetricPositiveDefinite, ss.HermitianPositiveDefinite)
GROUPS = (ss.SpecialOrthogonal, ss.Unitary)
# Its rigid motions are a product of groups, with other geodesics.
IN_PYMANOPT = (ss.SymmetricPositiveDefinite, ss.Grassmannian, ss.ComplexProjective, *GROUPS)

WHERE = 0.3
"""The point of a geodesic that is asked for."""
TOLERANCE = 1e-9


class Call(NamedTuple):
    """What is timed, and how its result is written in symspline."""

    work: Callable[[], Any]
    numbers: Callable[[Any], Array]


def text(pairs: Mapping[str, tuple[Array, Array]], effort: Effort) -> str:
    """Time for a pair of points p and q, space by space, of what others have, too."""
    lines = []
    for name, (p, q) in pairs.items():
        space = ss.space(name)
        for operation in OPERATIONS:
            contestants = {
                peer: Contestant(partial(checked, peer, space, operation, p, q))
                for peer in PEERS
                if offers(peer, space, operation)
            }
            if not contestants:
                continue
            contestants["symspline"] = ready(own(space, operation, p, q))
            found = {who: shared(result, len(p)) for who, result in measure(contestants, effort).items()}
            cells = [(found.get(peer), versus(found, peer, "symspline")[0]) for peer in PEERS]
            lines.append([f"{space!r}: {operation}", found["symspline"], *cells[0], *cells[1]])
    return table(("time a pair, one core", "symspline", "pyriemann", "ratio", "pymanopt", "ratio"), lines)


def own(space: ss.Space, operation: str, p: Array, q: Array) -> Work:
    """The operation with symspline. exp leads from p to q."""
    match operation:
        case "geodesic":
            return partial(space.geodesic, p, q, WHERE)
        case "exp":
            return partial(space.exp, p, space.log(p, q))
    return partial(space.log, p, q)


def offers(peer: str, space: ss.Space, operation: str) -> bool:
    """Whether a library has the operation, for many pairs in one call."""
    if peer == "pyriemann":
        return operation == "geodesic" and isinstance(space, POSITIVE)
    return operation != "geodesic" and isinstance(space, IN_PYMANOPT)


def checked(peer: str, space: ss.Space, operation: str, p: Array, q: Array) -> Work:
    """The work of another library; the benchmark stops if its result is not that of symspline."""
    call = {"pyriemann": _pyriemann, "pymanopt": _pymanopt}[peer](space, operation, p, q)
    expected, found = own(space, operation, p, q)(), call.numbers(call.work())
    # One subspace has many matrices.
    gap = np.abs(found - expected) if operation == "log" else space.distance(found, expected)
    agree(float(np.max(gap)), TOLERANCE, f"{peer}: {operation} in {space!r}")
    return call.work


def agree(gap: float, most: float, what: str) -> None:
    """Stop the benchmark if two results are too far apart to be of the same work."""
    if not gap <= most:
        raise SystemExit(
            f"{what} differs from symspline by {gap:.1e}, more than {most:.0e}: nothing to compare"
        )


def _pyriemann(space: ss.Space, operation: str, p: Array, q: Array) -> Call:
    from pyriemann.geometry.geodesic import geodesic_riemann

    return Call(partial(geodesic_riemann, p, q, WHERE), lambda points: points)


def _pymanopt(space: ss.Space, operation: str, p: Array, q: Array) -> Call:
    manifold = _manifold(space, len(p))
    # Points of projective spaces are matrices of one column there.
    a, b, v = (x.reshape(len(p), space.point_shape[0], -1) for x in (p, q, space.log(p, q)))
    group = isinstance(space, GROUPS)
    if operation == "exp":
        # Tangent vectors of groups are moved to the unit element there.
        vectors = np.swapaxes(a.conj(), -1, -2) @ v if group else v
        return Call(partial(manifold.exp, a, vectors), lambda points: points.reshape(p.shape))
    return Call(partial(manifold.log, a, b), lambda v: (a @ v if group else v).reshape(p.shape))


def _manifold(space: ss.Space, pairs: int) -> Any:
    from pymanopt import manifolds

    n, *k = space.point_shape
    match space:
        case ss.SymmetricPositiveDefinite():
            return manifolds.SymmetricPositiveDefinite(n, k=pairs)
        case ss.SpecialOrthogonal():
            return manifolds.SpecialOrthogonalGroup(n, k=pairs)
        case ss.Unitary():
            return manifolds.UnitaryGroup(n, k=pairs)
        case ss.Grassmannian():
            return manifolds.Grassmann(n, *k, k=pairs)
    # Projective space.
    return manifolds.ComplexGrassmann(n, 1, k=pairs)
