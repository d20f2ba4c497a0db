"""Picks the compiled module that suits this processor, before any other is imported.

A wheel for x86-64 holds three: ``_core``, which runs on all processors, ``_core_v3`` for those with AVX2 and FMA
(x86-64-v3, since about 2013), and ``_core_v4`` for those with AVX-512 (x86-64-v4). A checkout, and a wheel for another
architecture, have ``_core`` only; in a checkout it is built for the processor of the machine.
"""

import ctypes
import os
import platform
import sys
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

LEVELS = {"plain": "any processor", "v3": "x86-64-v3", "v4": "x86-64-v4"}
"""What ``SYMSPLINE_CPU`` may be, and the processors for which such a module is built; slowest first."""
_INSTRUCTIONS = {"v3": "AVX2 and FMA", "v4": "AVX-512"}
_V3 = {"avx2", "fma", "bmi1", "bmi2", "f16c", "movbe"}
_FLAGS = {"v3": _V3, "v4": _V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}}
"""Flags of Linux."""
_SYSCTL = {"v3": (b"hw.optional.avx2_0", b"hw.optional.fma"), "v4": (b"hw.optional.avx512f", b"hw.optional.avx512vl")}
"""Names of macOS."""
_FEATURES = {"v3": 40, "v4": 41}
"""PF_AVX2_INSTRUCTIONS_AVAILABLE and PF_AVX512F_INSTRUCTIONS_AVAILABLE of Windows."""

# What `load` did, for `show_config`.
reason = ""


def mark(level: str) -> bytes:
    """Return what the compiled file of a level contains."""
    return b"symspline built for " + LEVELS[level].encode()


def built_for(file: Path) -> str:
    """Return the level for which a compiled file was built."""
    content = file.read_bytes()
    return next(level for level in (*reversed(LEVELS), "plain") if level == "plain" or mark(level) in content)


def _has(level: str) -> bool:
    """Whether the operating system reports that the processor has a level; True if it is unknown."""
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return True
    try:
        if sys.platform == "linux":
            with open("/proc/cpuinfo", encoding="ascii", errors="replace") as file:
                flags = next((line for line in file if line.startswith("flags")), "")
            return not flags or set(flags.split()) >= _FLAGS[level]
        if sys.platform == "darwin":
            return all(_sysctl(name) != 0 for name in _SYSCTL[level])
        if sys.platform == "win32":
            return bool(ctypes.windll.kernel32.IsProcessorFeaturePresent(_FEATURES[level]))
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


def _level(plain: Path) -> str:
    """Return the best level that the processor itself reports.

    Asked through a module that it can run in any case: emulators show programs the files of another processor.
    """
    ask = ctypes.CDLL(str(plain)).symspline_cpu_level
    ask.restype = ctypes.c_int
    return list(LEVELS)[int(ask())]


def _find(folder: Path, level: str) -> Path | None:
    name = "_core" if level == "plain" else f"_core_{level}"
    files = (folder / (name + suffix) for suffix in EXTENSION_SUFFIXES)
    return next((file for file in files if file.is_file()), None)


def check(folder: Path) -> None:
    """Raise ImportError if the compiled module in ``folder`` needs what the processor lacks."""
    file = _find(folder, "plain")
    level = "plain" if not file or all(map(_has, _FLAGS)) else built_for(file)
    if level != "plain" and not _has(level):
        raise ImportError(
            f"symspline was built for processors with {_INSTRUCTIONS[level]} ({LEVELS[level]}), which this one lacks. "
            'Build it for any x86-64 processor with: RUSTFLAGS="-C target-cpu=x86-64" '
            "pip install --no-binary symspline symspline"
        )


def _choose(folder: Path) -> tuple[Path | None, str]:
    """The file to load as ``_core``, None for the one that Python finds by itself, and why."""
    asked = os.environ.get("SYMSPLINE_CPU", "")
    if asked and asked not in LEVELS:
        raise ImportError(f"SYMSPLINE_CPU must be plain, v3 or v4, not {asked[:99]!r}")
    modules = {level: file for level in LEVELS if (file := _find(folder, level))}
    plain = modules.get("plain")
    if not plain or len(modules) == 1:
        check(folder)
        if asked and plain and built_for(plain) != asked:
            raise ImportError(
                f"SYMSPLINE_CPU={asked} cannot be done: the only compiled module here is {plain.name}, "
                f"built for {LEVELS[built_for(plain)]}"
            )
        return None, "the only one here"
    if asked == "plain":
        return None, "SYMSPLINE_CPU=plain"
    own, levels = _level(plain), list(LEVELS)
    runs = [level for level in modules if levels.index(level) <= levels.index(own)]
    if asked and asked not in modules:
        raise ImportError(f"SYMSPLINE_CPU={asked} cannot be done: there is no compiled module for {LEVELS[asked]} here")
    if asked and asked not in runs:
        raise ImportError(
            f"SYMSPLINE_CPU={asked} cannot be done: this processor lacks {LEVELS[asked]} ({_INSTRUCTIONS[asked]})"
        )
    level = asked or runs[-1]
    if level == "plain":
        return None, "the processor lacks x86-64-v3"
    return modules[level], f"SYMSPLINE_CPU={level}" if asked else f"the processor has {LEVELS[own]}"


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
