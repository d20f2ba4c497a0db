"""Fits and the use of their curves: any input gives a valid curve or an error."""

import io
import pickle

import numpy as np
from cases import EPS, condition
from hypothesis import given, note
from hypothesis import strategies as st

import symspline as ss
from fuzz.fits import POLICIES, come_back, ends, knots, nodes, options, times
from fuzz.outcomes import Refusal, attempt
from fuzz.places import joined, parts, spaces, vectors
from fuzz.values import GOOD, ODD, array_like, moods, nonsense, rarely

batches = st.sampled_from([(), (), (1,), (3,), (2, 2)])


@given(st.data())
def test_fit(data):
    draw = data.draw
    mood, space, batch, n = draw(moods), draw(spaces), draw(batches), draw(st.integers(2, 7))
    p = draw(nodes(space, batch, n))
    bc_type = draw(ends(space, p, mood))
    if bc_type is not None and isinstance(bc_type, str) and bc_type == "periodic":
        p = come_back(space, p)
    p = joined(space, [draw(array_like(part, mood)) for part in p])
    if mood == ODD and rarely(draw):
        p = draw(nonsense)
    t, more = draw(knots(batch, n, mood)), draw(options(mood))
    name = draw(st.sampled_from([space, str(space)]))
    inputs = (t, p, bc_type)
    with np.errstate(**draw(st.sampled_from([{}, {"all": "raise"}]))):
        spline = attempt(lambda: ss.CubicSpline(t, p, name, bc_type=bc_type, **more), *inputs, wrong_types=mood == ODD)
        if isinstance(spline, Refusal):
            note(repr(spline.error))
            spline = getattr(spline.error, "spline", None)
        if spline is not None:
            use(draw, spline, mood, more.get("check", True) is True)


def use(draw, spline, mood, checked):
    """Everything that can be done with a curve."""
    assert isinstance(spline, ss.CubicSpline)
    note(repr(spline.report))
    converged = np.asarray(spline.report.converged)
    assert converged.shape == batch_of(spline)
    if checked and converged.all():
        holds(spline)
        comes_back(spline)
    policy, per_curve = draw(st.sampled_from(POLICIES)), rarely(draw)
    x = draw(times(spline.t, mood, batch_of(spline) if per_curve else ()))
    nu = draw(st.sampled_from([0, 1, 2]))
    if mood == ODD:
        nu, policy = draw(st.one_of(st.just(nu), nonsense)), draw(st.one_of(st.just(policy), nonsense))
    values = attempt(lambda: spline(x, nu, extrapolate=policy, per_curve=per_curve), x, wrong_types=mood == ODD)
    if not isinstance(values, Refusal):
        lead = np.shape(x) if per_curve else batch_of(spline) + np.shape(x)
        for factor, value in zip(parts(spline.space), parts(values), strict=True):
            assert value.shape == lead + factor.point_shape and value.dtype == factor.dtype
    for quantity in (spline.length, spline.bending_energy, lambda: spline.control_points, lambda: str(spline.report)):
        result = attempt(quantity)
        if quantity in (spline.length, spline.bending_energy) and not isinstance(result, Refusal):
            assert np.shape(result) == batch_of(spline)
    assert "CubicSpline" in repr(spline)


def batch_of(spline):
    """The leading axes of a batch of curves."""
    space, points = parts(spline.space)[0], parts(spline.points)[0]
    return points.shape[: points.ndim - 1 - len(space.point_shape)]


SECONDS = {"W": 604800.0, "D": 86400.0, "h": 3600.0, "m": 60.0, "s": 1.0}
SECONDS |= {"ms": 1e-3, "us": 1e-6, "ns": 1e-9, "ps": 1e-12, "fs": 1e-15, "as": 1e-18}


def seconds(steps):
    """Differences of numbers or dates."""
    if steps.dtype.kind != "m":
        return steps.astype(float)
    unit, count = np.datetime_data(steps.dtype)
    # NumPy's own quotients of units overflow for attoseconds.
    return steps.astype(np.int64) * (count * SECONDS[unit])


