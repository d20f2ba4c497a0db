"""Collects the licences of all Rust crates that a compiled module of symspline contains, in one text file.

    python packaging/licenses.py                                  # THIRD-PARTY-LICENSES.txt, for wheels
    python packaging/licenses.py crates/symspline-wasm FILE       # those of the npm package

The crates are the ones that the SBOM of a wheel lists as required: dependencies on any platform, without tools of the
build. Where a crate offers a choice of licences, the first of `PREFERENCE` is used.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
MODULE = ROOT / "crates/symspline-python"
OUT = ROOT / "THIRD-PARTY-LICENSES.txt"
PREFERENCE = ("MIT", "Apache-2.0", "BSD-2-Clause", "Unicode-3.0")
# How crates name the file of a licence that is not their only one.
FILES = {"MIT": "LICENSE-MIT*", "Apache-2.0": "LICENSE-APACHE*", "Unicode-3.0": "LICENSE-UNICODE*"}
HEAD = """\
symspline is distributed under the MIT licence, in the file LICENSE. Its compiled module contains code of the Rust
crates below, and of the Rust standard library, under the licences that follow their names.
"""


def required(module: Path) -> list[dict]:
    """Return the packages of other projects that a crate links, by name and version."""
    command = [
        "cargo",
        "metadata",
        "--format-version",
        "1",
        "--locked",
        "--manifest-path",
        str(module / "Cargo.toml"),
    ]
    metadata = json.loads(subprocess.run(command, capture_output=True, encoding="utf-8", check=True).stdout)
    dependencies = {
        node["id"]: [
            entry["pkg"] for entry in node["deps"] if any(kind["kind"] is None for kind in entry["dep_kinds"])
        ]
        for node in metadata["resolve"]["nodes"]
    }
    found, left = set(), [metadata["resolve"]["root"]]
    while left:
        name = left.pop()
        if name not in found:
            found.add(name)
            left += dependencies[name]
    others = (package for package in metadata["packages"] if package["id"] in found and package["source"])
    return sorted(others, key=lambda package: (package["name"], package["version"]))


def chosen(expression: str) -> list[str]:
    """Return one licence per term of an SPDX expression such as ``(MIT OR Apache-2.0) AND Unicode-3.0``."""
    found = []
    for term in expression.split(" AND "):
        options = re.split(" OR |/", term.strip("()"))
        known = [licence for licence in PREFERENCE if licence in options]
        if not known:
            sys.exit(f"read the licence {term}, and add it to PREFERENCE if its conditions can be met")
        found.append(known[0])
    return found


def text_of(package: dict, licence: str) -> str:
    """Return the text of a licence as the crate has it, without trailing blanks."""
    folder = Path(package["manifest_path"]).parent
    files = sorted(folder.glob(FILES.get(licence, "LICENSE"))) or sorted(folder.glob("LICENSE"))
    if not files:
        sys.exit(f"{package['name']} {package['version']} has no file with its licence {licence}")
    return "\n".join(line.rstrip() for line in files[0].read_text("utf-8").strip("\n").splitlines())


def collected(module: Path) -> str:
    """Return the content of the file: each text once, after the names of its crates."""
    # The standard library offers the same choice as most crates. The terms are those of this project.
    own = (ROOT / "LICENSE").read_text("utf-8").strip()
    standard = re.sub(r"Copyright .*", "Copyright (c) The Rust Project Developers", own)
    texts: dict[tuple[str, str], list[str]] = {("MIT", standard): ["the Rust standard library"]}
    for package in required(module):
        for licence in chosen(package["license"]):
            names = texts.setdefault((licence, text_of(package, licence)), [])
            names.append(f"{package['name']} {package['version']}")
    parts = [
        f"{', '.join(names)}\nLicence: {licence}\n\n{text}\n" for (licence, text), names in texts.items()
    ]
    return f"\n{'-' * 100}\n\n".join([HEAD, *parts])


def main() -> None:
    module, out = (ROOT / sys.argv[1], Path(sys.argv[2])) if len(sys.argv) > 1 else (MODULE, OUT)
    out.write_text(collected(module), "utf-8", newline="\n")


if __name__ == "__main__":
    main()
