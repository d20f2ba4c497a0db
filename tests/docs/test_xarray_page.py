"""The example and the tables of ``docs/xarray.md`` can be made."""

import re

import many_curves
import numpy as np
from pages import blocks, cells, run

import symspline as ss


def test_the_example_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    first, *noisy = blocks(many_curves.PAGE)
    run(first, many_curves.PAGE, names)
    assert names["ds"].converged.all()
    # Geodesics at constant speed.
    speed = names["sx"].speed(names["ds"], names["hours"]).compute()
    total = ss.Sphere(2).distance(names["start"], names["end"]) / (23 * 6 * 3600)
    np.testing.assert_allclose(speed, np.broadcast_to(total[..., None], speed.shape), rtol=1e-6)
    for block in noisy:
        run(block, many_curves.PAGE, names)
    assert names["smooth"].converged.all() and names["ds"].sizes["time"] == 600
    # The attitudes turn around z, as fast as the rates.
    assert np.allclose(names["curve"].parameters["gyro bias"].value, [2e-6, 2e-6, 0], atol=1e-6)


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
