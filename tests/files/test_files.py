"""Files keep a curve to the last bit."""

import io
import os
import pickle
from pathlib import Path

import numpy as np
import pytest
from curves import (
    KNOTS,
    S2,
    THREE,
    at_node,
    every_kind,
    failing,
    parts,
    points_on,
    same,
    same_curve,
    tangents_at,
)

import symspline as ss

EPOCH = 1_700_000_000_000_000_000


def round_trip(spline):
    file = io.BytesIO()
    spline.save(file)
    file.seek(0)
    return ss.load(file)


def saved_curves():
    v = tangents_at(S2, np.array([1.0, 0, 0]))
    product = ss.Product("sphere:3", "r:2")
    ends = [(1, tangents_at(product, at_node(product, points_on(product, 4), e))) for e in (0, -1)]
    cut, options = failing("cut locus")
    hour = np.datetime64("2024-01-01T00", "h")
    return {
        "one": ss.CubicSpline(None, THREE, S2),
        "own ends": ss.CubicSpline([0, 1, 3], THREE, S2, bc_type=((1, v), "not-a-knot"), extrapolate=True),
        "periodic": ss.CubicSpline(None, [*THREE, THREE[0]], S2, bc_type="periodic", extrapolate="geodesic"),
        "batch": ss.CubicSpline(KNOTS, points_on(S2, 6, (2, 3)), S2),
        "own times": ss.CubicSpline(
            [[0, 1, 2], [0, 2, 3.0]], [THREE, THREE], S2, bc_type=((2, [v, -v]), "natural")
        ),
        "dates": ss.CubicSpline(hour + np.array([0, 1, 3]), THREE, S2),
        "own dates": ss.CubicSpline(hour + np.array([[0, 1, 3], [1, 2, 3]]), [THREE, THREE], S2),
        "nanoseconds": ss.CubicSpline(np.int64(EPOCH) + np.array([0, 1, 3]), THREE, S2),
        "product": ss.CubicSpline(None, points_on(product, 4), product, bc_type=tuple(ends)),
        "product batch": ss.CubicSpline(KNOTS, points_on(product, 6, (2,)), product),
        "flat": ss.CubicSpline(KNOTS, points_on(ss.Euclidean(1), 6), "r:1"),
        "hyperbolic": ss.CubicSpline(KNOTS, points_on(ss.Hyperbolic(3), 6), "h:3"),
        "left out": ss.CubicSpline(None, [THREE, THREE], S2, where=[True, False]),
        "a bad sensor": ss.CubicSpline(None, [THREE, np.nan * np.array(THREE)], S2, on_failure="ignore"),
        "one bad curve": ss.CubicSpline(None, cut, S2, on_failure="ignore", **options),
    }


SAVED = saved_curves()


@pytest.mark.parametrize("name", SAVED)
def test_files_keep_everything(name):
    spline = SAVED[name]
    read = round_trip(spline)
    assert same_curve(read, spline)
    assert read.t.dtype == spline.t.dtype and read.space == spline.space
    assert read.extrapolate == spline.extrapolate
    assert repr(read) == repr(spline) and str(read.report) == str(spline.report)
    x = spline.t.ravel()[1:2]
    for nu in range(3):
        assert same(read(x, nu=nu), spline(x, nu=nu))
    if isinstance(spline.bc_type, str):
        assert read.bc_type == spline.bc_type
    for ours, theirs in zip(spline.bc_type, read.bc_type, strict=True):
        assert isinstance(ours, str) or (ours[0] == theirs[0] and same(tuple(ours[1]), tuple(theirs[1])))


def test_files_and_pickles_keep_durations():
    spline = ss.CubicSpline(np.array([0, 1000, 3000], "m8[ms]"), THREE, S2)
    half = np.timedelta64(500, "ms")
    for made in (spline, round_trip(spline), pickle.loads(pickle.dumps(spline))):
        assert same(made(half), spline(0.5)) and made.t.tolist() == [0.0, 1.0, 3.0]


