"""Estimates against dense linear algebra: flat posteriors, Gauss–Newton, and the true minimiser."""

import numpy as np
import pytest
import sensors
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

import symspline as ss
from symspline import measure

KNOTS = np.array([0, 0.4, 1.1, 1.5, 2.6, 3.0, 4.1, 5.0])
ENDS = {"acceleration": "natural", "jerk": "not-a-knot"}


def basis(x, nu, penalty):
    """Values at times x of the splines that are one at one knot and zero at the others."""
    return CubicSpline(KNOTS, np.eye(len(KNOTS)), bc_type=ENDS[penalty])(x, nu)


def stiffness(penalty):
    """The energy as a quadratic form of the values at the knots, by Gauss points."""
    h, root = np.diff(KNOTS), 0.5 / np.sqrt(3)
    x = (KNOTS[:-1, None] + h[:, None] * [0.5 - root, 0.5 + root]).ravel()
    rows = basis(x, 2 if penalty == "acceleration" else 3, penalty)
    return (rows * np.repeat(h / 2, 2)[:, None]).T @ rows


@pytest.mark.parametrize("penalty", ["acceleration", "jerk"])
def test_flat_posterior(penalty):
    rng = np.random.default_rng(0)
    t, s, f = (sensors.times(rng, 0, 5, n) for n in (9, 7, 6))
    y, v, z = (0.3 * rng.standard_normal(shape) for shape in [(9, 2), (7, 2), 6])
    sigma = rng.uniform(0.1, 0.3, 9)
    bias = measure.Constant(1, start=0.3, sigma=2.0)
    # The acceleration along one axis with an unknown bias.
    axis = np.array([0.6, 0.8])
    sensor = measure.Function(f, lambda x, d, a, p: a @ axis + p["b"] - z, nu=2, sigma=0.5, parameters={"b": bias})
    given = [measure.Points(t, y, sigma=sigma), measure.Velocities(s, np.zeros((7, 2)), v, sigma=0.2), sensor]
    lam = 0.07
    curve = ss.estimate(given, KNOTS, "r:2", lam=lam, penalty=penalty, tol=1e-10)
    rows = [np.kron(basis(t, 0, penalty) / sigma[:, None], np.eye(2)), np.kron(basis(s, 1, penalty) / 0.2, np.eye(2))]
    rows.append(np.kron(basis(f, 2, penalty), axis[None]) / 0.5)
    whole = np.zeros((18 + 14 + 6 + 1, 17))
    whole[:38, :16] = np.concatenate(rows)
    whole[32:38, 16], whole[38, 16] = 1 / 0.5, 1 / 2.0
    right = np.concatenate([(y / sigma[:, None]).ravel(), v.ravel() / 0.2, z / 0.5, [0.3 / 2.0]])
    matrix = whole.T @ whole
    matrix[:16, :16] += lam * np.kron(stiffness(penalty), np.eye(2))
    mean, cov = np.linalg.solve(matrix, whole.T @ right), np.linalg.inv(matrix)
    assert np.abs(curve.points - mean[:16].reshape(8, 2)).max() < 1e-9
    found = curve.parameters["b"]
    assert abs(found.value[0] - mean[16]) < 1e-9 and abs(found.cov[0, 0] - cov[16, 16]) < 1e-9
    for x, y in [(0.9, 4.4), (2.6, 2.7), (0.0, 5.0)]:
        a, b, d = (np.kron(basis(at, nu, penalty), np.eye(2)) for at, nu in [(x, 0), (y, 0), (x, 1)])
        part = cov[:16, :16]
        assert np.abs(curve.cov(x) - a @ part @ a.T).max() < 1e-9
        assert np.abs(curve.cov(x, y) - a @ part @ b.T).max() < 1e-9
        assert np.abs(curve.cov(x, nu=1) - d @ part @ d.T).max() < 1e-9
        joint = np.concatenate([a, d])
        assert np.abs(curve.cov(x, nu="joint") - joint @ part @ joint.T).max() < 1e-9
    # The prior is a measurement of the bias.
    left = whole @ mean - right
    assert curve.report.sigma == pytest.approx(np.sqrt(left @ left / (39 - np.trace(cov @ whole.T @ whole))), rel=1e-9)
    whole[38] = 0
    freedom = np.diag(cov @ whole.T @ whole)
    assert abs(freedom[:16].sum() / 2 - curve.df) < 1e-9


