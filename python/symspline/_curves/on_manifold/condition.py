"""The C² condition on any manifold, in the form of Popiel and Noakes (J. Approx. Theory 148, 2007).

The covariant acceleration of a cubic Bézier curve with control points p, q⁺, q⁻, … at p is

    6/h² (D log_p(q⁺)[log_{q⁺}(q⁻)] − v),   v = log_p(q⁺),

and C² means that those of both sides agree. On a symmetric space D log is S(v)⁻¹ E_p(−v), and this is (13) of the
paper for equal knots; on others it is not, see docs/manifolds.md.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..._spaces import Array, Doubles
from ...manifolds._operations import Operations


class End(NamedTuple):
    """A condition at one end of curves.

    Attributes
    ----------
    kind : {"natural", "velocity", "acceleration", "not-a-knot"}
        Kind of condition.
    vector : ndarray, shape (curves, *point_shape), or None
        Prescribed vector.
    logs : ndarray, shape (2, curves, *point_shape), or None
        For not-a-knot, the logarithms of the end and of the third point, at the point next to the end.
    """

    kind: str
    vector: Array | None = None
    logs: Array | None = None

    def take_batch(self, chosen: NDArray[np.int64]) -> End:
        """Return the condition for some of the curves."""
        return End(
            self.kind,
            None if self.vector is None else self.vector[chosen],
            None if self.logs is None else self.logs[:, chosen],
        )


class Problem(NamedTuple):
    """Curves with unknown velocities.

    Attributes
    ----------
    h : ndarray, shape (curves, N)
        Times between the points.
    p : ndarray, shape (curves, N+1, *point_shape)
        Points.
    frames : ndarray, shape (curves, N+1, dim, numbers of a point)
        Orthonormal frames at the points.
    forms : ndarray of the same shape, or None
        The frames as linear forms, if the manifold has them.
    ends : list of End, or None
        Conditions at both ends, None for closed curves.
    """

    operations: Operations
    h: Doubles
    p: Array
    frames: Array
    forms: Array | None
    ends: list[End] | None

    def take_batch(self, chosen: NDArray[np.int64]) -> Problem:
        """Return the problem of some of the curves."""
        ends = self.ends and [end.take_batch(chosen) for end in self.ends]
        forms = None if self.forms is None else self.forms[chosen]
        return self._replace(h=self.h[chosen], p=self.p[chosen], frames=self.frames[chosen], forms=forms, ends=ends)

    def velocities(self, coordinates: Doubles) -> Array:
        """Velocities at all points, of their coordinates in the frames."""
        nodes = coordinates.shape[1]
        u = np.einsum("cna,cnai->cni", coordinates, self.frames[:, :nodes])
        u = u.reshape(*u.shape[:2], *self.p.shape[2:])
        return np.concatenate([u, u[:, :1]], axis=1) if self.ends is None else u

    def coordinates(self, vectors: Array, nodes: slice) -> Doubles:
        """Coordinates of vectors at some nodes of every curve."""
        if self.forms is not None:
            flat = vectors.reshape(*vectors.shape[:2], -1)
            return np.asarray(np.einsum("cnai,cni->cna", self.forms[:, nodes], flat))
        frames = self.frames[:, nodes]
        frames = frames.reshape(*frames.shape[:3], *self.p.shape[2:])
        pairs = np.broadcast_to(self.p[:, nodes, None], frames.shape)
        return self.operations.inner(pairs, frames, np.broadcast_to(vectors[:, :, None], frames.shape))


class ControlPolygon(NamedTuple):
    """The control polygon of segments: handles v from the points p to the inner control points q, and the logarithm w
    from each q to the other one. The first axis, of length 2, has the starts and the ends; the shape is
    (2, curves, N, *point_shape)."""

    p: Array
    v: Array
    q: Array
    w: Array

    def at(self, index: Any) -> ControlPolygon:
        """Return the control polygons at an index of the axes after the first."""
        index = index if isinstance(index, tuple) else (index,)
        return ControlPolygon(*(part[(slice(None), *index)] for part in self))


def control_polygons(
    operations: Operations, h: Doubles, p: Array, u: Array, before: Array | None = None
) -> ControlPolygon:
    """The control polygons of curves with points and velocities, and those before the knots if they differ.

    They are NaN where there is no logarithm.
    """
    at, v = _handles(h, p, u)
    if before is not None:
        v[1] = _handles(h, p, before)[1][1]
    q = operations.exp(at, v)
    return ControlPolygon(at, v, q, operations.log(q, q[::-1]))


def _handles(h: Doubles, p: Array, u: Array) -> tuple[Array, Array]:
    """The ends of segments, and the handles there."""
    third = (h / 3).reshape(*h.shape, *[1] * (p.ndim - 2))
    return np.stack([p[:, :-1], p[:, 1:]]), np.stack([third * u[:, :-1], -third * u[:, 1:]])


def c2_residuals(problem: Problem, u: Array) -> Doubles:
    """Return the C² residuals at every node as coordinates: a sixth of the jump of the acceleration, and at an end with
    not-a-knot the error of the velocity."""
    bends = problem.operations.bends(*_handles(problem.h, problem.p, u))
    h = problem.h
    square = (h * h).reshape(*h.shape, *[1] * (u.ndim - 2))
    starts, stops = bends / square
    if problem.ends is None:
        jumps = np.concatenate([starts[:, :1] - stops[:, -1:], starts[:, 1:] - stops[:, :-1]], axis=1)
        return problem.coordinates(jumps, slice(0, h.shape[1]))
    jumps = np.concatenate([starts[:, :1], starts[:, 1:] - stops[:, :-1], -stops[:, -1:]], axis=1)
    # A copy: inner products of other libraries may be read-only arrays.
    found = np.array(problem.coordinates(jumps, slice(None)))
    for which, end in enumerate(problem.ends):
        sign, node = (1, 0) if which == 0 else (-1, h.shape[1])
        if end.kind == "velocity":
            found[:, node] = 0.0
        elif end.logs is not None:
            found[:, node] = _not_a_knot(problem, u, which, *end.logs)
        elif end.vector is not None:
            given = problem.coordinates(end.vector[:, None], slice(node, node + 1))
            found[:, node] -= sign * given[:, 0] / 6
    return found


def is_parabola(problem: Problem) -> bool:
    """Whether both ends of three points are not-a-knot: then the cubic is a parabola, which needs no velocity."""
    return problem.h.shape[1] == 2 and all(end.kind == "not-a-knot" for end in problem.ends or [End("")])


def not_a_knot(operations: Operations, p: Array, which: int) -> End:
    """Not-a-knot at an end of curves with points p, three or more."""
    end, mid, far = (0, 1, 2) if which == 0 else (-1, -2, -3)
    logs = operations.log(np.stack([p[:, mid], p[:, mid]]), np.stack([p[:, end], p[:, far]]))
    return End("not-a-knot", None, logs)


def _not_a_knot(problem: Problem, u: Array, which: int, x0: Array, x2: Array) -> Doubles:
    """In normal coordinates at the neighbouring knot the curve is one cubic c through three points, up to second
    order: c'(t₀) − D log_{p₁}(p₀)[u₀], in the frame at p₁."""
    operations, p = problem.operations, problem.p
    end, mid = (0, 1) if which == 0 else (-1, -2)
    # Seen from the last knot time runs backwards.
    sign = 1.0 if which == 0 else -1.0
    h0, h1 = (problem.h[:, i].reshape(-1, *[1] * (p.ndim - 2)) for i in ((0, 1) if which == 0 else (-1, -2)))
    left, right = -x0 / h0, x2 / h1
    bend = (right - left) / (h0 + h1)
    slope = left - h0 * bend
    if not is_parabola(problem):
        # The parabola's slope in the middle is left + h0 * bend; a cubic term changes it to the given one.
        slope = slope - (sign * u[:, mid] - left - h0 * bend) * (h0 + h1) / h1
    wanted = sign * slope - operations.dlog(p[:, mid], x0, p[:, end], u[:, end])
    index = 1 if which == 0 else p.shape[1] - 2
    return problem.coordinates(wanted[:, None], slice(index, index + 1))[:, 0]
