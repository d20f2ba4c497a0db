"""Smoothing of noisy grids: flat grids against dense matrices, noise, gaps, weights, spaces, files and errors."""

import io
import pickle
import warnings

import numpy as np
import pytest
from refused import raises
from scipy.interpolate import CubicSpline, make_smoothing_spline
from stored import restored

import symspline as ss
from symspline._smoothing import grid as smoothing_grid

LINE = ss.Euclidean(1)
U = np.array([0.0, 0.11, 0.13, 0.3, 0.42, 0.55, 0.6, 0.81, 0.9, 1.0, 1.3])
V = np.array([-2.0, -1.5, -0.7, -0.6, 0.1, 0.9, 1.4, 1.5, 2.2, 3.0, 3.3, 4.1, 4.5])


def energy_matrix(t, bc_type="natural"):
    """K with yᵀKy the bending energy of SciPy's spline through y, whose second derivative is piecewise linear."""
    count = len(t) - (bc_type == "periodic")
    cardinal = np.eye(len(t))[:, :count]
    if bc_type == "periodic":
        cardinal[-1] = cardinal[0]
    second = CubicSpline(t, cardinal, bc_type=bc_type)(t, 2)
    h, a, b = np.diff(t)[:, None, None], second[:-1], second[1:]
    products = [x[:, :, None] * y[:, None, :] for x, y in ((a, a), (a, b), (b, a), (b, b))]
    return np.sum(h / 6 * (2 * products[0] + products[1] + products[2] + 2 * products[3]), axis=0)


def smoother(t, lam, weights=1.0, bc_type="natural"):
    """The matrix (W + λK)⁻¹."""
    k = energy_matrix(t, bc_type)
    return np.linalg.inv(weights * np.eye(len(k)) + lam * k)


def wave(*axes):
    x = np.meshgrid(*axes, indexing="ij")
    return np.sin(3 * x[0]) * np.cos(x[1]) + 0.3 * x[0] * x[1]


def noisy_wave(rng, sigma=0.1, u=U, v=V):
    return wave(u, v), wave(u, v) + sigma * rng.standard_normal((len(u), len(v)))


def turns(u, v):
    x, y = np.meshgrid(u, v, indexing="ij")
    return ss.rotations.from_rotation_vectors(np.stack([np.sin(2 * x + y), np.cos(2 * y - x), x * y], axis=-1) / 2)


# ---- a Euclidean space ----


@pytest.mark.parametrize("scale", [1.0, 1e6, 1e-9])
@pytest.mark.parametrize("weight", [1.0, 4.2e-3])
def test_flat_grid_is_the_kronecker_product_of_smoothing_matrices(rng, scale, weight):
    y = scale * rng.standard_normal((11, 13, 2))
    lam = (3e-4 * weight, 0.2 * weight)
    grid = ss.make_smoothing_grid((U, V), y, "r:2", lam=lam, weights=np.full((11, 13), weight))
    first, second = smoother(U, lam[0], weight), smoother(V, lam[1], weight)
    np.testing.assert_allclose(
        grid.points, weight**2 * np.einsum("ij,kl,jlm->ikm", first, second, y), atol=1e-9 * scale
    )
    # sigma = 1 gives the posterior standard deviations alone.
    known = ss.make_smoothing_grid((U, V), y, "r:2", lam=lam, weights=np.full((11, 13), weight), sigma=1.0)
    np.testing.assert_allclose(known.std() ** 2, weight * np.multiply.outer(np.diag(first), np.diag(second)), rtol=1e-8)
    df = weight**2 * np.trace(first) * np.trace(second)
    assert grid.df == pytest.approx(df, rel=1e-8)
    rss = weight * np.sum((grid.points - y) ** 2)
    assert grid.sigma == pytest.approx(np.sqrt(rss / (2 * (143 - df))), rel=1e-8)
    np.testing.assert_allclose(grid.residuals, y - grid.points, atol=1e-12 * scale)


