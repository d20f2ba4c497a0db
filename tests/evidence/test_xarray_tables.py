"""The tables of ``docs/xarray.md`` can be made."""

import re

import many_curves
from pages import cells

import symspline as ss


def test_simulated_curves_are_points():
    ss.Sphere(2).check_point(many_curves.tracks(50))
    ss.SpecialOrthogonal(3).check_point(many_curves.attitudes(50))
    lazy = many_curves.simulated(25, 10)
    assert lazy.chunks[0] == (10, 10, 5)
    assert (lazy[10:20].values == many_curves.tracks(10, 1)).all()


def test_rates_table(monkeypatch):
    monkeypatch.setattr(many_curves, "WORK", {"S², fit": many_curves.WORK["S², fit"]})
    rows = cells(many_curves.rates_table(200, 1, 50))
    assert [row[0] for row in rows[:-1]] == list(many_curves.WAYS)
    assert all(int(cell.replace(" ", "")) > 0 for row in rows[:-1] for cell in row[1:])


def test_from_store_to_store_in_little_memory():
    """23 MB of points become 46 MB of curves, in blocks of 1 MB of points."""
    rows = dict(cells(many_curves.store_table(40_000, 2_000)))
    assert rows["converged"] == "40 000" and rows["bit-identical to the run without dask"] == "yes"
    most, before = map(int, re.findall(r"(\d+) MiB", rows["peak memory of a worker"]))
    assert most - before < 40
