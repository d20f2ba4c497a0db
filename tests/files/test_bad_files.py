"""Damaged, foreign and missing files raise an error."""

import contextlib
import gc
import io
import json
import tracemalloc
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest
from curves import S2
from refused import INF, NAN, P, raises
from stored import archive, load, npy, stored, with_arrays

import symspline as ss

KINDS = {
    "interpolating": ss.CubicSpline(None, P, S2),
    "smoothing": ss.make_smoothing_spline([0, 1, 1, 2], P[[0, 1, 1, 2]], S2, 0.1),
}
kinds = pytest.mark.parametrize("kind", KINDS)


def is_good_or_refused(data, kind="interpolating"):
    """A damaged file must be refused, or be read as what it was (damage may be where it does not matter)."""
    try:
        return load(data) == KINDS[kind]
    except (ss.ValidationError, OSError):
        return True


@kinds
def test_truncated_files(kind):
    data = stored(KINDS[kind])
    for n in [*range(0, len(data), 5), len(data) - 1]:
        raises("the file", load, data[:n])


@kinds
def test_files_with_one_bad_byte(kind):
    data = stored(KINDS[kind])
    # Most of the directory, which says where each array is, and some of the numbers.
    places = {*range(0, len(data), 61), *range(0, 400, 4), *range(len(data) - 1200, len(data), 8)}
    for k, i in enumerate(sorted(place for place in places if 0 <= place < len(data))):
        mask = (0x01, 0xFF)[k % 2]
        assert is_good_or_refused(data[:i] + bytes([data[i] ^ mask]) + data[i + 1 :], kind)


@pytest.mark.parametrize("method", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_compressed_files(method):
    file = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(stored())) as source, zipfile.ZipFile(file, "w", method) as target:
        for name in source.namelist():
            target.writestr(name, source.read(name))
    data = file.getvalue()
    assert load(data) == ss.CubicSpline(None, P, S2)
    for i in range(0, len(data), 31):
        assert is_good_or_refused(data[:i] + bytes([data[i] ^ 0xFF]) + data[i + 1 :])


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"hello",
        b"PK\x03\x04",
        b"PK\x05\x06" + 18 * b"\0",
        b"\x93NUMPY",
        b"\x80\x04N.",
        npy(np.eye(3)),
        archive(readme__txt="hello"),
        archive(format__npy="hello"),
        archive(format__npy=b"\x93NUMPY\x01\0\x76\0{"),
        archive(format="symspline-curve"),
    ],
    # Without the time of day that is in an archive: workers must find the same tests.
    ids=lambda data: str(data[:8]),
)
def test_foreign_files(data):
    raises("the file", load, data)


def test_messages_name_the_file(tmp_path):
    (tmp_path / "curve.npz").write_bytes(npy(np.eye(3)))
    for path in (tmp_path / "curve.npz", str(tmp_path / "curve.npz")):
        raises(r"curve\.npz", ss.load, path)


@pytest.mark.parametrize(
    "data", [npy(np.eye(3)), archive(readme__txt="hello"), stored()[:500]], ids=["array", "archive", "truncated"]
)
def test_files_are_closed_when_refused(tmp_path, data):
    (tmp_path / "curve.npz").write_bytes(data)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with contextlib.suppress(ss.ValidationError):
            ss.load(tmp_path / "curve.npz")
        gc.collect()
    assert not caught


class Bomb:
    """Leaves a mark when it is unpickled."""

    def __reduce__(self):
        return Path.touch, (Path(self.path),)


@pytest.mark.parametrize("name", ["format", "points", "report", "something"])
def test_files_are_read_without_pickle(tmp_path, name):
    bomb = Bomb()
    bomb.path = str(tmp_path / "exploded")
    # Of an entry that curves do not have nothing is read.
    with contextlib.nullcontext() if name == "something" else pytest.raises(ss.ValidationError):
        load(with_arrays(**{name: np.array([bomb], object)}))
    raises("the file", load, npy(np.array([bomb], object)))
    assert not (tmp_path / "exploded").exists()


ARRAYS = dict(np.load(io.BytesIO(stored())))


