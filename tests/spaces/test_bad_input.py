"""Bad points, space by space: what is wrong, where, by how much, and what to do."""

import re
import warnings

import numpy as np
import pytest
from cases import CASES
from curves import points_on, tangents_at

import symspline as ss

NAN, INF = np.nan, np.inf
PROJECT = r".*Points within 1e-8 are projected; use space\.project\(x\)"


def points(name, n=4, batch=()):
    return points_on(ss.space(name), n, batch, step=0.4)


def fails(match, points, space, kind=ss.ValidationError):
    """A fit fails with such a message, whoever asks for it, and nothing warns."""
    calls = [lambda: ss.CubicSpline(None, points, space), lambda: ss.fit_many([(None, points)], space)]
    if kind is ss.ValidationError:
        zero = np.zeros_like(points, dtype=ss.space(space).dtype)
        calls.append(lambda: ss.evaluate(0.5, None, points, zero, space))
    for call in calls:
        with warnings.catch_warnings(), pytest.raises(kind) as caught:
            warnings.simplefilter("error")
            call()
        message = str(caught.value).replace(" of curve 0", "")
        assert type(caught.value) is kind and re.search(match, message), message
        assert len(message) < 300


def changed(name, index, change):
    """Points of which one has been changed."""
    p = points(name)
    p[index] = change(p[index])
    return p


MATRICES = ["so:2", "so:3", "so:5", "o:3", "u:2", "u:5", "su:2", "su:3"]
FRAMES = ["gr:2,5", "gr:3,8", "cgr:2,4"]
LINES = ["rp:2", "rp:7", "cp:1", "cp:7", "gr:1,3", "cgr:1,2"]
POSITIVE = ["spd:2", "spd:3", "spd:8", "hpd:2", "hpd:5"]
POSES = ["se:2", "se:3"]
NAMES = [*MATRICES, *FRAMES, *LINES, *POSITIVE, *POSES, "spd:1", "hpd:1", "u:1"]


# ---- off the space ----


@pytest.mark.parametrize("name", MATRICES + FRAMES)
def test_columns_that_are_not_orthonormal(name):
    product = r"x\*x" if ss.space(name).dtype == np.complex128 else "xᵀx"
    columns = ss.space(name).point_shape[1]
    # |1.01² − 1| √columns
    size = f"{0.0201 * np.sqrt(columns):.3e}".replace("e-0", "e-")
    match = (
        rf"points\[2\] is off the space by .*columns are not orthonormal: \|{product} - 1\| = {size}{PROJECT}"
    )
    fails(match, changed(name, 2, lambda x: 1.01 * x), name)
    fails(r"points\[1\] is off the space.* 1\.\d+e0", changed(name, 1, lambda x: 0 * x), name)


@pytest.mark.parametrize("name", FRAMES)
def test_how_to_make_a_basis(name):
    fails(r"np\.linalg\.qr gives an orthonormal basis", changed(name, 2, lambda x: 1.01 * x), name)


@pytest.mark.parametrize("name", LINES)
def test_vectors_that_are_not_of_length_one(name):
    fails(rf"points\[3\] is off .* norm is 1\.01\d*, not 1 \(off by 1\.000e-2\){PROJECT}",
          changed(name, 3, lambda x: 1.01 * x), name)  # fmt: skip
    fails(r"points\[0\] is off the space.*it is the zero vector", changed(name, 0, lambda x: 0 * x), name)


@pytest.mark.parametrize("name", ["so:2", "so:3", "so:5", *POSES])
def test_reflections_among_rotations(name):
    def reflect(x):
        x = x.copy()
        x[:-1, 0] *= -1
        if name[:2] == "so":
            x[-1, 0] *= -1
        return x

    match = r"points\[2\] is off the space.* determinant is -1: it is a reflection, not a rotation \(swap two columns"
    fails(match, changed(name, 2, reflect), name)
    with pytest.raises(ss.ValidationError, match=r"x\[2\] cannot be projected"):
        ss.space(name).project(changed(name, 2, reflect))


