"""Columns of points on every space."""

import re
from itertools import cycle

import numpy as np
import pytest
from cases import SPACES
from compare import each, parts, same_curve
from curves import points_on
from tabular import TIMES, assert_same_columns, numbered, numbers, read_table, table, write, write_table

import symspline as ss
from symspline.cli import main

# A third of the spaces, and every format with a third of them.
ENDINGS = dict(zip(map(str, SPACES[::3]), cycle(["csv", "npz", "parquet"]), strict=False))


@pytest.mark.parametrize("name, ending", ENDINGS.items())
def test_tables_of_every_space(run, name, ending):
    space, p = ss.space(name), points_on(ss.space(name), step=0.4)
    write_table(f"a.{ending}", {"t": TIMES, **numbered(p)})
    run(f"fit a.{ending} --space '{name}' --bc-type not-a-knot -o fitted.npz")
    spline = ss.CubicSpline(TIMES, p, space, bc_type="not-a-knot")
    loaded = ss.load("fitted.npz")
    assert same_curve(loaded, spline)
    run("check fitted.npz")
    run(f"sample fitted.npz -n 11 --nu 0,1,2 -o b.{ending}")
    x = np.linspace(0, 5, 11)
    smooth = {"t": x, **numbered(spline(x)), **numbered(spline(x, 1), "_d1"), **numbered(spline(x, 2), "_d2")}
    assert_same_columns(read_table(f"b.{ending}"), smooth)
    # What was written can be read again.
    names = ",".join(key.removesuffix("_re") for key in numbered(p) if not key.endswith("_im"))
    run(f"fit b.{ending} --space '{name}' --columns {names} -o again.npz")
    assert same_curve(ss.load("again.npz"), ss.CubicSpline(x, spline(x), space))
    run("check again.npz")


@pytest.mark.parametrize("name", [str(space) for space in SPACES[1::6]])
def test_many_curves_of_every_space(run, name):
    space, p = ss.space(name), points_on(ss.space(name), step=0.4)
    columns = {"t": np.array([*"001122"], float), **numbered(p)}
    write_table("a.npz", {"id": np.array([*"ababab"]), **columns})
    run(f"fit a.npz --space '{name}' --curve id -o b.npz")
    first, second = each(lambda part: part[::2], p), each(lambda part: part[1::2], p)
    fitted = ss.fit_many([([0, 1, 2], first), ([0, 1, 2], second)], space)
    assert ss.load("b.npz") == dict(zip("ab", fitted, strict=True))
    run("sample b.npz --every 1 --nu 1 -o c.npz")
    rates = [numbered(spline([0, 1, 2], 1), "_d1") for spline in fitted]
    found = read_table("c.npz")
    assert found.pop("id").tolist() == [*"aaabbb"] and found.pop("t").tolist() == [0, 1, 2] * 2
    assert_same_columns(found, {key: np.concatenate([rate[key] for rate in rates]) for key in rates[0]})


def test_names_of_curves_that_were_made_in_python(run):
    for name, names in [
        ("s:2", ["x0", "x1", "x2"]),
        ("cp:1", ["x0_re", "x0_im", "x1_re", "x1_im"]),
        ("gr:1,2", ["m11", "m21"]),
        ("u:1", ["m11_re", "m11_im"]),
        ("r:1 x so:2 x s:1", ["x0", "m11", "m12", "m21", "m22", "x1", "x2"]),
        ("spd:1 x u:1 x r:1", ["m1_11", "m2_11_re", "m2_11_im", "x0"]),
    ]:
        ss.CubicSpline(None, points_on(ss.space(name), step=0.4), name).save("a.npz")
        run("sample a.npz -n 2 -o b.csv")
        assert list(table("b.csv")) == ["time", *names]
        run("sample a.npz -n 2 --nu 2 -o b.csv")
        assert list(table("b.csv")) == ["time", *(re.sub("(_re|_im|)$", r"_d2\1", key, count=1) for key in names)]
    ss.CubicSpline(None, points_on(ss.space("so:11"), n=3, step=0.4), "so:11").save("a.npz")
    run("sample a.npz -n 2 -o b.csv")
    names = list(table("b.csv"))
    assert (names[1], names[2], names[11], names[121]) == ("m1_1", "m1_2", "m1_11", "m11_11")


