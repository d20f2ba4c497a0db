"""Reduced bases and operators over two parameters: diffusion ν and drift c."""

import numpy as np
import pytest
from refused import raises
from scipy.linalg import orthogonal_procrustes
from scipy.sparse import diags_array

import symspline as ss
from symspline.subspaces import OperatorSpline, align, from_snapshots, reduced_operator

N, K = 60, 3
PLACES = np.linspace(0, 1, N + 2)[1:-1]
TIMES = np.linspace(0, 0.1, 30)
DIFFUSION = np.array([0.5, 0.6, 0.75, 0.9, 1.1])
DRIFT = np.array([0.0, 2.0, 3.0, 5.0])
MU = (np.array([[0.55], [0.8], [1.0]]), np.array([1.1, 4.0]))
LAPLACE = diags_array([1.0, -2.0, 1.0], offsets=[-1, 0, 1], shape=(N, N)).tocsr() * (N + 1) ** 2
SLOPE = diags_array([-1.0, 1.0], offsets=[-1, 1], shape=(N, N)).tocsr() * (N + 1) / 2


def operator(nu, c):
    return nu * LAPLACE - c * SLOPE


def snapshots(nu, c):
    values, vectors = np.linalg.eig(operator(nu, c).toarray())
    start = np.linalg.solve(vectors, np.exp(-50 * (PLACES - 0.4) ** 2))
    return ((vectors * start) @ np.exp(np.outer(values, TIMES))).real


BASES = from_snapshots([[snapshots(nu, c) for c in DRIFT] for nu in DIFFUSION], K)
# Bases as other programs return them: with random signs and rotations.
MIXED = BASES @ np.linalg.qr(np.random.default_rng(0).standard_normal((5, 4, K, K)))[0]
GRID = ss.GridSpline((DIFFUSION, DRIFT), MIXED, f"gr:{K},{N}")


def random_bases(shape, n, k, field=float, seed=0):
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((*shape, n, k))
    return np.linalg.qr(x + 1j * rng.standard_normal(x.shape) if field is complex else x)[0]


def near_bases(shape, n, k, field=float):
    """Bases of subspaces that are not far from each other, in any representation."""
    moved = random_bases((), n, k, field) + 0.3 * random_bases(shape, n, k, field, 1)
    return np.linalg.qr(moved)[0] @ random_bases(shape, k, k, field, 2)


# ---- alignment ----


@pytest.mark.parametrize("field", [float, complex])
def test_aligned_bases_are_the_nearest_ones(field):
    bases, reference = near_bases((3, 4), 9, 3, field), random_bases((), 9, 3, field)
    found = align(bases, reference)
    turns = random_bases((50,), 3, 3, field, 2)
    for index in np.ndindex(3, 4):
        assert np.allclose(found[index], bases[index] @ orthogonal_procrustes(bases[index], reference)[0], atol=1e-14)
        other = np.linalg.norm(found[index] @ turns - reference, axis=(1, 2))
        assert np.linalg.norm(found[index] - reference) < other.min()
    # The same for all bases of a subspace.
    assert np.abs(align(bases @ turns[0], reference) - found).max() < 1e-13
    assert np.abs(align(bases)[1, 1] - bases[1, 1]).max() < 1e-14


def test_missing_bases_stay_missing():
    bases = near_bases((3, 3), 6, 2)
    bases[1, 1, 0, 0] = bases[0, 2] = np.nan
    found = align(bases)
    missing = np.isnan(found).any(axis=(-2, -1))
    assert missing.sum() == 2 and missing[1, 1] and missing[0, 2]
    # The reference is the basis next to the middle.
    assert np.abs(found[0, 1] - bases[0, 1]).max() < 1e-15


def test_far_references_warn_and_orthogonal_ones_raise():
    def line(angle):
        return np.array([[np.cos(angle)], [np.sin(angle)], [0.0]])

    assert align(line(1.4), line(0)).shape == (3, 1)
    with pytest.warns(UserWarning, match=r"subspace of bases\[1\] is 86\.0° from the reference"):
        align(np.stack([line(0.3), line(np.radians(86))]), line(0))
    raises(
        r"bases\[1\] contains a direction orthogonal",
        align,
        np.stack([line(0.3), line(np.pi / 2)]),
        line(0),
        error=ss.CutLocusError,
    )


