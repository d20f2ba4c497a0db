"""The Hamiltonian of least change: it drives the states, and no other one varies less."""

import numpy as np
import pytest
import scipy.sparse as sp
from curves import points_on
from refused import raises
from scipy.integrate import solve_bvp, solve_ivp
from scipy.sparse.linalg import spsolve
from test_hamiltonian import GATES, KNOTS, STATES, X, adjoint, columns, curve

import symspline as ss
from symspline.quantum import LeastChangeHamiltonian, hamiltonian

NODES, WEIGHTS = np.polynomial.legendre.leggauss(30)


def change(h, spline):
    """The integral of ‖H'‖², by Gauss quadrature on every segment."""
    total = 0.0
    for a, b in zip(spline.t[:-1], spline.t[1:], strict=True):
        slope = h(a + (b - a) * (NODES + 1) / 2)
        total += (b - a) / 2 * np.sum(WEIGHTS[:, None, None] * np.abs(slope) ** 2)
    return total


def six_states():
    """Six random states of a qubit, from their points on the Bloch sphere."""
    b = np.random.default_rng(1).standard_normal((6, 3))
    polar, azimuth = np.arccos(b[:, 2] / np.linalg.norm(b, axis=1)), np.arctan2(b[:, 1], b[:, 0])
    states = np.stack([np.cos(polar / 2), np.exp(1j * azimuth) * np.sin(polar / 2)], axis=-1)
    return ss.CubicSpline(None, states, "cp:1")


def circle_of_latitude():
    azimuth, polar = np.linspace(0, 2 * np.pi, 129), np.radians(30)
    states = np.stack([np.full(129, np.cos(polar / 2)), np.exp(1j * azimuth) * np.sin(polar / 2)], axis=-1)
    return ss.CubicSpline(azimuth, states, "cp:1", bc_type="periodic")


def dense(spline, steps):
    """The least sum of ‖Hⱼ₊₁ − Hⱼ‖²/h over all Hamiltonians of the path at equally spaced times."""
    t = np.linspace(spline.t[0], spline.t[-1], steps + 1)
    point = columns(spline, spline(t))
    n, k = point.shape[1:]
    frame = np.linalg.qr(point, mode="complete").Q
    basis = []
    for i, j in np.ndindex(n, n):
        if (i < k) == (j < k):
            e = np.zeros((n, n), complex)
            e[i, j] += 1 if i <= j else 1j
            basis.append(e + adjoint(e))
    free = np.einsum("xia,dab,xjb->xijd", frame, np.array(basis), frame.conj())
    free, least = free.reshape(steps + 1, n * n, -1), hamiltonian(spline, t).reshape(-1)
    real = sp.vstack([sp.block_diag(list(part)) for part in (free.real, free.imag)])
    h = np.diff(t)[0]
    d = sp.kron(sp.diags([-1.0, 1.0], [0, 1], shape=(steps, steps + 1)), sp.eye(n * n)) / np.sqrt(h)
    d = sp.block_diag([d, d])
    a, b = (d @ real).tocsc(), d @ np.r_[least.real, least.imag]
    # A multiple of the identity is free.
    c = spsolve((a.T @ a + 1e-10 * sp.eye(a.shape[1])).tocsc(), -a.T @ b)
    return np.sum((a @ c + b) ** 2)


@pytest.mark.parametrize("name", ["cp:1", "cp:2", "cgr:1,3", "cgr:2,4"])
def test_no_other_hamiltonian_varies_less(name):
    spline = curve(name)
    h = LeastChangeHamiltonian(spline)
    least = change(lambda t: h(t, nu=1), spline)
    # The error of the difference quotients is of second order.
    coarse, fine = dense(spline, 250), dense(spline, 500)
    assert least == pytest.approx(fine + (fine - coarse) / 3, rel=1e-5)
    assert least < 0.95 * change(lambda t: hamiltonian(spline, t, nu=1), spline)


