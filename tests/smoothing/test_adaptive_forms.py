"""λ and σ that vary: batches, products, segments and curves of batches agree with fits of single curves."""

import numpy as np
import pytest
from compare import same
from noisy import each

import symspline as ss

N = 300
T = np.sort(np.random.default_rng(0).uniform(0, 60, N))
T = np.sort(np.where((T > 8) & (T < 12), T + 40, T))  # A long gap.
ADAPTIVE = {"lam": "adaptive", "noise": "adaptive"}
X = np.linspace(0.5, 59, 40)


def recording(kind, m=1, seed=0):
    """A slow motion in m coordinates, with a burst, or with a part of larger noise."""
    y = 0.3 * np.sin(0.1 * np.pi * T)
    if kind == "burst":
        y = y + np.exp(-(((T - 30) / 1.8) ** 2) / 2) * np.sin(np.pi * (T - 30))
    larger = (T > 20) & (T < 40) & (kind == "noise")
    sigma = np.where(larger, 0.2, 0.02)[:, None]
    return np.outer(y, np.arange(1, m + 1)) + sigma * np.random.default_rng([seed, m]).standard_normal((N, m))


KINDS = ("burst", "slow", "noise")


def assert_same(curve, other):
    assert curve == other
    for name in ("lam_at", "sigma_at", "std", "band"):
        assert same(getattr(curve, name)(X), getattr(other, name)(X))
    for ours, theirs in zip(curve._smoothed, other._smoothed, strict=True):
        assert ours.report == theirs.report
        for mine, others in ((ours.profile, theirs.profile), (ours.noise_profile, theirs.noise_profile)):
            assert (mine is None) == (others is None) and (mine is None or np.array_equal(mine, others))


@pytest.mark.parametrize("options", [{}, {"where": [True, False, True]}, {"on_failure": "ignore"}])
@pytest.mark.parametrize("penalty", ["acceleration", "jerk"])
@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
def test_curves_of_batches_are_those_alone(options, penalty):
    y = np.stack([recording(kind) for kind in KINDS])
    if "on_failure" in options:
        y[1] = np.nan
    batch = ss.make_smoothing_spline(T, y, "r:1", penalty=penalty, **ADAPTIVE, **options)
    for i in range(3) if not options else (0, 2):
        alone = ss.make_smoothing_spline(T, y[i], "r:1", penalty=penalty, **ADAPTIVE)
        assert_same(batch[i], alone)
        for name in ("lam_at", "sigma_at", "std"):
            assert np.array_equal(getattr(batch, name)(X)[i], getattr(alone, name)(X))
    if options:
        assert np.isnan(batch[1].lam_at(X)).all() and np.isnan(batch.sigma_at(X)[1]).all()
        assert np.isnan(batch.report.gain[1])


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
def test_factors_and_parts_are_those_alone():
    y = recording("burst", 2), recording("noise")
    for options in (ADAPTIVE, {"lam": ("adaptive", None), "noise": ("constant", "adaptive")}):
        curve = ss.make_smoothing_spline(T, y, "r:2 x r:1", **options)
        for i, (part, rows) in enumerate(zip(curve._parts, y, strict=True)):
            given = {name: value[i] if isinstance(value, tuple) else value for name, value in options.items()}
            assert_same(part, ss.make_smoothing_spline(T, rows, part.space, **given))
    poses = np.tile(np.eye(4), (N, 1, 1))
    poses[:, :3, 3] = recording("burst", 3)
    poses[:, :3, :3] = ss.rotations.from_rotation_vectors(0.1 * recording("noise", 3, 1))
    whole = ss.make_smoothing_spline(T, poses, "se:3", **ADAPTIVE)
    split = ss.make_smoothing_spline(T, (poses[:, :3, :3], poses[:, :3, 3]), "so:3 x r:3", **ADAPTIVE)
    assert same(whole.lam_at(X), split.lam_at(X)) and same(whole.sigma_at(X), split.sigma_at(X))


@pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")
def test_segments_are_those_alone():
    y = np.concatenate([recording(kind) for kind in KINDS])
    t = np.concatenate([T + 100 * i for i in range(3)])
    curve = ss.fit_segments(t, y, "r:1", max_gap=20, smooth=True, **ADAPTIVE)
    for i, segment in enumerate(curve):
        assert segment == ss.make_smoothing_spline(T + 100 * i, y[i * N : (i + 1) * N], "r:1", **ADAPTIVE)
        assert (segment.report.gain > 6) == (i != 1)


def test_curves_that_did_not_converge():
    y = np.stack([recording(kind) for kind in KINDS])
    points = ss.Sphere(2).exp([0.0, 0.0, 1.0], y * [1.0, 0.5, 0.0])
    with pytest.warns(ss.ConvergenceWarning):
        curve = ss.make_smoothing_spline(T, points, "sphere:2", max_iter=1, on_failure="warn", **ADAPTIVE)
    assert not curve.report.converged.any() and np.isnan(curve.report.gain).all()
    assert curve.lam_at(X).shape == (3, 40)


def test_constant_numbers_per_segment_are_one_number():
    y = np.stack([recording("slow")] * 2)
    lam = np.full((2, N - 1), 2.0)
    lam[0, 100:] = 3.0
    curve = ss.make_smoothing_spline(T, y, "r:1", lam, knots=T)
    assert curve[1]._smoothed[0].profile is None
    assert np.array_equal(curve.lam_at(T[[0, -1]]).round(12), [[2.0, 3.0], [2.0, 2.0]])


def test_reports_without_adaptive_options_have_no_gain():
    for curve in (
        ss.make_smoothing_spline(T, recording("slow"), "r:1"),
        ss.make_smoothing_spline(T, np.stack([recording("slow")] * 2), "r:1", 1.0),
    ):
        assert all(part.gain is None for part in each(curve.report))
