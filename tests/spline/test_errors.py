"""Bad input: an error of its own that names the place, the value and what to do, before any work."""

import contextlib
import gc
import io
import json
import re
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest
from curves import points_on, run_python

import symspline as ss

S2 = ss.Sphere(2)
P = np.eye(3)
TWO = np.stack([P, P])
NAN, INF = np.nan, np.inf


def fit_error(match, t=None, points=P, space=S2, kind=ss.ValidationError, **options):
    """A fit fails with a message like this, and does nothing before."""
    calls = []
    with pytest.raises(kind, match=match) as caught:
        ss.CubicSpline(t, points, space, progress=lambda *call: calls.append(call), **options)
    assert type(caught.value) is kind
    assert not calls or kind is not ss.ValidationError


def changed(index, value, points=P):
    points = np.array(points, float)
    points[index] = value
    return points


# ---- points ----


@pytest.mark.parametrize(
    "points, match",
    [
        (np.ones((3, 4)), r"points has shape \(3, 4\), but Sphere\(2\) needs shape \(\.\.\., 3\)"),
        (np.ones((3, 1)), r"points has shape \(3, 1\), but Sphere\(2\) needs"),
        (
            np.ones(3),
            r"shape \(3,\), which is one point; a curve needs shape \(\.\.\., N\+1, \*point_shape\)",
        ),
        (np.ones(()), r"no points given; a curve needs at least two"),
        ([], r"no points given; a curve needs at least two"),
        (np.ones((0, 3)), r"no points given; a curve needs at least two"),
        ([[1, 0, 0]], r"at least two points; got one"),
        (np.ones((4, 1, 3)), r"at least two points; got one"),
    ],
    ids=lambda x: str(np.shape(x)) if not isinstance(x, str) else "",
)
def test_shapes_of_points(points, match):
    fit_error(match, points=points)


@pytest.mark.parametrize(
    "points", [P + 0j, P.astype(str), P.astype(object), None, P.astype("M8[s]"), "points"]
)
def test_points_are_real_numbers(points):
    fit_error(r"points must be an array of real numbers, not of|no points given", points=points)


@pytest.mark.parametrize("argument", ["points", "t", "x", "end vector"])
def test_ragged_lists(argument):
    ragged = [[1, 0, 0], [0, 1]]
    with pytest.raises(ss.ValidationError):
        if argument == "x":
            ss.CubicSpline(None, P, S2)(ragged)
        elif argument == "end vector":
            ss.CubicSpline(None, P, S2, bc_type=((1, ragged), "natural"))
        else:
            ss.CubicSpline(**{"t": None, "points": P, argument: ragged}, space=S2)


OFF = r" is off the space"


@pytest.mark.parametrize("value", [NAN, INF, -INF])
@pytest.mark.parametrize(
    "space, points", [("sphere:2", P), ("euclidean:3", P), ("hyperbolic:2", P[[0, 0, 0]])]
)
def test_points_that_are_not_finite(space, points, value):
    fit_error(
        rf"points\[1\]{OFF}.*(NaN|inf|not finite).*space\.project\(x\)",
        None,
        changed((1, 2), value, points),
        space,
    )


@pytest.mark.parametrize(
    "space, points, match",
    [
        (
            "sphere:2",
            changed(2, [0, 0, 1.1]),
            r"points\[2\] is off the space by 1\.000e-1: its norm is 1\.1, not 1",
        ),
        ("sphere:2", changed(1, 0), r"points\[1\] is off the space by 1\.000e0: it is the zero vector"),
        (
            "hyperbolic:2",
            [[1, 0, 0], [1.1, 0, 0]],
            r"points\[1\] is off .* by 1\.000e-1: its Minkowski square is -1\.21",
        ),
        ("hyperbolic:2", [[-1, 0, 0], [1, 0, 0]], r"points\[0\] is off .*the first, is -1, not positive"),
        ("hyperbolic:2", [[1, 0, 0], [0, 0, 0]], r"points\[1\] is off .*the first, is 0, not positive"),
    ],
)
def test_points_off_the_space(space, points, match):
    fit_error(match + r".*Points within 1e-8 are projected; use space\.project\(x\)", None, points, space)


def test_the_bad_point_of_a_batch_is_named():
    fit_error(
        r"points\[2\] of curve 1 is off the space by 5\.000e-1", points=changed((1, 2), [0, 0, 1.5], TWO)
    )
    with pytest.raises(ss.ValidationError, match=r"points\[1\] of curve 1 is off the space"):
        ss.fit_many([(None, P), (None, changed(1, [0, 2, 0])[:2])], S2)


def test_the_bad_factor_of_a_product_is_named():
    flat = np.zeros((3, 1))
    fit_error(r"points\[1\]\[2\]|factor 1|Sphere\(2\)", None, (flat, changed(2, [0, 0, 2])), "r:1 x sphere:2")


