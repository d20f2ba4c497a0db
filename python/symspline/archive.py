"""How curves stand in an NPZ file, and writing them there."""

from __future__ import annotations

import json
import os
import secrets
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .manifolds.manifold import refuse_functions
from .piecewise import Piecewise
from .report import Report
from .spaces import Product, Space
from .times import Clock

FORMAT = "symspline-curve"
HERMITE = "symspline-hermite"
SMOOTHING = "symspline-smoothing"
MANY = "symspline-curves"
LISTS = ("bc_type", "extrapolate", "report", "noise")
VERSION = 1


def fitted_arrays(spline: Piecewise, reports: list[Report]) -> dict[str, Any]:
    """The arrays of one fitted curve, or of a batch, and how the fit went in every factor."""
    return arrays_of(spline, FORMAT) | {
        "bc_type": json.dumps(plain(spline._bc_type)),
        "report": json.dumps([_plain_report(report) for report in reports]),
    }


def arrays_of(spline: Piecewise, format: str) -> dict[str, Any]:
    """The arrays of one curve, or of a batch; the format says which kind of curve it is."""
    refuse_functions(
        spline.space,
        "curves are not saved (files hold no functions: pickle them, or keep t, points and velocities)",
        named=True,
    )
    arrays: dict[str, Any] = {
        "format": format,
        "version": VERSION,
        "space": str(spline.space),
        **times_arrays("t", spline._t, spline._clock),
        "extrapolate": json.dumps(spline.extrapolate),
    }
    for i, part in enumerate(spline._curve.parts):
        suffix = f"_{i}" if isinstance(spline.space, Product) else ""
        arrays["points" + suffix] = part.points
        arrays["velocities" + suffix] = part.velocities
    return arrays


def times_arrays(name: str, t: NDArray[Any], clock: Clock) -> dict[str, Any]:
    """Times as numbers, and the unit of dates."""
    unit = _unit(t.dtype, clock.zone) if clock.dates else ""
    return {name: t.astype(np.int64) if unit else t, f"{name}_unit": unit}


def write(file: Any, arrays: dict[str, Any]) -> None:
    """Write arrays to an open file, or to one with a name when all of it has been written."""
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


def _unit(dtype: np.dtype[Any], zone: str | None) -> str:
    """The unit of dates: "ns", or "10m" if they count in tens of minutes; and what is known of their zone: "ns UTC"."""
    unit, step = np.datetime_data(dtype)
    counted = unit if step == 1 else f"{step}{unit}"
    return counted if zone is None else f"{counted} {zone}"


def _plain_report(report: Report) -> dict[str, Any]:
    """All but the longest gap, which the knots show."""
    return {key: plain(value) for key, value in vars(report).items() if key != "max_gap"}


def plain(value: Any) -> Any:
    """As JSON can hold it: arrays become lists, complex ones two."""
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "c":
            return {"re": value.real.tolist(), "im": value.imag.tolist()}
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [plain(item) for item in value]
    return value


def rich(value: Any, space: Space) -> Any:
    """End conditions back from JSON; in a product vectors are tuples of arrays."""
    if isinstance(value, str):
        return value

    def vectors(plain: Any) -> Any:
        return tuple(map(_array, plain)) if isinstance(space, Product) else _array(plain)

    return tuple(end if isinstance(end, str) else (end[0], vectors(end[1])) for end in value)


def _array(plain: Any) -> NDArray[Any]:
    if isinstance(plain, dict):
        numbers = np.empty(np.shape(plain["re"]), np.complex128)
        numbers.real, numbers.imag = plain["re"], plain["im"]
        return numbers
    return np.asarray(plain, dtype=np.float64)