@pytest.mark.parametrize("prior", [None, 0.5])
def test_the_chosen_lam_has_the_least_restricted_likelihood(prior):
    rng = np.random.default_rng(3)
    t, s = (sensors.times(rng, 0, 5, n) for n in (14, 9))
    y, z = np.sin(2 * t) + 0.1 * rng.standard_normal(14), np.sin(2 * s) + 0.4 + 0.1 * rng.standard_normal(9)
    bias = measure.Constant(1, sigma=prior)
    sensor = measure.Function(s, lambda x, p: x + p["b"] - z[:, None], sigma=0.1, parameters={"b": bias})
    curve = ss.estimate([measure.Points(t, y[:, None], sigma=0.1), sensor], KNOTS, "r:1", tol=1e-10)
    rows = np.zeros((24, 9))
    rows[:23, :8] = basis(np.append(t, s), 0, "acceleration") / 0.1
    rows[14:23, 8], rows[23, 8] = 1 / 0.1, 0 if prior is None else 1 / prior
    right = np.concatenate([y, z, [0]]) / 0.1
    energy = np.zeros((9, 9))
    energy[:8, :8] = stiffness("acceleration")

    def score(lam):
        matrix = rows.T @ rows + lam * energy
        x = np.linalg.solve(matrix, rows.T @ right)
        squares = ((rows @ x - right) ** 2).sum() + lam * x @ energy @ x
        count = 23 if prior is None else 24
        return (count - 3) * np.log(squares) + np.linalg.slogdet(matrix)[1] - 6 * np.log(lam)

    near = curve.report.lam * np.exp(np.linspace(-0.2, 0.2, 41))
    assert abs(int(np.argmin([score(lam) for lam in near])) - 20) <= 1


def test_a_time_offset_has_the_variance_of_least_squares():
    """A straight line a + b t, seen by a second sensor that is late: its rows have the derivative b of the offset."""
    rng = np.random.default_rng(1)
    t, s = sensors.times(rng, 2, 5, 30), sensors.times(rng, 2.3, 4.7, 20)
    y, z = (0.3 + 2 * x + noise * rng.standard_normal(len(x)) for x, noise in ((t, 0.01), (s + 0.05, 0.02)))
    late = measure.Constant(1, name="late")
    given = [measure.Points(t, y[:, None], sigma=0.01), measure.Points(s, z[:, None], sigma=0.02, time_offset=late)]
    line = ss.estimate(given, [2, 5], "r:1", lam=0.0, tol=1e-10)
    slope, offset = line(3.0, 1)[0], line.parameters["late"]
    rows = [np.stack([1 + 0 * t, t, 0 * t], 1) / 0.01, np.stack([1 + 0 * s, s + offset.value, slope + 0 * s], 1) / 0.02]
    rows = np.concatenate(rows)
    assert offset.cov[0, 0] == pytest.approx(np.linalg.inv(rows.T @ rows)[2, 2], rel=1e-6)
    left = np.concatenate([(line(t)[:, 0] - y) / 0.01, (line(s + offset.value)[:, 0] - z) / 0.02])
    assert line.report.sigma == pytest.approx(np.sqrt(left @ left / (50 - 3)), rel=1e-6)


def test_weights_of_points_are_inverse_variances():
    rng = np.random.default_rng(2)
    t, w = sensors.times(rng, 0, 5, 40), rng.uniform(0.1, 9, 40)
    y = 0.3 / np.sqrt(w)[:, None] * rng.standard_normal((40, 2))
    v = measure.Velocities([1.0, 4.0], np.zeros((2, 2)), np.zeros((2, 2)), sigma=0.2)
    by_weights, by_sigma = (
        ss.estimate([measure.Points(t, y, **noise), v], KNOTS, "r:2", lam=0.07)
        for noise in ({"sigma": 0.3, "weights": w}, {"sigma": 0.3 / np.sqrt(w)})
    )
    assert np.abs(by_weights.points - by_sigma.points).max() < 1e-10
    assert by_weights.report.sigma == pytest.approx(by_sigma.report.sigma, rel=1e-9)