# ---- operators in interpolated bases ----


def test_operators_are_those_of_the_subspaces():
    found = reduced_operator(GRID, operator, MU)
    assert found.shape == (3, 2, K, K)
    for i, j in np.ndindex(3, 2):
        nu, c = MU[0][i, 0], MU[1][j]
        basis = align(GRID((nu, c)), MIXED[2, 1])
        assert np.allclose(found[i, j], basis.T @ operator(nu, c) @ basis, atol=1e-9)
        assert np.allclose(reduced_operator(GRID, operator, (nu, c), start=MIXED[2, 1]), found[i, j], atol=1e-9)
    # The basis at a parameter can be its own reference.
    basis = GRID((0.55, 4.0))
    alone = reduced_operator(GRID, LAPLACE, (0.55, 4.0), start=basis)
    assert np.allclose(alone, basis.T @ (LAPLACE @ basis), atol=1e-9)
    constant = reduced_operator(GRID, LAPLACE, MU)
    for same in (lambda nu, c: LAPLACE, LAPLACE.toarray().tolist()):
        assert np.abs(reduced_operator(GRID, same, MU) - constant).max() < 1e-9
    spectrum = np.linalg.eigvalsh(GRID((MU[0], MU[1])).swapaxes(-1, -2) @ LAPLACE.toarray() @ GRID(MU))
    assert np.abs(np.linalg.eigvalsh(constant) - spectrum).max() < 1e-9
    # Coordinates of scattered parameters, one pair per row.
    pairs = np.array([[0.55, 1.1], [1.0, 4.0]])
    rows = reduced_operator(GRID, operator, pairs)
    assert np.abs(rows - found[[0, 2], [0, 1]]).max() < 1e-9


@pytest.mark.parametrize("axis", [0, 1])
def test_operators_vary_smoothly(axis):
    """Value and two derivatives from both sides of a knot."""
    step, count = 2e-3 * (1 + 4 * axis), np.arange(9)
    knot = np.array([DIFFUSION[2], DRIFT[2]])
    other = [0.68, 1.3][1 - axis]
    sides = []
    for side in (-1, 1):
        x = [other, other]
        x[axis] = knot[axis] + side * step * count
        values = reduced_operator(GRID, LAPLACE, tuple(x)).reshape(9, -1)
        sides.append(np.linalg.solve(np.vander(side * count, increasing=True), values))
    size = np.abs(sides[0][0]).max()
    for order, tol in enumerate((1e-12, 1e-9, 1e-8)):
        assert np.abs(sides[0][order] - sides[1][order]).max() < tol * size


# ---- operators known at the nodes only ----


def family(u, v, field=float):
    """A smooth family of planes, and a matrix that varies."""
    x = np.stack(np.broadcast_arrays(1 + u, np.cos(2 * u + v), np.sin(v), u * v, 1 - v), axis=-1)
    y = np.stack(np.broadcast_arrays(np.sin(u), 1 + v, np.cos(u - v), u + 0 * v, 1 + u * v), axis=-1)
    bases = np.linalg.qr(np.stack([x, y + (1j * np.roll(x, 1, axis=-1) if field is complex else 0)], axis=-1))[0]
    i = np.arange(5)
    matrix = np.exp(-np.abs(i[:, None] - i) * (1 + 0.3 * (u + v)[..., None, None])) + np.eye(5)
    return bases, matrix