def test_a_product_is_checked_before_any_work():
    fit_error("off the space", None, (np.zeros((3, 1)), changed(2, [0, 0, 2])), "r:1 x sphere:2")


@pytest.mark.parametrize("dtype, tol", [("f8", "1e-8"), ("f4", "1e-4")])
def test_how_far_off_is_allowed(dtype, tol):
    fit_error(
        rf"off the space by 1\.0\d*e-2.*Points within {tol} are projected", points=(P * 1.01).astype(dtype)
    )


# ---- the cut locus ----


@pytest.mark.parametrize("method", ["auto", "fixed-point", "quasi-newton"])
def test_antipodal_neighbours(method):
    match = r"points\[1\] and points\[2\] lie at or past .*cut locus: angle 3\.14159\d*, limit 3\.14159\d*; put a point"
    fit_error(match, None, [P[0], P[1], -P[1]], kind=ss.CutLocusError, method=method)


def test_antipodal_neighbours_in_a_batch():
    match = r"points\[0\] and points\[1\] of curve 1 lie"
    fit_error(match, None, [P, [P[0], -P[0], P[1]]], kind=ss.CutLocusError)
    with pytest.raises(ss.CutLocusError, match=match):
        ss.fit_many([(None, P), (None, [P[0], -P[0]])], S2)


@pytest.mark.parametrize("n", [600, 3000])
def test_antipodal_neighbours_in_a_long_curve(n):
    points = S2.geodesic(P[0], P[1], np.linspace(0, 1, n))
    points[n - 100] = -points[n - 101]
    fit_error(rf"points\[{n - 101}\] and points\[{n - 100}\]", None, points, kind=ss.CutLocusError)


@pytest.mark.parametrize("operation", ["log", "geodesic", "transport"])
def test_antipodal_points_in_operations(operation):
    q = np.array([P[1], P[1], -P[0]])
    extra = {"log": (), "geodesic": (0.5,), "transport": (np.zeros(3),)}[operation]
    with pytest.raises(ss.CutLocusError, match=r"pair 2: .*angle 3\.14159\d*, limit 3\.14159"):
        getattr(S2, operation)(P[0], q, *extra)
    assert S2.distance(P[0], -P[0]) == pytest.approx(np.pi)


def test_the_logarithm_of_nan_is_no_cut_locus():
    try:
        result = S2.log(P[0], [NAN, 0, 0])
    except ss.ValidationError:
        return
    assert np.isnan(result).all()


# ---- times ----


@pytest.mark.parametrize(
    "t, match",
    [
        ([], r"t is empty; a curve needs at least two points"),
        ([0, 1], r"t has shape \(2,\), but 3 points a curve need \(3,\)"),
        (5.0, r"t has shape \(\), but 3 points"),
        ([[0, 1, 2]], r"t has shape \(1, 3\), but 3 points"),
        ([0, NAN, 2], r"t\[1\] is NaN; times must be finite"),
        ([0, 1, INF], r"t\[2\] is inf; times must be finite"),
        ([-INF, 1, 2], r"t\[0\] is -inf; times must be finite"),
        ([0, 2, 1], r"t\[2\] = 1 is before t\[1\] = 2.*np\.argsort\(t\)"),
        ([0, 1, 1], r"t\[2\] = 1 repeats t\[1\] = 1.*different times"),
        ([0, -0.0, 1], r"t\[1\] = -?0 repeats t\[0\] = 0"),
        (["a", "b", "c"], r"t must be numbers or datetime64, not <U1"),
        ([0, 1j, 2], r"t must be numbers or datetime64, not complex128"),
        ([0, None, 2], r"t must be numbers or datetime64, not object"),
        (np.arange(3).astype("m8[s]"), r"t must be numbers or datetime64, not timedelta64"),
        (np.array(["2024-01-01", "NaT", "2024-01-03"], "M8[D]"), r"t\[1\] is NaT"),
        (np.array(["2024-01-01", "2024-01-03", "2024-01-02"], "M8[D]"), r"t\[2\] .*is before t\[1\]"),
        ([-1e308, 0, 1e308], r"t spans more than a double can hold"),
    ],
    ids=str,
)
def test_bad_times(t, match):
    fit_error(match, t)


def test_the_bad_time_of_a_batch_is_named():
    fit_error(r"t\[1\]\[2\] = 1 is before t\[1\]\[1\] = 2", [[0, 1, 2], [0, 2, 1]], TWO)
    fit_error(r"t has shape \(3, 3\), but 3 points a curve need \(3,\) or \(2, 3\)", np.ones((3, 3)), TWO)
    with pytest.raises(ss.ValidationError, match=r"curve 1: t has shape \(2,\), but 3 points"):
        ss.fit_many([(None, P), ([0, 1], P)], S2)
    with pytest.raises(ss.ValidationError, match=r"t\[1\]\[2\] = 1 is before"):
        ss.fit_many([(None, P), ([0, 2, 1], P)], S2)


