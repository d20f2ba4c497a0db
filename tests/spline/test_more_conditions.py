"""Velocities at inner points, and a velocity with an acceleration at one end."""

import pickle
import warnings

import numpy as np
import pytest
from cases import loop_over, walk, zigzag
from compare import same, vectors_off
from curves import S2, at_node, every_kind, tangents_at
from refused import raises
from scipy.interpolate import CubicSpline as FlatSpline
from stored import restored

import symspline as ss
from symspline._splines.functional import segments_of
from symspline.cli._check import _measure

T = np.array([0.0, 0.4, 1.5, 2.0, 2.2, 3.1, 4.5, 5.0, 5.3])
FLAT = ss.Euclidean(2)


def flat_points(rng, batch=()):
    return rng.standard_normal((*batch, len(T), 2))


def nine_points(space, rng, step=0.4):
    if isinstance(space, ss.Product):
        return tuple(nine_points(factor, rng, step) for factor in space.factors)
    return walk(space, step, len(T), rng)


# ---- velocities at inner points ----


def test_sections_equal_those_of_scipy(rng):
    y = flat_points(rng)
    u, v, w = rng.standard_normal((3, 2))
    spline = ss.CubicSpline(T, y, FLAT, bc_type=("natural", (1, w)), velocities={3: u, 6: v})
    ends = [(2, np.zeros(2)), (1, u), (1, v), (1, w)]
    for (a, b), first, last in zip([(0, 3), (3, 6), (6, 8)], ends, ends[1:], strict=False):
        flat = FlatSpline(T[a : b + 1], y[a : b + 1], bc_type=(first, last))
        x = np.linspace(T[a], T[b], 30)[1:-1]
        for nu in range(3):
            assert np.abs(spline(x, nu) - flat(x, nu)).max() < 1e-12


def test_sections_of_a_closed_curve_equal_those_of_scipy(rng):
    y = flat_points(rng)
    y[-1] = y[0]
    u, v = rng.standard_normal((2, 2))
    spline = ss.CubicSpline(T, y, FLAT, bc_type="periodic", velocities={2: u, 5: v})
    outer = [5, 6, 7, 0, 1, 2]
    times = np.r_[T[5:8], T[-1] - T[0] + T[:3]]
    for t, p, pair in ((T[2:6], y[2:6], (u, v)), (times, y[outer], (v, u))):
        flat = FlatSpline(t, p, bc_type=((1, pair[0]), (1, pair[1])))
        x = np.linspace(t[0], t[-1], 40)[1:-1]
        for nu in range(3):
            assert np.abs(spline(x, nu) - flat(x, nu)).max() < 1e-12
    one = ss.CubicSpline(T, y, FLAT, bc_type="periodic", velocities={2: u})
    assert np.abs(one(T[2], 1) - u).max() < 1e-14
    assert np.abs(one(T[0], 2) - one(T[-1] - 1e-12, 2)).max() < 1e-9


@every_kind
def test_velocities_hold_and_the_curve_is_c2_elsewhere(space, rng):
    p = nine_points(space, rng)
    given = {node: tangents_at(space, at_node(space, p, node), seed=node) for node in (2, 5)}
    spline = ss.CubicSpline(T, p, space, bc_type="not-a-knot", velocities=given)
    assert spline.report.converged
    for node, vector in given.items():
        here = at_node(space, spline.points, node)
        assert vectors_off(space, spline(T[node]), spline(T[node], nu=1), here, vector) < 1e-12
    for part in spline._parts:
        for nu in range(3):
            sizes = np.array(segments_of(part).jumps(nu).size)
            if nu == 2:
                assert sizes[[1, 4]].max() > 1e-3
                sizes[[1, 4]] = 0
            assert sizes.max() < 1e-6 if isinstance(part.space, ss.Manifold) else sizes.max() < 1e-9


