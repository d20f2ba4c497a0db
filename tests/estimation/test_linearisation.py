"""Derivatives of every measurement against finite differences of a curve that moves."""

import numpy as np
import pytest
import sensors

import symspline as ss
from symspline import measure
from symspline._estimation.solve import Iteration, Setup
from symspline._estimation.terms import Body, bind
from symspline._smoothing.noise import smoothed_spaces

KNOTS = np.array([0, 0.7, 1.1, 2.3, 3.0, 3.9, 4.2, 5.5, 6.0])
GROUPS = ["so:3", "sphere:3", "su:2", "so:4", "u:2", "gl:2", "aff:2", "o:3"]


def iteration(space, given, rng):
    """An iteration at a curve through random points."""
    space = ss.space(space)
    spaces = smoothed_spaces(space)
    terms = [term for own in given for term in bind(own, "m", np.asarray(own.t, float), space)]
    constants = {name: own for term in terms for name, own in term.constants.items()}
    losses = ["linear"] * len(terms)
    setup = Setup(spaces, KNOTS, terms, losses, constants, "acceleration", "gcv", 1.4, 1e-3, np.ones(len(spaces)), 9)
    points = [sensors.walk(own, rng, len(KNOTS)) for own in spaces]
    found = Iteration(setup, points, None)
    found.values = {name: rng.standard_normal(own.size) for name, own in constants.items()}
    found.curves = [ss.CubicSpline(KNOTS, rows, own)._curve for own, rows in zip(spaces, points, strict=True)]
    return found


def checked(space, given, rng, tol=2e-8):
    """Compare with a move of the whole motion by a smooth field in the frames.

    The curve γ_ε(t) = exp(ε ξ(t)) moves, and its velocities and accelerations are differences of its points.
    """
    found = iteration(space, given, rng)
    for term in found.setup.terms:
        residuals = term.linearised(found.motion_at, found.values, 0.5)
        motion = found.motion_at(term.times, term.parts, term.nu)
        analytic, parameters = term.derivatives(motion, found.values)
        numeric, others = type(term).__mro__[-2].derivatives(term, motion, found.values)
        assert residuals.residuals.shape == term.noise.shape
        for nu in range(3):
            for part, own in numeric[nu].items():
                exact = analytic[nu].get(part)
                if exact is None:
                    assert np.abs(own).max() < tol
                else:
                    assert np.abs(own - exact).max() < tol * (1 + np.abs(own).max())
        for name, own in others.items():
            assert np.abs(own - parameters[name]).max() < tol * (1 + np.abs(own).max())


@pytest.mark.parametrize("name", GROUPS)
def test_body_rates(name):
    rng = np.random.default_rng(1)
    space = ss.space(name)
    t = sensors.times(rng, 0, 6, 12)
    body = Body(space)
    shape = (12, 3) if body.is_rotation else (12, *space.point_shape)
    omega = rng.standard_normal(shape)
    if not body.is_rotation:
        at = np.broadcast_to(body.identity, shape)
        omega = space.random_tangent(rng, at)
    given = measure.BodyRates(t, omega, sigma=0.1, bias=measure.Constant(body.size))
    checked(name, [given], rng)


def test_directions():
    rng = np.random.default_rng(2)
    t = sensors.times(rng, 0, 6, 12)
    for space in ("so:3", "sphere:3", "se:3"):
        several = measure.Directions(t, rng.standard_normal((12, 2, 3)), rng.standard_normal((2, 3)), sigma=0.1)
        single = measure.Directions(t, rng.standard_normal((12, 3)), rng.standard_normal((12, 3)), sigma=0.1)
        checked(space, [several, single], rng)


def test_rates_of_a_moving_rotation():
    # δω of R exp(ε η) with η' from differences: neither frames nor the curve's spline enter.
    rng = np.random.default_rng(3)
    curve = sensors.turning(6, rng)
    t, h = np.linspace(1, 5, 9), 1e-4
    eta, change = np.sin(t)[:, None] * [0.3, -0.2, 0.5], np.cos(t)[:, None] * [0.3, -0.2, 0.5]
    body = Body(sensors.SO3)

    def turned(size, at):
        field = np.sin(at)[:, None] * [0.3, -0.2, 0.5]
        return curve(at) @ ss.rotations.from_rotation_vectors(size * field)

    def rate(size):
        d = (turned(size, t + h) - turned(size, t - h)) / (2 * h)
        return body.rates(turned(size, t), d)

    found = (rate(1e-4) - rate(-1e-4)) / 2e-4
    omega = ss.rotations.angular_velocity(curve, t)
    assert np.abs(found - (change + np.cross(omega, eta))).max() < 1e-6


@pytest.mark.parametrize("name", ["sphere:2", "h:2", "so:3", "spd:2", "gr:2,4", "cp:2", "r:3"])
def test_velocities_and_points_move_as_the_curve_does(name):
    """The velocity of exp(ε ξ(t)), transported back, changes by ξ'; its acceleration by ξ'' + R(ξ, γ')γ'."""
    rng = np.random.default_rng(4)
    space = ss.space(name)
    found = iteration(name, [measure.Function([1.0], lambda p: np.zeros(1), sigma=1)], rng)
    spline = ss.CubicSpline(KNOTS, found.points[0], space)
    t, h, size = 2.7, 1e-3, 1e-4
    stencil = t + h * np.arange(-2, 3)
    here = found.motion_at(np.array([t]), [0], 2)[0]
    frames = [[spline.transport(t, x, own) for own in here.frames[0]] if x != t else here.frames[0] for x in stencil]
    c = rng.standard_normal((3, space.dim))
    xi = [c[0] + (x - t) * c[1] + (x - t) ** 2 / 2 * c[2] for x in stencil]

    def moved(e):
        points = [
            space.exp(p, e * np.einsum("j,j...->...", own, frame))
            for p, own, frame in zip(spline(stencil), xi, frames, strict=True)
        ]
        logs = [space.log(points[2], q) for q in points]
        velocity = (8 * (logs[3] - logs[1]) - (logs[4] - logs[0])) / (12 * h)
        acceleration = (16 * (logs[3] + logs[1]) - (logs[4] + logs[0])) / (12 * h * h)
        back = [space.transport(points[2], here.p[0], v) for v in (velocity, acceleration)]
        return [here.coordinates(v[None])[0] for v in back]

    found_v, found_a = ((a - b) / (2 * size) for a, b in zip(moved(size), moved(-size), strict=True))
    assert np.abs(found_v - c[1]).max() < 1e-5
    curvature = np.zeros(space.dim)
    for j in range(space.dim):
        there = here.moved(j, 0, 1e-4)
        change = (space.transport(there.p, here.p, there.a) - here.a) / 1e-4
        curvature += c[0][j] * here.coordinates(change)[0]
    assert np.abs(found_a - (c[2] + curvature)).max() < 2e-3
