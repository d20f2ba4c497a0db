"""Points, rates and velocities in one table: ``fit --smooth --rates``."""

import subprocess
import sys

import numpy as np
import pytest
from tabular import numbers, read_table, table, write, write_table

import symspline as ss
from symspline import measure

RNG = np.random.default_rng(3)
SO3 = ss.SpecialOrthogonal(3)
BIAS = np.array([0.05, -0.03, 0.02])
END = 10.0
POINTS, RATES = np.sort(RNG.uniform(0, END, 60)), np.sort(RNG.uniform(0, END, 300))
# Rates are missing for two seconds.
RATES = RATES[(RATES < 4) | (RATES > 6)]
KNOTS = np.linspace(0, END, 120)
PHASES = np.array([0.0, 1.0, 2.0])
TURN = ss.CubicSpline(KNOTS, ss.rotations.from_rotation_vectors(0.8 * np.sin(0.9 * KNOTS[:, None] + PHASES)), "so:3")
SEEN = SO3.exp(TURN(POINTS), 0.03 * SO3.random_tangent(RNG, TURN(POINTS)))
QUATERNIONS = ss.rotations.as_quaternions(SEEN, scalar_first=True)
OMEGA = ss.rotations.angular_velocity(TURN, RATES) + BIAS + 0.01 * RNG.standard_normal((len(RATES), 3))
Q, W, V = ["qw", "qx", "qy", "qz"], ["wx", "wy", "wz"], ["vx", "vy"]
OPTIONS = "--smooth --space so:3 --columns qw,qx,qy,qz --sigma 0.03 --rates wx,wy,wz --rate-sigma 0.01 --rate-bias"


def path(t, nu=0):
    """A plane path and its derivatives."""
    phase = np.multiply.outer(np.asarray(t), [0.9, 0.6]) + nu * np.pi / 2
    return np.array([10, 20]) * np.array([0.9, 0.6]) ** nu * np.sin(phase)


PLACES = path(POINTS) + 0.3 * RNG.standard_normal((len(POINTS), 2))
SPEEDS = path(RATES, 1) + 0.05 * RNG.standard_normal((len(RATES), 2))


def rows(t, names, values, every, blank=""):
    """Rows with one group of columns, the others blank."""
    for time, value in zip(t, values, strict=True):
        cells = dict(zip(names, value.tolist(), strict=True))
        yield time, ",".join([str(time), *(str(cells.get(name, blank)) for name in every)])


def interleaved(*groups, blank="", order=sorted):
    every = [name for _, names, _ in groups for name in names]
    lines = order(line for t, names, values in groups for line in rows(t, names, values, every, blank))
    return "\n".join([",".join(["t", *every]), *(line for _, line in lines)]) + "\n"


def imu(**options):
    return interleaved((POINTS, Q, QUATERNIONS), (RATES, W, OMEGA), **options)


def expected(**options):
    points = ss.rotations.from_quaternions(QUATERNIONS, scalar_first=True)
    both = [
        measure.Points(POINTS, points, sigma=0.03),
        measure.BodyRates(RATES, OMEGA, sigma=0.01, bias=measure.Constant(3)),
    ]
    return ss.estimate(both, "auto", "so:3", **options)


