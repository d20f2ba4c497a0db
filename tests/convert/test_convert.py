"""Conversions between coordinates: round trips, distances, and invalid input."""

from functools import partial

import numpy as np
import pytest
from cases import loop_over
from refused import raises
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline import convert, rotations

SEED = 7

EPS = np.finfo(float).eps
# Distances from the middle; in the ball 1 − |y| is some 2e^−d.
DISTANCES = [*(10.0 ** np.arange(-12, 1)), 3.0, 10.0, 17.0, 30.0]


def far_points(n, distance, rng):
    """Points of the hyperboloid at a distance from its middle, some straight up and down."""
    direction = rng.standard_normal((40, n))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    direction[0], direction[1] = np.eye(n)[-1], -np.eye(n)[-1]
    rest = np.sinh(distance) * direction
    return np.concatenate([np.hypot(1, np.linalg.norm(rest, axis=-1))[:, None], rest], axis=-1)


@pytest.mark.parametrize("n", [1, 2, 5])
@loop_over("distance", DISTANCES)
def test_models_there_and_back(n, distance, rng):
    x = far_points(n, distance, rng)
    size = np.sinh(distance)
    # A place near the boundary of the ball is known to ε, which is ε e^d of its distance from there.
    near = 10 * EPS * np.exp(distance)
    y = convert.hyperboloid_to_ball(x)
    assert np.abs(convert.ball_to_hyperboloid(y) - x)[:, 1:].max() <= near * size
    assert np.abs(np.linalg.norm(y, axis=-1) - np.tanh(distance / 2)).max() <= 4 * EPS * np.tanh(distance / 2)
    z = convert.hyperboloid_to_half_space(x)
    back = convert.half_space_to_hyperboloid(z)
    assert np.abs(back - x)[:, 1:].max() <= 10 * EPS * max(size, 1.0)
    heights = convert.hyperboloid_to_half_space(back)[:, -1] / z[:, -1]
    assert np.abs(heights - 1).max() <= 20 * EPS
    assert np.abs(convert.half_space_to_ball(z) - y).max() <= 10 * EPS
    there = convert.ball_to_half_space(y)
    # In the half-space numbers are large towards infinity, and small near the ground.
    assert np.abs(there - z).max(axis=-1) == pytest.approx(0, abs=near * max(1.0, z.max()))
    assert np.abs(convert.half_space_to_ball(there) - y).max() <= 10 * EPS


@pytest.mark.parametrize("distance", [1e-6, 1e-2, 1.0, 10.0, 300.0])
def test_half_space_holds_what_is_far_up_and_down(distance):
    z = np.array([[0.0, np.exp(distance)], [0.0, np.exp(-distance)], [np.exp(distance / 2), 1.0]])
    back = convert.hyperboloid_to_half_space(convert.half_space_to_hyperboloid(z))
    assert np.abs(back / np.where(z == 0, 1, z) - (z != 0)).max() <= 10 * EPS


@pytest.mark.parametrize("n", [1, 2, 4])
def test_models_have_the_same_distances(n, rng):
    space = ss.Hyperbolic(n)
    for distance in (1e-6, 1e-3, 1.0, 3.0):
        p, q = far_points(n, distance, rng), rng.permutation(far_points(n, distance, rng))
        d = space.distance(p, q)
        # 4 sinh²(d/2) in the metric of either model.
        chord = 2 * np.sinh(d / 2)
        a, b = convert.hyperboloid_to_ball(p), convert.hyperboloid_to_ball(q)
        room = (1 - np.sum(a**2, axis=-1)) * (1 - np.sum(b**2, axis=-1))
        # Differences of places, which are rounded to ε near the boundary.
        allowed = 20 * EPS * np.exp(distance)
        between = 2 * np.linalg.norm(a - b, axis=-1) / np.sqrt(room)
        assert np.abs(between - chord).max() <= allowed * max(1.0, chord.max())
        a, b = convert.hyperboloid_to_half_space(p), convert.hyperboloid_to_half_space(q)
        across = np.linalg.norm(a - b, axis=-1) / np.sqrt(a[:, -1] * b[:, -1])
        assert np.abs(across - chord).max() <= allowed * np.exp(distance)


