"""Curves in files: NPZ, read without pickle and without a new fit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import nullcontext
from typing import Any

import numpy as np

from .._base.arrays import short_repr
from .._base.system import damage, path_of
from .._base.typing import File, State
from .._core import ValidationError
from .archive import FORMATS, OPTIONAL, TEXTS, Entries, Stored, read_state, restore, write
from .base import Curve, UserCurve

# Entries with one value for all curves of a file.
_SHARED = (*TEXTS, "version")


def save(curves: UserCurve | Mapping[str, UserCurve], file: File) -> None:
    """Write a curve, or several curves by name, to an NPZ file that `load` reads.

    Parameters
    ----------
    curves : Curve or mapping of str to Curve
        A curve, a batch, or a mapping of names to single curves of any lengths. All curves of a mapping must have the
        same class, the same space and times of the same type.
    file : path or binary file
        File to write. An existing file is replaced as a whole once all data are on disk.

    Raises
    ------
    ValidationError
        If the curves cannot be stored in one file, or are on a `Manifold` that is made of functions.
    OSError
        If the file cannot be written.

    See Also
    --------
    load : Read the curves.
    CubicSpline.save : Write one curve.

    Notes
    -----
    Entries with one row per knot or per data point follow each other in one array for all curves of a mapping.

    Examples
    --------
    >>> import io, symspline as ss
    >>> square = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    >>> long, short = ss.fit_many([(None, square), ([0, 2], square[:2])], "sphere:2")
    >>> file = io.BytesIO()
    >>> ss.save({"long": long, "short": short}, file)
    >>> _ = file.seek(0)
    >>> ss.load(file) == {"long": long, "short": short}
    True
    """
    state = getattr(curves, "_state", None)
    if state and isinstance(curves, tuple(FORMATS.values())):
        write(file, state())
    elif isinstance(curves, Mapping) and all(isinstance(curve, Curve) for curve in curves.values()):
        write(file, _joined(curves))
    else:
        raise TypeError(f"curves must be a Curve or a mapping of names to Curves, not {short_repr(curves)}")


def load(file: File) -> Any:
    """Read what `save`, the method `CubicSpline.save` or ``symspline fit`` on the command line wrote.

    Parameters
    ----------
    file : path or binary file
        File to read.

    Returns
    -------
    Curve or dict of str to Curve
        The curve or batch, of the class that was saved, or the curves of a mapping in the order in which they were
        written.

    Raises
    ------
    ValidationError
        If the file is damaged, does not hold symspline curves, or was written by a newer version of symspline.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import io, symspline as ss
    >>> file = io.BytesIO()
    >>> spline = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "sphere:2")
    >>> spline.save(file)
    >>> _ = file.seek(0)
    >>> ss.load(file) == spline
    True
    """
    path = path_of(file, method="read")
    name = getattr(file, "name", "the file") if path is None else path
    damaged = damage(name, "is damaged or not a symspline curve")
    with nullcontext(file) if path is None else open(path, "rb") as opened, damaged:
        return _restored(read_state(opened))


def _joined(curves: Mapping[str, Curve]) -> State:
    """Return the state of several curves: arrays are concatenated, all else is in lists."""
    if not curves or not all(isinstance(name, str) for name in curves):
        raise ValidationError("curves must be a mapping with at least one curve, whose keys are text")
    for name, curve in curves.items():
        if curve._batch:
            raise ValidationError(f"curves[{name!r}] is a batch. Save it by itself, or pass its curves one by one.")
    states = [curve._state() for curve in curves.values()]
    names = list(curves)
    # Optional arrays that a curve lacks have no rows.
    optional = {
        key: value[:0]
        for state in states
        for key, value in state.items()
        if OPTIONAL.fullmatch(key) and isinstance(value, np.ndarray)
    }
    states = [state | {key: none for key, none in optional.items() if key not in state} for state in states]
    first = states[0]
    for name, state in zip(names, states, strict=True):
        ours, theirs = _layout(first), _layout(state)
        for key in ours.keys() | theirs.keys():
            if ours.get(key) != theirs.get(key):
                raise ValidationError(
                    f"curves[{name!r}] and curves[{names[0]!r}] differ in {key!r}, but the curves in one file must be "
                    "of one class and of one space, with times of one type. Save them in separate files."
                )
    joined: State = {"names": names, "rows": {}}
    for key, value in first.items():
        values = [state[key] for state in states]
        if isinstance(value, np.ndarray):
            joined[key], joined["rows"][key] = np.concatenate(values), [len(array) for array in values]
        else:
            joined[key] = value if key in _SHARED else values
    return joined


def _layout(state: State) -> State:
    """Return the parts of a state that all curves of a file must share."""

    def shared(key: str, value: object) -> Any:
        if key in _SHARED:
            return value
        return (value.dtype, value.shape[1:]) if isinstance(value, np.ndarray) else ()

    return {key: shared(key, value) for key, value in state.items()}


def _restored(state: Stored) -> Any:
    if "names" not in state:
        return restore(state)
    curves = {}
    for name, part in _states(state):
        try:
            curves[name] = restore(part)
        except ValidationError as error:
            raise ValidationError(f"curve {short_repr(name)}: {error}") from None
    return curves


def _states(state: Stored) -> Iterator[tuple[str, Entries]]:
    """Yield the names and states of several curves."""
    names, rows = state["names"], state["rows"]
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ValidationError("entry 'names' must be a list of texts")
    if len(set(names)) < len(names):
        raise ValidationError("entry 'names' holds a name twice")
    arrays = {key: value for key, value in state.items() if isinstance(value, np.ndarray) and value.ndim}
    lists = {key: state[key] for key in state.keys() - {*_SHARED, *arrays, "names", "rows"}}
    if not isinstance(rows, dict) or set(rows) != set(arrays):
        raise ValidationError(f"entry 'rows' must have the numbers of rows of {', '.join(arrays)}")
    for key, value in sorted(lists.items()) + sorted(rows.items()):
        if not isinstance(value, list) or len(value) != len(names):
            raise ValidationError(f"entry {key!r} must be a list with one value for each of {len(names)} curves")
    for key, counts in rows.items():
        if not all(type(count) is int and count >= 0 for count in counts) or sum(counts) != len(arrays[key]):
            raise ValidationError(
                f"entry 'rows' has {short_repr(counts)} for {key!r}, which does not add up to {len(arrays[key])} rows"
            )
    ends = {key: np.cumsum(counts).tolist() for key, counts in rows.items()}
    for i, name in enumerate(names):
        part = Stored(state)
        for key, counts in rows.items():
            part[key] = arrays[key][ends[key][i] - counts[i] : ends[key][i]]
            if not counts[i] and OPTIONAL.fullmatch(key):
                del part[key]
        part |= {key: values[i] for key, values in lists.items()}
        yield name, part
