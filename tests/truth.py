"""Whether curves are what their reports say, seen through the public interface alone: control points, exp, log,
geodesics and transport of the space, and every segment evaluated by itself."""

from dataclasses import dataclass

import numpy as np
from cases import EPS, LINEAR, POSITIVE, QUADRICS, QUOTIENTS

import symspline as ss

GROUPS = (ss.SpecialOrthogonal, ss.Orthogonal, ss.Unitary, ss.SpecialUnitary, ss.SpecialEuclidean)


@dataclass(frozen=True)
class Truth:
    """How far curves are from what a converged one is, as multiples of what rounding allows; one number a curve,
    NaN of those that are not converged.

    Attributes:
        interpolation: distance of both segments at a knot from its point, and across the seam.
        velocity: difference of the velocities on both sides of a knot, that of the control legs and that of the
            segments as they are evaluated.
        acceleration: the same for covariant accelerations.
        bezier: distance of the curve from the Bézier curve of its control points.
    """

    interpolation: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    bezier: np.ndarray

    @property
    def worst(self):
        return np.max([self.interpolation, self.velocity, self.acceleration, self.bezier], axis=0)


def truth(spline):
    """The `Truth` of a spline, or of a batch with one axis; curves with their own knots or shared ones."""
    space = spline.space
    axes = len(space.point_shape)
    lead = spline.points.ndim - 1 - axes
    count = 1 if lead == 0 else spline.points.shape[0]

    def rows(x, tail):
        return np.reshape(x, (count, *np.shape(x)[np.ndim(x) - tail :]))

    p, u = rows(spline.points, 1 + axes), rows(spline.velocities, 1 + axes)
    controls = rows(spline.control_points, 2 + axes)
    t = np.broadcast_to(np.asarray(spline.t, float), p.shape[:2])
    residual = np.broadcast_to(spline.report.residual, count)
    closed = isinstance(spline.bc_type, str) and spline.bc_type == "periodic"
    converged = np.broadcast_to(spline.report.converged, count)
    finite = np.isfinite(controls).reshape(count, -1).all(axis=1)
    found = np.where(converged, np.inf, np.nan) * np.ones((4, 1))
    good = converged & finite
    if good.any():
        found[:, good] = _measured(space, t[good], p[good], u[good], controls[good], residual[good], closed)
    return Truth(*found)


def _measured(space, t, p, u, controls, residual, closed):
    axes = len(space.point_shape)
    h = np.diff(t)

    def widen(x):
        return x[(...,) + (None,) * axes]

    near = closeness(space, controls)
    cond = conditions(space, controls)
    inner = cond[:, None] * near
    # Every segment as a curve of its own.
    pairs = [np.stack([x[:, :-1], x[:, 1:]], axis=2) for x in (p, u)]
    knots = np.stack([0 * h, h], axis=-1)
    place, rate, bend = (ss.evaluate(knots, *pairs, space, knots, nu=nu, per_curve=True) for nu in range(3))
    ends = np.stack([p[:, :-1], p[:, 1:]], axis=2)
    # At its end a segment goes through the logarithm of a leg, which may nearly reach the cut locus.
    off = space.distance(place, ends).max(axis=2) / (50 * EPS * inner)
    found = [off.max(axis=1)]
    if closed:
        found[0] = np.maximum(found[0], space.distance(p[:, -1], p[:, 0]) / (50 * EPS * cond))
    # Legs as the control points show them.
    legs = np.stack(
        [
            logs(space, controls[:, :, 0], controls[:, :, 1]) * widen(3 / h),
            -logs(space, controls[:, :, 3], controls[:, :, 2]) * widen(3 / h),
        ],
        axis=2,
    )
    before, behind = (np.arange(h.shape[1]), np.roll(np.arange(h.shape[1]), -1))
    if not closed:
        before, behind = before[:-1], behind[:-1]
    shorter = np.minimum(h[:, before], h[:, behind])
    rounding = 100 * EPS * np.maximum(inner[:, before], inner[:, behind])
    # What the residual is relative to, see `symspline.Report`.
    pace = space.distance(ends[:, :, 0], ends[:, :, 1]) / h
    speed = np.maximum(space.norm(p, u).max(axis=1), 1e-3 * pace.max(axis=1))
    velocity = np.zeros(len(t))
    # At its end a segment's velocity has the derivative of a logarithm, which grows once more near the cut locus.
    rounding_of_rates = rounding * np.maximum(near[:, before], near[:, behind])
    for at, vectors, noise in ((ends, legs, rounding), (place, rate, rounding_of_rates)):
        jump = jumps(space, at, vectors, before, behind)
        allowed = 1e-12 * space.norm(at, vectors).max(axis=(1, 2))[:, None] + noise / shorter
        velocity = np.maximum(velocity, (jump / allowed).max(axis=1, initial=0.0))
    found.append(velocity)
    # What the residual is defined by: the jump is six times it, times the speed and 1/h + 1/h, and S(v)⁻¹
    # for both legs.
    stretch = shrinkage(space, controls)
    at = stretch[:, before, 1] * stretch[:, behind, 0]
    weight = speed[:, None] * (1 / h[:, before] + 1 / h[:, behind]) * at
    jump = jumps(space, place, bend, before, behind)
    # The acceleration has its second derivative.
    noise = rounding_of_rates * np.maximum(near[:, before], near[:, behind])
    allowed = 12 * np.maximum(residual, 64 * EPS)[:, None] * weight + at * noise / shorter**2
    found.append((jump / allowed).max(axis=1, initial=0.0))
    found.append(_bezier(space, t, p, u, controls) / (100 * EPS * inner).max(axis=1))
    return found


