"""Pictures of several curves and data."""

import numpy as np
import pytest
from drawn import lines_of, rate_axes, rendered, spline_on, texts_of
from refused import raises

import symspline as ss

T = np.array([0.0, 1.1, 1.9, 3.2, 4.0, 5.3])


def pair(name):
    spline = spline_on(name, t=T)
    return spline, ss.PiecewiseGeodesic(T, spline.points, name)


@pytest.mark.parametrize("name", ["r:1", "sphere:2", "se:3", "spd:2", "gr:2,5"])
def test_curves_and_data_in_one_picture(name):
    spline, polygon = pair(name)
    figure = rendered(ss.plot([spline, polygon, (T, spline.points)], labels=["spline", "polygon", "measured"]))
    assert {"spline", "polygon", "measured", "2 curves, 6 data"} <= set(texts_of(figure))
    for axes in rate_axes(figure)[0]:
        assert len(lines_of(axes)) == 2


def test_what_cannot_be_compared_raises():
    spline, polygon = pair("r:2")
    raises("curves must contain at least one curve", ss.plot, [(T, np.zeros((6, 2)))])
    raises(r"curves\[1\] is on", ss.plot, [spline, spline_on("r:3")])
    raises(r"curves\[0\] is a batch of 3 curves", ss.plot, [spline_on("r:2", (3, 5))])
    raises("labels must be a list of 2 strings", ss.plot, [spline, polygon], labels=["one"])
    raises("colors must be a list of 2 colours", ss.plot, [spline, polygon], colors="red")
    raises(r"colors\[1\] must be a colour", ss.plot, [spline, polygon], colors=["red", "nothing"])
    raises(r"curves\[1\]: points have shape \(6, 3\)", ss.plot, [spline, (T, np.zeros((6, 3)))])
    raises(r"curves\[1\]: all points are missing", ss.plot, [spline, (T, np.full((6, 2), np.nan))])
    dates = np.datetime64("2024-01-01") + np.arange(6)
    raises(r"curves\[1\] has dates as times", ss.plot, [spline, spline_on("r:2", t=dates)])
    for wrong in (3, "sphere:2", [spline, 3]):
        raises(r"^curves", ss.plot, wrong, error=TypeError)
