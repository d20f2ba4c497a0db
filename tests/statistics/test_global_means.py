"""Means and medians of spread points: global minima in any order, warnings, and matrices in mixed units."""

import warnings

import numpy as np
import pytest

import symspline as ss

TORUS = ss.space("torus:1")


def wrap(angles):
    return (angles + np.pi) % (2 * np.pi) - np.pi


def lowest_on_the_grid(angles, weights, power):
    """The lowest point of a grid and its sum, which the exact result must not exceed."""
    grid = np.linspace(-np.pi, np.pi, 4_001)
    sums = weights @ np.abs(wrap(angles[:, None] - grid)) ** power
    return grid[np.argmin(sums)], sums.min()


CIRCLES = {
    "torus:1": lambda a: a[:, None],
    "sphere:1": lambda a: np.stack([np.cos(a), np.sin(a)], -1),
    "so:2": lambda a: np.stack([np.stack([np.cos(a), -np.sin(a)], -1), np.stack([np.sin(a), np.cos(a)], -1)], -2),
    "u:1": lambda a: np.exp(1j * a)[:, None, None],
    # Axes turn by half the angle, and signs are arbitrary.
    "rp:1": lambda a: np.stack([np.cos(a / 2), np.sin(a / 2)], -1) * np.where(a > 1, -1, 1)[:, None],
    "gr:1,2": lambda a: np.stack([np.cos(a / 2), np.sin(a / 2)], -1)[..., None],
}


def spread_angles(seed):
    """Angles in two clusters and alone, not in [−π, π), every third set in tens of degrees, with opposite ones."""
    rng = np.random.default_rng(seed)
    n = rng.integers(1, 40)
    angles = 7 + rng.normal(0, rng.uniform(0.2, 3), n) + 2.5 * (rng.random(n) < 0.3)
    if seed % 3 == 0:
        angles = np.radians(np.round(np.degrees(angles), -1))
    return angles, rng.uniform(0.1, 2, n) if seed % 2 else np.ones(n), rng


@pytest.mark.filterwarnings("ignore::symspline.AmbiguousMeanWarning")
@pytest.mark.parametrize("name", CIRCLES)
@pytest.mark.parametrize(("method", "power"), [("mean", 2), ("median", 1)])
def test_circles_have_exact_means_and_medians(name, method, power):
    space, point = ss.space(name), CIRCLES[name]
    unit = np.pi / space.injectivity_radius
    for seed in range(8):
        angles, weights, rng = spread_angles(seed)
        points = point(angles)
        found = getattr(space, method)(points, weights)
        least = lowest_on_the_grid(angles, weights, power)[1]
        assert weights @ (unit * space.distance(found, points)) ** power <= least * (1 + 1e-12) + 1e-12
        order = rng.permutation(len(angles))
        again = getattr(space, method)(points[order], weights[order])
        assert space.distance(found, again) < 1e-12


@pytest.mark.filterwarnings("ignore::symspline.AmbiguousMeanWarning")
def test_angles_of_a_torus_and_factors_of_a_product_are_exact():
    angles, weights, _ = spread_angles(1)
    both = np.stack([angles, angles[::-1] + 1], -1)
    found = ss.Torus(2).mean(both, weights)
    for axis in range(2):
        sums = weights @ wrap(both[:, axis, None] - found[axis]) ** 2
        assert sums <= lowest_on_the_grid(both[:, axis], weights, 2)[1] * (1 + 1e-12)
    turned, number = ss.space("torus:1 x r:1").mean((angles[:, None], angles[:, None]), weights)
    assert wrap(turned - TORUS.mean(angles[:, None], weights)) == pytest.approx(0, abs=1e-14)
    assert number == pytest.approx(np.average(angles, weights=weights), rel=1e-14)


def on_the_sphere(rng, count, spread):
    v = rng.normal(0, spread, (count, 2))
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.concatenate([np.cos(length), np.sinc(length / np.pi) * v], -1)


@pytest.mark.filterwarnings("ignore::symspline.AmbiguousMeanWarning")
@pytest.mark.parametrize(("method", "power"), [("mean", 2), ("median", 1)])
def test_directions_axes_and_rotations_have_global_minima_in_any_order(method, power):
    """No point of a fine random set has a lower sum."""
    rng = np.random.default_rng(4)
    sets = [(ss.Sphere(2), on_the_sphere(rng, 12, 1.0)) for _ in range(2)]
    sets += [(ss.RealProjective(2), on_the_sphere(rng, 10, 0.5) * rng.choice([-1, 1], (10, 1))) for _ in range(2)]
    axes = ss.Quotient("sphere:2", [1, -1])
    sets += [(axes, on_the_sphere(rng, 10, 0.5) * rng.choice([-1, 1], (10, 1)))]
    turns = ss.SpecialOrthogonal(3)
    eye = np.tile(np.eye(3), (10, 1, 1))
    sets += [(turns, turns.exp(eye, 0.9 * turns.random_tangent(rng, eye)))]
    for space, points in sets:
        found = getattr(space, method)(points)
        least = np.sum(space.distance(found, points) ** power)
        others = space.random_point(rng, 500)
        sums = np.sum(space.distance(others[:, None], points) ** power, axis=1)
        assert least <= sums.min()
        again = getattr(space, method)(points[rng.permutation(len(points))])
        assert space.distance(found, again) < 1e-7


