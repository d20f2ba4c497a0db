"""The code quoted in docs/adding-a-space.md exists."""

import re
from pathlib import Path

from pages import blocks

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/adding-a-space.md"


def test_the_page_of_rust_is_the_one_that_is_tested():
    source = (ROOT / "crates/symspline/tests/torus.rs").read_text(encoding="utf-8")
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


def test_the_class_is_python():
    for block in blocks(PAGE):
        compile(block, "adding-a-space.md", "exec")


def test_files_exist():
    links = re.findall(r"\]\((\.\./[^)]+)\)", PAGE.read_text(encoding="utf-8"))
    names = re.findall(r"`((?:crates|python|tests)/[^`]+)`", PAGE.read_text(encoding="utf-8"))
    assert links and names
    paths = [*links, *(f"../{name}" for name in names)]
    missing = {path for path in paths if not (ROOT / "docs" / path).exists()}
    # The page that would be added.
    assert missing == {"../crates/vectors/src/torus.rs"}