def test_flat_grid_over_three_axes(rng):
    w = np.linspace(0, 2, 6) ** 1.5
    y = rng.standard_normal((11, 13, 6, 1))
    lam = (1e-3, 0.5, 0.03)
    grid = ss.make_smoothing_grid((U, V, w), y, LINE, lam=lam)
    expected = np.einsum("ai,bj,ck,ijkm->abcm", *(smoother(t, own) for t, own in zip((U, V, w), lam, strict=True)), y)
    np.testing.assert_allclose(grid.points, expected, atol=1e-9)
    assert grid.lam == lam
    assert grid.report.evaluations == (0, 0, 0)


@pytest.mark.parametrize("bc_type", ["clamped", "periodic"])
@pytest.mark.parametrize("end", ["copy", "nan"])
def test_other_ends_on_a_flat_grid(rng, bc_type, end):
    y = rng.standard_normal((11, 13))
    periodic = bc_type == "periodic"
    if periodic:
        y[:, -1] = y[:, 0] if end == "copy" else np.nan
    data = y[:, :-1] if periodic else y
    grid = ss.make_smoothing_grid((U, V), y[..., None], LINE, lam=(1e-3, 0.4), bc_type=("natural", bc_type), sigma=1.0)
    first, second = smoother(U, 1e-3), smoother(V, 0.4, bc_type=bc_type)
    expected = first @ data @ second
    inner = slice(-1) if periodic else slice(None)
    np.testing.assert_allclose(grid.points[:, inner, 0], expected, atol=1e-9)
    np.testing.assert_allclose(grid.std()[:, inner] ** 2, np.outer(np.diag(first), np.diag(second)), rtol=1e-6)
    if periodic:
        np.testing.assert_allclose(grid.points[:, -1], grid.points[:, 0], atol=1e-12)
        np.testing.assert_allclose(grid((0.5, V[-1] + 0.25)), grid((0.5, V[0] + 0.25)), atol=1e-12)
        assert np.isnan(grid.residuals[:, -1]).all()
    assert grid.bc_type == ("natural", bc_type)


def test_further_data_at_the_end_of_a_periodic_axis_count(rng):
    y = rng.standard_normal((13, 1))
    merged, weights = y.copy(), np.ones(13)
    merged[0] = (y[0] + y[-1]) / 2
    weights[0], weights[-1] = 2.0, 0.0
    both = ss.make_smoothing_grid((V,), y, LINE, lam=0.1, bc_type="periodic")
    mean = ss.make_smoothing_grid((V,), merged, LINE, lam=0.1, bc_type="periodic", weights=weights)
    np.testing.assert_allclose(both.points, mean.points, atol=1e-9)


def test_one_axis_equals_other_smoothing_splines(rng):
    t = np.linspace(0, 2, 40)
    y = np.sin(4 * t) + 0.1 * rng.standard_normal(40)
    x = np.linspace(0, 2, 77)
    grid = ss.make_smoothing_grid((t,), y[:, None], LINE, lam=1e-3)
    np.testing.assert_allclose(grid((x,))[:, 0], make_smoothing_spline(t, y, lam=1e-3)(x), atol=1e-9)
    for options in ({"gamma": 1.4}, {"criterion": "cp", "sigma": 0.1}):
        chosen = ss.make_smoothing_grid((t,), y[:, None], LINE, **options)
        spline = ss.make_smoothing_spline(t, y[:, None], LINE, **options)
        assert chosen.lam[0] == pytest.approx(spline.lam, rel=0.05)
        assert chosen.report.df[0] == pytest.approx(chosen.df, rel=1e-6)
    exact = ss.make_smoothing_grid((t,), y[:, None], LINE, lam=spline.lam, sigma=0.1)
    np.testing.assert_allclose(exact.std(), spline.std(t), rtol=1e-6)


