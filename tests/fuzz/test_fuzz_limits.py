"""Huge names and hostile files do not abort the process."""

import sys

import pytest
from limited import run

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of memory as Linux has them")


def test_names_of_huge_spaces_do_not_abort():
    script = """
    families = ["r", "torus", "sphere", "h", "rp", "cp", "ch", "hp", "so", "o", "u", "su", "spd", "sspd", "logspd",
                "hpd", "siegel", "gl", "cgl", "sl", "sp", "aff", "sim", "lorentz"]
    names = [f"{family}:{n}" for family in families for n in (300, 1500, 20_000, 100_000, 2**24, 10**12)]
    names += [f"{family}:{k},{n}" for family in ("gr", "cgr", "st") for k in (2, 100) for n in (10**5, 10**9)]
    names += ["igr:0,1,1099511627776,1", "igr:0,1,3000,3000", "se:3 x gl:100000", "sphere:2 x so:100000"]
    made = 0
    for name in names:
        try:
            space = ss.space(name)
            made += 1
            space.dim, repr(space), space.point_shape
            # Small ones are other tests' matter, and what takes long can be stopped.
            if 1500 <= max(map(int, name.replace(":", ",").replace(" x ", ",").split(",")[-1:])):
                p = space.random_point(np.random.default_rng(0), (1,))
                space.check_point(p)
        except refused:
            pass
    print(len(names), made)
    """
    count, made = map(int, run(script, 300).split())
    assert count > 150 and made > 60


def test_hostile_files_do_not_abort():
    """Arrays, names and sizes in NPZ files that would take more memory than there is, or are nonsense."""
    script = """
    import io, struct, zipfile

    good = io.BytesIO()
    ss.CubicSpline(None, np.eye(3), "sphere:2").save(good)
    arrays = dict(np.load(io.BytesIO(good.getvalue())))

    def npy(array):
        file = io.BytesIO()
        np.save(file, array)
        return file.getvalue()

    def header(shape, descr="<f8"):
        text = f"{{'descr': {descr!r}, 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + chr(10)
        return b"\\x93NUMPY\\x01\\x00" + struct.pack("<H", len(text)) + text.encode()

    families = ("sphere", "r", "so", "spd", "gl", "gr:1,", "x")
    contents = [npy(np.array(f"{f}:{n}")) for f in families for n in (10**4, 10**7, 10**15, -1)]
    contents += [npy(np.zeros(shape, kind)) for shape in [(), (0,), (2**20,), (3, 3), (1,) * 20]
                 for kind in ("f8", "c16", "U4", "M8[s]", "i1", "?")]
    contents += [header(shape) for shape in [(2**40,), (3, 2**33), (-5,), (2**31, 2**31, 2**31), ("a",), ()]]
    contents += [header((4,), descr) for descr in ("|O", "<U99999999", "V1000000000", "<f2", "M8[s]", "nonsense")]
    contents += [npy(np.full((3, 3), value)) for value in (np.nan, np.inf, 1e308, 0.0, 2**63)]
    contents += [b"", b"no array", npy(np.zeros(0))[:30]]
    tried = refusals = 0
    for name in arrays:
        for content in contents:
            for packed in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)[: 1 + (name == "points")]:
                file = io.BytesIO()
                with zipfile.ZipFile(file, "w", packed) as target:
                    for other, array in arrays.items():
                        target.writestr(other + ".npy", content if other == name else npy(array))
                file.seek(0)
                tried += 1
                try:
                    ss.load(file)
                except refused:
                    refusals += 1
    print(tried, refusals)
    """
    tried, refusals = map(int, run(script, 300).split())
    assert tried > 400 and refusals > 0.9 * tried
