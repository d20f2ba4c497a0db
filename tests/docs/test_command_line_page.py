"""The commands of the guide on the command line."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs/guide/command_line.md"


def test_the_commands_of_the_guide(tmp_path):
    text = PAGE.read_text(encoding="utf-8")
    (tmp_path / "storms.csv").write_text(re.search(r"```csv\n(.*?)```", text, re.S)[1], encoding="utf-8")
    shell = shutil.which("bash") or pytest.skip("needs bash")
    blocks = re.findall(r"```sh\n(.*?)```", text, re.S)
    command = f'symspline() {{ "{sys.executable}" -m symspline "$@"; }}\nset -eo pipefail\n' + "".join(blocks)
    done = subprocess.run([shell, "-c", command], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "--curve storm fits one curve per storm" in done.stdout and done.stdout.endswith("]\n")
    assert sorted(path.name for path in tmp_path.glob("hourly*")) == [
        "hourly.csv",
        "hourly_Ida.csv",
        "hourly_Julian.csv",
    ]
