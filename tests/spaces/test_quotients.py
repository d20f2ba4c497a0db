"""Quotients by finite groups: distances, logarithms, means, names and invalid groups."""

import copy
import pickle

import numpy as np
import pytest
from crystals import CUBIC, SO3, at_random, brute_distance, noisy, path
from refused import raises
from scipy.spatial.transform import Rotation

import symspline as ss

NAMES = [
    *("so:3/432", "so:3/622", "432\\so:3", "432\\so:3/622", "so:3/1", "sphere:2/432", "sphere:3/[1.0,-1.0]"),
    *("pu:2", "pu:4", "u:2/[[1.0,0.0],[0.0,1.0],[-1.0,0.0],[0.0,-1.0]]", "stiefel:2,4/signs", "gl:3/23", "o:3/32"),
]


def near(space, rng, count=6):
    """Points close together, as representatives at random."""
    p = space.cover.random_point(rng)
    v = space.cover.random_tangent(rng, np.broadcast_to(p, (count, *space.point_shape)))
    p = np.broadcast_to(p, v.shape)
    size = np.sqrt(np.sum(np.abs(v) ** 2, axis=tuple(range(1, v.ndim)), keepdims=True))
    return space.cover.exp(p, 0.1 * v / size)


@pytest.mark.parametrize("name", NAMES)
def test_names_and_pickles_restore_the_space(name):
    space = ss.space(name)
    assert str(space) == name and ss.space(str(space)) == space and hash(ss.space(name)) == hash(space)
    for other in (pickle.loads(pickle.dumps(space)), copy.deepcopy(space)):
        assert other == space and str(other) == name and type(other) is type(space)
    assert space != space.cover and space.cover != space
    assert isinstance(space, ss.Quotient) and isinstance(space, type(space.cover))
    assert (space.point_shape, space.dim, space.dtype) == (
        space.cover.point_shape,
        space.cover.dim,
        space.cover.dtype,
    )


def test_repr_is_the_constructor_call():
    for name in ("so:3/432", "432\\so:3", "432\\so:3/622", "sphere:3/[1.0,-1.0]", "pu:4", "stiefel:2,4/signs"):
        space = ss.space(name)
        known = {"Quotient": ss.Quotient, "space": ss.space} | vars(ss)
        assert eval(repr(space), known) == space
    many = ss.Quotient("gl:3", Rotation.create_group("I").as_matrix())
    assert repr(many) == "Quotient(GeneralLinear(3), <60 elements>)"


def test_groups_in_any_order_and_with_rounding_errors_have_the_name():
    group = Rotation.create_group("O")[::-1]
    assert ss.Quotient("so:3", group) == CUBIC
    rounded = np.round(ss.rotations.point_group("622"), 9)
    assert str(ss.Quotient("so:3", rounded)) == "so:3/622"
    left = ss.Quotient("so:3", group, left=True)
    assert left != CUBIC and left.group is None and CUBIC.left_group is None
    for found in (left.left_group, CUBIC.group):
        assert np.linalg.norm(found[:, None] - group.as_matrix(), axis=(-2, -1)).min(axis=1).max() < 1e-14


@pytest.mark.parametrize("left, right", [("1", "432"), ("432", "1"), ("23", "622")])
def test_distance_is_the_smallest_over_the_group(left, right):
    rng = np.random.default_rng(1)
    p, q = SO3.random_point(rng, (4, 7)), SO3.random_point(rng, 7)
    g, h = (ss.rotations.point_group(own) for own in (left, right))
    space = ss.Quotient("so:3", h, left=g)
    expected = brute_distance(p, np.broadcast_to(q, p.shape), g, h)
    assert np.abs(space.distance(p, q) - expected).max() < 1e-14
    assert isinstance(space.distance(p[0, 0], q[0]), float)


def test_small_distances_are_accurate():
    rng = np.random.default_rng(2)
    p = SO3.random_point(rng, 5)
    angles = np.array([0.0, 1e-12, 1e-9, 1e-6, 1e-3])
    q = at_random(CUBIC, p @ ss.rotations.from_rotation_vectors(angles[:, None] * [0.6, 0, 0.8]), rng)
    assert np.abs(CUBIC.distance(p, q) - angles).max() < 1e-15


