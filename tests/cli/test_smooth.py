"""Curves near noisy points: ``fit --smooth``."""

import re
import warnings

import numpy as np
import pytest
from compare import parts
from scipy.spatial.transform import Rotation
from tabular import numbered, numbers, read_table, table, write, write_table

import symspline as ss

RNG = np.random.default_rng(0)
T = np.arange(60.0)
LON, LAT = (10 + 1e-2 * T + 1e-2 * RNG.standard_normal(60), 50 + np.sin(T / 20) + 1e-2 * RNG.standard_normal(60))
PLACES = ss.geo.from_lonlat(LON, LAT)

# What is compared with the command line warns of straight curves, which it reports in its summary.
pytestmark = pytest.mark.filterwarnings("ignore::symspline.SmoothingWarning")


@pytest.fixture(autouse=True)
def track():
    write_table("a.csv", {"t": T, "lon": LON, "lat": LAT})


def near(found, expected):
    """Curves with the same knots; points go through text, degrees and back."""
    assert np.array_equal(found.t, expected.t)
    for own, other in zip(parts(found.points), parts(expected.points), strict=True):
        assert np.abs(own - other).max() < 1e-10


@pytest.mark.parametrize(
    ("line", "options"),
    [
        ("", {}),
        ("--criterion gcv", {}),
        ("--criterion reml", {"criterion": "reml"}),
        ("--lam 12.5", {"lam": 12.5}),
        ("--sigma 0.01", {"criterion": "cp", "sigma": np.radians(0.01)}),
        ("--criterion gcv --robust", {"loss": "cauchy"}),
    ],
)
def test_a_noisy_track(run, line, options):
    out = run(f"fit a.csv --lonlat -o a.npz --smooth {line}")
    expected = ss.make_smoothing_spline(T, PLACES, "sphere:2", **options)
    near(ss.load("a.npz"), expected)
    report = expected.report
    assert out == (
        f"a.npz: 1 curve near 60 points of sphere:2, converged: λ {report.lam:.3g}, {report.df:.3g} degrees of "
        f"freedom, noise {np.degrees(report.sigma):.3g}° ({6_371_008.8 * report.sigma:.3g} m)\n"
    )
    run("sample a.npz -n 5 -o b.csv")
    assert np.abs(numbers(table("b.csv"), "lon", "lat")[0] - [LON[0], LAT[0]]).max() < 0.05
    run("check a.npz")


