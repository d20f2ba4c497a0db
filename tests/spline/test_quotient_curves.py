"""Curves on quotients: representatives at random give the curve through continuous ones."""

import pickle
import warnings
from contextlib import suppress

import numpy as np
import pytest
from crystals import CUBIC, SO3, at_random, noisy, path
from refused import raises

import symspline as ss

X = np.linspace(0, 1, 301)
GROUP = ss.rotations.point_group("432")


def times(rng, n=40):
    """Irregular times from 0 to 1."""
    return np.r_[0, np.sort(rng.uniform(0.01, 0.99, n - 2)), 1]


def disorientation(spline, truth=None):
    """Largest distance of a curve from the motion, in degrees."""
    return np.degrees(CUBIC.distance(spline(X), path(X) if truth is None else truth).max())


@pytest.fixture
def data():
    rng = np.random.default_rng(0)
    t = times(rng)
    given = at_random(CUBIC, path(t), rng)
    return t, given, CUBIC.unwrap(given)


# ---- the benefit ----


# ---- all kinds of fits ----


def test_splines_pass_through_continuous_representatives(data):
    t, given, unwrapped = data
    for bc_type in ("natural", "not-a-knot", "clamped"):
        spline = ss.CubicSpline(t, given, CUBIC, bc_type=bc_type)
        same = ss.CubicSpline(t, unwrapped, "so:3", bc_type=bc_type)
        assert spline.space == CUBIC and np.array_equal(spline.points, same.points)
        for nu in (0, 1, 2):
            assert np.array_equal(spline(X, nu), same(X, nu))
    assert np.array_equal(spline.points[0], given[0])
    assert np.array_equal(ss.CubicSpline(t, given[:, :], "so:3/432")(X), ss.CubicSpline(t, given, CUBIC)(X))


def test_vectors_at_the_ends_belong_to_the_given_points(data):
    t, given, unwrapped = data
    free = ss.CubicSpline(t, unwrapped, "so:3")
    index = np.flatnonzero([np.allclose(given[-1] @ g, unwrapped[-1]) for g in GROUP])[0]
    assert not np.allclose(GROUP[index], np.eye(3))
    # The velocity of the curve through the given last point.
    at_end = 1.3 * free.velocities[-1] @ GROUP[index].T
    spline = ss.CubicSpline(t, given, CUBIC, bc_type=("natural", (1, at_end)))
    same = ss.CubicSpline(t, unwrapped, "so:3", bc_type=("natural", (1, 1.3 * free.velocities[-1])))
    assert np.abs(spline(X) - same(X)).max() < 1e-14
    (many,) = ss.fit_many([(t, given)], CUBIC, bc_type=("natural", (1, at_end)))
    assert np.array_equal(many(X), spline(X))
    batch = ss.CubicSpline(t, np.stack([given, unwrapped]), CUBIC, bc_type=((1, free.velocities[0]), "natural"))
    assert np.abs(batch(X)[0] - batch(X)[1]).max() < 1e-14
    noisy_one = ss.make_smoothing_spline(t, given, CUBIC, 1e-6, bc_type=("natural", (1, at_end)))
    assert np.abs(noisy_one(1.0, 1) - 1.3 * free.velocities[-1]).max() < 0.05


def test_hermite_velocities_belong_to_the_given_points(data):
    t, given, unwrapped = data
    free = ss.CubicSpline(t, unwrapped, "so:3")
    found, _ = ss.fit(t, given, CUBIC)
    SO3.check_tangent(given, found)
    curve = ss.HermiteSpline(t, given, found, CUBIC)
    assert np.abs(curve(X) - free(X)).max() < 1e-14
    assert np.abs(ss.evaluate(t, given, found, CUBIC, X, nu=1) - free(X, 1)).max() < 1e-11
    # Times of few segments start from the same representative.
    long_t, long = np.linspace(0, 1, 200), at_random(CUBIC, path(np.linspace(0, 1, 200)), np.random.default_rng(2))
    velocities, _ = ss.fit(long_t, long, CUBIC)
    all_of_it = ss.evaluate(long_t, long, velocities, CUBIC, X)
    assert np.array_equal(ss.evaluate(long_t, long, velocities, CUBIC, X[200:210]), all_of_it[200:210])


