"""Invalid input, and assertions that it raises an error with the place, the value and the remedy."""

import re
import warnings

import numpy as np
import pytest
from curves import S2, points_on

import symspline as ss

P = np.eye(3)
TWO = np.stack([P, P])
REFLECTION = np.diag([-1.0, 1, 1])
# Knots of a curve with three control points.
CLAMPED = [0, 0, 0, 1, 1, 1]
NAN, INF = np.nan, np.inf


def raises(match, call, /, *arguments, error=ss.ValidationError, **options):
    """A call fails with a message like this. Returns the error."""
    with pytest.raises(error, match=match) as caught:
        call(*arguments, **options)
        pytest.fail(f"nothing was raised where {match!r} was expected")
    return caught.value


def fit_error(match, t=None, points=P, space=S2, kind=ss.ValidationError, **options):
    """A fit fails with a message like this, and does nothing before."""
    calls = []
    with pytest.raises(kind, match=match) as caught:
        ss.CubicSpline(t, points, space, progress=lambda *call: calls.append(call), **options)
    assert type(caught.value) is kind
    assert not calls or kind is not ss.ValidationError


def fails(match, points, space, kind=ss.ValidationError):
    """A fit fails with such a message, whoever asks for it, and nothing warns."""
    calls = [lambda: ss.CubicSpline(None, points, space), lambda: ss.fit_many([(None, points)], space)]
    if kind is ss.ValidationError:
        zero = np.zeros_like(points, dtype=ss.space(space).dtype)
        calls.append(lambda: ss.evaluate(None, points, zero, space, 0.5))
    for call in calls:
        with warnings.catch_warnings(), pytest.raises(kind) as caught:
            warnings.simplefilter("error")
            call()
        message = str(caught.value).replace(" of curve 0", "")
        assert type(caught.value) is kind and re.search(match, message), message
        assert len(message) < 300


def changed(index, value, points=P):
    """Points of which some numbers are others."""
    points = np.array(points, float)
    points[index] = value
    return points


def points(name, n=4, batch=()):
    """Points near each other on the space of that name."""
    return points_on(ss.space(name), n, batch, step=0.4)


def spoiled(name, index, change):
    """Points of which one has been changed."""
    p = points(name)
    p[index] = change(p[index])
    return p
