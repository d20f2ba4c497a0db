"""The tables of ``docs/manifolds.md`` can be made and agree with theory."""

import manifolds
import numpy as np
import pytest
from pages import cells

import symspline as ss


def test_condition_table():
    """(13) leaves a jump that falls in proportion to the step; D log, and (13) on the sphere, leave none."""
    rows = cells(manifolds.condition_table((0.8, 0.4)))
    assert [row[0] for row in rows[::2]] == ["St(2, 5), D log", "St(2, 5), (13)", "S², D log", "S², (13)"]
    relative = [float(row[4]) for row in rows]
    assert max(relative[:2] + relative[4:]) < 1e-9
    assert relative[2] > 0.1 and 1.3 < relative[2] / relative[3] < 3


def test_sphere_table():
    ((step, *off, core, ours),) = cells(manifolds.sphere_table((0.4,)))
    assert step == "0.4" and float(off[0]) < 1e-12 and float(off[2]) < 1e-9
    assert int(core) < 20 and int(ours) < 20


def test_order_and_data():
    assert manifolds.order(ss.Stiefel(2, 4)) == pytest.approx(4, abs=0.6)
    torus = manifolds.torus()
    p = manifolds.walk(torus, 0.3, 4)
    assert torus.distance(p[:-1], p[1:]) == pytest.approx(np.full(3, 0.3), abs=1e-10)
    oblique = manifolds._oblique(0.5)
    assert np.linalg.norm(oblique, axis=1) == pytest.approx(np.ones((manifolds.POINTS, 3)))
