"""The C² condition (13) of the paper for the velocities of splines, with natural ends or given velocities.

Nodes are along the first axis. Axes of a batch may follow.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from .library import Module, Tensor, adjoint, hermitian
from .models import Curved, Model, Poses, Positive, Rotations, cross_matrix, whitened

# Terms of the series of sinh(ad)/ad. The last is below rounding for handles up to 20 long; a handle has about a third
# of the length of its segment.
_TERMS = 14


class Chain:
    """Nodes and velocities of a spline in flat space; the others override what differs."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.lib = model.lib

    def enter(self, points: Tensor, velocities: Tensor) -> tuple[Tensor, Tensor]:
        """Return nodes and velocities in the arrays of the chain from those of the user."""
        return self.model.to_internal(points, velocities)

    def leave(self, p: Tensor, u: Tensor) -> Tensor:
        """Return velocities as the arrays of the user."""
        return self.model.velocities_from_internal(p, u)

    def scale(self, p: Tensor) -> Tensor:
        """Return the largest number of every curve whose rounding is in the logarithms."""
        return self.lib.xp.amax(abs(p), (0, -1))

    def tangent(self, p: Tensor, u: Tensor) -> Tensor:
        """Return the nearest tangent vectors at p."""
        return u

    def normal_change(self, p: Tensor, u: Tensor, dp: Tensor) -> Tensor:
        """Return the normal part of the change of tangent vectors u whose points move by dp."""
        return self.lib.xp.zeros_like(u)

    def logs(self, p: Tensor, ahead: Tensor, back: Tensor) -> tuple[Tensor, Tensor]:
        """Return the vectors from inner handle to inner handle, transported to the outer points.

        On a group, transport along the geodesic exp(sa) is Ad(exp(−sa/2)) in the frame of the body. Back from
        g = p exp(a), the vector log(g⁻¹ r) becomes log(exp(−a/2) p⁻¹ r exp(−a/2)).
        """
        exp, log, stack = self.model.exp, self.model.log, self.lib.xp.stack
        ends, handles = stack([p[:-1], p[1:]]), stack([ahead, back])
        inner = exp(ends, handles)
        others = stack([inner[1], inner[0]])
        first, last = log(exp(ends, 0.5 * handles), exp(others, -0.5 * handles))
        return first, last

    def stretched(self, v: Tensor, w: Tensor) -> Tensor:
        """Return sinh(ad_v)/ad_v of w."""
        divisors = [2.0 * k * (2 * k + 1) for k in range(_TERMS, 0, -1)]
        curvature = self.curvature(v)
        return self.lib.fold(lambda total, divisor: w + curvature(total) / divisor, w, divisors)

    def curvature(self, v: Tensor) -> Callable[[Tensor], Tensor]:
        """Return the map from w to ad_v² w, which is −R(w, v)v. On a group ad_v is ½[v, ·]."""
        return lambda w: 0 * w


class SphereChain(Chain):
    """Unit vectors, or rotations as unit quaternions."""

    def __init__(self, model: Curved | Rotations) -> None:
        super().__init__(model)
        self.sphere = model if isinstance(model, Curved) else Curved(model.lib, 1)

    def enter(self, points: Tensor, velocities: Tensor) -> tuple[Tensor, Tensor]:
        p, u = self.model.to_internal(points, velocities)
        if isinstance(self.model, Rotations) and len(p) > 1:
            # Of both signs of a quaternion the one nearer to that before.
            xp = self.lib.xp
            one = xp.ones_like(p[..., :1])
            signs = xp.where(self.sphere.inner(p[:-1], p[1:]) < 0, -one[1:], one[1:])
            along = xp.concatenate([one[:1], xp.cumprod(signs, 0)])
            p, u = along * p, along * u
        return p, u

    def tangent(self, p: Tensor, u: Tensor) -> Tensor:
        return u - self.sphere.inner(p, u) * p

    def normal_change(self, p: Tensor, u: Tensor, dp: Tensor) -> Tensor:
        return -self.sphere.inner(u, dp) * p

    def logs(self, p: Tensor, ahead: Tensor, back: Tensor) -> tuple[Tensor, Tensor]:
        exp, log, stack = self.sphere.exp, self.sphere.log, self.lib.xp.stack
        ends = stack([p[:-1], p[1:]])
        left, right = exp(ends, stack([ahead, back]))
        starts, others = stack([left, right]), stack([right, left])
        first, last = self._transported(starts, ends, log(starts, others))
        return first, last

    def _transported(self, a: Tensor, b: Tensor, v: Tensor) -> Tensor:
        """Transport tangent vectors at a in parallel along geodesics to b."""
        inner = self.sphere.inner
        return v - inner(v, b) / (1 + inner(a, b)) * (a + b)

    def stretched(self, v: Tensor, w: Tensor) -> Tensor:
        """Across v by sin|v|/|v|, and along v as it is."""
        z = self.sphere.inner(v, v)
        return self.lib.stumpff(1, 1, z) * w + self.lib.stumpff(3, 1, z) * self.sphere.inner(v, w) * v


