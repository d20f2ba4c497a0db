"""Berry phases, and propagators of many qubits."""

import numpy as np
import pytest
from refused import raises
from test_propagator import PAULI

import symspline as ss
from symspline import quantum


def loop(rng, n, count=9, size=0.5, batch=()):
    space = ss.ComplexProjective(n)
    p = np.broadcast_to(space.random_point(rng), (*batch, count, n + 1))
    points = space.exp(p, size * space.random_tangent(rng, p))
    phases = np.exp(2j * np.pi * rng.uniform(size=(*batch, count, 1)))
    points = np.concatenate([points * phases, points[..., :1, :]], axis=-2)
    t = np.r_[0, np.cumsum(rng.uniform(0.5, 1.5, count))]
    return ss.CubicSpline(t, points, space, bc_type="periodic", on_failure="ignore")


def solid_angle(x):
    """Of a closed polygon on the sphere, by the triangles to the pole (Van Oosterom and Strackee 1983)."""
    a, b, c = np.array([0.0, 0, 1]), x[:-1], x[1:]
    triple = np.cross(b, c) @ a
    return 2 * np.arctan2(triple, 1 + b @ a + np.sum(b * c, axis=-1) + c @ a).sum()


@pytest.mark.parametrize("n", [1, 2, 5])
def test_phases_are_limits_of_bargmann_invariants(n):
    rng = np.random.default_rng(n)
    curve = loop(rng, n)
    states = curve(np.linspace(curve.t[0], curve.t[-1], 20_001))
    states *= np.exp(2j * np.pi * rng.uniform(size=(20_001, 1)))
    states[-1] = states[0]
    overlaps = np.sum(states[:-1].conj() * states[1:], axis=-1)
    discrete = -np.angle(np.prod(overlaps / abs(overlaps)))
    assert abs(np.angle(np.exp(1j * (quantum.berry_phase(curve) - discrete)))) < 1e-6


def test_phases_of_qubits_are_half_the_solid_angle():
    curve = loop(np.random.default_rng(0), 1)
    states = curve(np.linspace(curve.t[0], curve.t[-1], 20_001))
    x = np.einsum("...a,qab,...b->...q", states.conj(), PAULI, states).real
    phase = quantum.berry_phase(curve)
    assert abs(np.angle(np.exp(1j * (phase + solid_angle(x) / 2)))) < 1e-6
    assert quantum.berry_phase(curve.reverse()) == pytest.approx(-phase)


def test_batches_of_loops_and_invalid_curves():
    curves = loop(np.random.default_rng(1), 2, batch=(2, 3))
    phases = quantum.berry_phase(curves)
    assert phases.shape == (2, 3)
    for i in np.ndindex(2, 3):
        assert phases[i] == pytest.approx(quantum.berry_phase(curves[i[0]][i[1]]), abs=1e-12)
    raises("not closed", quantum.berry_phase, ss.CubicSpline(None, [[1, 0], [0.6, 0.8]], "cp:1"))
    raises("ComplexProjective", quantum.berry_phase, ss.CubicSpline(None, [np.eye(2), np.eye(2)], "u:2"))


def test_propagators_of_ten_qubits_are_computed_in_the_span_of_the_data():
    rng = np.random.default_rng(6)
    space = ss.ComplexProjective(2**10 - 1)
    p = np.broadcast_to(space.random_point(rng), (5, 2**10))
    curve = ss.CubicSpline(None, space.exp(p, 0.02 * space.random_tangent(rng, p)), space)
    u = quantum.propagator(curve, 4.0)
    assert np.abs(abs(np.vdot(u @ curve.points[0], curve.points[-1])) - 1) < 1e-12
    # The identity on vectors that are orthogonal to all points.
    basis = np.linalg.qr(np.concatenate([curve.points, curve.velocities[[0, -1]], rng.standard_normal((1, 2**10))]).T)[
        0
    ]
    aside = basis[:, -1]
    assert np.abs(u @ aside - aside).max() < 1e-12
