"""Inexpensive checks of the site that `make docs` builds: it is complete, and the code of its pages runs."""

import doctest
import importlib
import re
import shutil
import types
from pathlib import Path

import derivatives_figure
import estimation
import guide_figures
import links
import manifolds
import many_curves
import paths_figures
import pytest
import smoothing
import smoothing_adaptive
from pages import blocks, run, with_output

import symspline as ss

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
README = ROOT / "README.md"
PAGES = sorted(path for path in DOCS.rglob("*") if path.suffix in (".md", ".rst"))
# Made by the build, where there was one.
PAGES = [path for path in PAGES if not {"gallery", "generated", "backreferences", "_templates"} & set(path.parts)]
GALLERY = (ROOT / "examples/index.rst").read_text(encoding="utf-8")
# Their own tests run or compare what they quote.
OTHERS = {
    "adaptive.md",
    "adding-a-space.md",
    "from_geomstats.md",
    "jax.md",
    "pytorch.md",
    "manifolds.md",
    "shapes.md",
    "smoothing.md",
    "solvers_tables.md",
    "xarray.md",
}


def with_data(page, folder, monkeypatch):
    """Go to a folder that holds the tables beside the page."""
    for table in page.parent.glob("*.csv"):
        shutil.copy(table, folder)
    monkeypatch.chdir(folder)


def listed(page):
    """Pages in the toctrees of a page."""
    text = page.read_text(encoding="utf-8")
    trees = re.findall(r"^```\{toctree\}\n(.*?)^```$", text, re.M | re.S)
    entries = (line.strip() for tree in trees for line in tree.splitlines() if line and line[0] != ":")
    for entry in entries:
        path = page.parent / entry
        for suffix in (".md", ".rst"):
            if path.with_name(path.name + suffix).exists():
                yield path.with_name(path.name + suffix).resolve()


def test_every_page_is_in_a_toctree():
    found, left = set(), [DOCS / "index.md"]
    while left:
        page = left.pop()
        if page not in found:
            found.add(page)
            left += listed(page)
    assert set(PAGES) == found - {DOCS / "gallery/index.rst"}


def test_every_public_name_is_in_the_reference():
    lines = (DOCS / "api/index.rst").read_text(encoding="utf-8").splitlines()
    names = [line.strip().removeprefix("symspline.") for line in lines if line.startswith("   symspline.")]
    assert len(set(names)) == len(names)
    assert set(names) == {*ss.__all__, "jax", "torch", "xarray"}


def test_every_public_name_has_a_description():
    for name in ss.__all__:
        thing = getattr(ss, name)
        assert thing.__doc__, name
        if isinstance(thing, types.ModuleType):
            members = getattr(importlib.import_module(thing.__name__), "__all__", [])
            # Numbers are described in the source.
            assert all(getattr(thing, member).__doc__ for member in members)


def test_notation_page_names_existing_attributes():
    spline = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0]], "sphere:2")
    things = {"spline": spline, "space": spline.space, "report": spline.report, "ss": ss}
    text = (DOCS / "notation.md").read_text(encoding="utf-8")
    named = re.findall(r"`(spline|space|report)\.(\w+)", text)
    assert len(named) > 15 and all(hasattr(things[thing], name) for thing, name in named)
    for call, name in re.findall(r"`(\w+\([kn, ]+\))`, `\"([^`]+)\"`", text):
        call, name = (re.sub(r"\bk\b", "2", re.sub(r"\bn\b", "5", part)) for part in (call, name))
        assert eval(f"ss.{call}") == ss.space(name)


def test_every_example_is_in_the_gallery_once():
    named = re.findall(r"^    \.\./examples/(\w+)\.py$", GALLERY, re.M)
    # And in the same order beside the pages.
    assert named == re.findall(r"^   (\w+)$", GALLERY, re.M)
    assert sorted(named) == sorted(path.stem for path in (ROOT / "examples").glob("*.py"))


