"""Information matrices as weights: some directions of the data are better known than others."""

import numpy as np
import pytest
from noisy import TIGHT, acceleration_energy, both_solvers, distance_to_minimum, example, rms, truth
from oracle import Dense
from refused import raises
from scipy.linalg import block_diag
from test_smoothing_laws import NAMES

import symspline as ss

every = pytest.mark.parametrize("name", [n for n in NAMES if n != "sphere:1"])


def matrices(rng, n, m, condition=30.0):
    """Symmetric matrices with eigenvalues between 1/√condition and √condition."""
    turn = np.linalg.qr(rng.normal(size=(n, m, m)))[0]
    values = np.exp(rng.uniform(-0.5, 0.5, (n, m)) * np.log(condition))
    values[:, 0], values[:, -1] = condition**-0.5, condition**0.5
    return turn @ (values[..., None] * np.swapaxes(turn, -1, -2))


def scattered(space, points, information, sigma, rng):
    """Noise with the covariances sigma² W⁻¹."""
    root = np.linalg.cholesky(np.linalg.inv(information))
    numbers = (root @ rng.standard_normal((*information.shape[:-1], 1)))[..., 0]
    axes = (1,) * len(space.point_shape)
    v = np.sum(numbers.reshape(*numbers.shape, *axes) * space.frame(points), axis=1)
    return space.exp(points, sigma * v)


def coordinates(frames, v):
    """Of vectors, one in every frame."""
    columns, numbers = (
        np.ascontiguousarray(x).reshape(*x.shape[:axes], -1).view(float) for x, axes in ((frames, 2), (v, 1))
    )
    return np.linalg.pinv(np.swapaxes(columns, -1, -2)) @ numbers[..., None]


@pytest.mark.parametrize("lam", [0.01, 1.0, 100.0])
def test_numbers_solve_the_equations_of_a_dense_matrix(lam):
    """(W + λK ⊗ 1) x = W y, with the matrix K of the energy of natural splines."""
    rng = np.random.default_rng(0)
    n, m = 15, 3
    t = np.cumsum(rng.uniform(0.3, 1, n))
    energy = np.kron(Dense(t, np.ones(n), t).penalty, np.eye(m))
    y, w = rng.normal(size=(n, m)), matrices(rng, n, m, 1000.0)
    whole = block_diag(*w)
    a = whole + lam * energy
    x = np.linalg.solve(a, whole @ y.ravel()).reshape(n, m)
    spline = ss.make_smoothing_spline(t, y, "r:3", lam, weights=w)
    assert np.abs(spline.points - x).max() < 1e-10
    assert spline.report.iterations <= 4
    df = np.trace(np.linalg.solve(a, whole)) / m
    assert spline.df == pytest.approx(df, rel=1e-10)
    rest = (x - y)[:, None, :] @ w @ (x - y)[:, :, None]
    assert spline.sigma == pytest.approx(np.sqrt(rest.sum() / (m * (n - df))), rel=1e-10)
    variances = np.diag(np.linalg.inv(a)).reshape(n, m).mean(axis=1)
    assert spline.std(t) == pytest.approx(spline.sigma * np.sqrt(variances), rel=1e-9)


@every
def test_information_matrices_refer_to_frames(name):
    """Any basis does; and a curve does not know which."""
    rng = np.random.default_rng(0)
    space, t, noisy, _ = example(name, 0.1, n=20)
    w = matrices(rng, 20, space.dim)
    change = matrices(rng, 20, space.dim, 5.0) @ np.triu(np.ones((space.dim, space.dim)))
    flat = space.frame(noisy).reshape(20, space.dim, -1)
    bent = (np.swapaxes(change, -1, -2) @ flat).reshape(20, space.dim, *space.point_shape)
    one = ss.make_smoothing_spline(t, noisy, space, 0.1, weights=w, **TIGHT)
    other = ss.make_smoothing_spline(
        t, noisy, space, 0.1, weights=np.swapaxes(change, -1, -2) @ w @ change, frames=bent, **TIGHT
    )
    assert space.distance(one.points, other.points).max() < 1e-7
    assert other.df == pytest.approx(one.df, rel=1e-9)


