"""The solvers: one step in flat space, quadratic convergence, points far apart, and no silent failure."""

from itertools import islice

import numpy as np
import pytest
from algorithm_1 import sweeps
from cases import EPS, closed_walk, condition, jumps, loop_over, walk, zigzag, zigzag_on
from compare import same
from curves import S2
from refused import raises
from scipy.interpolate import CubicSpline as FlatSpline

import symspline as ss

SEED = 1

# What an iteration counts: 120 sweeps, steps of Newton's method and the homotopy, whose steps of λ have twelve at most;
# of points far apart 2000 sweeps of Algorithm 1 more, and 120 steps of a trust region from three starts.
MOST = 4000


# Times that suit no curve with equal steps.
UNEVEN = np.cumsum([0.0, 20, 1, 20, 1, 20, 1, 20])


def fit(p, space, t=None, **options):
    return ss.CubicSpline(t, p, space, on_failure="ignore", **options)


def wild(space, step, n, rng):
    """A walk that turns by about 70° at every point, in any direction."""
    return walk(space, step, n, rng, turn=3.0)


def ends_on(space, p):
    """Every kind of end condition, for points that need not be closed."""
    v, w = space.log(p[0], p[1]), 0.5 * space.log(p[-1], p[-2])
    return ["natural", "clamped", "not-a-knot", ((1, v), (1, w)), ((2, v), (2, w)), ("not-a-knot", (1, w))]


@pytest.mark.parametrize("method", ["newton", "quasi-newton"])
@pytest.mark.parametrize("n", [3, 4, 5, 17])
@pytest.mark.parametrize("dim", [1, 3])
def test_newton_takes_one_step_in_flat_space(dim, n, method, rng):
    space, t = ss.Euclidean(dim), np.cumsum(rng.uniform(0.2, 2, n))
    p = rng.standard_normal((n, dim))
    closed = np.concatenate([p[:-1], p[:1]])
    for ends, points in [*((ends, p) for ends in ends_on(space, p)), ("periodic", closed)]:
        spline = ss.CubicSpline(t, points, space, bc_type=ends, method=method)
        # One to see the residual, one to see that it is gone.
        assert spline.report.iterations == 2, ends
        flat = FlatSpline(t, points, bc_type=ends)
        assert np.abs(spline.velocities - flat(t, 1)).max() < 1e-12 * np.abs(flat(t, 1)).max()


@pytest.mark.parametrize(
    ("name", "step"),
    [
        *((name, 0.3) for name in ("sphere:2", "so:3", "spd:3", "gr:2,5", "cp:2", "se:3", "hyperbolic:2")),
        *((name, 1.0) for name in ("sphere:2", "so:3", "spd:3", "gr:2,5", "se:3", "hyperbolic:2")),
        ("cp:2", 0.6),
    ],
)
@loop_over("ends", ["natural", "clamped", "not-a-knot", "periodic"])
def test_newton_converges_quadratically(name, step, ends, rng):
    space = ss.space(name)
    p = (closed_walk if ends == "periodic" else walk)(space, step, 12, rng)
    found = [fit(p, space, bc_type=ends, method="newton", tol=0.0, max_iter=k).report.residual for k in range(2, 13)]
    near = next(k for k, r in enumerate(found) if r < 0.03)
    for before, after in zip(found[near:], found[near + 1 :], strict=False):
        assert after <= 10 * before**2 + 20 * EPS * condition(space, p), found
    # Three steps square 0.03 to far below rounding.
    assert found[near + 3] <= 20 * EPS * condition(space, p), found


def test_fixed_point_is_linear_with_a_rate_of_one_half(rng):
    for space in (S2, ss.SpecialOrthogonal(3), ss.Grassmannian(2, 5)):
        report = ss.CubicSpline(None, walk(space, 0.1, 20, rng), space, method="fixed-point").report
        assert report.rate == pytest.approx(0.5, abs=0.05)


def test_the_rate_is_the_mean_contraction(rng):
    p = walk(ss.Sphere(2), 0.4, 20, rng)
    options = {"method": "fixed-point", "on_failure": "ignore"}
    done = ss.CubicSpline(None, p, "sphere:2", **options).report
    second = ss.CubicSpline(None, p, "sphere:2", max_iter=2, **options).report.residual
    assert done.rate == pytest.approx((done.residual / second) ** (1 / (done.iterations - 2)), rel=1e-12)


def test_auto_is_quasi_newton_where_that_is_quick(rng):
    p = wild(S2, 1.2, 20, rng)
    auto, quick = (ss.CubicSpline(None, p, S2, method=method) for method in ("auto", "quasi-newton"))
    assert auto == quick and auto.report == quick.report


