"""Angles of tori in degrees: an option of `symspline fit`, and an error without it."""

import numpy as np
import pytest
from tabular import numbers, table, write

import symspline as ss

DIRECTIONS = np.array([350, 10.5, 30, 20, 355, 340.25, 3, 0])
T = 5 + np.arange(8) ** 1.3


def rows(angles, head="t,dir"):
    return f"{head}\n" + "".join(f"{t!r},{a!r}\n" for t, a in zip(T.tolist(), angles.tolist(), strict=True))


def test_angles_in_degrees(run):
    write("a.csv", rows(DIRECTIONS))
    run("fit a.csv --space torus:1 --columns dir --degrees -o a.npz")
    curve = ss.load("a.npz")
    expected = ss.CubicSpline(T, np.unwrap(DIRECTIONS, period=360)[:, None], "r:1")
    x = np.linspace(T[0], T[-1], 50)
    off = np.degrees(curve(x)[:, 0]) - expected(x)[:, 0]
    assert np.abs((off + 180) % 360 - 180).max() < 1e-9
    write("x.csv", "t\n" + "\n".join(map(repr, x.tolist())) + "\n")
    run("sample a.npz --at x.csv --nu 0,1 --digits 17 -o b.csv")
    found = numbers(table("b.csv"), "dir", "dir_d1")
    off = found[:, 0] - expected(x)[:, 0]
    assert np.abs((off + 180) % 360 - 180).max() < 1e-9
    np.testing.assert_allclose(found[:, 1], expected(x, nu=1)[:, 0], atol=1e-9)


@pytest.mark.parametrize(
    "angles, head, says",
    [
        (DIRECTIONS, "t,dir", "angles up to 355 may be in degrees"),
        (DIRECTIONS + 1 / 3, "t,dir", "may be in degrees"),
        # A wheel with many turns.
        (np.linspace(0, 13, 8) + 1 / 3, "t,dir", "angles up to 13.3333 may be in degrees"),
        (np.linspace(0, 3, 8) + 1 / 3, "t,heading_deg", "the name 'heading_deg' means degrees"),
        (np.linspace(0, 3, 8) + 1 / 3, "t,heading (deg)", "means degrees"),
    ],
)
def test_angles_of_an_unknown_unit_are_refused(run, fails, angles, head, says):
    write("a.csv", rows(angles, head))
    problem = fails("fit a.csv --space torus:1 -o a.npz")
    assert says in problem and problem.endswith("; give --degrees or --radians")
    run("fit a.csv --space torus:1 --radians -o a.npz", notes=None)
    assert ss.space("torus:1").distance(ss.load("a.npz").points, angles[:, None]).max() < 1e-9
    assert "not allowed with" in fails("fit a.csv --space torus:1 --radians --degrees -o b.npz")


@pytest.mark.parametrize(
    "angles, head",
    [
        (np.radians(DIRECTIONS), "t,dir"),
        (np.linspace(0, 12, 8), "t,dir"),
        (np.linspace(-3, 3, 8) + 1 / 3, "t,degree_of_freedom"),
    ],
)
def test_angles_in_radians_need_no_option(run, angles, head):
    write("a.csv", rows(angles, head))
    run("fit a.csv --space torus:1 -o a.npz")


def test_the_option_is_for_tori(fails):
    write("a.csv", rows(DIRECTIONS))
    assert "is for torus:n" in fails("fit a.csv --space r:1 --degrees -o a.npz")
