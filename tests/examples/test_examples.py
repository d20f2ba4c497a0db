"""The recipes run, and do what they say."""

import re
import runpy
from pathlib import Path

import lifting
import pytest

import symspline as ss

FOLDER = Path(__file__).parents[2] / "examples"
SAYS = {
    "qubit_control": r"missed by (\d\.\de-1[4-7]|0\.0e\+00), strongest field",
    "tensor_volume": r"280 voxels, mean diffusivity 8.\d\de-04 mm²/s, all positive: True",
    "pod_over_a_parameter": r"4 numbers in place of 80: off by 0.\d%",
    "morph": "100 frames of 12 landmarks",
}


@pytest.mark.parametrize("name", SAYS)
def test_recipe(name, tmp_path, monkeypatch, capsys):
    if not hasattr(ss.CubicSpline, "lift"):
        monkeypatch.setattr(ss.CubicSpline, "lift", lifting.lift, raising=False)
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(FOLDER / f"{name}.py"))
    said = capsys.readouterr().out
    assert re.match(SAYS[name], said), said