@pytest.mark.parametrize(
    ("points", "method"), [(zigzag(1.0), "quasi-newton"), (zigzag(2.0), "fixed-point"), (zigzag(2.8), "trust-region")]
)
def test_auto_reports_the_successful_solver(points, method):
    spline = ss.CubicSpline(None, points, S2)
    assert spline.report.method == method
    assert max(jumps(spline)) < 1


def far_curves(name, part, count=20):
    """Walks and zigzags whose neighbours are `part` of the way to the cut locus."""
    space = ss.space(name)
    step = part * space.injectivity_radius
    return space, np.array(
        [wild(space, step, 20, np.random.default_rng(seed)) for seed in range(count)]
        + [zigzag_on(space, step, 20, np.random.default_rng(seed)) for seed in range(count)]
    )


def test_no_solver_is_skipped_in_few_dimensions():
    assert fit(zigzag(2.5), S2).report.skipped == ()
    assert fit(zigzag(0.5), S2).report.skipped == ()


@pytest.mark.parametrize(
    ("name", "part", "at_least"),
    [
        *(("sphere:2", *row) for row in [(0.6, 1.0), (0.8, 0.9), (0.95, 0.75)]),
        *(("so:3", 0.8, 0.9), ("cp:1", 0.95, 0.75), ("gr:2,5", 0.6, 1.0)),
    ],
)
def test_far_points_converge_or_are_reported(name, part, at_least):
    """Near the cut locus not every curve can be expected to converge, but none may be wrong in silence."""
    # Of a Grassmannian fewer: where steps are long its fits take seconds.
    space, curves = far_curves(name, part, 4 if name == "gr:2,5" else 15)
    batch = fit(curves, space)
    good = batch.report.converged
    for i in np.flatnonzero(good):
        p, spline = curves[i], batch[int(i)]
        assert spline.report.residual <= 1e-12
        assert space.distance(spline(spline.t), p).max() <= 10 * EPS * condition(space, p)
        # `jumps` counts multiples of 1e-12, and a residual of 1e-12 is a jump of 12e-12.
        assert max(jumps(spline)) < 20
    assert (batch.report.iterations <= MOST).all()
    for p in curves[~good][:2]:
        with pytest.raises((ss.ConvergenceError, ss.CutLocusError), match="put more points") as error:
            ss.CubicSpline(None, p, space)
        assert not error.value.spline.report.converged
    assert good.mean() >= at_least


def test_points_too_far_are_an_error_with_advice():
    advice = "too close for the distance .* between their points: merge the two samples, smooth the data"
    with pytest.raises(ss.ConvergenceError, match=f"longest step 1.0.*{advice}") as error:
        ss.CubicSpline(UNEVEN, zigzag(1.0, 8), S2)
    assert not error.value.spline.report.converged
    raises("put a point between", ss.CubicSpline, None, [[1, 0, 0], [-1, 0, 0], [0, 1, 0]], S2, error=ss.CutLocusError)


EASY, HARD, HARDEST = zigzag(0.5, 8), zigzag(2.8, 8), zigzag(2.3, 8, 0.3)
ANTIPODES = np.concatenate([EASY[:4], -EASY[3:4], EASY[5:]])
IMPOSSIBLE = zigzag(1.0, 8)
"""With the times `UNEVEN`."""


def assert_is_its_curves(p, t, **options):
    batch = fit(p, S2, t, **options)
    for i, points in enumerate(p):
        one = fit(points, S2, t[i], **options)
        for field in ("converged", "iterations", "residual", "max_step", "rate"):
            assert same(getattr(batch.report, field)[i], getattr(one.report, field)), (i, field)
        assert same(batch.velocities[i], one.velocities), i


def test_a_batch_of_easy_and_hard_curves_and_one_that_has_no_spline():
    p, t = np.array([EASY, HARDEST, ANTIPODES, HARD, IMPOSSIBLE]), np.tile(np.arange(8.0), (5, 1))
    t[4] = UNEVEN
    assert_is_its_curves(p, t)
    p = p[:4]
    batch = fit(p, S2)
    assert batch.report.converged.tolist() == [True, True, False, True]
    assert np.isnan(batch.velocities[2]).all() and np.isfinite(np.delete(batch.velocities, 2, 0)).all()
    # The last solver that any curve needed.
    assert batch.report.method == "homotopy" and fit(HARD, S2).report.method == "fixed-point"
    with pytest.raises(ss.CutLocusError, match=r"points\[3\] and points\[4\] of curve 2") as error:
        ss.CubicSpline(None, p, S2)
    assert error.value.spline == batch
    with pytest.warns(ss.ConvergenceWarning, match="of curve 2"):
        ss.CubicSpline(None, p, S2, on_failure="warn")


