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

import symspline as ss
from symspline import _core, _cpu

PACKAGE = Path(ss.__file__).parent
NAMED = {name: name + EXTENSION_SUFFIXES[0] for name in ("_core", "_core_v3")}
FOR_V3, FOR_ANY = b"..." + _cpu.MARK + b"...", b"... symspline built for any processor ..."

# Only there are two modules, and only there both can run.
needs_v3 = pytest.mark.skipif(
    platform.machine().lower() not in ("x86_64", "amd64") or not _cpu._has_v3(), reason="needs x86-64-v3"
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(_cpu, "_has_v3", lambda: False)
    monkeypatch.delenv("SYMSPLINE_CPU", raising=False)
    return tmp_path


def test_an_old_processor_gets_a_clear_message(folder):
    (folder / NAMED["_core"]).write_bytes(FOR_V3)
    with pytest.raises(ImportError, match=r"AVX2 and FMA.*RUSTFLAGS"):
        _cpu.load(folder)


def test_a_module_built_for_any_processor_is_let_in(folder):
    (folder / NAMED["_core"]).write_bytes(FOR_ANY)
    assert _cpu._choose(folder) == (None, "the only one here")


@pytest.mark.parametrize("content, other", [(FOR_ANY, "v3"), (FOR_V3, "plain")])
def test_missing_modules_cannot_be_forced(folder, monkeypatch, content, other):
    monkeypatch.setattr(_cpu, "_has_v3", lambda: True)
    (folder / NAMED["_core"]).write_bytes(content)
    monkeypatch.setenv("SYMSPLINE_CPU", other)
    with pytest.raises(ImportError, match=f"SYMSPLINE_CPU={other} cannot be done: the only compiled module"):
        _cpu.load(folder)
    monkeypatch.setenv("SYMSPLINE_CPU", {"plain": "v3", "v3": "plain"}[other])
    assert _cpu._choose(folder)[0] is None


@pytest.mark.parametrize(
    "has_v3, asked, name",
    [
        (True, "", "_core_v3"),
        (True, "v3", "_core_v3"),
        (True, "plain", None),
        (False, "", None),
        (False, "plain", None),
    ],
)
def test_of_two_the_one_that_suits(folder, monkeypatch, has_v3, asked, name):
    monkeypatch.setattr(_cpu, "_says_v3", lambda plain: has_v3)
    (folder / NAMED["_core"]).write_bytes(FOR_ANY)
    (folder / NAMED["_core_v3"]).write_bytes(FOR_V3)
    monkeypatch.setenv("SYMSPLINE_CPU", asked)
    assert _cpu._choose(folder)[0] == (name and folder / NAMED[name])


def test_unsupported_modules_cannot_be_forced(folder, monkeypatch):
    monkeypatch.setattr(_cpu, "_says_v3", lambda plain: False)
    for name in NAMED.values():
        (folder / name).touch()
    monkeypatch.setenv("SYMSPLINE_CPU", "v3")
    with pytest.raises(ImportError, match="this processor lacks x86-64-v3"):
        _cpu.load(folder)


@pytest.mark.parametrize("value", ["v4", "V3", "1", "plain "])
def test_other_values_are_refused(folder, monkeypatch, value):
    monkeypatch.setenv("SYMSPLINE_CPU", value)
    with pytest.raises(ImportError, match=f"SYMSPLINE_CPU must be plain or v3, not '{value}'"):
        _cpu.load(folder)


# ---- a package with both, as in a wheel ----

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
def test_each_of_two_can_be_forced(both):
    plain, fast = printed(both, "plain"), printed(both, "v3")
    assert plain.startswith("_core.") and plain.endswith("; SYMSPLINE_CPU=plain)")
    assert fast.startswith("_core_v3.") and fast.endswith("; SYMSPLINE_CPU=v3)")


@needs_v3
def test_the_processor_decides_by_itself(both):
    chosen = printed(both, "")
    assert chosen.startswith("_core_v3.") and chosen.endswith("(for x86-64-v3; the processor has x86-64-v3)")


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
