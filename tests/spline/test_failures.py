"""Failing curves: errors, warnings, and the other curves of a batch."""

import pickle
import warnings

import numpy as np
import pytest
from cases import EPS
from compare import largest_difference, same, same_curve
from curves import S2, failing, points_on
from refused import raises

import symspline as ss

C, H = np.cosh(1), np.sinh(1)
ERRORS = {"cut locus": ss.CutLocusError, "no convergence": ss.ConvergenceError}
every_failure = pytest.mark.parametrize("kind", ERRORS)
FLAT = points_on(ss.Euclidean(1), 20, (3,))
# Fits of three curves of which the middle one may fail.
FITS = {
    "class": lambda p, **options: ss.CubicSpline(None, p, S2, **options),
    "product": lambda p, **options: ss.CubicSpline(None, (FLAT, p), "r:1 x sphere:2", **options),
    "arrays": lambda p, **options: ss.fit(None, p, S2, **options)[1],
    "lists": lambda p, **options: ss.fit_many([(None, q) for q in p], S2, **options),
}


def converged(found):
    """Whether each of three curves has converged."""
    if isinstance(found, list):
        return [bool(curve.report.converged) for curve in found]
    return (found.report if isinstance(found, ss.CubicSpline) else found).converged.tolist()


@every_failure
@pytest.mark.parametrize("how", FITS)
def test_every_fit_obeys_on_failure(kind, how):
    p, options = failing(kind)
    for on_failure in ({}, {"on_failure": "raise"}):
        with pytest.raises(ERRORS[kind], match="of curve 1") as caught:
            FITS[how](p, **options, **on_failure)
        for error in (caught.value, pickle.loads(pickle.dumps(caught.value))):
            assert type(error) is ERRORS[kind] and str(error) == str(caught.value)
            assert converged(error.spline) == [True, False, True] and error.curve == (1,)
        assert pickle.loads(pickle.dumps(caught.value)).spline == caught.value.spline
    with pytest.warns(ss.ConvergenceWarning, match="of curve 1") as caught:
        assert converged(FITS[how](p, on_failure="warn", **options)) == [True, False, True]
    assert [warning.filename for warning in caught] == [__file__]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert converged(FITS[how](p, on_failure="ignore", **options)) == [True, False, True]


@every_failure
def test_the_error_of_a_single_curve_has_the_curve(kind):
    p, options = failing(kind)
    with pytest.raises(ERRORS[kind]) as caught:
        ss.CubicSpline(None, p[1], S2, **options)
    assert caught.value.curve == () and caught.value.spline.report.converged is False
    assert np.abs(caught.value.spline.points - p[1]).max() <= 2 * EPS


@every_failure
def test_a_bad_curve_never_spoils_the_others(kind):
    p, options = failing(kind)
    spline = ss.CubicSpline(None, p, S2, on_failure="ignore", **options)
    many = ss.fit_many([(None, p[0]), (None, p[1]), (None, p[2][:7])], S2, on_failure="ignore", **options)
    assert same_curve(many[2], ss.CubicSpline(None, p[2][:7], S2, **options))
    x = np.linspace(0, 19, 50)
    for i in (0, 2):
        alone = ss.CubicSpline(None, p[i], S2, **options)
        assert same_curve(spline[i], alone)
        for nu in range(3):
            assert same(spline(x, nu=nu)[i], alone(x, nu=nu))


def test_an_unconverged_curve_keeps_its_best_iterate():
    p, options = failing("no convergence")
    spline = ss.CubicSpline(None, p, S2, on_failure="ignore", **options)[1]
    assert np.isfinite(spline.velocities).all()
    assert largest_difference(spline(spline.t), spline.points) < 20 * EPS
    for method in ("fixed-point", "quasi-newton"):
        residuals = [
            ss.CubicSpline(None, p[1], S2, method=method, max_iter=n, on_failure="ignore").report.residual
            for n in range(1, 40)
        ]
        assert (np.diff(residuals) <= 0).all()