def test_every_figure_of_the_paper_has_an_entry():
    entries = re.findall(r"^\* Figures? ([\d, ]+): :doc:`[^<]+ <(\w+)>`$", GALLERY, re.M)
    figures = [int(number) for numbers, _ in entries for number in numbers.split(",")]
    assert sorted(figures) == list(range(1, 11))
    for numbers, name in entries:
        text = (ROOT / f"examples/{name}.py").read_text(encoding="utf-8")
        title = text.splitlines()[1]
        assert re.search(r"\(Figs?\. ", title) and numbers.split(",")[0] in title


@pytest.mark.parametrize(
    "page", [page for page in [*PAGES, README] if blocks(page, "pycon")], ids=lambda page: page.stem
)
def test_sessions_are_as_printed(page):
    session = "\n".join(blocks(page, "pycon"))
    test = doctest.DocTestParser().get_doctest(session, {}, page.name, str(page), 0)
    said = []
    assert test.examples
    doctest.DocTestRunner(verbose=False).run(test, out=said.append)
    assert not said, "".join(said)


@pytest.mark.parametrize(
    "page",
    [page for page in [*PAGES, README] if blocks(page) and page.name not in OTHERS],
    ids=lambda page: page.stem,
)
def test_code_runs(page, tmp_path, monkeypatch, capsys):
    with_data(page, tmp_path, monkeypatch)
    names = {}
    for block, output in with_output(page):
        run(block, page, names)
        printed = capsys.readouterr().out
        assert output is None or printed == output
    assert (
        str(page.relative_to(ROOT).with_suffix("")).removeprefix("docs/") not in guide_figures.PAGES
        or names["figure"].axes
    )
    assert page.stem != "derivatives" or names["gradient"].points.shape == (5, 3)


def test_pages_show_the_figures_of_their_code():
    for name in guide_figures.PAGES:
        page = DOCS / f"{name}.md"
        assert page.with_suffix(".png").exists() and f"]({page.stem}.png)" in page.read_text("utf-8"), name


@pytest.mark.parametrize(
    "module", [estimation, manifolds, many_curves, smoothing, smoothing_adaptive], ids=lambda module: module.__name__
)
def test_a_page_has_a_place_for_every_table(module):
    text = module.PAGE.read_text(encoding="utf-8")
    for part in module.PARTS:
        assert text.count(f"<!-- {part}: begin -->") == text.count(f"<!-- {part}: end -->") == 1


def test_the_figure_of_derivatives_can_be_made(tmp_path, monkeypatch):
    monkeypatch.setattr(derivatives_figure, "__file__", str(tmp_path / "figure.py"))
    derivatives_figure.main()
    assert (tmp_path / "derivatives.png").stat().st_size > 10_000


def test_the_figures_of_paths_can_be_made():
    names = paths_figures.names_of_page()
    assert len(paths_figures.closest(names).axes) == 1 and len(paths_figures.law(names).axes) == 2


def test_links_to_files_lead_somewhere():
    for page in PAGES:
        text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
        for link in re.findall(r"\]\((?!https?:|#|gallery/)([^)#]+)", text):
            assert (page.parent / link).exists(), f"{page.name}: {link}"


def test_files_of_the_contributing_page_exist():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.findall(r"`([\w./-]+\.(?:rs|py|toml|rst|md))`", text)
    folders = (ROOT, ROOT / "python/symspline", ROOT / "crates/core/src", ROOT / "crates/vectors/src")
    assert "fit/condition.rs" in named
    assert [name for name in named if not any((folder / name).exists() for folder in folders)] == []


def test_dead_links_are_found(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "a.html").write_text(
        '<h1 id="top"></h1><a href="sub/b.html#place"></a><a href="#top"></a><a href="https://x.y/none"></a>'
        '<a href="sub/b.html#none"></a><img src="none.png">'
    )
    (tmp_path / "sub/b.html").write_text('<a name="place"></a><a href="../a.html"></a><a href="c.html"></a>')
    assert links.dead_links(tmp_path) == ["c.html on sub/b.html", "none.png on a.html", "sub/b.html#none on a.html"]
