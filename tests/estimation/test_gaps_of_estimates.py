"""Bands of estimates in gaps in which no sensor measures."""

import numpy as np

import symspline as ss
from symspline import _core, measure


def recording(seed, gap, m=2, end=60.0):
    """A smooth motion, with measured positions and velocities except in a gap."""
    rng = np.random.default_rng(seed)
    frequency, phase, size = rng.uniform(0.05, 0.3, (3, m)), rng.uniform(0, 6.28, (3, m)), rng.uniform(0.3, 1, (3, m))

    def path(t, nu=0):
        angle = 2 * np.pi * frequency
        waves = np.sin(angle * np.asarray(t)[:, None, None] + phase + nu * np.pi / 2)
        return np.sum(size * angle**nu * waves, axis=1)

    t, s = np.sort(rng.uniform(0, end, (2, 300)), axis=1)
    t, s = (x[(x < gap[0]) | (x > gap[1])] for x in (t, s))
    y, v = path(t) + 0.02 * rng.standard_normal((len(t), m)), path(s, 1) + 0.05 * rng.standard_normal((len(s), m))
    return path, t, y, s, v


def given(t, y, s, v):
    return [measure.Points(t, y, sigma=0.02), measure.Velocities(s, np.zeros(v.shape), v, sigma=0.05)]


def test_predictions_are_those_of_an_estimate_without_the_data(monkeypatch):
    """Blocks equal a new estimate with the same λ and knots, without the measurements of both sensors."""
    _, t, y, s, v = recording(0, (25, 30), m=1)
    calls, calibrated = [], _core.gap_factors
    monkeypatch.setattr(_core, "gap_factors", lambda *args: calls.append(args) or calibrated(*args))
    knots = np.linspace(0, 60, 121)
    curve = ss.estimate(given(t, y, s, v), knots, "r:1", tol=1e-9)
    at_knots, known, (times, firsts, (factors, sides), (residuals, _), counts, *_), *_ = calls[0]
    data, rows = (firsts, factors.reshape(len(times), -1), sides.reshape(len(times), -1)), residuals.reshape(-1, 1)
    for start in (5, 40):
        kept_t, kept_s = ((x < start) | (x > start + 5) for x in (t, s))
        omitted = np.flatnonzero((times >= start) & (times <= start + 5))
        chosen = omitted[counts[omitted]]
        probes, blocks = tuple(own[chosen] for own in data), [[0, len(omitted), 0, len(chosen)]]
        values, variances = _core.predictions_without(at_knots, known, data, rows, probes, omitted, blocks)
        other = ss.estimate(given(t[kept_t], y[kept_t], s[kept_s], v[kept_s]), knots, "r:1", lam=curve.report.lam)
        at = times[chosen]
        assert np.array_equal(at, t[~kept_t])
        np.testing.assert_allclose(values, (other(at) - curve(at)) / 0.02, atol=1e-5)
        expected = other.std(at, calibrated=False) ** 2 / 0.02**2
        np.testing.assert_allclose(variances, expected, rtol=1e-6)


def test_no_gap_where_another_sensor_measures():
    path, t, y, _, _ = recording(1, (25, 30))
    rng = np.random.default_rng(1)
    every = np.linspace(0, 60, 600)
    curve = ss.estimate(given(t, y, every, path(every, 1) + 0.05 * rng.standard_normal((600, 2))), 120, "r:2")
    assert curve.gaps == []
