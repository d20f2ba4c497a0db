"""Files of curves, with the names that their columns had in the table."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from .._base.arrays import brief
from .._grid import GridSpline
from .._spaces import Space
from .._splines.archive import json_in, read
from .._splines.composed import SegmentedCurve
from .._splines.cubic import CubicSpline
from .._splines.files import load, save
from ._files import Source, writing
from ._formats import CURVES
from ._messages import Problem, did_you_mean, refuse
from ._points import GLOBE, LONLAT, Columns, count_with_quaternion, labels, require_globe

_COLUMNS = "columns"
"""The entry of the file with the columns, which the library ignores."""


@dataclass(frozen=True)
class Curves:
    """Curves of one space.

    Attributes
    ----------
    splines : dict
        Curves by name.
    named : bool
        Whether the names have a meaning.
    columns : Columns
        Names of their columns in a table.
    file : Source or None
        The file that was read.
    segmented : bool
        Whether the curves are the segments of one recording, in the order of time.
    """

    splines: Mapping[str, CubicSpline]
    named: bool
    columns: Columns
    segmented: bool = False
    file: Source | None = None

    @property
    def recordings(self) -> dict[str, list[str]]:
        """The names of the segments of every recording that was cut at gaps, and of every other curve itself."""
        if self.segmented:
            return {"": list(self.splines)}
        found: dict[str, list[str]] = {}
        for name in self.splines:
            base, _, number = name.rpartition("/")
            found.setdefault(base if self.columns.cut and number.isdecimal() else name, []).append(name)
        return found

    def called(self, name: str) -> str:
        """Refer to a curve in a message."""
        return f"{'segment' if self.segmented else 'curve'} {name!r}" if self.named else "the curve"

    def chosen(self, names: Sequence[str] | None) -> Curves:
        """Return the curves of these names, with all segments of each; a single one needs no name."""
        if names is None:
            return self
        splines: dict[str, CubicSpline] = {}
        refuse(self.file, (not self.named, " has one curve without a name; omit --curve"))
        for name in names:
            # A curve that was cut at gaps has the segments NAME/1, NAME/2, ...
            found = {key: own for key, own in self.splines.items() if name in (key, key.rpartition("/")[0])}
            refuse(self.file, (not found, f" has no curve {name!r}; {did_you_mean(name, list(self.splines))}"))
            splines |= found
        return replace(self, splines=splines, named=len(splines) > 1)


def write_curves(path: Path, curves: Curves) -> None:
    """Write curves to a file that `symspline.load` also reads."""
    splines: Any = curves.splines if curves.named else next(iter(curves.splines.values()))
    if curves.segmented:
        splines = SegmentedCurve(list(curves.splines.values()))
    with writing(path) as temporary:
        with open(temporary, "wb") as file:
            save(splines, file)
        add_entry(temporary, _COLUMNS, np.array(json.dumps(asdict(curves.columns))))


def add_entry(path: Path, name: str, array: NDArray[np.str_]) -> None:
    """Add an entry to a file of curves or of a grid, which the library ignores."""
    with zipfile.ZipFile(path, "a") as archive, archive.open(f"{name}.npy", "w") as entry:
        np.lib.format.write_array(entry, array)


def read_curves(path: Path, lonlat: bool = False) -> Curves:
    """Read the curves in a file of ``symspline fit`` or of the library; ``lonlat`` as for ``symspline sample``."""
    source = Source(path, CURVES[0])
    with source.open() as file:
        if not zipfile.is_zipfile(file):
            raise Problem(f"{source} is not a file of curves, such as `symspline fit` makes")
        file.seek(0)
        found = load(file)
        named = isinstance(found, dict)
        segmented = isinstance(found, SegmentedCurve)
        if segmented:
            found, named = {str(i): curve for i, curve in enumerate(found, 1)}, True
        for curve in found.values() if named else [found]:
            refuse(source, (isinstance(curve, GridSpline), " is a grid; symspline.load reads it"))
            if not isinstance(curve, CubicSpline):
                kind = type(curve).__name__
                raise Problem(f"{source} is a {kind}, whose acceleration jumps at knots; use symspline.load")
        if named:
            splines = found
        else:
            # The curves of a batch are named by their indices.
            indices = np.ndindex(found._batch)
            splines = {",".join(map(str, index)): reduce(getitem, index, found) for index in indices}
            named = len(splines) > 1
        space = next(iter(splines.values())).space
        if lonlat:
            require_globe(space)
        columns = _columns(source, file, space)
    if lonlat and not columns.lonlat:
        columns = replace(columns, points=LONLAT, lonlat=True)
    return Curves(splines, named, columns, segmented, source)


def _columns(path: object, file: BinaryIO, space: Space) -> Columns:
    """Return the columns that `write_curves` wrote, or the usual ones if another program wrote the curves."""
    try:
        entries = read(file, lambda name: name == _COLUMNS)
        columns = Columns(**json_in(entries, _COLUMNS)) if entries else Columns(labels(space))
    except OSError:
        raise
    except Exception as error:
        # Damaged files raise errors of zipfile, of its decompressors and of NumPy.
        raise Problem(f"{path} is damaged: {brief(error)}") from None
    names, order = columns.points, columns.quaternion
    numbers = count_with_quaternion(space) if order else len(labels(space))
    texts = isinstance(names, list) and all(isinstance(name, str) for name in (*names, columns.time, columns.curve))
    good = (
        texts
        and all(isinstance(own, bool) for own in (columns.lonlat, columns.cut, columns.degrees))
        and columns.utc in (True, False, None)
    )
    if good and columns.lonlat:
        good = len(names) == len(LONLAT) and space == GLOBE and order is None
    elif good:
        whole = order is None or (isinstance(order, list) and all(type(i) is int for i in order))
        good = len(names) == numbers and whole and (order is None or sorted(order) == list(range(len(names))))
    refuse(path, (not good, f" is damaged: its names of columns do not suit {space}"))
    return columns
