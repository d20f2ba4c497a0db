"""Numbers in unusual notation are refused with their place in the table."""

import pytest

from symspline.cli import main


@pytest.fixture
def said(tmp_path, monkeypatch, capsys):
    """What the command line says of a table with one row changed."""
    monkeypatch.chdir(tmp_path)

    def said(header, rows, options):
        (tmp_path / "a.csv").write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
        code = main(["fit", "a.csv", *options, "-o", "a.npz"])
        return code, capsys.readouterr().err

    return said


@pytest.mark.parametrize("cell", ["1_000", "١٢", "1_0.5", "１２"])
def test_numbers_are_written_as_usual(said, cell):
    rows = ["0,1", "1,2", f"2,{cell}"]
    code, err = said("t,x", rows, ["--space", "r:1"])
    assert code == 2 and f"line 4: column 'x' holds {cell!r}, which is not a number" in err
    code, err = said("t,x", ["0,1", "1,2", f"{cell},3"], ["--space", "r:1"])
    assert code == 2 and f"line 4: column 't' holds {cell!r}" in err
    code, err = said("t,x", ["0,1", "1,2"], ["--space", "r:1", "--tol", "1_0"])
    assert code == 2 and "--tol: invalid number value: '1_0'" in err
    code, err = said("t,x", ["0,1", "1, 2.5 "], ["--space", "r:1"])
    assert (code, err) == (0, "")
    assert main(["sample", "a.npz", "-n", "1_0", "-o", "b.csv"]) == 2


@pytest.mark.parametrize("lon", ["1e15", "9999", "-9999"])
def test_invalid_longitudes(said, lon):
    code, err = said("t,lon,lat", ["0,10,20", f"1,{lon},21"], ["--lonlat"])
    assert code == 2 and "line 3: longitude" in err and "not between -360 and 360 degrees" in err
    # From zero, and from -180 counted on.
    assert said("t,lon,lat", ["0,350,20", "1,360,21", "2,-350,20"], ["--lonlat"]) == (0, "")
