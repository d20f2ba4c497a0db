"""Information about the installation, for bug reports."""

import platform
import sys
from pathlib import Path

import numpy as np

from .. import _core, _cpu
from .version import VERSION


def show_config() -> None:
    """Print information about the installation, for bug reports.

    The output lists the versions of symspline, Python and NumPy, the operating system and architecture, the compiled
    module in use, the processors for which it is built and the reason for its choice, and the number of threads.

    See Also
    --------
    set_num_threads : Limit the number of threads of parallel work.

    Notes
    -----
    A wheel for x86-64 contains three compiled modules. ``plain``, ``v3`` or ``v4`` in the environment variable
    ``SYMSPLINE_CPU`` selects one of them.

    Examples
    --------
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
    built_for = _cpu.LEVELS[_cpu.built_for(file)]
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
    """Whether one thread runs Python at a time.

    ``sys._is_gil_enabled`` exists from the first version of Python in which the answer may be False.
    """
    return bool(getattr(sys, "_is_gil_enabled", lambda: True)())
