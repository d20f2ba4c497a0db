"""Propagators and pulses: where they bring the states."""

import numpy as np
import pytest
from curves import points_on
from refused import raises
from scipy.integrate import solve_ivp
from test_hamiltonian import GATES, KNOTS, STATES, X, adjoint, columns, curve

import symspline as ss
from symspline.quantum import hamiltonian, propagator, pulses

PAULI = np.array([[[0, 1], [1, 0]], [[0, -1j], [1j, 0]], [[1, 0], [0, -1]]])


def off_one(u):
    return np.abs(adjoint(u) @ u - np.eye(u.shape[-1])).max()


def reaches(spline, u, x):
    """How far U moves the first point from the curve."""
    moved = u @ columns(spline, spline.points[0])
    return spline.space.distance(spline.space.project(moved.reshape(-1, *spline.space.point_shape)), spline(x)).max()


@pytest.mark.parametrize("name", [*STATES, *GATES])
def test_it_is_unitary_and_follows_the_curve(name):
    spline = curve(name)
    u = propagator(spline, X)
    assert u.shape == (*X.shape, spline.space.point_shape[0], spline.space.point_shape[0])
    assert off_one(u) < 4e-15
    assert np.abs(u[0] - np.eye(u.shape[-1])).max() < 4e-15
    assert reaches(spline, u, X) < 1e-13


@pytest.mark.parametrize("name", ["cp:3", "cgr:2,5", "su:4"])
def test_solution_satisfies_the_equation(name):
    spline = curve(name, seed=5)
    n = spline.space.point_shape[0]

    def rate(t, u):
        return (-1j * hamiltonian(spline, t) @ u.reshape(n, n)).ravel()

    u = np.eye(n, dtype=complex).ravel()
    for i in range(len(KNOTS) - 1):
        u = solve_ivp(rate, KNOTS[i : i + 2], u, "DOP853", rtol=3e-14, atol=1e-14).y[:, -1]
        assert np.abs(propagator(spline, KNOTS[i + 1]) - u.reshape(n, n)).max() < 3e-12


def test_steps_are_short_where_the_curve_is_fast():
    """It rests at both ends, and is fast between."""
    spline = ss.CubicSpline(None, [[1, 0], [np.cos(1.4), np.sin(1.4)]], "cp:1", bc_type="clamped")
    u = propagator(spline, 1.0)
    assert reaches(spline, u, np.array([1.0])) < 1e-14


@pytest.mark.parametrize("name", ["cp:2", "cgr:2,4", "u:2"])
def test_one_time_alone_is_as_among_many(name):
    spline = curve(name)
    u = propagator(spline, X)
    assert np.array_equal(propagator(spline, X[::-1].reshape(1, -1))[0], u[::-1])
    assert np.array_equal(propagator(spline, X[20]), u[20])
    assert propagator(spline, []).shape == (0, *u.shape[1:])


@pytest.mark.parametrize("name", ["cp:2", "su:2"])
def test_batches_of_propagators(name):
    spline = curve(name, batch=(2, 3))
    u = propagator(spline, X)
    for i, j in np.ndindex(2, 3):
        assert np.abs(u[i, j] - propagator(spline[i][j], X)).max() < 1e-13
    # With knots of their own.
    t = np.stack([KNOTS, np.linspace(0, 5, 6)])
    own = ss.CubicSpline(t, spline.points[0, :2], spline.space)
    assert np.abs(propagator(own, X)[1] - propagator(own[1], X)).max() < 1e-13


def test_the_adiabatic_phase_of_a_circle_of_latitude():
    """States carried once round a circle of the Bloch sphere come back with half the solid angle as their phase."""
    angle, n = np.radians(50), 60
    turn = np.linspace(0, 2 * np.pi, n + 1)
    states = np.stack([np.cos(angle / 2) * np.ones(n + 1), np.sin(angle / 2) * np.exp(1j * turn)], axis=-1)
    spline = ss.CubicSpline(turn, states, "cp:1", bc_type="periodic")
    phase = np.angle(states[0].conj() @ propagator(spline, turn[-1]) @ states[0])
    # Of the circle, from which the spline is off by the fourth power of the spacing.
    assert phase == pytest.approx(-np.pi * (1 - np.cos(angle)), abs=1e-5)


def test_times_outside_the_knots():
    spline = curve("cp:1", extrapolate=True)
    for x in (-0.1, 5.1, np.nan):
        raises(r"x\[1\] is .*between the first and last knots, 0.0 and 5.0", propagator, spline, [1.0, x])
    # Where one curve of a batch has ended there is none of it.
    own = ss.CubicSpline([[0, 1, 5], [1, 2, 4]], spline.points[:6].reshape(2, 3, 2), "cp:1")
    for x in (0.5, 4.5):
        raises(r"between the first and last knots, 1.0 and 4.0", propagator, own, x)
    dates = np.datetime64("2024-01-01") + np.array([[0, 1, 2], [1, 2, 4]])
    own = ss.CubicSpline(dates, spline.points[:6].reshape(2, 3, 2), "cp:1")
    raises(r"one curve at a time: spline\[i\]", propagator, own, dates[0])


