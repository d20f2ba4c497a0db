"""Curves read from a file are bit-identical to those that were saved."""

import io
import os
import pickle
from pathlib import Path

import numpy as np
import pytest
from compare import parts, same, same_curve
from curves import KNOTS, S2, THREE, at_node, every_kind, failing, points_on, tangents_at
from refused import raises
from stored import load, restored, stored, with_arrays

import symspline as ss

EPOCH = 1_700_000_000_000_000_000


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
        "own times": ss.CubicSpline([[0, 1, 2], [0, 2, 3.0]], [THREE, THREE], S2, bc_type=((2, [v, -v]), "natural")),
        "tens": ss.CubicSpline(np.array([0, 1, 3], "M8[10s]"), THREE, S2),
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


ALL = SAVED | {f"velocities, {name}": spline for name, spline in HERMITES.items()}


@pytest.mark.parametrize("name", ALL)
def test_files_keep_everything(name):
    spline = ALL[name]
    read = restored(spline)
    assert type(read) is type(spline) and read == spline and repr(read) == repr(spline)
    assert read.t.dtype == spline.t.dtype and read.space == spline.space and same(read.velocities, spline.velocities)
    assert read.extrapolate == spline.extrapolate
    _, second, third = spline.t.ravel()[:3]
    for nu in range(3):
        for x in ([second], [second + (third - second) // 2]):
            assert same(read(x, nu=nu), spline(x, nu=nu))
    if name in SAVED:
        assert read.report == spline.report and str(read.report) == str(spline.report)
        if isinstance(spline.bc_type, str):
            assert read.bc_type == spline.bc_type
        for ours, theirs in zip(spline.bc_type, read.bc_type, strict=True):
            assert isinstance(ours, str) or (ours[0] == theirs[0] and same(tuple(ours[1]), tuple(theirs[1])))


def test_files_and_pickles_keep_durations():
    spline = ss.CubicSpline(np.array([0, 1000, 3000], "m8[ms]"), THREE, S2)
    half = np.timedelta64(500, "ms")
    for made in (spline, restored(spline), pickle.loads(pickle.dumps(spline))):
        assert same(made(half), spline(0.5)) and made.t.tolist() == [0.0, 1.0, 3.0]


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


@pytest.mark.parametrize("name, suffixes, unit", [("dates", [""], "h"), ("product", ["_0", "_1"], "")])
def test_what_is_in_a_file(name, suffixes, unit):
    spline = SAVED[name]
    names = ["format", "version", "space", "t", "t_unit", "bc_type", "extrapolate", "report"]
    with np.load(io.BytesIO(stored(spline)), allow_pickle=False) as arrays:
        assert sorted(arrays.files) == sorted(names + [k + s for k in ("points", "velocities") for s in suffixes])
        assert str(arrays["space"]) == str(spline.space) and str(arrays["t_unit"]) == unit
        for suffix, *values in zip(suffixes, parts(spline.points), parts(spline.velocities), strict=True):
            assert same((arrays["points" + suffix], arrays["velocities" + suffix]), tuple(values))


def test_saving_leaves_the_umask_alone(tmp_path, monkeypatch):
    masks = []
    monkeypatch.setattr(os, "umask", lambda mask: masks.append(mask) or 0o22)
    ss.CubicSpline(None, np.eye(3), S2).save(tmp_path / "curve.npz")
    assert not masks


def test_damaged_files_of_given_velocities_raise():
    for changes in ({"velocities": THREE}, {"points": 2 * np.eye(3)}, {"t": [0, 2, 1]}, {"version": 9}):
        raises("the file", load, with_arrays(HERMITES["one"], **changes))


@every_kind
def test_many_curves_in_one_file(space):
    curves = {str(n): ss.CubicSpline(None, points_on(space, n, step=0.5), space) for n in (2, 5, 3)}
    read = restored(curves)
    assert list(read) == list(curves)
    assert all(same_curve(read[name], curves[name]) for name in curves)


def test_collections_keep_names_and_end_conditions():
    one, other = ss.fit_many([(None, np.eye(3)), ([1, 2], np.eye(3)[:2])], "s:2", bc_type="not-a-knot")
    loaded = restored({"": one, "b\0é": other})
    assert loaded == {"": one, "b\0é": other}
    assert loaded[""].report == one.report and loaded[""].bc_type == "not-a-knot"
    v = (np.array([0.0, 1, 0]), np.array([2.0]))
    both = ss.CubicSpline(None, (np.eye(3), np.eye(3)[:, :1]), "s:2 x r:1", bc_type=((1, v), "natural"))
    assert restored({"p": both, "q": both})["q"] == both
    pair = dict(zip("ab", ss.fit_many([(None, np.eye(3))] * 2, "s:2", where=[True, False]), strict=True))
    assert restored(pair) == pair


def test_collections_of_any_class():
    curves = {"a": HERMITES["one"], "b": HERMITES["one"]}
    assert restored(curves) == curves


def test_invalid_collections_raise(tmp_path):
    one, flat = ss.CubicSpline(None, np.eye(3), S2), ss.CubicSpline(None, np.eye(3), "r:3")
    for curves, kind, match in (
        ({"p": flat, "q": one}, ss.ValidationError, r"curves\['q'\] and curves\['p'\] differ in .* in separate files"),
        ({"p": one, "q": HERMITES["one"]}, ss.ValidationError, "of one class and of one space"),
        ({}, ss.ValidationError, "at least one curve"),
        ({5: one}, ss.ValidationError, "whose keys are text"),
        ({"a": SAVED["batch"]}, ss.ValidationError, r"curves\['a'\] is a batch"),
        ({"a": 5}, TypeError, "curves must be a Curve or a mapping of names to Curves"),
        ([one], TypeError, "curves must be a Curve or a mapping of names to Curves"),
    ):
        raises(match, ss.save, curves, tmp_path / "curves.npz", error=kind)
    assert not (tmp_path / "curves.npz").exists()
