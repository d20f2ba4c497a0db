"""Which column of a table is what."""

from __future__ import annotations

import csv

from .. import spaces
from ..spaces import Product, Space
from ..spaces.base import COMPLEX_TWINS
from .curves import Columns
from .entries import Entry, paired
from .errors import Problem, first_twice, listed
from .layout import complex_numbers, described
from .points import LONLAT
from .quaternions import count_of, places_of
from .tables import Table


def split_names(text: str | None) -> list[str]:
    """Names with commas between them; one that has a comma itself is quoted."""
    try:
        (names,) = csv.reader([text or ""], skipinitialspace=True)
    except (csv.Error, ValueError):
        raise Problem(f"{text!r} is no list of names with commas between them") from None
    return [name.strip() for name in names]


def point_entries(
    table: Table, given: list[str], others: list[str | None], space: Space, lonlat: bool, order: str | None
) -> tuple[list[Entry], list[int] | None]:
    """The numbers of a point: in columns that were named, or in all that are left; and, if a rotation is a quaternion,
    which of its numbers is where."""
    if given:
        groups = [table.expand(name) for name in given]
    elif lonlat:
        groups = [_lonlat(table)]
    else:
        groups = [table.points(others)]
    columns = [column for group in groups for column in group]
    if any(complex_numbers(space)):
        groups = [columns]
    # Else A_re and A_im are two real numbers if both were named.
    entries = [entry for group in groups for entry in paired(group)]
    for names in (columns, [entry.name for entry in entries]):
        twice = first_twice([*filter(None, others), *names])
        if twice is not None:
            raise Problem(f"column {twice!r} of {table.path} cannot have two meanings")
    names = [entry.name for entry in entries]
    if len(names) == count_of(space):
        return entries, places_of(names, space, order)
    if order is not None:
        raise Problem(
            f"--quaternion {order}: {listed(names) or 'no columns'} are not the {count_of(space) or 4} numbers of a "
            f"quaternion in {space}"
            if count_of(space)
            else f"--quaternion is for so:3, se:3 and products with one of them, not for {space}"
        )
    if not lonlat:
        _check_halves(table, entries, space, bool(given))
    _check_count(table, entries, others, space, lonlat, bool(given))
    return entries, None


def named_columns(entries: list[Entry], time: str | None, curve: str | None, lonlat: bool) -> Columns:
    """What a file of curves keeps of them."""
    standard = Columns([entry.name for entry in entries])
    return Columns(standard.points, time or standard.time, curve or standard.curve, lonlat)


def _lonlat(table: Table) -> list[str]:
    found = [table.find("lon", "longitude"), table.find("lat", "latitude")]
    columns = [name for name in found if name is not None]
    if len(columns) < 2:
        raise Problem(
            f"{table.path}: --lonlat needs columns lon and lat, or longitude and latitude, or two --columns; "
            f"there are {listed(table.names)}"
        )
    return columns


def _check_halves(table: Table, entries: list[Entry], space: Space, given: bool) -> None:
    """Raise `Problem` unless real numbers have one column, and complex ones both or one without an ending."""
    kinds = complex_numbers(space)
    as_many = len(entries) == len(kinds)
    if not as_many:
        # Which number a column is for is not known, but all may be of one kind.
        kinds = kinds[:1] * len(entries) if len(set(kinds)) == 1 else []
    for entry, is_complex in zip(entries, kinds, strict=False):
        if len(entry.columns) > 1 and not is_complex:
            raise Problem(
                f"{table.path}: {' and '.join(entry.columns)} are a complex number where a real one belongs: "
                f"a point of {space} has {described(space)}; {_advice(space, as_many)}"
            )
        half = entry.other_half
        if half is not None and is_complex:
            where = "in --columns" if given else "with numbers" if half in table.names else "in the table"
            raise Problem(
                f"{table.path}: column {entry.columns[0]!r} is half of a complex number, "
                f"and there is no {half!r} {where}"
            )


def _advice(space: Space, as_many: bool) -> str:
    """What to do about complex numbers where real ones belong."""
    if not as_many or isinstance(space, Product) or space._name not in COMPLEX_TWINS:
        return "name its columns one by one with --columns"
    meant: type[Space] = getattr(spaces, COMPLEX_TWINS[space._name])
    return f"did you mean --space {meant._name}:{','.join(map(str, space._parameters))}?"


def _check_count(
    table: Table, entries: list[Entry], others: list[str | None], space: Space, lonlat: bool, given: bool
) -> None:
    wanted = len(LONLAT) if lonlat else len(complex_numbers(space))
    if len(entries) == wanted:
        return
    advice = "" if given else "; say which with --columns"
    known = {"", *table.numeric, *filter(None, others)}
    other = [name for name in table.names if name not in known]
    if other and not given:
        advice += f" (no numbers in the first row of {listed(other)})"
    point = "longitude and latitude are 2 numbers" if lonlat else f"a point of {space} has {described(space)}"
    kind = "numbers" if any(len(entry.columns) > 1 for entry in entries) else "columns"
    names = listed([entry.name for entry in entries])
    found = f"{len(entries)} {kind}: {names}" if entries else "no columns"
    raise Problem(f"{table.path}: {point}, and there are {found}{advice}")
