"""The compiled module is selected or rejected before it is imported."""

import os
import platform
import shutil
import subprocess
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import pytest
from refused import raises

import symspline as ss
from symspline import _core, _cpu

PACKAGE = Path(ss.__file__).parent
LEVELS = ("plain", "v3", "v4")
FILE = {level: f"_core{'' if level == 'plain' else f'_{level}'}{EXTENSION_SUFFIXES[0]}" for level in LEVELS}

# Only there are several modules, and only there two can run.
needs_v3 = pytest.mark.skipif(
    platform.machine().lower() not in ("x86_64", "amd64") or not _cpu._has("v3"), reason="needs x86-64-v3"
)


@pytest.fixture
def folder_with(tmp_path, monkeypatch):
    """A folder with modules for these levels, on a processor of a level, and SYMSPLINE_CPU."""

    def make(files, own, asked):
        for name, level in files.items():
            (tmp_path / FILE[name]).write_bytes(b"..." + _cpu.mark(level) + b"...")
        monkeypatch.setattr(_cpu, "_has", lambda level: LEVELS.index(level) <= LEVELS.index(own))
        monkeypatch.setattr(_cpu, "_level", lambda plain: own)
        monkeypatch.setenv("SYMSPLINE_CPU", asked)
        return tmp_path

    return make


ANY, V3, V4 = ({"plain": level} for level in LEVELS)
TWO = {level: level for level in ("plain", "v3")}
ALL = {level: level for level in LEVELS}


@pytest.mark.parametrize(
    "files, own, asked, level",
    [
        (ANY, "plain", "", None),
        (ANY, "v3", "plain", None),
        (V3, "v3", "v3", None),
        (V3, "v4", "", None),
        (V4, "v4", "v4", None),
        *((TWO, own, asked, "v3") for own in ("v3", "v4") for asked in ("", "v3")),
        *((ALL, own, asked, "v3") for own, asked in (("v3", ""), ("v3", "v3"), ("v4", "v3"))),
        *((ALL, "v4", asked, "v4") for asked in ("", "v4")),
        *((ALL, own, "plain", None) for own in LEVELS),
        (ALL, "plain", "", None),
    ],
)
def test_the_module_that_suits_the_processor_is_chosen(folder_with, files, own, asked, level):
    folder = folder_with(files, own, asked)
    assert _cpu._choose(folder)[0] == (level and folder / FILE[level])


@pytest.mark.parametrize(
    "files, own, asked, message",
    [
        (V3, "plain", "", r"AVX2 and FMA.*RUSTFLAGS"),
        (V4, "v3", "", r"AVX-512 \(x86-64-v4\).*RUSTFLAGS"),
        (ANY, "v3", "v3", "SYMSPLINE_CPU=v3 cannot be done: the only compiled module"),
        (V3, "v3", "plain", "SYMSPLINE_CPU=plain cannot be done: the only compiled module"),
        (ALL, "plain", "v3", "this processor lacks x86-64-v3"),
        (ALL, "v3", "v4", r"this processor lacks x86-64-v4 \(AVX-512\)"),
        (TWO, "v4", "v4", "there is no compiled module for x86-64-v4 here"),
        *((ALL, "v4", asked, f"must be plain, v3 or v4, not '{asked}'") for asked in ("v5", "V3", "1", "plain ")),
    ],
)
def test_missing_and_unsupported_modules_raise(folder_with, files, own, asked, message):
    raises(message, _cpu.load, folder_with(files, own, asked), error=ImportError)


@needs_v3
def test_the_processor_reports_the_level_that_the_system_reports():
    assert _cpu._level(Path(_core.__file__)) == ("v4" if _cpu._has("v4") else "v3")


CODE = """
import sys, numpy as np, symspline as ss, symspline._core
assert ss._core is sys.modules["symspline._core"] is symspline._core
try:
    ss.Sphere(0)
except symspline._core.ValidationError as error:
    assert type(error) is ss.ValidationError
assert (ss.CubicSpline(None, np.eye(3), "sphere:2")([0, 1, 2]) == np.eye(3)).all()
ss.show_config()
"""


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """A copy of the package with both modules; in a checkout they are the same one, twice."""
    copy = tmp_path_factory.mktemp("wheel") / "symspline"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    suffix = Path(_core.__file__).name.partition(".")[2]
    if not (copy / f"_core_v3.{suffix}").exists():
        shutil.copy(copy / f"_core.{suffix}", copy / f"_core_v3.{suffix}")
    return copy


def printed(both, asked):
    environment = os.environ | {"PYTHONPATH": str(both.parent), "SYMSPLINE_CPU": asked}
    done = subprocess.run(
        [sys.executable, "-c", CODE], env=environment, cwd=both.parent, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr[-2000:]
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("module")]
    return line.split(maxsplit=1)[1]


@needs_v3
def test_the_processor_decides_unless_one_of_two_is_forced(both):
    for asked, start, end in (
        ("plain", "_core.", "; SYMSPLINE_CPU=plain)"),
        ("v3", "_core_v3.", "; SYMSPLINE_CPU=v3)"),
        ("", "_core_v3.", f"; the processor has {_cpu.LEVELS[_cpu._level(Path(_core.__file__))]})"),
    ):
        chosen = printed(both, asked)
        assert chosen.startswith(start) and chosen.endswith(end)


def test_the_configuration_is_printed(capsys):
    ss.show_config()
    lines = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert list(lines) == ["symspline", "Python", "NumPy", "platform", "module", "threads"]
    assert lines["symspline"] == ss.__version__ and lines["threads"] == str(ss.num_threads())
    assert lines["module"].startswith(Path(_core.__file__).name) and _cpu.reason in lines["module"]


@pytest.mark.parametrize(
    "known, has_v3",
    [
        ({"AVX2": True}, True),
        ({"AVX2": False}, False),
        ({"X86_V3": True}, True),
        ({"X86_V3": False}, False),
        ({}, True),
    ],
)
def test_numpy_reports_the_features_of_the_processor(known, has_v3, monkeypatch):
    monkeypatch.setattr("numpy._core._multiarray_umath.__cpu_features__", known)
    assert _cpu._has("v3") is has_v3
