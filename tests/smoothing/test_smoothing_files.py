"""Files keep a smoothing spline, its data and its noise level bit for bit."""

import datetime
import io
import json
import pickle
import warnings

import numpy as np
import pytest
from compare import parts, same
from noisy import example
from refused import raises
from stored import load, restored, stored, with_arrays

import symspline as ss

S2, T, NOISY, _ = example("sphere:2", 0.05, n=40)
POSES = np.tile(np.eye(4), (40, 1, 1))
POSES[:, :3, 3] = NOISY
WEIGHTS = np.where(np.arange(40) == 3, 0.0, np.linspace(0.5, 2, 40))
DATES = np.datetime64("2024-03-01") + (T * 60).astype("timedelta64[s]")
TEXTS = DATES[8::8].astype(str)
ZONED = [datetime.datetime(2024, 3, 1, tzinfo=datetime.UTC) + datetime.timedelta(minutes=i) for i in range(40)]


def saved_curves():
    smooth = ss.make_smoothing_spline
    pair = np.stack([NOISY, NOISY[::-1]])
    gaps = np.where(WEIGHTS[:, None] > 0, NOISY, np.nan)
    return {
        "one": smooth(T, NOISY, S2),
        "weights": smooth(T, gaps, S2, weights=WEIGHTS, sigma=0.05, extrapolate="geodesic"),
        "robust": smooth(T, NOISY, S2, loss="cauchy"),
        "few knots": smooth(np.round(T), NOISY, S2, knots=[-1.0, 2, 5, 8, 11]),
        "least squares": ss.make_lsq_spline(T, NOISY, 8, S2),
        "batch": smooth(T, pair, S2),
        "own times": smooth(np.stack([T, 2 * T]), pair, S2, weights=[WEIGHTS, WEIGHTS[::-1]]),
        "dates": smooth(DATES, NOISY, S2),
        "date knots": smooth(DATES, NOISY, S2, knots=["2024-02-29T23:59:00.5", *TEXTS, "2024-03-01T00:11"]),
        "own dates": smooth(np.stack([DATES, DATES + 60]), pair, S2, knots=DATES[0] + 66 * np.arange(11)),
        "zones": smooth(ZONED, NOISY, S2, knots=[*ZONED[::10], ZONED[-1]]),
        "nanoseconds": smooth(1_700_000_000_000_000_000 + np.arange(40), NOISY, S2),
        "product": smooth(T, (NOISY, NOISY[:, :1]), "sphere:2 x r:1"),
        "product batch": smooth(T, (pair, pair[..., :1]), "sphere:2 x r:1"),
        "complex": smooth(T, example("cp:1", 0.05, n=40)[2], "cp:1"),
        "closed": smooth(T, np.concatenate([NOISY[:-1], NOISY[:1]]), S2, 1.0, bc_type="periodic"),
        "closed too": smooth(T, np.concatenate([NOISY[:-1], NOISY[:1]]), S2, 2.0, knots=9, bc_type="periodic"),
        "clamped": smooth(T, NOISY, S2, 1.0, bc_type="clamped"),
        "masked": smooth(T, np.where([[[1.0]], [[np.nan]]], pair, np.nan), S2, 0.1, on_failure="ignore"),
        "masked product": smooth(T, (pair, pair[..., :1]), "sphere:2 x r:1", where=[True, False]),
        "masked poses": smooth(T, np.stack([POSES] * 2), "se:3", 0.1, where=[False, True]),
        "unconverged": smooth(T, pair, S2, max_iter=1, on_failure="ignore"),
    }


with warnings.catch_warnings():
    # Five knots are too few for these data.
    warnings.simplefilter("ignore", ss.SmoothingWarning)
    SAVED = saved_curves()


