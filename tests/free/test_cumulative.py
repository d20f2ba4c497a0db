"""`CumulativeBSpline` as a curve: its definition, smoothness, derivatives, batches, products, files and errors."""

import itertools
import pickle
import warnings

import numpy as np
import pytest
from cases import walk
from curves import clamped
from refused import raises
from scipy.interpolate import BSpline
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation
from stored import restored

import symspline as ss

SEED = 1995
GROUPS = [
    "so:2", "so:3", "so:4", "so:5", "o:3", "u:1", "u:2", "u:3", "su:2", "su:3", "se:2", "se:3", "gl:2", "gl:3", "cgl:2",
    "aff:2", "sim:3", "sl:2", "sl:3", "sp:2", "lorentz:3",
]  # fmt: skip
# Irregular, with one interval a tenth of its neighbours.
KNOTS = np.array([-1.0, -0.4, -0.1, 0.0, 0.9, 1.0, 2.3, 2.9, 3.3, 4.5, 5.0])


def control(space, count, rng, batch=()):
    space = ss.space(space)
    points = np.array([walk(space, 0.4, count, rng) for _ in range(int(np.prod(batch)))])
    return points.reshape(*batch, count, *space.point_shape)


def reference(knots, points, degree, x):
    """Point, velocity and acceleration by the definition and the recursion of Sommer et al. (2020), (18) and (26)."""
    i = min(np.searchsorted(knots, x, "right") - 1, len(points) - 1)
    p, n = points[i - degree : i + 1], points.shape[-1]
    tail = [
        BSpline(knots, np.arange(len(points)) >= i - degree + j, degree, extrapolate=True) for j in range(degree + 1)
    ]
    gamma, rate, change = p[0], np.zeros((n, n)), np.zeros((n, n))
    for j in range(1, degree + 1):
        omega = logm(np.linalg.solve(p[j - 1], p[j]))
        lam, d, dd = (float(tail[j](x, nu)) if nu <= degree else 0.0 for nu in range(3))
        a = expm(lam * omega)
        back = np.linalg.inv(a)
        rate = back @ rate @ a + d * omega
        change = d * (rate @ omega - omega @ rate) + back @ change @ a + dd * omega
        gamma = gamma @ a
    return gamma, gamma @ rate, gamma @ change


@pytest.mark.parametrize(("name", "degree"), list(zip(GROUPS, itertools.cycle([3, 1, 2, 3, 5]), strict=False)))
def test_the_definition_and_the_recursion_of_derivatives(name, degree, rng):
    knots = clamped([0.4, 1.3, 1.4], degree) if degree != 3 else KNOTS
    points = control(name, len(knots) - degree - 1, rng)
    curve = ss.CumulativeBSpline(knots, points, name, degree=degree)
    scale = 1 + np.abs(points).max() ** 2
    for x in rng.uniform(*curve.domain, 12):
        for nu, wanted in enumerate(reference(knots, points, degree, x)):
            assert np.abs(curve(x, nu) - wanted).max() < 1e-12 * scale * (1 + np.abs(wanted).max()), (nu, x)


@pytest.mark.parametrize("name", [*GROUPS, "r:3"])
def test_degree_three_is_twice_continuously_differentiable(name, rng):
    points = control(name, len(KNOTS) - 4, rng)
    curve = ss.CumulativeBSpline(KNOTS, points, name)
    inner = curve.t[1:-1]
    for nu in range(3):
        after, before = curve(inner, nu), curve(np.nextafter(inner, -9), nu)
        assert np.abs(after - before).max() <= 1e-12 * np.abs(after).max()
    # The next derivative jumps.
    h = 1e-6
    jerk = [(curve(inner + e * h, 2) - curve(inner, 2)) / (e * h) for e in (1, -1)]
    assert np.abs(jerk[0] - jerk[1]).max() > 0.01


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_vectors_of_cumulative_splines_are_those_of_scipy(degree, rng):
    for knots in (clamped([0.4, 0.5, 2.0], degree), clamped([0.7, 0.7, 1.9], degree), np.arange(12.0) ** 1.3):
        points = rng.normal(size=(len(knots) - degree - 1, 2))
        curve, wanted = ss.CumulativeBSpline(knots, points, "r:2", degree=degree), BSpline(knots, points, degree)
        x = np.append(rng.uniform(*curve.domain, 40), curve.domain[0])
        for nu in range(min(degree, 2) + 1):
            values = wanted(x, nu)
            assert np.abs(curve(x, nu) - values).max() < 1e-14 * 8**nu * (1 + np.abs(values).max()) * degree**2


