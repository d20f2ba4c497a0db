"""Defects that were found and mended: what a user saw, and what is seen now."""

import inspect
import pickle

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import symspline as ss
from symspline import _core, spaces
from symspline.cli import main
from symspline.jax import curve
from symspline.lonlat import from_lonlat, to_lonlat

S2 = ss.Sphere(2)
AXES = np.eye(3)


# ---- arrays ----


def misaligned(array):
    """The same numbers, contiguous, but beginning between two doubles."""
    array = np.asarray(array, float)
    moved = np.zeros(array.nbytes + 1, np.uint8)[1:].view(float).reshape(array.shape)
    moved[:] = array
    assert moved.flags.c_contiguous and not moved.flags.aligned
    return moved


def test_misaligned_arrays_are_taken():
    t, v, x = [0.0, 1.0, 3.0], [0.0, 1.0, 0.5], [0.5, 2.0]
    expected = ss.CubicSpline(t, AXES, S2, bc_type=((1, v), "natural"))
    spline = ss.CubicSpline(misaligned(t), misaligned(AXES), S2, bc_type=((1, misaligned(v)), "natural"))
    assert spline == expected
    assert np.array_equal(spline(misaligned(x)), expected(x))
    assert np.array_equal(ss.evaluate(x, t, AXES, misaligned(spline.velocities), S2), expected(x))
    assert np.array_equal(S2.log(misaligned(AXES[0]), AXES[1]), S2.log(AXES[0], AXES[1]))
    moved = spline.jvp(misaligned(x), points=misaligned(AXES), t=misaligned(t))
    assert np.array_equal(moved, expected.jvp(x, points=AXES, t=t))
    square = ss.BezierCurve(misaligned(AXES), S2)
    assert np.array_equal(square(misaligned(x[:1])), ss.BezierCurve(AXES, S2)(x[:1]))


MASKED = np.ma.array(AXES, mask=[[0, 0, 0], [0, 0, 1], [1, 0, 0]])
TIMES = np.ma.array([0.0, 1.0, 2.0], mask=[0, 1, 0])


@pytest.mark.parametrize(
    "call, what",
    [
        (lambda: ss.CubicSpline(None, MASKED, S2), r"points\[1, 2\] is masked"),
        (lambda: ss.CubicSpline(None, list(MASKED), S2), r"points\[1, 2\] is masked"),
        (lambda: ss.CubicSpline(None, (AXES, MASKED), "r:3 x r:3"), r"points\[1, 2\] is masked"),
        (lambda: ss.CubicSpline(TIMES, AXES, S2), r"t\[1\] is masked"),
        (lambda: ss.CubicSpline(None, AXES, S2)(TIMES), r"x\[1\] is masked"),
        (lambda: ss.fit_many([(TIMES, AXES)], S2), r"curve 0: t\[1\] is masked"),
        (lambda: S2.project(MASKED), r"x\[1, 2\] is masked"),
        (lambda: ss.BezierCurve(MASKED, S2), r"control_points\[1, 2\] is masked"),
        (lambda: ss.convert.state_to_density(MASKED), r"state\[1, 2\] is masked"),
        (lambda: from_lonlat(TIMES, 0), r"lon\[1\] is masked"),
        (lambda: to_lonlat(MASKED), r"points\[1, 2\] is masked"),
        (lambda: S2.distance(np.ma.masked, AXES), r"p is masked"),
    ],
)
def test_masked_numbers_are_refused(call, what):
    with pytest.raises(ss.ValidationError, match=what):
        call()


def test_masked_arrays_without_masked_numbers_are_taken():
    points = np.ma.array(AXES)
    spline = ss.CubicSpline(np.ma.array([0.0, 1.0, 2.0], mask=False), points, S2)
    assert spline == ss.CubicSpline(None, list(points), S2) == ss.CubicSpline(None, AXES, S2)


# ---- spaces ----


def test_a_product_has_types():
    assert ss.space("sphere:2 x cp:1").dtype == (np.dtype(float), np.dtype(complex))


def test_digits_of_other_scripts_name_no_space():
    with pytest.raises(ss.ValidationError, match="behind the colon come whole numbers"):
        ss.space("sphere:٢")


