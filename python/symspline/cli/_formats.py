"""The formats of tables: the ending of each, how it is read, and how it is written."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path, PurePath
from typing import BinaryIO, NamedTuple

from . import _binary, _csv, _records
from ._messages import alternatives, refuse
from ._streams import STANDARD, Source, written
from ._tables import Array, Layout, Table


class _Format(NamedTuple):
    read: Callable[[Source], Table]
    write: Callable[[BinaryIO, Mapping[str, Array], Layout], None]
    endings: tuple[str, ...]
    text: bool = True


_FORMATS = {
    "csv": _Format(_csv.read_csv, _csv.write_csv, ("csv", "tsv")),
    "npz": _Format(_binary.read_npz, _binary.write_npz, ("npz",), False),
    "parquet": _Format(_binary.read_parquet, _binary.write_parquet, ("parquet",), False),
    "json": _Format(_records.read_json, _records.write_json, ("json",)),
    "geojson": _Format(_records.read_geojson, _records.write_geojson, ("geojson",)),
    "gpx": _Format(_records.read_gpx, _records.write_gpx, ("gpx",)),
    "tum": _Format(_binary.read_tum, _binary.write_tum, ("tum", "txt")),
}
TABLES = tuple(_FORMATS)
CURVES = ("npz",)


def format_of(path: Path, given: str | None, known: Sequence[str] = TABLES, what: str = "a table") -> str:
    """Return the format of a file: the given one, that of its ending, or the first one for a standard stream."""
    if given is not None or path == STANDARD:
        return given or known[0]
    name = PurePath(path.name.lower())
    unpacked = PurePath(name.stem) if name.suffix == ".gz" else name
    formats = {f".{end}": form for form in known for end in _FORMATS[form].endings}
    form = formats.get(unpacked.suffix, "")
    wrong = not form or (unpacked != name and is_binary(form))
    refuse(path, (wrong, f": the name of {what} must end in {alternatives([*formats])}"))
    return form


def is_binary(form: str) -> bool:
    """Whether files of this format are not text."""
    return not _FORMATS[form].text


def endings() -> str:
    """List the endings of names of tables for a help text."""
    return ", ".join(f".{end}" for form in _FORMATS.values() for end in form.endings)


def open_table(path: Path, given: str | None = None) -> Table:
    """Read the table in a file whose format is the given one or that of its ending."""
    source = Source(path, format_of(path, given))
    return _FORMATS[source.format].read(source)


def write_table(path: Path, form: str, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write columns of equal length to a file."""
    with written(path) as file:
        _FORMATS[form].write(file, columns, layout)