def test_files_keep_dates_that_count_in_tens():
    spline = ss.CubicSpline(np.array([0, 1, 3], "M8[10s]"), THREE, S2)
    assert np.array_equal(round_trip(spline).t, spline.t)


@pytest.mark.parametrize("kind", [str, Path])
@pytest.mark.parametrize("name", ["curve.npz", "curve", "Kurve äöü.spline"])
def test_files_have_the_name_they_were_given(tmp_path, kind, name):
    SAVED["one"].save(kind(tmp_path / name))
    assert os.listdir(tmp_path) == [name]
    assert ss.load(kind(tmp_path / name)) == SAVED["one"]


def test_files_are_replaced_whole(tmp_path):
    path = tmp_path / "curve.npz"
    SAVED["batch"].save(path)
    SAVED["one"].save(path)
    assert ss.load(path) == SAVED["one"]
    with pytest.raises(OSError):
        SAVED["one"].save(tmp_path / "missing" / "curve.npz")
    assert os.listdir(tmp_path) == ["curve.npz"]


def test_open_files(tmp_path):
    with open(tmp_path / "curve.npz", "w+b") as file:
        SAVED["batch"].save(file)
        file.seek(0)
        assert ss.load(file) == SAVED["batch"]
        assert not file.closed


def test_what_is_in_a_file():
    names = ["format", "version", "space", "t", "t_unit", "bc_type", "extrapolate", "report"]
    for spline, suffixes in ((SAVED["dates"], [""]), (SAVED["product"], ["_0", "_1"])):
        file = io.BytesIO()
        spline.save(file)
        file.seek(0)
        with np.load(file, allow_pickle=False) as arrays:
            expected = names + [kind + s for kind in ("points", "velocities") for s in suffixes]
            assert sorted(arrays.files) == sorted(expected)
            assert str(arrays["space"]) == str(spline.space)
            assert str(arrays["t_unit"]) == ("h" if spline is SAVED["dates"] else "")
            for suffix, points, velocities in zip(
                suffixes, parts(spline.points), parts(spline.velocities), strict=True
            ):
                assert same(arrays["points" + suffix], points)
                assert same(arrays["velocities" + suffix], velocities)


def test_saving_leaves_the_umask_alone(tmp_path, monkeypatch):
    masks = []
    monkeypatch.setattr(os, "umask", lambda mask: masks.append(mask) or 0o22)
    ss.CubicSpline(None, np.eye(3), S2).save(tmp_path / "curve.npz")
    assert not masks


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX rights")
def test_saved_files_have_the_rights_of_new_files(tmp_path):
    ss.CubicSpline(None, np.eye(3), S2).save(tmp_path / "curve.npz")
    (tmp_path / "other").write_text("")
    assert (tmp_path / "curve.npz").stat().st_mode == (tmp_path / "other").stat().st_mode


# ---- curves with given velocities ----


def saved_hermites():
    product = ss.Product("so:3", "r:3")
    poses, dates = points_on(product, 4), np.array(["2024-01-01", "2024-01-02", "2024-01-05"], "M8[h]")
    chosen = tangents_at(S2, np.array(THREE, float))
    return {
        "one": ss.HermiteSpline([0, 1, 3], THREE, chosen, S2, extrapolate="geodesic"),
        "batch": ss.HermiteSpline(None, [THREE, THREE], [chosen, 0 * chosen], S2),
        "dates": ss.HermiteSpline(dates, THREE, 1e-5 * chosen, S2),
        "product": ss.HermiteSpline(None, poses, tangents_at(product, poses), product),
        "span": ss.HermiteSpline(None, np.eye(400)[:3], 0.1 * np.eye(400)[10:13], "sphere:399"),
    }


HERMITES = saved_hermites()