def test_rounding_of_points():
    """|p|², the condition, |p|, and 1 or more."""
    far = ss.Hyperbolic(1).exp([1.0, 0.0], [[0.0, 5.0], [0.0, 0.0]])
    assert ss.Hyperbolic(1).rounding(far) == pytest.approx([np.cosh(10), 1.0], rel=1e-12)
    for space in (ss.SymmetricPositiveDefinite(2), ss.HermitianPositiveDefinite(2)):
        assert space.rounding(np.diag([1e-3, 10.0])) == pytest.approx(10.001 * 1000.1, rel=1e-12)
    assert ss.Euclidean(1).rounding([[-7.0], [0.3]]).tolist() == [7.0, 1.0]
    assert (S2.rounding(AXES) == 1.0).all()
    pair = ss.space("r:1 x h:1")
    assert pair.rounding(([3.0], [1.25, 0.75])) == 3.0


# ---- splines ----


def test_the_signature_names_the_parameters():
    assert list(inspect.signature(ss.CubicSpline).parameters) == [
        "t", "points", "space", "bc_type", "method", "tol", "max_iter", "extrapolate", "on_failure", "check",
        "progress",
    ]  # fmt: skip


def batch_of(space):
    points = np.stack([AXES, AXES[[1, 0, 2]]])
    return ss.CubicSpline(None, (points, points) if isinstance(space, ss.Product) else points, space)


@pytest.mark.parametrize("own_knots", [False, True])
def test_derivatives_of_no_curves(own_knots):
    t = np.tile(np.arange(3.0), (2, 1)) if own_knots else None
    none = ss.CubicSpline(t, np.stack([AXES, AXES[[1, 0, 2]]]), S2, bc_type=((1, np.zeros(3)), "natural"))[:0]
    assert none.jvp([0.5, 1.0], points=none.points).shape == (0, 2, 3)
    gradient = none.vjp([0.5, 1.0], np.zeros((0, 2, 3)))
    assert gradient.points.shape == (0, 3, 3)
    # What all curves share has the gradient of a sum over none.
    assert np.array_equal(gradient.t, np.zeros((0, 3) if own_knots else 3))
    assert np.array_equal(gradient.ends[0], np.zeros(3))


def test_derivatives_of_no_curves_in_a_product():
    none = batch_of(ss.space("sphere:2 x r:3"))[:0]
    assert [a.shape for a in none.jvp(0.5, points=none.points)] == [(0, 3), (0, 3)]
    assert none.vjp(0.5, (np.zeros((0, 3)), np.zeros((0, 3)))).t.shape == (3,)


@pytest.mark.parametrize("space", ["sphere:2", "sphere:2 x r:3"])
def test_pickles_and_parts_of_a_batch_are_splines(space):
    batch = batch_of(ss.space(space))
    for spline in (batch, batch[1], batch[:1], pickle.loads(pickle.dumps(batch))):
        assert type(spline) is ss.CubicSpline
        assert type(spline.report) is ss.Report
    assert pickle.loads(pickle.dumps(batch)) == batch
    assert pickle.loads(pickle.dumps(batch[1])).report == batch[1].report == batch.report.map(lambda c: c[1])


@pytest.mark.parametrize("space, checks", [("sphere:2", 0), ("sphere:2 x r:3", 2), ("r:3 x sphere:299", 2)])
def test_every_factor_is_checked_once(space, checks, monkeypatch):
    space, fit, calls = ss.space(space), _core.fit, []

    def counted(handle, *arguments):
        calls.append((arguments[6], arguments[10]))
        return fit(handle, *arguments)

    monkeypatch.setattr(_core, "fit", counted)
    points = tuple(np.eye(3, *factor.point_shape) for factor in spaces.factors_of(space))
    ss.CubicSpline(None, points if checks else points[0], space)
    # Whether the core checks, and whether it only checks.
    assert calls == ([(True, True)] * checks + [(False, False)] * checks if checks else [(True, False)])


# ---- progress of evaluation ----


