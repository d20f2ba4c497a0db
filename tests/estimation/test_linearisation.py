"""Residuals of every measurement against their formulas in NumPy, and derivatives against differences of these."""

from collections import namedtuple

import numpy as np
import pytest
import sensors

import symspline as ss
from symspline import _core, measure
from symspline._estimation.problem import Rows, Setup, bind
from symspline._smoothing.noise import smoothed_spaces
from symspline._smoothing.report import coordinates, frames_at

KNOTS = np.array([0, 0.7, 1.1, 2.3, 3.0, 3.9, 4.2, 5.5, 6.0])
GROUPS = ["so:3", "sphere:3", "su:2", "so:4", "u:2", "gl:2", "aff:2", "o:3"]
Problem = namedtuple("Problem", "setup points values")


def problem(space, given, rng):
    """A problem, random points at its knots, and random values of its parameters."""
    space = ss.space(space)
    spaces = smoothed_spaces(space)
    terms = [term for own in given for term in bind(own, "m", np.asarray(own.t, float), space)]
    constants = {name: own for term in terms for name, own in term.constants.items()}
    setup = Setup(spaces, KNOTS, terms, constants, "acceleration", "gcv", 1.4, 1e-3, np.ones(len(spaces)), 9)
    points = [sensors.walk(own, rng, len(KNOTS)) for own in spaces]
    return Problem(setup, points, {name: rng.standard_normal(own.size) for name, own in constants.items()})


def rows_of(given):
    """What the core computes for the only term."""
    (found,) = _core.linearise(*given.setup.in_core(given.points, given.values), True)
    return Rows(*found)


def motions(given, t):
    """The motion of every part at times."""
    found = []
    for space, points in zip(given.setup.spaces, given.points, strict=True):
        curve = ss.CubicSpline(KNOTS, points, space)
        p = curve(t)
        found.append(sensors.Motion(space, p, curve(t, 1), curve(t, 2), frames_at(space, KNOTS, points, t, p)))
    return found


def check(given, t, residuals, sigma, tol=2e-8):
    """Compare with a function of the motions of all parts and of the parameters."""
    rows, own = rows_of(given), motions(given, t)
    expected = residuals(own, given.values)
    assert np.abs(rows.residuals - expected / sigma).max() < 1e-12 * (1 + np.abs(expected / sigma).max())
    for nu in range(3):
        columns = []
        for i, part in enumerate(own):
            for j in range(part.space.dim):
                sides = [
                    residuals([*own[:i], sensors.moved(part, j, nu, e), *own[i + 1 :]], given.values)
                    for e in (3e-6, -3e-6)
                ]
                columns.append((sides[0] - sides[1]) / 6e-6 / sigma)
        compare(rows.jacobians[nu], np.stack(columns, axis=-1), tol)
    for name, columns in given.setup.columns.items():
        for k in range(len(given.values[name])):
            step = 1e-5 * (np.arange(len(given.values[name])) == k)
            sides = [residuals(own, given.values | {name: given.values[name] + e}) for e in (step, -step)]
            compare(rows.parameters[..., columns.start + k], (sides[0] - sides[1]) / 2e-5 / sigma, tol)


def compare(found, expected, tol):
    """Compare derivatives; those that vanish may be None."""
    found = np.zeros_like(expected) if found is None else found
    assert np.abs(found - expected).max() < tol * (1 + np.abs(expected).max())


def rates(space, p, v):
    """The components of g⁻¹v."""
    if space == ss.Sphere(3):
        w, x = p[:, :1], p[:, 1:]
        return 2 * (w * v[:, 1:] - v[:, :1] * x - np.cross(x, v[:, 1:]))
    element = np.linalg.solve(p, v)
    if space == sensors.SO3:
        return np.stack([element[:, 2, 1], element[:, 0, 2], element[:, 1, 0]], axis=-1)
    frame = space.frame(np.eye(len(p[0]), dtype=space.dtype)).reshape(space.dim, -1)
    real = np.concatenate([frame.real, frame.imag], axis=1)
    flat = element.reshape(len(p), -1)
    return np.linalg.lstsq(real.T, np.concatenate([flat.real, flat.imag], axis=1).T, rcond=None)[0].T


@pytest.mark.parametrize("name", GROUPS)
def test_body_rates(name):
    rng = np.random.default_rng(1)
    space = ss.space(name)
    t = sensors.times(rng, 0, 6, 12)
    size = 3 if name in ("so:3", "sphere:3") else space.dim
    omega = rng.standard_normal((12, 3))
    if size != 3 or name not in ("so:3", "sphere:3"):
        at = np.broadcast_to(np.eye(space.point_shape[0], dtype=space.dtype), (12, *space.point_shape))
        omega = space.random_tangent(rng, at)
    given = measure.BodyRates(t, omega, sigma=0.1, bias=measure.Constant(size))
    seen = omega if name in ("so:3", "sphere:3") else rates(space, at, omega)

    def residuals(motion, values):
        return rates(space, motion[0].p, motion[0].v) + values["gyro bias"] - seen

    check(problem(name, [given], rng), t, residuals, 0.1)


def rotations(space, p):
    return p if space == sensors.SO3 else ss.rotations.from_quaternions(p, scalar_first=True)


@pytest.mark.parametrize("name", ["so:3", "sphere:3", "se:3"])
@pytest.mark.parametrize("several", [True, False])
def test_directions(name, several):
    rng = np.random.default_rng(2)
    t = sensors.times(rng, 0, 6, 12)
    seen, reference = rng.standard_normal((12, 2 if several else 1, 3)), rng.standard_normal((2, 3))
    known = reference if several else rng.standard_normal((12, 1, 3))
    given = measure.Directions(t, seen if several else seen[:, 0], known if several else known[:, 0], sigma=0.1)

    def residuals(motion, values):
        turned = np.broadcast_to(known, seen.shape) @ rotations(motion[0].space, motion[0].p)
        return (turned - seen).reshape(12, -1)

    check(problem(name, [given], rng), t, residuals, 0.1)


