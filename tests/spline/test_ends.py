"""End conditions: words, vectors, closed curves, and invalid ones."""

import numpy as np
import pytest
from cases import loop_over, unit_tangent, walk
from compare import each, same, same_curve, vectors_off
from curves import KNOTS, S2, at_node, every_kind, points_on, tangents_at
from refused import INF, NAN, TWO, P, fit_error, raises

import symspline as ss


@every_kind
@loop_over(
    ("left", "right"),
    [("natural", "velocity"), ("velocity", "clamped"), ("acceleration", "not-a-knot"), ("clamped", "acceleration")],
)
def test_end_conditions_hold(space, left, right):
    p = points_on(space, step=0.5)
    conditions, bc_type = [], []
    for word, e in ((left, 0), (right, -1)):
        here = at_node(space, p, e)
        zero, vector = each(np.zeros_like, here), tangents_at(space, here)
        condition = {"natural": (2, zero), "clamped": (1, zero), "velocity": (1, vector), "acceleration": (2, vector)}
        conditions.append(condition.get(word))
        bc_type.append(word if word in ("natural", "clamped", "not-a-knot") else condition[word])
    spline = ss.CubicSpline(KNOTS, p, space, bc_type=tuple(bc_type))
    for condition, e in zip(conditions, (0, -1), strict=True):
        if condition is None:
            continue
        order, vector = condition
        here, found = at_node(space, spline.points, e), spline(KNOTS[e], nu=order)
        assert vectors_off(space, spline(KNOTS[e]), found, here, vector) < (1e-13 if order == 1 else 1e-11)


@pytest.mark.parametrize("word", ["natural", "clamped", "not-a-knot"])
def test_a_word_holds_at_both_ends(word):
    p = points_on(S2, 6)
    spline = ss.CubicSpline(KNOTS, p, S2, bc_type=word)
    assert spline.bc_type == word
    for pair in ((word, word), [word, word]):
        assert same_curve(spline, ss.CubicSpline(KNOTS, p, S2, bc_type=pair))
    default = ss.CubicSpline(KNOTS, p, S2)
    assert default.bc_type == "natural" and (default == spline) == (word == "natural")


@loop_over("shape", [(), (3,), (1,), (2, 1), (1, 3), (2, 3)])
@pytest.mark.parametrize("order", [1, 2])
def test_end_vectors_broadcast_to_the_batch(shape, order):
    p = np.array(points_on(S2, 6, (2, 3)))
    # One start for all curves, so that one vector is tangent to all.
    p[..., 0, :] = p[0, 0, 0]
    v = tangents_at(S2, np.broadcast_to(p[0, 0, 0], (*shape, 3)))
    spline = ss.CubicSpline(KNOTS, p, S2, bc_type=((order, v), "natural"))
    for i in np.ndindex(2, 3):
        own = np.broadcast_to(v, (2, 3, 3))[i]
        alone = ss.CubicSpline(KNOTS, p[i], S2, bc_type=((order, own), "natural"))
        assert same(spline.velocities[i], alone.velocities)


@pytest.mark.parametrize("part", [0.5, 0.93, 0.97, 0.995])
@pytest.mark.parametrize("method", ["auto", "fixed-point", "quasi-newton", "newton", "homotopy"])
def test_given_velocities_stay_near_the_cut_locus(method, part, rng):
    """Solvers keep the control handles that they compute a little further from it while they iterate."""
    p = walk(S2, 0.3, 5, rng)
    v = 3 * part * np.pi * unit_tangent(S2, p[0], rng)
    spline = ss.CubicSpline(None, p, S2, bc_type=((1, v), "natural"), method=method)
    assert spline.report.converged
    assert np.abs(spline.velocities[0] - v).max() <= 1e-12 * np.abs(v).max()


TANGENT, ACROSS = [0, 0.5, 0], [0.5, 0, 0]


