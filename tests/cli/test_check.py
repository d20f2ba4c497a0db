"""`symspline check` accepts fitted curves and rejects perturbed ones."""

import json

import numpy as np
import pytest
from cases import SPACES, one_sided, walk
from curves import points_on

import symspline as ss
from symspline.cli import main


@pytest.mark.parametrize("name", [*map(str, SPACES), "s:1", "h:5"])
def test_check_on_every_space(run, fails, name):
    space = ss.space(name)
    t = np.cumsum(np.random.default_rng(3).uniform(0.5, 1.5, 30))
    ss.CubicSpline(t, points_on(space, 30, step=0.5), space, bc_type="not-a-knot").save("a.npz")
    assert "All is within what rounding allows." in run("check a.npz")
    arrays = dict(np.load("a.npz"))
    last = max(key for key in arrays if key.startswith("velocities"))
    arrays[last][17] *= 1 + 1e-6
    np.savez("bent.npz", **arrays)
    assert "more than rounding allows" in fails("check bent.npz", code=1)


def hostile():
    """Points for which rounding is large, or of which each has many arrays."""
    rng = np.random.default_rng(6)
    for name, group in (("gr:2,4", "o:2"), ("cgr:2,4", "u:2"), ("cgr:1,3", "u:1")):
        yield name, points_on(ss.space(name), 20, step=0.5) @ ss.space(group).random_point(rng, 20)
    for name, phases in (("rp:2", rng.choice([-1, 1], (20, 1))), ("cp:2", np.exp(1j * rng.uniform(0, 6, (20, 1))))):
        yield name, points_on(ss.space(name), 20, step=0.5) * phases
    for name in ("spd:2", "hpd:3"):
        for unit in (1e-9, 1, 1e9):
            stretch = np.geomspace(1, 1e3, ss.space(name).point_shape[0])
            yield name, unit * stretch[:, None] * points_on(ss.space(name), 20, step=0.5) * stretch
    for far in (1e-6, 1e3, 1e6):
        for name in ("se:2", "se:3"):
            p = points_on(ss.space(name), 20, step=0.5)
            p[:, :-1, -1] += far
            yield name, p
    plane = ss.Hyperbolic(2)
    for far in (2, 4, 6):
        yield "h:2", plane.project(plane.transvection([1, 0, 0], [0, far, 0], walk(plane, 0.3, 20, rng)))
    stiefel = ss.Stiefel(2, 4)
    p = [stiefel.random_point(rng)]
    for _ in range(5):
        p.append(stiefel.exp(p[-1], 0.4 * stiefel.project_tangent(p[-1], rng.standard_normal((4, 2)))))
    yield "stiefel:2,4", p


def test_check_of_hostile_points(run):
    """Rounding counts as on other points, and so do residuals of tiny, long and thin matrices."""
    for name, points in hostile():
        ss.CubicSpline(None, points, name).save("a.npz")
        position = run("check a.npz").splitlines()[1].split()[2]
        assert float(position) < 1e-8


@pytest.mark.parametrize("unit", [1e-9, 1e9])
def test_perturbed_matrices_of_any_size_are_found(fails, unit):
    spline = ss.CubicSpline(None, unit * points_on(ss.space("spd:2"), 20, step=0.5), "spd:2")
    spline.save("a.npz")
    arrays = dict(np.load("a.npz"))
    arrays["velocities"][7] *= 1 + 1e-4
    np.savez("bent.npz", **arrays)
    fails("check bent.npz", code=1)


