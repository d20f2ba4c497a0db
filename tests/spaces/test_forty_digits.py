"""The geometry against formulas with 40 digits."""

import mpmath as mp
import numpy as np
import pytest
from cases import EPS, QUOTIENTS, loop_over, unit_tangent
from exact import DIGITS, Poses, PositiveDefinite, Sphere, Subspaces, Unitary, doubles, exact, transvection

import symspline as ss

SEED = 40


@pytest.fixture(autouse=True)
def digits():
    with mp.workdps(DIGITS):
        yield


def plain(space, x):
    """Subspaces as projectors."""
    return x @ np.swapaxes(x, -1, -2).conj() if isinstance(space, QUOTIENTS) else x


ROOT = np.sqrt(2)


def compare(space, geometry, p, v, x, scale=1.0, size=1.0, log_size=1.0):
    """Exp, transvection, log and distance, each from doubles as they are.

    Args:
        size: by how much rounding counts, in points.
        log_size: the same for the direction of logarithms.
    """
    exact_p, exact_x = geometry.point(exact(p)), geometry.point(exact(x))
    q = doubles(geometry.exp(exact_p, exact(v)), p)
    allowed = 20 * EPS * size
    assert np.abs(plain(space, space.exp(p, v)) - plain(space, q)).max() <= allowed * np.abs(q).max()
    moved = doubles(transvection(geometry, exact_p, exact(v), exact_x), x)
    difference = np.abs(plain(space, space.transvection(p, v, x)) - plain(space, moved)).max()
    assert difference <= allowed * np.abs(moved).max()
    exact_q = geometry.point(exact(q))
    log = doubles(geometry.log(exact_p, exact_q), v)
    allowed *= max(1.0, space.norm(p, v))
    assert np.abs(space.log(p, q) - log).max() <= allowed * log_size * max(1.0, np.abs(p).max())
    assert abs(space.distance(p, q) - float(geometry.distance(exact_p, exact_q)) * scale) <= allowed


LENGTHS = [1e-12, 1e-4, 0.6, 1.5]
GAPS = [0.5, 1e-4, 1e-8, 1e-14]


@loop_over("length", [*LENGTHS, 3.0, *(np.pi - np.array(GAPS))])
@pytest.mark.parametrize("n", [1, 2, 5])
def test_sphere(n, length, rng):
    space = ss.Sphere(n)
    p, x = space.random_point(rng, 2)
    # Two points as they are have a direction, however near to the antipode: q + p is exact.
    compare(space, Sphere(), p, length * unit_tangent(space, p, rng), x)


@pytest.mark.slow
@loop_over("length", [*LENGTHS, 2.5])
@pytest.mark.parametrize("name", ["u:3", "su:3", "so:3", "so:5", "o:4"])
def test_groups(name, length, rng):
    space = ss.space(name)
    p, x = space.random_point(rng, 2)
    if name == "o:4":
        x = p @ ss.SpecialOrthogonal(4).random_point(rng)
    v = length * unit_tangent(space, p, rng)
    compare(space, Unitary(), p, v, x, 1 / ROOT if name[0] in "so" and name[:2] != "su" else 1.0)


def unitary_velocity(p, turn, phases):
    """p Ω for the skew-Hermitian matrix Ω with given eigenphases and eigenvectors."""
    return p @ (turn * (1j * np.array(phases))) @ turn.conj().T


def rotation_velocity(p, turn, angles):
    """p Ω for the skew-symmetric matrix Ω that turns planes of the columns of ``turn`` by angles."""
    omega = np.zeros_like(p)
    for i, angle in enumerate(angles):
        omega[2 * i, 2 * i + 1], omega[2 * i + 1, 2 * i] = -angle, angle
    return p @ turn @ omega @ turn.T


