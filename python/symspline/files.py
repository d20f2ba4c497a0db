"""Curves in files: NPZ, read without pickle and without a new fit."""

from __future__ import annotations

import json
import os
import secrets
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ._arrays import brief, shown
from ._core import ValidationError
from ._ends import ends_of
from ._times import clock_of
from .product import Product, ProductSpline
from .report import Report
from .spaces import Hyperbolic, Space
from .spaces import space as space_named
from .spline import CubicSpline, _policy

_T = TypeVar("_T")

_FORMAT = "symspline-curve"
_MANY = "symspline-curves"
_LISTS = ("bc_type", "extrapolate", "report")
_VERSION = 1


def save(spline: CubicSpline, file: Any) -> None:
    """See `CubicSpline.save`."""
    _write(file, _arrays_of_curve(spline))


def save_many(curves: Mapping[str, CubicSpline], file: Any) -> None:
    """Write curves of one space, of any lengths, to one NPZ file, which `load_many` reads back.

    Knots, points and velocities of all curves follow each other in one array each; ``knots`` holds how
    many of them every curve has, ``names`` and the conditions and reports are lists in JSON.

    Args:
        curves: names and curves, none of them a batch; the knots of all are numbers, or all dates of one unit.
        file: where to write, a name or an open file.

    >>> import io, symspline as ss
    >>> square = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    >>> long, short = ss.fit_many([(None, square), ([0, 2], square[:2])], "sphere:2")
    >>> file = io.BytesIO()
    >>> ss.save_many({"long": long, "short": short}, file)
    >>> _ = file.seek(0)
    >>> ss.load_many(file) == {"long": long, "short": short}
    True
    """
    if not isinstance(curves, Mapping) or not all(isinstance(c, CubicSpline) for c in curves.values()):
        raise TypeError("curves must be a dictionary of names and splines")
    if not all(isinstance(name, str) for name in curves):
        raise ValidationError("names of curves must be text")
    if any(spline._batch for spline in curves.values()):
        raise ValidationError("save_many takes single curves; a batch has a method save of its own")
    if len({(spline.space, spline._t.dtype) for spline in curves.values()}) != 1:
        raise ValidationError("save_many needs curves, all of one space and with knots of one type")
    each = [_arrays_of_curve(spline) for spline in curves.values()]
    arrays: dict[str, Any] = {
        "format": _MANY,
        "names": json.dumps(list(curves)),
        "knots": [len(a["t"]) for a in each],
    }
    for key in each[0]:
        values = [a[key] for a in each]
        if key in _LISTS:
            arrays[key] = json.dumps([json.loads(value) for value in values])
        elif isinstance(values[0], np.ndarray):
            arrays[key] = np.concatenate(values)
        else:
            arrays.setdefault(key, values[0])
    _write(file, arrays)


def _arrays_of_curve(spline: CubicSpline) -> dict[str, Any]:
    parts = spline._parts if isinstance(spline, ProductSpline) else (spline,)
    unit = _unit(spline._t.dtype) if spline._clock.dates else ""
    arrays: dict[str, Any] = {
        "format": _FORMAT,
        "version": _VERSION,
        "space": str(spline.space),
        "t": spline._t.astype(np.int64) if unit else spline._t,
        "t_unit": unit,
        "bc_type": json.dumps(_plain(spline.bc_type)),
        "extrapolate": json.dumps(spline.extrapolate),
        "report": json.dumps([_plain(vars(part.report)) for part in parts]),
    }
    for i, part in enumerate(parts):
        suffix = f"_{i}" if len(parts) > 1 else ""
        arrays["points" + suffix] = part.points
        arrays["velocities" + suffix] = part.velocities
    return arrays


def _write(file: Any, arrays: dict[str, Any]) -> None:
    if hasattr(file, "write"):
        np.savez(file, **arrays)
        return
    with replacing(Path(file)) as temporary, open(temporary, "wb") as out:
        np.savez(out, **arrays)