def test_middle_and_infinity():
    middle = [1.0, 0.0, 0.0]
    assert np.array_equal(convert.hyperboloid_to_ball(middle), [0, 0])
    assert np.array_equal(convert.hyperboloid_to_half_space(middle), [0, 1])
    assert np.array_equal(convert.half_space_to_ball([0.0, 1.0]), [0, 0])
    assert np.array_equal(convert.ball_to_half_space([0.0, 0.0]), [0, 1])
    assert np.abs(convert.half_space_to_ball([[3.0, 1e12], [0.0, 1e-12]]) - [[0, 1], [0, -1]]).max() < 1e-11


@pytest.mark.parametrize("field", [float, complex])
@pytest.mark.parametrize(("k", "n"), [(1, 2), (2, 5), (3, 4), (1, 8)])
def test_projectors_there_and_back(k, n, field, rng):
    space = (ss.Grassmannian if field is float else ss.ComplexGrassmannian)(k, n)
    basis = space.random_point(rng, (4, 5))
    p = convert.basis_to_projector(basis)
    assert p.shape == (4, 5, n, n) and p.dtype == field
    assert np.abs(p @ p - p).max() <= 10 * EPS and np.array_equal(p, np.swapaxes(p, -1, -2).conj())
    back = convert.projector_to_basis(p)
    space.check_point(back)
    assert back.shape == basis.shape and back.dtype == basis.dtype
    assert np.abs(convert.basis_to_projector(back) - p).max() <= 20 * EPS
    assert space.distance(back, basis).max() <= 20 * EPS
    turn = np.linalg.qr(rng.standard_normal((k, k)).astype(field) + (0.3j if field is complex else 0)).Q
    assert np.abs(convert.basis_to_projector(basis @ turn) - p).max() <= 20 * EPS
    # |P − Q|² is 2 Σ sin² θᵢ.
    q = space.exp(basis, 1e-5 * space.random_tangent(rng, basis))
    far = np.linalg.norm(convert.basis_to_projector(q) - p, axis=(-2, -1)) / np.sqrt(2)
    assert far == pytest.approx(space.distance(basis, q), rel=1e-8)


@pytest.mark.parametrize("field", [float, complex])
@pytest.mark.parametrize("n", [2, 3, 8])
def test_states_there_and_back(n, field, rng):
    psi = rng.standard_normal((50, n)) + (1j * rng.standard_normal((50, n)) if field is complex else 0)
    psi /= np.linalg.norm(psi, axis=-1, keepdims=True)
    # Small components too.
    psi[:n] = np.eye(n) + 1e-9 * psi[:n]
    psi /= np.linalg.norm(psi, axis=-1, keepdims=True)
    rho = convert.state_to_density(psi)
    assert np.abs(np.trace(rho, axis1=1, axis2=2) - 1).max() <= 10 * EPS
    back = convert.density_to_state(rho)
    assert back.dtype == field
    phase = np.sum(back.conj() * psi, axis=-1, keepdims=True)
    assert np.abs(back * phase - psi).max() <= 10 * EPS
    assert np.abs(convert.state_to_density(back) - rho).max() <= 10 * EPS
    largest = np.take_along_axis(back, np.abs(back).argmax(axis=-1)[:, None], axis=-1)
    assert (largest.real > 0).all() and np.abs(largest.imag).max() == 0
    # For pure states the fidelity tr ρσ is cos² of the distance.
    space = ss.ComplexProjective(n - 1)
    fidelity = np.einsum("aij,bji->ab", rho, rho).real
    assert np.cos(space.distance(psi[:, None], psi)) ** 2 == pytest.approx(fidelity, abs=20 * EPS)


SMALL = 10.0 ** np.r_[-300:-10:40, -12:1]
ANGLES = [0.0, *SMALL, 2.0, 3.0, *(np.pi - 10.0 ** np.arange(-15, 0)), np.pi]


def axes(rng):
    """Axes in all directions, along coordinates, and almost."""
    some = np.concatenate([rng.standard_normal((40, 3)), np.eye(3), -np.eye(3), np.eye(3) + 1e-9, 1 - np.eye(3)])
    return some / np.linalg.norm(some, axis=-1, keepdims=True)