def assert_same(read, spline):
    assert type(read) is ss.SmoothingSpline and read == spline and repr(read) == repr(spline)
    assert read.t.dtype == spline.t.dtype and read.data[0].dtype == spline.data[0].dtype
    assert np.array_equal(read.data[0], spline.data[0]) and same(read.data[1], spline.data[1])
    assert same(read.residuals, spline.residuals)
    for ours, theirs in zip(parts(spline.report), parts(read.report), strict=True):
        assert type(theirs) is type(ours) and str(theirs) == str(ours)
        assert theirs == ours
    for name in ("lam", "df", "sigma"):
        assert same(getattr(read, name), getattr(spline, name))
    x = spline.t.ravel()[1:3]
    for nu in (0, 1):
        assert same(read.std(x, nu=nu), spline.std(x, nu=nu)) and same(read(x, nu), spline(x, nu))
    assert same(read.band(x), spline.band(x)) and read.extrapolate == spline.extrapolate


@pytest.mark.parametrize("name", SAVED)
def test_files_and_pickles_keep_everything(name):
    for read in (load(stored(SAVED[name])), pickle.loads(pickle.dumps(SAVED[name]))):
        assert_same(read, SAVED[name])


def test_zones_are_kept():
    read = load(stored(SAVED["zones"]))
    assert read.std(ZONED[3]) == SAVED["zones"].std(ZONED[3])
    raises("no time zone", read.std, datetime.datetime(2024, 3, 1))


def test_many_smoothing_splines_in_one_file():
    for names in (["one", "few knots", "robust"], ["dates"], ["product"], ["zones"], ["closed", "closed too"]):
        curves = {name: SAVED[name] for name in names}
        read = restored(curves)
        assert list(read) == names
        for name in names:
            assert_same(read[name], curves[name])
    plain = ss.CubicSpline(SAVED["one"].t, SAVED["one"].points, S2)
    raises("one class", ss.save, {"smooth": SAVED["one"], "plain": plain}, io.BytesIO())


ARRAYS = dict(np.load(io.BytesIO(stored(SAVED["weights"]))))


def load_with(**changes):
    """The curve with weights, read from a file in which some arrays are others or missing."""
    return load(with_arrays(SAVED["weights"], **changes))


def noise_with(**changes):
    return json.dumps([json.loads(str(ARRAYS["noise"]))[0] | changes])


@pytest.mark.parametrize("name", ARRAYS)
def test_files_with_a_missing_array(name):
    raises(name if name != "format" else "not a symspline curve", load_with, **{name: None})


def test_files_with_a_wrong_array():
    for changes in [
        {"data": 2 * ARRAYS["data"]},
        {"data": ARRAYS["data"][1:]},
        {"data": ARRAYS["data"] + 0j},
        {"data_t": ARRAYS["data_t"][::-1].copy()},
        {"data_t": ARRAYS["data_t"] - 1},
        {"data_t": ARRAYS["data_t"] + 1},
        {"data_t": np.arange(40), "data_t_unit": "s"},
        {"data_t_unit": "s CET"},
        {"data_t": 1.0},
        {"data_weights": -ARRAYS["data_weights"]},
        {"data_weights": ARRAYS["data_weights"].astype(str)},
        {"band": ARRAYS["band"][1:]},
        {"band": ARRAYS["band"][:, :3]},
        {"band": np.nan * ARRAYS["band"]},
        {"noise": "[{}]"},
        {"noise": "5"},
        {"noise": noise_with(method="guess")},
        {"noise": noise_with(converged="no")},
        {"noise": noise_with(lam=[1.0])},
        {"noise": noise_with(iterations=1.5)},
        {"noise": noise_with(surprise=1)},
    ]:
        raises("the file", load_with, **changes)


@pytest.mark.parametrize("changes", [{"rows": "{}"}, {"names": "5"}, {"noise": "[]"}, {"data_weights": [1.0]}])
def test_damaged_collections_raise(changes):
    file, damaged = io.BytesIO(), io.BytesIO()
    ss.save({"a": SAVED["one"], "b": SAVED["robust"]}, file)
    file.seek(0)
    np.savez(damaged, **dict(np.load(file)) | changes)
    damaged.seek(0)
    raises("the file", ss.load, damaged)