class replacing:
    """A temporary file beside ``path``, with the same ending, that takes its place if all goes well, and is
    gone if not."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __enter__(self) -> Path:
        self.temporary = self.path.with_name(f".{self.path.stem}.{secrets.token_hex(8)}{self.path.suffix}")
        # Created here, with the rights of any new file, so that a later open finds it.
        os.close(os.open(self.temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        return self.temporary

    def __exit__(self, kind: Any, *_: object) -> None:
        try:
            if kind is None:
                self.temporary.replace(self.path)
        finally:
            with suppress(FileNotFoundError):
                self.temporary.unlink()


def load(file: Any) -> CubicSpline:
    """Read a curve that `CubicSpline.save` wrote.

    Raises:
        ValidationError: the file is damaged, or not a symspline curve.
        OSError: the file cannot be read.

    >>> import io, symspline as ss
    >>> file = io.BytesIO()
    >>> spline = ss.CubicSpline(None, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "sphere:2")
    >>> spline.save(file)
    >>> _ = file.seek(0)
    >>> ss.load(file) == spline
    True
    """
    return _opened(file, _read)


def load_many(file: Any) -> dict[str, CubicSpline]:
    """Read the curves that `save_many`, or ``symspline fit --curve`` on the command line, wrote.

    Returns:
        Names and curves, in the order in which they were written.

    Raises:
        ValidationError: the file is damaged, or does not hold symspline curves.
        OSError: the file cannot be read.
    """
    return _opened(file, _read_many)


def _opened(file: Any, read: Callable[[dict[str, NDArray[Any]]], _T]) -> _T:
    name = getattr(file, "name", file if isinstance(file, (str, os.PathLike)) else "the file")
    if not hasattr(file, "read") and not isinstance(file, (str, os.PathLike)):
        raise TypeError(f"a path or an open file is needed, not {file!r}")
    try:
        if hasattr(file, "read"):
            return read(_arrays_of(file))
        with open(file, "rb") as opened:
            return read(_arrays_of(opened))
    except (OSError, MemoryError):
        raise
    except ValidationError as error:
        raise ValidationError(f"{name}: {error}") from None
    except Exception as error:
        # Damage shows as errors of zipfile, of its decompressors, of NumPy and of JSON.
        raise ValidationError(f"{name} is damaged or not a symspline curve: {brief(error)}") from None


def _unit(dtype: np.dtype[Any]) -> str:
    """The unit of dates: "ns", or "10m" if they count in tens of minutes."""
    unit, step = np.datetime_data(dtype)
    return unit if step == 1 else f"{step}{unit}"


def _arrays_of(file: Any) -> dict[str, NDArray[Any]]:
    archive = np.load(file, allow_pickle=False)
    if not isinstance(archive, np.lib.npyio.NpzFile) or "format" not in archive:
        raise ValidationError("this is not a symspline curve")
    with archive:
        return {key: archive[key] for key in archive.files}


def _read_many(arrays: dict[str, NDArray[Any]]) -> dict[str, CubicSpline]:
    if str(arrays["format"]) == _FORMAT:
        raise ValidationError("this file holds no collection of curves; read it with symspline.load")
    if str(arrays["format"]) != _MANY:
        raise ValidationError(f"format {str(arrays['format'])!r}, expected {_MANY!r}")
    names, ends = json.loads(str(arrays["names"])), np.cumsum(arrays["knots"])
    if ends[-1:].tolist() != [len(arrays["t"])]:
        raise ValidationError(f"the curves have {arrays['knots'].sum()} knots, but t has {len(arrays['t'])}")
    lists = {key: json.loads(str(arrays[key])) for key in _LISTS}
    curves = {}
    for i, (name, end) in enumerate(zip(names, ends, strict=True)):
        own = slice(end - arrays["knots"][i], end)
        one = {key: array[own] if array.ndim else array for key, array in arrays.items()}
        one |= {key: np.array(json.dumps(values[i])) for key, values in lists.items()}
        curves[str(name)] = _read(one | {"format": np.array(_FORMAT)})
    return curves


def _read(arrays: dict[str, NDArray[Any]]) -> CubicSpline:
    if str(arrays["format"]) == _MANY:
        raise ValidationError("this file holds several curves; read them with symspline.load_many")
    if str(arrays["format"]) != _FORMAT:
        raise ValidationError(f"format {str(arrays['format'])!r}, expected {_FORMAT!r}")
    version = int(arrays["version"])
    if version != _VERSION:
        raise ValidationError(
            f"version {version}; this symspline reads version {_VERSION}, a newer one may read it"
        )
    space = space_named(str(arrays["space"]))
    factors = space.factors if isinstance(space, Product) else (space,)
    bc_type = _rich(json.loads(str(arrays["bc_type"])), len(factors))
    extrapolate = _policy(json.loads(str(arrays["extrapolate"])))
    unit = str(arrays["t_unit"])
    shown = arrays["t"].astype(f"datetime64[{unit}]") if unit else arrays["t"]
    clock, shown = clock_of(shown)
    times = clock.knots(shown)
    if not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
        raise ValidationError("the knots do not increase")
    parts = []
    for i, factor in enumerate(factors):
        suffix = f"_{i}" if len(factors) > 1 else ""
        points, velocities = (
            factor._numbers(factor._doubles(arrays[key + suffix], key + suffix))
            for key in ("points", "velocities")
        )
        nodes = points.shape[: points.ndim - len(factor.point_shape)]
        if points.shape != velocities.shape or not nodes or times.shape not in ((nodes[-1],), nodes):
            raise ValidationError(
                f"shapes do not fit: t {times.shape}, points {points.shape}, velocities {velocities.shape}"
            )
        if nodes[-1] < 2:
            raise ValidationError("a curve needs at least two points")
        factor.check_point(points)
        report = _report(json.loads(str(arrays["report"]))[i], nodes[:-1])
        _check_velocities(factor, points, velocities, report)
        ends = bc_type if len(factors) == 1 else _factor_ends(bc_type, i)
        ends_of(ends, factor, nodes[:-1])
        parts.append(
            CubicSpline._made(factor, clock, shown, times, points, velocities, ends, extrapolate, report)
        )
    if isinstance(space, Product):
        return ProductSpline._of_parts(space, tuple(parts), bc_type)
    return parts[0]


def _check_velocities(space: Space, points: Any, velocities: Any, report: Report) -> None:
    """They are tangent; only curves that failed may be NaN."""
    finite = np.isfinite(velocities).all(axis=tuple(range(-1 - len(space.point_shape), 0)))
    if not (finite | ~np.asarray(report.converged)).all():
        raise ValidationError("velocities are not finite")
    off = velocities[finite] - space.project_tangent(points[finite], velocities[finite])
    # Far out in hyperbolic space rounding counts |p|² as much.
    far = float(np.square(points).max(initial=0.0)) if isinstance(space, Hyperbolic) else 0.0
    allowed = 1e-8 + 100 * np.finfo(np.float64).eps * far
    if np.abs(off).max(initial=0.0) > allowed * np.abs(velocities[finite]).max(initial=1e-8):
        raise ValidationError("velocities are not tangent")


def _factor_ends(bc_type: Any, i: int) -> Any:
    if isinstance(bc_type, str):
        return bc_type
    return tuple(end if isinstance(end, str) else (end[0], end[1][i]) for end in bc_type)


def _report(plain: dict[str, Any], batch: tuple[int, ...]) -> Report:
    numbers = dict.fromkeys(("residual", "max_step", "curvature", "invariant_radius", "rate"), "f")
    kinds = {"converged": "b", "iterations": "i"} | numbers

    def column(key: str, value: Any) -> Any:
        if key not in kinds or (key == "invariant_radius" and value is None):
            return value
        shape = () if key == "curvature" else batch
        array = np.asarray(value)
        if array.shape != shape or array.dtype.kind != kinds[key]:
            raise ValidationError(f"the report's {key} is {shown(value)}")
        return array if shape else value

    if not isinstance(plain["method"], str):
        raise ValidationError(f"the report's method is {shown(plain['method'])}")
    return Report(**{key: column(key, value) for key, value in plain.items()})


def _plain(value: Any) -> Any:
    """As JSON can hold it: arrays become lists, complex ones two."""
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "c":
            return {"re": value.real.tolist(), "im": value.imag.tolist()}
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    return value


def _rich(value: Any, factors: int) -> Any:
    """End conditions back from JSON; in a product vectors are tuples of arrays."""
    if isinstance(value, str):
        return value

    def vectors(plain: Any) -> Any:
        return _array(plain) if factors == 1 else tuple(_array(part) for part in plain)

    return tuple(end if isinstance(end, str) else (end[0], vectors(end[1])) for end in value)


def _array(plain: Any) -> NDArray[Any]:
    if isinstance(plain, dict):
        numbers = np.empty(np.shape(plain["re"]), np.complex128)
        numbers.real, numbers.imag = plain["re"], plain["im"]
        return numbers
    return np.asarray(plain, dtype=np.float64)