def fused(rng, n=12):
    truth = sensors.turning(5, rng, rate=0.3)
    t, s = sensors.times(rng, 0, 5, n), sensors.times(rng, 0, 5, 3 * n)
    seen = sensors.SO3.exp(truth(t), 0.05 * sensors.SO3.random_tangent(rng, truth(t)))
    omega = ss.rotations.angular_velocity(truth, s) + [0.1, -0.2, 0.05] + 0.05 * rng.standard_normal((3 * n, 3))
    return truth, [
        measure.Points(t, seen, sigma=0.05),
        measure.BodyRates(s, omega, sigma=0.05, bias=measure.Constant(3)),
    ]


@pytest.mark.parametrize("penalty", ["acceleration", "jerk"])
def test_dense_gauss_newton(penalty):
    """At the estimate, the step of the same linearisation vanishes, with all formulas and matrices in NumPy."""
    _, given = fused(np.random.default_rng(1))
    lam = 0.3
    curve = ss.estimate(given, KNOTS, "so:3", lam=lam, penalty=penalty, tol=1e-11)
    step, cov = dense_step(curve, given, lam, penalty)
    assert np.abs(step).max() < 1e-8
    # The core measures the energy in the moving frame, which changes the matrix slightly.
    bias = curve.parameters["gyro bias"]
    assert np.abs(cov[-3:, -3:] / bias.std / bias.std[:, None] - np.eye(3)).max() < 0.1
    deviation = np.sqrt(np.diag(cov)[:-3].reshape(-1, 3).sum(axis=1))
    assert np.abs(deviation / np.sqrt(np.trace(curve.cov(KNOTS), axis1=1, axis2=2)) - 1).max() < 0.02


def in_frames(curve, t, nu):
    """A derivative of the curve in coordinates of the frames along it."""
    return np.einsum("kij,klij->kl", curve(t, nu), curve.frames(t)) / 2


def turned(curve, t, vectors):
    """Rotation vectors of tangent vectors in the frame of the body, one column per vector."""
    hat = np.swapaxes(curve(t), -1, -2)[:, None] @ vectors
    return np.stack([hat[..., 2, 1], hat[..., 0, 2], hat[..., 1, 0]], axis=1)


def dense_step(curve, given, lam, penalty):
    """The step of all points and of the bias, and their covariance, from dense matrices."""
    n, m = len(KNOTS), 3
    points, rates = given
    bias, unit = curve.parameters["gyro bias"].value, np.eye(m)
    off = np.einsum("kij,klij->kl", sensors.SO3.log(curve(points.t), points.y), curve.frames(points.t)) / 2
    omega = turned(curve, rates.t, curve(rates.t, 1)[:, None])[..., 0]
    moves = turned(curve, rates.t, curve.frames(rates.t))
    half = 0.5 * np.cross(omega[:, :, None], moves, axis=1)

    def columns(t, jacobian, nu):
        return np.einsum("tdc,tk->tdkc", jacobian, basis(t, nu, penalty)).reshape(len(t), -1, n * m)

    of_points = columns(points.t, np.broadcast_to(unit, (len(off), m, m)), 0) / 0.05
    of_rates = (columns(rates.t, half, 0) + columns(rates.t, moves, 1)) / 0.05
    whole = np.zeros((of_points.shape[0] * m + of_rates.shape[0] * m, n * m + 3))
    whole[:, : n * m] = np.concatenate([own.reshape(-1, n * m) for own in (of_points, of_rates)])
    whole[of_points.shape[0] * m :, n * m :] = np.tile(unit / 0.05, (of_rates.shape[0], 1))
    right = np.concatenate([off.ravel(), (rates.omega - omega - bias).ravel()]) / 0.05
    # Jacobi's operator: ξ'' + R(ξ, u)u, with R(ξ, u)u = -[u, [u, ξ]] and [x, [y, z]] = x × (y × z) / 4 on SO(3). The
    # jerk changes by R(ξ, u)a = [a, [ξ, u]], too, half of which belongs to either end of a segment.
    u, a, h = in_frames(curve, KNOTS, 1), in_frames(curve, KNOTS, 2), np.diff(KNOTS)
    bend = np.cross(u[:, None], np.cross(unit, u[:, None])).swapaxes(1, 2) / 4
    twist = np.cross(a[:, None], np.cross(unit, u[:, None])).swapaxes(1, 2) / 4
    flat = np.kron(basis(KNOTS, 2, penalty), unit).reshape(n, m, n * m)
    values = np.eye(n * m).reshape(n, m, n * m)
    first, last = bend[:-1], bend[1:]
    if penalty == "jerk":
        first, last = first - h[:, None, None] / 2 * twist[:-1], last + h[:, None, None] / 2 * twist[1:]
    else:
        first, last = first.copy(), last.copy()
        first[0] = last[-1] = 0
    left, right_end = flat[:-1] + first @ values[:-1], flat[1:] + last @ values[1:]
    if penalty == "jerk":
        rows = (right_end - left) / np.sqrt(h)[:, None, None]
        known = np.diff(a, axis=0) / np.sqrt(h)[:, None]
    else:
        # Two Gauss points integrate products of linear functions exactly.
        share, root = np.array([0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3)]), np.sqrt(h / 2)[:, None, None]
        rows = np.concatenate([root * ((1 - x) * left + x * right_end) for x in share])
        known = np.concatenate([root[..., 0] * ((1 - x) * a[:-1] + x * a[1:]) for x in share])
    rows = rows.reshape(-1, n * m)
    gradient = rows.T @ known.ravel()
    matrix = whole.T @ whole
    matrix[: n * m, : n * m] += lam * rows.T @ rows
    vector = whole.T @ right
    vector[: n * m] -= lam * gradient
    return np.linalg.solve(matrix, vector), np.linalg.inv(matrix)


