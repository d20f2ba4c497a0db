"""The tables and figures of ``docs/solvers_tables.md`` can be made and agree with theory."""

import numpy as np
import pytest
import solvers
import solvers_figures as figures
from pages import cells

import symspline as ss


def test_zigzag_table():
    (near, far) = cells(solvers.zigzag_table((0.2, 2.5)))
    assert near[0] == "0.2" and near[-1] == "quasi-newton" and near[2] == near[4]
    assert far[2] == "none in 300" and far[-1] == "fixed-point"


def test_walk_table_counts_walks(monkeypatch):
    monkeypatch.setattr(solvers, "SEEDS", range(3))
    solvers.walks.cache_clear()
    (row,) = cells(solvers.walk_table(solvers.S2, (0.3,)))
    assert [cell.partition(",")[0] for cell in row[1:5]] == ["3"] * 4
    assert row[5] == "3 + 0 + 0 + 0"
    (row,) = cells(solvers.walk_table(solvers.S2, (0.3,), solvers.unequal_knots()))
    assert row[5] == "3 + 0 + 0 + 0"
    assert all(len(row) == 6 for row in cells(solvers.time_table(1)))
    solvers.walks.cache_clear()


def test_the_region_of_38_ends_where_it_must():
    kd, low, high = figures.roots(np.linspace(0.2, 0.3, 1001), np.linspace(0.01, 1.0, 20001))
    assert kd[-1] == pytest.approx(0.2610895, abs=1e-4)
    assert low[-1] == pytest.approx(0.4420886, abs=0.01) == high[-1]
    v = ss.CubicSpline(None, solvers.walk(solvers.S2, 0.2, 0), solvers.S2).report.invariant_radius
    assert low[0] == pytest.approx(v, abs=1e-4)


def test_figures_are_drawn(tmp_path):
    points = solvers.measured(solvers.S2, 0.26, 5)
    assert points.converged.all() and (points.rate < 0.52).all()
    far = solvers.measured(solvers.S2, 3.1, 5)
    figures.region({"near": points, "far": far}).savefig(tmp_path / "region.png")
    p = solvers.walk(solvers.S2, 0.3, 1)
    lines = {method: solvers.residuals(p, solvers.S2, method) for method in solvers.METHODS[:3]}
    assert len(lines["newton"]) < len(lines["quasi-newton"]) < len(lines["fixed-point"])
    figures.sweeps(dict.fromkeys("abcd", lines)).savefig(tmp_path / "sweeps.png")


def test_the_page_has_a_place_for_every_table_and_figure():
    text = solvers.PAGE.read_text(encoding="utf-8")
    for part in ("zigzags", "walks", "energy", "spaces", "uneven", "knots", "time"):
        assert text.count(f"<!-- {part}: begin -->") == text.count(f"<!-- {part}: end -->") == 1
    for name in ("solvers_region.png", "solvers_residuals.png"):
        assert name in text and (solvers.HERE / name).stat().st_size < 200_000