def test_batches_masks_and_lists(data):
    rng = np.random.default_rng(3)
    t, given, _ = data
    batch = np.stack([at_random(CUBIC, path(t), rng) for _ in range(4)]).reshape(2, 2, 40, 3, 3)
    spline = ss.CubicSpline(t, batch, CUBIC, where=[[True, False], [True, True]])
    assert np.array_equal(spline[1][1](X), ss.CubicSpline(t, batch[1, 1], CUBIC)(X)) and np.isnan(spline[0][1](X)).all()
    broken = batch.copy()
    broken[0, 1, 5] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        kept = ss.CubicSpline(t, broken, CUBIC, on_failure="warn")
    assert np.array_equal(kept[1][1](X), spline[1][1](X))
    many = ss.fit_many([(t, given), (t[:20], given[:20])], CUBIC)
    assert np.array_equal(many[0](X), ss.CubicSpline(t, given, CUBIC)(X))
    assert np.array_equal(many[1].points, many[0].points[:20])


def test_segments_with_duplicates():
    rng = np.random.default_rng(4)
    t = np.r_[np.linspace(0, 0.4, 30), np.linspace(0.6, 1, 30)]
    t = np.sort(np.r_[t, t[[4, 9, 40]]])
    given = at_random(CUBIC, path(t), rng)
    for options in ({"duplicates": "mean"}, {"duplicates": "first"}, {"smooth": True}):
        first, second = ss.fit_segments(t, given, CUBIC, max_gap=0.1, **options)
        for curve, x in ((first, X[X <= 0.4]), (second, X[X >= 0.6])):
            assert np.degrees(CUBIC.distance(curve(x), path(x)).max()) < 0.2


def test_periodic_curves():
    rng = np.random.default_rng(5)
    t = np.linspace(0, 2 * np.pi, 31)
    vectors = np.stack([np.sin(t), 0.7 * np.cos(t), 0.4 * np.sin(2 * t)], axis=-1)
    truth = ss.rotations.from_rotation_vectors(vectors)
    truth[-1] = truth[0]
    spline = ss.CubicSpline(t, at_random(CUBIC, truth, rng), CUBIC, bc_type="periodic")
    same = ss.CubicSpline(t, truth, "so:3", bc_type="periodic")
    assert CUBIC.distance(spline(t + 0.1), same(t + 0.1)).max() < 1e-7


def test_curves_that_end_at_another_representative_are_not_closed():
    t = np.linspace(0, 1, 13)
    quarter = ss.rotations.from_rotation_vectors(np.pi / 2 * t[:, None] * [0, 0, 1])
    given = at_random(CUBIC, quarter, np.random.default_rng(5))
    given[-1] = given[0]
    for fit in (
        lambda: ss.CubicSpline(t, given, CUBIC, bc_type="periodic"),
        lambda: ss.fit_many([(t, quarter), (t, given)], CUBIC, bc_type="periodic"),
        lambda: ss.make_smoothing_spline(t, given, CUBIC, bc_type="periodic"),
    ):
        raises(r"is not closed: .* end at points\[12\]", fit)
    four = np.concatenate([given[:-1]] * 4 + [given[:1]])
    spline = ss.CubicSpline(None, four, CUBIC, bc_type="periodic")
    assert spline.length() == pytest.approx(2 * np.pi)


# ---- noise ----


@pytest.mark.parametrize("criterion", ["gcv", "reml"])
def test_smoothing(criterion):
    rng = np.random.default_rng(6)
    t = times(rng, 200)
    clean = noisy(path(t), np.radians(1), rng)
    given = at_random(CUBIC, clean, rng)
    spline = ss.make_smoothing_spline(t, given, CUBIC, criterion=criterion)
    same = ss.make_smoothing_spline(t, CUBIC.unwrap(given), "so:3", criterion=criterion)
    assert np.array_equal(spline(X), same(X)) and spline.sigma == same.sigma
    assert disorientation(spline) < 2 and abs(np.degrees(spline.sigma) - 1) < 0.2
    with pytest.warns(UserWarning):
        naive = ss.make_smoothing_spline(t, given, "so:3")
    assert disorientation(naive) > 20
    knots = ss.make_lsq_spline(t, given, 12, CUBIC)
    assert disorientation(knots) < 2