def test_columns_of_complex_numbers(run):
    """Halves may stand anywhere; a column of its own is a complex number that is real."""
    up, down = np.array([1, 0.8, 0.6]), np.array([0, 0.6j, 0.64 + 0.48j])
    spline = ss.CubicSpline(None, np.stack([up, down], axis=1), "cp:1")
    columns = {"down_im": down.imag, "note": 0 * up, "up": up, "down_re": down.real}
    write_table("a.csv", columns)
    for names in ("up,down", "up,down_re,down_im", "up,down_im,down_re", "down_im,up,down_re"):
        run(f"fit a.csv --space cp:1 --columns {names} -o a.npz")
        loaded = ss.load("a.npz")
        swapped = np.flip(spline.points, axis=1)
        np.testing.assert_array_equal(loaded.points, swapped if names[:7] == "down_im" else spline.points)
    run("fit a.csv --space cp:1 --columns up,down -o a.npz")
    run("sample a.npz --every 1 --digits 17 -o b.csv")
    assert list(table("b.csv")) == ["time", "up_re", "up_im", "down_re", "down_im"]
    written = numbers(table("b.csv"), "up_re", "up_im", "down_re", "down_im").view(complex)
    np.testing.assert_array_equal(written, spline([0, 1, 2]))
    # In a real space they are two numbers, if both are named.
    run("fit a.csv --space r:2 --columns down_re,down_im -o a.npz")
    np.testing.assert_array_equal(ss.load("a.npz").points, np.stack([down.real, down.imag], 1))


def test_complex_numbers_of_pandas(run, fails):
    write("a.csv", "t,up,down\n0,(1+0j),0j\n1,(0.6-0j),0.8j\n2,(-6e-01+0j),(-0-0.8j)\n")
    run("fit a.csv --space cp:1 --columns up,down -o a.npz")
    run("fit a.csv --space cp:1 -o b.npz")
    states = np.array([[1, 0], [0.6, 0.8j], [-0.6, -0.8j]])
    assert ss.load("a.npz") == ss.load("b.npz") == ss.CubicSpline([0, 1, 2], states, "cp:1")
    write("a.csv", "t,up,down\n0,(1+0j),0j\n1,,0.8j\n2,1,0\n")
    assert "line 3: column 'up_re' is empty or NaN" in fails("fit a.csv --space cp:1 -o c.npz")
    write("a.csv", "t,up,down\n0,(1+0j),0j\n1,a,0.8j\n")
    assert "line 2: column 'up' holds '(1+0j)', which is not a number" in fails(
        "fit a.csv --space cp:1 --columns up,down -o c.npz"
    )


HALVES = "t,a_re,a_im,b_re,b_im\n0,1,0,0,0\n1,0.6,0,0,0.8\n"


def test_a_column_may_stand_on_both_sides_of_a_symmetric_matrix(run, fails):
    write("a.csv", "t,a,b,c\n0,1,0.1,2\n1,2,0.3,3\n3,2,0.1,1\n")
    problem = fails("fit a.csv --space spd:2 -o a.npz")
    assert problem.endswith("; name both sides of the matrix, such as --columns a,b,b,c for [[a, b], [b, c]]")
    run("fit a.csv --space spd:2 --columns a,b,b,c -o a.npz")
    spline = ss.load("a.npz")
    np.testing.assert_array_equal(spline.points[1], [[2, 0.3], [0.3, 3]])
    run("sample a.npz -n 4 --nu 0,1 -o b.csv")
    assert list(table("b.csv")) == ["t", "a", "b", "c", "a_d1", "b_d1", "c_d1"]
    np.testing.assert_allclose(numbers(table("b.csv"), "b")[1], spline(1.0)[0, 1:], rtol=1e-14)


def test_bad_columns_of_complex_numbers_and_matrices(fails):
    real, empty = "a complex number where a real one belongs: a point of", HALVES.replace("0,1,0,0,0", "0,1,0,0,")
    extra = HALVES.replace("t,a", "t,x,a").replace("\n0,", "\n0,0,").replace("\n1,", "\n1,0,")
    for text, options, problem in [
        (HALVES, "sphere:1", f"a.csv: a_re and a_im are {real} sphere:1 has 2 numbers; name its columns one by one"),
        (HALVES, "r:2 --columns a", "a point of euclidean:2 has 2 numbers; name its columns one by one with"),
        (HALVES, "'r:1 x cp:1' --columns a,b_re,b_im,t --time t", "column 't' of a.csv cannot have two meanings"),
        (extra, "'cp:1 x r:1'", f"b_re and b_im are {real} cp:1 x euclidean:1 has 3 numbers (cp:1: 2 complex"),
        (HALVES, "su:2", "a point of su:2 has 4 complex numbers, A_re and A_im each, a 2 x 2 matrix row by row, and"),
        (HALVES, "se:2 --columns a_re,b_re", "se:2 has 9 numbers, a 3 x 3 matrix row by row, and there are 2 col"),
        (HALVES, "cp:1 --columns a,b_re", "'b_re' is half of a complex number, and there is no 'b_im' in --col"),
        (HALVES, "cp:1 --columns a,a_re", "column 'a_re' of a.csv cannot have two meanings"),
        (HALVES, "cp:1 --columns a,c", "a.csv has no column 'c'; there are t, a_re, a_im, b_re, b_im"),
        (HALVES.replace("b_im", "c"), "cp:1 --columns a,b", "a column 'b_re', but no 'b_im'; a complex number"),
        (HALVES.replace("b_re", "c"), "cp:2", "'b_im' is half of a complex number, and there is no 'b_re' in"),
        (empty, "cp:1", "a.csv, line 2: column 'b_im' is empty"),
        (HALVES.replace("0.8", "east"), "cp:1 --time t --columns a,b", "line 3: column 'b_im' holds 'east'"),
        (
            HALVES.replace(",0,0,0\n", ",0,0,x\n"),
            "cp:1",
            "'b_re' is half of a complex number, and there is no 'b_im' with",
        ),
        (empty, "cp:1 --columns a,b", "a.csv, line 2: column 'b_im' is empty"),
        (HALVES + "2,1,0,0,\n", "cp:1", "a.csv, line 4: column 'b_im' is empty"),
        (HALVES + "2,1,0,0,0.2\n", "cp:1", "a.csv: the point in line 4 is off the space by 1.980e-2"),
    ]:
        write("a.csv", text)
        assert problem in fails(f"fit a.csv --space {options} -o a.npz")


