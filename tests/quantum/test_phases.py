"""Berry phases, purifications of mixed states, and propagators of many qubits."""

import numpy as np
import pytest
from scipy.linalg import sqrtm

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
    x = quantum.bloch_vector(curve(np.linspace(curve.t[0], curve.t[-1], 20_001)))
    phase = quantum.berry_phase(curve)
    assert abs(np.angle(np.exp(1j * (phase + solid_angle(x) / 2)))) < 1e-6
    assert quantum.berry_phase(curve.reverse()) == pytest.approx(-phase)


def test_batches_of_loops_and_invalid_curves():
    curves = loop(np.random.default_rng(1), 2, batch=(2, 3))
    phases = quantum.berry_phase(curves)
    assert phases.shape == (2, 3)
    for i in np.ndindex(2, 3):
        assert phases[i] == pytest.approx(quantum.berry_phase(curves[i[0]][i[1]]), abs=1e-12)
    with pytest.raises(ss.ValidationError, match="not closed"):
        quantum.berry_phase(ss.CubicSpline(None, [[1, 0], [0.6, 0.8]], "cp:1"))
    with pytest.raises(ss.ValidationError, match="ComplexProjective"):
        quantum.berry_phase(ss.CubicSpline(None, [np.eye(2), np.eye(2)], "u:2"))


def mixed(rng, n, count, rank=None, batch=()):
    x = rng.standard_normal((*batch, count, n, rank or n)) + 1j * rng.standard_normal((*batch, count, n, rank or n))
    rho = x @ np.swapaxes(x.conj(), -1, -2)
    return rho / np.trace(rho, axis1=-2, axis2=-1).real[..., None, None]


@pytest.mark.parametrize(("n", "rank"), [(2, None), (3, None), (4, 2), (3, 1)])
def test_distances_of_purifications_are_bures_angles(n, rank):
    rho = mixed(np.random.default_rng(n), n, 6, rank)
    w = quantum.purify(rho)
    np.testing.assert_allclose(quantum.density(w), rho, atol=1e-13)
    space = ss.ComplexProjective(n * n - 1)
    for k in range(5):
        root = sqrtm(rho[k])
        fidelity = np.trace(sqrtm(root @ rho[k + 1] @ root)).real
        assert np.cos(space.distance(w[k], w[k + 1])) == pytest.approx(fidelity, abs=1e-7)
        # Parallel purifications: W* W' is positive semidefinite.
        product = w[k].reshape(n, n).conj().T @ w[k + 1].reshape(n, n)
        assert np.abs(product - product.conj().T).max() < 1e-12
        assert np.linalg.eigvalsh(product)[0] > -1e-12


def test_splines_of_mixed_states():
    rho = mixed(np.random.default_rng(5), 2, 5, batch=(3,))
    curves = ss.CubicSpline(None, quantum.purify(rho), "cp:3")
    states = quantum.density(curves(np.linspace(0, 4, 50)))
    np.testing.assert_allclose(np.trace(states, axis1=-2, axis2=-1), 1, atol=1e-12)
    assert np.linalg.eigvalsh(states).min() > -1e-12
    np.testing.assert_allclose(quantum.density(curves(2.0)), rho[:, 2], atol=1e-9)


def test_invalid_states_raise():
    for state, match in (
        (np.eye(2), r"states has shape \(2, 2\)"),
        ([np.eye(2)], r"states\[0\] has the trace 2"),
        ([[[0.5, 1], [0, 0.5]]], r"states\[0\] is not Hermitian"),
        ([np.diag([1.5, -0.5])], r"states\[0\] is not positive semidefinite"),
    ):
        with pytest.raises(ss.ValidationError, match=match):
            quantum.purify(state)
    with pytest.raises(ss.ValidationError, match="purifications has shape"):
        quantum.density([1.0, 0, 0])
    with pytest.raises(ss.ValidationError, match="purifications has the norm 2"):
        quantum.density([2.0, 0, 0, 0])


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