def test_information_matrices_refer_to_the_given_points():
    rng = np.random.default_rng(7)
    t = np.linspace(0, 1, 60)
    clean = noisy(path(t), np.radians(1), rng)
    given = at_random(CUBIC, clean, rng)
    unwrapped = CUBIC.unwrap(given)
    axes = ss.rotations.velocities(given[:, None], np.eye(3))
    # The body of another representative is turned against that of the continuous one.
    turned = np.swapaxes(given, -1, -2) @ unwrapped
    weights = np.array([np.diag(own) for own in rng.uniform(0.2, 5, (60, 3))]) * 1e3
    spline = ss.make_smoothing_spline(t, given, CUBIC, 1e-3, weights=weights, frames=axes)
    bodies = ss.rotations.velocities(unwrapped[:, None], np.eye(3))
    same_weights = np.swapaxes(turned, -1, -2) @ weights @ turned
    same = ss.make_smoothing_spline(t, unwrapped, "so:3", 1e-3, weights=same_weights, frames=bodies)
    assert np.abs(spline(X) - same(X)).max() < 1e-9
    default = ss.make_smoothing_spline(t, given, CUBIC, 1e-3, weights=weights)
    other = ss.make_smoothing_spline(t, given, CUBIC, 1e-3, weights=weights, frames=SO3.frame(given))
    assert np.abs(default(X) - other(X)).max() < 1e-12


# ---- other spaces ----


def test_products_and_poses():
    rng = np.random.default_rng(9)
    t = np.linspace(0, 1, 30)
    position = np.stack([t, t**2, np.sin(t)], axis=-1)
    given = at_random(CUBIC, path(t), rng)
    spline = ss.CubicSpline(t, (given, position), "so:3/432 x r:3")
    assert spline.space == ss.Product(CUBIC, ss.Euclidean(3))
    assert np.array_equal(spline(X)[0], ss.CubicSpline(t, given, CUBIC)(X))
    assert spline.space.distance((given[0], position[0]), (given[0] @ GROUP[3], position[0])) < 1e-7
    assert ss.rotations.angular_velocity(spline, 0.5).shape == (3,)
    smooth = ss.make_smoothing_spline(t, (given, position), "so:3/432 x r:3")
    assert np.degrees(CUBIC.distance(smooth(X)[0], path(X)).max()) < 1
    # A box that looks the same after half turns.
    group = np.broadcast_to(np.eye(4), (4, 4, 4)).copy()
    group[:, :3, :3] = ss.rotations.point_group("222")
    box = ss.Quotient("se:3", group)
    poses = np.broadcast_to(np.eye(4), (30, 4, 4)).copy()
    poses[:, :3, :3], poses[:, :3, 3] = path(t), position
    seen = at_random(box, poses, rng)
    for fit in (ss.CubicSpline, ss.make_smoothing_spline):
        curve = fit(t, seen, box)
        assert np.abs(curve(X)[:, :3, 3] - np.stack([X, X**2, np.sin(X)], axis=-1)).max() < 0.01
        assert ss.poses.imu(curve, 0.5).specific_force.shape == (3,)


def test_bases_with_arbitrary_signs():
    rng = np.random.default_rng(10)
    t = np.linspace(0, 1, 25)
    a, b = rng.standard_normal((2, 12, 3))
    left = np.array([np.linalg.svd(a + s * b, full_matrices=False)[0] for s in t])
    signs = ss.Quotient(ss.Stiefel(3, 12), "signs")
    given = left * rng.choice([-1.0, 1.0], (25, 1, 3))
    spline = ss.CubicSpline(t, given, signs)
    assert np.sum(spline.points[1:] * spline.points[:-1], axis=1).min() > 0.5
    exact = np.linalg.svd(a + 0.51 * b, full_matrices=False)[0]
    assert signs.distance(spline(0.51), exact) < 1e-3
    raises(
        r"use|fit symspline.Quotient\(space, 'signs'\)", ss.CubicSpline, t, given, signs.cover, error=ss.CutLocusError
    )


# ---- files, and what is not available ----


def in_factors(value):
    return value if isinstance(value, tuple) else (value,)