@pytest.mark.parametrize("name", ["su:2", "su:3", "su:8"])
@pytest.mark.parametrize("phase", [0.3, -1e-5])
def test_the_phase_of_the_determinant(name, phase):
    mantissa, exponent = f"{phase:.3e}".split("e")
    n = ss.space(name).point_shape[0]
    p = changed(name, 1, lambda x: x * np.exp(1j * phase / n))
    fails(
        rf"points\[1\] is off .* determinant is not 1 but has the phase {mantissa}e{int(exponent)} "
        rf"\(Unitary\({n}\) takes",
        p,
        name,
    )
    ss.CubicSpline(None, p, f"u:{n}")
    ss.CubicSpline(None, ss.space(name).project(p), name)


def test_a_rotation_next_to_a_reflection():
    p = changed("o:3", 2, lambda x: x * [-1, 1, 1])
    match = r"points\[1\] and points\[2\]{} have opposite determinants: no curve joins a rotation and a reflection"
    with pytest.raises(ss.ValidationError, match=match.format("")):
        ss.CubicSpline(None, p, "o:3")
    both = np.stack([points("o:3"), p])
    with pytest.raises(ss.ValidationError, match=match.format(" of curve 1")):
        ss.CubicSpline(None, both, "o:3")
    with pytest.raises(ss.ValidationError, match=match.format(" of curve 1")):
        ss.fit_many([(None, q) for q in both], "o:3")
    # All on one side is fine on either side.
    ss.CubicSpline(None, both[0] * [-1, 1, 1], "o:3")


REFLECTION = np.diag([-1.0, 1, 1])


@pytest.mark.parametrize("operation", ["distance", "log", "geodesic", "transport"])
def test_no_geodesic_joins_a_rotation_and_a_reflection(operation):
    space = ss.Orthogonal(3)
    extra = {"geodesic": (0.5,), "transport": (np.zeros((3, 3)),)}.get(operation, ())
    call = getattr(space, operation)
    with pytest.raises(ss.ValidationError, match=r"pair 0 has opposite determinants: no curve joins"):
        call(np.eye(3), REFLECTION, *extra)
    both = np.array([np.eye(3), REFLECTION])
    with pytest.raises(ss.ValidationError, match=r"pair 1 has opposite determinants"):
        call(np.eye(3), both, *extra)
    with pytest.raises(ss.ValidationError, match=r"leading axes do not broadcast"):
        call(both, np.array([np.eye(3)] * 3), *extra)
    # Half a turn is another matter.
    if operation != "distance":
        with pytest.raises(ss.CutLocusError, match="pair 0"):
            call(np.eye(3), np.diag([-1.0, -1, 1]), *extra)


@pytest.mark.parametrize("name", POSITIVE)
def test_matrices_that_are_not_symmetric(name):
    def skew(x):
        return x + 1e-2 * np.eye(*x.shape, k=1)

    what = "symmetric" if name[:3] == "spd" else "Hermitian"
    match = (
        rf"points\[1\] is off the space by .*it is not {what}: the skew part is \d\.\d+e-\d of it{PROJECT}"
    )
    fails(match, changed(name, 1, skew), name)
    # The symmetric part is what is close.
    ss.CubicSpline(None, ss.space(name).project(changed(name, 1, skew)), name)


def test_a_diagonal_that_is_not_real():
    fails(r"points\[1\] is off .*not Hermitian", changed("hpd:2", 1, lambda x: x + 0.1j * np.eye(2)), "hpd:2")
    fails(r"points\[1\] is off .*not Hermitian", changed("hpd:1", 1, lambda x: x + 0.1j), "hpd:1")


@pytest.mark.parametrize("name", [*POSITIVE, "spd:1", "hpd:1"])
def test_matrices_that_are_not_positive(name):
    def negative(x):
        values, vectors = np.linalg.eigh(x)
        values[0] = -0.25
        return (vectors * values) @ vectors.conj().T

    match = r"points\[3\] is off the space: it is not positive definite: its smallest eigenvalue is -2\.5000\d*e-1"
    fails(match, changed(name, 3, negative), name)
    with pytest.raises(ss.ValidationError, match=r"x\[3\] cannot be projected"):
        ss.space(name).project(changed(name, 3, negative))