# ---- the choice of λ ----


def best_lam(score):
    x = np.linspace(-5, 1, 121)
    return 10 ** x[np.argmin([score(10**own) for own in x])]


@pytest.mark.parametrize("options", [{}, {"gamma": 1.4}, {"criterion": "cp", "sigma": 0.1}])
def test_lam_minimises_the_criterion_of_the_surface(rng, options):
    _, y = noisy_wave(rng)
    grid = ss.make_smoothing_grid((U, V), y[..., None], LINE, **options)
    gamma = options.get("gamma", 1.0)

    def score(lam):
        first, second = smoother(U, lam[0]), smoother(V, lam[1])
        rss, df = np.sum((first @ y @ second - y) ** 2), np.trace(first) * np.trace(second)
        if "sigma" in options:
            return rss + 2 * 0.01 * df
        return rss / (y.size - gamma * df) ** 2 if gamma * df < y.size else np.inf

    # λ of the first axis was chosen with that of the second axis from the first round.
    assert grid.lam[0] == pytest.approx(best_lam(lambda x: score((x, grid.lam[1]))), rel=0.3)
    assert grid.lam[1] == pytest.approx(best_lam(lambda x: score((grid.lam[0], x))), rel=0.1)


def test_one_lam_can_be_given(rng):
    _, y = noisy_wave(rng)
    both = ss.make_smoothing_grid((U, V), y[..., None], LINE)
    grid = ss.make_smoothing_grid((U, V), y[..., None], LINE, lam=(both.lam[0], None))
    assert grid.lam[0] == both.lam[0]
    assert grid.lam[1] == pytest.approx(both.lam[1], rel=0.02)
    assert grid.report.evaluations[0] == 0
    assert ss.make_smoothing_grid((U, V), y[..., None], LINE, lam=2.0).lam == (2.0, 2.0)


# ---- missing nodes and weights ----


def test_missing_nodes_are_filled_between_data_only(rng):
    u, v = np.linspace(0, 1, 30), np.linspace(0, 2, 34)
    truth, y = noisy_wave(rng, 0.05, u, v)
    x, z = np.meshgrid(u, v, indexing="ij")
    mask = ((x - 0.5) / 0.45) ** 2 + ((z - 1) / 0.9) ** 2 < 1
    hole = mask & (np.abs(x - 0.5) < 0.1) & (np.abs(z - 1) < 0.2)
    mask &= ~hole & (rng.random(mask.shape) > 0.1)
    grid = ss.make_smoothing_grid((u, v), np.where(mask, y, np.nan)[..., None], LINE)
    found = np.isfinite(grid.points[..., 0])
    assert found[mask | hole].all()
    assert not found[[0, -1]].any()
    assert not found[:, [0, -1]].any()
    error = np.abs(grid.points[..., 0] - truth)
    assert np.sqrt(np.mean(error[mask] ** 2)) < 0.02
    assert error[hole].max() < 0.08
    # The standard deviation is larger in the hole, and NaN where there is no surface.
    std = grid.std()
    assert np.array_equal(np.isfinite(std), found)
    assert std[hole].mean() > 1.1 * np.median(std[mask])
    assert np.isfinite(grid((0.5, 1.0))).all()
    np.testing.assert_array_equal(np.isfinite(grid.residuals[..., 0]), mask)
    # Weights of zero are the same as NaN.
    same = ss.make_smoothing_grid((u, v), y[..., None], LINE, weights=mask.astype(float))
    np.testing.assert_array_equal(same.points, grid.points)


