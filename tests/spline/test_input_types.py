"""Input of other types: dates, durations, tensors, quantum objects and tables; and input that could be misread.

PyTorch and QuTiP need not be there: stand-ins do what the library looks at, as those do it. Times of pandas are in
test_pandas.
"""

import pickle
from datetime import UTC, date, datetime, timedelta, timezone
from decimal import Decimal

import numpy as np
import pytest
from curves import S2, run_python
from refused import raises
from scipy.spatial.transform import Rotation
from stored import restored

import symspline as ss

P = np.eye(3)
HOURS = np.array(["2021-08-29T00", "2021-08-29T06", "2021-08-29T18"], "datetime64[h]")
SPLINE = ss.CubicSpline(HOURS, P, S2)
EAST = timezone(timedelta(hours=2))
BERLIN, KOLKATA = (timezone(timedelta(hours=h), name) for h, name in ((1, "Berlin"), (5.5, "Kolkata")))
NAIVE = [datetime(2021, 8, 29, hour) for hour in (0, 6, 18)]


class Tensor:
    """As torch.Tensor."""

    def __init__(self, numbers, requires_grad=False):
        self._numbers, self.requires_grad = np.asarray(numbers, float), requires_grad

    def detach(self):
        return Tensor(self._numbers)

    def cpu(self):
        return self

    def numpy(self):
        return self._numbers

    def __array__(self, *_, **__):
        raise RuntimeError("Can't call numpy() on Tensor that requires grad.")


class Qobj:
    """As qutip.Qobj."""

    def __init__(self, array):
        self._array = np.asarray(array, complex)
        self.isket, self.isbra = self._array.shape[1] == 1, self._array.shape[0] == 1

    def full(self):
        return self._array


class Quantity:
    """As pint.Quantity."""

    units, magnitude = "km", 3.0


@pytest.mark.parametrize(
    "t",
    [
        NAIVE,
        tuple(NAIVE),
        np.array(NAIVE, object),
        [moment.replace(tzinfo=UTC) for moment in NAIVE],
        [(moment + timedelta(hours=2)).replace(tzinfo=EAST) for moment in NAIVE],
        ["2021-08-29T00:00", "2021-08-29T06:00", "2021-08-29T18:00"],
        ["2021-08-29 00:00:00Z", "2021-08-29T08:00+02:00", "2021-08-29T15:30-0230"],
        np.array(["2021-08-29T00:00:00.000", "2021-08-29T06:00", "2021-08-29T18:00"]),
    ],
)
def test_dates_of_any_kind(t):
    spline = ss.CubicSpline(t, P, S2)
    assert np.array_equal(spline.t, HOURS) and np.array_equal(spline.velocities, SPLINE.velocities)
    assert np.array_equal(spline(t), SPLINE(HOURS))
    assert np.array_equal(spline(t[1]), SPLINE(HOURS[1]))
    assert np.array_equal(spline(spline.t), SPLINE(HOURS))


def test_days_and_nanoseconds():
    days = [date(2021, 8, 28), date(2021, 8, 29), date(2021, 8, 31)]
    assert ss.CubicSpline(days, P, S2) == ss.CubicSpline(np.array(days, "M8[D]"), P, S2)
    fine = ["2021-08-29T00:00:00.000000001", "2021-08-29T00:00:00.000000003"]
    assert ss.CubicSpline(fine, P[:2], S2).t.tolist() == np.array(fine, "M8[ns]").tolist()


AWARE = [moment.replace(tzinfo=UTC) for moment in NAIVE]


@pytest.mark.parametrize(
    "t, x, match",
    [
        (AWARE, NAIVE[1], "x has no time zone, but the knots have one"),
        (NAIVE, "2021-08-29T06:00Z", "x has a time zone, but the knots have none"),
        ([AWARE[0], *NAIVE[1:]], None, r"t\[1\] is 2021-08-29 06:00:00, but .* before has a time zone"),
        (["2021-08-29", "2021-08-30", "7"], None, r"t\[2\] is '7'"),
        ([NAIVE[0], 3, NAIVE[2]], None, r"t\[1\] is 3, but"),
        *(
            (["2021-08-29", word, "2021-08-31"], None, r"t\[1\] is '.*', not a date such as")
            for word in ("now", "today", "NaT", "2021", "2021-02-30", "29.8.2021", "20210829", "")
        ),
    ],
)
def test_times_with_and_without_a_zone_do_not_mix(t, x, match):
    raises(match, lambda: ss.CubicSpline(t, P, S2)(x))


KINDS = {
    "fitted": lambda t: ss.CubicSpline(t, P, S2),
    "given velocities": lambda t: ss.HermiteSpline(t, P, 1e-5 * np.roll(P, 1, axis=1), S2),
    "many": lambda t: ss.fit_many([(t, P)], S2)[0],
    "a piece": lambda t: ss.fit_segments(t, P, S2, max_gap=timedelta(hours=7))[0],
    "of a batch": lambda t: ss.CubicSpline([t, t], [P, P], S2)[1],
}