def test_velocities_beyond_the_largest_number_are_no_curve():
    with pytest.raises(ss.ConvergenceError, match="exceeded the floating-point range"):
        ss.CubicSpline([0, 1.57, 1.85], [[0.5, 0.5], [0.5, 0.5], [1e308, 0.5]], "r:2")


def test_kinds_of_errors():
    assert issubclass(ss.ValidationError, ValueError)
    assert issubclass(ss.CutLocusError, ValueError)
    assert issubclass(ss.ConvergenceError, RuntimeError)
    assert issubclass(ss.ConvergenceWarning, UserWarning)


def test_overflowing_control_polygons_raise():
    for name, p, v, length, part in [
        ("spd:2", [np.eye(2), np.diag([2.0, 0.5])], [np.diag([45.0, -45.0]), None], 21.2, 2 / 3),
        # Given velocities are a solution at once, but ε cosh²(30) is far above 1.
        ("h:2", [[1.0, 0, 0], [C, H, 0]], [[0, 0, 90.0]] * 2, 30.0, 0.1),
        ("ch:1", np.array([[1, 0], [C, H]], complex), 57j * np.array([[0, 1], [H, C]]), 19.0, 0.1),
    ]:
        fast, slow = (tuple("natural" if x is None else (1, s * np.asarray(x)) for x in v) for s in (1, part))
        match = r"control handle at points\[0\] has length .*times"
        error = raises(match, ss.CubicSpline, None, p, name, error=ss.ConvergenceError, bc_type=fast)
        assert error.node == 0 and error.value == pytest.approx(length, abs=0.05)
        spline = ss.CubicSpline(None, p, name, bc_type=slow)
        assert spline.report.converged and np.isfinite(spline(0.5)).all()


BEGIN = "neighbours almost at the cut locus"
MARK = pytest.mark.parametrize(
    "name", ["sphere:2", "sphere:4", "rp:2", "cp:2", "gr:2,5", "cgr:2,4", "so:3", "so:5", "u:2", "su:3", "se:3"]
)


def cut_in(space, p, v):
    """How many times as long as v a geodesic is where others get shorter, by bisection."""
    low, high = 0.0, 20.0
    for _ in range(60):
        middle = (low + high) / 2
        shortest = space.distance(p, space.exp(p, middle * v)) > middle * space.norm(p, v) * (1 - 1e-9)
        low, high = (middle, high) if shortest else (low, middle)
    return low


def rotations(*angles):
    """Turned by these angles in degrees, one after the other, about one axis."""
    return ss.rotations.from_rotation_vectors(np.radians(np.cumsum([0, *angles]))[:, None] * [0, 0, 1])


def silent(call):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return call()


def warned(call):
    with pytest.warns(UserWarning) as caught:
        result = call()
    (warning,) = caught
    # It points to the line that called, not into the package.
    assert warning.filename == __file__
    return result, str(warning.message)


@MARK
def test_within_a_hundred_thousandth(name):
    space = ss.space(name)
    rng = np.random.default_rng(3)
    p = space.random_point(rng)
    v = space.random_tangent(rng, p)
    cut = cut_in(space, p, v)

    def points(part):
        return np.stack([space.exp(p, x * v) for x in (0, 0.3 * cut, (0.3 + part) * cut)])

    silent(lambda: ss.CubicSpline(None, points(1 - 1.2e-5), space))
    with pytest.warns(UserWarning, match=rf"{BEGIN}: between points\[1\] and points\[2\] the angle is"):
        ss.CubicSpline(None, points(1 - 8e-6), space)