@loop_over("angle", ANGLES)
@pytest.mark.parametrize("scalar_first", [True, False])
def test_quaternions_there_and_back(angle, scalar_first, rng):
    q = np.concatenate([np.full((52, 1), np.cos(angle / 2)), np.sin(angle / 2) * axes(rng)], axis=-1)
    given = q if scalar_first else np.roll(q, -1, axis=-1)
    r = rotations.from_quaternions(given, scalar_first=scalar_first)
    ss.SpecialOrthogonal(3).check_point(r)
    assert np.abs(np.swapaxes(r, -1, -2) @ r - np.eye(3)).max() <= 10 * EPS
    assert np.abs(r - Rotation.from_quat(np.roll(q, -1, axis=-1)).as_matrix()).max() <= 10 * EPS
    back = rotations.as_quaternions(r, scalar_first=scalar_first)
    scalar = back[:, 0 if scalar_first else 3]
    assert (scalar >= 0).all()
    # At the angle π both signs are right.
    sign = np.sign(np.sum(back * given, axis=-1, keepdims=True))
    assert angle > 3.14 or (sign > 0).all()
    error = np.abs(sign * back - given)
    assert error.max() <= 10 * EPS
    vector = error[:, 1:] if scalar_first else error[:, :3]
    assert vector.max() <= 10 * EPS * np.sin(angle / 2), "the axis of a small rotation"
    theirs = Rotation.from_matrix(r).as_quat(scalar_first=scalar_first)
    assert np.minimum(np.abs(back - theirs), np.abs(back + theirs)).max() <= 10 * EPS


@loop_over("order", [None, 1, 0, "wxyz", "xyzw", np.True_])
@pytest.mark.parametrize(
    "call, value", [(rotations.as_quaternions, np.eye(3)), (rotations.from_quaternions, [1.0, 0, 0, 0])]
)
def test_quaternion_order_is_required(call, value, order):
    match = r"required.* scalar_first=True for \(w, x, y, z\) or scalar_first=False for \(x, y, z, w\) as in SciPy"
    raises(match, call, value, scalar_first=order)
    raises(match, call, value)
    with pytest.raises(TypeError):
        call(value, True)


SINGLE = [
    (convert.hyperboloid_to_ball, [1.25, 0.75, 0.0], {}),
    (convert.ball_to_hyperboloid, [0.1, 0.2], {}),
    (convert.hyperboloid_to_half_space, [1.25, 0.75, 0.0], {}),
    (convert.half_space_to_hyperboloid, [0.1, 0.2], {}),
    (convert.ball_to_half_space, [0.1, 0.2], {}),
    (convert.half_space_to_ball, [0.1, 0.2], {}),
    (convert.basis_to_projector, [[0.6], [0.8]], {}),
    (convert.projector_to_basis, [[0.36, 0.48], [0.48, 0.64]], {}),
    (convert.state_to_density, [0.6, 0.8], {}),
    (convert.density_to_state, [[0.36, 0.48], [0.48, 0.64]], {}),
    (convert.basis_to_reflection, [[0.75], [1.25]], {"negative": 1}),
    (convert.reflection_to_basis, [[-2.125, 1.875], [-1.875, 2.125]], {"negative": 1}),
    (rotations.as_quaternions, np.eye(3), {"scalar_first": True}),
    (rotations.from_quaternions, [1.0, 0.0, 0.0, 0.0], {"scalar_first": True}),
]
# Those of totally geodesic parts have tests of their own, in tests/spaces.
PARTS = {
    *("siegel_to_positive_definite", "positive_definite_to_siegel"),
    *("quaternions_to_subspace", "subspace_to_quaternions"),
}
each = pytest.mark.parametrize(("call", "value", "order"), SINGLE, ids=[case[0].__name__ for case in SINGLE])


def test_all_functions_are_here():
    assert {case[0].__name__ for case in SINGLE} - set(rotations.__all__) | PARTS == set(convert.__all__)


@each
def test_leading_axes_stay(call, value, order):
    one = call(value, **order)
    many = call(np.broadcast_to(value, (2, 3, *np.shape(value))), **order)
    assert many.shape == (2, 3, *one.shape)
    # BLAS may add in another order for stacks.
    assert np.abs(many - one).max() <= 4 * EPS
    if call not in (convert.projector_to_basis, convert.reflection_to_basis):
        assert call(np.broadcast_to(value, (0, *np.shape(value))), **order).shape == (0, *one.shape)


@each
def test_single_precision_is_enough(call, value, order):
    """Points of single precision are off by 1e-7; what comes out is a point to the last digits."""
    exact = call(value, **order)
    rough = call(np.asarray(value, np.float32), **order)
    assert rough.dtype == np.float64
    assert np.minimum(np.abs(rough - exact), np.abs(rough + exact)).max() <= 1e-6
    if call is convert.basis_to_projector:
        assert np.abs(rough @ rough - rough).max() <= 4 * EPS


