"""Refits of splines by Newton's method from given velocities, with the accelerations of Hermite splines alone.

Nothing of the solvers of the library is used, so that the curves it certifies can be refuted.
"""

import numpy as np

import symspline as ss


class Refit:
    """The C² condition of curves with the same knots, on batches of points of shape (curves, knots, *point_shape).

    `bc_type` is one of `ENDS`; `given` are the coordinates of both prescribed vectors in the frames there, shape
    (curves, 2, dim).
    """

    def __init__(self, space, t, points, bc_type, given=None):
        self.space, self.p, self.bc_type, self.given = space, points, bc_type, given
        self.h = np.diff(t)
        self.frames = np.asarray(space.frame(points))
        self.ones = (1,) * len(space.point_shape)

    def coordinates(self, vectors):
        """Coordinates of tangent vectors at the knots."""
        return np.asarray(self.space.inner(self.p[:, :, None], self.frames, vectors[:, :, None]))

    def vectors(self, u):
        """Tangent vectors with given coordinates."""
        flat = self.frames.reshape(*self.frames.shape[:3], -1)
        return (u[:, :, None, :] @ flat).reshape(self.p.shape)

    def residual(self, u):
        """The jumps of the acceleration, and the violations of the end conditions, in coordinates."""
        v = self.vectors(u)
        h = self.h.reshape(1, -1, 1, *self.ones)
        ends = np.stack([self.p[:, :-1], self.p[:, 1:]], 2)
        handles = np.stack([v[:, :-1], v[:, 1:]], 2) * h
        segments = ss.HermiteSpline([0.0, 1.0], ends, handles, self.space)
        # Of projective spaces and Grassmannians the arrays of a curve may be others for the same point.
        a = self.space.transport(segments(np.array([0.0, 1.0])), ends, segments(np.array([0.0, 1.0]), nu=2)) / h**2
        jumps = np.zeros_like(v)
        jumps[:, 1:-1] = a[:, 1:, 0] - a[:, :-1, 1]
        jumps[:, 0], jumps[:, -1] = a[:, 0, 0], -a[:, -1, 1]
        if self.bc_type == "periodic":
            jumps[:, 0] -= a[:, -1, 1]
        residual = self.coordinates(jumps)
        if self.bc_type == "periodic":
            residual[:, -1] = u[:, -1] - u[:, 0]
        elif self.bc_type == "clamped":
            residual[:, [0, -1]] = u[:, [0, -1]] - self.given
        elif self.bc_type == "acceleration":
            residual[:, 0] -= self.given[:, 0]
            residual[:, -1] += self.given[:, 1]
        elif self.bc_type == "not-a-knot":
            for end, mid, far, sign in ((0, 1, 2, 1), (-1, -2, -3, -1)):
                residual[:, end] = self._not_a_knot(u, v, end, mid, far, sign)
        return residual

    def _not_a_knot(self, u, v, end, mid, far, sign):
        """In normal coordinates beside the end the curve is one cubic; the derivative of exp by differences."""
        space, p = self.space, self.p
        h0, h1 = self.h[[0, 1]] if sign == 1 else self.h[[-1, -2]]
        slope = sign * v[:, mid]
        near, next_ = space.log(p[:, mid], p[:, end]), space.log(p[:, mid], p[:, far])
        both = np.linalg.solve([[h0**2, -(h0**3)], [h1**2, h1**3]], np.eye(2))
        (a, b), (c, d) = both
        second, third = (
            a * (near + h0 * slope) + b * (next_ - h1 * slope),
            c * (near + h0 * slope) + d * (next_ - h1 * slope),
        )
        begin = slope - 2 * h0 * second + 3 * h0**2 * third
        moved = [space.log(p[:, end], space.exp(p[:, mid], near + e * begin)) for e in (-2e-4, -1e-4, 1e-4, 2e-4)]
        velocity = np.zeros_like(v)
        velocity[:, end] = sign * (8 * (moved[2] - moved[1]) - (moved[3] - moved[0])) / 12e-4
        return (u - self.coordinates(velocity))[:, end]

    def solve(self, u, most=14):
        """Newton's method with derivatives by differences. Return velocities, and which curves have converged."""
        curves, knots, dim = u.shape
        step = np.full(u.shape, np.inf)
        for _ in range(most):
            residual = self.residual(u)
            jacobian = np.empty((curves, knots, dim, knots, dim))
            for i, k in np.ndindex(knots, dim):
                d = np.zeros((knots, dim))
                d[i, k] = 1e-6
                jacobian[:, :, :, i, k] = (self.residual(u + d) - self.residual(u - d)) / 2e-6
            jacobian = jacobian.reshape(curves, knots * dim, knots * dim)
            step = np.linalg.solve(jacobian, residual.reshape(curves, -1, 1)).reshape(u.shape)
            size = np.linalg.norm(step, axis=-1).max(axis=-1)
            u = u - np.minimum(1, 1 / np.maximum(size, 1e-300))[:, None, None] * step
            if size.max() < 1e-9:
                break
        small = np.abs(self.residual(u)).reshape(curves, -1).max(axis=-1) < 1e-6
        return u, small & (np.linalg.norm(step, axis=-1).max(axis=-1) < 1e-6)