def test_six_states_of_a_qubit():
    """With H = w·σ/2 and w = n × n' + c n, c'' = |n'|² c + det(n, n'', n')."""
    spline = six_states()
    h = LeastChangeHamiltonian(spline)
    # |w'|² = 2 ‖H'‖².
    assert 2 * change(lambda t: hamiltonian(spline, t, nu=1), spline) == pytest.approx(26.14016, abs=1e-5)
    assert 2 * change(lambda t: h(t, nu=1), spline) == pytest.approx(17.39020, abs=1e-5)

    pauli = np.array([[[0, 1], [1, 0]], [[0, -1j], [1j, 0]], [[1, 0], [0, -1]]])

    def vectors(matrices):
        return np.einsum("...ij,kji->...k", matrices, pauli).real

    def rate(t, y):
        psi = spline(t)
        n = vectors(psi[:, :, None] * psi[:, None, :].conj())
        w, turn = (vectors(hamiltonian(spline, t, nu=nu)) for nu in (0, 1))
        # n' = w × n, and w' = n × n''.
        slope = np.cross(w, n)
        return np.stack([y[1], np.sum(slope**2, axis=1) * y[0] + np.sum(turn * slope, axis=1)])

    t = np.linspace(0, 5, 101)
    found = solve_bvp(rate, lambda a, b: np.array([a[1], b[1]]), t, np.zeros((2, 101)), tol=1e-8, max_nodes=50000)
    psi = spline(t)
    n = vectors(psi[:, :, None] * psi[:, None, :].conj())
    added = np.sum(vectors(h(t)) * n, axis=1)
    assert np.abs(added - found.sol(t)[0]).max() < 1e-7


def test_it_is_constant_on_a_circle_of_latitude():
    spline = circle_of_latitude()
    h = LeastChangeHamiltonian(spline)
    assert change(lambda t: hamiltonian(spline, t, nu=1), spline) == pytest.approx(0.589, abs=1e-3)
    assert change(lambda t: h(t, nu=1), spline) < 1e-8
    assert np.abs(h(X) - np.diag([0.5, -0.5])).max() < 1e-6


@pytest.mark.parametrize("name", [*STATES, *GATES])
def test_it_drives_the_path(name):
    spline = curve(name)
    h = LeastChangeHamiltonian(spline)
    start = columns(spline, spline.points[0])

    def rate(t, psi):
        return (-1j * h(t) @ psi.reshape(start.shape)).ravel()

    psi = start.astype(complex).ravel()
    for i in range(len(KNOTS) - 1):
        times = [KNOTS[i : i + 2].mean(), KNOTS[i + 1]]
        solution = solve_ivp(rate, KNOTS[i : i + 2], psi, "DOP853", t_eval=times, rtol=1e-12, atol=1e-13)
        for t, column in zip(solution.t, solution.y.T, strict=True):
            reached = spline.space.project(column.reshape(spline.space.point_shape))
            assert spline.space.distance(reached, spline(t)) < 1e-10
        psi = solution.y[:, -1]


@pytest.mark.parametrize("name", [*STATES, *GATES])
def test_its_derivative(name):
    spline = curve(name)
    h = LeastChangeHamiltonian(spline)
    x, d = np.array([0.4, 1.3, 2.2, 4.6]), 1e-3
    weights = np.array([1, -9, 45, -45, 9, -1]) / 60
    slope = sum(w * h(x + k * d) for w, k in zip(weights, (3, 2, 1, -1, -2, -3), strict=True)) / d
    assert np.abs(h(x, nu=1) - slope).max() < 1e-9
    inner = KNOTS[1:-1]
    for nu, jump in ((0, 1e-12), (1, 1e-8)):
        assert np.abs(h(np.nextafter(inner, 9), nu=nu) - h(np.nextafter(inner, -9), nu=nu)).max() < jump
        assert np.array_equal(h(X, nu=nu), adjoint(h(X, nu=nu)))


@pytest.mark.parametrize("name", STATES)
def test_components_that_do_not_matter_are_zero(name):
    """The trace is constant, and a geodesic is driven by a constant Hamiltonian already."""
    spline = curve(name)
    assert np.abs(np.trace(LeastChangeHamiltonian(spline)(X), axis1=-2, axis2=-1)).max() < 1e-12
    two = ss.CubicSpline([0, 5], spline.points[:2], name)
    assert np.abs(LeastChangeHamiltonian(two)(X) - hamiltonian(two, X)).max() < 1e-10
    still = ss.CubicSpline([0, 5], spline.points[[0, 0]], name)
    assert np.abs(LeastChangeHamiltonian(still)(X)).max() < 1e-10