def test_curves_of_a_batch():
    good, almost, bad = rotations(20, 30), rotations(20, 179.9999), rotations(180, 30)
    batch = np.stack([[good, almost], [almost, good]])
    _, said = warned(lambda: ss.CubicSpline(None, batch, "so:3"))
    assert "between points[1] and points[2] of curve 0,1 the" in said and said.endswith("(and 1 more curves)")
    _, said = warned(lambda: ss.fit_many([(None, good), (None, almost)], "so:3"))
    assert "between points[1] and points[2] of curve 1 the" in said
    silent(lambda: ss.CubicSpline(None, batch, "so:3", where=[[True, False], [False, True]]))
    _, said = warned(lambda: ss.CubicSpline(None, batch, "so:3", where=[[False, False], [True, True]]))
    assert "of curve 1,0 the" in said
    # What failed comes first.
    with pytest.raises(ss.CutLocusError, match="of curve 0 lie at or past"):
        silent(lambda: ss.CubicSpline(None, np.stack([bad, almost]), "so:3"))
    curves, said = warned(lambda: ss.CubicSpline(None, np.stack([bad, almost]), "so:3", on_failure="ignore"))
    assert "of curve 1 the" in said
    assert curves.report.converged.tolist() == [False, True]


@pytest.mark.parametrize("bc_type", ["natural", "periodic"])
def test_long_curves_solved_by_blocks_name_the_point(bc_type):
    angles = np.full(4000, 360 / 4000)
    angles[3210] = 179.9999
    points = rotations(*angles[:-1], 360 - angles[:-1].sum() % 360)
    points[-1] = points[0]
    _, said = warned(lambda: ss.CubicSpline(None, points, "so:3", bc_type=bc_type, method="newton"))
    assert "between points[3210] and points[3211] the" in said


def raised(kind, *arguments, **options):
    with pytest.raises(kind) as caught:
        ss.CubicSpline(*arguments, **options)
    assert type(caught.value) is kind
    return caught.value


def test_errors_carry_the_curve_the_node_and_the_numbers():
    points = np.stack([[points_on(S2)] * 2] * 2)
    far, off = points.copy(), points.copy()
    far[1, 0, 2], off[1, 0, 2] = -points[1, 0, 1], 2 * points[1, 0, 2]
    error = raised(ss.ValidationError, None, off, S2)
    assert (error.curve, error.node, error.spline) == ((1, 0), 2, None)
    error = raised(ss.CutLocusError, None, far, S2)
    assert (error.curve, error.node) == ((1, 0), 1)
    assert error.value == pytest.approx(np.pi) and error.limit == pytest.approx(np.pi)
    error = raised(ss.ConvergenceError, None, points[0, 0], S2, method="fixed-point", max_iter=2)
    assert error.curve == () and error.value > error.limit == 1e-12
    # Text that is added on the way to the user leaves the fields as they are.
    dates, flat = np.datetime64("2026-01-01") + np.arange(off.shape[2]), np.zeros((*off.shape[:3], 1))
    error = raised(ss.ValidationError, dates, (flat, off), "r:1 x sphere:2")
    assert (error.curve, error.node) == ((1, 0), 2) and "factor 1, Sphere(2): " in str(error)
    frames = np.stack([[np.eye(4, 2)] * 3] * 2)
    frames[1, 1] *= 2
    error = raised(ss.ValidationError, None, frames, ss.Stiefel(2, 4))
    assert (error.curve, error.node) == ((1,), 1)


def test_warnings_about_a_curve_have_its_index_and_node():
    t = [0, 1, 2]
    good, turned = np.eye(4)[[0, 1, 2]], np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, -0.8, 0.6, 0]])
    with pytest.warns(UserWarning, match="opposite sign") as caught:
        ss.fit_many([(t, good), (t, turned)], "sphere:3")
    (warning,) = [found.message for found in caught]
    assert (warning.curve, warning.node) == ((1,), 1)
    with pytest.warns(ss.ConvergenceWarning, match="cut locus") as caught:
        ss.CubicSpline(None, [good, [good[0], -good[0], good[1]]], "sphere:3", on_failure="warn")
    assert [(found.message.curve, found.message.node) for found in caught if "cut" in str(found.message)] == [((1,), 0)]
