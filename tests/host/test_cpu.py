"""The compiled module is selected or rejected before it is imported."""

import ctypes
import os
import platform
import shutil
import subprocess
import sys
import types
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import pytest
from refused import raises

import symspline as ss
from symspline import _core, _cpu

PACKAGE = Path(ss.__file__).parent
NAMED = {name: name + EXTENSION_SUFFIXES[0] for name in ("_core", "_core_v3")}
FOR_V3, FOR_ANY = b"..." + _cpu.MARK + b"...", b"... symspline built for any processor ..."

# Only there are two modules, and only there both can run.
needs_v3 = pytest.mark.skipif(
    platform.machine().lower() not in ("x86_64", "amd64") or not _cpu._has_v3(), reason="needs x86-64-v3"
)


ANY, V3 = {"_core": FOR_ANY}, {"_core": FOR_V3}
BOTH = {"_core": FOR_ANY, "_core_v3": FOR_V3}


@pytest.fixture
def folder_with(tmp_path, monkeypatch):
    """A folder with these modules, on a processor with or without x86-64-v3, and SYMSPLINE_CPU."""

    def make(modules, has_v3, asked):
        for name, content in modules.items():
            (tmp_path / NAMED[name]).write_bytes(content)
        monkeypatch.setattr(_cpu, "_has_v3", lambda: has_v3)
        monkeypatch.setattr(_cpu, "_says_v3", lambda plain: has_v3)
        monkeypatch.setenv("SYMSPLINE_CPU", asked)
        return tmp_path

    return make


@pytest.mark.parametrize(
    "modules, has_v3, asked, name",
    [
        (ANY, False, "", None),
        (ANY, True, "plain", None),
        (V3, True, "v3", None),
        (BOTH, True, "", "_core_v3"),
        (BOTH, True, "v3", "_core_v3"),
        (BOTH, True, "plain", None),
        (BOTH, False, "", None),
        (BOTH, False, "plain", None),
    ],
)
def test_the_module_that_suits_the_processor_is_chosen(folder_with, modules, has_v3, asked, name):
    folder = folder_with(modules, has_v3, asked)
    assert _cpu._choose(folder)[0] == (name and folder / NAMED[name])


def test_missing_and_unsupported_modules_raise(folder_with):
    for modules, has_v3, asked, message in [
        (V3, False, "", r"AVX2 and FMA.*RUSTFLAGS"),
        (ANY, True, "v3", "SYMSPLINE_CPU=v3 cannot be done: the only compiled module"),
        (V3, True, "plain", "SYMSPLINE_CPU=plain cannot be done: the only compiled module"),
        (BOTH, False, "v3", "this processor lacks x86-64-v3"),
        *((BOTH, True, asked, f"must be plain or v3, not '{asked}'") for asked in ("v4", "V3", "1", "plain ")),
    ]:
        raises(message, _cpu.load, folder_with(modules, has_v3, asked), error=ImportError)


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
        ("", "_core_v3.", "(for x86-64-v3; the processor has x86-64-v3)"),
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
        ({b"hw.optional.avx2_0": 1, b"hw.optional.fma": 1}, True),
        ({b"hw.optional.avx2_0": 0, b"hw.optional.fma": 1}, False),
        ({b"hw.optional.avx2_0": 1, b"hw.optional.fma": 0}, False),
        # An emulator may know none of them.
        ({}, True),
    ],
)
def test_macos_is_asked_without_another_program(known, has_v3, monkeypatch):
    def sysctlbyname(name, value, size, new, new_size):
        """The C function of macOS."""
        if name not in known:
            return -1
        assert size[0] == ctypes.sizeof(ctypes.c_int) and not new and new_size == 0
        value[0] = known[name]
        return 0

    integer, length = ctypes.POINTER(ctypes.c_int), ctypes.POINTER(ctypes.c_size_t)
    kind = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_char_p, integer, length, ctypes.c_void_p, ctypes.c_size_t)
    library = types.SimpleNamespace(sysctlbyname=kind(sysctlbyname))
    monkeypatch.setattr(_cpu.sys, "platform", "darwin")
    monkeypatch.setattr(_cpu.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(_cpu.ctypes, "CDLL", lambda name: library)

    def refuse(*_, **__):
        raise AssertionError("another program was started")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    assert _cpu._has_v3() is has_v3