def test_bad_points_in_matrix_spaces(fails):
    """The fourth of equal points is another one."""
    for name, change, problem in [
        ("so:3", lambda p: 1.01 * p, "the point in line 5 is off the space by 1.741e-2: its columns are not"),
        ("so:3", lambda p: -p, "the point in line 5 is off the space: its determinant is -1"),
        ("r:1 x o:3", lambda p: -p, "the point in line 4 and the point in line 5 of curve 'a' have opposite"),
        ("su:2", lambda p: 1j * p, "its determinant is not 1 but has the phase 3.142e0 (u:2 takes it)"),
        ("spd:2", lambda p: -p, "the point in line 5 is off the space: it is not positive definite"),
        ("hpd:2", lambda p: p + 1j * p[0, 0] * np.eye(2), "line 5 is off the space by"),
        ("r:2 x gr:2,4", lambda p: 2 * p, "the part in gr:2,4 of the point in line 5 is off the space by"),
        ("so:3", lambda p: p @ np.diag([1, -1, -1]), "line 4 and the point in line 5 of curve 'a' lie at or past"),
    ]:
        space = ss.space(name)
        points = points_on(space, 2, step=0.4)
        rows = each(lambda part: np.concatenate([part[[0, 0, 0]], part[:1]]), points)
        parts(rows)[-1][3] = change(parts(rows)[-1][3])
        columns = {"t": np.arange(4), "id": np.array([*"aaaa"]), **numbered(rows)}
        write_table("a.csv", columns)
        found = fails(f"fit a.csv --space '{name}' --curve id -o b.npz")
        assert found.startswith("a.csv: ") and problem in found
        write_table("a.npz", columns)
        for line, row in (("line 4", "row 2 (counted from 0)"), ("line 5", "row 3 (counted from 0)")):
            problem = problem.replace(line, row)
        assert problem in fails(f"fit a.npz --space '{name}' --curve id -o b.npz")


@pytest.mark.filterwarnings("default:neighbours of opposite sign")
def test_quaternions_of_opposite_sign_are_noted(capsys):
    write("q.csv", "t,w,x,y,z\n0,1,0,0,0\n1,-0.8,-0.6,0,0\n2,0.6,0.8,0,0\n")
    write("named.csv", "name,w,x,y,z\na,1,0,0,0\na,.8,.6,0,0\nb,1,0,0,0\nb,-.8,-.6,0,0\n")
    for line, where, of in (
        ("fit q.csv --space sphere:3 -o q.npz", "q.csv: neighbours of opposite sign on sphere:3: ", ""),
        ("fit named.csv --space sphere:3 --curve name -o n.npz", "named.csv: ", " of curve 'b'"),
    ):
        assert main(line.split()) == 0
        note = capsys.readouterr().err
        assert note.startswith(f"symspline: {where}") and note.count("\n") == 2, note
        lines = (4, 5) if of else (2, 3)
        assert f"the point in line {lines[0]} and the point in line {lines[1]}{of} have inner product -0.8" in note
        assert "For rotations give --space so:3, or rp:3, where signs do not count\n" in note
        assert "UserWarning" not in note and "symspline.rotations" not in note


def test_inaccurate_points_are_projected_on_request(run, fails):
    write("a.csv", "t,x,y,z\n0,1,0,0\n1,0.7,0.7,0\n2,0,1,0.01\n")
    problem = fails("fit a.csv --space s:2 -o a.npz")
    advice = problem.rpartition("; ")[2]
    assert "line 3 is off the space by 1.005e-2" in problem and advice.endswith("points that are only inaccurate")
    run(f"fit a.csv --space s:2 {' '.join(advice.split()[:2])} -o a.npz")
    points = np.array([[1, 0, 0], [0.7, 0.7, 0], [0, 1, 0.01]])
    np.testing.assert_allclose(ss.load("a.npz").points, points / np.linalg.norm(points, axis=1, keepdims=True))
    write("b.csv", "t,x,y,z\n0,1,0,0\n1,70,70,0\n")
    assert "--atol" not in fails("fit b.csv --space s:2 -o b.npz")
    assert "give a number between 0 and 1" in fails("fit a.csv --space s:2 --atol 2 -o b.npz")