class PoseChain(Chain):
    """Rigid motions and twists of the body."""

    def curvature(self, v: Tensor) -> Callable[[Tensor], Tensor]:
        # [(ω, v), (ω', v')] = (ω × ω', ω × v' + v × ω')
        concatenate = self.lib.xp.concatenate
        turn, ahead = cross_matrix(self.lib, v[..., :3]), cross_matrix(self.lib, v[..., 3:])
        rows = [concatenate([turn, 0 * turn], axis=-1), concatenate([ahead, turn], axis=-1)]
        half = 0.5 * concatenate(rows, axis=-2)
        square = half @ half
        return lambda w: (square @ w[..., None])[..., 0]


class PositiveChain(Chain):
    """Positive definite matrices as Cholesky factors L, and velocities L⁻¹ V L⁻*."""

    def enter(self, points: Tensor, velocities: Tensor) -> tuple[Tensor, Tensor]:
        root = self.lib.xp.linalg.cholesky(hermitian(points))
        return root, whitened(self.lib, root, velocities)

    def leave(self, p: Tensor, u: Tensor) -> Tensor:
        return p @ u @ adjoint(p)

    def scale(self, p: Tensor) -> Tensor:
        return self.lib.xp.ones_like(p[0, ..., 0, 0])

    def tangent(self, p: Tensor, u: Tensor) -> Tensor:
        return hermitian(u)

    def logs(self, p: Tensor, ahead: Tensor, back: Tensor) -> tuple[Tensor, Tensor]:
        """In the frame L of a point the handle is exp(a), and exp(−a/2) · exp(−a/2) transports back from it.

        With X = exp(−a/2) L_p⁻¹ L_q exp(b/2), the vector at p is log XX*, and that at q is −log X*X.
        """
        outer = self.lib.exponential(self.lib.xp.stack([-0.5 * ahead, 0.5 * back]))
        x = outer[0] @ self.lib.solve_lower(p[:-1], p[1:]) @ outer[1]
        first, last = self.lib.logarithm(self.lib.xp.stack([x @ adjoint(x), adjoint(x) @ x]))
        return first, -last

    def curvature(self, v: Tensor) -> Callable[[Tensor], Tensor]:
        half = 0.5 * v

        def twice(w: Tensor) -> Tensor:
            inner = half @ w - w @ half
            return half @ inner - inner @ half

        return twice


def chain_of(model: Model | None) -> Chain | None:
    """Return the chain of a model; None if fits are not supported."""
    if isinstance(model, Rotations) or (isinstance(model, Curved) and model.sign > 0):
        return SphereChain(model)
    if isinstance(model, Poses):
        return PoseChain(model)
    if isinstance(model, Positive):
        return PositiveChain(model)
    return Chain(model) if type(model) is Model else None


