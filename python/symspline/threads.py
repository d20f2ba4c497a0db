"""How many threads parallel work uses."""

from . import _core
from ._core import ValidationError
from .arrays import whole_number

# More would only wait for each other, and a system has no room for very many.
_MOST = 1024


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
    _core.set_num_threads(int(n))