@pytest.mark.parametrize("name", ARRAYS)
def test_files_of_curves_with_a_missing_array(name):
    raises(name if name != "format" else "not a symspline curve", load, with_arrays(**{name: None}))


def report_with(**changes):
    return json.dumps([json.loads(str(ARRAYS["report"]))[0] | changes])


def test_files_of_curves_with_a_wrong_array():
    for changes in [
        {"version": "one"},
        {"space": "sphere:3"},
        {"space": "sphere:" + "9" * 30},
        {"t": [0.0, NAN, 1]},
        {"t": [0.0, 1, INF]},
        {"t": [0.0, 1]},
        {"t": [[0.0, 1, 2]]},
        {"t": ["a", "b", "c"]},
        {"t": [0, 1j, 2]},
        {"t": []},
        {"t_unit": "s CET", "t": [0, 1, 2]},
        {"t_unit": "s", "t": [0, 1, np.iinfo(np.int64).min]},
        {"points": NAN * P},
        {"points": P + 0j},
        {"points": P[:2]},
        {"points": P.astype(str)},
        {"velocities": P[:2]},
        {"extrapolate": "[1]"},
        {"report": "[{}]"},
        {"report": "[" * 100_000},
        {"report": report_with(converged="no", rate={}, method=5)},
        {"t": [0.0], "points": P[:1], "velocities": P[:1]},
        {"bc_type": "{}"},
        {"bc_type": '[["x", 1], "natural"]'},
    ]:
        raises("the file", load, with_arrays(**changes))


def test_newer_pickles_raise():
    message = rf"the format has version 99, but symspline {ss.__version__} reads versions up to 2\. Install a newer"
    for curve in KINDS.values():
        restore, (state,) = curve.__reduce__()
        assert state["version"] == 2
        raises(message, restore, state | {"version": 99})


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(FileNotFoundError):
        ss.load(tmp_path / "missing.npz")
    with pytest.raises(OSError):
        ss.load(tmp_path)
    with pytest.raises(OSError):
        ss.CubicSpline(None, P, S2).save(tmp_path)


def test_non_files_raise():
    for what in [None, 5, [1, 2]]:
        with pytest.raises((ss.ValidationError, TypeError, OSError)):
            ss.load(what)


