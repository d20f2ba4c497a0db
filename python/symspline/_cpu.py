"""Refuses, with a clear message, to load a compiled module that this processor cannot run."""

import ctypes
import platform
import subprocess
import sys
from pathlib import Path

_MARK = b"symspline built for x86-64-v3"
_NEEDED = {"avx2", "fma", "bmi1", "bmi2", "f16c", "movbe"}


def _has_v3() -> bool:
    """Whether the processor has x86-64-v3; True where it cannot be found out."""
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return True
    try:
        if sys.platform == "linux":
            with open("/proc/cpuinfo", encoding="ascii", errors="replace") as file:
                flags = next((line for line in file if line.startswith("flags")), "")
            return not flags or set(flags.split()) >= _NEEDED
        if sys.platform == "darwin":
            names = ["sysctl", "-n", "hw.optional.avx2_0", "hw.optional.fma"]
            return "0" not in subprocess.run(names, capture_output=True, text=True).stdout.split()
        if sys.platform == "win32":
            avx2_available = 40  # PF_AVX2_INSTRUCTIONS_AVAILABLE
            return bool(ctypes.windll.kernel32.IsProcessorFeaturePresent(avx2_available))
    except OSError:
        pass
    return True


def check(folder: Path) -> None:
    """Raise ImportError if the compiled module in ``folder`` needs what the processor lacks."""
    if _has_v3():
        return
    for file in [*folder.glob("_core*.so"), *folder.glob("_core*.pyd")]:
        if _MARK in file.read_bytes():
            raise ImportError(
                "symspline was built for processors with AVX2 and FMA (x86-64-v3), which this one lacks. "
                'Build it for any x86-64 processor with: RUSTFLAGS="-C target-cpu=x86-64" '
                "pip install --no-binary symspline symspline"
            )
