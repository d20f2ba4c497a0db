"""The examples of ``docs/xarray.md`` run."""

import many_curves
import numpy as np
from pages import blocks, run

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