def named(message, arrays):
    """The element that the first subscript in a message picks."""
    name, subscript = re.match(r"(\w+)((?:\[[^]]*\])+)", message).groups()
    value = arrays[name]
    for index in re.findall(r"\[([^]]*)\]", subscript):
        value = value[tuple(map(int, index.split(",")))]
    return value


@pytest.mark.parametrize("argument", ["t", "x"])
def test_indices_are_those_of_the_array_that_was_given(argument):
    t = np.broadcast_to([0.0, 1, 2], (2, 2, 3)).copy()
    with pytest.raises(ss.ValidationError) as caught:
        if argument == "t":
            t[1, 0, 1] = NAN
            ss.CubicSpline(t, np.stack([TWO, TWO]), S2)
        else:
            x = np.array([[0.5, 1.5], [1.0, NAN]])
            ss.CubicSpline(None, P, S2)(x)
    assert np.isnan(named(str(caught.value), {"t": t} if argument == "t" else {"x": x}))


def test_times_in_messages_are_those_that_were_given():
    with pytest.raises(ss.ValidationError, match=r"t\[2\] = 6 repeats") as caught:
        ss.CubicSpline([5, 6, 6], P, S2)
    assert "counted from" not in str(caught.value)


def test_messages_are_short():
    with pytest.raises(ss.ValidationError) as caught:
        ss.CubicSpline(None, P, S2)(-1e-300)
    assert len(str(caught.value)) < 250


# ---- end conditions ----

TANGENT, ACROSS = [0, 0.5, 0], [0.5, 0, 0]


@pytest.mark.parametrize(
    "bc_type, match",
    [
        ("foo", r"bc_type is 'natural', 'clamped', 'not-a-knot' or 'periodic', or a pair .*'foo'"),
        (None, r"bc_type is .*got None"),
        (3, r"bc_type is .*got 3"),
        (("natural",), r"bc_type is .*got \('natural',\)"),
        (("natural",) * 3, r"bc_type is .*got \('natural', 'natural', 'natural'\)"),
        (("natural", "foo"), r"the end is 'foo'"),
        (("periodic", "natural"), r"the start is 'periodic'"),
        ((1, TANGENT), r"the start is 1"),
        (("natural", (3, TANGENT)), r"the end is \(3, \[0, 0\.5, 0\]\)"),
        (("natural", (0, TANGENT)), r"the end is \(0, "),
        (((1,), "natural"), r"the start is \(1,\)"),
        (((1, [0, 1]), "natural"), r"the start velocity has shape \(2,\), but Sphere\(2\) needs shape"),
        (((2, 0.5), "natural"), r"the start acceleration has shape \(\), but"),
        (
            ((1, np.zeros((2, 3))), "natural"),
            r"the start velocity has shape \(2, 3\), which does not broadcast to \(3,\)",
        ),
        (
            ((1, [0, 1j, 0]), "natural"),
            r"the start velocity must be an array of real numbers, not of complex128",
        ),
        (((1, None), "natural"), r"the start velocity must be an array of real numbers, not of object"),
        (("natural", (1, ["a", "b", "c"])), r"the end velocity must be an array of real numbers, not of <U1"),
        (((1, [0, NAN, 0]), "natural"), r"the start velocity holds NaN; it must be finite"),
        (("natural", (2, [0, INF, 0])), r"the end acceleration holds inf; it must be finite"),
        (
            ((1, ACROSS), "natural"),
            r"the start velocity is not tangent at its point: a part of 1\.000e0 .*project_tangent",
        ),
        (("natural", (2, [0, 1, 1])), r"the end acceleration is not tangent .*a part of 7\.071e-1"),
    ],
    ids=str,
)
def test_bad_end_conditions(bc_type, match):
    fit_error(match, bc_type=bc_type)


def test_bad_end_conditions_in_a_batch():
    fit_error(
        r"the start velocity of curve 1 is not tangent",
        None,
        TWO,
        bc_type=((1, [TANGENT, ACROSS]), "natural"),
    )
    fit_error(
        r"the start velocity of curve 1 holds NaN",
        None,
        TWO,
        bc_type=((1, [TANGENT, [NAN, 0, 0]]), "natural"),
    )
    fit_error(r"does not broadcast to \(2, 3\)", None, TWO, bc_type=((1, np.zeros((3, 3))), "natural"))


