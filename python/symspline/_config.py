"""What runs here: for reports of bugs."""

import platform
import sys
from pathlib import Path

import numpy as np

from . import _core, _cpu
from ._version import VERSION


def show_config() -> None:
    """Print what a report of a bug should say.

    Versions of symspline, Python and NumPy; system and architecture; the compiled module in use, for which
    processors it is built, and why it was picked; and the number of threads that parallel work uses. A wheel for
    x86-64 holds two modules; ``plain`` or ``v3`` in the environment variable ``SYMSPLINE_CPU`` forces one.

    >>> import symspline as ss
    >>> ss.show_config()  # doctest: +ELLIPSIS
    symspline   ...
    Python      ...
    NumPy       ...
    platform    ...
    module      _core... (...)
    threads     ...
    """
    file = Path(str(_core.__file__))
    built_for = "x86-64-v3" if _cpu.MARK in file.read_bytes() else "any processor"
    lines = {
        "symspline": VERSION,
        "Python": f"{sys.version.split()[0]} ({platform.python_implementation()}, {'no ' * (not _locked())}GIL)",
        "NumPy": np.__version__,
        "platform": platform.platform() + " " + platform.machine(),
        "module": f"{file.name} (for {built_for}; {_cpu.reason})",
        "threads": f"{_core.num_threads()}",
    }
    for name, value in lines.items():
        print(f"{name:12}{value}")


def _locked() -> bool:
    """Whether one thread runs Python at a time; the question came with the first Python of which it may be false."""
    return bool(getattr(sys, "_is_gil_enabled", lambda: True)())