@loop_over("gap", GAPS)
@pytest.mark.parametrize("rest", [[0.7, -1.9], [0.7, 0.7, 0.7], [1e-9, 3.0, -3.0]])
def test_unitary_near_pi(gap, rest, rng):
    space = ss.Unitary(1 + len(rest))
    p, x, turn = space.random_point(rng, 3)
    # Neither directions nor angles fade there: the eigenvalue near −1 is alone.
    v = unitary_velocity(p, turn, [np.pi - gap, *rest])
    compare(space, Unitary(), p, space.project_tangent(p, v), x)


@loop_over("gap", GAPS)
@pytest.mark.parametrize(("n", "rest"), [(3, []), (4, [0.3]), (4, [2.0]), (5, [0.3]), (8, [0.3, 0.1, 2.0])])
def test_rotations_near_pi(n, rest, gap, rng):
    space = ss.SpecialOrthogonal(n)
    p, x, turn = space.random_point(rng, 3)
    v = rotation_velocity(p, turn, [np.pi - gap, *rest])
    compare(space, Unitary(), p, space.project_tangent(p, v), x, 1 / ROOT)


@pytest.mark.parametrize("gap", [1.0, 1e-2, 1e-4, 1e-8])
def test_special_unitary_past_pi(gap, rng):
    """Phases that add up to zero may be larger than π, where the principal logarithm has a trace."""
    space = ss.SpecialUnitary(3)
    p, turn = space.random_point(rng), ss.Unitary(3).random_point(rng)
    third = (2 * np.pi - gap) / 3
    v = space.project_tangent(p, unitary_velocity(p, turn, [2 * third, -third, -third]))
    q = doubles(Unitary().exp(Unitary.point(exact(p)), exact(v)), p)
    assert np.abs(space.exp(p, v) - q).max() <= 20 * EPS
    # Two phases that are 2π apart less the gap belong to one eigenvalue.
    assert np.abs(space.log(p, q) - v).max() <= 20 * EPS / min(1.0, gap)
    assert abs(space.distance(p, q) - third * np.sqrt(6)) <= 50 * EPS


@loop_over("length", LENGTHS)
@pytest.mark.parametrize("name", ["gr:3,4", "gr:2,6", "cgr:2,4"])
def test_subspaces(name, length, rng):
    space = ss.space(name)
    p, x = space.random_point(rng, 2)
    compare(space, Subspaces(), p, length * unit_tangent(space, p, rng), x, log_size=1 / (np.pi / 2 - length))


@loop_over("gap", GAPS)
@pytest.mark.parametrize("name", ["gr:2,4", "cgr:2,4"])
def test_subspaces_near_a_right_angle(name, gap, rng):
    space = ss.space(name)
    p, x = space.random_point(rng, 2)
    u, _, w = np.linalg.svd(space.random_tangent(rng, p), full_matrices=False)
    v = space.project_tangent(p, (u * [np.pi / 2 - gap, 0.7]) @ w)
    # Real principal vectors have no phase that could fade.
    compare(space, Subspaces(), p, v, x, log_size=1 / gap if name[0] == "c" else 1.0)


@pytest.mark.slow
@loop_over("condition", [1.0, 1e6, 1e12])
@loop_over("length", [1e-8, 0.1, 4.0])
@pytest.mark.parametrize("name", ["spd:3", "hpd:3"])
def test_positive_definite(name, length, condition, rng):
    space = ss.space(name)
    turns = ss.space("so:3" if name == "spd:3" else "u:3").random_point(rng, 2)
    p, x = space.project((turns * condition ** -np.linspace(0, 1, 3)) @ np.swapaxes(turns, -1, -2).conj())
    v = length * unit_tangent(space, p, rng)
    size = max(np.linalg.cond(y) for y in (p, x, space.exp(p, v)))
    compare(space, PositiveDefinite(), p, v, x, size=size)


@loop_over("length", [*LENGTHS, 3.0])
@pytest.mark.parametrize("name", ["se:2", "se:3"])
def test_poses(name, length, rng):
    space = ss.space(name)
    p, x = space.random_point(rng, 2)
    compare(space, Poses(), p, length * unit_tangent(space, p, rng), x, size=np.abs([p, x]).max())