@pytest.mark.parametrize("name", [*POSITIVE, "spd:1", "hpd:1"])
def test_the_zero_matrix_is_not_positive(name):
    fails(r"not positive definite: its smallest eigenvalue is -?0", changed(name, 1, lambda x: 0 * x), name)


@pytest.mark.parametrize("name", ["spd:2", "spd:3", "hpd:2"])
def test_singular_matrices(name):
    n = ss.space(name).point_shape[0]
    singular = np.diag([1.0] * (n - 1) + [0.0])
    match = r"points\[1\] is off the space: it is not positive definite: its smallest eigenvalue is -?0"
    fails(match, changed(name, 1, lambda x: singular), name)


@pytest.mark.parametrize("name", POSES)
def test_the_last_row_of_a_pose(name):
    n = ss.space(name).point_shape[0] - 1
    for entry in (0, n):
        p = points(name)
        p[1, n, entry] += 0.5
        fails(r"points\[1\] is off the space by .*its last row is \[.*\], not \(0, …, 0, 1\)", p, name)
    # Positions on the left, where matrices for rows have them.
    with pytest.raises(ss.ValidationError, match="its last row is"):
        ss.CubicSpline(None, np.swapaxes(points(name) + 0.1 * np.eye(n + 1, k=n), -1, -2), name)


@pytest.mark.parametrize("name", POSES)
def test_the_rotation_of_a_pose(name):
    def stretched(x):
        x = x.copy()
        x[:-1, :-1] *= 1.01
        return x

    fails(
        r"points\[2\] is off .*in its rotation, its columns are not orthonormal",
        changed(name, 2, stretched),
        name,
    )


# ---- not finite ----

EVERY = [case.name for case in CASES]


@pytest.mark.parametrize("value", [NAN, INF, -INF])
@pytest.mark.parametrize("name", EVERY)
def test_numbers_that_are_not_finite(name, value):
    space = ss.space(name)
    p = points(name)
    for place in {0, p[0].size - 1}:
        bad = p.copy()
        bad[2].flat[place] = value
        fails(r"points\[2\] is off the space", bad, name)
        with pytest.raises(ss.ValidationError, match=r"point 2 is off the space"):
            space.check_point(bad)
        with pytest.raises(ss.ValidationError, match=r"x\[2\] cannot be projected"):
            space.project(bad)


@pytest.mark.parametrize("name", EVERY)
def test_end_vectors_that_are_not_finite(name):
    p = points(name)
    v = tangents_at(ss.space(name), p[0])
    v.flat[-1] = NAN
    with pytest.raises(ss.ValidationError, match=r"the start velocity holds NaN; it must be finite"):
        ss.CubicSpline(None, p, name, bc_type=((1, v), "natural"))
    with pytest.raises(ss.ValidationError, match=r"u\[0.* is not finite"):
        ss.evaluate(0.5, None, p, np.stack([v] * 4), name)


@pytest.mark.parametrize("name", EVERY)
def test_end_vectors_that_are_not_tangent(name):
    space = ss.space(name)
    p = points(name)
    rng = np.random.default_rng(0)
    v = rng.standard_normal(p[0].shape) + (
        1j * rng.standard_normal(p[0].shape) if space.dtype.kind == "c" else 0
    )
    if np.abs(space.project_tangent(p[0], v) - v).max() < 1e-6:
        assert isinstance(space, ss.Euclidean) or p[0].size == 1
        return
    match = r"the start velocity is not tangent at its point: a part of .*project_tangent"
    with pytest.raises(ss.ValidationError, match=match):
        ss.CubicSpline(None, p, space, bc_type=((1, v), "natural"))


