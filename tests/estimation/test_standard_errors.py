"""Standard errors in the units of a field, against finite differences and curves drawn from the posterior."""

import warnings

import numpy as np
import pytest
import sensors
from refused import raises
from stored import restored

import symspline as ss
from symspline import geo, measure, poses, rotations

SO3, S2, R3 = sensors.SO3, ss.Sphere(2), ss.Euclidean(3)
GRAVITY = np.array([0, 0, -9.81])


def uneven(rng, end, n):
    """Irregular times that include both ends."""
    return np.r_[0, np.sort(rng.uniform(0, end, n - 2)), end]


def agree(many, std, each=0.1, mean=0.03):
    """Whether the scatter of samples agrees with standard errors, one by one and on average."""
    ratio = many.std(axis=0) / std
    assert np.abs(ratio - 1).max() < each, (ratio.min(), ratio.max())
    assert abs(np.sqrt(np.mean(ratio**2)) - 1) < mean


def attitudes(rng, noise=0.02):
    truth, t = sensors.turning(10, rng, 1.0), uneven(rng, 10, 200)
    return truth, t, SO3.exp(truth(t), noise * SO3.random_tangent(rng, truth(t)))


def gyro(rng, truth, t):
    omega = rotations.angular_velocity(truth, t) + 0.05 * rng.standard_normal((len(t), 3))
    return measure.BodyRates(t, omega, sigma=0.05, bias=measure.Constant(3))


def track(rng, latitude, n=150):
    t = uneven(rng, 3600, n)
    y = geo.from_lonlat(4 * np.sin(t / 900), latitude + 0.1 * np.cos(t / 700))
    y = S2.exp(y, 2e-5 * S2.random_tangent(rng, y))
    return t, y


# ---- derivatives ----


def moving(space, rng, n=6):
    """A motion at n times with random velocities, accelerations and frames."""
    p = sensors.walk(space, rng, n)
    frames = space.frame(p)
    return sensors.Motion(space, p, 2 * space.random_tangent(rng, p), 3 * space.random_tangent(rng, p), frames)


def numerical(function, motion, nu, step=1e-5):
    """The derivatives of numbers with respect to a move, or the derivative of order nu of it."""
    sides = [[function(sensors.moved(motion, j, nu, s)) for s in (step, -step)] for j in range(motion.space.dim)]
    return np.stack([(after - before) / (2 * step) for after, before in sides], axis=-1)


def speed(motion):
    return np.linalg.norm(motion.v, axis=-1)[:, None]


def course(motion):
    east, north = geo.compass(motion.p)
    return np.arctan2((motion.v * east).sum(-1), (motion.v * north).sum(-1))[:, None]


def rate(motion, frame):
    hat = np.swapaxes(motion.p, -1, -2) @ motion.v
    omega = np.stack([hat[:, 2, 1], hat[:, 0, 2], hat[:, 1, 0]], axis=-1)
    return omega if frame == "body" else rotations.turned(motion.p, omega)


def test_no_speed_has_no_standard_error():
    motion = moving(S2, np.random.default_rng(0))
    still = motion._replace(v=np.zeros_like(motion.v))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isnan(geo._speeds([still])[1][0]).all() and np.isnan(geo._courses([still])[1][0]).all()
        pole = motion._replace(p=np.broadcast_to([0.0, 0, 1], motion.p.shape))
        assert np.isnan(geo._courses([pole])[0][0]).all()


# ---- the covariance of points and velocities, and samples of the posterior ----


def exact(spline, x, values, step=1e-5):
    """Standard errors of numbers, from derivatives by differences and the covariance of points and velocities."""
    motion = sensors.Motion(spline.space, spline(x), spline(x, 1), spline(x, 2), spline.frames(x))
    jacobian = np.concatenate([numerical(values, motion, nu, step) for nu in (0, 1)], axis=-1)
    return np.sqrt(np.einsum("nki,nij,nkj->nk", jacobian, spline.cov(x, nu="joint"), jacobian))


@pytest.mark.parametrize("latitude", [0, 55, 85, 89.5])
def test_speed_and_course(latitude):
    rng = np.random.default_rng(latitude == 55)
    t, y = track(rng, latitude)
    spline = ss.make_smoothing_spline(t, y, S2, knots=uneven(rng, 3600, 28))
    x = np.sort(rng.uniform(50, 3550, 25))
    for call, values, options in (
        (geo.sog, speed, {"radius": 1.0}),
        (geo.cog, lambda own: np.degrees(course(own)), {}),
    ):
        value, std = call(spline, x, return_std=True, **options)
        assert np.array_equal(value, call(spline, x, **options))
        np.testing.assert_allclose(std, exact(spline, x, values, 1e-9)[:, 0], rtol=1e-4)


