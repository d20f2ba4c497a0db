"""Licences, README, metadata, extras and citation of the packages agree with their sources."""

import ast
import base64
import csv
import hashlib
import json
import re
import runpy
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "packaging"))

import index_readme  # noqa: E402
import licenses  # noqa: E402
import test_wheel  # noqa: E402

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
WORKSPACE = tomllib.loads((ROOT / "Cargo.toml").read_text("utf-8"))["workspace"]["package"]
EXTRAS = PROJECT["optional-dependencies"]
# Their objects are converted: whoever has such an object has the library.
CONVERTED = {"orix", "qutip"}


def name_of(requirement):
    return re.match(r"[\w-]+", requirement)[0].lower().replace("-", "_")


def test_licences_of_linked_crates_are_current():
    assert licenses.OUT.read_text("utf-8") == licenses.collected(licenses.MODULE), "run `make package-files`"


def test_licences_that_demand_their_text_are_there():
    text = licenses.OUT.read_text("utf-8")
    for crate, phrase in [
        ("nalgebra", "Apache License\n                           Version 2.0"),
        ("simba", "Apache License\n                           Version 2.0"),
        ("approx", "Apache License\n                           Version 2.0"),
        ("numpy", "Redistributions in binary form must reproduce the above copyright"),
        ("unicode-ident", "UNICODE LICENSE V3"),
        ("the Rust standard library", "The above copyright notice and this permission notice"),
    ]:
        (*_, part) = [part for part in text.split("-" * 100) if crate in part.partition("\nLicence:")[0]]
        assert phrase in part, crate


@pytest.mark.parametrize(
    "expression, chosen",
    [
        ("MIT", ["MIT"]),
        ("Zlib OR Apache-2.0 OR MIT", ["MIT"]),
        ("MIT/Apache-2.0", ["MIT"]),
        ("(MIT OR Apache-2.0) AND Unicode-3.0", ["MIT", "Unicode-3.0"]),
    ],
)
def test_one_licence_per_term_is_chosen(expression, chosen):
    assert licenses.chosen(expression) == chosen


def test_licences_that_nobody_has_read_stop_the_release():
    with pytest.raises(SystemExit, match="GPL"):
        licenses.chosen("MIT AND GPL-3.0-only")


def test_a_wheel_without_a_licence_is_refused(tmp_path):
    crates = [("numpy", "required"), ("nalgebra", "required"), ("autocfg", "excluded"), ("symspline-core", "required")]
    sbom = {"components": [{"name": name, "version": "0.3.0", "scope": scope} for name, scope in crates]}
    with zipfile.ZipFile(tmp_path / "a.whl", "w") as wheel:
        wheel.writestr("a.dist-info/sboms/a.cyclonedx.json", json.dumps(sbom))
        # A longer version and a longer name are not the crate.
        wheel.writestr(
            "a.dist-info/licenses/THIRD-PARTY-LICENSES.txt", "x 1, nalgebra 0.3.0, y 2\nmy-numpy 0.3.0, numpy 0.3.01\n"
        )
        assert test_wheel.without_licence(wheel) == ["numpy 0.3.0"]


def test_a_joined_wheel_has_all_modules_their_hashes_and_no_path(tmp_path):
    # The name of this module is also that of a library.
    join = runpy.run_path(str(ROOT / "packaging/wheel.py"))["join"]
    made = {}
    for level in ("plain", "v3"):
        made[level] = tmp_path / f"{level}.whl"
        with zipfile.ZipFile(made[level], "w") as wheel:
            wheel.writestr("symspline/_core.abi3.so", level)
            wheel.writestr("symspline/_core.pyi", "")
            wheel.writestr("symspline-1.dist-info/sboms/a.cyclonedx.json", f"path+{ROOT.as_uri()}/crates/core")
            wheel.writestr("symspline-1.dist-info/RECORD", "of one module")
    (tmp_path / "dist").mkdir()
    with zipfile.ZipFile(join(made["plain"], {"v3": made["v3"]}, tmp_path / "dist")) as wheel:
        rows = list(csv.reader(wheel.read("symspline-1.dist-info/RECORD").decode().splitlines()))
        assert [name for name, *_ in rows] == wheel.namelist() and rows[-1][1:] == ["", ""]
        for name, digest, size in rows[:-1]:
            content = wheel.read(name)
            found = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).decode().rstrip("=")
            assert (digest, int(size)) == (f"sha256={found}", len(content))
        assert wheel.read("symspline/_core.abi3.so") == b"plain" and wheel.read("symspline/_core_v3.abi3.so") == b"v3"
        assert [name for name in wheel.namelist() if test_wheel.paths(wheel.read(name))] == []


