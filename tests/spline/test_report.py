"""The fields of reports, and their text."""

import json

import numpy as np
from cases import has_metric
from curves import KNOTS, S2, at_node, every_batch, every_common, every_kind, every_single, failing, points_on

import symspline as ss

FIELDS = [
    "method", "converged", "iterations", "residual", "max_step", "max_gap", "curvature", "invariant_radius", "rate",
    "alternative_energy", "contraction_bound", "guaranteed_sweeps", "existence_radius", "uniqueness_radius", "skipped",
]  # fmt: skip


@every_kind
def test_report_of_one_curve(space):
    p = points_on(space, step=0.5)
    report = ss.CubicSpline(KNOTS, p, space).report
    assert list(vars(report)) == FIELDS
    assert report.method in ("fixed-point", "quasi-newton", "newton")
    assert report.converged is True
    assert isinstance(report.iterations, int) and report.iterations >= 1
    assert 0 <= report.residual <= 1e-12
    assert report.curvature == space.curvature or np.isnan(space.curvature)
    assert 0 <= report.rate < 1
    # For those who log reports.
    assert json.loads(json.dumps(vars(report)))["converged"] is True


@every_single
@every_batch
def test_max_step_is_the_longest_distance(space, batch):
    if not has_metric(space):
        # There is no invariant metric: it is measured elsewhere.
        return
    p = points_on(space, batch=batch, step=0.5)
    before, after = at_node(space, p, 2), at_node(space, p, 3)
    np.moveaxis(p, len(batch), 0)[3] = space.exp(before, 1.4 * space.log(before, after))
    steps = [space.distance(at_node(space, p, i), at_node(space, p, i + 1)) for i in range(5)]
    found = ss.CubicSpline(KNOTS, p, space).report.max_step
    assert np.allclose(found, np.max(steps, axis=0), rtol=1e-13, atol=0)


@every_common
@every_batch
def test_max_gap_is_the_longest_time_between_points(space, batch):
    p = points_on(space, 6, batch)
    assert np.array_equal(ss.CubicSpline(KNOTS, p, space).report.max_gap, np.full(batch, 1.5))
    own = np.cumsum(np.random.default_rng(0).uniform(1, 2, (*batch, 6)), axis=-1)
    report = ss.CubicSpline(own, p, space).report
    assert np.array_equal(report.max_gap, np.diff(own).max(axis=-1))
    dates = np.datetime64("2020-01-01") + (1e3 * KNOTS).astype("m8[ms]")
    assert np.array_equal(ss.CubicSpline(dates, p, space).report.max_gap, np.full(batch, 1.5))
    if batch == ():
        assert [s.report.max_gap for s in ss.fit_many([(KNOTS, p), (None, p)], space)] == [1.5, 1.0]


@every_common
@every_batch
def test_report_reads_as_one_line(space, batch):
    spline = ss.CubicSpline(KNOTS, points_on(space, batch=batch, step=0.5), space)
    line = str(spline.report)
    assert "\n" not in line and 20 < len(line) < 160
    assert "converged" in line and spline.report.method in line


def test_report_describes_the_failure():
    p, options = failing("cut locus")
    spline = ss.CubicSpline(None, p, S2, on_failure="ignore", **options)
    assert "2 of 3 curves converged" in str(spline.report)
    assert "nan" not in str(spline.report)
    assert "NOT converged" in str(spline[1].report)