def test_rows_of_few_data_keep_them(rng):
    y = rng.standard_normal((11, 13))
    mask = np.ones(y.shape, bool)
    mask[:, 4:7] = False
    mask[3, 4], mask[[2, 8], 5] = True, True
    y[~mask] = np.nan
    once = ss.make_smoothing_grid((U, [0.0, 1.0]), np.stack([y[:, 5], y[:, 4]], axis=-1)[..., None], LINE, lam=0.1)
    # The row of two data is a line, that of one datum a point. Rows of two nodes are not changed.
    np.testing.assert_allclose(once.points[[2, 8], 0, 0], y[[2, 8], 5], atol=1e-9)
    line = np.interp(U[2:9], U[[2, 8]], y[[2, 8], 5])
    np.testing.assert_allclose(once.points[[2, 4, 5, 6, 7, 8], 0, 0], np.delete(line, 1), atol=1e-9)
    assert np.isnan(once.points[[0, 1, 9, 10]]).all()
    assert once.points[3, 1, 0] == pytest.approx(y[3, 4])


def test_rows_with_close_nodes_and_few_data(rng):
    # Knots without data at distances of 1e-5 make the matrix of the whole row singular to rounding.
    t = np.sort(np.append(np.linspace(0, 1, 40), np.linspace(0.2, 0.8, 9) + 1e-5))
    y = np.full((len(t), 3), np.nan)
    y[:, 0], y[[3, 20, 21, 44], 1], y[[5, 30, 40], 2] = np.sin(5 * t), [1, 2, 2.1, 0], [1, 0, 3]
    grid = ss.make_smoothing_grid((t, None), y[..., None], LINE, lam=(1e-4, 0.0))
    for j, used in ((1, [3, 20, 21, 44]), (2, [5, 30, 40])):
        alone = ss.make_smoothing_spline(t[used], y[used, j, None], LINE, 1e-4)
        inside = slice(used[0], used[-1] + 1)
        np.testing.assert_allclose(grid.points[inside, j], alone(t[inside]), atol=1e-6)


def test_weights_along_later_axes_are_inverse_variances(rng):
    _, y = noisy_wave(rng)
    weights = rng.uniform(0.1, 3, y.shape)
    lam = (2e-3, 0.3)
    grid = ss.make_smoothing_grid((U, V), y[..., None], LINE, weights=weights, lam=lam, sigma=1.0)
    columns = [np.linalg.inv(np.diag(own) + lam[0] * energy_matrix(U)) for own in weights.T]
    half = np.stack([s @ (own * row) for s, own, row in zip(columns, weights.T, y.T, strict=True)], axis=-1)
    mean = weights.mean()
    complete = mean * np.diag(smoother(U, lam[0], mean))
    later = complete[:, None] / np.stack([np.diag(s) for s in columns], axis=-1)
    for i, own in enumerate(later):
        s = np.linalg.inv(np.diag(own) + lam[1] * energy_matrix(V))
        np.testing.assert_allclose(grid.points[i, :, 0], s @ (own * half[i]), atol=1e-9)
        np.testing.assert_allclose(grid.std()[i] ** 2, complete[i] * np.diag(s), rtol=1e-6)


# ---- axes, spaces, products ----


def test_dates_of_smoothing_grids_count_in_seconds(rng):
    _, y = noisy_wave(rng)
    hours = np.arange(13) * np.timedelta64(1, "h")
    dates = np.datetime64("2024-02-28T12:00") + hours
    grid = ss.make_smoothing_grid((U, dates), y[..., None], LINE)
    plain = ss.make_smoothing_grid((U, 3600.0 * np.arange(13)), y[..., None], LINE, lam=grid.lam)
    np.testing.assert_allclose(grid.points, plain.points, atol=1e-9)
    np.testing.assert_array_equal(grid.axes[1], dates)
    np.testing.assert_allclose(grid((0.5, dates[3])), plain((0.5, 3 * 3600.0)), atol=1e-9)


