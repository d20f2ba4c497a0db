"""The number of Python function calls per fit, which determines the time of fits of few points."""

import gc
import sys

import numpy as np
import pytest

import symspline as ss

# A fit takes 35.
MOST = 35


def calls(work):
    work()
    # A collection during the count would add the calls of finalizers.
    gc.collect()
    gc.disable()
    count = 0

    def profile(frame, event, arg):
        nonlocal count
        count += event == "call"

    sys.setprofile(profile)
    try:
        work()
    finally:
        sys.setprofile(None)
        gc.enable()
    return count


@pytest.mark.parametrize("name", ["sphere:3", "r:3", "so:3"])
def test_a_fit_takes_few_calls_of_python_functions(name):
    space, rng = ss.space(name), np.random.default_rng(0)
    first = space.random_point(rng)
    points = space.exp(first, 0.3 * space.random_tangent(rng, np.broadcast_to(first, (10, *first.shape))))
    t = np.arange(10.0)
    assert calls(lambda: ss.CubicSpline(t, points, space)) <= MOST
