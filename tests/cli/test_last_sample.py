"""`sample --every` reaches the end of a curve that its step divides, whatever rounding does to the quotient."""

import numpy as np
import pytest

import symspline as ss
from symspline.cli import main


@pytest.mark.parametrize(("end", "step"), [(0.3, "0.1"), (0.7, "0.1"), (1.1, "0.1"), (2.1, "0.7")])
def test_the_last_sample_is_at_the_end(end, step, tmp_path):
    curve, table = tmp_path / "curve.npz", tmp_path / "samples.csv"
    ss.CubicSpline([0.0, 0.1, end], [[0.0], [1.0], [2.0]], "r:1").save(curve)
    assert main(["sample", str(curve), "--every", step, "-o", str(table)]) == 0
    times = np.loadtxt(table, delimiter=",", skiprows=1)[:, 0]
    assert times[-1] == end and len(times) == round(end / float(step)) + 1