@pytest.mark.parametrize("h, largest", [(1.0, r"9\.42477\d"), (0.5, r"18\.8495\d*")])
def test_too_fast_end_velocities(h, largest):
    t = [0, h, 2, 3 - h / 2, 3 + h / 2]
    p = S2.geodesic(P[0], P[1], np.linspace(0, 1, 5))
    match = (
        rf"velocity has speed 20\.0+, too fast for its segment of length {h:g}: .*must stay below {largest}"
    )
    fit_error("the start " + match, t, p, bc_type=((1, [0, 20, 0]), "natural"))
    fit_error("the end " + match, t, p, bc_type=("natural", (1, [-20, 0, 0])))


def test_the_largest_end_velocity_is_the_one_named():
    limit = 3 * np.pi
    fit_error("too fast", points=P[:2], bc_type=((1, [0, limit * (1 + 1e-15), 0]), "natural"))
    fit_error(
        "too fast for .* of curve 1|of curve 1 .*too fast",
        None,
        TWO,
        bc_type=((1, [[0, 1, 0], [0, 10, 0]]), "natural"),
    )
    # Just below is no matter of validation; whether there is a curve is another question.
    ss.CubicSpline(None, P, S2, bc_type=((1, [0, limit * 0.99, 0]), "natural"), on_failure="ignore")


def test_no_end_velocity_is_too_fast_without_a_cut_locus():
    ss.CubicSpline(None, P, "r:3", bc_type=((1, [1e6, 0, 0]), "natural"))


def test_curves_that_are_not_closed():
    match = r"first and last point are 1\.571e0 apart \(allowed: 1e-8\); repeat the first point at the end"
    fit_error(match, bc_type="periodic")
    closed = [*P, P[0]]
    fit_error(r"first and last point of curve 1 are", None, [closed, [*P, P[1]]], bc_type="periodic")


# ---- options ----


@pytest.mark.parametrize(
    "options, match",
    [
        ({"method": "foo"}, r"method must be .*'auto'.*'quasi-newton'.*foo"),
        ({"tol": -1}, r"tol must be a number >= 0, not -1"),
        ({"tol": NAN}, r"tol must be a number >= 0, not NaN"),
        ({"tol": INF}, r"tol must be a number >= 0, not inf"),
        ({"max_iter": 0}, r"max_iter must be at least 1"),
        ({"extrapolate": "foo"}, r"extrapolate must be None, True, 'geodesic' or 'periodic', not 'foo'"),
        ({"extrapolate": False}, r"extrapolate must be .*, not False"),
        ({"on_failure": "foo"}, r"on_failure must be 'raise', 'warn' or 'ignore', not 'foo'"),
        ({"on_failure": None}, r"on_failure must be .*, not None"),
    ],
    ids=str,
)
@pytest.mark.parametrize("how", ["class", "product", "fit", "fit_many"])
def test_bad_options(options, match, how):
    if how == "class":
        fit_error(match, **options)
    with pytest.raises(ss.ValidationError, match=match):
        if how == "product":
            ss.CubicSpline(None, (P, P), "sphere:2 x r:3", **options)
        elif how == "fit_many":
            ss.fit_many([(None, P)], S2, **options)
        else:
            ss.fit(None, P, S2, **options)


@pytest.mark.parametrize("options", [{"max_iter": 1.5}, {"tol": "small"}, {"method": None}], ids=str)
def test_options_of_a_wrong_type(options):
    with pytest.raises((ss.ValidationError, TypeError), match=next(iter(options))):
        ss.CubicSpline(None, P, S2, **options)


@pytest.mark.parametrize(
    "options",
    [
        {"max_iter": -1},
        {"max_iter": 10**30},
        {"extrapolate": np.array([1, 2])},
        {"bc_type": (([1], TANGENT), "natural")},
        {"progress": 5},
    ],
    ids=str,
)
def test_options_that_cannot_be_understood(options):
    with pytest.raises((ss.ValidationError, TypeError), match=next(iter(options))):
        ss.CubicSpline(None, P, S2, **options)


def test_unknown_options():
    for call in (ss.CubicSpline, ss.fit):
        with pytest.raises(TypeError, match="smooth"):
            call(None, P, S2, smooth=True)
    with pytest.raises(TypeError, match="smooth"):
        ss.fit_many([(None, P)], S2, smooth=True)


@pytest.mark.parametrize(
    "space, match",
    [
        ("spere:2", r"unknown space 'spere:2'; known are .*sphere.*, e\.g\. 'sphere:2'"),
        ("", r"unknown space ''"),
        ("sphere:2 x klein:2", r"unknown space 'klein:2'"),
        ("sphere", r"'sphere': behind the colon come whole numbers"),
        ("sphere:", r"'sphere:': behind the colon come whole numbers"),
        ("sphere:-1", r"'sphere:-1': behind the colon come whole numbers"),
        ("sphere:2.0", r"behind the colon come whole numbers"),
        ("sphere:2,3", r"'sphere:2,3': Sphere does not take 2 numbers"),
        ("sphere:0", r"Sphere\(n\) needs n >= 1"),
        (None, r"a space or its name is needed, not None"),
        (ss.Sphere, r"a space or its name is needed, not <class"),
        (2, r"a space or its name is needed, not 2"),
    ],
    ids=str,
)
def test_unknown_spaces(space, match):
    fit_error(match, space=space)
    with pytest.raises(ss.ValidationError, match=match):
        ss.space(space)


