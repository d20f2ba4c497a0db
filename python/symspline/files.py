"""Curves in files: NPZ, read without pickle and without a new fit."""

from __future__ import annotations

import json
import os
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import ValidationError
from ._ends import ends_of
from ._times import clock_of
from .product import Product, ProductSpline
from .report import Report
from .spaces import Space
from .spaces import space as space_named
from .spline import CubicSpline, _policy

_FORMAT = "symspline-curve"
_VERSION = 1


def save(spline: CubicSpline, file: Any) -> None:
    """See `CubicSpline.save`."""
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
    if hasattr(file, "write"):
        np.savez(file, **arrays)
        return
    with replacing(Path(file)) as temporary, open(temporary, "wb") as out:
        np.savez(out, **arrays)


class replacing:
    """A temporary file beside ``path`` that takes its place if all goes well, and is gone if not."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __enter__(self) -> Path:
        handle, name = tempfile.mkstemp(dir=self.path.parent, prefix=f".{self.path.name}.")
        os.close(handle)
        self.temporary = Path(name)
        return self.temporary

    def __exit__(self, kind: Any, *_: object) -> None:
        try:
            if kind is None:
                # mkstemp's files are private; a result gets the rights of any new file.
                mask = os.umask(0)
                os.umask(mask)
                self.temporary.chmod(0o666 & ~mask)
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
    name = getattr(file, "name", file if isinstance(file, (str, os.PathLike)) else "the file")
    if not hasattr(file, "read") and not isinstance(file, (str, os.PathLike)):
        raise TypeError(f"a path or an open file is needed, not {file!r}")
    try:
        if hasattr(file, "read"):
            return _read(_arrays_of(file))
        with open(file, "rb") as opened:
            return _read(_arrays_of(opened))
    except (OSError, MemoryError):
        raise
    except ValidationError as error:
        raise ValidationError(f"{name}: {error}") from None
    except Exception as error:
        # Damage shows as errors of zipfile, of its decompressors, of NumPy and of JSON.
        raise ValidationError(f"{name} is damaged or not a symspline curve: {error}") from None


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


def _read(arrays: dict[str, NDArray[Any]]) -> CubicSpline:
    if str(arrays["format"]) != _FORMAT:
        raise ValidationError(f"format {str(arrays['format'])!r}, expected {_FORMAT!r}")
    version = int(arrays["version"])
    if version != _VERSION:
        raise ValidationError(
            f"version {version}; this symspline reads version {_VERSION}, a newer one may read it"
        )
    space = space_named(str(arrays["space"]))
    factors = space.factors if isinstance(space, Product) else (space,)
    bc_type = _rich(json.loads(str(arrays["bc_type"])))
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
            factor._doubles(arrays[key + suffix], key + suffix) for key in ("points", "velocities")
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
    if np.abs(off).max(initial=0.0) > 1e-8 * np.abs(velocities[finite]).max(initial=1e-8):
        raise ValidationError("velocities are not tangent")


def _factor_ends(bc_type: Any, i: int) -> Any:
    if isinstance(bc_type, str):
        return bc_type
    return tuple(end if isinstance(end, str) else (end[0], end[1][i]) for end in bc_type)


def _report(plain: dict[str, Any], batch: tuple[int, ...]) -> Report:
    kinds = {"converged": "b", "iterations": "i", "residual": "f", "max_step": "f", "rate": "f"}

    def column(key: str, value: Any) -> Any:
        array = np.asarray(value)
        if key in kinds and (array.shape != batch or array.dtype.kind != kinds[key]):
            raise ValidationError(f"the report's {key} is {value!r}")
        return array if key in kinds and batch else value

    if not isinstance(plain["method"], str):
        raise ValidationError(f"the report's method is {plain['method']!r}")
    return Report(**{key: column(key, value) for key, value in plain.items()})


def _plain(value: Any) -> Any:
    """As JSON can hold it: arrays become lists."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    return value


def _rich(value: Any) -> Any:
    """End conditions back from JSON."""
    if isinstance(value, str):
        return value
    return tuple(end if isinstance(end, str) else (end[0], _vectors(end[1])) for end in value)


def _vectors(value: Any) -> Any:
    """An array; for a product whose factors differ in shape, a tuple of arrays."""
    try:
        return np.asarray(value, dtype=np.float64)
    except ValueError:
        return tuple(np.asarray(part, dtype=np.float64) for part in value)