def _bezier(space, t, p, u, controls):
    """The largest distance between the curve and de Casteljau's algorithm (8) on its control points."""
    h = np.diff(t)
    tau = np.array([0.25, 0.5, 0.8])
    pairs = [np.stack([x[:, :-1], x[:, 1:]], axis=2) for x in (p, u)]
    knots = np.stack([0 * h, h], axis=-1)
    curve = ss.evaluate(knots, *pairs, space, h[..., None] * tau, per_curve=True)
    level = np.repeat(controls[:, :, None], len(tau), axis=2)
    for _ in range(3):
        ends = (level[:, :, :, :-1], level[:, :, :, 1:])
        level = geodesics(space, *ends, np.broadcast_to(tau[:, None], ends[0].shape[:4]))
    return space.distance(curve, level[:, :, :, 0]).max(axis=(1, 2))


def jumps(space, place, vectors, before, behind):
    """Lengths of the differences of vectors at the ends of segments from those at the starts of the next ones."""
    left, right = vectors[:, before, 1], vectors[:, behind, 0]
    if left.size == 0:
        return np.zeros(left.shape[:2])
    there = place[:, behind, 0]
    left = carried(space, place[:, before, 1], there, left)
    return space.norm(there, space.project_tangent(there, left - right))


def conditions(space, controls):
    """By how much rounding of the control points of each curve counts, in lengths of the space."""
    if isinstance(space, (ss.Hyperbolic, *QUADRICS)):
        return np.square(controls).sum(axis=-1).max(axis=(1, 2))
    if isinstance(space, POSITIVE):
        # Also of one seen from the next.
        legs = space.distance(controls[:, :, 1:], controls[:, :, :-1]).max(axis=(1, 2))
        return np.maximum(np.linalg.cond(controls).max(axis=(1, 2)), np.exp(legs))
    return np.maximum(1.0, np.abs(controls).reshape(len(controls), -1).max(axis=1))