@pytest.mark.parametrize("method", ["fixed-point", "quasi-newton", "newton", "auto"])
def test_no_solver_exceeds_max_iter(method):
    for points in (zigzag(1.0), zigzag(2.5), zigzag(2.3, 8, 0.3), zigzag(1.9, 12, 0.02)):
        for most in (1, 2, 8, 9, 50, 119, 120, 121, 125, 150, 170, 200, 250, 400):
            report = fit(points, S2, method=method, max_iter=most).report
            assert report.iterations <= most
            assert report.converged == (report.residual <= 1e-12)


# Table 1 of the paper, and parts of it.


def iterate(space, p, count, ends="natural", t=None):
    """The velocities that `method="fixed-point"` has after `count` sweeps, in the units of the paper."""
    bc_type = ends if isinstance(ends, str) else ((1, 3 * ends[0]), (1, 3 * ends[1]))
    options = {"bc_type": bc_type, "method": "fixed-point", "tol": 0.0, "on_failure": "ignore"}
    return ss.CubicSpline(t, p, space, max_iter=count + 1, **options).velocities / 3


@pytest.mark.parametrize("name", ["r:3", "h:2", "gr:2,5", "so:4", "cp:2", "su:3", "spd:3"])
@pytest.mark.parametrize("ends", ["natural", "clamped"])
def test_every_iterate_is_that_of_the_paper(name, ends):
    space, rng = ss.space(name), np.random.default_rng(3)
    for nodes, step in ((3, 0.9), (7, 0.5), (6, 1.2)):
        p = walk(space, step, nodes, rng, turn=3.0)
        given = 0.3 * space.log(p[0], p[1]), -0.4 * space.log(p[-1], p[-2])
        pair = "natural" if ends == "natural" else given
        tol = 1e-14 + 4 * EPS * condition(space, p)
        for count, (v, _) in enumerate(islice(sweeps(space, p, pair), 30)):
            off = space.norm(p, iterate(space, p, count, pair) - v).max()
            assert off <= tol, (nodes, step, count)


def test_number_of_sweeps_on_the_example_of_the_paper():
    # Appendix D: (1, 0, 0), (0, 1, 0), (0, 0, 1).
    def needed(tol):
        return next(k for k, (_, delta) in enumerate(sweeps(S2, np.eye(3))) if delta <= tol)

    report = ss.CubicSpline(None, np.eye(3), S2, method="fixed-point").report
    # The residual of the report is ‖δ‖ in other units; both fall by the same factor in a sweep.
    assert abs(report.iterations - needed(1e-13)) <= 8
    assert report.converged and report.rate < 0.6


@pytest.mark.parametrize("step", [1.5, 2.0, 2.5])
def test_auto_finds_a_curve_that_bends_less_than_that_of_quasi_newton(step):
    p = zigzag(step)
    symmetric = ss.CubicSpline(None, p, S2, method="newton").bending_energy()  # by quadrature, to 1e-4
    auto = ss.CubicSpline(None, p, S2)
    assert auto.bending_energy() < 0.98 * symmetric
    assert auto.bending_energy() < auto.report.alternative_energy <= symmetric * (1 + 1e-4)


def test_an_undefined_logarithm_names_its_segment():
    # With v₀ = 0 and v₂ = 1 towards −p₁, the control point of the last segment is opposite to p₁ in the first sweep.
    p = np.array([[0.0, 0, 1], [1, 0, 0], [np.cos(3.0), np.sin(3.0), 0]])
    towards = np.array([-np.sin(3.0), np.cos(3.0), 0.0])
    ends = ("clamped", (1, -3 * (np.pi - 3.0) * towards))
    options = {"bc_type": ends, "method": "fixed-point", "max_iter": 1}
    with pytest.raises(ss.CutLocusError, match=r"control points between points\[1\] and points\[2\]"):
        ss.CubicSpline(None, p, S2, **options)


def test_curves_around_the_space_are_alternatives():
    """Which curves around the space a solver finds depends on rounding errors. The result does not."""
    t = np.array([0.6906, 1.8647, 2.3345, 2.8122, 3.2786, 3.8183])
    points = np.array(
        [
            [0.3869, 0.6955 + 0.5691j, 0.0112 - 0.2064j],
            [0.5191, 0.4854 + 0.5625j, 0.3449 - 0.2439j],
            [0.3494, 0.3057 - 0.6381j, -0.6043 + 0.1097j],
            [0.4042, 0.4556 - 0.2911j, -0.6763 - 0.2947j],
            [0.1606, -0.3606 - 0.2859j, -0.1153 + 0.8655j],
            [0.6481, 0.1151 + 0.2498j, 0.7093 + 0.0342j],
        ]
    )
    points /= np.linalg.norm(points, axis=1)[:, None]
    lower = 0
    for change in np.linspace(-1e-4, 1e-4, 21):
        s = ss.CubicSpline(t + change * (np.arange(6) == 0), points, "cp:2")
        assert s.bending_energy() == pytest.approx(39.28, abs=0.02)
        lower += (s.report.alternative_energy or np.inf) < 34
    assert lower > 0