@pytest.mark.parametrize("nu", [0, 1])
@pytest.mark.parametrize(
    "space, per_curve", [("sphere:2", False), ("sphere:2", True), ("sphere:2 x r:3", False)]
)
def test_progress_of_evaluation_counts_points(space, per_curve, nu):
    spline = batch_of(ss.space(space))
    x = np.linspace(0, 2, 100).reshape((2, 50) if per_curve else 100)
    calls = []
    spline(x, nu, per_curve=per_curve, progress=lambda *call: calls.append(call))
    total = 2 * (50 if per_curve else 100) * (2 if "x" in space else 1)
    assert calls[-1] == (total, total) and calls == sorted(calls)
    calls.clear()
    arrays = (x, None, spline.points, spline.velocities, space, nu)
    ss.evaluate(*arrays, per_curve=per_curve, progress=lambda *call: calls.append(call))
    assert calls[-1] == (total, total)


def test_progress_within_an_evaluation():
    """Between its ends, too, the core counts points, of which complex ones of three numbers have six doubles."""
    rng = np.random.default_rng(0)
    space = ss.ComplexProjective(2)
    points = np.stack([space.exp(np.eye(1, 3)[0], v) for v in ([0, 0, 0], [0, 0.3j, 0], [0, 0, 0.3])])
    spline, calls, size = ss.CubicSpline(None, points, space), [], 100_000
    while len(calls) < 3 and size < 2**27:
        # Twenty times a second somebody is called; how fast a machine is nobody knows.
        calls.clear()
        size *= 2
        x = rng.uniform(0, 2, size)
        spline(x, 2, progress=lambda *call: calls.append(call))
    finished, total = np.transpose(calls)
    assert len(calls) >= 3 and (total == size).all() and (np.diff(finished) >= 0).all()
    assert finished[-1] == size and (finished[1:-1] < size).all()


def test_progress_of_evaluation_must_be_a_function():
    with pytest.raises(ss.ValidationError, match="progress must be a function"):
        batch_of(S2)(0.5, progress=3)
    with pytest.raises(ss.ValidationError, match="progress must be a function"):
        ss.evaluate(0.5, None, AXES, AXES, S2, progress=3)


def test_an_exception_in_progress_stops_an_evaluation():
    def stop(*_):
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        batch_of(S2)(0.5, progress=stop)


# ---- derivatives in JAX ----

FAR = np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0.5]]) / np.sqrt([[1.0], [1], [1.25]])


def test_a_curve_that_did_not_converge_has_no_derivatives_in_jax():
    stopped = {"method": "fixed-point", "max_iter": 6, "on_failure": "ignore"}
    with jax.enable_x64(True):
        spline = ss.CubicSpline(None, FAR, S2, **stopped)
        assert not spline.report.converged

        def function(points, t, x):
            return curve(x, t, points, S2, **stopped)

        arguments = (jnp.array(FAR), jnp.arange(3.0), jnp.array([0.5, 1.7]))
        np.testing.assert_allclose(function(*arguments), spline([0.5, 1.7]), atol=1e-15)
        for derivatives in (jax.jacfwd, jax.jacrev):
            for change in derivatives(function, argnums=(0, 1))(*arguments):
                assert np.isnan(change).all()


def test_curves_of_a_batch_that_converged_keep_their_derivatives_in_jax():
    options = {"method": "fixed-point", "max_iter": 6, "on_failure": "ignore", "tol": 0.02}
    both = np.stack([AXES, FAR])
    assert ss.CubicSpline(None, both, S2, **options).report.converged.tolist() == [True, False]

    def function(points):
        return curve(0.5, jnp.arange(3.0), points, S2, **options).sum()

    with jax.enable_x64(True):
        gradient, alone = (jax.grad(function)(jnp.array(points)) for points in (both, AXES))
    np.testing.assert_array_equal(gradient[0], alone)
    assert np.isfinite(alone).all() and np.isnan(gradient[1]).all()


# ---- the command line ----


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
    assert code == 2 and "--tol: invalid float value: '1_0'" in err
    code, err = said("t,x", ["0,1", "1, 2.5 "], ["--space", "r:1"])
    assert (code, err) == (0, "")
    assert main(["sample", "a.npz", "-n", "1_0", "-o", "b.csv"]) == 2


@pytest.mark.parametrize("lon", ["1e15", "9999", "-9999"])
def test_longitudes_that_are_none(said, lon):
    code, err = said("t,lon,lat", ["0,10,20", f"1,{lon},21"], ["--lonlat"])
    assert code == 2 and "line 3: longitude" in err and "not between -3600 and 3600 degrees" in err
    # Round the globe and further.
    assert said("t,lon,lat", ["0,350,20", "1,370,21"], ["--lonlat"]) == (0, "")
