"""A last time that exceeds the last knot by rounding is that knot, wherever times are looked up."""

import numpy as np
import pytest
from curves import S2, THREE

import symspline as ss
from symspline.cli import main

COUNT = 2000


def intervals(count=COUNT):
    """Ends of intervals of any length and place, and the last time that a user computes for each."""
    rng = np.random.default_rng(0)
    scale = 10.0 ** rng.integers(-3, 10, count)
    start, end = np.sort(rng.standard_normal((2, count)), axis=0) * scale
    last = np.array([(a + (b - a) * np.linspace(0, 1, 7))[-1] for a, b in zip(start, end, strict=True)])
    return start, end, last


START, END, LAST = intervals()
BEYOND = np.flatnonzero(LAST > END)
FRAME = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0]])


def test_rounding_does_exceed_the_last_knot():
    assert 0.005 * COUNT < len(BEYOND) < 0.2 * COUNT
    assert np.all(LAST[BEYOND] <= END[BEYOND] + 2 * np.spacing(np.maximum(abs(START), abs(END)))[BEYOND])


def knots(i):
    return np.array([START[i], 0.5 * (START[i] + END[i]), END[i]])


def curve(i, points=THREE, space=S2, kind=ss.CubicSpline):
    return kind(knots(i), points, space)


def hermite(i):
    return ss.HermiteSpline(knots(i), THREE, np.zeros((3, 3)), S2)


def unit_bspline(i):
    a, b = START[i], END[i]
    return ss.BSpline([a, a, a, b, b, b], THREE, 2, S2)


ROTATIONS = ss.rotations.from_rotation_vectors([[0, 0, 0], [0, 0, 1.0], [0.2, 0, 1.5]])
POSES = ss.poses.join(ROTATIONS, [[0, 0, 0], [1, 0, 0], [2, 1, 0]])
QUBIT = [[1, 0], [0.8, 0.6j], [0.6, 0.8]]
ARC = np.array([[1.0, 0, 0], [0, 1, 0]])
SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])

LOOKUPS = {
    "call": lambda i, x: curve(i)(x),
    "call with one time": lambda i, x: curve(i)(float(x)),
    "velocity": lambda i, x: curve(i)(x, nu=1),
    "speed": lambda i, x: curve(i).speed(x),
    "lift": lambda i, x: curve(i, QUBIT, "cp:1").lift(x),
    "transport": lambda i, x: curve(i).transport(START[i], x, curve(i)(START[i], nu=1)),
    "jvp": lambda i, x: curve(i).jvp(x, points=np.zeros((3, 3))),
    "vjp": lambda i, x: curve(i).vjp(x, [0.0, 0, 1]).points[-1],
    "evaluate": lambda i, x: ss.evaluate(x, knots(i), THREE, np.zeros((3, 3)), S2),
    "HermiteSpline": lambda i, x: hermite(i)(x),
    "BSpline": lambda i, x: unit_bspline(i)(x),
    "angular velocity": lambda i, x: ss.rotations.angular_velocity(curve(i, ROTATIONS, "so:3"), x),
    "quaternion": lambda i, x: ss.rotations.quaternion(curve(i, ROTATIONS, "so:3"), x, scalar_first=True),
    "imu": lambda i, x: ss.poses.imu(curve(i, POSES, "se:3"), np.array([x])).gyro[0],
    "sog": lambda i, x: ss.geo.sog(curve(i), x),
    "cog": lambda i, x: ss.geo.cog(curve(i), x),
    "hamiltonian": lambda i, x: ss.quantum.hamiltonian(curve(i, QUBIT, "cp:1"), x),
    "smoothing": lambda i, x: ss.make_smoothing_spline(knots(i), THREE, S2, 1e-3)(x),
}  # fmt: skip
# Where one curve takes a millisecond or more, fewer of the intervals are tried.
SLOW = {"smoothing", "imu", "hamiltonian", "jvp", "vjp"}


@pytest.mark.parametrize("name", LOOKUPS)
def test_rounding_beyond_the_last_knot(name):
    look = LOOKUPS[name]
    for i in BEYOND[: 5 if name in SLOW else 40]:
        assert np.array_equal(look(i, LAST[i]), look(i, END[i])), (START[i], END[i])


@pytest.mark.parametrize("name", LOOKUPS)
def test_rounding_before_the_first_knot(name):
    look = LOOKUPS[name]
    if name == "transport":
        look = lambda i, x: curve(i).transport(x, END[i], curve(i)(START[i], nu=1))  # noqa: E731
    for i in BEYOND[:5]:
        before = START[i] - 2 * np.spacing(max(abs(START[i]), abs(END[i])))
        assert np.array_equal(look(i, before), look(i, START[i]))


@pytest.mark.parametrize("name", LOOKUPS)
def test_ten_units_beyond_a_knot_are_refused(name):
    look = LOOKUPS[name]
    for i in range(5):
        unit = np.spacing(max(abs(START[i]), abs(END[i])))
        for x in [END[i] + 10 * unit] + ([] if name == "transport" else [START[i] - 10 * unit]):
            with pytest.raises(ss.ValidationError, match="outside"):
                look(i, x)


def test_all_intervals():
    for i in range(COUNT):
        x = START[i] + (END[i] - START[i]) * np.linspace(0, 1, 7)
        spline = ss.CubicSpline([START[i], END[i]], ARC, S2)
        assert np.array_equal(spline(x)[-1], spline(END[i]))
        assert np.isfinite(ss.BSpline([START[i]] * 2 + [END[i]] * 2, ARC, 1, S2)(x)).all()


