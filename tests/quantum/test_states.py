"""Kets, and Hamiltonians for QuTiP."""

import sys

import numpy as np
import pytest
from refused import raises
from scipy.integrate import ode
from test_hamiltonian import curve

import symspline as ss
from symspline.quantum import from_kets, hamiltonian, qobjevo

CP1 = ss.ComplexProjective(1)


class Ket:
    """What QuTiP's ``Qobj`` shows of itself."""

    def __init__(self, numbers):
        self.numbers = numbers

    def full(self):
        return np.array(self.numbers, complex).reshape(-1, 1)


# The second by a finite temperature.
PURE = ss.convert.state_to_density(CP1.random_point(np.random.default_rng(5), 4))
MIXED = 0.9 * PURE + 0.05 * np.eye(2)


class Operator(Ket):
    isket = False

    def full(self):
        return np.array(self.numbers)


@pytest.mark.parametrize(
    "points", [PURE, [PURE, PURE], PURE.astype("c8"), list(PURE), list(map(Operator, PURE)), np.diag([1, 0])]
)
@pytest.mark.parametrize("space", ["cp:1", "cp:3"])
def test_density_matrices_of_pure_states_are_named(points, space):
    raises(r"density matrices.*symspline\.convert\.density_to_state", ss.CubicSpline, None, points, space)
    raises("looks like density matrices", ss.space(space).check_point, points)
    ss.CubicSpline(None, ss.convert.density_to_state(PURE), "cp:1")


@pytest.mark.parametrize("space, points", [("cp:1", MIXED), ("rp:1", MIXED.real)])
def test_there_is_no_space_of_mixed_states(space, points):
    error = raises(r"density matrices.*mixed.*PositiveDefinite\(2\)", ss.CubicSpline, None, points, space)
    name = str(error).split("points of ")[-1].split(",")[0]
    ss.CubicSpline(None, points, getattr(ss, name.split("(")[0])(2))


def test_states_are_not_taken_for_density_matrices():
    # Hermitian, of trace 1, and of unit rows: of purity 3.
    ss.CubicSpline(None, np.diag([1.0, 1, -1]), "cp:2", on_failure="ignore")
    raises("off the space", ss.CubicSpline, None, [[1, 0], [0, np.nan]], "cp:1")
    raises(r"its norm is 0\.5, not 1", ss.CubicSpline, None, np.eye(2) / 2 + [[0, 0], [1, 0]], "cp:1")


def test_kets_are_columns():
    kets = [Ket([1, 0]), Ket([0.6, 0.8j])]
    assert np.array_equal(from_kets(kets), [[1, 0], [0.6, 0.8j]])
    assert from_kets(kets[1]).shape == (2,) and from_kets([kets, kets]).shape == (2, 2, 2)
    assert np.array_equal(from_kets(np.array(kets, dtype=object)), from_kets(kets))
    ss.CubicSpline(None, from_kets(kets), "cp:1")


def test_invalid_states_raise():
    for match, call in [
        ("kets must be columns, of shape", lambda: from_kets([[1, 0], [0, 1]])),
        (r"kets\[1\] is not a state", lambda: from_kets([Ket([1, 0]), Ket([1, 1])])),
    ]:
        raises(match, call)


def test_solvers_may_step_over_the_end():
    pytest.importorskip("qutip")
    spline = curve("cp:2")
    h = qobjevo(spline)
    assert np.array_equal(h(1.3).full(), hamiltonian(spline, 1.3))
    assert np.abs(h(5.7).full() - hamiltonian(spline, 5.0)).max() < 1e-13
    # The integrator behind QuTiP's default.
    solver = ode(lambda t, y: -1j * h(t).full() @ y).set_integrator(
        "zvode", method="adams", rtol=1e-10, atol=1e-12, nsteps=9999
    )
    psi = solver.set_initial_value(spline.points[0], 0).integrate(5)
    assert spline.space.distance(spline.space.project(psi), spline.points[-1]) < 1e-7
    closed = ss.CubicSpline(None, spline.points[[0, 1, 2, 0]], "cp:2", bc_type="periodic")
    assert np.abs(qobjevo(closed)(3.5).full() - hamiltonian(closed, 0.5)).max() < 1e-13


def test_invalid_qobjevo_curves_raise():
    pytest.importorskip("qutip")
    raises(r"is a batch, .* qobjevo\(spline\[0\]\)", qobjevo, curve("cp:2", batch=(2,)))
    dates = ss.CubicSpline(np.arange("2024-01-01", "2024-01-07", dtype="M8[D]"), curve("cp:2").points, "cp:2")
    raises("are dates", qobjevo, dates)


def test_there_is_no_hamiltonian_before_the_first_knot():
    pytest.importorskip("qutip")
    later = ss.CubicSpline([100, 101, 102], curve("cp:2").points[:3], "cp:2")
    h = qobjevo(later)
    raises(r"the time 0\.5 is before the first knot, 100\.0", h, 0.5)
    # What QuTiP asks for at first.
    assert h(0.0).shape == (3, 3)
    raises(r"dims \[2, 2\] have 4 levels, but the curve has 3", qobjevo, later, dims=[2, 2])
    raises(r"dims must be a list of whole numbers, such as \[2, 2\], not 3", qobjevo, later, dims=3)


def test_composite_systems_in_qutip():
    qutip = pytest.importorskip("qutip")
    up, down = qutip.basis(2, 0), qutip.basis(2, 1)
    kets = [qutip.tensor(up, up), qutip.tensor(up, (up + down).unit()), qutip.tensor(down, (up - down).unit())]
    spline = ss.CubicSpline([3, 4, 6], from_kets([kets[0], kets[1], (kets[1] + kets[2]).unit()]), "cp:3")
    options = {"atol": 1e-12, "rtol": 1e-12, "nsteps": 100_000}
    h = qobjevo(spline, dims=[2, 2])
    assert h.dims == [[2, 2], [2, 2]]
    found = qutip.sesolve(h, kets[0], [3, 4, 6], options=options).states
    assert abs(abs(found[1].overlap(kets[1])) - 1) < 1e-10
    # The error of the solver around it is not ours.
    with pytest.raises(Exception) as caught:
        qutip.sesolve(h, kets[0], [0, 4], options=options)
    assert "is before the first knot, 3.0" in str(caught.getrepr(style="native"))


def test_without_qutip(monkeypatch):
    monkeypatch.setitem(sys.modules, "qutip", None)
    raises("pip install qutip", qobjevo, curve("cp:1"), error=ImportError)


@pytest.mark.parametrize("name", ["cp:1", "cp:3", "u:3", "su:4"])
def test_qutip_drives_through_every_given_state(name):
    qutip = pytest.importorskip("qutip")
    spline = curve(name)
    options = {"atol": 1e-12, "rtol": 1e-12, "nsteps": 100_000}
    found = qutip.sesolve(qobjevo(spline), qutip.Qobj(spline.points[0]), list(spline.t), options=options).states
    for state, given in zip(found, spline.points, strict=True):
        reached = state.full().reshape(given.shape)
        size = np.linalg.norm(given)
        # Both overlaps are 1 where the states are one; of gates the phase counts, too.
        overlap = np.vdot(given, reached) / (size * np.linalg.norm(reached))
        fidelity = abs(overlap) ** 2 if name.startswith("cp") else overlap.real
        assert 1 - fidelity < 1e-12
