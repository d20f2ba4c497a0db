"""Tables that tests write and read."""

import csv
from pathlib import Path

import numpy as np
import pytest
from compare import parts

FIXES = [("00:00", 178.5, 28.0), ("06:00", -179.0, 29.1), ("12:00", -177.0, 30.0), ("18:00", -176.2, 31.5)]


TRACK = "time,lon,lat\n" + "".join(f"2021-08-29T{clock}Z,{lon},{lat}\n" for clock, lon, lat in FIXES)


AXES = "t,x,y,z\n0,1,0,0\n1,0,1,0\n3,0,0,1\n"


PAIR = "id,t,x,y,z\na,0,1,0,0\nb,1,0,1,0\na,2,0,0,1\nb,2,0,0,1\na,3,0,1,0\n"


def write(name, text):
    Path(name).write_text(text, encoding="utf-8", newline="")


def table(name):
    """The columns of a CSV file, as texts."""
    with open(name, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    return dict(zip(rows[0], map(list, zip(*rows[1:], strict=True)), strict=True))


def numbers(columns, *names):
    return np.stack([np.array(columns[name], float) for name in names], axis=1)


TIMES = np.array([0, 0.7, 2, 2.5, 4, 5])


def numbered(values, mark=""):
    """Columns of points or vectors: a0, a1, … in the first factor of a product, b0, b1, … in the second."""
    columns = {}
    for letter, part in zip("abcd", parts(values), strict=False):
        for i, column in enumerate(part.reshape(len(part), -1).T):
            both = {"_re": column.real, "_im": column.imag} if np.iscomplexobj(column) else {"": column}
            columns |= {f"{letter}{i}{mark}{end}": numbers for end, numbers in both.items()}
    return columns


def write_table(name, columns):
    if name.endswith("csv"):
        rows = [",".join(map(str, row)) for row in zip(*columns.values(), strict=True)]
        write(name, "\n".join([",".join(columns), *rows]))
    elif name.endswith("npz"):
        np.savez(name, **columns)
    else:
        pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
        parquet.write_table(pa.table(columns), name)


def read_table(name):
    if name.endswith("csv"):
        return {key: np.array(cells, float) for key, cells in table(name).items()}
    if name.endswith("npz"):
        return dict(np.load(name))
    columns = pytest.importorskip("pyarrow.parquet").read_table(name)
    return {key: columns[key].to_numpy() for key in columns.column_names}


def assert_same_columns(found, expected):
    assert list(found) == list(expected)
    for key, numbers in expected.items():
        np.testing.assert_array_equal(found[key], numbers)