def test_times_may_repeat(run, fails):
    write_table("a.csv", {"t": T // 2, "lon": LON, "lat": LAT})
    assert "--dedup first or mean" in fails("fit a.csv --lonlat -o a.npz")
    run("fit a.csv --lonlat --smooth -o a.npz")
    near(ss.load("a.npz"), ss.make_smoothing_spline(T // 2, PLACES, "sphere:2"))
    run("fit a.csv --lonlat --smooth --dedup first -o a.npz")
    near(ss.load("a.npz"), ss.make_smoothing_spline(T[:30], PLACES[::2], "sphere:2"))
    write_table("a.csv", {"t": -(T // 2), "lon": LON, "lat": LAT})
    assert fails("fit a.csv --lonlat --smooth -o b.npz").endswith("must not decrease; --sort puts the rows in order")
    write_table("a.csv", {"t": T - T, "lon": LON, "lat": LAT})
    assert "The data have one time only" in fails("fit a.csv --lonlat --smooth -o b.npz")


def test_segments_and_several_curves(run):
    t = np.r_[T[:20], T[20:40] + 50, 200, 200, T[42:] + 300]
    write_table("a.csv", {"t": t, "lon": LON, "lat": LAT})
    out = run("fit a.csv --lonlat --smooth --max-gap 5 -o a.npz")
    assert out.startswith("a.npz: 3 curves near 58 points") and " to " in out
    assert out.endswith("; 2 rows alone between gaps omitted\n")
    pieces = ss.fit_segments(t, PLACES, "sphere:2", max_gap=5, smooth=True)
    for found, expected in zip(ss.load("a.npz"), pieces, strict=True):
        near(found, expected)
    rows = "".join(f"{'ab'[i % 2]},{i},{LON[i]}\n" for i in range(60))
    write("b.csv", "id,t,x\n" + rows)
    run("fit b.csv --space r:1 --curve id --smooth --criterion reml -o b.npz")
    for i, found in enumerate(ss.load("b.npz").values()):
        near(found, ss.make_smoothing_spline(T[i::2], LON[i::2, None], "r:1", criterion="reml"))


def poses():
    noise = 0.02 * np.random.default_rng(1).standard_normal((60, 3))
    turning = ss.rotations.from_rotation_vectors(noise + np.array([0, 0, 1]))
    return turning, np.stack([T, LON, LAT], axis=-1)


@pytest.mark.parametrize(
    ("line", "options"),
    [("", {}), ("--lam 2,3", {"lam": (2.0, 3.0)}), ("--sigma 0.02,0.1", {"criterion": "cp", "sigma": (0.02, 0.1)})],
)
def test_smoothing_parameters_per_factor(run, line, options):
    space, p = ss.space("so:3 x r:3"), poses()
    write_table("a.npz", {"t": T, **numbered(p)})
    out = run(f"fit a.npz --space '{space}' -o b.npz --smooth {line}")
    expected = ss.make_smoothing_spline(T, p, space, **options)
    near(ss.load("b.npz"), expected)
    turning, place = expected.report
    assert f"so:3: λ {turning.lam:.3g}" in out and f"; euclidean:3: λ {place.lam:.3g}" in out


def test_a_bound_is_reported(run):
    write_table("b.csv", {"t": T, "x": T**2})
    assert "(at its bound), 60 degrees" in run("fit b.csv --space r:1 --smooth --criterion reml -o b.npz")


def test_contradicting_options(fails):
    for line, says in [
        (
            "--smooth --bc-type not-a-knot",
            "--bc-type is for curves through the points; omit it with --smooth",
        ),
        ("--smooth --method newton", "--method is for curves through the points; omit it with --smooth"),
        ("--smooth --tol 1e-9", "--tol is for curves through the points; omit it with --smooth"),
        ("--smooth --dedup mean", "with --smooth all points of one time count; omit --dedup mean"),
        ("--sigma 0.1", "--sigma is for noisy data; give --smooth, too"),
        ("--robust", "--robust is for noisy data; give --smooth, too"),
        ("--criterion reml", "--criterion is for noisy data; give --smooth, too"),
        ("--lam 1", "--lam is for noisy data; give --smooth, too"),
        ("--smooth b.csv", "unrecognized arguments: b.csv"),
        ("--smooth adaptive b.csv", "unrecognized arguments: b.csv"),
        ("--smooth=adaptve", "argument --smooth: invalid choice: 'adaptve'; did you mean adaptive?"),
        ("--smooth adaptive --lam 1", "--lam gives one λ, and --smooth adaptive lets it vary; omit one of them"),
        ("--noise adaptive", "--noise is for noisy data; give --smooth, too"),
        ("--smooth --criterion gvc", "invalid choice: 'gvc'; did you mean gcv?"),
        ("--smooth --criterion cp", "--criterion cp needs the noise; give it with --sigma"),
        ("--smooth --criterion gcv --lam 2", "--lam gives λ, which --criterion would choose; omit one of them"),
        ("--smooth --lam 1_0", "argument --lam: 1_0: give a finite number >= 0, such as 0.1"),
        ("--smooth --lam=-1", "argument --lam: -1: give a finite number >= 0"),
        ("--smooth --lam 1,2", "lam has shape (2,), but must be a number"),
        ("--smooth --sigma small", "argument --sigma: small: give a finite number >= 0"),
        ("--smooth --sigma 0", "argument --sigma: 0: the standard deviation must be greater than 0"),
    ]:
        assert says in fails(f"fit a.csv --lonlat -o a.npz {line}")


def test_samples_have_standard_deviations(run):
    run("fit a.csv --lonlat --smooth -o a.npz")
    spline = ss.load("a.npz")
    run("sample a.npz -n 7 --nu 0,1,2 -o b.npz")
    found = read_table("b.npz")
    x = found["t"]
    assert [name for name in found if name.startswith("std")] == ["std", "std_d1"]
    assert np.array_equal(found["std"], np.degrees(spline.std(x)))
    assert np.array_equal(found["std_d1"], np.degrees(spline.std(x, nu=1)))


def test_tracks_with_posteriors_of_both_kinds_are_in_one_file(run):
    """The posterior of a track that is far from flat has matrices, and that of others numbers."""
    rows = [
        (t, lon, lat, name)
        for name, last in (("A", 5), ("B", 145))
        for t, (lon, lat) in enumerate([(1, 2), (2, 2.5), (3, 2.4), (4, 3), (last, 3.3)])
    ]
    write("k.csv", "t,lon,lat,id\n" + "".join(f"{t},{lon},{lat},{name}\n" for t, lon, lat, name in rows))
    run("fit k.csv --lonlat --curve id --smooth -o m.npz")
    found = ss.load("m.npz")
    for name, last in (("A", 5), ("B", 145)):
        points = ss.geo.from_lonlat([1, 2, 3, 4, last], [2, 2.5, 2.4, 3, 3.3])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ss.SmoothingWarning)
            alone = ss.make_smoothing_spline(np.arange(5.0), points, "sphere:2")
        assert found[name] == alone
        np.testing.assert_array_equal(found[name].std([0.3, 2.2]), alone.std([0.3, 2.2]))
    run("check m.npz")


def test_rows_that_are_probably_outliers_are_named(run, fails):
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.5, 1.5, 40))
    t[25:] += 30
    turns = np.stack([np.sin(0.1 * t), np.cos(0.05 * t), 0.02 * t], axis=1) + 0.01 * rng.standard_normal((40, 3))
    turns[17] += [0, 2.5, 0]
    q = Rotation.from_rotvec(turns).as_quat(scalar_first=True)
    columns = {"t": t, **dict(zip(("qw", "qx", "qy", "qz"), q.T, strict=True))}
    write_table("a.csv", columns)
    note = "a.csv, line 19: the point is probably an outlier, "
    out = run("fit a.csv --space so:3 -o a.npz", notes=True)
    assert note in out and " from its neighbours, and most steps are 0." in out
    assert "; omit outliers, or fit near the points with --smooth --robust" in out
    size = min(ss.space("so:3").distance(ss.load("a.npz").points[17], ss.load("a.npz").points[[16, 18]]))
    assert f"{note}{size:.3g} from its neighbours" in out
    out = run("fit a.csv --space so:3 --smooth -o a.npz", notes=True)
    assert note in out and " from the curve, and half of the points are within 0." in out
    assert "--robust reduces the influence of outliers" in out
    assert "outlier" not in run("fit a.csv --space so:3 --smooth --robust -o a.npz")
    # A table without outliers, also with a gap or points at rest, has no such note.
    turns[17] -= [0, 2.5, 0]
    turns[30:] = turns[30]
    q = Rotation.from_rotvec(turns).as_quat(scalar_first=True)
    write_table("a.csv", {"t": t, **dict(zip(("qw", "qx", "qy", "qz"), q.T, strict=True))})
    assert "outlier" not in run("fit a.csv --space so:3 -o a.npz")
    assert "outlier" not in run("fit a.csv --space so:3 --smooth -o a.npz")


def test_rounding_errors_are_no_outliers(run):
    rest = np.ones(40) + np.random.default_rng(0).choice([0, 2e-16, -1e-16], 40)
    rest[20] += 5e-15
    write_table("a.csv", {"t": np.arange(40), "x": rest})
    assert "outlier" not in run("fit a.csv --space r:1 -o a.npz")
    line = np.arange(40) / 3
    line[13] += 1e-12
    write_table("a.csv", {"t": np.arange(40), "x": line})
    assert "outlier" not in run("fit a.csv --space r:1 --smooth --lam 1e9 -o a.npz", notes=False)


def test_motions_that_are_quick_are_no_outliers(run):
    x = np.concatenate([0.01 * np.arange(15), [5.0], 10 + 0.01 * np.arange(15)])
    write_table("a.csv", {"t": np.arange(31), "x": x + 0.001 * np.cos(np.arange(31))})
    assert "outlier" not in run("fit a.csv --space r:1 -o a.npz")


def burst(kind):
    """A slow motion with a burst, without one, or with a part of larger noise."""
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0, 60, 300))
    y = 0.3 * np.sin(0.1 * np.pi * t)
    if kind == "burst":
        y += np.exp(-(((t - 30) / 1.8) ** 2) / 2) * np.sin(np.pi * (t - 30))
    return t, y + np.where((t > 20) & (t < 40) & (kind == "noise"), 0.2, 0.02) * rng.standard_normal(300)


ADAPTIVE = {"lam": "adaptive", "noise": "adaptive"}


def test_smoothness_that_varies(run):
    t, y = burst("burst")
    write_table("b.csv", {"t": t, "x": y})
    expected = ss.make_smoothing_spline(t, y[:, None], "r:1", lam="adaptive")
    report = expected.report
    for line in ("b.csv --smooth adaptive", "--smooth adaptive b.csv", "--smooth=adaptive b.csv"):
        out = run(f"fit {line} --space r:1 -o b.npz")
        near(ss.load("b.npz"), expected)
        assert out.endswith(
            f"converged: λ {report.lam:.3g} (varies), {report.df:.3g} degrees of freedom, noise {report.sigma:.3g}, "
            f"gain {report.gain:.3g}\n"
        )
    assert f"λ {report.lam:.3g} (varies), " in run("info b.npz")
    run("fit b.csv --space r:1 --smooth adaptive --criterion reml --penalty jerk --sigma 0.02 -o b.npz")
    options = {"criterion": "reml", "penalty": "jerk", "sigma": 0.02}
    near(ss.load("b.npz"), ss.make_smoothing_spline(t, y[:, None], "r:1", "adaptive", **options))


def test_noise_that_varies_is_not_taken_for_outliers(run):
    t, y = burst("noise")
    write_table("b.csv", {"t": t, "x": y})
    out = run("fit b.csv --space r:1 --smooth --noise adaptive -o b.npz")
    expected = ss.make_smoothing_spline(t, y[:, None], "r:1", noise="adaptive")
    near(ss.load("b.npz"), expected)
    assert f"noise {expected.sigma:.3g} (varies), gain {expected.report.gain:.3g}\n" in out
    y[150] += 3
    write_table("b.csv", {"t": t, "x": y})
    out = run("fit b.csv --space r:1 --smooth --noise adaptive -o b.npz", notes=True)
    assert "b.csv, line 152: the point is probably an outlier, " in out


def test_curves_of_which_some_vary_are_in_one_file(run):
    curves = {kind: burst(kind) for kind in ("burst", "slow", "noise")}
    rows = "".join(f"{kind},{s},{x}\n" for kind, (t, y) in curves.items() for s, x in zip(t, y, strict=True))
    write("b.csv", "id,t,x\n" + rows)
    out = run("fit b.csv --space r:1 --curve id --smooth adaptive --noise adaptive -o b.npz")
    alone = {kind: ss.make_smoothing_spline(t, y[:, None], "r:1", **ADAPTIVE) for kind, (t, y) in curves.items()}
    loaded = ss.load("b.npz")
    for kind, curve in alone.items():
        near(loaded[kind], curve)
        assert np.array_equal(loaded[kind].lam_at(curve.t), curve.lam_at(curve.t))
        assert np.array_equal(loaded[kind].sigma_at(curve.t), curve.sigma_at(curve.t))
    assert " (varies in 1), " in out and "degrees of freedom" in out
    run("check b.npz")


def test_constant_smoothness_is_the_default(run):
    out = run("fit a.csv --lonlat --smooth -o a.npz")
    for line in ("--smooth a.csv", "a.csv --smooth constant --noise constant", "--smooth -- a.csv"):
        assert run(f"fit --lonlat -o a.npz {line}") == out


def test_ends_of_exact_data_are_no_outliers(run):
    """Natural ends bind the curve, which misses the data there by many times the other residuals."""
    t = np.arange(60)
    write_table("a.csv", {"t": t, "lon": np.round(t / 2, 4), "lat": np.round(30 * np.sin(t / 10), 4)})
    assert "outlier" not in run("fit a.csv --lonlat --smooth -o a.npz")


@pytest.mark.parametrize("line", ["", "--smooth"])
def test_two_outliers_beside_each_other_are_found(run, line):
    t = np.arange(200)
    x = np.sin(t / 15) + 0.02 * np.random.default_rng(0).standard_normal(200)
    x[80:82] += 1.0
    write_table("a.csv", {"t": t, "x": x})
    out = run(f"fit a.csv --space r:1 {line} -o a.npz", notes=True)
    assert "line 82: " in out or "line 83: " in out
    assert "the point is probably an outlier (and in 1 other row)" in out


def test_an_outlier_that_pulls_the_curve_is_found(run):
    """Between two gaps the curve follows a datum, whose residual is small."""
    t = np.r_[np.arange(40), 42, 45 + np.arange(40)]
    x = np.sin(t / 9) + 0.01 * np.random.default_rng(1).standard_normal(81)
    x[40] += 0.4
    write_table("a.csv", {"t": t, "x": x})
    out = run("fit a.csv --space r:1 --smooth -o a.npz", notes=True)
    assert "line 42: the point is probably an outlier, " in out


def test_noise_on_the_earth_is_also_a_distance(run):
    t = np.arange(60)
    rng = np.random.default_rng(0)
    for name, scale, unit in (("a", 1e-4, "m"), ("b", 0.1, "km")):
        lon, lat = np.c_[t / 10, np.sin(t / 9)].T + scale * rng.standard_normal((2, 60))
        write_table(f"{name}.csv", {"t": t, "lon": lon, "lat": lat})
        said = run(f"fit {name}.csv --lonlat --smooth --sigma {scale} -o {name}.npz")
        angle, distance = re.search(r"noise (\S+)° \((\S+) (?:m|km)\)", said).groups()
        assert f" {unit})" in said and f"noise {angle}° ({distance} {unit})" in run(f"info {name}.npz")
        assert float(distance) == pytest.approx(
            np.radians(float(angle)) * 6371.0088 * (1 if unit == "km" else 1000), rel=0.01
        )
        # The picture has the same number.
        assert f"noise {float(distance):.3g} {unit}" in ss.load(f"{name}.npz")._made_of(6_371_008.8)