def holds(spline):
    """A curve that converged goes through its points, and is finite all along."""
    space, own = spline.space, spline.t.ndim > 1
    steps = seconds(np.diff(spline.t, axis=-1))
    if steps.min() < 1e-60 or steps.max() > 1e60:
        # Derivatives may be too large for doubles.
        return
    found = attempt(lambda: spline(spline.t, per_curve=own))
    assert not isinstance(found, Refusal), found
    for factor, q, p, u in zip(*map(parts, (space, found, spline.points, spline.velocities)), strict=True):
        assert np.isfinite(q).all()
        # Rounding is that of points, and of the control legs of long segments.
        allowed = 100 * EPS * max(condition(factor, p), np.max(np.abs(u)) * steps.max())
        off = min(np.max(np.abs(q - p)), np.max(factor.distance(q, p)))
        assert off <= allowed, f"{off} off a point, {allowed} is allowed"
    x = between(spline.t)
    for nu in range(3):
        found = attempt(lambda nu=nu: spline(x, nu, per_curve=own))
        assert not isinstance(found, Refusal), found
        assert all(np.isfinite(part).all() for part in parts(found)), f"nu={nu}: {found} at {x}"


def between(t):
    """Some times between knots."""
    t = np.asarray(t)
    if t.dtype.kind != "f":
        return t
    shares = [0, 0.25, 0.5, 0.75]
    return np.concatenate([t[..., :-1] + share * (t[..., 1:] - t[..., :-1]) for share in shares], axis=-1)


def comes_back(spline):
    """Pickled or saved, a curve is what it was."""
    again = attempt(lambda: pickle.loads(pickle.dumps(spline)))
    assert again == spline and again.report == spline.report
    file = io.BytesIO()
    spline.save(file)
    file.seek(0)
    again = attempt(lambda: ss.load(file))
    assert not isinstance(again, Refusal), again
    assert again == spline and again.report == spline.report and again.extrapolate == spline.extrapolate


@given(st.data())
def test_fit_many(data):
    draw = data.draw
    mood, space = draw(moods), draw(spaces)
    bc_type, curves = draw(st.sampled_from(["natural", "clamped", "not-a-knot", ("natural", "clamped")])), []
    for _ in range(draw(st.integers(0, 4))):
        n = draw(st.integers(2, 6))
        p = joined(space, [draw(array_like(part, mood)) for part in draw(nodes(space, (), n))])
        curve = (draw(knots((), n, mood)), p)
        curves.append(draw(nonsense) if mood == ODD and rarely(draw) else curve)
    given_ = draw(nonsense) if mood == ODD and rarely(draw) else draw(st.sampled_from([curves, tuple(curves)]))
    more = draw(options(mood))
    fitted = attempt(lambda: ss.fit_many(given_, space, bc_type=bc_type, **more), curves, wrong_types=mood == ODD)
    if isinstance(fitted, Refusal):
        note(repr(fitted.error))
        fitted = getattr(fitted.error, "spline", None) or []
    for spline, (t, p) in zip(fitted, curves if fitted else [], strict=True):
        use(draw, spline, mood, more.get("check", True) is True)
        own = {key: more[key] for key in more if key in ("method", "tol", "max_iter", "check")}
        own |= {"bc_type": bc_type, "on_failure": "ignore"}
        alone = attempt(lambda t=t, p=p, own=own: ss.CubicSpline(t, p, space, **own))
        if isinstance(alone, Refusal):
            # One of its points is none, which among many is a curve that failed.
            assert more.get("on_failure") in ("warn", "ignore") and not spline.report.converged
            continue
        assert alone == spline and alone.report == spline.report


@given(st.data())
def test_evaluate(data):
    draw = data.draw
    mood, space, batch, n = draw(moods), draw(spaces), draw(batches), draw(st.integers(2, 7))
    p = draw(nodes(space, batch, n))
    u = joined(space, [draw(array_like(draw(vectors(f, q)), mood)) for f, q in zip(parts(space), p, strict=True)])
    p = joined(space, [draw(array_like(part, mood)) for part in p])
    t = draw(knots(batch, n, mood))
    nu, policy = draw(st.sampled_from([0, 1, 2])), draw(st.sampled_from(POLICIES))
    x = draw(times(np.arange(float(n)) if t is None or mood == ODD else t, mood))
    if mood == ODD:
        p, u, nu = (draw(nonsense) if rarely(draw) else value for value in (p, u, nu))
    values = attempt(
        lambda: ss.evaluate(t, p, u, space, x, nu, extrapolate=policy), x, t, p, u, wrong_types=mood == ODD
    )
    if not isinstance(values, Refusal):
        for factor, value in zip(parts(space), parts(values), strict=True):
            assert value.shape == batch + np.shape(x) + factor.point_shape or mood != GOOD