@pytest.mark.parametrize("n", [-1, 2.0, "2", None, True, 0])
@pytest.mark.parametrize("kind", [ss.Sphere, ss.Hyperbolic, ss.Euclidean])
def test_bad_dimensions(kind, n):
    with pytest.raises(ss.ValidationError, match=rf"{kind.__name__} takes whole numbers, not|needs n >= 1"):
        kind(n)


@pytest.mark.parametrize("make", [lambda: ss.Sphere(10**30), lambda: ss.space("sphere:" + "9" * 30)])
def test_huge_dimensions(make):
    with pytest.raises(ss.ValidationError):
        make()


# ---- products ----

PRODUCT = "sphere:2 x r:1"
FLAT = np.zeros((3, 1))


@pytest.mark.parametrize(
    "points, options, match",
    [
        (
            P,
            {},
            r"points must be a tuple of 2 arrays, one a factor of Product\(Sphere\(2\), Euclidean\(1\)\)",
        ),
        ((P,), {}, r"points must be a tuple of 2 arrays"),
        ((P, FLAT, FLAT), {}, r"points must be a tuple of 2 arrays"),
        ((FLAT, P), {}, r"points has shape \(3, 1\), but Sphere\(2\) needs"),
        ((P, FLAT), {"bc_type": ((1, [0, 0, 0]), "natural")}, r"an end vector must be a tuple of 2 arrays"),
        ((P, FLAT), {"bc_type": "foo"}, r"the start is 'foo'"),
        ((P, FLAT), {"bc_type": ("natural",)}, r"a pair, not \('natural',\)"),
        ((P, FLAT), {"bc_type": ("natural", (1,))}, r"an end condition is a word or a pair"),
    ],
)
def test_bad_products(points, options, match):
    fit_error(match, None, points, PRODUCT, **options)


def test_a_product_has_factors():
    with pytest.raises(ss.ValidationError, match="at least two factors"):
        ss.Product("sphere:2")
    space = ss.space(PRODUCT)
    with pytest.raises(ss.ValidationError, match=r"needs tuples of 2 arrays, one a factor"):
        space.exp((P, FLAT), (P,))


def test_factors_of_different_lengths():
    fit_error("points", None, (P, np.zeros((4, 1))), PRODUCT)


def test_factors_of_different_batch_axes():
    fit_error("batch axes differ", None, (TWO, np.zeros((3, 3, 1))), PRODUCT)


# ---- evaluation ----


@pytest.mark.parametrize(
    "x, match",
    [
        (NAN, r"x is NaN; times must be finite"),
        ([0.5, NAN], r"x\[1\] is NaN; times must be finite"),
        ([0.5, 1, INF], r"x\[2\] is inf; times must be finite"),
        (2.5, r"x = 2\.5 is outside the knots \[0, 2\].*extrapolate=True, 'geodesic' or 'periodic'"),
        ([0, 2, -0.25], r"x\[2\] = -0\.25 is outside the knots"),
        (np.nextafter(2, 3), r"x = 2\.0000000000000004 is outside the knots"),
        (1j, r"x must be numbers, not complex128"),
        ("a", r"x must be numbers, not <U1"),
        (None, r"x must be numbers, not object"),
        (np.timedelta64(1, "s"), r"x must be numbers, not timedelta64"),
        (np.datetime64("2024-01-01"), r"the knots are numbers, so x must be numbers, not datetime64"),
    ],
    ids=str,
)
def test_bad_times_of_evaluation(x, match):
    spline = ss.CubicSpline(None, P, S2)
    for call in (spline, spline.speed, lambda x: ss.evaluate(x, None, P, spline.velocities, S2)):
        with pytest.raises(ss.ValidationError, match=match):
            call(x)


@pytest.mark.parametrize("policy", [None, True, "geodesic", "periodic"])
@pytest.mark.parametrize("x", [NAN, INF, -INF])
def test_no_policy_makes_sense_of_nan(policy, x):
    spline = ss.CubicSpline(None, P, S2, extrapolate=policy)
    with pytest.raises(ss.ValidationError, match=r"x\[1\] is (NaN|-?inf); times must be finite"):
        spline([1.0, x])


def test_the_curve_of_a_bad_time_is_named():
    spline = ss.CubicSpline([[0, 1, 2], [0, 1, 3]], TWO, S2)
    with pytest.raises(ss.ValidationError, match=r"x = 2\.5 is outside the knots \[0, 2\] of curve 0"):
        spline(2.5)
    with pytest.raises(ss.ValidationError, match=r"x\[1,1\] is NaN"):
        spline([[1, 1], [1, NAN]], per_curve=True)
    with pytest.raises(ss.ValidationError, match=r"must begin with the batch axes \(2,\); got \(3,\)"):
        spline(np.ones(3), per_curve=True)


