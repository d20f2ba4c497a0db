"""Tables in text: CSV with commas, semicolons or tabs."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from itertools import groupby, islice
from typing import Any, BinaryIO

import numpy as np

from .._core import number_lines
from ._messages import Problem, Progress, first_duplicate, refuse
from ._streams import Source
from ._tables import FIRST, IM, RE, Array, Layout, Table, Texts
from ._times import is_number

# So few rows stay in the processor's cache, which is three times faster than reading all at once.
_CHUNK = 2000
# Bytes from which on pyarrow saves more time than its import takes.
_LARGE = 1_000_000
_SEPARATOR = ["sep=", ""]
"""The cells of a line ``sep=;``."""
_COMPLEX = re.compile(r"\(?[-+]?[\d.e]+([-+]?\d+)?([-+][\d.e]+([-+]\d+)?)?j\)?", re.ASCII)
_WRITTEN = 50_000
"""Rows that are written between two updates of the progress."""


# ---- reading ----


def read_csv(path: Source) -> Table:
    """Read text in UTF-8 with cells separated by commas, semicolons or tabs, and names of columns in the first line.

    Blank lines are skipped, and a line ``sep=;`` as well, with which Excel begins. Between semicolons, numbers may have
    a decimal comma. Complex numbers such as ``(1+2j)``, as pandas writes them, become two columns.
    """
    with path.open() as file:
        first = next(filter(bytes.strip, file), b"")
    mark = max(",;\t", key=lambda mark: first.count(mark.encode()))
    with _rows(path, mark) as (rows, place):
        names = [name.strip() for name in next(rows, [])]
        head_lines = int(place().removeprefix("line "))
        empty = next(rows, None) is None
    twice = first_duplicate([name for name in names if name])
    refuse(
        path,
        (not names, " is empty"),
        (all(is_number(name.replace(",", ".")) for name in names), ": the first line must name the columns, but "
         "holds numbers"),
        (twice is not None, f": the first line names two columns {twice!r}"),
        (empty, " has no rows below the names of its columns"),
    )  # fmt: skip
    columns = _columns_at_once(path, mark, len(names), head_lines) or _columns(path, mark, len(names))
    found = {name: Texts(cells, mark == ";") for name, cells in zip(names, columns, strict=True) if name}
    return Table(path, _with_parts(found), partial(_place, path, mark))


def _with_parts(columns: dict[str, Texts]) -> dict[str, Any]:
    """Return the columns, with real and imaginary parts in place of complex numbers."""
    found: dict[str, Any] = {}
    for name, own in columns.items():
        first = next(filter(None, own.tolist(FIRST)), "")
        values = None
        if _COMPLEX.fullmatch(first):
            with suppress(ValueError):
                values = np.array([complex(cell or "nan") for cell in own.tolist()])
        found |= {name: own} if values is None else {name + RE: values.real, name + IM: values.imag}
    return found


def _columns(path: Source, mark: str, width: int) -> list[list[str]]:
    """Return the cells of every column."""
    columns: list[list[str]] = [[] for _ in range(width)]
    with _rows(path, mark) as (rows, _), Progress("reading"):
        next(rows)
        while chunk := list(islice(rows, _CHUNK)):
            for i, row in enumerate(chunk):
                if len(row) != width:
                    where = _place(path, mark, len(columns[0]) + i)
                    named = f"{len(row)} cells, but the first line names {width} column{'s' * (width > 1)}"
                    named += "; remove lines above the names, such as comments" if width == 1 else ""
                    raise Problem(f"{path}, {where}: {named}")
            for column, cells in zip(columns, zip(*chunk, strict=True), strict=True):
                column += cells
    return columns


def _columns_at_once(path: Source, mark: str, width: int, head_lines: int) -> list[Any] | None:
    """Read a large file with pyarrow. None if the file is small or unusual, or pyarrow is not installed."""
    with path.open() as file:
        text = file.read()
    # Blanks before quotes have another meaning in pyarrow.
    if len(text) < _LARGE or b' "' in text:
        return None
    try:
        import pyarrow as pa
        from pyarrow import csv as reader
    except ImportError:
        return None
    names = [str(i) for i in range(width)]
    with Progress("reading"):
        try:
            table = reader.read_csv(
                pa.BufferReader(text),
                reader.ReadOptions(column_names=names, skip_rows=head_lines),
                reader.ParseOptions(delimiter=mark),
                reader.ConvertOptions(column_types=dict.fromkeys(names, pa.string())),
            )
        except pa.ArrowInvalid:
            return None
    return [table[name] for name in names]


# The first bytes of text in UTF-16, which spreadsheets write.
_UTF16 = (b"\xff\xfe", b"\xfe\xff")


@contextmanager
def _rows(path: Source, mark: str) -> Iterator[tuple[Iterator[list[str]], Any]]:
    """Open the file, and return its rows that are not blank, and a function that names the line of the last one."""
    with path.open() as binary:
        text = io.TextIOWrapper(binary, encoding="utf-8-sig", newline="")
        reader = csv.reader(text, delimiter=mark, skipinitialspace=True, strict=True)

        def place() -> str:
            return f"line {reader.line_num}"

        try:
            yield (row for row in reader if row and row != _SEPARATOR), place
        except UnicodeDecodeError:
            binary.seek(0)
            encoding = "utf-16" if binary.read(2) in _UTF16 else "cp1252"
            raise Problem(f"{path} is not text in UTF-8; convert it, such as by iconv -f {encoding} -t utf-8") from None
        except csv.Error as error:
            raise Problem(f"{path}, {place()}: {error}") from None
        finally:
            text.detach()


def _place(path: Source, mark: str, row: int) -> str:
    """Name the line of a row."""
    with _rows(path, mark) as (rows, place):
        next(islice(rows, row + 1, None), None)
        return str(place())


# ---- writing ----


def write_csv(file: BinaryIO, columns: Mapping[str, Array], layout: Layout) -> None:
    """Write numbers as the shortest text that reads back equal, and dates in ISO 8601."""
    file.write(_line(columns))
    total = max(map(len, columns.values()))
    with Progress("writing") as progress:
        for start in range(0, total, _WRITTEN):
            progress(start, total)
            blocks: list[Sequence[str]] = []
            for is_float, group in groupby(columns.values(), lambda values: values.dtype.kind == "f"):
                chunk = [values[start : start + _WRITTEN] for values in group]
                if is_float:
                    blocks.append(number_lines(np.stack(chunk, axis=1), ",").splitlines())
                else:
                    blocks += [_cells(values, layout.utc) for values in chunk]
            lines = blocks[0] if len(blocks) == 1 else map(",".join, zip(*blocks, strict=True))
            file.write("".join(f"{line}\n" for line in lines).encode())


def _cells(values: Array, utc: bool | None) -> list[str]:
    if values.dtype.kind == "M":
        return date_texts(values, utc)
    if values.dtype.kind == "U":
        quoted = {text: _line([text]).decode().removesuffix("\n") for text in np.unique(values).tolist()}
        return [quoted[text] for text in values.tolist()]
    return list(map(str, values.tolist()))


def date_texts(dates: Array, utc: bool | None) -> list[str]:
    """Return dates in ISO 8601, with a Z if they are in UTC."""
    texts: list[str] = np.datetime_as_string(dates).tolist()
    return [text + "Z" for text in texts] if utc else texts


def _line(cells: Any) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue().encode()