def test_invalid_end_conditions_raise():
    for bc_type, match in [
        ("foo", r"bc_type must be 'natural', 'clamped', 'not-a-knot' or 'periodic', or a pair .*'foo'"),
        (None, r"bc_type must be .*got None"),
        (3, r"bc_type must be .*got 3"),
        (("natural",), r"bc_type must be .*got \('natural',\)"),
        (("natural",) * 3, r"bc_type must be .*got \('natural', 'natural', 'natural'\)"),
        (("natural", "foo"), r"the end is 'foo'"),
        (("periodic", "natural"), r"the start is 'periodic'"),
        ((1, TANGENT), r"the start is 1"),
        (("natural", (3, TANGENT)), r"the end is \(3, \[0, 0\.5, 0\]\)"),
        (("natural", (0, TANGENT)), r"the end is \(0, "),
        (((1,), "natural"), r"the start is \(1,\)"),
        (((1, [0, 1]), "natural"), r"the start velocity has shape \(2,\), but Sphere\(2\) needs shape"),
        (((2, 0.5), "natural"), r"the start acceleration has shape \(\), but"),
        (
            ((1, np.zeros((2, 3))), "natural"),
            r"the start velocity has shape \(2, 3\), which does not broadcast to \(3,\)",
        ),
        (((1, [0, 1j, 0]), "natural"), r"the start velocity must be an array of real numbers, not of complex128"),
        (((1, None), "natural"), r"the start velocity must be an array of numbers, not of object: it is a NoneType"),
        (("natural", (1, ["a", "b", "c"])), r"the end velocity must be an array of real numbers, not of <U1"),
        (((1, [0, NAN, 0]), "natural"), r"the start velocity contains NaN; it must be finite"),
        (("natural", (2, [0, INF, 0])), r"the end acceleration contains inf; it must be finite"),
        (
            ((1, ACROSS), "natural"),
            r"the start velocity is not tangent at its point: its normal component is 1\.000e0 .*project_tangent",
        ),
        (("natural", (2, [0, 1, 1])), r"the end acceleration is not tangent .*its normal component is 7\.071e-1"),
    ]:
        fit_error(match, bc_type=bc_type)


def test_invalid_end_conditions_of_a_batch_raise():
    for vectors, match in [
        ([TANGENT, ACROSS], r"the start velocity of curve 1 is not tangent"),
        ([TANGENT, [NAN, 0, 0]], r"the start velocity of curve 1 contains NaN"),
        (np.zeros((3, 3)), r"does not broadcast to \(2, 3\)"),
        ([[0, 1, 0], [0, 10, 0]], r"too fast for .* of curve 1|of curve 1 .*too fast"),
    ]:
        fit_error(match, None, TWO, bc_type=((1, vectors), "natural"))


def test_curves_that_are_not_closed():
    match = r"the first and the last point are 1\.571e0 apart \(allowed: 1e-8\); repeat the first point at the end"
    fit_error(match, bc_type="periodic")
    closed = [*P, P[0]]
    fit_error(r"the first and the last point of curve 1 are", None, [closed, [*P, P[1]]], bc_type="periodic")


@pytest.mark.parametrize("h, largest", [(1.0, r"9\.42477\d"), (0.5, r"18\.8495\d*")])
def test_too_fast_end_velocities(h, largest):
    t = [0, h, 2, 3 - h / 2, 3 + h / 2]
    p = S2.geodesic(P[0], P[1], np.linspace(0, 1, 5))
    match = rf"velocity has speed 20\.0+, too fast for its segment of length {h:g}: .*must stay below {largest}"
    fit_error("the start " + match, t, p, bc_type=((1, [0, 20, 0]), "natural"))
    fit_error("the end " + match, t, p, bc_type=("natural", (1, [-20, 0, 0])))


@pytest.mark.parametrize(
    ("name", "angles", "most"),
    [
        # A plane turns by its largest angle, whatever the others.
        ("gr:2,5", [1.0, 1.0], np.pi / 2),
        ("cgr:2,4", [1.0, 0.9], np.pi / 2),
        # Eigenvalues meet when their phases are 2π apart.
        ("su:3", [1.0, -1.0, 0.0], np.pi),
        ("su:3", [1.0, -0.5, -0.5], 4 * np.pi / 3),
        ("u:3", [1.0, -1.0, 0.9], np.pi),
    ],
)
def test_end_velocities_are_too_fast_from_the_cut_locus_on(name, angles, most, rng):
    space = ss.space(name)
    p = walk(space, 0.1, 4, rng)
    k = len(angles)
    if name[0] in "gc":
        u, _, w = np.linalg.svd(space.random_tangent(rng, p[0]), full_matrices=False)
        v = (u * angles) @ w
    else:
        turn = ss.Unitary(k).random_point(rng)
        v = p[0] @ (turn * (1j * np.array(angles))) @ turn.conj().T
    v = space.project_tangent(p[0], v)
    # The leg is a third of the velocity.
    ss.CubicSpline(None, p, space, bc_type=((1, 3 * 0.98 * most * v), "natural"), on_failure="ignore")
    raises(
        "too fast", ss.CubicSpline, None, p, space, bc_type=((1, 3 * 1.02 * most * v), "natural"), on_failure="ignore"
    )
