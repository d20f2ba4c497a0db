"""Inconsistent representations of the data: a warning if most steps are long. Huge and tiny numbers."""

import itertools
import warnings

import numpy as np
import pytest
from cases import unit_tangent
from curves import points_on
from scipy.interpolate import CubicSpline as FlatSpline
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline.cli import main

MESSAGE = "more than half of the steps are long"
SO3 = ss.SpecialOrthogonal(3)
# The 24 rotations of a cube.
CUBE = Rotation.create_group("O").as_matrix()


@pytest.fixture(autouse=True)
def every_warning():
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=MESSAGE)
        yield


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


@pytest.mark.parametrize("space, points", [("so:3", orientations()), ("u:2", gates(1)), ("so:4", modes())])
def test_data_in_representations_that_do_not_fit_warn(space, points):
    with pytest.warns(ss.FarPointsWarning, match=MESSAGE) as said:
        ss.CubicSpline(None, points, space, on_failure="ignore")
    assert len(said) == 1 and said[0].filename == __file__
    assert "of 11 steps" in str(said[0].message) and "nearest to the previous" in str(said[0].message)


def test_the_nearest_representative_is_silent():
    points = orientations()
    for i in range(1, len(points)):
        points[i] = min(points[i] @ CUBE, key=lambda q: SO3.distance(points[i - 1], q))
    ss.CubicSpline(None, points, "so:3")
    for space in ("so:3", "u:2", "so:4"):
        ss.CubicSpline(None, smooth(space), space)


def on_plane(angles):
    """Turns about one axis."""
    return Rotation.from_rotvec(np.outer(np.cumsum(angles), [0, 0, 1])).as_matrix()


@pytest.mark.parametrize("far, warns", [(4, False), (5, True)])
def test_more_than_half_of_the_steps_count(far, warns):
    angles = np.r_[0.0, np.full(far, 0.61 * np.pi), np.full(8 - far, 0.59 * np.pi)]
    with pytest.warns(ss.FarPointsWarning, match="5 of 8 steps") if warns else warnings.catch_warnings():
        ss.CubicSpline(None, on_plane(angles), "so:3")


def test_curves_of_three_steps_are_silent():
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


def test_one_warning_counts_the_curves_of_a_call():
    points = np.stack([smooth("so:3"), orientations(1), orientations(2)])
    options = {"on_failure": "ignore"}
    with pytest.warns(ss.FarPointsWarning, match=r"of curve 1 \(and of 1 more curves\)") as said:
        ss.CubicSpline(None, points, "so:3", **options)
    assert len(said) == 1
    with pytest.warns(ss.FarPointsWarning, match=r"of curve 1 \(and of 1 more curves\)") as said:
        ss.fit_many([(None, p) for p in points], "so:3", **options)
    assert len(said) == 1
    ss.CubicSpline(None, points, "so:3", where=[True, False, False], **options)
    ss.fit_many([(None, p) for p in points], "so:3", where=[True, False, False], **options)
    with pytest.warns(ss.FarPointsWarning, match="SpecialOrthogonal"):
        ss.CubicSpline(None, (points[1], np.zeros((12, 2))), "so:3 x r:2", **options)


def test_other_functions_warn_too():
    points = orientations()
    with pytest.warns(ss.FarPointsWarning):
        ss.HermiteSpline(None, points, np.zeros_like(points), "so:3")
    with pytest.warns(ss.FarPointsWarning):
        ss.fit(None, points, "so:3", on_failure="ignore")
    ends = itertools.cycle([[1.0, 0, 0], [-0.9, 0.19**0.5, 0]])
    there_and_back = [next(ends) for _ in range(8)]
    with pytest.warns(ss.FarPointsWarning):
        ss.make_smoothing_spline(None, there_and_back, "sphere:2", lam=1e-6, on_failure="ignore")


def test_the_command_line_notes_it(tmp_path, capsys):
    p = np.array([[1.0, 0, 0], [-0.8, 0.6, 0]] * 4)
    table = tmp_path / "data.csv"
    np.savetxt(table, np.c_[np.arange(8.0), p], delimiter=",", header="t,x,y,z", comments="")
    warnings.filterwarnings("always", message=MESSAGE)
    main(["fit", str(table), "--space", "sphere:2", "-o", str(tmp_path / "curve.npz")])
    assert MESSAGE in capsys.readouterr().err


# ---- huge and tiny numbers, very far points ----


@pytest.mark.parametrize("size", [1e-200, 1e-150, 1e-30, 1e30, 1e150, 1e200])
def test_huge_and_tiny_flat_data(size):
    t, p = np.arange(5.0), size * points_on(ss.Euclidean(2), 5)
    spline, flat = ss.CubicSpline(t, p, "r:2"), FlatSpline(t, p, bc_type="natural")
    assert np.abs(spline.velocities - flat(t, 1)).max() < 1e-13 * size


@pytest.mark.parametrize(("name", "step"), [("hyperbolic:2", 11.0), ("spd:3", 14.0)])
def test_very_far_points_converge_to_their_rounding(name, step):
    """What rounding does to a residual grows with the length of chords, and is not a failure until the curve shows it,
    see test_report_is_true."""
    space = ss.space(name)
    origin = np.eye(*(3,) * 2) if name == "spd:3" else np.array([1.0, 0, 0])
    for seed in range(20):
        rng = np.random.default_rng(seed)
        p = [space.exp(origin, step / 2 * unit_tangent(space, origin, rng)) for _ in range(5)]
        assert ss.CubicSpline(None, np.array(p), space).report.converged