@pytest.mark.parametrize(
    ("line", "options"),
    [
        ("", {}),
        ("--penalty jerk", {"penalty": "jerk"}),
        (
            "--robust --penalty jerk --extrapolate geodesic",
            {"loss": "cauchy", "penalty": "jerk", "extrapolate": "geodesic"},
        ),
    ],
)
def test_attitudes_and_rates_at_different_times(run, line, options):
    write("imu.csv", imu())
    out = run(f"fit imu.csv {OPTIONS} {line} -o a.npz")
    found, curve = ss.load("a.npz"), expected(**options)
    assert np.abs(found(KNOTS[1:-1]) - curve(KNOTS[1:-1])).max() < 1e-10
    bias = curve.parameters["gyro bias"]
    each = ", ".join(f"{value:.3g} ± {std:.2g}" for value, std in zip(bias.value, bias.std, strict=True))
    report = curve.report
    assert out == (
        f"a.npz: 1 curve near 60 points and {len(RATES)} rates on so:3, converged: λ {report.lam:.3g}, {report.df:.3g} "
        f"degrees of freedom; residuals {report.sigma:.3g} times the given standard deviations\ngyro bias: {each}\n"
    )
    assert np.all(np.abs(bias.value - BIAS) < 5 * bias.std)
    assert run("info a.npz").endswith(f"; gyro bias: {each}\n")
    if options:
        x = KNOTS[5:-5]
        plain = ss.make_smoothing_spline(POINTS, SEEN, "so:3")
        errors = [np.sqrt(np.mean(SO3.distance(own(x), TURN(x)) ** 2)) for own in (found, plain)]
        assert errors[0] < 0.75 * errors[1]


def test_samples_have_standard_deviations(run):
    write("imu.csv", imu())
    run(f"fit imu.csv {OPTIONS} -o a.npz")
    run("check a.npz")
    run("sample a.npz -n 7 --nu 0,1 -o b.csv")
    found, curve = read_table("b.csv"), ss.load("a.npz")
    assert list(found) == ["t", *Q, "std", *W, *(f"std_{name}" for name in W)]
    # A unit quaternion changes half as much as the angle of its rotation.
    np.testing.assert_allclose(found["std"], curve.std(found["t"]) / 2, rtol=1e-12)
    omega, std = ss.rotations.angular_velocity(curve, found["t"], return_std=True)
    np.testing.assert_allclose(np.stack([found[name] for name in W], axis=1), omega, atol=1e-14)
    np.testing.assert_allclose(np.stack([found[f"std_{name}"] for name in W], axis=1), std, rtol=1e-12)


@pytest.mark.parametrize("blank", ["", " ", "nan", "NaN"])
def test_order_of_rows_and_blank_cells_do_not_matter(run, blank):
    write("imu.csv", imu(blank=blank, order=lambda lines: sorted(lines)[::-1]))
    run(f"fit imu.csv {OPTIONS} -o a.npz")
    assert np.abs(ss.load("a.npz")(KNOTS[1:-1]) - expected()(KNOTS[1:-1])).max() < 1e-9


@pytest.mark.parametrize("ending", ["npz", "parquet"])
def test_other_formats(run, ending):
    lengths = len(POINTS), len(RATES)
    numbers = [(name, column, 0) for name, column in zip(Q, QUATERNIONS.T, strict=True)]
    numbers += [(name, column, 1) for name, column in zip(W, OMEGA.T, strict=True)]
    columns = {"t": np.concatenate([POINTS, RATES])}
    for name, column, kind in numbers:
        columns[name] = np.full(sum(lengths), np.nan)
        columns[name][slice(0, lengths[0]) if kind == 0 else slice(lengths[0], None)] = column
    if ending == "parquet":
        pytest.importorskip("pyarrow")
        columns |= {name: [None if np.isnan(x) else x for x in columns[name]] for name, _, _ in numbers}
    write_table(f"imu.{ending}", columns)
    run(f"fit imu.{ending} {OPTIONS} -o a.npz")
    assert np.abs(ss.load("a.npz")(KNOTS[1:-1]) - expected()(KNOTS[1:-1])).max() < 1e-9


def test_all_columns_are_found(run):
    """The first rows have rates only, and the other columns of numbers are those of the points."""
    write("imu.csv", imu())
    assert read_first("imu.csv")[1] == "" or read_first("imu.csv")[5] == ""
    run(f"fit imu.csv {OPTIONS.replace('--columns qw,qx,qy,qz ', '')} -o a.npz")
    assert np.abs(ss.load("a.npz")(KNOTS[1:-1]) - expected()(KNOTS[1:-1])).max() < 1e-10