def test_rotations_are_those_of_the_definition_by_scipy(rng):
    """Equidistant knots: the closed form of λ of Kim, Kim & Shin (1995), and rotation vectors of SciPy."""
    points = control("so:3", 9, rng)
    curve = ss.CumulativeBSpline(None, points, "so:3")
    assert curve.domain == (0.0, 6.0)
    for x in rng.uniform(0, 6, 30):
        i, u = int(x), x % 1
        lam = [(5 + 3 * u - 3 * u**2 + u**3) / 6, (1 + 3 * u + 3 * u**2 - 2 * u**3) / 6, u**3 / 6]
        p = Rotation.from_matrix(points[i : i + 4])
        wanted = p[0]
        for j in range(3):
            wanted *= Rotation.from_rotvec(lam[j] * (p[j].inv() * p[j + 1]).as_rotvec())
        assert np.abs(curve(x) - wanted.as_matrix()).max() < 4e-15


def test_a_control_point_acts_on_four_intervals_and_translations_from_the_left_move_the_curve(rng):
    points = control("se:3", 12, rng)
    curve = ss.CumulativeBSpline(None, points, "se:3")
    x = np.linspace(*curve.domain, 400)
    changed = points.copy()
    changed[5] = ss.space("se:3").random_point(rng)
    moved = np.abs(ss.CumulativeBSpline(None, changed, "se:3")(x) - curve(x)).max(axis=(1, 2))
    assert np.all(moved[(x <= 2) | (x >= 6)] < 1e-13) and moved[(x > 2.2) & (x < 5.8)].min() > 1e-6
    g = ss.space("se:3").random_point(rng)
    assert np.abs(ss.CumulativeBSpline(None, g @ points, "se:3")(x) - g @ curve(x)).max() < 1e-13


@pytest.mark.parametrize("name", ["so:3", "u:2", "r:2", "so:3 x r:3"])
def test_batches_are_bit_identical_to_single_curves(name, rng):
    factors = name.split(" x ")
    arrays = tuple(control(factor, 8, rng, (2, 3)) for factor in factors)
    curve = ss.CumulativeBSpline(None, arrays if len(arrays) > 1 else arrays[0], name)
    assert len(curve) == 2 and curve[1][2].domain == (0.0, 5.0)
    for x in (0.7, np.zeros((0, 2)), np.linspace(0, 5, 40).reshape(4, 10)):
        for nu in range(3):
            values = curve(x, nu)
            for k, array in enumerate(arrays):
                own = values[k] if len(arrays) > 1 else values
                assert own.shape == (2, 3, *np.shape(x), *array.shape[3:])
                alone = ss.CumulativeBSpline(None, array[1, 2], factors[k])
                assert np.array_equal(own[1, 2], alone(x, nu))
        assert curve.speed(x).shape == (2, 3, *np.shape(x))
    assert np.allclose(curve.length()[1, 2], curve[1][2].length(), rtol=1e-14)
    s = curve.length() / 2
    assert np.allclose(curve.arc_length(curve.at_length(s, per_curve=True), per_curve=True), s)


def test_a_product_is_its_factors(rng):
    turns, path = control("so:3", 9, rng), 10 * rng.normal(size=(9, 3))
    both = ss.CumulativeBSpline(None, (turns, path), "so:3 x r:3")
    parts = ss.CumulativeBSpline(None, turns, "so:3"), ss.CumulativeBSpline(None, path, "r:3")
    x = np.linspace(0, 6, 50)
    for nu in range(3):
        assert all(np.array_equal(a, b(x, nu)) for a, b in zip(both(x, nu), parts, strict=True))
    assert np.allclose(both.speed(x), np.hypot(*(part.speed(x) for part in parts)), rtol=1e-15)
    assert np.isclose(both.bending_energy(), sum(part.bending_energy() for part in parts), rtol=1e-13)