@pytest.mark.parametrize("known", [True, False])
def test_specific_force(known):
    rng = np.random.default_rng(5)
    t, f = sensors.times(rng, 0, 6, 12), rng.standard_normal((12, 3))
    arm = rng.standard_normal(3)
    lever_arm = arm if known else measure.Constant(3)
    given = measure.SpecificForce(t, f, sigma=0.2, bias=measure.Constant(3), lever_arm=lever_arm)

    def residuals(motion, values):
        turning, moving = motion
        own = arm if known else values["lever arm"]
        omega, change = (rates(turning.space, turning.p, x) for x in (turning.v, turning.a))
        read = np.einsum("nij,ni->nj", turning.p, moving.a - sensors.GRAVITY)
        read = read + np.cross(change, own) + np.cross(omega, np.cross(omega, own))
        return read + values["accelerometer bias"] - f

    check(problem("so:3 x r:3", [given], rng), t, residuals, 0.2, 1e-7)


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "spd:2", "r:3", "gl:2"])
def test_points_and_velocities(name):
    rng = np.random.default_rng(6)
    space = ss.space(name)
    t = np.linspace(0.2, 5.8, 9)
    given = problem(name, [measure.Function([1.0], lambda p: np.zeros(1), sigma=1)], rng)
    (own,) = motions(given, t)
    y = space.exp(own.p, 0.1 * space.random_tangent(rng, own.p))
    v, frame = space.random_tangent(rng, y), space.frame(y)
    roots = rng.standard_normal((9, space.dim, space.dim))
    values, vectors = np.linalg.eigh(np.swapaxes(roots, -1, -2) @ roots)
    roots = np.sqrt(values)[..., None] * np.swapaxes(vectors, -1, -2)

    def at_points(motion, values):
        return -coordinates(space, motion[0].p, motion[0].frames, space.log(motion[0].p, y))

    def with_information(motion, values):
        logs = coordinates(space, y, frame, space.log(y, motion[0].p))
        return np.einsum("nij,nj->ni", roots, logs)

    def velocities(motion, values):
        return coordinates(space, y, frame, space.transport(motion[0].p, y, motion[0].v) - v)

    def checked(measurement, residuals, sigma):
        setup = problem(name, [measurement], rng).setup
        check(given._replace(setup=setup), t, residuals, sigma)

    checked(measure.Points(t, y, weights=np.swapaxes(roots, -1, -2) @ roots, sigma=0.3), with_information, 0.3)
    checked(measure.Velocities(t, y, v, sigma=0.2), velocities, 0.2)
    # The identity in place of the derivative of the logarithm.
    setup = problem(name, [measure.Points(t, y, sigma=0.3)], rng).setup
    rows = rows_of(given._replace(setup=setup))
    assert np.abs(rows.residuals - at_points([own], {}) / 0.3).max() < 1e-11
    assert np.array_equal(rows.jacobians[0], np.broadcast_to(np.eye(space.dim) / 0.3, rows.jacobians[0].shape))
    assert rows.jacobians[1] is None and rows.jacobians[2] is None and rows.parameters is None


def test_time_offset():
    rng = np.random.default_rng(7)
    t, y = np.linspace(0.5, 5.5, 9), rng.standard_normal((9, 2))
    given = problem("r:2", [measure.Points(t, y, sigma=0.5, time_offset=measure.Constant(1))], rng)
    given.values["time offset"][:] = 0.1
    rows, curve = rows_of(given), ss.CubicSpline(KNOTS, given.points[0], "r:2")
    assert np.abs(rows.residuals - frames_applied(given, t + 0.1, curve(t + 0.1) - y) / 0.5).max() < 1e-12
    assert np.abs(rows.parameters[..., 0] - frames_applied(given, t + 0.1, curve(t + 0.1, 1)) / 0.5).max() < 1e-8


def frames_applied(given, t, vectors):
    (own,) = motions(given, t)
    return coordinates(own.space, own.p, own.frames, vectors)


@pytest.mark.parametrize("name", ["sphere:2", "h:2", "so:3", "spd:2", "gr:2,4", "cp:2", "r:3"])
def test_velocities_and_points_move_as_the_curve_does(name):
    """The velocity of exp(ε ξ(t)), transported back, changes by ξ'; its acceleration by ξ'' + R(ξ, γ')γ'."""
    rng = np.random.default_rng(4)
    space = ss.space(name)
    t, h, size = 2.7, 1e-3, 1e-4

    def returned(p, v, a):
        # Velocities and accelerations at the unmoved point, in the frame there.
        back = [space.transport(p, here.p, own) for own in (v, a)]
        return np.concatenate([coordinates(space, here.p, here.frames, own) for own in back], axis=1)

    given = problem(name, [measure.Function([t], returned, nu=2, sigma=1.0)], rng)
    spline = ss.CubicSpline(KNOTS, given.points[0], space)
    (here,) = motions(given, np.array([t]))
    jacobians = rows_of(given).jacobians
    stencil = t + h * np.arange(-2, 3)
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
        return returned(points[2][None], velocity[None], acceleration[None])[0]

    found = (moved(size) - moved(-size)) / (2 * size)
    expected = sum(jacobian[0] @ own for jacobian, own in zip(jacobians, c, strict=True))
    m = space.dim
    assert np.abs(found[:m] - expected[:m]).max() < 1e-5 and np.abs(expected[:m] - c[1]).max() < 1e-7
    assert np.abs(found[m:] - expected[m:]).max() < 2e-3