def read_first(name):
    with open(name, encoding="utf-8") as file:
        return file.readlines()[1].strip().split(",")


def test_several_recordings_have_a_bias_each(run):
    lines = imu().splitlines()
    both = ["id," + lines[0], *(f"{name},{line}" for line in lines[1:] for name in ("a", "b"))]
    write("imu.csv", "\n".join(both))
    out = run(f"fit imu.csv --curve id {OPTIONS} -o a.npz").splitlines()
    assert out[0].startswith(f"a.npz: 2 curves near 120 points and {2 * len(RATES)} rates on so:3, converged: ")
    assert [line.partition(":")[0] for line in out[1:]] == ["gyro bias of curve 'a'", "gyro bias of curve 'b'"]
    assert list(ss.load("a.npz")) == ["a", "b"]


@pytest.mark.parametrize("penalty", ["acceleration", "jerk"])
def test_positions_and_velocities(run, penalty):
    write("car.csv", interleaved((POINTS, ["x", "y"], PLACES), (RATES, V, SPEEDS)))
    line = "--space r:2 --columns x,y --sigma 0.3 --velocities vx,vy --velocity-sigma 0.05"
    out = run(f"fit car.csv --smooth {line} --penalty {penalty} -o a.npz")
    assert out.startswith(f"a.npz: 1 curve near 60 points and {len(RATES)} velocities on euclidean:2, converged: λ ")
    given = [
        measure.Points(POINTS, PLACES, sigma=0.3),
        measure.Velocities(RATES, 0 * SPEEDS, SPEEDS, sigma=0.05),
    ]
    curve, found = ss.estimate(given, "auto", "r:2", penalty=penalty), ss.load("a.npz")
    assert np.abs(found(KNOTS[2:-2]) - curve(KNOTS[2:-2])).max() < 1e-9
    error = np.sqrt(np.mean((found(KNOTS[2:-2]) - path(KNOTS[2:-2])) ** 2))
    assert error < (0.1 if penalty == "jerk" else 0.2)


@pytest.mark.parametrize("space", ["se:3", "so:3 x r:3"])
def test_poses_with_rates_and_velocities_of_the_position(run, space):
    t = POINTS
    place = np.column_stack([path(t), 0 * t])
    speed = np.column_stack([path(t, 1), 0 * t]) + 0.05 * RNG.standard_normal((60, 3))
    omega = ss.rotations.angular_velocity(TURN, t) + BIAS + 0.01 * RNG.standard_normal((60, 3))
    columns = {"t": t, **dict(zip(Q, QUATERNIONS.T, strict=True)), **dict(zip(W, omega.T, strict=True))}
    columns |= dict(zip(["tx", "ty", "tz"], (place + 0.3 * RNG.standard_normal((60, 3))).T, strict=True))
    columns |= dict(zip(["ux", "uy", "uz"], speed.T, strict=True))
    write_table("a.csv", columns)
    line = "--columns qw,qx,qy,qz,tx,ty,tz --sigma 0.03,0.3 --rates wx,wy,wz --rate-sigma 0.01 --rate-bias"
    out = run(f"fit a.csv --smooth --space '{space}' {line} --velocities ux,uy,uz --velocity-sigma 0.05 -o a.npz")
    assert "near 60 points, 60 rates and 60 velocities on" in out and "so:3: λ" in out and "; euclidean:3: λ" in out
    run("sample a.npz -n 50 -o b.csv")
    found = table("b.csv")
    x = numbers(found, "t").ravel()
    assert np.sqrt(np.mean((numbers(found, "tx", "ty") - path(x)) ** 2)) < 0.12


