"""Points off a space: errors state the problem, the point, the distance and the remedy."""

import numpy as np
import pytest
from cases import CASES, EPS, loop_over
from compare import same
from curves import KNOTS, S2, points_on
from refused import INF, NAN, TWO, P, changed, fails, fit_error, points, raises, spoiled

import symspline as ss

PROJECT = r".*Points within \de-\d are projected; use space\.project\(x\)"
MATRICES = ["so:2", "so:3", "so:5", "o:3", "u:2", "u:5", "su:2", "su:3"]
FRAMES = ["gr:2,5", "gr:3,8", "cgr:2,4"]
LINES = ["rp:2", "rp:7", "cp:1", "cp:7", "gr:1,3", "cgr:1,2"]
SYMMETRIC, HERMITIAN = ["spd:2", "spd:3", "spd:8"], ["hpd:2", "hpd:5"]
DEFINITE = [*SYMMETRIC, *HERMITIAN, "spd:1", "hpd:1"]
POSES = ["se:2", "se:3"]


def reflect(x):
    """Change the sign of one column, for a pose that of the rotation."""
    return x * np.where(np.arange(len(x)) == 0, -1, 1)


def skew(x):
    return x + 1e-2 * np.eye(*x.shape, k=1)


def negative(x):
    """Replace the smallest eigenvalue by −1/4."""
    values, vectors = np.linalg.eigh(x)
    values[0] = -0.25
    return (vectors * values) @ vectors.conj().T


def singular(x):
    return np.diag([1.0] * (len(x) - 1) + [0.0])


def scaled(factor):
    return lambda x: factor * x


def last_row(entry):
    def change(x):
        x = x.copy()
        x[-1, entry] += 0.5
        return x

    return change


def stretched(x):
    x = x.copy()
    x[:-1, :-1] *= 1.01
    return x


NOT_SYMMETRIC = r"off the space by .*it is not {}: the skew part is \d\.\d+e-\d of it" + PROJECT
NOT_POSITIVE = "off the space: it is not positive definite: its smallest eigenvalue is "
OFF = [
    (MATRICES + FRAMES, scaled(1.01), r"off the space by .*columns are not orthonormal: \|x.x - 1\| = \d\.\d{3}e-2.*"),
    (FRAMES, scaled(1.01), r"np\.linalg\.qr gives an orthonormal basis" + PROJECT),
    (MATRICES + FRAMES, scaled(0), r"off the space.* 1\.\d+e0"),
    (LINES, scaled(1.01), r"off .* norm is 1\.0\d*, not 1 \(off by 1\.000e-2\)" + PROJECT),
    (LINES, scaled(0), "off the space.*it is the zero vector"),
    (["so:3", "so:5", *POSES], reflect, "determinant is -1: it is a reflection, not a rotation .swap two columns"),
    (SYMMETRIC, skew, NOT_SYMMETRIC.format("symmetric")),
    (HERMITIAN, skew, NOT_SYMMETRIC.format("Hermitian")),
    (["hpd:1", "hpd:2"], lambda x: x + 0.1j * np.eye(len(x)), "off .*not Hermitian"),
    (DEFINITE, negative, NOT_POSITIVE + r"-2\.5000\d*e-1"),
    (DEFINITE, scaled(0), NOT_POSITIVE + "-?0"),
    (DEFINITE, singular, NOT_POSITIVE + "-?0"),
    (POSES, last_row(0), r"off the space by .*its last row is \[.*\], not \(0, …, 0, 1\)"),
    (POSES, last_row(-1), r"off the space by .*its last row is \[.*\], not \(0, …, 0, 1\)"),
    (POSES, stretched, "off .*in its rotation, its columns are not orthonormal"),
]


@pytest.mark.parametrize(("names", "change", "match"), OFF, ids=[f"{row[0][0]}-{row[2][:30]}" for row in OFF])
def test_errors_state_the_distance_from_each_space(names, change, match):
    for i, name in enumerate(names):
        fails(rf"points\[{i % 4}\] is .*{match}", spoiled(name, i % 4, change), name)


@pytest.mark.parametrize(
    ("name", "change"), [("so:3", reflect), ("se:3", reflect), ("spd:3", negative), ("hpd:1", negative)]
)
def test_far_points_cannot_be_projected(name, change):
    raises(r"x\[2\] cannot be projected", ss.space(name).project, spoiled(name, 2, change))