def test_dates_and_numbers_do_not_mix():
    spline = ss.CubicSpline(np.datetime64("2024-01-01") + np.arange(3), P, S2)
    with pytest.raises(
        ss.ValidationError, match=r"the knots are dates, so x must be datetime64, not float64"
    ):
        spline(0.5)
    with pytest.raises(ss.ValidationError, match=r"x\[1\] is NaT"):
        spline(np.array(["2024-01-01", "NaT"], "M8[D]"))
    with pytest.raises(ss.ValidationError, match=r"x = .* is outside the knots"):
        spline(np.datetime64("2023-12-31"))


@pytest.mark.parametrize("nu", [3, -1, 1.5, "1", None])
def test_bad_derivatives(nu):
    with pytest.raises(ss.ValidationError, match=r"nu must be 0, 1 or 2, not "):
        ss.CubicSpline(None, P, S2)(0.5, nu=nu)


def test_bad_policies_of_a_call():
    with pytest.raises(ss.ValidationError, match=r"extrapolate must be .*not 'foo'"):
        ss.CubicSpline(None, P, S2)(0.5, extrapolate="foo")


def test_evaluate_compares_shapes():
    with pytest.raises(ss.ValidationError, match=r"u has shape \(2, 3\), but points \(3, 3\)"):
        ss.evaluate(0.5, None, P, P[:2], S2)
    with pytest.raises(ss.ValidationError, match=r"t has shape \(2,\), but 3 points"):
        ss.evaluate(0.5, [0, 1], P, P, S2)
    with pytest.raises(ss.ValidationError, match=r"at least two points"):
        ss.evaluate(0.5, None, P[:1], P[:1], S2)


@pytest.mark.parametrize(
    "t, p, u",
    [
        ([0, 2, 1], P, 0 * P),
        ([0, 1, 1], P, 0 * P),
        ([0, NAN, 2], P, 0 * P),
        ([0, 1, 2], 2 * P, 0 * P),
        ([0, 1, 2], NAN * P, 0 * P),
    ],
)
def test_evaluate_checks_its_input(t, p, u):
    with pytest.raises(ss.ValidationError):
        ss.evaluate(0.5, t, p, u, S2)


BAD_KNOTS = """
import itertools, sys, numpy as np, symspline as ss
p = np.repeat(np.eye(3), 4, axis=0)
rng = np.random.default_rng(0)
up = np.arange(12.0)
knots = [rng.permutation(up), up[::-1], 0 * up, np.nan * up, np.r_[up[1:], np.inf]]
for t, nu, extrapolate in itertools.product(knots, range(3), (None, True, "geodesic", "periodic")):
    for size in (1, 40):
        x = rng.uniform(-1, 13, size)
        try:
            if sys.argv[1] == "evaluate":
                ss.evaluate(x, t, p, 0 * p, "sphere:2", nu, extrapolate=extrapolate)
            else:
                ss.CubicSpline(t, p, "sphere:2", check=False, on_failure="ignore")(x, nu, extrapolate=extrapolate)
        except ss.ValidationError:
            pass
"""


@pytest.mark.parametrize("how", ["evaluate", "check=False"])
def test_bad_knots_never_panic(how):
    run_python(BAD_KNOTS, how, RUST_BACKTRACE="0")


# ---- operations of spaces ----


@pytest.mark.parametrize(
    "call, match",
    [
        (lambda: S2.exp([1, 0], [0, 1]), r"p has shape \(2,\), but Sphere\(2\) needs shape \(\.\.\., 3\)"),
        (lambda: S2.exp(P, np.zeros((4, 3))), r"the leading axes do not broadcast: p \(3, 3\), v \(4, 3\)"),
        (lambda: S2.geodesic(P[0], P, [0, 1]), r"the leading axes do not broadcast"),
        (lambda: S2.distance(P, P + 0j), r"q must be an array of real numbers, not of complex128"),
        (
            lambda: S2.project(np.zeros((2, 3))),
            r"x\[0\] cannot be projected: no point of the space is close to it, or it is not finite",
        ),
        (lambda: S2.project([1, NAN, 0]), r"x cannot be projected"),
        (lambda: S2.check_point(2 * P), r"point 0 is off the space by 1\.000e0: its norm is 2"),
        (lambda: S2.check_tangent(P, P), r"vector 0 is not tangent .*a part of 1\.000e\+00"),
        (lambda: S2.check_tangent(P, NAN * P), r"vector 0 is not tangent"),
        (lambda: S2.check_tangent(2 * P, P), r"point 0 is off the space"),
    ],
)
def test_bad_operands(call, match):
    with pytest.raises(ss.ValidationError, match=match):
        call()