@pytest.mark.parametrize("name", [n for n in NAMES if n != "sphere:1" and not n.startswith("se")])
def test_gauss_newton_reaches_the_minimum(name):
    rng = np.random.default_rng(2)
    space = ss.space(name)
    t = np.linspace(0, 10, 12)
    w, lam = matrices(rng, 12, space.dim), 0.3
    noisy = scattered(space, truth(space, segments=3)(t), w, 0.1, rng)

    def objective(points):
        e = coordinates(space.frame(noisy), space.log(noisy, points))
        misfit = np.sum(np.swapaxes(e, -1, -2) @ w @ e)
        return misfit + acceleration_energy(space, ss.CubicSpline(t, points, space), lam)

    flat, exact = both_solvers(t, noisy, space, lam, weights=w, **TIGHT)
    assert distance_to_minimum(space, exact.points, objective) < 1e-7
    # What the estimating equation is off by, more than usual over steps that are so long.
    assert rms(space, flat.points, exact.points) < 1.1e-2 * np.sqrt(space.dim) * exact.std(t).max()


def test_each_of_two_sensors_knows_one_direction():
    """Latitudes and longitudes of their own times: every matrix has rank one."""
    space, rng = ss.Sphere(2), np.random.default_rng(4)
    t = np.linspace(0, 10, 200)
    points = truth(space, step=0.4)(t)
    up = space.project_tangent(points, np.broadcast_to([0.0, 0.0, 1.0], points.shape))
    up /= space.norm(points, up)[:, None]
    east = np.cross(points, up)
    numbers = 0.02 * rng.standard_normal((200, 2))
    # What a sensor does not see is anything.
    numbers[::2, 0], numbers[1::2, 1] = 5 * numbers[::2, 0], 5 * numbers[1::2, 1]
    noisy = space.exp(points, numbers[:, :1] * up + numbers[:, 1:] * east)
    frames = space.transport(points[:, None], noisy[:, None], np.stack([up, east], axis=1))
    w = np.zeros((200, 2, 2))
    w[1::2, 0, 0] = w[::2, 1, 1] = 1 / 0.02**2
    spline = ss.make_smoothing_spline(t, noisy, space, weights=w, frames=frames)
    assert spline.report.converged
    assert rms(space, spline(t), points) < 0.012
    assert spline.sigma == pytest.approx(1, rel=0.1) and 10 < spline.df < 30
    raises("Pass sigma", ss.make_smoothing_spline, t, noisy, space, weights=w, frames=frames, loss="huber")
    robust = ss.make_smoothing_spline(t, noisy, space, weights=w, frames=frames, loss="huber", sigma=1)
    assert rms(space, robust(t), points) < 0.014


def test_batches_of_information_matrices_are_single_curves():
    rng = np.random.default_rng(6)
    space = ss.space("so:3")
    t = np.linspace(0, 10, 25)
    batch = np.stack([scattered(space, truth(space, k)(t), matrices(rng, 25, 3), 0.1, rng) for k in range(3)])
    w = np.stack([matrices(rng, 25, 3) for _ in range(3)])
    together = ss.make_smoothing_spline(t, batch, space, weights=w)
    for k in range(3):
        alone = ss.make_smoothing_spline(t, batch[k], space, weights=w[k])
        assert np.array_equal(alone.points, together.points[k]) and alone.lam == together.lam[k]
    shared = ss.make_smoothing_spline(t, batch, space, weights=w[0])
    assert np.array_equal(shared.points[0], together.points[0])


def test_closed_curves_of_information_matrices():
    rng = np.random.default_rng(8)
    space = ss.Sphere(2)
    t = np.linspace(0, 1, 41)
    points = np.stack([np.cos(2 * np.pi * t), np.sin(2 * np.pi * t), 0.5 + 0 * t], axis=-1) / np.sqrt(1.25)
    w = matrices(rng, 41, 2)
    noisy = scattered(space, points, w, 0.03, rng)
    spline = ss.make_smoothing_spline(t, noisy, space, weights=w, bc_type="periodic")
    assert spline.report.converged
    assert rms(space, spline(t), points) < 0.02
    for nu in range(3):
        assert np.abs(spline(0.0, nu=nu) - spline(1.0, nu=nu)).max() < 1e-9


