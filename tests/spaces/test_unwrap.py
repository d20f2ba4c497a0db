"""Continuous representatives along paths and over grids."""

import warnings

import numpy as np
import pytest
from crystals import CUBIC, SO3, at_random, noisy, path
from refused import raises

import symspline as ss

SIGNS = ss.Quotient("sphere:1", [1, -1])


@pytest.fixture(autouse=True)
def every_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def steps(space, points):
    """Lengths of the steps between representatives along each axis of a grid."""
    axes = points.ndim - len(space.point_shape)
    parts = [np.moveaxis(points, axis, 0) for axis in range(axes)]
    return [space.distance(part[:-1], part[1:]) for part in parts]


def length(space, p, q):
    try:
        return space.distance(p, q)
    except ss.CutLocusError:
        return np.inf


def one_by_one(space, points):
    """Unwrap a path with a loop."""
    found = [points[0]]
    for point in points[1:]:
        every = space._moved_by(np.array([point] * space._group.size), np.arange(space._group.size))
        found.append(every[np.argmin([length(space.cover, found[-1], own) for own in every])])
    return np.array(found)


@pytest.mark.parametrize("name", ["so:3/432", "432\\so:3", "23\\so:3/622", "pu:3", "stiefel:2,5/signs", "se:3/G"])
def test_a_path_agrees_with_a_loop(name):
    rng = np.random.default_rng(0)
    if name == "se:3/G":
        group = np.broadcast_to(np.eye(4), (8, 4, 4)).copy()
        group[:, :3, :3] = ss.rotations.point_group("422")
        space = ss.Quotient("se:3", group)
    else:
        space = ss.space(name)
    p = [space.cover.random_point(rng)]
    for _ in range(24):
        v = space.cover.random_tangent(rng, p[-1])
        p.append(space.cover.exp(p[-1], 0.15 * v / np.abs(v).max()))
    given = at_random(space, np.array(p), rng)
    found = space.unwrap(given)
    assert np.abs(found - one_by_one(space, given)).max() < 1e-13
    assert np.array_equal(found[0], given[0])
    assert np.abs(space.cover.distance(found[1:], found[:-1]) - space.distance(given[1:], given[:-1])).max() < 1e-7


def test_batches_gaps_and_types():
    rng = np.random.default_rng(1)
    t = np.sort(rng.uniform(0, 1, (2, 3, 60)))
    truth = noisy(path(t), 0.01, rng)
    given = at_random(CUBIC, truth, rng)
    missing = rng.random(given.shape[:3]) < 0.2
    missing[1, 1] = True
    given[missing] = np.nan
    found = CUBIC.unwrap(given)
    assert np.array_equal(np.isnan(found).any(axis=(-2, -1)), missing)
    for index in np.ndindex(2, 3):
        kept = ~missing[index]
        own, expected = found[index][kept], truth[index][kept]
        if kept.any():
            assert np.array_equal(own, CUBIC.unwrap(given[index][kept]))
            # The whole path is one representative of the motion.
            moved = np.swapaxes(expected, -1, -2) @ own
            assert np.abs(moved - moved[0]).max() < 1e-13
    single = CUBIC.unwrap(given[0].astype(np.float32))
    assert single.dtype == np.float64 and np.nanmax(np.abs(single - found[0])) < 1e-6
    assert CUBIC.unwrap(np.zeros((0, 5, 3, 3))).shape == (0, 5, 3, 3)
    assert CUBIC.unwrap(np.full((4, 3, 3), np.nan)).shape == (4, 3, 3)


def test_a_point_between_two_representatives_is_named():
    angles = np.radians([0, 20, 64, 90, 93])
    points = ss.rotations.from_rotation_vectors(angles[:, None] * [0, 0, 1])
    with pytest.warns(UserWarning, match=r"points\[2\] has two .* distances from points\[1\]") as caught:
        CUBIC.unwrap(points)
    assert caught[0].message.node == 2 and "more nodes" not in str(caught[0].message)
    with pytest.warns(UserWarning, match=r"points\[1, 2\] \(and 1 more nodes\)") as caught:
        CUBIC.unwrap(np.stack([points[[0, 1, 1, 1, 1]], points, points]))
    assert caught[0].message.curve == (1,) and caught[0].filename == __file__
    # Within 10 % of each other: 40 and 50 degrees are not.
    CUBIC.unwrap(ss.rotations.from_rotation_vectors(np.radians([[0, 0, 0], [0, 0, 42]])))


# ---- grids ----


def field(shape, rng):
    """Orientations over a grid, without jumps."""
    axes = np.meshgrid(*(np.linspace(0, 1, n) for n in shape), indexing="ij")
    x, y = axes[0], axes[1] + (axes[2] if len(axes) > 2 else 0)
    vectors = np.stack([1.5 * np.sin(2 * x + y), 0.9 * np.cos(2 * y), 1.8 * x * y], axis=-1)
    return noisy(ss.rotations.from_rotation_vectors(vectors), 0.01, rng)


