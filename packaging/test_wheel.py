"""Tests the wheel of dist/: its content, and in a new environment with nothing but NumPy, from a copy of the tests.

The wheel must contain the licence of every crate that its SBOM requires, and no path of the machine that built it.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
# Those that need no other library.
TESTS = [
    "host/test_cpu.py",
    "host/test_threads.py",
    "spaces/test_laws.py",
    "spaces/test_operations.py",
    "spline/test_functions.py",
]
SETTINGS = """
[pytest]
pythonpath = tests
addopts = -q -p no:cacheprovider
filterwarnings =
    error
    ignore:neighbours of opposite sign:UserWarning
"""


def without_licence(wheel: zipfile.ZipFile) -> list[str]:
    """Return the crates whose licence is missing: those that the SBOM requires, without those of this project."""
    (sbom,) = (name for name in wheel.namelist() if name.endswith(".cyclonedx.json"))
    (licences,) = (name for name in wheel.namelist() if name.endswith("licenses/THIRD-PARTY-LICENSES.txt"))
    text = wheel.read(licences).decode()
    required = (crate for crate in json.loads(wheel.read(sbom))["components"] if crate["scope"] == "required")
    names = (
        f"{crate['name']} {crate['version']}"
        for crate in required
        if not crate["name"].startswith("symspline")
    )
    return [name for name in names if not re.search(rf"^(.*, )?{re.escape(name)}(,|$)", text, re.M)]


def paths(content: bytes) -> list[str]:
    """Return strings in a file that begin with a folder of the machine that built it, if it was this one."""
    folders = {Path.home(), ROOT, Path(os.environ.get("CARGO_HOME", Path.home() / ".cargo"))}
    starts = b"|".join(re.escape(str(folder).encode()) + rb"[/\\\\]" for folder in folders)
    return [match.decode() for match in re.findall(rb"(?:" + starts + rb")[ -~]{0,60}", content)]


def newest_wheel() -> Path:
    """Return the newest wheel in dist."""
    wheels = sorted((ROOT / "dist").glob("*.whl"), key=os.path.getmtime)
    if not wheels:
        sys.exit("no wheel in dist: run `make wheel` first")
    return wheels[-1]


def main() -> None:
    made = newest_wheel()
    with zipfile.ZipFile(made) as wheel:
        if missing := without_licence(wheel):
            sys.exit(
                f"{made.name} lacks the licences of {', '.join(missing)}: run `make package-files`, then `make wheel`"
            )
        for name in wheel.namelist():
            if found := paths(wheel.read(name)):
                sys.exit(f"{name} contains {len(found)} paths of this machine, such as {found[0]}")
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(temporary)
        venv.create(home / "venv", with_pip=True)
        python = home / "venv" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        (home / "pytest.ini").write_text(SETTINGS)
        shutil.copytree(ROOT / "tests", home / "tests")
        for arguments in (
            [*install, str(made), sys.argv[1], "pytest"],
            ["-c", "import symspline; symspline.show_config()"],
            ["-m", "pytest", *(f"tests/{name}" for name in TESTS)],
        ):
            subprocess.run([python, *arguments], cwd=home, env=environment, check=True)


if __name__ == "__main__":
    main()
