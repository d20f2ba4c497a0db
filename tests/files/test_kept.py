"""Files and pickles of every format version are read, and their curves have the values with which they were written."""

import json
import pickle
from pathlib import Path

import numpy as np
import pytest
from kept import write

import symspline as ss
from symspline._splines import archive as _archive

FOLDERS = sorted(write.FOLDER.glob("version_*"))
VALUES = {folder: json.loads((folder / "values.json").read_text("utf-8")) for folder in FOLDERS}
FILES = [(folder, name) for folder, values in VALUES.items() for name in values]


def assert_same(found, expected):
    if isinstance(expected, dict):
        assert list(found) == list(expected)
        for name in expected:
            assert_same(found[name], expected[name])
    elif isinstance(expected, list):
        for one, other in zip(found, expected, strict=True):
            assert_same(one, other)
    elif isinstance(expected, float):
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-14, nan_ok=True)
    else:
        assert found == expected


@pytest.mark.parametrize("folder, name", FILES, ids=[f"{folder.name} {name}" for folder, name in FILES])
def test_kept_files_are_read(folder, name):
    expected = VALUES[folder][name]
    read = ss.load(folder / f"{name}.npz")
    unpickled = pickle.loads((folder / f"{name}.pickle").read_bytes())
    for found in (read, unpickled):
        assert_same(write.values(found), expected)
    assert read == unpickled


def test_every_version_has_one_file_of_each_kind():
    assert [folder.name for folder in FOLDERS] == [f"version_{i + 1}" for i in range(_archive.VERSION)]
    assert write.VERSION == _archive.VERSION
    kept = VALUES[FOLDERS[-1]]
    assert set(kept) == set(write.curves())
    kinds = {str(np.load(FOLDERS[-1] / f"{name}.npz")["format"]) for name in kept}
    assert kinds == set(_archive.FORMATS)
    assert {Path(file).suffix for file in FOLDERS[-1].iterdir()} == {".npz", ".pickle", ".json"}