SPACES = ["hyperbolic:2", "gr:2,5", "cp:2", "u:2", "gl:2"]


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
@pytest.mark.parametrize("name", SPACES)
def test_spaces(rng, name):
    space = ss.space(name)
    u, v = np.linspace(0, 1, 9), np.linspace(0, 1, 10) ** 1.3
    start = space.random_point(rng)
    frame = space.frame(start)
    x, y = (own.reshape(*own.shape, *[1] * len(space.point_shape)) for own in np.meshgrid(u, v, indexing="ij"))
    along = 0.4 * np.sin(3 * x + y) * frame[0] + 0.4 * np.cos(2 * y - x) * frame[-1]
    truth = space.exp(np.broadcast_to(start, along.shape), along)
    noisy = space.exp(truth, 0.05 * space.random_tangent(rng, truth))
    noisy[2, 3] = np.nan
    grid = ss.make_smoothing_grid((u, v), noisy, space)
    errors = space.distance(grid.points, truth) / np.sqrt(space.dim)
    assert np.sqrt(np.mean(errors**2)) < 0.04
    assert grid.sigma == pytest.approx(0.05, rel=0.3)
    assert isinstance(grid.lam[0], float)


@pytest.mark.slow
def test_poses_are_smoothed_as_rotations_and_positions(rng):
    u, v = np.linspace(0, 1, 8), np.linspace(0, 1, 9)
    poses = np.zeros((8, 9, 4, 4))
    poses[..., 3, 3] = 1
    noise = 0.02 * rng.standard_normal((8, 9, 3))
    poses[..., :3, :3] = turns(u, v) @ ss.rotations.from_rotation_vectors(noise)
    poses[..., :3, 3] = 100 * turns(u, v)[..., 0] + rng.standard_normal((8, 9, 3))
    grid = ss.make_smoothing_grid((u, v), poses, "se:3")
    rotations = ss.make_smoothing_grid((u, v), poses[..., :3, :3], "so:3")
    positions = ss.make_smoothing_grid((u, v), poses[..., :3, 3], "r:3")
    np.testing.assert_array_equal(grid.points[..., :3, :3], rotations.points)
    np.testing.assert_array_equal(grid.points[..., :3, 3], positions.points)
    assert grid.lam == tuple(zip(rotations.lam, positions.lam, strict=True))
    assert grid.sigma == (rotations.sigma, positions.sigma)
    assert grid.df == (rotations.df, positions.df)
    assert np.array_equal(grid.std()[1], positions.std())
    assert grid.report.sigma == tuple(zip(rotations.report.sigma, positions.report.sigma, strict=True))
    again = ss.make_smoothing_grid((u, v), poses, "se:3", lam=grid.lam)
    np.testing.assert_array_equal(again.points, grid.points)


def test_products_share_missing_nodes(rng):
    space = ss.Product(ss.Sphere(2), LINE)
    x, y = np.meshgrid(U, V, indexing="ij")
    directions = ss.Sphere(2).project(np.stack([x, 0.2 * y, np.ones_like(x)], axis=-1))
    directions = ss.Sphere(2).exp(directions, 0.03 * ss.Sphere(2).random_tangent(rng, directions))
    numbers = noisy_wave(rng)[1][..., None]
    directions[4, 5], numbers[4, 6] = np.nan, np.nan
    grid = ss.make_smoothing_grid((U, V), (directions, numbers), space, lam=(None, (0.3, 0.2)), sigma=(0.03, 0.1))
    assert grid.lam[1] == (0.3, 0.2)
    assert grid.sigma == (0.03, 0.1)
    assert all(np.isnan(own[4, [5, 6]]).all() and np.isfinite(own[4, 4]).all() for own in grid.data)
    alone = ss.make_smoothing_grid((U, V), grid.data[1], LINE, lam=(grid.lam[0][1], 0.2))
    np.testing.assert_allclose(grid.points[1], alone.points, atol=1e-12)
    assert grid.residuals[0].shape == (11, 13, 3)


