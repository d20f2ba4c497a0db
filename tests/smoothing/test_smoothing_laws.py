"""Laws of smoothing on every space."""

import numpy as np
import pytest
from cases import loop_over
from noisy import TIGHT, beside, each, example, rms, truth

import symspline as ss

NAMES = [
    "r:3", "sphere:1", "sphere:2", "sphere:4", "hyperbolic:2", "so:3", "so:4", "o:3", "u:2", "su:3", "spd:2",
    "spd:3", "hpd:2", "gr:2,5", "cgr:1,3", "rp:2", "cp:2", "ch:2", "hp:2", "siegel:2", "se:2", "se:3",
]  # fmt: skip
every = pytest.mark.parametrize("name", NAMES)


@every
def test_moves_with_its_data(name):
    """A transvection of all data is one of the curve."""
    space, t, noisy, _ = example(name, 0.05)
    spline = ss.make_smoothing_spline(t, noisy, space, **TIGHT)
    rng = np.random.default_rng(1)
    p = noisy[0]
    v = 0.7 * space.random_tangent(rng, p)

    def moved(x):
        if name.startswith("se"):
            # Another fixed frame, however far away.
            return space.exp(p, 100 * v) @ x
        return space.transvection(np.broadcast_to(p, x.shape), np.broadcast_to(v, x.shape), x)

    other = ss.make_smoothing_spline(t, moved(noisy), space, **TIGHT)
    assert each(other.lam) == pytest.approx(each(spline.lam), rel=1e-6)
    # Both were stopped at 1e-8 of their deviations, and λ at a parabola's lowest point.
    assert space.distance(other.points, moved(spline.points)).max() < 1e-6


@every
@loop_over("unit", [-1.0, 1e-9, 86400.0])
def test_direction_and_unit_of_time_do_not_matter(name, unit):
    space, t, noisy, _ = example(name, 0.05, n=30)
    spline = ss.make_smoothing_spline(t, noisy, space, **TIGHT)
    order = slice(None, None, int(np.sign(unit)))
    other = ss.make_smoothing_spline((unit * t)[order], noisy[order], space, **TIGHT)
    assert np.divide(each(other.lam), abs(unit) ** 3) == pytest.approx(each(spline.lam), rel=1e-6)
    assert space.distance(other.points[order], spline.points).max() < 1e-7
    rates = each(other.std(3.3 * unit, nu=1)), each(spline.std(3.3, nu=1))
    assert np.multiply(rates[0], abs(unit)) == pytest.approx(rates[1], rel=1e-5)


@every
def test_small_lam_goes_through_the_data_and_large_lam_straight_on(name):
    space, t, noisy, _ = example(name, 0.02, n=25, segments=3, step=0.4)
    through = ss.make_smoothing_spline(t, noisy, space, 1e-11)
    assert space.distance(through.points, noisy).max() < 1e-7
    exact = ss.make_smoothing_spline(t, noisy, space, 0.0)
    assert space.distance(exact.points, noisy).max() < 1e-12
    parts = len(each(exact.df))
    assert each(exact.df) == pytest.approx([25] * parts) and each(through.df) == pytest.approx([25] * parts, abs=1e-5)
    straight = ss.make_smoothing_spline(t, noisy, space, 1e9, tol=1e-3, max_iter=100)
    assert all(report.converged for report in each(straight.report))
    assert each(straight.df) == pytest.approx([2] * parts, abs=1e-3)
    x = np.linspace(0, 10, 50)
    if name.startswith("se"):
        # A rotation at constant rate, and a straight line.
        assert np.ptp(np.linalg.norm(np.diff(straight.points[:, :-1, -1], axis=0), axis=-1)) < 1e-5
        return
    speed = straight.speed(x)
    # The largest λ leaves about this.
    assert np.ptp(speed) < 1e-4 * speed.max()


@every
def test_a_batch_is_its_curves(name):
    space, t, noisy, _ = example(name, 0.05, n=20)
    other = beside(space, truth(space, 9)(t), 0.05, 9)
    batch = ss.make_smoothing_spline(t, np.stack([noisy, other, noisy]), space)
    assert len(batch) == 3
    for lam, std in zip(each(batch.lam), each(batch.std([1.0, 2.0])), strict=True):
        assert lam.shape == (3,) and std.shape == (3, 2)
    for i, data in enumerate([noisy, other, noisy]):
        alone = ss.make_smoothing_spline(t, data, space)
        assert alone == batch[i]
        assert alone.report == batch[i].report
        assert np.array_equal(alone.std(3.3), batch[i].std(3.3))
        assert np.array_equal(alone.residuals, batch[i].residuals)
    assert np.array_equal(np.transpose(batch.band(2.0)), [spline.band(2.0) for spline in batch])


