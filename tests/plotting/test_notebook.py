"""The representation of a curve in a notebook."""

import base64
import re

import numpy as np
import pytest

import symspline as ss


@pytest.fixture
def spline():
    return ss.CubicSpline(None, np.eye(3), "s:2")


def test_a_small_picture_and_the_text(spline):
    shown = spline._repr_html_()
    assert shown.startswith("<pre>&lt;CubicSpline on Sphere(2): 3 points, natural&gt;</pre><img ")
    picture = base64.b64decode(re.search(r'base64,([^"]*)"', shown)[1])
    assert picture.startswith(b"\x89PNG") and len(picture) < 200_000


def test_the_text_alone_without_matplotlib(spline, monkeypatch):
    monkeypatch.setattr("symspline._base_curve.find_spec", lambda _: None)
    assert spline._repr_html_() == "<pre>&lt;CubicSpline on Sphere(2): 3 points, natural&gt;</pre>"


def test_the_text_alone_of_curves_that_failed():
    lost = ss.CubicSpline(None, [[1, 0, 0], [-1, 0, 0], [0, 1, 0]], "s:2", on_failure="ignore")
    assert "<img" not in lost._repr_html_()
