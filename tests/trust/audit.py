"""Audit of the residuals after `estimate` and smoothing: sound recordings, and recordings with a fault.

A faulty recording is wrong by definition (its error is infinite), so that the share of the silently wrong ones is that
of faults without a warning.
"""

import numpy as np
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline import measure

from .outcome import outcome_of

SO3, S2 = ss.SpecialOrthogonal(3), ss.Sphere(2)
GRAVITY = np.array([0.0, 0.0, -9.80665])


def turning(rng, rate):
    """Rotations as a function of time, with three frequencies per axis."""
    frequency, phase = rate * rng.uniform(0.05, 0.25, (3, 3)), rng.uniform(0, 6.28, (3, 3))
    size = rng.normal(size=(3, 3)) / 2
    return lambda t: Rotation.from_rotvec(
        np.sum(size * np.sin(2 * np.pi * frequency * np.asarray(t)[:, None, None] + phase), axis=1)
    )


def angular_velocity(motion, t, h=1e-5):
    return (motion(t - h).inv() * motion(t + h)).as_rotvec() / (2 * h)


def attitudes_and_rates(seed, fault=None, loss="linear", penalty="jerk", sigma=(0.03, 0.02)):
    """Attitudes, and rates with a bias."""
    rng = np.random.default_rng([1, seed])
    end, start = rng.uniform(5, 15), rng.uniform(-100, 1e5)
    n, m = int(rng.integers(25, 80)), int(rng.integers(150, 500))
    motion = turning(rng, 10 / end)
    t, s = np.sort(rng.uniform(0.3, end - 0.3, n)), np.linspace(0.2, end - 0.2, m)
    seen = motion(t + {"offset": 0.2}.get(fault, 0.0)) * Rotation.from_rotvec(sigma[0] * rng.normal(size=(n, 3)))
    bias = rng.normal(size=3) * 0.05
    omega = angular_velocity(motion, s) + bias + sigma[1] * rng.normal(size=(m, 3))
    factors = {"sigma * 5": 5.0, "sigma / 5": 0.2, "sigma in degrees": np.degrees(1)}
    scale = factors.get(fault, 1.0)
    if fault == "rotated frame":
        seen = seen * Rotation.from_rotvec(np.radians(30) * np.array([0, 0, 1.0]))
    if fault == "swapped axes":
        omega = omega[:, [1, 0, 2]] * [1, 1, -1]
    if fault == "degrees":
        omega = np.degrees(omega)
    if fault == "jump":
        turned = seen * Rotation.from_euler("x", 20, degrees=True)
        seen = Rotation.from_matrix(np.where((t > 0.55 * end)[:, None, None], turned.as_matrix(), seen.as_matrix()))
    if fault == "outliers" or loss != "linear":
        bad = rng.choice(n, n // 10, replace=False)
        spoiled = seen.as_matrix()
        spoiled[bad] = Rotation.random(len(bad), random_state=seed).as_matrix()
        seen = Rotation.from_matrix(spoiled)
    if fault == "milliseconds":
        s = s / 1000
    known = measure.Constant(3, sigma=0.001 if fault == "prior" else 0.1)
    order = rng.permutation(n)
    given = [
        measure.Points(start + t[order], seen.as_matrix()[order], sigma=sigma[0] * scale),
        measure.BodyRates(start + s, omega, sigma=sigma[1], bias=known),
    ]
    if fault == "milliseconds":
        given[1] = measure.BodyRates(start + 0.2 + s, omega, sigma=sigma[1], bias=known)
    knots = start + np.linspace(0, end, int(4 * end))
    curve = ss.estimate(given, knots, "so:3", penalty=penalty, loss=loss)
    if fault:
        return np.inf
    error = SO3.distance(curve(start + t), motion(t).as_matrix())
    return float(np.max(error / curve.std(start + t))) / np.sqrt(3)


def directions(seed):
    """Two stars, seen as unit vectors, and a magnetometer that is not normalised."""
    rng = np.random.default_rng([2, seed])
    n, motion = int(rng.integers(40, 120)), turning(rng, 1.0)
    t = np.sort(rng.uniform(0, 10, n))
    r = motion(t).as_matrix()
    stars = np.array([[1.0, 0, 0], [0, 0.6, 0.8]])
    seen = np.einsum("ki,nij->nkj", stars, r) + 0.01 * rng.normal(size=(n, 2, 3))
    seen = seen / np.linalg.norm(seen, axis=-1, keepdims=True)
    field = np.array([20.0, 1, 40])
    magnetic = np.einsum("i,nij->nj", field, r) + 0.5 * rng.normal(size=(n, 3))
    given = [measure.Directions(t, seen, stars, sigma=0.01), measure.Directions(t, magnetic, field, sigma=0.5)]
    curve = ss.estimate(given, np.linspace(t[0], t[-1], 41), "so:3")
    return float(np.max(SO3.distance(curve(t), r) / curve.std(t))) / np.sqrt(3)


def velocities(seed):
    """Positions and velocities on a sphere."""
    rng = np.random.default_rng([3, seed])
    n, motion = int(rng.integers(30, 100)), turning(rng, 1.0)
    t = np.sort(rng.uniform(0, 10, n))
    axis = np.array([0.6, 0, 0.8])

    def path(x):
        return motion(x).apply(axis)

    y = S2.exp(path(t), 0.02 * S2.random_tangent(rng, path(t)))
    h = 1e-5
    v = S2.transport(path(t), y, S2.project_tangent(path(t), (path(t + h) - path(t - h)) / (2 * h)))
    v = v + 0.05 * S2.random_tangent(rng, y)
    curve = ss.estimate(
        [measure.Points(t, y, sigma=0.02), measure.Velocities(t, y, v, sigma=0.05)], np.linspace(t[0], t[-1], 31), S2
    )
    return float(np.max(S2.distance(curve(t), path(t)) / curve.std(t))) / np.sqrt(2)


def position(rng, end):
    frequency, phase = rng.uniform(0.05, 0.2, (3, 3)), rng.uniform(0, 6.28, (3, 3))
    return lambda t: np.sum(3 * np.sin(2 * np.pi * frequency * np.asarray(t)[:, None, None] + phase), axis=1)


def receivers(seed, fault=None):
    """Two receivers, one with weights or information matrices, and ranges to beacons."""
    rng = np.random.default_rng([4, seed])
    path, n, m = position(rng, 20), int(rng.integers(20, 200)), int(rng.integers(6, 60))
    t, s = np.sort(rng.uniform(0, 20, n)), rng.uniform(0, 20, m)
    y = path(t) + 0.5 * rng.normal(size=(n, 3))
    if seed % 3 == 0:
        flat = np.zeros((m, 3, 3))
        flat[:, :2, :2] = np.eye(2) / 0.1**2
        options = {"weights": flat}
        z = path(s) + rng.normal(size=(m, 3)) * [0.1, 0.1, 30]
    else:
        weights = rng.uniform(0.3, 3, m)
        weights[:2] = 0
        options = {"weights": weights, "sigma": 0.2}
        z = path(s) + 0.2 * rng.normal(size=(m, 3)) / np.sqrt(np.maximum(weights, 1e-2))[:, None]
    if fault == "offset":
        z = z + np.array([1.5, 0, 0])
    beacons = np.array([[10.0, 0, 0], [0, 10, 5], [-5, -5, 0]])
    ranges = np.linalg.norm(path(t)[:, None] - beacons, axis=-1) + 0.3 * rng.normal(size=(n, 3))
    given = [
        measure.Points(t, y, sigma=0.5),
        measure.Points(s, z, **options),
        measure.Function(t, lambda x: np.linalg.norm(x[:, None] - beacons, axis=-1) - ranges, sigma=0.3),
    ]
    curve = ss.estimate(given, np.linspace(0, 20, 41), "r:3", penalty=("acceleration", "jerk")[seed % 2])
    return np.inf if fault else float(np.max(np.linalg.norm(curve(t) - path(t), axis=-1) / curve.std(t))) / np.sqrt(3)


def inertial(seed, fault=None):
    """Positions, a gyroscope and an accelerometer on poses."""
    rng = np.random.default_rng([5, seed])
    path, motion = position(rng, 15), turning(rng, 1.0)
    n = int(rng.integers(40, 100))
    t, s = np.sort(rng.uniform(0, 15, n)), np.linspace(0, 15, 300)
    r, h = motion(s).as_matrix(), 1e-3
    acceleration = (path(s + h) - 2 * path(s) + path(s - h)) / h**2
    force = np.einsum("nij,ni->nj", r, acceleration - GRAVITY) + 0.1 * rng.normal(size=(300, 3)) + 0.1
    if fault == "g":
        force = force / 9.80665
    omega = angular_velocity(motion, s) + 0.03 + 0.01 * rng.normal(size=(300, 3))
    y = path(t) + 0.1 * rng.normal(size=(n, 3))
    given = [
        measure.Points(t, y, sigma=0.1),
        measure.BodyRates(s, omega, sigma=0.01, bias=measure.Constant(3)),
        measure.SpecificForce(s, force, sigma=0.1, bias=measure.Constant(3, sigma=1.0)),
    ]
    curve = ss.estimate(given, np.linspace(0, 15, 61), "se:3", penalty="jerk")
    if fault:
        return np.inf
    error = np.linalg.norm(curve(t)[:, :3, 3] - path(t), axis=-1)
    return float(np.max(error / curve.std(t)[1])) / np.sqrt(3)


def points_alone(seed, fault=None):
    """One receiver alone, with σ as a number, an array or a tuple."""
    rng = np.random.default_rng([6, seed])
    path, n = position(rng, 20), int(rng.integers(30, 200))
    t = np.sort(rng.uniform(0, 20, n))
    sigma = 0.1 * rng.uniform(0.5, 2, n)
    y = path(t) + sigma[:, None] * rng.normal(size=(n, 3))
    given = sigma * {"sigma * 5": 5.0, "sigma / 5": 0.2}.get(fault, 1.0)
    curve = ss.estimate([measure.Points(t, y, sigma=given)], "auto", "r:3")
    return np.inf if fault else float(np.max(np.linalg.norm(curve(t) - path(t), axis=-1) / curve.std(t))) / np.sqrt(3)


def smoothing(seed, fault=None, loss="linear"):
    """Noisy points whose noise level is unknown, on several spaces."""
    rng = np.random.default_rng([7, seed])
    n = int(10 ** rng.uniform(1.3, 2.6))
    space = ss.space(("sphere:2", "so:3", "torus:1", "r:1", "r:3", "h:2", "spd:2")[seed % 7])
    t = np.sort(rng.uniform(0, 10, n)) if rng.random() < 0.5 else np.linspace(0, 10, n)
    nodes = np.linspace(-1, 11, 8)
    points = [space.random_point(rng)]
    for _ in nodes[1:]:
        v = space.random_tangent(rng, points[-1])
        points.append(space.exp(points[-1], 0.6 * v / np.sqrt(space.inner(points[-1], v, v))))
    truth = ss.CubicSpline(nodes, np.array(points), space)(t)
    noise = 10 ** rng.uniform(-3, -1)
    errors = space.random_tangent(rng, truth)
    if fault == "outliers":
        bad = rng.choice(n, max(1, n // 30), replace=False)
        errors[bad] *= 25
    y = space.exp(truth, noise * errors)
    curve = ss.make_smoothing_spline(t, y, space, loss=loss)
    if fault:
        return np.inf
    return float(np.max(space.distance(curve(t), truth)[1:-1] / curve.std(t)[1:-1])) / np.sqrt(space.dim)


def spinning(seed):
    """A body that turns too far between its noisy attitudes."""
    rng = np.random.default_rng([8, seed])
    t, axis = np.arange(300) * 0.01, rng.normal(size=3)
    rate = rng.uniform(2.3, 2.9) / 0.01
    motion = Rotation.from_rotvec(np.outer(rate * t, axis / np.linalg.norm(axis)))
    y = (motion * Rotation.from_rotvec(0.05 * rng.normal(size=(300, 3)))).as_matrix()
    curve = ss.make_smoothing_spline(t, y, "so:3")
    return float(np.max(SO3.distance(curve(t), motion.as_matrix()))) / 0.05


def _kind(fit, *args, sound=True, **options):
    return lambda seed: outcome_of(lambda: fit(seed, *args, **options), sound)


FAULTS = (
    "rotated frame",
    "swapped axes",
    "degrees",
    "milliseconds",
    "sigma * 5",
    "sigma / 5",
    "sigma in degrees",
    "jump",
    "outliers",
    "offset",
    "prior",
)
KINDS = (
    {
        "audit: attitudes and rates": _kind(attitudes_and_rates),
        "audit: attitudes and rates, acceleration": _kind(attitudes_and_rates, penalty="acceleration"),
        "audit: outliers, cauchy": _kind(attitudes_and_rates, loss="cauchy"),
        "audit: outliers, huber": _kind(attitudes_and_rates, loss="huber"),
        "audit: directions": _kind(directions),
        "audit: positions and velocities on a sphere": _kind(velocities),
        "audit: two receivers and ranges": _kind(receivers),
        "audit: inertial navigation": _kind(inertial),
        "audit: one receiver": _kind(points_alone),
        "audit: smoothing": _kind(smoothing),
        "audit: smoothing, cauchy": _kind(smoothing, loss="cauchy"),
        "audit: smoothing, outliers": _kind(smoothing, "outliers", sound=False),
        "audit: smoothing, fast spins": _kind(spinning, sound=False),
        "audit: offset of a receiver": _kind(receivers, "offset", sound=False),
        "audit: specific force in g": _kind(inertial, "g", sound=False),
    }
    | {f"audit: {fault}": _kind(attitudes_and_rates, fault, sound=False) for fault in FAULTS}
    | {f"audit: one receiver, {fault}": _kind(points_alone, fault, sound=False) for fault in ("sigma * 5", "sigma / 5")}
)