@every
def test_weights_count_data(name):
    """None for a weight of zero, and two at one time for one of twice the weight."""
    space, t, noisy, _ = example(name, 0.05, n=20)
    keep = np.arange(20) % 5 != 2
    missing = noisy.copy()
    missing[~keep] = np.nan
    spline = ss.make_smoothing_spline(t, missing, space, 0.1, weights=1.0 * keep)
    assert spline == ss.make_smoothing_spline(t[keep], noisy[keep], space, 0.1, knots=t)
    assert np.array_equal(np.isnan(spline.residuals).reshape(20, -1).any(1), ~keep)
    # Not quite copies, which are counted as one.
    near = np.repeat(noisy, 2, axis=0)
    near[1::2] = beside(space, noisy, 1e-12)
    twice = ss.make_smoothing_spline(np.repeat(t, 2), near, space, 0.1, **TIGHT)
    heavy = ss.make_smoothing_spline(t, noisy, space, 0.1, weights=np.full(20, 2.0), **TIGHT)
    assert np.array_equal(twice.t, t) and space.distance(twice.points, heavy.points).max() < 1e-9


@every
def test_few_knots_are_enough(name):
    space, t, noisy, points = example(name, 0.05, n=200)
    whole = ss.make_smoothing_spline(t, noisy, space)
    enough = 5 * int(np.ceil(max(each(whole.df))))
    few = ss.make_smoothing_spline(t, noisy, space, knots=enough)
    assert few.points.shape[0] == enough
    assert each(few.df) == pytest.approx(each(whole.df), rel=0.02)
    assert rms(space, few(t), whole(t)) < 0.05 * rms(space, whole(t), points)


def test_factors_of_a_product_have_a_lam_each():
    (r3, t, a, _), (so3, _, b, _) = example("r:3", 0.3), example("so:3", 0.02)
    both = ss.make_smoothing_spline(t, (a, b), ss.Product(r3, so3))
    alone = [ss.make_smoothing_spline(t, x, s) for x, s in ((a, r3), (b, so3))]
    assert both.lam == tuple(s.lam for s in alone)
    assert both.df == tuple(s.df for s in alone) and both.sigma == tuple(s.sigma for s in alone)
    assert all(np.array_equal(x, s(3.3)) for x, s in zip(both(3.3), alone, strict=True))
    assert both.std(1.0) == tuple(s.std(1.0) for s in alone)
    given = ss.make_smoothing_spline(t, (a, b), ss.Product(r3, so3), (0.1, 0.2))
    assert given.lam == pytest.approx((0.1, 0.2))


def test_a_large_space_is_smoothed_in_the_span_of_its_data():
    small, t, noisy, _ = example("gr:2,5", 0.05, n=12)
    basis = np.linalg.qr(np.random.default_rng(0).standard_normal((300, 5)))[0]
    spline = ss.make_smoothing_spline(t, basis @ noisy, "gr:2,300", 0.1)
    inside = ss.make_smoothing_spline(t, noisy, small, 0.1)
    assert spline.space.distance(spline(t), basis @ inside(t)).max() < 1e-6


def test_times_that_nearly_coincide_are_one_knot():
    """Rounding beside λ/h³ would make the data vanish."""
    rng = np.random.default_rng(0)
    t = np.linspace(0, 10, 50)
    near = np.sort(np.r_[t, t[1:-1] + 1e-9])
    y = np.sin(near)[:, None] + 0.05 * rng.standard_normal((98, 1))
    spline = ss.make_smoothing_spline(near, y, "r:1")
    assert len(spline.t) == 50 and spline.sigma == pytest.approx(0.05, rel=0.3)
    # A given λ is kept on times over many decades.
    t = np.r_[0, np.logspace(-8, 1, 99)]
    y = np.sin(t) + 0.05 * rng.standard_normal(100)
    spline = ss.make_smoothing_spline(t, y[:, None], "r:1", 0.05)
    assert spline.lam == pytest.approx(0.05) and not spline.report.at_bound
    assert 5 < spline.df < 12 and np.abs(spline(t)[:, 0] - np.sin(t)).max() < 0.1


def test_crowds_of_times_do_not_starve_the_others():
    rng = np.random.default_rng(1)
    t = np.sort(np.r_[np.linspace(0, 10, 450), np.linspace(4, 4.01, 4050)])
    y = np.sin(50 * t)[:, None] + 0.3 * rng.standard_normal((4500, 1))
    few, whole = (ss.make_smoothing_spline(t, y, "r:1", knots=knots) for knots in (None, t))
    assert len(few.t) < 2500 and few.df == pytest.approx(whole.df, rel=0.01)
    assert np.abs(few(t) - whole(t)).max() < 0.05
