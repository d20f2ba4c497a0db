"""The number of Python function calls per fit and evaluation, which determines the time for few points."""

import gc
import sys
import weakref

import numpy as np
import pytest
from curves import points_on

import symspline as ss

# A fit takes 20 in a space, 27 in a product of two; an evaluation takes 11 in both, and a length 6.
FIT, FIT_IN_PRODUCT, EVALUATION, LENGTH = 20, 30, 15, 10


def calls(work):
    """Count the calls of functions of the package."""
    work()
    # A collection during the count would add the calls of finalizers.
    gc.collect()
    gc.disable()
    count, package = 0, ss.__path__[0]

    def profile(frame, event, arg):
        nonlocal count
        count += event == "call" and frame.f_code.co_filename.startswith(package)

    sys.setprofile(profile)
    try:
        work()
    finally:
        sys.setprofile(None)
        gc.enable()
    return count


@pytest.mark.parametrize("name, most", [("sphere:2", FIT), ("r:3", FIT), ("so:3", FIT), ("so:3 x r:3", FIT_IN_PRODUCT)])
def test_fits_and_evaluations_take_few_calls_of_python_functions(name, most):
    space = ss.space(name)
    points, t = points_on(space, 20), np.arange(20.0) + 3
    curve = ss.CubicSpline(t, points, space)
    x = np.linspace(3, 22, 50)
    assert calls(lambda: ss.CubicSpline(t, points, space)) <= most
    assert calls(lambda: curve(x)) <= EVALUATION
    assert calls(lambda: curve(x, 2)) <= EVALUATION
    assert calls(curve.length) <= LENGTH


@pytest.mark.parametrize("name", ["sphere:2", "so:3 x r:3"])
def test_arrays_of_a_curve_go_with_it(name):
    """Not when the garbage collector comes: large curves would fill the memory before."""
    space = ss.space(name)
    spline = ss.CubicSpline(None, points_on(space, 8), space)
    spline.vjp(1.5, spline(1.5))
    spline.length()
    arrays = weakref.ref(spline._solved())
    gc.collect()
    gc.disable()
    try:
        del spline
        assert arrays() is None
    finally:
        gc.enable()