def edge_states(spline, edges, h):
    """The product of the pulses' propagators, from the first edge to every one."""
    values, vectors = np.linalg.eigh(h)
    phases = np.exp(-1j * values * np.diff(edges)[:, None])
    u = [np.eye(h.shape[-1])]
    for step in vectors * phases[:, None] @ adjoint(vectors):
        u.append(step @ u[-1])
    return np.array(u)


@pytest.mark.parametrize("name", [*STATES, *GATES])
def test_exact_pulses_meet_the_curve_at_every_edge(name):
    spline = curve(name)
    edges = np.sort(np.r_[0, np.random.default_rng(4).uniform(0, 5, 22), 5])
    h = pulses(spline, edges)
    assert np.array_equal(h, adjoint(h))
    assert reaches(spline, edge_states(spline, edges, h), edges) < 3e-14


@pytest.mark.parametrize("name", ["cp:1", "cgr:2,4", "su:2"])
def test_midpoint_pulses_are_of_second_order(name):
    spline = curve(name)
    off = []
    for number in (50, 200, 800):
        edges = np.linspace(0, 5, number + 1)
        off.append(reaches(spline, edge_states(spline, edges, pulses(spline, edges, kind="midpoint")), edges))
    assert off[0] < 5e-3
    assert np.allclose(np.divide(off[:-1], off[1:]), 16, rtol=0.15)


def test_in_paulis_operators():
    spline = curve("cp:1")
    edges = np.linspace(0, 5, 41)
    for kind in ("exact", "midpoint"):
        h, c = pulses(spline, edges, kind=kind), pulses(spline, edges, kind=kind, operators=PAULI)
        assert c.shape == (40, 3) and c.dtype == float
        assert np.abs(np.einsum("mq,qab->mab", c, PAULI) - h).max() < 1e-14
        # tr σᵢσⱼ = 2δᵢⱼ.
        assert np.abs(np.einsum("mab,qba->mq", h, PAULI).real / 2 - c).max() < 1e-14


def test_in_operators_that_are_not_orthogonal():
    spline = curve("su:4", batch=(2,))
    rng = np.random.default_rng(0)
    operators = rng.standard_normal((16, 4, 4)) + 1j * rng.standard_normal((16, 4, 4))
    operators += adjoint(operators)
    edges = np.linspace(0, 5, 9)
    c = pulses(spline, edges, operators=operators)
    assert c.shape == (2, 8, 16)
    assert np.abs(np.einsum("...q,qab->...ab", c, operators) - pulses(spline, edges)).max() < 1e-12


def test_invalid_pulse_trains_raise():
    for match, options in [
        ("kind must be 'exact' or 'midpoint', not 'exakt'", {"kind": "exakt"}),
        ("edges must be a one-dimensional array of at least two times", {"edges": [1.0]}),
        (r"edges\[1\] is 1.0, and the next is 1.0, but edges must be strictly increasing", {"edges": [0, 1.0, 1.0, 2]}),
        (r"operators must be of shape \(q, 2, 2\), not \(3, 3\)", {"operators": np.eye(3)}),
        (r"operators\[1\] is not Hermitian", {"operators": [PAULI[0], [[0, 1], [0, 0]]]}),
        (r"operators\[1\] is zero or a linear combination", {"operators": [PAULI[0], PAULI[0] + 1e-12 * PAULI[1]]}),
        (r"pulse\[0\] cannot be expressed .* entries \[0, 1\] and \[1, 0\]", {"operators": PAULI[[0, 2]]}),
    ]:
        raises(match, pulses, curve("cp:1"), **{"edges": [0, 1, 2]} | options)
    path = ss.CubicSpline(None, [[1, 0], [2**-0.5, 2**-0.5], [0, 1]], "cp:1")
    # The entry that is missing has its sign.
    raises(r"entries \[0, 1\] and \[1, 0\] \(-?0-0.785j\)", pulses, path, [0, 1, 2], operators=PAULI[[0, 2]])
    # Edges are too far apart for the exact pulse, but not for the generator at the middle.
    raises("cut locus", pulses, path, [0, 2], error=ss.CutLocusError)
    assert np.abs(pulses(path, [0, 2], kind="midpoint", operators=PAULI) - [0, np.pi / 4, 0]).max() < 1e-14


@pytest.mark.parametrize("name", ["cp:31", "cgr:2,24"])
@pytest.mark.parametrize("ends", ["natural", "velocity"])
def test_in_the_span_of_the_points_it_is_the_same(name, ends):
    space = ss.space(name)
    p = points_on(space, 4, batch=(2,), seed=3)
    v = 0.3 * space.log(p[..., 0, *[slice(None)] * len(space.point_shape)], p[:, 1])
    # A velocity that leaves the span.
    v = v + 0.1 * space.random_tangent(np.random.default_rng(4), p[:, 0])
    spline = ss.CubicSpline(None, p, space, bc_type=((1, v), "natural") if ends == "velocity" else ends)
    x = np.linspace(0, 3, 7)
    u = propagator(spline, x)
    # One curve after the other is computed in another span.
    for i in range(2):
        assert np.abs(propagator(spline[i], x) - u[i]).max() < 4e-15
        assert reaches(spline[i], u[i], x) < 1e-13
    assert off_one(u) < 4e-15
