"""Fits and curves in PyTorch alone against the compiled core, and their derivatives under PyTorch's own checks."""

import doctest
import importlib
import re
from pathlib import Path

import numpy as np
import pytest
import torch
from cases import unit_tangent, walk

import symspline as ss
from symspline.torch import curve, evaluate, fit

# PyTorch warns of its own code.
pytestmark = pytest.mark.filterwarnings("ignore:`torch.jit:FutureWarning", "ignore:`torch.jit:DeprecationWarning")

# Irregular times; the knots of the second curve differ.
T = np.array([0.0, 1.0, 2.2, 3.0, 4.1, 5.0])
KNOTS = np.stack([T, 1.3 * T - 0.1 * T**1.5])
X = np.concatenate([np.linspace(0.0, 4.0, 9), [1.0, 2.2]]).reshape(1, 11)
SPACES = ["sphere:1", "sphere:2", "sphere:3", "so:2", "so:3", "se:2", "se:3", "spd:2", "spd:3", "r:2"]


def data(name, step=0.8):
    space = ss.space(name)
    points = np.stack([walk(space, step, len(T), np.random.default_rng(i)) for i in range(2)])
    ends = np.stack([0.5 * unit_tangent(space, p[0], np.random.default_rng(2)) for p in points])
    return space, points, ends


@pytest.mark.parametrize("step", [0.8, 1.6])
@pytest.mark.parametrize("name", SPACES)
def test_fits_are_those_of_the_core(name, step):
    space, points, ends = data(name, step)
    for t, bc_type in [(T, "natural"), (KNOTS, "clamped"), (KNOTS, ((1, ends), "natural"))]:
        found = fit(t, points, space, bc_type=bc_type)
        expected = ss.CubicSpline(t, points, space, bc_type=bc_type).velocities
        np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("name", [*SPACES, "h:2", "so:3 x r:3"])
def test_curves_are_those_of_the_core(name):
    space = ss.space(name)
    names = name.split(" x ")
    points = tuple(data(own)[1] for own in names)
    points = points if len(names) > 1 else points[0]
    for t in (T, KNOTS):
        spline = ss.CubicSpline(t, points, space)
        for nu in (0, 1, 2):
            found = evaluate(t, points, spline.velocities, space, X, nu=nu)
            expected = spline(X, nu)
            for a, b in zip(*((a if len(names) > 1 else (a,)) for a in (found, expected)), strict=True):
                np.testing.assert_allclose(a, b, atol=1e-12 * max(1, np.abs(b).max()))


def test_poses_with_metres_beside_radians():
    rng = np.random.default_rng(0)
    turns = ss.rotations.from_rotation_vectors(np.cumsum(0.3 * rng.standard_normal((40, 3)), axis=0))
    poses = ss.poses.join(turns, np.cumsum(20 * rng.standard_normal((40, 3)), axis=0))
    t = np.cumsum(rng.uniform(0.2, 2, 40))
    expected = ss.CubicSpline(t, poses, "se:3").velocities
    np.testing.assert_allclose(fit(t, poses, "se:3"), expected, atol=1e-12 * np.abs(expected).max())


def check(function, s, gradients=True, **options):
    """The check of random projections of derivatives, which needs few evaluations."""
    test = torch.autograd.gradcheck if gradients else torch.autograd.gradgradcheck
    assert test(function, (s,), fast_mode=True, **options)


def small(name):
    """Three points and knots that move with two numbers, and tangent vectors at the points."""
    space = ss.space(name)
    rng = np.random.default_rng(4)
    points = walk(space, 0.6, 3, rng)
    moves = np.stack([[unit_tangent(space, p, rng) for p in points] for _ in range(2)])
    points, moves = torch.tensor(points), torch.tensor(moves)
    t = torch.tensor([0.0, 1.0, 2.3], dtype=torch.float64)
    # Points leave the manifold along straight lines.
    return space, lambda s: (t * (1 + s[0] * t), points + torch.tensordot(s, moves, 1)), moves


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "se:3", "spd:2"])
def test_first_and_second_derivatives_of_fits_pass_the_checks_of_torch(name):
    """With respect to points, knots and the velocity at the start."""
    space, moved, vectors = small(name)

    def velocities(s):
        return fit(*moved(s), space, bc_type=((1, (0.7 + s[1]) * vectors[0, 0]), "natural"))

    s = torch.tensor([0.1, -0.05], dtype=torch.float64, requires_grad=True)
    check(velocities, s, atol=1e-6, rtol=1e-6)
    check(velocities, s, gradients=False, atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "se:3", "spd:2"])
