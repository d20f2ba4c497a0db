"""The public conformance test: the spaces of the library pass it, and incorrect ones fail."""

import numpy as np
import pytest
from cases import SINGLE
from made import ELLIPSOID, flat, twin

import symspline as ss
from symspline.testing import check


@pytest.mark.parametrize("space", [*SINGLE, ss.Stiefel(2, 5), ss.Stiefel(3, 4)], ids=str)
def test_a_space_of_the_library_conforms(space):
    found = check(space)
    assert found.space == space and found.deviations.keys() == found.allowed.keys()
    # Far below what is allowed of spaces of others: rounding, in second differences too.
    bent = found.deviations["acceleration is continuous"]
    assert bent <= 1e-10
    rest = {law: value for law, value in found.deviations.items() if not law.startswith(("acc", "the order", "vel"))}
    assert max(rest.values()) <= 2e-11, rest
    assert "log inverts exp" in str(found)


def test_surfaces_conform():
    # Geodesics are integrated to some 1e-13.
    check(ELLIPSOID, length=0.15, tol=1e-9)


def test_a_manifold_without_random_points_needs_one():
    with pytest.raises(ss.ValidationError, match="made without project="):
        check(flat(3))
    check(flat(3), point=[1.0, 2.0, 3.0])
    with pytest.raises(ss.ValidationError, match="check each factor"):
        check("sphere:2 x r:2")


S2, SO3 = ss.Sphere(2), ss.SpecialOrthogonal(3)


def retraction(p, v):
    return S2.project(p + v)


def chord(p, q):
    return S2.project_tangent(p, q - p)


def scaled(p, q):
    return 1.001 * S2.log(p, q)


def oblique(p, u, v):
    return S2.inner(p, u, v) + 0.3 * u[..., 0] * v[..., 1]


def anisotropic(p, u, v):
    return S2.inner(p, u, v) + 0.3 * u[..., 0] * v[..., 0]


def heavy(p, u, v):
    """A rigid body with two moments of inertia, left-invariant."""
    a, b = (np.swapaxes(p, -1, -2) @ x for x in (u, v))
    return SO3.inner(p, u, v) + a[..., 0, 1] * b[..., 0, 1]


def negative(p, u, v):
    return -S2.inner(p, u, v)


def carried(p, q, w):
    return S2.transport(q, p, w)


def shortened(p, v):
    return 0.9 * S2.project_tangent(p, v)


@pytest.mark.parametrize(
    ("changes", "law"),
    [
        ({"exp": retraction}, "log inverts exp"),
        ({"log": chord}, "log inverts exp"),
        ({"log": scaled}, "log inverts exp"),
        # A retraction and its inverse are no geodesics.
        (
            {"exp": retraction, "log": lambda p, q: q / np.sum(p * q, -1, keepdims=True) - p},
            "geodesics go on as geodesics",
        ),
        ({"inner": oblique}, "inner is symmetric"),
        # Great circles are no geodesics of another metric.
        ({"inner": anisotropic}, "distance is symmetric"),
        ({"dlog": carried}, "dlog is the derivative of log"),
        ({"project_tangent": shortened}, "project_tangent is a projection"),
    ],
)
def test_broken_laws_are_reported(changes, law):
    with pytest.raises(AssertionError, match=rf"breaks the law that {law}.*: off by .*, allowed"):
        check(twin(S2, **changes))


def test_geodesics_are_those_of_the_inner_product():
    """Free rotations of such a body have no constant axis."""
    with pytest.raises(AssertionError, match="breaks the law that distance has its first variation"):
        check(twin(SO3, inner=heavy))


def test_an_inner_product_is_positive():
    with pytest.raises(ss.ValidationError, match="inner must be positive"):
        check(twin(S2, inner=negative))


def test_short_steps_are_looked_at():
    """A cut-off that takes short vectors for none is seen, and points that no spline joins break a law, too."""
    sphere = ss.Sphere(2)

    def exp(p, v):
        short = np.linalg.norm(v, axis=-1, keepdims=True) < 1e-8
        return np.where(short, p, sphere.exp(p, v))

    parts = {"project_tangent": sphere.project_tangent, "inner": sphere.inner, "project": sphere.project}
    cut = ss.Manifold(exp=exp, log=sphere.log, point_shape=(3,), injectivity_radius=np.pi, **parts)
    with pytest.raises(AssertionError, match="log inverts exp"):
        ss.testing.check(cut)
    noise = np.random.default_rng(0)

    def log(p, q):
        return sphere.project_tangent(p, sphere.log(p, q) + 1e-10 * noise.standard_normal(np.shape(p)))

    noisy = ss.Manifold(exp=sphere.exp, log=log, point_shape=(3,), injectivity_radius=np.pi, **parts)
    with pytest.raises(AssertionError, match="breaks the law that"):
        ss.testing.check(noisy, tol=1e-9)