def test_velocities_on_the_globe_are_in_degrees(run):
    t, rng = np.linspace(0, 10, 40), np.random.default_rng(0)
    lon, lat = 10 + t, 50 + 2 * np.sin(t / 3)
    sphere = ss.geo.from_lonlat(lon, lat)
    track = ss.CubicSpline(t, sphere, "sphere:2", bc_type="not-a-knot")
    write_table("a.csv", {"t": t, "lon": lon, "lat": lat})
    run("fit a.csv --lonlat --bc-type not-a-knot -o true.npz")
    run("sample true.npz -n 40 --nu 1 -o v.csv")
    east, north = numbers(table("v.csv"), "east_d1", "north_d1").T + 0.01 * rng.standard_normal((2, 40))
    noise = 0.2 * rng.standard_normal((2, 40))
    write_table("a.csv", {"t": t, "lon": lon + noise[0], "lat": lat + noise[1], "east": east, "north": north})
    line = "--lonlat --columns lon,lat --sigma 0.2 --velocities east,north --velocity-sigma 0.01"
    run(f"fit a.csv --smooth {line} -o a.npz")
    x = np.linspace(1, 9, 50)
    found, plain = (
        ss.load("a.npz"),
        ss.make_smoothing_spline(t, ss.geo.from_lonlat(lon + noise[0], lat + noise[1]), "s:2"),
    )
    errors = [np.sqrt(np.mean(ss.Sphere(2).distance(own(x), track(x)) ** 2)) for own in (found, plain)]
    assert errors[0] < 0.7 * errors[1]


def test_tangent_vectors_on_a_sphere(run, fails):
    t = np.linspace(0, 3, 30)
    points = np.stack([np.cos(t), np.sin(t), 0 * t], axis=-1)
    columns = {"t": t, **dict(zip("xyz", points.T, strict=True))}
    write_table("a.csv", columns | {"u": -np.sin(t), "v": np.cos(t), "w": 0 * t})
    line = "--smooth --space sphere:2 --columns x,y,z --sigma 0.01 --velocities u,v,w --velocity-sigma 0.01"
    run(f"fit a.csv {line} -o a.npz")
    write_table("a.csv", columns | {"u": np.cos(t), "v": np.cos(t), "w": 0 * t})
    assert "a.csv, line 2: the vector in columns u, v, w is not tangent to sphere:2 at the point in its row" in fails(
        f"fit a.csv {line} -o b.npz"
    )
    write("a.csv", "t,x,y,z,u,v,w\n0,1,0,0,0,1,0\n1,0,1,0,-1,0,0\n2,,,,-1,0,0\n")
    assert "a.csv, line 4: this velocity has no point in its row" in fails(f"fit a.csv {line} -o b.npz")


def test_bad_cells_are_named_by_line_and_column(fails):
    head = "t,qw,qx,qy,qz,wx,wy,wz\n"
    good = "0,1,0,0,0,,,\n0.5,,,,,0.1,0,0\n"
    for last, problem in [
        ("1,,,,,0.1,,0\n", "line 4: column 'wy' is empty, but 'wx' is not; an angular velocity needs all"),
        ("1,1,0,nan,0,,,\n", "line 4: column 'qy' is empty, but 'qw' is not; a point needs all"),
        ("1,1,0,0,0,n/a,0,0\n", "line 4: column 'wx' holds 'n/a', which is not a number"),
        ("1,1,0,0,0,0,inf,0\n", "line 4: column 'wy' holds inf, which is not a finite number"),
        ("1,2,0,0,0,0,0,0\n", "line 4"),
        (",1,0,0,0,0,0,0\n", "line 4: column 't' is empty"),
    ]:
        write("a.csv", head + good + last)
        assert problem in fails(f"fit a.csv {OPTIONS} -o a.npz")


