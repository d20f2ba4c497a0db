"""Reduced bases over a parameter."""

import numpy as np
import pytest
from curves import points_on
from refused import raises
from scipy.sparse import diags_array

import symspline as ss
from symspline.subspaces import from_snapshots, reduced_operator

N = 60
GRID = np.linspace(0, 1, N + 2)[1:-1]
TIME = np.linspace(0, 0.1, 30)
LAPLACE = diags_array([1.0, -2.0, 1.0], offsets=[-1, 0, 1], shape=(N, N)).tocsr() * (N + 1) ** 2
PARAMETERS = np.array([0.1, 0.3, 0.4, 0.7, 1.0])
X = np.linspace(0.1, 1.0, 19)


def operator(mu):
    """Diffusion and drift."""
    drift = diags_array([-1.0, 1.0], offsets=[-1, 1], shape=(N, N)) * (N + 1) / 2
    return LAPLACE * mu + 10 * drift


def snapshots(mu):
    """Solutions of u' = A(μ)u at 30 times, through the eigenvectors of A."""
    values, vectors = np.linalg.eig(operator(mu).toarray())
    start = np.linalg.solve(vectors, np.exp(-100 * (GRID - 0.4) ** 2))
    return ((vectors * start) @ np.exp(np.outer(values, TIME))).real


EQUAL = np.stack([np.diag([3.0, 2, 1, 0]), np.diag([2.0, 1, 1, 0])])
SPHERE = ss.CubicSpline(None, np.eye(3), "sphere:2")
ALL = np.stack([snapshots(mu) for mu in PARAMETERS])


def curve(rank=4, **options):
    return ss.CubicSpline(PARAMETERS, from_snapshots(ALL, rank), f"gr:{rank},{N}", bc_type="not-a-knot", **options)


@pytest.mark.parametrize("field", [float, complex])
def test_the_best_subspace_of_its_dimension(field):
    rng = np.random.default_rng(0)
    x = rng.standard_normal((3, 8, 5)) + (1j * rng.standard_normal((3, 8, 5)) if field is complex else 0)
    basis = from_snapshots(x, 2)
    assert basis.shape == (3, 8, 2) and basis.dtype == field
    # The eigenvectors of XX*, by another solver.
    leading = np.linalg.eigh(x @ x.conj().swapaxes(1, 2))[1][..., -2:]
    assert (ss.ComplexGrassmannian(2, 8) if field is complex else ss.Grassmannian(2, 8)).distance(
        basis, leading
    ).max() < 1e-14
    # Eckart and Young: what is left is what the other singular values are.
    left = x - basis @ (basis.conj().swapaxes(1, 2) @ x)
    sizes = np.linalg.svd(x, compute_uv=False)
    assert np.abs(np.linalg.norm(left, axis=(1, 2)) - np.linalg.norm(sizes[:, 2:], axis=1)).max() < 1e-14


@pytest.mark.parametrize("energy", [0.5, 0.9, 0.999, 1 - 1e-9])
def test_enough_dimensions_for_the_energy(energy):
    basis = from_snapshots(ALL, energy=energy)
    k = basis.shape[-1]
    squares = np.linalg.svd(ALL, compute_uv=False) ** 2
    share = np.cumsum(squares, axis=1) / squares.sum(axis=1, keepdims=True)
    assert share[:, k - 1].min() >= energy - 1e-15
    assert k == 1 or share[:, k - 2].min() < energy
    assert np.array_equal(basis, from_snapshots(ALL, k))
    # Of snapshots of rank 3 three dimensions hold everything.
    assert from_snapshots(np.diag([3.0, 2.0, 1.0, 0.0, 0.0]), energy=1).shape == (5, 3)


def test_reduced_operators_vary_smoothly():
    """Value and two derivatives from both sides of a knot; those of a call of the spline jump."""
    spline = curve()
    step, k = 2e-3, np.arange(9)
    for knot in PARAMETERS[1:-1]:
        left, right = (
            np.linalg.solve(
                np.vander(side * k, increasing=True),
                reduced_operator(spline, LAPLACE, knot + side * step * k).reshape(9, -1),
            )
            for side in (-1, 1)
        )
        size = np.abs(left[0]).max()
        for order, tol in enumerate((1e-12, 1e-9, 1e-8)):
            assert np.abs(left[order] - right[order]).max() < tol * size
    before, after = (spline(np.nextafter(PARAMETERS[2], end)) for end in (0, 1))
    jump = before.T @ (LAPLACE @ before) - after.T @ (LAPLACE @ after)
    assert np.abs(jump).max() > 1e-4 * size


def test_complex_bases():
    rng = np.random.default_rng(3)
    a = rng.standard_normal((5, 5)) + 1j * rng.standard_normal((5, 5))
    spline = ss.CubicSpline(None, points_on(ss.space("cgr:2,5"), 4), "cgr:2,5")
    found, y = reduced_operator(spline, a, [0.3, 2.5]), spline.lift([0.3, 2.5])
    assert np.abs(found - np.einsum("mia,ij,mjb->mab", y.conj(), a, y)).max() < 1e-14


def test_it_does_not_depend_on_the_bases_of_the_data():
    spline = curve()
    rng = np.random.default_rng(0)
    turned = np.stack([p @ np.linalg.qr(rng.standard_normal((4, 4)))[0] for p in spline.points])
    other = ss.CubicSpline(PARAMETERS, turned, spline.space, bc_type="not-a-knot")
    found = reduced_operator(spline, operator, X)
    size = np.abs(found).max()
    assert np.abs(reduced_operator(other, operator, X, start=spline.points[0]) - found).max() < 1e-10 * size


def test_invalid_bases_raise():
    for match, call in [
        ("pass either rank, .* or energy", lambda: from_snapshots(ALL, 3, energy=0.9)),
        ("energy must be a fraction above 0 and at most 1, not 99", lambda: from_snapshots(ALL, energy=99)),
        ("rank must be at least 1", lambda: from_snapshots(ALL, 0)),
        (r"31 dimensions needs .* 31 snapshots; x has shape \(5, 60, 30\)", lambda: from_snapshots(ALL, 31)),
        ("3 dimensions needs more than 3 numbers", lambda: from_snapshots(np.eye(3), 3)),
        (r"x\[1\] does not determine .* singular values 2 and 3 are 1 and 1", lambda: from_snapshots(EQUAL, 2)),
        ("values 2 and 3 are 0 and 0", lambda: from_snapshots(np.outer([1, 2, 3.0], [1, 1, 1]) * [1, 0, 0], 2)),
        ("must contain at least one snapshot", lambda: from_snapshots(np.zeros((5, 0)), 1)),
        (
            "one curve or a grid on a Grassmannian, not <CubicSpline on Sphere",
            lambda: reduced_operator(SPHERE, np.eye(3), 0.5),
        ),
        (r"operator has shape \(59, 60\), but bases of 60", lambda: reduced_operator(curve(), np.ones((59, N)), 0.5)),
    ]:
        raises(match, call)
