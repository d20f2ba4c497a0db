"""Permitted outcomes of a call: a result, or an error that a user can read and catch."""

import signal
import warnings
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

import symspline as ss

REFUSALS = (ss.ValidationError, ss.CutLocusError, ss.ConvergenceError, MemoryError)
SECONDS = 60
"""What no example comes near, unless it hangs, also on a machine that has other things to do."""


@dataclass(frozen=True)
class Refusal:
    """The error with which a call refused."""

    error: Exception


def attempt(call, *inputs, wrong_types=False):
    """The result of a call, or its `Refusal`.

    Fails if the call raises anything else, hangs, warns, or changes its inputs or the state of NumPy.

    Args:
        call: what to do.
        inputs: arrays that it is given.
        wrong_types: whether it is given things of plainly wrong types, so that TypeError is an answer, too.
    """
    before, state = [snapshot(x) for x in inputs], np.geterr()
    allowed = (*REFUSALS, TypeError) if wrong_types else REFUSALS
    with warnings.catch_warnings(record=True) as caught, time_limit():
        warnings.simplefilter("always")
        try:
            result = call()
        except allowed as error:
            assert str(error) or isinstance(error, MemoryError)
            result = Refusal(error)
        except BaseException as error:
            if type(error).__name__ == "PanicException":
                raise AssertionError(f"the compiled code panicked: {error}") from error
            raise
    # Points of sphere:3 are no quaternions here, and some walks are long.
    expected = ("neighbours of opposite sign", "neighbours almost at the cut locus", "more than half of the steps")
    told = [w for w in caught if not str(w.message).startswith(expected)]
    assert all(issubclass(w.category, ss.ConvergenceWarning) for w in told), [str(w) for w in told]
    assert np.geterr() == state
    assert [snapshot(x) for x in inputs] == before, "an input was modified"
    return result


@contextmanager
def time_limit():
    """Fails what does not end; compiled code looks at signals, too."""
    if not hasattr(signal, "setitimer"):
        yield
        return
    fired = []

    def stop(*_):
        fired.append(True)
        raise AssertionError("it hangs")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    # Even if somebody caught the error.
    assert not fired, "it hangs"


def snapshot(value):
    """Something that is equal as long as the value is what it was, NaN included."""
    if isinstance(value, (tuple, list)):
        return [snapshot(item) for item in value]
    if not isinstance(value, np.ndarray) or value.dtype.hasobject:
        return repr(value)
    once = value[tuple(slice(0, 1) if stride == 0 else slice(None) for stride in value.strides)]
    return value.shape, value.strides, value.dtype, value.flags.writeable, once.tobytes()
