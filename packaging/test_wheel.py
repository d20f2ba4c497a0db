"""Tests the wheel of dist/ in a new environment with nothing but NumPy, from a copy of the tests alone."""

import os
import shutil
import subprocess
import sys
import tempfile
import venv
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


def main() -> None:
    wheels = sorted((ROOT / "dist").glob("*.whl"), key=os.path.getmtime)
    if not wheels:
        sys.exit("no wheel in dist: run `make wheel` first")
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(temporary)
        venv.create(home / "venv", with_pip=True)
        python = home / "venv" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        (home / "pytest.ini").write_text(SETTINGS)
        shutil.copytree(ROOT / "tests", home / "tests")
        for arguments in (
            [*install, str(wheels[-1]), sys.argv[1], "pytest"],
            ["-c", "import symspline; symspline.show_config()"],
            ["-m", "pytest", *(f"tests/{name}" for name in TESTS)],
        ):
            subprocess.run([python, *arguments], cwd=home, env=environment, check=True)


if __name__ == "__main__":
    main()
