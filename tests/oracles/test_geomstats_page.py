"""The code of ``docs/guide/from_geomstats.md`` runs and prints what the page shows.

In a process of its own, because geomstats selects its backend when it is imported.
"""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests/docs"))

from pages import with_output  # noqa: E402

PAGE = ROOT / "docs/guide/from_geomstats.md"


def test_the_page_prints_what_it_shows():
    blocks = with_output(PAGE)
    environment = os.environ | {"GEOMSTATS_BACKEND": "autograd", "PYTHONPATH": str(ROOT / "python")}
    code = "\n".join(code for code, _ in blocks)
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "".join(output for _, output in blocks if output) and "True" in done.stdout