@pytest.mark.parametrize("zone", [BERLIN, KOLKATA, None])
@pytest.mark.parametrize("kind", KINDS)
def test_time_zones_are_kept(zone, kind):
    spline = KINDS[kind]([datetime(2026, 1, 1, hour, tzinfo=zone) for hour in (0, 6, 12)])
    for curve in (spline, restored(spline), pickle.loads(pickle.dumps(spline))):
        middle = datetime(2026, 1, 1, 6, tzinfo=zone)
        utc = middle.astimezone(UTC).replace(tzinfo=None) if zone else middle
        # NumPy's dates have no zone: they are those of ``t``, UTC.
        assert curve.t[1] == np.datetime64(utc) and np.array_equal(curve(curve.t[1]), P[1])
        if zone:
            for x in (middle, middle.astimezone(EAST), middle.astimezone(KOLKATA).isoformat()):
                assert np.array_equal(curve(x), P[1]) and np.array_equal(curve([x])[0], P[1])
            for x in (middle.replace(tzinfo=None), "2026-01-01T06:00"):
                raises(r"no time zone, but the knots have one.*both with", curve, x)
        else:
            for x in (middle.replace(tzinfo=KOLKATA), "2026-01-01T06:00Z"):
                raises("a time zone, but the knots have none", curve, x)


def test_max_gap_accepts_durations():
    t = [timedelta(0), timedelta(seconds=1), timedelta(seconds=3)]
    (piece,) = ss.fit_segments(t, P, S2, max_gap=5)
    assert np.array_equal(piece(t[1]), P[1]) and piece == ss.CubicSpline(t, P, S2)


@pytest.mark.parametrize(
    "t", [[timedelta(0), timedelta(milliseconds=500), timedelta(seconds=2)], np.array([0, 500, 2000], "m8[ms]")]
)
def test_durations_are_seconds(t):
    spline = ss.CubicSpline(t, P, S2)
    assert spline == ss.CubicSpline([0, 0.5, 2], P, S2) and spline.t.dtype == np.float64
    assert np.array_equal(spline(t), spline([0, 0.5, 2]))
    assert np.array_equal(spline(np.timedelta64(500, "ms")), spline(0.5))
    for x in (timedelta(seconds=1), np.timedelta64(1, "s")):
        raises("x must be numbers, not timedelta64", SPLINE_OF_NUMBERS, x)
    raises("units of 'Y' have no fixed length", ss.CubicSpline, np.array([0, 1, 2], "m8[Y]"), P, S2)


SPLINE_OF_NUMBERS = ss.CubicSpline(None, P, S2)


def test_tensors():
    assert ss.CubicSpline(Tensor([0, 1, 2]), Tensor(P), S2) == SPLINE_OF_NUMBERS
    assert ss.CubicSpline(None, [Tensor(row) for row in P], S2) == SPLINE_OF_NUMBERS
    assert np.array_equal(SPLINE_OF_NUMBERS(Tensor([0.5])), SPLINE_OF_NUMBERS([0.5]))
    for points in (Tensor(P, True), [Tensor(row, i == 1) for i, row in enumerate(P)]):
        raises(r"points(\[1\])? requires a gradient.*symspline\.torch\.curve", ss.CubicSpline, None, points, S2)


def test_quantum_objects():
    kets = np.array([[1, 0], [0.8, 0.6j], [0.6, 0.8]])
    states = [Qobj(ket[:, None]) for ket in kets]
    assert ss.CubicSpline(None, states, "cp:1") == ss.CubicSpline(None, kets, "cp:1")
    assert ss.CubicSpline(None, [states, states], "cp:1") == ss.CubicSpline(None, [kets, kets], "cp:1")
    unitary = ss.SpecialUnitary(2).random_point(np.random.default_rng(0), 3)
    assert ss.CubicSpline(None, list(map(Qobj, unitary)), "su:2") == ss.CubicSpline(None, unitary, "su:2")
    assert ss.ComplexProjective(1).distance(states[0], states[1]) == ss.ComplexProjective(1).distance(*kets[:2])
    with pytest.raises(ss.ValidationError, match=r"points\[1\] is a bra; pass the ket"):
        ss.CubicSpline(None, [states[0], Qobj(kets[1][None]), states[2]], "cp:1")


NOT = "must be an array of numbers, not of object: it is a"


def test_objects_that_are_not_numbers_raise():
    for points, match in [
        (Rotation.identity(3), r"points.*Rotation; pass its \.as_matrix\(\)"),
        ([[1, 0, 0], [0, 1, None]], r"points is not an array|points\[1, 2\]"),
        ([[1, 0, 0], [0, 1, None], [0, 0, 1]], rf"points\[1, 2\] {NOT} NoneType"),
        ([[1, 0, 0], [0, Decimal(1), 0]], r"points\[1, 1\] .* it is a decimal\.Decimal; leave it out, or convert"),
        ([[1, 0, 0], [0, Quantity(), 0]], r"points\[1\]\[1\] has the unit km, which would be lost; .*magnitude"),
        (Quantity(), r"points has the unit km"),
        (object(), rf"points {NOT} object; leave it out"),
    ]:
        raises(match, ss.CubicSpline, None, points, S2)


def test_no_library_is_imported_to_find_out():
    code = (
        "import sys, symspline as ss; ss.CubicSpline(['2021-08-29', '2021-08-30'], [[1, 0], [0, 1]], 's:1');"
        "print([name for name in ('pandas', 'torch', 'qutip', 'scipy', 'matplotlib') if name in sys.modules])"
    )
    assert run_python(code).strip() == "[]"
