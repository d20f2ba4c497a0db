"""The code quoted in docs/adding-a-space.md exists, and what the page adds in Python fits where it is added."""

import re
import sys
import types
from pathlib import Path

import numpy as np
import pytest
import test_docstrings
from cases import CASES, Case
from pages import blocks

import symspline as ss

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/adding-a-space.md"


def test_the_page_of_rust_is_the_one_that_is_tested():
    source = (ROOT / "crates/engine/tests/circles.rs").read_text(encoding="utf-8")
    region = source.split("// ---- the page begins ----\n")[1].split("// ---- the page ends ----\n")[0]
    assert "\n".join(blocks(PAGE, "rust")) == region


def test_lines_are_added_between_lines_that_are_there():
    additions = blocks(PAGE, "diff")
    assert additions
    for addition in additions:
        head, *lines = addition.splitlines()
        there = (ROOT / head.removeprefix("+++ ")).read_text(encoding="utf-8").splitlines()
        around = [line[1:] for line in lines if line.startswith(" ")]
        assert [line for line in there if line in around] == around
        added = [line[1:] for line in lines if line.startswith("+")]
        assert len(around) + len(added) == len(lines) and not set(added) & set(there)


@pytest.fixture
def torus(monkeypatch):
    """The class of the page, in a module where the page adds it."""
    # It does not stay among the known spaces.
    monkeypatch.setattr("symspline._spaces.base.CLASSES", {})
    (code,) = blocks(PAGE)
    module = types.ModuleType("symspline._spaces.circles", doc="The flat torus.")
    module.__package__ = "symspline._spaces"
    monkeypatch.setitem(sys.modules, module.__name__, module)
    exec(compile(code, "adding-a-space.md", "exec"), vars(module))
    return module.Circles


def test_the_docstring_of_the_class_is_complete(torus, monkeypatch):
    monkeypatch.setattr(ss, "Circles", torus, raising=False)
    assert test_docstrings.problems("symspline.Circles", torus) == []


def test_the_class_has_a_symmetry_and_a_group(torus):
    # The core does not know the torus, and these methods need nothing of it.
    space = object.__new__(torus)
    space._point_shape = (2, 2)
    p, x = (np.stack([np.cos(a), np.sin(a)], axis=-1) for a in ([0.3, 1.2], [0.5, -0.7]))
    angles = np.array([0.1, 3.1])
    mirrored = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    assert np.abs(space._reflected(p, x) - mirrored).max() <= 4 * np.finfo(float).eps
    g = np.eye(4)
    g[:2, :2] = [[0, -1], [1, 0]]
    assert np.array_equal(space._moved(space._element(g), x), [[-x[0, 1], x[0, 0]], x[1]])


def test_the_cases_are_cases():
    (lines,) = (block.splitlines() for block in blocks(PAGE, "diff") if block.startswith("+++ tests/cases.py"))
    added = eval(f"[{''.join(line[1:] for line in lines if line.startswith('+ '))}]", {"Case": Case})
    assert [case.name for case in added] == ["circles:1", "circles:2"]
    # As the page says, some case of the family stands for it.
    assert any(case.interface for case in added) and not set(added) & set(CASES)


def test_files_exist():
    links = re.findall(r"\]\((\.\./[^)]+)\)", PAGE.read_text(encoding="utf-8"))
    names = re.findall(r"`((?:crates|python|tests)/[^`]+)`", PAGE.read_text(encoding="utf-8"))
    assert links and names
    paths = [*links, *(f"../{name}" for name in names)]
    missing = {path for path in paths if not (ROOT / "docs" / path).exists()}
    # The page that would be added.
    assert missing == {"../crates/vectors/src/circles.rs"}