@pytest.mark.parametrize("name", ["cp:1", "u:2", "hpd:2"])
def test_shapes_in_messages_are_those_that_were_given(name):
    space = ss.space(name)
    p = points(name)
    shape = space.point_shape
    with pytest.raises(ss.ValidationError) as caught:
        ss.CubicSpline(None, p, space, bc_type=((1, np.zeros((3, *shape))), "natural"))
    assert f"has shape {(3, *shape)}, which does not broadcast to {shape}" in str(caught.value)
    for call in (space.log, space.check_tangent):
        with pytest.raises(ss.ValidationError) as caught:
            call(p, p[:3])
        assert str((4, *shape)) in str(caught.value) and str((3, *shape)) in str(caught.value)
    with pytest.raises(ss.ValidationError) as caught:
        space.exp(np.zeros((4, 7)), p)
    assert "p has shape (4, 7)" in str(caught.value)


# ---- complex where real is meant ----


@pytest.mark.parametrize(
    "name, meant",
    [
        ("sphere:3", "ComplexProjective"),
        ("rp:2", "ComplexProjective"),
        ("gr:2,5", "ComplexGrassmannian"),
        ("so:3", "SpecialUnitary"),
        ("o:3", "Unitary"),
        ("spd:2", "HermitianPositiveDefinite"),
    ],
)
def test_complex_points_of_a_real_space(name, meant):
    p = points(name) + 0j
    match = rf"points must be an array of real numbers, not of complex128; did you mean {meant}\?"
    with pytest.raises(ss.ValidationError, match=match):
        ss.CubicSpline(None, p, name)
    with pytest.raises(ss.ValidationError, match=rf"p must be .*did you mean {meant}\?"):
        ss.space(name).exp(p, p)
    with pytest.raises(ss.ValidationError, match=rf"factor 1, .*did you mean {meant}\?"):
        ss.CubicSpline(None, (np.zeros((4, 1)), p), f"r:1 x {name}")
    assert hasattr(ss, meant)


@pytest.mark.parametrize("name", ["euclidean:3", "hyperbolic:2", "se:3"])
def test_complex_points_where_nothing_else_is_meant(name):
    with pytest.raises(ss.ValidationError, match=r"real numbers, not of complex128$"):
        ss.CubicSpline(None, points(name) + 0j, name)


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("dtype", [str, object, "M8[s]"])
def test_points_that_are_no_numbers(name, dtype):
    space = ss.space(name)
    p = np.zeros((3, *space.point_shape), int).astype(dtype)
    with pytest.raises(ss.ValidationError, match=r"points must be an array of (real )?numbers, not of "):
        ss.CubicSpline(None, p, space)


# ---- the cut locus ----