def test_equivalent_orientations_give_the_same_surface(rng):
    space, group = ss.space("so:3"), ss.rotations.point_group("432")
    crystal = ss.Quotient("so:3", group)
    t = np.linspace(0, 1, 10)
    truth = turns(t, t)
    noisy = space.exp(truth, 0.02 * space.random_tangent(rng, truth))
    plain = ss.make_smoothing_grid((t, t), noisy, space, lam=1e-3)
    grid = ss.make_smoothing_grid((t, t), noisy @ group[rng.integers(len(group), size=(10, 10))], crystal, lam=1e-3)
    assert crystal.distance(grid.points, plain.points).max() < 1e-9
    assert grid.sigma == pytest.approx(plain.sigma)


# ---- files ----


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
@pytest.mark.parametrize("kind", ["mask", "poses", "dates"])
def test_files_and_pickles_of_smoothing_grids(rng, kind):
    axes, space, y = (U, V), "r:1", noisy_wave(rng)[1][..., None]
    if kind == "mask":
        y[:3, :4] = np.nan
    if kind == "dates":
        axes = U, np.datetime64("2024-01-01") + np.arange(13)
    if kind == "poses":
        space, rotations = "se:3", turns(U, V / 5)
        y = np.concatenate(
            [np.concatenate([rotations, rotations[..., :1]], axis=-1), np.zeros((11, 13, 1, 4))], axis=-2
        )
        y[..., 3, 3] = 1
        y[..., :3, 3] += 0.1 * rng.standard_normal((11, 13, 3))
    grid = ss.make_smoothing_grid(axes, y, space)
    for other in (restored(grid), pickle.loads(pickle.dumps(grid))):
        assert other == grid
        assert isinstance(other, ss.SmoothingGrid)
        assert other.lam == grid.lam
        assert other.sigma == grid.sigma
        np.testing.assert_array_equal(other.std(), grid.std())
        np.testing.assert_array_equal(other.residuals, grid.residuals)
        assert other.report.df == grid.report.df
    assert grid != ss.make_smoothing_grid(axes, y, space, lam=0.1)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("data", np.zeros((3, 4, 1))),
        ("data_weights", np.zeros((3, 4))),
        ("variance_0", np.zeros((3, 4))),
        ("noise", np.array("[]")),
        ("noise", np.array('[{"axes": [], "df": 1.0, "sigma": 1.0}]')),
    ],
)
def test_damaged_files_raise(rng, name, value):
    file = io.BytesIO()
    ss.make_smoothing_grid((U, V), noisy_wave(rng)[1][..., None], LINE, lam=0.1).save(file)
    file.seek(0)
    entries = dict(np.load(file)) | {name: value}
    damaged = io.BytesIO()
    np.savez(damaged, **entries)
    damaged.seek(0)
    raises(name.split("_")[0], ss.load, damaged)


# ---- errors and warnings ----

ONES = np.ones((11, 13, 1))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lam": (1.0, 2.0, 3.0)}, "lam has 3 entries, but there are 2 axes"),
        ({"lam": (1.0, -2.0)}, r"lam\[1\] must be finite and >= 0"),
        ({"lam": (1.0, (1.0, 2.0))}, r"lam\[1\] must be a number"),
        ({"lam": "gcv"}, "lam must be a number"),
        ({"criterion": "cp"}, "needs the standard deviation"),
        ({"criterion": "reml"}, "criterion must be 'gcv' or 'cp'"),
        ({"gamma": 0.5}, "gamma must be a number >= 1"),
        ({"weights": np.ones((13, 11))}, r"weights must be numbers of shape \(11, 13\)"),
        ({"weights": -np.ones((11, 13))}, r"weights\[0, 0\] is -1.0, but must be finite and >= 0"),
        ({"weights": np.zeros((11, 13))}, "no valid node"),
        ({"sigma": (0.1, 0.2)}, "sigma must be a number"),
        ({"bc_type": "not-a-knot"}, "bc_type 'not-a-knot' of axis 0 is not available"),
        ({"bc_type": "closed"}, "bc_type must be"),
        ({"axes": (U[::-1], V)}, "knots must increase"),
        ({"axes": (U,)}, "1 axes of knots"),
        ({"axes": U}, "axes must be a tuple"),
        ({"points": np.where(np.arange(13)[:, None] == 5, np.inf, ONES)}, r"points\[0, 5\] is infinite"),
        ({"points": np.full((11, 13, 1), np.nan)}, "no valid node"),
        ({"points": np.ones((11, 13, 3)), "space": "sphere:2"}, r"points\[0, 0\] .*norm"),
        ({"on_failure": "skip"}, "on_failure must be"),
        ({"progress": 3}, "progress must be a function"),
        ({"points": ONES[:3], "axes": (U[:3], V), "bc_type": "periodic"}, "axis 0 is periodic and needs at least 4"),
    ],
)
def test_invalid_input_of_smoothing_grids_raises(change, message):
    given = {"axes": (U, V), "points": ONES, "space": "r:1"} | change
    axes, points, space = (given.pop(name) for name in ("axes", "points", "space"))
    raises(message, lambda: ss.make_smoothing_grid(axes, points, space, **given))


