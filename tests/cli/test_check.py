"""`symspline check` accepts fitted curves and rejects perturbed ones."""

import json

import numpy as np
import pytest
from cases import SPACES, walk
from curves import points_on

import symspline as ss
from symspline.cli import main


@pytest.mark.parametrize("name", [*map(str, SPACES[::3]), "s:1", "h:5"])
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


def test_curves_with_given_velocities_are_named(fails):
    ss.HermiteSpline(None, np.eye(3), np.roll(np.eye(3), 1, axis=1), "s:2").save("hermite.npz")
    for command in ("check hermite.npz", "sample hermite.npz -n 3 -o a.csv", "plot hermite.npz -o a.png"):
        assert "hermite.npz is a HermiteSpline, whose acceleration jumps" in fails(command)
