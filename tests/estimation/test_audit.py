"""The objective of points alone, standardised residuals, and the audit of the residuals of every sensor."""

import warnings
from itertools import pairwise

import numpy as np
import pytest
import sensors
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline import measure

SO3 = sensors.SO3


# ---- one objective ----


def dense(t, y, weights, knots, lam):
    """Values at the knots that minimise Σ eᵀWe + λ ∫ |x''|², by dense linear algebra, and the degrees of freedom."""
    m = y.shape[1]
    basis = CubicSpline(knots, np.eye(len(knots)), bc_type="natural")
    energy = np.zeros((len(knots), len(knots)))
    for a, b in pairwise(knots):
        x = 0.5 * (a + b) + 0.5 * (b - a) * np.array([-1, 1]) / np.sqrt(3)
        energy += 0.5 * (b - a) * basis(x, 2).T @ basis(x, 2)
    b = basis(t)
    data = np.einsum("nk,nij,nl->kilj", b, weights, b).reshape(len(knots) * m, -1)
    right = np.einsum("nk,nij,nj->ki", b, weights, y).ravel()
    whole = data + lam * np.kron(energy, np.eye(m))
    return np.linalg.solve(whole, right).reshape(-1, m), np.trace(np.linalg.solve(whole, data)) / m


@pytest.mark.parametrize("kind", ["number", "array", "weights", "matrices", "matrices and sigma"])
def test_points_alone_have_the_documented_objective(kind):
    rng = np.random.default_rng(0)
    t = 1e4 + rng.uniform(0, 10, 40)
    y = np.stack([np.sin(t), np.cos(t)], -1) + 0.05 * rng.standard_normal((40, 2))
    knots, lam = np.linspace(1e4, 1e4 + 10, 9), 1.0
    root = rng.standard_normal((40, 2, 2)) * 10
    matrices = np.swapaxes(root, 1, 2) @ root + 50 * np.eye(2)
    sigmas, weights = rng.uniform(0.02, 0.2, 40), rng.uniform(0, 2, 40)
    weights[3] = 0
    given, expected = {
        "number": ({"sigma": 0.05}, np.full(40, 400.0)),
        "array": ({"sigma": sigmas}, sigmas**-2),
        "weights": ({"sigma": sigmas, "weights": weights}, weights / sigmas**2),
        "matrices": ({"sigma": 1.0, "weights": matrices}, matrices),
        "matrices and sigma": ({"sigma": 0.5, "weights": matrices}, 4 * matrices),
    }[kind]
    whole = expected if expected.ndim == 3 else expected[:, None, None] * np.eye(2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SmoothingWarning)
        curve = ss.estimate([measure.Points(t, y, **given)], knots, "r:2", lam=lam)
        # A second measurement without information leads through the estimation of any kinds of measurements.
        nothing = measure.Function([knots[0]], lambda x: 0 * x[:, 0], sigma=1e9)
        other = ss.estimate([measure.Points(t, y, **given), nothing], knots, "r:2", lam=lam)
    right, df = dense(t - 1e4, y, whole, knots - 1e4, lam)
    for found in (curve, other):
        assert np.abs(found(knots) - right).max() < 1e-7
        # Numbers are summed over all coordinates, matrices couple them.
        assert abs(found.df - df) < 1e-6
    off = CubicSpline(knots - 1e4, right, bc_type="natural")(t - 1e4) - y
    squares = np.einsum("ni,nij,nj->n", off, whole, off)
    used = squares > 0
    for found in (curve, other):
        assert np.allclose(np.sum(found.residuals[0] ** 2, axis=1), squares[used], rtol=1e-5, atol=1e-8)
    left = 2 * np.sum(used) - 2 * df
    assert abs(curve.report.sigma - np.sqrt(squares.sum() / left)) < 1e-6 * curve.report.sigma