@pytest.mark.parametrize("name", GATES)
def test_gates_have_one_hamiltonian(name):
    spline = curve(name)
    for nu in (0, 1):
        assert np.array_equal(LeastChangeHamiltonian(spline)(X, nu=nu), hamiltonian(spline, X, nu=nu))


@pytest.mark.parametrize("size", [1e-5, 1.0])
def test_small_paths_are_as_accurate(size):
    """H of a small circle is that of a large one: a constant."""
    angle = np.linspace(0, 2 * np.pi, 129)
    states = np.stack([np.ones(129), size * np.exp(1j * angle)], axis=-1)
    spline = ss.CubicSpline(angle, states / np.linalg.norm(states, axis=1)[:, None], "cp:1", bc_type="periodic")
    assert np.abs(LeastChangeHamiltonian(spline)(X) - np.diag([0.5, -0.5])).max() < 1e-5


@pytest.mark.parametrize("name", ["cp:2", "cgr:2,4"])
def test_batches_shapes_and_bases(name):
    spline = curve(name, batch=(2, 3))
    h = LeastChangeHamiltonian(spline)
    values, slopes = h(X.reshape(1, 37)), h(X, nu=1)
    n = spline.space.point_shape[0]
    assert values.shape == (2, 3, 1, 37, n, n)
    for i, j in np.ndindex(2, 3):
        one = LeastChangeHamiltonian(spline[i][j])
        assert np.abs(values[i, j, 0] - one(X)).max() < 1e-11
        assert np.abs(slopes[i, j] - one(X, nu=1)).max() < 1e-9
    assert one(1.0).shape == (n, n)
    points = spline[1][2].points
    phases = ss.CubicSpline(KNOTS, points * np.exp(1j * np.arange(6)).reshape(-1, *[1] * (points.ndim - 1)), name)
    assert np.abs(LeastChangeHamiltonian(phases)(X) - one(X)).max() < 1e-10
    own = ss.CubicSpline(np.stack([KNOTS, np.linspace(0, 5, 6)]), spline.points[0, :2], spline.space)
    assert np.abs(LeastChangeHamiltonian(own)(X)[1] - LeastChangeHamiltonian(own[1])(X)).max() < 1e-11


def test_computations_are_in_the_span_of_the_points():
    small = curve("cp:2")
    turn = ss.Unitary(20).random_point(np.random.default_rng(0))[:, :3]
    large = ss.CubicSpline(KNOTS, small.points @ turn.T, "cp:19")
    wanted = turn @ LeastChangeHamiltonian(small)(X) @ adjoint(turn)
    assert np.abs(LeastChangeHamiltonian(large)(X) - wanted).max() < 1e-10
    still = ss.CubicSpline([0, 1], large.points[[0, 0]], "cp:19")
    assert np.abs(LeastChangeHamiltonian(still)(0.3)).max() < 1e-10


def test_bad_input_raises():
    sphere = ss.CubicSpline(None, np.eye(3), "sphere:2")
    raises(r"Sphere\(2\) does not define a Hamiltonian; use Compl", LeastChangeHamiltonian, sphere)
    h = LeastChangeHamiltonian(curve("cp:1"))
    assert repr(h).startswith("LeastChangeHamiltonian(<CubicSpline on")
    raises(r"x\[1\] is 5.1, but must be between the first and last knots", h, [0, 5.1])
    for nu in (2, True, None):
        raises("nu must be 0 or 1, not", h, 0.5, nu=nu)
    dates = np.datetime64("2024-01-01") + np.array([[0, 1, 2], [1, 2, 4]])
    points = points_on(ss.space("cp:1"), 3, (2,), seed=1)
    own = LeastChangeHamiltonian(ss.CubicSpline(dates, points, "cp:1"))
    raises(r"one curve at a time: spline\[i\]", own, dates[0])
    one = LeastChangeHamiltonian(ss.CubicSpline(dates[0], points[0], "cp:1"))
    assert one(dates[0]).shape == (3, 2, 2)