@pytest.mark.parametrize("name", ["su:2", "su:8"])
@pytest.mark.parametrize("phase", [0.3, -1e-5])
def test_the_phase_of_the_determinant(name, phase):
    mantissa, exponent = f"{phase:.3e}".split("e")
    n = ss.space(name).point_shape[0]
    p = spoiled(name, 1, lambda x: x * np.exp(1j * phase / n))
    phase = f"{mantissa}e{int(exponent)}"
    fails(rf"points\[1\] is off .* determinant is not 1 but has the phase {phase} \(Unitary\({n}\) takes", p, name)
    ss.CubicSpline(None, p, f"u:{n}")
    ss.CubicSpline(None, ss.space(name).project(p), name)


def test_a_rotation_next_to_a_reflection():
    p = spoiled("o:3", 2, lambda x: x * [-1, 1, 1])
    fails(r"points\[1\] and points\[2\] have opposite determinants: no curve joins them", p, "o:3")
    both = np.stack([points("o:3"), p])
    raises(r"points\[1\] and points\[2\] of curve 1 have opposite", ss.CubicSpline, None, both, "o:3")
    # All on one side is fine on either side.
    ss.CubicSpline(None, both[0] * [-1, 1, 1], "o:3")


@pytest.mark.parametrize("name", ["spd:3", "hpd:3", "spd:8"])
def test_a_matrix_that_is_singular_to_rounding_is_refused(name):
    """Whatever the sign of the rounding errors, and whatever the units of its rows."""
    n, dtype, rng = ss.space(name).point_shape[0], ss.space(name).dtype, np.random.default_rng(3)
    for _ in range(20):
        a = rng.normal(size=(n, n - 1))
        points = np.array([np.eye(n), a @ a.T], dtype)
        fails(r"points\[1\] is off the space: it is not positive definite: its smallest eigenvalue", points, name)
    units = 10.0 ** rng.uniform(-6, 6, n)
    regular = (np.eye(n) + 0.3) * units * units[:, None]
    assert ss.CubicSpline(None, np.array([np.eye(n), regular]), name).report.converged


def test_points_off_the_space():
    for space, rows, match in [
        ("sphere:2", changed(2, [0, 0, 1.1]), r"\[2\] is off the space by 1\.000e-1: its norm is 1\.1, not 1"),
        ("sphere:2", changed(1, 0), r"\[1\] is off the space by 1\.000e0: it is the zero vector"),
        ("h:2", [[1, 0, 0], [1.1, 0, 0]], r"\[1\] is off .* by 1\.000e-1: its Minkowski square is -1\.21"),
        ("ch:1", [[1, 0], [0, 2j]], r"\[1\] is off .*its square -\|x0\|\^2 .* is 4, not -1"),
        ("h:2", [[-1, 0, 0], [1, 0, 0]], r"\[0\] is off .*the first, is -1, not positive"),
        ("h:2", [[1, 0, 0], [0, 0, 0]], r"\[1\] is off .*the first, is 0, not positive"),
    ]:
        fit_error("points" + match + PROJECT, None, rows, space)


def test_error_names_the_point_of_a_batch():
    fit_error(r"points\[2\] of curve 1 is off the space by 5\.000e-1", points=changed((1, 2), [0, 0, 1.5], TWO))
    raises(r"points\[1\] of curve 1 is off the space", ss.fit_many, [(None, P), (None, changed(1, [0, 2, 0])[:2])], S2)


@pytest.mark.parametrize("dtype, tol", [("f8", "1e-8"), ("f4", "1e-4")])
def test_how_far_off_is_allowed(dtype, tol):
    match = rf"off the space by 1\.0\d*e-2.*Points within {tol} are projected"
    fit_error(match, points=(P * (1.01 + 1e-4 / 3)).astype(dtype))


EVERY = [case.name for case in CASES]


@loop_over("value", [NAN, INF, -INF])
@pytest.mark.parametrize("name", EVERY)
def test_points_that_are_not_finite_raise(name, value):
    space, p = ss.space(name), points(name)
    for place in {0, p[0].size - 1}:
        bad = p.copy()
        bad[2].flat[place] = value
        fails(r"points\[2\] is off the space.*No point is close to it; correct it or remove it", bad, name)
        raises(r"point 2 is off the space", space.check_point, bad)
        raises(r"x\[2\] cannot be projected", space.project, bad)


