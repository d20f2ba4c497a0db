"""How many threads parallel work uses."""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from . import _core
from ._arrays import whole_number
from ._core import ValidationError

# More would only wait for each other, and a system has no room for very many.
_MOST = 1024


class _Threads:
    """The number that was asked for, 0 for all cores, and how many callers want one thread for now."""

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
    """A child has none of its parent's threads, so that nobody in it wants one only; nor may it find the lock held."""
    global _threads
    _threads = _Threads(_threads.asked)
    _core.set_num_threads(_threads.asked)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)


def set_num_threads(n: int) -> None:
    """Limit the number of threads; 0 stands for all cores.

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

    The compiled core has one number for the whole process. While any thread is in here it is 1, and calls of others
    use one thread, too; then it is again what was asked for, also if that was meanwhile.
    """
    threads = _threads
    threads.enter()
    try:
        yield
    finally:
        threads.leave()