@pytest.mark.parametrize("name", ["so:3/432", "432\\so:3/622", "so:3/432 x r:2", "pu:2", "sphere:2/[1.0,-1.0]"])
def test_files_and_pickles_of_quotients(name, tmp_path):
    space, rng = ss.space(name), np.random.default_rng(14)
    factors = space.factors if isinstance(space, ss.Product) else (space,)
    points = []
    for factor in factors:
        p = factor.random_point(rng)
        v = factor.random_tangent(rng, np.broadcast_to(p, (6, *factor.point_shape)))
        points.append(factor.exp(np.broadcast_to(p, v.shape), 0.05 * v))
    data = tuple(points) if len(points) > 1 else points[0]
    for options in ({}, {"lam": 0.1}):
        spline = (ss.make_smoothing_spline if options else ss.CubicSpline)(np.arange(6.0), data, space, **options)
        spline.save(tmp_path / "curve.npz")
        for other in (ss.load(tmp_path / "curve.npz"), pickle.loads(pickle.dumps(spline))):
            assert other == spline and other.space == space
            values = zip(in_factors(other(2.5)), in_factors(spline(2.5)), strict=True)
            assert all(np.array_equal(*pair) for pair in values)


# ---- warnings ----


def far():
    """Orientations whose steps are nearly all long."""
    rng = np.random.default_rng(15)
    t = np.linspace(0, 1, 40)
    return t, at_random(CUBIC, path(t), rng)


FITS = {
    "CubicSpline": lambda t, p, space: ss.CubicSpline(t, p, space),
    "fit": lambda t, p, space: ss.fit(t, p, space),
    "fit_many": lambda t, p, space: ss.fit_many([(t, p)], space),
    "fit_segments": lambda t, p, space: ss.fit_segments(t, p, space, max_gap=1),
    "HermiteSpline": lambda t, p, space: ss.HermiteSpline(t, p, np.zeros_like(p), space),
    "make_smoothing_spline": lambda t, p, space: ss.make_smoothing_spline(t, p, space),
    "make_lsq_spline": lambda t, p, space: ss.make_lsq_spline(t, p, 8, space),
    "smooth segments": lambda t, p, space: ss.fit_segments(t, p, space, max_gap=1, smooth=True),
    "BSpline": lambda t, p, space: ss.BSpline(np.r_[[0] * 3, t[1:-1], [1] * 3][:44], p, 3, space),
    "BezierCurve": lambda t, p, space: ss.BezierCurve(p, space),
    "product": lambda t, p, space: ss.CubicSpline(t, (p, p[:, 0]), ss.Product(space, ss.Euclidean(3))),
}


@pytest.mark.parametrize("fit", FITS.values(), ids=FITS.keys())
def test_long_steps_warn_wherever_curves_are_made(fit):
    t, given = far()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with suppress(ss.ConvergenceError):
            fit(t, given, SO3)
    found = [own for own in caught if own.category is ss.FarPointsWarning]
    assert len(found) == 1
    for remedy in ("Quotient", "unwrap", "lift"):
        assert remedy in str(found[0].message)
    with warnings.catch_warnings():
        warnings.simplefilter("error", ss.FarPointsWarning)
        fit(t, given, CUBIC)


@pytest.mark.parametrize("name", [name for name in FITS if name not in ("fit", "product")])
def test_every_fit_is_that_of_continuous_representatives(name, data):
    t, given, unwrapped = data
    curve, same = (FITS[name](t, points, space) for points, space in ((given, CUBIC), (unwrapped, SO3)))
    if name == "fit_many":
        (curve,), (same,) = curve, same
    x = np.linspace(*curve.domain, 301)
    assert CUBIC.distance(curve(x), same(x)).max() < 1e-7


def test_gates():
    rng = np.random.default_rng(12)
    pu = ss.space("pu:2")
    t = np.linspace(0, 1, 12)
    p = [np.eye(2, dtype=complex)]
    for _ in t[1:]:
        p.append(pu.cover.exp(p[-1], 0.2 * pu.cover.random_tangent(rng, p[-1])))
    spline = ss.CubicSpline(t, at_random(pu, np.array(p), rng), pu)
    same = ss.CubicSpline(t, p, "su:2")
    assert pu.distance(spline(X), same(X)).max() < 1e-7
    assert ss.quantum.hamiltonian(spline, 0.5).shape == (2, 2)
