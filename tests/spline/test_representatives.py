"""Inconsistent representatives of the data: warnings for quaternions of opposite sign, and if most steps are long."""

import warnings

import numpy as np
import pytest
from curves import S3, points_on
from scipy.spatial.transform import Rotation

import symspline as ss

SIGNS, FAR = "neighbours of opposite sign", "more than half of the steps are long"
# The 24 rotations of a cube.
CUBE = Rotation.create_group("O").as_matrix()


@pytest.fixture(autouse=True)
def every_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def motion():
    """A turn by 180 degrees in steps of 20, as quaternions."""
    half = np.radians(10) * np.arange(10)
    return np.stack([np.cos(half), np.sin(half), 0 * half, 0 * half], axis=-1)


def flipped(*samples):
    q = motion()
    q[list(samples)] *= -1
    return q


def smooth(space, n=12, seed=0):
    """Points of a slow motion."""
    return points_on(ss.space(space), n, step=0.2, seed=seed)


def orientations(seed=0):
    """A grain that turns slowly, each time in one of 24 equivalent orientations."""
    return smooth("so:3") @ CUBE[np.random.default_rng(seed).integers(24, size=12)]


def gates(seed=0):
    """A gate that changes slowly, each time with another global phase."""
    phases = np.exp(1j * np.random.default_rng(seed).uniform(-np.pi, np.pi, 12))
    return smooth("u:2") * phases[:, None, None]


def modes(seed=1):
    """A basis that turns slowly, in which two modes have any sign, and the others make up for it."""
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], (12, 4))
    signs[:, 3] *= signs.prod(axis=1)
    return smooth("so:4") * signs[:, None]


# Data on a space that are consistent and that are not, and the warning with a place for the name of the curve.
KINDS = {
    "signs": ("sphere:3", motion(), flipped(9), rf"{SIGNS} .* points\[8\] and points\[9\]{{}} have"),
    "far": ("so:3", smooth("so:3"), orientations(1), rf"{FAR}: \d+ of 11 steps between neighbouring points{{}} are"),
}


@pytest.mark.parametrize("kind", KINDS)
def test_one_warning_names_the_curve(kind):
    space, good, bad, match = KINDS[kind]
    flat, options = np.zeros((len(good), 2)), {"on_failure": "ignore"}
    for fit, curve in (
        (lambda: ss.CubicSpline(None, bad, space, **options), ""),
        (lambda: ss.CubicSpline(None, (flat, bad), f"r:2 x {space}", **options), ""),
        (lambda: ss.CubicSpline(None, np.stack([good, bad]), space, **options), " of curve 1"),
        (lambda: ss.fit_many([(None, good), (None, bad)], space, **options), " of curve 1"),
        (lambda: ss.fit_many([(None, bad)] * 2, space, where=[False, True], **options), " of curve 1"),
        (lambda: ss.fit(None, bad, space, **options), ""),
        (lambda: ss.HermiteSpline(None, bad, 0 * bad, space), ""),
    ):
        with pytest.warns(UserWarning, match=match.format(curve)) as caught:
            fit()
        # It points to the line above, not into the package.
        assert [warning.filename for warning in caught] == [__file__]
    ss.CubicSpline(None, good, space)
    ss.fit_many([(None, bad), (None, good)], space, where=[False, True])


@pytest.mark.parametrize(
    ("space", "points", "lam", "match"),
    [("sphere:3", flipped(4), 1.0, SIGNS), ("sphere:2", [[1.0, 0, 0], [-0.9, 0.19**0.5, 0]] * 4, 1e-6, FAR)],
)
def test_noisy_data_warn_too(space, points, lam, match):
    with pytest.warns(UserWarning, match=match):
        ss.make_smoothing_spline(None, points, space, lam=lam, on_failure="ignore")


def test_a_flipped_sample_warns_with_advice():
    with pytest.warns(UserWarning) as caught:
        ss.CubicSpline(None, flipped(4), "sphere:3", method="newton")
    message = str(caught[0].message)
    assert message.startswith(f"{SIGNS} on sphere:3: points[3] and points[4] have inner product -0.985")
    assert "(and 1 more pairs)" in message and "so:3" in message and "rp:3" in message
    assert f"warnings.filterwarnings('ignore', message='{SIGNS}')" in message
    warnings.filterwarnings("ignore", message=SIGNS)
    ss.CubicSpline(None, flipped(4), "sphere:3", method="newton")


