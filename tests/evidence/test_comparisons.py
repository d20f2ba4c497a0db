"""The comparisons of ``docs/comparisons`` run and agree with theory."""

import sys

import convection
import numpy as np
import order
import page
import pytest
import reconstruct
import recordings
import reduced_bases
import riemannian_cubics as cubics

SCRIPTS = ("order", "cubics", "reconstruct", "ends", "bases")


@pytest.fixture(params=["S²", "SO(3)"])
def case(request):
    return cubics.SPHERE if request.param == "S²" else cubics.ROTATIONS


def test_errors_fall_with_the_orders_of_the_end_conditions():
    sizes = (41, 81)
    everywhere, middle = order.measure(sizes)
    for errors, expected in (
        (everywhere[order.NOT_A_KNOT], 4),
        (everywhere[order.NATURAL], 2),
        (everywhere[order.SCIPY], 2),
        (middle[order.SCIPY], 4),
    ):
        assert order.order(sizes, errors) == pytest.approx(expected, abs=0.3)
    assert order.text(sizes, everywhere, middle).count("\n") == 4


def test_spline_is_close_to_the_cubic_and_bends_more(case):
    rows = [cubics.compare(case, n, case is cubics.SPHERE) for n in (6, 12)]
    assert all(0 < row.excess < 1e-3 and row.distance < row.error for row in rows)
    falls = np.log(rows[0].distance / rows[1].distance) / np.log(11 / 5)
    assert 3 < falls < 5
    assert cubics.text(rows, case.solver).count("\n") == 3
    # SciPy's solver of boundary value problems finds the same curve.
    assert all(row.energy_of_other in (None, pytest.approx(row.energy, rel=1e-6)) for row in rows)


def test_cubics_satisfy_the_differential_equation_and_cannot_be_improved(case):
    moved, moved_splines = cubics.variations(case, fields=5)
    assert min(one.rise for one in moved) > 0
    assert max(abs(one.slope) for one in moved) < 1e-4 * max(abs(one.slope) for one in moved_splines)
    assert case is cubics.ROTATIONS or cubics.residual() < 1e-4


def test_times_are_listed_for_both_spaces():
    assert cubics.times((6,)).count("|") == 3 * 8


def test_bicubic_bases_are_equally_good_near_a_reference_and_the_spline_is_better_elsewhere():
    unseen = convection.Unseen(convection.drift(40), 6)
    found = reduced_bases.errors(unseen, (7, 7))
    near = [
        found[name][0]
        for name in (reduced_bases.ALIGNED, reduced_bases.BICUBIC, reduced_bases.LOCAL, reduced_bases.GRID)
    ]
    assert max(near) < 1.5 * min(near)
    assert found[reduced_bases.ENTRIES][0] > 3 * max(near) and found[reduced_bases.BILINEAR][0] > 1.2 * max(near)
    assert found[reduced_bases.GRID][1] < 2 * np.sqrt(np.mean(unseen.model_errors(unseen.own) ** 2))
    wind = convection.Unseen(convection.wind(7), 6)
    text = reduced_bases.text("Wind", wind, [(4, 9)])
    assert text.count("| 4 × 9 |") == 2
    turned = reduced_bases.errors(wind, (4, 13))
    assert all(
        turned[reduced_bases.GRID][0] < 0.7 * own[0] for name, own in turned.items() if name != reduced_bases.GRID
    )


def test_recordings_of_others_can_be_read(tmp_path):
    lines = reconstruct.text(recordings.read(reconstruct.POSES), (40,)).count("\n")
    file = tmp_path / "own.txt"
    file.write_text("# t x y z qx qy qz qw\n0 0 0 0 0 0 0 1\n1 1 0 0 0 0 1 1\n", encoding="utf-8")
    own = recordings.read(file)
    assert lines == 7 and own.rotations[1, 1, 0] == pytest.approx(1)
    file.write_text("0 0 0\n", encoding="utf-8")
    with pytest.raises(ValueError, match="8 numbers, not 3"):
        recordings.read(file)


def test_tables_find_their_place(tmp_path):
    copy = tmp_path / "page.md"
    copy.write_text(page.PAGE.read_text(encoding="utf-8"), encoding="utf-8")
    for part in SCRIPTS:
        page.insert(part, f"before: {part}", copy)
        page.insert(part, f"now {part}", copy)
    text = copy.read_text(encoding="utf-8")
    assert all(f"\n\nnow {part}\n\n<!-- {part}: end -->" in text for part in SCRIPTS)
    assert "before:" not in text and "Riemannian cubics?" in text
    with pytest.raises(ValueError, match="once each"):
        page.insert("nothing", "", copy)


@pytest.mark.parametrize("arguments", [("--every=40",), ("--every=40", str(reconstruct.POSES))])
def test_command_line(arguments, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["reconstruct.py", *arguments])
    reconstruct.main()
    printed = capsys.readouterr().out
    assert ("data_xsens" in printed) == (len(arguments) == 1)
    assert printed.count("| 40 |") == (11 if len(arguments) == 1 else 6)
