"""Sampling times on the command line are sorted and lie between the first and the last knot."""

from unittest.mock import patch

import numpy as np
from cases import EPS
from hypothesis import given, note
from hypothesis import strategies as st

import symspline as ss
from fuzz.fits import knots
from fuzz.outcomes import Refusal, attempt
from fuzz.tables import STEPS
from fuzz.values import BAD
from symspline.cli import _times as times
from symspline.cli._errors import Problem

steps = st.one_of(
    st.sampled_from(STEPS),
    st.integers(1, 2**63).map(str),
    st.builds("{}e{}".format, st.integers(1, 99), st.integers(-20, 20)),
    st.builds("{}{}".format, st.integers(1, 10**6), st.sampled_from(sorted(times._NANOSECONDS))),
)


@given(st.data())
def test_times_along_a_curve(data):
    n = data.draw(st.integers(2, 5))
    t = data.draw(knots((), n, BAD))
    spline = attempt(lambda: ss.CubicSpline(t, np.zeros((n, 1)), "r:1"))
    if isinstance(spline, Refusal):
        return
    t = spline.t
    count, step = data.draw(st.integers(1, 50)), data.draw(st.one_of(st.none(), steps))
    # Enough samples to see what is wrong.
    with patch.object(times, "_MOST", 10**4):
        found = attempt(lambda: along(t, count, step))
    if found is None:
        return
    note(repr(found))
    assert found[0] == t[0] and (found[1:] >= found[:-1]).all() and found[-1] <= t[-1]
    if step is None:
        assert len(found) == count and (count == 1 or found[-1] == t[-1])
    elif len(found) > 2:
        gaps = np.diff(found)
        assert (np.abs(gaps - gaps[0]) <= (8 * EPS * np.abs(t).max() if t.dtype.kind == "f" else 0 * gaps[0])).all()
        assert t[-1] - found[-1] <= gaps[0]


def along(t, count, step):
    """The times, or None if there is a reason that a user can read."""
    try:
        return times.spread(count, t) if step is None else times.every(step, t)
    except Problem as problem:
        assert str(problem)
        return None