def test_a_little_more_than_half_a_turn_warns():
    # Of two quaternions at right angles neither sign is the nearer one.
    for angle, warns in ((np.pi / 2 + 1e-3, True), (np.pi / 2 - 1e-3, False)):
        with pytest.warns(UserWarning, match="inner product -0.001") if warns else warnings.catch_warnings():
            ss.CubicSpline(None, [[1, 0, 0, 0], [np.cos(angle), np.sin(angle), 0, 0]], S3)


@pytest.mark.parametrize("space, points", [("so:3", orientations()), ("u:2", gates(1)), ("so:4", modes())])
def test_data_in_representations_that_do_not_fit_warn(space, points):
    with pytest.warns(ss.FarPointsWarning, match="of 11 steps .* nearest to the previous"):
        ss.CubicSpline(None, points, space, on_failure="ignore")
    ss.CubicSpline(None, smooth(space), space)


def test_degrees_on_a_torus_warn():
    degrees = np.array([0, 40, 80, 120, 160, 200.0])[:, None]
    with pytest.warns(ss.FarPointsWarning, match="Angles must be in radians"):
        ss.CubicSpline(None, degrees, "torus:1")
    ss.CubicSpline(None, np.radians(degrees), "torus:1")


def on_plane(angles):
    """Turns about one axis."""
    return Rotation.from_rotvec(np.outer(np.cumsum(angles), [0, 0, 1])).as_matrix()


def test_more_than_half_of_the_steps_count():
    for far, warns in ((4, False), (5, True)):
        angles = np.r_[0.0, np.full(far, 0.61 * np.pi), np.full(8 - far, 0.59 * np.pi)]
        with pytest.warns(ss.FarPointsWarning, match="5 of 8 steps") if warns else warnings.catch_warnings():
            ss.CubicSpline(None, on_plane(angles), "so:3")
    # Three steps are too few.
    ss.CubicSpline(None, on_plane([0, 2.5, 2.5, 2.5]), "so:3")


@pytest.mark.parametrize("name", ["sphere:2", "rp:2", "cp:2", "gr:2,5", "cgr:2,5", "so:5", "u:3", "su:3", "se:3"])
def test_the_angle_that_decides_counts(name):
    """One angle of 0.7 of the way to the cut locus, in every step; or of 0.5, and more of them beside it."""
    space = ss.space(name)
    p = points_on(space, 9, step=0.1)
    v = space.log(p[0], p[1])
    full = {"so:5": np.pi, "u:3": np.pi, "su:3": np.pi, "se:3": np.pi}
    if name in ("so:5", "u:3", "su:3", "se:3"):
        omega = np.linalg.solve(p[0], v)
        largest = np.abs(np.linalg.eigvals(omega).imag).max()
    elif "gr" in name:
        largest = np.linalg.svd(v, compute_uv=False)[0]
    else:
        largest = space.norm(p[0], v)
    limit = full.get(name, space.injectivity_radius)
    for part, warns in ((0.7, True), (0.5, False)):
        moved = [p[0]]
        for _ in range(5):
            moved.append(space.exp(moved[-1], part * limit / largest * v))
            v = space.transport(moved[-2], moved[-1], v)
        with pytest.warns(ss.FarPointsWarning) if warns else warnings.catch_warnings():
            ss.CubicSpline(None, moved, space, on_failure="ignore")
        v = space.log(p[0], p[1])


def test_long_translations_and_spaces_without_a_cut_locus_are_silent():
    poses = np.broadcast_to(np.eye(4), (6, 4, 4)).copy()
    poses[:, 0, 3] = 100.0 * np.arange(6)
    ss.CubicSpline(None, poses, "se:3")
    ss.CubicSpline(None, points_on(ss.space("spd:3"), 6, step=4.0), "spd:3", on_failure="ignore")
    ss.CubicSpline(None, 1e3 * np.random.default_rng(0).standard_normal((6, 2)), "r:2")