@pytest.mark.parametrize("frame", ["body", "world"])
@pytest.mark.parametrize("kind", ["smoothed", "estimated", "fast"])
def test_angular_velocity(kind, frame):
    rng = np.random.default_rng(2)
    truth, t, seen = attitudes(rng)
    knots = np.linspace(0, 10, 25) + np.r_[0, rng.uniform(-0.1, 0.1, 23), 0]
    if kind == "smoothed":
        spline = ss.make_smoothing_spline(t, seen, SO3, knots=knots)
    elif kind == "estimated":
        spline = ss.estimate([measure.Points(t, seen, sigma=0.02), gyro(rng, truth, t[::2])], knots, SO3)
    else:
        # At 6 rad/s, the noise of the point contributes to that of the rate.
        turning = rotations.from_rotation_vectors(t[:, None] * [0, 0, 6.0])
        seen = SO3.exp(turning, 0.02 * SO3.random_tangent(rng, turning))
        spline = ss.make_smoothing_spline(t[:100], seen[:100], SO3, knots=30, lam=1e-4)
    x = np.sort(rng.uniform(0.1, 0.99 * spline.t[-1], 25))
    omega, std = rotations.angular_velocity(spline, x, frame, return_std=True)
    assert np.array_equal(omega, rotations.angular_velocity(spline, x, frame))
    np.testing.assert_allclose(std, exact(spline, x, lambda own: rate(own, frame)), rtol=1e-8)


def fused(rng, space, force=True):
    truth, t, seen = attitudes(rng)
    path = sensors.moving(10, rng)
    y = path(t) + 0.1 * rng.standard_normal((len(t), 3))
    if not force:
        data = {"se:3": poses.join(seen, y), "so:3 x r:3": (seen, y), "r:3 x sphere:2 x so:3": (y, seen[..., 0], seen)}
        return ss.make_lsq_spline(t, data[space], 21, space)
    read = np.einsum("nij,ni->nj", truth(t), path(t, 2) - GRAVITY) + 0.1 * rng.standard_normal((len(t), 3))
    if space == "se:3":
        seen_at = measure.Function(t, lambda pose: pose[:, :3, 3] - y, sigma=0.1)
    else:
        seen_at = measure.Points(t, y, sigma=0.1, factor=1)
    sensor = measure.SpecificForce(t, read, sigma=0.1, gravity=GRAVITY)
    return ss.estimate(
        [seen_at, gyro(rng, truth, t), sensor], np.linspace(0, 10, 41), space, penalty="jerk", criterion="gcv"
    )


def apart(many, spline):
    """Samples as curves whose position does not depend on the attitude."""
    if spline.space != ss.SpecialEuclidean(3):
        return many
    return ss.CubicSpline(many.t, poses.split(many.points), "so:3 x r:3", bc_type=spline.bc_type)


@pytest.mark.parametrize(
    ("space", "force"),
    [("r:3 x sphere:2 x so:3", False), ("so:3 x r:3", True), ("se:3", True)],
)
def test_inertial_signals(space, force):
    rng = np.random.default_rng(3)
    spline = fused(rng, space, force)
    x = np.sort(rng.uniform(1, 9, 20))
    signals, std = poses.imu(spline, x, return_std=True)
    many = poses.imu(apart(spline.sample(rng, 2000), spline), x)
    assert isinstance(std, poses.Imu)
    assert all(map(np.array_equal, signals, poses.imu(spline, x)))
    agree(many.gyro, std.gyro)
    # The specific force of the curve on se:3 differs slightly from that of separate curves, most at natural ends.
    agree(many.specific_force, std.specific_force, each=0.15 if space == "se:3" else 0.1)


# ---- use ----


def test_variance_between_knots_is_included():
    """With the times of the data as knots, as by default, standard errors agree with `std`."""
    rng = np.random.default_rng(5)
    t, y = track(rng, 50, 60)
    spline = ss.make_smoothing_spline(t, y, S2)
    x = rng.uniform(0, 3600, 20)
    assert np.allclose(geo.sog(spline, x, radius=1.0, return_std=True)[1], spline.std(x, nu=1), rtol=1e-9)
    slow = rotations.from_rotation_vectors(0.2 * np.sin(t / 500)[:, None] * [1, 2, 0])
    spline = ss.make_smoothing_spline(t, SO3.exp(slow, 0.01 * SO3.random_tangent(rng, slow)), SO3)
    std = rotations.angular_velocity(spline, x, return_std=True)[1]
    frames = spline.frames(x)
    size = SO3.norm(spline(x), frames[:, 0])
    unit = np.linalg.norm(frames[:, 0], axis=(-2, -1)) / np.sqrt(2) / size
    assert np.allclose(std, (unit * spline.std(x, nu=1))[:, None], rtol=1e-2)