def margin(space, p, q):
    """How far the deciding angle of two points is from the cut locus, and that limit; infinite where there is
    none."""
    if isinstance(space, ss.Sphere):
        return 2 * np.arcsin(np.minimum(1.0, np.linalg.norm(p + q, axis=-1) / 2)), np.pi
    if isinstance(space, QUOTIENTS):
        if len(space.point_shape) == 1:
            p, q = p[..., None], q[..., None]
        cosines = np.linalg.svd(np.swapaxes(p.conj(), -1, -2) @ q, compute_uv=False)
        return np.arcsin(np.minimum(1.0, cosines.min(axis=-1))), np.pi / 2
    if isinstance(space, QUADRICS):
        # p + q has the square 2κ(1 + cos θ), whose root is 2 cos(θ/2).
        rest = space.invariant_form(p, p + q, p + q) * (1 if isinstance(space, ss.DeSitter) else -1)
        return 2 * np.arcsin(np.minimum(1.0, np.sqrt(np.maximum(rest, 0.0)) / 2)), np.pi
    if isinstance(space, (*LINEAR, ss.IndefiniteGrassmannian)):
        phases = np.angle(np.linalg.eigvals(np.linalg.solve(p, q)))
        return np.pi - np.abs(phases).max(axis=-1), np.pi
    if isinstance(space, GROUPS):
        if isinstance(space, ss.SpecialEuclidean):
            p, q = p[..., :-1, :-1], q[..., :-1, :-1]
        phases = np.sort(np.angle(np.linalg.eigvals(np.swapaxes(p.conj(), -1, -2) @ q)), axis=-1)
        if not isinstance(space, ss.SpecialUnitary):
            return np.pi - np.abs(phases).max(axis=-1), np.pi
        # Phases that add up to zero: as many of the largest go down a turn as there are turns in the sum.
        turns = np.rint(phases.sum(axis=-1) / (2 * np.pi)).astype(int)
        n = phases.shape[-1]
        place = np.arange(n)
        phases = phases - 2 * np.pi * (place >= n - turns[..., None]) + 2 * np.pi * (place < -turns[..., None])
        return 2 * np.pi - (phases.max(axis=-1) - phases.min(axis=-1)), 2 * np.pi
    return np.full(p.shape[: p.ndim - len(space.point_shape)], np.inf), np.inf


def closeness(space, controls):
    """By how much the cut locus makes rounding count in each segment: limit/(limit − angle) of its legs."""
    pairs = [margin(space, controls[:, :, k], controls[:, :, k + 1]) for k in range(3)]
    least = np.min([m for m, _ in pairs], axis=0)
    limit = pairs[0][1]
    return np.ones(least.shape) if np.isinf(limit) else limit / np.maximum(least, EPS)


def shrinkage(space, controls):
    """|S(v)⁻¹| of both outer legs of each segment; S is sin x/x of K times their angle at worst."""
    pairs = [margin(space, controls[:, :, k], controls[:, :, k + 1]) for k in (0, 2)]
    angle = np.stack([limit - m if np.isfinite(limit) else np.zeros(m.shape) for m, limit in pairs], axis=-1)
    angle = np.where(np.isfinite(angle), angle, 0.0)
    # ad of an element with eigenvalues θ: differences of θ/2 on groups, up to 2θ on Grassmannians.
    if isinstance(space, GROUPS):
        several = space.point_shape[0] > 3
        angle = angle * (1.0 if several and not isinstance(space, ss.SpecialUnitary) else 0.5)
    if isinstance(space, (ss.Grassmannian, ss.ComplexGrassmannian, ss.ComplexProjective)):
        angle = 2 * angle
    return 1 / np.maximum(np.sinc(np.minimum(angle, np.pi) / np.pi), EPS)


def _or_nan(function, space, *inputs):
    """A function of points, row by row where some lie at each other's cut locus: those are NaN."""
    try:
        return function(*inputs)
    except (ss.CutLocusError, ss.ValidationError):
        pass
    axes = len(space.point_shape)
    lead = inputs[0].shape[: inputs[0].ndim - axes]
    result = np.full_like(inputs[0], np.nan)
    for i in np.ndindex(lead):
        try:
            result[i] = function(*(x[i] for x in inputs))
        except (ss.CutLocusError, ss.ValidationError):
            continue
    return result


def logs(space, p, q):
    return _or_nan(space.log, space, p, q)


def carried(space, p, q, v):
    return _or_nan(space.transport, space, p, q, v)


def geodesics(space, p, q, t):
    return _or_nan(space.geodesic, space, p, q, t)
