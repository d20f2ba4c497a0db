"""The Hamiltonian of a curve: it drives the states, no smaller one does, and it is as smooth as the velocity."""

from itertools import pairwise

import numpy as np
import pytest
from curves import points_on
from refused import raises
from scipy.integrate import quad_vec, solve_ivp

import symspline as ss
from symspline.quantum import hamiltonian

STATES = ["cp:1", "cp:3", "cgr:2,4", "cgr:2,5"]
GATES = ["u:1", "u:3", "su:2", "su:4"]
KNOTS = np.array([0.0, 0.8, 2.0, 2.7, 4.0, 5.0])
X = np.linspace(0, 5, 37)


def curve(name, seed=1, batch=(), **options):
    return ss.CubicSpline(KNOTS, points_on(ss.space(name), len(KNOTS), batch, seed=seed), name, **options)


def columns(spline, points):
    """Points as matrices."""
    return points[..., None] if spline.space.point_shape[1:] == () else points


def adjoint(m):
    return np.swapaxes(m, -1, -2).conj()


@pytest.mark.parametrize("name", [*STATES, *GATES])
def test_the_schroedinger_equation_goes_through_every_point(name):
    spline = curve(name)
    start = columns(spline, spline.points[0])

    def rate(t, psi):
        return (-1j * hamiltonian(spline, t) @ psi.reshape(start.shape)).ravel()

    # Piece by piece: H is not smooth at the knots.
    psi = start.astype(complex).ravel()
    for i in range(len(KNOTS) - 1):
        psi = solve_ivp(rate, KNOTS[i : i + 2], psi, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
        reached = spline.space.project(psi.reshape(spline.space.point_shape))
        assert spline.space.distance(reached, spline.points[i + 1]) < 1e-11


@pytest.mark.parametrize("name", STATES)
def test_it_is_the_commutator_of_the_projector(name):
    """H = i[P', P], with the derivative of P as a difference of complex order."""
    spline = curve(name, bc_type="not-a-knot")

    def projector(t):
        x = columns(spline, spline(t))
        return x @ adjoint(x)

    x, d = np.array([0.4, 1.3, 2.2, 4.6]), 1e-3
    weights = np.array([1, -9, 45, -45, 9, -1]) / 60
    slope = sum(w * projector(x + k * d) for w, k in zip(weights, (3, 2, 1, -1, -2, -3), strict=True)) / d
    p = projector(x)
    assert np.abs(hamiltonian(spline, x) - 1j * (slope @ p - p @ slope)).max() < 1e-11


@pytest.mark.parametrize("name", ["cp:3", "cgr:2,4"])
def test_phases_and_bases_do_not_matter(name):
    spline = curve(name)
    turned, turns = np.array(spline.points), ss.Unitary(2).random_point(np.random.default_rng(0), len(KNOTS))
    for i in range(len(turned)):
        turned[i] = turned[i] * np.exp(1j * i) if name == "cp:3" else turned[i] @ turns[i]
    other = ss.CubicSpline(KNOTS, turned, name)
    for nu in (0, 1):
        # The solver's tolerance is 1e-12 of the legs.
        assert np.abs(hamiltonian(other, X, nu=nu) - hamiltonian(spline, X, nu=nu)).max() < 1e-11


@pytest.mark.parametrize("name", [*STATES, *GATES])
def test_the_derivative(name):
    spline = curve(name)
    x, d = np.array([0.4, 1.3, 2.2, 4.6]), 1e-3
    weights = np.array([1, -9, 45, -45, 9, -1]) / 60
    slope = sum(w * hamiltonian(spline, x + k * d) for w, k in zip(weights, (3, 2, 1, -1, -2, -3), strict=True)) / d
    assert np.abs(hamiltonian(spline, x, nu=1) - slope).max() < 1e-10
    # Continuous at the knots.
    inner = KNOTS[1:-1]
    jump = hamiltonian(spline, np.nextafter(inner, 9), nu=1) - hamiltonian(spline, np.nextafter(inner, -9), nu=1)
    assert np.abs(jump).max() < 1e-11
    # And no smoother than that.
    bend = [hamiltonian(spline, inner + s * d, nu=1) - hamiltonian(spline, inner + s * 2 * d, nu=1) for s in (1, -1)]
    assert np.abs(bend[0] + bend[1]).max() > 0.01 * d


@pytest.mark.parametrize("name", ["cp:2", "u:2"])
def test_batches_and_shapes(name):
    spline = curve(name, batch=(2, 3))
    h = hamiltonian(spline, X.reshape(1, 37))
    n = spline.space.point_shape[0]
    assert h.shape == (2, 3, 1, 37, n, n)
    assert np.array_equal(h[1, 2, 0], hamiltonian(spline[1][2], X))


def test_extrapolation_continues_the_motion():
    spline = curve("cp:2")
    end = hamiltonian(spline, 5.0)
    assert np.abs(hamiltonian(spline, [5.5, 7.0], extrapolate="geodesic") - end).max() < 1e-13
    raises("outside", hamiltonian, spline, 5.5)


def test_spaces_without_hamiltonian_raise():
    sphere = ss.CubicSpline(None, np.eye(3), "sphere:2")
    raises(r"Sphere\(2\) does not define a Hamiltonian; use Compl", hamiltonian, sphere, 0.5)
    for nu in (2, True, -1, "1", None):
        raises("nu must be 0 or 1, not", hamiltonian, curve("cp:1"), 0.5, nu=nu)


@pytest.mark.parametrize("name", STATES)
def test_changes_cost_twice_the_bending_energy(name):
    spline = curve(name)

    def power(t):
        return np.sum(np.abs(hamiltonian(spline, t, nu=1)) ** 2)

    total = sum(quad_vec(power, a, b, epsrel=1e-12)[0] for a, b in pairwise(KNOTS))
    assert total == pytest.approx(2 * spline.bending_energy(), rel=1e-11)