def test_curves_of_a_batch_are_those_alone(rng):
    p = np.array([[nine_points(S2, rng) for _ in range(3)] for _ in range(2)])
    t = np.cumsum(rng.uniform(0.5, 1.5, (2, 3, len(T))), axis=-1)
    v = tangents_at(S2, p[..., 3, :])
    a = tangents_at(S2, p[..., 0, :], seed=5)
    u = tangents_at(S2, p[..., 0, :], seed=6)
    options = {"velocities": {3: v}, "bc_type": ([(2, a), (1, u)], "natural")}
    for knots in (T, t):
        batch = ss.CubicSpline(knots, p, S2, **options)
        for i in np.ndindex(2, 3):
            own = {"velocities": {3: v[i]}, "bc_type": ([(2, a[i]), (1, u[i])], "natural")}
            alone = ss.CubicSpline(knots if knots.ndim == 1 else knots[i], p[i], S2, **own)
            assert same(batch.velocities[i], alone.velocities) and same(batch[i[0]][i[1]].points, alone.points)
    masked = ss.CubicSpline(T, p, S2, where=np.arange(6).reshape(2, 3) != 4, **options)
    assert np.isnan(masked(1.0)[1, 1]).all() and np.isfinite(masked(1.0)).sum() == 15


def test_quotients(rng):
    space = ss.space("pu:2")
    p = np.array(walk(ss.space("su:2"), 0.3, len(T), rng))
    v = {4: ss.space("su:2").random_tangent(rng, p[4])}
    u, a = (ss.space("su:2").random_tangent(rng, p[-1]) for _ in range(2))
    signs = np.where(np.arange(len(T)) % 3 == 1, -1.0, 1.0)
    ends = ("natural", [(1, u), (2, a)])
    plain = ss.CubicSpline(T, p, space, velocities=v, bc_type=ends)
    flipped = ss.CubicSpline(
        T,
        p * signs[:, None, None],
        space,
        velocities={4: v[4] * signs[4]},
        bc_type=("natural", [(1, u * signs[-1]), (2, a * signs[-1])]),
    )
    x = np.linspace(0, T[-1], 20)
    assert np.abs(space.distance(plain(x), flipped(x))).max() < 1e-7
    assert np.abs(plain(T[-1], 2) - a).max() < 1e-11


def test_invalid_velocities_raise(rng):
    p = nine_points(S2, rng)
    v = tangents_at(S2, p[3])
    for given, match in [
        ([v], r"velocities must be a dict from indices of inner points to the velocities there, such as \{3: v\}"),
        ({0: v}, r"velocities has the key 0, but keys must be indices of inner points \(1 to 7\)\. Use bc_type"),
        ({8: v}, r"the key 8"),
        ({-3: v}, r"the key -3"),
        ({True: v}, r"the key True"),
        ({3.0: v}, r"the key 3\.0"),
        ({3: v[:2]}, r"velocities\[3\] has shape \(2,\)"),
        ({3: [v, v]}, r"velocities\[3\] has shape \(2, 3\), which does not broadcast to \(3,\)"),
        ({3: v * np.nan}, r"velocities\[3\] must be finite"),
        ({3: p[3]}, r"velocities\[3\]: vector 0 is not tangent at its point"),
    ]:
        raises(match, ss.CubicSpline, T, p, S2, velocities=given)
    fast = {3: 60 * v / np.linalg.norm(v)}
    match = r"between points\[0\] and points\[3\]: the end velocity has speed 60\.0+, too fast for its segment"
    raises(match, ss.CubicSpline, T, p, S2, velocities=fast)


def test_messages_name_the_points_of_the_whole_curve(rng):
    p = np.array(nine_points(S2, rng, 0.1))
    p[7] = -p[6]
    v = tangents_at(S2, p[3])
    with pytest.raises(ss.CutLocusError, match=r"points\[6\] and points\[7\]") as caught:
        ss.CubicSpline(T, p, S2, velocities={3: v})
    assert caught.value.node == 6
    raises(r"points\[5\]", ss.CubicSpline, T, np.where(np.arange(9)[:, None] == 5, 2.0, p), S2, velocities={3: v})