@each
def test_error_names_the_first_invalid_entry(call, value, order):
    many = np.tile(value, (2, 3, *(1,) * np.ndim(value)))
    many[1, 2] = many[0, 1] = -3.0
    raises(r"^[a-z]+\[0, 1\] is (not|n't|too)|^[a-z]+\[0, 1\] does not", call, many, **order)
    many = np.tile(value, (2, 3, *(1,) * np.ndim(value)))
    many[1, 2].flat[0] = np.nan
    raises(r"^[a-z]+\[1, 2, 0(, 0)?\] is nan", call, many, **order)


@each
@loop_over("bad", ["text", [[1, 2], [3]], 3.0, [], [None]])
def test_invalid_point_arrays_raise(call, value, order, bad):
    with pytest.raises(ss.ValidationError):
        call(bad, **order)


as_quaternions = partial(rotations.as_quaternions, scalar_first=True)
from_quaternions = partial(rotations.from_quaternions, scalar_first=True)
BAD = [
    (convert.hyperboloid_to_ball, [2.0, 0.0, 0.0], r"not on the hyperboloid.* is 2\.0, but .* is 1\.0; .*project"),
    (convert.hyperboloid_to_ball, [-1.25, 0.75, 0.0], r"not on the hyperboloid.* -1\.25"),
    (convert.hyperboloid_to_ball, [1e17, 1e17, 0.0], "too distant for the ball.*half-space"),
    (convert.ball_to_hyperboloid, [0.6, 0.8], r"not inside the unit ball: its length is 1\.0"),
    (convert.ball_to_half_space, [1e200, 0.8], r"not inside the unit ball: its length is 1e\+200"),
    (convert.half_space_to_ball, [1e30, 1.0], "too distant for the ball"),
    (convert.half_space_to_hyperboloid, [1.0, -2.0], r"height, is -2\.0; it must be positive"),
    (convert.half_space_to_hyperboloid, [1.0, 1e-320], "too distant for the hyperboloid"),
    (convert.half_space_to_hyperboloid, [1.0, 1j], "must be real, of shape .*, not complex"),
    (convert.basis_to_projector, [[1.0], [1.0]], r"orthonormal columns: .* 1\.000e\+00; .*qr"),
    (convert.basis_to_projector, [[1e300], [1.0]], "orthonormal columns"),
    (convert.basis_to_projector, [[1.0, 0.0]], "1 <= k <= n"),
    (convert.projector_to_basis, [[1.0, 1.0], [0.0, 0.0]], r"not Hermitian: .* 1\.000e\+00"),
    (convert.projector_to_basis, [[0.5, 0.0], [0.0, 0.5]], r"not a projector: .* 2\.500e-01"),
    (convert.projector_to_basis, [[1e200, 0.0], [0.0, 0.5]], "not a projector"),
    (convert.projector_to_basis, [np.eye(2), np.diag([1.0, 0.0])], r"projector\[1\] has rank 1, but others .* 2;"),
    (convert.projector_to_basis, np.zeros((2, 2)), "zero or empty"),
    (convert.projector_to_basis, np.zeros((0, 2, 2)), "zero or empty"),
    (convert.projector_to_basis, np.zeros((2, 3)), "square"),
    (convert.state_to_density, [1.0, 1.0], r"not a state: its length is 1\.414.*divide"),
    (convert.density_to_state, np.eye(2), r"its trace is 2\.0, not 1; divide"),
    (convert.density_to_state, np.eye(2) / 2, r"not a pure state: .* tr P² is 0\.5; only pure"),
    # Trace and purity 1, but an eigenvalue is negative.
    (convert.density_to_state, np.diag([2.0, 2.0, -1.0]) / 3, r"not a pure state: .* 4\.444e-01"),
    (as_quaternions, 2 * np.eye(3), r"not a rotation: .* 3\.000e\+00; .*project"),
    (as_quaternions, np.diag([1.0, 1.0, -1.0]), "reflection.*determinant is -1; swap"),
    (as_quaternions, np.eye(2), r"of shape \(\.\.\., 3, 3\)"),
    (as_quaternions, 1j * np.eye(3), "must be real"),
    (from_quaternions, [0.0, 0.0, 0.0, 0.0], r"not a unit quaternion: its length is 0\.0"),
    (from_quaternions, [1.0, 0.0, 0.0], r"of shape \(\.\.\., 4\)"),
]


@pytest.mark.parametrize(("call", "value", "message"), BAD)
def test_invalid_points_of_conversions_raise(call, value, message):
    raises(message, call, value)