def test_shapes_of_batches_and_times():
    rng = np.random.default_rng(6)
    t, y = track(rng, 30, 40)
    batch = S2.exp(np.stack([y] * 3), 1e-5 * S2.random_tangent(rng, np.stack([y] * 3)))
    spline = ss.make_smoothing_spline(t, batch, S2, where=[True, False, True])
    for x, shape in ((100.0, ()), (np.ones((2, 4)), (2, 4)), ([], (0,))):
        for call in (geo.sog, geo.cog):
            value, std = call(spline, x, return_std=True)
            assert np.shape(value) == np.shape(std) == (3, *shape)
            assert np.isnan(std[1]).all() and np.isfinite(std[[0, 2]]).all()
            assert np.allclose(std[0], call(spline[0], x, return_std=True)[1], rtol=1e-9)
    assert isinstance(geo.sog(spline[0], 100.0, return_std=True)[1], float)
    # More times than are processed together.
    x = np.linspace(0, 3600, 10_001)
    assert np.array_equal(
        geo.cog(spline[0], x, return_std=True)[1][9_000:], geo.cog(spline[0], x[9_000:], return_std=True)[1]
    )
    _, t, seen = attitudes(rng)
    turning = ss.make_smoothing_spline(t, np.stack([seen, np.swapaxes(seen, 1, 2)]), SO3, knots=20)
    x = rng.uniform(0, 10, (2, 5))
    omega, std = rotations.angular_velocity(turning, x, per_curve=True, return_std=True)
    assert omega.shape == std.shape == (2, 5, 3)
    for i in range(2):
        assert np.allclose(std[i], rotations.angular_velocity(turning[i], x[i], return_std=True)[1], rtol=1e-9)


@pytest.mark.filterwarnings("ignore:there are no data:symspline.SmoothingWarning")
def test_own_times_of_every_curve():
    rng = np.random.default_rng(7)
    t, y = track(rng, 30, 40)
    own = np.stack([t, 2 * t])
    spline = ss.make_smoothing_spline(own, np.stack([y, y]), S2)
    found = geo.sog(spline, [100.0, 200.0], return_std=True)[1]
    assert np.allclose(found[1], geo.sog(spline[1], [100.0, 200.0], return_std=True)[1], rtol=1e-9)
    dates = np.datetime64("2026-01-01") + (1e3 * t).astype(int).astype("timedelta64[ms]")
    dated = ss.make_smoothing_spline(dates, y, S2)
    plain = ss.make_smoothing_spline((dates - dates[0]) / np.timedelta64(1, "s"), y, S2)
    std = geo.cog(dated, dates[5:9], return_std=True)[1]
    assert np.allclose(std, geo.cog(plain, plain.t[5:9], return_std=True)[1], rtol=1e-6)


def test_beyond_the_knots_of_standard_errors():
    rng = np.random.default_rng(8)
    # Not from 0, so that periods are counted from the first knot.
    angle = np.linspace(1.3, 1.3 + 2 * np.pi, 41)
    y = S2.project(np.stack([np.cos(angle), np.sin(angle), 0.3 + 0 * angle], -1) + 0.01 * rng.standard_normal((41, 3)))
    closed = ss.make_smoothing_spline(angle, y, S2, bc_type="periodic")
    there, again = (geo.sog(closed, x, return_std=True)[1] for x in (7.0, 7.0 + 4 * np.pi))
    assert np.isclose(there, again, rtol=1e-9)
    _, t, seen = attitudes(rng)
    spline = ss.make_smoothing_spline(t, seen, SO3, knots=20)
    _, std = rotations.angular_velocity(spline, [5.0, 11.0], extrapolate=False, return_std=True)
    assert np.isfinite(std[0]).all() and np.isnan(std[1]).all()
    raises("x = 11 is outside", rotations.angular_velocity, spline, 11.0, return_std=True)
    raises(
        "Standard errors are available between the knots only",
        *(rotations.angular_velocity, spline, 11.0),
        extrapolate=True,
        return_std=True,
    )
    _, std = rotations.angular_velocity(spline, [5.0], extrapolate=True, return_std=True)
    assert np.isfinite(std).all()


def test_files_keep_standard_errors():
    spline = fused(np.random.default_rng(9), "so:3 x r:3")
    before, after = (poses.imu(own, [1.0, 2.5], return_std=True)[1] for own in (spline, restored(spline)))
    assert all(np.allclose(*pair, rtol=1e-9) for pair in zip(before, after, strict=True))


def test_curves_without_covariance_raise():
    message = (
        "return_std=True needs a curve with a covariance, but spline is a CubicSpline. Fit the curve by "
        "symspline.make_smoothing_spline or symspline.estimate."
    )
    globe = ss.CubicSpline([0, 60], geo.from_lonlat([5, 4], [0, 0]), "sphere:2")
    pose = ss.CubicSpline(None, [np.eye(4), np.eye(4)], "se:3")
    for call, spline in ((geo.sog, globe), (geo.cog, globe), (rotations.angular_velocity, pose), (poses.imu, pose)):
        raises(message, call, spline, 0.5, return_std=True)
        raises("return_std must be True or False, not 'yes'", call, spline, 0.5, return_std="yes")
