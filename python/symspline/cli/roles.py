"""Which column of a table is what."""

from __future__ import annotations

import csv
from collections.abc import Sequence

from ..spaces import Space
from .curves import Columns
from .errors import Problem, first_twice, listed
from .points import LONLAT, labels
from .tables import Table


def split_names(text: str | None) -> list[str]:
    """Names with commas between them; one that has a comma itself is quoted."""
    (names,) = csv.reader([text or ""], skipinitialspace=True)
    return [name.strip() for name in names]


def time_column(table: Table, given: str | None, others: Sequence[str | None]) -> str | None:
    """The column of times: the one that was named, or one called t or time."""
    if given is not None:
        return table.require(given)
    found = table.find("t", "time")
    return None if found in others else found


def point_columns(
    table: Table, given: list[str], others: list[str | None], space: Space, lonlat: bool
) -> list[str]:
    """The columns of a point: those that were named, or all that are left."""
    if given:
        columns = [column for name in given for column in table.expand(name)]
    elif lonlat:
        columns = _lonlat(table)
    else:
        columns = table.points(others)
    _check(table, columns, others, space, lonlat, bool(given))
    return columns


def named_columns(points: list[str], time: str | None, curve: str | None, lonlat: bool) -> Columns:
    """What a file of curves keeps of them."""
    standard = Columns(points)
    return Columns(points, time or standard.time, curve or standard.curve, lonlat)


def _lonlat(table: Table) -> list[str]:
    found = [table.find("lon", "longitude"), table.find("lat", "latitude")]
    columns = [name for name in found if name is not None]
    if len(columns) < 2:
        raise Problem(
            f"{table.path}: --lonlat needs columns lon and lat, or longitude and latitude, or two --columns; "
            f"there are {listed(table.names)}"
        )
    return columns


def _check(
    table: Table, columns: list[str], others: list[str | None], space: Space, lonlat: bool, given: bool
) -> None:
    wanted = LONLAT if lonlat else labels(space)
    twice = first_twice([*filter(None, others), *columns])
    if twice is not None:
        raise Problem(f"column {twice!r} of {table.path} cannot have two meanings")
    if len(columns) != len(wanted):
        advice = "" if given else "; say which with --columns"
        known = {"", *table.numeric, *filter(None, others)}
        other = [name for name in table.names if name not in known]
        if other and not given:
            advice += f" (no numbers in the first row of {listed(other)})"
        place = "longitude and latitude are 2 numbers"
        point = place if lonlat else f"a point of {space} has {len(wanted)} numbers"
        found = f"{len(columns)} columns: {listed(columns)}" if columns else "no columns"
        raise Problem(f"{table.path}: {point}, and there are {found}{advice}")
    for name, meant in zip(columns, wanted, strict=True):
        mark = meant[-3:]
        if mark in ("_re", "_im") and name[-3:] in ("_re", "_im") and not name.endswith(mark):
            raise Problem(
                f"{table.path}: columns of complex numbers come as A_re,A_im,B_re,B_im; got {listed(columns)}"
            )
