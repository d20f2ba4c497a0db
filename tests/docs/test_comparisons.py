"""The comparisons of ``docs/comparisons`` run and agree with theory."""

import sys

import angles
import ends
import motions
import numpy as np
import order
import page
import pytest
import reconstruct
import recordings
import riemannian_cubics as cubics

SCRIPTS = ("order", "cubics", "reconstruct", "ends")


@pytest.fixture(params=["S²", "SO(3)"])
def case(request):
    if request.param == "S²":
        return cubics.SPHERE
    pytest.importorskip("interpolatepy", minversion="3.3")
    return cubics.ROTATIONS


# ---- order ----


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


# ---- Riemannian cubics ----


def test_spline_is_close_to_the_cubic_and_bends_more(case):
    rows = [cubics.compare(case, n) for n in (6, 12)]
    assert all(0 < row.excess < 1e-3 and row.distance < row.error for row in rows)
    falls = np.log(rows[0].distance / rows[1].distance) / np.log(11 / 5)
    assert 3 < falls < 5
    assert cubics.text(rows).count("\n") == 3


def test_cubic_is_critical_and_the_spline_is_not(case):
    found = cubics.variations(case, fields=3)
    cubic, spline = ([abs(one.slope) for one in curve] for curve in found)
    assert max(cubic) < 1e-4 and max(spline) > 1e-2
    assert min(one.rise for one in found[0]) > 1e-5
    assert "3 random variations" in cubics.words(*found)


# ---- recordings ----


def tumbling(n=201):
    """A recording without errors, its rates half a sample earlier."""
    t = motions.DURATION * np.arange(n) / (n - 1)
    still = recordings.Recording(t, motions.tumble(t), None, np.zeros((n, 3)))
    x, step = still.rate_times, 1e-5
    r = motions.tumble(x)
    slope = (motions.tumble(x + step) - motions.tumble(x - step)) / (2 * step)
    return still._replace(rates=angles.body_rate(r, slope))


def test_smooth_motion_is_reconstructed_by_all_methods():
    recording = tumbling()
    coarse, fine = (reconstruct.errors(recording, k) for k in (10, 5))
    assert list(coarse) == list(fine) and len(coarse) == 5
    for method, (rms, worst, rates) in fine.items():
        assert rms < worst < 1 and rates < 20
        assert rms < coarse[method][0] / 3 and rates < coarse[method][2] / 1.5
    for ends_of in ("not-a-knot", "end velocities measured"):
        rms, _, rates = fine[f"symspline, {ends_of}"]
        assert rms < 0.002 and rates < 0.1
    assert ends.errors(recording, 4)[1]["symspline, not-a-knot"] < 0.01


def test_poses_are_reconstructed_by_all_methods():
    t = np.linspace(0, 1.5, 201)
    recording = recordings.Recording(t, motions.tumble(t), motions.track(t), None)
    found = reconstruct.errors(recording, 10)
    assert len(found) == 6
    apart, screw = (found[f"symspline, {name}, not-a-knot"] for name in ("SO(3) × R³", "SE(3)"))
    # The rotations of a rigid motion do not feel its translations.
    assert apart[:2] == pytest.approx(screw[:2], rel=1e-6)
    assert apart[2] == pytest.approx(found["SciPy, RotationSpline and CubicSpline"][2], rel=1e-6)
    assert all(numbers[2] < numbers[3] < 20 for numbers in found.values())


def test_recordings_of_others_can_be_read(tmp_path):
    lines = reconstruct.text(recordings.read(reconstruct.POSES), (40,)).count("\n")
    file = tmp_path / "own.txt"
    file.write_text("# t x y z qx qy qz qw\n0 0 0 0 0 0 0 1\n1 1 0 0 0 0 1 1\n", encoding="utf-8")
    own = recordings.read(file)
    assert lines == 7 and own.rotations[1, 1, 0] == pytest.approx(1)
    file.write_text("0 0 0\n", encoding="utf-8")
    with pytest.raises(ValueError, match="8 numbers, not 3"):
        recordings.read(file)


# ---- the page ----


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
