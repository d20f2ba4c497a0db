"""`method="fixed-point"` is Algorithm 1 of the paper: the same iterates as its literal transcription."""

from itertools import islice

import numpy as np
import pytest
from algorithm_1 import sweeps
from cases import EPS, condition, walk, zigzag
from curves import S2

import symspline as ss

# Table 1 of the paper, and parts of it.
TABLE_1 = [
    *("r:3", "sphere:2", "sphere:3", "h:2", "gr:2,5", "o:3", "so:3", "so:4"),
    *("cp:2", "rp:2", "cgr:2,4", "u:2", "su:3", "spd:3", "hpd:2"),
]


def iterate(space, p, count, ends="natural", t=None):
    """The velocities that `method="fixed-point"` has after `count` sweeps, in the units of the paper."""
    bc_type = ends if isinstance(ends, str) else ((1, 3 * ends[0]), (1, 3 * ends[1]))
    options = {"bc_type": bc_type, "method": "fixed-point", "tol": 0.0, "on_failure": "ignore"}
    return ss.CubicSpline(t, p, space, max_iter=count + 1, **options).velocities / 3


def given_ends(space, p):
    return 0.3 * space.log(p[0], p[1]), -0.4 * space.log(p[-1], p[-2])


@pytest.mark.parametrize("name", TABLE_1)
@pytest.mark.parametrize("ends", ["natural", "clamped"])
def test_every_iterate_is_that_of_the_paper(name, ends):
    space, rng = ss.space(name), np.random.default_rng(3)
    for nodes, step in ((3, 0.9), (7, 0.5), (6, 1.2)):
        p = walk(space, step, nodes, rng, turn=3.0)
        pair = "natural" if ends == "natural" else given_ends(space, p)
        tol = 1e-14 + 4 * EPS * condition(space, p)
        for count, (v, _) in enumerate(islice(sweeps(space, p, pair), 30)):
            off = space.norm(p, iterate(space, p, count, pair) - v).max()
            assert off <= tol, (nodes, step, count)


def test_number_of_sweeps_on_the_example_of_the_paper():
    # Appendix D: (1, 0, 0), (0, 1, 0), (0, 0, 1).
    def needed(tol):
        return next(k for k, (_, delta) in enumerate(sweeps(S2, np.eye(3))) if delta <= tol)

    report = ss.CubicSpline(None, np.eye(3), S2, method="fixed-point").report
    # The residual of the report is ‖δ‖ in other units; both fall by the same factor in a sweep.
    assert abs(report.iterations - needed(1e-13)) <= 8
    assert report.converged and report.rate < 0.6


@pytest.mark.parametrize("step", [1.5, 2.0, 2.5])
def test_zigzags_converge_to_the_curve_of_the_transcription(step):
    # An exact zigzag is symmetric, and its symmetric curve repels the iteration: rounding would decide where it goes.
    rng = np.random.default_rng(1)
    p = S2.project(zigzag(step) + 0.03 * rng.standard_normal((20, 3)))
    spline = ss.CubicSpline(None, p, S2, method="fixed-point")
    found = next(islice(sweeps(S2, p), spline.report.iterations - 1, None))[0]
    assert np.abs(found - spline.velocities / 3).max() <= 1e-9
    auto = ss.CubicSpline(None, p, S2)
    assert auto.bending_energy() <= spline.bending_energy() * (1 + 1e-6)


@pytest.mark.parametrize("step", [1.5, 2.0, 2.5])
def test_auto_finds_a_curve_that_bends_less_than_that_of_quasi_newton(step):
    p = zigzag(step)
    symmetric = ss.CubicSpline(None, p, S2, method="newton").bending_energy()  # by quadrature, to 1e-4
    auto = ss.CubicSpline(None, p, S2)
    assert auto.bending_energy() < 0.98 * symmetric
    assert auto.bending_energy() < auto.report.alternative_energy <= symmetric * (1 + 1e-4)


@pytest.mark.parametrize("kind", ["not-a-knot", "acceleration", "periodic"])
def test_other_ends_and_unequal_knots_converge_to_the_same_curve(kind):
    rng = np.random.default_rng(5)
    space = ss.space("so:3")
    p = walk(space, 0.5, 9, rng)
    t = np.cumsum(rng.uniform(0.5, 1.5, 9))
    bc_type = kind
    if kind == "periodic":
        p[-1] = p[0]
    if kind == "acceleration":
        bc_type = ((2, 0.4 * space.log(p[0], p[1])), (2, 0.3 * space.random_tangent(rng, p[-1])))
    one, other = (
        ss.CubicSpline(t, p, space, bc_type=bc_type, method=m) for m in ("fixed-point", "quasi-newton")
    )
    assert np.abs(one.velocities - other.velocities).max() <= 1e-11


def test_far_sets_converge_where_the_transcription_does():
    rng = np.random.default_rng(8)
    found = 0
    for name in ("sphere:2", "so:3", "cp:1", "gr:2,4"):
        space = ss.space(name)
        for _ in range(3):
            p = walk(space, 0.75 * min(space.injectivity_radius, np.pi), 6, rng, turn=100.0)
            try:
                literal = any(delta <= 1e-12 for _, delta in islice(sweeps(space, p), 400))
            except ss.ValidationError:
                continue
            if literal:
                found += 1
                spline = ss.CubicSpline(None, p, space, method="fixed-point", on_failure="ignore")
                # The limit may have a control point past the cut locus, which is another error.
                passes = np.isnan(spline.velocities).any()
                assert spline.report.converged or passes
    assert found >= 6


def test_an_undefined_logarithm_names_its_segment():
    # With v₀ = 0 and v₂ = 1 towards −p₁, the control point of the last segment is opposite to p₁ in the first sweep.
    p = np.array([[0.0, 0, 1], [1, 0, 0], [np.cos(3.0), np.sin(3.0), 0]])
    towards = np.array([-np.sin(3.0), np.cos(3.0), 0.0])
    ends = ("clamped", (1, -3 * (np.pi - 3.0) * towards))
    options = {"bc_type": ends, "method": "fixed-point", "max_iter": 1}
    with pytest.raises(ss.CutLocusError, match=r"control points between points\[1\] and points\[2\]"):
        ss.CubicSpline(None, p, S2, **options)