@pytest.mark.parametrize(
    "call",
    [
        lambda: S2.check_tangent(P[:2], np.zeros((3, 3))),
        lambda: S2.geodesic(P[0], P[1], "x"),
        lambda: S2.geodesic(P[0], P[1], 1j),
        lambda: ss.Hyperbolic(2).project([NAN, 0, 0]),
    ],
    ids=["check_tangent shapes", "t text", "t complex", "project NaN"],
)
def test_bad_operands_without_an_error_of_their_own(call):
    with pytest.raises(ss.ValidationError):
        call()


# ---- files ----


def stored(spline=None):
    file = io.BytesIO()
    (spline or ss.CubicSpline(None, P, S2)).save(file)
    return file.getvalue()


def load(data):
    return ss.load(io.BytesIO(data))


def with_arrays(**changes):
    """A well-formed file with some arrays replaced, or taken out."""
    arrays = dict(np.load(io.BytesIO(stored()))) | changes
    file = io.BytesIO()
    np.savez(file, **{name: array for name, array in arrays.items() if array is not None})
    return file.getvalue()


def is_good_or_refused(data):
    """A damaged file must be refused, or be read as what it was (damage may be where it does not matter)."""
    try:
        return load(data) == ss.CubicSpline(None, P, S2)
    except (ss.ValidationError, OSError):
        return True


def test_truncated_files():
    data = stored()
    for n in range(len(data)):
        with pytest.raises(ss.ValidationError, match="the file"):
            load(data[:n])


@pytest.mark.parametrize("mask", [0x01, 0xFF])
def test_files_with_one_bad_byte(mask):
    data = stored()
    for i in range(len(data)):
        assert is_good_or_refused(data[:i] + bytes([data[i] ^ mask]) + data[i + 1 :])


def test_files_with_many_bad_bytes():
    data, rng = np.frombuffer(stored(), np.uint8), np.random.default_rng(0)
    for _ in range(500):
        bad = data.copy()
        bad[rng.integers(len(bad), size=rng.integers(1, 200))] = rng.integers(256)
        assert is_good_or_refused(bad.tobytes())


@pytest.mark.parametrize(
    "method",
    [
        zipfile.ZIP_DEFLATED,
        zipfile.ZIP_BZIP2,
        zipfile.ZIP_LZMA,
    ],
)
def test_compressed_files(method):
    file = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(stored())) as source, zipfile.ZipFile(file, "w", method) as target:
        for name in source.namelist():
            target.writestr(name, source.read(name))
    data = file.getvalue()
    assert load(data) == ss.CubicSpline(None, P, S2)
    for i in range(0, len(data), 7):
        assert is_good_or_refused(data[:i] + bytes([data[i] ^ 0xFF]) + data[i + 1 :])


def npy(array):
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def archive(**members):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as target:
        for name, content in members.items():
            target.writestr(name.replace("__", "."), content)
    return file.getvalue()


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\0",
        b"hello",
        b"PK\x03\x04",
        b"PK\x05\x06" + 18 * b"\0",
        b"\x93NUMPY",
        b"\x80\x04N.",
        npy(np.eye(3)),
        npy(np.array("symspline-curve")),
        archive(readme__txt="hello"),
        archive(format__npy="hello"),
        archive(format__npy=b"\x93NUMPY\x01\0\x76\0{"),
        archive(format="symspline-curve"),
    ],
    # Without the time of day that is in an archive: workers must find the same tests.
    ids=lambda data: str(data[:8]),
)
def test_foreign_files(data):
    with pytest.raises(ss.ValidationError, match="the file"):
        load(data)


def test_messages_name_the_file(tmp_path):
    (tmp_path / "curve.npz").write_bytes(npy(np.eye(3)))
    for path in (tmp_path / "curve.npz", str(tmp_path / "curve.npz")):
        with pytest.raises(ss.ValidationError, match=r"curve\.npz"):
            ss.load(path)


@pytest.mark.parametrize(
    "data",
    [
        npy(np.eye(3)),
        archive(readme__txt="hello"),
        stored()[:500],
    ],
    ids=["array", "archive", "truncated"],
)
def test_files_are_closed_when_refused(tmp_path, data):
    (tmp_path / "curve.npz").write_bytes(data)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with contextlib.suppress(ss.ValidationError):
            ss.load(tmp_path / "curve.npz")
        gc.collect()
    assert not caught


class Bomb:
    """Leaves a mark when it is unpickled."""

    def __reduce__(self):
        return Path.touch, (Path(self.path),)