@pytest.mark.parametrize("dtype, off", [("f8", 9e-9), ("f4", 9e-5)])
def test_points_nearly_on_the_space_are_projected(dtype, off):
    p = points_on(S2, 5)
    spline = ss.CubicSpline(None, (p * (1 + off)).astype(dtype), S2)
    assert np.abs(np.linalg.norm(spline.points, axis=-1) - 1).max() <= 2 * EPS
    assert np.abs(spline.points - p).max() < 1.2 * np.finfo(dtype).eps
    h = points_on(ss.Hyperbolic(2), 5)
    spline = ss.CubicSpline(None, (h * [1 + off, 1, 1]).astype(dtype), "h:2")
    squares = spline.points**2 @ [-1, 1, 1]
    assert np.abs(squares + 1).max() <= 8 * EPS * np.square(h).max()


def test_check_false_skips_the_checks():
    p = points_on(S2, 6)
    checked, unchecked = (ss.CubicSpline(KNOTS, p, S2, check=c) for c in (True, False))
    # Checking projects once more, which may turn a last bit.
    assert np.abs(checked.velocities - unchecked.velocities).max() < 20 * EPS
    assert same(ss.CubicSpline(None, 2 * np.eye(3), S2, check=False).points, 2 * np.eye(3))


def test_double_precision_is_not_excused_by_single_precision_beside_it():
    good = np.array([[1, 0, 0], [0, 1, 0]])
    off = good + 1e-6
    curves = [(None, good.astype(np.float32)), (None, off)]
    raises(r"curve 1: .*off the space by", ss.fit_many, curves, "sphere:2")
    assert len(ss.fit_many([(None, off.astype(np.float32)), (None, good)], "sphere:2")) == 2


def test_the_nearest_rotation_is_the_factor_of_the_polar_decomposition():
    """By the singular value decomposition (Kabsch 1976), near and far, whatever the neighbours are."""
    rng, space = np.random.default_rng(3), ss.space("so:3")
    rotations = space.random_point(rng, 60)
    sizes = np.repeat([1e-15, 1e-12, 1e-8, 1e-5, 3e-4, 2e-3, 1e-2, 0.1, 0.3, 0.5], 6)
    given = rotations + sizes[:, None, None] * rng.uniform(-1, 1, (60, 3, 3))
    given = given[rng.permutation(60)]
    u, _, v = np.linalg.svd(given)
    found = space.project(given)
    np.testing.assert_allclose(found, u @ v, rtol=0, atol=4e-15)
    alone = np.stack([space.project(x) for x in given])
    np.testing.assert_array_equal(alone, found)
    poses = np.zeros((60, 4, 4))
    poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = given, rng.normal(size=(60, 3)), 1
    np.testing.assert_array_equal(ss.space("se:3").project(poses)[:, :3, :3], found)
    raises("reflection", space.check_point, -rotations[0])


@pytest.mark.parametrize("name", ["cp:1", "cp:3"])
@pytest.mark.parametrize(
    ("matrices", "hint"),
    [
        ([np.diag([0.5, 0.5])] * 3, True),
        ([[[0.6, 0.2j], [-0.2j, 0.4]]] * 3, True),
        ([[[0.6, 0.2], [0.1, 0.4]]] * 3, False),
        ([np.diag([0.5, 0.6])] * 3, False),
        # The purity of a state is 1 at most.
        ([np.diag([1.5, -0.5])] * 3, False),
        ([np.diag([0.9, 0.5, -0.4])] * 3, False),
        ([np.diag([0.5, 0.5]), np.diag([0.5, 0.6])], False),
    ],
)
def test_only_density_matrices_get_the_advice_for_them(name, matrices, hint):
    with pytest.raises(ss.ValidationError) as caught:
        ss.CubicSpline(None, matrices, name)
    assert ("looks like density matrices, Hermitian of trace 1" in str(caught.value)) == hint


def test_covariances_of_low_rank_name_the_remedy():
    x = np.random.default_rng(0).standard_normal((6, 4, 200))
    x -= x.mean(axis=1, keepdims=True)  # the average reference of electroencephalography
    raises(
        r"its rank is too low\. Drop a variable, or add a small multiple", ss.space("spd:4").mean, x @ x.swapaxes(1, 2)
    )
    # Both remedies.
    assert ss.space("spd:3").mean(x[:, :3] @ x[:, :3].swapaxes(1, 2)).shape == (3, 3)
    assert ss.space("spd:4").mean(x @ x.swapaxes(1, 2) + 1e-3 * np.eye(4)).shape == (4, 4)
    with pytest.raises(ss.ValidationError, match="smallest eigenvalue") as caught:
        ss.CubicSpline(None, [np.eye(2), np.diag([1.0, -0.5])], "spd:2")
    assert "rank" not in str(caught.value)
