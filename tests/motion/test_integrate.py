"""Rotations from angular velocities, against closed forms, SciPy's `solve_ivp` and finite differences of order."""

import warnings

import numpy as np
import pytest
from curves import core_calls
from refused import raises
from scipy.spatial.transform import Rotation

import symspline as ss
from symspline import _core, rotations

A, B = np.array([0.3, -1.2, 0.5]), np.array([0.9, 0.4, -0.7])


def precession(t):
    """The rotations exp(tA) exp(tB)."""
    return (Rotation.from_rotvec(t[:, None] * A) * Rotation.from_rotvec(t[:, None] * B)).as_matrix()


def rate(t):
    """Their angular velocity B + exp(−tB) A in the body frame."""
    return B + Rotation.from_rotvec(-t[:, None] * B).apply(A)


def uneven(n, end=10.0, seed=0):
    """Irregular times from 0 to the end."""
    t = np.arange(n) + np.random.default_rng(seed).uniform(-0.3, 0.3, n)
    return (t - t[0]) / (t[-1] - t[0]) * end


@pytest.mark.parametrize("frame", ["body", "world"])
@pytest.mark.parametrize(("interpolation", "order", "largest"), [("cubic", 4, 3e-7), ("linear", 2, 2e-3)])
def test_order_with_irregular_steps(frame, interpolation, order, largest):
    counts, errors = [40, 80, 160, 320], []
    for n in counts:
        t = uneven(n)
        expected, omega = precession(t), rate(t)
        if frame == "world":
            omega = rotations.turned(expected, omega)
        found = rotations.integrate(t, omega, frame=frame, interpolation=interpolation)
        errors.append(np.abs(found - expected).max())
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert abs(slope - order) < 0.25, slope
    assert errors[-1] < largest


def test_rates_of_a_curve_give_the_curve_back():
    t = uneven(400)
    spline = ss.CubicSpline(t, precession(t), "so:3", bc_type="not-a-knot")
    for frame in ("body", "world"):
        omega = rotations.angular_velocity(spline, t, frame)
        assert np.abs(rotations.integrate(t, omega, frame=frame) - spline(t)).max() < 1e-7


def test_constant_rates_are_exact():
    t = uneven(50, end=100.0)
    found = rotations.integrate(t, np.broadcast_to(A, (50, 3)))
    assert np.abs(found - Rotation.from_rotvec(t[:, None] * A).as_matrix()).max() < 1e-13


def test_many_samples():
    """A result of 100 000 samples is one running product, and rounding errors stay small."""
    t = uneven(100_000, end=1000.0)
    omega = rate(t)
    assert core_calls("quaternion_products", lambda: rotations.integrate(t, omega)) == 1
    found = rotations.integrate(t, omega)
    gram = np.swapaxes(found, -1, -2) @ found - np.eye(3)
    assert np.abs(gram).max() < 2e-15
    assert np.abs(found - precession(t)).max() < 2e-7
    still = rotations.integrate(t, np.broadcast_to(A, omega.shape))
    assert np.abs(still - Rotation.from_rotvec(t[:, None] * A).as_matrix()).max() < 2e-12


@pytest.mark.parametrize("n", [1, 2, 101])
def test_running_products_agree_with_a_loop(n):
    turns = Rotation.random(n, random_state=n)
    q = np.roll(turns.as_quat(), 1, axis=-1)
    expected = [turns[0]]
    for i in range(1, n):
        expected.append(expected[-1] * turns[i])
    wanted = Rotation.concatenate(expected).as_matrix()
    found = Rotation.from_quat(np.roll(_core.quaternion_products(q), -1, axis=-1)).as_matrix()
    assert np.abs(found - wanted).max() < 1e-14


@pytest.mark.parametrize("frame", ["body", "world"])
def test_batches_of_integrated_rates(frame):
    rng = np.random.default_rng(3)
    t, omega = np.sort(rng.uniform(0, 5, (2, 3, 30)), axis=-1), rng.standard_normal((2, 3, 30, 3))
    starts = Rotation.random(3, random_state=1).as_matrix()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = rotations.integrate(t, omega, starts, frame)
        shared = rotations.integrate(t[0, 0], omega, starts[0], frame)
        assert found.shape == shared.shape == (2, 3, 30, 3, 3)
        for i in np.ndindex(2, 3):
            assert np.abs(found[i] - rotations.integrate(t[i], omega[i], starts[i[1]], frame)).max() < 1e-14
            assert np.abs(shared[i] - rotations.integrate(t[0, 0], omega[i], starts[0], frame)).max() < 1e-14


def test_start_is_the_first_rotation():
    t = uneven(60)
    start = Rotation.from_rotvec([1.0, 2.0, -0.5])
    body = rotations.integrate(t, rate(t), start)
    assert np.abs(body - start.as_matrix() @ rotations.integrate(t, rate(t))).max() < 1e-15
    world = rotations.integrate(t, rate(t), start, "world")
    assert np.abs(world - rotations.integrate(t, rate(t), frame="world") @ start.as_matrix()).max() < 1e-15
    assert np.abs(body[0] - start.as_matrix()).max() < 1e-15


def test_dates_count_in_seconds():
    t = np.arange(50) * 0.1
    dates = np.datetime64("2026-01-01T00:00:00", "ms") + (1000 * t).astype("timedelta64[ms]")
    expected = rotations.integrate(t, rate(t))
    assert np.abs(rotations.integrate(dates, rate(t)) - expected).max() < 1e-13
    assert np.abs(rotations.integrate(None, 0.1 * rate(t)) - expected).max() < 1e-13


def test_invalid_input_of_integrated_rates_raises():
    t, omega = np.arange(5.0), np.ones((5, 3))

    def changed(array, index, value):
        array = array.copy()
        array[index] = value
        return array

    for message, arguments in [
        (r"t\[2\] is 2.0 and the next time is 2.0, but times must increase", (changed(t, 3, 2.0), omega)),
        (r"t\[1\] is nan; times must be finite. Pass skipna=True", (changed(t, 1, np.nan), omega)),
        (r"t has shape \(4,\)", (t[:4], omega)),
        (r"omega\[2, 1\] is nan, but must be finite; remove missing values", (t, changed(omega, (2, 1), np.nan))),
        (r"omega must be real, of shape \(..., n, 3\)", (t, omega[:, :2])),
        (r"omega must be real, of shape \(..., n, 3\)", ([], np.empty((0, 3)))),
        (r"omega\[3\] is \[.*\], which is 1.73e\+200 rad in one step. Check the units", (t, changed(omega, 3, 1e200))),
        (r"start has shape \(2, 3, 3\), but \(3, 3\) is needed", (t, omega, np.stack([np.eye(3)] * 2))),
        (r"start: ", (t, omega, 2 * np.eye(3))),
        ("frame must be 'body' or 'world', not 'global'", (t, omega, None, "global")),
    ]:
        raises(message, rotations.integrate, *arguments)
    raises("interpolation must be 'cubic' or 'linear'", rotations.integrate, t, omega, interpolation="nearest")
    raises(
        "one rotation per recording of the batch", rotations.integrate, t, np.ones((2, 5, 3)), np.stack([np.eye(3)] * 3)
    )