def test_a_product_takes_one_of_every_factor(tmp_path):
    rng = np.random.default_rng(9)
    t = np.linspace(0, 10, 30)
    first, _, places, _ = example("r:3", 0.1, n=30)
    second, _, turns, _ = example("so:3", 0.1, n=30)
    w = matrices(rng, 30, 3)
    for weights in ((None, w), (w, None), (w, rng.uniform(1, 2, 30)), (w, w[::-1])):
        both = ss.make_smoothing_spline(t, (places, turns), "r:3 x so:3", weights=weights)
        for factor, points, own, part in zip((first, second), (places, turns), weights, both.points, strict=True):
            alone = ss.make_smoothing_spline(t, points, factor, weights=own)
            assert np.array_equal(part, alone.points)
        file = tmp_path / "both.npz"
        both.save(file)
        again = ss.load(file)
        assert again == both and np.array_equal(again.std(t), both.std(t))
        assert all(np.array_equal(a, b) for a, b in zip(again.residuals, both.residuals, strict=True))


def test_segments_have_information_matrices_of_their_own():
    rng = np.random.default_rng(10)
    space = ss.space("so:3")
    t = np.r_[0:10:0.2, 30:40:0.2]
    w = matrices(rng, 100, 3)
    noisy = scattered(space, truth(space, end=40.0)(t), w, 0.05, rng)
    frames = ss.rotations.velocities(noisy[:, None], np.eye(3))
    pieces = ss.fit_segments(t, noisy, space, max_gap=5, smooth=True, weights=w, frames=frames)
    for piece, own in zip(pieces, (slice(50), slice(50, None)), strict=True):
        alone = ss.make_smoothing_spline(t[own], noisy[own], space, weights=w[own], frames=frames[own])
        assert np.array_equal(piece.points, alone.points)


S2, T, NOISY, _ = example("sphere:2", n=10)
FRAMES = S2.frame(NOISY)
ONE = np.broadcast_to(np.eye(2), (10, 2, 2))


def with_entry(array, index, value):
    array = np.array(array, float)
    array[index] = value
    return array


def test_invalid_information_raises():
    for weights, frames, match in [
        (with_entry(ONE, (3, 0, 1), 0.1), None, r"weights\[3\] is not symmetric"),
        (with_entry(ONE, (4, 0, 0), -1), None, r"weights\[4\] has a negative eigenvalue"),
        (ONE[:9], None, r"weights has shape \(9, 2, 2\), but matrices for 10 points of Sphere\(2\)"),
        (np.ones((10, 3, 3)), None, r"need \(10,\), or as matrices \(10, 2, 2\)"),
        (ONE, np.ones((10, 3, 3)), r"frames has shape \(10, 3, 3\), but 2 tangent vectors"),
        (ONE, with_entry(FRAMES, (6, 0), NOISY[6]), r"frames\[6\] are not tangent"),
        (ONE, with_entry(FRAMES, (6, 0), FRAMES[6, 1]), r"frames\[6\] do not span"),
        (np.ones(10), FRAMES, "`weights` are numbers"),
        (0 * ONE, None, "All weights of the data are 0"),
    ]:
        raises(match, ss.make_smoothing_spline, T, NOISY, S2, weights=weights, frames=frames)


def test_information_for_other_spaces_raises():
    with pytest.raises(ss.ValidationError, match="must be a tuple with 2 entries"):
        ss.make_smoothing_spline(T, (NOISY,) * 2, "sphere:2 x sphere:2", weights=(ONE,))
    large = ss.Sphere(300).random_point(np.random.default_rng(0), 10)
    with pytest.raises(ss.ValidationError, match="is too large for information matrices"):
        ss.make_smoothing_spline(T, large, "sphere:300", weights=np.zeros((10, 300, 300)))
