"""`fit`, `evaluate` and `fit_many` agree with `CubicSpline`."""

import numpy as np
import pytest
from compare import each, parts, pick, same, same_curve
from curves import KNOTS, S2, at_node, every_batch, every_common, every_kind, points_on, tangents_at, with_ends
from refused import P, raises

import symspline as ss


@every_common
def test_fit_many_equals_one_at_a_time(space):
    curves = []
    for i, n in enumerate([6, 2, 3, 6, 40, 2, 7, 3, 6, 6, 600]):
        t = None if i % 3 == 0 else np.cumsum(np.random.default_rng(i).uniform(0.5, 1.5, n))
        curves.append((t, points_on(space, n, step=0.4, seed=i)))
    for bc_type in ("natural", "not-a-knot", "clamped"):
        fitted = ss.fit_many(iter(curves), str(space), bc_type=bc_type, extrapolate=True)
        assert isinstance(fitted, list) and len(fitted) == len(curves)
        for spline, (t, p) in zip(fitted, curves, strict=True):
            alone = ss.CubicSpline(t, p, space, bc_type=bc_type, extrapolate=True)
            assert type(spline) is type(alone) and same_curve(spline, alone)
            assert (spline.bc_type, spline.extrapolate) == (bc_type, True)


@every_kind
@every_batch
def test_fit_and_evaluate_are_the_class(space, batch):
    p = points_on(space, batch=batch, step=0.5)
    options = {"bc_type": ("not-a-knot", with_ends(space, p)[1]), "method": "fixed-point", "tol": 1e-10}
    spline = ss.CubicSpline(KNOTS, p, space, **options)
    u, report = ss.fit(KNOTS, p, str(space), **options)
    assert same(u, spline.velocities) and report == spline.report
    x = np.linspace(-0.5, 4.75, 8)
    for nu in range(3):
        values = ss.evaluate(KNOTS, spline.points, u, str(space), x, nu=nu, extrapolate="geodesic")
        assert same(values, spline(x, nu=nu, extrapolate="geodesic"))
    raises("outside the knots", ss.evaluate, KNOTS, spline.points, u, space, x)


@every_kind
def test_fit_many_with_a_vector_for_every_curve(space):
    curves = []
    for i, n in enumerate([5, 2, 9, 3]):
        t = None if i % 2 else np.cumsum(np.random.default_rng(i).uniform(0.5, 1.5, n))
        curves.append((t, points_on(space, n, step=0.4, seed=i)))
    starts = each(lambda *rows: np.stack(rows), *(at_node(space, p, 0) for _, p in curves))
    v = tangents_at(space, starts)
    fitted = ss.fit_many(curves, str(space), bc_type=((1, v), "natural"))
    for i, (t, p) in enumerate(curves):
        alone = ss.CubicSpline(t, p, space, bc_type=((1, pick(v, i)), "natural"))
        assert same_curve(fitted[i], alone) and same(fitted[i].bc_type[0][1], alone.bc_type[0][1])


NODES = 300


def nodes(name, seed=0):
    space, rng = ss.space(name), np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.3, 1.0, NODES))
    points = points_on(space, NODES, step=0.2, seed=seed)
    return t, points, ss.fit(t, points, space)[0], space


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "rp:2", "gr:2,5", "u:2", "sphere:2 x r:3"])
@pytest.mark.parametrize("nu", [0, 1, 2])
def test_values_are_bit_identical_to_those_of_all_nodes(name, nu):
    t, points, velocities, space = nodes(name)
    rng = np.random.default_rng(1)
    times = [t[0], t[-1], t[7], float(t[-2]), rng.uniform(t[0], t[-1], 3), t[[5, 90]], np.sort(rng.choice(t, 4))]
    for x in times:
        few = ss.evaluate(t, points, velocities, space, x, nu=nu)
        # Knots in a list are read as a whole.
        every = ss.evaluate(t.tolist(), points, velocities, space, x, nu=nu)
        for own, expected in zip(parts(few), parts(every), strict=True):
            np.testing.assert_array_equal(own, expected)


def test_invalid_knots_raise_wherever_they_are():
    t, points, velocities, space = nodes("sphere:2")
    for wrong in (t[199], np.nan):
        bad = t.copy()
        bad[200] = wrong
        raises(r"t\[200\]", ss.evaluate, bad, points, velocities, space, float(t[3]))


def test_messages_name_the_whole_domain_and_what_is_read():
    t, points, velocities, space = nodes("sphere:2")
    raises(rf"outside the knots \[{t[0]}", ss.evaluate, t, points, velocities, space, [t[3], t[-1] + 1])
    bad = points * np.where(np.arange(NODES) == 50, 2, 1)[:, None]
    raises("off the space", ss.evaluate, t, bad, velocities, space, float(t[50]))


def test_curves_that_are_not_pairs_raise():
    for curve in [5, "ab", (None,), (None, P, P)]:
        raises(r"curves\[1\] must be a pair \(t, points\)", ss.fit_many, [(None, P), curve], S2)
        raises(r"curves must be pairs \(t, points\), not 5", ss.fit_many, 5, S2)


def test_invalid_times_raise_whatever_the_precision_of_other_curves():
    good = (None, np.array([[-0.3], [0.5]], np.float32))
    with pytest.raises(ss.ValidationError, match=r"t\[1\]\[1\] is inf"):
        ss.fit_many([good, ([0.0, np.inf, np.inf], [[0.2], [0.3], [0.4]])], "r:1", on_failure="warn")