@pytest.mark.parametrize("name", ["torus:1", "so:3"])
def test_two_minima_of_nearly_the_same_height_warn_once(name):
    rng = np.random.default_rng(5)
    space = ss.space(name)
    centre = space.random_point(rng)
    at = np.repeat(centre[None], 8, 0)
    near = space.exp(at, 0.01 * space.random_tangent(rng, at))
    ahead = space.random_tangent(rng, centre)
    opposite = space.exp(centre, 0.995 * space.injectivity_radius / space.norm(centre, ahead) * ahead)
    far = space.exp(space.project(np.repeat(opposite[None], 8, 0)), 0.0 * at)
    points = np.concatenate([near, far])
    with pytest.warns(ss.AmbiguousMeanWarning, match=r"the mean is ambiguous.* distance .* larger") as caught:
        space.mean(points)
    assert len(caught) == 1
    with pytest.warns(ss.AmbiguousMeanWarning, match="of group 1 is ambiguous"):
        space.mean(np.stack([np.concatenate([near, near]), points]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        space.mean(near)
        space.median(near)


def test_the_warning_names_the_second_of_three_minima():
    """Rotations about one axis at three angles: the sum of the third minimum is 6 % larger than the lowest."""
    counts, angles = np.array([51, 50, 45]), np.radians([0, 120, 240])
    grid = np.linspace(0, 2 * np.pi, 100_001)
    sums = np.sum(counts * ((grid[:, None] - angles + np.pi) % (2 * np.pi) - np.pi) ** 2, axis=1)
    low = np.flatnonzero((sums[1:-1] < sums[:-2]) & (sums[1:-1] <= sums[2:])) + 1
    first, second, third = np.sort(sums[low])
    assert third > 1.05 * first
    turns = ss.rotations.from_rotation_vectors(np.repeat(angles, counts)[:, None] * [0, 0, 1])
    with pytest.warns(ss.AmbiguousMeanWarning, match=f"Its sum is only {100 * (second / first - 1):.2g} % larger"):
        ss.SpecialOrthogonal(3).mean(turns)


def test_an_exactly_opposite_pair_does_not_prevent_a_mean():
    points = np.concatenate([on_the_sphere(np.random.default_rng(6), 20, 0.2), [[0, 0, 1.0], [0, 0, -1.0]]])
    found = ss.Sphere(2).mean(points)
    assert ss.Sphere(2).distance(found, [1, 0, 0]) < 0.2
    angles = np.radians([10.0, 190, 20, 0, 30])
    for order in ([0, 1, 2, 3, 4], [2, 0, 1, 3, 4], [1, 4, 0, 3, 2]):
        assert np.degrees(TORUS.mean(angles[order, None])) == pytest.approx(50, abs=1e-12)


def test_poses_start_from_the_mean_rotation():
    """For rotations about one axis, the mean does not depend on the first pose."""
    angles, _, rng = spread_angles(5)
    turns = ss.rotations.from_rotation_vectors(angles[:, None] * [0, 0, 1])
    poses = ss.poses.join(turns, rng.normal(size=(len(angles), 3)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.AmbiguousMeanWarning)
        for order in (np.arange(len(angles)), np.argsort(angles)):
            found = ss.SpecialEuclidean(3).mean(poses[order])
            assert ss.SpecialOrthogonal(3).distance(found[:3, :3], ss.SpecialOrthogonal(3).mean(turns)) < 1e-8


def definite(rng, count, size, dtype=float):
    s = rng.normal(size=(count, size, size)) + (1j * rng.normal(size=(count, size, size)) if dtype is complex else 0)
    w, v = np.linalg.eigh((s + np.swapaxes(s.conj(), 1, 2)) / 2)
    return (v * np.exp(w)[:, None]) @ np.swapaxes(v.conj(), 1, 2)


def scales(rng, exponent, size):
    d = 10.0 ** rng.uniform(-exponent, exponent, size)
    d[0], d[-1] = 10.0**exponent, 10.0**-exponent
    return d


@pytest.mark.parametrize("method", ["mean", "median"])
@pytest.mark.parametrize("exponent", [2, 4, 8])
def test_means_of_matrices_do_not_depend_on_units(method, exponent):
    """The affine-invariant mean of D A D is D mean(A) D."""
    rng = np.random.default_rng(exponent)
    for space, dtype in ((ss.SymmetricPositiveDefinite(4), float), (ss.HermitianPositiveDefinite(3), complex)):
        points = definite(rng, 9, space.point_shape[0], dtype)
        d = scales(rng, exponent, space.point_shape[0])
        square = np.outer(d, d)
        weights = rng.uniform(0.1, 2, 9)
        compute = getattr(space, method)
        right = compute(points, weights)
        # Medians converge linearly.
        tol = 1e-12 if method == "mean" else 1e-10
        assert space.distance(compute(points * square, weights) / square, right) < tol
        order = rng.permutation(9)
        assert space.distance(compute((points * square)[order], weights[order]) / square, right) < tol
        # The gradient vanishes: an independent check in the original units.
        if method == "mean":
            logs = space.log(np.broadcast_to(right, points.shape), points)
            assert np.abs(np.tensordot(weights, logs, 1)).max() < 1e-10


@pytest.mark.filterwarnings("ignore::symspline.AmbiguousMeanWarning")
def test_rounding_errors_of_spread_directions_do_not_grow():
    """Some directions are farther than a quarter turn from the mean, where logarithms amplify errors of its length."""
    sphere = ss.Sphere(2)
    for seed in range(12):
        points = on_the_sphere(np.random.default_rng(seed), 24, 1.5)
        mean = sphere.mean(points)
        gradient = sphere.log(np.broadcast_to(mean, points.shape), points).mean(axis=0)
        assert np.linalg.norm(gradient) < 1e-11 and abs(np.linalg.norm(mean) - 1) < 1e-15
