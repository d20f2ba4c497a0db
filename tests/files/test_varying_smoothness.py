"""Files and pickles keep λ and σ that vary along smoothing splines."""

import pickle

import numpy as np
import pytest
from compare import parts, same
from stored import load, restored, stored

import symspline as ss

N = 300
T = np.sort(np.random.default_rng(0).uniform(0, 60, N))
ADAPTIVE = {"lam": "adaptive", "noise": "adaptive"}


def coordinate(kind, seed=0):
    """A number against time: a slow motion, with a burst, or with a part of larger noise."""
    y = 0.3 * np.sin(0.1 * np.pi * T)
    if kind == "burst":
        y = y + np.exp(-(((T - 30) / 1.8) ** 2) / 2) * np.sin(np.pi * (T - 30))
    larger = (T > 20) & (T < 40) & (kind == "noise")
    return y + np.where(larger, 0.2, 0.02) * np.random.default_rng([seed, 1]).standard_normal(N)


def points(space, *kinds):
    """Points of a space with some of these coordinates beside a fixed point."""
    space = ss.space(space)
    start = {"sphere:2": np.array([0.0, 0.0, 1.0]), "so:3": np.eye(3)}.get(str(space), np.zeros(space.point_shape))
    v = np.stack([coordinate(kind, seed) for seed, kind in enumerate(kinds)], axis=-1)
    return space.exp(start, np.tensordot(v, space.frame(start), 1))


def line(kind):
    return points("r:1", kind)


def poses():
    p = np.tile(np.eye(4), (N, 1, 1))
    p[:, :3, :3], p[:, :3, 3] = points("so:3", "burst", "slow", "slow"), points("r:3", "slow", "noise", "noise")
    return p


def curves():
    smooth, three = ss.make_smoothing_spline, np.stack([line(kind) for kind in ("burst", "slow", "noise")])
    product = points("sphere:2", "burst", "slow"), line("noise")
    batch = tuple(np.stack([rows, rows[::-1]]) for rows in product)
    middles = (T[1:] + T[:-1]) / 2
    return {
        "burst": smooth(T, line("burst"), "r:1", **ADAPTIVE),
        "noise": smooth(T, line("noise"), "r:1", **ADAPTIVE),
        "jerk": smooth(T, line("burst"), "r:1", penalty="jerk", **ADAPTIVE),
        "closed": smooth(T, np.r_[line("burst")[:-1], line("burst")[:1]], "r:1", bc_type="periodic", **ADAPTIVE),
        "dates": smooth(np.datetime64("2024-01-01") + (T * 1e9).astype("m8[ns]"), three, "r:1", **ADAPTIVE),
        "batch": smooth(T, three, "r:1", **ADAPTIVE),
        "masked": smooth(T, three, "r:1", where=[True, False, True], **ADAPTIVE),
        "failed": smooth(
            T, np.where(np.arange(3)[:, None, None] == 1, np.nan, three), "r:1", on_failure="ignore", **ADAPTIVE
        ),
        "product": smooth(T, product, "sphere:2 x r:1", **ADAPTIVE),
        "one factor": smooth(T, product, "sphere:2 x r:1", lam=("adaptive", None)),
        "product batch": smooth(T, batch, "sphere:2 x r:1", **ADAPTIVE),
        "poses": smooth(T, poses(), "se:3", **ADAPTIVE),
        "given": smooth(T, line("burst"), "r:1", np.where(np.abs(middles - 30) < 6, 1e-4, 3.0), knots=T),
    }


with pytest.warns(ss.SmoothingWarning):
    # λ of the noise in "one factor" is constant.
    SAVED = curves()


def assert_same(read, curve):
    assert read == curve
    for one, other in zip(parts(read.report), parts(curve.report), strict=True):
        assert one == other
    x = curve.t[[0, 40, 150, -1]]
    for name in ("lam_at", "sigma_at", "std", "cov"):
        assert same(getattr(read, name)(x), getattr(curve, name)(x))


@pytest.mark.parametrize("name", SAVED)
def test_files_and_pickles_keep_what_varies(name):
    curve = SAVED[name]
    varying = [profile for part in curve._smoothed for profile in (part.profile, part.noise_profile)]
    assert any(profile is not None for profile in varying)
    for read in (load(stored(curve)), pickle.loads(pickle.dumps(curve))):
        assert_same(read, curve)


@pytest.mark.parametrize("names", [("burst", "noise", "given", "steady"), ("product", "one factor")])
def test_curves_that_vary_and_others_are_in_one_file(names):
    steady = ss.make_smoothing_spline(T, line("slow"), "r:1", **ADAPTIVE)
    assert steady._smoothed[0].profile is None and steady._smoothed[0].noise_profile is None
    curves = {name: SAVED.get(name, steady) for name in names}
    read = restored(curves)
    assert list(read) == list(names)
    for name, curve in curves.items():
        assert_same(read[name], curve)
        for ours, theirs in zip(read[name]._smoothed, curve._smoothed, strict=True):
            assert (ours.profile is None) == (theirs.profile is None)
            assert (ours.noise_profile is None) == (theirs.noise_profile is None)


def test_segments_keep_what_varies():
    t, y = np.r_[T, T + 100, T + 200], np.r_[line("burst"), line("slow"), line("noise")]
    curve = ss.fit_segments(t, y, "r:1", max_gap=20, smooth=True, **ADAPTIVE)
    for read in (load(stored(curve)), pickle.loads(pickle.dumps(curve))):
        for ours, theirs in zip(read, curve, strict=True):
            assert_same(ours, theirs)


def test_parts_and_other_times_of_curves_are_read():
    curve = SAVED["burst"]
    for other in (curve.restrict(20.5, 40.5), curve.reverse(), curve.shift(3.0), curve.restrict(T[20], T[200])):
        assert load(stored(other)) == other


def test_files_of_curves_that_cannot_vary_have_no_new_entries():
    """Earlier versions read them."""
    state = ss.make_smoothing_spline(T, line("slow"), "r:1")._state()
    assert "gain" not in state["noise"][0] and not {"profile", "noise_profile"} & set(state)