def bomb(name, method, size=2**26, **more):
    """A small archive with an entry of 64 MiB, zeros all of them."""
    file = io.BytesIO(with_arrays(**{name: None} | more))
    with zipfile.ZipFile(file, "a", method) as target, target.open(f"{name}.npy", "w") as entry:
        np.lib.format.write_array_header_1_0(entry, {"descr": "<f8", "fortran_order": False, "shape": (size // 8,)})
        for _ in range(size // 2**20):
            entry.write(bytes(2**20))
    return file.getvalue()


@pytest.mark.parametrize(("name", "method"), [("points", zipfile.ZIP_DEFLATED), ("format", zipfile.ZIP_BZIP2)])
def test_archives_that_unpack_to_far_more_than_their_size(name, method):
    data = bomb(name, method)
    tracemalloc.start()
    try:
        raises(rf"the file: entry '{name}' would take 671\d+ bytes of memory", load, data)
        assert tracemalloc.get_traced_memory()[1] < 2**24
    finally:
        tracemalloc.stop()


def test_unknown_entries_are_not_read():
    data = bomb("surprise", zipfile.ZIP_BZIP2)
    tracemalloc.start()
    try:
        assert load(data) == ss.CubicSpline(None, P, S2)
        assert tracemalloc.get_traced_memory()[1] < 2**24
    finally:
        tracemalloc.stop()


def test_arrays_that_are_smaller_than_their_header_says():
    file = io.BytesIO(with_arrays(points=None))
    with zipfile.ZipFile(file, "a") as target, target.open("points.npy", "w") as entry:
        np.lib.format.write_array_header_1_0(entry, {"descr": "<f8", "fortran_order": False, "shape": (2**40, 3)})
    raises("entry 'points' is damaged: it has 0 bytes", load, file.getvalue())


def test_messages_name_the_file_and_the_entry(tmp_path):
    for changes, message in [
        ({"format": "other"}, "entry 'format' is 'other', but must be one of .*'symspline-curve'"),
        ({"format": 3}, "entry 'format' is not a text: it holds int64"),
        ({"version": 1.5}, "entry 'version' is 1.5, but must be a positive integer"),
        ({"version": 0}, "entry 'version' is 0, but must be a positive integer"),
        ({"version": 99}, "the format has version 99, but symspline .* reads versions up to 2. Install a newer"),
        ({"version": True}, "entry 'version' is True"),
        ({"space": "klein:2"}, "entry 'space': unknown space 'klein"),
        ({"space": 5.0}, "entry 'space': entry 'space' is not a text|entry 'space' is not a text"),
        ({"extrapolate": '"wrap"'}, "entry 'extrapolate': extrapolate must be None, 'raise', True, False, 'geodesic'"),
        ({"extrapolate": "{"}, "entry 'extrapolate' is not JSON"),
        ({"bc_type": '"foo"'}, "entry 'bc_type': bc_type must be 'natural'"),
        ({"bc_type": '[[1, "x"], "natural"]'}, "entry 'bc_type': "),
        ({"report": "5"}, "entry 'report': it must be a list with one report for each of 1 factors"),
        ({"report": report_with(method="magic")}, "entry 'report': the method is 'magic', but must be one of fixed"),
        ({"report": report_with(surprise=5)}, "entry 'report': there is no field 'surprise'"),
        ({"report": report_with(max_gap="far")}, "entry 'report': max_gap is 'far'"),
        ({"points": None}, "entry 'points' is missing"),
        ({"points": 2 * P}, "entry 'points': point"),
        ({"velocities": P}, "entry 'velocities': the vectors are not tangent"),
        ({"t": [0.0, 2, 1]}, "entry 't': the knots do not increase"),
        ({"t_unit": "parsec"}, "entry 't_unit': "),
        ({"t_unit": "s CET"}, "entry 't_unit': the zone of the times is 'CET', but must be UTC or none"),
        ({"t_unit": "s"}, "entry 't': dates are counted in whole numbers, not in float64"),
    ]:
        (tmp_path / "a.npz").write_bytes(with_arrays(**changes))
        raises(rf"a\.npz: {message}", ss.load, tmp_path / "a.npz")


def many_with(**changes):
    file = io.BytesIO()
    curve = ss.CubicSpline(None, P, S2)
    ss.save({"a": curve, "b": curve}, file)
    file.seek(0)
    arrays, file = dict(np.load(file)) | changes, io.BytesIO()
    np.savez(file, **{name: array for name, array in arrays.items() if array is not None})
    return io.BytesIO(file.getvalue())


def rows_of(**changes):
    return json.dumps({name: [3, 3] for name in ("t", "points", "velocities")} | changes)


def test_messages_about_collections():
    for changes, message in [
        ({"names": '["a"]'}, "entry 'bc_type' must be a list with one value for each of 1 curves"),
        ({"names": '["a", "a"]'}, "entry 'names' holds a name twice"),
        ({"names": "5"}, "entry 'names' must be a list of texts"),
        ({"rows": None}, "entry 'rows' is missing"),
        ({"rows": "[]"}, "entry 'rows' must have the numbers of rows of t, "),
        ({"rows": rows_of(t=[3, 4])}, r"entry 'rows' has \[3, 4\] for 't', which does not add up to 6 rows"),
        ({"rows": rows_of(t=[3, 2])}, r"entry 'rows' has \[3, 2\] for 't', which does not add up to 6 rows"),
        ({"rows": rows_of(points=[2.0, 4.0])}, r"entry 'rows' has \[2\.0, 4\.0\] for 'points'"),
        ({"rows": rows_of(points=[6])}, "entry 'points' must be a list with one value for each of 2 curves"),
        ({"rows": rows_of(data=[3, 3])}, "entry 'rows' must have the numbers of rows of t, "),
        ({"rows": rows_of(points=[2, 4])}, "curve 'a': shapes do not fit"),
        ({"report": "[]"}, "entry 'report' must be a list with one value for each of 2 curves"),
        ({"bc_type": '["natural", "foo"]'}, "curve 'b': entry 'bc_type': "),
    ]:
        raises(f"the file: {message}", ss.load, many_with(**changes))
