"""The adapter for PyTorch, under PyTorch's own gradient checks: `make test-torch`."""

import numpy as np
import pytest
import torch
from cases import unit_tangent, walk

import symspline as ss
from symspline.torch import curve

# PyTorch's forward mode warns of itself.
pytestmark = pytest.mark.filterwarnings("ignore:`torch.jit:FutureWarning", "ignore:`torch.jit:DeprecationWarning")

X = torch.tensor([0.3, 1.7, 3.1], dtype=torch.float64)
T = torch.tensor([0.0, 1.0, 2.2, 3.0, 4.1], dtype=torch.float64)


def points_of(name, seed=0):
    return torch.tensor(walk(ss.space(name), 0.5, len(T), np.random.default_rng(seed)))


def check(function, *inputs):
    inputs = tuple(x.clone().requires_grad_() for x in inputs)
    assert torch.autograd.gradcheck(function, inputs, check_forward_ad=True, atol=1e-6, rtol=1e-6)


@pytest.mark.parametrize("bc_type", ["natural", "not-a-knot", "clamped"])
@pytest.mark.parametrize("name", ["r:2", "sphere:2", "so:3", "spd:2", "u:2"])
def test_gradients_pass_the_checks_of_torch(name, bc_type):
    check(lambda x, t, points: curve(x, t, points, name, bc_type=bc_type), X, T, points_of(name))


@pytest.mark.parametrize("order", [1, 2])
def test_vectors_at_the_ends_have_gradients(order):
    space, points = ss.Sphere(2), points_of("sphere:2")
    rng = np.random.default_rng(1)
    a, b = (torch.tensor(0.3 * unit_tangent(space, points[i].numpy(), rng)) for i in (0, -1))
    check(lambda a, b: curve(X, T, points, space, bc_type=((order, a), (order, b))), a, b)


def test_products_batches_and_single_precision():
    points = points_of("sphere:3"), points_of("r:3")
    values = curve(X, T, points, "sphere:3 x r:3")
    expected = ss.CubicSpline(T.numpy(), tuple(p.numpy() for p in points), "sphere:3 x r:3")(X.numpy())
    for value, array in zip(values, expected, strict=True):
        np.testing.assert_allclose(value, array, atol=1e-14)
    many = torch.stack([points[0], points_of("sphere:3", 1)]).float().requires_grad_()
    curve(X, T, many, "sphere:3").sum().backward()
    assert many.grad.dtype == torch.float32
    assert many.grad.shape == many.shape


def test_gradients_of_real_data_on_a_complex_space_are_real():
    points, vector = points_of("u:2"), torch.zeros((2, 2), dtype=torch.float64, requires_grad=True)
    (found,) = torch.autograd.grad(curve(X, T, points, "u:2", bc_type=("natural", (1, vector))).real.sum(), vector)
    (expected,) = torch.autograd.grad(
        curve(X, T, points, "u:2", bc_type=("natural", (1, turned := vector.to(points.dtype)))).real.sum(), turned
    )
    assert found.dtype == torch.float64
    torch.testing.assert_close(found, expected.real)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
@pytest.mark.parametrize("name", ["sphere:2", "so:3", "u:2"])
def test_values_and_gradients_stay_on_the_gpu(name):
    points, vector = points_of(name), torch.zeros(ss.space(name).point_shape, dtype=torch.float64)

    def value_and_gradients(device):
        given = [a.detach().to(device).requires_grad_() for a in (X, T, points, vector)]
        x, t, own, end = given
        value = curve(x, t, own, name, bc_type=("natural", (1, end)))
        with torch.autograd.forward_ad.dual_level():
            dual = torch.autograd.forward_ad.make_dual(own, own)
            moved = torch.autograd.forward_ad.unpack_dual(curve(x, t, dual, name)).tangent
        return value, moved, *torch.autograd.grad((value.real**3).sum(), given)

    for found, expected in zip(value_and_gradients("cuda"), value_and_gradients("cpu"), strict=True):
        assert found.device.type == "cuda"
        torch.testing.assert_close(found.cpu(), expected, rtol=0, atol=1e-14)