def test_rates_and_inertial_measurements(rng):
    poses = control("se:3", 9, rng)
    curve, x = ss.CumulativeBSpline(None, poses, "se:3"), np.linspace(0, 6, 41)
    body = np.linalg.solve(curve(x), curve(x, 1))
    turning = np.stack([body[:, 2, 1], body[:, 0, 2], body[:, 1, 0]], axis=1)
    assert np.abs(ss.rotations.angular_velocity(curve, x) - turning).max() < 1e-13
    twist = ss.poses.twist(curve, x)
    assert np.abs(twist - np.concatenate([turning, body[:, :3, 3]], axis=1)).max() < 1e-13
    product = ss.CumulativeBSpline(None, ss.poses.split(poses), "so:3 x r:3")
    assert np.abs(ss.rotations.angular_velocity(product, x) - turning).max() < 1e-13
    gyro, force = ss.poses.imu(product, x, gravity=[0, 0, -9.81])
    rotations, _ = product(x)
    wanted = np.swapaxes(rotations, 1, 2) @ (product(x, 2)[1] + [0, 0, 9.81])[..., None]
    assert np.abs(force - wanted[..., 0]).max() < 1e-12 and np.abs(gyro - turning).max() < 1e-13
    # On se:3 the position is not a B-spline; its second derivative by differences.
    h = 1e-4
    second = (curve(x[1:-1] + h) - 2 * curve(x[1:-1]) + curve(x[1:-1] - h))[:, :3, 3] / h**2
    _, force = ss.poses.imu(curve, x[1:-1], gravity=[0, 0, 0])
    wanted = np.swapaxes(curve(x[1:-1])[:, :3, :3], 1, 2) @ second[..., None]
    assert np.abs(force - wanted[..., 0]).max() < 1e-5
    assert np.isnan(ss.rotations.angular_velocity(curve, [-1.0, 1.0], extrapolate=False)).any(axis=1).tolist() == [1, 0]
    raises("extrapolate must be None", ss.rotations.angular_velocity, curve, 1.0, extrapolate="periodic")
    for own in (curve, curve.reverse()):
        raises("CubicSpline", ss.rotations.quaternion, own, 1.0, scalar_first=True, error=TypeError)
    assert np.abs(ss.rotations.angular_velocity(curve.reverse(), x) + turning[::-1]).max() < 1e-13
    raises("x.* is outside", ss.rotations.angular_velocity, curve, -1.0)


@pytest.mark.parametrize("name", ["so:3", "u:2", "so:3 x r:3", "su:2"])
def test_files_and_pickles_of_cumulative_splines(name, rng):
    factors = name.split(" x ")
    arrays = tuple(control(factor, 8, rng) for factor in factors)
    curve = ss.CumulativeBSpline(None, arrays if len(arrays) > 1 else arrays[0], name)
    for again in (restored(curve), pickle.loads(pickle.dumps(curve))):
        assert again == curve and type(again) is ss.CumulativeBSpline and again.report is None
        values = again(1.3), curve(1.3)
        assert all(np.array_equal(*pair) for pair in zip(*values, strict=True))
    assert curve != ss.CumulativeBSpline(None, curve.control_points, name, degree=2)
    if len(arrays) == 1:
        assert curve != ss.BSpline(curve.knots, arrays[0], 3, name)


def test_invalid_input_of_cumulative_splines_raises(rng):
    points = control("so:3", 5, rng)
    make = ss.CumulativeBSpline
    raises("not a group", make, None, np.eye(3), "sphere:2")
    raises("not a group", make, None, (points, np.eye(3)), "so:3 x sphere:2")
    raises("not a group", make, None, points, "so:3/432")
    raises("degree 3 needs at least 4 control points", make, None, points[:3], "so:3")
    raises("5 control points of degree 3 need 9 knots", make, np.arange(8), points, "so:3")
    raises("knots.1. = 0.0 is before", make, [1, 0, 2, 3, 4, 5, 6, 7, 8], points, "so:3")
    raises("degree must be", make, None, points, "so:3", degree=0)
    raises("control_points must be a tuple of 2", make, None, points, "so:3 x r:3")
    raises("same number", make, None, (points, np.zeros((6, 3))), "so:3 x r:3")
    raises("control_points.2.", make, None, np.where(np.arange(5)[:, None, None] == 2, 2 * points, points), "so:3")
    opposite = np.array([np.eye(3), np.eye(3), np.diag([-1.0, -1, 1]), np.eye(3)])
    raises("control_points.1. and control_points.2.", make, None, opposite, "so:3", error=ss.CutLocusError)
    curve = make(None, points, "so:3")
    raises("outside the domain", curve, 3.0)
    raises("nu must be 0, 1 or 2", curve, 1.0, 3)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        make(None, Rotation.from_rotvec(np.arange(6)[:, None] * [0, 0, 2.5]).as_matrix(), "so:3")
    assert [one.category for one in caught] == [ss.FarPointsWarning]