@pytest.mark.parametrize("name", HERMITES)
def test_files_keep_given_velocities(name):
    spline = HERMITES[name]
    read = round_trip(spline)
    assert type(read) is ss.HermiteSpline and read == spline and repr(read) == repr(spline)
    assert read.t.dtype == spline.t.dtype and read.extrapolate == spline.extrapolate
    x = spline.t.ravel()[:1] + (spline.t.ravel()[1] - spline.t.ravel()[0]) // 2
    for nu in range(3):
        assert same(read(x, nu=nu), spline(x, nu=nu))


def test_files_of_given_velocities_that_are_damaged():
    file = io.BytesIO()
    HERMITES["one"].save(file)
    file.seek(0)
    arrays = dict(np.load(file))
    bad = {
        "velocities": np.array(THREE, float),
        "points": 2.0 * np.array(THREE),
        "t": [0, 2, 1],
        "version": 9,
    }
    for key, value in [*bad.items(), ("velocities", np.full((3, 3), np.nan))]:
        file = io.BytesIO()
        np.savez(file, **arrays | {key: value})
        file.seek(0)
        with pytest.raises(ss.ValidationError, match="the file"):
            ss.load(file)


# ---- many curves in one file ----


@every_kind
def test_many_curves_in_one_file(space):
    curves = {str(n): ss.CubicSpline(None, points_on(space, n, step=0.5), space) for n in (2, 5, 3)}
    file = io.BytesIO()
    ss.save(curves, file)
    file.seek(0)
    read = ss.load(file)
    assert list(read) == list(curves)
    assert all(same_curve(read[name], curves[name]) for name in curves)


def test_collections_in_python(tmp_path):
    one, other = ss.fit_many([(None, np.eye(3)), ([1, 2], np.eye(3)[:2])], "s:2", bc_type="not-a-knot")
    ss.save({"": one, "b\0é": other}, tmp_path / "c.npz")
    loaded = ss.load(tmp_path / "c.npz")
    assert loaded == {"": one, "b\0é": other}
    assert loaded[""].report == one.report and loaded[""].bc_type == "not-a-knot"
    product = ss.space("s:2 x r:1")
    v = (np.array([0.0, 1, 0]), np.array([2.0]))
    both = ss.CubicSpline(None, (np.eye(3), np.eye(3)[:, :1]), product, bc_type=((1, v), "natural"))
    ss.save({"p": both, "q": both}, tmp_path / "p.npz")
    assert ss.load(tmp_path / "p.npz")["q"] == both
    pair = ss.fit_many([(None, np.eye(3)), (None, np.eye(3))], "s:2", where=[True, False])
    ss.save(dict(zip("ab", pair, strict=True)), tmp_path / "some.npz")
    assert ss.load(tmp_path / "some.npz") == dict(zip("ab", pair, strict=True))
    ss.save({"a": HERMITES["one"], "b": HERMITES["one"]}, tmp_path / "d.npz")
    assert ss.load(tmp_path / "d.npz")["b"] == HERMITES["one"]
    batch = ss.CubicSpline(None, [np.eye(3)] * 2, "s:2")
    for curves, message in [
        ({"p": both, "q": one}, r"curves\['q'\] and curves\['p'\] differ in .* Save them in separate files"),
        ({"p": one, "q": HERMITES["one"]}, "of one class and of one space"),
        ({"a": batch}, r"curves\['a'\] is a batch"),
        ({}, "at least one curve"),
        ({5: one}, "whose keys are text"),
    ]:
        with pytest.raises(ss.ValidationError, match=message):
            ss.save(curves, tmp_path / "e.npz")
    for wrong in ({"a": 5}, [one], 5):
        with pytest.raises(TypeError, match="curves must be a Curve or a mapping of names to Curves"):
            ss.save(wrong, tmp_path / "e.npz")
    assert not (tmp_path / "e.npz").exists()
    arrays = dict(np.load(tmp_path / "c.npz"))
    for key, value in {"rows": "{}", "names": '["a"]', "format": "other", "report": "[]"}.items():
        np.savez(tmp_path / "bad.npz", **arrays | {key: value})
        with pytest.raises(ss.ValidationError, match=r"bad\.npz"):
            ss.load(tmp_path / "bad.npz")
