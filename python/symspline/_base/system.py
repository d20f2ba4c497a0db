"""Files that arguments name, threads of parallel work, and information about the installation."""

from __future__ import annotations

import errno
import io
import os
import platform
import re
import secrets
import stat
import sys
import threading
import time
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from .. import _core, _cpu
from .._core import ValidationError
from . import VERSION
from .arrays import brief, short_repr, whole_number

# Characters of the file's own name in that of a temporary one: at most 128 bytes of the 255 that file systems allow.
_TAIL = 32
# Age in seconds above which a temporary file of another machine, or of a running process, counts as abandoned.
_OLD = 24 * 3600


def path_of(file: object, name: str = "file", *, method: str, text: bool = False) -> Path | None:
    """The path that an argument names, or None if it is an open file.

    Numbers are refused: Python opens 0, 1 and 2 as the standard streams.

    Parameters
    ----------
    file : path or open file
        The argument.
    name : str
        What the caller calls the argument.
    method : {"read", "write"}
        What an open file must have.
    text : bool
        Whether an open file must be open as text.

    Raises
    ------
    TypeError
        The argument is neither.
    ValidationError
        It is a text that cannot be the name of a file.
    """
    if callable(getattr(file, method, None)):
        if isinstance(file, (io.RawIOBase, io.BufferedIOBase) if text else io.TextIOBase):
            mode = "as text, without 'b' in its mode" if text else "in binary mode, with 'b'"
            raise TypeError(f"{name} must be open {mode}; pass its name, or open it so")
        return None
    if not isinstance(file, (str, os.PathLike)):
        raise TypeError(f"{name} must be a path or an open file with a method {method}, not {short_repr(file)}")
    path = os.fspath(file)
    if not isinstance(path, str):
        raise TypeError(f"{name} must be a path of text, not {short_repr(path)}")
    if not path:
        raise ValidationError(f"{name} is an empty text, which names no file")
    try:
        os.fsencode(path)
    except UnicodeEncodeError:
        raise ValidationError(f"{name} = {short_repr(path)} is not the name of a file: it is not Unicode") from None
    if "\0" in path:
        raise ValidationError(f"{name} = {short_repr(path)} is not the name of a file: it holds a null character")
    return Path(path)


@contextmanager
def damage(file: object, problem: str) -> Iterator[None]:
    """Raise ValidationError with the name of a file for errors in reading what it holds.

    Damaged files cause errors of zipfile, of its decompressors, of NumPy, of JSON and of other libraries. They are
    described by ``found``, such as "is damaged".
    """
    try:
        yield
    except (OSError, MemoryError, ImportError):
        raise
    except ValidationError as error:
        raise ValidationError(f"{file}: {error}") from None
    except Exception as error:
        raise ValidationError(f"{file} {problem}: {brief(error)}") from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Write a file as a whole: a context whose value is a temporary path, which takes the place of ``path``.

    The temporary file lies in the same folder and has the same ending. If the body fails it is removed, and an
    existing file stays as it was. If the body succeeds, its data are flushed to disk before it is renamed. An existing
    file keeps its permissions and, where the system allows that, its owner. Of a symbolic link the target is
    replaced.

    Raises
    ------
    OSError
        ``path`` is a folder, a device, a pipe or a socket, or cannot be written.
    """
    # Raises for links that go in circles; a link to nothing becomes a file where it points.
    with suppress(FileNotFoundError):
        os.stat(path)
    target = Path(os.path.realpath(path))
    old: os.stat_result | None = None
    with suppress(FileNotFoundError):
        old = os.stat(target)
    if old is not None and not stat.S_ISREG(old.st_mode):
        if stat.S_ISDIR(old.st_mode):
            raise IsADirectoryError(errno.EISDIR, "it is a folder", str(path))
        what = "it is a device, a pipe or a socket, not a regular file; pass an open file instead"
        raise OSError(errno.EINVAL, what, str(path))
    _remove_left(target)
    temporary = target.with_name(f".{_machine()}-{os.getpid():x}-{secrets.token_hex(8)}{target.name[-_TAIL:]}")
    # A new file has the permissions of any new file. One that replaces another gets those at the end, and until then
    # nobody else may read it.
    try:
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666 if old is None else 0o600))
    except OSError as error:
        # The name of the user's file, not that of the temporary one.
        raise type(error)(error.errno, error.strerror, str(path)) from None
    try:
        yield temporary
        with open(temporary, "rb+") as file:
            os.fsync(file.fileno())
        if old is not None:
            _keep(temporary, old)
        temporary.replace(target)
    finally:
        with suppress(FileNotFoundError):
            temporary.unlink()


def _remove_left(target: Path) -> None:
    """Remove temporary files of this name that killed processes did not remove."""
    name = re.compile(rf"\.([0-9a-f]{{8}})-([0-9a-f]+)-[0-9a-f]{{16}}{re.escape(target.name[-_TAIL:])}")
    with suppress(OSError), os.scandir(target.parent) as entries:
        for entry in entries:
            match = name.fullmatch(entry.name)
            with suppress(OSError):
                if match is not None and _is_left(match[1] == _machine(), int(match[2], 16), entry.stat().st_mtime):
                    os.unlink(entry.path)


def _is_left(here: bool, process: int, changed: float) -> bool:
    """Whether no process can still be writing a file: the process of this machine has ended, or the file is old."""
    if here and os.name == "posix" and process != os.getpid():
        try:
            os.kill(process, 0)
        except (ProcessLookupError, OverflowError):
            return True
        except OSError:
            return False
    return time.time() - changed > _OLD


def _machine() -> str:
    """Return a text that differs between machines that share a folder."""
    return f"{zlib.crc32(platform.node().encode()):08x}"


def _keep(temporary: Path, old: os.stat_result) -> None:
    """Keep owner and permissions of the file that is replaced."""
    new = os.stat(temporary)
    if hasattr(os, "chown") and (new.st_uid, new.st_gid) != (old.st_uid, old.st_gid):
        with suppress(OSError):
            os.chown(temporary, old.st_uid, old.st_gid)
    os.chmod(temporary, stat.S_IMODE(old.st_mode))


# ---- threads of parallel work ----

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
