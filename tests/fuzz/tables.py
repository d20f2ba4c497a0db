"""Tables of points in files: CSV as people write it, and Parquet and NPZ with columns of any type."""

import io

import numpy as np
from hypothesis import strategies as st

from fuzz.damage import damaged_bytes
from fuzz.values import rarely, seeds

GOOD = [
    b"t,x,y,z\n0,1,0,0\n1,0,1,0\n3,0,0,1\n",
    b"time,lon,lat\n2021-08-29T00:00Z,178.5,28\n2021-08-29T06:00Z,-179,29.1\n2021-08-29T12:00Z,-177,30\n",
    b"id,t,x,y,z\na,0,1,0,0\nb,1,0,1,0\na,2,0,0,1\nb,2,0,0,1\na,3,0,1,0\n",
    b"t,x_re,x_im,y_re,y_im\n0,1,0,0,0\n1,0.6,0,0,0.8\n2,0,0,0,1\n",
    b"m11,m12,m21,m22\n2,0,0,1\n3,1,1,2\n1,0,0,9\n",
    b"a,b,c,d,e\n0.1,2,1,0,0\n0.5,7,0,1,0\n0.7,1,0,0,1\n",
]
NAMES = ["t", "time", "x", "y", "z", "lon", "lat", "id", "x_re", "x_im", "a", "A", "", " x ", "é", "a,b", 'q"', "x_d1"]
CELLS = [
    "0", "1", "-1", "0.5", "1e-3", "1e400", "nan", "inf", "-0.0", "1_000", "0x10", "9007199254740993", "9" * 5000,
    "1e-400", "", " ", "x", "é", "None", "NaT", "2021-08-29", "2021-02-30", "2021-08-29T06:00Z", "2021-08-29 06:00",
    "2021-08-29T06:00:00.123456789+02:30", "0000-01-01", "9999-12-31", "-2021-08-29", '"', "a\nb", "\ud800", "\x00",
    "٢", "1,5", "1;5", "½", "+1", "١",
]  # fmt: skip
STEPS = [
    "1", "0.5", "10min", "0", "-1", "1e-400", "1e400", "1e999999999", "1e-9", "x", "1 h", "0.1ns", "1e9d", "nan",
    "5e-324", "9" * 400, "1" + "0" * 30 + "ns", "1e-999999999", "1e99999999999999999999", ".5s", "1e20", "1e17s",
]  # fmt: skip
SPACES = ["sphere:2", "r:1", "r:2", "r:3", "sphere:1", "h:1", "cp:1", "spd:2", "so:2", "r:1 x sphere:2", "u:1", "se:2"]
numbers = st.sampled_from([*CELLS[:10], "0.6", "0.8", "2", "3", "178.5", "-89.9"])
cells = st.one_of(numbers, st.sampled_from(CELLS), st.text(max_size=4))


@st.composite
def csv_bytes(draw):
    """A CSV file, more or less."""
    if draw(st.booleans()):
        data = draw(st.sampled_from(GOOD))
        return data if draw(st.booleans()) else draw(damaged_bytes(data, GOOD))
    names = draw(st.lists(st.sampled_from(NAMES), max_size=5))
    rows = [[draw(cells) for _ in names] for _ in range(draw(st.integers(0, 4)))]
    if rows and rarely(draw):
        rows[-1].append("1")
    quote = draw(st.sampled_from(["", '"', "'"]))
    cell, line = (
        draw(st.sampled_from([",", ",", ",", ", ", ";", "\t"])),
        draw(st.sampled_from(["\n", "\r\n", "\r", "\n\n"])),
    )
    text = line.join(cell.join(f"{quote}{c}{quote}" if quote else c for c in row) for row in [names, *rows])
    return text.encode(draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "latin-1"])), "replace")


def _parquet():
    import pyarrow as pa
    import pyarrow.parquet as parquet

    file = io.BytesIO()
    parquet.write_table(pa.table({"t": [0.0, 1, 2], "x": [1.0, 0, 0], "y": [0, 1.0, 0], "z": [0, 0, 1.0]}), file)
    return file.getvalue()


@st.composite
def parquet_bytes(draw):
    """A damaged Parquet file; tests of the command line have columns of every type."""
    return draw(damaged_bytes(_parquet()))


@st.composite
def npz_bytes(draw):
    """An NPZ file with arrays of any type."""
    count = draw(st.integers(0, 4))
    rng = np.random.default_rng(draw(seeds))
    arrays = {}
    for name in draw(
        st.lists(st.sampled_from(["t", "time", "x", "y", "z", "points", "id", "format", "names", "é"]), max_size=4)
    ):
        dtype = draw(
            st.sampled_from(
                ["f8", "f8", "f4", "g", "i8", "u8", "?", "U3", "S3", "c16", "M8[s]", "M8[M]", "m8[s]", "V3"]
            )
        )
        shape = draw(st.sampled_from([(count,), (count, 3), (count, 2, 2), (), (count + 1,), (count, 0)]))
        with np.errstate(all="ignore"):
            arrays[name] = (rng.integers(-3, 3, shape) if dtype != "V3" else np.zeros(shape)).astype(dtype)
    file = io.BytesIO()
    # The padding of long doubles is whatever was there, and would make compressed files of any length.
    plain = draw(st.booleans()) or any(a.dtype == np.longdouble for a in arrays.values())
    np.savez(file, **arrays) if plain else np.savez_compressed(file, **arrays)
    data = file.getvalue()
    return draw(damaged_bytes(data)) if rarely(draw, 3) else data
