"""Node.js and the npm package that `make wasm` builds, or the reason why tests skip."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "build/npm"
TOOLS = ROOT / "build/node/node_modules"
PAGE = ROOT / "build/play/index.html"

NODE = shutil.which("node")


def require(*paths: Path) -> None:
    """Skip a module of tests where Node.js or a built file is missing."""
    if NODE is None:
        pytest.skip("Node.js is not installed", allow_module_level=True)
    for path in paths:
        if not path.exists():
            pytest.skip(f"{path.relative_to(ROOT)} does not exist: run `make wasm`", allow_module_level=True)


def node(script: str, *arguments: object, timeout: float = 120) -> str:
    """Run a program of this folder and return its output."""
    command = [str(NODE), str(Path(__file__).with_name(script)), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=timeout, cwd=ROOT)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-6000:]
    return done.stdout


def run_cases(cases: list[dict[str, Any]], folder: Path) -> list[dict[str, Any]]:
    """Run cases with the npm package."""
    file = folder / "cases.json"
    file.write_text(json.dumps(cases, allow_nan=False))
    found: list[dict[str, Any]] = json.loads(node("run_cases.mjs", PACKAGE, file))
    return found
