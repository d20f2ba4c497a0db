"""The code and the commands of the page on fields run."""

import shlex
from pathlib import Path

import numpy as np
import pytest
from pages import blocks, run

from symspline.cli import main

PAGE = Path(__file__).parents[2] / "docs/guide/fields.md"


def test_the_commands_of_the_guide(tmp_path, monkeypatch, capsys):
    nibabel, xr = pytest.importorskip("nibabel"), pytest.importorskip("xarray")
    pytest.importorskip("zarr")
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in blocks(PAGE):
        run(block, PAGE, names)
    assert names["fine"].mask.shape == (39, 47, 31)
    nibabel.save(nibabel.Nifti1Image(names["mask"].astype(np.uint8), names["volume"].affine), "brain.nii.gz")
    nibabel.save(nibabel.Nifti1Image(np.zeros((9, 9, 9), np.uint8), np.diag([4.0, 4, 4, 1])), "t1.nii.gz")
    coords = {"lat": names["lat"], "lon": names["lon"]}
    wind = xr.DataArray(names["points"], dims=("lat", "lon", "q"), coords=coords, name="wind")
    wind.chunk(lat=7).to_zarr("wind.zarr", consolidated=False)
    np.savez("positions.npz", lat=[0.0, 30.0], lon=[10.0, 20.0])
    lines = blocks(PAGE, "sh")[0].splitlines()
    for line in lines:
        code = main(shlex.split(line.removeprefix("symspline ").partition("#")[0]))
        assert (code, "symspline: " in capsys.readouterr().err) == (0, False), line
    with np.load("values.npz") as values:
        assert len(lines) == 6 and values["points"].shape == (2, 2, 3)