@pytest.mark.parametrize("name", ["format", "points", "report", "something"])
def test_files_are_read_without_pickle(tmp_path, name):
    bomb = Bomb()
    bomb.path = str(tmp_path / "exploded")
    with pytest.raises(ss.ValidationError):
        load(with_arrays(**{name: np.array([bomb], object)}))
    with pytest.raises(ss.ValidationError):
        load(npy(np.array([bomb], object)))
    assert not (tmp_path / "exploded").exists()


ARRAYS = dict(np.load(io.BytesIO(stored())))


@pytest.mark.parametrize("name", ARRAYS)
def test_files_with_a_missing_array(name):
    with pytest.raises(ss.ValidationError, match=name if name != "format" else "not a symspline curve"):
        load(with_arrays(**{name: None}))


def report_with(**changes):
    return json.dumps([json.loads(str(ARRAYS["report"]))[0] | changes])


@pytest.mark.parametrize(
    "changes",
    [
        {"format": "other"},
        {"version": 99},
        {"version": "one"},
        {"space": "klein:2"},
        {"space": "sphere:3"},
        {"space": "sphere:" + "9" * 30},
        {"space": "sphere:2 x sphere:2"},
        {"t": [0.0, 2, 1]},
        {"t": [0.0, 1, 1]},
        {"t": [0.0, NAN, 1]},
        {"t": [0.0, 1, INF]},
        {"t": [0.0, 1]},
        {"t": 1.0},
        {"t": [[0.0, 1, 2]]},
        {"t": ["a", "b", "c"]},
        {"t": [0, 1j, 2]},
        {"t": []},
        {"t_unit": "parsec", "t": [0, 1, 2]},
        {"t_unit": "s", "t": [0, 1, np.iinfo(np.int64).min]},
        {"points": 2 * P},
        {"points": NAN * P},
        {"points": P + 0j},
        {"points": 3.0},
        {"points": P[:2]},
        {"points": P.astype(str)},
        {"velocities": P[:2]},
        {"velocities": NAN * P},
        {"bc_type": "{"},
        {"bc_type": "5"},
        {"bc_type": "null"},
        {"extrapolate": '"foo"'},
        {"extrapolate": "[1]"},
        {"report": "[]"},
        {"report": "{}"},
        {"report": "[{}]"},
        {"report": "5"},
        {"report": "[" * 100_000},
        {"report": report_with(surprise=1)},
    ],
    ids=lambda changes: str(changes)[:40],
)
def test_files_with_a_wrong_array(changes):
    with pytest.raises(ss.ValidationError):
        load(with_arrays(**changes))


@pytest.mark.parametrize(
    "changes",
    [
        {"t": [0.0], "points": P[:1], "velocities": P[:1]},
        {"bc_type": '"foo"'},
        {"bc_type": "{}"},
        {"bc_type": '[["x", 1], "natural"]'},
        {"velocities": P},
        {"report": report_with(converged="no", rate={}, method=5)},
    ],
    ids=lambda changes: str(changes)[:40],
)
def test_files_with_a_wrong_array_that_are_read_all_the_same(changes):
    with pytest.raises(ss.ValidationError):
        load(with_arrays(**changes))


def test_newer_files_say_so():
    with pytest.raises(ss.ValidationError, match=r"version 99; this symspline reads version 1"):
        load(with_arrays(version=99))


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(FileNotFoundError):
        ss.load(tmp_path / "missing.npz")
    with pytest.raises(OSError):
        ss.load(tmp_path)
    with pytest.raises(OSError):
        ss.CubicSpline(None, P, S2).save(tmp_path)


@pytest.mark.parametrize("what", [None, 5, [1, 2]], ids=str)
def test_things_that_are_no_files(what):
    with pytest.raises((ss.ValidationError, TypeError, OSError)):
        ss.load(what)


# ---- long curves ----


def test_a_bad_point_is_found_before_a_long_fit():
    points = points_on(S2, 2000)
    points[1999] = 0
    fit_error(r"points\[1999\] is off the space", points=points)


def test_messages_quote_no_large_arrays():
    # NumPy would write out all of it, as no axis is long.
    wrong = np.zeros((2,) * 20)
    with pytest.raises(ss.ValidationError, match=r"not an array of shape \(2, 2, 2, .*\)$"):
        ss.CubicSpline(None, P, S2, on_failure=wrong)


def test_messages_quote_no_large_part_of_a_file():
    file = io.BytesIO()
    ss.CubicSpline(None, P, S2).save(file)
    # It quotes as much as the damaged length of a name says.
    with zipfile.ZipFile(file) as archive:
        info = archive.infolist()[1]
    data = bytearray(file.getvalue())
    data[info.header_offset + 26 : info.header_offset + 28] = (5000).to_bytes(2, "little")
    with pytest.raises(ss.ValidationError, match="damaged or not a symspline curve") as caught:
        ss.load(io.BytesIO(data + bytes(5000)))
    assert len(str(caught.value)) < 300