ENDS = ("natural", "clamped", "acceleration", "not-a-knot", "periodic")


def refuted(space, kd, bc_type, rng, curves, starts, knots=5):
    """Refit random walks with steps up to `kd` / K from velocities within R.

    Return the number of certified curves, and of refits that found them again, or another curve within R.
    """
    start = np.eye(1, space.point_shape[0])[0] if isinstance(space, ss.Hyperbolic) else space.random_point(rng)
    p = [np.broadcast_to(start, (curves, *space.point_shape))]
    ones = (1,) * len(space.point_shape)
    for _ in range(knots - 1):
        v = space.random_tangent(rng, p[-1])
        lengths = kd / space.curvature * rng.uniform(0, 1, curves) / space.norm(p[-1], v)
        p.append(space.exp(p[-1], v * lengths.reshape(-1, *ones)))
    p = np.stack(p, axis=1)
    if bc_type == "periodic":
        p[:, -1] = p[:, 0]
    t = np.cumsum(rng.uniform(0.5, 2, knots)) + rng.normal()
    given, kinds = None, bc_type
    if bc_type in ("clamped", "acceleration"):
        given = 0.3 * kd / space.curvature * rng.normal(size=(curves, 2, space.dim))
        u = np.zeros((curves, knots, space.dim))
        u[:, [0, -1]] = given
        vectors = Refit(space, t, p, bc_type).vectors(u)
        kinds = tuple((1 if bc_type == "clamped" else 2, vectors[:, end]) for end in (0, -1))
    spline = ss.CubicSpline(t, p, space, bc_type=kinds, on_failure="ignore")
    certificate = spline.report.certificate
    if certificate is None:
        return 0, 0, 0
    good = np.flatnonzero(np.isfinite(certificate.R))
    chosen = np.repeat(good, starts)
    refit = Refit(space, t, p[chosen], bc_type, None if given is None else given[chosen])
    u = refit.coordinates(spline.velocities[chosen])
    away = rng.normal(size=u.shape)
    away *= rng.uniform(0, 1, (*u.shape[:2], 1)) ** 0.3 / np.linalg.norm(away, axis=-1, keepdims=True)
    if bc_type == "clamped":
        away[:, [0, -1]] = 0.0
    if bc_type == "periodic":
        away[:, -1] = away[:, 0]
    found, converged = refit.solve(u + certificate.R[chosen, None, None] * away)
    distance = np.linalg.norm(found - u, axis=-1).max(axis=-1)
    same = distance < 1e-6
    return (
        good.size,
        int((converged & same).sum()),
        int((converged & ~same & (distance <= certificate.R[chosen])).sum()),
    )


def main():
    """Refit 10 000 sets of points on six spaces from 20 starts each: a quarter of an hour."""
    rng = np.random.default_rng(0)
    for name in ("sphere:2", "hyperbolic:2", "so:3", "cp:2", "gr:2,4", "spd:3"):
        totals = np.zeros(3, int)
        for group in range(67):
            kd = (0.3, 0.6, 0.8, 1.0)[group // 5 % 4]
            totals += refuted(ss.space(name), kd, ENDS[group % 5], rng, 25, 20)
        print(
            f"{name}: {67 * 25} sets, {totals[0]} certified, found again {totals[1]} times, refuted {totals[2]} times"
        )


if __name__ == "__main__":
    main()