def test_derivatives_with_respect_to_data_are_refused(rng):
    p = nine_points(S2, rng)
    spline = ss.CubicSpline(T, p, S2, velocities={3: tangents_at(S2, p[3])})
    raises("derivatives with respect to the data are not available", spline.jvp, 1.0, p)
    raises("derivatives with respect to the data are not available", spline.vjp, 1.0, p[0])
    raises("points cannot be appended to a curve with prescribed velocities", spline.append, 6.0, p[0])


# ---- a velocity and an acceleration at one end ----


@every_kind
@loop_over("which", [(0,), (1,), (0, 1)])
def test_both_conditions_hold(space, which, rng):
    p = nine_points(space, rng)
    vectors = {e: [tangents_at(space, at_node(space, p, -e), seed=s + e) for s in (3, 7)] for e in which}
    ends = tuple([(1, vectors[e][0]), (2, vectors[e][1])] if e in which else "not-a-knot" for e in (0, 1))
    spline = ss.CubicSpline(T, p, space, bc_type=ends)
    assert spline.report.converged and len(spline.t) == len(T) + len(which)
    for e in which:
        x, here = T[-e], at_node(space, p, -e)
        for order, bound in ((1, 1e-12), (2, 1e-7 if "Manifold" in str(spline._parts) else 1e-10)):
            assert vectors_off(space, spline(x), spline(x, nu=order), here, vectors[e][order - 1]) < bound
    original = np.isin(spline.t, T)
    for part, own in zip(spline._parts, p if isinstance(p, tuple) else (p,), strict=True):
        assert np.abs(part.points[original] - own).max() < 1e-12
        segments = segments_of(part)
        for nu in range(3):
            bound = 1e-6 if isinstance(part.space, ss.Manifold) else 1e-9
            assert segments.jumps(nu).size.max() < bound


def test_flat_curves_equal_the_dense_solution(rng):
    """The C² spline with the additional knot, as B-splines: n + 3 coefficients and as many equations."""
    from scipy.interpolate import BSpline

    y, (v, a) = flat_points(rng), rng.standard_normal((2, 2))
    spline = ss.CubicSpline(T, y, FLAT, bc_type=([(1, v), (2, a)], "natural"))
    knots = np.insert(T, 1, (T[0] + T[1]) / 2)
    assert np.array_equal(spline.t, knots)
    padded = np.r_[[knots[0]] * 3, knots, [knots[-1]] * 3]
    basis = BSpline(padded, np.eye(len(padded) - 4), 3)
    rows = [*basis(T), basis(T[0], 1), basis(T[0], 2), basis(T[-1], 2)]
    dense = BSpline(padded, np.linalg.solve(rows, [*y, v, a, [0, 0]]), 3)
    x = np.linspace(T[0], T[-1], 100)
    for nu in range(3):
        assert np.abs(spline(x, nu) - dense(x, nu)).max() < 1e-11


@loop_over("count", [2, 3])
@loop_over("which", [0, 1])
def test_few_points_with_a_not_a_knot_end(count, which, rng):
    for space in (FLAT, S2, ss.space("so:3")):
        p, t = walk(space, 0.5, count, rng), T[:count]
        v, a = (tangents_at(space, p[-which], seed=s) for s in (3, 7))
        pair = [(1, v), (2, a)]
        ends = (pair, "not-a-knot") if which == 0 else ("not-a-knot", pair)
        spline = ss.CubicSpline(t, p, space, bc_type=ends)
        for order, vector in ((1, v), (2, a)):
            assert np.abs(spline(t[-which], order) - vector).max() < 1e-10
        knots = (1, "not-a-knot") if which == 0 else ("not-a-knot", 1)
        ends = tuple((1, v) if end == 1 else end for end in knots)
        # The additional point is exact up to rounding, which a projection would change.
        again = ss.CubicSpline(spline.t, spline.points, space, bc_type=ends, check=False)
        assert same(again.velocities, spline.velocities)
        if space is FLAT and count == 2:
            # One cubic: the third derivative is that of the whole curve.
            third = spline(t[0] + 0.1, 3), spline(t[-1] - 0.1, 3)
            assert np.abs(third[0] - third[1]).max() < 1e-9