@pytest.mark.parametrize("name", NAMES)
def test_operations_do_not_depend_on_representatives(name):
    space, rng = ss.space(name), np.random.default_rng(3)
    x = near(space, rng)
    p, q = x[:3], x[3:]
    v, other = space.cover.log(p, q), at_random(space, q, rng)
    assert np.abs(space.distance(p, other) - space.cover.distance(p, q)).max() < 1e-7
    assert np.abs(space.log(p, other) - v).max() < 1e-12
    assert np.abs(space.geodesic(p, other, 0.3) - space.cover.geodesic(p, q, 0.3)).max() < 1e-12
    if not isinstance(space, ss.Stiefel):
        assert np.abs(space.symmetry(p, other) - space.cover.symmetry(p, q)).max() < 1e-12
        # The result of `transport` is tangent at the given representative.
        moved = space.transport(p, other, v)
        space.check_tangent(other, moved)
        assert np.abs(space.transport(other, p, moved) - v).max() < 1e-12


def test_axes_agree_with_the_projective_plane():
    rng = np.random.default_rng(4)
    axes, plane = ss.Quotient("sphere:2", [1, -1]), ss.RealProjective(2)
    p, q = (ss.Sphere(2).random_point(rng, 50) for _ in range(2))
    assert np.abs(axes.distance(p, q) - plane.distance(p, q)).max() < 1e-14
    assert axes.injectivity_radius == pytest.approx(np.pi / 2)


def test_gates_have_no_phase():
    pu, rng = ss.space("pu:4"), np.random.default_rng(5)
    p, q = ss.SpecialUnitary(4).random_point(rng, (2, 8))
    phases = np.exp(0.5j * np.pi * rng.integers(0, 4, 8))[:, None, None]
    assert np.abs(pu.distance(p, q) - pu.distance(p, phases * q)).max() < 1e-13
    assert pu.distance(p, q).max() < ss.SpecialUnitary(4).distance(p, q).max()
    gates = ss.Quotient("su:4", np.array([1, 1j, -1, -1j]))
    assert gates == pu


def test_injectivity_radius_is_half_of_the_smallest_displacement():
    radii = {"432": 45, "622": 30, "222": 90, "32": 60, "1": 180}
    for symbol, degrees in radii.items():
        assert np.degrees(ss.Quotient("so:3", symbol).injectivity_radius) == pytest.approx(degrees)
    # Axes of rotations are fixed points on the sphere.
    assert ss.Quotient("sphere:2", "4").injectivity_radius == 0


def test_the_mean_is_that_of_the_representatives():
    rng = np.random.default_rng(6)
    grain = noisy(np.broadcast_to(path(0.4), (3, 40, 3, 3)), np.radians(5), rng)
    mean = CUBIC.mean(at_random(CUBIC, grain, rng))
    assert mean.shape == (3, 3, 3)
    nearest = CUBIC.distance(mean[:, None], grain)
    assert np.abs(np.mean(SO3.log(mean[:, None], _closest(mean[:, None], grain)), axis=1)).max() < 1e-13
    assert nearest.mean() < np.radians(10)
    assert np.degrees(CUBIC.distance(mean, path(0.4))).max() < 4


def _closest(p, q):
    each = q[..., None, :, :] @ ss.rotations.point_group("432")
    best = SO3.distance(p[..., None, :, :], each).argmin(axis=-1)
    return np.take_along_axis(each, best[..., None, None, None], axis=-3)[..., 0, :, :]


def test_invalid_points_have_no_mean():
    raises("at least one point", CUBIC.mean, np.zeros((0, 3, 3)))
    raises("finite", CUBIC.mean, np.full((2, 3, 3), np.nan))


# ---- groups ----


def test_groups_that_are_not_closed_name_the_pair():
    group = ss.rotations.point_group("432")
    with pytest.raises(ss.ValidationError, match=r"`group\[\d+\] @ group\[\d+\]` is not an element") as caught:
        ss.Quotient("so:3", group[:-1])
    i, j = (int(part.split("]")[0]) for part in str(caught.value).split("group[")[1:3])
    products = group[i] @ group[j] - group[:-1]
    assert np.abs(products).max(axis=(-2, -1)).min() > 0.1
    raises(r"`group\[1\] \* group\[1\]`", ss.Quotient, "su:3", [1, np.exp(2j * np.pi / 3)])