@pytest.mark.parametrize("field", [float, complex])
@pytest.mark.parametrize("kind", ["positive", "general"])
def test_values_are_operators_in_aligned_bases(kind, field):
    """The error falls with order 4, and at the nodes there is none."""
    errors = []
    fine = np.linspace(0, 1, 14)
    for n in (6, 11):
        u = np.linspace(0, 1, n)
        bases, matrix = family(u[:, None], u, field)
        if kind == "general":
            matrix = matrix + np.triu(np.ones((5, 5)), 1)
        mixed = bases @ random_bases((n, n), 2, 2, field)
        small = mixed.conj().swapaxes(-1, -2) @ matrix @ mixed
        spline = OperatorSpline((u, u), small, mixed, reference=bases[0, 0])
        positive = {float: ss.SymmetricPositiveDefinite(2), complex: ss.HermitianPositiveDefinite(2)}[field]
        assert (spline.spline.space == positive) == (kind == "positive")
        truth, whole = family(fine[:, None], fine, field)
        if kind == "general":
            whole = whole + np.triu(np.ones((5, 5)), 1)
        truth = align(truth, spline.reference)
        expected = truth.conj().swapaxes(-1, -2) @ whole @ truth
        found = spline((fine[:, None], fine))
        errors.append(np.abs(found - expected).max())
        at_nodes = spline((u[:, None], u))
        turned = align(mixed, spline.reference)
        assert np.abs(at_nodes - turned.conj().swapaxes(-1, -2) @ matrix @ turned).max() < 1e-12
    assert errors[1] < 3e-3 and np.log2(errors[0] / errors[1]) > 3


def test_positive_operators_stay_positive_and_missing_ones_are_nan():
    """Operators of different magnitudes with noise; one node is missing."""
    bases, rng = near_bases((5, 6), 8, 3), np.random.default_rng(3)
    sizes = 10.0 ** (np.arange(8) - 4 + rng.uniform(-0.5, 0.5, (5, 6, 8)))
    small = np.einsum("...ia,...i,...ib->...ab", bases, sizes, bases)
    small[0, 5] = np.nan
    spline = OperatorSpline((None, None), small, bases, bc_type=("natural", "not-a-knot"))
    x = np.linspace(0, 4, 9)
    values = spline((x[:, None], np.linspace(0, 5, 11)))
    missing = np.isnan(values).any(axis=(-2, -1))
    assert missing.any() and not missing[:, :8].any()
    assert np.linalg.eigvalsh(values[~missing]).min() > 0
    assert spline.spline.bc_type == ("natural", "not-a-knot")


def test_operators_in_single_precision_are_symmetric_but_for_rounding():
    bases, matrix = family(np.linspace(0, 1, 5)[:, None], np.linspace(0, 1, 4))
    narrow, scale = bases.astype(np.float32), np.float32(1e3)
    small = narrow.swapaxes(-1, -2) @ (scale * matrix.astype(np.float32)) @ narrow
    assert (small != small.swapaxes(-1, -2)).any()
    spline = OperatorSpline((None, None), small, narrow)
    assert spline.spline.space == ss.SymmetricPositiveDefinite(2)
    whole = OperatorSpline((None, None), 1e3 * bases.swapaxes(-1, -2) @ matrix @ bases, bases)
    assert np.abs(spline((1.3, 2.1)) - whole((1.3, 2.1))).max() < 1e-6 * 1e3


def test_invalid_bases_and_operators_raise():
    small, axes = np.broadcast_to(np.eye(K), (5, 4, K, K)), (DIFFUSION, DRIFT)
    sphere = ss.GridSpline((None, None), np.broadcast_to(np.eye(3)[0], (3, 3, 3)), "sphere:2")
    for match, call in [
        (r"bases must be numbers of shape \(..., n, k\)", lambda: align(np.ones((2, 3)))),
        (r"bases\[1\] must have orthonormal columns", lambda: align([[[1.0], [0.0]], [[1.0], [1.0]]])),
        ("at least one basis without NaN", lambda: align(np.full((2, 3, 1), np.nan))),
        (r"reference basis has shape \(60, 2\), but must have \(60, 3\)", lambda: align(BASES, BASES[0, 0, :, :2])),
        (r"need \(5, 4, 3, 3\): one reduced operator per basis", lambda: OperatorSpline(axes, small[0], BASES)),
        (r"operators\[0, 0\] is infinite", lambda: OperatorSpline(axes, np.inf * (1 + small), BASES)),
        ("operators must be an array of numbers", lambda: OperatorSpline(axes, small.astype(str), BASES)),
        ("or a grid on a Grassmannian, not <GridSpline", lambda: reduced_operator(sphere, np.eye(3), (0.5, 0.5))),
        (r"operator has shape \(3, 3\)", lambda: reduced_operator(GRID, np.eye(3), (0.6, 1.0))),
    ]:
        raises(match, call)