def test_batches_with_knots_of_their_own():
    some = BEYOND[:8]
    t = np.stack([knots(i) for i in some])
    splines = ss.CubicSpline(t, np.broadcast_to(THREE, (8, 3, 3)), S2)
    x = np.stack([[END[i], LAST[i]] for i in some])
    for values in (splines(x, per_curve=True), splines(x, nu=1, per_curve=True)):
        assert np.array_equal(values[:, 0], values[:, 1])
    # One time for curves of which only the first ends there.
    ends = ss.CubicSpline([[0, 0.1, 0.3], [0, 1, 2]], [THREE, THREE], S2)
    assert np.array_equal(ends(0.1 + 0.2), [ends[0](0.3), ends[1](0.1 + 0.2)])
    assert np.array_equal(ends.jvp(0.1 + 0.2, np.zeros((2, 3, 3))), np.zeros((2, 3)))
    v = ends(0, nu=1)
    carried = ends.transport(0, 0.1 + 0.2, v)
    assert np.array_equal(carried, [ends[0].transport(0, 0.3, v[0]), ends[1].transport(0, 0.1 + 0.2, v[1])])


def test_times_in_single_precision_have_its_rounding():
    spline = ss.CubicSpline([0, 0.1, 0.3], THREE, S2)
    x = np.linspace(0, 0.3, 5, dtype=np.float32)
    assert float(x[-1]) > 0.3 + 1e-9
    assert np.array_equal(spline(x)[-1], spline(0.3))
    with pytest.raises(ss.ValidationError, match="outside"):
        spline(np.float32(0.3) + np.float32(1e-6))


def test_dates_are_exact():
    t = np.array(["2024-01-01", "2024-01-02", "2024-01-03"], "M8[ns]")
    with pytest.raises(ss.ValidationError, match="outside"):
        ss.CubicSpline(t, THREE, S2)(t[-1] + np.timedelta64(1, "ns"))


def test_a_bezier_curve():
    curve = ss.BezierCurve(THREE, S2)
    assert np.array_equal(curve(1 + 2**-52), curve(1.0))
    with pytest.raises(ss.ValidationError, match="outside"):
        curve(1 + 10 * 2**-52)


def test_films_propagators_and_pulses():
    i = BEYOND[0]
    film = ss.shapes.AffineMorph(knots(i), [SQUARE, 2 * SQUARE, SQUARE + 1])
    assert np.array_equal(film(LAST[i]), film(END[i]))
    with pytest.raises(ss.ValidationError, match="outside"):
        film(END[i] + 10 * np.spacing(max(abs(START[i]), abs(END[i]))))
    qubit = curve(i, QUBIT, "cp:1")
    assert np.array_equal(ss.quantum.propagator(qubit, LAST[i]), ss.quantum.propagator(qubit, END[i]))
    edges = np.linspace(START[i], END[i], 4)
    late = np.append(edges[:-1], LAST[i])
    assert np.array_equal(ss.quantum.pulses(qubit, late), ss.quantum.pulses(qubit, edges))


def test_stiefel_manifolds():
    i = BEYOND[0]
    spline = ss.CubicSpline(knots(i), [FRAME.T, FRAME.T, FRAME.T], ss.Stiefel(2, 4))
    assert np.array_equal(spline(LAST[i]), spline(END[i]))


def test_xarray():
    xr = pytest.importorskip("xarray")
    import symspline.xarray

    for i in BEYOND[:5]:
        da = xr.DataArray(np.array(THREE, float), dims=("time", "q"), coords={"time": knots(i)})
        ds = symspline.xarray.fit(da, "sphere:2")
        assert np.array_equal(symspline.xarray.evaluate(ds, LAST[i]), symspline.xarray.evaluate(ds, END[i]))
        assert np.isfinite(symspline.xarray.resample(da, "sphere:2", [START[i], LAST[i]])).all()


def test_jax():
    jax = pytest.importorskip("jax")
    import symspline.jax as sj

    with jax.enable_x64(True):
        i = BEYOND[0]
        points = jax.numpy.asarray(THREE, float)
        found = jax.grad(lambda p: sj.curve(LAST[i], knots(i), p, "sphere:2").sum())(points)
        assert np.array_equal(
            found, jax.grad(lambda p: sj.curve(END[i], knots(i), p, "sphere:2").sum())(points)
        )
        for values in (
            sj.evaluate(knots(i), points, sj.fit(knots(i), points, "sphere:2")[0], x, "sphere:2")
            for x in (LAST[i], END[i])
        ):
            np.testing.assert_allclose(values, points[-1], atol=1e-14)
    t = np.array([0.0, 0.1, 0.3], np.float32)
    late = np.nextafter(t[-1], np.float32(1))
    assert np.isfinite(sj.curve(late, t, points.astype(np.float32), "sphere:2")).all()
    assert np.isfinite(
        jax.grad(lambda p: sj.curve(late, t, p, "sphere:2").sum())(points.astype(np.float32))
    ).all()


def test_the_command_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    i = BEYOND[0]
    rows = [[t, *map(float, p)] for t, p in zip(knots(i).tolist(), THREE, strict=True)]
    (tmp_path / "a.csv").write_text("t,x,y,z\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows))
    assert main(["fit", "a.csv", "--space", "sphere:2", "-o", "a.npz"]) == 0
    unit = np.spacing(max(abs(START[i]), abs(END[i])))
    for x, code in ((LAST[i], 0), (END[i] + 10 * unit, 2)):
        (tmp_path / "at.csv").write_text(f"t\n{float(x)!r}\n")
        assert main(["sample", "a.npz", "--at", "at.csv", "-o", "b.csv"]) == code