def test_first_and_second_derivatives_of_curves_pass_the_checks_of_torch(name):
    """With respect to points, velocities, knots and times, for values and their covariant derivatives."""
    space, moved, vectors = small(name)

    def values(s, nu):
        t, points = moved(s)
        x = torch.tensor([0.4, 1.9], dtype=torch.float64) + s[1]
        return evaluate(t, points, (0.7 + s[0]) * vectors[0], space, x, nu=nu)

    s = torch.tensor([0.1, -0.05], dtype=torch.float64, requires_grad=True)
    for nu in (0, 1, 2):
        check(lambda s, nu=nu: values(s, nu), s, atol=1e-6, rtol=1e-6)
    check(lambda s: values(s, 1), s, gradients=False, atol=1e-5, rtol=1e-5)


def test_forward_mode_is_available():
    space, moved, _ = small("spd:2")

    def values(s):
        t, points = moved(s)
        return evaluate(t, points, fit(t, points, space), space, [0.4, 1.9])

    s = torch.tensor([0.1, -0.05], dtype=torch.float64, requires_grad=True)
    check(values, s, check_forward_ad=True, atol=1e-6, rtol=1e-6)


@pytest.mark.parametrize("name", ["sphere:2", "so:3", "se:3", "spd:3"])
def test_equal_points_have_derivatives(name):
    """Equal points, zero velocities, and for positive definite matrices equal eigenvalues."""
    space = ss.space(name)
    one = np.eye(3) if name == "spd:3" else walk(space, 0.5, 1, np.random.default_rng(0))[0]
    rng = np.random.default_rng(1)
    moves = torch.tensor(np.stack([unit_tangent(space, one, rng) for _ in range(4)]))
    points = torch.tensor(np.stack([one] * 4))
    t = torch.tensor(T[:4])

    def number(s):
        p = points + s[0] * moves
        u = fit(t, p, space)
        return sum((evaluate(t, p, u, space, X[0, :5], nu=nu) ** 3).sum() for nu in (0, 1))

    s = torch.zeros(1, dtype=torch.float64, requires_grad=True)
    check(number, s, atol=1e-6)
    check(number, s, gradients=False, atol=1e-4)
    free = points.clone().requires_grad_()
    (fit(t, free, space) ** 3).sum().backward()
    assert torch.isfinite(free.grad).all()


def test_gradients_through_fit_and_curve_are_those_of_the_core():
    for name in ("sphere:2", "se:3", "spd:3"):
        space, points, _ = data(name)
        found = []
        for compiled in (False, True):
            p, t = torch.tensor(points, requires_grad=True), torch.tensor(T, requires_grad=True)
            x = torch.tensor(X[0], requires_grad=True)
            value = curve(x, t, p, space) if compiled else evaluate(t, p, fit(t, p, space), space, x)
            found.append(torch.autograd.grad((value**3).sum(), (p, t, x)))
        for a, b in zip(*found, strict=True):
            np.testing.assert_allclose(a, b, atol=1e-10 * float(b.abs().max()))


def test_hessians_by_transforms():
    """`torch.func` makes the same second derivatives as two backward passes."""
    space, moved, _ = small("sphere:2")

    def number(s):
        return (fit(*moved(s), space) ** 3).sum()

    s = torch.tensor([0.1, -0.05], dtype=torch.float64)
    expected = torch.autograd.functional.hessian(number, s)
    np.testing.assert_allclose(torch.func.hessian(number)(s), expected, rtol=1e-10)
    np.testing.assert_allclose(torch.func.jacrev(torch.func.jacrev(number))(s), expected, rtol=1e-10)


def test_products_single_precision_and_integers():
    poses = data("so:3")[1], data("r:3")[1]
    velocities = fit(T, poses, "so:3 x r:3")
    expected = ss.CubicSpline(T, poses, "so:3 x r:3").velocities
    for found, array in zip(velocities, expected, strict=True):
        np.testing.assert_allclose(found, array, atol=1e-12)
    points = torch.tensor(data("sphere:2")[1], dtype=torch.float32, requires_grad=True)
    value = evaluate(T, points, fit(T, points, "sphere:2"), "sphere:2", X, nu=1)
    assert value.dtype == torch.float32
    value.sum().backward()
    assert points.grad.dtype == torch.float32
    expected = ss.CubicSpline(T, data("sphere:2")[1], "sphere:2")(X, 1)
    np.testing.assert_allclose(value.detach(), expected, atol=1e-5)
    assert fit([0, 1, 2], [[0], [1], [0]], "r:1").dtype == torch.get_default_dtype()