def test_two_points_with_two_conditions_at_both_ends(rng):
    p = walk(S2, 0.5, 2, rng)
    v, a, w, b = (tangents_at(S2, p[i], seed=s) for s, i in enumerate((0, 0, 1, 1)))
    spline = ss.CubicSpline([1, 4], p, S2, bc_type=([(1, v), (2, a)], [(1, w), (2, b)]))
    assert np.allclose(spline.t, [1, 2, 3, 4], rtol=1e-15)
    for x, nu, expected in ((1, 1, v), (1, 2, a), (4, 1, w), (4, 2, b)):
        assert np.abs(spline(x, nu) - expected).max() < 1e-12


def test_dates_and_large_integers():
    y = np.array([[0.0], [1.0], [3.0]])
    ends = ([(1, [0.0]), (2, [1e-12])], "natural")
    dates = np.array(["2024-01-01", "2024-01-02", "2024-01-05"], "datetime64[D]")
    spline = ss.CubicSpline(dates, y, "r:1", bc_type=ends)
    assert spline.t[1] == np.datetime64("2024-01-01T12") and np.array_equal(spline.t[[0, 2, 3]], dates)
    ticks = np.array([2**60, 2**60 + 1000, 2**60 + 5000])
    spline = ss.CubicSpline(ticks, y, "r:1", bc_type=ends)
    assert spline.t.tolist() == [2**60, 2**60 + 500, 2**60 + 1000, 2**60 + 5000]
    assert np.abs(spline(ticks[0], 2) - 1e-12).max() < 1e-20


def test_an_additional_knot_that_does_not_halve_its_segment(rng):
    """The middle of three nanoseconds is rounded to the first of them."""
    t = np.array([4, 7, 12, 16, 19], "datetime64[ns]")
    points = walk(S2, 0.3, 5, rng)
    v, w = (S2.project_tangent(points[[0, -1]], 0.05 * rng.normal(size=(2, 3))) for _ in range(2))
    bc_type = ([(1, 1e9 * v[0]), (2, 1e18 * w[0])], [(1, 1e9 * v[1]), (2, 1e18 * w[1])])
    spline = ss.CubicSpline(t, points, S2, bc_type=bc_type)
    assert (spline.t - t[0]).astype(int).tolist() == [0, 1, 3, 8, 12, 13, 15]
    through = ss.CubicSpline((spline.t - t[0]).astype(float), spline.points, S2, bc_type=((1, v[0]), (1, v[1])))
    for end in (0, -1):
        assert np.abs(through(through.t[end], 2) - w[end]).max() < 1e-9
    assert np.abs(through.velocities - 1e-9 * spline.velocities).max() < 1e-12


@pytest.mark.parametrize(
    "t", [np.array([1, 2, 5, 6], "datetime64[ns]"), np.array([1.0, np.nextafter(1, 2), np.nextafter(3, 2), 3.0])]
)
def test_knots_without_a_time_between_them(t):
    y, both = np.arange(4.0)[:, None], [(1, [0.0]), (2, [0.0])]
    raises("at the first point.*first two knots are too close", ss.CubicSpline, t, y, "r:1", bc_type=(both, "natural"))
    raises("at the last point.*last two knots are too close", ss.CubicSpline, t, y, "r:1", bc_type=("natural", both))
    raises("increase", ss.CubicSpline, [0.0, 0.0, 1.0, 2.0], y, "r:1", bc_type=(both, "natural"))


