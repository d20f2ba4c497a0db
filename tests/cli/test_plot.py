"""`symspline plot` of several curves, files and grids."""

import struct
from pathlib import Path

import numpy as np
import pytest
from tabular import PAIR, TRACK, write

import symspline as ss

pytest.importorskip("matplotlib")


@pytest.fixture
def drawn(monkeypatch):
    """The figures that are saved."""
    from matplotlib.figure import Figure

    figures, save = [], Figure.savefig

    def saved(self, *arguments, **options):
        figures.append(self)
        return save(self, *arguments, **options)

    monkeypatch.setattr(Figure, "savefig", saved)
    return figures


def texts(figure):
    from matplotlib.text import Text

    return {text.get_text() for text in figure.findobj(Text)}


def size(name):
    return struct.unpack(">II", Path(name).read_bytes()[16:24])


def test_several_curves_of_one_file(run, drawn, fails):
    rows = [f"{t},{name},{lon + t},50" for name, lon in (("ann", 5), ("bob", 25)) for t in range(4)]
    write("a.csv", "t,id,lon,lat\n" + "\n".join(rows) + "\n")
    run("fit a.csv --lonlat --curve id -o a.npz")
    assert run("plot a.npz --title Birds --size 7,5 --dpi 60 -o a.png") == "a.png: a picture of 2 curves\n"
    assert {"ann", "bob", "Birds"} <= texts(drawn[-1])
    assert "_land" in {artist.get_label() for artist in drawn[-1].findobj()}
    assert size("a.png") == (420, 300)
    run("plot a.npz --curve bob -o b.svg")
    assert "ann" not in texts(drawn[-1])
    assert "give width and height in inches" in fails("plot a.npz --size 7 -o c.png")
    assert "between 10 and 2400" in fails("plot a.npz --dpi 1 -o c.png")


def test_several_files(run, drawn, fails):
    write("a.csv", TRACK)
    run("fit a.csv --lonlat -o monday.npz")
    write("b.csv", TRACK.replace(",2", ",3"))
    run("fit b.csv --lonlat -o tuesday.npz")
    run("plot monday.npz tuesday.npz -o week.svg")
    assert {"monday", "tuesday"} <= texts(drawn[-1])
    write("pair.csv", PAIR)
    run("fit pair.csv --space s:2 --curve id -o pair.npz")
    run("plot pair.npz pair.npz --curve a -o a.svg")
    ss.CubicSpline(None, [[0], [1]], "r:1").save("line.npz")
    assert fails("plot monday.npz line.npz -o b.svg").endswith("not on sphere:2 and euclidean:1")
    assert "no curve 'c'" in fails("plot pair.npz --curve c -o b.svg")


def test_many_curves_have_no_legend(run, drawn):
    rows = [f"{t},n{k},{k},{5 * t}" for k in range(14) for t in range(3)]
    write("a.csv", "t,id,lon,lat\n" + "\n".join(rows) + "\n")
    run("fit a.csv --lonlat --curve id -o a.npz")
    assert "14 curves" in run("plot a.npz -o a.svg")
    assert not {"n0", "n13"} & texts(drawn[-1])


def test_grids(run, drawn, fails):
    lon, lat = np.meshgrid([0, 20, 40], [0, 10, 30], indexing="ij")
    grid = ss.GridSpline(([0, 1, 2], [0, 1, 2]), ss.geo.from_lonlat(lon, lat), "sphere:2")
    grid.save("grid.npz")
    assert run("plot grid.npz --title Field -o grid.svg") == "grid.svg: a picture of the grid\n"
    assert "Field" in texts(drawn[-1])
    assert "is drawn alone" in fails("plot grid.npz grid.npz -o b.svg")