@pytest.mark.parametrize("penalty", ["acceleration", "jerk"])
def test_near_the_true_minimiser(penalty):
    """The estimate solves an equation whose solution differs from the minimiser by a small part of its deviation."""
    rng = np.random.default_rng(2)
    _, given = fused(rng, 20)
    lam = 0.3
    curve = ss.estimate(given, KNOTS, "so:3", lam=lam, penalty=penalty, tol=1e-9)
    frames = curve.frames(KNOTS)
    pts, rates = given

    def residuals(x):
        v = np.einsum("kj,kj...->k...", x[:-3].reshape(-1, 3), frames)
        moved = ss.CubicSpline(KNOTS, sensors.SO3.exp(curve.points, v), "so:3", bc_type=ENDS[penalty])
        a = sensors.SO3.log(moved(pts.t), pts.y)
        b = ss.rotations.angular_velocity(moved, rates.t) + curve.parameters["gyro bias"].value + x[-3:] - rates.omega
        root, h = 0.5 / np.sqrt(3), np.diff(KNOTS)
        at = (KNOTS[:-1, None] + h[:, None] * [0.5 - root, 0.5 + root]).ravel()
        if penalty == "acceleration":
            bend = moved(at, 2) * np.sqrt(lam * np.repeat(h / 2, 2) / 2)[:, None, None]
        else:
            e = 1e-4 * h
            ends = [np.stack([KNOTS[:-1] + e, KNOTS[1:] - e])]
            parts = [moved.transport(float(y), float(x), moved(y, 2)) for x, y in ends[0].T]
            jerk = np.array(parts) - moved(KNOTS[:-1] + e, 2)
            bend = jerk / (h - 2 * e)[:, None, None] * np.sqrt(lam * h / 2)[:, None, None]
        return np.concatenate([a.ravel() / 0.05 / np.sqrt(2), b.ravel() / 0.05, bend.ravel()])

    best = least_squares(residuals, np.zeros(len(KNOTS) * 3 + 3), xtol=1e-12, ftol=1e-14)
    deviation = np.sqrt(np.trace(curve.cov(KNOTS), axis1=-2, axis2=-1))
    off = np.linalg.norm(best.x[:-3].reshape(-1, 3), axis=1) / deviation
    assert off.max() < (0.02 if penalty == "acceleration" else 0.05), off
    assert np.all(np.abs(best.x[-3:]) < 0.02 * curve.parameters["gyro bias"].std)