def test_files_and_pickles_of_more_conditions(rng):
    p = nine_points(S2, rng)
    v, a = (tangents_at(S2, p[0], seed=s) for s in (1, 2))
    spline = ss.CubicSpline(T, p, S2, bc_type=([(1, v), (2, a)], "natural"), velocities={4: tangents_at(S2, p[4])})
    for found in (restored(spline), pickle.loads(pickle.dumps(spline))):
        assert found == spline and found._c1_nodes == (5,)
        raises("not available", found.jvp, 1.0)
    # The command `symspline check` allows jumps of the acceleration at these nodes only.
    assert _measure(spline)[1] <= 1
    spline._c1_nodes = (4,)
    assert _measure(spline)[1] > 1
    assert spline.bc_type[0][0] == 1 and same(spline.bc_type[0][1], v)
    # The result is an ordinary spline through its points with the velocity.
    plain = ss.CubicSpline(T, p, S2, bc_type=([(1, v), (2, a)], "natural"))
    assert same(ss.CubicSpline(plain.t, plain.points, S2, bc_type=plain.bc_type).velocities, plain.velocities)
    assert plain.jvp(1.0, np.zeros((10, 3))).shape == (3,)


def test_invalid_pairs_of_conditions_raise(rng):
    p = nine_points(S2, rng)
    v = tangents_at(S2, p[0])
    for end, match in [
        ([(1, v), (1, v)], r"bc_type must be .*\[\(1, velocity\), \(2, acceleration\)\] for either end"),
        ([(1, v), (2, v), (2, v)], r"bc_type must be "),
        ([(1, v), (2, p[0])], r"the start acceleration is not tangent at its point"),
        ([(1, p[0]), (2, v)], r"the start velocity is not tangent at its point"),
        ([(1, v), (2, v * np.nan)], r"the start acceleration contains NaN"),
    ]:
        raises(match, ss.CubicSpline, T, p, S2, bc_type=(end, "natural"))
    raises(
        "bc_type prescribes a velocity and an acceleration at the start, which is available in CubicSpline only",
        ss.fit_many,
        [(T, p)],
        S2,
        bc_type=([(1, v), (2, v)], "natural"),
    )


def test_accelerations_without_a_curve_raise(rng):
    p = nine_points(S2, rng)
    v = tangents_at(S2, p[0])
    with pytest.raises((ss.ConvergenceError, ss.CutLocusError), match=r"control handle|no convergence"):
        ss.CubicSpline(T, p, S2, bc_type=([(1, v), (2, 1e4 * v)], "natural"))
    # Other curves of a batch are not affected.
    both = np.stack([p, p])
    ends = ([(1, v), (2, np.stack([v, 1e4 * v]))], "natural")
    batch = ss.CubicSpline(T, both, S2, bc_type=ends, on_failure="ignore")
    assert batch.report.converged.tolist() == [True, False]
    assert np.abs(batch[0](0.0, 2) - v).max() < 1e-12


def test_another_curve_through_a_section_is_another_curve():
    """The last section, of long steps, has another solution; the first one is the same in both curves."""
    far, u = zigzag(2.5), np.zeros(3)
    near = [S2.exp(far[0], S2.project_tangent(far[0], [0.0, 0.1 * i, 0.2 * i])) for i in (2, 1)]
    points = np.concatenate([near, far])
    t = 3 + np.arange(len(points))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.FarPointsWarning)
        whole = ss.CubicSpline(t, points, S2, velocities={2: u})
        first = ss.CubicSpline(t[:3], points[:3], S2, bc_type=("natural", (1, u)))
        last = ss.CubicSpline(t[2:], points[2:], S2, bc_type=((1, u), "natural"))
    assert first.report.alternative_energy is None and last.report.alternative_energy is not None
    other = first.bending_energy() + last.report.alternative_energy
    np.testing.assert_allclose(whole.report.alternative_energy, other, rtol=1e-11)


def test_points_of_a_fault_are_counted_with_the_additional_ones():
    points = S2.project([[1, 0, 0], [1, 0.2, 0], [1, 0.5, 0.1], [-1, -0.5, -0.1], [-1, -0.2, 0]])
    rest = [(1, np.zeros(3)), (2, np.zeros(3))]
    for bc_type, node in (((rest, "natural"), 3), (("natural", rest), 2), ((rest, rest), 3)):
        beside = rf"points\[{node}\] and points\[{node + 1}\] lie at"
        raises(beside, ss.CubicSpline, None, points, S2, bc_type=bc_type, error=ss.CutLocusError)