def rotation(angle, n=3):
    r = np.eye(n)
    r[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return r


def pose(angle, n=3):
    g = np.eye(n + 1)
    g[:n, :n], g[:n, n] = rotation(angle, n), angle
    return g


def plane(angle, n=5):
    """Principal angles 0.4 of it and all of it to the first two axes."""
    y = np.eye(n)[:, :2].copy()
    y[:, 0] = np.cos(0.4 * angle) * np.eye(n)[0] + np.sin(0.4 * angle) * np.eye(n)[2]
    y[:, 1] = np.cos(angle) * np.eye(n)[1] + np.sin(angle) * np.eye(n)[3]
    return y


def phases(*weights):
    return lambda angle: np.diag(np.exp(1j * angle * np.array(weights)))


# Points at an angle from the first, and the angle at which they meet its cut locus.
REACH = {
    "sphere:2": (lambda a: rotation(a)[0], np.pi),
    "rp:2": (lambda a: rotation(a)[0], np.pi / 2),
    "rp:1": (lambda a: rotation(a)[0, :2], np.pi / 2),
    "cp:1": (lambda a: rotation(a)[0, :2] * [1j, 1], np.pi / 2),
    "cp:2": (lambda a: rotation(a)[0] * 1j, np.pi / 2),
    "gr:1,3": (lambda a: rotation(a)[0][:, None], np.pi / 2),
    "gr:2,5": (plane, np.pi / 2),
    "cgr:2,5": (lambda a: 1j * plane(a), np.pi / 2),
    "so:2": (lambda a: rotation(a, 2), np.pi),
    "so:3": (rotation, np.pi),
    "so:5": (lambda a: rotation(a, 5), np.pi),
    "o:3": (lambda a: -rotation(a), np.pi),
    "u:1": (phases(1), np.pi),
    "u:2": (phases(1, -0.3), np.pi),
    "u:5": (phases(1, -0.3, 0, 0, 0.5), np.pi),
    "se:2": (lambda a: pose(a, 2), np.pi),
    "se:3": (pose, np.pi),
}
LIMIT = {np.pi: r"3\.14159\d*", np.pi / 2: r"1\.57079\d*", 2 * np.pi: r"6\.28318\d*"}


@pytest.mark.parametrize("name", REACH)
def test_points_at_the_cut_locus(name):
    at, limit = REACH[name]
    angle = LIMIT[limit]
    p = np.array([at(0), at(0.3 * limit), at(1.3 * limit)])
    match = (
        rf"points\[1\] and points\[2\] lie at or past .*cut locus: angle {angle}, limit {angle}; put a point"
    )
    fails(match, p, name, ss.CutLocusError)
    space = ss.space(name)
    with pytest.raises(ss.CutLocusError, match=rf"pair 1: .*angle {angle}, limit {angle}"):
        space.log(p[0], np.array([p[1], at(limit)]))
    with pytest.raises(ss.CutLocusError, match=rf"pair 0: .*angle {angle}, limit {angle}"):
        space.geodesic(p[1], p[2], 0.5)
    # Nearer is fine, and farther is nearer on the other side.
    ss.CubicSpline(None, np.array([at(0), at(0.9 * limit), at(1.8 * limit)]), name)
    ss.CubicSpline(None, np.array([at(0), at(1.2 * limit)]), name)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_special_unitary_matrices_at_the_cut_locus(n):
    """There the deciding angle is the spread of the phases."""
    phase = np.zeros(n)
    phase[:2] = np.pi, -np.pi
    p = np.array([np.eye(n), np.diag(np.exp(1j * phase))])
    match = r"points\[0\] and points\[1\] lie .*cut locus: angle 6\.28318\d*, limit 6\.28318\d*"
    fails(match, p, f"su:{n}", ss.CutLocusError)
    ss.CubicSpline(None, np.array([p[0], np.diag(np.exp(0.9j * phase))]), f"su:{n}")


def test_the_bad_pair_of_a_batch_is_named():
    at, limit = REACH["gr:2,5"]
    good, bad = np.array([at(0), at(0.5), at(1.0)]), np.array([at(0), at(0.2), at(0.2 + limit)])
    batch = np.array([[good, good, good], [good, bad, good]])
    with pytest.raises(ss.CutLocusError, match=r"points\[1\] and points\[2\] of curve 1,1 lie"):
        ss.CubicSpline(None, batch, "gr:2,5")
    with pytest.raises(ss.CutLocusError, match=r"points\[1\] and points\[2\] of curve 2 lie"):
        ss.fit_many([(None, good), (None, good), (None, bad)], "gr:2,5")


@pytest.mark.parametrize("name", ["rp:2", "cp:2", "gr:2,5", "cgr:2,5", "so:3", "u:2", "su:2", "se:3"])
def test_end_velocities_that_are_too_fast(name):
    space = ss.space(name)
    p = points(name)
    v = tangents_at(space, p[0])
    v *= 30 / space.norm(p[0], v)
    match = r"the start velocity has speed 30\.0+, too fast for its segment of length 1: .* must stay below \d+\.\d+"
    with pytest.raises(ss.ValidationError, match=match) as caught:
        ss.CubicSpline(None, p, space, bc_type=((1, v), "natural"))
    allowed = float(str(caught.value).rpartition(" ")[2])
    # Whether there is a curve is another question.
    ss.CubicSpline(None, p, space, bc_type=((1, v * 0.99 * allowed / 30), "natural"), on_failure="ignore")


# ---- spaces that there are not ----


@pytest.mark.parametrize(
    "name, match",
    [
        ("gr:5,2", r"asks for subspaces larger than the space; did you mean Grassmannian\(2, 5\)\?"),
        ("cgr:5,2", r"did you mean ComplexGrassmannian\(2, 5\)\?"),
        ("gr:3,3", r"Grassmannian\(k, n\) needs 1 <= k < n; Grassmannian\(3, 3\) is a single point"),
        ("cgr:1,1", r"needs 1 <= k < n; ComplexGrassmannian\(1, 1\) is a single point"),
        ("gr:0,3", r"needs 1 <= k < n"),
        ("gr:2", r"'gr:2': Grassmannian does not take 1 numbers"),
        ("so:2,3", r"'so:2,3': SpecialOrthogonal does not take 2 numbers"),
        ("se:4", r"SpecialEuclidean\(n\) needs n = 2 or 3, not 4"),
        ("se:1", r"needs n = 2 or 3, not 1"),
        ("o:1", r"Orthogonal\(n\) needs n >= 2"),
        ("so:1", r"SpecialOrthogonal\(n\) needs n >= 2"),
        ("su:1", r"SpecialUnitary\(n\) needs n >= 2"),
        *((f"{name}:0", r"\(n\) needs n >= ") for name in ("rp", "cp", "o", "so", "u", "su", "spd", "hpd", "r", "h")),
        ("gr:2.0,5", r"behind the colon come whole numbers"),
        ("gr:2;5", r"behind the colon come whole numbers"),
        ("cp:1xso:3", r"behind the colon come whole numbers"),
        ("cp:1 x ", r"unknown space"),
        ("so:99999999999", r"too large"),
        ("gr:3,99999999999999999999", r"too large"),
        ("sphere:18446744073709551615", r"too large"),
    ],
)  # fmt: skip
def test_spaces_that_there_are_not(name, match):
    with pytest.raises(ss.ValidationError, match=match):
        ss.space(name)


@pytest.mark.parametrize("value", [-1, 2.0, "2", None, True])
@pytest.mark.parametrize(
    "kind", ["Grassmannian", "SpecialOrthogonal", "Unitary", "SpecialEuclidean", "ComplexProjective"]
)
def test_sizes_that_are_no_whole_numbers(kind, value):
    cls = getattr(ss, kind)
    with pytest.raises(ss.ValidationError, match=rf"{kind} takes whole numbers, not {value!r}"):
        cls(value, 5) if kind == "Grassmannian" else cls(value)


# ---- conversions ----

TURN = [[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]


@pytest.mark.parametrize("order", [None, 1, 0, "wxyz", np.True_])
@pytest.mark.parametrize(
    "function, value", [("matrix_to_quaternion", TURN), ("quaternion_to_matrix", [1.0, 0, 0, 0])]
)
def test_the_order_of_quaternions_must_be_said(function, value, order):
    convert = getattr(ss.convert, function)
    match = r"in doubt.* scalar_first=True for \(w, x, y, z\) or scalar_first=False for \(x, y, z, w\) as in SciPy"
    with pytest.raises(ss.ValidationError, match=match):
        convert(value, scalar_first=order)
    with pytest.raises(ss.ValidationError, match=match):
        convert(value)


# ---- curves with control points ----

P = np.eye(3)
CLAMPED = [0, 0, 0, 1, 1, 1]


@pytest.mark.parametrize(
    "knots, degree, match",
    [
        (CLAMPED[1:], 2, r"3 control points of degree 2 need 6 knots, got 5"),
        ([], 2, r"need 6 knots, got 0"),
        ([0, 0, 0, 1, 0.5, 1], 2, r"knots\[4\] = 0\.5 is before knots\[3\]"),
        ([0, 0, NAN, 1, 1, 1], 2, r"knots\[2\] is not finite"),
        ([0, 0, 0, 1, 1, INF], 2, r"knots\[5\] is not finite"),
        ([CLAMPED, CLAMPED], 2, r"knots must be a row of real numbers, not int64 of shape \(2, 6\)"),
        ([0, 0, 0, 1, 1, 1j], 2, r"knots must be a row of real numbers, not complex128"),
        (list("aaabbb"), 2, r"knots must be a row of real numbers, not <U1"),
        (np.array(CLAMPED, "M8[s]"), 2, r"knots must be a row of real numbers, not datetime64"),
        ([[0, 0], [1]], 2, r"knots is not an array of equally long rows"),
        (
            [0, 0, 0, 0, 1, 1],
            2,
            r"knots repeat 0\.0 4 times; with degree 2 a knot may repeat at most 3 times",
        ),
        ([0, 1, 2, 2, 3, 4], 2, r"the curve lives between knots\[2\] and knots\[3\], which are equal"),
        ([-1e308] * 3 + [1e308] * 3, 2, r"knots span more than a double can hold"),
        (CLAMPED, 3, r"degree 3 needs at least 4 control points, got 3"),
        (CLAMPED, 0, r"degree must be at least 1"),
        (CLAMPED, -1, r"degree must be at least 1"),
        (CLAMPED, 1.5, r"degree must be a whole number, not 1\.5"),
        (CLAMPED, True, r"degree must be a whole number, not True"),
        (CLAMPED, None, r"degree must be a whole number, not None"),
        (CLAMPED, 10**30, r"degree must be "),
    ],
    ids=str,
)
def test_knots_and_degrees(knots, degree, match):
    with warnings.catch_warnings(), pytest.raises(ss.ValidationError, match=match):
        warnings.simplefilter("error")
        ss.BSpline(knots, P, degree, "sphere:2")


@pytest.mark.parametrize("kind", ["BSpline", "BezierCurve"])
@pytest.mark.parametrize(
    "points, match",
    [
        (P[0], r"control_points has shape \(3,\); a curve needs shape \(\.\.\., n, 3\) with n >= 2"),
        (P[:1], r"control_points has shape \(1, 3\); a curve needs .* n >= 2"),
        (P[:0], r"control_points has shape \(0, 3\); a curve needs"),
        (np.ones((0, 3, 3)), r"control_points has shape \(0, 3, 3\); a curve needs"),
        ([], r"control_points has shape \(0,\); a curve needs"),
        (None, r"control_points has shape \(\); a curve needs"),
        (np.eye(4)[:3], r"control_points has shape \(3, 4\), but Sphere\(2\) needs shape \(\.\.\., 3\)"),
        (P + 0j, r"control_points must be .*complex128; did you mean ComplexProjective"),
        (P.astype(str), r"control_points must be an array of real numbers"),
        ([[1, 0, 0], [1]], r"control_points is not an array of equally long rows"),
        (2 * P, r"control_points\[0\] is off the space by 1\.000e0: its norm is 2"),
        ([P[0], P[1], [0, 0, 0]], r"control_points\[2\] is off .*zero vector"),
        ([P[0], P[1], [NAN, 0, 0]], r"control_points\[2\] is off the space"),
        ([P, [P[0], 2 * P[1], P[2]]], r"control_points\[1\] of curve 1 is off the space by 1\.000e0"),
    ],
    ids=lambda x: None if isinstance(x, str) else str(np.shape(x)) if not isinstance(x, list) else "list",
)
def test_control_points(kind, points, match):
    with pytest.raises(ss.ValidationError, match=match):
        ss.BSpline(CLAMPED, points, 2, "sphere:2") if kind == "BSpline" else ss.BezierCurve(
            points, "sphere:2"
        )


@pytest.mark.parametrize("name", REACH)
def test_control_points_that_are_too_far_apart(name):
    at, limit = REACH[name]
    good, bad = np.array([at(0), at(0.4), at(0.8)]), np.array([at(0), at(0.4), at(0.4 + limit)])
    lie = rf"lie at or past .*cut locus: angle {LIMIT[limit]}, limit {LIMIT[limit]}"
    with pytest.raises(ss.CutLocusError, match=rf"control_points\[1\] and control_points\[2\] {lie}"):
        ss.BezierCurve(bad, name)
    for batch, curve in ((np.stack([good, bad]), "1"), (np.stack([[good, good], [bad, good]]), "1,0")):
        match = rf"control_points\[1\] and control_points\[2\] of curve {curve} {lie}"
        with pytest.raises(ss.CutLocusError, match=match):
            ss.BSpline(CLAMPED, batch, 2, name)


def test_control_points_of_two_parts():
    match = r"control_points\[0\] and control_points\[1\] have opposite determinants"
    with pytest.raises(ss.ValidationError, match=match):
        ss.BezierCurve([np.eye(3), REFLECTION], "o:3")
    with pytest.raises(ss.ValidationError, match=r"control_points\[1\] is off .*reflection"):
        ss.BezierCurve([np.eye(3), REFLECTION], "so:3")


def test_control_points_in_a_product():
    for make in (lambda s: ss.BezierCurve((P, P), s), lambda s: ss.BSpline(CLAMPED, (P, P), 2, s)):
        with pytest.raises(ss.ValidationError, match="one curve in every factor: make one for each"):
            make("sphere:2 x r:3")


@pytest.mark.parametrize(
    "x, match",
    [
        (-0.1, r"x = -0\.1 is outside the curve's times \[0\.0, 1\.0\]"),
        ([0.5, 2], r"x\[1\] = 2\.0 is outside"),
        (np.nextafter(1, 2), r"x = 1\.0000000000000002 is outside"),
        (NAN, r"x = nan is not finite"),
        ([[0, 1], [INF, 0]], r"x\[1, 0\] = inf is not finite"),
        ("a", r"x must be real numbers, not <U1"),
        (None, r"x must be real numbers, not object"),
        (1j, r"x must be real numbers, not complex128"),
        (np.datetime64("2020-01-01"), r"x must be real numbers, not datetime64"),
    ],
    ids=str,
)
def test_times_outside(x, match):
    curve = ss.BezierCurve(P, "sphere:2")
    for call in (curve, curve.speed):
        with pytest.raises(ss.ValidationError, match=match):
            call(x)


@pytest.mark.parametrize("nu", [3, -1, 1.5, "1", None, [1]])
def test_derivatives_that_there_are_not(nu):
    with pytest.raises(ss.ValidationError, match=r"nu must be 0, 1 or 2, not "):
        ss.BezierCurve(P, "sphere:2")(0.5, nu=nu)


@pytest.mark.parametrize("name", ["spd:3", "hpd:3", "spd:8"])
def test_a_matrix_that_is_singular_to_rounding_is_refused(name):
    """Whatever the sign of the rounding errors, and whatever the units of its rows."""
    n, rng = ss.space(name).point_shape[0], np.random.default_rng(3)
    for _ in range(20):
        a = rng.normal(size=(n, n - 1))
        points = np.array([np.eye(n), a @ a.T], dtype=ss.space(name).dtype)
        fails(
            r"points\[1\] is off the space: it is not positive definite: its smallest eigenvalue",
            points,
            name,
        )
    units = 10.0 ** rng.uniform(-6, 6, n)
    regular = np.eye(n) + 0.3
    assert ss.CubicSpline(
        None, np.array([np.eye(n), regular * units * units[:, None]]), name
    ).report.converged


def test_double_precision_is_not_excused_by_single_precision_beside_it():
    good = np.array([[1, 0, 0], [0, 1, 0]])
    off = good + 1e-6
    curves = [(None, good.astype(np.float32)), (None, off)]
    with pytest.raises(ss.ValidationError, match=r"curve 1: .*off the space by"):
        ss.fit_many(curves, "sphere:2")
    assert len(ss.fit_many([(None, off.astype(np.float32)), (None, good)], "sphere:2")) == 2
