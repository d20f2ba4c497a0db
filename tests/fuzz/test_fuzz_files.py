"""Damaged files of curves raise an error or give a valid curve."""

import io
import json

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import symspline as ss
from fuzz.damage import damaged_bytes, damaged_json
from fuzz.outcomes import Refusal, attempt
from fuzz.places import parts
from fuzz.values import BAD, array_like, rarely

P = np.eye(3)
ROTATIONS = np.stack([np.eye(3), np.eye(3)[[1, 2, 0]], np.eye(3)[[2, 0, 1]]])
DATES = np.array(["2021-08-29T00", "2021-08-29T06", "2021-08-30T00"], "M8[m]")


def stored(*arguments, **options):
    file = io.BytesIO()
    ss.CubicSpline(*arguments, **options).save(file)
    return file.getvalue()


def smooth(**options):
    return ss.make_smoothing_spline(np.arange(6) // 1.5, P[[0, 0, 1, 1, 2, 2]], "sphere:2", 0.1, **options)


def stored_smooth():
    file = io.BytesIO()
    smooth(weights=[1, 2, 1, 1, 0, 1]).save(file)
    return file.getvalue()


def stored_many_smooth():
    file = io.BytesIO()
    ss.save({"a": smooth(), "b": smooth(knots=2)}, file)
    return file.getvalue()


def stored_many():
    file = io.BytesIO()
    long, short = ss.fit_many([(None, P), ([0, 2], P[:2])], "sphere:2")
    ss.save({"long": long, "short": short}, file)
    return file.getvalue()


ONE = [
    stored(None, P, "sphere:2"),
    stored(DATES, P, "sphere:2", bc_type=((1, [0, 1e-5, 0]), "natural"), extrapolate="geodesic"),
    stored([2**60, 2**60 + 1, 2**60 + 5], ROTATIONS, "so:3", bc_type="not-a-knot"),
    stored([[0, 1, 2], [0, 2, 3]], np.stack([P, P[::-1]]), "s:2", extrapolate=True),
    stored(None, ([[1, 0], [0.6, 0.8j]], [[1.0], [2.0]]), "cp:1 x r:1", bc_type=((1, ([0, 1e-3j], [3.0])), "clamped")),
    stored(None, [[1, 0], [-1, 0], [0, 1]], "s:1", on_failure="ignore"),
    stored(None, [[[2, 1j], [-1j, 2]], [[1, 0], [0, 3]]], "hpd:2", bc_type=((2, [[0, 1j], [-1j, 1]]), "natural")),
    stored_smooth(),
]
MANY = [stored_many(), stored_many_smooth()]


def check_loaded(curve):
    """What was read is a curve that works and can be written again."""
    assert isinstance(curve, ss.CubicSpline) and repr(curve) and str(curve.report)
    for factor, p, u in zip(*map(parts, (curve.space, curve.points, curve.velocities)), strict=True):
        # Of a curve that failed they may be NaN.
        if np.isfinite(u).all():
            assert np.abs(u - factor.project_tangent(p, u)).max() <= 1e-6 * np.abs(u).max()
    t = curve.t
    for nu in range(3):
        attempt(lambda nu=nu: curve(t, nu, per_curve=t.ndim > 1))
    file = io.BytesIO()
    curve.save(file)
    file.seek(0)
    again = attempt(lambda: ss.load(file))
    assert not isinstance(again, Refusal), again
    assert again == curve and again.report == curve.report


def check_file(data):
    """A file is read or refused."""
    found = attempt(lambda: ss.load(io.BytesIO(data)))
    if isinstance(found, Refusal):
        return
    for name, curve in (found if isinstance(found, dict) else {"": found}).items():
        assert isinstance(name, str)
        check_loaded(curve)


@given(st.data())
def test_damaged_files(data):
    check_file(data.draw(damaged_bytes(data.draw(st.sampled_from([*ONE, *MANY])), [*ONE, *MANY])))


@given(st.data())
def test_files_with_other_arrays(data):
    draw = data.draw
    arrays = dict(np.load(io.BytesIO(draw(st.sampled_from([*ONE, *MANY])))))
    for key in draw(st.lists(st.sampled_from(sorted(arrays)), min_size=1, max_size=2, unique=True)):
        array = arrays[key]
        if rarely(draw):
            del arrays[key]
        elif array.ndim == 0 and array.dtype.kind == "U" and is_json(str(array)):
            arrays[key] = np.array(draw(damaged_json(str(array))))
        elif array.ndim == 0:
            words = [
                "symspline-curve", "symspline-hermite", "symspline-bspline", "symspline-smoothing",
                "symspline-cumulative", "sphere:2", "s:2 x s:2", "r:1", "ns",
                "generic", "Y", "10s",
            ]  # fmt: skip
            arrays[key] = np.array(draw(st.one_of(st.sampled_from(words), st.text(max_size=9), st.integers(-2, 3))))
        else:
            value = draw(array_like(array, BAD))
            arrays[key] = np.asarray(value)
    arrays = {key: value for key, value in arrays.items() if not value.dtype.hasobject}
    if rarely(draw):
        arrays["surprise"] = np.zeros(3)
    file = io.BytesIO()
    np.savez(file, **arrays)
    check_file(file.getvalue())


def is_json(text):
    try:
        json.loads(text)
    except ValueError:
        return False
    return True