@pytest.mark.parametrize("shape, space", [((23, 31), CUBIC), ((13, 14, 15), CUBIC), ((1, 20), ss.space("622\\so:3"))])
def test_grids_become_continuous(shape, space):
    rng = np.random.default_rng(2)
    truth = field(shape, rng)
    found = space.unwrap(at_random(space, truth, rng), axes=len(shape))
    for own, least in zip(steps(SO3, found), steps(space, truth), strict=True):
        assert np.abs(own - least).max(initial=0) < 1e-7
    # Everywhere the same transformation of the truth.
    moved = np.swapaxes(truth, -1, -2) @ found if space is CUBIC else found @ np.swapaxes(truth, -1, -2)
    assert np.abs(moved - moved[(0,) * len(shape)]).max() < 1e-13


def test_the_tree_avoids_long_steps():
    """A grain boundary that ends within the map: a path across it would choose other representatives."""
    rng = np.random.default_rng(3)
    truth = field((20, 24), rng)
    # Each of these rows has noise of up to 40 degrees, which leads a path astray.
    rough = truth.copy()
    rough[7:9, 4:20] = noisy(rough[7:9, 4:20], 0.35, rng)
    given = at_random(CUBIC, rough, rng)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = CUBIC.unwrap(given, axes=2)
    still = np.ones((20, 24), bool)
    still[7:9, 4:20] = False
    moved = (np.swapaxes(truth, -1, -2) @ found)[still]
    assert np.abs(moved - moved[0]).max() < 1e-13


def test_each_part_of_a_masked_map_keeps_its_first_point():
    rng = np.random.default_rng(4)
    truth = field((30, 40), rng)
    given = at_random(CUBIC, truth, rng)
    given[:, 17] = np.nan
    given[12, :17] = np.nan
    found = CUBIC.unwrap(given, axes=2)
    for part in ((slice(12), slice(17)), (slice(13, None), slice(17)), (slice(None), slice(18, None))):
        own, expected = found[part], truth[part]
        assert np.array_equal(own[0, 0], given[part][0, 0])
        moved = np.swapaxes(expected, -1, -2) @ own
        assert np.abs(moved - moved[0, 0]).max() < 1e-13
    assert np.array_equal(np.isnan(found), np.isnan(given))


def directors(n, charge, hole=0):
    """Axes in the plane around a singular point, which turn by half a turn for the charge 1/2."""
    x, y = np.meshgrid(np.arange(n) - (n - 1) / 2, np.arange(n) - (n - 1) / 2, indexing="ij")
    angle = charge * np.arctan2(y, x)
    points = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    points[np.hypot(x, y) < hole] = np.nan
    return points


def test_open_loops_are_named():
    """Nematic directors around a disclination have no continuous signs."""
    rng = np.random.default_rng(6)
    given = at_random(SIGNS, directors(10, 0.5), rng)
    with pytest.warns(UserWarning, match="not continuous over the whole grid") as caught:
        found = SIGNS.unwrap(given, axes=2)
    (message,) = [str(own.message) for own in caught if "continuous" in str(own.message)]
    # The square of four nodes around the singular point.
    assert "around 1 squares of four neighbours" in message
    assert "(4, 4) – (5, 4) – (5, 5) – (4, 5)" in message
    jumps = sum(np.count_nonzero(np.sum(a * b, axis=-1) < 0) for a, b in _pairs(found))
    assert f"{jumps} pairs of neighbours" in message and jumps >= 4
    # A whole turn has continuous signs.
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "two representatives")
        SIGNS.unwrap(at_random(SIGNS, directors(10, 1, hole=1.5), rng), axes=2)


def _pairs(points):
    return [(points[:-1], points[1:]), (points[:, :-1], points[:, 1:])]


def test_open_loops_around_missing_nodes_are_named():
    rng = np.random.default_rng(7)
    with pytest.warns(UserWarning, match="loops around missing nodes, through the neighbours") as caught:
        SIGNS.unwrap(at_random(SIGNS, directors(12, 0.5, hole=3), rng), axes=2)
    assert len(caught) == 1


@pytest.mark.parametrize(
    "points, axes, message",
    [
        (np.eye(3), 1, "has 0 axes of nodes, but `axes` is 1"),
        (np.eye(3)[None], 2, "has 1 axes of nodes, but `axes` is 2"),
        (np.eye(3)[None], 0, "axes must be at least 1"),
        (2 * np.eye(3)[None], 1, "point 0"),
        (np.zeros((3, 2)), 1, "needs shape"),
    ],
)
def test_invalid_points_to_unwrap_raise(points, axes, message):
    raises(message, CUBIC.unwrap, points, axes=axes)
