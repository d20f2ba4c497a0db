"""Every public function and method with good and bad arguments: results, or errors that the library words itself."""

import inspect
import os
import re
import traceback
import unicodedata
import warnings
from collections import defaultdict

import numpy as np
import pytest

import symspline as ss
from fuzz.everything import functions, methods, objects, pools
from fuzz.outcomes import time_limit

ROOT = os.path.dirname(ss.__file__)
# What Python, NumPy and others say of their own internals.
RAW = re.compile(
    r"truth value|unhashable|has no attribute|not subscriptable|\baxis\b.*out of bounds"
    r"|index out of range|is not iterable|object is not callable|unsupported operand"
    r"|not supported between|cannot unpack|not enough values to unpack|too many values to unpack"
    r"|could not convert string|invalid literal|expected str, bytes|ufunc|broadcast together"
    r"|cannot reshape|setting an array element|object of type|must be real number,"
    r"|cannot be interpreted as an integer|could not be broadcast|is not an instance of"
    r"|object cannot be converted|numpy boolean|has no len|inhomogeneous|concatenate"
)
TEXTS = 1500
KNOWN = (ss.ValidationError, ss.CutLocusError, ss.ConvergenceError)


def trouble(error, names):
    """What is wrong with an error, None if nothing is."""
    text = str(error)
    frames = traceback.extract_tb(error.__traceback__)
    inside = frames[-1].filename.startswith(ROOT)
    if isinstance(error, (KeyboardInterrupt, SystemExit, AssertionError)):
        return "is not an error of this library"
    if not text and not isinstance(error, MemoryError):
        return "says nothing"
    if isinstance(error, (OSError, ImportError)) and not isinstance(error, ss.ValidationError):
        return None
    if len(text) > TEXTS:
        return f"has {len(text)} letters"
    if any(unicodedata.category(letter) in ("Cc", "Cs") and letter != "\n" for letter in text):
        return "has control characters"
    if RAW.search(text):
        return "shows internals"
    if isinstance(error, (*KNOWN, MemoryError)):
        return None
    if isinstance(error, TypeError) and (inside or len(frames) <= 2):
        return None if any(name in text for name in names) else "names no argument"
    if type(error) is IndexError and inside and "index" in names:
        # By which Python ends a loop.
        return None
    if type(error) is ValueError and inside:
        return None
    return "is of a kind that is not documented"


def names_of(call):
    try:
        return inspect.signature(call).parameters
    except (TypeError, ValueError):
        return {}


def arguments(rng, call, good, bad):
    """Positional and keyword arguments by the signature of a call."""
    found, by_name = [], {}
    for name, parameter in names_of(call).items():
        values = good.get(name, bad) if rng.random() < 0.7 else bad
        value = values[rng.integers(len(values))]
        if parameter.kind in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL):
            continue
        required = parameter.default is parameter.empty
        if parameter.kind is parameter.KEYWORD_ONLY or by_name:
            if required or rng.random() < 0.2:
                by_name[name] = value
        elif required or rng.random() < 0.4:
            found.append(value)
        else:
            by_name |= {} if rng.random() < 0.7 else {name: value}
            if not by_name:
                break
    return found, by_name


def calls():
    """All calls by name; those of objects are looked up anew, as calls may change what they are of."""
    things = objects()
    found = dict(functions())
    for label, thing in things.items():
        for name in methods(thing):
            found[f"<{label}>.{name}"] = getattr(thing, name)
    return things, found


THINGS, CALLS = calls()


def test_everything_public_is_called():
    # Every class and module of the package is among them.
    assert len(CALLS) > 300
    for name in ("CubicSpline", "geo.cog", "<CubicSpline>.transport", "poses.imu", "quantum.pulses"):
        assert name in CALLS


@pytest.mark.parametrize("part", range(4))
def test_every_public_call(part, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    seed = int.from_bytes(os.urandom(4), "big")
    failed = defaultdict(list)
    for number in range(300):
        good, bad = pools(THINGS)
        for name, call in sorted(CALLS.items())[part::4]:
            rng = np.random.default_rng([seed, number, len(name), *name.encode()])
            found, by_name = arguments(rng, call, good, bad)
            with warnings.catch_warnings(), np.errstate(all="ignore"), time_limit():
                warnings.simplefilter("ignore")
                try:
                    call(*found, **by_name)
                except BaseException as error:
                    what = trouble(error, [*names_of(call), "argument", "arguments"])
                    if what is not None:
                        frame = traceback.extract_tb(error.__traceback__)[-1]
                        place = f"{os.path.basename(frame.filename)}:{frame.lineno}"
                        failed[type(error).__name__, place].append(
                            f"{name}(*{found!r}, **{by_name!r})"[:300] + f" {what}: {str(error)[:200]!a}"
                        )
    assert not failed, f"{len(failed)} places, seed {seed}:\n" + "\n".join(
        f"{kind} at {place}: {lines[0]}" for (kind, place), lines in failed.items()
    )