@pytest.mark.parametrize(
    "space, group, left, message",
    [
        ("so:3", np.diag([1.0, 1.0, -1.0])[None], False, "does not contain the identity|not an element"),
        ("so:3", [np.eye(3), np.diag([1.0, 1.0, -1.0])], False, "does not map SpecialOrthogonal.* isometrically"),
        ("so:3", [np.eye(3), np.eye(3)], False, r"`group\[0\]` and `group\[1\]` are equal"),
        ("so:3", np.eye(4)[None], False, r"`group` has shape \(1, 4, 4\)"),
        ("so:3", np.full((1, 3, 3), np.nan), False, r"`group\[0\]` is not finite"),
        ("so:3", np.eye(3)[None] * 1j, False, "must be an array of real numbers"),
        ("so:3", [1, -1], False, "isometrically"),
        ("so:3", [0.0], False, "does not contain the identity"),
        ("so:3", "m3m", False, "not the symbol of a point group"),
        ("so:4", "432", False, "point groups consist of 3 × 3 matrices"),
        ("spd:3", "432", False, "isometrically"),
        ("stiefel:2,4", "222", False, "point groups consist of 3 × 3"),
        ("stiefel:2,3", "4", True, None),
        ("stiefel:9,12", "signs", False, r"has 2\*\*9 elements"),
        ("so:3 x r:3", "432", False, "Make quotients of its factors"),
        ("so:3/432", "432", False, "Pass its space of representatives"),
    ],
)
def test_invalid_groups_raise(space, group, left, message):
    if message is None:
        ss.Quotient(space, group, left=left)
        return
    raises(message, ss.Quotient, space, group, left=left)


@pytest.mark.parametrize(
    "name", ["so:3/", "so:3/[[1", "so:3/[1,2]", "/432", "\\so:3", "pu:", "pu:0", "pu:2,3", "so:3/x"]
)
def test_invalid_names_raise(name):
    with pytest.raises(ss.ValidationError):
        ss.space(name)


# ---- orix ----


class Orix:
    """Objects with the attributes that those of orix have."""

    def __init__(self, data, symmetry=None, improper=None):
        self.data = np.asarray(data, float)
        self.improper = np.zeros(self.data.shape[:-1], int) if improper is None else improper
        if symmetry is not None:
            self.symmetry = symmetry


def quaternions(matrices):
    return ss.rotations.as_quaternions(matrices, scalar_first=True)


def symmetry(symbol, laue=False):
    data = quaternions(ss.rotations.point_group(symbol))
    if not laue:
        return Orix(data)
    return Orix(np.concatenate([data, -data]), improper=np.repeat([0, 1], len(data)))


def test_orix_symmetry_acts_on_the_left_of_orientations():
    rng = np.random.default_rng(7)
    o = SO3.random_point(rng, 9)
    orientations = Orix(2 * quaternions(o), symmetry("432", laue=True))
    space = ss.Quotient("so:3", orientations)
    assert str(space) == "432\\so:3"
    equivalent = ss.rotations.point_group("432")[5] @ o
    assert space.distance(orientations, equivalent).max() < 1e-7
    assert space.distance(orientations, np.swapaxes(equivalent, -1, -2)).max() > 0.1
    assert np.abs(ss.SpecialOrthogonal(3)._array(orientations, "points") - o).max() < 1e-14


def test_orix_misorientations_have_two_symmetries():
    # M = O₂ O₁⁻¹, where equivalent orientations are s O.
    rng = np.random.default_rng(8)
    first, second = ss.rotations.point_group("622")[7], ss.rotations.point_group("432")[11]
    o1, o2 = SO3.random_point(rng, (2, 5))
    m = o2 @ np.swapaxes(o1, -1, -2)
    other = second @ o2 @ np.swapaxes(first @ o1, -1, -2)
    space = ss.Quotient("so:3", Orix(quaternions(m), (symmetry("622"), symmetry("432"))))
    assert str(space) == "432\\so:3/622"
    assert space.distance(m, other).max() < 1e-7


def test_improper_rotations_are_not_points():
    raises(r"rotation \[1\] is improper", CUBIC.distance, Orix(np.eye(4)[:2], improper=np.array([0, 1])), np.eye(3))


def test_to_orix(monkeypatch):
    import sys
    from types import ModuleType

    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "orix", None)
        raises("pip install orix", ss.rotations.as_orix, np.eye(3), error=ImportError)
    package, module = ModuleType("orix"), ModuleType("orix.quaternion")
    module.Orientation = type("Orientation", (Orix,), {})
    module.Misorientation = type("Misorientation", (Orix,), {})
    monkeypatch.setitem(sys.modules, "orix", package)
    monkeypatch.setitem(sys.modules, "orix.quaternion", module)
    points = SO3.random_point(np.random.default_rng(9), 4)
    found = ss.rotations.as_orix(points, symmetry("432"))
    assert type(found) is module.Orientation
    assert np.abs(SO3._array(found, "points") - points).max() < 1e-14
    assert str(ss.Quotient("so:3", found)) == "432\\so:3"
    pair = ss.rotations.as_orix(points, (symmetry("3"), symmetry("432")))
    assert type(pair) is module.Misorientation