def test_check_finds_perturbed_curves(run, fails, capsys):
    good = ss.CubicSpline(None, walk(ss.Sphere(2), 0.5, 8, np.random.default_rng(1)), "s:2")
    good.save("a.npz")
    arrays = dict(np.load("a.npz"))
    arrays["velocities"][3] *= 1 + 1e-6
    np.savez("bent.npz", **arrays)
    assert main(["check", "bent.npz"]) == 1
    out, err = capsys.readouterr()
    assert err == "symspline: bent.npz: more than rounding allows in the curve\n"
    position, velocity, acceleration = map(float, out.splitlines()[1].split()[2:])
    assert max(position, velocity) < 1e-14 and 1e-7 < acceleration < 1e-4
    lost = ss.CubicSpline(None, [[1, 0, 0], [-1, 0, 0], [0, 1, 0]], "s:2", on_failure="ignore")
    ss.save({"good": good, "bent": ss.load("bent.npz"), "lost": lost}, "many.npz")
    problem = fails("check many.npz", code=1)
    assert problem == "many.npz: more than rounding allows in 2 of 3 curves: bent, lost"


def test_check_includes_the_closing_knot(fails):
    ring = walk(ss.Sphere(2), 0.5, 6, np.random.default_rng(2))
    ss.CubicSpline(None, [*ring, ring[0]], "s:2", bc_type="periodic").save("ring.npz")
    arrays = dict(np.load("ring.npz"))
    arrays["velocities"][0] *= 1.01
    np.savez("ring.npz", **arrays)
    fails("check ring.npz", code=1)
    arrays["bc_type"] = json.dumps("natural")
    arrays["velocities"][0] /= 1.01
    np.savez("ring.npz", **arrays)
    assert main(["check", "ring.npz"]) == 0


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(
    "name, p",
    [
        ("s:2", [[np.cos(x), np.sin(x), 0] for x in (0, 0.3, 0.7, 1.2)]),
        ("r:2", [[0.1, 0.7]] * 4),
        ("spd:2", [np.diag([np.exp(x), np.exp(-x)]) for x in (0, 0.3, 0.7, 1.2)]),
    ],
)
def test_check_of_a_geodesic_is_zero_up_to_rounding(run, name, p, unit):
    """What is zero but for rounding jumps by as much as it is: 0/0 is not a measure."""
    ss.CubicSpline(unit * np.array([0, 0.3, 0.7, 1.2]), p, name).save("a.npz")
    assert all(float(cell) < 1e-13 for cell in run("check a.npz").splitlines()[1].split()[1:])


def test_positions_that_differ_by_rounding_are_measured(run):
    """Far out in the hyperbolic plane, rounding moves points by visible distances, relative to large coordinates."""
    plane = ss.Hyperbolic(2)
    x, y = np.sinh(np.linspace(0, 6, 12)), np.linspace(0, 1, 12) ** 2
    spline = ss.CubicSpline(None, np.stack([np.sqrt(1 + x**2 + y**2), x, y], axis=-1), plane)
    spline.save("a.npz")
    printed = float(run("check a.npz").splitlines()[1].split()[2])
    starts, ends = one_sided(spline, 0)
    largest = np.linalg.norm([starts, ends], axis=-1).max()
    assert (
        printed == pytest.approx(plane.distance(ends[:-1], starts[1:]).max() / largest, rel=0.1, abs=0) and printed > 0
    )


def test_check_of_a_slight_bend_is_relative(run):
    """A small acceleration that is not rounding is measured as before."""
    p = [[np.cos(x), np.sin(x), 0] for x in (0, 0.3, 0.7, 1.2)]
    bent = ss.CubicSpline(None, ss.Sphere(2).project(np.add(p, [[0], [0], [0], [1e-9]]) * 1.0), "s:2")
    bent.save("a.npz")
    printed = float(run("check a.npz").splitlines()[1].split()[-1])
    starts, ends = one_sided(bent, 2)
    jump, largest = (np.linalg.norm(x, axis=-1).max() for x in (ends[:-1] - starts[1:], [starts, ends]))
    assert printed == pytest.approx(jump / largest, rel=0.1) and largest > 1e-10


def test_curves_with_given_velocities_are_named(fails):
    ss.HermiteSpline(None, np.eye(3), np.roll(np.eye(3), 1, axis=1), "s:2").save("hermite.npz")
    for command in ("check hermite.npz", "sample hermite.npz -n 3 -o a.csv", "plot hermite.npz -o a.png"):
        assert "hermite.npz is a HermiteSpline, whose acceleration jumps" in fails(command)