def test_manifolds_of_functions_and_the_constructor_raise():
    raises(
        "smoothing grids are not made", ss.make_smoothing_grid, (None, None), np.ones((4, 4, 5, 2)), ss.Stiefel(2, 5)
    )
    raises("make_smoothing_grid", ss.SmoothingGrid, error=TypeError)


@pytest.mark.parametrize("on_failure", ["raise", "warn", "ignore"])
def test_rows_that_fail(rng, monkeypatch, on_failure):
    smooth = smoothing_grid.smooth

    def fail(rows, lam):
        found = smooth(rows, lam)
        if len(rows.t) == len(V):
            found.converged[4] = False
        return found

    monkeypatch.setattr(smoothing_grid, "smooth", fail)
    y = noisy_wave(rng)[1][..., None]
    message = r"along axis 1 in the row points\[4, :\]"
    if on_failure == "raise":
        with pytest.raises(ss.ConvergenceError, match=message) as caught:
            ss.make_smoothing_grid((U, V), y, LINE, lam=0.1)
        assert not caught.value.spline.report.converged
        return
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        grid = ss.make_smoothing_grid((U, V), y, LINE, lam=0.1, on_failure=on_failure)
    assert [own.category for own in seen] == ([ss.ConvergenceWarning] if on_failure == "warn" else [])
    assert np.isfinite(grid.points).all()


@pytest.mark.slow
def test_lam_at_a_bound_warns():
    line = (U[:, None] + np.sin(V))[..., None]
    with pytest.warns(ss.SmoothingWarning, match="along axis 0 chose a lam so large that rows are geodesics"):
        grid = ss.make_smoothing_grid((U, V), line, LINE)
    assert grid.report.at_bound[0]
    np.testing.assert_allclose(grid.points, line, atol=0.1)
    with pytest.warns(ss.SmoothingWarning, match="follow nearly all nodes"):
        exact = ss.make_smoothing_grid((U, V), wave(U, V)[..., None], LINE)
    np.testing.assert_allclose(exact.points[..., 0], wave(U, V), atol=1e-3)


def test_random_points_warn(rng):
    points = ss.Sphere(2).random_point(rng, (12, 12))
    with pytest.warns(UserWarning, match="the surface has little meaning"):
        ss.make_smoothing_grid((None, None), points, "sphere:2", lam=100.0, on_failure="ignore")


def test_progress_reaches_the_total(rng):
    calls = []
    ss.make_smoothing_grid((U, V), noisy_wave(rng)[1][..., None], LINE, progress=lambda *own: calls.append(own))
    done, totals = zip(*calls, strict=True)
    assert list(done) == sorted(set(done))
    assert done[-1] == totals[-1]
    assert len(set(totals)) == 1