def test_residuals_are_standardised_for_every_space_and_loss():
    rng = np.random.default_rng(1)
    t = sensors.times(rng, 100, 110, 200)
    order = rng.permutation(200)
    turn, path = sensors.turning(10, rng), sensors.moving(10, rng)
    r = SO3.exp(turn(t - 100), 0.02 * SO3.random_tangent(rng, turn(t - 100)))
    x = path(t - 100) + 0.5 * rng.standard_normal((200, 3))
    poses = np.zeros((200, 4, 4))
    poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = r, x, 1
    for space, y in (("so:3 x r:3", (r[order], x[order])), ("se:3", poses[order])):
        for loss in ("linear", "huber", "cauchy"):
            points = measure.Points(t[order], y, sigma=(0.02, np.full(200, 0.5)))
            curve = ss.estimate([points], "auto", space, loss=loss)
            assert all(abs(own.sigma - 1) < 0.15 for own in curve.report), (space, loss)
            turned, moved = curve.residuals[0]
            assert turned.shape == moved.shape == (200, 3)
            at = curve(t[order])
            position = at[1] if isinstance(at, tuple) else at[:, :3, 3]
            assert np.allclose(np.abs(moved), np.abs(position - x[order]) / 0.5, atol=1e-9)
    unknown = ss.estimate([measure.Points(t[order], x[order])], "auto", "r:3")
    assert 0.9 < sensors.rms(unknown.residuals[0]) < 1.0 and abs(unknown.sigma - 0.5) < 0.05


def test_files_of_points(tmp_path):
    t = np.linspace(0, 5, 60)
    y = np.sin(t)[:, None] + 0.1 * np.random.default_rng(0).standard_normal((60, 1))
    curve = ss.estimate([measure.Points(t, y, sigma=0.1)], "auto", "r:1")
    curve.save(tmp_path / "curve.npz")
    found = ss.load(tmp_path / "curve.npz")
    assert type(found) is type(curve) and np.array_equal(found(2.2), curve(2.2)) and found.residuals == ()


# ---- the audit ----


def knots(truth):
    return 50 + np.linspace(*truth.domain, 41)


def recording(seed, n=45, m=301):
    """A rotation, and measured attitudes in any order and rates, which begin at t = 50."""
    rng = np.random.default_rng(seed)
    truth = sensors.turning(10, rng)
    t, s = rng.uniform(0, 10, n), np.linspace(0, 10, m)
    seen = SO3.exp(truth(t), 0.03 * SO3.random_tangent(rng, truth(t)))
    omega = ss.rotations.angular_velocity(truth, s) + [0.03, -0.02, 0.05] + 0.02 * rng.standard_normal((m, 3))
    prior = measure.Constant(3, sigma=0.1)
    return truth, [
        measure.Points(50 + t, seen, sigma=0.03),
        measure.BodyRates(50 + s, omega, sigma=0.02, bias=prior),
    ]


def spoil(points, rates, fault):
    """Return a recording with a fault."""
    if fault == "rotated frame":
        points.y = points.y @ Rotation.from_euler("z", 30, degrees=True).as_matrix()
    if fault == "swapped axes":
        rates.omega = rates.omega[:, [1, 0, 2]] * [1, 1, -1]
    if fault == "jump":
        turned = points.y @ Rotation.from_euler("x", 20, degrees=True).as_matrix()
        points.y = np.where((np.asarray(points.t) > 55)[:, None, None], turned, points.y)
    if fault == "milliseconds":
        rates.t = 52 + (rates.t - 50) / 1000
    if fault == "outliers":
        points.y = np.array(points.y)
        points.y[[7, 21]] = points.y[[7, 21]] @ Rotation.from_euler("y", 1.5).as_matrix()
    if fault == "late":
        points.t = np.clip(points.t - 0.3, 50, 60)
    if fault == "prior":
        rates.bias = measure.Constant(3, sigma=0.002)
    points.sigma *= {"sigma * 5": 5.0, "sigma / 5": 0.2, "sigma in degrees": np.degrees(1)}.get(fault, 1.0)


