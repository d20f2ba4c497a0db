"""The tables of ``docs/smoothing_accuracy.md`` agree with theory."""

import numpy as np
import pytest
import smoothing
import smoothing_adaptive
import smoothing_others as others
from pages import cells

import symspline as ss

# Tables have geodesics in them.
pytestmark = pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")


def test_tables():
    ((name, *rest),) = cells(smoothing.flat_table((20,)))[:1]
    assert name == "20, even"
    assert all(float(number) < 1e-10 for cell in rest for number in cell.split(","))
    rows = cells(smoothing.iteration_table(("S²",), (0.1,), 1))
    assert [row[0] for row in rows] == ["S²", "S², two turns"]
    assert all(int(cell) < 10 for cell in rows[0][2:6]) and float(rows[0][6]) < 1e-3
    assert all(int(cell) < 15 for cell in rows[1][2:6]) and float(rows[1][6]) < 2e-3
    (row,) = cells(smoothing.choice_table(("S²",), (0.1,), 2))
    assert row[:2] == ["S²", "0.1"] and len(row) == 11
    # No criterion is better than the best λ.
    assert all(1 <= float(cell) < 1.3 for cell in row[3:7])
    (row,) = cells(smoothing.time_table((200,), 1))
    assert row[0] == "200" and row[-1] == "200" and all(row)


def test_other_programs_are_compared_on_the_same_data():
    space = ss.Sphere(2)
    t, noisy, truth = others.path(space, 50, 0.1)
    found = others.row("none", space, t, noisy, truth, lambda: noisy)
    assert found.error == pytest.approx(0.1 * np.sqrt(2), rel=0.2) and found.ours < 0.55 * found.error
    assert others.HEAD.splitlines()[0].count("|") == str(found).count("|") == 7
    straight, _, line = others.path(space, 50, 0.1, straight=True)
    assert np.ptp(space.distance(line[1:], line[:-1])) < 1e-14 and len(straight) == 50


def test_tables_of_adaptive_smoothing(monkeypatch):
    monkeypatch.setattr(smoothing_adaptive, "SEEDS", 2)
    burst, sine = cells(smoothing_adaptive.lam_table((200,), ("burst between rests", "one sine")))
    one, adaptive = (float(burst[1].replace("→", ",").split(",")[i]) for i in (0, 2))
    assert adaptive < 0.7 * one and burst[2] == "2"
    assert sine[2:4] == ["0", "1.00"]
    (row,) = cells(smoothing_adaptive.noise_table(("one sine",)))
    assert row[0] == "one sine" and len(row) == 7
    burst, slow = cells(smoothing_adaptive.space_table(("S²",), 500))
    assert float(burst[1]) < 0.7 and burst[2] == "2" and slow[1:3] == ["1.00", "0"]
    assert len(cells(smoothing_adaptive.time_table((100,), 1))) == 2