def test_paths_of_this_machine_are_found_in_a_module():
    home = str(Path.home())
    module = f"\0{home}/.cargo/registry/src/x.rs\0crates/x.rs\0/rustc/abc/lib.rs\0{home}less/y.rs\0".encode()
    assert test_wheel.paths(module) == [f"{home}/.cargo/registry/src/x.rs"]


def test_the_readme_for_indexes_is_current_and_has_no_relative_links():
    text = index_readme.OUT.read_text("utf-8")
    assert text == index_readme.current(), "run `make package-files`"
    assert not [link for link in re.findall(r"\]\(([^)]+)\)", text) if not link.startswith("https://")]
    assert "<img" not in text and "make demo" not in text and "pip install symspline" in text


def test_links_of_the_readme_for_indexes_lead_to_the_repository():
    readme = (ROOT / "README.md").read_text("utf-8")
    text = index_readme.for_index(readme, "https://github.com/owner/name", "1.2.3")
    assert "![37 storm tracks" in text and "](https://github.com/owner/name/raw/v1.2.3/docs/tracks.png)" in text
    assert "[Start](https://github.com/owner/name/blob/v1.2.3/docs/start.md)" in text
    links = re.findall(r"\]\(([^)]+)\)", text)
    assert len(links) > 20 and all(link.startswith("https://") for link in links)
    paths = [link.partition("/v1.2.3/")[2] for link in links if "/v1.2.3/" in link]
    assert [path for path in paths if not (ROOT / path.partition("#")[0]).exists()] == []


def test_addresses_of_the_repository_agree():
    package = json.loads((ROOT / "packaging/npm/package.json").read_text("utf-8"))
    addresses = {PROJECT.get("urls", {}).get("Repository"), WORKSPACE.get("repository"), package.get("repository")}
    assert len(addresses) == 1, "set the same address in pyproject.toml, Cargo.toml and packaging/npm/package.json"


def imported():
    """Top-level modules that the package imports at run time, with a file that does so."""
    found = {}

    def visit(node, file):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
                continue
            names = [alias.name for alias in child.names] if isinstance(child, ast.Import) else []
            if isinstance(child, ast.ImportFrom) and child.level == 0:
                names = [child.module]
            found.update({name.partition(".")[0]: file.name for name in names})
            visit(child, file)

    for file in (ROOT / "python/symspline").rglob("*.py"):
        visit(ast.parse(file.read_text("utf-8")), file)
    return {name: file for name, file in found.items() if name not in sys.stdlib_module_names}


def test_extras_contain_what_the_code_imports():
    names = re.search(r"\[(.*)\]", EXTRAS["all"][0])[1].split(",")
    assert EXTRAS["all"] == [f"symspline[{','.join(names)}]"]
    # Everything for users, and nothing for developers.
    assert {*names, "all", "bench", "docs", "test"} == set(EXTRAS)
    installed = {name_of(requirement) for name in names for requirement in EXTRAS[name]} | {"numpy"}
    needed = imported()
    assert {"pandas", "matplotlib", "jax", "torch", "orix"} <= set(needed)
    # Matplotlib installs mpl_toolkits.
    assert set(needed) - installed - CONVERTED - {"mpl_toolkits"} == set(), needed


def test_extras_that_messages_and_pages_name_exist():
    files = [*(ROOT / "python/symspline").rglob("*.py"), *(ROOT / "docs").rglob("*.md"), ROOT / "README.md"]
    named = {
        (name, file.name)
        for file in files
        for names in re.findall(r"(?:symspline|'\.)\[([a-z,]+)\]", file.read_text("utf-8"))
        for name in names.split(",")
    }
    assert len(named) > 10 and {pair for pair in named if pair[0] not in EXTRAS} == set()


def test_metadata_names_authors_and_keywords():
    holder = re.search(r"Copyright \(c\) \d+ (.*)", (ROOT / "LICENSE").read_text("utf-8"))[1]
    assert [author["name"] for author in PROJECT["authors"]] == [holder]
    assert len(PROJECT["keywords"]) >= 5
    assert all((ROOT / name).exists() for name in [*PROJECT["license-files"], PROJECT["readme"]])


def test_the_citation_has_the_paper_and_this_version():
    text = (ROOT / "CITATION.cff").read_text("utf-8")
    fields = dict(re.findall(r"^ *(version|doi|volume|issue|start|end|year): (\S+)$", text, re.M))
    assert fields["version"] == WORKSPACE["version"]
    assert fields["doi"].startswith("10.1137/") and fields["volume"] == "56" and fields["year"] == "2018"
    assert int(fields["start"]) < int(fields["end"]) and fields["issue"] in "123456"
