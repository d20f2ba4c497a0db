"""Threads of parallel work, and information about the installation."""

import os
import platform
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from .. import _core, _cpu
from .._core import ValidationError
from .arrays import whole_number
from .version import VERSION

# More threads would only wait for each other, and operating systems limit their number.
_MOST = 1024


class _Threads:
    """The requested number of threads, 0 for all cores, and the number of callers that currently require one thread."""

    def __init__(self, asked: int = 0) -> None:
        self.lock, self.asked, self.alone = threading.Lock(), asked, 0

    def ask(self, n: int) -> None:
        with self.lock:
            self.asked = n
            if not self.alone:
                _core.set_num_threads(n)

    def enter(self) -> None:
        with self.lock:
            self.alone += 1
            _core.set_num_threads(1)

    def leave(self) -> None:
        with self.lock:
            self.alone -= 1
            if not self.alone:
                _core.set_num_threads(self.asked)


_threads = _Threads()


def _forked() -> None:
    """Reset the state in a forked process.

    The child has none of its parent's threads, so no caller in it requires a single thread, and the lock may have been
    held.
    """
    global _threads
    _threads = _Threads(_threads.asked)
    _core.set_num_threads(_threads.asked)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)


def set_num_threads(n: int) -> None:
    """Limit the number of threads of parallel work.

    Parameters
    ----------
    n : int
        Largest number of threads, at most 1024. 0 means all cores.

    Raises
    ------
    ValidationError
        If n is not an integer from 0 to 1024.

    See Also
    --------
    num_threads : Return the number of threads.

    Notes
    -----
    Results are bit-identical for every number of threads. The environment variable ``SYMSPLINE_NUM_THREADS`` sets the
    number before the package is imported.

    Examples
    --------
    >>> import symspline as ss
    >>> ss.set_num_threads(2)
    >>> ss.num_threads()
    2
    >>> ss.set_num_threads(0)
    """
    if whole_number(n, "the number of threads", 0) > _MOST:
        raise ValidationError(f"the number of threads must be at most {_MOST}, not {n}")
    _threads.ask(int(n))


@contextmanager
def one_thread() -> Iterator[None]:
    """Work on the calling thread only, as one of many workers.

    The compiled core has one number of threads for the whole process. While any thread is in this context the number
    is 1, also for calls of other threads. Afterwards it is the requested number again, even if that changed in the
    meantime.
    """
    threads = _threads
    threads.enter()
    try:
        yield
    finally:
        threads.leave()


# ---- information about the installation, for bug reports ----


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
