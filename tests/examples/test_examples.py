"""The recipes run, draw their pictures, and do what they say."""

import re
import runpy
from pathlib import Path

import pytest
from matplotlib.image import imread

FOLDER = Path(__file__).parents[2] / "examples"
SAYS = {
    "attitude": r"at 6.5 minutes: \[",
    "imu_from_a_recording": "",
    "qubit_control": r"missed by (\d\.\de-1[4-7]|0\.0e\+00), strongest field",
    "tensor_volume": r"280 voxels, mean diffusivity 8.\d\de-04 mm²/s, all positive: True",
    "pod_over_a_parameter": r"4 numbers in place of 80: off by 0.\d%",
    "storms_from_a_table": "37 storms, 946 fixes, 5900 hours; fastest: Martin 2022",
    "noisy_gps": r"2\d degrees of freedom; half way known to 4\.\d m",
    "noisy_attitude": r"noise 1\.0\d degrees found; the curve is off by 0\.[45]\d degrees",
    "noisy_tensors": r"noise 0\.1[3-6] in every coordinate; the curve is off by 0\.1\d",
    "polar_wander": r"[5-8] degrees of freedom; 100 million years ago A95 is 2\.\d degrees",
    "noisy_camera": r"λ = 0\.03\d*, noise 0\.04\d m; λ = 0\.2\d*, noise 0\.05\d rad",
    "field_on_a_grid": r"2592 curves in 4 blocks, 2592 converged; the field turns by up to 0.2\d degrees a year",
    "morph": "100 frames of 12 landmarks",
}


@pytest.mark.parametrize("name", SAYS)
def test_a_recipe_draws_a_picture(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(FOLDER / f"{name}.py"))
    said = capsys.readouterr().out
    assert re.match(SAYS[name], said), said
    pictures = list(tmp_path.glob("*.png"))
    # Neither white nor of one colour.
    assert pictures and all(imread(picture)[..., :3].std() > 0.02 for picture in pictures)


def test_every_recipe_is_here():
    assert sorted(path.stem for path in FOLDER.glob("*.py")) == sorted(SAYS)
