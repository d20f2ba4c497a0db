"""Picks the compiled module that suits this processor, before any other is imported.

A wheel for x86-64 holds three: ``_core``, which runs on all processors, ``_core_v3`` for those with AVX2 and FMA
(x86-64-v3, since about 2013), and ``_core_v4`` for those with AVX-512 (x86-64-v4). A checkout, and a wheel for another
architecture, have ``_core`` only; in a checkout it is built for the processor of the machine.
"""

import ctypes
import os
import sys
from importlib import import_module
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

LEVELS = {"plain": "any processor", "v3": "x86-64-v3", "v4": "x86-64-v4"}
"""What ``SYMSPLINE_CPU`` may be, and the processors for which such a module is built; slowest first."""
_INSTRUCTIONS = {"v3": "AVX2 and FMA", "v4": "AVX-512"}
# Features that NumPy reports, by its names for groups of them and for single ones.
_FEATURES = {"v3": ("X86_V3", "AVX2"), "v4": ("X86_V4", "AVX512_SKX")}

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
    """Whether NumPy finds that the processor has a level; True if it does not report that."""
    try:
        features = import_module("numpy._core._multiarray_umath").__cpu_features__
    except ImportError:
        return True
    known = [features[name] for name in _FEATURES[level] if name in features]
    return not known or any(known)


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
    level = "plain" if not file or all(map(_has, _FEATURES)) else built_for(file)
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
    best, levels = _level(plain), list(LEVELS)
    runs = [level for level in modules if levels.index(level) <= levels.index(best)]
    if asked and asked not in modules:
        raise ImportError(f"SYMSPLINE_CPU={asked} cannot be done: there is no compiled module for {LEVELS[asked]} here")
    if asked and asked not in runs:
        raise ImportError(
            f"SYMSPLINE_CPU={asked} cannot be done: this processor lacks {LEVELS[asked]} ({_INSTRUCTIONS[asked]})"
        )
    level = asked or runs[-1]
    if level == "plain":
        return None, "the processor lacks x86-64-v3"
    return modules[level], f"SYMSPLINE_CPU={level}" if asked else f"the processor has {LEVELS[best]}"


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