def test_times_outside_the_knots_are_nan():
    value = evaluate([0.0, 1.0], np.eye(3)[:2], np.zeros((2, 3)), "sphere:2", [-0.1, 0.5, 1.1])
    np.testing.assert_array_equal(torch.isnan(value).all(dim=-1), [True, False, True])


def test_curves_that_do_not_converge_are_named():
    points = np.stack([np.eye(3)[[0, 1, 0]], [[1.0, 0, 0], [-1, 0, 0], [0, 1, 0]]])
    with pytest.raises(ss.ConvergenceError, match=r"of curve \(1,\)") as caught:
        fit([0.0, 0.5, 1.0], points, "sphere:2")
    assert caught.value.curve == (1,)


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: fit([0, 1], np.stack([np.eye(2)] * 2), "u:2"), "does not support u:2"),
        (lambda: fit([0, 1], [[1.0, 0, 0]] * 2, "h:2"), "does not support hyperbolic:2"),
        (lambda: evaluate([0, 1], np.ones((2, 3, 1)), np.ones((2, 3, 1)), "gr:1,3", 0.5), "does not support gr"),
        (lambda: fit([0, 1], np.eye(3), "sphere:2"), r"t has shape \(2,\)"),
        (lambda: fit([0, 1, 2], np.eye(3), "sphere:3"), r"points has shape \(3, 3\)"),
        (lambda: fit([0, 1, 2], "far", "sphere:2"), "points must be a tensor"),
        (lambda: fit(None, np.eye(3), "sphere:2"), "t must be a tensor"),
        (lambda: fit([0, 1, 2], 1j * np.eye(3), "sphere:2"), "points must be a tensor of real"),
        (lambda: fit([0, 1, 2], np.eye(3), "sphere:2", bc_type="periodic"), "bc_type must be 'natural'"),
        (lambda: fit([0, 1, 2], np.eye(3), "sphere:2", bc_type=((1, [1.0, 2]), "natural")), "start velocity has shape"),
        (lambda: evaluate([0, 1, 2], np.eye(3), np.eye(2), "sphere:2", 0.5), r"velocities has shape \(2, 2\)"),
        (lambda: evaluate([0, 1, 2], np.eye(3), np.eye(3), "sphere:2", "now"), "x must be a tensor"),
        (lambda: evaluate([0, 1, 2], np.eye(3), np.eye(3), "sphere:2", 0.5, nu=3), "nu must be"),
    ],
)
def test_invalid_arguments_raise(call, match):
    with pytest.raises(ss.ValidationError, match=match):
        call()


@pytest.mark.parametrize("module", ["", "._native"])
def test_examples_of_docstrings(module):
    assert not doctest.testmod(importlib.import_module(f"symspline.torch{module}")).failed


def test_the_example_of_the_guide():
    page = (Path(__file__).parents[2] / "docs/pytorch.md").read_text("utf-8")
    (code,) = re.findall(r"^```python\n(.*?)^```$", page, re.M | re.S)
    names = {}
    exec(code, names)
    assert names["acceleration"].shape == (100, 50, 3)
    assert torch.isfinite(names["gradient"]).all()


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
@pytest.mark.parametrize("name", SPACES)
def test_fits_on_a_gpu_are_those_of_the_core(name):
    space, points, _ = data(name)
    expected = ss.CubicSpline(T, points, space)
    for dtype, tolerance in ((torch.float64, 1e-12), (torch.float32, 2e-5)):
        t, own, x = (torch.tensor(a, dtype=dtype, device="cuda") for a in (T, points, X))
        velocities = fit(t, own, space)
        values = evaluate(t, own, velocities, space, x)
        for found, exact in ((velocities, expected.velocities), (values, expected(X))):
            assert found.device.type == "cuda" and found.dtype == dtype
            np.testing.assert_allclose(found.cpu(), exact, atol=tolerance * np.abs(exact).max())
