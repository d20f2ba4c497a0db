"""Picks the compiled module that suits this processor, before any other is imported.

A wheel for x86-64 holds two: ``_core``, which runs on all of them, and ``_core_v3`` for those with AVX2 and FMA
(x86-64-v3, since about 2013). A checkout, and a wheel for another architecture, have ``_core`` only.
"""

import ctypes
import os
import platform
import sys
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

# In the compiled file.
MARK = b"symspline built for x86-64-v3"
_NEEDED = {"avx2", "fma", "bmi1", "bmi2", "f16c", "movbe"}

# What `load` did, for `show_config`.
reason = ""


def _has_v3() -> bool:
    """Whether the operating system reports that the processor has x86-64-v3; True if it is unknown."""
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return True
    try:
        if sys.platform == "linux":
            with open("/proc/cpuinfo", encoding="ascii", errors="replace") as file:
                flags = next((line for line in file if line.startswith("flags")), "")
            return not flags or set(flags.split()) >= _NEEDED
        if sys.platform == "darwin":
            return all(_sysctl(name) != 0 for name in (b"hw.optional.avx2_0", b"hw.optional.fma"))
        if sys.platform == "win32":
            avx2_available = 40  # PF_AVX2_INSTRUCTIONS_AVAILABLE
            return bool(ctypes.windll.kernel32.IsProcessorFeaturePresent(avx2_available))
    except OSError:
        pass
    return True


def _sysctl(name: bytes) -> int | None:
    """A number that macOS reports for the processor; None if it does not report this one."""
    value, size = ctypes.c_int(0), ctypes.c_size_t(ctypes.sizeof(ctypes.c_int))
    # man 3 sysctl; the C library is part of every process.
    ask = ctypes.CDLL(None).sysctlbyname
    if ask(name, ctypes.byref(value), ctypes.byref(size), None, ctypes.c_size_t(0)) != 0:
        return None
    return value.value


def _says_v3(plain: Path) -> bool:
    """Whether the processor itself reports that it has x86-64-v3.

    Asked through a module that it can run in any case: emulators show programs the files of another processor.
    """
    ask = ctypes.CDLL(str(plain)).symspline_has_v3
    ask.restype = ctypes.c_bool
    return bool(ask())


def _find(folder: Path, name: str) -> Path | None:
    files = (folder / (name + suffix) for suffix in EXTENSION_SUFFIXES)
    return next((file for file in files if file.is_file()), None)


def check(folder: Path) -> None:
    """Raise ImportError if the compiled module in ``folder`` needs what the processor lacks."""
    if _has_v3():
        return
    file = _find(folder, "_core")
    if file and MARK in file.read_bytes():
        raise ImportError(
            "symspline was built for processors with AVX2 and FMA (x86-64-v3), which this one lacks. "
            'Build it for any x86-64 processor with: RUSTFLAGS="-C target-cpu=x86-64" '
            "pip install --no-binary symspline symspline"
        )


def _choose(folder: Path) -> tuple[Path | None, str]:
    """The file to load as ``_core``, None for the one that Python finds by itself, and why."""
    asked = os.environ.get("SYMSPLINE_CPU", "")
    if asked not in ("", "plain", "v3"):
        raise ImportError(f"SYMSPLINE_CPU must be plain or v3, not {asked[:99]!r}")
    plain, fast = _find(folder, "_core"), _find(folder, "_core_v3")
    if not plain or not fast:
        check(folder)
        if asked and plain and (MARK in plain.read_bytes()) != (asked == "v3"):
            other = "any processor" if asked == "v3" else "x86-64-v3"
            raise ImportError(
                f"SYMSPLINE_CPU={asked} cannot be done: the only compiled module here is {plain.name}, "
                f"built for {other}"
            )
        return None, "the only one here"
    if asked == "plain":
        return None, "SYMSPLINE_CPU=plain"
    if _says_v3(plain):
        return fast, "SYMSPLINE_CPU=v3" if asked else "the processor has x86-64-v3"
    if asked:
        raise ImportError("SYMSPLINE_CPU=v3 cannot be done: this processor lacks x86-64-v3 (AVX2 and FMA)")
    return None, "the processor lacks x86-64-v3"


def load(folder: Path) -> None:
    """Make ``_core`` of the package in ``folder`` the compiled module that suits; else raise ImportError."""
    global reason
    file, reason = _choose(folder)
    if file is None:
        return
    name = f"{__package__}._core"
    # The compiled file identifies itself as `_core`, whatever it is called.
    spec = spec_from_file_location(name, file, loader=ExtensionFileLoader(name, str(file)))
    assert spec and spec.loader
    module = module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    sys.modules[__package__]._core = module  # type: ignore[attr-defined]