class Problem(NamedTuple):
    """The C² condition of curves.

    Attributes
    ----------
    chain : Chain
        The space.
    given : tuple of bool
        Whether the velocity is given at the start and at the end; otherwise the acceleration is zero, (20).
    h : array, shape (n - 1, ...)
        Lengths of the intervals.
    p : array, shape (n, ...)
        Nodes in the arrays of the chain.
    first, last : array
        Velocities at the ends, which count where they are given.
    """

    chain: Chain
    given: tuple[bool, bool]
    h: Tensor
    p: Tensor
    first: Tensor
    last: Tensor

    def residual(self, u: Tensor) -> Tensor:
        """Return the residuals for velocities u at inner nodes, and of the end conditions.

        On unequal knots (13) has factors sinh(ad)/ad. Each residual is a velocity times its weight in `weights`.
        """
        chain, h, times, xp = self.chain, self.h, self.chain.model.times, self.chain.lib.xp
        ahead, back = times(h / 3, u[:-1]), times(-h / 3, u[1:])
        from_start, from_end = chain.logs(self.p, ahead, back)
        after, before = times(1 / h**2, from_start - ahead), times(1 / h**2, from_end - back)
        right, left = chain.stretched(xp.stack([back[:-1], ahead[1:]]), xp.stack([after[1:], before[:-1]]))
        start = self.first - u[0] if self.given[0] else 3 * after[0]
        end = self.last - u[-1] if self.given[1] else -3 * before[-1]
        return xp.concatenate([start[None], 3 * (right - left), end[None]])

    def weights(self) -> tuple[Tensor, Tensor, Tensor]:
        """Return the three diagonals of the condition in flat space, shape (n, ...) of the intervals."""
        xp, r = self.chain.lib.xp, 1 / self.h
        zero, one = xp.zeros_like(r[:1]), xp.ones_like(r[:1])
        first, last = (one if fixed else 2 * end for fixed, end in zip(self.given, (r[:1], r[-1:]), strict=True))
        middle = xp.concatenate([first, 2 * (r[:-1] + r[1:]), last])
        above = xp.concatenate([zero if self.given[0] else r[:1], r[1:], zero])
        below = xp.concatenate([zero, r[:-1], zero if self.given[1] else r[-1:]])
        return below, middle, above

    def sizes(self, rows: Tensor) -> Tensor:
        """Return the length of one vector per node."""
        flat = rows.reshape(*rows.shape[: rows.ndim - self.chain.model.axes], -1)
        return self.chain.lib.xp.sqrt((abs(flat) ** 2).sum(axis=-1))


# ---- block tridiagonal systems, solved in few operations on whole arrays, which suits GPUs ----


def cyclic_reduction(
    xp: Module, solve: Callable[..., Tensor], below: Tensor, diagonal: Tensor, above: Tensor, rows: Tensor
) -> Tensor:
    """Solve block tridiagonal systems by eliminating every second unknown, again and again.

    Golub & Van Loan, *Matrix Computations* (4th edition), §4.5.4. It needs O(log n) operations on arrays, without
    pivoting between blocks: those of the C² condition are diagonally dominant for points that are not far apart.

    Parameters
    ----------
    xp : module
        ``jax.numpy`` or ``torch``.
    solve : callable
        ``solve(diagonal, *columns)`` returns the solutions of every block for several arrays of columns.
    below, diagonal, above : array, shape (n, ..., k, k)
        Blocks; below[0] and above[-1] must be zero.
    rows : array, shape (n, ..., k, m)
    """
    n = len(rows)
    if n == 1:
        return solve(diagonal, rows)[0]
    # For odd i, x_i = r − L x_{i−1} − U x_{i+1} with these three.
    odd = left, right, rest = solve(diagonal[1::2], below[1::2], above[1::2], rows[1::2])
    # Those before and after each even i; there is none before the first, and none after the last of an odd number.
    before, after = [], []
    for a in odd:
        zero = xp.zeros_like(a[:1])
        before.append(xp.concatenate([zero, a])[: (n + 1) // 2])
        after.append(xp.concatenate([a, zero])[: (n + 1) // 2])
    low, high = below[::2], above[::2]
    even = cyclic_reduction(
        xp,
        solve,
        -low @ before[0],
        diagonal[::2] - low @ before[1] - high @ after[0],
        -high @ after[1],
        rows[::2] - low @ before[2] - high @ after[2],
    )
    next_even = xp.concatenate([even[1:], xp.zeros_like(even[:1])])[: n // 2]
    uneven = rest - left @ even[: n // 2] - right @ next_even
    pairs = xp.stack([even[: n // 2], uneven], 1).reshape(2 * (n // 2), *even.shape[1:])
    return xp.concatenate([pairs, even[n // 2 :]])