def test_invalid_options(fails):
    write("imu.csv", imu())
    for line, problem in [
        ("--space so:3 --rates wx,wy,wz --rate-sigma 1", "--rates is for noisy data; give --smooth, too"),
        ("--space so:3 --penalty jerk", "--penalty is for noisy data; give --smooth, too"),
        ("--space so:3 --smooth --rates wx,wy,wz --rate-sigma 1", "--rates needs the standard deviation of the points"),
        ("--space so:3 --smooth --sigma 1 --rates wx,wy,wz", "--rates needs the standard deviation of one number of"),
        (
            "--space so:3 --smooth --sigma 1 --rates wx,wy --rate-sigma 1",
            "--rates wx,wy: an angular velocity has 3 numbe",
        ),
        ("--space so:3 --smooth --sigma 1 --rates wx,wy,ww --rate-sigma 1", "imu.csv has no column 'ww'; there are"),
        (
            "--space so:3 --smooth --sigma 1 --rates wx,wy,wz --rate-sigma 0",
            "--rate-sigma 0: the standard deviation must",
        ),
        (
            "--space so:3 --smooth --sigma 1 --rate-sigma 1",
            "there are no --rates, to which --rate-sigma and --rate-bias",
        ),
        ("--space so:3 --smooth --sigma 1 --velocity-sigma 1", "there are no --velocities, to which"),
        ("--space r:4 --smooth --sigma 1 --rates wx,wy,wz --rate-sigma 1", "--rates needs a space with one rotation"),
        (
            "--space so:3 --smooth --sigma 1 --velocities wx,wy,wz --velocity-sigma 1",
            "--velocities is not for rotations",
        ),
        ("--space r:4 --smooth --sigma 1 --velocities wx,wy,wz --velocity-sigma 1", "a velocity on euclidean:4 has 4"),
        (f"--time none {OPTIONS}", "--rates needs times"),
        (f"--max-gap 1 {OPTIONS}", "--rates cannot be combined with --max-gap"),
        (f"--dedup first {OPTIONS}", "--rates cannot be combined with --dedup"),
        (OPTIONS.replace("qz", "wx"), "column 'wx' of imu.csv cannot have two meanings"),
    ]:
        assert problem in fails(f"fit imu.csv {line} -o a.npz")


def test_a_wrong_noise_level_is_reported(run):
    write("imu.csv", imu())
    assert "(check --sigma, --rate-sigma and" in run(
        f"fit imu.csv {OPTIONS.replace('0.03', '0.003').replace('0.01', '0.001')} -o a.npz"
    )


def test_rates_alone_do_not_determine_attitudes(fails):
    write("a.csv", interleaved((RATES, W, OMEGA), (RATES[:0], Q, QUATERNIONS[:0])))
    assert "a.csv, line 2: there are no points, and rates and velocities alone do not determine a curve" in fails(
        f"fit a.csv {OPTIONS} -o a.npz"
    )


def test_smoothing_with_the_jerk(run):
    write_table("a.csv", {"t": POINTS, "x": PLACES[:, 0]})
    run("fit a.csv --space r:1 --smooth --penalty jerk -o a.npz")
    curve = ss.make_smoothing_spline(POINTS, PLACES[:, :1], "r:1", penalty="jerk")
    assert np.abs(ss.load("a.npz").points - curve.points).max() < 1e-10


def test_as_a_process():
    """With dates, whose rates are per second."""
    write("imu.csv", imu())
    lines = imu().splitlines()
    stamps = [np.datetime64("2024-05-01", "us") + int(1e6 * float(line.split(",")[0])) for line in lines[1:]]
    dated = [lines[0], *(f"{stamp},{line.partition(',')[2]}" for stamp, line in zip(stamps, lines[1:], strict=True))]
    write("imu.csv", "\n".join(dated))
    command = [sys.executable, "-m", "symspline", "fit", "imu.csv", *OPTIONS.split(), "-o", "a.npz"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, encoding="utf-8")
    assert not done.stdout and "\ngyro bias: 0.0" in done.stderr
    curve = ss.load("a.npz")
    assert curve.t.dtype.kind == "M" and np.all(np.abs(curve.parameters["gyro bias"].value - BIAS) < 0.02)