FAULTS = {
    "rotated frame": r"measurements\[0\] \(Points\): the residuals are .*correlation.*Check the frame",
    "swapped axes": r"measurements\[1\] \(BodyRates\)",
    "jump": r"measurements\[0\] \(Points\): .*the mean of the residuals changes at index \d+",
    "milliseconds": r"The times of measurements\[1\] span 0\.01, .*check the unit of the times",
    "outliers": r"measurements\[0\] \(Points\).* the largest of 2 outliers, at index (7|21), .*pass loss='cauchy'",
    "late": r"measurements\[0\] \(Points\): .*Check the frame .* the times of measurements\[0\]",
    "prior": r"The constant 'gyro bias' is .* standard deviations from its prior",
    "sigma * 5": r"measurements\[0\] \(Points\): the residuals are 0\.\d+ times .*Multiply sigma",
    "sigma / 5": r"measurements\[0\] \(Points\): the residuals are [45]\.?\d* times .*Multiply sigma",
    "sigma in degrees": r"measurements\[0\] \(Points\): the residuals are 0\.0\d* times",
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_found_and_named(fault):
    truth, given = recording(3)
    spoil(*given, fault)
    with pytest.warns(ss.SmoothingWarning, match=FAULTS[fault]) as caught:
        ss.estimate(given, knots(truth), "so:3", penalty="jerk")
    assert len([own for own in caught if "do not agree" in str(own.message)]) == 1


@pytest.mark.slow
def test_degrees_for_radians_are_named():
    truth, (points, rates) = recording(4)
    rates.omega = np.degrees(rates.omega)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            ss.estimate([points, rates], knots(truth), "so:3", penalty="jerk")
            said = str(caught[0].message)
        except ss.ConvergenceError as error:
            said = str(error)
    assert "pass radians instead of degrees" in said


@pytest.mark.parametrize("loss", ["linear", "huber", "cauchy"])
@pytest.mark.parametrize("penalty", ["acceleration", "jerk"])
def test_sound_recordings_of_estimates_do_not_warn(loss, penalty):
    # Warnings are errors in tests.
    for seed in range(10, 14):
        truth, given = recording(seed)
        ss.estimate(given, knots(truth), "so:3", penalty=penalty, loss=loss)


def test_a_bad_sensor_is_not_hidden_behind_a_numerous_one():
    rng = np.random.default_rng(5)
    t, s = rng.uniform(0, 20, 400), rng.uniform(0, 20, 25)
    path = np.stack([np.sin(t), np.cos(t)], -1) + 0.1 * rng.standard_normal((400, 2))
    few = np.stack([np.sin(s), np.cos(s)], -1) + 0.5 * rng.standard_normal((25, 2))
    given = [measure.Points(t, path, sigma=0.1), measure.Points(s, few, sigma=0.05)]
    with pytest.warns(ss.SmoothingWarning, match=r"measurements\[1\] \(Points\): the residuals are [67]\S* times"):
        ss.estimate(given, np.linspace(0, 20, 30), "r:2", lam=0.1)


@pytest.mark.parametrize("factor", [0.05, 5.0])
def test_points_alone_warn_of_sigma(factor):
    rng = np.random.default_rng(6)
    t = np.sort(rng.uniform(0, 20, 300))
    y = np.sin(t)[:, None] + 0.1 * rng.standard_normal((300, 1))
    for sigma in (0.1 * factor, np.full(300, 0.1 * factor)):
        with pytest.warns(ss.SmoothingWarning, match=r"Multiply sigma of the data by (20|0\.2\d?) "):
            curve = ss.estimate([measure.Points(t, y, sigma=sigma)], 80, "r:1")
        assert abs(curve.report.sigma * factor - 1) < 0.1


def test_directions_without_noise_along_them_and_singular_matrices_are_sound():
    rng = np.random.default_rng(7)
    truth = sensors.turning(10, rng)
    t = sensors.times(rng, 0, 10, 120)
    stars = np.array([[1.0, 0, 0], [0, 0.6, 0.8]])
    seen = np.einsum("ki,nij->nkj", stars, truth(t)) + 0.01 * rng.standard_normal((120, 2, 3))
    seen /= np.linalg.norm(seen, axis=-1, keepdims=True)
    ss.estimate([measure.Directions(t, seen, stars, sigma=0.01)], np.linspace(0, 10, 41), "so:3")
    path = sensors.moving(10, rng)
    flat = np.broadcast_to(np.diag([100.0, 100.0, 0.0]), (120, 3, 3))
    known = path(t) + rng.standard_normal((120, 3)) * [0.1, 0.1, 50]
    given = [
        measure.Points(t, known, weights=flat),
        measure.Points(t, path(t) + rng.standard_normal((120, 3)), sigma=1),
    ]
    ss.estimate(given, np.linspace(0, 10, 31), "r:3")
